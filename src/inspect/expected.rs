//! The error of the pose to expect from a plan's datums, before anything is measured: expected errors of the datum features,
//! pushed through the alignment itself.

use super::budget::{Along, Budget, Known, Own, Scatter};
use crate::align::{
    BEST_FIT_POINTS, Common, DatumErrors, Datums, PoseUncertainty, REGION_POINTS, expected_best_fit,
    expected_pose_uncertainty, expected_region_fit, move_region_fit,
};
use crate::geometry::{Point3, UnitVector3, Vector3, decompose};
use crate::measure::surface::window_radius_mm;
use crate::part::{Face, Part};
use crate::plan::expected::{Expected, OpeningStd};
use crate::plan::{
    AlignmentMethod, ComparisonPoint, Draft, Feature, Geometry, Plan, Rig, Side, SurfaceFit, SurfaceMethod,
    UncertaintySettings,
};
use nalgebra::{Matrix2, Matrix3};

/// What of a plan the expected error of its pose depends on.
#[derive(Debug, Clone, Copy)]
pub struct Outlook<'a> {
    /// How the part is held.
    pub method: &'a AlignmentMethod,
    /// By which features.
    pub features: &'a [Feature],
    /// Where its deviations are wanted.
    pub comparison: &'a [ComparisonPoint],
    /// What measures it.
    pub rig: Option<&'a Rig>,
    /// What the scans cannot show.
    pub uncertainty: UncertaintySettings,
    /// The CAD, the surface of which holds a best fit.
    pub part: Option<&'a Part>,
}

/// What to expect of a comparison point: expanded uncertainties (k = 2), mm along its direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExpectedU {
    /// In all.
    pub u_mm: f64,
    /// What the point's own measurement owes.
    pub point_mm: f64,
    /// What the alignment owes.
    pub pose_mm: f64,
    /// What the sheet's thickness (on the side where that shows more) and the scale owe, at the point and through the alignment.
    pub common_mm: f64,
}

impl<'a> Outlook<'a> {
    /// Of a plan.
    pub fn of(plan: &'a Plan) -> Self {
        let Plan { alignment, features, comparison, rig, uncertainty, .. } = plan;
        Self { method: alignment, features, comparison, rig: rig.as_ref(), uncertainty: *uncertainty, part: None }
    }

    /// Of what is sound of a plan, if that tells its alignment.
    pub fn of_draft(draft: &'a Draft) -> Option<Self> {
        let Draft { alignment, features, comparison, rig, .. } = draft;
        let uncertainty = draft.uncertainty.unwrap_or_default();
        Some(Self { method: alignment.as_ref()?, features, comparison, rig: rig.as_ref(), uncertainty, part: None })
    }

    /// What the pose's error will do to each comparison point along its direction, mm (standard deviation); `None` where the
    /// datums do not hold the part, and for a best fit to a CAD that is not known, or whose surface does not hold the part by itself.
    pub fn pose_errors_mm(&self) -> Option<Vec<f64>> {
        let pose = pose(self, self.method, Side::Top, Figures::Scatter)?;
        Some(self.comparison.iter().map(|point| error_mm(&pose, &point.geometry)).collect())
    }

    /// The expanded uncertainty (k = 2) to expect at each comparison point of a good scan, mm. `None` where the datums do not hold
    /// the part.
    pub fn expected_u_mm(&self) -> Option<Vec<f64>> {
        Some(self.expected()?.iter().map(|expected| expected.u_mm).collect())
    }

    /// The same with its parts, seen from the side where it is more: the datums through the pose (a best fit to a CAD that is not known
    /// owes next to nothing), the point's own fit, the measuring system and the edges' offset, and, of a CAD that is known,
    /// thickness and scale. A point that is itself a datum has its datum's error in common with the part. The sheet
    /// leans as it does where the part rests on the belt. What it leaves out (shadows, lost points, form deviations) only adds to it.
    pub fn expected(&self) -> Option<Vec<ExpectedU>> {
        let sides: &[Side] = if self.part.is_some() { &[Side::Top, Side::Bottom] } else { &[Side::Top] };
        let views: Vec<View> = sides.iter().filter_map(|side| View::of(*self, *side)).collect();
        let of_point = |point: &ComparisonPoint| {
            let budgets = views.iter().map(|view| view.budget(point));
            budgets.max_by(|a, b| a.standard_mm().total_cmp(&b.standard_mm())).map(|budget| told(&budget))
        };
        if views.is_empty() {
            return None;
        }
        Some(self.comparison.iter().filter_map(of_point).collect())
    }

    /// How well points will tell the sheet at a place when that side is seen: it leans there as it does where the part rests most
    /// stably with that side up; of a CAD that is not known it faces the camera.
    pub(super) fn expected_at(&self, geometry: &Geometry, side: Side) -> Expected {
        let poses = self.part.map_or(&[][..], |part| &part.resting_poses);
        // The most stable comes first.
        let up = poses.iter().find(|resting| resting.side == side).map(|resting| resting.up_cad);
        Expected::of(self.rig).leaning(up.map_or(1.0, |up| geometry.sheet_normal().dot(&up)))
    }

