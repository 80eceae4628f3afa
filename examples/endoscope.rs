//! Writes simulated views of an endoscope for `shapeline merge`, with their truth: `cargo run --release --example endoscope -- DIR [SUBJECT] [SEED]`.
//!
//! SUBJECT is `cylinder` (two views, µm; taken when none is named), `pin` (six views of it and one of something else), `plane`, `sphere` or `part` (100 views of the demo part, mm, their prior poses off by
//! 0.5 mm and 1 degree, and two views of another part among them).

use shapeline::run::RunContext;
use shapeline::simulate::endoscope::{PriorError, Scene, write_dataset};
use std::error::Error;
use std::io::Write;
use std::path::PathBuf;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().map(PathBuf::from).ok_or("expected: DIR [cylinder|pin|plane|sphere|part] [SEED]")?;
    let subject = arguments.next().unwrap_or_else(|| "cylinder".into());
    let seed = arguments.next().map_or(Ok(1), |seed| seed.parse())?;
    // A linear stage knows where it is to some µm; what the hand or a robot holds is further off.
    let stage = PriorError { shift: 20.0, turn_rad: 0.1f64.to_radians() };
    let robot = PriorError { shift: 0.5, turn_rad: 1f64.to_radians() };
    let scene = match subject.as_str() {
        "cylinder" => Scene::cylinder(stage, seed),
        "pin" => Scene::pin(stage, seed),
        "plane" => Scene::plane(stage, seed),
        "sphere" => Scene::sphere(stage, seed),
        "part" => Scene::part(100, 2, robot, seed),
        other => return Err(format!("found {other}, expected cylinder, pin, plane, sphere or part").into()),
    };
    let written = write_dataset(&folder, &scene, &RunContext::silent())?;
    let merge = written.merge.display();
    writeln!(std::io::stdout(), "{} views, {} points: shapeline merge {merge}", written.views, written.points)?;
    Ok(())
}
