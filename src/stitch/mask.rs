//! Masks: points of which some metric is out of bounds are left out.

use super::metric::Metric;
pub use crate::plan::merge::Mask;

/// Which points all masks keep, and how many each mask leaves out by itself. `column` gives the values of a metric, one for each of
/// `count` points.
pub fn kept<'a>(count: usize, masks: &[Mask], column: impl Fn(Metric) -> &'a [f32]) -> (Vec<bool>, Vec<usize>) {
    let mut keep = vec![true; count];
    let left_out = masks.iter().map(|mask| {
        let outside = column(mask.metric).iter().map(|value| !mask.keeps(*value));
        outside
            .zip(&mut keep)
            .map(|(outside, keep)| {
                *keep &= !outside;
                usize::from(outside)
            })
            .sum()
    });
    let left_out = left_out.collect();
    (keep, left_out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_kept_and_what_is_no_number_is_not() {
        let masks = [
            Mask { metric: Metric::PhaseShiftVariation, min: 0.5, max: f64::INFINITY },
            Mask { metric: Metric::CalibrationDistance, min: f64::NEG_INFINITY, max: 150.0 },
        ];
        let (sigma, d) = ([0.5, 0.25, 1.0, f32::NAN, 1.0], [150.0, 10.0, 151.0, 10.0, f32::NAN]);
        let column = |metric| if metric == Metric::PhaseShiftVariation { &sigma[..] } else { &d[..] };
        let (keep, left_out) = kept(5, &masks, column);
        assert_eq!((keep, left_out), (vec![true, false, false, false, false], vec![2, 2]));
        assert_eq!(kept(2, &[], column).0, [true, true]);
    }

    /// A bound that a column can hold only rounded keeps the points that have just that value; without bounds what is infinite is none.
    #[test]
    fn bounds_are_those_that_a_column_can_hold() {
        let mask = |min, max| Mask { metric: Metric::CalibrationDistance, min, max };
        for value in [0.1_f64, 0.3, 1.0 / 3.0, -0.7, 1e-20, 16_777_217.0] {
            assert!(mask(value, value).keeps(value as f32), "{value}");
        }
        let next = |value: f32, step: i32| f32::from_bits(value.to_bits().wrapping_add_signed(step));
        assert!(!mask(f64::NEG_INFINITY, 0.1).keeps(next(0.1, 1)) && !mask(0.1, f64::INFINITY).keeps(next(0.1, -1)));
        let open = mask(f64::NEG_INFINITY, f64::INFINITY);
        assert!(open.keeps(f32::MAX) && !open.keeps(f32::INFINITY) && !open.keeps(f32::NEG_INFINITY));
        assert!(mask(0.0, 1e300).keeps(f32::MAX));
    }
}
