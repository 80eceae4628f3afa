//! What can be told of a CAD and of a scan before there is a plan: for who makes one.

use super::examine::{cad_as_scan, prepare_cad};
use crate::diagnostic::{Diagnostic, ReadError, Stop};
use crate::geometry::LengthUnit;
use crate::io;
use crate::io::unit_guard::{check_raw_scale, robust_diagonal_mm};
use crate::part::{Part, PartSettings};
use crate::plan::{BackgroundSettings, CadSettings, CadSide, Side};
use crate::run::{RunContext, Stage};
use crate::scan::{ConditionedScan, ScanHints, condition};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// All units, in the order in which they are tried.
pub const UNITS: [LengthUnit; 5] = [LengthUnit::Mm, LengthUnit::Inch, LengthUnit::M, LengthUnit::Cm, LengthUnit::Um];

/// Diagonals of stamped parts, mm: from a clip to the side of a van.
const PARTS_MM: [f64; 2] = [20.0, 6000.0];

/// A CAD as it was found.
#[derive(Debug, Clone)]
pub struct CadLook {
    /// The file.
    pub path: PathBuf,
    /// The unit in which it was read.
    pub unit: LengthUnit,
    /// Prepared as a solid where it is one, else as one face of a sheet of no thickness.
    pub part: Arc<Part>,
    /// Of a solid: how thick its sheet is, mm.
    pub thickness_mm: Option<f64>,
}

impl CadLook {
    /// Side lengths of its box, mm.
    pub fn size_mm(&self) -> [f64; 3] {
        self.part.bounds.extents().into()
    }

    /// Side lengths of its box if its file were in another unit, mm.
    pub fn size_in(&self, unit: LengthUnit) -> [f64; 3] {
        self.size_mm().map(|side| side * unit.in_mm() / self.unit.in_mm())
    }

    /// How many trimmed edges and rims it has.
    pub fn edges(&self) -> usize {
        self.part.face(Side::Top).boundary_loops.len()
    }
}

/// The unit in which a part of that diagonal, if it were mm, has the size of a stamped part; mm where none has.
pub fn guess_unit(diagonal_as_mm: f64) -> LengthUnit {
    let fits = |unit: &LengthUnit| {
        let diagonal = diagonal_as_mm * unit.in_mm();
        (PARTS_MM[0]..=PARTS_MM[1]).contains(&diagonal)
    };
    UNITS.into_iter().find(fits).unwrap_or(LengthUnit::Mm)
}

/// Reads and prepares a CAD file. Without a unit, the likely one is taken by its size.
///
/// # Errors
/// What is wrong with the file; cancelled.
pub fn look_at_cad(path: &Path, unit: Option<LengthUnit>, run: &RunContext) -> Result<CadLook, ReadError> {
    let prepare = |unit: LengthUnit, cad_side: CadSide| {
        let file = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let cad = CadSettings { file, path: path.to_path_buf(), unit };
        let settings = PartSettings { cad_side, thickness_mm: 0.0, plan_directions: Vec::new() };
        prepare_cad(&cad, &settings, None, run).map(|(part, _)| part)
    };
    let unit = match unit {
        Some(unit) => unit,
        None => {
            run.enter(Stage::Read)?;
            let bytes = io::read_file(path)?;
            // Read in millimetres; a CAD that has no part's size in that unit may still have it in another.
            let mesh = io::read_mesh(&bytes, path, LengthUnit::Mm, run)?;
            guess_unit(mesh.bounds().map_or(0.0, |b| b.diagonal()))
        }
    };
    let sheet = prepare(unit, CadSide::Top)?;
    let closed = sheet.face(Side::Top).boundary_loops.is_empty();
    let solid = if closed { prepare(unit, CadSide::Solid) } else { Ok(sheet.clone()) };
    let (part, thickness_mm) = match solid {
        Ok(solid) if closed && solid.thickness_mm > 0.0 => {
            let thickness_mm = solid.thickness_mm;
            (solid, Some(thickness_mm))
        }
        Err(ReadError::Cancelled(cancelled)) => return Err(cancelled.into()),
        // A closed surface that is no sheet is shown as it is; step by step its side is asked for.
        Ok(_) | Err(_) => (sheet, None),
    };
    Ok(CadLook { path: path.to_path_buf(), unit, part: Arc::new(part), thickness_mm })
}

