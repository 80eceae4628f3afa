//! Many views solved together: each pair asks for a motion of one view against the other, each prior for a motion of one view.
//!
//! Edges of the graph of poses have weights of their own, after Geman and McClure with a scale that comes down from where the problem is nearly
//! linear (graduated non-convexity, Yang et al. 2020): a pair that contradicts the others loses its weight instead of bending them.

use super::motion::{self, Motion};
use super::normal::{Normal, Solved};
use crate::geometry::{Isometry3, Point3};
use crate::run::{Cancelled, RunContext};
use nalgebra::{Matrix6, Vector6};

/// What two views ask of each other, world frame: half the weighted square of `motion of a - motion of b - asked`, motions told about a centre.
#[derive(Debug, Clone)]
pub(super) struct Between {
    pub a: usize,
    pub b: usize,
    pub centre: Point3,
    pub precision: Matrix6<f64>,
    pub asked: Motion,
}

/// What is asked of one view, told about its middle.
#[derive(Debug, Clone)]
pub(super) struct Alone {
    pub view: usize,
    pub precision: Matrix6<f64>,
    pub asked: Motion,
}

/// Solves for the motions, each about its view's own middle; `None` when they are not held.
///
/// # Errors
/// The job was stopped.
pub(super) fn solve(
    middles: &[Point3],
    between: &[Between],
    alone: &[Alone],
    run: &RunContext,
) -> Result<Option<Solved>, Cancelled> {
    let mut normal = Normal::new(middles.len(), between.iter().map(|term| (term.a, term.b)));
    for term in between {
        let a = motion::seen_from(&middles[term.a], &term.centre);
        let b = -motion::seen_from(&middles[term.b], &term.centre);
        let (pa, pb) = (a.transpose() * term.precision, b.transpose() * term.precision);
        normal.add(term.a, term.a, &(pa * a));
        normal.add(term.b, term.b, &(pb * b));
        normal.add(term.a, term.b, &(pa * b));
        normal.ask(term.a, &(pa * term.asked));
        normal.ask(term.b, &(pb * term.asked));
    }
    for term in alone {
        normal.add(term.view, term.view, &term.precision);
        normal.ask(term.view, &(term.precision * term.asked));
    }
    normal.solve(run)
}

/// An edge of the graph: two views as they were registered by themselves.
#[derive(Debug, Clone)]
pub(super) struct Edge {
    pub a: usize,
    pub b: usize,
    pub b_from_a: Isometry3,
    /// Middle of the overlap, frame of `b`, with precision and covariance of motions of `a` about it, frame of `b`.
    pub centre: Point3,
    pub precision: Matrix6<f64>,
    pub covariance: Matrix6<f64>,
}

impl Edge {
    /// What it asks in given poses, world frame.
    pub(super) fn term(&self, world_from_view: &[Isometry3]) -> Between {
        let (a, b) = (&world_from_view[self.a], &world_from_view[self.b]);
        let centre = b * self.centre;
        let asked = motion::of_rigid(&(b * self.b_from_a * a.inverse()), &centre);
        let turned = motion::turned(&b.rotation);
        let precision = turned * self.precision * turned.transpose();
        Between { a: self.a, b: self.b, centre, precision, asked }
    }

    /// Covariance of what it asks, world frame, about its centre.
    pub(super) fn covariance_in(&self, world_from_view: &[Isometry3]) -> Matrix6<f64> {
        let turned = motion::turned(&world_from_view[self.b].rotation);
        turned * self.covariance * turned.transpose()
    }
}

/// What holds a single view: its prior, or that it stays where it is.
#[derive(Debug, Clone)]
pub(super) struct Anchor {
    pub view: usize,
    /// Where it is held.
    pub world_from_view: Isometry3,
    /// Standard deviations of turn and shift of its middle.
    pub rotation_sigma_rad: f64,
    pub translation_sigma: f64,
    /// Whether it follows the view instead of holding it: the view is held by nothing else.
    pub follows: bool,
}

impl Anchor {
    /// What it asks in given poses.
    pub(super) fn term(&self, world_from_view: &[Isometry3], middle_view: &Point3) -> Alone {
        let now = &world_from_view[self.view];
        let asked = if self.follows {
            Motion::zeros()
        } else {
            motion::of_rigid(&(self.world_from_view * now.inverse()), &(now * middle_view))
        };
        let (turn, shift) = (self.rotation_sigma_rad.powi(-2), self.translation_sigma.powi(-2));
        let precision = Matrix6::from_diagonal(&Vector6::new(turn, turn, turn, shift, shift, shift));
        Alone { view: self.view, precision, asked }
    }
}

/// Moves each view about its middle.
pub(super) fn move_views(world_from_view: &mut [Isometry3], middles: &[Point3], motions: &[Motion]) {
    for ((pose, middle), motion) in world_from_view.iter_mut().zip(middles).zip(motions) {
        *pose = motion::about(middle, motion) * *pose;
        pose.rotation.renormalize();
    }
}

