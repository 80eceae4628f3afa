//! From where the part is seen: plain numbers, no window.
//!
//! The eye's frame has x to the right, y up and z towards the eye, its origin in the target: the point about which the camera turns
//! and whose surroundings are `height_mm` high in the picture. Pixels count from the top left corner of the view.

use crate::geometry::{Point3, Vector3};
use nalgebra::{Rotation3, Unit, UnitQuaternion};

/// Parallel, or as an eye sees it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Projection {
    /// Near things are larger.
    #[default]
    Perspective,
    /// Equal lengths are equal everywhere in the picture.
    Parallel,
}

/// Size of a view in pixels (points of the window, or pixels: the caller's choice, always the same one).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewSize {
    /// From left to right.
    pub width: f64,
    /// From top to bottom.
    pub height: f64,
}

/// A place in the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projected {
    /// Pixels from the left.
    pub x: f64,
    /// Pixels from the top.
    pub y: f64,
    /// Towards the eye from the target, mm.
    pub depth_mm: f64,
}

/// A line of sight; points on it are `origin + t * direction`, t > 0, the direction of length one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Where it begins.
    pub origin: Point3,
    /// Away from the eye.
    pub direction: Vector3,
}

/// Where the camera stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// About which it turns; in the middle of the picture.
    pub target: Point3,
    /// Turns the eye's frame into that of the CAD.
    pub cad_from_eye: UnitQuaternion<f64>,
    /// What the picture is high at the target, mm.
    pub height_mm: f64,
    /// How depth is shown.
    pub projection: Projection,
}

/// The seven standard views.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StandardView {
    /// From minus y, z up.
    Front,
    /// From plus y.
    Back,
    /// From minus x.
    Left,
    /// From plus x.
    Right,
    /// From plus z, y up.
    Top,
    /// From minus z, y up.
    Bottom,
    /// From a corner of the box, on the side of the sheet that was measured.
    Isometric,
}

impl StandardView {
    /// All of them in the order of their keys 1 to 6 and 0.
    pub const ALL: [StandardView; 7] = [
        StandardView::Front,
        StandardView::Back,
        StandardView::Left,
        StandardView::Right,
        StandardView::Top,
        StandardView::Bottom,
        StandardView::Isometric,
    ];

    /// Turns the eye's frame into that of the CAD. `facing` is the mean normal of the sheet's measured side; only the isometric view
    /// asks for it.
    pub fn cad_from_eye(self, facing: &Vector3) -> UnitQuaternion<f64> {
        let (towards, up) = match self {
            StandardView::Front => (-Vector3::y(), Vector3::z()),
            StandardView::Back => (Vector3::y(), Vector3::z()),
            StandardView::Left => (-Vector3::x(), Vector3::z()),
            StandardView::Right => (Vector3::x(), Vector3::z()),
            StandardView::Top => (Vector3::z(), Vector3::y()),
            StandardView::Bottom => (-Vector3::z(), Vector3::y()),
            StandardView::Isometric => (corner_facing(facing), Vector3::z()),
        };
        looking(&towards, &up)
    }
}

/// The corner of a cube that a normal points to best. Where several are as good, to a tenth of the sum, the first one in a fixed order is
/// taken, so that a normal that is nearly an axis does not choose by its last digits.
fn corner_facing(normal: &Vector3) -> Vector3 {
    let corners: Vec<Vector3> =
        (0..8).map(|k| Vector3::from_fn(|i, _| if (k >> (2 - i)) & 1 == 0 { 1.0 } else { -1.0 })).collect();
    let best = corners.iter().map(|c| c.dot(normal)).fold(f64::NEG_INFINITY, f64::max);
    let slack = 0.2 * normal.norm();
    corners.iter().find(|c| c.dot(normal) >= best - slack).copied().unwrap_or_else(|| Vector3::new(1.0, 1.0, 1.0))
}

/// The turn of an eye that looks from `towards` with `up` up in the picture as far as it can be.
pub fn looking(towards: &Vector3, up: &Vector3) -> UnitQuaternion<f64> {
    let z = towards.try_normalize(0.0).unwrap_or_else(Vector3::z);
    let least = (0..3).min_by(|&a, &b| z[a].abs().total_cmp(&z[b].abs())).unwrap_or(0);
    let x = up.cross(&z).try_normalize(1e-9).unwrap_or_else(|| Vector3::ith(least, 1.0).cross(&z).normalize());
    let y = z.cross(&x);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(nalgebra::Matrix3::from_columns(&[x, y, z])))
}

