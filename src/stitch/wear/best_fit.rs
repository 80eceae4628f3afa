//! The new cloud put onto the old one by what has not changed.

use super::local::{Local, Pair, REACH};
use super::smooth::SmoothErrors;
use super::starts::{Place, least_trimmed, second_share};
use super::{NewCloud, OldCloud, WearError, badness_of};
use crate::fit::robust::{TUKEY_WIDTH_SIGMAS, mad_scale_about_zero, median, quantile, tukey_weight};
use crate::geometry::{Isometry3, Point3, Vector3, decompose};
use crate::run::RunContext;
use nalgebra::{Matrix6, SymmetricEigen, Translation3, UnitQuaternion, Vector6};
use std::collections::BTreeMap;

/// The search begins with cylinders so many times as wide, and narrows.
const WIDTHS: [f64; 3] = [4.0, 2.0, 1.0];
/// Rounds for each width at most.
const ROUNDS: usize = 12;
/// Places looked at; more tell nothing more of six numbers.
const MOST_PLACES: usize = 6000;
/// Fewer places fix no motion.
const LEAST_PLACES: usize = 30;
/// At least this share of the places has a counterpart: else it is another tool, or another part of it.
const LEAST_SHARE: f64 = 0.25;
/// Poses in one frame leave less of a turn than this, degrees.
const MOST_TURN_DEG: f64 = 10.0;
/// Two surfaces of one tool differ by less than so many times the scatter of a point, or this share of the radius, at most places.
const MOST_SCATTERS: f64 = 10.0;
const MOST_OF_RADIUS: f64 = 0.1;
/// The fit that begins at the better half is taken where its scale is less than this share of the other's.
const CLEARLY_BETTER: f64 = 0.8;
/// A motion whose information is less than this share of the best one's is left as it is: a cylinder may turn and slide.
const WEAK: f64 = 1e-3;

/// A start moves only along motions of at least this share of the best one's information.
const SURELY_HELD: f64 = 0.02;

/// How well two clouds fit.
#[derive(Debug, Clone, PartialEq)]
pub struct WearFit {
    /// Places looked at.
    pub places: usize,
    /// Of these, with no weight left at the end.
    pub outlying: usize,
    /// Robust standard deviation of the differences at them.
    pub sigma: f64,
    /// What they differ in beyond their noise: smooth errors of both measurements.
    pub smooth: SmoothErrors,
    /// Motions, of six, that the surface leaves free; there the cloud stays where it was.
    pub free_motions: usize,
    /// Share of the places that lie as before, within three standard deviations.
    pub as_before: f64,
    /// Share of the places that would lie as before if another motion were taken: of those that do not under this one.
    pub otherwise: f64,
    /// How far the fit moved a place at most.
    pub moved: f64,
    /// New variance of single points less that of the old ones, at the middle place.
    pub(super) excess: f64,
    /// Covariance of the motion about the centre: turn (times `size`) and shift.
    covariance: Matrix6<f64>,
    /// Projects onto the motions that the surface leaves free.
    left_free: Matrix6<f64>,
    centre: Point3,
    size: f64,
}

impl WearFit {
    /// Standard uncertainty of the difference at a place (old cloud's frame) because of the motion's. Along motions that were left as they were the cloud
    /// is off by as much as it was along the others, and the little that the surface tells of them is in the difference.
    pub(super) fn motion_u(&self, place: &Point3, normal: &Vector3) -> f64 {
        let row = row(place, normal, &self.centre, self.size);
        let left = (row.transpose() * self.left_free * row)[(0, 0)] * (self.moved * self.moved / 3.0);
        ((row.transpose() * self.covariance * row)[(0, 0)] + left).max(0.0).sqrt()
    }
}

