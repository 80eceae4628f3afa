//! Where the data ends, for poses that the surface alone leaves free: a flat part slides, a round one turns.
//!
//! At places along the face's rims the number of points in a window across the rim tells where the data's edge lies: with
//! `d` points a mm² and a window of width `b` from `-w` to `w` (outwards), `n` points put the edge at `n / (d b) - w`. That
//! is an estimate without the bias of "outermost points"; it is only as fine as the point spacing, so it is used only
//! together with the surface.

use super::icp::Sums;
use crate::fit::robust::tukey_weight;
use crate::geometry::{Isometry3, Point3, Vector3};
use crate::part::Face;

/// Depth of the window inside the rim that tells whether the surface was measured there, mm.
const INNER_MM: f64 = 4.0;
/// Step along the rim, mm, at least.
const LEAST_STEP_MM: f64 = 2.0;

/// One place on a rim, CAD frame.
struct RimPlace {
    at: Point3,
    /// Outward surface normal.
    normal: Vector3,
    /// In the surface, away from the material.
    outwards: Vector3,
    along: Vector3,
}

/// Places on the rims of a face and the points near which they are looked for.
pub(super) struct RimLock<'a> {
    places: Vec<RimPlace>,
    dense: &'a DenseIndex<'a>,
    reach_mm: f64,
    half_width_mm: f64,
}

/// Dense points by cell of the xy plane of the work frame.
pub(super) struct DenseIndex<'a> {
    points: &'a [Point3],
    raster: super::height_map::Raster,
    starts: Vec<u32>,
    order: Vec<u32>,
    /// Points a mm², seen along z.
    pub per_mm2: f64,
}

impl<'a> DenseIndex<'a> {
    /// Sorts the points into cells.
    pub fn build(points: &'a [Point3], raster: super::height_map::Raster, per_mm2: f64) -> Self {
        let mut starts = vec![0u32; raster.len() + 1];
        let cells: Vec<Option<usize>> = points.iter().map(|p| raster.index(p.x, p.y)).collect();
        for c in cells.iter().flatten() {
            starts[c + 1] += 1;
        }
        for k in 0..raster.len() {
            starts[k + 1] += starts[k];
        }
        let mut next = starts.clone();
        let mut order = vec![0u32; starts[raster.len()] as usize];
        for (k, c) in cells.iter().enumerate() {
            if let Some(c) = c {
                order[next[*c] as usize] = k as u32;
                next[*c] += 1;
            }
        }
        Self { points, raster, starts, order, per_mm2 }
    }

    /// Calls `each` for the points of all cells that a box (low and high x and y) touches.
    fn within(&self, low: [f64; 2], high: [f64; 2], mut each: impl FnMut(&Point3)) {
        let r = &self.raster;
        let clamped = |v: f64, n: usize| ((v / r.cell_mm).max(0.0) as usize).min(n - 1);
        let (i0, i1) = (clamped(low[0] - r.x0, r.nx), clamped(high[0] - r.x0, r.nx));
        let (j0, j1) = (clamped(low[1] - r.y0, r.ny), clamped(high[1] - r.y0, r.ny));
        for j in j0..=j1 {
            let (first, end) = (self.starts[j * r.nx + i0], self.starts[j * r.nx + i1 + 1]);
            for &k in &self.order[first as usize..end as usize] {
                each(&self.points[k as usize]);
            }
        }
    }
}

impl<'a> RimLock<'a> {
    /// At most so many rim places of a face that are seen from `up` (CAD frame); the data's edge is looked for within a reach.
    pub fn new(face: &Face, up: &Vector3, dense: &'a DenseIndex<'a>, most_places: usize, reach_mm: f64) -> Self {
        let spacing = 1.0 / dense.per_mm2.max(1e-6).sqrt();
        let length: f64 = face.boundary_loops.iter().map(|l| loop_length(l)).sum();
        let step = LEAST_STEP_MM.max(length / most_places as f64);
        let mut places = Vec::new();
        for rim in &face.boundary_loops {
            for (at, along) in walk(rim, step) {
                if let Some(place) = rim_place(face, at, along, up) {
                    places.push(place);
                }
            }
        }
        Self { places, dense, reach_mm: reach_mm.max(2.5 * spacing), half_width_mm: 1.0f64.max(2.0 * spacing) }
    }

    /// How many places' windows a stretch of rim lies in, at least one: what it says is counted so many times.
    pub fn overlap(&self) -> f64 {
        (2.0 * self.half_width_mm / LEAST_STEP_MM).max(1.0)
    }

