//! The profiled log-likelihood with its gradient and curvature.

#![expect(clippy::needless_range_loop, reason = "rows and columns of one small matrix are addressed by number")]

use super::data::{Data, FAR, LANES, Region};
use super::normal::distribution_and_density;
use super::outline::{MAX_SHAPE, Moments, Outline};

/// Most parameters: shape, ln tau, gradient along u and v.
pub const MAX_ALL: usize = MAX_SHAPE + 3;

/// Everything that is estimated. The density gradient is told over the region's reach, so it has no unit.
#[derive(Debug, Clone)]
pub struct State<O> {
    pub outline: O,
    pub tau_mm: f64,
    pub gradient: [f64; 2],
}

impl<O: Outline> State<O> {
    /// Number of parameters in use.
    pub const fn count() -> usize {
        O::SHAPE + 3
    }

    /// The state after a step in (shape, ln tau, gradient).
    pub fn moved(&self, step: &[f64]) -> Self {
        let s = O::SHAPE;
        Self {
            outline: self.outline.moved(&step[..s]),
            tau_mm: self.tau_mm * step[s].exp(),
            gradient: [self.gradient[0] + step[s + 1], self.gradient[1] + step[s + 2]],
        }
    }
}

/// A vector over all parameters.
pub type Slope = [f64; MAX_ALL];
/// A matrix over all parameters.
pub type Curvature = [[f64; MAX_ALL]; MAX_ALL];

/// Value, gradient and (negative, approximate) curvature at a state.
#[derive(Clone)]
pub struct Evaluation {
    pub value: f64,
    pub slope: Slope,
    pub curvature: Curvature,
}

/// Relative density below which the linear gradient has no meaning.
const LEAST_DENSITY: f64 = 0.02;

/// A sum of logarithms that takes one logarithm for many factors.
struct LogSum {
    sum: f64,
    product: f64,
}

impl Default for LogSum {
    fn default() -> Self {
        Self { sum: 0.0, product: 1.0 }
    }
}

impl LogSum {
    fn add(&mut self, factor: f64) {
        self.product *= factor;
        if !(1e-100..1e100).contains(&self.product) {
            self.sum += self.product.ln();
            self.product = 1.0;
        }
    }

    fn total(&self) -> f64 {
        self.sum + self.product.ln()
    }
}

/// Log-likelihood with gradient and curvature; `None` where the model has no meaning (negative density, no area). The curvature leaves
/// out the bending of the distance function itself, which is smaller than the rest by tau / radius; it is only used for steps and
/// for the covariance. The data must hold the state.
pub fn evaluate<O: Outline>(data: &Data<O>, state: &State<O>) -> Option<Evaluation> {
    debug_assert!(data.holds(state));
    let all = State::<O>::count();
    if !state.outline.is_sound() {
        return None;
    }
    let mut logarithms = LogSum::default();
    let mut out = Evaluation { value: 0.0, slope: [0.0; MAX_ALL], curvature: [[0.0; MAX_ALL]; MAX_ALL] };
    add_density(data, state, &mut logarithms, &mut out)?;
    add_near(data, state, &mut logarithms, &mut out);
    for a in 1..all {
        for b in 0..a {
            out.curvature[a][b] = out.curvature[b][a];
        }
    }
    let g = state.gradient;
    let weight = 1.0 / (data.gradient_sigma * data.gradient_sigma);
    let clutter = data.far_in_void as f64 * data.clutter.ln();
    let area = add_area_terms(data, state, &mut out)?;
    let prior = 0.5 * weight * (g[0] * g[0] + g[1] * g[1]);
    out.value = logarithms.total() + clutter - data.count() * area.ln() - prior;
    for a in 0..2 {
        out.slope[O::SHAPE + 1 + a] -= g[a] * weight;
        out.curvature[O::SHAPE + 1 + a][O::SHAPE + 1 + a] += weight;
    }
    debug_assert!(out.slope[..all].iter().all(|v| v.is_finite()));
    Some(out)
}

