//! Voids: places of the sheet beside an outline where no points are, through a shadow or glare.
//!
//! A void that touches the rim looks like a part of the hole and pulls the outline into it. The window is laid out in squares
//! of 1.5 spacings; a cluster of empty squares that reaches more than 2.5 spacings into the material and is larger than chance
//! leaves is a void. Its squares and those next to it are cut out of the window, and so are the whole sectors of the outline
//! that it touches: nobody can tell there what is hole and what is void.

use super::Window;
use super::data::{Piece, Region};
use super::outline::Outline;
use super::sectors::{Cell, Raster, sector};

/// Side of a square, spacings.
pub const CELL: f64 = 1.5;
/// How far into the material an empty cluster must reach to be a void, spacings.
const DEEP: f64 = 2.5;
/// Squares whose middle is that deep in the material are material throughout, spacings.
const MATERIAL: f64 = 0.75;
/// A void touches the outline where it comes as near as this, spacings: no square of material in between.
const TOUCHES: f64 = MATERIAL + CELL;
/// Points expected in a cluster that has none. Six squares of 2.25 points each are left empty by independent points with the chance
/// `e^-13.5 = 1.4e-6`; a window has some 450 squares about each of which 216 such clusters may lie: one in ten windows shows one, as
/// a rule far from the rim. A jittered lattice leaves far fewer.
const EXPECTED: f64 = 13.0;
/// Side of the pieces in which the cut is summed near the outline, as a share of a square.
const PIECES: usize = 5;
/// Near the outline is what is nearer than this, spacings; further away a piece is a whole square.
const NEAR: f64 = 3.0;

/// What is cut out of a window.
#[derive(Debug, Clone, PartialEq)]
pub struct Cut {
    /// For each square of the raster whether it is cut out.
    pub cells: Vec<bool>,
    /// Share of the outline's length that is left.
    pub outline_left: f64,
}

/// The voids of a window around an outline; `density` is the points expected per mm² of material at a place.
pub fn find_voids<O: Outline>(
    raster: &Raster,
    outline: &O,
    density: impl Fn([f64; 2]) -> f64,
    spacing_mm: f64,
) -> Option<Cut> {
    let empty = |c: &Cell| c.points == 0 && c.is_whole() && c.signed_mm > MATERIAL * spacing_mm;
    let mut seen: Vec<bool> = raster.cells.iter().map(|c| !empty(c)).collect();
    let mut voids: Vec<Vec<usize>> = Vec::new();
    for first in 0..seen.len() {
        if seen[first] {
            continue;
        }
        let cluster = cluster_of(raster, first, &mut seen);
        let expected: f64 = cluster.iter().map(|k| density(raster.cells[*k].place)).sum();
        let deepest = cluster.iter().map(|k| raster.cells[*k].signed_mm).fold(0.0, f64::max);
        if expected * raster.cell_mm * raster.cell_mm >= EXPECTED && deepest > DEEP * spacing_mm {
            voids.push(cluster);
        }
    }
    (!voids.is_empty()).then(|| cut_out(raster, outline, &voids, spacing_mm))
}

/// The empty squares joined to one by their sides, marked as seen.
fn cluster_of(raster: &Raster, first: usize, seen: &mut [bool]) -> Vec<usize> {
    seen[first] = true;
    let mut cluster = vec![first];
    let mut next = 0;
    while let Some(&k) = cluster.get(next) {
        next += 1;
        for n in raster.neighbours(k) {
            if !seen[n] {
                seen[n] = true;
                cluster.push(n);
            }
        }
    }
    cluster
}

fn cut_out<O: Outline>(raster: &Raster, outline: &O, voids: &[Vec<usize>], spacing_mm: f64) -> Cut {
    let count = ((outline.length_mm() / raster.cell_mm) as usize).max(1);
    let mut blind = vec![false; count];
    let mut cells = vec![false; raster.cells.len()];
    for k in voids.iter().flatten() {
        let cell = &raster.cells[*k];
        cells[*k] = true;
        for n in raster.neighbours(*k) {
            cells[n] = true;
        }
        if cell.signed_mm < TOUCHES * spacing_mm {
            // The sector next to it may be touched by a corner of the void that the squares do not show.
            let own = sector(outline.along(cell.place), count);
            blind[own] = true;
            for n in [own.checked_sub(1).or(O::CLOSED.then_some(count - 1)), Some(own + 1)].into_iter().flatten() {
                if n < count || O::CLOSED {
                    blind[n % count] = true;
                }
            }
        }
    }
    let left = blind.iter().filter(|b| !**b).count() as f64 / count as f64;
    if left < 1.0 {
        for (cut, cell) in cells.iter_mut().zip(&raster.cells) {
            *cut |= cell.part > 0.0 && blind[sector(outline.along(cell.place), count)];
        }
    }
    Cut { cells, outline_left: left }
}

impl Cut {
    /// What is left of a window.
    pub fn region(&self, window: &Window, raster: &Raster, spacing_mm: f64) -> Region {
        let mut region = Region::whole(window);
        for (cell, _) in raster.cells.iter().zip(&self.cells).filter(|(cell, cut)| **cut && cell.part > 0.0) {
            if cell.signed_mm.abs() < NEAR * spacing_mm || !cell.is_whole() {
                pieces(cell, window, raster.cell_mm, &mut region.cut);
            } else {
                let side = raster.cell_mm;
                region.cut.push(Piece { place: cell.place, area: side * side, blur_sq: side * side / 12.0 });
            }
        }
        for piece in &region.cut {
            region.moments[0] -= piece.area;
            region.moments[1] -= piece.area * piece.place[0];
            region.moments[2] -= piece.area * piece.place[1];
        }
        region
    }

    /// The points that are left.
    pub fn kept(&self, points: &[[f64; 2]], raster: &Raster) -> Vec<[f64; 2]> {
        points.iter().filter(|p| !self.cells[raster.index(p)]).copied().collect()
    }
}

/// The pieces of a square that belong to a window.
fn pieces(cell: &Cell, window: &Window, cell_mm: f64, out: &mut Vec<Piece>) {
    let side = cell_mm / PIECES as f64;
    let first = [0, 1].map(|axis| cell.place[axis] - 0.5 * cell_mm + 0.5 * side);
    for (j, [from, to]) in window.rows(first[1], side, PIECES).into_iter().enumerate() {
        for i in 0..PIECES {
            let u = first[0] + side * i as f64;
            let width = (to.min(u + 0.5 * side) - from.max(u - 0.5 * side)).max(0.0);
            if width > 0.0 {
                let place = [u, first[1] + side * j as f64];
                out.push(Piece { place, area: width * side, blur_sq: side * side / 12.0 });
            }
        }
    }
}
