//! A cloud with a class for every point: nothing is thrown away, so that the window can show what was removed.

use crate::geometry::{Point3, PointCloud, UnitVector3};
use serde::{Deserialize, Serialize};

/// How many points each filter took.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Removed {
    /// NaN or infinite in the file.
    pub invalid: usize,
    /// Exactly where an earlier point stands.
    pub duplicate: usize,
    /// On or below the belt plane.
    pub belt: usize,
    /// Of the belt's colour.
    pub colour: usize,
    /// Too dark.
    pub dark: usize,
    /// Far from the component that is the part (noise, other things in view).
    pub stray: usize,
    /// Of another part or thing in view, told by the alignment.
    #[serde(default)]
    pub other: usize,
}

/// What a point was taken for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum PointClass {
    /// Part, as far as the filters can tell.
    Kept,
    /// Exactly where an earlier point stands: it tells nothing new.
    Duplicate,
    /// On or below the belt plane.
    Belt,
    /// Of the belt's colour.
    Colour,
    /// Too dark.
    Dark,
    /// Far from the component that is the part.
    Stray,
    /// Of another part or thing in view.
    Other,
}

/// The belt as fitted, scan frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeltPlane {
    /// A point on it (the centroid of its inliers).
    pub point: Point3,
    /// Its normal, towards the camera.
    pub normal: UnitVector3,
    /// Robust standard deviation of its points about it, mm.
    pub sigma_mm: f64,
}

impl BeltPlane {
    /// Height above the belt in mm, towards the camera positive.
    pub fn height_mm(&self, point_scan: &Point3) -> f64 {
        (point_scan - self.point).dot(&self.normal)
    }
}

/// Where sheet and belt part at a place, heights above the belt in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeltLimits {
    /// A point above is sheet, one below is belt.
    pub cut_mm: f64,
    /// Sheet that stands lower loses points to the belt, or gets some of it.
    pub told_mm: f64,
    /// Points of such sheet scatter up to here.
    pub tail_mm: f64,
    /// The least cut of all places.
    pub lowest_cut_mm: f64,
}

/// What a layer of points needs between itself and a cut, in standard deviations: 0.6 % lie beyond, and the mean of the rest is off
/// by 0.02 standard deviations.
const CLEAR_SIGMAS: f64 = 2.5;

/// By how much the face's height above the belt may differ between the best fit and the plan's alignment, mm.
const POSE_SLACK_MM: f64 = 0.3;

/// A cloud ready for alignment.
#[derive(Debug, Clone, PartialEq)]
pub struct ConditionedScan {
    /// All points, scan frame.
    pub cloud: PointCloud,
    /// One class a point.
    pub classes: Vec<PointClass>,
    /// Indices of the kept points, ascending.
    pub kept: Vec<u32>,
    /// What the filters took.
    pub removed: Removed,
    /// The belt, when one is in view.
    pub belt: Option<BeltPlane>,
    /// Height above the belt up to which the filter took points for the belt, mm; `None` without a belt.
    pub belt_clearance_mm: Option<f64>,
    /// From the part towards the camera, scan frame: minus the plan's view direction, else the belt's normal, else the mean of the
    /// kept points' normals. `None` when none of them is there.
    pub to_camera: Option<UnitVector3>,
    /// Typical distance between neighbouring kept points: 1 / sqrt(points per mm²), mm.
    pub spacing_mm: f64,
    /// What somebody should know.
    pub warnings: Vec<String>,
}

impl ConditionedScan {
    /// Where sheet and belt part at a place where the part's face lies that high above the belt, in mm.
    ///
    /// Up to the clearance everything was taken for belt. Where a face lies less than twice as high, half of its height parts the two
    /// better, if both layers of points are clear of it. Without a belt nothing has to be told from it.
    pub fn belt_limits(&self, face_mm: f64) -> BeltLimits {
        let (Some(belt), Some(clearance_mm)) = (self.belt, self.belt_clearance_mm) else {
            let none_mm = f64::NEG_INFINITY;
            return BeltLimits { cut_mm: none_mm, told_mm: none_mm, tail_mm: none_mm, lowest_cut_mm: none_mm };
        };
        let clear_mm = CLEAR_SIGMAS * belt.sigma_mm;
        let told = |cut_mm: f64| (cut_mm + clear_mm).max(2.0 * clear_mm);
        let half_mm = clearance_mm.min((0.5 * face_mm).max(clear_mm));
        let cut_mm = if face_mm >= told(half_mm) { half_mm } else { clearance_mm };
        let told_mm = told(cut_mm);
        BeltLimits { cut_mm, told_mm, tail_mm: told_mm + clear_mm, lowest_cut_mm: clearance_mm.min(clear_mm) }
    }

