//! Which motions a set of locked directions leaves free.
//!
//! A lock of direction `d` at point `p` sees the small motion (v, w) as `d·v + ((p - c) x d)·w`: one row of six numbers a
//! lock, with `c` the middle of the points and lengths in units of their mean distance from it, so that shifts and turns weigh
//! alike. The motions that all rows miss are free.

use super::values::triple_words;
use crate::geometry::{Point3, UnitVector3, Vector3};
use nalgebra::{DMatrix, Matrix6, Vector6};

/// Below this part of the strongest motion a motion counts as free: locks that differ by rounding only.
const FREE: f64 = 1e-4;

/// Below this it is held so weakly that an error of the locks comes back a hundredfold.
const WEAK: f64 = 1e-2;

/// What locks hold.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Hold {
    /// Every free motion in words, such as `turning about [0, 0, 1]`.
    pub free: Vec<String>,
    /// The weakest motion in words, and how many times stronger the strongest is, when that is a hundred or more.
    pub weak: Option<(String, f64)>,
}

/// Examines locks (point in mm, direction), CAD frame.
pub(super) fn hold(locks: &[(Point3, UnitVector3)]) -> Hold {
    let count = locks.len().max(1) as f64;
    let centre = Point3::from(locks.iter().map(|(p, _)| p.coords).sum::<Vector3>() / count);
    let spread = (locks.iter().map(|(p, _)| (p - centre).norm_squared()).sum::<f64>() / count).sqrt().max(1e-6);
    let mut normal = Matrix6::<f64>::zeros();
    for (point, direction) in locks {
        let turn = ((point - centre) / spread).cross(direction);
        let row = Vector6::new(direction.x, direction.y, direction.z, turn.x, turn.y, turn.z);
        normal += row * row.transpose();
    }
    // The singular values of the rows are the roots of these eigenvalues; 1e-4 of the largest is 1e-8 here, far above rounding.
    let eigen = normal.symmetric_eigen();
    let strongest = eigen.eigenvalues.max().max(0.0).sqrt();
    let strength = |k: usize| eigen.eigenvalues[k].max(0.0).sqrt();
    let motion = |k: usize| eigen.eigenvectors.column(k).into_owned();
    let free: Vec<Vector6<f64>> = (0..6).filter(|k| strength(*k) <= FREE * strongest).map(motion).collect();
    let weakest = (0..6).min_by(|a, b| strength(*a).total_cmp(&strength(*b))).unwrap_or(0);
    let weak = (free.is_empty() && strength(weakest) < WEAK * strongest)
        .then(|| (in_words(&motion(weakest), &centre, spread), strongest / strength(weakest)));
    Hold { free: words_of_space(&free, &centre, spread), weak }
}

/// Words for a space of free motions. Its basis is turned first, so that pure shifts stand alone.
fn words_of_space(basis: &[Vector6<f64>], centre: &Point3, spread: f64) -> Vec<String> {
    if basis.is_empty() {
        return Vec::new();
    }
    let turns = DMatrix::from_fn(3, basis.len(), |row, k| basis[k][row + 3]);
    let eigen = (turns.transpose() * &turns).symmetric_eigen();
    let mut order: Vec<usize> = (0..basis.len()).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    order
        .into_iter()
        .map(|k| {
            let mixed: Vector6<f64> = basis.iter().zip(eigen.eigenvectors.column(k).iter()).map(|(b, f)| b * *f).sum();
            in_words(&mixed, centre, spread)
        })
        .collect()
}

/// `moving along [..]` or `turning about [..] through [..]`, whichever a small motion mostly is.
fn in_words(motion: &Vector6<f64>, centre: &Point3, spread: f64) -> String {
    let shift = Vector3::new(motion[0], motion[1], motion[2]);
    let turn = Vector3::new(motion[3], motion[4], motion[5]);
    if turn.norm() < 0.1 * motion.norm() {
        return format!("moving along {}", triple_words(rounded(shift.normalize())));
    }
    // The points that do not move across the axis: c + (turn x shift) / |turn|², lengths back in mm.
    let through = centre + turn.cross(&shift) * (spread / turn.norm_squared());
    let through: [f64; 3] = through.coords.map(|v| (v * 10.0).round() / 10.0).into();
    format!("turning about {} through {}", triple_words(rounded(turn.normalize())), triple_words(through))
}

/// Three decimals, first telling component positive: an axis has no sense.
fn rounded(v: Vector3) -> [f64; 3] {
    let v = v.map(|c| (c * 1e3).round() / 1e3);
    let sign = v.iter().find(|c| **c != 0.0).map_or(1.0, |c| c.signum());
    (v * sign).map(|c| c + 0.0).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lock(p: [f64; 3], d: [f64; 3]) -> (Point3, UnitVector3) {
        (Point3::from(p), UnitVector3::new_normalize(Vector3::from(d)))
    }

    const Z: [f64; 3] = [0.0, 0.0, 1.0];

    #[test]
    fn three_two_one_holds_everything() {
        let locks = [
            lock([0.0, 0.0, 0.0], Z),
            lock([100.0, 0.0, 0.0], Z),
            lock([0.0, 80.0, 0.0], Z),
            lock([0.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
            lock([100.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
            lock([0.0, 0.0, 0.0], [1.0, 0.0, 0.0]),
        ];
        assert_eq!(hold(&locks), Hold { free: vec![], weak: None });
    }

    #[test]
    fn names_a_free_turn_with_its_place_and_a_free_shift() {
        let planar = [lock([0.0, 0.0, 5.0], Z), lock([100.0, 0.0, 5.0], Z), lock([0.0, 80.0, 5.0], Z)];
        let at_hole = [lock([10.0, 20.0, 5.0], [1.0, 0.0, 0.0]), lock([10.0, 20.0, 5.0], [0.0, 1.0, 0.0])];
        let turning: Vec<_> = planar.iter().chain(&at_hole).chain(&at_hole[..1]).copied().collect();
        assert_eq!(hold(&turning).free, ["turning about [0, 0, 1] through [10, 20, 5]"]);
        let sliding: Vec<_> = planar
            .iter()
            .chain(&[lock([0.0, 0.0, 0.0], [0.0, 1.0, 0.0]), lock([90.0, 0.0, 0.0], [0.0, 1.0, 0.0])])
            .copied()
            .collect();
        assert_eq!(hold(&sliding).free, ["moving along [1, 0, 0]"]);
        assert_eq!(hold(&planar).free.len(), 3);
        assert_eq!(hold(&[]).free.len(), 6);
    }

    #[test]
    fn a_short_lever_is_weak_not_free() {
        let locks = [
            lock([0.0, 0.0, 0.0], Z),
            lock([100.0, 0.0, 0.0], Z),
            lock([50.0, 0.3, 0.0], Z),
            lock([0.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
            lock([100.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
            lock([0.0, 0.0, 0.0], [1.0, 0.0, 0.0]),
        ];
        let hold = hold(&locks);
        assert!(hold.free.is_empty());
        let (words, ratio) = hold.weak.unwrap();
        assert!(words.starts_with("turning about [1, 0, 0]"), "{words}");
        assert!(ratio > 100.0);
    }
}
