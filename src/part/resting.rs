//! Ways in which a part may lie on the belt.
//!
//! A rigid part rests on a facet of its convex hull whose polygon the plumb line from the centroid meets. Facets that differ by less
//! than 2 degrees count as one, because a sheet is neither rigid nor free of springback; for the same reason facets are kept that the
//! plumb line misses by up to a hundredth of the part's size.

use crate::geometry::hull::{Hull, convex_hull};
use crate::geometry::{Mesh, Point3, UnitVector3, Vector3};
use crate::plan::Side;

/// A way in which the part may lie.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RestingPose {
    /// CAD direction that points up, to the camera.
    pub up_cad: UnitVector3,
    /// The face that shows more of its area upwards.
    pub side: Side,
    /// Between 0 and 1, larger is more stable: the share of all directions in which the supporting facet is seen from the centroid, times
    /// the angle (as part of a right one) by which the part must be tipped to fall over. 0 for poses that need a little help.
    pub stability: f64,
    /// Extent along `up_cad`, mm.
    pub height_mm: f64,
}

/// Poses kept at most.
const MOST: usize = 24;
const MERGED_RAD: f64 = 2.0 * std::f64::consts::PI / 180.0;
/// Poses nearer to each other than this are one: the alignment finds tilts of 5 degrees by itself.
const DISTINCT_RAD: f64 = 4.0 * std::f64::consts::PI / 180.0;
/// How far outside its support the plumb line may fall, as share of the part's size.
const NEARLY: f64 = 0.01;

/// Finds the poses of the sheet, most stable first. `top` is the mesh whose normals point out on the top side, `points` all vertices of
/// both faces.
pub(super) fn resting_poses(points: &[Point3], top: &Mesh, centroid: &Point3) -> Vec<RestingPose> {
    let hull = convex_hull(points);
    let Some(bounds) = crate::geometry::Aabb::of_points(&hull.vertices) else { return Vec::new() };
    let towards_top: Vector3 = (0..top.triangles.len()).map(|t| top.area_vector_twice(t)).sum();
    let mut poses: Vec<(RestingPose, f64)> = supports(&hull)
        .into_iter()
        .filter_map(|support| {
            let up = -support.normal;
            let centre_height = (centroid - hull.vertices[support.corners[0] as usize]).dot(&up).max(0.0);
            let margin = margin(&hull, &support, centroid);
            if margin < -NEARLY * bounds.diagonal() {
                return None;
            }
            let share = solid_angle(&hull, &support, centroid) / (4.0 * std::f64::consts::PI);
            let tip = margin.max(0.0).atan2(centre_height) / std::f64::consts::FRAC_PI_2;
            let pose = RestingPose {
                up_cad: up,
                side: if towards_top.dot(&up) >= 0.0 { Side::Top } else { Side::Bottom },
                stability: (share * tip).clamp(0.0, 1.0),
                height_mm: height(&hull, &up),
            };
            Some((pose, share))
        })
        .collect();
    poses.sort_by(|a, b| b.0.stability.total_cmp(&a.0.stability).then(b.1.total_cmp(&a.1)));
    let mut kept: Vec<RestingPose> = Vec::new();
    for (pose, _) in poses {
        if kept.len() < MOST && kept.iter().all(|k| k.up_cad.angle(&pose.up_cad) > DISTINCT_RAD) {
            kept.push(pose);
        }
    }
    kept
}

/// Facets of the hull that count as one.
struct Support {
    /// Outwards: down, when the part rests on it.
    normal: UnitVector3,
    facets: Vec<usize>,
    corners: Vec<u32>,
}

/// Groups the facets, the largest first, each with those that differ from it by less than the merging angle.
fn supports(hull: &Hull) -> Vec<Support> {
    let area_vector = |k: usize| {
        let [a, b, c] = hull.facets[k].map(|v| hull.vertices[v as usize]);
        (b - a).cross(&(c - a))
    };
    let mut by_area: Vec<(f64, usize)> = (0..hull.facets.len()).map(|k| (area_vector(k).norm(), k)).collect();
    by_area.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut groups: Vec<(UnitVector3, Vec<usize>)> = Vec::new();
    for (_, facet) in by_area {
        let Some(normal) = UnitVector3::try_new(area_vector(facet), 0.0) else { continue };
        match groups.iter_mut().find(|(seed, _)| seed.dot(&normal) > MERGED_RAD.cos()) {
            Some((_, facets)) => facets.push(facet),
            None => groups.push((normal, vec![facet])),
        }
    }
    let finish = |(seed, facets): (UnitVector3, Vec<usize>)| {
        let sum: Vector3 = facets.iter().map(|f| area_vector(*f)).sum();
        let mut corners: Vec<u32> = facets.iter().flat_map(|f| hull.facets[*f]).collect();
        corners.sort_unstable();
        corners.dedup();
        Support { normal: UnitVector3::try_new(sum, 0.0).unwrap_or(seed), facets, corners }
    };
    groups.into_iter().map(finish).collect()
}

/// How far inside the supporting polygon the plumb line meets it, mm; negative outside.
fn margin(hull: &Hull, support: &Support, centroid: &Point3) -> f64 {
    let down = support.normal;
    let side = if down.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
    let x = down.cross(&side).normalize();
    let y = down.cross(&x);
    let flat = |p: &Point3| ((p - centroid).dot(&x), (p - centroid).dot(&y));
    let outline = outline(support.corners.iter().map(|v| flat(&hull.vertices[*v as usize])).collect());
    let distance = |k: usize| {
        let (a, b) = (outline[k], outline[(k + 1) % outline.len()]);
        let (ex, ey) = (b.0 - a.0, b.1 - a.1);
        // Left of the edge is inside; the plumb line is the origin.
        (a.0 * ey - a.1 * ex) / ex.hypot(ey).max(f64::MIN_POSITIVE)
    };
    if outline.len() < 3 {
        return f64::NEG_INFINITY;
    }
    (0..outline.len()).map(distance).fold(f64::INFINITY, f64::min)
}

/// Convex outline, counter-clockwise (Andrew's monotone chain).
fn outline(mut points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let half = |points: &mut dyn Iterator<Item = (f64, f64)>| {
        let mut chain: Vec<(f64, f64)> = Vec::new();
        for p in points {
            while let [.., a, b] = chain[..] {
                if (b.0 - a.0) * (p.1 - a.1) - (b.1 - a.1) * (p.0 - a.0) > 0.0 {
                    break;
                }
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut lower = half(&mut points.iter().copied());
    lower.extend(half(&mut points.iter().rev().copied()));
    lower
}

/// Solid angle of the supporting facets, seen from the centroid (Van Oosterom & Strackee 1983).
fn solid_angle(hull: &Hull, support: &Support, centroid: &Point3) -> f64 {
    let one = |facet: &usize| {
        let [a, b, c] = hull.facets[*facet].map(|v| hull.vertices[v as usize] - centroid);
        let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
        let volume = a.dot(&b.cross(&c));
        2.0 * volume.atan2(la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb)
    };
    support.facets.iter().map(one).sum()
}

fn height(hull: &Hull, up: &UnitVector3) -> f64 {
    let along = hull.vertices.iter().map(|v| v.coords.dot(up));
    let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), a| (l.min(a), h.max(a)));
    high - low
}
