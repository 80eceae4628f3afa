//! Where the views lie: their poses before, refined by registration.

use super::condition::{Conditioned, PointCounts};
use super::register::{Gauge, Options, Prior, RegisterError, Registration, ViewOutcome, register_from};
use super::shelf::{InMemory, Shelf, ViewFacts};
use super::units::{check_poses, check_sizes};
use super::{StitchError, View};
use crate::diagnostic::Diagnostic;
use crate::fit::robust::median;
use crate::geometry::Isometry3;
use crate::plan::merge::{MergePlan, Prealign};
use crate::run::{RunContext, Stage};

/// A view with what is known of its pose before.
#[derive(Debug, Clone, PartialEq)]
pub struct Ready {
    /// Its place in the order of names, from 0: the number of its points in the result.
    pub index: usize,
    /// Its points.
    pub conditioned: Conditioned,
    /// `world_from_view` before registration; else why it is not known.
    pub start: Result<Isometry3, NoStart>,
}

/// Why nothing is known of a pose before registration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum NoStart {
    /// Nobody said.
    Unknown,
    /// The CAD gave none, for this reason.
    Refused(String),
}

/// What became of a view.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// It is merged, from here.
    Placed(Isometry3),
    /// It is not, for this reason.
    LeftOut(String),
}

impl Outcome {
    /// `world_from_view`, if it is merged.
    pub fn world_from_view(&self) -> Option<&Isometry3> {
        match self {
            Outcome::Placed(pose) => Some(pose),
            Outcome::LeftOut(_) => None,
        }
    }
}

/// Views in their places.
#[derive(Debug, Clone, PartialEq)]
pub struct PlacedViews {
    /// All that were ready, in the order of names, each in its own frame.
    pub views: Vec<View>,
    /// Their places in the order of all names.
    pub indices: Vec<usize>,
    /// Their points.
    pub counts: Vec<PointCounts>,
    /// What became of each.
    pub outcomes: Vec<Outcome>,
    /// What registration told of pairs, rings and weak motions, where it was asked for; of the views in this order.
    pub registration: Option<Registration>,
    /// The distance d_grid of points: the median of the merged views' own.
    pub d_grid: f64,
    /// The median size of the merged views, a diagonal.
    pub size: f64,
    /// What people should know.
    pub warnings: Vec<String>,
}

impl PlacedViews {
    /// The merged views: which of all, and their poses.
    pub fn merged(&self) -> impl Iterator<Item = (usize, &View, &Isometry3)> {
        let views = self.views.iter().zip(&self.outcomes).enumerate();
        views.filter_map(|(k, (view, outcome))| Some((k, view, outcome.world_from_view()?)))
    }
}

/// Standard uncertainty of a pre-aligned position where the settings tell none, in sizes of a view.
const TRANSLATION_SIGMA: f64 = 0.01;
/// The same of a turn, rad: half a degree.
const ROTATION_SIGMA_RAD: f64 = 0.0087;
/// What agrees less than this is told.
const USUAL_AGREEMENT: f64 = 0.95;
/// Fewer views than this make nothing to merge.
const LEAST_VIEWS: usize = 2;

/// Finds the places of views.
///
/// # Errors
/// Fewer than two views have a place, poses that unit mistakes would make, or the job was stopped.
pub fn place(plan: &MergePlan, mut ready: Vec<Ready>, run: &RunContext) -> Result<PlacedViews, StitchError> {
    ready.sort_by_key(|view| view.index);
    let facts = ready.iter().map(|one| ViewFacts::new(&one.conditioned.view, run));
    let facts: Vec<ViewFacts> = facts.collect::<Result<_, StitchError>>()?;
    place_from(plan, ready, &facts, None, run)
}

