//! Points told apart by the tile of space they lie in, in portions that fit a processor's cache.

use super::points::{Numbered, Points};
use crate::geometry::Point3;
use crate::run::{Cancelled, RunContext};
use crate::stitch::cells::{TooManyCells, check_extent};
use rayon::prelude::*;
use std::collections::{BTreeSet, HashMap};
use std::ops::Range;

/// Points of one portion.
const PORTION: usize = 1 << 16;
/// Points that are looked at to choose the size of tiles.
const LOOKED_AT: usize = 1 << 14;
/// A tile should hold fewer points than this: they and what is found of them fit a processor's cache.
const TILE_POINTS: usize = 100_000;
/// Cells along a tile's side are at most two to this: a row of them has a bit each in one number.
pub(super) const MOST_BITS: u32 = 6;
const LEAST_BITS: u32 = 3;
/// A cell is wider than the radius by this part, so that what is within the radius lies in cells that touch, however places are rounded.
const WIDER: f64 = 1.0 / 65_536.0;
/// Bits of a tile's number along an axis.
const AXIS_BITS: u32 = 21;

/// How places are told in cells.
pub(super) struct Frame {
    low: Point3,
    per_length: f64,
    /// The radius in cells: a little less than 1.
    pub reach: f64,
    /// Cells along a tile's side, as a power of two.
    pub bits: u32,
}

/// A tile by its place along each axis.
pub(super) type Corner = [u32; 3];

impl Frame {
    /// Of points between two corners; usual tiles.
    pub fn of_box(low: Point3, high: Point3, radius: f64) -> Result<Self, TooManyCells> {
        let extent = (high - low).max();
        check_extent(if extent == f64::NEG_INFINITY { 0.0 } else { extent }, radius)?;
        Ok(Self { low, per_length: (1.0 - WIDER) / radius, reach: 1.0 - WIDER, bits: MOST_BITS })
    }

    /// Of all points; tiles of `bits`, or of as many as the points' density asks for.
    pub fn new<P: Points>(all: &Numbered<P>, radius: f64, bits: Option<u32>) -> Result<Self, TooManyCells> {
        let none = (Point3::from([f64::INFINITY; 3]), Point3::from([f64::NEG_INFINITY; 3]));
        let portions = portions(all);
        let (low, high) = portions
            .par_iter()
            .map(|(part, range)| {
                let places = range.clone().map(|k| all.points.position(*part, k));
                places.fold(none, |(low, high), p| (low.inf(&p), high.sup(&p)))
            })
            .reduce(|| none, |a, b| (a.0.inf(&b.0), a.1.sup(&b.1)));
        let mut frame = Self::of_box(low, high, radius)?;
        match bits {
            Some(bits) => frame.bits = bits,
            None => frame.choose_size(all),
        }
        Ok(frame)
    }

    /// Smaller tiles where the usual ones would hold too many points of a surface.
    fn choose_size<P: Points>(&mut self, all: &Numbered<P>) {
        let step = all.len().div_ceil(LOOKED_AT).max(1);
        let tile = |k: usize| pack(self.tile(self.cells(&all.position(k as u32))));
        let tiles: BTreeSet<u64> = (0..all.len()).step_by(step).map(tile).collect();
        let mut usual = all.len() / tiles.len().max(1);
        while usual > TILE_POINTS && self.bits > LEAST_BITS {
            self.bits -= 1;
            usual /= 4;
        }
    }

    /// A place in cells from the corner of all points.
    #[inline]
    pub fn cells(&self, place: &Point3) -> [f64; 3] {
        std::array::from_fn(|k| (place[k] - self.low[k]) * self.per_length)
    }

    #[inline]
    pub fn tile(&self, cells: [f64; 3]) -> Corner {
        cells.map(|c| c as u32 >> self.bits)
    }

    /// A place in cells from the corner of its tile.
    #[inline]
    pub fn in_tile(&self, cells: [f64; 3], tile: Corner) -> [f64; 3] {
        std::array::from_fn(|k| cells[k] - f64::from(tile[k] << self.bits))
    }
}

