//! Points sorted into cubic cells, for looking around every one of them in turn: memory goes with the points and not with the box
//! around them, and neighbours are found by walking along, not by looking up.

use crate::geometry::Point3;
use rayon::prelude::*;
use std::ops::Range;

/// Points whose cells are numbered by one task.
const CHUNK: usize = 1 << 15;
/// Bits of a cell's number along one axis.
const AXIS_BITS: u32 = 21;
/// One more than the largest number along an axis; the first and the last are never used, so that every cell has neighbours.
const AXIS_CELLS: f64 = (1_u64 << AXIS_BITS) as f64 - 2.0;

/// The points' box has too many cells along an axis.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "the points reach over {extent:.4}, more than two million times the distance of {cell:.3e} within which they are merged"
)]
pub struct TooManyCells {
    /// Longest side of the box.
    pub extent: f64,
    /// Side of a cell.
    pub cell: f64,
}

/// Points in the order of their cells.
#[derive(Debug, Clone)]
pub struct Cells {
    /// Index of each point among those given, cell by cell.
    pub order: Vec<u32>,
    /// Its position.
    pub positions: Vec<Point3>,
    /// Numbers of the cells that hold points, rising.
    keys: Vec<u64>,
    /// First point of each cell, and one past the last.
    starts: Vec<u32>,
}

/// The nine rows of three cells around a cell, each by its first point and one past its last; the cell's own row comes first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Around([[u32; 2]; 9]);

impl Around {
    /// The rows as ranges of points.
    pub fn rows(&self) -> impl Iterator<Item = Range<usize>> {
        self.0.into_iter().map(|[from, to]| from as usize..to as usize)
    }

    /// All the points.
    pub fn points(&self) -> impl Iterator<Item = usize> {
        self.rows().flatten()
    }
}

/// Whether cells of a side can be numbered over an extent.
pub(super) fn check_extent(extent: f64, side: f64) -> Result<(), TooManyCells> {
    if extent / side >= AXIS_CELLS - 1.0 { Err(TooManyCells { extent, cell: side }) } else { Ok(()) }
}

impl Cells {
    /// Sorts points into cells of that side. Within a cell they stay in the order given.
    ///
    /// # Errors
    /// A box with more than 2 097 150 cells along a side.
    pub fn new(positions: &[Point3], side: f64) -> Result<Self, TooManyCells> {
        let none = (Point3::from([f64::INFINITY; 3]), Point3::from([f64::NEG_INFINITY; 3]));
        let (low, high) = positions
            .par_chunks(CHUNK)
            .map(|chunk| chunk.iter().fold(none, |(low, high), p| (low.inf(p), high.sup(p))))
            .reduce(|| none, |a, b| (a.0.inf(&b.0), a.1.sup(&b.1)));
        let extent = if positions.is_empty() { 0.0 } else { (high - low).max() };
        check_extent(extent, side)?;
        let cell = |p: &Point3| -> [u64; 3] { std::array::from_fn(|k| ((p[k] - low[k]) / side) as u64 + 1) };
        let last = if positions.is_empty() { [1; 3] } else { cell(&high) };
        let (order, keys, starts) = sorted(positions, cell, last);
        let positions = order.par_iter().map(|k| positions[*k as usize]).collect();
        Ok(Self { order, positions, keys, starts })
    }

    /// How many cells hold points.
    pub fn len(&self) -> usize {
        self.keys.len()
    }

    /// Whether there are no points.
    pub fn is_empty(&self) -> bool {
        self.keys.is_empty()
    }

    /// The points of a cell.
    pub fn points(&self, cell: usize) -> Range<usize> {
        self.starts[cell] as usize..self.starts[cell + 1] as usize
    }

    /// A walk over the cells from one on; each step costs little, whatever the number of cells.
    pub fn walk(&self, from: usize) -> Walk<'_> {
        let mut walk = Walk { cells: self, next: from, rows: [[0; 2]; 9] };
        if from < self.len() {
            walk.rows = ROWS.map(|row| self.row(from, row).map(|key| self.keys.partition_point(|k| *k < key)));
        }
        walk
    }

    /// Numbers of the first cell of a row of three around a cell, and one past the last.
    fn row(&self, cell: usize, [y, z]: [i64; 2]) -> [u64; 2] {
        let middle = self.keys[cell].wrapping_add_signed((z << (2 * AXIS_BITS)) + (y << AXIS_BITS));
        [middle - 1, middle + 2]
    }
}

