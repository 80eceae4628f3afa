//! All pairs matched again and all views moved together, until nothing moves: what each pair found by itself is not believed any longer.

use super::Options;
use super::matches::{Group, Sample, scale, sums};
use super::motion;
use super::network::{Alone, Anchor, Between, move_views, solve};
use super::normal::Solved;
use super::observed::Observed;
use super::pairwise::Two;
use super::progress::Step;
use super::surface::Surface;
use crate::fit::robust::TUKEY_WIDTH_SIGMAS;
use crate::geometry::{Isometry3, Point3};
use crate::run::{Cancelled, RunContext};
use nalgebra::Vector6;
use rayon::prelude::*;

/// Most rounds of matching and solving.
const ROUNDS: usize = 20;
/// It has settled when no view moves further than this share of the residuals' scale, or than the other share and no less than in the round
/// before: places change their partners for ever.
const SETTLED: f64 = 1e-4;
const STALLED: f64 = 0.05;
/// Of the rounds to come, this part is left after each, for progress only.
const LEFT: f64 = 0.97;

/// A pair that takes part; views by their number among those solved for.
pub(super) struct Joined<'a> {
    pub a: usize,
    pub b: usize,
    pub sample: &'a Sample,
    /// Robust standard deviation of its residuals so far.
    pub scale: f64,
    pub inflation: f64,
    /// Of rims: how many times surer than patches they are, and their robust standard deviation so far.
    pub rim_gain: f64,
    pub rim_scale: f64,
}

/// What the last round solved.
pub(super) struct Refined {
    pub solved: Solved,
    pub between: Vec<Between>,
}

/// Refines poses. `None` where the pairs hold nothing.
pub(super) fn refine(
    surfaces: &[&Surface],
    world_from_view: &mut [Isometry3],
    pairs: &[Joined],
    anchors: &[Anchor],
    options: &Options,
    (run, step): (&RunContext, &Step),
) -> Result<Option<Refined>, Cancelled> {
    let mut refined = None;
    let mut last = f64::INFINITY;
    for _ in 0..ROUNDS {
        run.check()?;
        let poses: &[Isometry3] = world_from_view;
        let found: Vec<Option<(Between, f64)>> =
            pairs.par_iter().map(|pair| term(surfaces, poses, pair, options)).collect();
        let least = found.iter().flatten().map(|(_, scale)| *scale).fold(f64::INFINITY, f64::min);
        let between: Vec<Between> = found.into_iter().flatten().map(|(term, _)| term).collect();
        let middles: Vec<Point3> = poses.iter().zip(surfaces).map(|(pose, s)| pose * s.middle).collect();
        let alone: Vec<Alone> = anchors.iter().map(|a| a.term(poses, &surfaces[a.view].middle)).collect();
        let Some(solved) = solve(&middles, &between, &alone, run)? else { return Ok(refined) };
        move_views(world_from_view, &middles, &solved.motions);
        let moved = |(m, s): (&motion::Motion, &&Surface)| motion::shift(m).norm() + motion::turn(m).norm() * s.extent;
        let most = solved.motions.iter().zip(surfaces).map(moved).fold(0.0, f64::max);
        refined = Some(Refined { solved, between });
        step.leaves(LEFT);
        if most < SETTLED * least || (most < STALLED * least && most > 0.7 * last) {
            break;
        }
        last = most;
    }
    Ok(refined)
}

/// What a pair asks for in given poses, and the scale of its residuals.
fn term(
    surfaces: &[&Surface],
    world_from_view: &[Isometry3],
    pair: &Joined,
    options: &Options,
) -> Option<(Between, f64)> {
    let (a, b) = (&world_from_view[pair.a], &world_from_view[pair.b]);
    let two = Two { a: surfaces[pair.a], b: surfaces[pair.b] };
    let least = two.least_scale(options);
    let wide = 3.0 * TUKEY_WIDTH_SIGMAS * pair.scale.max(least);
    let b_from_a = b.inverse() * a;
    let posed = two.posed(&b_from_a, wide);
    let matches = posed.matched(pair.sample);
    let rim_width = TUKEY_WIDTH_SIGMAS * pair.rim_scale.max(two.least_rim_scale());
    let rims = if pair.rim_gain > 0.0 && rim_width.is_finite() { posed.rims(3.0 * rim_width) } else { Vec::new() };
    let scale = scale(&matches, wide).max(least);
    let sums = sums(&[
        Group { matches: &matches, width: TUKEY_WIDTH_SIGMAS * scale, gain: 1.0 },
        Group { matches: &rims, width: rim_width, gain: pair.rim_gain },
    ])?;
    let observed = Observed::of(&sums)?;
    let variances = observed.seen.map(|seen| pair.inflation.max(1.0) * scale * scale / (seen * observed.weight));
    let along = Vector6::from_fn(|k, _| if observed.held[k] > 0.0 { observed.asked[k] } else { 0.0 });
    let turned = motion::turned(&b.rotation);
    let term = Between {
        a: pair.a,
        b: pair.b,
        centre: b * sums.centre,
        precision: turned * observed.precision(&variances) * turned.transpose(),
        asked: turned * (observed.motions * along),
    };
    Some((term, scale))
}
