//! Robust point-to-plane registration to one face, in the CAD frame.
//!
//! Minimises the sum of Tukey's biweight of the distances of points to the face (after Bergström and Edlund 2014, 2017):
//! residual `r = n . (p - c)` with `c` the closest place and `n` its outward normal, weight from the full distance
//! `|p - c|`, points beyond a trimmed edge without weight (they know nothing about the surface). Each step solves
//!
//! ```text
//! (H + lambda P) x = -g,   H = sum w J'J,  P = sum w A'A,  J = [q x n; n],  A = [-[q]x  I],  q = p - centroid
//! ```
//!
//! where P is the normal matrix of the point-to-point problem, so that `x' P x` is the weighted sum of squared displacements.
//! Lambda is the smallest of a ladder for which that sum does not exceed the weighted sum of squared point-to-point
//! distances: a point-to-plane step moves no further than the points are off, or than a fraction of the width (trust region). The biweight's width
//! shrinks only after a step that was small compared with it, very small near the end; shrinking at every step loses poses.

use super::rim::RimLock;
use crate::fit::robust::{SIGMA_OF_MAD, TUKEY_WIDTH_SIGMAS, middle_value, tukey_weight_of_square};
use crate::geometry::{Isometry3, Point3, UnitVector3, Vector3, decompose};
use crate::part::Face;
use crate::run::{Cancelled, RunContext};
use nalgebra::{Matrix6, Translation3, UnitQuaternion, Vector6};
use rayon::prelude::*;

/// Points in one summand of the ordered reduction.
const CHUNK: usize = 512;
/// Below this width the pose must have settled before the width shrinks further: most of a flat part fits in any place, so the
/// robust scale is small long before the few slopes that hold the part in its plane are within it.
const CAREFUL_MM: f64 = 2.5;
/// Steps up to this share of the width are always free: they leave every point within reach of its place. Without that a
/// nearly flat part creeps, since its distances are far smaller than its way along the surface.
const FREE_SHARE: f64 = 0.25;
/// The least damping: keeps motions in which the face slides on itself at rest.
const LADDER: [f64; 6] = [1e-6, 1e-3, 1e-2, 1e-1, 1.0, 10.0];

/// What points do whose closest place is on a trimmed edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Beyond {
    /// Nothing: they know nothing about the surface.
    Nothing,
    /// They pull towards the edge, point to point. Far from the answer that is what moves a flat part.
    Pull,
}

/// How a registration goes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Settings {
    /// Most steps.
    pub steps: usize,
    /// Width of the biweight at the start, mm.
    pub width_mm: f64,
    /// Smallest robust standard deviation believed, mm.
    pub least_scale_mm: f64,
    /// Ends when no corner of the points' box moves further, mm.
    pub stop_mm: f64,
    /// What points beyond a trimmed edge do.
    pub beyond: Beyond,
    /// A rotation axis through the points' centroid (CAD frame) about which nothing may turn.
    pub locked_axis: Option<UnitVector3>,
}

/// Where it ended.
#[derive(Debug, Clone)]
pub(super) struct Registered {
    /// The pose.
    pub cad_from_work: Isometry3,
    /// Last width, mm.
    pub width_mm: f64,
    /// Robust standard deviation of the residuals, mm.
    pub scale_mm: f64,
    /// Weighted rms of the points within the width, mm.
    pub rms_mm: f64,
    /// Points within the width / points.
    pub inlier_ratio: f64,
    /// Whether it ended because nothing moved any more, in the final width, and not because its steps ran out.
    pub converged: bool,
    /// Whether the width had come to its end, to a hundredth.
    pub final_width: bool,
    /// What its steps left undone, CAD frame: the last of them, as often as it would be repeated if each were shorter than the
    /// one before by the same ratio for ever. `None` where no step could be made.
    pub unfinished: Option<Isometry3>,
    /// Standard deviation of the least certain motion (mm at half the points' extent) that 600 points with residuals of
    /// 0.1 mm would leave, from the surface alone.
    pub weakest_mm: f64,
}

/// One point against the face.
pub(super) struct Pair {
    pub at: Point3,
    pub normal: Vector3,
    pub residual_mm: f64,
    pub distance_sq: f64,
    /// Whether it says anything: within reach and not past a trimmed edge.
    pub counts: bool,
    pulls: bool,
}

/// Sums over pairs.
#[derive(Clone)]
pub(super) struct Sums {
    pub h: Matrix6<f64>,
    /// The part of `h` that comes from the surface alone.
    pub surface: Matrix6<f64>,
    pub g: Vector6<f64>,
    pub p: Matrix6<f64>,
    pub weight: f64,
    pub distance_sq: f64,
}

