//! A second look at the belt once the pose is known.
//!
//! Background removal knows no part: it takes everything up to one height for the belt, a flange that lies there with it, and leaves
//! what scatters above. The pose tells at each place how high above the belt the part's face lies, and so on which side of which height a
//! point is sheet ([`ConditionedScan::belt_limits`]):
//!
//! - Points taken for belt by their height are taken back where they are sheet. Beside the face, too, as far as an edge is looked
//!   for: taken back up to the CAD's edge only, a longer flange would end at its nominal edge. What has the belt's colour stays belt: in
//!   its shadow the belt scatters three times as far, and beside an edge trimmed short such points would be taken for sheet.
//! - Kept points where face and belt cannot be told apart are belt: what is left there of either is its upper tail, and the map
//!   would show that as a deviation. Low points far from the part are belt as well. Measuring does not need them to be gone: a value that
//!   near to the belt is none.
//!
//! Whether there is sheet at all is not asked here: belt under a flange that is missing stands below those heights.

use crate::geometry::{CadFromScan, Isometry3, Point3};
use crate::part::Face;
use crate::run::{Cancelled, RunContext};
use crate::scan::{BeltPlane, ConditionedScan, PointClass};
use rayon::prelude::*;

/// How far beside the face points are looked at again, mm: further than any edge is looked for.
const BESIDE_MM: f64 = 10.0;
/// The same where other things are in view, which lie apart by 5 mm or so.
const BESIDE_OTHERS_MM: f64 = 2.5;
const CHUNK: usize = 1 << 15;

/// What the second look found. Indices into the cloud, ascending.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SecondLook {
    /// Removed points that are sheet.
    pub sheet: Vec<u32>,
    /// Kept points that are belt, or cannot be told from it.
    pub belt: Vec<u32>,
}

/// Looks again at the points near the belt, in a pose good to about a mm. Without a belt there is nothing to look at.
pub fn second_look(
    scan: &ConditionedScan,
    face: &Face,
    cad_from_scan: &CadFromScan,
    run: &RunContext,
) -> Result<SecondLook, Cancelled> {
    let Some(belt) = scan.belt else { return Ok(SecondLook::default()) };
    let beside_mm = if scan.removed.other > 0 { BESIDE_OTHERS_MM } else { BESIDE_MM };
    let look = Look { scan, belt, face, cad_from_scan, scan_from_cad: cad_from_scan.scan_from_cad(), beside_mm };
    let chunks: Vec<SecondLook> = scan
        .classes
        .par_chunks(CHUNK)
        .enumerate()
        .map(|(chunk, classes)| {
            run.check()?;
            Ok(look.chunk(chunk * CHUNK, classes))
        })
        .collect::<Result<_, Cancelled>>()?;
    let mut found = SecondLook::default();
    for chunk in chunks {
        found.sheet.extend(chunk.sheet);
        found.belt.extend(chunk.belt);
    }
    Ok(found)
}

struct Look<'a> {
    scan: &'a ConditionedScan,
    belt: BeltPlane,
    face: &'a Face,
    cad_from_scan: &'a CadFromScan,
    scan_from_cad: Isometry3,
    beside_mm: f64,
}

impl Look<'_> {
    fn chunk(&self, start: usize, classes: &[PointClass]) -> SecondLook {
        let mut found = SecondLook::default();
        // No place decides at less than the least of all cuts, nor at more than what is told from the belt anywhere.
        let least_mm = self.scan.belt_limits(0.0).lowest_cut_mm;
        let most_mm = self.scan.belt_limits(f64::INFINITY).tail_mm;
        for (k, class) in classes.iter().enumerate() {
            let index = (start + k) as u32;
            let point = &self.scan.cloud.positions[start + k];
            let height_mm = || self.belt.height_mm(point);
            match class {
                PointClass::Belt if height_mm() > least_mm && self.is_sheet(point) => {
                    found.sheet.push(index);
                }
                PointClass::Kept if height_mm() < most_mm && !self.can_be_told(point) => found.belt.push(index),
                _ => {}
            }
        }
        found
    }

    /// How high above the belt the face lies where it is nearest to a point; `None` where it is far away.
    fn face_mm(&self, point: &Point3) -> Option<f64> {
        let hit = self.face.closest(&self.cad_from_scan.point(point), self.beside_mm)?;
        Some(self.belt.height_mm(&(self.scan_from_cad * hit.point)))
    }

    fn is_sheet(&self, point: &Point3) -> bool {
        self.face_mm(point).is_some_and(|face_mm| {
            let limits = self.scan.belt_limits(face_mm);
            face_mm >= limits.told_mm && self.belt.height_mm(point) > limits.cut_mm
        })
    }

    /// Whether a kept point can be of the part and not of the belt.
    fn can_be_told(&self, point: &Point3) -> bool {
        let height_mm = self.belt.height_mm(point);
        match self.face_mm(point) {
            Some(face_mm) => {
                let limits = self.scan.belt_limits(face_mm);
                face_mm >= limits.told_mm || height_mm >= limits.tail_mm
            }
            None => height_mm >= self.scan.belt_limits(f64::INFINITY).told_mm,
        }
    }
}
