//! Estimators: robust statistics, least-squares shapes, and the soft-edge likelihood of holes, slots and trimmed edges.
//!
//! Plain functions over points; nothing here knows of parts, scans or plans.

pub mod boundary;
mod determined;
pub mod gauss_newton;
pub mod hold;
pub mod outcome;
pub mod robust;
mod robust_start;
pub mod shapes;
pub mod soft_edge;
pub mod two_step;
mod uncertainty;

pub use outcome::{CoordinatePlane, FitKind, FitMethod, FitOutcome, Fitted, Known, fit_points, fit_points_knowing};
pub use shapes::FitError;
pub use uncertainty::ShapeUncertainty;
