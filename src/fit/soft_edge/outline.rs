//! The outlines: signed distance with its derivatives, and what each takes away from a window, blurred edge included.
//!
//! Signed distance is positive in the material. The void is the other side: with Phi the normal distribution and tau the
//! blur, an outline removes the weight `1 - Phi(s/tau)` from every place. For a circle and a slot the integral of that
//! weight follows from Steiner's formula for parallel bodies: the area at distance d outside is `A + P d + pi d²`, and the
//! blur has mean 0 and variance tau², hence `A + pi tau²` exactly (up to the weight that reaches past the middle,
//! exp(-r²/2tau²)). By point symmetry its first moment is that area times the centre.

use std::f64::consts::{PI, TAU};

/// Most shape parameters an outline has.
pub const MAX_SHAPE: usize = 5;

/// Area of the void and its first moments along u and v.
pub type Moments = [f64; 3];

/// A family of outlines in the plane (u, v), mm.
pub trait Outline: Clone {
    /// How many shape parameters there are (at most [`MAX_SHAPE`]).
    const SHAPE: usize;
    /// Which shape parameters are angles (rad, or a slope) rather than lengths.
    const IS_ANGLE: [bool; MAX_SHAPE];
    /// The parameter that moves the whole outline along its normal, and the sign with which it grows the void.
    const DEPTH: (usize, f64);

    /// Signed distance of a place in mm, positive in the material; its derivatives by the shape parameters go to `gradient`.
    fn signed_mm(&self, place: [f64; 2], gradient: &mut [f64; MAX_SHAPE]) -> f64;

    /// Moments of the blurred void inside the window, and their derivatives by the shape parameters (the last entry is the
    /// derivative by tau).
    fn void(&self, tau_mm: f64) -> (Moments, [Moments; MAX_SHAPE + 1]);

    /// Where along the outline a place lies, 0..1 of its length.
    fn along(&self, place: [f64; 2]) -> f64;

    /// Length of the outline in the window, mm.
    fn length_mm(&self) -> f64;

    /// The outline with its shape parameters changed by a step.
    fn moved(&self, step: &[f64]) -> Self;

    /// The largest step that an iteration may take in each shape parameter, for points of that spacing.
    fn step_limits(&self, spacing_mm: f64) -> [f64; MAX_SHAPE];

    /// Whether the parameters make an outline (positive sizes).
    fn is_sound(&self) -> bool;
}

/// A circular hole: parameters centre u, centre v, radius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle {
    /// Centre, mm.
    pub centre: [f64; 2],
    /// Radius, mm.
    pub radius: f64,
}

impl Outline for Circle {
    const SHAPE: usize = 3;
    const IS_ANGLE: [bool; MAX_SHAPE] = [false; MAX_SHAPE];
    const DEPTH: (usize, f64) = (2, 1.0);

    fn signed_mm(&self, place: [f64; 2], gradient: &mut [f64; MAX_SHAPE]) -> f64 {
        let (x, y) = (place[0] - self.centre[0], place[1] - self.centre[1]);
        let distance = x.hypot(y);
        let inverse = if distance > 0.0 { 1.0 / distance } else { 0.0 };
        gradient[0] = -x * inverse;
        gradient[1] = -y * inverse;
        gradient[2] = -1.0;
        distance - self.radius
    }

    fn void(&self, tau_mm: f64) -> (Moments, [Moments; MAX_SHAPE + 1]) {
        let area = PI * (self.radius * self.radius + tau_mm * tau_mm);
        let mut by = [[0.0; 3]; MAX_SHAPE + 1];
        by[0] = [0.0, area, 0.0];
        by[1] = [0.0, 0.0, area];
        by[2] = about_centre(TAU * self.radius, self.centre);
        by[MAX_SHAPE] = about_centre(TAU * tau_mm, self.centre);
        (about_centre(area, self.centre), by)
    }

    fn along(&self, place: [f64; 2]) -> f64 {
        (f64::atan2(place[1] - self.centre[1], place[0] - self.centre[0]) / TAU).rem_euclid(1.0)
    }

    fn length_mm(&self) -> f64 {
        TAU * self.radius
    }

