//! The scans of a study, one after the other, inspected by the same code as those of a run.

use super::figures::PointFigures;
use super::reference;
use super::request::{Source, Study, StudyRequest};
use super::series::Tally;
use crate::diagnostic::{Diagnostic, ReadError, Severity};
use crate::inspect::{InspectionResult, Outcome, check_against_part};
use crate::plan::rig::SHARED_DEPTH_VARIANCE;
use crate::plan::{
    self, AlignmentMethod, CadSide, ComparisonPoint, Geometry, Plan, Rig, ScanSettings, UncertaintySettings,
};
use crate::report::words::clean;
use crate::run::{Cancelled, RunContext};
use crate::simulate::files::EVERYDAY_SPRINGBACK_MM;
use crate::simulate::{RigModel, ScanTruth, Series};
use crate::worker::scans::{Links, list_scans};
use crate::worker::{Event, Examiner, Listener, StopSwitch, prepare_part};
use std::path::Path;
use std::sync::Arc;

/// The belt around a simulated part, mm: enough to find its plane, and no more rays than that needs.
const BELT_MARGIN_MM: f64 = 20.0;
/// Scans that a type-1 study asks for.
const USUAL_SCANS: usize = 25;

/// Runs a study on this thread. What happens on the way goes to the listener: problems, the CAD, each scan as it is begun.
/// `Ok(None)`: stopped before there was anything to tell. The error is `None` when its problems were told already.
pub fn run_study(
    request: &StudyRequest,
    stop: &StopSwitch,
    listener: Listener,
) -> Result<Option<Study>, Option<Box<Diagnostic>>> {
    let observe = |stage| listener(Event::Stage(stage));
    let run = RunContext::new(&stop.now, &observe);
    let Some(examiner) = prepare(&request.plan_path, &run, listener)? else { return Ok(None) };
    let job = Job { examiner: &examiner, stop, listener, run };
    let study = match &request.source {
        Source::Simulated { count, seed, springback_mm } => job.simulated(*count, *seed, *springback_mm),
        Source::Repeats { folder, reference } => job.repeats(folder, reference.as_deref()),
    };
    match study {
        _ if stop.now.is_cancelled() => Ok(None),
        Ok(study) if study.scans == 0 => Ok(None),
        Ok(study) => Ok(Some(study)),
        Err(diagnostic) => Err(Some(diagnostic)),
    }
}

/// Plan and CAD, their problems told; `None` when stopped meanwhile.
fn prepare(
    plan_path: &Path,
    run: &RunContext,
    listener: Listener,
) -> Result<Option<Examiner>, Option<Box<Diagnostic>>> {
    let loaded = plan::load(plan_path);
    listener(Event::Problems(loaded.problems));
    let Some(plan) = loaded.plan else { return Err(None) };
    if plan.comparison.is_empty() {
        let fault = Diagnostic::error("the plan has no comparison point: there is nothing to study").in_file(plan_path);
        return Err(Some(Box::new(fault.with_help("name the places whose deviations matter under [[comparison]]"))));
    }
    let (part, cache) = match prepare_part(&plan, run) {
        Ok(prepared) => prepared,
        Err(ReadError::Cancelled(_)) => return Ok(None),
        Err(ReadError::Bad(diagnostic) | ReadError::CutOff(diagnostic)) => return Err(Some(diagnostic)),
    };
    let (plan, part) = (Arc::new(plan), Arc::new(part));
    listener(Event::Prepared { plan: plan.clone(), part: part.clone(), cache });
    let against_cad = check_against_part(&plan, &part);
    let unfit = against_cad.iter().any(|p| p.severity == Severity::Error);
    listener(Event::Problems(against_cad));
    if unfit { Err(None) } else { Ok(Some(Examiner { plan, part })) }
}

/// A study under way.
struct Job<'a> {
    examiner: &'a Examiner,
    stop: &'a StopSwitch,
    listener: Listener<'a>,
    run: RunContext<'a>,
}

