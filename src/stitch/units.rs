//! Mistakes of units: lengths in the settings that no view of this size can mean.

use super::StitchError;
use super::calibration::Calibration;
use super::place::Ready;
use super::shelf::ViewFacts;
use crate::diagnostic::Diagnostic;
use crate::fit::robust::median;
use crate::geometry::Point3;
use crate::io::unit_guard::robust_diagonal_mm;
use crate::plan::merge::{MergePlan, MergeRadius, NamedFile, Prealign};

/// Two lengths that differ by more than this, where they should be alike, are in two units.
const UNLIKE: f64 = 200.0;

/// The diagonal of the middle 98 % of some points on each axis; 0 without points.
pub fn size(points: &[Point3]) -> f64 {
    let all: Vec<u32> = (0..points.len() as u32).collect();
    robust_diagonal_mm(points, &all).unwrap_or(0.0)
}

/// Words, and what units explain a ratio if any do.
fn with_factor(words: String, ratio: f64) -> String {
    match ratio {
        r if (500.0..2000.0).contains(&r) => format!("{words} (about 1000 times: mm for um, or m for mm?)"),
        r if (1.0 / 2000.0..1.0 / 500.0).contains(&r) => {
            format!("{words} (about a thousandth: um for mm, or mm for m?)")
        }
        _ => words,
    }
}

/// Three digits are enough to see a unit.
fn told(length: f64) -> String {
    crate::plan::short_number(length)
}

/// Holds d_s against the views.
pub(super) fn check_radius(plan: &MergePlan, d_s: f64, d_grid: f64, size: f64) -> Result<(), StitchError> {
    let MergeRadius::Length(_) = plan.merge.radius.value else { return Ok(()) };
    let unit = plan.unit.key();
    let ratio = if d_s > size { d_s / size } else { d_s / d_grid };
    let words = match ratio {
        _ if d_s > size => format!("found {} {unit}, more than the views' size of {} {unit}", told(d_s), told(size)),
        r if r < 1.0 / UNLIKE => {
            format!("found {} {unit}, which merges nothing: points stand {} {unit} apart", told(d_s), told(d_grid))
        }
        r if r > UNLIKE => {
            format!("found {} {unit}, {:.0} times the distance of points of {} {unit}", told(d_s), r, told(d_grid))
        }
        _ => return Ok(()),
    };
    let message = with_factor(format!("[merge] radius: {words}, expected one to five times that distance"), ratio);
    let help =
        format!("radius is in the unit of the views: check `unit` ({unit}) and the number, or write radius_grid = 2.0");
    Err(Diagnostic::error(message).in_file(&plan.path).at_line(plan.merge.radius.line).with_help(help).into())
}

/// What a feature's radius says of the views' unit; a warning, as a large part may have small features.
pub(super) fn feature_warnings(plan: &MergePlan, size: f64) -> Vec<String> {
    let unit = plan.unit.key();
    let warn = |feature: &crate::plan::merge::MergeFeature| {
        let ratio = feature.radius? / size;
        (!(1.0 / UNLIKE..=UNLIKE).contains(&ratio)).then(|| {
            let words = format!(
                "the radius of {} is {} {unit} and the views measure {} {unit} across: check `unit`",
                feature.name,
                told(ratio * size),
                told(size)
            );
            with_factor(words, ratio)
        })
    };
    plan.features.iter().filter_map(warn).collect()
}

/// Holds calibrated features against a view.
pub fn check_calibration(
    plan: &MergePlan,
    file: &NamedFile,
    calibration: &Calibration,
    view: &[Point3],
) -> Result<(), StitchError> {
    let (features, view) = (calibration.size(), size(view));
    let ratio = features / view;
    if (1.0 / UNLIKE..=UNLIKE).contains(&ratio) || !ratio.is_finite() || ratio <= 0.0 {
        return Ok(());
    }
    let unit = plan.unit.key();
    let message = format!(
        "[calibration]: the features of {} measure {} {unit} across and a view {} {unit}, expected about the same",
        file.file,
        told(features),
        told(view)
    );
    let message = with_factor(message, ratio);
    let help = format!("both are read in `unit` ({unit}): export the features in the unit of the views");
    Err(Diagnostic::error(message).in_file(&plan.path).at_line(file.line).with_help(help).into())
}

/// Holds the views' sizes against each other: a view in another unit would be a speck among the others, or they in it.
pub(super) fn check_sizes(plan: &MergePlan, ready: &[Ready], facts: &[ViewFacts]) -> Result<(), StitchError> {
    let mut sizes: Vec<f64> = facts.iter().map(|facts| facts.size).collect();
    let Some(usual) = median(&mut sizes) else { return Ok(()) };
    let unit = plan.unit.key();
    for (one, facts) in ready.iter().zip(facts) {
        let ratio = facts.size / usual;
        let message = format!(
            "{} measures {} {unit} across and the middle one of the views {} {unit}",
            one.conditioned.view.name,
            told(facts.size),
            told(usual)
        );
        let with_unit = with_factor(message.clone(), ratio);
        // Sizes that no units explain are those of small views.
        if with_unit != message && facts.d_grid.is_some() {
            let help = format!(
                "all views are read in `unit` ({unit}): export this one again, or leave it out by [views] pattern"
            );
            return Err(Diagnostic::error(with_unit)
                .in_file(&plan.path)
                .at_line(plan.views.folder.line)
                .with_help(help)
                .into());
        }
    }
    Ok(())
}

/// Holds the poses against the views' size; also what is odd about them.
pub(super) fn check_poses(plan: &MergePlan, ready: &[Ready], facts: &[ViewFacts]) -> Result<Vec<String>, StitchError> {
    let Prealign::Poses(file) = &plan.views.prealign else { return Ok(Vec::new()) };
    let known = |(view, facts): (&Ready, &ViewFacts)| Some((view.start.as_ref().ok()? * facts.middle?, facts.size));
    let middles: Vec<(Point3, f64)> = ready.iter().zip(facts).filter_map(known).collect();
    let count = middles.len() as f64;
    if middles.len() < 2 {
        return Ok(Vec::new());
    }
    let largest = middles.iter().map(|(_, size)| *size).fold(0.0, f64::max);
    let spread = size_of(middles.iter().map(|(middle, _)| *middle));
    let unit = plan.unit.key();
    // A row of views end to end is as long as they are many.
    if spread > UNLIKE * count * largest {
        let ratio = spread / (count * largest);
        let message = format!(
            "the poses put the {count} views {} {unit} apart, and the largest measures {} {unit}",
            told(spread),
            told(largest)
        );
        let message = with_factor(message, ratio);
        let help = format!("t is in the unit of the views: check `unit` ({unit}) and the poses");
        return Err(Diagnostic::error(message).in_file(&file.path).with_help(help).into());
    }
    let odd = spread > 0.0 && spread < largest / UNLIKE && middles.len() > 2;
    let words = || {
        format!(
            "the poses of {count} views differ by no more than {} {unit}, while a view measures {} {unit}: check the unit of t",
            told(spread),
            told(largest)
        )
    };
    Ok(odd.then(words).into_iter().collect())
}

fn size_of(points: impl Iterator<Item = Point3>) -> f64 {
    let points: Vec<Point3> = points.collect();
    crate::geometry::Aabb::of_points(&points).map_or(0.0, |bounds| bounds.extents().norm())
}
