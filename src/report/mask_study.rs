//! The study of masks as a table for spreadsheets: one row a threshold.

use super::csv::{optional, text_field};
use crate::plan::merge::{Better, MergeFeature, Metric};
use crate::stitch::mask_study::{Curve, Knee, MaskStudy, Step};
use std::fmt::Write;

const HEADER: &str =
    "feature,kind,metric,bound,threshold,remaining,remaining_share,sigma_dev,radius,d_r,rejected,views_fitted,mark\n";

/// The word for the side of a threshold, as in `[mask]`.
pub fn bound(metric: Metric) -> &'static str {
    match metric.better() {
        Better::Larger => "min",
        Better::Smaller => "max",
    }
}

/// The table. Lengths are in the unit of the views; `mark` is `suggested` at the knee and `mask` at the file's own threshold.
pub fn csv(study: &MaskStudy, features: &[MergeFeature]) -> String {
    let mut text = String::from(HEADER);
    for curve in &study.curves {
        for (k, step) in curve.steps.iter().enumerate() {
            let mark = if matches!(curve.knee, Knee::At { step, .. } if step == k) { "suggested" } else { "" };
            row(&mut text, study, &features[curve.feature], curve, step, mark);
        }
        if let Some(own) = &curve.own {
            row(&mut text, study, &features[curve.feature], curve, own, "mask");
        }
    }
    text
}

fn row(text: &mut String, study: &MaskStudy, feature: &MergeFeature, curve: &Curve, step: &Step, mark: &str) {
    let d_r = step.radius.zip(feature.radius).map(|(found, certified)| found - certified);
    let _ = writeln!(
        text,
        "{},{},{},{},{},{},{:.5},{},{},{},{},{},{mark}",
        text_field(&feature.name),
        feature.kind.key(),
        curve.metric.key(),
        bound(curve.metric),
        step.threshold,
        step.remaining,
        step.remaining as f64 / study.points as f64,
        optional(step.sigma_dev),
        optional(step.radius),
        optional(d_r),
        step.rejected,
        step.views,
    );
}

/// What is to be done about a metric, in words.
pub fn advice(curve: &Curve) -> String {
    let percent = |share: f64| format!("{:.0} %", 100.0 * share);
    match &curve.knee {
        Knee::At { step, plateau } => {
            let cut = &curve.steps[*step];
            let whole = curve.steps[0].remaining.max(1) as f64;
            format!(
                "{} = {} leaves {} of the points with sigma_dev {}, unmasked {}, at best {}",
                bound(curve.metric),
                cut.threshold,
                percent(cut.remaining as f64 / whole),
                told(cut.sigma_dev),
                told(curve.steps[0].sigma_dev),
                told(Some(*plateau))
            )
        }
        Knee::NoGain { plateau } => format!(
            "no knee: sigma_dev is {} unmasked and {} at best",
            told(curve.steps.first().and_then(|s| s.sigma_dev)),
            told(Some(*plateau))
        ),
        Knee::TooDear { share, plateau } => format!(
            "no knee: sigma_dev {} comes within 5 % of its best, {}, only where {} of the points are left",
            told(curve.steps.first().and_then(|s| s.sigma_dev)),
            told(Some(*plateau)),
            percent(*share)
        ),
        Knee::Misfit { sigma_dev, noise } => format!(
            "no suggestion: even masked the points lie off the feature by {} and scatter by {} beside their neighbours, check its kind",
            told(Some(*sigma_dev)),
            told(Some(*noise))
        ),
        Knee::NotTold => "no view can be fitted".to_owned(),
    }
}

/// Thresholds that a plot of them shows, from the loosest to the strictest: a lone value far out would press all others into a corner. `None` where
/// there is one value only.
pub fn shown_thresholds(thresholds: &[f64]) -> Option<[f64; 2]> {
    let (first, last) = (*thresholds.first()?, *thresholds.last()?);
    let usual = thresholds.get(2).copied().unwrap_or(first);
    let begin = if (first - last).abs() > 1.6 * (usual - last).abs() && usual != last { usual } else { first };
    (begin != last).then_some([begin, last])
}

/// The ends of a scale for sigma_dev on which its curve is seen: not from zero, where all of it would lie flat along the top, and never so close
/// that what is no difference (a twentieth, as the knee has it) fills the plot. `None` where nothing is known.
pub fn sigma_scale(sigmas: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    let (low, high) = sigmas.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    let pad = (0.15 * (high - low)).max(0.05 * high);
    (low.is_finite() && high > 0.0).then(|| [(low - pad).max(0.0), high + pad])
}

/// Three digits.
pub fn told(value: Option<f64>) -> String {
    value.map_or_else(|| "none".to_owned(), short)
}

/// A number in three significant digits, as people write it.
pub fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let decimals = (2 - value.abs().log10().floor() as i64).clamp(0, 12) as usize;
    format!("{value:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plot_shows_the_curve_and_no_lone_value_far_out() {
        assert_eq!(shown_thresholds(&[900.0, 320.0, 300.0, 200.0, 40.0]), Some([300.0, 40.0]));
        assert_eq!(shown_thresholds(&[320.0, 310.0, 300.0, 200.0, 40.0]), Some([320.0, 40.0]));
        assert_eq!((shown_thresholds(&[7.0]), shown_thresholds(&[])), (None, None));
        // From 9 to 9.7, as masks of a study do: the curve takes 0.7 of 0.7 + 2 times 0.485 of the plot's height; what is a fiftieth of that stays flat.
        let share = |sigmas: &[f64]| {
            let [low, high] = sigma_scale(sigmas.iter().copied()).unwrap();
            let (least, most) = (sigmas[0], sigmas[sigmas.len() - 1]);
            assert!(low < least && most < high);
            (most - least) / (high - low)
        };
        assert!(share(&[9.0, 9.7]) > 0.4 && share(&[6.5, 9.7]) > 0.7);
        assert!(share(&[9.5, 9.52]) < 0.05);
        assert_eq!(sigma_scale(std::iter::empty()), None);
    }
}
