//! A circular hole.

use super::card::Card;
use super::frame::or_too_near_the_belt;
use super::opening::{Opening, arc, frame_of, measure_opening};
use super::{Local, NotFound, SHARPNESS_U};
use crate::fit::soft_edge::Circle;
use crate::fit::soft_edge::outline::MAX_SHAPE;
use crate::geometry::{Point3, UnitVector3, Vector3};
use nalgebra::Matrix3;
use std::f64::consts::TAU;

/// A hole as found. CAD frame, on the CAD's own face.
#[derive(Debug, Clone, PartialEq)]
pub struct HoleFound {
    /// Centre.
    pub centre: Point3,
    /// Normal of the sheet around it, on the plan's side.
    pub axis: Vector3,
    /// Diameter, the calibrated edge offset taken out.
    pub diameter_mm: f64,
    /// Covariance of the centre, mm², from the points alone.
    pub centre_covariance: Matrix3<f64>,
    /// k = 1 of the centre along any direction in the sheet (the larger of the two), from the points alone.
    pub u_centre_mm: f64,
    /// k = 1, from the points alone.
    pub u_diameter_mm: f64,
    /// Rms of the surrounding points about their plane.
    pub rms_mm: f64,
    /// Points of the fit.
    pub points_used: usize,
    /// What somebody should know of this value.
    pub warning: Option<String>,
}

impl Opening for Circle {
    const WORD: &'static str = "hole";
    const SHAPE_WORD: &'static str = "round";
    const SIZES: [bool; MAX_SHAPE] = [false, false, true, false, false];

    fn centre(&self) -> [f64; 2] {
        self.centre
    }

    fn centred_at(&self, centre: [f64; 2]) -> Self {
        Self { centre, ..*self }
    }

    fn reach_mm(&self) -> f64 {
        self.radius
    }

    fn grown(&self, by_mm: f64) -> Vec<[f64; 2]> {
        let mut corners = Vec::new();
        arc(self.centre, self.radius + by_mm, 0.0, TAU, 128, &mut corners);
        corners.pop(); // the arc ends where it began
        corners
    }

    fn rim_mm(&self) -> f64 {
        TAU * self.radius
    }

    fn rim_place(&self, [u, v]: [f64; 2]) -> (f64, f64) {
        let turn = (v - self.centre[1]).atan2(u - self.centre[0]).rem_euclid(TAU);
        (turn * self.radius, self.radius.recip())
    }

    fn size_difference_mm(&self, other: &Self) -> f64 {
        2.0 * (self.radius - other.radius).abs()
    }

    fn least_size_mm(&self) -> f64 {
        2.0 * self.radius
    }

    fn sizes_in_words(&self) -> String {
        format!("{:.1} mm wide", 2.0 * self.radius)
    }
}

/// Measures a hole of about that diameter around `centre`, at most `search_mm` away; `axis` is the sheet's normal.
pub fn hole(
    local: &Local,
    centre: &Point3,
    axis: &UnitVector3,
    diameter_mm: f64,
    search_mm: f64,
) -> Result<HoleFound, NotFound> {
    hole_with_card(local, centre, axis, diameter_mm, search_mm, &mut Card::default())
}

/// The same, with the card of what was asked on the way.
pub fn hole_with_card(
    local: &Local,
    centre: &Point3,
    axis: &UnitVector3,
    diameter_mm: f64,
    search_mm: f64,
    card: &mut Card,
) -> Result<HoleFound, NotFound> {
    let nominal = Circle { centre: [0.0, 0.0], radius: 0.5 * diameter_mm };
    let frame = frame_of(local, centre, axis, None, &nominal);
    let found = measure_opening(local, &frame, &nominal, search_mm, card);
    let found = or_too_near_the_belt(local, centre, found, card)?;
    let own = found.centre_covariance();
    let fit = &found.fit;
    let sharpness = SHARPNESS_U * found.spacing_mm;
    card.normal = Some(frame.vector(found.normal()));
    Ok(HoleFound {
        centre: frame.on_own_face(found.centre()),
        axis: frame.vector(found.normal()),
        diameter_mm: 2.0 * (fit.outline.radius + local.uncertainty.edge_offset_mm),
        centre_covariance: frame.covariance(&own),
        u_centre_mm: larger_axis(&own),
        u_diameter_mm: 2.0 * fit.covariance[(2, 2)].max(0.0).sqrt().hypot(sharpness),
        rms_mm: found.layer.rms_mm,
        points_used: fit.points,
        warning: found.warning,
    })
}

/// Square root of the largest variance that a covariance about a frame has along any direction of u and v.
pub(super) fn larger_axis(own: &Matrix3<f64>) -> f64 {
    let [a, b, c] = [own[(0, 0)], own[(0, 1)], own[(1, 1)]];
    let (middle, half) = (0.5 * (a + c), 0.5 * (a - c));
    (middle + half.hypot(b)).max(0.0).sqrt()
}
