//! One fit of one kind to one set of points, as `shapeline fit` tells it.

use super::determined;
use super::robust::{TUKEY_WIDTH_SIGMAS, mad_scale_about_zero, tukey_weight};
use super::shapes::circle::{Circle, fit_circle, fit_circle_in_plane};
use super::shapes::cone::{Cone, fit_cone};
use super::shapes::cylinder::{Cylinder, fit_cylinder};
use super::shapes::line::{Line, fit_line};
use super::shapes::plane::{Plane, fit_plane};
use super::shapes::sphere::{Sphere, fit_sphere};
use super::shapes::{FitError, Normaliser};
use crate::geometry::{Point3, UnitVector3, Vector3};

/// The shapes that can be fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FitKind {
    /// Straight line.
    Line,
    /// Plane.
    Plane,
    /// Circle, in space or in a given plane.
    Circle,
    /// Sphere.
    Sphere,
    /// Cylinder.
    Cylinder,
    /// Cone.
    Cone,
}

impl FitKind {
    /// All of them.
    pub const ALL: [FitKind; 6] =
        [FitKind::Line, FitKind::Plane, FitKind::Circle, FitKind::Sphere, FitKind::Cylinder, FitKind::Cone];

    /// The word on the command line and in results.
    pub fn key(self) -> &'static str {
        match self {
            FitKind::Line => "line",
            FitKind::Plane => "plane",
            FitKind::Circle => "circle",
            FitKind::Sphere => "sphere",
            FitKind::Cylinder => "cylinder",
            FitKind::Cone => "cone",
        }
    }

    /// Points below which the shape is not fixed.
    pub fn points_needed(self) -> usize {
        match self {
            FitKind::Line => 2,
            FitKind::Plane | FitKind::Circle => 3,
            FitKind::Sphere => 4,
            FitKind::Cylinder => 5,
            FitKind::Cone => 6,
        }
    }

    /// Free parameters of the shape.
    fn parameters(self, in_plane: bool) -> usize {
        match self {
            FitKind::Line | FitKind::Sphere => 4,
            FitKind::Plane => 3,
            FitKind::Circle => 3 + if in_plane { 0 } else { 3 },
            FitKind::Cylinder => 5,
            FitKind::Cone => 6,
        }
    }
}

/// How points far from the shape are treated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FitMethod {
    /// All points count alike.
    LeastSquares,
    /// Least squares, then once more without the points beyond three standard deviations (endoscope paper).
    ThreeSigma,
    /// Tukey's biweight, iterated.
    Robust,
}

/// A coordinate plane for circles: coordinate 0, 1 or 2 has that value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoordinatePlane {
    /// 0 for x, 1 for y, 2 for z.
    pub axis: usize,
    /// Its value.
    pub value: f64,
}

/// A fitted shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fitted {
    /// A line.
    Line(Line),
    /// A plane.
    Plane(Plane),
    /// A circle.
    Circle(Circle),
    /// A sphere.
    Sphere(Sphere),
    /// A cylinder.
    Cylinder(Cylinder),
    /// A cone.
    Cone(Cone),
}

impl Fitted {
    /// Orthogonal distance of a point; signed where the shape has an outside.
    pub fn distance(&self, p: &Point3) -> f64 {
        match self {
            Fitted::Line(s) => s.distance(p),
            Fitted::Plane(s) => s.distance(p),
            Fitted::Circle(s) => s.distance(p),
            Fitted::Sphere(s) => s.distance(p),
            Fitted::Cylinder(s) => s.distance(p),
            Fitted::Cone(s) => s.distance(p),
        }
    }
}

/// A fit with how well it went.
#[derive(Debug, Clone, PartialEq)]
pub struct FitOutcome {
    /// The shape.
    pub shape: Fitted,
    /// Points given.
    pub points: usize,
    /// Root mean square distance of the points that were used.
    pub rms: f64,
    /// Standard deviation of their distances, degrees of freedom taken off.
    pub sigma: f64,
    /// Points left out by the three-sigma step, or of weight zero in the robust fit.
    pub rejected: usize,
    /// Condition of the fit's equations; large = weakly fixed.
    pub condition: f64,
}

/// Fits a shape. Lengths are in the unit of the points.
///
/// # Errors
/// Too few points, points that are not finite, points that do not fix the shape (`NotFixed`, `Degenerate`) or do not lie in the plane
/// given, and a fit that does not settle.
pub fn fit_points(
    kind: FitKind,
    points: &[Point3],
    method: FitMethod,
    plane: Option<CoordinatePlane>,
) -> Result<FitOutcome, FitError> {
    let (shape, condition) = fit_weighted(kind, points, &[], plane)?;
    match method {
        FitMethod::LeastSquares => outcome(kind, shape, condition, points, &[], plane),
        FitMethod::ThreeSigma => three_sigma(kind, points, &shape, plane),
        FitMethod::Robust => robust(kind, points, shape, plane),
    }
}

