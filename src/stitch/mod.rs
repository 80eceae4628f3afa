//! Many overlapping measurements made one cloud: quality metrics, masks, adaptive merging (after the endoscope paper).
//!
//! ```text
//! points of a file --intake--> Measured --condition: columns, masks, noise, density--> Conditioned
//!   with its pose --place: registration--> PlacedViews --merging--> Merged: points, metrics, the view of each
//! ```
//!
//! Every step is a pure function: the same views and settings give the same bytes, in whatever order and with any number of threads. Lengths
//! are in the unit of the views throughout, which `MERGE.toml` names.

pub mod adaptive;
mod bands;
pub mod calibration;
mod calibration_file;
pub mod cells;
pub mod columns;
pub mod condition;
mod fault;
pub mod feature;
pub mod intake;
mod judged;
pub mod mask;
pub mod mask_study;
pub mod mask_worth;
pub mod merging;
pub mod metric;
pub mod noise;
pub mod non_uniformity;
pub mod odd_radius;
pub mod organised;
pub mod place;
mod pose_file;
pub mod register;
pub mod result;
mod shelf;
pub mod spacing;
#[cfg(test)]
mod test_points;
pub mod units;
pub mod view;
pub mod voxel;
pub mod wear;

pub use adaptive::{MergeError, Points, Rank, survivors, survivors_of};
pub use bands::Room;
pub use calibration_file::calibration;
pub use columns::{Tools, wanted};
pub use condition::{Conditioned, PointCounts, condition};
pub use fault::StitchError;
pub use intake::{Measured, measured};
pub use mask::Mask;
pub use merging::{Merged, merge, merge_from};
pub use metric::{Better, Metric};
pub use place::{NoStart, Outcome, PlacedViews, Ready, place, place_from};
pub use pose_file::poses;
pub use result::{FileIdentity, MergeIdentity, MergeResult, ViewEnd, ViewFile};
pub use shelf::{Shelf, ViewFacts};
pub use view::View;