/// Densities multiplied before a logarithm is taken: 0.02 to the 16th is far above the smallest number.
const BLOCK: usize = 16;

/// Sums over points of what the density's logarithm has for derivatives.
#[derive(Clone, Copy, Default)]
struct DensitySums {
    su: f64,
    sv: f64,
    uu: f64,
    uv: f64,
    vv: f64,
}

impl DensitySums {
    #[inline]
    fn add(&mut self, u: f64, v: f64) {
        self.su += u;
        self.sv += v;
        self.uu += u * u;
        self.uv += u * v;
        self.vv += v * v;
    }

    fn join(&mut self, other: &Self) {
        self.su += other.su;
        self.sv += other.sv;
        self.uu += other.uu;
        self.uv += other.uv;
        self.vv += other.vv;
    }
}

/// The share of `1 + g.x` in the likelihood.
fn add_density<O: Outline>(
    data: &Data<O>,
    state: &State<O>,
    logarithms: &mut LogSum,
    out: &mut Evaluation,
) -> Option<()> {
    let [gu, gv] = state.gradient;
    let mut lanes = [DensitySums::default(); LANES];
    let (us, vs) = (data.scaled[0].chunks_exact(BLOCK * LANES), data.scaled[1].chunks_exact(BLOCK * LANES));
    let rest = (us.remainder(), vs.remainder());
    for (us, vs) in us.zip(vs).chain(std::iter::once(rest)) {
        let (mut least, mut product) = ([f64::INFINITY; LANES], [1.0; LANES]);
        for (us, vs) in us.chunks_exact(LANES).zip(vs.chunks_exact(LANES)) {
            for k in 0..LANES {
                let density = 1.0 + gu * us[k] + gv * vs[k];
                least[k] = if density < least[k] { density } else { least[k] };
                product[k] *= density;
                lanes[k].add(us[k] / density, vs[k] / density);
            }
        }
        if least.iter().any(|least| *least <= LEAST_DENSITY) {
            return None;
        }
        product.iter().for_each(|product| logarithms.add(*product));
    }
    let mut sums = DensitySums::default();
    lanes.iter().for_each(|lane| sums.join(lane));
    let DensitySums { su, sv, uu, uv, vv } = sums;
    let first = O::SHAPE + 1;
    out.slope[first] += su;
    out.slope[first + 1] += sv;
    out.curvature[first][first] += uu;
    out.curvature[first][first + 1] += uv;
    out.curvature[first + 1][first + 1] += vv;
    Some(())
}

/// What the points near the outline say of shape and blur (upper triangle of the curvature): a lane of points at a time, as
/// [`add_presence`] does one by one.
fn add_near<O: Outline>(data: &Data<O>, state: &State<O>, logarithms: &mut LogSum, out: &mut Evaluation) {
    let (shape, inverse_tau, present) = (O::SHAPE, 1.0 / state.tau_mm, 1.0 - data.clutter);
    let (distance, mut ds) = (state.outline.distances(), [0.0; MAX_SHAPE]);
    let lanes = data.near.chunks_exact(LANES);
    let rest = lanes.remainder();
    let mut blur = [0.0; MAX_SHAPE + 1];
    for points in lanes {
        let (mut z, mut dz) = ([0.0; LANES], [[0.0; LANES]; MAX_SHAPE + 1]);
        for l in 0..LANES {
            z[l] = distance(points[l], &mut ds) * inverse_tau;
            for k in 0..shape {
                dz[k][l] = ds[k] * inverse_tau;
            }
            dz[shape][l] = -z[l]; // by ln tau
        }
        let (mut m, mut bend, mut product) = ([0.0; LANES], [0.0; LANES], 1.0);
        for l in 0..LANES {
            let (phi, d) = distribution_and_density(z[l]);
            let presence = data.clutter + present * phi;
            m[l] = present * d / presence;
            bend[l] = m[l] * (z[l] + m[l]);
            product *= presence;
        }
        logarithms.add(product);
        for a in 0..=shape {
            let slope = dot(&m, &dz[a]);
            out.slope[a] += slope;
            blur[a] += slope;
            let row: [f64; LANES] = std::array::from_fn(|l| bend[l] * dz[a][l]);
            for b in a..=shape {
                out.curvature[a][b] += dot(&row, &dz[b]);
            }
        }
    }
    // Second derivatives of z by ln tau.
    for a in 0..=shape {
        out.curvature[a][shape] += blur[a];
    }
    for p in rest {
        let s = distance(*p, &mut ds);
        logarithms.add(add_presence::<O>(s, &ds, state.tau_mm, data.clutter, &mut out.slope, &mut out.curvature));
    }
}

