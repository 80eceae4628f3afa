//! Sampling a cloud without sorting it: stratified samples, local density and local noise.
//!
//! A search tree over two million points would cost more than the whole background removal. Instead a few hundred seed
//! points get a ball each, the balls go into a small hash table, and one pass over the cloud drops every point into the
//! balls it lies in.

use crate::fit::robust::{SIGMA_OF_MAD, middle_value};
use crate::geometry::{Point3, Vector3, decompose};
use nalgebra::Matrix3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Points a chunk: fixed, so that sums are made in the same order whatever the number of threads.
pub(super) const CHUNK: usize = 1 << 15;

/// Buckets of the table of balls.
const BUCKETS: usize = 1 << 16;

/// What a cloud looks like close up.
#[derive(Debug, Clone, Copy)]
pub(super) struct Texture {
    /// 1 / sqrt(points per mm²).
    pub spacing_mm: f64,
    /// Standard deviation of the points about local planes, mm.
    pub noise_mm: f64,
}

/// At most `wanted` of the numbers below `count`, ascending: one at random out of each of `wanted` equal stretches, so that
/// neither the order of the file nor its scan lines can resonate with the sample.
pub(super) fn stratified(count: usize, wanted: usize, seed: u64) -> Vec<u32> {
    if count <= wanted {
        return (0..count as u32).collect();
    }
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..wanted)
        .map(|k| {
            let from = k * count / wanted;
            let to = (k + 1) * count / wanted;
            rng.random_range(from..to) as u32
        })
        .collect()
}

/// Spacing and noise of the points named by `indices` (ascending), measured in several hundred balls. `None` when there
/// are too few points for it, or all lie on one spot.
///
/// Of a large cloud half a million points are used, spread evenly: its surface is flat enough over the wider balls.
pub(super) fn texture(positions: &[Point3], indices: &[u32], seed: u64) -> Option<Texture> {
    const ENOUGH: usize = 500_000;
    if indices.len() <= ENOUGH {
        return texture_of_all(positions, indices, seed);
    }
    let thinned: Vec<u32> =
        stratified(indices.len(), ENOUGH, seed ^ 0x7417).into_iter().map(|k| indices[k as usize]).collect();
    let found = texture_of_all(positions, &thinned, seed)?;
    let thinning = (thinned.len() as f64 / indices.len() as f64).sqrt();
    Some(Texture { spacing_mm: found.spacing_mm * thinning, ..found })
}

fn texture_of_all(positions: &[Point3], indices: &[u32], seed: u64) -> Option<Texture> {
    let mut spacing_mm = rough_spacing_mm(positions, indices, seed)?;
    let seeds: Vec<u32> =
        stratified(indices.len(), 400, seed ^ 0x5eed).into_iter().map(|k| indices[k as usize]).collect();
    let mut noise_mm = 0.0;
    // A second round only when the first guess of the density or of the noise was poor.
    for _ in 0..2 {
        // About 50 points a ball; it must be wide against the noise, or it loses points above and below.
        let radius_mm = (4.0 * spacing_mm).max(6.0 * noise_mm);
        let balls = in_balls(positions, indices, &seeds, radius_mm);
        let patches: Vec<Patch> = balls
            .par_iter()
            .zip(&seeds)
            .filter_map(|(ball, &seed)| Patch::new(positions, ball, seed, radius_mm))
            .collect();
        let mut densities: Vec<f64> = patches.iter().map(|patch| patch.density).collect();
        let mut noises: Vec<f64> = patches.iter().map(|patch| patch.noise_mm).collect();
        let (Some(density), Some(noise)) = (middle_value(&mut densities), middle_value(&mut noises)) else {
            return Some(Texture { spacing_mm, noise_mm });
        };
        noise_mm = noise;
        let better_mm = 1.0 / density.sqrt();
        let was_good = (0.7..1.4).contains(&(better_mm / spacing_mm)) && 6.0 * noise_mm < 1.5 * radius_mm;
        spacing_mm = better_mm;
        if was_good {
            break;
        }
    }
    Some(Texture { spacing_mm, noise_mm })
}

/// The surface within one ball, taken for a plane.
struct Patch {
    /// Points per mm² of the plane.
    density: f64,
    /// Robust standard deviation about it, mm.
    noise_mm: f64,
}

impl Patch {
    /// `None` for fewer than ten points, or for points on a line.
    fn new(positions: &[Point3], ball: &[u32], seed: u32, radius_mm: f64) -> Option<Self> {
        if ball.len() < 10 {
            return None;
        }
        let points: Vec<Point3> = ball.iter().map(|&k| positions[k as usize]).collect();
        let (centroid, normal) = weighted_plane(&points, |_| 1.0)?;
        let mut heights: Vec<f64> = points.iter().map(|p| (p - centroid).dot(&normal).abs()).collect();
        // Three parameters were fitted.
        let freedom = (points.len() as f64 / (points.len() - 3) as f64).sqrt();
        let noise_mm = SIGMA_OF_MAD * middle_value(&mut heights)? * freedom;
        // Counted in a cylinder of 0.6 of the radius: there the ball reaches 0.8 of its radius up and down.
        let cylinder_mm = 0.6 * radius_mm;
        let centre = positions[seed as usize];
        let inside = |p: &&Point3| {
            let d = *p - centre;
            (d - normal * d.dot(&normal)).norm_squared() <= cylinder_mm * cylinder_mm
        };
        // The seed itself is there for certain and tells nothing about the density.
        let others = points.iter().filter(inside).count().saturating_sub(1);
        let density = others.max(1) as f64 / (std::f64::consts::PI * cylinder_mm * cylinder_mm);
        Some(Self { density, noise_mm })
    }
}