impl WearFit {
    /// Fits again at some of the places, of a difference with its standard uncertainty at a place with its normal, and tells the motion that is left to
    /// do. The covariance becomes that of these.
    pub(super) fn again(&mut self, places: &[(Point3, Vector3, [f64; 2])]) -> Option<Vector6<f64>> {
        let rows: Vec<Vector6<f64>> = places.iter().map(|(p, n, _)| row(p, n, &self.centre, self.size)).collect();
        let mut moves = Vector6::zeros();
        for _ in 0..10 {
            let weigh = |(row, (_, _, [difference, u])): (&Vector6<f64>, &(Point3, Vector3, [f64; 2]))| {
                let left = difference + row.dot(&moves);
                [left, tukey_weight(left, TUKEY_WIDTH_SIGMAS * u) / (u * u)]
            };
            let weighed: Vec<[f64; 2]> = rows.iter().zip(places).map(weigh).collect();
            let information: Matrix6<f64> =
                rows.iter().zip(&weighed).map(|(r, [_, weight])| r * r.transpose() * *weight).sum();
            let pull: Vector6<f64> = rows.iter().zip(&weighed).map(|(r, [left, weight])| r * (weight * left)).sum();
            let (inverse, left_free, free) = pseudo_inverse(information)?;
            if free > self.free_motions {
                return None;
            }
            (self.covariance, self.left_free) = (inverse * std::f64::consts::PI, left_free);
            moves -= inverse * pull;
        }
        Some(moves)
    }

    /// What such a motion adds to a difference.
    pub(super) fn adds(&self, moves: &Vector6<f64>, place: &Point3, normal: &Vector3) -> f64 {
        row(place, normal, &self.centre, self.size).dot(moves)
    }

    /// Such a motion as one of points.
    pub(super) fn motion(&self, moves: &Vector6<f64>) -> Isometry3 {
        motion_of(moves, &self.centre, self.size)
    }
}

fn motion_of(moves: &Vector6<f64>, centre: &Point3, size: f64) -> Isometry3 {
    let turn = UnitQuaternion::new(moves.fixed_rows::<3>(0) / size);
    let shift: Vector3 = moves.fixed_rows::<3>(3).into_owned();
    let about = Translation3::from(centre.coords + shift - turn * centre.coords);
    Isometry3::from_parts(about, turn)
}

/// How a difference goes with a turn (times the size) and a shift of the new cloud.
fn row(place: &Point3, normal: &Vector3, centre: &Point3, size: f64) -> Vector6<f64> {
    let turn = (place - centre).cross(normal) / size;
    Vector6::new(turn.x, turn.y, turn.z, normal.x, normal.y, normal.z)
}

/// Old from new, and how well that is known.
pub(super) fn best_fit(
    new: &NewCloud<'_>,
    old: &OldCloud<'_>,
    radius: f64,
    run: &RunContext,
) -> Result<(Isometry3, WearFit), WearError> {
    let mut motion = Isometry3::identity();
    let mut fit = None;
    // As many in a narrow cloud as in a wide search.
    let places = places(new.positions, radius);
    for (step, width) in WIDTHS.into_iter().enumerate() {
        let last = step + 1 == WIDTHS.len();
        for _ in 0..ROUNDS {
            run.check()?;
            let found = round(new, old, &places, &motion, width * radius, run)?;
            let (step, told) = solve(&found);
            let moved = told.size * step.rotation.angle() + (step * told.centre - told.centre).norm();
            motion = step * motion;
            let settled = moved < 1e-3 * told.sigma.max(1e-9 * told.size);
            if last {
                fit = Some((told, found));
            }
            if settled {
                break;
            }
        }
    }
    let (mut fit, found) = fit.expect("at least one round");
    let new_from_old = motion.inverse();
    fit.moved = found.iter().map(|(p, _)| (p - new_from_old * p).norm()).fold(0.0, f64::max);
    is_of_one_tool(&fit, &motion, &found, radius)?;
    fit.excess = middle(found.iter().map(|(_, l)| l.scatter[0].powi(2) - l.scatter[1].powi(2)));
    Ok((motion, fit))
}

/// Whether what was found can be two measurements of one tool by poses in one frame.
fn is_of_one_tool(fit: &WearFit, motion: &Isometry3, found: &[(Point3, Local)], radius: f64) -> Result<(), WearError> {
    let scatter = middle(found.iter().map(|(_, l)| l.scatter[0].max(l.scatter[1])));
    if fit.sigma > MOST_SCATTERS * scatter && fit.sigma > MOST_OF_RADIUS * radius {
        return Err(WearError::OtherSurface { sigma: fit.sigma, scatter });
    }
    let (turned_deg, reach) = (motion.rotation.angle().to_degrees(), WIDTHS[0] * REACH * radius);
    if turned_deg > MOST_TURN_DEG || fit.moved > reach {
        return Err(WearError::Moved { turned_deg, moved: fit.moved, most_deg: MOST_TURN_DEG, reach });
    }
    Ok(())
}

