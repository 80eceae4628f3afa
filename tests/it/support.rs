//! What several themes need.

use shapeline::geometry::PointCloud;
use shapeline::inspect::{Identity, Inspected, inspect};
use shapeline::part::{Part, PartSettings};
use shapeline::plan::{CadSide, Plan};
use shapeline::run::RunContext;
use shapeline::simulate::SyntheticPart;

/// A synthetic part as CAD.
pub fn prepared(nominal: &SyntheticPart) -> Part {
    let settings =
        PartSettings { cad_side: CadSide::Top, thickness_mm: nominal.thickness_mm, plan_directions: Vec::new() };
    Part::prepare(nominal.mesh.clone(), "0".repeat(64), &settings, &RunContext::silent()).expect("a sound part")
}

/// An identity for scans that come from no file.
pub fn identity() -> Identity {
    Identity {
        part_name: "simulated".into(),
        part_number: String::new(),
        part_revision: String::new(),
        plan_file: "plan.toml".into(),
        plan_sha256: "0".repeat(64),
        cad_file: "part.stl".into(),
        cad_sha256: "0".repeat(64),
        cad_triangles: 0,
        scan_file: "scan.ply".into(),
        scan_sha256: None,
        scan_taken: None,
    }
}

/// The pipeline on a cloud.
pub fn inspect_scan(plan: &Plan, part: &Part, cloud: PointCloud, identity: Identity) -> Inspected {
    inspect(plan, part, cloud, identity, &RunContext::silent()).expect("nobody cancels")
}
