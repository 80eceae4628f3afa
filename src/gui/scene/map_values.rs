//! The deviation of every vertex of the CAD: a robust mean of the points whose feet lie around it.
//!
//! The value belongs to the surface, not to the picture, so that it stays the same however the part is turned. Where no point's foot is
//! within reach there is no value, and the view draws a hatch.

use crate::geometry::{Bvh, Mesh, Point3, Vector3};
use crate::run::{Cancelled, RunContext};
use rayon::prelude::*;
use std::collections::HashMap;

/// Gaps up to this many point spacings are filled, as in the map on paper: in a Poisson cloud of spacing s no point lies within 2.5 s of
/// a place once in exp(-π 2.5²) = 3e-9 places, so what stays empty was not measured.
const REACH: f64 = 2.5;
/// Standard deviation of the weights, in spacings of the points and in edges of the mesh, the larger one.
const SIGMA_SPACINGS: f64 = 0.7;
const SIGMA_EDGES: f64 = 0.45;
/// Values further from the median than so many robust standard deviations do not count.
const CUT: f64 = 3.5;
/// The scatter is never taken for less than this, mm, so that equal values do not throw each other out.
const LEAST_SCATTER_MM: f64 = 0.001;
/// Points a task; fixed, though nothing depends on it.
const CHUNK: usize = 4096;
/// Feet further from the surface belong to no map, mm; the map's own reach is less for every range that people use.
const FURTHEST_MM: f64 = 100.0;

/// Points that carry a deviation.
#[derive(Debug, Clone, Copy)]
pub struct Measured<'a> {
    /// CAD frame.
    pub points: &'a [Point3],
    /// mm; as many as points.
    pub deviations_mm: &'a [f32],
    /// Typical distance between neighbouring points, mm.
    pub spacing_mm: f64,
}

/// The deviation of each vertex in mm, NaN where nothing was measured. `longest_mm` is the length of the mesh's edges. The same for any
/// number of threads.
pub fn on_vertices(
    mesh: &Mesh,
    normals: &[Vector3],
    longest_mm: f64,
    measured: &Measured<'_>,
    run: &RunContext,
) -> Result<Vec<f32>, Cancelled> {
    let spacing_mm = if measured.spacing_mm.is_finite() { measured.spacing_mm.max(1e-3) } else { longest_mm };
    let reach_mm = (REACH * spacing_mm).max(longest_mm);
    let sigma_mm = (SIGMA_SPACINGS * spacing_mm).max(SIGMA_EDGES * longest_mm);
    let feet = feet(mesh, measured, run)?;
    let buckets = Buckets::of(&feet, reach_mm);
    mesh.vertices
        .par_iter()
        .zip(normals)
        .with_min_len(256)
        .map_init(Vec::new, |near: &mut Vec<(f32, f32)>, (vertex, normal)| {
            run.check()?;
            near.clear();
            buckets.for_each_near(vertex, |k| {
                let foot = &feet[k as usize];
                let distance_sq = (foot.place - vertex).norm_squared();
                // The other leaf of a fold may be as near; its normal looks away.
                if distance_sq <= reach_mm * reach_mm && foot.normal.dot(normal) > 0.0 {
                    let weight = (-0.5 * distance_sq / (sigma_mm * sigma_mm)).exp();
                    near.push((foot.deviation_mm, weight as f32));
                }
            });
            Ok(robust_mean(near))
        })
        .collect()
}

/// The values smoothed, for lines of equal deviation: a line is about form, and the scatter of single points would break it up. Each round
/// spreads a value by about a quarter of an edge's square. NaN stays NaN and is not drawn upon.
pub fn smoothed(mesh: &Mesh, values: &[f32], rounds: usize) -> Vec<f32> {
    let mut now = values.to_vec();
    for _ in 0..rounds {
        let mut sums = vec![(0.0f32, 0u32); now.len()];
        for corners in &mesh.triangles {
            for k in 0..3 {
                let (to, from) = (corners[k] as usize, corners[(k + 1) % 3] as usize);
                for (to, from) in [(to, from), (from, to)] {
                    if now[from].is_finite() {
                        sums[to].0 += now[from];
                        sums[to].1 += 1;
                    }
                }
            }
        }
        for (value, (sum, count)) in now.iter_mut().zip(sums) {
            if value.is_finite() && count > 0 {
                *value = 0.5 * (*value + sum / count as f32);
            }
        }
    }
    now
}

/// Where a point's perpendicular meets the surface.
#[derive(Debug, Clone, Copy)]
struct Foot {
    place: Point3,
    normal: Vector3,
    deviation_mm: f32,
}

