//! What the sensor looks at, in the world's frame.

use crate::geometry::{Mesh, Point3, Vector3};
use crate::simulate::caster::Caster;
use std::sync::Arc;

/// A shape without wear.
#[derive(Debug, Clone)]
pub enum Shape {
    /// z = 0, seen from above.
    Plane,
    /// About the origin, seen from outside.
    Sphere {
        /// Its radius.
        radius: f64,
    },
    /// About the x axis, seen from outside.
    Cylinder {
        /// Its radius.
        radius: f64,
    },
    /// Triangles with their normals, seen from the side of the normals.
    Mesh(Arc<MeshShape>),
}

/// A mesh with what rays need.
#[derive(Debug, Clone)]
pub struct MeshShape {
    /// Its triangles.
    pub mesh: Mesh,
    caster: Caster,
}

impl Shape {
    /// Of triangles.
    pub fn mesh(mesh: Mesh) -> Self {
        let caster = Caster::new(&mesh);
        Shape::Mesh(Arc::new(MeshShape { mesh, caster }))
    }
}

/// Material that is gone (or, of negative depth, came on), along the surface's normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pocket {
    /// Its middle on the surface.
    pub centre: Point3,
    /// Up to here from the middle something is gone.
    pub radius: f64,
    /// Within `flat * radius` the whole depth is gone, further out less and less.
    pub flat: f64,
    /// How deep.
    pub depth: f64,
}

impl Pocket {
    /// What is gone at a place.
    pub fn depth_at(&self, place: &Point3) -> f64 {
        let out = (place - self.centre).norm() / self.radius;
        match out {
            o if o <= self.flat => self.depth,
            o if o < 1.0 => {
                self.depth * 0.5 * (1.0 + (std::f64::consts::PI * (o - self.flat) / (1.0 - self.flat)).cos())
            }
            _ => 0.0,
        }
    }
}

/// A shape with its wear.
#[derive(Debug, Clone)]
pub struct Surface {
    /// As it was made.
    pub shape: Shape,
    /// What is gone since.
    pub pockets: Vec<Pocket>,
}

/// Where a ray met the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Met {
    /// Distance along the ray of a unit direction.
    pub t: f64,
    /// Unit normal of the shape, towards the side that is seen.
    pub normal: Vector3,
}

impl Surface {
    /// A shape without wear.
    pub fn unworn(shape: Shape) -> Self {
        Self { shape, pockets: Vec::new() }
    }

    /// How high a place near the surface stands over the unworn shape because of its wear.
    pub fn raised(&self, place: &Point3) -> f64 {
        -self.pockets.iter().map(|pocket| pocket.depth_at(place)).sum::<f64>()
    }

    /// Where a ray of unit direction meets the surface from the side that is seen.
    pub(super) fn meet(&self, origin: &Point3, direction: &Vector3) -> Option<Met> {
        let mut met = self.shape.meet(origin, direction)?;
        if self.pockets.is_empty() {
            return Some(met);
        }
        let foot = met;
        // Down the ray until the height over the shape is that of the wear; each step leaves a share of the wear's slope.
        for _ in 0..12 {
            let place = origin + direction * met.t;
            let (height, normal) = self.shape.height(&place, origin, direction, &foot);
            met.t += (self.raised(&place) - height) / direction.dot(&normal);
            met.normal = normal;
        }
        Some(met)
    }

    /// Whether something stands between a place on the surface and the light.
    pub(super) fn is_shaded(&self, place: &Point3, light: &Point3, normal: &Vector3, hair: f64) -> bool {
        let towards = light - place;
        match &self.shape {
            Shape::Mesh(mesh) => {
                let from = place + normal * hair;
                mesh.caster.is_blocked(&from, &(light - from), 1e-6, 1.0)
            }
            // Plane and round shapes shade nothing but what is turned away.
            _ => towards.dot(normal) <= 0.0,
        }
    }
}

