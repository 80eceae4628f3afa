//! What a comparison says on the whole: worn, not worn as far as can be seen, or cannot be told.

use super::best_fit::WearFit;
use super::regions::WornRegion;

/// Another motion that lays at least this share of the places as before as the best one does is as good an answer: which of the two parts wore is
/// not known.
const ALIKE: f64 = 0.25;
/// The fit lies on at least this share of the places, or it is the fit of nothing.
const LEAST_AS_BEFORE: f64 = 0.5;

/// The answer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Verdict {
    /// At least one region differs by more than errors explain.
    Differs,
    /// Noise explains every difference.
    Same,
    /// It cannot be told whether the surface wore, or which part of it did.
    CannotBeTold(Doubt),
}

/// Why it cannot be told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Doubt {
    /// Differences that hang together are larger than noise, and smooth errors of the measurements may be as large: wear cannot be told from them.
    SmoothErrors {
        /// The largest of these differences: wear of that may be among them.
        hidden: f64,
        /// The usual smooth error, as a standard deviation.
        smooth_u: f64,
    },
    /// Two motions lay parts of the surface as before; the one part may have worn, or the other.
    TwoFits {
        /// Share of the places that lie as before under the best fit.
        as_before: f64,
        /// Share that another motion would lay so.
        otherwise: f64,
    },
}

impl Doubt {
    /// A word for files.
    pub fn key(&self) -> &'static str {
        match self {
            Self::SmoothErrors { .. } => "smooth_errors",
            Self::TwoFits { .. } => "two_fits",
        }
    }

    /// In words; lengths are in `unit`.
    pub fn words(&self, unit: &str) -> String {
        match self {
            Self::SmoothErrors { hidden, smooth_u } => format!(
                "differences of up to {hidden:+.3} {unit} are larger than noise explains; smooth errors of the measurements ({smooth_u:.3} {unit}) may be that large, or it is wear"
            ),
            Self::TwoFits { as_before, otherwise } => format!(
                "{:.0} % of the places lie as before under the best fit, {:.0} % would under another one: the one part may have changed, or the other",
                100.0 * as_before,
                100.0 * otherwise
            ),
        }
    }
}

/// `beyond_noise` are the regions that there would be if smooth errors were none.
pub(super) fn verdict(fit: &WearFit, smooth_u: f64, regions: &[WornRegion], beyond_noise: &[WornRegion]) -> Verdict {
    if fit.otherwise >= ALIKE * fit.as_before || fit.as_before < LEAST_AS_BEFORE {
        return Verdict::CannotBeTold(Doubt::TwoFits { as_before: fit.as_before, otherwise: fit.otherwise });
    }
    if !regions.is_empty() {
        return Verdict::Differs;
    }
    let furthest = beyond_noise.iter().map(|r| r.extreme).max_by(|a, b| a.abs().total_cmp(&b.abs()));
    match furthest {
        None => Verdict::Same,
        Some(hidden) => Verdict::CannotBeTold(Doubt::SmoothErrors { hidden, smooth_u }),
    }
}
