//! From where the sensor looks, and how well that is known beforehand.

use crate::geometry::{Isometry3, Mesh, Point3, Vector3};
use nalgebra::{Rotation3, Translation3, UnitQuaternion};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// How far the pose from stage or robot is off: always by so much, in a direction drawn at random.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PriorError {
    /// Length of the shift.
    pub shift: f64,
    /// Angle of the turn, about the middle of what the view sees.
    pub turn_rad: f64,
}

impl PriorError {
    /// The pose as stage or robot tell it.
    pub(super) fn spoil(&self, world_from_view: &Isometry3, target: &Point3, rng: &mut ChaCha8Rng) -> Isometry3 {
        let mut direction = || -> Vector3 { Vector3::from_fn(|_, _| StandardNormal.sample(rng)).normalize() };
        let (shift, axis) = (direction() * self.shift, direction());
        let turn = UnitQuaternion::new(axis * self.turn_rad);
        let about = target.coords - turn * target.coords;
        Isometry3::from_parts(Translation3::from(about + shift), turn) * world_from_view
    }
}

/// The pose (world from view) of a sensor that looks straight at a place from `distance` along `normal`, its x axis turned from `x` by
/// `roll_rad` about the line of sight.
///
/// # Panics
/// When `x` lies along the normal.
pub fn facing(target: &Point3, normal: &Vector3, distance: f64, x: &Vector3, roll_rad: f64) -> Isometry3 {
    let z = -normal.normalize();
    let across = (x - z * z.dot(x)).try_normalize(1e-6).expect("x lies across the line of sight");
    let rolled = across * roll_rad.cos() + z.cross(&across) * roll_rad.sin();
    let axes = Rotation3::from_basis_unchecked(&[rolled, z.cross(&rolled), z]);
    let eye = target - z * distance;
    Isometry3::from_parts(Translation3::from(eye.coords), UnitQuaternion::from_rotation_matrix(&axes))
}

/// So many places spread over a mesh, each as far as can be from those before it, with the mean normal within `reach` of it.
pub(super) fn spread_over(mesh: &Mesh, count: usize, reach: f64) -> Vec<(Point3, Vector3)> {
    let middle = |t: usize| {
        let [a, b, c] = mesh.corners(t);
        Point3::from((a.coords + b.coords + c.coords) / 3.0)
    };
    let middles: Vec<Point3> = (0..mesh.triangles.len()).map(middle).collect();
    let mut distance = vec![f64::INFINITY; middles.len()];
    let mut next = 0;
    let mut places = Vec::new();
    for _ in 0..count.min(middles.len()) {
        let place = middles[next];
        let near = (0..middles.len()).filter(|t| (middles[*t] - place).norm() < reach);
        let normal: Vector3 = near.map(|t| mesh.area_vector_twice(t)).sum();
        places.push((place, normal));
        for (least, at) in distance.iter_mut().zip(&middles) {
            *least = least.min((at - place).norm_squared());
        }
        next = (0..middles.len()).max_by(|a, b| distance[*a].total_cmp(&distance[*b])).unwrap_or(0);
    }
    places
}
