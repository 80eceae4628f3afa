//! Registration of two surfaces, and whether they belong together.

use super::Options;
use super::matches::{Match, Posed, Sample, scale, sums};
use super::motion;
use super::observed::Observed;
use super::sampling::picked;
use super::surface::Surface;
use crate::fit::robust::TUKEY_WIDTH_SIGMAS;
use crate::geometry::{Isometry3, Point3};
use crate::run::{Cancelled, RunContext};
use nalgebra::Matrix6;

/// Patches of each surface that are looked at first, those of the overlap at the end, and those that all views are solved with.
const FIRST_PATCHES: usize = 800;
const LAST_PATCHES: usize = 3000;
const JOINT_PATCHES: usize = 8000;
/// Most steps with the first and with the last patches.
const STEPS: usize = 60;
/// The width shrinks when a step was smaller than this share of it.
const SMALL_STEP: f64 = 0.2;
/// By this.
const SHRINK: f64 = 0.7;
/// A step ends it that displaces the overlap by less than this share of the residuals' scale.
const SETTLED: f64 = 1e-2;
/// Residuals are not believed to scatter less than this share of a point's noise.
const LEAST_SCALE: f64 = 0.02;
/// Patches of a neighbourhood whose errors go together, in their distance.
const NEIGHBOURHOOD: f64 = 5.0;
/// A pair's precision is not believed to be better than this share of a point's noise.
const LEAST_U: f64 = 0.25;
/// What is seen in one place and does not agree with the other view stays below this share, else they are not of one part.
pub(super) const LEAST_AGREEMENT: f64 = 0.6;

/// Which steps are made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Steps {
    /// Along motions that the overlap holds; others stay as they are.
    Held,
    /// Along all, damped: from far away.
    Free,
}

/// Two surfaces, by what they are told apart.
#[derive(Clone, Copy)]
pub(super) struct Two<'a> {
    pub a: &'a Surface,
    pub b: &'a Surface,
}

impl<'t> Two<'t> {
    /// Standard deviation of a point of one about a point of the other.
    pub(super) fn noise(&self, options: &Options) -> f64 {
        let of = |surface: &Surface| options.noise.unwrap_or(surface.noise);
        of(self.a).hypot(of(self.b))
    }

    /// In a pose, matched up to a distance.
    pub(super) fn posed<'p>(self, b_from_a: &'p Isometry3, reach: f64) -> Posed<'p>
    where
        't: 'p,
    {
        Posed { a: self.a, b: self.b, b_from_a, reach }
    }

    /// Size that motions have which nothing holds.
    fn size(&self) -> f64 {
        self.a.half_size().max(self.b.half_size())
    }

    /// Residuals are not believed to scatter less.
    pub(super) fn least_scale(&self, options: &Options) -> f64 {
        (LEAST_SCALE * self.noise(options)).max(1e-6 * self.a.extent.max(self.b.extent))
    }
}

/// Where the iteration ended.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ended {
    pub b_from_a: Isometry3,
    pub scale: f64,
    /// Whether it settled.
    pub settled: bool,
}

/// How an iteration goes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Way {
    /// Width of the weights at the beginning.
    pub width: f64,
    pub steps: Steps,
    pub most_steps: usize,
}

/// Robust symmetric point-to-plane from a start.
pub(super) fn iterate(
    two: Two,
    sample: &Sample,
    start: &Isometry3,
    way: Way,
    options: &Options,
    run: &RunContext,
) -> Result<Option<Ended>, Cancelled> {
    let mut ended = Ended { b_from_a: *start, scale: f64::INFINITY, settled: false };
    let mut width = way.width;
    let least = two.least_scale(options);
    for _ in 0..way.most_steps {
        run.check()?;
        let matches = two.posed(&ended.b_from_a, 1.5 * width).matched(sample);
        ended.scale = scale(&matches, width).max(least);
        let end_width = TUKEY_WIDTH_SIGMAS * ended.scale;
        width = width.max(end_width.min(way.width));
        let Some(sums) = sums(&matches, width) else { return Ok(None) };
        let Some(observed) = Observed::of(&sums) else { return Ok(None) };
        let step = match way.steps {
            Steps::Held => observed.step(0.5 * width),
            Steps::Free => observed.free_step(0.5 * width),
        };
        ended.b_from_a = motion::about(&sums.centre, &step) * ended.b_from_a;
        ended.b_from_a.rotation.renormalize();
        let moved = (observed.told * step).norm();
        let narrow = width <= 1.01 * end_width;
        if narrow && moved < SETTLED * ended.scale {
            ended.settled = true;
            break;
        }
        width = if narrow {
            end_width
        } else if moved < SMALL_STEP * width {
            (SHRINK * width).max(end_width)
        } else {
            width
        };
    }
    Ok(Some(ended))
}

