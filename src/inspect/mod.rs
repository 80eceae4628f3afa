//! Comparison points, deviation map and verdicts: from an aligned scan to an `InspectionResult`.

pub mod result;

pub use result::*;
