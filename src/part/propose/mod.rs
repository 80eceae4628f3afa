//! Proposals for a plan by picking on the prepared CAD: a surface point, a place on a trimmed edge, a hole, a slot.
//!
//! A click is a ray. Everything proposed lies on the CAD's own surface, whatever the sheet's thickness, and its normals are those of
//! the CAD. Where nothing fits, words say why. The window may move or retype what is proposed; nothing here is a measurement.

mod again;
mod edge;
mod opening;
mod picker;
mod stadium;
mod surface;
#[cfg(test)]
mod tests;

pub use picker::{Hit, Picker, Ray};

use crate::geometry::Point3;
use crate::plan::Geometry;

/// What a click means.
#[derive(Debug, Clone, PartialEq)]
pub struct Proposal {
    /// The shape, CAD frame, places and sizes rounded to 0.0001 mm.
    pub geometry: Geometry,
    /// What somebody should know of it.
    pub note: Option<String>,
    /// How far the CAD's outline is from the shape at most, mm; 0 of points.
    pub off_mm: f64,
}

impl Proposal {
    fn new(geometry: Geometry) -> Self {
        Self { geometry: rounded(geometry), note: None, off_mm: 0.0 }
    }
}

/// Why a click means nothing.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NoProposal {
    /// The ray passes the part.
    #[error("the click does not meet the part")]
    PastThePart,
    /// The CAD has no boundary.
    #[error("this CAD has no trimmed edge: its surface is closed")]
    NoEdge,
    /// None is near enough.
    #[error("the nearest trimmed edge is {nearest_mm:.1} mm from the click")]
    EdgeTooFar {
        /// How far.
        nearest_mm: f64,
    },
    /// The edge turns at the click.
    #[error("the edge turns by {degrees:.0} degrees there: a corner has no direction outwards")]
    Corner {
        /// By how much.
        degrees: f64,
    },
    /// The CAD has no opening.
    #[error("this CAD has no hole or slot cut out")]
    NoOpening,
    /// None is near enough.
    #[error("the rim of the nearest opening is {nearest_mm:.1} mm from the click")]
    OpeningTooFar {
        /// How far.
        nearest_mm: f64,
    },
    /// The opening has another shape.
    #[error(
        "the opening of {length_mm:.2} x {width_mm:.2} mm is not round: its rim is up to {off_mm:.2} mm off a circle"
    )]
    NotRound {
        /// Its largest extent.
        length_mm: f64,
        /// The extent across.
        width_mm: f64,
        /// How far.
        off_mm: f64,
    },
    /// The opening has another shape.
    #[error(
        "the opening of {length_mm:.2} x {width_mm:.2} mm is no slot with round ends: its rim is up to {off_mm:.2} mm off one"
    )]
    NoSlot {
        /// Its largest extent.
        length_mm: f64,
        /// The extent across.
        width_mm: f64,
        /// How far.
        off_mm: f64,
    },
    /// A slot as long as wide.
    #[error("the opening of {length_mm:.2} x {width_mm:.2} mm is round, not a slot")]
    Round {
        /// Its largest extent.
        length_mm: f64,
        /// The extent across.
        width_mm: f64,
    },
    /// The rim does not fix a shape.
    #[error("nothing could be fitted to the rim: {0}")]
    Unfitted(#[from] crate::fit::FitError),
}

impl NoProposal {
    /// What to do.
    pub fn help(&self) -> &'static str {
        match self {
            NoProposal::PastThePart => "click on the part",
            NoProposal::NoEdge => "use a CAD of one face of the sheet, or cad_side = \"solid\"",
            NoProposal::EdgeTooFar { .. } => "click nearer to the edge, or come closer",
            NoProposal::Corner { .. } => "choose a place along one of the two edges",
            NoProposal::NoOpening => "check whether the CAD has its holes cut out, and is one face of the sheet",
            NoProposal::OpeningTooFar { .. } => "click nearer to the rim, or into the opening",
            NoProposal::NotRound { .. } => "compare edge points on its rim, or take it as a slot",
            NoProposal::NoSlot { .. } => "compare edge points on its rim",
            NoProposal::Round { .. } => "take it as a hole",
            NoProposal::Unfitted(_) => "choose another opening, or type its values",
        }
    }
}

/// Places and sizes to 0.0001 mm: what a drawing and a reader can tell apart.
fn rounded(geometry: Geometry) -> Geometry {
    let round = |v: f64| (v * 1e4).round() / 1e4 + 0.0;
    let place = |p: Point3| p.map(round);
    match geometry {
        Geometry::Hole { centre, axis, diameter_mm, direction } => {
            Geometry::Hole { centre: place(centre), axis, diameter_mm: round(diameter_mm), direction }
        }
        Geometry::Slot { centre, axis, direction, length_mm, width_mm } => {
            let (length_mm, width_mm) = (round(length_mm), round(width_mm));
            Geometry::Slot { centre: place(centre), axis, direction, length_mm, width_mm }
        }
        Geometry::Surface { position, direction } => Geometry::Surface { position: place(position), direction },
        Geometry::Edge { position, direction, normal } => {
            Geometry::Edge { position: place(position), direction, normal }
        }
    }
}
