//! The belt: the plane with (nearly) nothing behind it.
//!
//! SIVPRO fits "a plane to the colour of the non-worn region of the conveyor belt". Here colour only proposes planes; what
//! makes a plane the belt is that the camera sees nothing beyond it. A big flat part has more points than the belt around
//! it, but the belt lies behind its plane, so the search goes down to those points and tries again until nothing is left
//! behind. Points that scatter behind the plane where the plane itself is seen are noise and do not count.

use super::conditioned::BeltPlane;
use super::neighbourhood::{Texture, weighted_plane};
use crate::fit::robust::{SIGMA_OF_MAD, middle_value, tukey_weight};
use crate::geometry::{Point3, UnitVector3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Width of Tukey's weight in standard deviations. Narrower than the usual 4.685: the belt has points to spare, but the
/// face of a thin part may lie five standard deviations above it and must have no pull.
const TUKEY: f64 = 3.0;
/// Least share of the points that a belt must have.
const LEAST_SHARE: f64 = 0.03;
/// Share of the points that may lie behind the belt where no belt is seen (junk in deep shadow).
const BEHIND_SHARE: f64 = 0.01;
/// A belt is not seen flatter than this (cosine to the direction of the camera).
const LEAST_COSINE: f64 = 0.5;
/// How often the search goes further down.
const LEVELS: usize = 6;

/// A few thousand points that stand for the cloud.
pub(super) struct Sample {
    /// Their positions.
    pub points: Vec<Point3>,
    /// Places in `points` that have a colour of the unworn belt.
    pub belt_coloured: Vec<u32>,
    /// Spacing and noise of the whole cloud.
    pub texture: Texture,
    /// How many points of the cloud each of them stands for.
    pub each_for: f64,
}

impl Sample {
    /// Surface in mm² that one point of the sample stands for.
    pub fn area_each_mm2(&self) -> f64 {
        self.each_for * self.texture.spacing_mm * self.texture.spacing_mm
    }

    fn noise_mm(&self) -> f64 {
        // A noiseless cloud still has rounding.
        self.texture.noise_mm.max(1e-3 * self.texture.spacing_mm)
    }
}

/// The backmost plane seen from the side of `to_camera`, with its normal on that side. `None` when there is no plane with
/// nothing behind it that has a fair share of the points.
pub(super) fn backmost_plane(sample: &Sample, to_camera: &Vector3, least_cosine: f64) -> Option<BeltPlane> {
    let count = sample.points.len();
    let mut among: Vec<u32> = (0..count as u32).collect();
    for level in 0..LEVELS {
        let plane = dominant_plane(sample, &among, Some((to_camera, least_cosine)), level as u64)?;
        let behind = behind_plane(sample, &plane);
        if behind.len() as f64 <= BEHIND_SHARE * count as f64 {
            let share = inliers(sample, &plane).count() as f64 / count as f64;
            return (share >= LEAST_SHARE).then_some(plane);
        }
        among = behind;
    }
    None
}

/// The backmost plane for a known camera.
pub(super) fn belt_seen_from(sample: &Sample, to_camera: &Vector3) -> Option<BeltPlane> {
    backmost_plane(sample, to_camera, LEAST_COSINE)
}

/// The backmost planes for both sides on which the camera may stand, when nothing is known of it.
pub(super) fn belts_seen_from_both_sides(sample: &Sample) -> Vec<BeltPlane> {
    let among: Vec<u32> = (0..sample.points.len() as u32).collect();
    let Some(dominant) = dominant_plane(sample, &among, None, 99) else { return Vec::new() };
    let normal = dominant.normal.into_inner();
    // The dominant plane may be a sloping face of the part, so the belt may differ from it by much.
    [normal, -normal].iter().filter_map(|side| backmost_plane(sample, side, 0.2)).collect()
}

/// The sample's points on the plane, within 3.5 standard deviations.
pub(super) fn inliers<'a>(sample: &'a Sample, plane: &'a BeltPlane) -> impl Iterator<Item = &'a Point3> {
    sample.points.iter().filter(|p| plane.height_mm(p).abs() <= 3.5 * plane.sigma_mm)
}

/// Places of the points that lie behind the plane where the plane itself is not seen: in a raster along the plane, those
/// of cells in which most points lie behind.
pub(super) fn behind_plane(sample: &Sample, plane: &BeltPlane) -> Vec<u32> {
    let (u, v) = tangents(&plane.normal);
    // About eight points of the sample in a cell that is covered.
    let cell_mm = (8.0 * sample.area_each_mm2()).sqrt();
    let cell_of = |p: &Point3| {
        let d = p - plane.point;
        ((d.dot(&u) / cell_mm).floor() as i64, (d.dot(&v) / cell_mm).floor() as i64)
    };
    let mut entries: Vec<((i64, i64), bool, u32)> = sample
        .points
        .iter()
        .enumerate()
        .map(|(k, p)| (cell_of(p), plane.height_mm(p) < -4.0 * plane.sigma_mm, k as u32))
        .collect();
    entries.sort_unstable();
    let mut places: Vec<u32> = entries
        .chunk_by(|a, b| a.0 == b.0)
        .filter(|cell| {
            let behind = cell.iter().filter(|entry| entry.1).count();
            behind >= 3 && 2 * behind > cell.len()
        })
        .flat_map(|cell| cell.iter().filter(|entry| entry.1).map(|entry| entry.2))
        .collect();
    places.sort_unstable();
    places
}

/// Two unit vectors that span the plane of a normal.
pub(super) fn tangents(normal: &UnitVector3) -> (Vector3, Vector3) {
    let other = if normal.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
    let u = normal.cross(&other).normalize();
    (u, normal.cross(&u))
}

/// The plane with the most support among some points of the sample (MSAC), refined on all of them. With `towards`, only
/// planes whose normal, turned to that side, has at least the given cosine to it.
fn dominant_plane(sample: &Sample, among: &[u32], towards: Option<(&Vector3, f64)>, seed: u64) -> Option<BeltPlane> {
    const REFINED: usize = 8;
    if among.len() < 20 {
        return None;
    }
    let band_mm = 3.0 * sample.noise_mm();
    let judges: Vec<Point3> = {
        let step = among.len().div_ceil(2000);
        among.iter().step_by(step).map(|&k| sample.points[k as usize]).collect()
    };
    let support = |point: &Point3, normal: &Vector3| -> f64 {
        let lack = |p: &Point3| ((p - point).dot(normal) / band_mm).powi(2);
        judges.iter().map(|p| (1.0 - lack(p)).max(0.0)).sum()
    };
    let hypotheses = propose(sample, among, towards, seed);
    let mut ranked: Vec<(f64, usize)> =
        hypotheses.par_iter().enumerate().map(|(k, (point, normal))| (support(point, normal), k)).collect();
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut best: Option<(f64, BeltPlane)> = None;
    for &(_, k) in ranked.iter().take(REFINED) {
        let (point, normal) = hypotheses[k];
        let Some(plane) = settle(sample, &judges, point, normal) else { continue };
        if towards.is_some_and(|(side, least)| plane.normal.dot(side) < least) {
            continue;
        }
        let reached = support(&plane.point, &plane.normal);
        if best.as_ref().is_none_or(|(so_far, _)| reached > *so_far) {
            best = Some((reached, plane));
        }
    }
    best.map(|(_, plane)| plane)
}

/// Planes through three points: some from all over, some close together (a belt in few places is met only so), some of the
/// belt's colour.
fn propose(sample: &Sample, among: &[u32], towards: Option<(&Vector3, f64)>, seed: u64) -> Vec<(Point3, Vector3)> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut planes = Vec::new();
    let mut add = |a: Point3, b: Point3, c: Point3| {
        let normal = (b - a).cross(&(c - a));
        let length = normal.norm();
        // Corners of a needle tell no plane.
        if length < 1e-3 * ((b - a).norm_squared() + (c - a).norm_squared()) || length <= 0.0 {
            return;
        }
        let mut normal = normal / length;
        if let Some((side, least)) = towards {
            if normal.dot(side) < 0.0 {
                normal = -normal;
            }
            if normal.dot(side) < 0.8 * least {
                return;
            }
        }
        planes.push((a, normal));
    };
    let draw = |rng: &mut ChaCha8Rng, from: &[u32]| sample.points[from[rng.random_range(0..from.len())] as usize];
    for _ in 0..400 {
        add(draw(&mut rng, among), draw(&mut rng, among), draw(&mut rng, among));
    }
    for _ in 0..800 {
        let first = draw(&mut rng, among);
        let mut others: [Point3; 12] = std::array::from_fn(|_| draw(&mut rng, among));
        others.sort_by(|a, b| (a - first).norm_squared().total_cmp(&(b - first).norm_squared()));
        add(first, others[1], others[2]);
    }
    let coloured = &sample.belt_coloured;
    if coloured.len() >= 30 && among.len() == sample.points.len() {
        for _ in 0..300 {
            add(draw(&mut rng, coloured), draw(&mut rng, coloured), draw(&mut rng, coloured));
        }
    }
    planes
}

