//! Comparison points, deviation map and verdicts: from an aligned scan to an `InspectionResult`.

pub mod plan_check;
pub mod result;
mod rims;

pub use plan_check::check_against_part;
pub use result::*;
