//! Conditioning of a cloud: what is belt, what is dark, what is the part.

pub mod conditioned;

pub use conditioned::*;