/// Two surfaces registered.
#[derive(Debug, Clone)]
pub(super) struct Fitted {
    pub b_from_a: Isometry3,
    /// Patches of the overlap that are looked at from now on.
    pub sample: Sample,
    /// Middle of the overlap, frame of `b`.
    pub centre: Point3,
    /// Precision of motions of `a` about the centre, frame of `b`; nothing along what is not held.
    pub precision: Matrix6<f64>,
    /// Their covariance; what is not held has the size of the views.
    pub covariance: Matrix6<f64>,
    /// Takes a motion about the centre to its displacements along what the overlap holds.
    pub held: Matrix6<f64>,
    /// How many times the variance of independent residuals that of the pose is.
    pub inflation: f64,
    pub fit: Fit,
}

/// How well two surfaces lie on each other in a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fit {
    /// Share of the smaller view that lies on the other one, and its points.
    pub share: f64,
    pub shared: usize,
    /// Robust standard deviation of the distances of patches.
    pub scale: f64,
    /// Of single points: root mean square of those that agree.
    pub rms: f64,
    /// Mean of the distances of those that agree.
    pub mean: f64,
    /// Share of the matches that agree.
    pub agreement: f64,
}

/// Two surfaces registered from a start, and why they do not belong together if they do not.
pub(super) struct Tried {
    pub fitted: Option<Fitted>,
    pub why_not: Option<String>,
}

/// Registers two surfaces. `way.width` is how far they may lie apart at the beginning.
pub(super) fn register(
    two: Two,
    start: &Isometry3,
    way: Way,
    options: &Options,
    run: &RunContext,
) -> Result<Tried, Cancelled> {
    let few = |surface: &Surface| {
        let count = surface.patches.len();
        let most = FIRST_PATCHES.min(count);
        (0..most).map(|k| (k * count / most) as u32).collect()
    };
    let first = Sample { a: few(two.a), b: few(two.b) };
    let Some(ended) = iterate(two, &first, start, way, options, run)? else { return Ok(nothing_shared()) };
    let overlap = two.posed(&ended.b_from_a, way.width).overlap();
    if overlap.a.len() + overlap.b.len() < 12 {
        return Ok(nothing_shared());
    }
    let sample = Sample { a: picked(two.a, &overlap.a, LAST_PATCHES), b: picked(two.b, &overlap.b, LAST_PATCHES) };
    let last = Way { width: (2.0 * TUKEY_WIDTH_SIGMAS * ended.scale).min(way.width), steps: Steps::Held, ..way };
    let Some(ended) = iterate(two, &sample, &ended.b_from_a, last, options, run)? else {
        return Ok(nothing_shared());
    };
    let Some(fitted) = describe(two, &ended, &overlap, &sample, way.width, options) else {
        return Ok(nothing_shared());
    };
    let why_not = doubt(two, &fitted.fit, options);
    Ok(Tried { fitted: Some(fitted), why_not })
}

fn nothing_shared() -> Tried {
    Tried { fitted: None, why_not: Some("nothing of them lies on each other".to_owned()) }
}

/// The way from a start that is off by no more than a distance, roughly.
pub(super) fn way_from(two: Two, off: f64, options: &Options) -> Way {
    let least = 2.0 * two.a.spacing.max(two.b.spacing) + 5.0 * two.noise(options);
    Way { width: off.max(least), steps: Steps::Held, most_steps: STEPS }
}

