//! What the pointer means: from a pixel to a proposal on the CAD. Plain functions of camera and tool, without a window.

use crate::geometry::{Point3, UnitVector3};
use crate::gui::engineer::Tool;
use crate::gui::scene::camera::{Camera, NEAR, Projection, ViewSize};
use crate::part::propose::{NoProposal, Picker, Proposal, Ray};
use crate::plan::Geometry;
use crate::plan::document::List;

/// An edge or rim within so many pixels of the pointer is meant.
pub const REACH_PX: f64 = 14.0;
/// A parallel line of sight begins so far before the target, mm: no part reaches there.
const BEGIN_MM: f64 = 1e5;

/// The line of sight through a pixel, CAD frame. In perspective it begins where the picture does: nearer to the eye nothing is drawn.
pub fn ray(camera: &Camera, pixel: [f64; 2], size: ViewSize) -> Option<Ray> {
    let sight = camera.ray(pixel, size, BEGIN_MM);
    let direction = UnitVector3::try_new(sight.direction, 1e-12)?;
    let depth = -direction.dot(&camera.towards());
    let begin = match camera.projection {
        Projection::Perspective => NEAR * camera.distance_mm() / depth.max(1e-6),
        Projection::Parallel => 0.0,
    };
    Some(Ray { origin: sight.origin + direction.into_inner() * begin, direction })
}

/// How far the pointer's reach goes on the part, mm, at a place that is looked at.
fn reach_mm(camera: &Camera, at: &Point3, size: ViewSize) -> f64 {
    let depth = camera.eye_from_cad(at).z;
    let px_per_mm = camera.px_per_mm(depth, size).or_else(|| camera.px_per_mm(0.0, size)).unwrap_or(1.0);
    REACH_PX / px_per_mm
}

/// A pixel of a view of a part.
#[derive(Debug, Clone, Copy)]
pub struct Pointer<'a> {
    /// What clicks are told from.
    pub picker: &'a Picker,
    /// From where it is looked at.
    pub camera: &'a Camera,
    /// Pixels from the view's left top corner.
    pub pixel: [f64; 2],
    /// The view.
    pub size: ViewSize,
}

impl Pointer<'_> {
    /// The place of the CAD under the pointer.
    pub fn place(&self) -> Option<Point3> {
        self.picker.hit(&ray(self.camera, self.pixel, self.size)?).ok().map(|hit| hit.point)
    }

    /// Line of sight and reach.
    fn aim(&self) -> Result<(Ray, f64), NoProposal> {
        let ray = ray(self.camera, self.pixel, self.size).ok_or(NoProposal::PastThePart)?;
        let looked_at = self.picker.hit(&ray).map_or_else(|_| self.picker.part().bounds.centre(), |hit| hit.point);
        Ok((ray, reach_mm(self.camera, &looked_at, self.size)))
    }

    /// What a click proposes with a tool; `None` of the tools that propose nothing.
    pub fn propose(&self, tool: Tool) -> Option<Result<Proposal, NoProposal>> {
        let with = |propose: &dyn Fn(&Ray, f64) -> Result<Proposal, NoProposal>| {
            Some(self.aim().and_then(|(ray, reach_mm)| propose(&ray, reach_mm)))
        };
        match tool {
            Tool::Choose | Tool::Measure => None,
            Tool::Surface | Tool::Feature => with(&|ray, _| self.picker.surface_point(ray)),
            Tool::Edge => with(&|ray, reach| self.picker.edge_point(ray, reach)),
            Tool::Hole | Tool::FeatureHole => with(&|ray, reach| self.picker.hole(ray, reach)),
            Tool::Slot => with(&|ray, reach| self.picker.slot(ray, reach)),
        }
    }

    /// A shape that is dragged here: the same kind, turned as it was.
    pub fn drag(&self, shape: &Geometry) -> Result<Proposal, NoProposal> {
        let (ray, reach_mm) = self.aim()?;
        // A point that is dragged along an edge stays on it while the hand is not quite there.
        self.picker.again(shape, &ray, 3.0 * reach_mm)
    }
}

