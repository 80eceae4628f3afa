//! What a plan that is not saved makes of a scan that is loaded.

use super::check::check_document;
use super::examine::{identity_of, part_settings, prepare_cad};
use crate::diagnostic::{Diagnostic, ReadError, Severity};
use crate::geometry::PointCloud;
use crate::inspect::{self, Inspected, InspectionResult};
use crate::part::Part;
use crate::plan::document::{Document, PlanProblem};
use crate::plan::{CadSide, Plan};
use crate::report::differences::{PointDifference, point_differences, verdict_words};
use crate::run::{Cancelled, RunContext};
use std::path::Path;
use std::sync::Arc;

/// What a trial gives.
#[derive(Debug, Clone)]
pub struct Trial {
    /// The plan as it is edited.
    pub plan: Arc<Plan>,
    /// Its CAD; with the plan for the next trial.
    pub part: Arc<Part>,
    /// The result and the scan with its classes.
    pub inspected: Inspected,
    /// The result before.
    pub before: Option<Arc<InspectionResult>>,
    /// Every point before and after.
    pub points: Vec<PointDifference>,
    /// What became of the verdict of the part, in words.
    pub verdict: String,
}

/// Why there was no trial.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NoTrial {
    /// The plan has errors.
    #[error("the plan has {} {}", .0.len(), if .0.len() == 1 { "error" } else { "errors" })]
    NotSound(Vec<PlanProblem>),
    /// The CAD cannot be used.
    #[error("{0}")]
    Cad(Box<Diagnostic>),
    /// Somebody cancelled it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Inspects a loaded scan, mm, with the plan as it is being edited, and tells what changes against the result before. The part of `known`,
/// with the plan for which it was prepared, is used again where the plan still asks for the same; nothing is cached, nothing is written.
/// `scan` names the cloud.
///
/// # Errors
/// A plan with errors, also against its CAD; a CAD that cannot be used; cancelled. A scan that is refused is a result.
pub fn try_plan(
    document: &Document,
    known: Option<(&Plan, &Arc<Part>)>,
    cloud: &PointCloud,
    scan: &Path,
    before: Option<Arc<InspectionResult>>,
    run: &RunContext,
) -> Result<Trial, NoTrial> {
    let Some(plan) = document.read().plan else { return Err(not_sound(check_document(document, None))) };
    let part = match known.filter(|(known, _)| asks_for_the_same(known, &plan)) {
        Some((_, part)) => Arc::clone(part),
        None => match prepare_cad(&plan.cad, &part_settings(&plan), None, run) {
            Ok((part, _)) => Arc::new(part),
            Err(ReadError::Cancelled(cancelled)) => return Err(cancelled.into()),
            Err(ReadError::Bad(fault) | ReadError::CutOff(fault)) => return Err(NoTrial::Cad(fault)),
        },
    };
    let problems = check_document(document, Some(&part));
    if problems.iter().any(|p| p.diagnostic.severity == Severity::Error) {
        return Err(not_sound(problems));
    }
    let scan_sha256 = before.as_ref().and_then(|before| before.identity.scan_sha256.clone());
    let identity = identity_of(&plan, &part, scan, scan_sha256);
    let inspected = inspect::inspect(&plan, &part, cloud.clone(), identity, run)?;
    let points = point_differences(before.as_deref(), &inspected.result);
    let verdict = verdict_words(before.as_deref(), &inspected.result);
    Ok(Trial { plan: Arc::new(plan), part, inspected, before, points, verdict })
}

fn not_sound(problems: Vec<PlanProblem>) -> NoTrial {
    NoTrial::NotSound(problems.into_iter().filter(|p| p.diagnostic.severity == Severity::Error).collect())
}

/// Whether the part prepared for one plan serves another; only of a solid do the plan's points decide what is made of it.
fn asks_for_the_same(known: &Plan, plan: &Plan) -> bool {
    let (mut old, mut new) = (part_settings(known), part_settings(plan));
    if new.cad_side != CadSide::Solid {
        old.plan_directions.clear();
        new.plan_directions.clear();
    }
    known.cad == plan.cad && old == new
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inspect::Verdict;
    use crate::io;
    use crate::plan::Geometry;
    use crate::plan::LengthUnit;
    use crate::plan::document::{FieldValue, List};
    use crate::worker::plan_file::open_plan;
    use crate::worker::prepare_part;

    /// The demo's plan with other limits, a moved point and one less, on the demo's first scan.
    #[test]
    fn only_what_was_edited_changes() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let mut document = open_plan(&root.join("settings/demo.toml")).unwrap().document;
        let run = RunContext::silent();
        let plan = document.read().plan.unwrap();
        let (part, _) = prepare_part(&plan, &run).unwrap();
        let part = Arc::new(part);
        let known = Some((&plan, &part));
        let scan = root.join("assets/demo/scans/01_good_top.ply");
        let cloud = io::read_cloud(&io::read_file(&scan).unwrap(), &scan, LengthUnit::Mm, &run).unwrap();
        let first = try_plan(&document, known, &cloud, &scan, None, &run).unwrap();
        assert!(Arc::ptr_eq(&first.part, &part) && first.points.iter().all(|p| p.before.is_none()));
        let before = Arc::new(first.inspected.result);
        document.set_tolerances(&[1], Some(-0.001), Some(0.001)).unwrap();
        let points = document.read().draft.comparison;
        let Geometry::Surface { position, direction } = points[2].geometry else { panic!() };
        let raised = position + direction.into_inner() * 0.3;
        let at = FieldValue::Numbers(raised.iter().copied().collect());
        document.set_value(List::Comparison, 2, "position", &at).unwrap();
        document.remove(List::Comparison, &[0]).unwrap();
        let trial = try_plan(&document, known, &cloud, &scan, Some(before), &run).unwrap();
        let changed: Vec<&str> = trial.points.iter().filter(|p| p.is_change()).map(|p| p.name.as_str()).collect();
        assert_eq!(changed, ["P02", "P03", "P01"]);
        let of = |name: &str| trial.points.iter().find(|p| p.name == name).unwrap();
        let (limits, moved) = (of("P02"), of("P03"));
        let values = |p: &PointDifference| [&p.before, &p.after].map(|r| r.as_ref().unwrap().deviation_mm.unwrap());
        assert_eq!(values(limits)[0], values(limits)[1]);
        assert_ne!(limits.after.as_ref().unwrap().verdict, Verdict::Pass);
        // The window moves with the place by 0.3 mm along its normal, so that the same sheet is measured from 0.3 mm higher up; of the
        // points at the window's rim a few come and go: less than a tenth of a spacing of 0.7 mm times a slope of 0.1.
        let [a, b] = values(moved);
        assert!((b - (a - 0.3)).abs() < 0.01, "{a} {b}");
        assert!(of("P01").after.is_none());
        document.set_setting("part", "thickness_mm", &FieldValue::Text("thin".into())).unwrap();
        let Err(NoTrial::NotSound(errors)) = try_plan(&document, None, &cloud, &scan, None, &run) else { panic!() };
        assert_eq!(errors.len(), 1);
    }
}
