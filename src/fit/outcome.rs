//! One fit of one kind to one set of points, as `shapeline fit` tells it.

use super::determined;
use super::robust::{TUKEY_WIDTH_SIGMAS, mad_scale_about_zero, tukey_weight};
use super::robust_start::robust_start;
use super::shapes::circle::{Circle, fit_circle, fit_circle_in_plane};
use super::shapes::cone::{Cone, fit_cone, fit_cone_near};
use super::shapes::cylinder::{Cylinder, fit_cylinder, fit_cylinder_near};
use super::shapes::fixed::{fit_circle_of, fit_cylinder_of, fit_flat_circle_of, fit_sphere_of};
use super::shapes::line::{Line, fit_line};
use super::shapes::plane::{Plane, fit_plane};
use super::shapes::sphere::{Sphere, fit_sphere};
use super::shapes::{FitError, Normaliser};
use super::uncertainty::{ShapeUncertainty, uncertainty_of};
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
    fn parameters(self, known: Known) -> usize {
        let fixed = usize::from(known.radius.is_some());
        match self {
            FitKind::Line => 4,
            FitKind::Sphere => 4 - fixed,
            FitKind::Plane => 3,
            FitKind::Circle => 3 - fixed + if known.plane.is_some() { 0 } else { 3 },
            FitKind::Cylinder => 5 - fixed,
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

/// What is known of a shape before it is fitted.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Known {
    /// The plane of a circle.
    pub plane: Option<CoordinatePlane>,
    /// The radius of a circle, sphere or cylinder, in the unit of the points; other kinds take no notice of it.
    pub radius: Option<f64>,
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
    /// What it is.
    pub fn kind(&self) -> FitKind {
        match self {
            Fitted::Line(_) => FitKind::Line,
            Fitted::Plane(_) => FitKind::Plane,
            Fitted::Circle(_) => FitKind::Circle,
            Fitted::Sphere(_) => FitKind::Sphere,
            Fitted::Cylinder(_) => FitKind::Cylinder,
            Fitted::Cone(_) => FitKind::Cone,
        }
    }

    /// Radius of a circle, sphere or cylinder.
    pub fn radius(&self) -> Option<f64> {
        match self {
            Fitted::Circle(s) => Some(s.radius),
            Fitted::Sphere(s) => Some(s.radius),
            Fitted::Cylinder(s) => Some(s.radius),
            Fitted::Line(_) | Fitted::Plane(_) | Fitted::Cone(_) => None,
        }
    }

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
    /// Standard deviation of their distances, degrees of freedom taken off; nobody knows it where none is left.
    pub sigma: Option<f64>,
    /// Points left out by the three-sigma step, or of weight zero in the robust fit.
    pub rejected: usize,
    /// Condition of the fit's equations; large = weakly fixed.
    pub condition: f64,
    /// How well the shape is known; nobody knows where it has as many parameters as its points have coordinates off it.
    pub uncertainty: Option<ShapeUncertainty>,
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
    fit_points_knowing(kind, points, method, Known { plane, radius: None })
}

/// Fits a shape of which something is known; the same as [`fit_points`] otherwise.
pub fn fit_points_knowing(
    kind: FitKind,
    points: &[Point3],
    method: FitMethod,
    known: Known,
) -> Result<FitOutcome, FitError> {
    let first = fit_weighted(kind, points, &[], known);
    match method {
        FitMethod::LeastSquares => {
            first.and_then(|(shape, condition)| outcome(kind, shape, condition, points, &[], known))
        }
        FitMethod::ThreeSigma => first.and_then(|(shape, _)| three_sigma(kind, points, &shape, known)),
        FitMethod::Robust => {
            robust(kind, points, robust_start(kind, points, known, first.map(|(shape, _)| shape))?, known)
        }
    }
}

pub(super) fn fit_weighted(
    kind: FitKind,
    points: &[Point3],
    weights: &[f64],
    known: Known,
) -> Result<(Fitted, f64), FitError> {
    Normaliser::of(points, kind.points_needed())?;
    let fixed = known.radius;
    Ok(match (kind, known.plane) {
        (FitKind::Line, _) => fit_line(points, weights).map(|(s, c)| (Fitted::Line(s), c))?,
        (FitKind::Plane, _) => fit_plane(points, weights).map(|(s, c)| (Fitted::Plane(s), c))?,
        (FitKind::Circle, plane) => {
            let (free, condition) = match plane {
                Some(CoordinatePlane { axis, value }) => {
                    let unit = Vector3::from_fn(|k, _| if k == axis { 1.0 } else { 0.0 });
                    fit_circle_in_plane(
                        points,
                        weights,
                        &UnitVector3::new_unchecked(unit),
                        &Point3::from(unit * value),
                    )?
                }
                None => fit_circle(points, weights)?,
            };
            let (circle, condition) = match (fixed, plane) {
                (None, _) => (free, condition),
                (Some(radius), None) => fit_circle_of(radius, &free, points, weights)?,
                (Some(radius), Some(_)) => fit_flat_circle_of(radius, &free, points, weights)?,
            };
            (Fitted::Circle(circle), condition)
        }
        (FitKind::Sphere, _) => {
            let free = fit_sphere(points, weights)?;
            let (sphere, condition) =
                fixed.map_or(Ok(free), |radius| fit_sphere_of(radius, &free.0, points, weights))?;
            (Fitted::Sphere(sphere), condition)
        }
        (FitKind::Cylinder, _) => {
            let free = fit_cylinder(points, weights)?;
            let (cylinder, condition) =
                fixed.map_or(Ok(free), |radius| fit_cylinder_of(radius, &free.0, points, weights))?;
            (Fitted::Cylinder(cylinder), condition)
        }
        (FitKind::Cone, _) => fit_cone(points, weights).map(|(s, c)| (Fitted::Cone(s), c))?,
    })
}

/// The same from a shape that is near: cylinders and cones need no search then.
pub(super) fn fit_weighted_near(
    near: &Fitted,
    kind: FitKind,
    points: &[Point3],
    weights: &[f64],
    known: Known,
) -> Result<(Fitted, f64), FitError> {
    match (near, known.radius) {
        (Fitted::Cylinder(near), None) => {
            fit_cylinder_near(near, points, weights).map(|(s, c)| (Fitted::Cylinder(s), c))
        }
        (Fitted::Cylinder(near), Some(radius)) => {
            fit_cylinder_of(radius, near, points, weights).map(|(s, c)| (Fitted::Cylinder(s), c))
        }
        (Fitted::Cone(near), _) => fit_cone_near(near, points, weights).map(|(s, c)| (Fitted::Cone(s), c)),
        _ => fit_weighted(kind, points, weights, known),
    }
}

/// Distances as the fit sees them: for a circle in a given plane only what lies in that plane.
pub(super) fn distances(shape: &Fitted, points: &[Point3], plane: Option<CoordinatePlane>) -> Vec<f64> {
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
    known: Known,
) -> Result<FitOutcome, FitError> {
    let plane = known.plane;
    let used = |k: usize| weights.get(k).is_none_or(|w| *w > 0.0);
    let used: Vec<Point3> = points.iter().enumerate().filter(|(k, _)| used(*k)).map(|(_, p)| *p).collect();
    let distances = distances(&shape, &used, plane);
    determined::check(&shape, &used, &distances, known)?;
    let (rms, sigma) = rms_and_sigma(kind, &distances, known);
    let weights: Vec<f64> = weights.iter().copied().filter(|w| *w > 0.0).collect();
    let uncertainty = match sigma {
        None => None,
        Some(sigma) => Some(uncertainty_of(&shape, &used, &weights, sigma, known)?),
    };
    let rejected = points.len() - used.len();
    Ok(FitOutcome { shape, points: points.len(), rms, sigma, rejected, condition, uncertainty })
}

/// Figures of a fit in which all points count alike.
pub(super) fn figures(kind: FitKind, shape: Fitted, condition: f64, points: &[Point3]) -> Result<FitOutcome, FitError> {
    outcome(kind, shape, condition, points, &[], Known::default())
}

/// Root mean square of the distances, and their standard deviation with the shape's parameters taken off, if any freedom is left then.
fn rms_and_sigma(kind: FitKind, distances: &[f64], known: Known) -> (f64, Option<f64>) {
    let (n, sum) = (distances.len(), distances.iter().map(|d| d * d).sum::<f64>());
    let freedom = freedom(kind, n, known);
    let sigma = (freedom > 0).then(|| (sum / freedom as f64).sqrt());
    ((sum / n.max(1) as f64).sqrt(), sigma)
}

/// Residuals less parameters. In space each point of a line or circle gives two residuals.
fn freedom(kind: FitKind, points: usize, known: Known) -> usize {
    let residuals = match (kind, known.plane) {
        (FitKind::Line, _) | (FitKind::Circle, None) => 2 * points,
        _ => points,
    };
    residuals.saturating_sub(kind.parameters(known))
}

fn three_sigma(kind: FitKind, points: &[Point3], first: &Fitted, known: Known) -> Result<FitOutcome, FitError> {
    let distances = distances(first, points, known.plane);
    let (rms, sigma) = rms_and_sigma(kind, &distances, known);
    // Points that fit to rounding, or just as many points as parameters, leave nothing to reject.
    let size = Normaliser::of(points, kind.points_needed())?.scale;
    let limit = (3.0 * sigma.unwrap_or(0.0)).max(3.0 * rms).max(1e-12 * size);
    let kept: Vec<Point3> = points.iter().zip(distances).filter(|(_, d)| d.abs() <= limit).map(|(p, _)| *p).collect();
    let (shape, condition) = fit_weighted(kind, &kept, &[], known)?;
    let refit = outcome(kind, shape, condition, &kept, &[], known)?;
    Ok(FitOutcome { points: points.len(), rejected: points.len() - kept.len(), ..refit })
}

const MOST_ROUNDS: usize = 100;

fn robust(kind: FitKind, points: &[Point3], start: Fitted, known: Known) -> Result<FitOutcome, FitError> {
    let mut shape = start;
    let mut condition = 1.0;
    let mut weights = Vec::new();
    let size = Normaliser::of(points, kind.points_needed())?.scale;
    for _ in 0..MOST_ROUNDS {
        let d = distances(&shape, points, known.plane);
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
        (shape, condition) = fit_weighted_near(&shape, kind, points, &weights, known)?;
    }
    outcome(kind, shape, condition, points, &weights, known)
}

#[cfg(test)]
mod known_truth;
#[cfg(test)]
mod tests;
