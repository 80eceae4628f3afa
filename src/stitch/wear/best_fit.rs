//! The new cloud put onto the old one by what has not changed.

use super::local::{Local, Pair, REACH};
use super::smooth::SmoothErrors;
use super::{NewCloud, OldCloud, WearError, badness_of};
use crate::fit::robust::{TUKEY_WIDTH_SIGMAS, mad_scale_about_zero, tukey_weight};
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
/// A motion whose information is less than this share of the best one's is left as it is: a cylinder may turn and slide.
const WEAK: f64 = 1e-3;

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
    /// Covariance of the motion about the centre: turn (times `size`) and shift.
    covariance: Matrix6<f64>,
    centre: Point3,
    size: f64,
}

impl WearFit {
    /// Standard uncertainty of the difference at a place (old cloud's frame) because of the motion's.
    pub(super) fn motion_u(&self, place: &Point3, normal: &Vector3) -> f64 {
        let row = row(place, normal, &self.centre, self.size);
        (row.transpose() * self.covariance * row)[(0, 0)].max(0.0).sqrt()
    }
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
    for (step, width) in WIDTHS.into_iter().enumerate() {
        let last = step + 1 == WIDTHS.len();
        // As many in a narrow cloud as in a wide search.
        let places = places(new.positions, radius);
        for _ in 0..ROUNDS {
            run.check()?;
            let found = round(new, old, &places, &motion, width * radius, run)?;
            let (step, told) = solve(&found, width * radius)?;
            let moved = told.size * step.rotation.angle() + (step * told.centre - told.centre).norm();
            motion = step * motion;
            let settled = moved < 1e-3 * told.sigma.max(1e-9 * told.size);
            if last {
                fit = Some(told);
            }
            if settled {
                break;
            }
        }
    }
    let fit = fit.expect("at least one round");
    Ok((motion, fit))
}

/// One new point of each cell of a width, the first of it; thinned when there are many.
fn places(positions: &[Point3], width: f64) -> Vec<u32> {
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
    let needed = LEAST_PLACES.max(places.len() / 10);
    if found.len() < needed {
        return Err(WearError::Apart { found: found.len(), of: places.len(), reach: REACH * radius, needed });
    }
    Ok(found)
}

/// The small motion that makes differences small, worn places down-weighted.
fn solve(found: &[(Point3, Local)], radius: f64) -> Result<(Isometry3, WearFit), WearError> {
    let count = found.len() as f64;
    let centre = Point3::from(found.iter().map(|(p, _)| p.coords).sum::<Vector3>() / count);
    let size = (found.iter().map(|(p, _)| (p - centre).norm_squared()).sum::<f64>() / count).sqrt();
    let rows: Vec<Vector6<f64>> = found.iter().map(|(p, l)| row(p, &l.normal, &centre, size)).collect();
    let mut moves = Vector6::zeros();
    let mut fit = WearFit {
        places: found.len(),
        outlying: 0,
        sigma: 0.0,
        smooth: SmoothErrors::new(&[]),
        free_motions: 0,
        covariance: Matrix6::zeros(),
        centre,
        size,
    };
    // The biweight's weights belong to a motion, and the motion to weights.
    for _ in 0..30 {
        let left: Vec<f64> = found.iter().zip(&rows).map(|((_, l), row)| l.difference + row.dot(&moves)).collect();
        fit.sigma = mad_scale_about_zero(&left).unwrap_or(0.0);
        let told: Vec<[f64; 3]> = found.iter().zip(&left).map(|((_, l), r)| [l.badness, *r, l.u]).collect();
        fit.smooth = SmoothErrors::new(&told);
        let least = 1e-12 * size;
        let sigmas: Vec<f64> = found.iter().map(|(_, l)| fit.smooth.sigma(l.badness).max(least)).collect();
        let weigh = |(r, s): (&f64, &f64)| tukey_weight(*r, TUKEY_WIDTH_SIGMAS * s) / (s * s);
        let weights: Vec<f64> = left.iter().zip(&sigmas).map(weigh).collect();
        fit.outlying = weights.iter().filter(|w| **w == 0.0).count();
        let information: Matrix6<f64> = rows.iter().zip(&weights).map(|(r, w)| r * r.transpose() * *w).sum();
        let pull: Vector6<f64> = rows.iter().zip(&weights).zip(&left).map(|((r, w), l)| r * (w * l)).sum();
        let Some((inverse, free)) = pseudo_inverse(information) else { break };
        // Cylinders around neighbouring places share points: about pi places for each that is by itself.
        (fit.covariance, fit.free_motions) = (inverse * std::f64::consts::PI, free);
        let step = inverse * pull;
        moves -= step;
        if step.norm() < 1e-4 * fit.sigma.max(1e-9 * radius) {
            break;
        }
    }
    let turn = UnitQuaternion::new(moves.fixed_rows::<3>(0) / size);
    let shift: Vector3 = moves.fixed_rows::<3>(3).into_owned();
    let about = Translation3::from(centre.coords + shift - turn * centre.coords);
    Ok((Isometry3::from_parts(about, turn), fit))
}

/// Inverse over the motions that are fixed, and how many are not.
fn pseudo_inverse(information: Matrix6<f64>) -> Option<(Matrix6<f64>, usize)> {
    let SymmetricEigen { eigenvectors, eigenvalues } = decompose::symmetric_eigen(information)?;
    let limit = WEAK * eigenvalues.max();
    let mut inverse = Matrix6::zeros();
    let mut free = 0;
    for k in 0..6 {
        if eigenvalues[k] > limit {
            let v = eigenvectors.column(k);
            inverse += v * v.transpose() / eigenvalues[k];
        } else {
            free += 1;
        }
    }
    (free < 6).then_some((inverse, free))
}