/// The same of views in the order of names whose facts are known. Where there is a shelf, their points lie there, in this order.
///
/// # Errors
/// Those of [`place`], and those of the shelf.
///
/// # Panics
/// When there are not as many facts as views.
pub fn place_from(
    plan: &MergePlan,
    ready: Vec<Ready>,
    facts: &[ViewFacts],
    shelf: Option<&dyn Shelf>,
    run: &RunContext,
) -> Result<PlacedViews, StitchError> {
    assert_eq!(ready.len(), facts.len(), "facts of every view");
    check_sizes(plan, &ready, facts)?;
    let mut warnings = check_poses(plan, &ready, facts)?;
    warnings.extend(check_cad(plan, &ready)?);
    run.enter(Stage::Register)?;
    let (mut views, mut indices, mut counts, mut starts) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for one in ready {
        views.push(one.conditioned.view);
        indices.push(one.index);
        counts.push(one.conditioned.counts);
        starts.push(one.start);
    }
    let sizes: Vec<f64> = facts.iter().map(|facts| facts.size).collect();
    let (outcomes, registration) = if plan.registration.enabled {
        let in_memory = InMemory(&views);
        refined(plan, &views, shelf.unwrap_or(&in_memory), &starts, &sizes, run)?
    } else {
        (as_before(plan, &counts, &starts, facts), None)
    };
    if let Some(registration) = &registration {
        warnings.extend(weak_words(registration));
        warnings.extend(disagreeing(&views, registration));
    }
    let placed: Vec<usize> = (0..views.len()).filter(|k| outcomes[*k].world_from_view().is_some()).collect();
    if placed.len() < LEAST_VIEWS {
        return Err(too_few(plan, &views, &outcomes).into());
    }
    let of_placed = |value: fn(&ViewFacts) -> f64| {
        let mut values: Vec<f64> = placed.iter().map(|k| value(&facts[*k])).collect();
        median(&mut values).unwrap_or(f64::NAN)
    };
    let (d_grid, size) = (of_placed(|facts| facts.d_grid.unwrap_or(f64::NAN)), of_placed(|facts| facts.size));
    Ok(PlacedViews { views, indices, counts, outcomes, registration, d_grid, size, warnings })
}

/// Holds what the CAD gave against what was asked of it; also which views it did not place.
fn check_cad(plan: &MergePlan, ready: &[Ready]) -> Result<Option<String>, StitchError> {
    let refused = |one: &Ready| match &one.start {
        Err(NoStart::Refused(why)) => Some(format!("{}: {why}", one.conditioned.view.name)),
        _ => None,
    };
    let refused: Vec<String> = ready.iter().filter_map(refused).collect();
    let (Some(first), count, all) = (refused.first(), refused.len(), ready.len()) else { return Ok(None) };
    if count == all {
        let help = "a view has to show at least half of what the CAD has on that side: give poses for smaller ones";
        let message = format!("the CAD places none of the views; {first}");
        return Err(Diagnostic::error(message)
            .in_file(&plan.path)
            .at_line(plan.views.folder.line)
            .with_help(help)
            .into());
    }
    Ok(Some(format!("the CAD places {} of {all} views, the others hang on these; {first}", all - count)))
}

/// The poses before: registration is off.
fn as_before(
    plan: &MergePlan,
    counts: &[PointCounts],
    starts: &[Result<Isometry3, NoStart>],
    facts: &[ViewFacts],
) -> Vec<Outcome> {
    let outcome = |k: usize| match &starts[k] {
        _ if facts[k].d_grid.is_none() => {
            Outcome::LeftOut(format!("its {} points are too few, or in one place", counts[k].points_kept))
        }
        Ok(pose) => Outcome::Placed(*pose),
        Err(NoStart::Refused(why)) => Outcome::LeftOut(why.clone()),
        Err(NoStart::Unknown) if plan.views.prealign == Prealign::None => Outcome::Placed(Isometry3::identity()),
        Err(NoStart::Unknown) => Outcome::LeftOut("nothing is known of its pose".to_owned()),
    };
    (0..counts.len()).map(outcome).collect()
}

