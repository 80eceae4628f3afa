//! The bundled demo project: how its plan, its CAD and its scans are made.
//!
//! `cargo run --release --example make_demo` writes the files again; they are part of the repository so that a demo needs
//! no minute of simulation and everybody sees the same bytes.

use super::bracket::{BracketParameters, bracket};
use super::displacement::{Displacement, DisplacementField, draw_springback};
use super::files::{whole, write_scan};
use super::part::SyntheticPart;
use super::placing::PoseChoice;
use super::rig::RigModel;
use super::scan::{SimulatedScan, simulate_scan};
use super::subject::Subject;
use crate::geometry::{LengthUnit, Vector3};
use crate::io::write_stl;
use crate::plan::{Geometry, Side};
use crate::run::{Cancelled, RunContext};
use std::fmt::Write as _;
use std::io::{self, Write as _};
use std::path::Path;

/// Points a mm² in the demo's scans: small files, still good for 0.1 mm.
pub const DEMO_DENSITY_PER_MM2: f64 = 2.0;

/// The demo's scans in their order, by name. The last one is to be cut off.
pub fn demo_scans(run: &RunContext) -> Result<Vec<(&'static str, SimulatedScan)>, Cancelled> {
    let nominal = bracket(&BracketParameters::default());
    let rig = RigModel { belt_margin_mm: 15.0, ..RigModel::default().with_density(DEMO_DENSITY_PER_MM2) };
    let sunk = RigModel { belt_sink_mm: 1.05, ..rig.clone() };
    let cases = [
        ("01_good_top", everyday(1), Side::Top, &rig, 101),
        ("02_good_bottom", everyday(2), Side::Bottom, &rig, 102),
        ("03_out_of_tolerance", out_of_tolerance(&nominal), Side::Top, &rig, 103),
        ("04_flange_on_belt", everyday(4), Side::Top, &sunk, 104),
        ("05_cut_off", everyday(5), Side::Bottom, &rig, 105),
    ];
    let mut scans = Vec::new();
    for (name, (parameters, field), side, rig, seed) in cases {
        let subject = Subject::synthetic(&nominal, &bracket(&parameters), field);
        let pose = PoseChoice::side(&subject, side);
        scans.push((name, simulate_scan(&subject, rig, &pose, seed, run)?));
    }
    Ok(scans)
}

/// A good part: everyday springback, and a press's small scatter of holes and trims.
fn everyday(seed: u64) -> (BracketParameters, DisplacementField) {
    let small = 0.03 * (seed as f64 - 2.5);
    let parameters = BracketParameters {
        shifts: vec![("C01", small, -small), ("C04", -small, small), ("C02", 0.05, small)],
        diameter_changes: vec![("C03", 0.04)],
        trims: vec![("E01", 2.0 * small), ("E03", -small), ("E05", 0.08)],
        flange_angles_rad: [0.0, 0.001 * small / 0.05, -0.001],
        ..BracketParameters::default()
    };
    let bounds = bracket(&BracketParameters::default()).mesh.bounds();
    (parameters, bounds.map_or_else(DisplacementField::none, |b| draw_springback(seed, 0.12, &b)))
}

/// A bad part: hole C01 shifted by 0.6 mm, edge E03 trimmed 1.1 mm short, a dent at P08.
fn out_of_tolerance(nominal: &SyntheticPart) -> (BracketParameters, DisplacementField) {
    let (mut parameters, mut field) = everyday(3);
    parameters.shifts.push(("C01", 0.6, 0.0));
    parameters.trims.push(("E03", -1.1));
    if let Some(dented) = nominal.comparison.iter().find(|c| c.name == "P08") {
        field.0.push(Displacement::Dent {
            centre: dented.geometry.position(),
            displacement: Vector3::new(0.0, 0.0, -0.95),
            sigma_mm: 6.0,
        });
    }
    (parameters, field)
}

/// Writes `settings/demo.toml`, `assets/demo/bracket.stl` and `assets/demo/scans/` under a folder.
pub fn write_assets(folder: &Path, run: &RunContext) -> io::Result<()> {
    let scans = folder.join("assets/demo/scans");
    std::fs::create_dir_all(&scans)?;
    std::fs::create_dir_all(folder.join("settings"))?;
    let nominal = bracket(&BracketParameters::default());
    whole(&folder.join("assets/demo/bracket.stl"), |out| write_stl(out, &nominal.mesh))?;
    let text = plan_text(&nominal);
    whole(&folder.join("settings/demo.toml"), |out| out.write_all(text.as_bytes()))?;
    for (name, scan) in demo_scans(run).map_err(io::Error::other)? {
        let path = write_scan(&scans, name, &scan, LengthUnit::Mm)?;
        if name.ends_with("cut_off") {
            // In the middle of a record, as a broken copy leaves it.
            let bytes = std::fs::read(&path)?;
            whole(&path, |out| out.write_all(&bytes[..bytes.len() * 3 / 10]))?;
            std::fs::remove_file(scans.join(format!("{name}.truth.json")))?;
        }
    }
    Ok(())
}

/// The demo's plan, with a word on each setting for a newcomer.
pub fn plan_text(part: &SyntheticPart) -> String {
    let mut text = String::from(HEADER);
    for feature in &part.features {
        text.push_str(&entry("feature", &feature.name, &feature.geometry, None));
    }
    text.push_str(COMPARISON);
    for point in &part.comparison {
        text.push_str(&entry("comparison", &point.name, &point.geometry, Some((point.lower_mm, point.upper_mm))));
    }
    text.push_str(FOOTER);
    text
}