/// Half of the angle that the picture spans from bottom to top in perspective: 14 degrees, which distorts little.
const HALF_ANGLE: f64 = 14.0 * std::f64::consts::PI / 180.0;
/// The picture is never less high than this, nor more, mm.
const HEIGHTS_MM: [f64; 2] = [0.05, 1e6];
/// Nearer to the eye than this share of its distance nothing is seen.
pub const NEAR: f64 = 0.02;

impl Camera {
    /// Distance of the eye to the target, mm; that of the parallel projection only says where its rays begin.
    pub fn distance_mm(&self) -> f64 {
        0.5 * self.height_mm / HALF_ANGLE.tan()
    }

    /// Direction from the target towards the eye.
    pub fn towards(&self) -> Vector3 {
        self.cad_from_eye * Vector3::z()
    }

    /// A point in the eye's frame.
    pub fn eye_from_cad(&self, point_cad: &Point3) -> Vector3 {
        self.cad_from_eye.inverse() * (point_cad - self.target)
    }

    /// Where a point stands in the picture; `None` when it is behind the eye.
    pub fn project(&self, point_cad: &Point3, size: ViewSize) -> Option<Projected> {
        let eye = self.eye_from_cad(point_cad);
        let scale = self.px_per_mm(eye.z, size)?;
        Some(Projected { x: 0.5 * size.width + eye.x * scale, y: 0.5 * size.height - eye.y * scale, depth_mm: eye.z })
    }

    /// Pixels a millimetre at some depth towards the eye; `None` behind the eye.
    pub fn px_per_mm(&self, depth_mm: f64, size: ViewSize) -> Option<f64> {
        let flat = size.height / self.height_mm;
        match self.projection {
            Projection::Parallel => Some(flat),
            Projection::Perspective => {
                let distance = self.distance_mm();
                let left = distance - depth_mm;
                (left > NEAR * distance).then(|| flat * distance / left)
            }
        }
    }

    /// The line of sight through a pixel. In the parallel projection it begins `reach_mm` before the target's plane: what lies further
    /// towards the eye is not met.
    pub fn ray(&self, [x, y]: [f64; 2], size: ViewSize, reach_mm: f64) -> Ray {
        let mm_per_px = self.height_mm / size.height;
        let across = Vector3::new((x - 0.5 * size.width) * mm_per_px, (0.5 * size.height - y) * mm_per_px, 0.0);
        let (origin, direction) = match self.projection {
            Projection::Parallel => (across + Vector3::z() * reach_mm, -Vector3::z()),
            Projection::Perspective => {
                let eye = Vector3::z() * self.distance_mm();
                (eye, (across - eye).normalize())
            }
        };
        Ray { origin: self.target + self.cad_from_eye * origin, direction: self.cad_from_eye * direction }
    }

    /// The point of the target's plane that is seen in a pixel.
    pub fn on_target_plane(&self, [x, y]: [f64; 2], size: ViewSize) -> Point3 {
        let mm_per_px = self.height_mm / size.height;
        let across = Vector3::new((x - 0.5 * size.width) * mm_per_px, (0.5 * size.height - y) * mm_per_px, 0.0);
        self.target + self.cad_from_eye * across
    }

