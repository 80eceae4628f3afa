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
    /// Height above the belt up to which points were taken for the belt, mm; `None` without a belt.
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
    fn each_point_stays_counted_once() {
        let mut scan = scan(0.1, 0.35);
        scan.set_other(&[1, 3], vec![3]);
        assert_eq!((scan.kept.clone(), scan.removed.other, scan.removed.belt), (vec![3], 1, 1));
        assert_eq!(scan.classes[1], PointClass::Other);
    }
}
