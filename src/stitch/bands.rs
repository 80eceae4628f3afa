//! Merging of points that do not all fit into memory: by bands of rank, views fetched one after the other.
//!
//! A point's fate hangs on better ones only. So the best points, as many as there is room for, are decided first; then the views are gone through
//! again: what lies within the radius of a survivor is dropped, and the best of the others are decided, until none is left. Each
//! band is decided as if it were all there is, and what survives is the same as if all points were decided together.

use super::adaptive::{Field, Last, Points, Reach, score_key, survivors_of};
use super::metric::Metric;
use super::shelf::Shelf;
use super::view::View;
use super::{MergeError, StitchError};
use crate::geometry::{Isometry3, Point3};
use crate::run::{Cancelled, RunContext};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Points by which bands are planned, roughly.
const SAMPLED: usize = 1 << 17;
/// A band is planned to be so full, since a sample is not exact.
const FULL: f64 = 0.75;
/// Points that one task looks at: so many words of 64 marks.
const TASK_WORDS: usize = 256;

/// Points from the best to the worst: key of the score, number.
type Place = (u64, u32);

/// The views that are merged, as parts.
pub(super) struct Parts<'a> {
    pub shelf: &'a dyn Shelf,
    /// Of each part: its place on the shelf, its pose, how many points it has.
    pub of: Vec<(usize, Isometry3, usize)>,
    /// By one metric, or by sums over several that are computed already, part by part.
    pub judge: PartJudge,
}

pub(super) enum PartJudge {
    One(Metric),
    Sums(Vec<Vec<f64>>),
}

/// How many points there is room for.
#[derive(Debug, Clone, Copy)]
pub struct Room {
    /// That are decided at once.
    pub band: usize,
    /// That survive.
    pub kept: usize,
}

/// Why it cannot go on.
pub(super) enum BandError {
    Merge(MergeError),
    View(StitchError),
    /// More points survive than there is room for.
    NoRoom,
}

impl From<Cancelled> for BandError {
    fn from(cancelled: Cancelled) -> Self {
        Self::Merge(cancelled.into())
    }
}

impl From<MergeError> for BandError {
    fn from(error: MergeError) -> Self {
        Self::Merge(error)
    }
}

impl From<StitchError> for BandError {
    fn from(error: StitchError) -> Self {
        Self::View(error)
    }
}

/// Points in the order of their numbers.
#[derive(Default)]
struct Band {
    positions: Vec<Point3>,
    scores: Vec<f64>,
    numbers: Vec<u32>,
}

impl Band {
    fn append(&mut self, mut other: Band) {
        self.positions.append(&mut other.positions);
        self.scores.append(&mut other.scores);
        self.numbers.append(&mut other.numbers);
    }
}

impl Points for Band {
    fn parts(&self) -> usize {
        1
    }

    fn count(&self, _: usize) -> usize {
        self.numbers.len()
    }

    fn position(&self, _: usize, index: usize) -> Point3 {
        self.positions[index]
    }

    fn score(&self, _: usize, index: usize) -> f64 {
        self.scores[index]
    }
}

/// A point by which bands are planned.
struct Sample {
    place: Place,
    position: Point3,
}

/// Numbers of the points that survive, rising.
pub(super) fn survivors_in_bands(
    parts: &Parts,
    radius: f64,
    room: Room,
    run: &RunContext,
) -> Result<Vec<u32>, BandError> {
    let count: usize = parts.of.iter().map(|(_, _, count)| count).sum();
    let (mut samples, low, high) = parts.sample(count.div_ceil(SAMPLED).max(1), run)?;
    let field = Field::new(low, high, radius).map_err(MergeError::from)?;
    let sampled = samples.len().max(1);
    let mut marks: Vec<Vec<u64>> = parts.of.iter().map(|(_, _, count)| vec![u64::MAX; count.div_ceil(64)]).collect();
    let (mut kept, mut newest, mut done): (Vec<u32>, Vec<Point3>, Option<Place>) = (Vec::new(), Vec::new(), None);
    loop {
        run.done(1.0 - samples.len() as f64 / sampled as f64);
        let reach = Reach::new(&field, &newest, run)?;
        let mut last = Last::default();
        samples.retain(|s| done.is_none_or(|done| s.place > done) && !reach.any(&s.position, &mut last));
        let wanted = (FULL * room.band as f64 * sampled as f64 / count.max(1) as f64) as usize;
        let mut until = samples.get(wanted).map(|sample| sample.place);
        let band = loop {
            let pass = Pass { parts, done, until, reach: &reach, most: room.band, gathered: AtomicUsize::new(0) };
            match pass.gather(&mut marks, run)? {
                Ok(band) => break band,
                Err(earlier) => until = Some(earlier),
            }
        };
        let survivors = survivors_of(&band, radius, &run.without_share())?;
        newest = survivors.iter().map(|k| band.positions[*k as usize]).collect();
        kept.extend(survivors.iter().map(|k| band.numbers[*k as usize]));
        if kept.len() > room.kept {
            return Err(BandError::NoRoom);
        }
        if until.is_none() {
            break;
        }
        done = until;
    }
    kept.par_sort_unstable();
    Ok(kept)
}