impl Job<'_> {
    /// Simulated scans: each has its own truth.
    fn simulated(&self, count: u64, seed: u64, springback_mm: Option<f64>) -> Result<Study, Box<Diagnostic>> {
        let Examiner { plan, part } = self.examiner;
        let best_fit = matches!(plan.alignment, AlignmentMethod::BestFit | AlignmentMethod::Regions(_));
        if best_fit && springback_mm.is_some_and(|mm| mm > 0.0) {
            let message = "the best fit of a bent part has no exact answer to compare with";
            let fault = Diagnostic::error(message).in_file(&plan.path).at_line(plan.alignment_line);
            return Err(Box::new(fault.with_help("leave --deform out, or align the part on features")));
        }
        let springback_mm = springback_mm.unwrap_or(if best_fit { 0.0 } else { EVERYDAY_SPRINGBACK_MM });
        // Edges are seen where [uncertainty] says, not where some rounding that nobody asked for would put them.
        let rig = RigModel { rim_rounding_mm: 0.0, belt_margin_mm: BELT_MARGIN_MM, ..RigModel::of_plan(plan) };
        let series = Series { rig, springback_mm, ..Series::of_plan(plan, part, seed) };
        let mut tally = Tally::new(&plan.comparison);
        for index in 0..count {
            let name = format!("sim_{:04}", index + 1);
            let Some(_) = self.begin(index as usize, count as usize, Path::new(&name)) else { break };
            let Ok((result, truth)) = self.simulate_and_inspect(&series, index, Path::new(&name)) else { break };
            let deviation = |k: usize| {
                let point = truth.points.get(k)?;
                let told = if best_fit { point.in_true_pose } else { point.aligned };
                told.map(|d| d.deviation_mm)
            };
            count_in(&mut tally, name, &result, deviation);
        }
        let bent = match springback_mm {
            mm if mm > 0.0 => format!("bent by about {mm} mm at their ends"),
            _ => "as the CAD has them".to_owned(),
        };
        let source = format!("{}, seed {seed}, parts {bent}", counted(tally.scans, count, "simulated scan"));
        let notes = simulation_notes(plan, tally.scans);
        Ok(self.study(tally, source, notes, |_| true))
    }

    fn simulate_and_inspect(
        &self,
        series: &Series,
        index: u64,
        name: &Path,
    ) -> Result<(InspectionResult, ScanTruth), Cancelled> {
        let scan = series.scan(index, &self.run)?;
        Ok((self.examiner.inspect_cloud(name, scan.cloud, &self.run)?, scan.truth))
    }

    /// Scans of one part: its truth is what the reference says, if there is one.
    fn repeats(&self, folder: &Path, reference: Option<&Path>) -> Result<Study, Box<Diagnostic>> {
        let plan = &self.examiner.plan;
        let known = reference.map(|path| reference::read(path, &plan.comparison)).transpose()?;
        let settings = ScanSettings { path: folder.to_path_buf(), ..plan.scans.clone() };
        let scans = list_scans(&settings, Links::Follow)
            .map_err(|d| Box::new(d.with_help("name the folder with the scans of one part: --scans DIR")))?;
        if scans.is_empty() {
            let message = format!("no scan matches \"{}\"", settings.pattern);
            let fault = Diagnostic::error(message).in_file(folder);
            return Err(Box::new(
                fault.with_help("put scans of one part there, or change [scans] pattern in the plan"),
            ));
        }
        let truth = |k: usize| known.as_ref().and_then(|known| known[k]);
        let mut tally = Tally::new(&plan.comparison);
        for (index, scan) in scans.iter().enumerate() {
            let Some(_) = self.begin(index, scans.len(), &scan.path) else { break };
            let Ok(result) = self.examiner.inspect_file(&scan.path, &self.run) else { break };
            let name = file_name(&scan.path);
            count_in(&mut tally, name, &result, |k| Some(truth(k).unwrap_or(0.0)));
        }
        let against = reference.map_or(String::new(), |path| format!(", reference values from {}", file_name(path)));
        let scans = counted(tally.scans, scans.len() as u64, "scan");
        let source = format!("{scans} of one part from {}{against}", file_name(folder));
        let mut notes = few_scans(tally.scans);
        let unknown: Vec<&str> = (0..plan.comparison.len())
            .filter(|k| truth(*k).is_none())
            .map(|k| plan.comparison[k].name.as_str())
            .collect();
        match &known {
            None => notes.push(
                "without --reference nothing is known of the part's true deviations: bias, coverage and Cgk are left out, and \
                 \"repeats\" says no more than that the scans agree with each other"
                    .to_owned(),
            ),
            Some(_) if !unknown.is_empty() => {
                notes.push(format!("no reference value, so that only repeatability is told: {}", unknown.join(", ")));
            }
            Some(_) => notes.push("reference values are taken as exact".to_owned()),
        }
        Ok(self.study(tally, source, notes, |k| truth(k).is_some()))
    }

    /// Tells that a scan begins; `None` when the study was stopped.
    fn begin(&self, index: usize, of: usize, scan: &Path) -> Option<()> {
        if self.stop.is_on() {
            return None;
        }
        let waiting = of.saturating_sub(index + 1);
        (self.listener)(Event::Started { index: index + 1, of: Some(of), waiting, scan: scan.to_path_buf() });
        Some(())
    }

    fn study(&self, tally: Tally, source: String, notes: Vec<String>, truth_known: impl Fn(usize) -> bool) -> Study {
        let Examiner { plan, part } = self.examiner;
        let points = plan.comparison.iter().zip(&tally.points).enumerate();
        let info = [&plan.part.name, &plan.part.number, &plan.part.revision].map(|text| clean(text));
        Study {
            part: info.iter().filter(|text| !text.is_empty()).cloned().collect::<Vec<_>>().join(" "),
            plan: (file_name(&plan.path), plan.sha256.clone()),
            cad: (clean(&plan.cad.file), part.cad_sha256.clone()),
            source,
            rig: plan.rig.as_ref().map(Rig::figures),
            notes,
            scans: tally.scans,
            seen: [tally.from_top, tally.from_bottom],
            points: points
                .map(|(k, (point, series))| PointFigures::of(point, series, tally.scans, truth_known(k)))
                .collect(),
            refused: tally.refused,
        }
    }
}

