//! One scan from its points to its result: a pure function.

use super::comparison::compare;
use super::map::deviation_map;
use super::result::{CloudCounts, Identity, Inspection, InspectionResult, Outcome};
use super::verdict::of_part;
use crate::align::{self, AlignmentInput, BestFit, DatumHold, FeatureAlignment, InView, align_on_plan};
use crate::diagnostic::{Refusal, Stop};
use crate::geometry::PointCloud;
use crate::io::unit_guard;
use crate::measure::Local;
use crate::part::Part;
use crate::plan::{Plan, Rig, Side};
use crate::run::{Cancelled, RunContext, Stage};
use crate::scan::{self, ConditionedScan, PointClass, PointGrid, ScanHints};

/// A result and the scan that it is about; printers draw the map from both.
#[derive(Debug, Clone)]
pub struct Inspected {
    /// The result.
    pub result: InspectionResult,
    /// The scan with its classes; `None` when it was refused before that.
    pub scan: Option<ConditionedScan>,
}

/// Inspects one cloud against the prepared CAD. The same input gives the same result, whatever the number of threads.
pub fn inspect(
    plan: &Plan,
    part: &Part,
    cloud: PointCloud,
    identity: Identity,
    run: &RunContext,
) -> Result<Inspected, Cancelled> {
    let mut counts = CloudCounts { points_read: Some(cloud.len() + cloud.skipped_invalid), ..CloudCounts::default() };
    let (outcome, scan) = match condition(plan, part, cloud, run) {
        Err(Stop::Refused(refusal)) => (Outcome::Refused(refusal), None),
        Err(Stop::Cancelled(cancelled)) => return Err(cancelled),
        Ok((mut scan, points_read)) => match measure_conditioned(plan, part, &mut scan, points_read, run) {
            Ok(inspection) => (Outcome::Measured(Box::new(inspection)), Some(scan)),
            Err(Stop::Refused(refusal)) => (Outcome::Refused(refusal), Some(scan)),
            Err(Stop::Cancelled(cancelled)) => return Err(cancelled),
        },
    };
    if let Some(scan) = &scan {
        counts.points_kept = Some(scan.kept.len());
        counts.removed = Some(scan.removed);
    }
    let result = InspectionResult {
        identity,
        outcome,
        counts,
        map_range_mm: plan.output.map_range_mm,
        method: plan.alignment.clone(),
    };
    Ok(Inspected { result, scan })
}

/// The result of a scan that could not even be read.
pub fn refused(plan: &Plan, identity: Identity, refusal: Refusal) -> InspectionResult {
    InspectionResult {
        identity,
        outcome: Outcome::Refused(refusal),
        counts: CloudCounts::default(),
        map_range_mm: plan.output.map_range_mm,
        method: plan.alignment.clone(),
    }
}

/// The cloud with its background told, and how many points the file had.
fn condition(plan: &Plan, part: &Part, cloud: PointCloud, run: &RunContext) -> Result<(ConditionedScan, usize), Stop> {
    let points_read = cloud.len() + cloud.skipped_invalid;
    run.enter(Stage::Background)?;
    check_raw_units(&cloud, part)?;
    Ok((scan::condition(cloud, &plan.background, &hints(plan, part), run)?, points_read))
}

fn hints(plan: &Plan, part: &Part) -> ScanHints {
    let extents = part.bounds.extents();
    ScanHints {
        view_direction: plan.scans.view_direction,
        part_extents_mm: [extents.x, extents.y, extents.z],
        part_area_mm2: part.face(Side::Top).mesh.area(),
        thickness_mm: part.thickness_mm,
    }
}

