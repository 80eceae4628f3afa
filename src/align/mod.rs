//! Where the part lies: global pose, robust best fit, datum alignment.

pub mod pose;

pub use pose::*;