fn count_in(tally: &mut Tally, name: String, result: &InspectionResult, truth_mm: impl Fn(usize) -> Option<f64>) {
    match &result.outcome {
        Outcome::Measured(inspection) => tally.add(inspection, truth_mm),
        Outcome::Refused(refusal) => tally.refuse(name, clean(&refusal.reason)),
    }
}

/// `7 of 20 simulated scans`, or all of them.
fn counted(done: usize, asked: u64, what: &str) -> String {
    let plural = if asked == 1 { "" } else { "s" };
    if done as u64 == asked {
        format!("{asked} {what}{plural}")
    } else {
        format!("{done} of {asked} {what}{plural} (stopped)")
    }
}

/// What the simulation takes for granted.
fn simulation_notes(plan: &Plan, scans: usize) -> Vec<String> {
    let mut notes = few_scans(scans);
    if plan.rig.is_none() {
        notes.push(format!("the plan has no [rig]; simulated is that of the paper: {}", Rig::PAPER.figures()));
    }
    let u = &plan.uncertainty;
    if *u == UncertaintySettings::default() {
        notes.push(
            "[uncertainty] states nothing: scale, thickness, optical edges and measuring system are simulated without error; real ones \
             have some"
                .to_owned(),
        );
    }
    let of_solid = plan.part.cad_side == CadSide::Solid;
    if of_solid && (u.edge_offset_mm != 0.0 || u.edge_offset_u_mm != 0.0) {
        notes.push("the CAD is a solid: its edges are simulated without [uncertainty] edge_offset".to_owned());
    }
    let is_distance = |p: &&ComparisonPoint| matches!(p.geometry, Geometry::Hole { direction: None, .. });
    let distances: Vec<&str> = plan.comparison.iter().filter(is_distance).map(|p| p.name.as_str()).collect();
    if !distances.is_empty() {
        notes
            .push(format!("a distance, which noise can only lengthen, so that it is biased: {}", distances.join(", ")));
    }
    notes.push(format!(
        "noise is simulated as normal, {:.0} % of the variance of depth shared by neighbours; scratches, oil and dirt are not simulated",
        100.0 * SHARED_DEPTH_VARIANCE
    ));
    notes
}

/// A word where the scans are fewer than such studies ask for.
fn few_scans(scans: usize) -> Vec<String> {
    if !(2..USUAL_SCANS).contains(&scans) {
        return Vec::new();
    }
    let known = 100.0 / (2.0 * (scans - 1) as f64).sqrt();
    vec![format!(
        "a type-1 study asks for {USUAL_SCANS} scans at least, better 50: from {scans} a standard deviation, and with it Cg, is known to \
         {known:.0} % (one sigma)"
    )]
}

fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(|| clean(&path.to_string_lossy()), |name| clean(&name.to_string_lossy()))
}