impl Sums {
    pub(super) fn zero() -> Self {
        Self {
            h: Matrix6::zeros(),
            surface: Matrix6::zeros(),
            g: Vector6::zeros(),
            p: Matrix6::zeros(),
            weight: 0.0,
            distance_sq: 0.0,
        }
    }

    /// Adds one residual along a direction, at a place relative to the centre of rotation; what it added to `h`.
    pub(super) fn add(&mut self, q: &Vector3, direction: &Vector3, residual_mm: f64, weight: f64) -> Matrix6<f64> {
        let turn = q.cross(direction);
        let j = Vector6::new(turn.x, turn.y, turn.z, direction.x, direction.y, direction.z);
        let added = j * j.transpose() * weight;
        self.h += added;
        self.g += j * (residual_mm * weight);
        added
    }

    /// Adds one displacement to the trust region's measure.
    fn add_displacement(&mut self, q: &Vector3, distance_sq: f64, weight: f64) {
        let turn = q.cross_matrix();
        let square = -(turn * turn);
        let mut p = self.p.fixed_view_mut::<3, 3>(0, 0);
        p += square * weight;
        let mut p = self.p.fixed_view_mut::<3, 3>(0, 3);
        p += turn * weight;
        let mut p = self.p.fixed_view_mut::<3, 3>(3, 0);
        p -= turn * weight;
        let mut p = self.p.fixed_view_mut::<3, 3>(3, 3);
        p += nalgebra::Matrix3::identity() * weight;
        self.weight += weight;
        self.distance_sq += weight * distance_sq;
    }

    fn plus(mut self, other: &Self) -> Self {
        self.h += other.h;
        self.surface += other.surface;
        self.g += other.g;
        self.p += other.p;
        self.weight += other.weight;
        self.distance_sq += other.distance_sq;
        self
    }
}

/// Registers points (work frame) to a face from a start pose. `seeds` keeps each point's last triangle between calls.
pub(super) fn register(
    face: &Face,
    points: &[Point3],
    start: &Isometry3,
    settings: &Settings,
    rim: Option<&RimLock>,
    run: &RunContext,
) -> Result<Registered, Cancelled> {
    let mut pose = *start;
    let mut width = settings.width_mm;
    let mut seeds = vec![u32::MAX; points.len()];
    let mut out = Registered {
        cad_from_work: pose,
        width_mm: width,
        scale_mm: f64::NAN,
        rms_mm: f64::NAN,
        inlier_ratio: 0.0,
        converged: false,
        final_width: false,
        unfinished: None,
        weakest_mm: f64::INFINITY,
    };
    let extent = half_extent(points);
    let mut last_moved = f64::INFINITY;
    for _ in 0..settings.steps {
        run.check()?;
        let pairs = pairs_of(face, points, &pose, 1.5 * width, settings.beyond, &mut seeds);
        let scale = robust_scale(&pairs, 2.0 * width).max(settings.least_scale_mm);
        let end_width = TUKEY_WIDTH_SIGMAS * scale;
        width = width.max(end_width.min(settings.width_mm));
        let centre = centroid(&pairs, width);
        let mut sums = pairs
            .par_chunks(CHUNK)
            .map(|chunk| summed(chunk, &centre, width))
            .collect::<Vec<_>>()
            .iter()
            .fold(Sums::zero(), |total, part| total.plus(part));
        if sums.weight < 1e-9 {
            out.unfinished = None;
            break;
        }
        note_quality(&mut out, &pairs, width, scale, &sums, extent);
        if let Some(rim) = rim {
            rim.add_to(&mut sums, &pose, &centre, scale);
        }
        if let Some(axis) = &settings.locked_axis {
            lock(&mut sums, axis);
        }
        let Some(step) = trusted_step(&sums, FREE_SHARE * width) else {
            out.unfinished = None;
            break;
        };
        pose = motion_about(&centre, &step) * pose;
        pose.rotation.renormalize();
        let moved = step.fixed_rows::<3>(3).norm() + step.fixed_rows::<3>(0).norm() * extent;
        out.cad_from_work = pose;
        out.width_mm = width;
        out.unfinished = Some(motion_about(&centre, &(step * repeats(moved, last_moved))));
        out.final_width = width <= 1.01 * end_width;
        last_moved = moved;
        let settled = width <= end_width * 1.0001;
        if settled && moved < settings.stop_mm {
            out.converged = true;
            break;
        }
        let small = if width > CAREFUL_MM { 0.6 * width } else { 0.1 * width };
        if moved < small && !settled {
            width = (0.75 * width).max(end_width);
        } else if settled {
            width = end_width;
        }
    }
    Ok(out)
}

