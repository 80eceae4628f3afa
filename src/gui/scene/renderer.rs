//! What a scene is asked to draw; whoever draws it is behind one trait, so that another graphics library is a matter of one file.

use super::camera::{Camera, Projection, ViewSize};
use super::content::{MapContent, PartContent, Shown};
use super::points::Points;
use crate::report::palette::{Rgb, Scale};
use std::sync::Arc;

/// What is drawn of a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Layer {
    /// The CAD in grey.
    Cad,
    /// The deviation map on the CAD's face.
    Surface,
    /// The scan's points.
    Cloud,
}

/// Which classes of points are drawn: a bit for each of `Shown`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Classes(pub u8);

impl Classes {
    /// Only what carries a value.
    pub const VALUES: Classes = Classes(1);

    /// Whether a class is drawn.
    pub fn has(self, class: Shown) -> bool {
        self.0 >> (class as u8) & 1 == 1
    }

    /// The same with a class added or taken away.
    pub fn with(self, class: Shown, drawn: bool) -> Classes {
        let bit = 1 << (class as u8);
        Classes(if drawn { self.0 | bit } else { self.0 & !bit })
    }
}

/// Colours of what is not deviation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Tones {
    /// Behind everything.
    pub background: Rgb,
    /// Outlines.
    pub outline: Rgb,
    /// The CAD.
    pub cad: Rgb,
    /// The sheet's other side.
    pub reverse: Rgb,
    /// The two greys of "no data".
    pub hatch: [Rgb; 2],
    /// Kept points without a value.
    pub flagged: Rgb,
    /// Points that were removed.
    pub removed: Rgb,
}

/// What a view shows, whole: two equal requests give the same picture.
#[derive(Debug, Clone)]
pub struct Request {
    /// The part.
    pub part: Arc<PartContent>,
    /// The result, if there is one; without one, only `Layer::Cad` shows anything.
    pub map: Option<Arc<MapContent>>,
    /// What is drawn.
    pub layer: Layer,
    /// From where.
    pub camera: Camera,
    /// Pixels across and down.
    pub size_px: [u32; 2],
    /// Pixels a point of the window.
    pub px_per_point: f64,
    /// Colours of deviations.
    pub scale: Scale,
    /// Other colours.
    pub tones: Tones,
    /// Which points.
    pub classes: Classes,
    /// Typical distance between neighbouring points, mm.
    pub spacing_mm: f64,
    /// The camera is on its way: a quick picture now is better than a good one later.
    pub moving: bool,
}

impl Request {
    /// Whether the other one asks for the same picture.
    pub fn same_picture(&self, other: &Request) -> bool {
        let same_map = match (&self.map, &other.map) {
            (Some(a), Some(b)) => Arc::ptr_eq(a, b),
            (None, None) => true,
            _ => false,
        };
        same_map
            && Arc::ptr_eq(&self.part, &other.part)
            && (self.layer, self.size_px, self.tones, self.classes, self.moving)
                == (other.layer, other.size_px, other.tones, other.classes, other.moving)
            && (self.camera, self.px_per_point, self.scale, self.spacing_mm)
                == (other.camera, other.px_per_point, other.scale, other.spacing_mm)
    }
}

/// A cloud with a colour for every point, which belongs to no CAD.
#[derive(Debug, Clone)]
pub struct CloudRequest {
    /// Its points.
    pub points: Arc<Points>,
    /// Red, green, blue of each, and whether it is drawn at all (not 0); as many as there are points.
    pub colours: Arc<Vec<[u8; 4]>>,
    /// From where.
    pub camera: Camera,
    /// Pixels across and down.
    pub size_px: [u32; 2],
    /// Pixels a point of the window.
    pub px_per_point: f64,
    /// Behind the points.
    pub background: Rgb,
    /// The camera is on its way.
    pub moving: bool,
}

impl CloudRequest {
    /// Whether the other one asks for the same picture.
    pub fn same_picture(&self, other: &CloudRequest) -> bool {
        Arc::ptr_eq(&self.points, &other.points)
            && Arc::ptr_eq(&self.colours, &other.colours)
            && (self.size_px, self.background, self.moving) == (other.size_px, other.background, other.moving)
            && (self.camera, self.px_per_point) == (other.camera, other.px_per_point)
    }
}

/// How far a picture is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    /// Nothing is left to draw.
    Done,
    /// Another call draws more of the same picture; until then the earlier one is shown.
    More,
}

/// Draws scenes into pictures that it keeps, and shows them.
pub trait SceneRenderer: Send {
    /// Goes on with the picture of a view; draws nothing when it is there already.
    fn draw(&mut self, view: usize, request: &Request) -> Result<Progress, String>;

    /// The same of a cloud without a CAD.
    fn draw_cloud(&mut self, view: usize, request: &CloudRequest) -> Result<Progress, String>;

    /// Shows the picture of a view. Pixels of the window count from its bottom left corner.
    fn show(&mut self, view: usize, at: Placement) -> Result<(), String>;
}

/// Where on the window's surface a picture is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Placement {
    /// Size of the window.
    pub window: [u32; 2],
    /// Left, bottom, width, height of the view.
    pub view: [i32; 4],
    /// Left, bottom, width, height of what of it may be seen.
    pub clip: [i32; 4],
}

/// A matrix by columns, in single precision.
pub type Columns4 = [[f32; 4]; 4];