    fn moved(&self, step: &[f64]) -> Self {
        Self { centre: [self.centre[0] + step[0], self.centre[1] + step[1]], radius: self.radius + step[2] }
    }

    fn step_limits(&self, spacing_mm: f64) -> [f64; MAX_SHAPE] {
        [2.0 * spacing_mm; MAX_SHAPE]
    }

    fn is_sound(&self) -> bool {
        self.radius > 0.0
    }
}

/// A slot with round ends: parameters centre u, centre v, angle of the long axis from u, half of the straight length,
/// radius (half width).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slot {
    /// Centre, mm.
    pub centre: [f64; 2],
    /// Angle of the long axis from u towards v, rad.
    pub angle: f64,
    /// Half the distance between the centres of the two ends, mm.
    pub half_straight: f64,
    /// Radius of the ends, half the width, mm.
    pub radius: f64,
}

impl Slot {
    /// Overall length, mm.
    pub fn length_mm(&self) -> f64 {
        2.0 * (self.half_straight + self.radius)
    }

    /// Width, mm.
    pub fn width_mm(&self) -> f64 {
        2.0 * self.radius
    }

    /// Place in the slot's own frame: along and across the long axis.
    pub fn own_frame(&self, place: [f64; 2]) -> [f64; 2] {
        let (x, y) = (place[0] - self.centre[0], place[1] - self.centre[1]);
        let (sin, cos) = self.angle.sin_cos();
        [x * cos + y * sin, y * cos - x * sin]
    }
}

impl Outline for Slot {
    const SHAPE: usize = 5;
    const IS_ANGLE: [bool; MAX_SHAPE] = [false, false, true, false, false];
    const DEPTH: (usize, f64) = (4, 1.0);

    fn signed_mm(&self, place: [f64; 2], gradient: &mut [f64; MAX_SHAPE]) -> f64 {
        let (sin, cos) = self.angle.sin_cos();
        let [along, across] = self.own_frame(place);
        let foot = along.clamp(-self.half_straight, self.half_straight);
        let distance = (along - foot).hypot(across);
        let inverse = if distance > 0.0 { 1.0 / distance } else { 0.0 };
        let (n_along, n_across) = ((along - foot) * inverse, across * inverse);
        gradient[0] = -(n_along * cos - n_across * sin);
        gradient[1] = -(n_along * sin + n_across * cos);
        // The foot point turns with the axis, across it.
        gradient[2] = -n_across * foot;
        gradient[3] = -n_along * foot.signum();
        gradient[4] = -1.0;
        distance - self.radius
    }

    fn void(&self, tau_mm: f64) -> (Moments, [Moments; MAX_SHAPE + 1]) {
        let (r, l) = (self.radius, self.half_straight);
        let area = PI * (r * r + tau_mm * tau_mm) + 4.0 * l * r;
        let mut by = [[0.0; 3]; MAX_SHAPE + 1];
        by[0] = [0.0, area, 0.0];
        by[1] = [0.0, 0.0, area];
        by[3] = about_centre(4.0 * r, self.centre);
        by[4] = about_centre(TAU * r + 4.0 * l, self.centre);
        by[MAX_SHAPE] = about_centre(TAU * tau_mm, self.centre);
        (about_centre(area, self.centre), by)
    }

    fn along(&self, place: [f64; 2]) -> f64 {
        // Counter-clockwise from the middle of the right-hand end: half an arc, the upper side, an arc, the lower side, half an arc.
        let [x, y] = self.own_frame(place);
        let (l, arc) = (self.half_straight, PI * self.radius);
        let from_start = if x.abs() <= l {
            if y >= 0.0 { 0.5 * arc + (l - x) } else { 1.5 * arc + 2.0 * l + (x + l) }
        } else if x > l {
            y.atan2(x - l) * self.radius
        } else {
            // Turned by half a turn: the left-hand end seen as a right-hand one.
            (-y).atan2(-x - l) * self.radius + arc + 2.0 * l
        };
        (from_start / (TAU * self.radius + 4.0 * self.half_straight)).rem_euclid(1.0)
    }

    fn length_mm(&self) -> f64 {
        TAU * self.radius + 4.0 * self.half_straight
    }