fn feet(mesh: &Mesh, measured: &Measured<'_>, run: &RunContext) -> Result<Vec<Foot>, Cancelled> {
    let bvh = Bvh::build(mesh);
    let chunks: Vec<Vec<Foot>> = measured
        .points
        .par_chunks(CHUNK)
        .zip(measured.deviations_mm.par_chunks(CHUNK))
        .map(|(points, deviations)| {
            run.check()?;
            let mut seed = u32::MAX;
            let mut feet = Vec::with_capacity(points.len());
            for (point, &deviation_mm) in points.iter().zip(deviations) {
                let Some(hit) = bvh.closest_seeded(point, FURTHEST_MM, seed) else { continue };
                seed = hit.triangle;
                let normal = mesh.area_vector_twice(hit.triangle as usize);
                if deviation_mm.is_finite() {
                    feet.push(Foot { place: hit.point, normal, deviation_mm });
                }
            }
            Ok(feet)
        })
        .collect::<Result<_, Cancelled>>()?;
    Ok(chunks.into_iter().flatten().collect())
}

/// Feet by cubes as wide as the reach.
struct Buckets {
    cell_mm: f64,
    /// First and last place in `order` of a cube's feet.
    cubes: HashMap<[i32; 3], [u32; 2]>,
    order: Vec<u32>,
}

impl Buckets {
    fn of(feet: &[Foot], cell_mm: f64) -> Buckets {
        let mut keyed: Vec<([i32; 3], u32)> =
            feet.par_iter().enumerate().map(|(k, foot)| (cube(&foot.place, cell_mm), k as u32)).collect();
        keyed.par_sort_unstable();
        let mut cubes: HashMap<[i32; 3], [u32; 2]> = HashMap::new();
        for (k, (key, _)) in keyed.iter().enumerate() {
            cubes.entry(*key).or_insert([k as u32; 2])[1] = k as u32 + 1;
        }
        Buckets { cell_mm, cubes, order: keyed.into_iter().map(|(_, k)| k).collect() }
    }

    fn for_each_near(&self, place: &Point3, mut visit: impl FnMut(u32)) {
        let [x, y, z] = cube(place, self.cell_mm);
        let around = |k: i32| k.saturating_sub(1)..=k.saturating_add(1);
        for key in around(x).flat_map(|x| around(y).flat_map(move |y| around(z).map(move |z| [x, y, z]))) {
            if let Some(&[first, last]) = self.cubes.get(&key) {
                self.order[first as usize..last as usize].iter().for_each(|&k| visit(k));
            }
        }
    }
}

fn cube(place: &Point3, cell_mm: f64) -> [i32; 3] {
    std::array::from_fn(|k| (place[k] / cell_mm).floor() as i32)
}

