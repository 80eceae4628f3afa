//! Registration of two surfaces, and whether they belong together.

use super::Options;
use super::matches::{Group, Match, Posed, Sample, scale, sums};
use super::motion;
use super::observed::Observed;
use super::sampling::picked;
use super::surface::Surface;
use crate::fit::robust::TUKEY_WIDTH_SIGMAS;
use crate::geometry::{Isometry3, Point3};
use crate::plan::short_number;
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
/// Standard deviation of a rim's place in the distance of points, at the least; and of a patch's in the noise of a point, where nothing was measured yet.
const RIM_SIGMA_GRID: f64 = 0.15;
const PATCH_SIGMA: f64 = 0.32;
/// How many times the variance of independent ones that of rims is: neighbours share their points, each is matched both ways, and where rows of pixels run
/// along a rim all its places are off alike.
const RIM_INFLATION: f64 = 20.0;
/// Smooth errors of so much of a point's noise, each over one of so many parts of the overlap, are thought possible: a fit follows them, so
/// that its residuals do not tell of them. The paper's points scatter by 5.5 µm beside and 8 µm with them where nothing is masked.
const SMOOTH_SIGMA: f64 = 0.5;
const SMOOTH_PARTS: f64 = 4.0;
/// The inflation of patches that is taken before it is known.
const FIRST_INFLATION: f64 = 300.0;
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

    /// Distance of points of both.
    fn grid(&self) -> f64 {
        self.a.grid.hypot(self.b.grid)
    }

    /// Rims are not believed to scatter less: there may be few to tell.
    pub(super) fn least_rim_scale(&self) -> f64 {
        RIM_SIGMA_GRID * self.grid()
    }

    /// How many times surer a rim is than a patch is, as long as nothing is measured.
    pub(super) fn first_rim_gain(&self, options: &Options) -> f64 {
        let patch = PATCH_SIGMA * self.noise(options) * FIRST_INFLATION.sqrt();
        patch / (self.least_rim_scale() * RIM_INFLATION.sqrt())
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
    /// Of rims.
    pub rim_scale: f64,
    /// Whether it settled.
    pub settled: bool,
}

/// How an iteration goes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Way {
    /// Width of the weights at the beginning.
    pub width: f64,
    /// The same of rims, and how many times surer they are than patches; 0 where they are not needed.
    pub rim_width: f64,
    pub rim_gain: f64,
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
    let none = f64::INFINITY;
    let mut ended = Ended { b_from_a: *start, scale: none, rim_scale: none, settled: false };
    let mut widths = [way.width, way.rim_width];
    let least = [two.least_scale(options), two.least_rim_scale()];
    for _ in 0..way.most_steps {
        run.check()?;
        let posed = two.posed(&ended.b_from_a, 1.5 * widths[0]);
        let matches = posed.matched(sample);
        let rims = if way.rim_gain > 0.0 { posed.rims(1.5 * widths[1]) } else { Vec::new() };
        let scales = [scale(&matches, widths[0]).max(least[0]), scale(&rims, widths[1]).max(least[1])];
        [ended.scale, ended.rim_scale] = scales;
        let ends = [TUKEY_WIDTH_SIGMAS * scales[0], (TUKEY_WIDTH_SIGMAS * scales[1]).min(way.rim_width)];
        widths[0] = widths[0].max(ends[0].min(way.width));
        let groups = [
            Group { matches: &matches, width: widths[0], gain: 1.0 },
            Group { matches: &rims, width: widths[1], gain: way.rim_gain },
        ];
        let Some(sums) = sums(&groups) else { return Ok(None) };
        let Some(observed) = Observed::of(&sums) else { return Ok(None) };
        let most = 0.5 * if rims.is_empty() { widths[0] } else { widths[0].max(widths[1]) };
        let step = match way.steps {
            Steps::Held => observed.step(most),
            Steps::Free => observed.free_step(most),
        };
        ended.b_from_a = motion::about(&sums.centre, &step) * ended.b_from_a;
        ended.b_from_a.rotation.renormalize();
        let moved = (observed.told * step).norm();
        let narrow = [0, 1].map(|k| widths[k] <= 1.01 * ends[k] || (k == 1 && rims.is_empty()));
        if narrow == [true; 2] && moved < SETTLED * ended.scale {
            ended.settled = true;
            break;
        }
        for k in 0..2 {
            if narrow[k] {
                widths[k] = ends[k];
            } else if moved < SMALL_STEP * widths[k] {
                widths[k] = (SHRINK * widths[k]).max(ends[k]);
            }
        }
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
    /// How many times surer a rim is than a patch; and the robust standard deviation of rims.
    pub rim_gain: f64,
    pub rim_scale: f64,
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
    let last = |ended: &Ended, rim_gain| Way {
        width: (2.0 * TUKEY_WIDTH_SIGMAS * ended.scale).min(way.width),
        rim_width: (2.0 * TUKEY_WIDTH_SIGMAS * ended.rim_scale).min(way.rim_width),
        rim_gain,
        steps: Steps::Held,
        ..way
    };
    let mut gain = way.rim_gain;
    let mut ended = ended;
    // Once more with what the residuals tell of how sure patches and rims are.
    for _ in 0..2 {
        let Some(found) = iterate(two, &sample, &ended.b_from_a, last(&ended, gain), options, run)? else {
            return Ok(nothing_shared());
        };
        ended = found;
        let matches = two.posed(&ended.b_from_a, way.width).matched(&sample);
        let Some((_, known)) = sureness(two, &ended, &matches, options) else { break };
        gain = known;
    }
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
    let width = off.max(least);
    Way { width, rim_width: width, rim_gain: two.first_rim_gain(options), steps: Steps::Held, most_steps: STEPS }
}

