//! Scans as files, each with its truth beside it; and the `simulate` command.

use super::displacement::{DisplacementField, draw_springback};
use super::drawn::Drawn;
use super::placing::PoseChoice;
use super::rig::RigModel;
use super::scan::{SimulatedScan, simulate_scan};
use super::subject::Subject;
use crate::diagnostic::{Diagnostic, ReadError};
use crate::geometry::{LengthUnit, Point3};
use crate::io::write_ply_cloud;
use crate::part::Part;
use crate::plan::{Plan, Side};
use crate::run::{Cancelled, RunContext};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Springback and twist of simulated parts at their ends, of this order.
pub const EVERYDAY_SPRINGBACK_MM: f64 = 0.3;

/// Writes `NAME.ply` (binary, positions in `unit`, colours) and `NAME.truth.json` into a folder, each whole or not at all.
/// Returns the path of the scan.
pub fn write_scan(folder: &Path, name: &str, scan: &SimulatedScan, unit: LengthUnit) -> io::Result<PathBuf> {
    let scale = 1.0 / unit.in_mm();
    let positions: Vec<Point3> = scan.cloud.positions.iter().map(|p| p * scale).collect();
    let path = folder.join(format!("{name}.ply"));
    whole(&path, |out| write_ply_cloud(out, &positions, unit, scan.cloud.colours.as_deref(), None, &[]))?;
    let mut truth = serde_json::to_string_pretty(&scan.truth)?;
    truth.push('\n');
    whole(&folder.join(format!("{name}.truth.json")), |out| out.write_all(truth.as_bytes()))?;
    Ok(path)
}

/// Writes a file beside its place first, then moves it there.
pub(super) fn whole(path: &Path, write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> io::Result<()> {
    let mut beside = path.as_os_str().to_owned();
    beside.push(".part");
    let mut out = BufWriter::new(File::create(&beside)?);
    let written = write(&mut out).and_then(|()| out.flush()).and_then(|()| std::fs::rename(&beside, path));
    if written.is_err() {
        // The fault is told; a leftover that cannot be removed either would only hide it.
        let _ = std::fs::remove_file(&beside);
    }
    written
}

/// Scans of a plan's part: the plan's CAD with springback and twist, either side up, anywhere on the belt, with the errors that
/// the plan's `[uncertainty]` states drawn for each.
#[derive(Debug, Clone)]
pub struct Series<'a> {
    /// The plan.
    pub plan: &'a Plan,
    /// Its CAD.
    pub part: &'a Part,
    /// What measures it.
    pub rig: RigModel,
    /// Springback and twist at the ends are of this order; 0: the part as it should be.
    pub springback_mm: f64,
    /// The same seed gives the same scans.
    pub seed: u64,
}

impl<'a> Series<'a> {
    /// With the plan's rig and everyday springback.
    pub fn of_plan(plan: &'a Plan, part: &'a Part, seed: u64) -> Self {
        Self { plan, part, rig: RigModel::of_plan(plan), springback_mm: EVERYDAY_SPRINGBACK_MM, seed }
    }

    /// Scan number `index` (from 0). What the series is, and the index, alone decide what comes out.
    pub fn scan(&self, index: u64, run: &RunContext) -> Result<SimulatedScan, Cancelled> {
        let seed = one_of_series(self.seed, index);
        let field = if self.springback_mm > 0.0 {
            draw_springback(seed, self.springback_mm, &self.part.bounds)
        } else {
            DisplacementField::none()
        };
        let drawn = Drawn::of_plan(self.plan, seed);
        let thickness_mm = drawn.map_or(self.plan.part.thickness_mm, |d| d.thickness_mm);
        let subject = Subject::of_thickness(self.plan, self.part, field, thickness_mm);
        let side = if seed & 1 == 0 { Side::Top } else { Side::Bottom };
        let resting = self.part.resting_poses.iter().find(|p| p.side == side);
        let mut pose = PoseChoice::side(&subject, side);
        if let Some(resting) = resting {
            pose.up_cad = resting.up_cad;
        }
        let rig = drawn.map_or_else(|| self.rig.clone(), |d| d.rig(&self.rig));
        let mut scan = simulate_scan(&subject, &rig, &pose, seed, run)?;
        scan.truth.drawn = drawn;
        Ok(scan)
    }
}

/// `shapeline simulate`: writes `count` scans into a folder (made if need be) as `sim_0001.ply` and on, and tells each one
/// as it is written.
pub fn simulate_series(
    plan: &Plan,
    part: &Part,
    folder: &Path,
    count: u64,
    seed: u64,
    run: &RunContext,
    mut written: impl FnMut(&Path, &SimulatedScan),
) -> Result<(), ReadError> {
    let cannot = |e: io::Error| {
        let message = format!("cannot be written: {e}");
        Diagnostic::error(message).in_file(folder).with_help("give another folder with --out")
    };
    std::fs::create_dir_all(folder).map_err(cannot)?;
    let series = Series::of_plan(plan, part, seed);
    for index in 0..count {
        let scan = series.scan(index, run)?;
        let path = write_scan(folder, &format!("sim_{:04}", index + 1), &scan, plan.scans.unit).map_err(cannot)?;
        written(&path, &scan);
    }
    Ok(())
}

/// Seeds of a series that have nothing to do with each other (the finaliser of SplitMix64).
fn one_of_series(seed: u64, index: u64) -> u64 {
    let mut z = seed.wrapping_add(index.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::part::PartSettings;
    use crate::simulate::{ScanTruth, rail};

    #[test]
    fn a_series_of_a_plan_is_written_with_its_truth() {
        let rail = rail();
        let mut plan = rail.plan();
        plan.scans.unit = LengthUnit::Cm;
        let settings = PartSettings { cad_side: plan.part.cad_side, thickness_mm: 1.0, plan_directions: Vec::new() };
        let silent = RunContext::silent();
        let part = Part::prepare(rail.mesh.clone(), String::new(), &settings, &silent).unwrap();
        plan.rig = Some(crate::plan::Rig {
            distance_mm: 600.0,
            base_mm: 200.0,
            focal_mm: 35.0,
            pixel_um: 4.88,
            image_accuracy_px: 0.3,
            resolution_level: 5,
            point_spacing_mm: None,
        });
        let folder = tempfile::tempdir().unwrap();
        let mut names = Vec::new();
        simulate_series(&plan, &part, folder.path(), 2, 11, &silent, |path, _| names.push(path.to_path_buf())).unwrap();
        assert_eq!(names.len(), 2);
        for path in names {
            let bytes = std::fs::read(&path).unwrap();
            let cloud = crate::io::read_cloud(&bytes, &path, LengthUnit::Cm, &silent).unwrap();
            let text = std::fs::read_to_string(path.with_extension("truth.json")).unwrap();
            let truth: ScanTruth = serde_json::from_str(&text).unwrap();
            let pose = truth.pose().unwrap();
            // On the belt, about 600 mm in front of the camera, in the file's unit and back.
            assert!(cloud.positions.iter().filter(|p| (p.z - 600.0).abs() < 30.0).count() * 10 > cloud.len() * 9);
            let near = cloud.positions.iter().filter(|p| pose.point(p).coords.norm() < 60.0).count();
            assert!(near > 100 && truth.points.iter().all(|p| p.aligned.is_some()), "{near} {truth:?}");
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 4);
    }
}
