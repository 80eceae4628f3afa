//! Estimators: robust statistics, least-squares shapes, and the soft-edge likelihood of holes, slots and trimmed edges.
//!
//! Plain functions over points; nothing here knows of parts, scans or plans.

pub mod robust;
pub mod soft_edge;