    /// Height above the belt from which on a measurement is not the work of the filters, where the face lies that high above the belt in
    /// the pose of the measurement, in mm. The filters had an earlier one, in which it may have been a little higher or lower.
    pub fn told_from_belt_mm(&self, face_mm: f64) -> f64 {
        let told = |face_mm: f64| self.belt_limits(face_mm).told_mm;
        told(face_mm - POSE_SLACK_MM).max(told(face_mm + POSE_SLACK_MM))
    }

    /// Keeps only some of the points kept before (`everything`, ascending, as well as `kept`); the others are of other things.
    pub fn set_other(&mut self, everything: &[u32], kept: Vec<u32>) {
        for &k in everything {
            self.classes[k as usize] = PointClass::Other;
        }
        for &k in &kept {
            self.classes[k as usize] = PointClass::Kept;
        }
        self.removed.other += everything.len() - kept.len();
        self.kept = kept;
    }

    /// Gives some points another class; `kept` and `removed` follow.
    pub fn reclassify(&mut self, points: &[u32], class: PointClass) {
        for &k in points {
            let before = std::mem::replace(&mut self.classes[k as usize], class);
            for (of, count) in [(before, usize::MAX), (class, 1)] {
                let counter = match of {
                    PointClass::Kept => continue,
                    PointClass::Duplicate => &mut self.removed.duplicate,
                    PointClass::Belt => &mut self.removed.belt,
                    PointClass::Colour => &mut self.removed.colour,
                    PointClass::Dark => &mut self.removed.dark,
                    PointClass::Stray => &mut self.removed.stray,
                    PointClass::Other => &mut self.removed.other,
                };
                *counter = counter.wrapping_add(count);
            }
        }
        if !points.is_empty() {
            let kept = |k: &u32| self.classes[*k as usize] == PointClass::Kept;
            self.kept = (0..self.classes.len() as u32).filter(kept).collect();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vector3;

    fn scan(sigma_mm: f64, clearance_mm: f64) -> ConditionedScan {
        let classes = vec![PointClass::Belt, PointClass::Kept, PointClass::Colour, PointClass::Kept];
        ConditionedScan {
            cloud: PointCloud { positions: vec![Point3::origin(); 4], ..PointCloud::default() },
            classes,
            kept: vec![1, 3],
            removed: Removed { belt: 1, colour: 1, ..Removed::default() },
            belt: Some(BeltPlane { point: Point3::origin(), normal: Vector3::z_axis(), sigma_mm }),
            belt_clearance_mm: Some(clearance_mm),
            to_camera: None,
            spacing_mm: 1.0,
            warnings: Vec::new(),
        }
    }

    #[test]
    fn a_low_face_and_the_belt_part_half_way_between_them_if_both_are_clear_of_it() {
        let near = |a: f64, b: f64| (a - b).abs() < 1e-12;
        let limits = |clearance_mm: f64, face_mm: f64| {
            let l = scan(0.1, clearance_mm).belt_limits(face_mm);
            (l.cut_mm, l.told_mm)
        };
        // A clearance far above the belt's scatter of 0.1 mm: a face 1.2 mm up is told at 0.6 mm, and one 0.4 mm up not at all.
        let (cut, told) = limits(2.0, 1.2);
        assert!(near(cut, 0.6) && near(told, 0.85));
        let (cut, told) = limits(2.0, 0.4);
        assert!(near(cut, 2.0) && near(told, 2.25));
        // High above, the clearance decides; a cut is never below 2.5 sigma, nor is anything told below 5.
        assert!(near(limits(2.0, 50.0).0, 2.0) && near(limits(0.35, 0.5).0, 0.25) && near(limits(0.35, 0.5).1, 0.5));
        assert!(near(limits(0.1, 0.4).0, 0.1) && near(limits(0.1, 0.4).1, 0.5));
        // In another pose: 1.2 mm may have been 1.5 mm, and 0.7 mm may have been 0.4 mm, where nothing is told below the clearance.
        assert!(near(scan(0.1, 2.0).told_from_belt_mm(1.2), 1.0) && near(scan(0.1, 0.35).told_from_belt_mm(0.7), 0.6));
        assert!(near(scan(0.1, 2.0).told_from_belt_mm(0.7), 2.25));
    }

    #[test]
    fn each_point_stays_counted_once() {
        let mut scan = scan(0.1, 0.35);
        scan.reclassify(&[0, 2], PointClass::Kept);
        assert_eq!((scan.kept.clone(), scan.removed), (vec![0, 1, 2, 3], Removed::default()));
        scan.reclassify(&[1], PointClass::Belt);
        assert_eq!((scan.kept.clone(), scan.removed.belt), (vec![0, 2, 3], 1));
        scan.set_other(&[0, 2, 3], vec![2]);
        assert_eq!((scan.kept.clone(), scan.removed.other), (vec![2], 2));
        assert_eq!(scan.classes[3], PointClass::Other);
    }
}
