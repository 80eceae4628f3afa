//! Comparison points, deviation map and verdicts: from an aligned scan to an `InspectionResult`.

mod budget;
pub mod comparison;
pub mod crowd;
mod expected;
mod expected_warnings;
mod foretold;
pub mod map;
pub mod pipeline;
pub mod plan_check;
mod region_check;
pub mod result;
pub mod verdict;

pub use budget::Budget;
pub use expected::{ExpectedU, Outlook};
pub use expected_warnings::{axis_reading_warning, expected_warnings, region_warnings};
pub use foretold::{Foretold, ForetoldPoint, Scheme, SchemeCost, foretell};
pub use pipeline::{Inspected, inspect, refused};
pub use plan_check::{check_against_part, check_draft};
pub use result::*;
