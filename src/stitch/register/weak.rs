//! Motions of a view that its neighbours do not hold, in words.

use super::Prior;
use super::motion::{self, Motion};
use super::network::Between;
use super::surface::Surface;
use crate::fit::hold::{Named, Twist};
use crate::geometry::{Isometry3, Point3, Vector3, decompose};
use crate::plan::short_number;
use nalgebra::{DMatrix, Matrix3, Matrix6, Vector6};

/// Held weaker than this share of the view's size a motion is not held at all.
const NOT_HELD: f64 = 0.1;

/// A weak motion: root mean square displacement of the view's places that one standard deviation of it is, and words.
pub(super) struct WeakMotion {
    pub uncertainty: f64,
    pub words: String,
}

/// The motions of a view, in its pose, that its neighbours hold no better than to `limit`, the weakest first.
pub(super) fn weak_motions(
    name: &str,
    view: usize,
    surface: &Surface,
    world_from_view: &Isometry3,
    between: &[Between],
    prior: Option<&Prior>,
    limit: f64,
) -> Vec<WeakMotion> {
    let middle = world_from_view * surface.middle;
    let mut held = Matrix6::zeros();
    for term in between.iter().filter(|term| term.a == view || term.b == view) {
        let seen = motion::seen_from(&middle, &term.centre);
        held += seen.transpose() * term.precision * seen;
    }
    let Some(lower) = displacement(surface, world_from_view, &middle).cholesky().map(|c| c.l()) else {
        return Vec::new();
    };
    let Some(inverse) = lower.try_inverse() else { return Vec::new() };
    let Some(eigen) = decompose::symmetric_eigen(inverse * held * inverse.transpose()) else { return Vec::new() };
    let uncertainty = |k: usize| eigen.eigenvalues[k].max(0.0).sqrt().recip();
    let mut order: Vec<usize> = (0..6).filter(|k| uncertainty(*k) > limit).collect();
    order.sort_by(|a, b| uncertainty(*b).total_cmp(&uncertainty(*a)));
    let size = surface.half_size();
    let motion = |k: &usize| inverse.transpose() * eigen.eigenvectors.column(*k);
    let (open, loose): (Vec<usize>, Vec<usize>) = order.iter().partition(|k| uncertainty(**k) > NOT_HELD * size);
    let open_motions: Vec<Motion> = open.iter().map(motion).collect();
    let mut out: Vec<WeakMotion> = clear(&open_motions, size)
        .iter()
        .map(|m| WeakMotion {
            uncertainty: f64::INFINITY,
            words: format!(
                "{name}: its neighbours do not hold a {}; {}",
                in_words(m, &middle, size),
                holder(prior, limit)
            ),
        })
        .collect();
    out.extend(loose.iter().map(|k| {
        let u = uncertainty(*k);
        let (words, told) = (in_words(&motion(k), &middle, size), short_number(u));
        WeakMotion {
            uncertainty: u,
            words: format!("{name}: its neighbours hold a {words} to {told} only; {}", holder(prior, limit)),
        }
    }));
    out
}

fn holder(prior: Option<&Prior>, limit: f64) -> String {
    match prior {
        Some(prior) => {
            let (shift, turn) =
                (short_number(prior.translation_sigma), short_number(prior.rotation_sigma_rad.to_degrees()));
            format!("its pose as given before holds it, to {shift} and {turn} degrees")
        }
        None => {
            let limit = short_number(limit);
            format!("nothing else holds it (single points are known to {limit}): give poses, or a view across it")
        }
    }
}

/// Mean square displacement of a view's places by motions about the middle.
fn displacement(surface: &Surface, world_from_view: &Isometry3, middle: &Point3) -> Matrix6<f64> {
    let count = surface.patches.len() as f64;
    let square = |p: &super::surface::Patch| {
        let q = world_from_view * p.centre - middle;
        Matrix3::identity() * q.norm_squared() - q * q.transpose()
    };
    let turns = surface.patches.iter().map(square).sum::<Matrix3<f64>>() / count;
    let mut matrix = Matrix6::identity();
    let ridge = Matrix3::identity() * (1e-9 * turns.trace() + f64::MIN_POSITIVE);
    matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&(turns + ridge));
    matrix
}

/// Another basis of a space of motions: turns that are as much turn as can be first, pure shifts last.
fn clear(motions: &[Motion], size: f64) -> Vec<Motion> {
    if motions.len() < 2 {
        return motions.to_vec();
    }
    let turns = DMatrix::from_fn(3, motions.len(), |r, k| motions[k][r] * size);
    let Some(eigen) = decompose::symmetric_eigen(turns.transpose() * &turns) else { return motions.to_vec() };
    let mut order: Vec<usize> = (0..motions.len()).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let mixed = |k: usize| -> Motion {
        motions
            .iter()
            .zip(eigen.eigenvectors.column(k).iter())
            .map(|(m, f)| m * *f)
            .fold(Vector6::zeros(), |a, b| a + b)
    };
    order.into_iter().map(mixed).collect()
}

fn in_words(m: &Motion, middle: &Point3, size: f64) -> String {
    let turn: Vector3 = motion::turn(m) * size;
    let shift = motion::shift(m);
    // The lead of a screw is left out: words would name it in millimetres, which the views need not be told in.
    let lead = turn.try_normalize(0.1 * shift.norm()).map_or(Vector3::zeros(), |axis| axis * axis.dot(&shift));
    let none: [Named; 0] = [];
    Twist { centre: *middle, shift: shift - lead, turn, length_mm: size }.in_words(&none)
}
