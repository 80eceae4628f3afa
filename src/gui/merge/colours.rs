//! The points of a merge and their colours, computed away from the window's thread.

use super::facts::{Done, Merging};
use super::figures::rounded_up;
use super::state::Cloud;
use crate::geometry::{Aabb, Isometry3, Point3, Vector3};
use crate::gui::scene::points::Points;
use crate::plan::merge::{Mask, Metric};
use crate::report::palette::{Palette, Rgb};
use crate::report::view_colours::view_colour;
use crate::run::{Cancelled, RunContext};
use crate::stitch::mask_worth::{Worth, keep};
use crate::stitch::spacing::grid_distance;
use crate::stitch::{View, ViewEnd};
use crate::worker::merge::Preview;
use std::sync::Arc;

/// What the colour of a point tells.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum By {
    /// The view it comes from.
    #[default]
    View,
    /// A metric.
    Metric(Metric),
    /// Its distance from the fitted feature of that number.
    Deviation(usize),
    /// Its difference to the earlier cloud.
    Wear,
}

/// A cloud with what its points are.
#[derive(Debug, Default)]
pub struct CloudPoints {
    /// As it is drawn.
    pub points: Arc<Points>,
    /// Of each point, in the order given, the place of its view among the files; -1 of a mean over several.
    pub view: Vec<i32>,
    /// The middle of each view that has points, in the scene.
    pub labels: Vec<(i32, Point3)>,
}

/// Measured and merged points in one scene.
#[derive(Debug, Default)]
pub struct Scenes {
    /// The views' points.
    pub measured: CloudPoints,
    /// What was merged of them.
    pub merged: Option<CloudPoints>,
    /// Some view stands in its own frame, since nobody knows its pose.
    pub unplaced: bool,
}

/// What scenes are made of: addresses of things that are kept beside it.
#[derive(Debug, Clone)]
pub struct ScenesKey {
    preview: Arc<Preview>,
    done: Option<Arc<Done>>,
}

impl PartialEq for ScenesKey {
    fn eq(&self, other: &Self) -> bool {
        let same_done = match (&self.done, &other.done) {
            (Some(a), Some(b)) => Arc::ptr_eq(a, b),
            (None, None) => true,
            _ => false,
        };
        same_done && Arc::ptr_eq(&self.preview, &other.preview)
    }
}

impl ScenesKey {
    /// Of the merge that is looked at.
    pub fn of(merging: &Merging) -> Option<Self> {
        Some(Self { preview: merging.preview()?.clone(), done: merging.done.clone() })
    }

    /// Where a view stands: as registered, else as it was before.
    fn pose(&self, at: usize) -> Option<Isometry3> {
        let registered = self.done.as_ref().and_then(|done| {
            let result = &done.job.result;
            let file = result.files.get(self.preview.numbers[at])?;
            if file.name != self.preview.views[at].name {
                return None;
            }
            match file.end {
                ViewEnd::Ready(ready) => result.placed.outcomes[ready].world_from_view().copied(),
                ViewEnd::Unusable(_) => None,
            }
        });
        registered.or(self.preview.starts[at])
    }

