//! Guard against a cloud and a CAD in different units.
//!
//! The ratio cloud size / CAD size of the *kept* points (background removed) is near 1 when the units agree: a view may
//! see half of the part, or keep something beside it. A wrong unit puts it a factor 10, 25.4, 100 or 1000 away, which
//! [`check_scale`] looks for. The raw cloud shows the belt as well, and a view of 600 mm by 400 mm over a part of 60 mm
//! has the innocent ratio 12; so [`check_raw_scale`], which runs before the background is known, speaks only about
//! clouds much smaller than the CAD, where the belt cannot be the reason, and about factors of 100 and more.

use crate::geometry::Point3;

/// A cloud whose size does not fit the CAD's by a factor that units explain.
#[derive(Debug, Clone, PartialEq)]
pub struct ScaleSuspicion {
    /// Cloud size / CAD size as units would explain it: 10, 25.4, 100 or 1000, or one over them. For sizes that are none, their
    /// ratio as it is.
    pub factor: f64,
    /// What was found and what was expected.
    pub words: String,
    /// What to do.
    pub help: String,
}

/// Ratios between units of files: cm, inch, dm or m/cm, m against mm (or mm against um).
const FACTORS: [f64; 4] = [10.0, 25.4, 100.0, 1000.0];
/// A cloud may be larger than its part by this: strays, sheet thickness, springback.
const MOST_LARGER: f64 = 1.25;
/// A cloud too large by a factor still shows most of the part.
const MOST_SMALLER_ABOVE: f64 = 0.8;
/// A cloud too small by a factor may be a partial view as well; factors 10 and 25.4 then still do not touch.
const MOST_SMALLER_BELOW: f64 = 0.55;
/// From here on a raw cloud cannot be a part on a belt.
const LEAST_RAW_FACTOR: f64 = 100.0;
/// The middle half of an evenly covered area is half as large as all of it, of a part that fills a corner of it less; far-off points
/// beside a cloud in the right unit leave it at less than a hundredth.
const LEAST_BULK: f64 = 0.1;
/// A raw cloud smaller than this share of the CAD shows a small piece of the part at most, which could not be aligned either.
const LEAST_RAW_SHARE: f64 = 0.3;
/// Points that are looked at for the size of a cloud.
const POINTS_LOOKED_AT: usize = 200_000;

/// Compares the kept points of a scan with the CAD. Both lengths are diagonals of boxes, mm; the cloud's should be
/// robust against strays ([`robust_diagonal_mm`]). `None` when the sizes are plausible, or when the cloud has no size.
pub fn check_scale(cloud_diagonal_mm: f64, cad_diagonal_mm: f64) -> Option<ScaleSuspicion> {
    suspicion(cloud_diagonal_mm, cad_diagonal_mm, FACTORS[0])
}

/// The same for the cloud as read, with belt and surroundings: sees less, and never blames a part for its belt.
///
/// Some points far outside are no unit either: strays, or the -9999 that a program wrote where it saw nothing. The size is that of the
/// middle 98 %, and where that is too large, the middle half must be far too large too. `None` without points.
pub fn check_raw_scale(points: &[Point3], cad_diagonal_mm: f64) -> Option<ScaleSuspicion> {
    let inner = |left_out: f64| inner_diagonal_mm(points, 0..points.len(), left_out);
    let cloud_mm = inner(0.01)?;
    let Some(found) = suspicion(cloud_mm, cad_diagonal_mm, LEAST_RAW_FACTOR) else {
        return (cloud_mm < LEAST_RAW_SHARE * cad_diagonal_mm).then(|| too_small_with_belt(cloud_mm, cad_diagonal_mm));
    };
    let is_by_strays = || inner(0.25).is_some_and(|mm| mm <= LEAST_BULK * found.factor * cad_diagonal_mm);
    (found.factor < 1.0 || !is_by_strays()).then_some(found)
}

