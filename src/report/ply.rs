//! `NAME.ply`: the kept points in the CAD frame with the deviation of each.

use super::palette::Palette;
use crate::geometry::{LengthUnit, Point3};
use crate::inspect::{InspectionResult, Outcome};
use crate::io::write_ply_cloud;
use crate::run::{Cancelled, RunContext};
use crate::scan::ConditionedScan;
use std::io::{self, Write};

/// Colour of a kept point that carries no deviation (past a trimmed edge, too far from the CAD).
const NO_VALUE: [u8; 3] = [0x85, 0x8F, 0x9C];

/// The kept points as binary PLY, mm in the CAD frame, with the map's colours and the float property `deviation` (mm, NaN
/// where a point carries none). A refused scan gives a file without points.
pub fn ply(result: &InspectionResult, scan: &ConditionedScan, run: &RunContext) -> Result<Vec<u8>, Cancelled> {
    let mut points: Vec<Point3> = Vec::new();
    let mut deviations: Vec<f32> = Vec::new();
    if let Outcome::Measured(inspection) = &result.outcome {
        let mut known = vec![f32::NAN; scan.cloud.len()];
        for (&i, &deviation) in inspection.map.indices.iter().zip(&inspection.map.deviations_mm) {
            if let Some(place) = known.get_mut(i as usize) {
                *place = deviation;
            }
        }
        run.check()?;
        let pose = &inspection.alignment.cad_from_scan;
        points.extend(scan.kept.iter().map(|&i| pose.point(&scan.cloud.positions[i as usize])));
        run.check()?;
        deviations.extend(scan.kept.iter().map(|&i| known[i as usize]));
    }
    let colour = |&d: &f32| match d.is_nan() {
        true => NO_VALUE,
        false => Palette::default().colour(f64::from(d) / result.map_range_mm),
    };
    let mut colours: Vec<[u8; 3]> = Vec::with_capacity(deviations.len());
    for chunk in deviations.chunks(CHUNK) {
        run.check()?;
        colours.extend(chunk.iter().map(colour));
    }
    let mut out = Stoppable { bytes: Vec::new(), run };
    match write_ply_cloud(&mut out, &points, LengthUnit::Mm, Some(&colours), None, &[("deviation", &deviations)]) {
        Ok(()) => Ok(out.bytes),
        // Memory takes every write of a job that goes on, and the arrays have one length.
        Err(_) => Err(Cancelled),
    }
}

/// Points coloured between two looks at whether the job was cancelled.
const CHUNK: usize = 1 << 18;

/// Takes bytes until the job is cancelled.
struct Stoppable<'a> {
    bytes: Vec<u8>,
    run: &'a RunContext<'a>,
}

impl Write for Stoppable<'_> {
    fn write(&mut self, more: &[u8]) -> io::Result<usize> {
        self.run.check().map_err(io::Error::other)?;
        self.bytes.extend_from_slice(more);
        Ok(more.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;
    use std::path::Path;

    #[test]
    fn reads_back_in_the_cad_frame_with_its_deviations() {
        let (points, deviations) = example::dome_cloud(2000, |p| 0.005 * p.x);
        let (mut result, scan) = example::with_map(example::bracket(), &points, deviations.clone(), 1.0);
        // The first point loses its value: it is kept, but carries no deviation.
        let map = &mut example::inspection_mut(&mut result).map;
        map.indices.remove(0);
        map.deviations_mm.remove(0);
        let bytes = ply(&result, &scan, &RunContext::silent()).unwrap();
        let cloud = crate::io::read_cloud(&bytes, Path::new("x.ply"), LengthUnit::Mm, &RunContext::silent()).unwrap();
        assert_eq!(cloud.len(), points.len());
        // Coordinates are floats of up to 120 mm: half a unit in the last place is 4e-6 mm.
        assert!(cloud.positions.iter().zip(&points).all(|(a, b)| (a - b).norm() < 2e-5));
        let read = cloud.scalar("deviation").unwrap();
        assert!(read[0].is_nan() && read[1..] == deviations[1..]);
        assert_eq!(cloud.colours.unwrap()[0], NO_VALUE);
        assert!(ply(&example::refused(), &scan, &RunContext::silent()).unwrap().starts_with(b"ply"));
    }
}
