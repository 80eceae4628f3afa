//! What is kept of a scan.

use shapeline::plan::Side;

/// One scan.
pub struct ScanRecord {
    pub side: Side,
    pub is_perfect: bool,
    /// Why it was refused.
    pub refused: Option<String>,
    /// Largest error of the best fit over the corners of the part's box, mm; of a bent part it has no exact answer.
    pub best_fit_corner_mm: Option<f64>,
    /// Largest error of the plan's alignment over the corners of the part's box, mm.
    pub corner_mm: Option<f64>,
    /// The plan's comparison points, in its order.
    pub points: Vec<PointRecord>,
}

/// One comparison point in one scan. Errors are measured minus true, mm.
pub struct PointRecord {
    pub name: String,
    pub kind: &'static str,
    /// Nominal diameter of a hole.
    pub diameter_mm: Option<f64>,
    /// Angle between line of sight and the sheet's normal.
    pub seen_deg: f64,
    /// The true deviation after the alignment.
    pub truth_mm: f64,
    /// Error of the reported deviation and its U (k = 2), after the alignment.
    pub aligned: Option<(f64, f64)>,
    /// Why there is none.
    pub reason: Option<String>,
    /// Error of a hole's centre along two axes in the sheet, after the alignment.
    pub centre: Option<[f64; 2]>,
    /// Error of a hole's diameter.
    pub diameter_error_mm: Option<f64>,
    /// Errors in the true pose: one, or two of a hole; none where it was not measured.
    pub in_true_pose: Vec<f64>,
    /// Errors of the simple estimator in the true pose: one, or centre and diameter of a hole.
    pub simple: Vec<f64>,
}
