//! Places on the actual part: where a line meets its face, where its trimmed edge runs, where its holes are.

use super::caster::Caster;
use super::subject::{Subject, boundary_edges};
use super::truth::Deviation;
use crate::geometry::{Isometry3, Mesh, Point3, Vector3};
use crate::plan::{Geometry, Side};

/// Places on a rim that stand for it.
const RIM_PLACES: usize = 720;
/// Nothing farther from its nominal place belongs to it.
const FARTHEST_MM: f64 = 20.0;

/// The actual part as seen from a side.
pub(super) struct Actual<'a> {
    pub subject: &'a Subject,
    offset_mm: f64,
    face: Mesh,
    caster: Caster,
    rim: Vec<[u32; 2]>,
}

/// A feature of the actual part, CAD frame, on the CAD's own face.
#[derive(Debug, Clone)]
pub(super) struct Found {
    pub place: Point3,
    pub axis: Vector3,
    pub diameter_mm: Option<f64>,
    pub direction: Option<Vector3>,
}

impl<'a> Actual<'a> {
    pub fn new(subject: &'a Subject, side: Side) -> Self {
        let face = subject.face(side);
        let caster = Caster::new(&face);
        let rim = boundary_edges(&face);
        Self { subject, offset_mm: subject.face_offset_mm(side), face, caster, rim }
    }

    /// Deviation of a comparison point when the actual part is moved by `motion` (from the true pose); `None` when the
    /// part has nothing there.
    pub fn deviation(&self, index: usize, motion: &Isometry3) -> Option<Deviation> {
        let plain = |deviation_mm| Deviation { deviation_mm, delta_mm: None, diameter_mm: None };
        match &self.subject.plan.comparison[index].geometry {
            Geometry::Surface { position, direction } => self.surface(position, direction, motion).map(plain),
            Geometry::Edge { position, direction, normal } => self.edge(position, direction, normal, motion).map(plain),
            Geometry::Hole { centre, axis, direction, .. } => {
                let found = self.opening(&self.subject.actual_comparison[index], motion)?;
                let delta = found.place - centre;
                let delta = delta - axis.into_inner() * delta.dot(axis);
                Some(Deviation {
                    deviation_mm: direction.map_or(delta.norm(), |d| delta.dot(&d)),
                    delta_mm: Some(delta.into()),
                    diameter_mm: found.diameter_mm,
                })
            }
            Geometry::Slot { .. } => None,
        }
    }

    /// A feature of the plan on the moved part.
    pub fn feature(&self, index: usize, motion: &Isometry3) -> Option<Found> {
        let axis_at = |place: Point3, axis: Vector3| Found { place, axis, diameter_mm: None, direction: None };
        match &self.subject.plan.features[index].geometry {
            Geometry::Surface { position, direction } => {
                let deviation = self.surface(position, direction, motion)?;
                Some(axis_at(position + direction.into_inner() * deviation, direction.into_inner()))
            }
            Geometry::Edge { position, direction, normal } => {
                let deviation = self.edge(position, direction, normal, motion)?;
                Some(axis_at(position + direction.into_inner() * deviation, normal.into_inner()))
            }
            _ => self.opening(&self.subject.actual_features[index], motion),
        }
    }

    /// Where the line through the nominal place meets the moved face, from that place along the direction, mm.
    fn surface(&self, position: &Point3, direction: &Vector3, motion: &Isometry3) -> Option<f64> {
        let origin = motion.inverse_transform_point(&(position + direction * self.offset_mm));
        let direction = motion.inverse_transform_vector(direction);
        // Both ways from the place; a hair of overlap, so that a place exactly on the face is met.
        let hair = 1e-3;
        let ahead = self.caster.first(&(origin - direction * hair), &direction, 0.0, FARTHEST_MM).map(|h| h.t - hair);
        let behind = self.caster.first(&(origin + direction * hair), &-direction, 0.0, FARTHEST_MM).map(|h| hair - h.t);
        [ahead, behind].into_iter().flatten().min_by(|a, b| a.abs().total_cmp(&b.abs()))
    }