    fn moved(&self, step: &[f64]) -> Self {
        Self {
            centre: [self.centre[0] + step[0], self.centre[1] + step[1]],
            angle: self.angle + step[2],
            half_straight: self.half_straight + step[3],
            radius: self.radius + step[4],
        }
    }

    fn step_limits(&self, spacing_mm: f64) -> [f64; MAX_SHAPE] {
        let mm = 2.0 * spacing_mm;
        [mm, mm, mm / (self.half_straight + self.radius), mm, mm]
    }

    fn is_sound(&self) -> bool {
        self.radius > 0.0 && self.half_straight >= 0.0
    }
}

/// A trimmed edge in a window `along.0 <= u <= along.1`, `v <= outer_mm`: material below the line
/// `v = offset + slope u`. Parameters offset, slope.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// Where the edge lies at u = 0, outwards positive, mm.
    pub offset: f64,
    /// Its rise along u.
    pub slope: f64,
    /// Ends of the window along the edge, mm.
    pub along: [f64; 2],
    /// End of the window outwards, mm; several tau beyond the edge.
    pub outer_mm: f64,
}

impl Outline for Edge {
    const SHAPE: usize = 2;
    const IS_ANGLE: [bool; MAX_SHAPE] = [false, true, false, false, false];
    const DEPTH: (usize, f64) = (0, -1.0);

    fn signed_mm(&self, place: [f64; 2], gradient: &mut [f64; MAX_SHAPE]) -> f64 {
        // The distance across v, not across the slanted line: the slope is a few degrees at most, the blur absorbs its cosine.
        gradient[0] = 1.0;
        gradient[1] = place[0];
        self.offset + self.slope * place[0] - place[1]
    }

    fn void(&self, tau_mm: f64) -> (Moments, [Moments; MAX_SHAPE + 1]) {
        // Integrals over the strip from v = offset + slope u to the outer end, blur tau: the mean of v² gains tau².
        let [m1, m2] = self.along;
        let (p1, p2, p3) = (m2 - m1, (m2 * m2 - m1 * m1) / 2.0, (m2.powi(3) - m1.powi(3)) / 3.0);
        let (s, k, b) = (self.offset, self.slope, self.outer_mm);
        let area = (b - s) * p1 - k * p2;
        let moment_u = (b - s) * p2 - k * p3;
        let moment_v = 0.5 * ((b * b - s * s - tau_mm * tau_mm) * p1 - 2.0 * s * k * p2 - k * k * p3);
        let mut by = [[0.0; 3]; MAX_SHAPE + 1];
        by[0] = [-p1, -p2, -s * p1 - k * p2];
        by[1] = [-p2, -p3, -s * p2 - k * p3];
        by[MAX_SHAPE] = [0.0, 0.0, -tau_mm * p1];
        ([area, moment_u, moment_v], by)
    }

    fn along(&self, place: [f64; 2]) -> f64 {
        (place[0] - self.along[0]) / (self.along[1] - self.along[0])
    }

    fn length_mm(&self) -> f64 {
        self.along[1] - self.along[0]
    }

    fn moved(&self, step: &[f64]) -> Self {
        Self { offset: self.offset + step[0], slope: self.slope + step[1], ..*self }
    }

    fn step_limits(&self, spacing_mm: f64) -> [f64; MAX_SHAPE] {
        let mm = 2.0 * spacing_mm;
        [mm, 2.0 * mm / (self.along[1] - self.along[0]), mm, mm, mm]
    }

    fn is_sound(&self) -> bool {
        true
    }
}