    /// Turns about a point: `right` and `down` are what the pointer moved, in pixels; half a turn for the height of the view.
    pub fn orbit(&mut self, right: f64, down: f64, pivot: &Point3, size: ViewSize) {
        let rad_per_px = std::f64::consts::PI / size.height.max(1.0);
        let about_up = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -right * rad_per_px);
        let about_right = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -down * rad_per_px);
        let before = self.cad_from_eye;
        self.cad_from_eye = UnitQuaternion::new_normalize((before * about_up * about_right).into_inner());
        let turn = self.cad_from_eye * before.inverse();
        self.target = pivot + turn * (self.target - pivot);
    }

    /// Moves the picture with the pointer: the point `grabbed` stays under it.
    pub fn pan(&mut self, right: f64, down: f64, grabbed: &Point3, size: ViewSize) {
        let depth = self.eye_from_cad(grabbed).z;
        let Some(scale) = self.px_per_mm(depth, size) else { return };
        self.target -= self.cad_from_eye * Vector3::new(right / scale, -down / scale, 0.0);
    }

    /// Comes nearer (factor below 1) or goes away; `anchor` stays where it is in the picture, at any depth and in both projections, because
    /// the whole camera is scaled about it.
    pub fn zoom(&mut self, factor: f64, anchor: &Point3) {
        let height = (self.height_mm * factor).clamp(HEIGHTS_MM[0], HEIGHTS_MM[1]);
        let factor = height / self.height_mm;
        self.target = anchor + (self.target - anchor) * factor;
        self.height_mm = height;
    }

    /// Moves and zooms so that the points just fill the view but for a margin on each side, pixels; the direction stays. Does
    /// nothing without points.
    pub fn fit(&mut self, points: &[Point3], size: ViewSize, [side, top]: [f64; 2]) {
        if points.is_empty() {
            return;
        }
        // At least a third of the view is used, whatever the margins.
        let share = |margin: f64, whole: f64| (1.0 - 2.0 * margin / whole.max(1.0)).max(1.0 / 3.0);
        let half = [0.5 * share(side, size.width) * size.width / size.height.max(1.0), 0.5 * share(top, size.height)];
        let eyes: Vec<Vector3> = points.iter().map(|p| self.eye_from_cad(p)).collect();
        let middle =
            0.5 * eyes.iter().fold(eyes[0], |m, e| m.inf(e)) + 0.5 * eyes.iter().fold(eyes[0], |m, e| m.sup(e));
        let mut centre = middle;
        // In perspective the near side shifts the middle of the picture; three rounds leave less than a pixel.
        for _ in 0..3 {
            self.height_mm = self.needed_height(&eyes, &centre, half);
            let distance = self.distance_mm();
            let scale = |e: &Vector3| match self.projection {
                Projection::Parallel => 1.0,
                Projection::Perspective => distance / (distance - (e.z - middle.z)).max(NEAR * distance),
            };
            for axis in 0..2 {
                let seen = eyes.iter().map(|e| (e[axis] - centre[axis]) * scale(e));
                let (low, high) = seen.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
                centre[axis] += 0.5 * (low + high);
            }
        }
        self.height_mm = self.needed_height(&eyes, &centre, half);
        self.target += self.cad_from_eye * centre;
    }

    /// The least height at which all points are inside: |x| (h k) / (h k - z) <= half h with the eye at k h, solved for h.
    fn needed_height(&self, eyes: &[Vector3], centre: &Vector3, half: [f64; 2]) -> f64 {
        let per_distance = 2.0 * HALF_ANGLE.tan();
        let needed = eyes.iter().flat_map(|e| {
            let depth = match self.projection {
                Projection::Parallel => 0.0,
                Projection::Perspective => (e.z - centre.z) * per_distance,
            };
            [0, 1].map(|axis| (e[axis] - centre[axis]).abs() / half[axis] + depth)
        });
        needed.fold(HEIGHTS_MM[0], f64::max).min(HEIGHTS_MM[1])
    }

    /// The camera that shows a place: in the middle, near enough, and from where its sheet can be seen. `hidden` says that something
    /// stands before it now.
    pub fn facing(&self, place: &Point3, normal: &Vector3, height_mm: f64, hidden: bool) -> Camera {
        let mut camera = *self;
        camera.target = *place;
        camera.height_mm = height_mm.clamp(HEIGHTS_MM[0], HEIGHTS_MM[1]);
        let (normal, towards) = (normal.try_normalize(0.0).unwrap_or(towards_of(self)), self.towards());
        if hidden || normal.dot(&towards) < 0.3 {
            // Half a radian off the normal shows the form better than square on; the shortest turn keeps the sense of up.
            let lean = Unit::try_new(normal.cross(&towards), 1e-9)
                .map_or(normal, |axis| UnitQuaternion::from_axis_angle(&axis, 0.5) * normal);
            let turn = UnitQuaternion::rotation_between(&towards, &lean)
                .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&up_of(self), std::f64::consts::PI));
            camera.cad_from_eye = turn * self.cad_from_eye;
        }
        camera
    }
}

fn towards_of(camera: &Camera) -> Vector3 {
    camera.towards()
}

fn up_of(camera: &Camera) -> Unit<Vector3> {
    Unit::new_normalize(camera.cad_from_eye * Vector3::y())
}

/// A flight from one camera to another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flight {
    from: Camera,
    to: Camera,
    start_s: f64,
}

/// How long a flight takes, seconds.
pub const FLIGHT_S: f64 = 0.25;

impl Flight {
    /// Begins at a time in seconds.
    pub fn new(from: Camera, to: Camera, start_s: f64) -> Self {
        Self { from, to, start_s }
    }

    /// Where it ends.
    pub fn end(&self) -> Camera {
        self.to
    }

