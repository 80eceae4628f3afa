//! The inspection plan: as written, checked, all problems told together.

pub mod model;

pub use model::*;