fn middle(values: impl Iterator<Item = f64>) -> f64 {
    median(&mut values.collect::<Vec<f64>>()).unwrap_or(0.0)
}

/// One new point of each cell of a width, the first of it; thinned when there are many.
pub(super) fn places(positions: &[Point3], width: f64) -> Vec<u32> {
    let mut first: BTreeMap<[i64; 3], u32> = BTreeMap::new();
    for (k, p) in positions.iter().enumerate() {
        let key: [i64; 3] = std::array::from_fn(|axis| (p[axis] / width).floor() as i64);
        first.entry(key).or_insert(k as u32);
    }
    let step = first.len().div_ceil(MOST_PLACES).max(1);
    let mut places: Vec<u32> = first.into_values().step_by(step).collect();
    places.sort_unstable();
    places
}

/// Differences at the places, with where they are in the old cloud's frame.
fn round(
    new: &NewCloud<'_>,
    old: &OldCloud<'_>,
    places: &[u32],
    motion: &Isometry3,
    radius: f64,
    run: &RunContext,
) -> Result<Vec<(Point3, Local)>, WearError> {
    let moved: Vec<Point3> = new.positions.iter().map(|p| motion * p).collect();
    let sensors: Vec<Point3> = new.sensors.iter().map(|p| motion * p).collect();
    let pair = Pair::new(&moved, old.positions, &badness_of(new, old), radius)?;
    let toward = |k: usize| sensors[new.seen_from[k] as usize];
    let locals = pair.differences(places, &toward, run)?;
    let found: Vec<(Point3, Local)> =
        places.iter().zip(locals).filter_map(|(k, local)| Some((moved[*k as usize], local?))).collect();
    let needed = LEAST_PLACES.max((LEAST_SHARE * places.len() as f64).ceil() as usize);
    if found.len() < needed {
        return Err(WearError::Apart { found: found.len(), of: places.len(), reach: REACH * radius, needed });
    }
    Ok(found)
}

/// The small motion that makes differences small, worn places down-weighted.
fn solve(found: &[(Point3, Local)]) -> (Isometry3, WearFit) {
    let count = found.len() as f64;
    let centre = Point3::from(found.iter().map(|(p, _)| p.coords).sum::<Vector3>() / count);
    let size = (found.iter().map(|(p, _)| (p - centre).norm_squared()).sum::<f64>() / count).sqrt();
    let usual_u = middle(found.iter().map(|(_, l)| l.u));
    let place = |(p, l): &(Point3, Local)| Place {
        at: *p,
        row: row(p, &l.normal, &centre, size),
        difference: l.difference,
        sigma: l.u.max(usual_u).max(1e-12 * size),
    };
    let places: Vec<Place> = found.iter().map(place).collect();
    let held = held_motions(&places);
    let (mut moves, mut fit) = biweight(found, &places, Vector6::zeros(), centre, size);
    // What lies best by less than the half decides: a scale that wear on more than a third of the surface does not reach.
    let scale = |moves: &Vector6<f64>| {
        let mut left: Vec<f64> = places.iter().map(|p| p.left(moves).abs()).collect();
        quantile(&mut left, 0.4).unwrap_or(0.0)
    };
    if let Some(start) = least_trimmed(&places, &held) {
        let (other, other_fit) = biweight(found, &places, start, centre, size);
        if scale(&other) < CLEARLY_BETTER * scale(&moves) {
            (moves, fit) = (other, other_fit);
        }
    }
    let last: Vec<Place> = places
        .iter()
        .zip(found)
        .map(|(p, (_, l))| Place { sigma: fit.smooth.sigma(l.badness).max(1e-12 * size), ..*p })
        .collect();
    let outlying: Vec<Place> = last.iter().filter(|p| p.left(&moves).abs() > 3.0).copied().collect();
    fit.as_before = 1.0 - outlying.len() as f64 / count;
    fit.otherwise = second_share(&last, &outlying, &held);
    (motion_of(&moves, &centre, size), fit)
}

