//! Is the backmost plane the belt, or a flat face of a part that is all there is in view?
//!
//! A cloud of nothing but a flat part has a backmost plane as well, and removing it would remove the part. The part's size
//! decides: where there is a belt, the cloud is larger than the part can be.

use super::belt::{Sample, behind_plane, belt_seen_from, belts_seen_from_both_sides, inliers, tangents};
use super::conditioned::BeltPlane;
use super::hints::ScanHints;
use crate::fit::robust::quantile;
use crate::geometry::Point3;

/// What the search for a belt came to.
pub(super) enum Verdict {
    /// There it is.
    Belt(BeltPlane),
    /// No belt; why, for people.
    None(String),
}

/// Finds the belt, or tells why there is none.
pub(super) fn find_belt(sample: &Sample, hints: &ScanHints) -> Verdict {
    let candidates = match &hints.view_direction {
        Some(direction) => belt_seen_from(sample, &-direction.into_inner()).into_iter().collect(),
        None => belts_seen_from_both_sides(sample),
    };
    let plane = match candidates.as_slice() {
        [] => return Verdict::None("no plane with nothing behind it".into()),
        [only] => only,
        // A small part does not keep the belt from being the backmost plane from both sides: the part is on the camera's.
        [one, other, ..] if same_plane(one, other) => {
            if behind_plane(sample, one).len() <= behind_plane(sample, other).len() { one } else { other }
        }
        [one, other, ..] => match nearer_to_a_belt(sample, hints, one, other) {
            Some(plane) => plane,
            None => return Verdict::None("the belt and the part cannot be told apart without a view direction".into()),
        },
    };
    if is_all_part(sample, hints, plane) {
        return Verdict::None("what is in view is no larger than the part".into());
    }
    Verdict::Belt(*plane)
}

/// Whether the cloud as a whole can be the part alone: by its surface, by its length and by its outline on the plane.
fn is_all_part(sample: &Sample, hints: &ScanHints, plane: &BeltPlane) -> bool {
    if !hints.has_size() {
        return false;
    }
    let surface_mm2 = sample.points.len() as f64 * sample.area_each_mm2();
    fits_the_part(hints, surface_mm2, &sample.points, plane)
}

/// Whether a patch with that surface and those points can be a part of the part.
fn fits_the_part(hints: &ScanHints, surface_mm2: f64, points: &[Point3], plane: &BeltPlane) -> bool {
    let [length_mm, width_mm] = smallest_rectangle(points, plane);
    surface_mm2 <= 1.15 * hints.part_area_mm2
        && length_mm <= 1.05 * hints.diagonal_mm()
        && length_mm * width_mm <= 1.1 * hints.largest_shadow_mm2()
}

/// Of the backmost planes seen from either side the one that is the belt: larger than a part can be, or much more spread out
/// than what lies before it. `None` when neither tells.
fn nearer_to_a_belt<'a>(
    sample: &Sample,
    hints: &ScanHints,
    one: &'a BeltPlane,
    other: &'a BeltPlane,
) -> Option<&'a BeltPlane> {
    const CLEARLY: f64 = 1.4;
    let larger_than_part = |plane: &BeltPlane| {
        let on_plane: Vec<Point3> = inliers(sample, plane).copied().collect();
        hints.has_size() && !fits_the_part(hints, on_plane.len() as f64 * sample.area_each_mm2(), &on_plane, plane)
    };
    match (larger_than_part(one), larger_than_part(other)) {
        (true, false) => return Some(one),
        (false, true) => return Some(other),
        _ => {}
    }
    let (spread_one, spread_other) = (spread_ratio(sample, one), spread_ratio(sample, other));
    if spread_one > CLEARLY && spread_one > spread_other {
        Some(one)
    } else if spread_other > CLEARLY && spread_other > spread_one {
        Some(other)
    } else {
        None
    }
}

fn same_plane(one: &BeltPlane, other: &BeltPlane) -> bool {
    one.normal.dot(&other.normal).abs() > 0.9999 && one.height_mm(&other.point).abs() < 2.0 * one.sigma_mm
}

/// Root mean square radius of the points on the plane over that of the others.
fn spread_ratio(sample: &Sample, plane: &BeltPlane) -> f64 {
    let on_it = |p: &&Point3| plane.height_mm(p).abs() <= 3.5 * plane.sigma_mm;
    let radius = |points: Vec<&Point3>| {
        let count = points.len().max(1) as f64;
        let mean = points.iter().fold(nalgebra::Vector3::zeros(), |sum, p| sum + p.coords) / count;
        (points.iter().map(|p| (p.coords - mean).norm_squared()).sum::<f64>() / count).sqrt()
    };
    let (on, off): (Vec<&Point3>, Vec<&Point3>) = sample.points.iter().partition(on_it);
    let off_radius = radius(off);
    if off_radius > 0.0 { radius(on) / off_radius } else { f64::INFINITY }
}

/// Sides of the smallest rectangle about the points' outline on the plane, the longer first; one per cent of the points may
/// lie outside at each side.
fn smallest_rectangle(points: &[Point3], plane: &BeltPlane) -> [f64; 2] {
    let (u, v) = tangents(&plane.normal);
    // The outline needs no more than a thousand points.
    let step = points.len().div_ceil(1500).max(1);
    let flat: Vec<(f64, f64)> =
        points.iter().step_by(step).map(|p| ((p - plane.point).dot(&u), (p - plane.point).dot(&v))).collect();
    rectangle_about(&flat)
}

/// The same about places in a plane.
pub(super) fn rectangle_about(flat: &[(f64, f64)]) -> [f64; 2] {
    const TURNS: usize = 30;
    let extent = |angle: f64| {
        let (s, c) = angle.sin_cos();
        let mut along: Vec<f64> = flat.iter().map(|(x, y)| c * x + s * y).collect();
        let low = quantile(&mut along, 0.01).unwrap_or(0.0);
        quantile(&mut along, 0.99).unwrap_or(0.0) - low
    };
    let quarter = std::f64::consts::FRAC_PI_2;
    let mut best = [f64::INFINITY; 2];
    for turn in 0..TURNS {
        let angle = quarter * turn as f64 / TURNS as f64;
        let (a, b) = (extent(angle), extent(angle + quarter));
        if a * b < best[0] * best[1] {
            best = [a.max(b), a.min(b)];
        }
    }
    best
}