/// The weighted mean of the values within `CUT` robust standard deviations of their median; NaN of none.
fn robust_mean(values: &mut [(f32, f32)]) -> f32 {
    if values.is_empty() {
        return f32::NAN;
    }
    let middle = values.len() / 2;
    let median = f64::from(values.select_nth_unstable_by(middle, |a, b| a.0.total_cmp(&b.0)).1.0);
    let off = |v: &(f32, f32)| (f64::from(v.0) - median).abs();
    let scatter = off(values.select_nth_unstable_by(middle, |a, b| off(a).total_cmp(&off(b))).1);
    let limit = CUT * (1.4826 * scatter).max(LEAST_SCATTER_MM);
    // In the order of the values, so that the sum does not depend on how they were found.
    values.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let counted = values.iter().filter(|v| off(v) <= limit);
    let (sum, weight) = counted.fold((0.0, 0.0), |(s, w), v| (s + f64::from(v.0) * f64::from(v.1), w + f64::from(v.1)));
    if weight > 0.0 { (sum / weight) as f32 } else { median as f32 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gui::scene::shape::refined;
    use crate::report::example;

    fn normals(mesh: &Mesh) -> Vec<Vector3> {
        let mut sums = vec![Vector3::zeros(); mesh.vertices.len()];
        for (t, corners) in mesh.triangles.iter().enumerate() {
            corners.iter().for_each(|&v| sums[v as usize] += mesh.area_vector_twice(t));
        }
        sums
    }

    fn values(mesh: &Mesh, points: &[Point3], deviations_mm: &[f32], spacing_mm: f64) -> Vec<f32> {
        let measured = Measured { points, deviations_mm, spacing_mm };
        on_vertices(mesh, &normals(mesh), 4.0, &measured, &RunContext::silent()).unwrap()
    }

    #[test]
    fn a_linear_field_comes_back_and_a_hole_in_the_data_stays_one() {
        let mesh = refined(&example::dome(30), 4.0);
        let (points, deviations) = example::dome_cloud(60_000, |p| 0.01 * p.x);
        let gap = |p: &Point3| (p.x - 60.0).hypot(p.y) < 15.0;
        let (points, deviations): (Vec<_>, Vec<_>) =
            points.into_iter().zip(deviations).filter(|(p, _)| !gap(p)).unzip();
        let found = values(&mesh, &points, &deviations, example::dome_spacing(60_000));
        let used: std::collections::BTreeSet<u32> = mesh.triangles.iter().flatten().copied().collect();
        for &v in &used {
            let (vertex, value) = (&mesh.vertices[v as usize], found[v as usize]);
            let from_gap = (vertex.x - 60.0).hypot(vertex.y);
            // Reach: 4 mm (the edge) in space; the slope there is below one half.
            if from_gap < 10.0 {
                assert!(value.is_nan(), "{vertex}: {value}");
            } else if from_gap > 20.0
                && vertex.x.abs() < 95.0
                && vertex.y.abs() < 65.0
                && vertex.x.hypot(vertex.y) > 20.0
            {
                // Weights of 1.8 mm about the vertex; 0.01 per mm, uneven by a tenth of that at the most.
                assert!((f64::from(value) - 0.01 * vertex.x).abs() < 0.002, "{vertex}: {value}");
            }
        }
    }

    #[test]
    fn large_deviations_are_found_at_their_feet() {
        // 3 mm above a flat plate of 80 x 80 mm, further than any reach across it.
        let corners = [[-40.0, -40.0, 0.0], [40.0, -40.0, 0.0], [40.0, 40.0, 0.0], [-40.0, 40.0, 0.0]];
        let plate = Mesh { vertices: corners.map(Point3::from).to_vec(), triangles: vec![[0, 1, 2], [0, 2, 3]] };
        let mesh = refined(&plate, 4.0);
        let points: Vec<Point3> =
            (0..6400).map(|k| Point3::new(f64::from(k % 80) - 39.5, f64::from(k / 80) - 39.5, 3.0)).collect();
        let found = values(&mesh, &points, &vec![3.0; points.len()], 1.0);
        assert!(found.iter().all(|v| (v - 3.0).abs() < 1e-6));
    }

    #[test]
    fn smoothing_keeps_a_slope_and_takes_scatter_away() {
        let mesh = refined(&example::dome(30), 4.0);
        let slope = |p: &Point3| (0.01 * p.x) as f32;
        let clean: Vec<f32> = mesh.vertices.iter().map(slope).collect();
        let rough: Vec<f32> = clean.iter().enumerate().map(|(k, v)| v + if k % 2 == 0 { 0.1 } else { -0.1 }).collect();
        let inner = |p: &Point3| p.x.abs() < 90.0 && p.y.abs() < 50.0 && p.x.hypot(p.y) > 35.0;
        let off = |of: &[f32]| {
            let inside = (0..of.len()).filter(|&k| inner(&mesh.vertices[k]) && of[k].is_finite());
            inside.map(|k| (of[k] - clean[k]).abs()).fold(0.0, f32::max)
        };
        // Neighbours are not quite symmetric: a tenth of an edge's rise of 0.04 mm a round at the worst, levelled out again.
        assert!(off(&smoothed(&mesh, &clean, 24)) < 0.02);
        assert!(off(&smoothed(&mesh, &rough, 24)) < 0.06, "{}", off(&smoothed(&mesh, &rough, 24)));
        let mut gap = clean.clone();
        gap[0] = f32::NAN;
        assert!(smoothed(&mesh, &gap, 24)[0].is_nan());
    }

    #[test]
    fn stray_values_do_not_count_and_nothing_is_no_value() {
        let mut mixed: Vec<(f32, f32)> = (0..40).map(|k| (0.1 + 0.001 * (k % 5) as f32, 1.0)).collect();
        mixed.extend([(5.0, 1.0), (-7.0, 1.0), (5.0, 1.0)]);
        assert!((robust_mean(&mut mixed) - 0.102).abs() < 1e-6);
        assert!(robust_mean(&mut []).is_nan());
        assert_eq!(robust_mean(&mut [(0.25, 1e-20)]), 0.25);
    }

    #[test]
    fn the_same_values_with_any_number_of_threads() {
        let mesh = example::dome(20);
        let (points, deviations) = example::dome_cloud(20_000, |p| (0.3 * p.x).sin());
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| values(&mesh, &points, &deviations, 1.3))
        };
        assert!(with(1).iter().zip(with(3)).all(|(a, b)| a.to_bits() == b.to_bits()));
    }
}
