//! Things that lie apart in view: a press makes the left and the right part at once, and a tool may lie beside them.
//!
//! The kept points are looked at along the camera's direction, in a raster of a few spacings a cell. What a camera sees from above lies
//! apart there when it lies apart on the belt, and a part is in one piece there although its steep walls are hardly seen. Cells with as many
//! points as a surface has, side by side, are one *body*. A blot without data may cut one part into several bodies: larger bodies are
//! put together, the nearest ones first, as long as they can be one part by their size. Whether they are is for the alignment to say.

use super::ConditionedScan;
use super::belt::tangents;
use super::belt_judge::rectangle_about;
use super::conditioned::BeltPlane;
use super::hints::ScanHints;
use super::neighbourhood::{CHUNK, Texture, stratified, weighted_plane};
use crate::geometry::{Point3, UnitVector3, Vector3};
use rayon::prelude::*;
use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicU32, Ordering};

/// Side of a cell in spacings. Bodies lie apart from a gap of that times the square root of five on, whichever way it runs.
const CELL_SPACINGS: f64 = 2.5;
/// The gap between two bodies at which they surely lie apart, in spacings.
pub const APART_SPACINGS: f64 = 2.24 * CELL_SPACINGS;
/// Share of the points of a full cell that makes it one of surface, three points of six. Two thirds of the density are still one piece
/// (of irregular points 79 % of the cells hold that many; 59 % are the least for cells side by side to hang together), and noise of a
/// tenth of it fills 3 % of the cells and bridges no gap.
const SURFACE_SHARE: f64 = 0.35;
/// Cells in all, at most: a larger view gets larger cells.
const MOST_CELLS: f64 = 4e6;
/// Bodies looked at, the largest ones.
const MOST_BODIES: usize = 48;
/// Places that stand for a body.
const PLACES: usize = 500;
/// A body of less than this share of the part's surface is clutter, and goes with what is next to it.
const LEAST_SHARE: f64 = 0.005;
/// What can be one part: its surface and its shadow may be larger than the CAD's by these, its length by the last.
const MOST_SURFACE: f64 = 1.15;
const MOST_SHADOW: f64 = 1.1;
const MOST_LENGTH: f64 = 1.05;
/// A body of less than this share of the part's surface is put together with none: it may be anything, and the alignment tells
/// afterwards to what it belongs.
const LEAST_PIECE: f64 = 0.05;

/// One body.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// Points in its cells.
    pub points: usize,
    /// Surface as the camera sees it.
    pub area_mm2: f64,
    /// Mean of its places, scan frame.
    pub middle: Point3,
    /// An even sample of its points, scan frame.
    pub places: Vec<Point3>,
}

/// The bodies of a scan, the largest first, and which body each kept point is nearest to.
#[derive(Debug, Clone)]
pub struct Bodies {
    /// At least one, unless the scan has no points.
    pub list: Vec<Body>,
    /// Towards the camera, as far as it is known; else across the points' plane.
    pub to_camera: UnitVector3,
    kept: Vec<u32>,
    /// Body of each kept point; empty where there are less than two bodies.
    owners: Vec<u8>,
    /// Bodies next to each other, with the gap between them in mm, the nearest first.
    gaps: Vec<(f64, u8, u8)>,
}