    /// Adds what the rims say to a registration's sums, in the units of residuals with standard deviation `scale_mm`.
    pub fn add_to(&self, sums: &mut Sums, cad_from_work: &Isometry3, centre: &Point3, scale_mm: f64) {
        let work_from_cad = cad_from_work.inverse();
        for place in &self.places {
            let Some((offset_mm, sigma_mm)) = self.edge_offset(place, &work_from_cad) else { continue };
            let weight = (scale_mm / sigma_mm).powi(2) * tukey_weight(offset_mm, self.reach_mm);
            sums.add(&(place.at - centre), &place.outwards, offset_mm, weight);
        }
    }

    /// How far outside the nominal rim the data ends, mm, and its standard deviation; `None` where nothing is near.
    fn edge_offset(&self, place: &RimPlace, work_from_cad: &Isometry3) -> Option<(f64, f64)> {
        let at = work_from_cad * place.at;
        let turn = work_from_cad.rotation;
        let (outwards, along, normal) = (turn * place.outwards, turn * place.along, turn * place.normal);
        let w = self.reach_mm;
        // Soft ends, a quarter of a mm wide, so that the estimate is continuous in the pose.
        let ramp = |v: f64| (v / 0.25 + 0.5).clamp(0.0, 1.0);
        let (mut across, mut inner) = (0.0, 0.0);
        // The window's box seen along z: from the inner end to the outer, to both sides, above and below.
        let ends = [outwards * -(w + INNER_MM + 0.2), outwards * (w + 0.2)];
        let reach = |axis: usize| 1.6 * normal[axis].abs() + (self.half_width_mm + 0.2) * along[axis].abs();
        let low = [0, 1].map(|k| at[k] + ends[0][k].min(ends[1][k]) - reach(k));
        let high = [0, 1].map(|k| at[k] + ends[0][k].max(ends[1][k]) + reach(k));
        self.dense.within(low, high, |p| {
            let d = p - at;
            let s = d.dot(&outwards);
            let height = ramp(1.5 - d.dot(&normal).abs());
            let side = height * ramp(self.half_width_mm - d.dot(&along).abs());
            if side > 0.0 {
                across += side * ramp(s + w) * ramp(w - s);
                inner += side * ramp(s + w + INNER_MM) * ramp(-w - s);
            }
        });
        // Where the face is slanted the same raster holds more surface.
        let per_mm = self.dense.per_mm2 * normal.z.max(0.2) * 2.0 * self.half_width_mm;
        let full = per_mm * INNER_MM;
        if inner < 0.6 * full || inner > 1.6 * full {
            return None;
        }
        let offset = across / per_mm - w;
        let sigma = (across.max(1.0).sqrt() / per_mm).max(0.1);
        (offset.abs() < 0.9 * w).then_some((offset, sigma))
    }
}

/// Length of a chain. A closed one repeats its first point at its end; an open one has no side between its ends.
fn loop_length(rim: &[Point3]) -> f64 {
    rim.windows(2).map(|side| (side[1] - side[0]).norm()).sum()
}

/// Places at equal steps along a chain, with the direction of the side they lie on.
fn walk(rim: &[Point3], step: f64) -> Vec<(Point3, Vector3)> {
    let count = (loop_length(rim) / step).floor().max(3.0);
    let step = loop_length(rim) / count;
    let mut places = Vec::new();
    let mut until = 0.5 * step;
    for ends in rim.windows(2) {
        let side = ends[1] - ends[0];
        let length = side.norm();
        while until < length {
            places.push((ends[0] + side * (until / length), side / length));
            until += step;
        }
        until -= length;
    }
    places
}

/// The face's frame at a rim; `None` where it is not seen from `up`.
fn rim_place(face: &Face, at: Point3, along: Vector3, up: &Vector3) -> Option<RimPlace> {
    let normal = face.closest(&at, 0.5)?.normal.into_inner();
    if normal.dot(up) < 0.4 {
        return None;
    }
    // The surface lies on the left of a loop's direction.
    let outwards = along.cross(&normal).try_normalize(1e-9)?;
    Some(RimPlace { at, normal, outwards, along })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three sides of a square of 30 mm: the fourth is there only when the chain comes back to its first point.
    #[test]
    fn an_open_chain_is_not_closed() {
        let mut chain: Vec<Point3> =
            [[0.0, 0.0], [30.0, 0.0], [30.0, 30.0], [0.0, 30.0]].map(|[x, y]| Point3::new(x, y, 0.0)).to_vec();
        let on_fourth = |places: &[(Point3, Vector3)]| places.iter().filter(|(p, _)| p.x < 1e-9).count();
        assert_eq!(loop_length(&chain), 90.0);
        let open = walk(&chain, 3.0);
        assert_eq!((open.len(), on_fourth(&open)), (30, 0));
        chain.push(chain[0]);
        assert_eq!(loop_length(&chain), 120.0);
        let closed = walk(&chain, 3.0);
        assert_eq!((closed.len(), on_fourth(&closed)), (40, 10));
    }
}