/// Sum of products, two sums side by side, which the processor adds at once.
#[inline]
fn dot(a: &[f64; LANES], b: &[f64; LANES]) -> f64 {
    let mut sums = [0.0; 2];
    for l in (0..LANES).step_by(2) {
        sums[0] += a[l] * b[l];
        sums[1] += a[l + 1] * b[l + 1];
    }
    sums[0] + sums[1]
}

/// Adds what one point near the outline, its signed distance and derivatives given, says of shape and blur (upper triangle of the
/// curvature), and returns the share of its place that is material or clutter.
#[inline]
pub fn add_presence<O: Outline>(
    signed_mm: f64,
    ds: &[f64; MAX_SHAPE],
    tau_mm: f64,
    clutter: f64,
    slope: &mut Slope,
    curvature: &mut Curvature,
) -> f64 {
    let shape = O::SHAPE;
    let inverse_tau = 1.0 / tau_mm;
    let z = signed_mm * inverse_tau;
    if z.abs() > FAR {
        return if z > 0.0 { 1.0 } else { clutter };
    }
    let (phi, d) = distribution_and_density(z);
    let presence = clutter + (1.0 - clutter) * phi;
    let m = (1.0 - clutter) * d / presence;
    let mut dz = [0.0; MAX_SHAPE + 1];
    for k in 0..shape {
        dz[k] = ds[k] * inverse_tau;
    }
    dz[shape] = -z; // by ln tau
    let bend = m * (z + m);
    for a in 0..=shape {
        slope[a] += m * dz[a];
        let row = bend * dz[a];
        for b in a..=shape {
            curvature[a][b] += row * dz[b];
        }
        // Second derivatives of z by ln tau.
        curvature[a][shape] += m * dz[a];
    }
    presence
}

/// Subtracts the derivatives of `N log A_eff` and returns that area; the second ones by differences of the closed-form first ones.
fn add_area_terms<O: Outline>(data: &Data<O>, state: &State<O>, out: &mut Evaluation) -> Option<f64> {
    const STEP: f64 = 1e-5;
    let all = State::<O>::count();
    let n = data.count();
    let (region, clutter) = (data.region, data.clutter);
    let (mut area, mut first) = whole_area(region, clutter, state);
    let mut second = [[0.0; MAX_ALL]; MAX_ALL];
    add_cut(region, clutter, state, &mut area, &mut first, &mut second);
    if area <= 0.0 {
        return None;
    }
    for b in 0..all {
        let mut step = [0.0; MAX_ALL];
        step[b] = STEP;
        let up = whole_area(region, clutter, &state.moved(&step)).1;
        step[b] = -STEP;
        let down = whole_area(region, clutter, &state.moved(&step)).1;
        for a in 0..all {
            second[a][b] += (up[a] - down[a]) / (2.0 * STEP);
        }
    }
    for a in 0..all {
        out.slope[a] -= n * first[a] / area;
        for b in 0..all {
            out.curvature[a][b] += n * (second[a][b] / area - first[a] * first[b] / (area * area));
        }
    }
    Some(area)
}