/// Steps with each scale of the weights; they are enough since poses are nearly right.
const STEPS: usize = 3;
/// Factor by which the scale comes down.
const COOLING: f64 = 2.0;
/// An edge that is off by this many standard deviations in each of six motions has a quarter of the weight.
const DOUBTFUL_SIGMAS: f64 = 4.0;
/// Lower weights are taken for a contradiction.
pub(super) const LEAST_WEIGHT: f64 = 0.25;

/// Poses by edges and anchors, and a weight of each edge; `None` where they hold nothing.
///
/// # Errors
/// The job was stopped.
pub(super) fn graph(
    world_from_view: &mut [Isometry3],
    middles_view: &[Point3],
    edges: &[Edge],
    anchors: &[Anchor],
    run: &RunContext,
) -> Result<Option<Vec<f64>>, Cancelled> {
    let bound = 6.0 * DOUBTFUL_SIGMAS * DOUBTFUL_SIGMAS;
    let square = |term: &Between| (term.asked.transpose() * term.precision * term.asked)[0];
    let terms = |poses: &[Isometry3]| edges.iter().map(|edge| edge.term(poses)).collect::<Vec<Between>>();
    let weights = |terms: &[Between], wide: f64| -> Vec<f64> {
        terms.iter().map(|term| (wide * bound / (wide * bound + square(term))).powi(2)).collect()
    };
    let step = |poses: &mut [Isometry3], wide: f64| -> Result<bool, Cancelled> {
        let mut between = terms(poses);
        let weights = weights(&between, wide);
        between.iter_mut().zip(weights).for_each(|(term, w)| term.precision *= w);
        let middles: Vec<Point3> = poses.iter().zip(middles_view).map(|(pose, middle)| pose * middle).collect();
        let alone: Vec<Alone> = anchors.iter().map(|anchor| anchor.term(poses, &middles_view[anchor.view])).collect();
        let Some(solved) = solve(&middles, &between, &alone, run)? else { return Ok(false) };
        move_views(poses, &middles, &solved.motions);
        Ok(true)
    };
    // All edges alike once, so that the scale begins at what they contradict each other by, not at what the priors are off by.
    if !step(world_from_view, 1e12)? {
        return Ok(None);
    }
    let worst = terms(world_from_view).iter().map(square).fold(0.0, f64::max);
    let mut wide = (2.0 * worst / bound).max(1.0);
    loop {
        for _ in 0..STEPS {
            if !step(world_from_view, wide)? {
                return Ok(None);
            }
        }
        if wide <= 1.0 {
            return Ok(Some(weights(&terms(world_from_view), 1.0)));
        }
        wide = (wide / COOLING).max(1.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vector3;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn small(rng: &mut ChaCha8Rng, turn: f64, shift: f64) -> Isometry3 {
        let mut vector = |size: f64| Vector3::from_fn(|_, _| size * (rng.random::<f64>() - 0.5));
        Isometry3::new(vector(shift), vector(turn))
    }

    /// A ring of twelve views with chords. Exact edges give exact poses, though priors are off and two edges say something else.
    #[test]
    fn exact_edges_give_the_planted_poses_and_contradicting_ones_lose_their_weight() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let truth: Vec<Isometry3> =
            (0..12).map(|k| Isometry3::new(Vector3::new(10.0 * f64::from(k), 0.0, 0.0), Vector3::y() * 0.1)).collect();
        let middles = vec![Point3::new(0.0, 0.0, 50.0); 12];
        let precision = Matrix6::identity() * 1e6;
        let pairs = (0..12).flat_map(|a| [1, 2, 3].map(|step| (a, (a + step) % 12)));
        let mut edges: Vec<Edge> = pairs
            .map(|(a, b)| {
                let b_from_a = truth[b].inverse() * truth[a];
                Edge { a, b, b_from_a, centre: middles[0], precision, covariance: Matrix6::identity() * 1e-6 }
            })
            .collect();
        for k in [4, 20] {
            edges[k].b_from_a = small(&mut rng, 0.05, 3.0) * edges[k].b_from_a;
        }
        let anchors: Vec<Anchor> = (0..12)
            .map(|view| Anchor {
                view,
                // Only their mean is held: the first prior is right and far surer than the others.
                world_from_view: if view == 0 { truth[0] } else { small(&mut rng, 0.02, 1.0) * truth[view] },
                rotation_sigma_rad: if view == 0 { 1e-7 } else { 1.0 },
                translation_sigma: if view == 0 { 1e-7 } else { 50.0 },
                follows: false,
            })
            .collect();
        let mut poses: Vec<Isometry3> = anchors.iter().map(|anchor| anchor.world_from_view).collect();
        let weights = graph(&mut poses, &middles, &edges, &anchors, &RunContext::silent()).unwrap().unwrap();
        for (k, weight) in weights.iter().enumerate() {
            assert_eq!(*weight < LEAST_WEIGHT, [4, 20].contains(&k), "edge {k}: {weight}");
        }
        for (pose, truth) in poses.iter().zip(&truth) {
            // Priors of 1 / 50² pull against edges of 1e6, and rejected edges keep a weight of some 1e-4 of theirs: below 1e-4 of a few.
            assert!((pose * middles[0] - truth * middles[0]).norm() < 2e-3, "{pose} {truth}");
        }
    }
}