    /// The camera at a time, and whether it has arrived.
    pub fn at(&self, now_s: f64) -> (Camera, bool) {
        let t = (now_s - self.start_s) / FLIGHT_S;
        if t.is_nan() || t >= 1.0 {
            return (self.to, true);
        }
        let t = t.max(0.0);
        let t = t * t * (3.0 - 2.0 * t);
        let turn = self.from.cad_from_eye.try_slerp(&self.to.cad_from_eye, t, 1e-9).unwrap_or(self.to.cad_from_eye);
        let height_mm = self.from.height_mm * (self.to.height_mm / self.from.height_mm).powf(t);
        let target = self.from.target + (self.to.target - self.from.target) * t;
        (Camera { target, cad_from_eye: turn, height_mm, projection: self.to.projection }, false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: ViewSize = ViewSize { width: 640.0, height: 480.0 };

    fn cameras() -> Vec<Camera> {
        let mut cameras = Vec::new();
        for (k, view) in StandardView::ALL.into_iter().enumerate() {
            for projection in [Projection::Perspective, Projection::Parallel] {
                let mut camera = Camera {
                    target: Point3::new(10.0, -4.0, 3.0 * k as f64),
                    cad_from_eye: view.cad_from_eye(&Vector3::z()),
                    height_mm: 80.0 + 20.0 * k as f64,
                    projection,
                };
                camera.orbit(13.0 * k as f64, -7.0, &Point3::new(1.0, 2.0, 3.0), SIZE);
                cameras.push(camera);
            }
        }
        cameras
    }

    #[test]
    fn a_ray_through_a_pixel_meets_what_is_seen_there() {
        for camera in cameras() {
            for point in [Point3::new(12.0, 0.0, 5.0), Point3::new(-9.0, 7.0, 1.0), Point3::new(30.0, -20.0, 12.0)] {
                let seen = camera.project(&point, SIZE).unwrap();
                let ray = camera.ray([seen.x, seen.y], SIZE, 500.0);
                let to_point = point - ray.origin;
                // Rounding only: coordinates of 100 mm have 14 digits.
                assert!(to_point.cross(&ray.direction).norm() < 1e-9, "{camera:?}");
                assert!(to_point.dot(&ray.direction) > 0.0);
                let flat = camera.on_target_plane([seen.x, seen.y], SIZE);
                assert!(camera.eye_from_cad(&flat).z.abs() < 1e-9);
            }
        }
    }

    #[test]
    fn right_is_right_and_up_is_up() {
        let top = Camera {
            target: Point3::origin(),
            cad_from_eye: StandardView::Top.cad_from_eye(&Vector3::z()),
            height_mm: 48.0,
            projection: Projection::Parallel,
        };
        let seen = top.project(&Point3::new(3.0, 2.0, 7.0), SIZE).unwrap();
        // Ten pixels a millimetre, the middle at 320, 240.
        assert!((seen.x - 350.0).abs() < 1e-9 && (seen.y - 220.0).abs() < 1e-9 && (seen.depth_mm - 7.0).abs() < 1e-9);
        let front = Camera { cad_from_eye: StandardView::Front.cad_from_eye(&Vector3::z()), ..top };
        let seen = front.project(&Point3::new(3.0, 2.0, 7.0), SIZE).unwrap();
        assert!((seen.x - 350.0).abs() < 1e-9 && (seen.y - 170.0).abs() < 1e-9 && (seen.depth_mm + 2.0).abs() < 1e-9);
    }

    #[test]
    fn the_anchor_of_a_zoom_stays_under_the_pointer() {
        for mut camera in cameras() {
            let anchor = Point3::new(14.0, 3.0, 8.0);
            let before = camera.project(&anchor, SIZE).unwrap();
            for factor in [0.8, 0.5, 1.7, 0.33] {
                camera.zoom(factor, &anchor);
                let after = camera.project(&anchor, SIZE).unwrap();
                assert!((after.x - before.x).abs() < 1e-6 && (after.y - before.y).abs() < 1e-6, "{camera:?}");
            }
        }
    }

    #[test]
    fn a_zoom_ends_before_nothing_and_before_everything() {
        let mut camera = cameras()[0];
        let target = camera.target;
        (0..200).for_each(|_| camera.zoom(0.5, &target));
        assert_eq!(camera.height_mm, HEIGHTS_MM[0]);
        (0..200).for_each(|_| camera.zoom(2.0, &target));
        assert_eq!(camera.height_mm, HEIGHTS_MM[1]);
    }

    #[test]
    fn the_pivot_of_a_turn_and_the_grabbed_point_of_a_pan_stay_with_the_pointer() {
        for mut camera in cameras() {
            let pivot = Point3::new(4.0, 9.0, -2.0);
            let before = camera.project(&pivot, SIZE).unwrap();
            camera.orbit(40.0, 25.0, &pivot, SIZE);
            let after = camera.project(&pivot, SIZE).unwrap();
            assert!((after.x - before.x).hypot(after.y - before.y) < 1e-6);
            camera.pan(30.0, -12.0, &pivot, SIZE);
            let moved = camera.project(&pivot, SIZE).unwrap();
            assert!((moved.x - after.x - 30.0).abs() < 1e-6 && (moved.y - after.y + 12.0).abs() < 1e-6);
        }
    }

    #[test]
    fn fit_holds_every_point_within_the_margins_and_wastes_no_room() {
        let points: Vec<Point3> = (0..8)
            .map(|k| Point3::new([-110.0, 120.0][k & 1], [-60.0, 80.0][k >> 1 & 1], [0.0, 30.0][k >> 2]))
            .collect();
        let margins = [140.0, 20.0];
        for mut camera in cameras() {
            camera.fit(&points, SIZE, margins);
            let seen: Vec<Projected> = points.iter().map(|p| camera.project(p, SIZE).unwrap()).collect();
            let least = |f: fn(&Projected) -> f64| seen.iter().map(f).fold(f64::INFINITY, f64::min);
            let most = |f: fn(&Projected) -> f64| seen.iter().map(f).fold(f64::NEG_INFINITY, f64::max);
            let room = [least(|p| p.x), SIZE.width - most(|p| p.x), least(|p| p.y), SIZE.height - most(|p| p.y)];
            let wanted = [margins[0], margins[0], margins[1], margins[1]];
            // The last round's height holds the points about a centre that may still be off by less than a pixel.
            assert!(room.iter().zip(wanted).all(|(r, w)| *r > w - 1.0), "{room:?} {camera:?}");
            let spare = room.iter().zip(wanted).map(|(r, w)| r - w).fold(f64::INFINITY, f64::min);
            assert!(spare < 2.0, "{room:?}");
        }
    }

    #[test]
    fn nothing_to_fit_and_no_room_leave_a_usable_camera() {
        let mut camera = cameras()[0];
        let before = camera;
        camera.fit(&[], SIZE, [10.0, 10.0]);
        assert_eq!(camera, before);
        camera.fit(&[Point3::origin()], ViewSize { width: 20.0, height: 10.0 }, [140.0, 140.0]);
        assert!(camera.height_mm >= HEIGHTS_MM[0] && camera.height_mm.is_finite());
    }

    #[test]
    fn a_flight_begins_and_ends_where_it_should() {
        let all = cameras();
        let flight = Flight::new(all[0], all[9], 5.0);
        let (start, arrived) = flight.at(5.0);
        assert!(
            !arrived
                && (start.target - all[0].target).norm() < 1e-9
                && start.cad_from_eye.angle_to(&all[0].cad_from_eye) < 1e-7
        );
        let (middle, arrived) = flight.at(5.0 + 0.5 * FLIGHT_S);
        assert!(!arrived && (middle.target - all[9].target).norm() < (all[0].target - all[9].target).norm());
        assert_eq!(flight.at(5.0 + FLIGHT_S), (all[9], true));
        assert_eq!(flight.at(f64::NAN), (all[9], true));
    }

    #[test]
    fn a_place_on_the_far_side_is_looked_at_from_there() {
        for camera in cameras() {
            let place = Point3::new(3.0, 4.0, 5.0);
            for normal in [Vector3::x(), -Vector3::z(), camera.towards(), -camera.towards()] {
                let there = camera.facing(&place, &normal, 30.0, false);
                assert!(there.towards().dot(&normal) > 0.29, "{normal:?} {:?}", there.towards());
                let seen = there.project(&place, SIZE).unwrap();
                assert!((seen.x - 320.0).abs() < 1e-6 && (seen.y - 240.0).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn the_isometric_view_shows_the_measured_side() {
        let towards = |normal: Vector3| StandardView::Isometric.cad_from_eye(&normal) * Vector3::z();
        assert!((towards(Vector3::new(0.01, -0.02, 1.0)) - Vector3::new(1.0, 1.0, 1.0).normalize()).norm() < 1e-9);
        assert!(towards(-Vector3::z()).z < 0.0);
        assert!(towards(Vector3::new(-0.5, 0.4, 0.7)).dot(&Vector3::new(-0.5, 0.4, 0.7)) > 0.9);
    }
}
