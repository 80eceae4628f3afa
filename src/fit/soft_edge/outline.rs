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

    /// A function that tells the signed distance of a place in mm, positive in the material, and puts its derivatives by the shape
    /// parameters into its second argument. What is the same for all places is computed once.
    fn distances(&self) -> impl Fn([f64; 2], &mut [f64; MAX_SHAPE]) -> f64;

    /// Signed distance of a single place in mm, as [`Outline::distances`] tells it.
    fn signed_mm(&self, place: [f64; 2], gradient: &mut [f64; MAX_SHAPE]) -> f64 {
        self.distances()(place, gradient)
    }

    /// Moments of the blurred void inside the window, and their derivatives by the shape parameters (the last entry is the
    /// derivative by tau).
    fn void(&self, tau_mm: f64) -> (Moments, [Moments; MAX_SHAPE + 1]);

    /// Whether the outline ends where it begins.
    const CLOSED: bool;
    /// Shape parameters whose variances are told together: from and to (not included).
    const BLOCKS: &'static [[usize; 2]];

    /// The shape parameters.
    fn parameters(&self) -> [f64; MAX_SHAPE];

    /// A function that tells where along the outline a place lies, 0..1 of its length. What is the same for all places is computed
    /// once.
    fn places(&self) -> impl Fn([f64; 2]) -> f64;

    /// Where along the outline a single place lies, as [`Outline::places`] tells it.
    fn along(&self, place: [f64; 2]) -> f64 {
        self.places()(place)
    }

    /// The place on the outline at that share (0..1) of its length.
    fn place_at(&self, along: f64) -> [f64; 2];

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

    #[inline]
    fn distances(&self) -> impl Fn([f64; 2], &mut [f64; MAX_SHAPE]) -> f64 {
        let Self { centre, radius } = *self;
        move |place, gradient| {
            let (x, y) = (place[0] - centre[0], place[1] - centre[1]);
            // Quicker than hypot; these are some mm, whose squares neither overflow nor vanish.
            let distance = (x * x + y * y).sqrt();
            let inverse = if distance > 0.0 { 1.0 / distance } else { 0.0 };
            gradient[0] = -x * inverse;
            gradient[1] = -y * inverse;
            gradient[2] = -1.0;
            distance - radius
        }
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

    const CLOSED: bool = true;
    const BLOCKS: &'static [[usize; 2]] = &[[0, 2], [2, 3]];

    fn parameters(&self) -> [f64; MAX_SHAPE] {
        [self.centre[0], self.centre[1], self.radius, 0.0, 0.0]
    }

    #[inline]
    fn places(&self) -> impl Fn([f64; 2]) -> f64 {
        let [u, v] = self.centre;
        move |place| turn_share(quick_angle(place[1] - v, place[0] - u) / TAU)
    }

    fn place_at(&self, along: f64) -> [f64; 2] {
        let (sin, cos) = (along * TAU).sin_cos();
        [self.centre[0] + self.radius * cos, self.centre[1] + self.radius * sin]
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
        self.own_frames()(place)
    }

    /// The function that tells places in the slot's own frame.
    #[inline]
    fn own_frames(&self) -> impl Fn([f64; 2]) -> [f64; 2] + use<> {
        let (centre, (sin, cos)) = (self.centre, self.angle.sin_cos());
        move |place| {
            let (x, y) = (place[0] - centre[0], place[1] - centre[1]);
            [x * cos + y * sin, y * cos - x * sin]
        }
    }
}

impl Outline for Slot {
    const SHAPE: usize = 5;
    const IS_ANGLE: [bool; MAX_SHAPE] = [false, false, true, false, false];
    const DEPTH: (usize, f64) = (4, 1.0);