/// Spacing from the distance to the eighth neighbour within a sample, scaled to the whole.
fn rough_spacing_mm(positions: &[Point3], indices: &[u32], seed: u64) -> Option<f64> {
    const NEIGHBOUR: usize = 8;
    let sample: Vec<Point3> =
        stratified(indices.len(), 6000, seed).into_iter().map(|k| positions[indices[k as usize] as usize]).collect();
    if sample.len() < 4 * NEIGHBOUR {
        return None;
    }
    let mut spacings: Vec<f64> = stratified(sample.len(), 300, seed)
        .par_iter()
        .map(|&k| {
            let centre = sample[k as usize];
            let mut distances_sq: Vec<f64> = sample.iter().map(|p| (p - centre).norm_squared()).collect();
            // Place 0 is the point itself.
            let (_, eighth_sq, _) = distances_sq.select_nth_unstable_by(NEIGHBOUR, f64::total_cmp);
            (std::f64::consts::PI * *eighth_sq / (NEIGHBOUR - 1) as f64).sqrt()
        })
        .collect();
    let in_sample_mm = middle_value(&mut spacings)?;
    let all_mm = in_sample_mm * (sample.len() as f64 / indices.len() as f64).sqrt();
    (all_mm > 1e-9 && all_mm.is_finite()).then_some(all_mm)
}

/// For every seed the points of `indices` within the radius, in the order of `indices`.
fn in_balls(positions: &[Point3], indices: &[u32], seeds: &[u32], radius_mm: f64) -> Vec<Vec<u32>> {
    let table = BallTable::new(positions, seeds, radius_mm);
    let radius_sq = radius_mm * radius_mm;
    let hits: Vec<Vec<(u32, u32)>> = indices
        .par_chunks(CHUNK)
        .map(|chunk| {
            let mut found = Vec::new();
            for &index in chunk {
                let point = &positions[index as usize];
                for &ball in table.near(point) {
                    if (positions[seeds[ball as usize] as usize] - point).norm_squared() <= radius_sq {
                        found.push((ball, index));
                    }
                }
            }
            found
        })
        .collect();
    let mut balls = vec![Vec::new(); seeds.len()];
    for (ball, index) in hits.into_iter().flatten() {
        balls[ball as usize].push(index);
    }
    balls
}

/// Balls by hashed cell, as one list with the start of every bucket.
struct BallTable {
    cell_mm: f64,
    starts: Vec<u32>,
    balls: Vec<u32>,
}

impl BallTable {
    fn new(positions: &[Point3], seeds: &[u32], radius_mm: f64) -> Self {
        // With cells of two radii a ball touches eight of them at most, and its bounding box touches the same ones.
        let cell_mm = 2.0 * radius_mm;
        let mut entries: Vec<(u32, u32)> = Vec::with_capacity(8 * seeds.len());
        for (ball, &seed) in seeds.iter().enumerate() {
            let centre = &positions[seed as usize];
            for corner in 0..8 {
                let side = |bit: u32| if corner >> bit & 1 == 1 { radius_mm } else { -radius_mm };
                let at = centre + Vector3::new(side(0), side(1), side(2));
                entries.push((bucket(&at, cell_mm), ball as u32));
            }
        }
        entries.sort_unstable();
        entries.dedup();
        let mut starts = vec![0u32; BUCKETS + 1];
        for &(bucket, _) in &entries {
            starts[bucket as usize + 1] += 1;
        }
        for k in 0..BUCKETS {
            starts[k + 1] += starts[k];
        }
        Self { cell_mm, starts, balls: entries.into_iter().map(|(_, ball)| ball).collect() }
    }

    fn near(&self, point: &Point3) -> &[u32] {
        let bucket = bucket(point, self.cell_mm) as usize;
        &self.balls[self.starts[bucket] as usize..self.starts[bucket + 1] as usize]
    }
}

fn bucket(point: &Point3, cell_mm: f64) -> u32 {
    let cell = |v: f64| floor(v / cell_mm) as u64;
    let mixed = cell(point.x)
        .wrapping_mul(0x9e37_79b9_7f4a_7c15)
        .wrapping_add(cell(point.y).wrapping_mul(0xc2b2_ae3d_27d4_eb4f))
        .wrapping_add(cell(point.z).wrapping_mul(0x1656_67b1_9e37_79f9));
    ((mixed ^ (mixed >> 31)).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 48) as u32
}

/// Plane of least weighted squared distances: centroid and unit normal. `None` when the weights leave fewer than three
/// points' worth, or the points lie on a line.
pub(super) fn weighted_plane(points: &[Point3], weight: impl Fn(&Point3) -> f64) -> Option<(Point3, Vector3)> {
    // About the first point, so that far origins cost no digits.
    let origin = *points.first()?;
    let (mut total, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
    for point in points {
        let w = weight(point);
        if w > 0.0 {
            let v = point - origin;
            total += w;
            first += v * w;
            second += v * v.transpose() * w;
        }
    }
    if total < 3.0 {
        return None;
    }
    let mean = first / total;
    let covariance = second / total - mean * mean.transpose();
    let eigen = decompose::symmetric_eigen(covariance)?;
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    // Spread along two directions, or there is no plane.
    let spreads = eigen.eigenvalues[order[1]] > 1e-9 * eigen.eigenvalues[order[2]].abs();
    let normal: Vector3 = eigen.eigenvectors.column(order[0]).into_owned();
    spreads.then(|| (origin + mean, normal.normalize()))
}

/// The next whole number below; saturating. Without the newer instructions of a processor `f64::floor` is a call, which is felt
/// in a loop over all points.
pub(super) fn floor(value: f64) -> i64 {
    let truncated = value as i64;
    if value < truncated as f64 { truncated.saturating_sub(1) } else { truncated }
}
