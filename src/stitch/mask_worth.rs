//! What the masks at hand are worth, all of them together: the points that they leave, and how much those scatter about a feature.
//!
//! As in [`super::mask_study`] every view is fitted by itself, so that neither poses nor registration are in the figures.

use super::feature::{fit_feature_near, fit_kind};
use super::mask::kept;
use super::view::View;
use crate::fit::Fitted;
use crate::fit::two_step::near_shape;
use crate::geometry::Point3;
use crate::plan::merge::{Mask, MergeFeature, Metric};
use crate::run::{Cancelled, RunContext};
use rayon::prelude::*;

/// Points that are fitted in all; of more a fixed part of each view, so that the figures follow a hand on a slider.
const MOST_FITTED: usize = 200_000;

/// A shape near the points of each view, by feature; none where no such shape fits the view.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Starts(Vec<Vec<Option<Fitted>>>);

impl Starts {
    /// Of all points of each view.
    ///
    /// # Errors
    /// The job was stopped.
    pub fn of(views: &[View], features: &[MergeFeature], run: &RunContext) -> Result<Self, Cancelled> {
        let of_view = |kind, view: &View| {
            run.check()?;
            Ok(near_shape(kind, &view.positions).ok())
        };
        let of_feature = |feature: &MergeFeature| {
            views.par_iter().map(|view| of_view(fit_kind(feature.kind), view)).collect::<Result<Vec<_>, Cancelled>>()
        };
        features.iter().map(of_feature).collect::<Result<_, _>>().map(Self)
    }
}

/// What masks leave.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Worth {
    /// Points of each view that all masks keep. None of a view that does not know a masked metric.
    pub kept: Vec<usize>,
    /// Points of all views that each mask keeps by itself, in the order of the masks.
    pub kept_by: Vec<usize>,
    /// By feature.
    pub features: Vec<FeatureWorth>,
    /// One point in how many was fitted; 1 = all of them.
    pub fitted_every: usize,
}

/// How what is left scatters about a feature.
#[derive(Debug, Clone, PartialEq)]
pub struct FeatureWorth {
    /// Standard deviation about the views' own fits; none where no view can be fitted.
    pub sigma_dev: Option<f64>,
    /// Fitted radius, the mean over views weighted by their points.
    pub radius: Option<f64>,
    /// The fit of each view, its own frame.
    pub shapes: Vec<Option<Fitted>>,
}

/// Which points of a view all masks keep, and how many each keeps by itself.
pub fn keep(view: &View, masks: &[Mask]) -> (Vec<bool>, Vec<usize>) {
    let count = view.positions.len();
    if masks.iter().any(|mask| !view.columns.contains_key(&mask.metric)) {
        let by = |mask: &Mask| view.columns.get(&mask.metric).map_or(0, |values| keeps(mask, values));
        return (vec![false; count], masks.iter().map(by).collect());
    }
    let column = |metric: Metric| view.columns.get(&metric).map_or(&[][..], Vec::as_slice);
    let (keep, left_out) = kept(count, masks, column);
    (keep, left_out.into_iter().map(|left_out| count - left_out).collect())
}

fn keeps(mask: &Mask, values: &[f32]) -> usize {
    values.iter().filter(|value| mask.keeps(**value)).count()
}

