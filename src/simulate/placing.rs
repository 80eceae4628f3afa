//! How the part is put down on the belt, and where the camera stands over it.

use super::rig::RigModel;
use super::settle::{centre_of_mass, settle};
use super::subject::Subject;
use crate::geometry::{Isometry3, Point3, UnitVector3, Vector3};
use crate::plan::Side;
use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Uniform};

/// How the part lies on the belt; what is left open is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseChoice {
    /// The CAD direction that points up, before the part comes to rest.
    pub up_cad: UnitVector3,
    /// Let it tip until it lies still (else it floats exactly so).
    pub settles: bool,
    /// Turn about the vertical; `None`: any.
    pub yaw_rad: Option<f64>,
    /// Place of the box's middle on the belt, mm from the middle of the rig; `None`: within the rig's `wander_mm`.
    pub at_mm: Option<[f64; 2]>,
}

impl PoseChoice {
    /// Put down with that side of the sheet up, left to settle.
    pub fn side(subject: &Subject, side: Side) -> Self {
        let up = UnitVector3::try_new(subject.upper_direction() * side.sign(), 0.0).unwrap_or_else(Vector3::z_axis);
        Self { up_cad: up, settles: true, yaw_rad: None, at_mm: None }
    }

    /// Put down with that CAD direction up, not settled: for resting poses computed elsewhere.
    pub fn up(up_cad: UnitVector3) -> Self {
        Self { up_cad, settles: false, yaw_rad: None, at_mm: None }
    }
}

/// The part on the belt: up as asked (settled), turned, its box's middle where it is to be, its lowest point on the belt.
pub(super) fn put_down(subject: &Subject, rig: &RigModel, pose: &PoseChoice, rng: &mut ChaCha8Rng) -> Isometry3 {
    let (turn, x, y) = (signed(rng) * std::f64::consts::PI, signed(rng) * rig.wander_mm, signed(rng) * rig.wander_mm);
    let up = if pose.settles {
        let centre = centre_of_mass(&subject.face(Side::Top));
        settle(&subject.solid.vertices, &centre, pose.up_cad)
    } else {
        pose.up_cad
    };
    let upright = UnitQuaternion::rotation_between_axis(&up, &Vector3::z_axis())
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
    let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), pose.yaw_rad.unwrap_or(turn)) * upright;
    let turned: Vec<Point3> = subject.solid.vertices.iter().map(|v| rotation * v).collect();
    let Some(bounds) = crate::geometry::Aabb::of_points(&turned) else { return Isometry3::identity() };
    let [x, y] = pose.at_mm.unwrap_or([x, y]);
    let middle = bounds.centre();
    let shift = Translation3::new(x - middle.x, y - middle.y, -bounds.min.z - rig.belt_sink_mm);
    Isometry3::from_parts(shift, rotation)
}

/// The scan frame: the camera's, looking along `view_direction` from the origin, the belt at the rig's distance, not
/// quite square to the view.
pub(super) fn scan_from_belt(rig: &RigModel) -> Isometry3 {
    let look = rig.view_direction;
    let x = across(&look);
    let square = Matrix3::from_columns(&[x, (-look.into_inner()).cross(&x), -look.into_inner()]);
    let square = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(square));
    let tilt_axis = UnitVector3::new_normalize(Vector3::new(0.8, -0.6, 0.0));
    let tilt = UnitQuaternion::from_axis_angle(&tilt_axis, rig.camera_tilt_deg.to_radians());
    Isometry3::from_parts(Translation3::from(look.into_inner() * rig.distance_mm), square * tilt)
}

/// A unit vector across a direction.
pub(super) fn across(direction: &UnitVector3) -> Vector3 {
    let other = if direction.x.abs() < 0.7 { Vector3::x() } else { Vector3::y() };
    direction.cross(&other).normalize()
}

/// Even in -1..1.
pub(super) fn signed(rng: &mut ChaCha8Rng) -> f64 {
    2.0 * unit(rng) - 1.0
}

/// Even in 0..1.
pub(super) fn unit(rng: &mut ChaCha8Rng) -> f64 {
    Uniform::new(0.0, 1.0).map_or(0.5, |u| u.sample(rng))
}
