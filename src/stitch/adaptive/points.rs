//! The points that are merged, wherever they lie.

use crate::geometry::Point3;

/// Points in parts (views), part after part. Of equal scores the point of the lower part is better, in a part the one of the lower index.
///
/// Places and scores are asked for several times and must come out the same each time.
pub trait Points: Sync {
    /// How many parts there are.
    fn parts(&self) -> usize;
    /// Points of a part.
    fn count(&self, part: usize) -> usize;
    /// Where a point of a part lies.
    fn position(&self, part: usize, index: usize) -> Point3;
    /// How good it is: larger is better, what is no number is worse than any.
    fn score(&self, part: usize, index: usize) -> f64;
}

/// A score as a number of which the smaller is better.
pub(in crate::stitch) fn score_key(score: f64) -> u64 {
    // The order of bits is that of numbers, once negative ones are turned round; both zeros are one.
    let bits = (score + 0.0).to_bits();
    let rising = if bits >> 63 == 1 { !bits } else { bits | (1 << 63) };
    if score.is_nan() { u64::MAX } else { !rising }
}

/// Points numbered through all parts, from 0.
pub(super) struct Numbered<'a, P> {
    pub points: &'a P,
    /// Number of the first point of each part, and one past the last.
    pub starts: Vec<u32>,
}

impl<'a, P: Points> Numbered<'a, P> {
    /// # Panics
    /// When there are more than 4 294 967 295 points.
    pub fn new(points: &'a P) -> Self {
        let mut starts = vec![0];
        let mut sum = 0_usize;
        for part in 0..points.parts() {
            sum += points.count(part);
            starts.push(u32::try_from(sum).expect("points are numbered in 32 bits"));
        }
        Self { points, starts }
    }

    pub fn len(&self) -> usize {
        self.starts.last().map_or(0, |last| *last as usize)
    }

    /// Part of a point and index in it.
    pub fn place(&self, number: u32) -> (usize, usize) {
        let part = self.starts.partition_point(|start| *start <= number) - 1;
        (part, (number - self.starts[part]) as usize)
    }

    pub fn position(&self, number: u32) -> Point3 {
        let (part, index) = self.place(number);
        self.points.position(part, index)
    }

    /// Of two points the one with the smaller key is better.
    pub fn key(&self, number: u32) -> (u64, u32) {
        let (part, index) = self.place(number);
        (score_key(self.points.score(part, index)), number)
    }
}