/// How the scene is projected: from millimetres about the part's centre to clip coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lens {
    /// Clip coordinates from the scene.
    pub clip_from_scene: Columns4,
    /// Turns normals into the eye's frame.
    pub eye_from_scene: [[f32; 3]; 3],
    /// Distances from the eye between which something is drawn, mm.
    pub near_far_mm: [f64; 2],
}

impl Lens {
    /// Of a camera that sees everything within `radius_mm` of the scene's centre.
    pub fn of(camera: &Camera, centre: &crate::geometry::Point3, radius_mm: f64, size: ViewSize) -> Lens {
        let distance = camera.distance_mm();
        let middle = camera.eye_from_cad(centre);
        let (nearest, farthest) = (distance - middle.z - 1.01 * radius_mm, distance - middle.z + 1.01 * radius_mm);
        let (near, far) = match camera.projection {
            Projection::Perspective => {
                let near = nearest.max(super::camera::NEAR * distance);
                (near, farthest.max(1.01 * near))
            }
            Projection::Parallel => (nearest, farthest.max(nearest + 1e-3)),
        };
        let turn = camera.cad_from_eye.inverse().to_rotation_matrix();
        let scale_y = 2.0 / camera.height_mm;
        let scale_x = scale_y * size.height / size.width;
        // Rows of the projection over (x, y, z, 1) of the eye's frame.
        let projection: [[f64; 4]; 4] = match camera.projection {
            Projection::Parallel => [
                [scale_x, 0.0, 0.0, 0.0],
                [0.0, scale_y, 0.0, 0.0],
                [0.0, 0.0, -2.0 / (far - near), (2.0 * distance - far - near) / (far - near)],
                [0.0, 0.0, 0.0, 1.0],
            ],
            Projection::Perspective => [
                [scale_x * distance, 0.0, 0.0, 0.0],
                [0.0, scale_y * distance, 0.0, 0.0],
                {
                    let (a, b) = ((far + near) / (far - near), -2.0 * far * near / (far - near));
                    [0.0, 0.0, -a, a * distance + b]
                },
                [0.0, 0.0, -1.0, distance],
            ],
        };
        let moved: [[f64; 4]; 4] = std::array::from_fn(|r| {
            std::array::from_fn(|c| if c < 3 { turn[(r.min(2), c)] } else { middle[r.min(2)] })
        });
        let entry = |row: usize, column: usize| {
            let across: f64 = (0..3).map(|k| projection[row][k] * moved[k][column]).sum();
            across + if column == 3 { projection[row][3] } else { 0.0 }
        };
        Lens {
            clip_from_scene: std::array::from_fn(|c| std::array::from_fn(|r| entry(r, c) as f32)),
            eye_from_scene: std::array::from_fn(|c| std::array::from_fn(|r| turn[(r, c)] as f32)),
            near_far_mm: [near, far],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::camera::StandardView;
    use super::*;
    use crate::geometry::{Point3, Vector3};

    /// Pixels as the graphics card computes them must be those of the camera, or markers would stand beside their places.
    #[test]
    fn the_card_projects_as_the_camera_does() {
        let size = ViewSize { width: 700.0, height: 500.0 };
        let centre = Point3::new(20.0, -30.0, 5.0);
        for view in StandardView::ALL {
            for projection in [Projection::Perspective, Projection::Parallel] {
                let turn = view.cad_from_eye(&Vector3::z());
                let camera =
                    Camera { target: Point3::new(25.0, -20.0, 0.0), cad_from_eye: turn, height_mm: 150.0, projection };
                let lens = Lens::of(&camera, &centre, 90.0, size);
                for point in [Point3::new(60.0, -10.0, 20.0), Point3::new(0.0, -60.0, -9.0), centre] {
                    let seen = camera.project(&point, size).unwrap();
                    let v = point - centre;
                    let m = lens.clip_from_scene;
                    let clip: Vec<f64> = (0..4)
                        .map(|r| (0..3).map(|c| f64::from(m[c][r]) * v[c]).sum::<f64>() + f64::from(m[3][r]))
                        .collect();
                    let x = (0.5 + 0.5 * clip[0] / clip[3]) * size.width;
                    let y = (0.5 - 0.5 * clip[1] / clip[3]) * size.height;
                    // Single precision: 700 px times 1e-7 times a few operations.
                    assert!((x - seen.x).abs() < 1e-2 && (y - seen.y).abs() < 1e-2, "{view:?} {projection:?}");
                    assert!((clip[2] / clip[3]).abs() <= 1.0, "{view:?} {projection:?}");
                }
            }
        }
    }

    #[test]
    fn nearer_places_have_less_depth() {
        let size = ViewSize { width: 700.0, height: 500.0 };
        for projection in [Projection::Perspective, Projection::Parallel] {
            let turn = StandardView::Top.cad_from_eye(&Vector3::z());
            let camera = Camera { target: Point3::origin(), cad_from_eye: turn, height_mm: 150.0, projection };
            let m = Lens::of(&camera, &Point3::origin(), 90.0, size).clip_from_scene;
            let depth = |z: f32| (m[2][2] * z + m[3][2]) / (m[2][3] * z + m[3][3]);
            assert!(depth(10.0) < depth(0.0) && depth(0.0) < depth(-10.0), "{projection:?}");
        }
    }

    #[test]
    fn classes_are_bits() {
        let classes = Classes::VALUES.with(Shown::Belt, true);
        assert!(classes.has(Shown::Value) && classes.has(Shown::Belt) && !classes.has(Shown::Other));
        assert_eq!(classes.with(Shown::Belt, false), Classes::VALUES);
    }
}