    /// The window of a surface point to expect, mm.
    pub(super) fn window_mm(&self, point: &Point3, how: &SurfaceFit, spacing_mm: f64, side: Side) -> f64 {
        let cad_edge_mm = self.part.map_or(f64::INFINITY, |part| part.face(side).edge_distance_mm(point));
        window_radius_mm(how, spacing_mm, cad_edge_mm)
    }
}

/// How far the mean height of a face within a radius stands off its height at the place itself, mm: what a plane there is off.
fn bend_mm(face: &Face, place: &Point3, direction: &UnitVector3, radius_mm: f64) -> f64 {
    // Rings of equal area.
    const RINGS: u32 = 4;
    const AROUND: u32 = 12;
    let (u, v) = (across(direction), direction.cross(&across(direction)));
    let height_mm = |at: Point3| {
        let hit = face.closest(&at, 2.0 * radius_mm).filter(|hit| !hit.on_boundary)?;
        Some((hit.point - at).dot(direction))
    };
    let Some(middle_mm) = height_mm(*place) else { return 0.0 };
    let places = (0..RINGS).flat_map(|ring| {
        let r = radius_mm * ((f64::from(ring) + 0.5) / f64::from(RINGS)).sqrt();
        (0..AROUND).map(move |k| (r, std::f64::consts::TAU * f64::from(k) / f64::from(AROUND)))
    });
    let heights: Vec<f64> =
        places.filter_map(|(r, turn)| height_mm(place + u * (r * turn.cos()) + v * (r * turn.sin()))).collect();
    heights.iter().sum::<f64>() / heights.len().max(1) as f64 - if heights.is_empty() { 0.0 } else { middle_mm }
}

/// Which figures of the datums are meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Figures {
    /// By how much they will scatter.
    Scatter,
    /// What a scan will tell of that.
    Told,
}

/// As it is told: expanded, the shares put together.
fn told(budget: &Budget) -> ExpectedU {
    let Budget { fit_mm, pose_mm, thickness_mm, scale_mm, edge_offset_mm, system_mm } = *budget;
    ExpectedU {
        u_mm: 2.0 * budget.standard_mm(),
        point_mm: 2.0 * fit_mm.hypot(system_mm).hypot(edge_offset_mm),
        pose_mm: 2.0 * pose_mm,
        common_mm: 2.0 * thickness_mm.hypot(scale_mm),
    }
}

/// A part of which one side is seen, in a pose of which something is known.
struct View<'a> {
    outlook: Outlook<'a>,
    side: Side,
    pose: PoseUncertainty,
    settings: UncertaintySettings,
}

impl<'a> View<'a> {
    /// `None` where the datums do not hold the part.
    fn of(outlook: Outlook<'a>, side: Side) -> Option<Self> {
        let by_surface = matches!(outlook.method, AlignmentMethod::BestFit | AlignmentMethod::Regions(_));
        let pose = match outlook.part {
            None if by_surface => PoseUncertainty::none(Point3::origin()),
            _ => pose(&outlook, outlook.method, side, Figures::Told)?,
        };
        // What thickness and scale do is told by the CAD.
        let settings = match outlook.part {
            None => UncertaintySettings { thickness_mm: 0.0, scale_ppm: 0.0, ..outlook.uncertainty },
            Some(_) => outlook.uncertainty,
        };
        Some(Self { outlook, side, pose, settings })
    }

    fn budget(&self, point: &ComparisonPoint) -> Budget {
        let Outlook { features, part, .. } = self.outlook;
        let seen = part.map(|part| (part, part.face(self.side)));
        let known = Known { features, settings: &self.settings, seen, pose: &self.pose };
        known.of_value(point, &self.own(point))
    }

    /// What the points around it leave open.
    fn own(&self, point: &ComparisonPoint) -> Own {
        let expected = self.outlook.expected_at(&point.geometry, self.side).as_told();
        match &point.geometry {
            Geometry::Surface { position, direction } => {
                let how = &point.surface_fit;
                let window_mm = self.outlook.window_mm(position, how, expected.spacing_mm, self.side);
                let bend_mm = match (how.method, self.outlook.part) {
                    (SurfaceMethod::Plane, Some(part)) => bend_mm(part.face(self.side), position, direction, window_mm),
                    _ => 0.0,
                };
                Own::along(expected.surface_mm(how.method, window_mm).hypot(bend_mm), direction, false)
            }
            Geometry::Edge { direction, .. } => Own::along(expected.edge_mm(), direction, true),
            Geometry::Hole { diameter_mm, direction, .. } => {
                let across_mm = expected.opening(*diameter_mm, *diameter_mm).across_mm;
                match direction {
                    Some(direction) => Own::along(across_mm, direction, false),
                    None => Own {
                        scatter: Scatter::Centre(Matrix3::identity() * (across_mm * across_mm)),
                        along: Along::Distance(Vector3::zeros()),
                        is_edge: false,
                    },
                }
            }
            Geometry::Slot { direction, length_mm, width_mm, .. } => {
                Own::along(expected.opening(*length_mm, *width_mm).along_mm, direction, false)
            }
        }
    }
}