type Sampled = (Vec<Sample>, Point3, Point3);

impl Parts<'_> {
    /// Number of a part's first point.
    fn first(&self, part: usize) -> u32 {
        self.of[..part].iter().map(|(_, _, count)| *count as u32).sum()
    }

    fn score(&self, part: usize, view: &View, index: usize) -> f64 {
        match &self.judge {
            PartJudge::One(metric) => {
                view.columns.get(metric).map_or(f64::NAN, |values| metric.score(f64::from(values[index])))
            }
            PartJudge::Sums(sums) => sums[part][index],
        }
    }

    /// Every so many-th point, the best first; and the corners of all.
    fn sample(&self, step: usize, run: &RunContext) -> Result<Sampled, BandError> {
        let of_part = |part: usize| -> Result<Sampled, BandError> {
            run.check()?;
            let (place, pose, _) = &self.of[part];
            let view = self.shelf.view(*place)?;
            let (mut samples, first) = (Vec::new(), self.first(part) as usize);
            let (mut low, mut high) = corners();
            for (index, position) in view.positions.iter().enumerate() {
                let position = pose * position;
                (low, high) = (low.inf(&position), high.sup(&position));
                let number = first + index;
                if number.is_multiple_of(step) {
                    let place = (score_key(self.score(part, &view, index)), number as u32);
                    samples.push(Sample { place, position });
                }
            }
            Ok((samples, low, high))
        };
        let sampled: Vec<Sampled> = (0..self.of.len()).into_par_iter().map(of_part).collect::<Result<_, _>>()?;
        let (mut samples, (mut low, mut high)) = (Vec::new(), corners());
        for (own, own_low, own_high) in sampled {
            samples.extend(own);
            (low, high) = (low.inf(&own_low), high.sup(&own_high));
        }
        samples.par_sort_unstable_by_key(|sample| sample.place);
        Ok((samples, low, high))
    }
}

fn corners() -> (Point3, Point3) {
    (Point3::from([f64::INFINITY; 3]), Point3::from([f64::NEG_INFINITY; 3]))
}

/// Once through all views.
struct Pass<'a> {
    parts: &'a Parts<'a>,
    /// The last point of the bands before.
    done: Option<Place>,
    /// The last one of this band; none where it holds all that are left.
    until: Option<Place>,
    /// The survivors of the band before.
    reach: &'a Reach<'a>,
    most: usize,
    gathered: AtomicUsize,
}