/// Pulls a rough plane onto the points about it with Tukey weights: wide and on the points that proposed it at first (a big
/// face a little above would draw it up), then narrow and on all.
fn settle(sample: &Sample, judges: &[Point3], point: Point3, normal: Vector3) -> Option<BeltPlane> {
    let (mut point, mut normal) = (point, normal);
    for widening in [4.0, 2.0, 1.0, 1.0] {
        let width_mm = widening * TUKEY * sample.noise_mm();
        (point, normal) = reweigh(judges, point, normal, width_mm)?;
    }
    let start = BeltPlane { point, normal: UnitVector3::new_normalize(normal), sigma_mm: sample.noise_mm() };
    refine(&sample.points, start)
}

/// Iteratively reweighted least squares from a plane that is nearly right, with the width following the spread found.
/// `None` when what it finds is no plane.
pub(super) fn refine(points: &[Point3], start: BeltPlane) -> Option<BeltPlane> {
    let least_sigma_mm = 0.5 * start.sigma_mm;
    // Waves of the belt widen it; a plane that cuts through things at a slope widens without end.
    let most_sigma_mm = 6.0 * start.sigma_mm;
    let mut plane = start;
    for _ in 0..6 {
        let (point, normal) = reweigh(points, plane.point, plane.normal.into_inner(), TUKEY * plane.sigma_mm)?;
        plane = BeltPlane { point, normal: UnitVector3::new_normalize(normal), sigma_mm: plane.sigma_mm };
        // Measured behind the plane only: before it, a thin part may lie within the window.
        let mut depths: Vec<f64> = points
            .iter()
            .map(|p| -plane.height_mm(p))
            .filter(|depth| (0.0..3.5 * plane.sigma_mm).contains(depth))
            .collect();
        plane.sigma_mm = (SIGMA_OF_MAD * middle_value(&mut depths)?).max(least_sigma_mm);
        if plane.sigma_mm > most_sigma_mm {
            return None;
        }
    }
    Some(plane)
}

/// One weighted fit; the normal stays on its side.
fn reweigh(points: &[Point3], point: Point3, normal: Vector3, width_mm: f64) -> Option<(Point3, Vector3)> {
    let (centroid, found) = weighted_plane(points, |p| tukey_weight((p - point).dot(&normal), width_mm))?;
    Some((centroid, if found.dot(&normal) < 0.0 { -found } else { found }))
}
