//! One outline fitted: clutter, voids and the covariance that is stated.

use super::Window;
use super::clutter::with_clutter;
use super::covariance::larger;
use super::data::{Region, apart_mm};
use super::jackknife::{self, Estimate};
use super::newton::{Refined, refine};
use super::outline::{MAX_SHAPE, Moments, Outline};
use super::sectors::{Raster, sector};
use super::voids::{self, Cut, find_voids};
use nalgebra::DMatrix;
use std::borrow::Cow;

/// How a fit is done.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SoftEdgeSettings {
    /// Typical distance between neighbouring points, mm: bounds the blur.
    pub spacing_mm: f64,
    /// Share of clutter where there is no material, to start from.
    pub clutter: f64,
    /// Standard deviation of the prior on the density gradient over the window's reach.
    pub gradient_sigma: f64,
    /// Fix the blur at this value (to search from afar) instead of estimating it.
    pub fixed_tau_mm: Option<f64>,
    /// Blur to start from, mm.
    pub start_tau_mm: f64,
    /// Density gradient to start from, over the window's reach.
    pub start_gradient: [f64; 2],
    /// The iteration has arrived when a step moves the outline by less than this, in spacings; Newton's next step would be smaller by
    /// far.
    pub tolerance: f64,
    /// Shape parameters kept at their start value, one flag each.
    pub fixed_shape: [bool; MAX_SHAPE],
}

impl SoftEdgeSettings {
    /// Everything estimated, for points of that spacing.
    pub fn new(spacing_mm: f64) -> Self {
        Self {
            spacing_mm,
            clutter: 0.005,
            gradient_sigma: 0.3,
            fixed_tau_mm: None,
            start_tau_mm: 0.5 * spacing_mm,
            start_gradient: [0.0; 2],
            tolerance: 3e-3,
            fixed_shape: [false; MAX_SHAPE],
        }
    }

    /// Blur fixed at a value and a coarse end: a wide basin of attraction, for the search.
    pub fn with_tau(self, tau_mm: f64) -> Self {
        Self { fixed_tau_mm: Some(tau_mm), tolerance: 0.05, ..self }
    }
}

/// An outline as estimated.
#[derive(Debug, Clone)]
pub struct SoftEdgeFit<O> {
    /// The outline.
    pub outline: O,
    /// Covariance of its shape parameters (their units), fixed ones with zero rows: the larger, direction by direction within each of
    /// [`Outline::BLOCKS`], of `information` and `jackknife`.
    pub covariance: DMatrix<f64>,
    /// Inverse observed information; density gradient and blur are accounted for.
    pub information: DMatrix<f64>,
    /// Jackknife over twelve sectors of the outline.
    pub jackknife: Option<DMatrix<f64>>,
    /// Blur of the edge, mm.
    pub tau_mm: f64,
    /// Density gradient over the window's reach.
    pub gradient: [f64; 2],
    /// Share of clutter where there is no material.
    pub clutter: f64,
    /// Points per mm² on material.
    pub density_per_mm2: f64,
    /// Log-likelihood with the density profiled out.
    pub log_likelihood: f64,
    /// Newton steps.
    pub iterations: usize,
    /// Whether the last step was below the tolerance.
    pub converged: bool,
    /// Points that the fit was made of.
    pub points: usize,
    /// Share of the outline's length beside which points stand and no void is.
    pub outline_seen: f64,
    /// What was left of the window where voids were cut out of it.
    pub kept: Option<Kept>,
}

/// What was left of a window without its voids.
#[derive(Debug, Clone, PartialEq)]
pub struct Kept {
    /// Its points.
    pub points: Vec<[f64; 2]>,
    /// Its area and first moments.
    pub moments: Moments,
}

/// Why there is no outline.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SoftEdgeError {
    /// Fewer points than the model needs.
    #[error("{found} points stand within the window, {needed} are needed")]
    TooFewPoints {
        /// Points in the window.
        found: usize,
        /// Points needed.
        needed: usize,
    },
    /// The points do not tell where the outline is, or the search left the window.
    #[error("the points show no edge of this shape")]
    NoEdge,
}

