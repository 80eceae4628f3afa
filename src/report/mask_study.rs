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
