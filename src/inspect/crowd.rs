//! Points that stand together far from the CAD: a deep dent, another part, a piece of belt. They have no value in the map, so
//! that they must be told in words.

use crate::geometry::Point3;
use std::collections::BTreeMap;

/// Most points far from the CAD in one cube.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crowd {
    /// Their mean, CAD frame.
    pub centre: Point3,
    /// Points in the cube.
    pub points: usize,
}

/// Edge of a cube: in mm, and in spacings at least.
const CUBE_MM: f64 = 6.0;
const CUBE_SPACINGS: f64 = 6.0;
/// Share of the points that sheet across a whole cube would have there: stray points reach a few percent.
const SHARE: f64 = 0.4;

/// The fullest cube, if it is as full as a piece of sheet makes it. `far` in the CAD frame.
pub fn fullest(far: &[Point3], spacing_mm: f64) -> Option<Crowd> {
    let cube_mm = CUBE_MM.max(CUBE_SPACINGS * spacing_mm);
    let mut cubes: BTreeMap<[i64; 3], (usize, [f64; 3])> = BTreeMap::new();
    for p in far {
        // Saturates far outside, where nothing is told apart any more.
        let key = [p.x, p.y, p.z].map(|c| (c / cube_mm).floor() as i64);
        let cube = cubes.entry(key).or_default();
        cube.0 += 1;
        for (sum, c) in cube.1.iter_mut().zip([p.x, p.y, p.z]) {
            *sum += c;
        }
    }
    let (points, sum) = cubes.into_values().max_by(|a, b| a.0.cmp(&b.0))?;
    let enough = SHARE * (cube_mm / spacing_mm).powi(2);
    (points as f64 >= enough).then(|| Crowd { centre: Point3::from(sum.map(|s| s / points as f64)), points })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_piece_of_sheet_is_a_crowd_and_strays_are_none() {
        let sheet = (0..400).map(|k| Point3::new(0.3 + 0.5 * f64::from(k % 20), 0.3 + 0.5 * f64::from(k / 20), 40.2));
        let strays = (0..400).map(|k| Point3::new(f64::from(k) * 0.7, f64::from(k * k % 97), 30.0 + f64::from(k % 13)));
        let strays: Vec<Point3> = strays.collect();
        let both: Vec<Point3> = sheet.chain(strays.iter().copied()).collect();
        let crowd = fullest(&both, 0.5).unwrap();
        // A whole cube of 6 mm holds 144 points of that sheet.
        assert!((100..=160).contains(&crowd.points) && (crowd.centre.z - 40.2).abs() < 0.5, "{crowd:?}");
        assert_eq!(fullest(&strays, 0.5), None);
        assert_eq!(fullest(&[], 0.5), None);
    }
}