fn measure_conditioned(
    plan: &Plan,
    part: &Part,
    scan: &mut ConditionedScan,
    points_read: usize,
    run: &RunContext,
) -> Result<Inspection, Stop> {
    check_units(scan, part)?;
    run.enter(Stage::BestFit)?;
    let InView { best_fit, warnings: others } = align::find_part(part, scan, &hints(plan, part), run)?;
    run.enter(Stage::Features)?;
    let second_look = align::second_look(scan, part.face(best_fit.face), &best_fit.cad_from_scan, run)?;
    scan.reclassify(&second_look.sheet, PointClass::Kept);
    run.check()?;
    let grid = PointGrid::build(scan, grid_cell_mm(scan));
    run.check()?;
    // After the grid: to take low points from a measurement would move it, and one that is too low is none anyway.
    scan.reclassify(&second_look.belt, PointClass::Belt);
    let scan = &*scan;
    let input = AlignmentInput { plan, part, scan, grid: &grid };
    let (alignment, pose_uncertainty) = align_on_plan(&input, &best_fit, run)?;
    run.enter(Stage::Comparison)?;
    let face = part.face(best_fit.face);
    let local =
        Local { part, face, scan, grid: &grid, cad_from_scan: alignment.cad_from_scan, uncertainty: &plan.uncertainty };
    let compared = compare(plan, &local, &alignment, &pose_uncertainty, run)?;
    run.enter(Stage::Map)?;
    let map = deviation_map(scan, part, best_fit.face, &alignment.cad_from_scan, plan.output.map_range_mm, run)?;
    let verdict = of_part(&compared.points, alignment.degraded.is_some());
    let mut warnings = warnings(scan, &best_fit, &alignment);
    warnings.extend(coarser_than_the_rig(plan.rig.as_ref(), scan.spacing_mm));
    warnings.extend(others);
    warnings.extend(compared.warnings);
    warnings.extend(map.far_crowd.map(|crowd| {
        let [x, y, z]: [f64; 3] = crowd.centre.coords.into();
        format!(
            "{} points stand too far from the CAD to be compared with it, {} of them together around ({x:.0}, {y:.0}, {z:.0}): a deep dent, \
             or something that is not the part; look at the part there",
            map.statistics.far, crowd.points
        )
    }));
    Ok(Inspection {
        points_read,
        points_kept: scan.kept.len(),
        removed: scan.removed,
        verdict,
        warnings,
        best_fit,
        alignment,
        points: compared.points,
        map,
    })
}

/// Cells of the size of a typical window keep the number of cells per look-up small.
fn grid_cell_mm(scan: &ConditionedScan) -> f64 {
    (4.0 * scan.spacing_mm).clamp(1.0, 8.0)
}

/// Refuses a scan whose unit is not the plan's: its part is a telling factor larger or smaller than the CAD.
fn check_units(scan: &ConditionedScan, part: &Part) -> Result<(), Refusal> {
    let diagonal = unit_guard::robust_diagonal_mm(&scan.cloud.positions, &scan.kept);
    let suspicion = diagonal.and_then(|mm| unit_guard::check_scale(mm, part.diagonal_mm()));
    suspicion.map_or(Ok(()), |s| Err(Refusal::new(s.words, s.help)))
}

/// The same before anything is removed: a cloud so small or large that the filters would make nothing of it.
fn check_raw_units(cloud: &PointCloud, part: &Part) -> Result<(), Refusal> {
    let suspicion = unit_guard::check_raw_scale(&cloud.positions, part.diagonal_mm());
    suspicion.map_or(Ok(()), |s| Err(Refusal::new(s.words, s.help)))
}

/// Points this many times as far apart as the rig's are not its own: loss of every second point makes 1.4 of it.
const COARSER: f64 = 1.5;

/// Warns of a scan to which nothing applies that was expected of the plan's rig.
fn coarser_than_the_rig(rig: Option<&Rig>, spacing_mm: f64) -> Option<String> {
    let told_mm = rig?.spacing_mm();
    (spacing_mm > COARSER * told_mm).then(|| {
        format!(
            "the points lie {spacing_mm:.3} mm apart, [rig] tells {told_mm:.3} mm: uncertainties foretold by check and study are too \
             small for such scans; correct [rig], or give it point_spacing_mm"
        )
    })
}

fn warnings(scan: &ConditionedScan, best_fit: &BestFit, alignment: &FeatureAlignment) -> Vec<String> {
    let mut warnings = scan.warnings.clone();
    if best_fit.margin < 1.5 * best_fit.margin_limit {
        warnings.push(format!(
            "the margin to the second pose is {:.2}, close to the limit of {:.2}",
            best_fit.margin, best_fit.margin_limit
        ));
    }
    let of_datums =
        alignment.features.iter().filter_map(|f| Some(format!("datum {}: {}", f.name, f.warning.as_ref()?)));
    warnings.extend(of_datums);
    if let Some(reason) = &alignment.degraded {
        warnings.push(format!("the map is drawn in the best fit, nothing is judged: {reason}"));
    }
    if let Some(DatumHold { condition, weak: Some(motion), .. }) = &alignment.hold {
        warnings.push(format!(
            "the datums hold the {motion} {condition:.0} times more weakly than the best held motion: what they are off comes back as much larger"
        ));
    }
    warnings
}
