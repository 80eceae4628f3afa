//! A slot with round ends.

use super::card::Card;
use super::frame::or_too_near_the_belt;
use super::hole::larger_axis;
use super::layer::Layer;
use super::opening::{Opening, arc, frame_of, measure_opening};
use super::{Local, NotFound, SHARPNESS_U};
use crate::fit::soft_edge::Slot;
use crate::fit::soft_edge::outline::MAX_SHAPE;
use crate::geometry::{Point3, UnitVector3, Vector3};
use nalgebra::Matrix3;
use std::f64::consts::{FRAC_PI_2, PI};

/// A slot as found. CAD frame, on the CAD's own face.
#[derive(Debug, Clone, PartialEq)]
pub struct SlotFound {
    /// Centre.
    pub centre: Point3,
    /// Normal of the sheet around it, on the plan's side.
    pub axis: Vector3,
    /// Long axis, perpendicular to `axis`, pointing as the plan's.
    pub direction: Vector3,
    /// Overall length, the calibrated edge offset taken out.
    pub length_mm: f64,
    /// Width, the calibrated edge offset taken out.
    pub width_mm: f64,
    /// Covariance of the centre, mm², from the points alone.
    pub centre_covariance: Matrix3<f64>,
    /// k = 1 of the centre along any direction in the sheet (the larger of the two), from the points alone.
    pub u_centre_mm: f64,
    /// k = 1 of the long axis's direction, rad, from the points alone.
    pub u_direction_rad: f64,
    /// k = 1 of how far the long axis leans out of the sheet, rad, from the points alone.
    pub u_tilt_rad: f64,
    /// k = 1, from the points alone.
    pub u_length_mm: f64,
    /// k = 1, from the points alone.
    pub u_width_mm: f64,
    /// Rms of the surrounding points about their plane.
    pub rms_mm: f64,
    /// Points of the fit.
    pub points_used: usize,
    /// What somebody should know of this value.
    pub warning: Option<String>,
}

impl Opening for Slot {
    const WORD: &'static str = "slot";
    const SHAPE_WORD: &'static str = "straight with round ends";
    const SIZES: [bool; MAX_SHAPE] = [false, false, false, true, true];

    fn centre(&self) -> [f64; 2] {
        self.centre
    }

    fn centred_at(&self, centre: [f64; 2]) -> Self {
        Self { centre, ..*self }
    }

    fn reach_mm(&self) -> f64 {
        self.half_straight + self.radius
    }

    fn grown(&self, by_mm: f64) -> Vec<[f64; 2]> {
        let (sin, cos) = self.angle.sin_cos();
        let end = |sign: f64| {
            [self.centre[0] + sign * self.half_straight * cos, self.centre[1] + sign * self.half_straight * sin]
        };
        let mut corners = Vec::new();
        let (a, r) = (self.angle, self.radius + by_mm);
        arc(end(1.0), r, a - FRAC_PI_2, a + FRAC_PI_2, 64, &mut corners);
        arc(end(-1.0), r, a + FRAC_PI_2, a + FRAC_PI_2 + PI, 64, &mut corners);
        corners
    }

    fn rim_mm(&self) -> f64 {
        4.0 * self.half_straight + 2.0 * PI * self.radius
    }

    fn rim_place(&self, [u, v]: [f64; 2]) -> (f64, f64) {
        let (sin, cos) = self.angle.sin_cos();
        let [du, dv] = [u - self.centre[0], v - self.centre[1]];
        let (x, y) = (du * cos + dv * sin, dv * cos - du * sin);
        let (half, r) = (self.half_straight, self.radius);
        if x.abs() <= half {
            // Back along the side above the axis, and on along the one below.
            let along = if y >= 0.0 { PI * r + half - x } else { 2.0 * PI * r + 3.0 * half + x };
            return (along, 0.0);
        }
        let turned = (y * x.signum()).atan2(x.abs() - half) + FRAC_PI_2;
        let before = if x > 0.0 { 0.0 } else { PI * r + 2.0 * half };
        (before + turned * r, r.recip())
    }

