//! From a deviation and its uncertainty to a verdict.

use super::result::{PointResult, Verdict};
use crate::plan::Decision;

/// The verdict of one value. `uncertainty_mm` is expanded (k = 2); a limit that is none is infinite.
///
/// ISO 14253-1: in tolerance is proved only inside the limits drawn in by U, out of tolerance only outside the limits
/// moved out by U; between them nothing is proved.
pub fn decide(
    decision: Decision,
    deviation_mm: f64,
    uncertainty_mm: f64,
    lower_mm: f64,
    upper_mm: f64,
) -> (Verdict, Option<String>) {
    let guard = match decision {
        Decision::Iso14253 => uncertainty_mm,
        Decision::Plain => 0.0,
    };
    if !(deviation_mm.is_finite() && uncertainty_mm.is_finite()) {
        return (Verdict::NotMeasured, Some("the fit gave no finite value".into()));
    }
    let past = (deviation_mm - upper_mm).max(lower_mm - deviation_mm);
    if past > guard {
        (Verdict::Fail, None)
    } else if past <= -guard {
        (Verdict::Pass, None)
    } else if past > 0.0 {
        (Verdict::Undecided, Some(format!("{past:.3} mm past the limit, U is {guard:.3} mm")))
    } else {
        (Verdict::Undecided, Some(format!("{:.3} mm inside the limit, U is {guard:.3} mm", -past)))
    }
}

/// The verdict of the part: fail, else incomplete, else undecided, else pass. No point at all proves nothing.
pub fn of_part(points: &[PointResult], degraded: bool) -> Verdict {
    let worst = points.iter().map(|p| p.verdict).max().unwrap_or(Verdict::NotMeasured);
    if degraded { worst.max(Verdict::NotMeasured) } else { worst }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Point3, Vector3};

    #[test]
    fn the_uncertainty_is_taken_off_on_both_sides() {
        // Eighths are exact in binary, so that a value on the limit is on the limit.
        let iso = |d| decide(Decision::Iso14253, d, 0.125, -0.5, 0.75).0;
        assert_eq!(iso(0.625), Verdict::Pass);
        assert_eq!(iso(0.626), Verdict::Undecided);
        assert_eq!(iso(0.875), Verdict::Undecided);
        assert_eq!(iso(0.876), Verdict::Fail);
        assert_eq!(iso(-0.375), Verdict::Pass);
        assert_eq!(iso(-0.376), Verdict::Undecided);
        assert_eq!(iso(-0.626), Verdict::Fail);
        let plain = |d| decide(Decision::Plain, d, 0.125, -0.5, 0.75).0;
        assert_eq!((plain(0.75), plain(0.7501), plain(-0.5001)), (Verdict::Pass, Verdict::Fail, Verdict::Fail));
    }

    /// A distance cannot fall below 0, however uncertain it is.
    #[test]
    fn a_distance_within_its_only_limit_passes() {
        let of = |d| decide(Decision::Iso14253, d, 0.125, f64::NEG_INFINITY, 0.25).0;
        assert_eq!([0.0, 0.125, 0.2, 0.375, 0.376].map(of), {
            use Verdict::{Fail, Pass, Undecided};
            [Pass, Pass, Undecided, Undecided, Fail]
        });
    }

    #[test]
    fn an_uncertainty_wider_than_the_tolerance_never_passes() {
        assert_eq!(decide(Decision::Iso14253, 0.0, 1.0, -0.5, 0.5).0, Verdict::Undecided);
    }

    #[test]
    fn no_number_is_not_measured() {
        assert_eq!(decide(Decision::Plain, f64::NAN, 0.1, -0.5, 0.5).0, Verdict::NotMeasured);
        assert_eq!(decide(Decision::Iso14253, 0.0, f64::INFINITY, -0.5, 0.5).0, Verdict::NotMeasured);
        assert_eq!(decide(Decision::Plain, 0.0, f64::NAN, -0.5, 0.5).0, Verdict::NotMeasured);
    }

    fn point(verdict: Verdict) -> PointResult {
        PointResult {
            name: "P".into(),
            kind: "surface",
            nominal: Point3::origin(),
            direction: Vector3::z(),
            lower_mm: -1.0,
            upper_mm: 1.0,
            verdict,
            reason: None,
            points_used: 0,
            card: Default::default(),
            measurement: None,
        }
    }

    #[test]
    fn the_worst_point_decides_and_nothing_measured_is_never_a_pass() {
        use Verdict::{Fail, NotMeasured, Pass, Undecided};
        let part = |v: &[Verdict]| of_part(&v.iter().map(|&v| point(v)).collect::<Vec<_>>(), false);
        assert_eq!(part(&[Pass, Pass]), Pass);
        assert_eq!(part(&[Pass, Undecided]), Undecided);
        assert_eq!(part(&[Undecided, NotMeasured, Pass]), NotMeasured);
        assert_eq!(part(&[NotMeasured, Fail]), Fail);
        assert_eq!(part(&[]), NotMeasured);
        assert_eq!(of_part(&[point(Pass)], true), NotMeasured);
    }
}