    /// Computes the scenes.
    ///
    /// # Errors
    /// The job was stopped.
    pub fn compute(&self, run: &RunContext) -> Result<Scenes, Cancelled> {
        let (mut places, mut numbers) = (Vec::new(), Vec::new());
        let (mut towards, mut unplaced) = (Vector3::zeros(), false);
        for (at, view) in self.preview.views.iter().enumerate() {
            run.check()?;
            let pose = self.pose(at);
            unplaced |= pose.is_none();
            let pose = pose.unwrap_or_else(Isometry3::identity);
            let from = places.len();
            places.extend(view.positions.iter().map(|p| pose * p));
            numbers.resize(places.len(), self.preview.numbers[at] as i32);
            towards += (pose * view.sensor - middle(&places[from..])).try_normalize(0.0).unwrap_or_default();
        }
        let merged = self.done.as_ref().map(|done| &done.job.result.merged);
        let ends = |points: &[Point3]| Aabb::of_points(points.iter()).map(|b| vec![b.min, b.max]).unwrap_or_default();
        let frame: Vec<Point3> = [ends(&places), merged.map(|m| ends(&m.positions)).unwrap_or_default()].concat();
        let scene = |places: &[Point3], numbers: Vec<i32>| -> Result<CloudPoints, Cancelled> {
            let spacing = grid_distance(places).ok().flatten().unwrap_or(1e-3 * size(places));
            let points = Points::of(places, &frame, &towards, spacing, run)?;
            let labels = labels(places, &numbers).into_iter().map(|(n, p)| (n, points.in_scene(&p))).collect();
            Ok(CloudPoints { points: Arc::new(points), view: numbers, labels })
        };
        Ok(Scenes {
            measured: scene(&places, numbers)?,
            merged: merged.map(|merged| scene(&merged.positions, merged.view.clone())).transpose()?,
            unplaced,
        })
    }
}

fn middle(points: &[Point3]) -> Point3 {
    let sum: Vector3 = points.iter().map(|p| p.coords).sum();
    Point3::from(sum / points.len().max(1) as f64)
}

fn size(points: &[Point3]) -> f64 {
    Aabb::of_points(points.iter()).map_or(1.0, |b| b.extents().norm())
}

/// Of each view the point nearest to the middle of its own.
fn labels(places: &[Point3], numbers: &[i32]) -> Vec<(i32, Point3)> {
    let mut sums: std::collections::BTreeMap<i32, (Vector3, f64)> = std::collections::BTreeMap::new();
    for (place, number) in places.iter().zip(numbers).filter(|(_, number)| **number >= 0) {
        let sum = sums.entry(*number).or_default();
        *sum = (sum.0 + place.coords, sum.1 + 1.0);
    }
    let mut nearest: std::collections::BTreeMap<i32, (f64, Point3)> = std::collections::BTreeMap::new();
    for (place, number) in places.iter().zip(numbers) {
        let Some((sum, count)) = sums.get(number) else { continue };
        let off = (place.coords - sum / *count).norm_squared();
        let best = nearest.entry(*number).or_insert((off, *place));
        if off < best.0 {
            *best = (off, *place);
        }
    }
    nearest.into_iter().map(|(number, (_, place))| (number, place)).collect()
}

/// What colours are made of.
#[derive(Debug, Clone)]
pub struct ColourKey {
    /// Of which cloud.
    pub cloud: Cloud,
    /// By what.
    pub by: By,
    /// The view that stands out.
    pub chosen: Option<usize>,
    /// Half the range of deviations, where somebody set it.
    pub range: Option<f64>,
    /// What others fade towards.
    pub background: Rgb,
    scenes: Arc<Scenes>,
    of: ScenesKey,
    masks: Vec<Mask>,
    worth: Option<Arc<Worth>>,
}

impl PartialEq for ColourKey {
    fn eq(&self, other: &Self) -> bool {
        let deviation = |key: &Self| matches!(key.by, By::Deviation(_)) && key.cloud == Cloud::Measured;
        let same_worth = match (&self.worth, &other.worth) {
            (Some(a), Some(b)) => Arc::ptr_eq(a, b),
            (None, None) => true,
            _ => false,
        };
        (self.cloud, self.by, self.chosen, self.range, self.background)
            == (other.cloud, other.by, other.chosen, other.range, other.background)
            && Arc::ptr_eq(&self.scenes, &other.scenes)
            && (self.cloud == Cloud::Merged || self.masks == other.masks)
            && (!deviation(self) || same_worth)
    }
}

/// The colours of a cloud, and what its legend says.
#[derive(Debug, Default)]
pub struct Colours {
    /// Of each point in the shuffled order.
    pub colours: Arc<Vec<[u8; 4]>>,
    /// Values at the ends of the scale; none where there is none.
    pub range: Option<[f64; 2]>,
    /// Points over and under the ends.
    pub beyond: [usize; 2],
    /// Points without a value.
    pub none: usize,
}