/// A scan as it was found.
#[derive(Debug, Clone)]
pub struct ScanLook {
    /// The file.
    pub path: PathBuf,
    /// The unit in which it was read.
    pub unit: LengthUnit,
    /// Its points with their classes, scan frame, mm.
    pub scan: Arc<ConditionedScan>,
    /// Points of the file, with those that are no numbers.
    pub points: usize,
    /// Diagonal of what is taken for the part, mm; strays do not count.
    pub part_mm: Option<f64>,
    /// What speaks against this unit, in words with what to do.
    pub doubt: Option<String>,
}

/// Reads a scan and removes its background with the default settings of a plan. `part` tells its size; without a unit the one is taken
/// in which the scan has that size.
///
/// # Errors
/// What is wrong with the file, or why nothing of it can be a part; cancelled.
pub fn look_at_scan(
    path: &Path,
    unit: Option<LengthUnit>,
    part: &Part,
    run: &RunContext,
) -> Result<ScanLook, ReadError> {
    run.enter(Stage::Read)?;
    let bytes = io::read_file(path)?;
    if io::sha256_of(&bytes, run)? == part.cad_sha256 {
        let refusal = cad_as_scan();
        return Err(Diagnostic::error(refusal.reason).in_file(path).with_help(refusal.help).into());
    }
    let mut unit_read = unit.unwrap_or(LengthUnit::Mm);
    let mut cloud = io::read_cloud(&bytes, path, unit_read, run)?;
    let suspicion = check_raw_scale(&cloud.positions, part.diagonal_mm());
    if let (None, Some(found)) = (unit, &suspicion)
        && let Some(other) = unit_of_factor(found.factor)
    {
        unit_read = other;
        cloud = io::read_cloud(&bytes, path, other, run)?;
    }
    drop(bytes);
    let doubt = check_raw_scale(&cloud.positions, part.diagonal_mm());
    let points = cloud.len() + cloud.skipped_invalid;
    run.enter(Stage::Background)?;
    let extents = part.bounds.extents();
    let hints = ScanHints {
        view_direction: None,
        part_extents_mm: [extents.x, extents.y, extents.z],
        part_area_mm2: part.face(Side::Top).mesh.area(),
        thickness_mm: part.thickness_mm,
    };
    let scan = condition(cloud, &BackgroundSettings::default(), &hints, run).map_err(|stop| match stop {
        Stop::Cancelled(cancelled) => ReadError::Cancelled(cancelled),
        Stop::Refused(refusal) => Diagnostic::error(refusal.reason).in_file(path).with_help(refusal.help).into(),
    })?;
    let part_mm = robust_diagonal_mm(&scan.cloud.positions, &scan.kept);
    let doubt = doubt.map(|found| format!("{}; {}", found.words, found.help));
    Ok(ScanLook { path: path.to_path_buf(), unit: unit_read, scan: Arc::new(scan), points, part_mm, doubt })
}