/// What the masks leave of the views.
///
/// # Errors
/// The job was stopped.
pub fn worth(views: &[View], starts: &Starts, masks: &[Mask], run: &RunContext) -> Result<Worth, Cancelled> {
    let all: usize = views.iter().map(|view| view.positions.len()).sum();
    let fitted_every = all.div_ceil(MOST_FITTED).max(1);
    let of_view = |(index, view): (usize, &View)| {
        run.check()?;
        let (keep, by) = keep(view, masks);
        let left = keep.iter().filter(|keep| **keep).count();
        let some = view.positions.iter().zip(&keep).step_by(fitted_every);
        let points: Vec<Point3> = some.filter(|(_, keep)| **keep).map(|(p, _)| *p).collect();
        let mut fits = Vec::new();
        for near in &starts.0 {
            run.check()?;
            fits.push(near[index].as_ref().and_then(|near| fit_feature_near(near, &points).ok()));
        }
        Ok((left, by, fits))
    };
    let views: Vec<_> = views.par_iter().enumerate().map(of_view).collect::<Result<_, Cancelled>>()?;
    let kept_by = (0..masks.len()).map(|k| views.iter().map(|(_, by, _)| by[k]).sum()).collect();
    let features = (0..starts.0.len()).map(|feature| {
        let (mut squares, mut radii, mut used) = (0.0, 0.0, 0.0);
        let fits = views.iter().map(|(_, _, fits)| fits[feature].as_ref());
        for fit in fits.clone().flatten() {
            let count = fit.points as f64;
            squares += fit.sigma_dev * fit.sigma_dev * count;
            radii += fit.radius.unwrap_or(f64::NAN) * count;
            used += count;
        }
        FeatureWorth {
            sigma_dev: (used > 0.0).then(|| (squares / used).sqrt()),
            radius: Some(radii / used).filter(|radius| radius.is_finite()),
            shapes: fits.map(|fit| fit.map(|fit| fit.shape)).collect(),
        }
    });
    let features = features.collect();
    Ok(Worth { kept: views.iter().map(|(kept, ..)| *kept).collect(), kept_by, features, fitted_every })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::merge::FeatureKind;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use std::collections::BTreeMap;

    /// A plane with noise that grows with d_cal: a grid of 60 by 60, its heights anywhere within a fifth of d_cal.
    fn plane(tilt: f64) -> View {
        let cell = |k: usize| (k / 60, k % 60);
        let d_cal = |k: usize| cell(k).0 as f32;
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let mut place = |k: usize| {
            let (x, y) = (cell(k).0 as f64, cell(k).1 as f64);
            Point3::new(x, y, tilt * x + 0.2 * x * rng.random_range(-1.0..1.0))
        };
        View {
            name: "v".into(),
            positions: (0..3600).map(&mut place).collect(),
            columns: BTreeMap::from([(Metric::CalibrationDistance, (0..3600).map(d_cal).collect())]),
            pixels: None,
            sensor: Point3::new(0.0, 0.0, 100.0),
        }
    }

    fn feature() -> MergeFeature {
        MergeFeature { name: "f".into(), kind: FeatureKind::Plane, radius: None, radius_u: 0.0, line: 1 }
    }

    #[test]
    fn masks_together_leave_what_the_study_of_one_says_and_scatter_falls() {
        let views = [plane(0.0), plane(0.3)];
        let run = RunContext::silent();
        let starts = Starts::of(&views, &[feature()], &run).unwrap();
        let mask = |max| Mask { metric: Metric::CalibrationDistance, min: f64::NEG_INFINITY, max };
        let all = worth(&views, &starts, &[], &run).unwrap();
        assert_eq!((all.kept.as_slice(), all.kept_by.len()), (&[3600, 3600][..], 0));
        let masked = worth(&views, &starts, &[mask(29.0)], &run).unwrap();
        assert_eq!((masked.kept.as_slice(), masked.kept_by.as_slice()), (&[1800, 1800][..], &[3600][..]));
        // Heights are off by 0.2 x / sqrt(3) on average: over 0..30 that is 0.2 * sqrt(29 * 59 / 18) = 1.95, of 1800 numbers known to 2 %. A tilted
        // plane is nearer by its cosine, 0.958.
        let level = 1.95 * ((1.0 + 0.958f64.powi(2)) / 2.0).sqrt();
        let sigma = masked.features[0].sigma_dev.unwrap();
        assert!((sigma / level - 1.0).abs() < 0.06, "{sigma} {level}");
        assert!(all.features[0].sigma_dev.unwrap() > 1.8 * sigma);
        assert!(masked.features[0].shapes.iter().all(Option::is_some) && masked.features[0].radius.is_none());
        // The study of that metric says the same at that threshold.
        let study =
            super::super::mask_study::mask_study(&views, &[feature()], &[mask(29.0)], &run, &|_, _| {}).unwrap();
        let own = study.curves[0].own.as_ref().unwrap();
        assert_eq!((own.remaining, own.sigma_dev), (3600, masked.features[0].sigma_dev));
    }

    #[test]
    fn a_view_without_the_metric_keeps_nothing_as_the_merge_leaves_it_out() {
        let views = [plane(0.0), View { columns: BTreeMap::new(), ..plane(0.0) }];
        let run = RunContext::silent();
        let starts = Starts::of(&views, &[feature()], &run).unwrap();
        let mask = Mask { metric: Metric::CalibrationDistance, min: f64::NEG_INFINITY, max: 29.0 };
        let found = worth(&views, &starts, &[mask], &run).unwrap();
        assert_eq!((found.kept, found.kept_by), (vec![1800, 0], vec![1800]));
        assert_eq!(found.features[0].shapes[1], None);
    }
}
