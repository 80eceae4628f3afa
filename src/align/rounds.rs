//! Rounds of measuring the datums and moving the part, and when they have ended.
//!
//! Each round shrinks the remaining motion. A window that shrinks where its fit lacks (see `measure::surface`) may be large in
//! one round's pose and small in the next one's: the rounds then come back to where they were, again and again, and the poses
//! among which they go round are all the answers there are.

use crate::geometry::{Aabb, CadFromScan, Isometry3, Point3};

/// A round that moves no corner of the part's box by more than this ends the iteration, mm.
const SETTLED_MM: f64 = 1e-7;
/// Motions that no longer shrink, two after each other, are the toggling of single points at the windows' rims, below this, mm.
const TOGGLING_MM: f64 = 0.01;
/// Longest way round, in rounds.
const LONGEST_CYCLE: usize = 4;
/// The rounds have come back when what is missing is this share of the last motion: a round shrinks what remains to less.
const RETURNED: f64 = 0.25;

/// The poses after each round, the first the one before all.
pub(super) struct Rounds {
    corners: [Point3; 8],
    poses: Vec<CadFromScan>,
}

impl Rounds {
    /// None made yet.
    pub fn from(start: CadFromScan, bounds: &Aabb) -> Self {
        Self { corners: corners(bounds), poses: vec![start] }
    }

    /// The pose after the last round.
    pub fn pose(&self) -> CadFromScan {
        self.poses[self.poses.len() - 1]
    }

    /// Takes a round's motion over.
    pub fn add(&mut self, motion: &Isometry3) {
        self.poses.push(CadFromScan::new(motion * self.pose().isometry()));
    }

    /// How far a round moved the part's furthest corner, mm: `back` 0 for the last. Infinite where there was no such round.
    fn moved_mm(&self, back: usize) -> f64 {
        let before = self.poses.len().checked_sub(2 + back);
        before.map_or(f64::INFINITY, |before| self.apart_mm(before, before + 1))
    }

    /// How far the last round moved the part.
    pub fn last_moved_mm(&self) -> f64 {
        self.moved_mm(0)
    }

    fn apart_mm(&self, a: usize, b: usize) -> f64 {
        furthest_mm(&self.corners, &self.motion(a, b))
    }

    /// The part's motion from one pose to another, CAD frame.
    fn motion(&self, from: usize, to: usize) -> Isometry3 {
        self.poses[to].isometry() * self.poses[from].isometry().inverse()
    }

    /// Whether going on would change nothing.
    pub fn have_settled(&self) -> bool {
        let (last, before, first) = (self.moved_mm(0), self.moved_mm(1), self.moved_mm(2));
        last < SETTLED_MM || (last < TOGGLING_MM && last > 0.5 * before && before > 0.5 * first)
    }

    /// The motions from the last pose to the others of the cycle that the rounds go round; `None` where they go on to new
    /// places.
    pub fn cycle(&self) -> Option<Vec<Isometry3>> {
        let last = self.poses.len() - 1;
        let returned = |length: &usize| self.apart_mm(last - length, last) < RETURNED * self.last_moved_mm();
        let length = (2..=LONGEST_CYCLE.min(last)).find(returned)?;
        Some((1..length).map(|back| self.motion(last, last - back)).collect())
    }
}

/// The corners of a box.
pub(super) fn corners(bounds: &Aabb) -> [Point3; 8] {
    let ends = [bounds.min, bounds.max];
    std::array::from_fn(|k| Point3::new(ends[k & 1].x, ends[k >> 1 & 1].y, ends[k >> 2 & 1].z))
}

/// How far a motion moves the furthest of some points, mm.
pub(super) fn furthest_mm(points: &[Point3], motion: &Isometry3) -> f64 {
    points.iter().map(|p| (motion * p - p).norm()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vector3;

    fn lifts(lifts_mm: &[f64]) -> Rounds {
        let bounds = Aabb { min: Point3::origin(), max: Point3::new(300.0, 200.0, 30.0) };
        let mut rounds = Rounds::from(CadFromScan::new(Isometry3::identity()), &bounds);
        for by in lifts_mm {
            rounds.add(&Isometry3::translation(0.0, 0.0, *by));
        }
        rounds
    }

    #[test]
    fn shrinking_motions_settle_and_are_no_cycle() {
        let rounds = lifts(&[1.0, 0.1, 0.01, 1e-3, 1e-4]);
        assert!(!rounds.have_settled() && rounds.cycle().is_none());
        assert!(lifts(&[1.0, 1e-3, 1e-8]).have_settled());
        // Single points that toggle; once may be chance.
        assert!(!lifts(&[1.0, 1e-3, -9e-4]).have_settled());
        assert!(lifts(&[1.0, 1e-3, -9e-4, 9e-4]).have_settled());
        // One way, however slowly, is no cycle.
        assert!(lifts(&[0.05; 8]).cycle().is_none() && !lifts(&[0.05; 8]).have_settled());
    }

    /// A window that is 5 mm in one round and 3.5 mm in the next tells heights 0.03 mm apart.
    #[test]
    fn a_window_that_switches_is_a_cycle_with_its_span() {
        let two = lifts(&[0.8, 0.03, -0.031, 0.0305, -0.0305, 0.0305]);
        assert!(!two.have_settled());
        let motions = two.cycle().unwrap();
        assert_eq!(motions.len(), 1);
        assert!((motions[0].translation.vector - Vector3::new(0.0, 0.0, -0.0305)).norm() < 1e-12);
        let three = lifts(&[0.8, 0.03, 0.02, -0.05, 0.03, 0.02, -0.05]).cycle().unwrap();
        let heights: Vec<f64> = three.iter().map(|m| (1e6 * m.translation.z).round()).collect();
        assert_eq!(heights, [50_000.0, 30_000.0]);
    }
}
