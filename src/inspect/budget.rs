//! What a value's uncertainty is made of (GUM): fit, pose and the plan's own contributions, added in squares.

use crate::align::{DatumShares, PoseUncertainty};
use crate::geometry::{Point3, UnitVector3, Vector3};
use crate::measure::Reading;
use crate::part::{Face, Part};
use crate::plan::{ComparisonPoint, Feature, Geometry, SurfaceFit, UncertaintySettings};
use nalgebra::Matrix3;

/// Standard uncertainties (k = 1) of a value by where they come from, mm.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Budget {
    /// The scatter of the points; of a datum what its lock leaves of that and of the system's share.
    pub fit_mm: f64,
    /// The alignment.
    pub pose_mm: f64,
    /// The sheet's thickness, where it was compensated: at the point and, through the pose, at the datums.
    pub thickness_mm: f64,
    /// The scale, at the point and, through the pose, at the datums.
    pub scale_mm: f64,
    /// The calibrated edge offset, which the pose may have in common with the point.
    pub edge_offset_mm: f64,
    /// The measuring system.
    pub system_mm: f64,
}

impl Budget {
    /// All of them together.
    pub fn standard_mm(&self) -> f64 {
        let parts = [self.fit_mm, self.pose_mm, self.thickness_mm, self.scale_mm, self.edge_offset_mm, self.system_mm];
        parts.iter().map(|u| u * u).sum::<f64>().sqrt()
    }
}

/// How far the points alone leave a value open, k = 1.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Scatter {
    /// Along its direction, mm.
    Along(f64),
    /// Covariance of a hole's centre, mm².
    Centre(Matrix3<f64>),
}

/// What a value brings with it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Own {
    /// What the points leave open.
    pub scatter: Scatter,
    /// The direction along which pose and system act on it.
    pub along: Along,
    /// It is the place of an edge.
    pub is_edge: bool,
}

impl Own {
    /// Of a value told along a direction, with its standard uncertainty in mm.
    pub fn along(u_mm: f64, direction: &UnitVector3, is_edge: bool) -> Self {
        Self { scatter: Scatter::Along(u_mm), along: Along::Direction(direction.into_inner()), is_edge }
    }
}

/// The direction of a value.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Along {
    /// It is told along this.
    Direction(Vector3),
    /// A hole's distance: so far from its nominal place in the sheet, mm.
    Distance(Vector3),
}

/// What is known beside the value.
#[derive(Clone, Copy)]
pub(super) struct Known<'a> {
    /// The plan's features, of which the pose knows what their errors do.
    pub features: &'a [Feature],
    /// What the scan cannot show.
    pub settings: &'a UncertaintySettings,
    /// The CAD and its face that was seen; without it no displacement of the sheet is taken for one along a surface point's line.
    pub seen: Option<(&'a Part, &'a Face)>,
    /// How well the pose is known.
    pub pose: &'a PoseUncertainty,
}

/// What iterations leave of a datum that its lock makes exact, mm.
const LEAST_MM: f64 = 1e-4;
/// A distance counts as one from here on, in standard uncertainties of the worst direction.
const TELLING_DISTANCE: f64 = 2.0;
/// Directions in the half-circle that are looked at: the worst one is met to 1 - cos(2.5 degrees), 0.1 %.
const DIRECTIONS: u32 = 36;
/// Lengths and directions that differ by no more are the same in a plan, mm and rad.
const SAME_PLACE_MM: f64 = 1e-6;
const SAME_DIRECTION: f64 = 1e-6;

