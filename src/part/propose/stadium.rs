//! A slot with round ends fitted to the points of its rim.
//!
//! In the rim's plane the slot is all that is nearer than r to a straight line of length 2 a. A point's residual is its distance from
//! that line minus r; centre, angle, a and r are free.

use super::super::rims::Rim;
use crate::fit::FitError;
use crate::fit::gauss_newton::{Shape, minimise};
use crate::geometry::{Point3, UnitVector3, Vector3};
use nalgebra::SVector;

/// A slot in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stadium {
    pub centre: Point3,
    /// Normal of its plane.
    pub axis: UnitVector3,
    /// Its long axis.
    pub along: UnitVector3,
    /// Half of the straight part's length.
    pub half_straight_mm: f64,
    /// Half of its width.
    pub radius_mm: f64,
    /// How far the farthest point is off, in the plane and out of it.
    pub off_mm: f64,
}

/// A slot in its plane, lengths as shares of the rim's length: z is not looked at.
#[derive(Debug, Clone, Copy)]
struct Flat {
    centre: [f64; 2],
    angle: f64,
    half: f64,
    radius: f64,
}

impl Flat {
    /// A point in the slot's own frame, and what of it points away from the middle line.
    fn local(&self, p: &Point3) -> ([f64; 2], [f64; 2]) {
        let (sin, cos) = self.angle.sin_cos();
        let d = [p.x - self.centre[0], p.y - self.centre[1]];
        let own = [cos * d[0] + sin * d[1], cos * d[1] - sin * d[0]];
        (own, [own[0] - own[0].clamp(-self.half, self.half), own[1]])
    }
}

impl Shape<5, 1> for Flat {
    fn residuals(&self, point: &Point3) -> ([f64; 1], [[f64; 5]; 1]) {
        let (own, away) = self.local(point);
        let distance = away[0].hypot(away[1]);
        let n = if distance > 0.0 { [away[0] / distance, away[1] / distance] } else { [0.0, 1.0] };
        let (sin, cos) = self.angle.sin_cos();
        let by_half = -n[0] * own[0].signum();
        let row =
            [-(cos * n[0] - sin * n[1]), -(sin * n[0] + cos * n[1]), n[0] * own[1] - n[1] * own[0], by_half, -1.0];
        ([distance - self.radius], [row])
    }

    fn moved(&self, step: &SVector<f64, 5>) -> Self {
        Self {
            centre: [self.centre[0] + step[0], self.centre[1] + step[1]],
            angle: self.angle + step[2],
            half: self.half + step[3],
            radius: self.radius + step[4],
        }
    }

    fn is_sound(&self) -> bool {
        self.half > 0.0 && self.radius > 0.0 && self.half + self.radius < 10.0
    }
}

/// Fits a slot to the points of a rim.
///
/// # Errors
/// The points do not fix one.
pub(super) fn fit_stadium(points: &[Point3], rim: &Rim) -> Result<Stadium, FitError> {
    let (u, v) = (rim.long_axis, rim.axis.cross(&rim.long_axis));
    let scale = rim.length_mm;
    let flat: Vec<Point3> =
        points.iter().map(|p| p - rim.centre).map(|d| Point3::new(d.dot(&u) / scale, d.dot(&v) / scale, 0.0)).collect();
    let radius = 0.5 * rim.width_mm / scale;
    let start = Flat { centre: [0.0; 2], angle: 0.0, half: 0.5 - radius, radius };
    let fitted = minimise::<_, 5, 1>(start, &flat, &[])?.shape;
    let in_space = |x: f64, y: f64| u.into_inner() * x + v * y;
    let off = |(p, q): (&Point3, &Point3)| {
        let in_plane = fitted.residuals(q).0[0] * scale;
        in_plane.hypot((p - rim.centre).dot(&rim.axis))
    };
    let along: Vector3 = in_space(fitted.angle.cos(), fitted.angle.sin());
    Ok(Stadium {
        centre: rim.centre + in_space(fitted.centre[0], fitted.centre[1]) * scale,
        axis: rim.axis,
        along: UnitVector3::new_normalize(along),
        half_straight_mm: fitted.half * scale,
        radius_mm: fitted.radius * scale,
        off_mm: points.iter().zip(&flat).map(off).fold(0.0, f64::max),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The derivatives match central differences of the residual; the error of those is about h² times a third derivative of
    /// order one, h = 1e-5.
    #[test]
    fn derivatives_match_differences() {
        let shape = Flat { centre: [0.03, -0.02], angle: 0.2, half: 0.3, radius: 0.16 };
        for k in 0..40 {
            let (sin, cos) = (0.157 * f64::from(k)).sin_cos();
            let p = Point3::new(0.55 * cos, 0.3 * sin, 0.0);
            let (_, [row]) = shape.residuals(&p);
            for (c, derivative) in row.iter().enumerate() {
                let at =
                    |h: f64| shape.moved(&SVector::from_fn(|r, _| if r == c { h } else { 0.0 })).residuals(&p).0[0];
                assert!(((at(1e-5) - at(-1e-5)) / 2e-5 - derivative).abs() < 1e-8, "{k} {c}");
            }
        }
    }
}
