//! Points spread evenly over a face, for alignment and coverage.
//!
//! Candidates are drawn uniformly by area from a fixed seed; each is kept unless an earlier one lies within a radius chosen so that
//! the discs can just be packed at random that densely (random sequential packing fills 0.547 of the plane). So no two samples
//! crowd and no wide gap stays.

use super::FaceSample;
use crate::geometry::weld::Mixing;
use crate::geometry::{Mesh, Point3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::HashMap;

/// Samples aimed at.
const WANTED: usize = 4000;
/// Candidates drawn for each of them: the last gaps are closed late.
const CANDIDATES_EACH: usize = 12;
const SEED: u64 = 0x5a4d_91e5;

/// Spreads the samples; the same mesh gives the same ones. None when the mesh has no area.
pub(super) fn spread(mesh: &Mesh) -> Vec<FaceSample> {
    let mut up_to = Vec::with_capacity(mesh.triangles.len());
    let mut area = 0.0;
    for t in 0..mesh.triangles.len() {
        area += 0.5 * mesh.area_vector_twice(t).norm();
        up_to.push(area);
    }
    if !(area > 0.0 && area.is_finite()) {
        return Vec::new();
    }
    // Saturation density 0.547 / (pi r^2 / 4) = wanted / area, then a little less radius, because candidates end before saturation.
    let radius = 0.93 * (4.0 * 0.547 * area / (std::f64::consts::PI * WANTED as f64)).sqrt();
    // Cells are counted from the mesh; of a surface next to a line the discs would be too small to be counted.
    let Some(bounds) = mesh.bounds() else { return Vec::new() };
    let radius = radius.max(1e-6 * bounds.diagonal());
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let mut grid = Grid { first: HashMap::default(), next: Vec::new() };
    let mut samples: Vec<FaceSample> = Vec::with_capacity(WANTED);
    for _ in 0..CANDIDATES_EACH * WANTED {
        let at: f64 = rng.random::<f64>() * area;
        let (a, b): (f64, f64) = (rng.random(), rng.random());
        let triangle = up_to.partition_point(|sum| *sum <= at).min(up_to.len() - 1);
        let Some(normal) = mesh.normal(triangle) else { continue };
        let point = on_triangle(&mesh.corners(triangle), a, b);
        let cell = [0, 1, 2].map(|k| ((point[k] - bounds.min[k]) / radius).floor() as i64);
        if !grid.holds_any(&cell, |k| (samples[k].point - point).norm_squared() < radius * radius) {
            grid.add(cell);
            samples.push(FaceSample { point, normal });
        }
    }
    samples
}

/// Uniform on the triangle for two uniform numbers.
fn on_triangle(corners: &[Point3; 3], a: f64, b: f64) -> Point3 {
    let (a, b) = if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) };
    corners[0] + (corners[1] - corners[0]) * a + (corners[2] - corners[0]) * b
}

/// Samples by cell, each cell a chain through `next`.
struct Grid {
    first: HashMap<[i64; 3], u32, Mixing>,
    next: Vec<u32>,
}

impl Grid {
    /// Adds the next sample.
    fn add(&mut self, cell: [i64; 3]) {
        let head = self.first.entry(cell).or_insert(u32::MAX);
        self.next.push(*head);
        *head = (self.next.len() - 1) as u32;
    }

    /// Whether any sample in the cell or beside it is of that kind; the cell itself first, where it is likeliest.
    fn holds_any(&self, cell: &[i64; 3], is: impl Fn(usize) -> bool) -> bool {
        const STEPS: [i64; 3] = [0, -1, 1];
        for place in 0..27 {
            let [x, y, z] = [STEPS[place % 3], STEPS[place / 3 % 3], STEPS[place / 9]];
            let mut k = self.first.get(&[cell[0] + x, cell[1] + y, cell[2] + z]).copied().unwrap_or(u32::MAX);
            while k != u32::MAX {
                if is(k as usize) {
                    return true;
                }
                k = self.next[k as usize];
            }
        }
        false
    }
}