/// The effective area with its derivatives by shape, ln tau and gradient, the void of the cut still counted as taken away.
fn whole_area<O: Outline>(region: &Region, clutter: f64, state: &State<O>) -> (f64, Slope) {
    let scale = 1.0 / region.reach_mm;
    let g = [state.gradient[0] * scale, state.gradient[1] * scale];
    let weighted = |m: &Moments| m[0] + g[0] * m[1] + g[1] * m[2];
    let present = 1.0 - clutter;
    let (void, by) = state.outline.void(state.tau_mm);
    let mut first = [0.0; MAX_ALL];
    for k in 0..O::SHAPE {
        first[k] = -present * weighted(&by[k]);
    }
    first[O::SHAPE] = -present * weighted(&by[MAX_SHAPE]) * state.tau_mm;
    for a in 0..2 {
        first[O::SHAPE + 1 + a] = scale * (region.moments[1 + a] - present * void[1 + a]);
    }
    (weighted(&region.moments) - present * weighted(&void), first)
}

/// Gives back the void of the pieces that were cut out, which [`whole_area`] has taken away: their sum of `1 - Phi(s / tau)`, the blur
/// of a piece's own size put to tau.
fn add_cut<O: Outline>(
    region: &Region,
    clutter: f64,
    state: &State<O>,
    area: &mut f64,
    first: &mut Slope,
    second: &mut Curvature,
) {
    let (shape, scale) = (O::SHAPE, 1.0 / region.reach_mm);
    let g = state.gradient;
    let (distance, mut ds) = (state.outline.distances(), [0.0; MAX_SHAPE]);
    for piece in &region.cut {
        let x = [piece.place[0] * scale, piece.place[1] * scale];
        let blur_sq = state.tau_mm * state.tau_mm + piece.blur_sq;
        let inverse = blur_sq.sqrt().recip();
        let z = distance(piece.place, &mut ds) * inverse;
        if z > FAR {
            continue;
        }
        let (phi, d) = if z < -FAR { (0.0, 0.0) } else { distribution_and_density(z) };
        let density = 1.0 + g[0] * x[0] + g[1] * x[1];
        let bare = (1.0 - clutter) * piece.area;
        let full = bare * density;
        *area += full * (1.0 - phi);
        let share = state.tau_mm * state.tau_mm / blur_sq;
        let mut dz = [0.0; MAX_SHAPE + 1];
        for k in 0..shape {
            dz[k] = ds[k] * inverse;
        }
        dz[shape] = -z * share; // by ln tau
        for a in 0..=shape {
            first[a] -= full * d * dz[a];
            for b in 0..=shape {
                second[a][b] += full * d * z * dz[a] * dz[b];
            }
            for c in 0..2 {
                second[a][shape + 1 + c] -= bare * x[c] * d * dz[a];
                second[shape + 1 + c][a] -= bare * x[c] * d * dz[a];
            }
            if a < shape {
                second[a][shape] += full * d * dz[a] * share;
                second[shape][a] += full * d * dz[a] * share;
            }
        }
        second[shape][shape] -= full * d * (z * share * share - 2.0 * z * share * (1.0 - share));
        for c in 0..2 {
            first[shape + 1 + c] += bare * x[c] * (1.0 - phi);
        }
    }
}

