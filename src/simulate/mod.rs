//! Synthetic truth: parts whose shape is known, a measuring rig, and scans with the exact answer beside them.
//!
//! Used by the demo, by tests and by `shapeline simulate`. It samples meshes and casts rays; it shares no formula with
//! `fit`, so that no estimator can be tuned to it.

mod actual;
pub mod blank;
pub mod bracket;
pub mod caster;
mod datum;
pub mod demo;
pub mod displacement;
mod drawn;
pub mod endoscope;
pub mod field;
pub mod files;
pub mod forming;
pub mod part;
mod placing;
pub mod rig;
mod rim;
pub mod scan;
pub mod settle;
pub mod shapes;
mod standing;
pub mod subject;
pub mod truth;

pub use bracket::{BracketParameters, bracket};
pub use displacement::{Displacement, DisplacementField, draw_springback};
pub use drawn::Drawn;
pub use files::{Series, simulate_series, write_scan};
pub use part::SyntheticPart;
pub use placing::PoseChoice;
pub use rig::{RigModel, Sampling};
pub use scan::{Label, SimulatedScan, simulate_scan, simulate_scene};
pub use shapes::{cover, hemmed, rail, symmetric_plate};
pub use standing::{InView, Neighbour};
pub use subject::Subject;
pub use truth::{Deviation, FeatureTruth, PointTruth, ScanTruth};