/// The motion of a step (turn in rad, shift in mm) about a centre.
fn motion_about(centre: &Point3, step: &Vector6<f64>) -> Isometry3 {
    let turn = UnitQuaternion::from_scaled_axis(step.fixed_rows::<3>(0).into_owned());
    Isometry3::from_parts(Translation3::from(centre.coords + step.fixed_rows::<3>(3)), turn)
        * Translation3::from(-centre.coords)
}

/// How many times the last step is still to be made, at least once: q / (1 - q), where q is by what steps shrink. Steps that
/// hardly shrink tell no end; twenty times is what is said of them.
fn repeats(moved: f64, last_moved: f64) -> f64 {
    const MOST: f64 = 20.0;
    let q = (moved / last_moved).clamp(0.0, 1.0);
    (q / (1.0 - q)).clamp(1.0, MOST)
}

pub(super) fn half_extent(points: &[Point3]) -> f64 {
    crate::geometry::Aabb::of_points(points).map_or(1.0, |b| 0.5 * b.diagonal())
}

/// Each point with its closest place, `None` beyond the reach. `seeds` keeps each point's last triangle between calls.
pub(super) fn pairs_of(
    face: &Face,
    points: &[Point3],
    pose: &Isometry3,
    reach_mm: f64,
    beyond: Beyond,
    seeds: &mut [u32],
) -> Vec<Option<Pair>> {
    let mut pairs: Vec<Option<Pair>> = Vec::with_capacity(points.len());
    points
        .par_chunks(CHUNK)
        .zip(seeds.par_chunks_mut(CHUNK))
        .map(|(points, seeds)| {
            let one = |(p, seed): (&Point3, &mut u32)| {
                let at = pose * p;
                let hit = if *seed == u32::MAX {
                    face.closest(&at, reach_mm)
                } else {
                    face.closest_seeded(&at, reach_mm, *seed)
                }?;
                *seed = hit.triangle;
                let away = at - hit.point;
                let distance_sq = away.norm_squared();
                let pulls = hit.on_boundary && beyond == Beyond::Pull && distance_sq > 1e-12;
                let normal = if pulls { away / distance_sq.sqrt() } else { hit.normal.into_inner() };
                Some(Pair {
                    at,
                    normal,
                    residual_mm: away.dot(&normal),
                    distance_sq,
                    counts: pulls || !hit.on_boundary,
                    pulls,
                })
            };
            points.iter().zip(seeds.iter_mut()).map(one).collect::<Vec<_>>()
        })
        .collect_into_vec_of_vecs(&mut pairs);
    pairs
}

/// Collects ordered chunks into one vector.
trait CollectOrdered<T> {
    fn collect_into_vec_of_vecs(self, out: &mut Vec<T>);
}

impl<T: Send, I: IndexedParallelIterator<Item = Vec<T>>> CollectOrdered<T> for I {
    fn collect_into_vec_of_vecs(self, out: &mut Vec<T>) {
        let chunks: Vec<Vec<T>> = self.collect();
        out.extend(chunks.into_iter().flatten());
    }
}

/// Robust standard deviation of the residuals of the pairs within a reach; infinite without any.
fn robust_scale(pairs: &[Option<Pair>], reach_mm: f64) -> f64 {
    let mut sizes: Vec<f64> = pairs
        .iter()
        .flatten()
        .filter(|p| p.counts && p.distance_sq < reach_mm * reach_mm)
        .map(|p| p.residual_mm.abs())
        .collect();
    middle_value(&mut sizes).map_or(f64::INFINITY, |size| SIGMA_OF_MAD * size)
}

/// The weighted middle of the pairs that count.
pub(super) fn centroid(pairs: &[Option<Pair>], width: f64) -> Point3 {
    let (mut sum, mut total) = (Vector3::zeros(), 0.0);
    for pair in pairs.iter().flatten().filter(|p| p.counts) {
        let w = tukey_weight_of_square(pair.distance_sq, width);
        sum += pair.at.coords * w;
        total += w;
    }
    Point3::from(sum / f64::max(total, 1e-12))
}

fn summed(pairs: &[Option<Pair>], centre: &Point3, width: f64) -> Sums {
    let mut sums = Sums::zero();
    for pair in pairs.iter().flatten().filter(|p| p.counts) {
        let w = tukey_weight_of_square(pair.distance_sq, width);
        if w > 0.0 {
            let q = pair.at - centre;
            let added = sums.add(&q, &pair.normal, pair.residual_mm, w);
            if !pair.pulls {
                sums.surface += added;
            }
            sums.add_displacement(&q, pair.distance_sq, w);
        }
    }
    sums
}

