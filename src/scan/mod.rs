//! Conditioning of a cloud: what is belt, what is dark, what is the part.

pub mod background;
#[cfg(test)]
mod background_tests;
mod belt;
mod belt_judge;
pub mod bodies;
mod colour;
pub mod conditioned;
mod duplicates;
pub mod grid;
pub mod hints;
mod neighbourhood;
mod normals;
mod rules;
mod stray;
#[cfg(test)]
mod synthetic;

pub use background::condition;
pub use bodies::{APART_SPACINGS, Bodies, Body};
pub use conditioned::*;
pub use grid::PointGrid;
pub use hints::ScanHints;
