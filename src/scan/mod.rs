//! Conditioning of a cloud: what is belt, what is dark, what is the part.

pub mod conditioned;
pub mod grid;

pub use conditioned::*;
pub use grid::PointGrid;