    fn size_difference_mm(&self, other: &Self) -> f64 {
        (self.length_mm() - other.length_mm()).abs().max((self.width_mm() - other.width_mm()).abs())
    }

    fn least_size_mm(&self) -> f64 {
        self.width_mm()
    }

    fn sizes_in_words(&self) -> String {
        format!("{:.1} mm long and {:.1} mm wide", self.length_mm(), self.width_mm())
    }
}

/// Nominal slot: where it is and how big.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NominalSlot {
    /// Centre on the CAD's own face, CAD frame.
    pub centre: Point3,
    /// Normal of the sheet.
    pub axis: UnitVector3,
    /// Long axis, perpendicular to `axis`.
    pub direction: UnitVector3,
    /// Overall length.
    pub length_mm: f64,
    /// Width.
    pub width_mm: f64,
}

/// Measures a slot of about that size around its nominal centre, at most `search_mm` away.
pub fn slot(local: &Local, nominal: &NominalSlot, search_mm: f64) -> Result<SlotFound, NotFound> {
    let radius = 0.5 * nominal.width_mm;
    let half_straight = (0.5 * nominal.length_mm - radius).max(0.0);
    // The long axis is v of the frame.
    let start = Slot { centre: [0.0, 0.0], angle: FRAC_PI_2, half_straight, radius };
    let frame = frame_of(local, &nominal.centre, &nominal.axis, Some(&nominal.direction), &start);
    let mut card = Card::default();
    let found = measure_opening(local, &frame, &start, search_mm, &mut card);
    let found = or_too_near_the_belt(local, &nominal.centre, found, &mut card)?;
    let (fit, c) = (&found.fit, &found.fit.covariance);
    let axis = frame.vector(found.normal());
    let (sin, cos) = fit.outline.angle.sin_cos();
    let in_plane = frame.vector([cos, sin, 0.0]);
    let direction = (in_plane - axis * in_plane.dot(&axis)).normalize();
    let direction = if direction.dot(&nominal.direction) < 0.0 { -direction } else { direction };
    let own = found.centre_covariance();
    let u_tilt_rad = u_slope(&found.layer, [cos, sin]);
    let sharpness = SHARPNESS_U * found.spacing_mm;
    let offset = 2.0 * local.uncertainty.edge_offset_mm;
    let u_half_length = (c[(3, 3)] + c[(4, 4)] + 2.0 * c[(3, 4)]).max(0.0).sqrt();
    Ok(SlotFound {
        centre: frame.on_own_face(found.centre()),
        axis,
        direction,
        length_mm: fit.outline.length_mm() + offset,
        width_mm: fit.outline.width_mm() + offset,
        centre_covariance: frame.covariance(&own),
        u_centre_mm: larger_axis(&own),
        u_direction_rad: c[(2, 2)].max(0.0).sqrt().hypot(found.turn_by_lean([cos, sin]) * u_tilt_rad),
        u_tilt_rad,
        u_length_mm: 2.0 * u_half_length.hypot(sharpness),
        u_width_mm: 2.0 * c[(4, 4)].max(0.0).sqrt().hypot(sharpness),
        rms_mm: found.layer.rms_mm,
        points_used: fit.points,
        warning: found.warning,
    })
}

/// Standard uncertainty of the slope of the surrounding sheet along a unit direction of its plane, rad. What neighbouring
/// points' errors have in common makes it larger by the same factor as that of the height: the windows are many times as wide
/// as errors reach.
fn u_slope(layer: &Layer, [cos, sin]: [f64; 2]) -> f64 {
    let along = Vector3::new(0.0, cos, sin);
    ((layer.covariance * along).dot(&along).max(0.0) * layer.inflation()).sqrt()
}