impl Bodies {
    /// Finds the bodies among the kept points.
    pub fn find(scan: &ConditionedScan, hints: &ScanHints) -> Self {
        let to_camera = scan.to_camera.unwrap_or_else(|| thin_axis(scan));
        let mut bodies =
            Self { list: Vec::new(), to_camera, kept: scan.kept.clone(), owners: Vec::new(), gaps: Vec::new() };
        let positions = &scan.cloud.positions;
        let Some(raster) = Raster::over(positions, &scan.kept, scan.spacing_mm, &to_camera) else { return bodies };
        let point_mm2 = scan.spacing_mm * scan.spacing_mm;
        let enough = (LEAST_SHARE * hints.part_area_mm2 / point_mm2).max(1.0) as usize;
        let (body_of, sizes) = raster.bodies(positions, &scan.kept, enough);
        match sizes.len() {
            0 => {}
            1 => bodies.list.push(one_body(scan, &scan.kept, sizes[0])),
            _ => {
                let nearest = raster.nearest(&body_of);
                bodies.gaps = raster.gaps(&nearest);
                let owner = |k: &u32| nearest[raster.cell(&positions[*k as usize])].0;
                bodies.owners = scan.kept.par_iter().with_min_len(CHUNK).map(owner).collect();
                let own = |k: &u32| body_of[raster.cell(&positions[*k as usize])];
                let mut members = vec![Vec::new(); sizes.len()];
                for &k in &scan.kept {
                    if let Some(list) = members.get_mut(own(&k) as usize) {
                        list.push(k);
                    }
                }
                bodies.list = members.iter().zip(&sizes).map(|(m, size)| one_body(scan, m, *size)).collect();
            }
        }
        bodies
    }

    /// The kept points, ascending, whose nearest body is one of those chosen.
    pub fn kept_of(&self, chosen: &[bool]) -> Vec<u32> {
        if self.owners.is_empty() {
            return self.kept.clone();
        }
        let is_chosen = |owner: u8| chosen.get(owner as usize).copied().unwrap_or(false);
        self.kept.iter().zip(&self.owners).filter(|(_, owner)| is_chosen(**owner)).map(|(k, _)| *k).collect()
    }

    /// Surface of some bodies.
    pub fn area_mm2(&self, chosen: &[bool]) -> f64 {
        self.of(chosen).map(|b| b.area_mm2).sum()
    }

    /// Mean place of some bodies, scan frame.
    pub fn middle(&self, chosen: &[bool]) -> Point3 {
        let points = self.of(chosen).map(|b| b.points).sum::<usize>().max(1) as f64;
        Point3::from(self.of(chosen).map(|b| b.middle.coords * (b.points as f64 / points)).sum::<Vector3>())
    }

    /// The bodies chosen.
    pub fn of<'a>(&'a self, chosen: &'a [bool]) -> impl Iterator<Item = &'a Body> {
        self.list.iter().zip(chosen).filter(|(_, c)| **c).map(|(b, _)| b)
    }

    /// Whether some bodies together can be one part by their size.
    pub fn can_be_one_part(&self, chosen: &[bool], hints: &ScanHints) -> bool {
        let (u, v) = tangents(&self.to_camera);
        let flat: Vec<(f64, f64)> =
            self.of(chosen).flat_map(|b| &b.places).map(|p| (p.coords.dot(&u), p.coords.dot(&v))).collect();
        fits_one_part(self.area_mm2(chosen), &flat, hints)
    }

    /// Bodies put together, the nearest first, as long as they can be one part: who belongs to each group, the largest group first.
    pub fn groups(&self, hints: &ScanHints) -> Vec<Vec<bool>> {
        let count = self.list.len();
        let mut groups: Vec<Option<Vec<bool>>> =
            (0..count).map(|k| Some((0..count).map(|b| b == k).collect())).collect();
        let mut group_of: Vec<usize> = (0..count).collect();
        let is_piece = |b: u8| self.list[b as usize].area_mm2 >= LEAST_PIECE * hints.part_area_mm2;
        for &(_, a, b) in self.gaps.iter().filter(|(_, a, b)| is_piece(*a) && is_piece(*b)) {
            let (a, b) = (group_of[a as usize], group_of[b as usize]);
            let (Some(first), Some(second)) = (&groups[a], &groups[b]) else { continue };
            let both: Vec<bool> = first.iter().zip(second).map(|(x, y)| x | y).collect();
            if a != b && self.can_be_one_part(&both, hints) {
                group_of.iter_mut().filter(|g| **g == b).for_each(|g| *g = a);
                groups[a] = Some(both);
                groups[b] = None;
            }
        }
        let mut groups: Vec<Vec<bool>> = groups.into_iter().flatten().collect();
        groups.sort_by(|a, b| self.area_mm2(b).total_cmp(&self.area_mm2(a)));
        groups
    }

