//! Convex hull of many points, as exact as resting poses need it.
//!
//! The points are thinned to those that are extreme in some direction, moved at random by a millionth of their extent and put
//! into an incremental hull. The small motion (Barber et al. 1996 call it joggled input) leaves no four points in one plane, so flat
//! parts need no special case: their hull has two sides a few micrometres apart.

use super::{Aabb, Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A closed convex surface.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Hull {
    /// Corners (moved by up to a millionth of the extent, see above).
    pub vertices: Vec<Point3>,
    /// Triangles, counter-clockwise from outside.
    pub facets: Vec<[u32; 3]>,
}

/// Directions in which the farthest point is looked for. They are 0.08 rad apart, so a corner that none of them finds stands out by
/// less than 1 - cos(0.04), a thousandth of the extent.
const DIRECTIONS: usize = 2000;
/// Columns a side in each of the three views that pick the candidates.
const COLUMNS: usize = 48;
const JOGGLE: f64 = 1e-6;
const SEED: u64 = 0x4811;

/// The hull; empty for fewer than four points or points all in one place. Never fails on flat, straight or repeated points.
pub fn convex_hull(points: &[Point3]) -> Hull {
    let Some(bounds) = Aabb::of_points(points) else { return Hull::default() };
    let size = bounds.diagonal();
    if !(size > 0.0 && size.is_finite()) {
        return Hull::default();
    }
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let mut shift = || size * JOGGLE * (rng.random::<f64>() - 0.5);
    let extreme: Vec<Point3> =
        extreme_points(points, &bounds).iter().map(|p| p + Vector3::new(shift(), shift(), shift())).collect();
    incremental(&extreme)
}

/// Points that are farthest in some direction, in their original order.
fn extreme_points(points: &[Point3], bounds: &Aabb) -> Vec<Point3> {
    let candidates = column_ends(points, bounds);
    let centre = bounds.centre();
    let offsets: Vec<Vector3> = candidates.iter().map(|k| points[*k as usize] - centre).collect();
    let mut chosen: Vec<u32> = directions()
        .filter_map(|d| {
            let farther = |best: Option<(f64, u32)>, (k, v): (usize, &Vector3)| {
                let reach = v.dot(&d);
                if best.is_none_or(|b| reach > b.0) { Some((reach, candidates[k])) } else { best }
            };
            offsets.iter().enumerate().fold(None, farther).map(|b| b.1)
        })
        .collect();
    chosen.sort_unstable();
    chosen.dedup();
    chosen.iter().map(|k| points[*k as usize]).collect()
}

/// Axes and diagonals exactly, because parts are flat and square along them; then a Fibonacci sphere.
fn directions() -> impl Iterator<Item = Vector3> {
    let steps = [-1.0, 0.0, 1.0];
    let lattice = steps
        .into_iter()
        .flat_map(move |x| steps.into_iter().flat_map(move |y| steps.into_iter().map(move |z| Vector3::new(x, y, z))));
    let golden = std::f64::consts::PI * (3.0 - 5.0f64.sqrt());
    let spiral = (0..DIRECTIONS).map(move |k| {
        let z = 1.0 - (2 * k + 1) as f64 / DIRECTIONS as f64;
        let (sin, cos) = (golden * k as f64).sin_cos();
        let r = (1.0 - z * z).sqrt();
        Vector3::new(r * cos, r * sin, z)
    });
    lattice.filter(|d| *d != Vector3::zeros()).chain(spiral)
}

/// The two ends of each column of points, looking along each axis: all that can be extreme, up to a column's width.
fn column_ends(points: &[Point3], bounds: &Aabb) -> Vec<u32> {
    let extents = bounds.extents();
    let cell = |p: &Point3, axis: usize| {
        let share = if extents[axis] > 0.0 { (p[axis] - bounds.min[axis]) / extents[axis] } else { 0.0 };
        ((share * COLUMNS as f64) as usize).min(COLUMNS - 1)
    };
    let mut chosen = Vec::new();
    for axis in 0..3 {
        let (across, up) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut ends = vec![[u32::MAX; 2]; COLUMNS * COLUMNS];
        for (k, p) in points.iter().enumerate() {
            let column = &mut ends[cell(p, across) * COLUMNS + cell(p, up)];
            if column[0] == u32::MAX || p[axis] < points[column[0] as usize][axis] {
                column[0] = k as u32;
            }
            if column[1] == u32::MAX || p[axis] > points[column[1] as usize][axis] {
                column[1] = k as u32;
            }
        }
        chosen.extend(ends.into_iter().flatten().filter(|k| *k != u32::MAX));
    }
    chosen.sort_unstable();
    chosen.dedup();
    chosen
}

struct Facet {
    corners: [u32; 3],
    normal: Vector3,
    height: f64,
}

impl Facet {
    fn new(points: &[Point3], corners: [u32; 3]) -> Self {
        let [a, b, c] = corners.map(|k| points[k as usize]);
        let normal = (b - a).cross(&(c - a));
        let normal = normal.try_normalize(0.0).unwrap_or(normal);
        Self { corners, normal, height: normal.dot(&a.coords) }
    }

    fn sees(&self, p: &Point3) -> bool {
        self.normal.dot(&p.coords) > self.height
    }
}

fn incremental(points: &[Point3]) -> Hull {
    let Some(first) = tetrahedron(points) else { return Hull::default() };
    let [a, b, c, d] = first;
    let mut facets: Vec<Facet> = [[a, b, c], [a, c, d], [a, d, b], [b, d, c]].map(|f| Facet::new(points, f)).into();
    for (k, p) in points.iter().enumerate().filter(|(k, _)| !first.contains(&(*k as u32))) {
        add_point(points, &mut facets, k as u32, p);
    }
    let mut new_index = vec![u32::MAX; points.len()];
    let mut hull = Hull::default();
    for facet in facets {
        hull.facets.push(facet.corners.map(|k| {
            let place = &mut new_index[k as usize];
            if *place == u32::MAX {
                *place = hull.vertices.len() as u32;
                hull.vertices.push(points[k as usize]);
            }
            *place
        }));
    }
    hull
}

/// Replaces the facets that see the point by a fan from it to their outline.
fn add_point(points: &[Point3], facets: &mut Vec<Facet>, index: u32, p: &Point3) {
    let mut edges: Vec<[u32; 2]> = Vec::new();
    for facet in facets.iter().filter(|f| f.sees(p)) {
        let [a, b, c] = facet.corners;
        edges.extend([[a, b], [b, c], [c, a]]);
    }
    edges.sort_unstable();
    let outline: Vec<[u32; 2]> =
        edges.iter().filter(|[a, b]| edges.binary_search(&[*b, *a]).is_err()).copied().collect();
    // Rounding can tear the outline; a point that near to a facet's plane adds nothing.
    let simple = outline.len() >= 3 && outline.windows(2).all(|w| w[0][0] != w[1][0]);
    if !simple {
        return;
    }
    facets.retain(|f| !f.sees(p));
    facets.extend(outline.into_iter().map(|[a, b]| Facet::new(points, [a, b, index])));
}

/// Four points that span as much as a greedy choice finds, wound outwards.
fn tetrahedron(points: &[Point3]) -> Option<[u32; 4]> {
    let farthest = |measure: &dyn Fn(&Point3) -> f64| {
        let better = |best: (usize, f64), (k, p): (usize, &Point3)| {
            let m = measure(p);
            if m > best.1 { (k, m) } else { best }
        };
        let (k, m) = points.iter().enumerate().fold((0, 0.0), better);
        (m > 0.0).then_some(k)
    };
    let a = *points.first()?;
    let b = points[farthest(&|p| (p - a).norm_squared())?];
    let a_index = farthest(&|p| (p - b).norm_squared())?;
    let a = points[a_index];
    let b_index = farthest(&|p| (p - a).norm_squared())?;
    let b = points[b_index];
    let c_index = farthest(&|p| (p - a).cross(&(b - a)).norm_squared())?;
    let normal = (b - a).cross(&(points[c_index] - a));
    let d_index = farthest(&|p| (p - a).dot(&normal).abs())?;
    let above = (points[d_index] - a).dot(&normal) > 0.0;
    let (b_index, c_index) = if above { (c_index, b_index) } else { (b_index, c_index) };
    Some([a_index, b_index, c_index, d_index].map(|k| k as u32))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nothing sticks out by more than the motion and the missed corners allow; every edge is met twice.
    fn check(points: &[Point3], allowed: f64) -> Hull {
        let hull = convex_hull(points);
        let mut edges = Vec::new();
        for f in &hull.facets {
            let [a, b, c] = f.map(|k| hull.vertices[k as usize]);
            let n = (b - a).cross(&(c - a)).normalize();
            assert!(points.iter().all(|p| (p - a).dot(&n) <= allowed));
            edges.extend([(f[0], f[1]), (f[1], f[2]), (f[2], f[0])]);
        }
        edges.sort_unstable();
        assert!(edges.iter().all(|(a, b)| edges.binary_search(&(*b, *a)).is_ok()));
        hull
    }

    #[test]
    fn random_points_are_inside_and_the_surface_is_closed() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let points: Vec<Point3> = (0..5000)
            .map(|_| Point3::new(rng.random::<f64>() * 200.0, rng.random::<f64>() * 90.0, rng.random::<f64>() * 30.0))
            .collect();
        check(&points, 1.0);
    }

    #[test]
    fn flat_straight_and_repeated_points_do_no_harm() {
        let grid: Vec<Point3> = (0..900).map(|k| Point3::new(f64::from(k % 30), f64::from(k / 30), 5.0)).collect();
        let hull = check(&grid, 1e-3);
        let area: f64 = hull
            .facets
            .iter()
            .map(|f| f.map(|k| hull.vertices[k as usize]))
            .map(|[a, b, c]| 0.5 * (b - a).cross(&(c - a)).norm())
            .sum();
        assert!((area - 2.0 * 29.0 * 29.0).abs() < 0.1, "both sides of the square: {area}");
        let line: Vec<Point3> = (0..50).map(|k| Point3::new(f64::from(k), 0.0, 0.0)).collect();
        check(&line, 1e-3);
        assert!(convex_hull(&[Point3::origin(); 9]).facets.is_empty());
        assert!(convex_hull(&line[..2]).facets.is_empty());
        assert!(convex_hull(&[]).facets.is_empty());
    }
}