/// Points of which nothing is known.
pub const NO_VALUE: Rgb = [0x8B, 0x96, 0xA3];

impl ColourKey {
    /// Of what is looked at.
    pub fn of(
        merging: &Merging,
        (of, scenes): &(ScenesKey, Arc<Scenes>),
        (cloud, by): (Cloud, By),
        (chosen, range): (Option<usize>, Option<f64>),
        background: Rgb,
    ) -> Self {
        let worth = merging.latest_worth().cloned();
        let range = range.filter(|_| matches!(by, By::Deviation(_) | By::Wear));
        let (of, scenes, masks) = (of.clone(), scenes.clone(), merging.masks.clone());
        Self { cloud, by, chosen, range, background, scenes, of, masks, worth }
    }

    /// The points that they are of.
    pub fn points(&self) -> Option<&CloudPoints> {
        match self.cloud {
            Cloud::Measured => Some(&self.scenes.measured),
            Cloud::Merged => self.scenes.merged.as_ref(),
        }
    }

    /// Computes them.
    ///
    /// # Errors
    /// The job was stopped.
    pub fn compute(&self, run: &RunContext) -> Result<Colours, Cancelled> {
        let Some(cloud) = self.points() else { return Ok(Colours::default()) };
        let (values, shown) = match self.cloud {
            Cloud::Measured => self.measured(run)?,
            Cloud::Merged => (self.merged(), vec![true; cloud.view.len()]),
        };
        let diverging = matches!(self.by, By::Deviation(_) | By::Wear);
        let range = values.as_ref().map(|values| self.range_of(values, diverging));
        let mut found = Colours { range, ..Colours::default() };
        run.check()?;
        let mut colours = Vec::with_capacity(cloud.view.len());
        for at in cloud.points.order.iter().map(|k| *k as usize) {
            let own = match (&values, range) {
                (Some(values), Some(range)) => found.of_value(values[at], range, diverging, shown[at]),
                _ => of_view(cloud.view[at]),
            };
            let is_chosen = self.chosen.is_none_or(|chosen| cloud.view[at] == chosen as i32);
            let [r, g, b] = if is_chosen { own } else { faded(own, self.background) };
            colours.push([r, g, b, u8::from(shown[at])]);
        }
        found.colours = Arc::new(colours);
        Ok(found)
    }

    /// Values of the measured points, and which of them all masks keep.
    fn measured(&self, run: &RunContext) -> Result<(Option<Vec<f32>>, Vec<bool>), Cancelled> {
        let (mut values, mut shown) = (Vec::new(), Vec::new());
        for (at, view) in self.of.preview.views.iter().enumerate() {
            run.check()?;
            shown.extend(keep(view, &self.masks).0);
            match self.by {
                By::Metric(metric) => match view.columns.get(&metric) {
                    Some(column) => values.extend_from_slice(column),
                    None => values.resize(values.len() + view.positions.len(), f32::NAN),
                },
                By::Deviation(feature) => values.extend(self.off_feature(at, feature, view)),
                By::View | By::Wear => {}
            }
        }
        let values = matches!(self.by, By::Metric(_) | By::Deviation(_)).then_some(values);
        Ok((values, shown))
    }

    /// Distances from the view's own fit.
    fn off_feature(&self, at: usize, feature: usize, view: &View) -> Vec<f32> {
        let shape = self.worth.as_ref().and_then(|w| w.features.get(feature)?.shapes.get(at)?.as_ref());
        match shape {
            Some(shape) => view.positions.iter().map(|p| shape.distance(p) as f32).collect(),
            None => vec![f32::NAN; view.positions.len()],
        }
    }

    fn merged(&self) -> Option<Vec<f32>> {
        let job = &self.of.done.as_ref()?.job;
        let merged = &job.result.merged;
        let unknown = || vec![f32::NAN; merged.positions.len()];
        match self.by {
            By::View => None,
            By::Metric(metric) => Some(merged.columns.get(&metric).cloned().unwrap_or_else(unknown)),
            By::Wear => Some(job.extras.wear.as_ref().map_or_else(unknown, |wear| wear.difference.clone())),
            By::Deviation(feature) => {
                let shape = job.extras.features.get(feature).and_then(|row| row.after.as_ref().ok());
                Some(shape.map_or_else(unknown, |fit| {
                    merged.positions.iter().map(|p| fit.shape.distance(p) as f32).collect()
                }))
            }
        }
    }

