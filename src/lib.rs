//! Shape inspection of stamped sheet metal against its CAD model.
//!
//! One scan goes through the crate like this:
//!
//! ```text
//! bytes --io--> PointCloud --scan--> ConditionedScan --align--> BestFit, FeatureAlignment --inspect--> InspectionResult --report--> files
//! ```
//!
//! Lengths are millimetres, angles radians, numbers `f64`; where a number crosses an edge (plan key, report column) its unit
//! is part of the name. Frames: `scan` is the frame in which points were measured, `cad` the frame of the CAD file, `belt`
//! the plane on which the part lies (z up, towards the camera). Transforms read `target_from_source`.
//!
//! Modules import downward only: `geometry`, `fit`, then `io` and `plan`, then `part` and `scan`, `measure`, `align`,
//! `inspect`, `report`, `worker`, `study`, `cli`. `diagnostic` and `run` serve every layer, `simulate` makes test truth beside them.

pub mod align;
pub mod cli;
pub mod demo;
pub mod diagnostic;
pub mod fit;
pub mod geometry;
#[cfg(feature = "gui")]
pub mod gui;
pub mod inspect;
pub mod io;
pub mod measure;
pub mod part;
pub mod plan;
pub mod report;
pub mod run;
pub mod scan;
pub mod simulate;
pub mod stitch;
pub mod study;
pub mod worker;