fn fit_weighted(
    kind: FitKind,
    points: &[Point3],
    weights: &[f64],
    plane: Option<CoordinatePlane>,
) -> Result<(Fitted, f64), FitError> {
    Normaliser::of(points, kind.points_needed())?;
    Ok(match kind {
        FitKind::Line => fit_line(points, weights).map(|(s, c)| (Fitted::Line(s), c))?,
        FitKind::Plane => fit_plane(points, weights).map(|(s, c)| (Fitted::Plane(s), c))?,
        FitKind::Circle => match plane {
            Some(CoordinatePlane { axis, value }) => {
                let unit = Vector3::from_fn(|k, _| if k == axis { 1.0 } else { 0.0 });
                let at = Point3::from(unit * value);
                let axis = UnitVector3::new_unchecked(unit);
                fit_circle_in_plane(points, weights, &axis, &at).map(|(s, c)| (Fitted::Circle(s), c))?
            }
            None => fit_circle(points, weights).map(|(s, c)| (Fitted::Circle(s), c))?,
        },
        FitKind::Sphere => fit_sphere(points, weights).map(|(s, c)| (Fitted::Sphere(s), c))?,
        FitKind::Cylinder => fit_cylinder(points, weights).map(|(s, c)| (Fitted::Cylinder(s), c))?,
        FitKind::Cone => fit_cone(points, weights).map(|(s, c)| (Fitted::Cone(s), c))?,
    })
}

/// Distances as the fit sees them: for a circle in a given plane only what lies in that plane.
fn distances(shape: &Fitted, points: &[Point3], plane: Option<CoordinatePlane>) -> Vec<f64> {
    match (shape, plane) {
        (Fitted::Circle(circle), Some(_)) => {
            points.iter().map(|p| (p - circle.centre).cross(&circle.axis).norm() - circle.radius).collect()
        }
        _ => points.iter().map(|p| shape.distance(p)).collect(),
    }
}

/// Figures of a fit over the points of positive weight; refuses a shape that they do not fix.
fn outcome(
    kind: FitKind,
    shape: Fitted,
    condition: f64,
    points: &[Point3],
    weights: &[f64],
    plane: Option<CoordinatePlane>,
) -> Result<FitOutcome, FitError> {
    let used = |k: usize| weights.get(k).is_none_or(|w| *w > 0.0);
    let used: Vec<Point3> = points.iter().enumerate().filter(|(k, _)| used(*k)).map(|(_, p)| *p).collect();
    let distances = distances(&shape, &used, plane);
    determined::check(&shape, &used, &distances, plane)?;
    let (rms, sigma) = rms_and_sigma(kind, &distances, plane);
    Ok(FitOutcome { shape, points: points.len(), rms, sigma, rejected: points.len() - used.len(), condition })
}

/// Root mean square of the distances, and their standard deviation with the shape's parameters taken off.
fn rms_and_sigma(kind: FitKind, distances: &[f64], plane: Option<CoordinatePlane>) -> (f64, f64) {
    let (n, sum) = (distances.len(), distances.iter().map(|d| d * d).sum::<f64>());
    // In space each point of a line or circle gives two residuals.
    let residuals = match (kind, plane) {
        (FitKind::Line, _) | (FitKind::Circle, None) => 2 * n,
        _ => n,
    };
    let freedom = residuals.saturating_sub(kind.parameters(plane.is_some()));
    let sigma = if freedom > 0 { (sum / freedom as f64).sqrt() } else { 0.0 };
    ((sum / n.max(1) as f64).sqrt(), sigma)
}

fn three_sigma(
    kind: FitKind,
    points: &[Point3],
    first: &Fitted,
    plane: Option<CoordinatePlane>,
) -> Result<FitOutcome, FitError> {
    let distances = distances(first, points, plane);
    let (rms, sigma) = rms_and_sigma(kind, &distances, plane);
    // Points that fit to rounding, or just as many points as parameters, leave nothing to reject.
    let size = Normaliser::of(points, kind.points_needed())?.scale;
    let limit = (3.0 * sigma).max(3.0 * rms).max(1e-12 * size);
    let kept: Vec<Point3> = points.iter().zip(distances).filter(|(_, d)| d.abs() <= limit).map(|(p, _)| *p).collect();
    let (shape, condition) = fit_weighted(kind, &kept, &[], plane)?;
    let refit = outcome(kind, shape, condition, &kept, &[], plane)?;
    Ok(FitOutcome { points: points.len(), rejected: points.len() - kept.len(), ..refit })
}

const MOST_ROUNDS: usize = 100;

fn robust(
    kind: FitKind,
    points: &[Point3],
    start: Fitted,
    plane: Option<CoordinatePlane>,
) -> Result<FitOutcome, FitError> {
    let mut shape = start;
    let mut condition = 1.0;
    let mut weights = Vec::new();
    let size = Normaliser::of(points, kind.points_needed())?.scale;
    for _ in 0..MOST_ROUNDS {
        let d = distances(&shape, points, plane);
        let scale = mad_scale_about_zero(&d).unwrap_or(0.0);
        if scale <= 1e-14 * size {
            break;
        }
        let next: Vec<f64> = d.iter().map(|r| tukey_weight(*r, TUKEY_WIDTH_SIGMAS * scale)).collect();
        let change = match weights.len() {
            0 => f64::INFINITY,
            _ => next.iter().zip(&weights).map(|(a, b): (&f64, &f64)| (a - b).abs()).fold(0.0, f64::max),
        };
        weights = next;
        if change < 1e-9 {
            break;
        }
        (shape, condition) = fit_weighted(kind, points, &weights, plane)?;
    }
    outcome(kind, shape, condition, points, &weights, plane)
}

#[cfg(test)]
mod tests;
