//! What the datum features will be worth, before anything is measured.
//!
//! **Problem.** An outline (hole rim, slot rim) is fitted to points of spacing `h`. How uncertain are its centre and, for
//! a slot, the direction of its long axis?
//!
//! **Formula.** Every piece `ds` of the outline tells the place of the outline along its normal with a variance `q / ds`.
//! A motion that moves the outline by `m(s)` along its normal per unit of motion then has the variance
//! `q / integral(m² ds)`. For a slot with straight edges of length `l` and end radius `r`:
//!
//! * turning about the centre: `m = x` on the two edges and `m = (l/2) sin t` on the ends, so
//!   `var(angle) = q / (l³/6 + pi r l²/4)`;
//! * shift along the long axis: `var = q / (pi r)`; across it: `var = q / (pi r + 2 l)`; a hole has `l = 0`.
//!
//! **Source of q.** In 150 simulated clouds the soft-edge fit found a straight trimmed edge, over a window of 3 mm at
//! h = 0.168 mm, with a standard deviation of 0.10 h, so `q = (0.10 h)² * 3 mm * (h / 0.168 mm) = 0.179 h³`: points lie along an outline at
//! distance h, each good for a fixed part of h. This predicts, for a slot of 20 x 8 mm, 1.07 mrad (measured
//! 1.0 to 1.3), 0.049 h and 0.029 h for its centre (measured 0.047 h and 0.025 h), and 0.049 h for a hole of 8 mm (measured
//! 0.042 h; the fit's own information matrix says 0.051 h).
//!
//! What is left out: height noise, shadows, lost points. The figures are standard deviations (k = 1) of a good scan.

use super::model::{AlignmentMethod, ComparisonPoint, Geometry, Plan, Rig, SlotReading};
use super::values::short;
use crate::geometry::{Point3, UnitVector3, Vector3};
use std::f64::consts::PI;

/// Point spacing in mm of the SIVPRO system (Bergström et al., "Automatic in-line inspection of shape based on
/// photogrammetry") at quarter resolution, for plans without `[rig]`.
pub const PAPER_SPACING_MM: f64 = 0.168;

/// Variance times length of outline, in units of h³; derived in the module's head.
const OUTLINE_VARIANCE: f64 = 0.10 * 0.10 * 3.0 / PAPER_SPACING_MM;

impl Rig {
    /// Distance in mm between neighbouring points on a part that faces the cameras: a pixel seen through the lens,
    /// `distance / focal * pixel`, doubled by each level of resolution after the first (the paper's second level has a quarter of the
    /// pixels, half of them in each direction).
    pub fn point_spacing_mm(&self) -> f64 {
        let halvings = self.resolution_level.saturating_sub(1).min(30);
        self.distance_mm / self.focal_mm * self.pixel_um * 1e-3 * f64::from(1_u32 << halvings)
    }
}

/// Point spacing to expect, mm: from the rig, else the paper's.
pub fn point_spacing_mm(rig: Option<&Rig>) -> f64 {
    rig.map_or(PAPER_SPACING_MM, Rig::point_spacing_mm)
}

/// Standard deviation in rad of the direction of a slot's long axis; `length_mm` is the overall length.
pub fn slot_axis_std_rad(length_mm: f64, width_mm: f64, spacing_mm: f64) -> f64 {
    let (straight, radius) = (length_mm - width_mm, 0.5 * width_mm);
    let information = straight.powi(3) / 6.0 + 0.25 * PI * radius * straight * straight;
    (OUTLINE_VARIANCE * spacing_mm.powi(3) / information).sqrt()
}

/// Standard deviations in mm of a slot's centre along its long axis and across it. A hole is a slot as long as wide.
pub fn slot_centre_std_mm(length_mm: f64, width_mm: f64, spacing_mm: f64) -> (f64, f64) {
    let (straight, radius) = (length_mm - width_mm, 0.5 * width_mm);
    let q = OUTLINE_VARIANCE * spacing_mm.powi(3);
    ((q / (PI * radius)).sqrt(), (q / (PI * radius + 2.0 * straight)).sqrt())
}

/// How well a plan's hole and slot will hold the part against turning about the hole, by either reading of the slot.
#[derive(Debug, Clone, PartialEq)]
pub struct TurningError {
    /// Name of the comparison point farthest from the hole, across the hole's axis.
    pub point: String,
    /// Its distance from the axis of the hole, mm.
    pub lever_mm: f64,
    /// Standard deviation there, mm, when the slot's axis is used.
    pub axis_mm: f64,
    /// Standard deviation there, mm, when the line between the centres is used.
    pub centre_line_mm: f64,
}

/// The turning error at the worst comparison point; `None` unless the plan aligns on features and has such a point.
pub fn turning_error(plan: &Plan) -> Option<TurningError> {
    let AlignmentMethod::Features { hole, slot, .. } = plan.alignment else { return None };
    let spacing = point_spacing_mm(plan.rig.as_ref());
    turning_error_of(&plan.features.get(hole)?.geometry, &plan.features.get(slot)?.geometry, &plan.comparison, spacing)
}

