//! The order in which views are taken: by what they show, so that neither their names nor the order in which they are given change a bit.

use super::Prior;
use super::result::{Cycle, Pair};
use super::surface::Surface;
use std::cmp::Ordering;

/// Places of views in the order of their surfaces: larger ones first, those of equal size by their patches. Views without a surface come
/// last. Views all alike follow their priors, else each other as they are.
pub(super) fn by_content(surfaces: &[Option<Surface>], priors: &[Option<Prior>]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..surfaces.len()).collect();
    order.sort_by(|a, b| match (&surfaces[*a], &surfaces[*b]) {
        (Some(one), Some(other)) => of_surfaces(one, other).then_with(|| of_priors(&priors[*a], &priors[*b])),
        (one, other) => other.is_some().cmp(&one.is_some()),
    });
    order
}

fn of_surfaces(one: &Surface, other: &Surface) -> Ordering {
    let numbers = |s: &Surface| -> [f64; 5] { [s.middle.x, s.middle.y, s.middle.z, s.extent, s.noise] };
    let patch = |p: &super::surface::Patch| -> [f64; 6] {
        std::array::from_fn(|k| if k < 3 { p.centre[k] } else { p.normal[k - 3] })
    };
    let patches = || one.patches.iter().zip(&other.patches).map(|(a, b)| of_numbers(&patch(a), &patch(b)));
    other
        .patches
        .len()
        .cmp(&one.patches.len())
        .then_with(|| of_numbers(&numbers(one), &numbers(other)))
        .then_with(|| patches().find(|order| order.is_ne()).unwrap_or(Ordering::Equal))
}

fn of_priors(one: &Option<Prior>, other: &Option<Prior>) -> Ordering {
    let numbers = |prior: &Option<Prior>| prior.map(|p| p.world_from_view.to_homogeneous());
    match (numbers(one), numbers(other)) {
        (Some(one), Some(other)) => of_numbers(one.as_slice(), other.as_slice()),
        (one, other) => other.is_some().cmp(&one.is_some()),
    }
}

fn of_numbers(one: &[f64], other: &[f64]) -> Ordering {
    one.iter().zip(other).map(|(a, b)| a.total_cmp(b)).find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
}

/// Pairs as people look for them: the view whose name comes first is `a`, and the pairs of it follow each other. `rank`: of each view its
/// place in the order of names.
pub(super) fn pairs_by_name(mut pairs: Vec<Pair>, rank: &[usize]) -> Vec<Pair> {
    for pair in pairs.iter_mut().filter(|pair| rank[pair.a] > rank[pair.b]) {
        std::mem::swap(&mut pair.a, &mut pair.b);
        pair.mean = -pair.mean;
    }
    pairs.sort_by_key(|pair| (rank[pair.a], rank[pair.b]));
    pairs
}

/// Rings as people look for them: each from the view whose name comes first on to that neighbour of it whose name does.
pub(super) fn cycles_by_name(mut cycles: Vec<Cycle>, rank: &[usize]) -> Vec<Cycle> {
    for cycle in &mut cycles {
        let views = &mut cycle.views;
        let first = (0..views.len()).min_by_key(|k| rank[views[*k]]).unwrap_or(0);
        views.rotate_left(first);
        if views.len() > 2 && rank[views[1]] > rank[views[views.len() - 1]] {
            views[1..].reverse();
        }
    }
    cycles.sort_by_cached_key(|cycle| cycle.views.iter().map(|view| rank[*view]).collect::<Vec<_>>());
    cycles
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stitch::register::result::PairState;

    #[test]
    fn pairs_and_rings_are_told_by_names() {
        // The third view given has the first name, the second one the last.
        let rank = [1, 2, 0];
        let pair = |a, b, mean| {
            let state = PairState::Used { weight: 1.0 };
            Pair { a, b, shared: 9, share: 0.5, rms: 0.1, mean, agreement: 1.0, state }
        };
        let told = pairs_by_name(vec![pair(1, 0, 0.25), pair(0, 2, 0.5)], &rank);
        let told: Vec<_> = told.iter().map(|p| (p.a, p.b, p.mean)).collect();
        assert_eq!(told, [(2, 0, -0.5), (0, 1, -0.25)]);
        let ring = |views: &[usize]| Cycle {
            views: views.to_vec(),
            translation: 0.0,
            angle_rad: 0.0,
            expected_translation: 0.0,
            expected_angle_rad: 0.0,
            normalised: 0.0,
        };
        let told = cycles_by_name(vec![ring(&[1, 2, 0]), ring(&[0, 1])], &rank);
        assert_eq!(told.iter().map(|c| c.views.clone()).collect::<Vec<_>>(), [vec![2, 0, 1], vec![0, 1]]);
    }
}
