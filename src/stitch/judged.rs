//! The points of placed views with their scores, as merging looks at them: nothing of them is copied.

use super::adaptive::Points;
use super::metric::{Metric, rank_sum};
use super::place::PlacedViews;
use super::view::View;
use crate::geometry::{Isometry3, Point3};

/// The merged views as parts, in the world.
pub(super) struct Judged<'a> {
    views: Vec<(&'a View, &'a Isometry3)>,
    scores: Scores<'a>,
}

/// The larger the better.
enum Scores<'a> {
    /// A metric's own, of the views that know it.
    One(Metric, Vec<Option<&'a [f32]>>),
    /// Of several metrics together, view by view.
    Sum(Vec<Vec<f64>>),
}

impl<'a> Judged<'a> {
    pub fn new(placed: &'a PlacedViews, metrics: &[Metric]) -> Self {
        let views: Vec<_> = placed.merged().map(|(_, view, pose)| (view, pose)).collect();
        let scores = if let [metric] = metrics {
            Scores::One(*metric, views.iter().map(|(view, _)| view.columns.get(metric).map(Vec::as_slice)).collect())
        } else {
            let columns: Vec<(Metric, Vec<f32>)> =
                metrics.iter().map(|metric| (*metric, super::merging::column(placed, *metric))).collect();
            let columns: Vec<(Metric, &[f32])> = columns.iter().map(|(m, values)| (*m, values.as_slice())).collect();
            let counts = views.iter().map(|(view, _)| view.positions.len());
            Scores::Sum(by_part(&rank_sum(&columns), counts))
        };
        Self { views, scores }
    }
}

/// Values of all points, part by part.
pub(super) fn by_part(values: &[f64], counts: impl Iterator<Item = usize>) -> Vec<Vec<f64>> {
    let mut rest = values;
    let part = |count: usize| {
        let (part, after) = rest.split_at(count);
        rest = after;
        part.to_vec()
    };
    counts.map(part).collect()
}

impl Points for Judged<'_> {
    fn parts(&self) -> usize {
        self.views.len()
    }

    fn count(&self, part: usize) -> usize {
        self.views[part].0.positions.len()
    }

    fn position(&self, part: usize, index: usize) -> Point3 {
        let (view, world_from_view) = self.views[part];
        world_from_view * view.positions[index]
    }

    fn score(&self, part: usize, index: usize) -> f64 {
        match &self.scores {
            Scores::One(metric, columns) => columns[part].map_or(f64::NAN, |c| metric.score(f64::from(c[index]))),
            Scores::Sum(sums) => sums[part][index],
        }
    }
}