fn turning_error_of(
    hole: &Geometry,
    slot: &Geometry,
    comparison: &[ComparisonPoint],
    spacing_mm: f64,
) -> Option<TurningError> {
    let Geometry::Hole { centre, axis, diameter_mm, .. } = hole else { return None };
    let Geometry::Slot { centre: slot_centre, direction, length_mm, width_mm, .. } = slot else { return None };
    let mut worst: Option<(&ComparisonPoint, f64)> = None;
    for point in comparison {
        let lever = lever_mm(&point.geometry.position(), centre, axis);
        if worst.is_none_or(|(_, longest)| lever > longest) {
            worst = Some((point, lever));
        }
    }
    let (point, lever_mm) = worst?;
    let line = slot_centre - centre;
    let (hole_std, _) = slot_centre_std_mm(*diameter_mm, *diameter_mm, spacing_mm);
    let (along, across) = slot_centre_std_mm(*length_mm, *width_mm, spacing_mm);
    // The slot's centre turns the line by what it moves across the line: along the slot's axis by the sine between them.
    let cosine = line.try_normalize(1e-9).map_or(0.0, |unit| unit.dot(direction));
    let slot_var = along * along * (1.0 - cosine * cosine) + across * across * cosine * cosine;
    let centre_line_rad = (hole_std * hole_std + slot_var).sqrt() / line.norm().max(1e-9);
    Some(TurningError {
        point: point.name.clone(),
        lever_mm,
        axis_mm: slot_axis_std_rad(*length_mm, *width_mm, spacing_mm) * lever_mm,
        centre_line_mm: centre_line_rad * lever_mm,
    })
}

/// Message and help for a plan that reads the slot's axis; `None` for the other readings.
pub(super) fn axis_reading_warning(plan: &Plan) -> Option<(String, String)> {
    let AlignmentMethod::Features { slot, slot_reading: SlotReading::Axis, .. } = plan.alignment else { return None };
    let error = turning_error(plan)?;
    let spacing = point_spacing_mm(plan.rig.as_ref());
    let slot = plan.features.get(slot)?;
    let Geometry::Slot { length_mm, width_mm, .. } = slot.geometry else { return None };
    let mrad = 1e3 * slot_axis_std_rad(length_mm, width_mm, spacing);
    let source = if plan.rig.is_some() { "from [rig]" } else { "without [rig]" };
    let message = format!(
        "[alignment] slot_reading: the axis of slot \"{}\" ({} x {} mm) is only known to about {mrad:.2} mrad at {spacing:.3} mm \
         between points ({source}); expected error (standard deviation) about {} at point \"{}\", {:.0} mm from the hole; \
         \"centre_line\" would be about {}",
        slot.name,
        short(length_mm),
        short(width_mm),
        mm(error.axis_mm),
        error.point,
        error.lever_mm,
        mm(error.centre_line_mm),
    );
    Some((message, "write slot_reading = \"centre_line\", unless the drawing asks for the slot's axis".to_owned()))
}

/// A length with two telling digits.
fn mm(length_mm: f64) -> String {
    let digits = if length_mm >= 0.1 { 2 } else { 3 };
    format!("{length_mm:.digits$} mm")
}

/// Distance of a point from the axis through the hole.
fn lever_mm(point: &Point3, centre: &Point3, axis: &UnitVector3) -> f64 {
    let from_hole: Vector3 = point - centre;
    (from_hole - axis.into_inner() * axis.dot(&from_hole)).norm()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The figures of the simulations named in the module's head, each to its own spread.
    #[test]
    fn predicts_what_was_measured_on_simulated_slots_and_holes() {
        let h = PAPER_SPACING_MM;
        let angle = slot_axis_std_rad(20.0, 8.0, h);
        assert!((1.0e-3..1.3e-3).contains(&angle), "{angle}");
        let (along, across) = slot_centre_std_mm(20.0, 8.0, h);
        // 60 runs: a standard deviation is known to 1/sqrt(120) = 9 %, the formula is good to 25 %.
        assert!((along / (0.047 * h) - 1.0).abs() < 0.25, "{along}");
        assert!((across / (0.025 * h) - 1.0).abs() < 0.25, "{across}");
        let (hole, other) = slot_centre_std_mm(8.0, 8.0, h);
        assert_eq!(hole, other);
        assert!((hole / (0.046 * h) - 1.0).abs() < 0.25, "{hole}");
    }

    #[test]
    fn the_rig_of_the_paper_has_the_spacing_of_the_paper() {
        let rig = |resolution_level: u32| Rig {
            distance_mm: 600.0,
            base_mm: 200.0,
            focal_mm: 35.0,
            pixel_um: 4.88,
            image_accuracy_px: 0.3,
            resolution_level,
        };
        // The paper rounds to 1 µm.
        assert!((rig(2).point_spacing_mm() - PAPER_SPACING_MM).abs() < 1e-3);
        for level in 1..16 {
            assert_eq!(rig(level + 1).point_spacing_mm(), 2.0 * rig(level).point_spacing_mm());
        }
    }

    #[test]
    fn longer_slots_and_denser_points_hold_better() {
        assert!(slot_axis_std_rad(40.0, 8.0, 0.168) < 0.5 * slot_axis_std_rad(20.0, 8.0, 0.168));
        // q goes with h³, so the deviation with h^1.5.
        let ratio = slot_axis_std_rad(20.0, 8.0, 0.336) / slot_axis_std_rad(20.0, 8.0, 0.168);
        assert!((ratio - 2.0_f64.powf(1.5)).abs() < 1e-12);
    }
}
