//! The pose of a scan, guarded by its own type so that it cannot be mistaken for its inverse.

use super::{Isometry3, Point3, Vector3};
use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion};

/// Maps scan coordinates to CAD coordinates: `x_cad = R x_scan + t`, det R = +1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CadFromScan(Isometry3);

impl CadFromScan {
    /// Guards a motion that the caller knows to map scan to CAD.
    pub fn new(cad_from_scan: Isometry3) -> Self {
        Self(cad_from_scan)
    }

    /// The motion that leaves everything in place.
    pub fn identity() -> Self {
        Self(Isometry3::identity())
    }

    /// Reads a row-major 4 x 4 matrix; `None` unless it is a proper rigid motion (R orthogonal to 1e-6, det R = +1).
    pub fn try_from_row_major(m: &[f64; 16]) -> Option<Self> {
        let r = Matrix3::new(m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]);
        let orthogonal = (r * r.transpose() - Matrix3::identity()).abs().max() < 1e-6;
        let last_row = m[12] == 0.0 && m[13] == 0.0 && m[14] == 0.0 && m[15] == 1.0;
        if !m.iter().all(|v| v.is_finite()) || !orthogonal || r.determinant() < 0.0 || !last_row {
            return None;
        }
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(r));
        Some(Self(Isometry3::from_parts(Translation3::new(m[3], m[7], m[11]), rotation)))
    }

    /// Row-major 4 x 4 matrix, translation in mm.
    pub fn row_major(&self) -> [f64; 16] {
        let h = self.0.to_homogeneous();
        std::array::from_fn(|k| h[(k / 4, k % 4)])
    }

    /// The plain motion, scan to CAD.
    pub fn isometry(&self) -> &Isometry3 {
        &self.0
    }

    /// The plain motion the other way, CAD to scan.
    pub fn scan_from_cad(&self) -> Isometry3 {
        self.0.inverse()
    }

    /// A scan point in CAD coordinates.
    pub fn point(&self, point_scan: &Point3) -> Point3 {
        self.0 * point_scan
    }

    /// A scan direction in CAD coordinates.
    pub fn vector(&self, vector_scan: &Vector3) -> Vector3 {
        self.0.rotation * vector_scan
    }

    /// Angle in rad and distance in mm between two poses, the distance taken at a point of interest in the CAD frame
    /// (the part's centre), so that it does not depend on where the scan's origin lies.
    pub fn difference(&self, other: &CadFromScan, at_cad: &Point3) -> (f64, f64) {
        let other_from_self = other.0 * self.0.inverse();
        (other_from_self.rotation.angle(), (other_from_self * at_cad - at_cad).norm())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn row_major_round_trip_and_mirror_refused() {
        let pose = CadFromScan::new(Isometry3::new(Vector3::new(1.0, -2.0, 3.5), Vector3::new(0.3, -1.2, 0.7)));
        let back = CadFromScan::try_from_row_major(&pose.row_major()).unwrap();
        let (angle, distance) = pose.difference(&back, &Point3::new(100.0, 50.0, 10.0));
        assert!(angle < 1e-12 && distance < 1e-10);
        let mut mirrored = pose.row_major();
        for k in [0, 4, 8] {
            mirrored[k] = -mirrored[k];
        }
        assert!(CadFromScan::try_from_row_major(&mirrored).is_none());
    }

    #[test]
    fn point_follows_r_x_plus_t() {
        let pose = CadFromScan::new(Isometry3::new(
            Vector3::new(10.0, 0.0, 0.0),
            Vector3::new(0.0, 0.0, std::f64::consts::FRAC_PI_2),
        ));
        assert!((pose.point(&Point3::new(1.0, 0.0, 0.0)) - Point3::new(10.0, 1.0, 0.0)).norm() < 1e-12);
    }
}
