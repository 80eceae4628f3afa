//! Capability of a plan: what the same inspection tells of many scans whose truth is known, or of many scans of one part.
//!
//! ```text
//! simulated scans (plan, rig, [uncertainty], seed) --+
//!                                                    +--inspect--> errors by point --figures--> bias, s, U, coverage, Cg, Cgk, a word
//! scans of one part (folder, reference values)    --+
//! ```
//!
//! Scans come one after the other and leave only numbers behind, so that memory does not grow with their count but by these. The same
//! request gives the same bytes, whatever the number of threads.

mod figures;
mod reference;
mod request;
mod sequence;
mod series;
mod statistics;
mod table;

pub use figures::{PointFigures, Word};
pub use request::{Source, Study, StudyRequest};
pub use sequence::run_study;
pub use statistics::{LIMIT, cg, cgk, least_tolerance_mm, mean, median, standard_deviation};
pub use table::{csv, text, write};