/// A cloud that is far too small though it may show a belt around the part: by which factor nobody knows then.
fn too_small_with_belt(cloud_mm: f64, cad_mm: f64) -> ScaleSuspicion {
    let words = format!(
        "the scan, with all that it shows beside the part, measures {cloud_mm:.4} mm across and the CAD {cad_mm:.4} mm, expected at \
         least the part's size"
    );
    let help = "check [scans] unit and [cad] unit in the plan: cm, inch or m may have been taken for mm; or scan the whole part";
    ScaleSuspicion { factor: cloud_mm / cad_mm, words, help: help.into() }
}

fn suspicion(cloud_mm: f64, cad_mm: f64, least_factor_above: f64) -> Option<ScaleSuspicion> {
    let ratio = cloud_mm / cad_mm;
    let are_sizes = cloud_mm >= 0.0 && cloud_mm.is_finite() && cad_mm > 0.0 && cad_mm.is_finite();
    if !(are_sizes && ratio.is_finite()) {
        return Some(ScaleSuspicion {
            factor: ratio,
            words: format!(
                "the scan measures {cloud_mm} mm across and the CAD {cad_mm} mm, expected two finite sizes above 0"
            ),
            help: "check that scan and CAD are whole, and [scans] unit and [cad] unit in the plan".into(),
        });
    }
    let below = FACTORS.iter().map(|f| (1.0 / f, MOST_SMALLER_BELOW));
    let above = FACTORS.iter().filter(|f| **f >= least_factor_above).map(|f| (*f, MOST_SMALLER_ABOVE));
    let (factor, _) = below.chain(above).find(|(f, least)| (least * f..=MOST_LARGER * f).contains(&ratio))?;
    let (times, larger) = if factor < 1.0 { (1.0 / factor, "smaller") } else { (factor, "larger") };
    Some(ScaleSuspicion {
        factor,
        words: format!(
            "the scan measures {cloud_mm:.4} mm across and the CAD {cad_mm:.4} mm: about {times} times {larger}, expected \
             about the same size"
        ),
        help: format!(
            "check [scans] unit and [cad] unit in the plan: the two differ by a factor of {times}, as {} do",
            match times {
                10.0 => "cm and mm",
                25.4 => "inch and mm",
                100.0 => "m and cm",
                _ => "m and mm, or mm and um",
            }
        ),
    })
}

/// The diagonal, in mm, of the box that holds the middle 98 % of some points on each axis; strays do not move it. On an
/// evenly covered part it comes out about 2 % short. `None` when there are no points.
pub fn robust_diagonal_mm(points: &[Point3], kept: &[u32]) -> Option<f64> {
    inner_diagonal_mm(points, kept.iter().map(|&index| index as usize), 0.01)
}

