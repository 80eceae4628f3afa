//! Whether any of some points lies within the radius of a place.

use super::binning::{Binned, Corner, Frame};
use super::points::{Numbered, Points};
use super::space::{Neighbours, Space};
use super::tile::{Scratch, Tile};
use crate::geometry::Point3;
use crate::run::{Cancelled, RunContext};
use crate::stitch::cells::TooManyCells;
use rayon::prelude::*;
use std::ops::ControlFlow;

/// Space between two corners in cells as wide as the radius.
pub(in crate::stitch) struct Field {
    frame: Frame,
    radius_squared: f64,
}

impl Field {
    /// # Errors
    /// The corners are more than two million radii apart.
    pub fn new(low: Point3, high: Point3, radius: f64) -> Result<Self, TooManyCells> {
        Ok(Self { frame: Frame::of_box(low, high, radius)?, radius_squared: radius * radius })
    }
}

/// Points in a field.
pub(in crate::stitch) struct Reach<'a> {
    field: &'a Field,
    positions: &'a [Point3],
    space: Space,
}

/// The tile that was asked for last.
#[derive(Default)]
pub(in crate::stitch) struct Last(Option<(Corner, Neighbours)>);

impl<'a> Reach<'a> {
    pub fn new(field: &'a Field, positions: &'a [Point3], run: &RunContext) -> Result<Self, Cancelled> {
        let listed = Unjudged(positions);
        let all = Numbered::new(&listed);
        let binned = Binned::new(&all, &field.frame, run)?;
        let tile = |scratch: &mut Scratch, runs| Tile::new(&all, &field.frame, &binned, runs, scratch);
        let tiles = binned.tiles().into_par_iter().map_init(Scratch::default, tile).collect();
        Ok(Self { field, positions, space: Space::new(tiles, &field.frame) })
    }

    /// Whether any point lies within the radius of a place between the corners of the field.
    pub fn any(&self, place: &Point3, last: &mut Last) -> bool {
        let frame = &self.field.frame;
        let cells = frame.cells(place);
        let corner = frame.tile(cells);
        if last.0.is_none_or(|(known, _)| known != corner) {
            last.0 = Some((corner, self.space.neighbours(corner)));
        }
        let Some((_, neighbours)) = &last.0 else { return false };
        let at = frame.in_tile(cells, corner).map(|c| c as f32);
        let found = self.space.around(neighbours, at, |tile, k, is_sure| {
            let within = || {
                let other = self.positions[self.space.tiles[tile as usize].numbers[k] as usize];
                (other - place).norm_squared() <= self.field.radius_squared
            };
            if is_sure || within() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        found.is_break()
    }
}

/// Points of which only places are known.
struct Unjudged<'a>(&'a [Point3]);

impl Points for Unjudged<'_> {
    fn parts(&self) -> usize {
        1
    }

    fn count(&self, _: usize) -> usize {
        self.0.len()
    }

    fn position(&self, _: usize, index: usize) -> Point3 {
        self.0[index]
    }

    fn score(&self, _: usize, _: usize) -> f64 {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stitch::test_points::scattered;

    #[test]
    fn what_is_in_reach_is_told_and_nothing_else() {
        let (points, places) = (scattered(3000, 3, [90.0, 40.0, 9.0]), scattered(2000, 4, [90.0, 40.0, 9.0]));
        let all = || points.iter().chain(&places);
        let low = all().fold(points[0], |low, p| low.inf(p));
        let high = all().fold(points[0], |high, p| high.sup(p));
        for radius in [0.3, 1.0, 5.0] {
            let field = Field::new(low, high, radius).unwrap();
            let reach = Reach::new(&field, &points, &RunContext::silent()).unwrap();
            let mut last = Last::default();
            for place in &places {
                let expected = points.iter().any(|p| (p - place).norm() <= radius);
                assert_eq!(reach.any(place, &mut last), expected, "{place} {radius}");
            }
        }
    }
}