/// The list to which a tool adds.
pub fn list_of(tool: Tool) -> Option<List> {
    match tool {
        Tool::Choose | Tool::Measure => None,
        Tool::Surface | Tool::Edge | Tool::Hole => Some(List::Comparison),
        Tool::FeatureHole | Tool::Slot | Tool::Feature => Some(List::Feature),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vector3;
    use crate::gui::scene::camera::{StandardView, looking};
    use crate::part::{Part, PartSettings};
    use crate::plan::CadSide;
    use crate::run::RunContext;
    use crate::simulate::{BracketParameters, SyntheticPart, bracket};
    use std::sync::Arc;

    const SIZE: ViewSize = ViewSize { width: 900.0, height: 600.0 };

    fn sample() -> (SyntheticPart, Picker) {
        let made = bracket(&BracketParameters::default());
        let settings = PartSettings { cad_side: CadSide::Top, thickness_mm: 1.2, plan_directions: Vec::new() };
        let part = Part::prepare(made.mesh.clone(), String::new(), &settings, &RunContext::silent()).unwrap();
        let picker = Picker::new(Arc::new(part));
        (made, picker)
    }

    /// Cameras that look at a place square on and leaned, in both projections, from far off and from near.
    fn cameras(place: &Point3, normal: &Vector3) -> Vec<Camera> {
        let start = Camera {
            target: *place,
            cad_from_eye: StandardView::Isometric.cad_from_eye(normal),
            height_mm: 300.0,
            projection: Projection::Perspective,
        };
        let mut all = Vec::new();
        for height_mm in [400.0, 120.0, 12.0] {
            for projection in [Projection::Perspective, Projection::Parallel] {
                let camera = Camera { projection, ..start }.facing(place, normal, height_mm, true);
                let mut aside = camera;
                aside.target += aside.cad_from_eye * Vector3::new(0.2 * height_mm, -0.1 * height_mm, 0.0);
                all.extend([camera, aside]);
            }
        }
        all
    }

    /// A click on the picture of a place means that place, at every scale and in both projections.
    #[test]
    fn clicks_mean_what_is_seen_there() {
        let (made, picker) = sample();
        let mut clicks = 0;
        for point in &made.comparison {
            let (place, normal) = (point.geometry.position(), point.geometry.sheet_normal());
            let tool = match point.geometry.kind() {
                "surface" => Tool::Surface,
                "edge" => Tool::Edge,
                _ => Tool::Hole,
            };
            for camera in cameras(&place, &normal) {
                let seen = camera.project(&place, SIZE).unwrap();
                // Beside an edge and into a hole, as a hand does; within the reach.
                let pixel = if tool == Tool::Surface { [seen.x, seen.y] } else { [seen.x + 4.0, seen.y - 3.0] };
                let pointer = Pointer { picker: &picker, camera: &camera, pixel, size: SIZE };
                let px_mm = 1.0 / camera.px_per_mm(seen.depth_mm, SIZE).unwrap();
                let hidden = pointer.place().is_some_and(|hit| {
                    (hit - camera.target).dot(&camera.towards()) > (place - camera.target).dot(&camera.towards()) + 3.0
                });
                if hidden {
                    continue;
                }
                let told = pointer.propose(tool).unwrap().unwrap_or_else(|e| panic!("{} {camera:?}: {e}", point.name));
                assert_eq!(told.geometry.kind(), point.geometry.kind());
                // Five pixels along an edge, seen at a slant of 30 degrees and more; surface points to rounding, holes to their fit.
                let allowed = match tool {
                    Tool::Edge => 10.0 * px_mm + 0.01,
                    _ => 0.01,
                };
                let off = (told.geometry.position() - place).norm();
                assert!(off < allowed, "{} off {off} of {allowed}, {camera:?}", point.name);
                clicks += 1;
            }
        }
        assert!(clicks > 200, "{clicks} clicks were tried");
    }

    #[test]
    fn the_reach_is_that_of_the_hand_at_every_scale() {
        let (made, picker) = sample();
        let edge = made.comparison.iter().find(|p| p.geometry.kind() == "edge").unwrap();
        let Geometry::Edge { position, direction, normal } = edge.geometry else { panic!() };
        for height_mm in [400.0, 12.0] {
            for projection in [Projection::Perspective, Projection::Parallel] {
                let start = Camera {
                    target: position,
                    cad_from_eye: StandardView::Top.cad_from_eye(&normal),
                    height_mm,
                    projection,
                };
                let camera = Camera { cad_from_eye: looking(&normal, &direction), ..start };
                // The edge lies across the middle of the picture, out of the sheet is up.
                let told = |up: f64| {
                    let pixel = [0.5 * SIZE.width, 0.5 * SIZE.height - up];
                    Pointer { picker: &picker, camera: &camera, pixel, size: SIZE }.propose(Tool::Edge).unwrap()
                };
                assert!(told(10.0).is_ok() && told(-10.0).is_ok(), "{height_mm} {projection:?}");
                assert!(matches!(told(-20.0), Err(NoProposal::EdgeTooFar { .. })), "{height_mm} {projection:?}");
            }
        }
    }

    #[test]
    fn a_shape_is_dragged_along_the_edge_and_not_off_it() {
        let (made, picker) = sample();
        let edge = made.comparison.iter().find(|p| p.geometry.kind() == "edge").unwrap();
        let Geometry::Edge { position, direction, normal } = edge.geometry else { panic!() };
        let camera = Camera {
            target: position,
            cad_from_eye: looking(&normal, &direction),
            height_mm: 60.0,
            projection: Projection::Parallel,
        };
        let at = |x: f64, y: f64| Pointer {
            picker: &picker,
            camera: &camera,
            pixel: [0.5 * SIZE.width + x, 0.5 * SIZE.height - y],
            size: SIZE,
        };
        let moved = at(40.0, 25.0).drag(&edge.geometry).unwrap().geometry;
        // 40 pixels of 0.1 mm along the edge.
        let along = (moved.position() - position).norm();
        assert!((along - 4.0).abs() < 0.1, "{along}");
        assert!(picker.part().face(crate::plan::Side::Top).edge_distance_mm(&moved.position()) < 1.3);
        assert!(at(0.0, 60.0).drag(&edge.geometry).is_err());
    }
}