/// Projects onto the motions that the surface holds well; parts of it may hold the others by chance only.
fn held_motions(places: &[Place]) -> Matrix6<f64> {
    let information: Matrix6<f64> = places.iter().map(|p| p.row * p.row.transpose()).sum();
    let Some(eigen) = decompose::symmetric_eigen(information) else { return Matrix6::identity() };
    let limit = SURELY_HELD * eigen.eigenvalues.max();
    let held = (0..6).filter(|k| eigen.eigenvalues[*k] > limit);
    held.map(|k| eigen.eigenvectors.column(k) * eigen.eigenvectors.column(k).transpose()).sum()
}

/// Tukey's biweight from a start on.
fn biweight(
    found: &[(Point3, Local)],
    places: &[Place],
    start: Vector6<f64>,
    centre: Point3,
    size: f64,
) -> (Vector6<f64>, WearFit) {
    let mut moves = start;
    let mut fit = WearFit {
        places: found.len(),
        outlying: 0,
        sigma: 0.0,
        smooth: SmoothErrors::new(&[]),
        free_motions: 0,
        as_before: 1.0,
        otherwise: 0.0,
        moved: 0.0,
        excess: 0.0,
        covariance: Matrix6::zeros(),
        left_free: Matrix6::zeros(),
        centre,
        size,
    };
    // The biweight's weights belong to a motion, and the motion to weights.
    for _ in 0..30 {
        let left: Vec<f64> = places.iter().map(|p| p.difference + p.row.dot(&moves)).collect();
        fit.sigma = mad_scale_about_zero(&left).unwrap_or(0.0);
        let told: Vec<[f64; 3]> = found.iter().zip(&left).map(|((_, l), r)| [l.badness, *r, l.u]).collect();
        fit.smooth = SmoothErrors::new(&told);
        let least = 1e-12 * size;
        let sigmas: Vec<f64> = found.iter().map(|(_, l)| fit.smooth.sigma(l.badness).max(least)).collect();
        let weigh = |(r, s): (&f64, &f64)| tukey_weight(*r, TUKEY_WIDTH_SIGMAS * s) / (s * s);
        let weights: Vec<f64> = left.iter().zip(&sigmas).map(weigh).collect();
        fit.outlying = weights.iter().filter(|w| **w == 0.0).count();
        let weighed = || places.iter().map(|p| &p.row).zip(&weights);
        let information: Matrix6<f64> = weighed().map(|(r, w)| r * r.transpose() * *w).sum();
        let pull: Vector6<f64> = weighed().zip(&left).map(|((r, w), l)| r * (w * l)).sum();
        let Some((inverse, left_free, free)) = pseudo_inverse(information) else { break };
        // Cylinders around neighbouring places share points: about pi places for each that is by itself.
        (fit.covariance, fit.left_free, fit.free_motions) = (inverse * std::f64::consts::PI, left_free, free);
        let step = inverse * pull;
        moves -= step;
        if step.norm() < 1e-4 * fit.sigma.max(1e-9 * size) {
            break;
        }
    }
    (moves, fit)
}

/// Inverse over the motions that are fixed, what projects onto those that are not, and how many these are.
fn pseudo_inverse(information: Matrix6<f64>) -> Option<(Matrix6<f64>, Matrix6<f64>, usize)> {
    let SymmetricEigen { eigenvectors, eigenvalues } = decompose::symmetric_eigen(information)?;
    let limit = WEAK * eigenvalues.max();
    let (mut inverse, mut left_free) = (Matrix6::zeros(), Matrix6::zeros());
    let mut free = 0;
    for k in 0..6 {
        let v = eigenvectors.column(k);
        if eigenvalues[k] > limit {
            inverse += v * v.transpose() / eigenvalues[k];
        } else {
            left_free += v * v.transpose();
            free += 1;
        }
    }
    (free < 6).then_some((inverse, left_free, free))
}