fn note_quality(out: &mut Registered, pairs: &[Option<Pair>], width: f64, scale: f64, sums: &Sums, extent: f64) {
    let (mut inliers, mut square, mut total) = (0usize, 0.0, 0.0);
    for pair in pairs.iter().flatten().filter(|p| p.counts && p.distance_sq < width * width) {
        let w = tukey_weight_of_square(pair.distance_sq, width);
        inliers += 1;
        square += w * pair.residual_mm * pair.residual_mm;
        total += w;
    }
    out.scale_mm = scale;
    out.rms_mm = (square / f64::max(total, 1e-12)).sqrt();
    out.inlier_ratio = inliers as f64 / pairs.len().max(1) as f64;
    out.weakest_mm = weakest_mm(&sums.surface, pairs.len().max(1) as f64, extent);
}

/// Standard deviation of the least certain motion (mm at half the points' extent) that 600 points with residuals of 0.1 mm would leave,
/// from the normal matrix of `count` points.
pub(super) fn weakest_mm(surface: &Matrix6<f64>, count: f64, extent: f64) -> f64 {
    // Rotations count by what they move half way out.
    let lever = f64::max(0.5 * extent, 1e-6);
    let mut information = surface * (600.0 / count) / 0.01;
    for r in 0..6 {
        for c in 0..6 {
            let scale = |k: usize| if k < 3 { 1.0 / lever } else { 1.0 };
            information[(r, c)] *= scale(r) * scale(c);
        }
    }
    let least = decompose::symmetric_eigenvalues(information).map_or(0.0, |values| values.min());
    1.0 / least.max(1e-12).sqrt()
}

/// Takes one rotation out of the solution.
fn lock(sums: &mut Sums, axis: &UnitVector3) {
    let a = Vector6::new(axis.x, axis.y, axis.z, 0.0, 0.0, 0.0);
    let stiff = 1e6 * (sums.h.trace() + sums.p.trace());
    sums.h += a * a.transpose() * stiff;
}

/// The least damped step that the trust region allows, or that moves the points by no more than `free_mm` (rms).
fn trusted_step(sums: &Sums, free_mm: f64) -> Option<Vector6<f64>> {
    let mut last = None;
    let allowed = sums.distance_sq.max(sums.weight * free_mm * free_mm);
    for lambda in LADDER {
        let Some(cholesky) = (sums.h + sums.p * lambda).cholesky() else { continue };
        let step = -cholesky.solve(&sums.g);
        if !step.iter().all(|v| v.is_finite()) {
            continue;
        }
        last = Some(step);
        if (step.transpose() * sums.p * step)[0] <= allowed {
            break;
        }
    }
    last
}