/// The diagonal of the box that leaves out a share of some points at both ends of each axis, from some of them at a fixed stride.
fn inner_diagonal_mm(
    points: &[Point3],
    indices: impl ExactSizeIterator<Item = usize> + Clone,
    left_out: f64,
) -> Option<f64> {
    let step = indices.len().div_ceil(POINTS_LOOKED_AT).max(1);
    let mut square = 0.0;
    for axis in 0..3 {
        let at = |index: usize| points.get(index).map(|point| point[axis]);
        let mut values: Vec<f64> = indices.clone().step_by(step).filter_map(at).collect();
        let last = values.len().checked_sub(1)?;
        let cut = (last as f64 * left_out) as usize;
        let (_, low, _) = values.select_nth_unstable_by(cut, f64::total_cmp);
        let low = *low;
        let (_, high, _) = values.select_nth_unstable_by(last - cut, f64::total_cmp);
        square += (*high - low).powi(2);
    }
    Some(f64::sqrt(square))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_factor_is_found_both_ways() {
        for factor in FACTORS {
            for off in [0.85, 1.0, 1.15] {
                assert_eq!(check_scale(300.0 * factor * off, 300.0).unwrap().factor, factor);
                assert_eq!(check_scale(300.0 / factor * off, 300.0).unwrap().factor, 1.0 / factor);
            }
        }
    }

    #[test]
    fn partial_views_and_strays_are_innocent() {
        for ratio in [0.2, 0.5, 1.0, 2.0, 4.0, 7.0] {
            assert_eq!(check_scale(300.0 * ratio, 300.0), None, "{ratio}");
        }
        // All points in one place: that is refused with its own words elsewhere.
        assert_eq!(check_scale(0.0, 300.0), None);
    }

    #[test]
    fn sizes_that_are_none_are_not_plausible() {
        for odd in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1.0] {
            for (cloud, cad) in [(odd, 300.0), (300.0, odd), (odd, odd)] {
                assert!(check_scale(cloud, cad).is_some(), "{cloud} {cad}");
            }
        }
        assert!(check_scale(300.0, 0.0).is_some() && check_scale(0.0, 0.0).is_some());
        assert!(check_scale(1e300, 1e-300).is_some());
    }

    /// A belt of 600 mm by 400 mm, evenly covered.
    fn belt(scale: f64) -> Vec<Point3> {
        let at = |i: u32| [f64::from(i % 200) * 3.0, f64::from(i / 200) * 4.0];
        (0..20_000).map(|i| Point3::new(at(i)[0] * scale, at(i)[1] * scale, 0.0)).collect()
    }

    #[test]
    fn a_small_part_on_a_wide_belt_is_innocent_as_a_raw_cloud() {
        for part in [20.0, 28.4, 60.0, 72.0, 600.0] {
            assert_eq!(check_raw_scale(&belt(1.0), part), None, "{part}");
        }
        assert_eq!(check_raw_scale(&belt(1000.0), 600.0).unwrap().factor, 1000.0);
        assert_eq!(check_raw_scale(&belt(0.001), 600.0).unwrap().factor, 0.001);
        assert_eq!(check_raw_scale(&[], 600.0), None);
        assert!(check_raw_scale(&belt(1.0), f64::NAN).is_some());
    }

    /// In inches, with a belt around the part: larger by a third than 25.4 explains, smaller than 10 does, and none of the belt's doing.
    #[test]
    fn a_raw_cloud_far_too_small_is_told_whatever_it_shows_beside_the_part() {
        let told = check_raw_scale(&belt(1.0 / 25.4), 540.0).unwrap();
        assert!(told.words.contains("beside the part") && told.help.contains("[scans] unit"), "{told:?}");
        assert_eq!(check_raw_scale(&belt(0.5), 600.0), None);
    }

    /// A single one, and one point in ten written as (-9999, -9999, -9999), all over the file.
    #[test]
    fn points_far_outside_are_no_wrong_unit() {
        for (scale, expected) in [(1.0, None), (1000.0, Some(1000.0)), (0.001, Some(0.001))] {
            let mut cloud = belt(scale);
            cloud.push(Point3::new(-30_000.0 * scale, 0.0, 0.0));
            assert_eq!(check_raw_scale(&cloud, 600.0).map(|s| s.factor), expected, "one stray at {scale}");
        }
        let mut cloud = belt(1.0);
        cloud.iter_mut().step_by(10).for_each(|p| *p = Point3::new(-9999.0, -9999.0, -9999.0));
        assert_eq!(check_raw_scale(&cloud, 150.0), None);
    }

    #[test]
    fn strays_do_not_move_the_size() {
        let mut points: Vec<Point3> =
            (0..10_000).map(|i| Point3::new(f64::from(i % 100) * 3.0, f64::from(i / 100) * 4.0, 0.0)).collect();
        points.extend([Point3::new(1e6, 1e6, 1e6), Point3::new(-1e6, 0.0, 0.0)]);
        let kept: Vec<u32> = (0..points.len() as u32).collect();
        // 99 steps of 3 mm and 4 mm make 495 mm; two of 100 rows are cut off on each axis.
        let size = robust_diagonal_mm(&points, &kept).unwrap();
        assert!((480.0..=495.0).contains(&size), "{size}");
        assert_eq!(robust_diagonal_mm(&points, &[]), None);
    }
}