    /// Whether some bodies reach the border of what was seen (all points of the cloud): they may go on beyond it.
    pub fn reach_the_border(&self, scan: &ConditionedScan, chosen: &[bool]) -> bool {
        const DIRECTIONS: u32 = 360;
        let near_mm = 2.0 + 3.0 * scan.spacing_mm;
        let (u, v) = tangents(&self.to_camera);
        let flat = |p: &Point3| (p.coords.dot(&u), p.coords.dot(&v));
        let positions = &scan.cloud.positions;
        let all: Vec<(f64, f64)> =
            stratified(positions.len(), 20_000, 8).iter().map(|&k| flat(&positions[k as usize])).collect();
        let own: Vec<(f64, f64)> = self.of(chosen).flat_map(|b| &b.places).map(flat).collect();
        (0..DIRECTIONS).any(|k| {
            let (s, c) = (std::f64::consts::TAU * f64::from(k) / f64::from(DIRECTIONS)).sin_cos();
            let furthest = |of: &[(f64, f64)]| of.iter().map(|(x, y)| c * x + s * y).fold(f64::NEG_INFINITY, f64::max);
            furthest(&all) - furthest(&own) < near_mm
        })
    }
}

/// Whether nothing but parts is in view, each lying apart and no larger than the CAD: then the backmost plane is no belt, but faces of
/// theirs that lie level. `indices` names the points that are bright enough.
///
/// A part beside a piece of belt is not taken for two parts: most of that piece lies in the plane, and only a flat part as large as
/// the CAD does so, too.
pub(super) fn are_parts_alone(
    positions: &[Point3],
    indices: &[u32],
    plane: &BeltPlane,
    texture: Texture,
    hints: &ScanHints,
) -> bool {
    const ENOUGH: usize = 300_000;
    const LEAST_PART: f64 = 0.1;
    const NEARLY_ALL: f64 = 0.9;
    if !hints.has_size() {
        return false;
    }
    let sample: Vec<u32> = stratified(indices.len(), ENOUGH, 11).into_iter().map(|k| indices[k as usize]).collect();
    let spacing_mm = texture.spacing_mm * (indices.len() as f64 / sample.len() as f64).sqrt();
    let point_mm2 = spacing_mm * spacing_mm;
    let Some(raster) = Raster::over(positions, &sample, spacing_mm, &plane.normal) else { return false };
    let enough = (LEAST_PART * hints.part_area_mm2 / point_mm2).max(1.0) as usize;
    let (body_of, sizes) = raster.bodies(positions, &sample, enough);
    if sizes.len() < 2 || (sizes.iter().sum::<usize>() as f64) < NEARLY_ALL * sample.len() as f64 {
        return false;
    }
    (0..sizes.len()).all(|body| {
        let own: Vec<&Point3> =
            sample.iter().map(|&k| &positions[k as usize]).filter(|p| body_of[raster.cell(p)] == body as u8).collect();
        let step = own.len().div_ceil(1500).max(1);
        let flat: Vec<(f64, f64)> =
            own.iter().step_by(step).map(|p| (p.coords.dot(&raster.u), p.coords.dot(&raster.v))).collect();
        let in_plane = own.iter().filter(|p| plane.height_mm(p).abs() <= 3.5 * plane.sigma_mm).count();
        let area_mm2 = sizes[body] as f64 * point_mm2;
        let is_no_belt = 2 * in_plane < own.len() || area_mm2 >= 0.8 * hints.part_area_mm2;
        is_no_belt && fits_one_part(area_mm2, &flat, hints)
    })
}

/// Whether a surface with that outline can be one part by its size.
fn fits_one_part(area_mm2: f64, flat: &[(f64, f64)], hints: &ScanHints) -> bool {
    let [length_mm, width_mm] = rectangle_about(flat);
    area_mm2 <= MOST_SURFACE * hints.part_area_mm2
        && length_mm <= MOST_LENGTH * hints.diagonal_mm()
        && length_mm * width_mm <= MOST_SHADOW * hints.largest_shadow_mm2()
}

