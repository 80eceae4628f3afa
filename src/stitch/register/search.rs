//! Registration of two surfaces of which nothing is known: many starts, and a margin between the best pose and any other one.
//!
//! Starts are turns up to 20 degrees about the middle and offsets up to 0.6 of the size, from where the views are and from where their middles
//! coincide. What counts for a pose is what agrees; what one view sees where the other one sees something else counts against it, so that a
//! pose is not better by sliding two smooth sheets over each other.

use super::Options;
use super::matches::Sample;
use super::motion;
use super::pairwise::{Ended, Fitted, Steps, Tried, Two, Way, iterate, register};
use super::surface::Surface;
use crate::fit::robust::TUKEY_WIDTH_SIGMAS;
use crate::geometry::{Isometry3, Vector3};
use crate::plan::short_number;
use crate::run::{Cancelled, RunContext};
use nalgebra::{Translation3, UnitQuaternion};
use rayon::prelude::*;

/// Patches of a coarse surface.
pub(super) const COARSE_PATCHES: usize = 500;
/// Steps of the lattice of turns, rad, and of offsets, in the size; each lattice reaches two steps far.
const TURN_STEP: f64 = 10.0 * std::f64::consts::PI / 180.0;
const OFFSET_STEP: f64 = 0.3;
/// Starts that are followed, and those followed to their end.
const FOLLOWED: usize = 64;
const FINISHED: usize = 8;
const COARSE_STEPS: usize = 25;
const FINE_STEPS: usize = 60;
/// Patches of each view by which poses are compared.
const COMPARED: usize = 1500;
/// Another pose that explains this much of what the best one does is as good as that.
const MARGIN: f64 = 0.8;
/// Poses are distinct when they differ by this many distances of patches along what the overlap holds.
const DISTINCT: f64 = 3.0;

/// Two views, fine and coarse.
pub(super) struct Scales<'a> {
    pub fine: Two<'a>,
    pub coarse: Two<'a>,
}

/// Registers two views from anywhere near.
pub(super) fn search(scales: &Scales, options: &Options, run: &RunContext) -> Result<Tried, Cancelled> {
    let coarse = scales.coarse;
    let reach = 2.0 * coarse.a.spacing.max(coarse.b.spacing);
    let starts = starts(coarse);
    let scored: Vec<(f64, Isometry3)> = starts.par_iter().map(|start| (score(coarse, start, reach), *start)).collect();
    run.check()?;
    let followed: Vec<Option<Ended>> = distinct(coarse, scored, 0.5 * reach, FOLLOWED)
        .par_iter()
        .map(|start| follow(coarse, start, reach, options, run))
        .collect::<Result<_, Cancelled>>()?;
    let ends: Vec<(f64, Isometry3)> = followed
        .into_iter()
        .flatten()
        .map(|ended| (score(coarse, &ended.b_from_a, 0.5 * reach), ended.b_from_a))
        .collect();
    let rim_gain = scales.fine.first_rim_gain(options);
    let width = 0.5 * reach;
    let way = Way { width, rim_width: width, rim_gain, steps: Steps::Free, most_steps: FINE_STEPS };
    let finished: Vec<Tried> = distinct(coarse, ends, 0.25 * reach, FINISHED)
        .par_iter()
        .map(|start| register(scales.fine, start, way, options, run))
        .collect::<Result<_, Cancelled>>()?;
    Ok(chosen(scales.fine, finished, reach, options))
}

fn follow(
    coarse: Two,
    start: &Isometry3,
    reach: f64,
    options: &Options,
    run: &RunContext,
) -> Result<Option<Ended>, Cancelled> {
    let way = Way { width: reach, rim_width: reach, rim_gain: 1.0, steps: Steps::Free, most_steps: COARSE_STEPS };
    iterate(coarse, &both(coarse, usize::MAX), start, way, options, run)
}

/// Evenly taken patches of both.
fn both(two: Two, most: usize) -> Sample {
    let few = |surface: &Surface| {
        let step = surface.patches.len().div_ceil(most).max(1);
        (0..surface.patches.len() as u32).step_by(step).collect()
    };
    Sample { a: few(two.a), b: few(two.b) }
}

