//! The CAD's trimmed edges around a feature, in its plane.

use super::Local;
use super::frame::FeatureFrame;

/// Places along one boundary loop of the CAD in a feature's plane, no further apart than a step.
pub struct Rim {
    /// (u, v) along the loop; consecutive places belong together.
    pub places: Vec<[f64; 2]>,
    /// The last place is followed by the first.
    pub closed: bool,
}

/// The parts of the boundary loops within `radius_mm` of the frame's origin (measured in space), cut into pieces wherever
/// a loop leaves that ball. Straight stretches are subdivided to `step_mm`.
pub fn rims_near(local: &Local, frame: &FeatureFrame, radius_mm: f64, step_mm: f64) -> Vec<Rim> {
    let mut rims = Vec::new();
    for points in &local.face.boundary_loops {
        let mut piece: Vec<[f64; 2]> = Vec::new();
        let mut left = false;
        for pair in points.windows(2) {
            let length = nalgebra::distance(&pair[0], &pair[1]);
            if nalgebra::distance(&pair[0], &frame.seen) > radius_mm + length {
                left = true;
                flush(&mut rims, &mut piece);
                continue;
            }
            let pieces = (length / step_mm).ceil().max(1.0);
            for k in 0..pieces as usize {
                let p = pair[0] + (pair[1] - pair[0]) * (k as f64 / pieces);
                let [u, v, w] = frame.of_cad(&p);
                if u * u + v * v + w * w <= radius_mm * radius_mm {
                    piece.push([u, v]);
                } else {
                    left = true;
                    flush(&mut rims, &mut piece);
                }
            }
        }
        if !piece.is_empty() {
            rims.push(Rim { places: piece, closed: !left });
        }
    }
    rims
}

fn flush(rims: &mut Vec<Rim>, piece: &mut Vec<[f64; 2]>) {
    if !piece.is_empty() {
        rims.push(Rim { places: std::mem::take(piece), closed: false });
    }
}