impl Known<'_> {
    /// Of a value along its direction. A hole that has none is told by its distance: an error across that hardly changes it, unless it
    /// is not much longer than the errors themselves. Then its direction is theirs, and the worst one in the sheet counts.
    pub fn of_value(&self, point: &ComparisonPoint, own: &Own) -> Budget {
        let nominal = &point.geometry;
        let reading = self.seen.map_or_else(Reading::free, |(part, face)| Reading::of(part, face, nominal));
        let datum = self.features.iter().position(|feature| is_measured_as(point, &feature.geometry));
        let at = |along: &Vector3| self.along(&At { place: nominal.position(), along, reading: &reading, datum }, own);
        match &own.along {
            Along::Direction(along) => at(along),
            Along::Distance(delta_mm) => of_distance(delta_mm, &nominal.sheet_normal(), at),
        }
    }

    fn along(&self, at: &At, own: &Own) -> Budget {
        let UncertaintySettings { scale_ppm, thickness_mm, system_mm, edge_offset_u_mm, .. } = *self.settings;
        let At { place, along, reading, datum } = at;
        let told = |displacement: &Vector3| reading.of_displacement(displacement).dot(along).abs();
        let own_edge_mm = if own.is_edge { edge_offset_u_mm } else { 0.0 };
        let alone = Budget {
            fit_mm: match &own.scatter {
                Scatter::Along(u_mm) => *u_mm,
                Scatter::Centre(covariance) => along.dot(&(covariance * *along)).max(0.0).sqrt(),
            },
            pose_mm: self.pose.without_edge_offset(place, along),
            thickness_mm: told(&(reading.of_thickness(thickness_mm) + self.pose.by_thickness(place))),
            scale_mm: told(&self.pose.by_scale(place, scale_ppm)),
            edge_offset_mm: self.pose.edge_offset_mm(place, along, own_edge_mm),
            system_mm,
        };
        let shares = datum.and_then(|datum| self.pose.of_datum(datum, place, along));
        shares.map_or(alone, |DatumShares { own_mm, others_mm, edge_offset_mm }| Budget {
            fit_mm: own_mm.hypot(LEAST_MM),
            pose_mm: others_mm,
            edge_offset_mm,
            system_mm: 0.0,
            ..alone
        })
    }
}

/// Where a value is told, and how.
struct At<'a> {
    place: Point3,
    along: &'a Vector3,
    reading: &'a Reading,
    /// The plan's feature that is the same as the point.
    datum: Option<usize>,
}

/// Whether a point is measured as a feature is: the same shape in the same place, looked at in the same way.
fn is_measured_as(point: &ComparisonPoint, feature: &Geometry) -> bool {
    let near = (point.geometry.position() - feature.position()).norm() < SAME_PLACE_MM;
    let alike = |a: &Vector3, b: &Vector3| (a - b).norm() < SAME_DIRECTION;
    near && match (&point.geometry, feature) {
        (Geometry::Surface { direction: a, .. }, Geometry::Surface { direction: b, .. }) => {
            alike(a, b) && point.surface_fit == SurfaceFit::default()
        }
        (Geometry::Edge { direction: a, normal: n, .. }, Geometry::Edge { direction: b, normal: m, .. }) => {
            alike(a, b) && alike(n, m)
        }
        (Geometry::Hole { axis: a, diameter_mm: d, .. }, Geometry::Hole { axis: b, diameter_mm: e, .. }) => {
            alike(a, b) && (d - e).abs() < SAME_PLACE_MM
        }
        _ => false,
    }
}

/// Of the length of a vector in the sheet, from that along any direction.
fn of_distance(delta_mm: &Vector3, normal: &Vector3, at: impl Fn(&Vector3) -> Budget) -> Budget {
    let x = normal.cross(&Vector3::ith(normal.iamin(), 1.0)).normalize();
    let y = normal.cross(&x);
    let direction = |k: u32| {
        let (sin, cos) = (std::f64::consts::PI * f64::from(k) / f64::from(DIRECTIONS)).sin_cos();
        x * cos + y * sin
    };
    let worst = (0..DIRECTIONS).map(|k| at(&direction(k))).max_by(|a, b| a.standard_mm().total_cmp(&b.standard_mm()));
    let worst = worst.unwrap_or_default();
    match delta_mm.try_normalize(0.0) {
        Some(along) if delta_mm.norm() >= TELLING_DISTANCE * worst.standard_mm() => at(&along),
        _ => worst,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Known to 0.01 mm along x and 0.05 mm along y: a distance of 0.03 mm along x may as well be all noise along y.
    #[test]
    fn a_short_distance_is_as_uncertain_as_its_worst_direction() {
        let at = |d: &Vector3| Budget { fit_mm: (0.01 * d.x).hypot(0.05 * d.y), ..Budget::default() };
        let told = |x: f64, y: f64| of_distance(&Vector3::new(x, y, 0.0), &Vector3::z(), at).standard_mm();
        for short in [told(0.0, 0.0), told(0.03, 0.0), told(0.0, 0.03), told(0.07, -0.07)] {
            assert!((0.04995..=0.05).contains(&short), "{short}");
        }
        // Longer than two of the worst: its own direction.
        assert!((told(0.2, 0.0) - 0.01).abs() < 1e-12 && (told(0.0, 0.2) - 0.05).abs() < 1e-12);
    }
}