impl Shape {
    fn meet(&self, origin: &Point3, direction: &Vector3) -> Option<Met> {
        match self {
            Shape::Plane => {
                let t = -origin.z / direction.z;
                (t > 0.0 && direction.z < 0.0).then_some(Met { t, normal: Vector3::z() })
            }
            Shape::Sphere { radius } => round(*radius, &origin.coords, direction).map(|t| {
                let place = origin.coords + direction * t;
                Met { t, normal: place / *radius }
            }),
            Shape::Cylinder { radius } => {
                let across = |v: &Vector3| Vector3::new(0.0, v.y, v.z);
                round(*radius, &across(&origin.coords), &across(direction)).map(|t| {
                    let place = across(&(origin.coords + direction * t));
                    Met { t, normal: place / *radius }
                })
            }
            Shape::Mesh(mesh) => {
                let hit = mesh.caster.first(origin, direction, 0.0, f64::INFINITY)?;
                let normal = mesh.mesh.normal(hit.triangle as usize)?.into_inner();
                (normal.dot(direction) < 0.0).then_some(Met { t: hit.t, normal })
            }
        }
    }

    /// Height of a place over the shape and the normal below it; of a mesh over the triangle that was met.
    fn height(&self, place: &Point3, origin: &Point3, direction: &Vector3, met: &Met) -> (f64, Vector3) {
        let off = |v: Vector3, radius: f64| (v.norm() - radius, v.normalize());
        match self {
            Shape::Plane => (place.z, Vector3::z()),
            Shape::Sphere { radius } => off(place.coords, *radius),
            Shape::Cylinder { radius } => off(Vector3::new(0.0, place.y, place.z), *radius),
            Shape::Mesh(_) => ((place - (origin + direction * met.t)).dot(&met.normal), met.normal),
        }
    }
}

/// Where a ray first comes within a radius of the origin.
fn round(radius: f64, origin: &Vector3, direction: &Vector3) -> Option<f64> {
    let a = direction.norm_squared();
    let half_b = origin.dot(direction);
    let c = origin.norm_squared() - radius * radius;
    let rest = half_b * half_b - a * c;
    if rest < 0.0 || a == 0.0 {
        return None;
    }
    let t = (-half_b - rest.sqrt()) / a;
    (t > 0.0).then_some(t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_end_on_the_shape_and_in_its_pockets() {
        let pocket = |centre| Pocket { centre, radius: 300.0, flat: 0.6, depth: 20.0 };
        for (shape, top) in [
            (Shape::Plane, Point3::origin()),
            (Shape::Sphere { radius: 900.0 }, Point3::new(0.0, 0.0, 900.0)),
            (Shape::Cylinder { radius: 900.0 }, Point3::new(40.0, 0.0, 900.0)),
        ] {
            let worn = Surface { shape: shape.clone(), pockets: vec![pocket(top)] };
            let eye = Point3::new(2000.0, -1000.0, 9000.0);
            for k in 0..200 {
                let angle = 2.4 * f64::from(k);
                let aim = top + Vector3::new(angle.cos(), angle.sin(), 0.0) * (1.9 * f64::from(k));
                let direction = (aim - eye).normalize();
                let met = worn.meet(&eye, &direction).unwrap();
                let place = eye + direction * met.t;
                let height = match shape {
                    Shape::Plane => place.z,
                    Shape::Sphere { radius } => place.coords.norm() - radius,
                    _ => place.y.hypot(place.z) - 900.0,
                };
                assert!((height + pocket(top).depth_at(&place)).abs() < 1e-6, "{shape:?} {k}: {height}");
                assert!(met.normal.dot(&direction) < 0.0);
            }
        }
        assert!(
            Surface::unworn(Shape::Plane).meet(&Point3::new(0.0, 0.0, -5.0), &Vector3::z()).is_none(),
            "from behind"
        );
    }
}