/// Evenly taken ones of the overlap, all unless there are very many: every point then counts alike, which those picked by what they hold do not.
fn even(patches: &[u32]) -> Vec<u32> {
    patches.iter().step_by(patches.len().div_ceil(JOINT_PATCHES).max(1)).copied().collect()
}

fn describe(
    two: Two,
    ended: &Ended,
    overlap: &Sample,
    sample: &Sample,
    reach: f64,
    options: &Options,
) -> Option<Fitted> {
    let matches = two.posed(&ended.b_from_a, reach).matched(sample);
    let width = TUKEY_WIDTH_SIGMAS * ended.scale;
    let sums = sums(&matches, width)?;
    let observed = Observed::of(&sums)?;
    let side = NEIGHBOURHOOD * two.a.spacing.max(two.b.spacing);
    let variances = observed.variances(&sums, &matches, width, ended.scale, side);
    let floor = LEAST_U * two.noise(options);
    let floored = variances.map(|v| v + floor * floor);
    let independent = observed.seen.map(|seen| ended.scale * ended.scale / (seen * observed.weight));
    let (mut ratio, mut held) = (0.0, 0.0);
    for k in 0..6 {
        ratio += observed.held[k] * variances[k] / independent[k];
        held += observed.held[k];
    }
    Some(Fitted {
        b_from_a: ended.b_from_a,
        centre: sums.centre,
        precision: observed.precision(&floored),
        covariance: observed.covariance(&floored, two.size()),
        held: Matrix6::from_diagonal(&observed.held) * observed.told,
        inflation: if held > 0.0 { ratio / held } else { 1.0 },
        fit: fit_of(two, &matches, overlap, ended.scale, options),
        sample: Sample { a: even(&overlap.a), b: even(&overlap.b) },
    })
}

/// How well matches of an overlap agree.
pub(super) fn fit_of(two: Two, matches: &[Match], overlap: &Sample, scale: f64, options: &Options) -> Fit {
    let noise = two.noise(options);
    let most = TUKEY_WIDTH_SIGMAS * scale.max(0.5 * noise);
    let most_raw = 5.0 * noise.max(scale);
    let (mut agree, mut sum, mut raws, mut squares) = (0_usize, 0.0, 0_usize, 0.0);
    for m in matches.iter().filter(|m| m.residual.abs() <= most) {
        agree += 1;
        sum += m.residual;
        if m.raw.abs() <= most_raw {
            raws += 1;
            squares += m.raw * m.raw;
        }
    }
    let agreement = if matches.is_empty() { 0.0 } else { agree as f64 / matches.len() as f64 };
    let points = |surface: &Surface| surface.points_of_patch * surface.patches.len() as f64;
    let of_a = points(two.a) <= points(two.b);
    let (smaller, opposite) = if of_a { (two.a, overlap.a.len()) } else { (two.b, overlap.b.len()) };
    let share = agreement * opposite as f64 / smaller.patches.len() as f64;
    let shared = (share * points(smaller)).round() as usize;
    let rms = if raws == 0 { f64::NAN } else { (squares / raws as f64).sqrt() };
    let mean = if agree == 0 { f64::NAN } else { sum / agree as f64 };
    Fit { share, shared, scale, rms, mean, agreement }
}

/// Why two surfaces that lie like this do not belong together, if so.
fn doubt(two: Two, fit: &Fit, options: &Options) -> Option<String> {
    let (noise, most) = (two.noise(options), options.most_residual);
    if fit.scale > most * noise {
        let scale = fit.scale;
        return Some(format!(
            "their surfaces differ by {scale:.3e} (one standard deviation), more than {most} times the noise of their points of {noise:.3e}"
        ));
    }
    if fit.agreement < LEAST_AGREEMENT {
        let (found, least) = (100.0 * fit.agreement, 100.0 * LEAST_AGREEMENT);
        return Some(format!(
            "only {found:.0} % of what both see in the same place agrees, expected at least {least:.0} %"
        ));
    }
    if fit.share < options.least_share {
        let (found, least) = (100.0 * fit.share, 100.0 * options.least_share);
        return Some(format!("they share {found:.1} % of the smaller view, expected at least {least:.0} %"));
    }
    None
}
