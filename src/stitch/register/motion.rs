//! Small motions: a turn (rad) and the shift of a centre, six numbers.

use crate::geometry::{Isometry3, Point3, Vector3};
use nalgebra::{Matrix6, Translation3, UnitQuaternion, Vector6};

pub(super) type Motion = Vector6<f64>;

pub(super) fn turn(motion: &Motion) -> Vector3 {
    motion.fixed_rows::<3>(0).into_owned()
}

pub(super) fn shift(motion: &Motion) -> Vector3 {
    motion.fixed_rows::<3>(3).into_owned()
}

pub(super) fn motion(turn: &Vector3, shift: &Vector3) -> Motion {
    Motion::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z)
}

/// The rigid motion that turns about a centre and shifts it.
pub(super) fn about(centre: &Point3, motion: &Motion) -> Isometry3 {
    let turn = UnitQuaternion::from_scaled_axis(turn(motion));
    Isometry3::from_parts(Translation3::from(centre.coords + shift(motion)), turn) * Translation3::from(-centre.coords)
}

/// The turn and shift of a rigid motion about a centre.
pub(super) fn of_rigid(rigid: &Isometry3, centre: &Point3) -> Motion {
    motion(&rigid.rotation.scaled_axis(), &(rigid * centre - centre))
}

/// The screw about a centre that, followed for a time of one, is the rigid motion. A slide along a cylinder or a plane stays in the directions of
/// its beginning, however far it goes.
pub(super) fn screw(rigid: &Isometry3, centre: &Point3) -> Motion {
    let w = rigid.rotation.scaled_axis();
    let angle = w.norm();
    let moved = rigid * centre - centre;
    // V^-1 = I - W/2 + (1/angle² - (1 + cos) / (2 angle sin)) W²
    let factor = if angle < 1e-4 {
        1.0 / 12.0
    } else {
        1.0 / (angle * angle) - (1.0 + angle.cos()) / (2.0 * angle * angle.sin())
    };
    motion(&w, &(moved - w.cross(&moved) * 0.5 + w.cross(&w.cross(&moved)) * factor))
}

/// Takes motions told about one centre to what they are about another one.
pub(super) fn seen_from(from: &Point3, to: &Point3) -> Matrix6<f64> {
    let mut matrix = Matrix6::identity();
    matrix.fixed_view_mut::<3, 3>(3, 0).copy_from(&(-(to - from).cross_matrix()));
    matrix
}

/// Takes motions told in one frame to another one, about the same place.
pub(super) fn turned(target_from_source: &UnitQuaternion<f64>) -> Matrix6<f64> {
    let r = target_from_source.to_rotation_matrix();
    let mut matrix = Matrix6::zeros();
    matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(r.matrix());
    matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(r.matrix());
    matrix
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motions_come_back_and_are_the_same_from_another_centre() {
        let (here, there) = (Point3::new(3.0, -2.0, 5.0), Point3::new(-1.0, 7.0, 0.5));
        let small = Motion::new(1e-5, -2e-5, 3e-5, 0.1, 0.2, -0.3);
        let rigid = about(&here, &small);
        assert!((of_rigid(&rigid, &here) - small).norm() < 1e-12);
        // Turns of 4e-5 rad at ten lengths: second order is 1e-8.
        let seen = seen_from(&here, &there) * small;
        assert!((of_rigid(&rigid, &there) - seen).norm() < 2e-8, "{seen}");
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.4, 0.2, -0.9));
        let other = turn * rigid * turn.inverse();
        assert!((of_rigid(&other, &(turn * here)) - turned(&turn) * small).norm() < 1e-12);
    }

    /// Half the screw, made twice, is the whole motion.
    #[test]
    fn a_screw_is_followed_at_a_steady_pace() {
        let centre = Point3::new(3.0, -2.0, 5.0);
        let axis = Vector3::new(0.3, -0.5, 0.8);
        let slide = about(&Point3::new(10.0, 1.0, 0.0), &motion(&axis, &(axis * 2.0)));
        let all = screw(&slide, &centre);
        // exp of the screw in ten thousand steps: their error is of the order of 1e-4 of the motion.
        let step = about(&centre, &(all / 10_000.0));
        let mut at = Isometry3::identity();
        let mut place = centre;
        for _ in 0..10_000 {
            let velocity = shift(&all) + turn(&all).cross(&(place - centre));
            place += velocity / 10_000.0;
            at = step * at;
        }
        assert!((place - slide * centre).norm() < 2e-3, "{place} {}", slide * centre);
    }
}
