//! A cloud that belongs to no CAD, as it is drawn: in coordinates of its own, so that no unit is too small or too large for a camera.

use super::camera::{Camera, ViewSize};
use super::linked::Subject;
use super::permutation::shuffled;
use crate::geometry::hull::convex_hull;
use crate::geometry::{Aabb, Point3, Vector3};
use crate::run::{Cancelled, RunContext};

/// From one end of the cloud to the other, in the scene.
pub const DIAGONAL: f64 = 200.0;
/// The first points of the shuffle stand for all where something is looked for.
const SAMPLE: usize = 40_000;
/// Points farther from the pointer than this are not meant, points of the window.
const REACH: f64 = 14.0;

/// Points in a shuffled order: the first ones are a fair sample of all.
#[derive(Debug, Clone, Default)]
pub struct Points {
    /// About the middle, [`DIAGONAL`] from end to end.
    pub positions: Vec<[f32; 3]>,
    /// Of each its place in the order in which the cloud was given.
    pub order: Vec<u32>,
    /// Corners of the hull, in the scene.
    pub corners: Vec<Point3>,
    /// Towards the sensors, in the scene.
    pub facing: Vector3,
    /// The distance of neighbours, in the scene.
    pub spacing: f64,
    /// The cloud's own middle.
    pub middle: Point3,
    /// Scene over cloud.
    pub scale: f64,
}

impl Points {
    /// Of a cloud in any unit. `frame`: points that tell the scene's middle and size as well, so that two clouds lie alike; `towards`: where it was seen
    /// from; `spacing`: the distance of neighbours.
    ///
    /// # Errors
    /// The job was stopped.
    pub fn of(
        cloud: &[Point3],
        frame: &[Point3],
        towards: &Vector3,
        spacing: f64,
        run: &RunContext,
    ) -> Result<Points, Cancelled> {
        let Some(bounds) = Aabb::of_points(cloud.iter().chain(frame)) else { return Ok(Points::default()) };
        let middle = bounds.centre();
        let scale = DIAGONAL / bounds.extents().norm().max(f64::MIN_POSITIVE);
        let to_scene = |p: &Point3| Point3::from(scale * (p - middle));
        run.check()?;
        let order = shuffled(cloud.len());
        run.check()?;
        let positions = order.iter().map(|k| {
            let place = to_scene(&cloud[*k as usize]);
            [place.x as f32, place.y as f32, place.z as f32]
        });
        let positions: Vec<[f32; 3]> = positions.collect();
        run.check()?;
        let sample = positions.iter().take(SAMPLE).map(|p| Point3::from(p.map(f64::from)));
        let all: Vec<Point3> = sample.collect();
        let hull = convex_hull(&all).vertices;
        // A flat cloud has no hull.
        let corners = if hull.is_empty() { all.into_iter().take(2000).collect() } else { hull };
        let facing = if towards.norm() > 0.0 { *towards } else { Vector3::z() };
        Ok(Points { positions, order, corners, facing, spacing: spacing * scale, middle, scale })
    }

    /// A place of the cloud in the scene.
    pub fn in_scene(&self, place: &Point3) -> Point3 {
        Point3::from(self.scale * (place - self.middle))
    }

    /// The point that is seen nearest to a pixel, by its place in the shuffled order: of those within reach, the one before the others. Looks at
    /// the sample, among those that `shown` names.
    pub fn near(
        &self,
        camera: &Camera,
        pixel: [f64; 2],
        size: ViewSize,
        shown: impl Fn(usize) -> bool,
    ) -> Option<usize> {
        let seen = self.positions.iter().take(SAMPLE).enumerate().filter_map(|(k, p)| {
            let seen = camera.project(&Point3::from(p.map(f64::from)), size)?;
            let off = (seen.x - pixel[0]).hypot(seen.y - pixel[1]);
            (off <= REACH && shown(k)).then_some((k, seen.depth_mm))
        });
        seen.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(k, _)| k)
    }
}

impl Subject for Points {
    fn centre(&self) -> Point3 {
        Point3::origin()
    }

    fn facing(&self) -> Vector3 {
        self.facing
    }

    fn corners(&self) -> &[Point3] {
        &self.corners
    }

    fn diagonal(&self) -> f64 {
        DIAGONAL
    }

    fn under(&self, camera: &Camera, pixel: [f64; 2], size: ViewSize) -> Option<Point3> {
        let near = self.near(camera, pixel, size, |_| true)?;
        Some(Point3::from(self.positions[near].map(f64::from)))
    }

    /// Points hide nothing.
    fn hides(&self, _: &Camera, _: &Point3, _: ViewSize) -> bool {
        false
    }
}

#[cfg(test)]
mod tests {
    use super::super::camera::{Projection, StandardView};
    use super::*;

    /// A sheet of 100 by 80 points, a lower one below its middle.
    fn sheets(unit: f64) -> Vec<Point3> {
        let upper = (0..8000).map(|k| Point3::new(f64::from(k % 100), f64::from(k / 100), 0.0));
        let lower = (0..100).map(|k| Point3::new(40.0 + f64::from(k % 10), 40.0 + f64::from(k / 10), -20.0));
        upper.chain(lower).map(|p| Point3::from(unit * p.coords)).collect()
    }

    #[test]
    fn a_cloud_of_any_unit_fills_the_same_scene_and_every_point_is_in_it() {
        for unit in [1e-3, 1.0, 1e5] {
            let cloud = sheets(unit);
            let points = Points::of(&cloud, &[], &Vector3::z(), unit, &RunContext::silent()).unwrap();
            assert_eq!(points.positions.len(), cloud.len());
            for (k, place) in points.order.iter().zip(&points.positions) {
                let there = points.in_scene(&cloud[*k as usize]);
                // Single precision of 100.
                assert!((there - Point3::from(place.map(f64::from))).norm() < 2e-5);
            }
            // 99 x 79 x 20: 128.2 from end to end.
            assert!((points.spacing - DIAGONAL / 128.2).abs() < 1e-3 * points.spacing, "{}", points.spacing);
            assert!(points.corners.len() >= 8 && points.corners.iter().all(|p| p.coords.norm() < 0.51 * DIAGONAL));
        }
        let none = Points::of(&[], &[], &Vector3::z(), 1.0, &RunContext::silent()).unwrap();
        assert!(none.positions.is_empty());
    }

    #[test]
    fn what_is_under_the_pointer_is_the_point_before_the_others() {
        let cloud = sheets(1.0);
        let points = Points::of(&cloud, &[], &Vector3::z(), 1.0, &RunContext::silent()).unwrap();
        let size = ViewSize { width: 800.0, height: 600.0 };
        let cad_from_eye = StandardView::Top.cad_from_eye(&Vector3::z());
        let camera =
            Camera { target: Point3::origin(), cad_from_eye, height_mm: 220.0, projection: Projection::Parallel };
        let middle = camera.project(&points.in_scene(&Point3::new(44.0, 44.0, 0.0)), size).unwrap();
        let near = points.near(&camera, [middle.x, middle.y], size, |_| true).unwrap();
        assert!(points.order[near] < 8000, "the upper sheet hides the lower one");
        let lower = |k: usize| points.order[k] >= 8000;
        let near = points.near(&camera, [middle.x, middle.y], size, lower).unwrap();
        assert!(points.order[near] >= 8000);
        assert_eq!(points.near(&camera, [1.0, 1.0], size, |_| true), None);
    }
}
