//! Estimators: robust statistics, least-squares shapes, and the soft-edge likelihood of holes, slots and trimmed edges.
//!
//! Plain functions over points; nothing here knows of parts, scans or plans.

pub mod boundary;
mod determined;
pub mod gauss_newton;
pub mod hold;
pub mod outcome;
pub mod robust;
pub mod shapes;
pub mod soft_edge;

pub use outcome::{CoordinatePlane, FitKind, FitMethod, FitOutcome, Fitted, fit_points};
pub use shapes::FitError;
