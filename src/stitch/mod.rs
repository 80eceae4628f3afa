//! Many overlapping measurements made one cloud: quality metrics, masks, adaptive merging (after the endoscope paper).
//!
//! Lengths are in the unit of the views throughout, which `MERGE.toml` names.

pub mod adaptive;
pub mod calibration;
pub mod cells;
pub mod feature;
pub mod mask;
pub mod mask_study;
pub mod metric;
pub mod non_uniformity;
pub mod register;
pub mod spacing;
#[cfg(test)]
mod test_points;
pub mod view;
pub mod voxel;

pub use adaptive::{MergeError, Rank, survivors};
pub use mask::Mask;
pub use metric::{Better, Metric};
pub use view::View;
