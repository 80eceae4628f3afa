//! Guard against coordinates that are stored too coarsely to be measured.
//!
//! float32 has 24 binary digits: between 131 and 262 m from the origin its steps are 0.016 mm, at a kilometre 0.06 mm. Rounding to them is no
//! noise that a mean takes out: all points of a face that lies across an axis are rounded the same way, by half a step at most.

use super::columns::Lengths;
use crate::diagnostic::Diagnostic;
use crate::geometry::Point3;

/// Coarsest step between stored coordinates, mm. Half of it is a tenth of the smallest noise that a scan is expected to have (0.05 mm in
/// the plane, 0.12 mm in depth).
const COARSEST_STEP_MM: f64 = 0.01;

/// Refuses points whose coordinates, each stored as float32 in the file's unit or not, have coarser steps than can be measured with. The
/// median tells, so that a stray far away does not spoil a scan.
///
/// # Errors
/// Steps above 0.01 mm at the median of a coordinate's magnitudes.
pub fn check(points: &[Point3], is_float32: [bool; 3], lengths: Lengths) -> Result<(), Diagnostic> {
    let Lengths { kept_per_unit, mm_per_kept } = lengths;
    let step_mm = |kept: f64| float32_step(kept / kept_per_unit) * kept_per_unit * mm_per_kept;
    for axis in (0..3).filter(|axis| is_float32[*axis]) {
        let largest = points.iter().map(|p| p[axis].abs()).fold(0.0, f64::max);
        if step_mm(largest) <= COARSEST_STEP_MM {
            continue;
        }
        let mut magnitudes: Vec<f64> = points.iter().map(|p| p[axis].abs()).collect();
        let (_, median, _) = magnitudes.select_nth_unstable_by(points.len() / 2, f64::total_cmp);
        let (median_mm, step_mm) = (*median * mm_per_kept, step_mm(*median));
        if step_mm > COARSEST_STEP_MM {
            let name = ["x", "y", "z"][axis];
            return Err(Diagnostic::error(format!(
                "{name} is about {median_mm:.0} mm from the origin and stored as float32, in steps of {step_mm:.3} mm there; expected \
                 {COARSEST_STEP_MM} mm at most"
            ))
            .with_help(
                "store the coordinates as double, or move them nearer the origin before they are stored (float32 will do within 100 m)",
            ));
        }
    }
    Ok(())
}

/// Distance between a float32 and its next larger neighbour, of a value that is finite in that type.
fn float32_step(value: f64) -> f64 {
    let stored = (value as f32).abs();
    f64::from(stored.next_up()) - f64::from(stored)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(points: &[Point3], is_float32: [bool; 3], mm_per_unit: f64) -> Result<(), Diagnostic> {
        super::check(points, is_float32, Lengths::in_mm(mm_per_unit))
    }

    #[test]
    fn steps_are_those_of_float32() {
        // 24 binary digits: 2^-23 from 1 on, 2^17 * 2^-23 from 2^17 on.
        assert_eq!(float32_step(1.0), 2.0_f64.powi(-23));
        assert_eq!(float32_step(-131_072.0), 0.015_625);
        assert_eq!(float32_step(131_071.0), 0.007_812_5);
        assert_eq!(float32_step(4e6), 0.25);
    }

    #[test]
    fn coarse_steps_are_refused_in_any_unit_and_doubles_never() {
        let at = |x: f64| [Point3::new(0.0, x, 0.0), Point3::new(0.0, x, 9.0), Point3::origin()];
        assert!(check(&at(-131_000.0), [true; 3], 1.0).is_ok());
        let told = check(&at(-132_000.0), [true; 3], 1.0).unwrap_err();
        assert!(
            told.message
                .starts_with("y is about 132000 mm from the origin and stored as float32, in steps of 0.016 mm"),
            "{told}"
        );
        assert!(told.help.unwrap().contains("as double"));
        // 132 m, stored in metres: 2^7 * 2^-23 m are 0.0153 mm.
        assert!(check(&at(132_000.0), [true; 3], 1000.0).unwrap_err().message.contains("0.015 mm"));
        assert!(check(&at(900_000.0), [true, false, true], 1.0).is_ok());
        assert!(check(&[], [true; 3], 1.0).is_ok());
        // One stray among three.
        assert!(check(&[Point3::new(9e5, 0.0, 0.0), Point3::origin(), Point3::origin()], [true; 3], 1.0).is_ok());
    }
}
