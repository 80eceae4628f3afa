//! The gap between the sheet's points: the soft-edge fit of an opening in a window of its own.

use super::NotFound;
use super::opening::Opening;
use crate::fit::soft_edge::outline::MAX_SHAPE;
use crate::fit::soft_edge::{
    SoftEdgeError, SoftEdgeFit, SoftEdgeSettings, Window, closed_log_likelihood, clutter_share, fit_soft_edge,
    refine_soft_edge,
};

/// Material needed around the outline, mm.
pub fn margin_mm(spacing_mm: f64) -> f64 {
    (8.0 * spacing_mm).max(1.5)
}

/// An outline as fitted, and what it gains.
pub struct Gap<O> {
    /// The fit, about the frame's origin.
    pub fit: SoftEdgeFit<O>,
    /// Log-likelihood over that of closed sheet in the same window.
    pub gain: f64,
}

/// The fit near a rough outline; where the rim is too far off for a fit to see it, of a hole drilled larger, near that outline grown
/// or shrunk to where the points begin.
pub fn final_fit<O: Opening>(
    sheet: &[[f64; 2]],
    rough: &O,
    obstacles: &[[f64; 2]],
    spacing_mm: f64,
) -> Result<Gap<O>, NotFound> {
    let fit = |start: &O, passes: &[Pass]| fit_in_passes(sheet, start, obstacles, spacing_mm, passes);
    let is_no_edge = |gap: &Result<Gap<O>, (SoftEdgeError, usize)>| matches!(gap, Err((SoftEdgeError::NoEdge, _)));
    let mut gap = fit(rough, &[Pass::Wide, Pass::Exact]);
    if is_no_edge(&gap) {
        gap = fit(&to_the_points(sheet, rough, spacing_mm), &[Pass::Wide, Pass::Exact]);
    }
    if is_no_edge(&gap) {
        // Where much of the rim is hidden a wide blur runs away.
        gap = fit(rough, &[Pass::Exact]);
    }
    gap.map_err(|(error, points)| match error {
        SoftEdgeError::TooFewPoints { found, needed } => NotFound::too_few(found, needed),
        SoftEdgeError::NoEdge => NotFound::new(format!("the points show no {} here", O::WORD), points),
    })
}

/// The largest of the outlines parallel to one that hold a twentieth of the sheet's points at most.
fn to_the_points<O: Opening>(sheet: &[[f64; 2]], outline: &O, spacing_mm: f64) -> O {
    const HELD: f64 = 0.05;
    let mut unused = [0.0; MAX_SHAPE];
    let mut distances: Vec<f64> = sheet.iter().map(|p| outline.signed_mm(*p, &mut unused)).collect();
    distances.sort_unstable_by(f64::total_cmp);
    let parallel = |by_mm: f64| {
        let mut step = [0.0; MAX_SHAPE];
        step[O::DEPTH.0] = by_mm * O::DEPTH.1;
        outline.moved(&step[..O::SHAPE])
    };
    let empty_enough =
        |held: usize, o: &O| o.is_sound() && held as f64 <= HELD * o.void(0.0).0[0] / (spacing_mm * spacing_mm);
    // Outlines that reach up to one point after the other.
    let mut outlines = distances.iter().enumerate().map(|(held, by_mm)| (held, parallel(*by_mm)));
    outlines.rfind(|(held, o)| empty_enough(*held, o)).map_or_else(|| outline.clone(), |(_, o)| o)
}

/// How a fit sees the rim.
#[derive(Clone, Copy, PartialEq)]
enum Pass {
    /// With a blur that still sees a few spacings far.
    Wide,
    /// With its own blur, clutter and voids.
    Exact,
}

/// Fits once or twice, each time in a window that follows the outline: grown by the margin, cut half-way to the neighbours. Why there is
/// no fit comes with the points of the window.
fn fit_in_passes<O: Opening>(
    sheet: &[[f64; 2]],
    rough: &O,
    obstacles: &[[f64; 2]],
    spacing_mm: f64,
    passes: &[Pass],
) -> Result<Gap<O>, (SoftEdgeError, usize)> {
    let mut start = rough.clone();
    let mut local_spacing_mm = spacing_mm;
    let mut result = Err((SoftEdgeError::NoEdge, sheet.len()));
    for pass in passes {
        let centre = start.centre();
        let (points, window) = window_points(sheet, &start, obstacles, spacing_mm);
        let origin = start.centred_at([0.0, 0.0]);
        let mut settings = SoftEdgeSettings::new(local_spacing_mm);
        settings.clutter = clutter_share(&points, &origin, &window, local_spacing_mm);
        let fit = match pass {
            Pass::Wide => refine_soft_edge(&points, &window, &origin, &settings.with_tau(0.7 * local_spacing_mm)),
            Pass::Exact => fit_soft_edge(&points, &window, &origin, &settings),
        };
        let mut fit = fit.map_err(|e| (e, points.len()))?;
        let [u, v] = fit.outline.centre();
        fit.outline = fit.outline.centred_at([centre[0] + u, centre[1] + v]);
        start = fit.outline.clone();
        // The sheet leans, or its gate is narrow: its points are further apart than the scan's typical ones.
        local_spacing_mm = fit.density_per_mm2.sqrt().recip();
        let closed = match &fit.kept {
            Some(kept) => closed_log_likelihood(&kept.points, &kept.moments, window.reach_mm, settings.gradient_sigma),
            None => closed_log_likelihood(&points, &window.moments, window.reach_mm, settings.gradient_sigma),
        };
        let gain = fit.log_likelihood - closed;
        result = Ok(Gap { fit, gain });
    }
    result
}