/// Indices of points by cell, then as given, with the cells' numbers and where each begins. `last` is the largest cell along each axis.
///
/// Cell and index are one number as long as they fit into 64 bits, which halves the time to sort them; else they are two.
fn sorted(
    positions: &[Point3],
    cell: impl Fn(&Point3) -> [u64; 3] + Sync,
    last: [u64; 3],
) -> (Vec<u32>, Vec<u64>, Vec<u32>) {
    let bits = |largest: u64| u64::BITS - largest.leading_zeros();
    let ([x_bits, y_bits, z_bits], index_bits) = (last.map(bits), bits(positions.len() as u64));
    let whole = |[x, y, z]: [u64; 3]| (z << (2 * AXIS_BITS)) | (y << AXIS_BITS) | x;
    if x_bits + y_bits + z_bits + index_bits > u64::BITS {
        let tag = |(k, p): (usize, &Point3)| (whole(cell(p)), k as u32);
        let mut tagged: Vec<(u64, u32)> = positions.par_iter().enumerate().map(tag).collect();
        tagged.par_sort_unstable();
        let (keys, starts) = runs(tagged.iter().map(|(key, _)| *key), tagged.len());
        return (tagged.into_par_iter().map(|(_, k)| k).collect(), keys, starts);
    }
    let tag = |(k, p): (usize, &Point3)| {
        let [x, y, z] = cell(p);
        (((((z << y_bits) | y) << x_bits) | x) << index_bits) | k as u64
    };
    let mut tagged: Vec<u64> = positions.par_iter().enumerate().map(tag).collect();
    tagged.par_sort_unstable();
    let (mut keys, starts) = runs(tagged.iter().map(|tag| tag >> index_bits), tagged.len());
    let low = |value: u64, bits: u32| value & ((1 << bits) - 1);
    for key in &mut keys {
        *key = whole([low(*key, x_bits), low(*key >> x_bits, y_bits), *key >> (x_bits + y_bits)]);
    }
    (tagged.into_par_iter().map(|tag| low(tag, index_bits) as u32).collect(), keys, starts)
}

/// Numbers of cells that follow each other, each once, with the first point of each and one past the last.
fn runs(cells: impl Iterator<Item = u64>, count: usize) -> (Vec<u64>, Vec<u32>) {
    let (mut keys, mut starts) = (Vec::new(), Vec::new());
    for (k, key) in cells.enumerate() {
        if keys.last() != Some(&key) {
            keys.push(key);
            starts.push(k as u32);
        }
    }
    starts.push(count as u32);
    (keys, starts)
}

/// Rows around a cell: steps along y and z. Its own comes first, then those that share a face with it.
const ROWS: [[i64; 2]; 9] = [[0, 0], [-1, 0], [1, 0], [0, -1], [0, 1], [-1, -1], [1, -1], [-1, 1], [1, 1]];

/// A walk over cells, with what lies around each.
pub struct Walk<'a> {
    cells: &'a Cells,
    next: usize,
    /// Of each row, the first cell that is not before it and the first that is past it.
    rows: [[usize; 2]; 9],
}

impl Iterator for Walk<'_> {
    type Item = (usize, Around);

    fn next(&mut self) -> Option<Self::Item> {
        let cell = self.next;
        if cell >= self.cells.len() {
            return None;
        }
        self.next += 1;
        let keys = &self.cells.keys;
        let around = std::array::from_fn(|k| {
            let wanted = self.cells.row(cell, ROWS[k]);
            for (at, key) in self.rows[k].iter_mut().zip(wanted) {
                while *at < keys.len() && keys[*at] < key {
                    *at += 1;
                }
            }
            self.rows[k].map(|at| self.cells.starts[at])
        });
        Some((cell, Around(around)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stitch::test_points::scattered;

    #[test]
    fn what_lies_around_each_point_is_all_within_a_side() {
        for points in [scattered(2000, 3, [10.0, 10.0, 10.0]), scattered(2000, 4, [40.0, 30.0, 0.5])] {
            let cells = Cells::new(&points, 1.3).unwrap();
            let mut seen = 0;
            for from in [0, cells.len() / 3] {
                for (cell, around) in cells.walk(from) {
                    for k in cells.points(cell) {
                        let p = cells.positions[k];
                        let mut found: Vec<u32> = around
                            .points()
                            .filter(|j| (cells.positions[*j] - p).norm() <= 1.3)
                            .map(|j| cells.order[j])
                            .collect();
                        found.sort_unstable();
                        let all = (0..points.len() as u32).filter(|j| (points[*j as usize] - p).norm() <= 1.3);
                        assert_eq!(found, all.collect::<Vec<u32>>());
                        seen += usize::from(from == 0);
                    }
                }
            }
            assert_eq!(seen, points.len());
        }
    }

    /// Two million cells along each axis leave no room for the index beside them.
    #[test]
    fn cells_that_do_not_fit_beside_the_index_are_sorted_alike() {
        let mut points = scattered(3000, 5, [9.0, 8.0, 3.0]);
        let near = Cells::new(&points, 0.7).unwrap();
        points.push(points.iter().fold(points[0], |low, p| low.inf(p)));
        points.push(points[3000] + crate::geometry::Vector3::new(1e6, 1e6, 1e6));
        let far = Cells::new(&points, 0.7).unwrap();
        let of_near = |order: &[u32]| order.iter().copied().filter(|k| *k < 3000).collect::<Vec<u32>>();
        assert_eq!(of_near(&far.order), near.order);
        assert_eq!(far.order[3001], 3001);
    }

    #[test]
    fn no_points_and_a_box_too_large_for_its_cells() {
        let none = Cells::new(&[], 1.0).unwrap();
        assert!(none.is_empty() && none.walk(0).next().is_none());
        let far = [Point3::origin(), Point3::new(0.0, 3e6, 0.0)];
        assert_eq!(Cells::new(&far, 1.0).unwrap_err(), TooManyCells { extent: 3e6, cell: 1.0 });
        assert_eq!(Cells::new(&far, 2.0).unwrap().len(), 2);
    }
}