/// Distances, mm, of points to the face in a pose; `limit_mm` where it is further.
pub(super) fn distances(face: &Face, points: &[Point3], pose: &Isometry3, limit_mm: f64) -> Vec<f64> {
    points
        .iter()
        .map(|p| {
            let at = pose * p;
            face.closest(&at, limit_mm).map_or(limit_mm, |hit| (at - hit.point).norm().min(limit_mm))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::part::{Part, PartSettings};
    use crate::plan::{CadSide, Side};
    use crate::simulate::{BracketParameters, bracket};

    fn part() -> Part {
        let nominal = bracket(&BracketParameters { spacing_mm: 4.0, ..BracketParameters::default() });
        let settings = PartSettings { cad_side: CadSide::Top, thickness_mm: 1.2, plan_directions: Vec::new() };
        Part::prepare(nominal.mesh, "0".repeat(64), &settings, &RunContext::silent()).unwrap()
    }

    fn settings(width_mm: f64, beyond: Beyond) -> Settings {
        Settings { steps: 60, width_mm, least_scale_mm: 0.02, stop_mm: 1e-9, beyond, locked_axis: None }
    }

    /// Exact points of a face, moved by a known motion: the registration must undo it.
    #[test]
    fn exact_points_come_back_from_a_few_degrees_and_mm() {
        let part = part();
        for side in [Side::Top, Side::Bottom] {
            let face = part.face(side);
            let points: Vec<Point3> = face.samples.iter().step_by(4).map(|s| s.point).collect();
            for (k, angle) in [0.03, -0.06, 0.1].into_iter().enumerate() {
                let axis = [Vector3::z(), Vector3::new(0.3, -0.2, 0.9), Vector3::new(-0.2, 0.4, 1.0)][k].normalize();
                let start = Isometry3::new(Vector3::new(2.0, -2.0, 1.0) * (0.4 + 0.3 * k as f64), axis * angle);
                let rough =
                    register(face, &points, &start, &settings(8.0, Beyond::Pull), None, &RunContext::silent()).unwrap();
                let fine = settings(rough.width_mm.max(1.0), Beyond::Nothing);
                let found = register(face, &points, &rough.cad_from_work, &fine, None, &RunContext::silent()).unwrap();
                // Every residual can be zero, so the solution is exact; Gauss-Newton ends below its own stop limit.
                let worst = points.iter().map(|p| (found.cad_from_work * p - p).norm()).fold(0.0, f64::max);
                assert!(worst < 1e-6, "{side:?} {angle}: {worst}");
            }
        }
    }

    /// A step may move the points, weighted, no further than they are off.
    #[test]
    fn a_step_stays_in_the_trust_region() {
        let part = part();
        let face = part.face(Side::Top);
        let points: Vec<Point3> = face.samples.iter().step_by(8).map(|s| s.point).collect();
        let mut seeds = vec![u32::MAX; points.len()];
        for turn in [0.01, 0.1, 0.4, 1.5] {
            let pose = Isometry3::new(Vector3::new(3.0, 4.0, 6.0), Vector3::z() * turn);
            let pairs = pairs_of(face, &points, &pose, 30.0, Beyond::Nothing, &mut seeds);
            let centre = centroid(&pairs, 20.0);
            let sums = summed(&pairs, &centre, 20.0);
            let step = trusted_step(&sums, 0.0).unwrap();
            let moved = (step.transpose() * sums.p * step)[0];
            assert!(moved <= sums.distance_sq * (1.0 + 1e-9), "turn {turn}: {moved} {}", sums.distance_sq);
            assert!(moved > 0.0);
        }
    }

    /// Stopped on its way it says so, and how far it may have to go yet; at the end nothing is left.
    #[test]
    fn a_registration_knows_whether_it_has_ended() {
        let part = part();
        let face = part.face(Side::Top);
        let points: Vec<Point3> = face.samples.iter().step_by(4).map(|s| s.point).collect();
        let start = Isometry3::new(Vector3::new(0.05, -0.05, 0.03), Vector3::new(3e-4, -3e-4, 5e-4));
        let with = |steps: usize| {
            let settings = Settings { steps, ..settings(1.0, Beyond::Nothing) };
            register(face, &points, &start, &settings, None, &RunContext::silent()).unwrap()
        };
        let furthest = |motion: &Isometry3| points.iter().map(|p| (motion * p - p).norm()).fold(0.0, f64::max);
        let ended = with(60);
        assert!(ended.converged && ended.final_width && furthest(&ended.unfinished.unwrap()) < 1e-6);
        // Points are exact, so that what is left is how far they are from where they belong.
        for steps in 1..4 {
            let stopped = with(steps);
            let (left, told) = (furthest(&stopped.cad_from_work), furthest(&stopped.unfinished.unwrap()));
            assert!(!stopped.converged && told > left, "{steps} steps: {told} of {left} mm");
        }
    }

    #[test]
    fn steps_that_hardly_shrink_are_to_be_repeated() {
        assert_eq!(repeats(1e-9, 1.0), 1.0);
        assert!((repeats(0.8, 1.0) - 4.0).abs() < 1e-9);
        assert_eq!(repeats(2.0, 1.0), 20.0);
        assert_eq!(repeats(1.0, f64::INFINITY), 1.0);
    }

    #[test]
    fn outliers_do_not_move_the_answer() {
        let part = part();
        let face = part.face(Side::Top);
        let mut points: Vec<Point3> = face.samples.iter().step_by(4).map(|s| s.point).collect();
        // Three in ten lie 3 to 9 mm above: beyond the final width they weigh nothing at all.
        for (k, p) in points.iter_mut().enumerate().filter(|(k, _)| k % 10 < 3) {
            *p += Vector3::z() * (3.0 + (k % 7) as f64);
        }
        let start = Isometry3::new(Vector3::new(1.0, -1.0, 0.5), Vector3::new(0.01, -0.01, 0.03));
        let found =
            register(face, &points, &start, &settings(6.0, Beyond::Nothing), None, &RunContext::silent()).unwrap();
        let right = points.iter().enumerate().filter(|(k, _)| k % 10 >= 3).map(|(_, p)| p);
        let worst = right.map(|p| (found.cad_from_work * p - p).norm()).fold(0.0, f64::max);
        assert!(worst < 1e-6, "{worst}");
        assert!((found.inlier_ratio - 0.7).abs() < 0.01, "{}", found.inlier_ratio);
    }
}