fn one_body(scan: &ConditionedScan, members: &[u32], points: usize) -> Body {
    let positions = &scan.cloud.positions;
    let places: Vec<Point3> =
        stratified(members.len(), PLACES, 9).into_iter().map(|k| positions[members[k as usize] as usize]).collect();
    let sum: Vector3 = places.iter().map(|p| p.coords).sum();
    let middle = Point3::from(sum / places.len().max(1) as f64);
    Body { points, area_mm2: points as f64 * scan.spacing_mm * scan.spacing_mm, middle, places }
}

/// Direction of least variance of the kept points: nobody knows where the camera stood.
fn thin_axis(scan: &ConditionedScan) -> UnitVector3 {
    let points: Vec<Point3> = stratified(scan.kept.len(), 5000, 10)
        .into_iter()
        .map(|k| scan.cloud.positions[scan.kept[k as usize] as usize])
        .collect();
    weighted_plane(&points, |_| 1.0).map_or(Vector3::z_axis(), |(_, normal)| UnitVector3::new_normalize(normal))
}

const NOBODY: u8 = u8::MAX;

/// Cells across the camera's direction.
struct Raster {
    spacing_mm: f64,
    u: Vector3,
    v: Vector3,
    low: (f64, f64),
    cell_mm: f64,
    nx: usize,
    ny: usize,
}

impl Raster {
    /// Over all points named; `None` without any.
    fn over(positions: &[Point3], kept: &[u32], spacing_mm: f64, to_camera: &UnitVector3) -> Option<Self> {
        let (u, v) = tangents(to_camera);
        let box_of = |chunk: &[u32]| {
            chunk.iter().fold([f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY], |b, &k| {
                let p = &positions[k as usize].coords;
                let (x, y) = (p.dot(&u), p.dot(&v));
                [b[0].min(x), b[1].max(x), b[2].min(y), b[3].max(y)]
            })
        };
        let join = |a: [f64; 4], b: [f64; 4]| [a[0].min(b[0]), a[1].max(b[1]), a[2].min(b[2]), a[3].max(b[3])];
        let [x0, x1, y0, y1] = kept.par_chunks(CHUNK).map(box_of).reduce_with(join)?;
        let cell_mm = (CELL_SPACINGS * spacing_mm).max(((x1 - x0) * (y1 - y0) / MOST_CELLS).sqrt());
        let cell_mm = cell_mm.max((x1 - x0).max(y1 - y0) / MOST_CELLS);
        let cells = |extent: f64| (extent / cell_mm) as usize + 1;
        Some(Self { spacing_mm, u, v, low: (x0, y0), cell_mm, nx: cells(x1 - x0), ny: cells(y1 - y0) })
    }

    /// The cell of one of the points.
    fn cell(&self, point: &Point3) -> usize {
        let place = |along: &Vector3, low: f64, cells: usize| {
            (((point.coords.dot(along) - low) / self.cell_mm) as usize).min(cells - 1)
        };
        place(&self.v, self.low.1, self.ny) * self.nx + place(&self.u, self.low.0, self.nx)
    }

    fn count(&self, positions: &[Point3], kept: &[u32]) -> Vec<u32> {
        let counts: Vec<AtomicU32> = (0..self.nx * self.ny).map(|_| AtomicU32::new(0)).collect();
        kept.par_chunks(CHUNK).for_each(|chunk| {
            for &k in chunk {
                counts[self.cell(&positions[k as usize])].fetch_add(1, Ordering::Relaxed);
            }
        });
        counts.into_iter().map(AtomicU32::into_inner).collect()
    }