    /// Where the moved face's rim crosses the plane through the nominal edge across the edge, from there outwards, mm.
    fn edge(&self, position: &Point3, outwards: &Vector3, normal: &Vector3, motion: &Isometry3) -> Option<f64> {
        let nominal = motion.inverse_transform_point(&(position + normal * self.offset_mm));
        let outwards = motion.inverse_transform_vector(outwards);
        let along = motion.inverse_transform_vector(normal).cross(&outwards);
        let crossing = |[a, b]: &[u32; 2]| {
            let (a, b) = (self.face.vertices[*a as usize] - nominal, self.face.vertices[*b as usize] - nominal);
            let (s, t) = (a.dot(&along), b.dot(&along));
            ((s <= 0.0) != (t <= 0.0)).then(|| a + (b - a) * (s / (s - t)))
        };
        let nearest = self.rim.iter().filter_map(crossing).min_by(|a, b| a.norm().total_cmp(&b.norm()))?;
        (nearest.norm() < FARTHEST_MM).then(|| nearest.dot(&outwards))
    }

    /// A hole or a slot, made with its own parameters, displaced and moved: the middle of its rim on the seen face, taken
    /// back to the CAD's own face by the thickness.
    fn opening(&self, geometry: &Geometry, motion: &Isometry3) -> Option<Found> {
        let (rim, slot_ends) = self.rim_of(geometry)?;
        let rim: Vec<Point3> = rim.iter().map(|p| motion * self.subject.displaced(p)).collect();
        let middle = Point3::from(rim.iter().map(|p| p.coords).sum::<Vector3>() / rim.len() as f64);
        let turn = |k: usize| (rim[k] - middle).cross(&(rim[(k + 1) % rim.len()] - middle));
        let axis = (0..rim.len()).map(turn).sum::<Vector3>().try_normalize(0.0)?;
        let in_sheet = |p: &Point3| {
            let r = p - middle;
            (r - axis * r.dot(&axis)).norm()
        };
        let mean_radius = rim.iter().map(in_sheet).sum::<f64>() / rim.len() as f64;
        let moved = |p: &Point3| motion * self.subject.displaced(p);
        Some(Found {
            place: middle - axis * self.offset_mm,
            axis,
            diameter_mm: slot_ends.is_none().then_some(2.0 * mean_radius),
            direction: slot_ends.and_then(|[a, b]| (moved(&b) - moved(&a)).try_normalize(0.0)),
        })
    }

    /// Places evenly along the rim on the seen face, counter-clockwise about the axis; of a slot also the middles of its
    /// end arcs.
    fn rim_of(&self, geometry: &Geometry) -> Option<(Vec<Point3>, Option<[Point3; 2]>)> {
        let turned = |k: usize, n: usize| (std::f64::consts::TAU * k as f64 / n as f64).sin_cos();
        match geometry {
            Geometry::Hole { centre, axis, diameter_mm, .. } => {
                let x = super::placing::across(axis);
                let y = axis.cross(&x);
                let middle = centre + axis.into_inner() * self.offset_mm;
                let place = |k| {
                    let (sin, cos) = turned(k, RIM_PLACES);
                    middle + (x * cos + y * sin) * (0.5 * diameter_mm)
                };
                Some(((0..RIM_PLACES).map(place).collect(), None))
            }
            Geometry::Slot { centre, axis, direction, length_mm, width_mm } => {
                let middle = centre + axis.into_inner() * self.offset_mm;
                let (x, y) = (direction.into_inner(), axis.cross(direction));
                let (half, radius) = (0.5 * (length_mm - width_mm), 0.5 * width_mm);
                let perimeter = 4.0 * half + std::f64::consts::TAU * radius;
                let place = |k: usize| {
                    // From the middle of the right arc, counter-clockwise.
                    let s = perimeter * (k as f64 + 0.5) / RIM_PLACES as f64;
                    let quarter = std::f64::consts::FRAC_PI_2 * radius;
                    let (u, v) = if s < quarter || s > perimeter - quarter {
                        let angle = s / radius - if s < quarter { 0.0 } else { perimeter / radius };
                        (half + radius * angle.cos(), radius * angle.sin())
                    } else if s < quarter + 2.0 * half {
                        (half - (s - quarter), radius)
                    } else if s < 3.0 * quarter + 2.0 * half {
                        let angle = (s - 2.0 * half) / radius;
                        (-half + radius * angle.cos(), radius * angle.sin())
                    } else {
                        (-half + (s - 3.0 * quarter - 2.0 * half), -radius)
                    };
                    middle + x * u + y * v
                };
                Some(((0..RIM_PLACES).map(place).collect(), Some([middle - x * half, middle + x * half])))
            }
            _ => None,
        }
    }
}
