//! The share of clutter where there is no material.

use super::Window;
use super::data::Region;
use super::fit::{SoftEdgeError, SoftEdgeSettings};
use super::newton::{Refined, refine};
use super::outline::{MAX_SHAPE, Outline};

/// Fits until the clutter has settled.
pub fn with_clutter<O: Outline>(
    points: &[[f64; 2]],
    region: &Region,
    start: &O,
    settings: &mut SoftEdgeSettings,
) -> Result<Refined<O>, SoftEdgeError> {
    let mut refined = refine(points, region, start, settings)?;
    for _ in 0..3 {
        let clutter = region_clutter(points, &refined.fit.outline, region, settings.spacing_mm);
        if (clutter - settings.clutter).abs() < 0.1 * settings.clutter {
            break;
        }
        settings.clutter = clutter;
        settings.start_tau_mm = refined.fit.tau_mm;
        settings.start_gradient = refined.fit.gradient;
        refined = refine(points, region, &refined.fit.outline.clone(), settings)?;
    }
    Ok(refined)
}

/// Share of clutter: points deep in the void over those expected there were it material, with a prior of 0.5 % on eight
/// expected points to steady it. The window's density is taken from the points outside the outline.
pub fn clutter_share<O: Outline>(points: &[[f64; 2]], outline: &O, window: &Window, spacing_mm: f64) -> f64 {
    region_clutter(points, outline, &Region::whole(window), spacing_mm)
}

fn region_clutter<O: Outline>(points: &[[f64; 2]], outline: &O, region: &Region, spacing_mm: f64) -> f64 {
    const PRIOR: (f64, f64) = (0.005, 8.0);
    // The void at a depth follows from moving the outline by the parameter that moves it along its normal.
    let mut step = [0.0; MAX_SHAPE];
    step[O::DEPTH.0] = -1.5 * spacing_mm * O::DEPTH.1;
    let inner = outline.moved(&step[..O::SHAPE]);
    let material = region.moments[0] - region.void_area(outline);
    if !inner.is_sound() || material <= 0.0 {
        return PRIOR.0;
    }
    let (distance, mut unused) = (outline.distances(), [0.0; MAX_SHAPE]);
    let (mut deep, mut inside) = (0, 0);
    for p in points {
        let s = distance(*p, &mut unused);
        inside += usize::from(s < 0.0);
        deep += usize::from(s < -1.5 * spacing_mm);
    }
    let density = (points.len() - inside) as f64 / material;
    let expected = (region.void_area(&inner) * density).max(0.0);
    ((deep as f64 + PRIOR.0 * PRIOR.1) / (expected + PRIOR.1)).clamp(0.001, 0.5)
}