    /// The body of each cell ([`NOBODY`] where there is none) and the points of each body, the largest first; bodies of fewer
    /// points than `enough` do not count.
    fn bodies(&self, positions: &[Point3], kept: &[u32], enough: usize) -> (Vec<u8>, Vec<usize>) {
        let counts = self.count(positions, kept);
        let least = (SURFACE_SHARE * (self.cell_mm / self.spacing_mm).powi(2)).ceil().max(2.0) as u32;
        let (piece, sizes) = self.pieces(&counts, least);
        let mut order: Vec<usize> = (0..sizes.len()).filter(|&k| sizes[k] >= enough).collect();
        order.sort_by(|&a, &b| sizes[b].cmp(&sizes[a]).then(a.cmp(&b)));
        order.truncate(MOST_BODIES);
        let mut body_of_piece = vec![NOBODY; sizes.len()];
        for (body, &k) in order.iter().enumerate() {
            body_of_piece[k] = body as u8;
        }
        let body_of = |&k: &u32| body_of_piece.get(k as usize).copied().unwrap_or(NOBODY);
        (piece.iter().map(body_of).collect(), order.iter().map(|&k| sizes[k]).collect())
    }

    /// Cells of at least so many points that hang together side by side: the piece of each cell and the points of each piece.
    fn pieces(&self, counts: &[u32], least: u32) -> (Vec<u32>, Vec<usize>) {
        const NONE: u32 = u32::MAX;
        let mut piece = vec![NONE; counts.len()];
        let mut sizes: Vec<usize> = Vec::new();
        let mut waiting = Vec::new();
        for start in 0..counts.len() {
            if counts[start] < least || piece[start] != NONE {
                continue;
            }
            let label = sizes.len() as u32;
            let mut points = 0;
            piece[start] = label;
            waiting.push(start);
            while let Some(cell) = waiting.pop() {
                points += counts[cell] as usize;
                for other in self.beside(cell).into_iter().flatten() {
                    if counts[other] >= least && piece[other] == NONE {
                        piece[other] = label;
                        waiting.push(other);
                    }
                }
            }
            sizes.push(points);
        }
        (piece, sizes)
    }

    /// The cells that share a side with one.
    fn beside(&self, cell: usize) -> [Option<usize>; 4] {
        let (x, y) = (cell % self.nx, cell / self.nx);
        [
            (x > 0).then(|| cell - 1),
            (x + 1 < self.nx).then(|| cell + 1),
            (y > 0).then(|| cell - self.nx),
            (y + 1 < self.ny).then(|| cell + self.nx),
        ]
    }

    /// The nearest body of each cell and the steps from cell to cell to it. There must be a body.
    fn nearest(&self, body_of: &[u8]) -> Vec<(u8, u32)> {
        let mut nearest: Vec<(u8, u32)> = body_of.iter().map(|&b| (b, 0)).collect();
        let mut waiting: VecDeque<usize> = (0..body_of.len()).filter(|&c| body_of[c] != NOBODY).collect();
        while let Some(cell) = waiting.pop_front() {
            let (body, steps) = nearest[cell];
            for other in self.beside(cell).into_iter().flatten() {
                if nearest[other].0 == NOBODY {
                    nearest[other] = (body, steps + 1);
                    waiting.push_back(other);
                }
            }
        }
        nearest
    }

    /// The least gap between bodies that are next to each other, in mm, the least first.
    fn gaps(&self, nearest: &[(u8, u32)]) -> Vec<(f64, u8, u8)> {
        let mut least: BTreeMap<(u8, u8), u32> = BTreeMap::new();
        for (cell, (body, steps)) in nearest.iter().enumerate() {
            for other in self.beside(cell).into_iter().flatten() {
                let (next, more) = nearest[other];
                if *body < next {
                    let gap = least.entry((*body, next)).or_insert(u32::MAX);
                    *gap = (*gap).min(steps + more);
                }
            }
        }
        let mut gaps: Vec<(f64, u8, u8)> =
            least.into_iter().map(|((a, b), steps)| (f64::from(steps) * self.cell_mm, a, b)).collect();
        gaps.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        gaps
    }
}

#[cfg(test)]
mod tests;