/// A tile as one number.
#[inline]
pub(super) fn pack([x, y, z]: Corner) -> u64 {
    (u64::from(z) << (2 * AXIS_BITS)) | (u64::from(y) << AXIS_BITS) | u64::from(x)
}

pub(super) fn unpack(tile: u64) -> Corner {
    [0, AXIS_BITS, 2 * AXIS_BITS].map(|shift| (tile >> shift) as u32 & ((1 << AXIS_BITS) - 1))
}

/// Parts in portions: part, and indices in it.
fn portions<P: Points>(all: &Numbered<P>) -> Vec<(usize, Range<usize>)> {
    let of_part = |part: usize| {
        let count = all.points.count(part);
        (0..count).step_by(PORTION).map(move |from| (part, from..(from + PORTION).min(count)))
    };
    (0..all.points.parts()).flat_map(of_part).collect()
}

/// Points of one portion that lie in one tile.
#[derive(Clone, Copy)]
pub(super) struct Run {
    pub tile: u64,
    portion: u32,
    from: u32,
    to: u32,
}

/// All points by tile.
pub(super) struct Binned {
    /// Of each portion its part and the indices of its points, tile by tile, rising in each.
    portions: Vec<(usize, Vec<u32>)>,
    /// By tile, then by portion.
    runs: Vec<Run>,
}

impl Binned {
    pub fn new<P: Points>(all: &Numbered<P>, frame: &Frame, run: &RunContext) -> Result<Self, Cancelled> {
        let portions = portions(all);
        let sorted: Vec<ByTile> = portions
            .par_iter()
            .map(|(part, range)| {
                run.check()?;
                let tile = |k: usize| pack(frame.tile(frame.cells(&all.points.position(*part, k))));
                Ok(by_tile(range.clone(), tile))
            })
            .collect::<Result<_, Cancelled>>()?;
        let mut runs = Vec::new();
        let mut of_portions = Vec::new();
        for (portion, ((part, _), (indices, ends))) in portions.into_iter().zip(sorted).enumerate() {
            let mut from = 0;
            for (tile, to) in ends {
                runs.push(Run { tile, portion: portion as u32, from, to });
                from = to;
            }
            of_portions.push((part, indices));
        }
        runs.par_sort_unstable_by_key(|run| (run.tile, run.portion));
        Ok(Self { portions: of_portions, runs })
    }

    /// The runs of each tile, tiles rising.
    pub fn tiles(&self) -> Vec<&[Run]> {
        self.runs.chunk_by(|a, b| a.tile == b.tile).collect()
    }

    /// Part and indices of a run.
    pub fn points(&self, run: &Run) -> (usize, &[u32]) {
        let (part, indices) = &self.portions[run.portion as usize];
        (*part, &indices[run.from as usize..run.to as usize])
    }
}

type ByTile = (Vec<u32>, Vec<(u64, u32)>);

/// Indices by tile, tiles in the order in which they come up, and where each ends.
fn by_tile(range: Range<usize>, tile: impl Fn(usize) -> u64) -> ByTile {
    let mut known: HashMap<u64, u32> = HashMap::new();
    let mut counts: Vec<(u64, u32)> = Vec::new();
    let mut last = (u64::MAX, 0);
    let mut which = Vec::with_capacity(range.len());
    for k in range.clone() {
        let tile = tile(k);
        if tile != last.0 {
            let next = counts.len() as u32;
            last = (tile, *known.entry(tile).or_insert(next));
            if last.1 == next {
                counts.push((tile, 0));
            }
        }
        counts[last.1 as usize].1 += 1;
        which.push(last.1);
    }
    let mut sum = 0;
    for (_, count) in &mut counts {
        sum += std::mem::replace(count, sum);
    }
    let mut indices = vec![0; which.len()];
    for (k, which) in range.zip(which) {
        let place = &mut counts[which as usize].1;
        indices[*place as usize] = k as u32;
        *place += 1;
    }
    (indices, counts)
}
