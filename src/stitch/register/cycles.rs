//! Closure errors: pairs registered by themselves, followed around a ring, should end where they began.
//!
//! In the final poses every ring closes. What a pair by itself says beside them, a small motion, is added up around the ring instead.

use super::motion::{self, Motion};
use super::network::Edge;
use super::result::Cycle;
use crate::geometry::Isometry3;
use nalgebra::Matrix6;
use std::collections::{BTreeSet, VecDeque};

/// The shortest ring through each edge, each ring once. Views are those of the edges.
pub(super) fn closures(views: usize, edges: &[Edge], world_from_view: &[Isometry3]) -> Vec<Cycle> {
    let mut neighbours: Vec<Vec<(usize, usize)>> = vec![Vec::new(); views];
    for (k, edge) in edges.iter().enumerate() {
        neighbours[edge.a].push((edge.b, k));
        neighbours[edge.b].push((edge.a, k));
    }
    neighbours.iter_mut().for_each(|list| list.sort_unstable());
    let mut seen = BTreeSet::new();
    let mut cycles = Vec::new();
    for k in 0..edges.len() {
        let Some(path) = way_around(&neighbours, edges, k) else { continue };
        let mut members: Vec<usize> = path.iter().map(|(view, _)| *view).collect();
        let views = members.clone();
        members.sort_unstable();
        if seen.insert(members) {
            cycles.extend(closure(edges, world_from_view, &path, views));
        }
    }
    cycles
}

/// The shortest way from an edge's `b` back to its `a` without it, with the edge itself first: each view with the edge that leaves it.
fn way_around(neighbours: &[Vec<(usize, usize)>], edges: &[Edge], edge: usize) -> Option<Vec<(usize, usize)>> {
    let (from, to) = (edges[edge].b, edges[edge].a);
    // Towards the end, so that steps are read off in their order: of each view the next one and the edge there.
    let mut next: Vec<Option<(usize, usize)>> = vec![None; neighbours.len()];
    let mut queue = VecDeque::from([to]);
    while let Some(view) = queue.pop_front() {
        for (other, through) in neighbours[view].iter().filter(|(_, through)| *through != edge) {
            if *other != to && next[*other].is_none() {
                next[*other] = Some((view, *through));
                queue.push_back(*other);
            }
        }
    }
    let mut path = vec![(to, edge)];
    let mut at = from;
    while at != to {
        let (view, through) = next[at]?;
        path.push((at, through));
        at = view;
    }
    Some(path)
}

fn closure(edges: &[Edge], world_from_view: &[Isometry3], path: &[(usize, usize)], views: Vec<usize>) -> Option<Cycle> {
    let first = edges[path[0].1].term(world_from_view).centre;
    let (mut sum, mut covariance) = (Motion::zeros(), Matrix6::zeros());
    for (view, through) in path {
        let edge = &edges[*through];
        let term = edge.term(world_from_view);
        let seen = motion::seen_from(&term.centre, &first);
        let sign = if edge.a == *view { 1.0 } else { -1.0 };
        sum += seen * term.asked * sign;
        covariance += seen * edge.covariance_in(world_from_view) * seen.transpose();
    }
    let normalised = covariance.cholesky().map(|c| (sum.dot(&c.solve(&sum)) / 6.0).sqrt())?;
    let trace = |from: usize| (from..from + 3).map(|k| covariance[(k, k)]).sum::<f64>().sqrt();
    Some(Cycle {
        views,
        translation: motion::shift(&sum).norm(),
        angle_rad: motion::turn(&sum).norm(),
        expected_translation: trace(3),
        expected_angle_rad: trace(0),
        normalised,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Point3, Vector3};

    /// Three views in a ring of which one pair is off by a known motion, and a fourth that hangs on one edge only.
    #[test]
    fn the_motion_planted_in_one_pair_is_what_the_ring_does_not_close_by() {
        let poses: Vec<Isometry3> = (0..4).map(|k| Isometry3::translation(10.0 * f64::from(k), 0.0, 0.0)).collect();
        let centre = Point3::new(2.0, 1.0, 0.0);
        let off = motion::motion(&Vector3::new(0.0, 0.0, 1e-3), &Vector3::new(0.02, 0.0, -0.01));
        let edge = |a: usize, b: usize, planted: bool| {
            let exact = poses[b].inverse() * poses[a];
            let b_from_a = if planted { motion::about(&centre, &off) * exact } else { exact };
            Edge { a, b, b_from_a, centre, precision: Matrix6::identity(), covariance: Matrix6::identity() * 1e-4 }
        };
        let edges = [edge(0, 1, false), edge(1, 2, true), edge(0, 2, false), edge(2, 3, false)];
        let found = closures(4, &edges, &poses);
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].views, [0, 1, 2]);
        assert!((found[0].angle_rad - 1e-3).abs() < 1e-9, "{found:?}");
        // Told about the middle of the ring's first pair, 10 from the planted one's: 1e-3 rad shift it by 0.01 along y.
        let expected = Vector3::new(0.02, -0.01, -0.01).norm();
        assert!((found[0].translation - expected).abs() < 1e-6, "{found:?}");
        assert!(found[0].normalised > 0.0 && found[0].expected_translation >= (9e-4_f64).sqrt());
    }
}
