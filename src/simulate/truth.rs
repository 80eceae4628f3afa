//! The exact answers that belong to a scan.

use super::subject::Subject;
use crate::geometry::CadFromScan;
use crate::plan::Side;
use serde::{Deserialize, Serialize};

/// What a measurement of the scan should find.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ScanTruth {
    /// Scan to CAD, row-major, mm: the pose in which the scan was made.
    pub cad_from_scan: [f64; 16],
    /// `top` or `bottom`: the side of the sheet that the cameras stand on.
    pub side: String,
    /// The seed of the scan.
    pub seed: u64,
}

impl ScanTruth {
    /// The truth of a subject seen in a pose.
    pub fn new(_subject: &Subject, cad_from_scan: CadFromScan, side: Side, seed: u64) -> Self {
        Self { cad_from_scan: cad_from_scan.row_major(), side: side.key().into(), seed }
    }
}
