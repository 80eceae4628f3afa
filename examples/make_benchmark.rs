//! Writes the benchmark project: the demo part with 184,000 triangles and scans of two million points, or of so many millions.
//! `cargo run --release --example make_benchmark FOLDER [SCANS [MILLIONS]]`, then `shapeline run FOLDER/plan.toml --timings FILE`.

use shapeline::geometry::LengthUnit;
use shapeline::io::write_stl;
use shapeline::plan::Side;
use shapeline::run::RunContext;
use shapeline::simulate::bracket::BENCHMARK_SPACING_MM;
use shapeline::simulate::{
    BracketParameters, PoseChoice, RigModel, Subject, bracket, demo, draw_springback, simulate_scan, write_scan,
};
use std::error::Error;
use std::fs;
use std::path::PathBuf;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args_os().skip(1);
    let folder = PathBuf::from(arguments.next().ok_or("give a folder")?);
    let count: u64 = arguments.next().map_or(Ok(1), |n| n.to_string_lossy().parse())?;
    let millions: f64 = arguments.next().map_or(Ok(2.0), |n| n.to_string_lossy().parse())?;
    let scans = folder.join("scans");
    fs::create_dir_all(&scans)?;
    let part = bracket(&BracketParameters { spacing_mm: BENCHMARK_SPACING_MM, ..BracketParameters::default() });
    fs::write(folder.join("plan.toml"), demo::plan_text(&part).replace("../assets/demo/", ""))?;
    let mut stl = Vec::new();
    write_stl(&mut stl, &part.mesh)?;
    fs::write(folder.join("bracket.stl"), stl)?;
    let bounds = part.mesh.bounds().ok_or("an empty part")?;
    // Enough belt around the part for two million points in all; more lie closer to each other.
    let paper = RigModel { belt_margin_mm: 40.0, ..RigModel::default() };
    let rig = RigModel { density_per_mm2: paper.density_per_mm2 * millions / 2.0, ..paper };
    for index in 0..count {
        let subject = Subject::synthetic(&part, &part, draw_springback(index, 0.2, &bounds));
        let side = if index % 2 == 0 { Side::Top } else { Side::Bottom };
        let pose = PoseChoice::side(&subject, side);
        let scan = simulate_scan(&subject, &rig, &pose, 7000 + index, &RunContext::silent())?;
        write_scan(&scans, &format!("{:04}", index + 1), &scan, LengthUnit::Mm)?;
    }
    Ok(())
}