    #[inline]
    fn distances(&self) -> impl Fn([f64; 2], &mut [f64; MAX_SHAPE]) -> f64 {
        let Self { centre, angle, half_straight, radius } = *self;
        let (sin, cos) = angle.sin_cos();
        move |place, gradient| {
            let (x, y) = (place[0] - centre[0], place[1] - centre[1]);
            let (along, across) = (x * cos + y * sin, y * cos - x * sin);
            let foot = along.clamp(-half_straight, half_straight);
            let beyond = along - foot;
            let distance = (beyond * beyond + across * across).sqrt();
            let inverse = if distance > 0.0 { 1.0 / distance } else { 0.0 };
            let (n_along, n_across) = (beyond * inverse, across * inverse);
            gradient[0] = -(n_along * cos - n_across * sin);
            gradient[1] = -(n_along * sin + n_across * cos);
            // The foot point turns with the axis, across it.
            gradient[2] = -n_across * foot;
            gradient[3] = -n_along * foot.signum();
            gradient[4] = -1.0;
            distance - radius
        }
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

    const CLOSED: bool = true;
    // The end of a slot is its half length and its radius together.
    const BLOCKS: &'static [[usize; 2]] = &[[0, 2], [2, 3], [3, 5]];

    fn parameters(&self) -> [f64; MAX_SHAPE] {
        [self.centre[0], self.centre[1], self.angle, self.half_straight, self.radius]
    }

    #[inline]
    fn places(&self) -> impl Fn([f64; 2]) -> f64 {
        let (own, l, r) = (self.own_frames(), self.half_straight, self.radius);
        let (arc, length) = (PI * r, TAU * r + 4.0 * l);
        // Counter-clockwise from the middle of the right-hand end: half an arc, the upper side, an arc, the lower side, half an arc.
        move |place| {
            let [x, y] = own(place);
            let from_start = if x.abs() <= l {
                if y >= 0.0 { 0.5 * arc + (l - x) } else { 1.5 * arc + 2.0 * l + (x + l) }
            } else if x > l {
                quick_angle(y, x - l) * r
            } else {
                // Turned by half a turn: the left-hand end seen as a right-hand one.
                quick_angle(-y, -x - l) * r + arc + 2.0 * l
            };
            turn_share(from_start / length)
        }
    }

    fn place_at(&self, along: f64) -> [f64; 2] {
        // Half an outline on from a quarter turn back is the right half: an arc, then the upper side; the rest is opposite.
        let (l, r) = (self.half_straight, self.radius);
        let (arc, half) = (PI * r, PI * r + 2.0 * l);
        let from_start = along * 2.0 * half + 0.5 * arc;
        let opposite = if from_start >= half && from_start < 2.0 * half { -1.0 } else { 1.0 };
        let from_corner = from_start.rem_euclid(half);
        let [x, y] = if from_corner < arc {
            let (sin, cos) = (from_corner / r).sin_cos();
            [l + r * sin, -r * cos]
        } else {
            [l - (from_corner - arc), r]
        };
        let (sin, cos) = self.angle.sin_cos();
        let [x, y] = [opposite * x, opposite * y];
        [self.centre[0] + x * cos - y * sin, self.centre[1] + x * sin + y * cos]
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

    #[inline]
    fn distances(&self) -> impl Fn([f64; 2], &mut [f64; MAX_SHAPE]) -> f64 {
        let Self { offset, slope, .. } = *self;
        // The distance across v, not across the slanted line: the slope is a few degrees at most, the blur absorbs its cosine.
        move |place, gradient| {
            gradient[0] = 1.0;
            gradient[1] = place[0];
            offset + slope * place[0] - place[1]
        }
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

    const CLOSED: bool = false;
    const BLOCKS: &'static [[usize; 2]] = &[[0, 1], [1, 2]];

    fn parameters(&self) -> [f64; MAX_SHAPE] {
        [self.offset, self.slope, 0.0, 0.0, 0.0]
    }

    fn place_at(&self, along: f64) -> [f64; 2] {
        let u = self.along[0] + along * (self.along[1] - self.along[0]);
        [u, self.offset + self.slope * u]
    }

    #[inline]
    fn places(&self) -> impl Fn([f64; 2]) -> f64 {
        let [from, to] = self.along;
        move |place| (place[0] - from) / (to - from)
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

/// A number of turns, to be brought into 0..1, that is between -1 and 2 already.
fn turn_share(turns: f64) -> f64 {
    if turns < 0.0 {
        turns + 1.0
    } else if turns >= 1.0 {
        turns - 1.0
    } else {
        turns
    }
}

/// `y.atan2(x)` to 4e-8 rad, by a polynomial in the smaller over the larger.
#[inline]
fn quick_angle(y: f64, x: f64) -> f64 {
    // Minimax fit of atan(t) / t over 0..1, powers of t² from the highest.
    const POWERS: [f64; 8] = [
        -0.004_054_567,
        0.021_862_957,
        -0.055_912_328,
        0.096_421_977,
        -0.139_086_298,
        0.199_465_658,
        -0.333_298_608,
        0.999_999_336,
    ];
    let (wide, high) = (x.abs(), y.abs());
    let larger = wide.max(high);
    if larger == 0.0 {
        return 0.0;
    }
    let t = wide.min(high) / larger;
    let octant = t * POWERS.iter().fold(0.0, |sum, c| sum * (t * t) + c);
    let quadrant = if high > wide { 0.5 * PI - octant } else { octant };
    let half = if x < 0.0 { PI - quadrant } else { quadrant };
    if y < 0.0 { -half } else { half }
}

fn about_centre(area: f64, centre: [f64; 2]) -> Moments {
    [area, area * centre[0], area * centre[1]]
}

#[cfg(test)]
mod tests;