/// Poses by registration, which begins at those before.
fn refined(
    plan: &MergePlan,
    views: &[View],
    shelf: &dyn Shelf,
    starts: &[Result<Isometry3, NoStart>],
    sizes: &[f64],
    run: &RunContext,
) -> Result<(Vec<Outcome>, Option<Registration>), StitchError> {
    let usual_size = median(&mut sizes.to_vec()).unwrap_or(1.0);
    let translation_sigma = plan.registration.translation_sigma.unwrap_or(TRANSLATION_SIGMA * usual_size);
    let rotation_sigma_rad = plan.registration.rotation_sigma.unwrap_or(ROTATION_SIGMA_RAD);
    let prior = |start: &Result<Isometry3, NoStart>| {
        let world_from_view = *start.as_ref().ok()?;
        Some(Prior { world_from_view, translation_sigma, rotation_sigma_rad })
    };
    let priors: Vec<Option<Prior>> = starts.iter().map(prior).collect();
    let registration = register_from(views, shelf, &priors, &Options::default(), run).map_err(|error| match error {
        RegisterError::Cancelled(cancelled) => StitchError::Cancelled(cancelled),
        RegisterError::NotFetched(fault) => *fault,
        fault => {
            let help =
                "check the views and the poses; with `enabled = false` in [registration] they are taken as they are";
            Diagnostic::error(format!("registration: {fault}")).in_file(&plan.path).with_help(help).into()
        }
    })?;
    let outcome = |(found, start): (&ViewOutcome, &Result<Isometry3, NoStart>)| match (found, start) {
        (ViewOutcome::Placed(placed), _) => Outcome::Placed(placed.world_from_view),
        (ViewOutcome::LeftOut(left_out), Err(NoStart::Refused(why))) => {
            Outcome::LeftOut(format!("{}; {why}", left_out.reason))
        }
        (ViewOutcome::LeftOut(left_out), _) => Outcome::LeftOut(left_out.reason.clone()),
    };
    let outcomes = registration.views.iter().zip(starts).map(outcome).collect();
    Ok((outcomes, Some(registration)))
}

/// That some views could slide on their neighbours, if they could.
fn weak_words(registration: &Registration) -> Option<String> {
    let views: std::collections::BTreeSet<usize> = registration.weak.iter().map(|weak| weak.view).collect();
    (!views.is_empty()).then(|| {
        let views = if views.len() == 1 { "one view".to_owned() } else { format!("{} views", views.len()) };
        if registration.gauge == Gauge::Priors {
            format!("the overlaps do not hold every motion of {views}, what is known before does (`weak` in the report tells how well)")
        } else {
            format!("the overlaps do not hold every motion of {views}, and no poses are known that would (`weak` in the report tells which)")
        }
    })
}

/// Views that stay in the cloud though what others see in the same place is not all like it.
fn disagreeing(views: &[View], registration: &Registration) -> Vec<String> {
    let placed = |(view, outcome): (&View, &ViewOutcome)| {
        let agreement = outcome.placed()?.agreement;
        (agreement < USUAL_AGREEMENT).then(|| {
            let percent = 100.0 * agreement;
            format!(
                "{}: only {percent:.0} % of what its neighbours see in the same place agrees with it: one of them may show something else",
                view.name
            )
        })
    };
    views.iter().zip(&registration.views).filter_map(placed).collect()
}

fn too_few(plan: &MergePlan, views: &[View], outcomes: &[Outcome]) -> Diagnostic {
    let why = |(view, outcome): (&View, &Outcome)| match outcome {
        Outcome::LeftOut(reason) => Some(format!("{}: {reason}", view.name)),
        Outcome::Placed(_) => None,
    };
    let mut reasons: Vec<String> = views.iter().zip(outcomes).filter_map(why).collect();
    let more = reasons.len().saturating_sub(3);
    reasons.truncate(3);
    if more > 0 {
        reasons.push(format!("{more} more"));
    }
    let placed = outcomes.iter().filter(|outcome| outcome.world_from_view().is_some()).count();
    let found = if placed == 0 { "no view" } else { "one view" };
    let message = format!("found {found} with a place, expected two or more to merge");
    let message = [message].into_iter().chain(reasons).collect::<Vec<_>>().join("; ");
    let help = "views must overlap and be pre-aligned well enough: check [views] prealign and poses, and the masks";
    Diagnostic::error(message).in_file(&plan.path).at_line(plan.views.folder.line).with_help(help)
}
