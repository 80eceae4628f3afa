//! What a mask is worth before anything is masked (endoscope paper, figures 10 to 13): for a range of thresholds of every metric, how much a
//! fitted feature's points scatter, and how many of them are left.
//!
//! Every view is fitted by itself, so that neither poses nor registration are in the figures: squares of the distances of all views are put
//! together. The fit is the two-step one; sigma_dev counts the points that its second step leaves out.

use super::feature::{MISFIT, fit_feature_near, fit_kind, local_scatter};
use super::metric::{Better, Metric};
use super::view::View;
use crate::fit::two_step::near_shape;
use crate::fit::{FitError, Fitted};
use crate::geometry::Point3;
use crate::plan::merge::{Mask, MergeFeature};
use crate::run::{Cancelled, RunContext};
use rayon::prelude::*;

/// Shares of the points that the thresholds leave, about.
const SHARES: [f64; 22] = [
    1.0, 0.995, 0.99, 0.98, 0.96, 0.94, 0.92, 0.90, 0.87, 0.84, 0.80, 0.75, 0.70, 0.65, 0.60, 0.50, 0.40, 0.30, 0.25,
    0.20, 0.15, 0.10,
];
/// The knee: from here on sigma_dev lies within so much of its plateau.
const WITHIN: f64 = 1.05;
/// A threshold that leaves less than this is none to suggest.
const LEAST_SHARE: f64 = 0.5;

/// One threshold of one metric.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Points at least (or at most, where smaller is better) as good are kept.
    pub threshold: f64,
    /// Points that are left, of all views.
    pub remaining: usize,
    /// Their standard deviation about the fits; none where no view can be fitted.
    pub sigma_dev: Option<f64>,
    /// Fitted radius, the mean over views weighted by their points.
    pub radius: Option<f64>,
    /// Of the remaining points, left out by the fits' second step.
    pub rejected: usize,
    /// Views that could be fitted.
    pub views: usize,
}

/// Whether a metric helps, and where to cut.
#[derive(Debug, Clone, PartialEq)]
pub enum Knee {
    /// The loosest threshold from which on sigma_dev stays within 5 % of its plateau.
    At {
        /// Index of the step.
        step: usize,
        /// What sigma_dev falls to, the least over all thresholds.
        plateau: f64,
    },
    /// It scatters hardly more unmasked than masked.
    NoGain {
        /// The least sigma_dev over all thresholds.
        plateau: f64,
    },
    /// The plateau is reached only where less than half of the points are left.
    TooDear {
        /// Share that would be left.
        share: f64,
        /// The least sigma_dev over all thresholds.
        plateau: f64,
    },
    /// Even with the threshold that the curve would suggest the points lie off the feature in a pattern: it is of another kind.
    Misfit {
        /// Their standard deviation about the fits there.
        sigma_dev: f64,
        /// And beside their neighbours.
        noise: f64,
    },
    /// No fit.
    NotTold,
}

/// What thresholds of one metric do to one feature.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Of what.
    pub metric: Metric,
    /// Index of the feature.
    pub feature: usize,
    /// From the loosest to the strictest.
    pub steps: Vec<Step>,
    /// What is suggested.
    pub knee: Knee,
    /// The threshold that the file's own mask has, with what it does.
    pub own: Option<Step>,
    /// Points of which the metric is no number: no threshold keeps them.
    pub unknown: usize,
}

/// A study of masks.
#[derive(Debug, Clone, PartialEq)]
pub struct MaskStudy {
    /// By feature, then by metric.
    pub curves: Vec<Curve>,
    /// All points of all views.
    pub points: usize,
    /// Views.
    pub views: usize,
}

/// Why there is no study.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// No view can be fitted with all of its points.
    #[error("no {kind} fits a view: view {view}: {why}")]
    NoFit {
        /// What was asked for.
        kind: &'static str,
        /// The first view.
        view: String,
        /// Why it does not fit.
        why: FitError,
    },
    /// Somebody stopped it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Studies every metric that all views have a column of. `told` hears of each curve that is done, and of how many.