/// Evenly taken ones of the overlap, all unless there are very many: every point then counts alike, which those picked by what they hold do not.
fn even(patches: &[u32]) -> Vec<u32> {
    patches.iter().step_by(patches.len().div_ceil(JOINT_PATCHES).max(1)).copied().collect()
}

/// How many times the variance of independent residuals that of patches is, by what patches alone hold; and how many times surer rims are
/// then, one by one: 0 where patches alone hold every motion better than a rim is known.
fn sureness(two: Two, ended: &Ended, matches: &[Match], options: &Options) -> Option<(f64, f64)> {
    let group = Group { matches, width: TUKEY_WIDTH_SIGMAS * ended.scale, gain: 1.0 };
    let sums = sums(&[group])?;
    let observed = Observed::of(&sums)?;
    let side = NEIGHBOURHOOD * two.a.spacing.max(two.b.spacing);
    let variances = observed.variances(&sums.centre, &group, ended.scale, side);
    let independent = observed.independent(ended.scale);
    let (mut ratio, mut held) = (0.0, 0.0);
    for k in 0..6 {
        ratio += observed.held[k] * variances[k] / independent[k];
        held += observed.held[k];
    }
    let seen_inflation = if held > 0.0 { (ratio / held).max(1.0) } else { 1.0 };
    let smooth = SMOOTH_SIGMA * two.noise(options) / ended.scale;
    let inflation = seen_inflation.max(1.0 + smooth * smooth * observed.weight / SMOOTH_PARTS);
    let least_sure = (0..6).map(|k| independent[k] * inflation / observed.held[k]).fold(0.0, f64::max).sqrt();
    if least_sure < two.least_rim_scale() || !ended.rim_scale.is_finite() {
        return Some((inflation, 0.0));
    }
    Some((inflation, ended.scale * inflation.sqrt() / (ended.rim_scale * RIM_INFLATION.sqrt())))
}

fn describe(
    two: Two,
    ended: &Ended,
    overlap: &Sample,
    sample: &Sample,
    reach: f64,
    options: &Options,
) -> Option<Fitted> {
    let posed = two.posed(&ended.b_from_a, reach);
    let matches = posed.matched(sample);
    let (inflation, rim_gain) = sureness(two, ended, &matches, options)?;
    let rim_width = TUKEY_WIDTH_SIGMAS * ended.rim_scale.min(reach);
    let rims = if rim_gain > 0.0 { posed.rims(rim_width) } else { Vec::new() };
    let surface = Group { matches: &matches, width: TUKEY_WIDTH_SIGMAS * ended.scale, gain: 1.0 };
    let sums = sums(&[surface, Group { matches: &rims, width: rim_width, gain: rim_gain }])?;
    let observed = Observed::of(&sums)?;
    let floor = LEAST_U * two.noise(options);
    let floored = observed.independent(ended.scale).map(|v| inflation * v + floor * floor);
    let joint = Sample { a: even(&overlap.a), b: even(&overlap.b) };
    // What neighbours have in common more of them do not make surer.
    let more = (joint.a.len() + joint.b.len()) as f64 / (sample.a.len() + sample.b.len()).max(1) as f64;
    let joint_inflation = 1.0 + (inflation - 1.0) * more.max(1.0);
    Some(Fitted {
        b_from_a: ended.b_from_a,
        centre: sums.centre,
        precision: observed.precision(&floored),
        covariance: observed.covariance(&floored, two.size()),
        held: Matrix6::from_diagonal(&observed.held) * observed.told,
        inflation: joint_inflation,
        rim_gain: rim_gain * (joint_inflation / inflation).sqrt(),
        rim_scale: ended.rim_scale,
        fit: fit_of(two, &matches, overlap, ended.scale, options),
        sample: joint,
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
        let (scale, noise) = (short_number(fit.scale), short_number(noise));
        return Some(format!(
            "their surfaces differ by {scale} (one standard deviation), more than {most} times the noise of their points of {noise}"
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