/// The points of the window around an outline, relative to its centre, and the window.
fn window_points<O: Opening>(
    sheet: &[[f64; 2]],
    outline: &O,
    obstacles: &[[f64; 2]],
    spacing_mm: f64,
) -> (Vec<[f64; 2]>, Window) {
    let margin = margin_mm(spacing_mm);
    let [cu, cv] = outline.centre();
    let centred = outline.centred_at([0.0, 0.0]);
    let cuts = cuts(&centred, obstacles.iter().map(|p| [p[0] - cu, p[1] - cv]), margin);
    let mut corners = centred.grown(margin);
    for cut in &cuts {
        corners = clipped(&corners, cut);
    }
    let inside =
        |p: &[f64; 2]| cuts.iter().all(|c| c.keeps(p)) && centred.signed_mm(*p, &mut [0.0; MAX_SHAPE]) < margin;
    let points = sheet.iter().map(|p| [p[0] - cu, p[1] - cv]).filter(inside).collect();
    (points, Window::polygon(&corners))
}

/// Keeps the places with `normal . p <= limit`.
struct Cut {
    normal: [f64; 2],
    limit: f64,
}

impl Cut {
    fn keeps(&self, p: &[f64; 2]) -> bool {
        self.normal[0] * p[0] + self.normal[1] * p[1] <= self.limit
    }
}

/// Straight cuts half-way to each obstacle within the margin, the nearest first; those that an earlier cut has removed
/// need none.
fn cuts<O: Opening>(outline: &O, obstacles: impl Iterator<Item = [f64; 2]>, margin: f64) -> Vec<Cut> {
    let mut near: Vec<(f64, [f64; 2], [f64; 2])> = obstacles
        .filter_map(|p| {
            let mut gradient = [0.0; MAX_SHAPE];
            let s = outline.signed_mm(p, &mut gradient);
            // The centre's derivatives are minus the direction away from the outline.
            (0.0..margin).contains(&s).then_some((s, p, [-gradient[0], -gradient[1]]))
        })
        .collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut cuts: Vec<Cut> = Vec::new();
    for (s, p, normal) in near {
        if cuts.iter().all(|c| c.keeps(&p)) {
            cuts.push(Cut { normal, limit: normal[0] * p[0] + normal[1] * p[1] - 0.5 * s });
        }
    }
    cuts
}

/// A convex polygon without what a cut removes.
fn clipped(corners: &[[f64; 2]], cut: &Cut) -> Vec<[f64; 2]> {
    let excess = |p: &[f64; 2]| cut.normal[0] * p[0] + cut.normal[1] * p[1] - cut.limit;
    let mut out = Vec::with_capacity(corners.len() + 1);
    for (k, a) in corners.iter().enumerate() {
        let b = &corners[(k + 1) % corners.len()];
        let (ea, eb) = (excess(a), excess(b));
        if ea <= 0.0 {
            out.push(*a);
        }
        if (ea < 0.0 && eb > 0.0) || (ea > 0.0 && eb < 0.0) {
            let t = ea / (ea - eb);
            out.push([a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::soft_edge::Circle;

    /// Half of a hole's surroundings lies in shadow: what is left tells a circle, and how much of its rim was seen.
    #[test]
    fn a_rim_half_in_shadow_is_told_as_half_seen() {
        const SPACING_MM: f64 = 0.2;
        let hole = Circle { centre: [0.0, 0.0], radius: 4.0 };
        for shadow_from_mm in [0.0, -0.6] {
            let lattice = (-40..=40).flat_map(|i| (-40..=40).map(move |j| [f64::from(i), f64::from(j)]));
            let place = |p: [f64; 2]| [p[0] * SPACING_MM + 0.07 * p[1].sin(), p[1] * SPACING_MM + 0.07 * p[0].sin()];
            let seen = |p: &[f64; 2]| p[0].hypot(p[1]) > 4.0 && p[0] < shadow_from_mm;
            let sheet: Vec<[f64; 2]> = lattice.map(place).filter(seen).collect();
            let gap = final_fit(&sheet, &hole, &[], SPACING_MM).unwrap();
            // acos(0.6 / 4) is 0.95 of a quarter turn; at either end a stretch of three spacings may count either way: 0.05 of the rim.
            let share = f64::acos(-shadow_from_mm / 4.0) / std::f64::consts::PI;
            let told = gap.fit.outline_seen;
            assert!((told - share).abs() < 0.06, "{told} of {share}");
        }
    }
}