fn entry(table: &str, name: &str, geometry: &Geometry, limits: Option<(f64, f64)>) -> String {
    let place = |v: &[f64]| numbers(v, 4);
    let unit = |v: &[f64]| numbers(v, 9);
    let mut text = format!("\n[[{table}]]\nname = \"{name}\"\nkind = \"{}\"\n", geometry.kind());
    let mut line =
        |key: &str, value: String| writeln!(text, "{key} = {value}").expect("writing to a string cannot fail");
    let centre = if table == "feature" { "centre" } else { "position" };
    match geometry {
        Geometry::Hole { centre: at, axis, diameter_mm, direction } => {
            line(centre, place(at.coords.as_slice()));
            line("axis", unit(axis.as_slice()));
            if let Some(direction) = direction {
                line("direction", unit(direction.as_slice()));
            }
            line("diameter_mm", format!("{diameter_mm:?}"));
        }
        Geometry::Slot { centre: at, axis, direction, length_mm, width_mm } => {
            line(centre, place(at.coords.as_slice()));
            line("axis", unit(axis.as_slice()));
            line("direction", unit(direction.as_slice()));
            line("length_mm", format!("{length_mm:?}"));
            line("width_mm", format!("{width_mm:?}"));
        }
        Geometry::Surface { position, direction } => {
            line("position", place(position.coords.as_slice()));
            line("direction", unit(direction.as_slice()));
        }
        Geometry::Edge { position, direction, normal } => {
            line("position", place(position.coords.as_slice()));
            line("direction", unit(direction.as_slice()));
            line("normal", unit(normal.as_slice()));
        }
    }
    if let Some((lower, upper)) = limits {
        line("lower_mm", format!("{lower:?}"));
        line("upper_mm", format!("{upper:?}"));
    }
    text
}

/// A TOML array with so many decimals, trailing zeros left out.
fn numbers(values: &[f64], decimals: usize) -> String {
    let one = |v: &f64| {
        let text = format!("{v:.decimals$}");
        let short = text.trim_end_matches('0');
        let short = if short.ends_with('.') { format!("{short}0") } else { short.to_owned() };
        if short == "-0.0" { "0.0".to_owned() } else { short }
    };
    format!("[{}]", values.iter().map(one).collect::<Vec<_>>().join(", "))
}

const HEADER: &str = r#"# Inspection plan of the bundled demo part. Lengths are millimetres, angles degrees; paths start at this file's folder.
# Try:  shapeline run settings/demo.toml        Change a tolerance below and run it again.
schema = 1

[part]
name = "Bracket RH"
number = "4711-02"
revision = "C"
thickness_mm = 1.2            # of the sheet; a part seen from below is compared with the face one thickness behind the CAD
decision = "iso14253"         # the uncertainty is taken off the tolerance before a point passes or fails; or "plain"
cad_side = "top"              # the CAD is the upper face of the sheet, its material lies behind it

[cad]
file = "../assets/demo/bracket.stl"
unit = "mm"

[scans]
folder = "../assets/demo/scans"
pattern = "*.ply"
unit = "mm"
order = "name"
view_direction = [0.0, 0.0, 1.0]   # where the camera looks, in the coordinates of the scans

[background]
belt_plane = true                  # what lies on the conveyor belt or below it is not part
belt_colours = [[58, 74, 69]]      # dark green rubber where it is not worn

# Deviations refer to a hole, a slot and a surface point: the hole's centre is put on its nominal place, the line from there
# to the slot's centre is turned onto its nominal direction, and the part is turned about that line until the surface point
# lies at its nominal height.
[alignment]
method = "features"
hole = "H1"
slot = "S1"
point = "A1"
"#;

const COMPARISON: &str =
    "\n# What is compared. A deviation is positive along `direction`; the limits are the tolerance.\n";

const FOOTER: &str = r#"
# The measuring system: four cameras at 600 mm, as `shapeline simulate` uses it. Only every thirteenth of its points is in the demo's scans.
[rig]
distance_mm = 600.0
base_mm = 200.0
focal_mm = 35.0
pixel_um = 4.88
image_accuracy_px = 0.3
resolution_level = 2
point_spacing_mm = 0.6

[output]
folder = "results"
formats = ["ascii", "json", "pdf"]
map_range_mm = 1.0                 # colours from -1 mm (blue) to +1 mm (red)
"#;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plan_is_read_without_a_problem_and_says_what_the_part_is() {
        let nominal = bracket(&BracketParameters::default());
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("settings/demo.toml");
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(text, plan_text(&nominal), "write the demo again: cargo run --release --example make_demo");
        let loaded = crate::plan::load(&path);
        assert!(loaded.problems.is_empty(), "{:?}", loaded.problems);
        let plan = loaded.plan.unwrap();
        assert_eq!(plan.comparison.len(), 26);
        for (read, known) in plan.comparison.iter().zip(&nominal.comparison) {
            assert!((read.geometry.position() - known.geometry.position()).norm() < 1e-4, "{}", known.name);
            assert!((read.geometry.sheet_normal() - known.geometry.sheet_normal()).norm() < 1e-8, "{}", known.name);
        }
    }
}