    /// How far the worst region of wear stands off: few points, which are what people look for.
    fn worst_region(&self) -> f64 {
        let wear = self.of.done.as_ref().and_then(|done| done.job.extras.wear.as_ref()).filter(|_| self.by == By::Wear);
        wear.map_or(0.0, |wear| wear.regions.iter().map(|region| region.extreme.abs()).fold(0.0, f64::max))
    }

    /// The ends of the scale: of a metric all but the outermost hundredth, of a deviation even about zero.
    fn range_of(&self, values: &[f32], diverging: bool) -> [f64; 2] {
        let step = values.len().div_ceil(100_000).max(1);
        let known = values.iter().step_by(step).filter(|v| v.is_finite());
        let mut few: Vec<f64> = known.map(|v| if diverging { f64::from(v.abs()) } else { f64::from(*v) }).collect();
        few.sort_by(f64::total_cmp);
        let at = |share: f64| few.get((share * few.len().saturating_sub(1) as f64).round() as usize).copied();
        if diverging {
            let usual = at(0.95).unwrap_or(1.0);
            let half = self.range.unwrap_or_else(|| rounded_up(usual.max(self.worst_region())));
            return [-half, half];
        }
        let (low, high) = (at(0.01).unwrap_or(0.0), at(0.99).unwrap_or(1.0));
        if high > low { [low, high] } else { [low - 0.5, low + 0.5] }
    }
}

/// A colour of the scale from 0 to 1.
pub fn of_scale(share: f64, diverging: bool) -> Rgb {
    let palette = if diverging { Palette::default() } else { Palette::Viridis };
    palette.colour(2.0 * share - 1.0)
}

/// The colour of a view, by its place among the files.
pub fn of_view(number: i32) -> Rgb {
    if number < 0 { NO_VALUE } else { view_colour(number) }
}

fn faded(own: Rgb, background: Rgb) -> Rgb {
    std::array::from_fn(|k| ((f64::from(own[k]) + 4.0 * f64::from(background[k])) / 5.0).round() as u8)
}

impl Colours {
    fn of_value(&mut self, value: f32, [low, high]: [f64; 2], diverging: bool, shown: bool) -> Rgb {
        let value = f64::from(value);
        let count = usize::from(shown);
        if value.is_nan() {
            self.none += count;
            return NO_VALUE;
        }
        self.beyond[0] += if value > high { count } else { 0 };
        self.beyond[1] += if value < low { count } else { 0 };
        of_scale(((value - low) / (high - low)).clamp(0.0, 1.0), diverging)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_label_stands_on_its_views_own_points() {
        let ring = |k: usize, far: f64| {
            let angle = k as f64;
            Point3::new(far + angle.cos(), angle.sin(), 0.0)
        };
        let places: Vec<Point3> = (0..200).map(|k| ring(k, if k % 2 == 0 { 0.0 } else { 50.0 })).collect();
        let numbers: Vec<i32> = (0..200).map(|k| if k % 2 == 0 { 3 } else { -1 }).collect();
        let found = labels(&places, &numbers);
        assert_eq!((found.len(), found[0].0), (1, 3));
        assert!(places.contains(&found[0].1));
    }

    #[test]
    fn values_beyond_and_without_are_counted_of_what_is_shown() {
        let mut colours = Colours::default();
        for (value, shown) in [(5.0, true), (5.0, false), (-9.0, true), (f32::NAN, true), (0.5, true)] {
            colours.of_value(value, [0.0, 1.0], false, shown);
        }
        assert_eq!((colours.beyond, colours.none), ([1, 1], 1));
        assert_eq!(colours.of_value(f32::NAN, [0.0, 1.0], true, true), NO_VALUE);
    }
}