/// Start poses `b_from_a`.
fn starts(two: Two) -> Vec<Isometry3> {
    let size = two.a.half_size().min(two.b.half_size());
    let lattice = || {
        let steps = (-2..=2).flat_map(|x| (-2..=2).flat_map(move |y| (-2..=2).map(move |z| [x, y, z])));
        steps.filter(|[x, y, z]| x * x + y * y + z * z <= 4).map(|v| Vector3::from(v.map(f64::from)))
    };
    let mut starts = Vec::new();
    let middle = two.a.middle;
    for to in [middle, two.b.middle] {
        for turn in lattice() {
            let turned = UnitQuaternion::from_scaled_axis(turn * TURN_STEP);
            for offset in lattice() {
                let place = Translation3::from(to.coords + offset * (OFFSET_STEP * size));
                starts.push(place * turned * Translation3::from(-middle.coords));
            }
        }
    }
    starts
}

/// Share of the patches of `a` that lie on `b`, nearer ones counting more.
fn score(two: Two, b_from_a: &Isometry3, reach: f64) -> f64 {
    let sample = Sample { a: (0..two.a.patches.len() as u32).collect(), b: Vec::new() };
    let matches = two.posed(b_from_a, reach).matched(&sample);
    matches.iter().map(|m| 1.0 - (m.residual / reach).powi(2)).sum::<f64>() / two.a.patches.len() as f64
}

/// The best poses that differ from each other by more than a distance, the best first.
fn distinct(two: Two, mut scored: Vec<(f64, Isometry3)>, apart: f64, most: usize) -> Vec<Isometry3> {
    scored.sort_by(|x, y| y.0.total_cmp(&x.0));
    let mut kept: Vec<Isometry3> = Vec::new();
    for (score, pose) in scored {
        if kept.len() == most {
            break;
        }
        let differs = |other: &Isometry3| {
            let between = pose * other.inverse();
            let at = other * two.a.middle;
            (between * at - at).norm().hypot(between.rotation.angle() * two.a.extent) > apart
        };
        if score > 0.0 && kept.iter().all(differs) {
            kept.push(pose);
        }
    }
    kept
}

/// The pose that explains most, unless another one does nearly as well.
fn chosen(two: Two, finished: Vec<Tried>, reach: f64, options: &Options) -> Tried {
    let (found, lost): (Vec<Tried>, Vec<Tried>) = finished.into_iter().partition(|tried| tried.fitted.is_some());
    let sharpest = found.iter().flat_map(|t| &t.fitted).map(|f| f.fit.scale).fold(f64::INFINITY, f64::min);
    let tolerance = TUKEY_WIDTH_SIGMAS * sharpest.max(0.5 * two.noise(options));
    let sample = both(two, COMPARED);
    let explained = |fitted: &Fitted| -> f64 {
        let matches = two.posed(&fitted.b_from_a, reach).matched(&sample);
        matches.iter().map(|m| 1.0 - (m.residual / tolerance).powi(2).min(2.0)).sum()
    };
    let mut ranked: Vec<(f64, Tried)> =
        found.into_iter().map(|tried| (tried.fitted.as_ref().map_or(0.0, explained), tried)).collect();
    ranked.sort_by(|x, y| y.0.total_cmp(&x.0));
    let mut ranked = ranked.into_iter();
    let Some((most, mut best)) = ranked.next() else {
        let none =
            Tried { fitted: None, why_not: Some("no pose was found in which they lie on each other".to_owned()) };
        return lost.into_iter().next().unwrap_or(none);
    };
    let spacing = two.a.spacing.max(two.b.spacing);
    let other = ranked.find(|(_, tried)| {
        let both = best.fitted.as_ref().zip(tried.fitted.as_ref());
        both.is_some_and(|(best, other)| apart(best, other) > DISTINCT * spacing)
    });
    if let Some((second, tried)) = other.filter(|(second, _)| *second > MARGIN * most)
        && best.why_not.is_none()
    {
        best.why_not = Some(ambiguous(&best, &tried, second / most));
    }
    best
}

/// How far two poses are apart along what the overlap in the first one holds.
fn apart(best: &Fitted, other: &Fitted) -> f64 {
    let between = other.b_from_a * best.b_from_a.inverse();
    (best.held * motion::screw(&between, &best.centre)).norm()
}

fn ambiguous(best: &Tried, other: &Tried, ratio: f64) -> String {
    let Some((best, other)) = best.fitted.as_ref().zip(other.fitted.as_ref()) else { return String::new() };
    let between = other.b_from_a * best.b_from_a.inverse();
    let (angle, distance) =
        (between.rotation.angle().to_degrees(), short_number((between * best.centre - best.centre).norm()));
    let (ratio, limit) = (100.0 * ratio, 100.0 * MARGIN);
    format!(
        "two poses explain them alike, {distance} and {angle:.2} degrees apart: the second one explains {ratio:.0} % of what the first one \
         does, at most {limit:.0} % is allowed; give their poses"
    )
}