///
/// # Errors
/// A feature that no view shows, or the job was stopped.
pub fn mask_study(
    views: &[View],
    features: &[MergeFeature],
    masks: &[Mask],
    run: &RunContext,
    told: &(dyn Fn(usize, usize) + Sync),
) -> Result<MaskStudy, StudyError> {
    let has = |metric: &Metric| !views.is_empty() && views.iter().all(|v| v.columns.contains_key(metric));
    let metrics: Vec<Metric> = Metric::ALL.into_iter().filter(has).collect();
    let mut curves = Vec::new();
    for (index, feature) in features.iter().enumerate() {
        let fitted = starts(views, feature)?;
        for metric in &metrics {
            let own = masks.iter().find(|mask| mask.metric == *metric);
            curves.push(curve(&fitted, *metric, index, own, run)?);
            told(curves.len(), features.len() * metrics.len());
        }
    }
    let points = views.iter().map(|v| v.positions.len()).sum();
    Ok(MaskStudy { curves, points, views: views.len() })
}

/// A view with a shape near which its points lie.
struct Started<'a> {
    view: &'a View,
    near: Fitted,
}

/// The views that show the feature.
fn starts<'a>(views: &'a [View], feature: &MergeFeature) -> Result<Vec<Started<'a>>, StudyError> {
    let kind = fit_kind(feature.kind);
    let of = |view: &'a View| (view, near_shape(kind, &view.positions));
    let tried: Vec<(&View, Result<Fitted, FitError>)> = views.par_iter().map(of).collect();
    let mut started = Vec::new();
    let mut failed = None;
    for (view, near) in tried {
        match near {
            Ok(near) => started.push(Started { view, near }),
            Err(why) => failed = failed.or(Some((view.name.clone(), why))),
        }
    }
    match failed {
        Some((view, why)) if started.is_empty() => Err(StudyError::NoFit { kind: feature.kind.key(), view, why }),
        _ => Ok(started),
    }
}