/// The uncertainty of the pose to expect, that side of the part seen; `None` where the datums do not hold the part.
pub(super) fn pose(
    outlook: &Outlook,
    method: &AlignmentMethod,
    side: Side,
    figures: Figures,
) -> Option<PoseUncertainty> {
    let common = outlook.part.map(|part| Common { part, face: part.face(side), settings: &outlook.uncertainty });
    if let AlignmentMethod::BestFit | AlignmentMethod::Regions(_) = method {
        let mut known = fitted_pose(outlook, method, side)?;
        match method {
            AlignmentMethod::Regions(fit) => move_region_fit(&common?, fit, &mut known),
            _ => common?.move_best_fit(&mut known),
        }
        return Some(known);
    }
    let positions = outlook.features.iter().map(|f| f.geometry.position());
    let first = outlook.features.first()?.geometry.position();
    let length_mm = positions.map(|p| (p - first).norm()).fold(1.0, f64::max);
    let datums = Datums { method, features: outlook.features, length_mm };
    let of_datum = |geometry: &Geometry| {
        let scatter = outlook.expected_at(geometry, side);
        let expected = if figures == Figures::Told { scatter.as_told() } else { scatter };
        let window_mm = outlook.window_mm(&geometry.position(), &SurfaceFit::default(), expected.spacing_mm, side);
        errors(&expected, geometry, window_mm).with_settings(geometry, &outlook.uncertainty)
    };
    expected_pose_uncertainty(datums, of_datum, common).ok()
}

/// The same of a fit to the CAD's surface, from the scatter of the points alone.
fn fitted_pose(outlook: &Outlook, method: &AlignmentMethod, side: Side) -> Option<PoseUncertainty> {
    let expected = Expected::of(outlook.rig);
    let part = outlook.part?;
    let face = part.face(side);
    let mm2_per_point = face.mesh.area() / BEST_FIT_POINTS as f64;
    let whole = expected_best_fit(face, expected.thinned_variance_mm4(mm2_per_point));
    let AlignmentMethod::Regions(fit) = method else { return whole };
    let variance_mm4 = |area_mm2: f64| expected.thinned_variance_mm4(area_mm2 / REGION_POINTS as f64);
    expected_region_fit(part, side, fit, whole.as_ref(), variance_mm4)
}

/// What to expect of one datum feature; a surface point is told within `window_mm`.
fn errors(expected: &Expected, geometry: &Geometry, window_mm: f64) -> DatumErrors {
    let opening = |axis: &UnitVector3, long: Vector3, std: OpeningStd| {
        let across = axis.cross(&long);
        vec![long * std.along_mm, across * std.across_mm, axis.into_inner() * std.height_mm]
    };
    match geometry {
        Geometry::Hole { axis, diameter_mm, .. } => {
            let std = expected.opening(*diameter_mm, *diameter_mm);
            DatumErrors { shifts: opening(axis, across(axis), std), ..DatumErrors::default() }
        }
        Geometry::Slot { axis, direction, length_mm, width_mm, .. } => {
            let std = expected.opening(*length_mm, *width_mm);
            let turns = vec![axis.into_inner() * std.turn_rad, axis.cross(direction) * std.tilt_rad];
            DatumErrors { shifts: opening(axis, direction.into_inner(), std), turns, ..DatumErrors::default() }
        }
        Geometry::Surface { direction, .. } => DatumErrors {
            shifts: vec![direction.into_inner() * expected.surface_mm(SurfaceMethod::Local, window_mm)],
            ..DatumErrors::default()
        },
        Geometry::Edge { direction, .. } => {
            DatumErrors { shifts: vec![direction.into_inner() * expected.edge_mm()], ..DatumErrors::default() }
        }
    }
}

/// What the pose's error does to a comparison point, mm (k = 1): along its direction; of a hole that has none along the worst
/// direction in the sheet.
pub(super) fn error_mm(pose: &PoseUncertainty, geometry: &Geometry) -> f64 {
    let at = |direction: &Vector3| pose.at(&geometry.position(), direction);
    match geometry {
        Geometry::Surface { direction, .. } | Geometry::Edge { direction, .. } | Geometry::Slot { direction, .. } => {
            at(direction)
        }
        Geometry::Hole { direction: Some(direction), .. } => at(direction),
        Geometry::Hole { axis, direction: None, .. } => {
            let x = across(axis);
            let y = axis.cross(&x);
            // Variances along x, y and the diagonal give the covariance.
            let (xx, yy) = (at(&x).powi(2), at(&y).powi(2));
            let xy = at(&((x + y) * std::f64::consts::FRAC_1_SQRT_2)).powi(2) - 0.5 * (xx + yy);
            let worst = decompose::symmetric_eigenvalues(Matrix2::new(xx, xy, xy, yy));
            worst.map_or(f64::NAN, |worst| worst.max().max(0.0).sqrt())
        }
    }
}

/// Some unit vector across another.
fn across(axis: &UnitVector3) -> Vector3 {
    axis.cross(&Vector3::ith(axis.iamin(), 1.0)).normalize()
}
