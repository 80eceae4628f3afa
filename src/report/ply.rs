//! `NAME.ply`: the kept points in the CAD frame with the deviation of each.

use super::palette::Palette;
use crate::geometry::{LengthUnit, Point3};
use crate::inspect::{InspectionResult, Outcome};
use crate::io::write_ply_cloud;
use crate::scan::ConditionedScan;

/// Colour of a kept point that carries no deviation (past a trimmed edge, too far from the CAD).
const NO_VALUE: [u8; 3] = [0x85, 0x8F, 0x9C];

/// The kept points as binary PLY, mm in the CAD frame, with the map's colours and the float property `deviation` (mm, NaN
/// where a point carries none). A refused scan gives a file without points.
pub fn ply(result: &InspectionResult, scan: &ConditionedScan) -> Vec<u8> {
    let mut points: Vec<Point3> = Vec::new();
    let mut deviations: Vec<f32> = Vec::new();
    if let Outcome::Measured(inspection) = &result.outcome {
        let mut known = vec![f32::NAN; scan.cloud.len()];
        for (&i, &deviation) in inspection.map.indices.iter().zip(&inspection.map.deviations_mm) {
            if let Some(place) = known.get_mut(i as usize) {
                *place = deviation;
            }
        }
        let pose = &inspection.alignment.cad_from_scan;
        points.extend(scan.kept.iter().map(|&i| pose.point(&scan.cloud.positions[i as usize])));
        deviations.extend(scan.kept.iter().map(|&i| known[i as usize]));
    }
    let colour = |&d: &f32| match d.is_nan() {
        true => NO_VALUE,
        false => Palette::default().colour(f64::from(d) / result.map_range_mm),
    };
    let colours: Vec<[u8; 3]> = deviations.iter().map(colour).collect();
    let mut bytes = Vec::new();
    write_ply_cloud(&mut bytes, &points, LengthUnit::Mm, Some(&colours), None, &[("deviation", &deviations)])
        .expect("a Vec takes every write");
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;
    use crate::run::RunContext;
    use std::path::Path;

    #[test]
    fn reads_back_in_the_cad_frame_with_its_deviations() {
        let (points, deviations) = example::dome_cloud(2000, |p| 0.005 * p.x);
        let (mut result, scan) = example::with_map(example::bracket(), &points, deviations.clone(), 1.0);
        // The first point loses its value: it is kept, but carries no deviation.
        let map = &mut example::inspection_mut(&mut result).map;
        map.indices.remove(0);
        map.deviations_mm.remove(0);
        let bytes = ply(&result, &scan);
        let cloud = crate::io::read_cloud(&bytes, Path::new("x.ply"), LengthUnit::Mm, &RunContext::silent()).unwrap();
        assert_eq!(cloud.len(), points.len());
        // Coordinates are floats of up to 120 mm: half a unit in the last place is 4e-6 mm.
        assert!(cloud.positions.iter().zip(&points).all(|(a, b)| (a - b).norm() < 2e-5));
        let read = cloud.scalar("deviation").unwrap();
        assert!(read[0].is_nan() && read[1..] == deviations[1..]);
        assert_eq!(cloud.colours.unwrap()[0], NO_VALUE);
        assert!(ply(&example::refused(), &scan).starts_with(b"ply"));
    }
}