/// The effective area with its derivatives by shape, ln tau and gradient.
pub fn effective_area<O: Outline>(region: &Region, clutter: f64, state: &State<O>) -> (f64, Slope) {
    let (mut area, mut first) = whole_area(region, clutter, state);
    add_cut(region, clutter, state, &mut area, &mut first, &mut [[0.0; MAX_ALL]; MAX_ALL]);
    (area, first)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::soft_edge::data::Piece;
    use crate::fit::soft_edge::{Circle, Edge, Slot, Window};
    use rand::{RngExt, SeedableRng};

    /// A checkerboard of pieces over a quarter of the plane, as if cut out.
    fn with_pieces(window: &Window) -> Region {
        let mut region = Region::whole(window);
        for i in 0..12 {
            for j in 0..12 {
                let place = [0.25 + 0.5 * f64::from(i), 0.25 + 0.5 * f64::from(j)];
                region.cut.push(Piece { place, area: 0.2, blur_sq: 0.02 });
                region.moments[0] -= 0.2;
                region.moments[1] -= 0.2 * place[0];
                region.moments[2] -= 0.2 * place[1];
            }
        }
        region
    }

    fn check<O: Outline>(outline: O, region: &Region) {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
        let points: Vec<[f64; 2]> =
            (0..400).map(|_| [rng.random_range(-6.0..6.0), rng.random_range(-6.0..6.0)]).collect();
        let state = State { outline, tau_mm: 0.4, gradient: [0.1, -0.2] };
        let data = Data::new(&points, region, 0.02, 0.5, &state);
        let at = evaluate(&data, &state).unwrap();
        let d = 1e-5;
        for k in 0..State::<O>::count() {
            let mut step = [0.0; MAX_ALL];
            step[k] = d;
            let up = evaluate(&data, &state.moved(&step)).unwrap();
            step[k] = -d;
            let down = evaluate(&data, &state.moved(&step)).unwrap();
            // Values of about 1e3 known to 1e-10 (table of Phi) over 2e-5: 1e-5 each, times some tens of points at the rim.
            assert!(((up.value - down.value) / (2.0 * d) - at.slope[k]).abs() < 2e-3, "parameter {k}");
            // The curvature leaves out only the bending of the distance (which the edge does not have).
            if O::SHAPE == 2 {
                for a in 0..State::<O>::count() {
                    let difference = -(up.slope[a] - down.slope[a]) / (2.0 * d);
                    assert!(
                        (difference - at.curvature[a][k]).abs() < 1e-2 * (1.0 + difference.abs()),
                        "curvature {a} {k}: {difference} {}",
                        at.curvature[a][k]
                    );
                }
            }
        }
    }

    #[test]
    fn gradient_matches_differences() {
        let disc = Window::disc(6.5);
        let square = Window::rectangle([-6.0, -6.0], [6.0, 6.0]);
        let circle = Circle { centre: [0.3, -0.2], radius: 3.0 };
        let slot = Slot { centre: [0.3, -0.2], angle: 0.4, half_straight: 2.0, radius: 1.5 };
        let edge = Edge { offset: 0.4, slope: 0.05, along: [-6.0, 6.0], outer_mm: 6.0 };
        for region in [Region::whole, with_pieces] {
            check(circle, &region(&disc));
            check(slot, &region(&disc));
            check(edge, &region(&square));
        }
    }

    /// Points far from the outline are not looked at one by one; the likelihood must be that of all of them.
    #[test]
    fn points_far_from_the_outline_count_as_they_are() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(6);
        let points: Vec<[f64; 2]> =
            (0..600).map(|_| [rng.random_range(-6.0..6.0), rng.random_range(-6.0..6.0)]).collect();
        let region = Region::whole(&Window::disc(9.0));
        let outline = Circle { centre: [0.0, 0.0], radius: 4.0 };
        let state = State { outline, tau_mm: 0.05, gradient: [0.1, 0.0] };
        let data = Data::new(&points, &region, 0.02, 0.5, &state);
        assert!(data.near.len() < points.len() / 2 && data.far_in_void > 0);
        let direct: f64 = points
            .iter()
            .map(|p| {
                let z = (p[0].hypot(p[1]) - 4.0) / 0.05;
                let presence = 0.02 + 0.98 * distribution_and_density(z).0;
                (presence * (1.0 + 0.1 * p[0] / 9.0)).ln()
            })
            .sum::<f64>()
            - 600.0 * effective_area(&region, 0.02, &state).0.ln()
            - 0.5 * 0.01 / 0.25;
        // Phi(-6.5) = 4e-11, over a clutter of 0.02 and 600 points: 1e-6 at most.
        assert!((evaluate(&data, &state).unwrap().value - direct).abs() < 1e-6);
    }
}
