//! The CAD's trimmed edges around a feature, in its frame.

use super::frame::{FeatureFrame, Uvw};
use crate::geometry::Point3;
use crate::part::Face;
use std::ops::Range;

/// Places along one boundary loop of the CAD's seen face about a feature's frame, no further apart than a step.
pub struct Rim {
    /// Along the loop; consecutive places belong together.
    pub places: Vec<Uvw>,
    /// The last place is followed by the first.
    pub closed: bool,
}

/// The parts of the boundary loops within `radius_mm` of the frame's origin (measured in space), cut into pieces wherever
/// a loop leaves that ball. Straight stretches are subdivided to `step_mm`.
pub fn rims_near(face: &Face, frame: &FeatureFrame, radius_mm: f64, step_mm: f64) -> Vec<Rim> {
    let mut rims = Vec::new();
    for points in &face.boundary_loops {
        let mut piece: Vec<Uvw> = Vec::new();
        let mut left = false;
        for pair in points.windows(2) {
            let pieces = (nalgebra::distance(&pair[0], &pair[1]) / step_mm).ceil().max(1.0);
            let near = steps_inside([&pair[0], &pair[1]], pieces, &frame.seen, radius_mm);
            let (starts_outside, ends_outside) = (near.start > 0 || near.is_empty(), near.end < pieces as usize);
            if starts_outside {
                left = true;
                flush(&mut rims, &mut piece);
            }
            for k in near {
                let p = pair[0] + (pair[1] - pair[0]) * (k as f64 / pieces);
                let place @ [u, v, w] = frame.of_cad(&p);
                if u * u + v * v + w * w <= radius_mm * radius_mm {
                    piece.push(place);
                } else {
                    left = true;
                    flush(&mut rims, &mut piece);
                }
            }
            if ends_outside {
                left = true;
                flush(&mut rims, &mut piece);
            }
        }
        if !piece.is_empty() {
            rims.push(Rim { places: piece, closed: !left });
        }
    }
    rims
}

/// Whether a rim's place is that of a leaf behind the sheet (the other edge of a channel, the inner leaf of a hem): it neither ends that
/// sheet nor hides it. `above_mm` is the place's height above the sheet as known from `away_mm` away, over which the sheet may
/// rise or fall by half of that.
pub fn is_of_a_leaf_behind(frame: &FeatureFrame, above_mm: f64, away_mm: f64) -> bool {
    const LEAVES_MM: f64 = 0.3;
    // Not a number is no height.
    above_mm * frame.outward < -(LEAVES_MM + 0.5 * away_mm)
}

/// Of the places `k / pieces` along a segment, `k` in `0..pieces`, a stretch that holds all within a ball, and few others: a CAD's
/// edge may be many thousand times as long as the ball is wide.
fn steps_inside([from, to]: [&Point3; 2], pieces: f64, middle: &Point3, radius_mm: f64) -> Range<usize> {
    let (way, start) = (to - from, from - middle);
    let length_sq = way.norm_squared();
    if length_sq <= 0.0 {
        return 0..pieces as usize;
    }
    let foot = -start.dot(&way) / length_sq;
    // A little wider than the ball: rounding must not lose a place on its surface.
    let radius_sq = (1.001 * radius_mm).powi(2);
    let inside_sq = radius_sq - (start + way * foot).norm_squared();
    if inside_sq < 0.0 {
        return 0..0;
    }
    let half = (inside_sq / length_sq).sqrt();
    let first = ((foot - half) * pieces).floor().max(0.0) as usize;
    let end = ((foot + half) * pieces).ceil().clamp(-1.0, pieces - 1.0) + 1.0;
    first..(end as usize).max(first)
}

fn flush(rims: &mut Vec<Rim>, piece: &mut Vec<Uvw>) {
    if !piece.is_empty() {
        rims.push(Rim { places: std::mem::take(piece), closed: false });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As every place on its own tells, for segments through the ball, beside it, that begin or end in it, and for a point.
    #[test]
    fn the_stretch_holds_every_place_in_the_ball_and_few_others() {
        let middle = Point3::new(1.0, 2.0, 3.0);
        let radius = 9.0;
        let ends = [
            [-50.0, 2.0, 3.0],
            [50.0, 4.0, 1.0],
            [3.0, 2.0, 1.0],
            [1.0, 60.0, 3.0],
            [1.0, 10.9, 3.0],
            [40.0, 40.0, 40.0],
        ];
        for a in ends.map(Point3::from) {
            for b in ends.map(Point3::from) {
                let pieces = (nalgebra::distance(&a, &b) / 0.25).ceil().max(1.0);
                let near = steps_inside([&a, &b], pieces, &middle, radius);
                assert!(near.end <= pieces as usize, "{a} {b}: {near:?}");
                let inside = |k: &usize| ((a + (b - a) * (*k as f64 / pieces)) - middle).norm() <= radius;
                let all: Vec<usize> = (0..pieces as usize).filter(inside).collect();
                assert!(all.iter().all(|k| near.contains(k)), "{a} {b}: {near:?}");
                // One step at each end, and what the wider ball adds: of a segment that touches it up to twice the root of
                // 2 x 0.001 x 9² in steps of 0.25 mm.
                assert!(near.len() <= all.len() + 6, "{a} {b}: {near:?} for {}", all.len());
            }
        }
    }

    #[test]
    fn an_edge_of_a_thousand_kilometres_is_looked_at_around_the_place_only() {
        let (a, b) = (Point3::new(-1e9, 0.0, 1.0), Point3::new(1e9, 0.0, 1.0));
        let near = steps_inside([&a, &b], 8e9, &Point3::origin(), 10.0);
        // 20 mm in steps of 0.25 mm, and the two ends.
        assert!((79..=83).contains(&near.len()) && near.contains(&4_000_000_000), "{near:?}");
    }
}
