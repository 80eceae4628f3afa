//! What several themes need.

use shapeline::geometry::{CadFromScan, Point3, PointCloud, Vector3};
use shapeline::inspect::{Identity, Inspected, inspect};
use shapeline::measure::Local;
use shapeline::part::{Part, PartSettings};
use shapeline::plan::{CadSide, Plan, Side, UncertaintySettings};
use shapeline::run::RunContext;
use shapeline::scan::{ConditionedScan, PointClass, PointGrid, Removed};
use shapeline::simulate::scan::Label;
use shapeline::simulate::{RigModel, SimulatedScan, SyntheticPart};
use std::sync::LazyLock;

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

/// Belt removed by its label, everything else kept: what the background filters leave in the best case.
pub fn conditioned(scan: SimulatedScan, rig: &RigModel) -> ConditionedScan {
    let kept: Vec<u32> = (0..scan.labels.len() as u32).filter(|&i| scan.labels[i as usize] != Label::Belt).collect();
    let classes = scan.labels.iter().map(|l| if *l == Label::Belt { PointClass::Belt } else { PointClass::Kept });
    let classes = classes.collect();
    ConditionedScan {
        classes,
        cloud: scan.cloud,
        kept,
        removed: Removed::default(),
        belt: None,
        belt_clearance_mm: None,
        to_camera: Some(-rig.view_direction),
        spacing_mm: rig.density_per_mm2.sqrt().recip(),
        warnings: Vec::new(),
    }
}

/// Points of a sheet seen from above (z), all of them kept.
pub fn seen_from_above(positions: Vec<Point3>, spacing_mm: f64) -> ConditionedScan {
    ConditionedScan {
        classes: vec![PointClass::Kept; positions.len()],
        kept: (0..positions.len() as u32).collect(),
        cloud: PointCloud { positions, ..PointCloud::default() },
        removed: Removed::default(),
        belt: None,
        belt_clearance_mm: None,
        to_camera: Some(Vector3::z_axis()),
        spacing_mm,
        warnings: Vec::new(),
    }
}

/// What is measured in a scan in a pose that is known, nothing calibrated and nothing known of the system.
pub fn local<'a>(
    part: &'a Part,
    side: Side,
    scan: &'a ConditionedScan,
    grid: &'a PointGrid,
    cad_from_scan: CadFromScan,
) -> Local<'a> {
    static NOTHING: LazyLock<UncertaintySettings> = LazyLock::new(UncertaintySettings::default);
    Local { part, face: part.face(side), scan, grid, cad_from_scan, uncertainty: &NOTHING }
}
