//! Features measured from the points near their nominal place.
//!
//! Each function takes the nominal shape in the CAD frame and a pose that is good to a few mm, looks only at the points in a
//! window around that place, and answers in the CAD frame *on the CAD's own face*: the nominal place is moved to the face
//! that the camera saw, measured there, and moved back by the same vector. Deviations are positive along the plan's
//! directions whichever side was seen. What is told as measured is where the feature is, the thickness taken out, wherever the plan has
//! it: of a nominal place off the CAD the deviation (measured minus nominal, along the plan's direction) tells it, the
//! measured place does not. The cloud is never transformed; the window's points are, one by one.
//!
//! What is told as standard uncertainty (k = 1) comes from the scatter of the points alone; the plan's contributions
//! (`[uncertainty]`) and that of the alignment are added by whoever knows them.

mod bend;
pub mod card;
mod chance;
pub mod edge;
mod edge_place;
pub mod frame;
mod gap;
pub mod hole;
mod layer;
mod opening;
mod patch;
mod place;
mod reading;
mod rim;
mod rim_steps;
mod sight;
pub mod slot;
pub mod surface;
mod thin;
mod windows;

pub use card::{Card, Gate, Rule, WindowShare};
pub use edge::{EdgeFound, edge, edge_length_mm, edge_with_card};
pub use hole::{HoleFound, hole, hole_with_card};
pub use reading::Reading;
pub use slot::{SlotFound, slot};
pub use surface::{SurfaceFound, surface, surface_with_card};

use crate::geometry::CadFromScan;
use crate::part::{Face, Part};
use crate::plan::UncertaintySettings;
use crate::scan::{ConditionedScan, PointGrid};

/// Everything that a measurement looks at.
#[derive(Clone, Copy)]
pub struct Local<'a> {
    /// The part.
    pub part: &'a Part,
    /// The face that the camera saw.
    pub face: &'a Face,
    /// The scan.
    pub scan: &'a ConditionedScan,
    /// Its kept points, sorted.
    pub grid: &'a PointGrid,
    /// The pose, good to a few mm at the place measured.
    pub cad_from_scan: CadFromScan,
    /// The plan's calibrated offsets.
    pub uncertainty: &'a UncertaintySettings,
}

/// There is no value, and why, in the user's words.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{reason}")]
pub struct NotFound {
    /// Lower case start, no full stop.
    pub reason: String,
    /// Points found in the window.
    pub points: usize,
}

impl NotFound {
    fn new(reason: impl Into<String>, points: usize) -> Self {
        Self { reason: reason.into(), points }
    }

    fn too_few(found: usize, needed: usize) -> Self {
        let stand = if found == 1 { "point stands" } else { "points stand" };
        Self::new(format!("{found} {stand} within the window, {needed} are needed"), found)
    }
}

/// Least share of a rim or an edge beside which points must stand.
const LEAST_COVERED: f64 = 0.6;

/// The blur below which an edge's sharpness cannot be told leaves this uncertainty of the outline, in spacings.
const SHARPNESS_U: f64 = 0.05;