impl Pass<'_> {
    /// The points of this band. `marks`: a bit for each point, taken away where a survivor drops it. Where the band would hold too many, a place
    /// where it may end instead.
    fn gather(&self, marks: &mut [Vec<u64>], run: &RunContext) -> Result<Result<Band, Place>, BandError> {
        let gathered: Vec<Band> = marks
            .par_iter_mut()
            .enumerate()
            .map(|(part, marks)| self.of_part(part, marks, run))
            .collect::<Result<_, BandError>>()?;
        let mut band = Band::default();
        let count = gathered.iter().map(|part| part.numbers.len()).sum();
        band.positions.reserve_exact(count);
        band.scores.reserve_exact(count);
        band.numbers.reserve_exact(count);
        gathered.into_iter().for_each(|part| band.append(part));
        if count <= self.most {
            return Ok(Ok(band));
        }
        let mut places: Vec<Place> =
            band.scores.iter().zip(&band.numbers).map(|(score, number)| (score_key(*score), *number)).collect();
        let (_, earlier, _) = places.select_nth_unstable(self.most / 2);
        Ok(Err(*earlier))
    }

    fn of_part(&self, part: usize, marks: &mut [u64], run: &RunContext) -> Result<Band, BandError> {
        // One that is too full already is begun again with less.
        if self.gathered.load(Ordering::Relaxed) > self.most {
            return Ok(Band::default());
        }
        let (place, pose, _) = &self.parts.of[part];
        let view = self.parts.shelf.view(*place)?;
        let first = self.parts.first(part);
        let task = |(task, marks): (usize, &mut [u64])| -> Result<Band, BandError> {
            run.check()?;
            let (mut band, mut last) = (Band::default(), Last::default());
            for (word, marks) in marks.iter_mut().enumerate() {
                let from = 64 * (TASK_WORDS * task + word);
                for bit in 0..64_usize.min(view.positions.len() - from) {
                    if *marks >> bit & 1 == 0 {
                        continue;
                    }
                    let (index, number) = (from + bit, first + (from + bit) as u32);
                    let score = self.parts.score(part, &view, index);
                    let place = (score_key(score), number);
                    let position = pose * view.positions[index];
                    if self.done.is_some_and(|done| place <= done) || self.reach.any(&position, &mut last) {
                        *marks &= !(1 << bit);
                    } else if self.until.is_none_or(|until| place <= until) {
                        band.positions.push(position);
                        band.scores.push(score);
                        band.numbers.push(number);
                    }
                }
            }
            Ok(band)
        };
        let tasks: Vec<Band> = marks.par_chunks_mut(TASK_WORDS).enumerate().map(task).collect::<Result<_, _>>()?;
        let mut band = Band::default();
        tasks.into_iter().for_each(|task| band.append(task));
        self.gathered.fetch_add(band.numbers.len(), Ordering::Relaxed);
        Ok(band)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stitch::test_points::scattered;
    use std::borrow::Cow;
    use std::collections::BTreeMap;

    impl Shelf for Vec<View> {
        fn view(&self, k: usize) -> Result<Cow<'_, View>, StitchError> {
            Ok(Cow::Borrowed(&self[k]))
        }
    }

    /// Three views of one place, by a judge.
    fn views(judge: impl Fn(usize, &Point3) -> f32) -> Vec<View> {
        let view = |seed: u64| {
            let positions = scattered(4000 + 7 * seed as usize, seed, [40.0, 30.0, 0.5]);
            let values = positions.iter().enumerate().map(|(k, p)| judge(k, p)).collect();
            let columns = BTreeMap::from([(Metric::CalibrationDistance, values)]);
            View { name: format!("v{seed}"), positions, columns, pixels: None, sensor: Point3::origin() }
        };
        (1..4).map(view).collect()
    }

    /// Noise, a slope through all of it, all alike, and no numbers.
    #[test]
    fn bands_decide_as_if_all_points_were_decided_together() {
        let judges: [fn(usize, &Point3) -> f32; 4] = [
            |k, _| ((k * 7919) % 1009) as f32,
            |_, p| (p.x - 2.0 * p.y) as f32,
            |_, _| 1.0,
            |k, p| if k % 3 == 0 { f32::NAN } else { p.z as f32 },
        ];
        for judge in judges {
            let views = views(judge);
            let of = (0..3).map(|k| (k, Isometry3::translation(0.1 * k as f64, 0.0, 0.0), views[k].positions.len()));
            let judge = PartJudge::One(Metric::CalibrationDistance);
            let parts = Parts { shelf: &views, of: of.collect(), judge };
            let kept = |band: usize| {
                let room = Room { band, kept: 20_000 };
                survivors_in_bands(&parts, 0.8, room, &RunContext::silent()).ok().unwrap()
            };
            let whole = kept(20_000);
            assert!(whole.len() > 500);
            [17, 500, 3000].into_iter().for_each(|band| assert_eq!(kept(band), whole, "{band} at once"));
            let room = Room { band: 500, kept: 100 };
            let none = survivors_in_bands(&parts, 0.8, room, &RunContext::silent());
            assert!(matches!(none, Err(BandError::NoRoom)));
        }
    }
}
