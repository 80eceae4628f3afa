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
}
