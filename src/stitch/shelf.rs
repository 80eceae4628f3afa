//! Views whose points need not all be in memory at once.

use super::spacing::grid_distance;
use super::units::size;
use super::{StitchError, View};
use crate::diagnostic::Diagnostic;
use crate::geometry::{Aabb, Point3};
use crate::run::RunContext;
use std::borrow::Cow;

/// Views one at a time, as conditioning left them. They are asked for several times and must be the same each time.
pub trait Shelf: Sync {
    /// The view of that place among those that are ready, with its points.
    ///
    /// # Errors
    /// It cannot be fetched, in words.
    fn view(&self, k: usize) -> Result<Cow<'_, View>, StitchError>;
}

/// Views in memory.
pub(super) struct InMemory<'a>(pub &'a [View]);

impl Shelf for InMemory<'_> {
    fn view(&self, k: usize) -> Result<Cow<'_, View>, StitchError> {
        Ok(Cow::Borrowed(&self.0[k]))
    }
}

/// What must be known of a view's points once they are put away. Lengths in the unit of the view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewFacts {
    /// Its diagonal.
    pub size: f64,
    /// The middle of the box around it, view frame.
    pub middle: Option<Point3>,
    /// The distance d_grid of its points; none where they are too few.
    pub d_grid: Option<f64>,
}

impl ViewFacts {
    /// Of a view in memory.
    ///
    /// # Errors
    /// Its points reach too far, or the job was stopped.
    pub fn new(view: &View, run: &RunContext) -> Result<Self, StitchError> {
        run.check()?;
        let d_grid = grid_distance(&view.positions).map_err(|e| {
            let help = "points far outside reach over too much: mask them, or ask for [noise]";
            Diagnostic::error(format!("{}: {e}", view.name)).with_help(help)
        })?;
        let middle = Aabb::of_points(&view.positions).map(|bounds| bounds.centre());
        Ok(Self { size: size(&view.positions), middle, d_grid })
    }
}