fn curve(
    fitted: &[Started<'_>],
    metric: Metric,
    feature: usize,
    own: Option<&Mask>,
    run: &RunContext,
) -> Result<Curve, Cancelled> {
    let values: Vec<f64> = fitted.iter().flat_map(|s| &s.view.columns[&metric]).map(|v| f64::from(*v)).collect();
    let thresholds = thresholds(metric, &values);
    let steps: Result<Vec<Step>, Cancelled> = thresholds
        .par_iter()
        .map(|threshold| {
            run.check()?;
            Ok(step(fitted, &at_threshold(metric, *threshold), *threshold))
        })
        .collect();
    let steps = steps?;
    let bound = |mask: &Mask| if metric.better() == Better::Larger { mask.min } else { mask.max };
    let own = own.map(|mask| step(fitted, mask, bound(mask)));
    let unknown = values.iter().filter(|v| !v.is_finite()).count();
    let knee = match knee(&steps, values.len()) {
        Knee::At { step, plateau } => {
            let misfit = misfit(fitted, &at_threshold(metric, steps[step].threshold), &steps[step]);
            misfit.unwrap_or(Knee::At { step, plateau })
        }
        other => other,
    };
    Ok(Curve { metric, feature, steps, knee, own, unknown })
}

fn at_threshold(metric: Metric, threshold: f64) -> Mask {
    let (mut min, mut max) = (f64::NEG_INFINITY, f64::INFINITY);
    match metric.better() {
        Better::Larger => min = threshold,
        Better::Smaller => max = threshold,
    }
    Mask { metric, min, max }
}

/// Thresholds that leave about the shares wanted, in three digits as people write them, rounded to the loose side.
fn thresholds(metric: Metric, values: &[f64]) -> Vec<f64> {
    let mut known: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    known.sort_unstable_by(f64::total_cmp);
    let Some(last) = known.len().checked_sub(1) else { return Vec::new() };
    let at = |share: f64| {
        let from_the_best = (share * last as f64).round() as usize;
        match metric.better() {
            Better::Larger => loose(known[last - from_the_best], f64::floor),
            Better::Smaller => loose(known[from_the_best], f64::ceil),
        }
    };
    let mut thresholds: Vec<f64> = SHARES.into_iter().map(at).collect();
    thresholds.dedup();
    thresholds
}

/// In three significant digits.
fn loose(value: f64, towards: fn(f64) -> f64) -> f64 {
    if value == 0.0 {
        return 0.0;
    }
    let digits = 2 - value.abs().log10().floor() as i32;
    let rounded = match digits {
        0.. => towards(value * 10f64.powi(digits)) / 10f64.powi(digits),
        _ => towards(value / 10f64.powi(-digits)) * 10f64.powi(-digits),
    };
    if rounded.is_finite() { rounded } else { value }
}

fn step(fitted: &[Started<'_>], mask: &Mask, threshold: f64) -> Step {
    let mut step = Step { threshold, remaining: 0, sigma_dev: None, radius: None, rejected: 0, views: 0 };
    let (mut squares, mut used, mut radii) = (0.0, 0.0, 0.0);
    for Started { view, near } in fitted {
        let points = kept_points(view, mask);
        step.remaining += points.len();
        let Ok(fit) = fit_feature_near(near, &points) else { continue };
        let count = points.len() as f64;
        squares += fit.sigma_dev * fit.sigma_dev * count;
        radii += fit.radius.unwrap_or(0.0) * count;
        used += count;
        step.rejected += fit.rejected;
        step.views += 1;
    }
    if step.views > 0 {
        step.sigma_dev = Some((squares / used).sqrt());
        step.radius = fitted[0].near.radius().map(|_| radii / used);
    }
    step
}

/// Whether the points that a mask leaves are those of another shape.
fn misfit(fitted: &[Started<'_>], mask: &Mask, step: &Step) -> Option<Knee> {
    let (mut squares, mut used) = (0.0, 0.0);
    for Started { view, near } in fitted {
        let points = kept_points(view, mask);
        let Ok(fit) = fit_feature_near(near, &points) else { continue };
        let Some(noise) = local_scatter(&fit.shape, &points) else { continue };
        squares += noise * noise * points.len() as f64;
        used += points.len() as f64;
    }
    let (sigma_dev, noise) = (step.sigma_dev?, (squares / used).sqrt());
    (sigma_dev > MISFIT * noise).then_some(Knee::Misfit { sigma_dev, noise })
}

/// The points of a view that a mask keeps.
fn kept_points(view: &View, mask: &Mask) -> Vec<Point3> {
    let kept = view.positions.iter().zip(&view.columns[&mask.metric]).filter(|(_, value)| mask.keeps(**value));
    kept.map(|(p, _)| *p).collect()
}

/// The loosest threshold from which on sigma_dev stays within 5 % of its plateau, the least that it comes to.
fn knee(steps: &[Step], points: usize) -> Knee {
    let told: Vec<(usize, f64)> = steps.iter().enumerate().filter_map(|(k, s)| Some((k, s.sigma_dev?))).collect();
    let Some(plateau) = told.iter().map(|(_, s)| *s).min_by(f64::total_cmp) else { return Knee::NotTold };
    let low = told.iter().position(|(_, s)| *s <= WITHIN * plateau).expect("the least one is within");
    let share = steps[told[low].0].remaining as f64 / points as f64;
    match low {
        0 => Knee::NoGain { plateau },
        _ if share < LEAST_SHARE => Knee::TooDear { share, plateau },
        _ => Knee::At { step: told[low].0, plateau },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vector3;
    use crate::plan::merge::FeatureKind;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};
    use std::collections::BTreeMap;

    /// A plane of 8,000 points with noise of 1; the tenth with the least b has noise of 6, and nothing else tells of that.
    fn view(seed: u64) -> View {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut view = View {
            name: format!("view_{seed}"),
            positions: Vec::new(),
            columns: BTreeMap::new(),
            pixels: None,
            sensor: Point3::new(0.0, 0.0, 1000.0),
        };
        let (mut strength, mut other) = (Vec::new(), Vec::new());
        for _ in 0..8000 {
            let b: f32 = rng.random();
            let noise: f64 = StandardNormal.sample(&mut rng);
            let noise = if b < 0.1 { 6.0 * noise } else { noise };
            let [x, y] = [rng.random_range(-100.0..100.0), rng.random_range(-100.0..100.0)];
            // Another pose each: nothing is put together.
            view.positions.push(Point3::new(x, y, 0.1 * x) + Vector3::z() * noise);
            strength.push(b);
            other.push(if rng.random::<f32>() < 0.01 { f32::NAN } else { rng.random() });
        }
        view.columns.insert(Metric::Strength, strength);
        view.columns.insert(Metric::CalibrationDistance, other);
        view
    }

    fn plane() -> MergeFeature {
        MergeFeature { name: "plane 1".into(), kind: FeatureKind::Plane, radius: None, radius_u: 0.0, line: 1 }
    }

    fn study(views: &[View], masks: &[Mask]) -> MaskStudy {
        mask_study(views, &[plane()], masks, &RunContext::silent(), &|_, _| {}).unwrap()
    }

    #[test]
    fn the_knee_lies_where_bad_points_end_and_a_metric_that_tells_nothing_has_none() {
        let views = [view(1), view(2)];
        let own = Mask { metric: Metric::Strength, min: 0.3, max: f64::INFINITY };
        let study = study(&views, &[own]);
        let [b, d_cal] = &study.curves[..] else { panic!("{}", study.curves.len()) };
        let Knee::At { step, plateau } = b.knee else { panic!("{:?}", b.knee) };
        let cut = &b.steps[step];
        // At 8 % out, 2 % of the points have six times the noise: sqrt(1 + 0.02 * 35) = 1.3 and more; at 10 % none.
        assert!((0.075..0.135).contains(&cut.threshold), "{cut:?}");
        assert!(cut.remaining as f64 > 0.86 * 16_000.0);
        // Two sheets of some thousand points tell a sigma to 1 %; the least of some twenty is lower by two of these.
        assert!((plateau - 1.0).abs() < 0.05 && b.steps[0].sigma_dev.unwrap() > 2.0, "{plateau}");
        assert_eq!(b.own.as_ref().unwrap().threshold, 0.3);
        assert!(matches!(d_cal.knee, Knee::NoGain { .. }), "{:?}", d_cal.knee);
        assert!(d_cal.unknown > 50 && d_cal.steps[0].remaining == 16_000 - d_cal.unknown);
        assert!(b.steps.windows(2).all(|w| w[0].threshold < w[1].threshold && w[0].remaining >= w[1].remaining));
        assert!(d_cal.steps.windows(2).all(|w| w[0].threshold > w[1].threshold));
    }

    #[test]
    fn a_plateau_that_costs_most_points_is_told_as_such() {
        let step = |remaining, sigma| Step {
            threshold: 1.0,
            remaining,
            sigma_dev: Some(sigma),
            radius: None,
            rejected: 0,
            views: 1,
        };
        let steps = [step(100, 8.0), step(70, 7.0), step(30, 5.1), step(20, 5.0)];
        assert_eq!(knee(&steps, 100), Knee::TooDear { share: 0.3, plateau: 5.0 });
        assert_eq!(knee(&[], 100), Knee::NotTold);
    }

    /// The same sheets bent, so that a plane lies off them by 54 (0.018 * 100^2 * 0.298), and a metric that keeps the middle six tenths: it lies
    /// off these by 0.36 of that, and they scatter by 2.1 (a tenth has the noise of 6), with cells of 9 on a slope of 1.3 by 4.
    #[test]
    fn nothing_is_suggested_where_the_points_are_of_another_shape() {
        let mut bent = [view(1), view(2)];
        for view in &mut bent {
            view.positions.iter_mut().for_each(|p| p.z += 0.018 * p.x * p.x);
            let is_middle = view.positions.iter().map(|p| if p.x.abs() < 60.0 { 1.0 } else { 0.0 }).collect();
            view.columns.insert(Metric::Strength, is_middle);
        }
        let study = study(&bent, &[]);
        let Knee::Misfit { sigma_dev, noise } = study.curves[0].knee else { panic!("{:?}", study.curves[0].knee) };
        assert!((18.0..22.0).contains(&sigma_dev) && (2.0..5.0).contains(&noise), "{sigma_dev} {noise}");
    }

    #[test]
    fn a_view_that_shows_no_such_feature_is_named() {
        let mut few = view(3);
        few.positions.truncate(2);
        for column in few.columns.values_mut() {
            column.truncate(2);
        }
        let error = mask_study(&[few], &[plane()], &[], &RunContext::silent(), &|_, _| {}).unwrap_err();
        assert!(error.to_string().contains("view_3"), "{error}");
    }

    #[test]
    fn thresholds_are_rounded_to_the_loose_side() {
        assert_eq!(loose(0.001_234_9, f64::floor), 0.001_23);
        assert_eq!(loose(123_456.0, f64::ceil), 124_000.0);
        assert_eq!(loose(-0.012_341, f64::floor), -0.0124);
        assert_eq!(loose(0.0, f64::ceil), 0.0);
    }
}