/// The unit of a scan that, read as millimetres, has that factor to its part.
fn unit_of_factor(factor: f64) -> Option<LengthUnit> {
    let off = |unit: &LengthUnit| (factor * unit.in_mm()).ln().abs();
    UNITS.into_iter().find(|unit| *unit != LengthUnit::Mm && off(unit) < 1e-6)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::CancelToken;
    use std::fs;

    fn demo(name: &str) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/demo").join(name)
    }

    #[test]
    fn a_unit_is_guessed_by_the_size_of_a_part() {
        let all =
            [(300.0, LengthUnit::Mm), (0.3, LengthUnit::M), (12.0, LengthUnit::Inch), (250_000.0, LengthUnit::Um)];
        for (diagonal, unit) in all {
            assert_eq!(guess_unit(diagonal), unit, "{diagonal}");
        }
        // Nothing that any unit explains.
        assert_eq!([guess_unit(0.0), guess_unit(f64::NAN), guess_unit(1e12)], [LengthUnit::Mm; 3]);
    }

    #[test]
    fn the_demos_cad_and_scan_are_what_their_truth_says() {
        let run = RunContext::silent();
        let cad = look_at_cad(&demo("bracket.stl"), None, &run).unwrap();
        assert_eq!((cad.unit, cad.thickness_mm), (LengthUnit::Mm, None));
        let metres = cad.size_in(LengthUnit::M);
        assert!((metres[0] - 1000.0 * cad.size_mm()[0]).abs() < 1e-6);
        let scan = look_at_scan(&demo("scans/01_good_top.ply"), None, &cad.part, &run).unwrap();
        assert!(scan.scan.belt.is_some() && scan.doubt.is_none() && scan.points == scan.scan.cloud.len());
        // One side of the part is seen, tilted by its resting: most of its diagonal.
        let share = scan.part_mm.unwrap() / cad.part.diagonal_mm();
        assert!((0.85..1.1).contains(&share), "{share}");
    }

    /// The same scan written in metres is read in metres, as nobody said.
    #[test]
    fn a_scan_in_another_unit_is_told_by_its_size() {
        let run = RunContext::silent();
        let cad = look_at_cad(&demo("bracket.stl"), None, &run).unwrap();
        let read = look_at_scan(&demo("scans/01_good_top.ply"), None, &cad.part, &run).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("metres.xyz");
        let points = read.scan.cloud.positions.iter().step_by(3);
        let text: String = points.map(|p| format!("{} {} {}\n", 1e-3 * p.x, 1e-3 * p.y, 1e-3 * p.z)).collect();
        fs::write(&path, text).unwrap();
        let told = look_at_scan(&path, None, &cad.part, &run).unwrap();
        assert_eq!((told.unit, told.doubt), (LengthUnit::M, None));
        let told = look_at_scan(&path, Some(LengthUnit::Mm), &cad.part, &run);
        // Taken for millimetres it is 0.3 mm across: refused, or doubted.
        assert!(told.map_or(true, |look| look.doubt.is_some()));
    }

    #[test]
    fn a_solid_tells_its_thickness() {
        let run = RunContext::silent();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("plate.stl");
        let corners: Vec<crate::geometry::Point3> = (0..8)
            .map(|k| crate::geometry::Point3::new([0.0, 90.0][k & 1], [0.0, 60.0][k >> 1 & 1], [0.0, 1.5][k >> 2]))
            .collect();
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
        let mut stl = Vec::new();
        io::write_stl(&mut stl, &crate::geometry::Mesh { vertices: corners, triangles }).unwrap();
        fs::write(&path, stl).unwrap();
        let told = look_at_cad(&path, None, &run).unwrap();
        // Written as float32: 1.5 is exact.
        assert!((told.thickness_mm.unwrap() - 1.5).abs() < 1e-9, "{:?}", told.thickness_mm);
        assert_eq!(told.part.cad_side, CadSide::Solid);
    }

    #[test]
    fn the_cad_is_no_scan_of_itself() {
        let run = RunContext::silent();
        let folder = tempfile::tempdir().unwrap();
        let [cad, copy] = ["cad.ply", "scan.ply"].map(|name| folder.path().join(name));
        let text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
                    element face 2\nproperty list uchar int vertex_indices\nend_header\n\
                    0 0 0\n90 0 0\n90 60 0\n0 60 0\n3 0 1 2\n3 0 2 3\n";
        fs::write(&cad, text).unwrap();
        fs::write(&copy, text).unwrap();
        assert!(io::ply_has_faces(&cad) && !io::ply_has_faces(&demo("scans/01_good_top.ply")));
        let look = look_at_cad(&cad, None, &run).unwrap();
        let Err(ReadError::Bad(told)) = look_at_scan(&copy, None, &look.part, &run) else { panic!("it is refused") };
        assert!(told.message.contains("the content of the CAD file"), "{told}");
    }

    #[test]
    fn a_file_that_is_none_is_told_and_a_cancelled_look_ends() {
        let run = RunContext::silent();
        let Err(ReadError::Bad(told)) = look_at_cad(Path::new("no such.stl"), None, &run) else { panic!() };
        assert!(told.to_string().contains("no such.stl"));
        let stop = CancelToken::default();
        stop.cancel();
        let run = RunContext::new(&stop, &|_| {});
        assert!(matches!(look_at_cad(&demo("bracket.stl"), None, &run), Err(ReadError::Cancelled(_))));
    }
}