/// Fits an outline from a start that is good to a few spacings, clutter and voids included: fit, count the points deep in the
/// void, fit again; cut out what is no sheet, fit again. The covariance is the larger, direction by direction, of the inverse
/// information and the jackknife over sectors.
pub fn fit_soft_edge<O: Outline>(
    points: &[[f64; 2]],
    window: &Window,
    start: &O,
    settings: &SoftEdgeSettings,
) -> Result<SoftEdgeFit<O>, SoftEdgeError> {
    const ROUNDS: usize = 3;
    let mut settings = *settings;
    let mut refined = match with_clutter(points, &Region::whole(window), start, &mut settings) {
        // Where much of the rim is hidden nothing holds the outline there; at a good start the voids can be seen all the same.
        Err(SoftEdgeError::NoEdge) => {
            let even = (settings.spacing_mm * settings.spacing_mm).recip();
            let view = View::without_voids(points, window, start, |_| even, settings.spacing_mm);
            if view.cut.is_none() || view.outline_left() < LEAST_LEFT {
                return Err(SoftEdgeError::NoEdge);
            }
            with_clutter(&view.points, &view.region, start, &mut settings)?
        }
        other => other?,
    };
    let mut round = 0;
    let view = loop {
        round += 1;
        let spacing_mm = refined.fit.density_per_mm2.sqrt().recip();
        let [gu, gv] = refined.state.gradient.map(|g| g / window.reach_mm);
        let density = |p: [f64; 2]| refined.fit.density_per_mm2 * (1.0 + gu * p[0] + gv * p[1]);
        let from = refined.state.outline.clone();
        let view = View::without_voids(points, window, &from, density, spacing_mm);
        if view.outline_left() < LEAST_LEFT {
            refined.fit.outline_seen = view.outline_left();
            return Ok(refined.fit);
        }
        if view.cut.is_none() && refined.fit.points == points.len() {
            break view;
        }
        refined = with_clutter(&view.points, &view.region, &from, &mut settings)?;
        if round == ROUNDS || apart_mm(&from, &refined.state.outline, window.reach_mm) < 0.1 * spacing_mm {
            break view;
        }
    };
    Ok(stated(refined, view, &settings))
}

/// Share of the outline below which nothing is fitted to what voids have left of it.
const LEAST_LEFT: f64 = 0.3;

/// What a fit looks at: a window without its voids.
struct View<'a> {
    raster: Raster,
    cut: Option<Cut>,
    region: Region,
    points: Cow<'a, [[f64; 2]]>,
}

impl<'a> View<'a> {
    /// All of the points and the window but for what are voids beside an outline; `density` is told per mm² of material.
    fn without_voids<O: Outline>(
        points: &'a [[f64; 2]],
        window: &Window,
        outline: &O,
        density: impl Fn([f64; 2]) -> f64,
        spacing_mm: f64,
    ) -> Self {
        let raster = Raster::new(points, window, outline, voids::CELL * spacing_mm);
        match find_voids(&raster, outline, density, spacing_mm) {
            None => Self { raster, cut: None, region: Region::whole(window), points: Cow::Borrowed(points) },
            Some(cut) => {
                let region = cut.region(window, &raster, spacing_mm);
                let points = Cow::Owned(cut.kept(points, &raster));
                Self { raster, cut: Some(cut), region, points }
            }
        }
    }

    fn outline_left(&self) -> f64 {
        self.cut.as_ref().map_or(1.0, |cut| cut.outline_left)
    }
}

/// The fit with the covariance that is stated, and how much of the outline was seen.
fn stated<O: Outline>(refined: Refined<O>, view: View, settings: &SoftEdgeSettings) -> SoftEdgeFit<O> {
    let estimate = Estimate {
        points: &view.points,
        region: &view.region,
        raster: &view.raster,
        cut: view.cut.as_ref(),
        state: &refined.state,
        clutter: settings.clutter,
        gradient_sigma: settings.gradient_sigma,
        free: &refined.free,
    };
    let jackknife = jackknife::covariance(&estimate);
    let mut fit = refined.fit;
    if let Some(jackknife) = jackknife {
        fit.covariance = larger(&fit.covariance, &jackknife, O::BLOCKS);
        fit.jackknife = Some(jackknife);
    }
    let spacing_mm = fit.density_per_mm2.sqrt().recip();
    fit.outline_seen = covered_share(&view.points, &fit.outline, spacing_mm).min(view.outline_left());
    let moments = view.region.moments;
    fit.kept = view.cut.map(|_| Kept { points: view.points.into_owned(), moments });
    fit
}

/// Fits an outline with the clutter as given, all of the window taken as it is.
pub fn refine_soft_edge<O: Outline>(
    points: &[[f64; 2]],
    window: &Window,
    start: &O,
    settings: &SoftEdgeSettings,
) -> Result<SoftEdgeFit<O>, SoftEdgeError> {
    let refined = refine(points, &Region::whole(window), start, settings)?;
    let mut fit = refined.fit;
    fit.outline_seen = covered_share(points, &fit.outline, settings.spacing_mm);
    Ok(fit)
}

/// Share of the outline's length beside which points stand in a band of material: the length is cut into sectors, at most
/// 36, long enough that four points are expected in each.
fn covered_share<O: Outline>(points: &[[f64; 2]], outline: &O, spacing_mm: f64) -> f64 {
    let band_mm = 2.5 * spacing_mm;
    let sectors = ((outline.length_mm() / (1.6 * spacing_mm)) as usize).clamp(1, 36);
    let mut seen = vec![false; sectors];
    let (distance, places, mut unused) = (outline.distances(), outline.places(), [0.0; MAX_SHAPE]);
    for p in points.iter().filter(|p| (-0.5 * spacing_mm..band_mm).contains(&distance(**p, &mut unused))) {
        let along = places(*p);
        if (0.0..1.0).contains(&along) {
            seen[sector(along, sectors)] = true;
        }
    }
    seen.iter().filter(|s| **s).count() as f64 / sectors as f64
}
