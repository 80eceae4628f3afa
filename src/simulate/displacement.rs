//! Smooth displacement fields: how a whole part is bent without any feature moving on its blank.

use crate::geometry::{Mesh, Point3, UnitVector3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Uniform};

/// One cause of displacement. CAD frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Displacement {
    /// The same everywhere.
    Shift(Vector3),
    /// Springback: grows with the square of the distance past a line.
    Springback {
        /// A point on the line.
        line: Point3,
        /// Across the line, the way the displacement grows.
        towards: UnitVector3,
        /// The displacement's direction.
        up: UnitVector3,
        /// Displacement in mm at 100 mm from the line.
        at_100_mm: f64,
    },
    /// Twist about an axis, to first order: `angle cross r`, the angle growing along the axis.
    Twist {
        /// A point on the axis where nothing turns.
        origin: Point3,
        /// The axis.
        axis: UnitVector3,
        /// Angle per length, rad/mm.
        rad_per_mm: f64,
    },
    /// A dent or bump: a Gaussian bell.
    Dent {
        /// Its deepest point.
        centre: Point3,
        /// Displacement there.
        displacement: Vector3,
        /// One sigma of the bell.
        sigma_mm: f64,
    },
}

/// A sum of displacements; empty: the part as it is.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct DisplacementField(pub Vec<Displacement>);

impl DisplacementField {
    /// No displacement.
    pub fn none() -> Self {
        Self::default()
    }

    /// The displacement in mm of the material that is nominally at `p` (CAD frame).
    pub fn at(&self, p: &Point3) -> Vector3 {
        let one = |d: &Displacement| match d {
            Displacement::Shift(shift) => *shift,
            Displacement::Springback { line, towards, up, at_100_mm } => {
                let distance = (p - line).dot(towards).max(0.0) / 100.0;
                up.into_inner() * (at_100_mm * distance * distance)
            }
            Displacement::Twist { origin, axis, rad_per_mm } => {
                let r = p - origin;
                axis.cross(&r) * (rad_per_mm * r.dot(axis))
            }
            Displacement::Dent { centre, displacement, sigma_mm } => {
                displacement * (-0.5 * (p - centre).norm_squared() / (sigma_mm * sigma_mm)).exp()
            }
        };
        self.0.iter().map(one).sum()
    }

    /// A place moved by the field.
    pub fn moved(&self, p: &Point3) -> Point3 {
        p + self.at(p)
    }

    /// A mesh moved by the field.
    #[must_use]
    pub fn moved_mesh(&self, mesh: &Mesh) -> Mesh {
        Mesh { vertices: mesh.vertices.iter().map(|p| self.moved(p)).collect(), triangles: mesh.triangles.clone() }
    }
}

/// A press's everyday scatter: springback about a line across the part's middle and a twist along it, each at the part's
/// ends of the order of `amplitude_mm`. The part lies about the origin of its box `min`..`max`, roughly flat in x and y.
pub fn draw_springback(seed: u64, amplitude_mm: f64, bounds: &crate::geometry::Aabb) -> DisplacementField {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut draw = |low: f64, high: f64| Uniform::new(low, high).map_or(0.0, |u| u.sample(&mut rng));
    let centre = bounds.centre();
    let reach = 0.5 * bounds.diagonal().max(1.0);
    let angle = draw(0.0, std::f64::consts::TAU);
    let towards = UnitVector3::new_normalize(Vector3::new(angle.cos(), angle.sin(), 0.0));
    let axis_angle = draw(0.0, std::f64::consts::PI);
    let springback = Displacement::Springback {
        line: centre,
        towards,
        up: Vector3::z_axis(),
        at_100_mm: draw(-1.0, 1.0) * amplitude_mm * (100.0 / reach).powi(2),
    };
    let twist = Displacement::Twist {
        origin: centre,
        axis: UnitVector3::new_normalize(Vector3::new(axis_angle.cos(), axis_angle.sin(), 0.0)),
        rad_per_mm: draw(-1.0, 1.0) * amplitude_mm * 2.0 / (reach * reach),
    };
    DisplacementField(vec![springback, twist])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn field_is_the_sum_of_its_causes() {
        let dent =
            Displacement::Dent { centre: Point3::origin(), displacement: Vector3::new(0.0, 0.0, -0.5), sigma_mm: 4.0 };
        let springback = Displacement::Springback {
            line: Point3::new(10.0, 0.0, 0.0),
            towards: Vector3::x_axis(),
            up: Vector3::z_axis(),
            at_100_mm: 0.8,
        };
        let field = DisplacementField(vec![dent, springback]);
        assert!((field.at(&Point3::origin()).z + 0.5).abs() < 1e-15);
        assert!((field.at(&Point3::new(60.0, 7.0, 1.0)).z - 0.2).abs() < 1e-12);
    }
}
