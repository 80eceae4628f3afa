//! The CAD's own surface under a ray.

use super::super::{Face, Part};
use super::NoProposal;
use crate::geometry::{Point3, UnitVector3, Vector3};
use crate::plan::{CadSide, Side};
use std::sync::Arc;

/// Where the facets around a place lean more than this off the one that was hit, rad, its own normal is taken.
const SHARP: f64 = 20.0 * std::f64::consts::PI / 180.0;

/// A line of sight, CAD frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Where it begins, mm.
    pub origin: Point3,
    /// Where it goes; any length but 0.
    pub direction: UnitVector3,
}

impl Ray {
    /// Foot of a place on the ray, as the distance along it, mm.
    pub(super) fn along(&self, p: &Point3) -> f64 {
        (p - self.origin).dot(&self.direction)
    }
}

/// Where a ray meets the CAD.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// The place, on the CAD's own surface.
    pub point: Point3,
    /// The CAD's normal there, smoothed between the corners of its facet unless the sheet bends sharply.
    pub normal: UnitVector3,
    /// Distance along the ray, mm.
    pub along_mm: f64,
    /// Whether the normal is that of one facet beside a sharp bend.
    pub sharp: bool,
}

/// What clicks are told from. Made once for a part.
#[derive(Debug, Clone)]
pub struct Picker {
    part: Arc<Part>,
    /// The CAD itself where neither face of the sheet is.
    middle: Option<Box<Face>>,
}

/// A face that is the CAD's own surface, and what turns its normals into the CAD's.
#[derive(Clone, Copy)]
pub(super) struct Surface<'p> {
    pub face: &'p Face,
    pub sign: f64,
}

impl Picker {
    /// For a part.
    pub fn new(part: Arc<Part>) -> Self {
        let is_middle = part.cad_side == CadSide::Middle && part.thickness_mm != 0.0;
        let middle = is_middle.then(|| Box::new(Face::new(Side::Top, part.mesh.clone())));
        Self { part, middle }
    }

    /// The part.
    pub fn part(&self) -> &Arc<Part> {
        &self.part
    }

    pub(super) fn surfaces(&self) -> Vec<Surface<'_>> {
        let face = |side| self.part.face(side);
        match (&self.middle, self.part.cad_side) {
            (Some(middle), _) => vec![Surface { face: middle, sign: 1.0 }],
            (None, CadSide::Top | CadSide::Middle) => vec![Surface { face: face(Side::Top), sign: 1.0 }],
            (None, CadSide::Bottom) => vec![Surface { face: face(Side::Bottom), sign: -1.0 }],
            (None, CadSide::Solid) => {
                vec![Surface { face: face(Side::Top), sign: 1.0 }, Surface { face: face(Side::Bottom), sign: 1.0 }]
            }
        }
    }

    /// Where a ray first meets the CAD, from either side.
    ///
    /// # Errors
    /// It does not.
    pub fn hit(&self, ray: &Ray) -> Result<Hit, NoProposal> {
        let hits = self.surfaces().into_iter().filter_map(|surface| {
            let hit = surface.face.bvh.ray(&ray.origin, &ray.direction, f64::INFINITY)?;
            let point = ray.origin + ray.direction.into_inner() * hit.t;
            let (normal, sharp) = surface.normal(hit.triangle as usize, &point)?;
            Some(Hit { point, normal, along_mm: hit.t, sharp })
        });
        hits.min_by(|a, b| a.along_mm.total_cmp(&b.along_mm)).ok_or(NoProposal::PastThePart)
    }
}

impl Surface<'_> {
    /// The CAD's normal at a place of a facet, and whether it is that of the facet alone.
    pub fn normal(&self, triangle: usize, at: &Point3) -> Option<(UnitVector3, bool)> {
        let mesh = &self.face.mesh;
        let facet = mesh.normal(triangle)?;
        let corners = mesh.triangles[triangle].map(|v| self.face.vertex_normals[v as usize]);
        let weights = barycentric(&mesh.corners(triangle), at);
        let smooth: Vector3 =
            corners.iter().zip(weights).filter_map(|(n, w)| n.try_normalize(1e-300).map(|n| n * w)).sum();
        let smooth = UnitVector3::try_new(smooth, 1e-9).filter(|n| n.angle(&facet) <= SHARP);
        let told = smooth.unwrap_or(facet);
        Some((UnitVector3::new_unchecked(told.into_inner() * self.sign), smooth.is_none()))
    }
}

/// Weights of a triangle's corners at a place in its plane, none below 0.
fn barycentric(corners: &[Point3; 3], at: &Point3) -> [f64; 3] {
    let [a, b, c] = corners;
    let whole = (b - a).cross(&(c - a));
    let share = |p: &Point3, q: &Point3| ((p - at).cross(&(q - at)).dot(&whole) / whole.norm_squared()).max(0.0);
    [share(b, c), share(c, a), share(a, b)]
}