fn about_centre(area: f64, centre: [f64; 2]) -> Moments {
    [area, area * centre[0], area * centre[1]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::soft_edge::normal;

    fn check_distance_derivatives<O: Outline>(outline: &O) {
        let d = 1e-6;
        for place in [[5.3, 0.4], [-1.2, 3.9], [6.1, -2.2], [-7.0, 1.0], [0.2, -1.1]] {
            let mut gradient = [0.0; MAX_SHAPE];
            outline.signed_mm(place, &mut gradient);
            for k in 0..O::SHAPE {
                let mut step = [0.0; MAX_SHAPE];
                let mut shifted = |by: f64| {
                    step[k] = by;
                    outline.moved(&step).signed_mm(place, &mut [0.0; MAX_SHAPE])
                };
                let slope = (shifted(d) - shifted(-d)) / (2.0 * d);
                // Central differences: rounding 1e-16/1e-6 * 10 mm, truncation 1e-12.
                assert!((slope - gradient[k]).abs() < 1e-7, "parameter {k} at {place:?}: {slope} {}", gradient[k]);
            }
        }
    }

    /// Void moments summed on a fine grid of the window against the closed form, and derivatives against differences.
    fn check_void<O: Outline>(outline: &O, u: [f64; 2], v: [f64; 2], tau: f64) {
        let steps = 700;
        let (du, dv) = ((u[1] - u[0]) / steps as f64, (v[1] - v[0]) / steps as f64);
        let mut sum = [0.0; 3];
        for i in 0..steps {
            for j in 0..steps {
                let place = [u[0] + (i as f64 + 0.5) * du, v[0] + (j as f64 + 0.5) * dv];
                let s = outline.signed_mm(place, &mut [0.0; MAX_SHAPE]);
                let weight = (1.0 - normal::distribution_and_density(s / tau).0) * du * dv;
                sum = [sum[0] + weight, sum[1] + weight * place[0], sum[2] + weight * place[1]];
            }
        }
        let (moments, by) = outline.void(tau);
        for k in 0..3 {
            // Midpoint sums of a function blurred over tau > 10 steps are good to 1e-6 of the area.
            assert!((sum[k] - moments[k]).abs() < 2e-4, "moment {k}: {} {}", sum[k], moments[k]);
        }
        let d = 1e-6;
        for p in 0..=O::SHAPE {
            let shifted = |by: f64| {
                let mut step = [0.0; MAX_SHAPE];
                if p < O::SHAPE {
                    step[p] = by;
                    outline.moved(&step).void(tau).0
                } else {
                    outline.void(tau + by).0
                }
            };
            let (up, down) = (shifted(d), shifted(-d));
            let analytic = if p < O::SHAPE { by[p] } else { by[MAX_SHAPE] };
            for k in 0..3 {
                assert!(((up[k] - down[k]) / (2.0 * d) - analytic[k]).abs() < 1e-6, "parameter {p} moment {k}");
            }
        }
    }

    #[test]
    fn circle_distance_and_area() {
        let circle = Circle { centre: [0.3, -0.2], radius: 4.0 };
        check_distance_derivatives(&circle);
        check_void(&circle, [-7.0, 7.0], [-7.0, 7.0], 0.3);
    }

    #[test]
    fn slot_distance_and_area() {
        let slot = Slot { centre: [0.3, -0.2], angle: 0.4, half_straight: 4.0, radius: 2.0 };
        check_distance_derivatives(&slot);
        check_void(&slot, [-9.0, 9.0], [-8.0, 8.0], 0.3);
        assert_eq!((slot.length_mm(), slot.width_mm()), (12.0, 4.0));
    }

    #[test]
    fn places_around_an_outline_are_numbered_by_its_length() {
        let slot = Slot { centre: [1.0, 2.0], angle: 0.0, half_straight: 4.0, radius: 2.0 };
        let length = TAU * 2.0 + 16.0;
        let at = |x: f64, y: f64| slot.along([1.0 + x, 2.0 + y]) * length;
        let arc = PI * 2.0;
        for (place, expected) in [
            ((6.5, 0.0), 0.0),
            ((4.0, 2.2), 0.5 * arc),
            ((0.0, 2.0), 0.5 * arc + 4.0),
            ((-4.0 - 1e-9, 2.0), 0.5 * arc + 8.0),
            ((-6.0, 0.0), arc + 8.0),
            ((0.0, -2.0), 1.5 * arc + 12.0),
        ] {
            assert!((at(place.0, place.1) - expected).abs() < 1e-6, "{place:?}");
        }
        let circle = Circle { centre: [1.0, 2.0], radius: 3.0 };
        assert_eq!(circle.along([1.0, 7.0]), 0.25);
    }

    #[test]
    fn edge_distance_and_area() {
        let edge = Edge { offset: 0.4, slope: 0.05, along: [-2.0, 1.5], outer_mm: 4.0 };
        check_distance_derivatives(&edge);
        check_void(&edge, [-2.0, 1.5], [-5.0, 4.0], 0.3);
    }
}
