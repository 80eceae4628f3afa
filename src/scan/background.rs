//! Background removal: belt colour, belt plane and luminance, as in section 4 of the SIVPRO paper, and what is left far
//! away from the part.
//!
//! The belt's plane is sought first, on the points that are bright enough, because it tells how far colour can be trusted:
//! a worn belt has the part's own grey, so that colour decides only close to the belt where a plane is known. Without a
//! plane colour decides alone, unless it would take the part with it. Every such decision is made on a sample; one pass
//! over all points then gives each its class.

use super::belt::{Sample, refine};
use super::belt_judge::{Verdict, find_belt};
use super::bodies::are_parts_alone;
use super::colour::{BeltColours, automatic_luminance_min, luminance};
use super::conditioned::{BeltPlane, ConditionedScan, PointClass, Removed};
use super::duplicates::{duplicates, leave_out, warning_of_duplicates};
use super::hints::ScanHints;
use super::neighbourhood::{CHUNK, Texture, stratified, texture};
use super::normals::mean_normal;
use super::rules::{ColourUse, Rules, rules};
use super::stray::components;
use crate::diagnostic::{Refusal, Stop};
use crate::geometry::{Point3, PointCloud, UnitVector3};
use crate::plan::model::BackgroundSettings;
use crate::run::{Cancelled, RunContext};
use rayon::prelude::*;

/// Fewer points than this are no scan of a part.
const FEWEST_POINTS: usize = 200;
/// A body of less than this share of the part's surface is no part on the belt.
pub(super) const LEAST_BODY: f64 = 0.005;

/// Gives every point its class and finds the belt, the camera's side and the spacing of the points.
///
/// Each point is counted once in `removed`, by the first filter that takes it, in the order invalid (by the reader), duplicate,
/// dark, colour, belt, stray. Lengths mm, scan frame; the belt's normal and `to_camera` point to the camera.
///
/// # Errors
/// Refused when nothing that can be a part is left; cancelled when the run was.
pub fn condition(
    cloud: PointCloud,
    settings: &BackgroundSettings,
    hints: &ScanHints,
    run: &RunContext,
) -> Result<ConditionedScan, Stop> {
    run.check()?;
    if cloud.len() < FEWEST_POINTS {
        return Err(too_few(cloud.len(), cloud.skipped_invalid).into());
    }
    let again = duplicates(&cloud.positions, run)?;
    if cloud.len() - again.len() < FEWEST_POINTS {
        return Err(few_places(cloud.len() - again.len(), cloud.len()).into());
    }
    let first = attempt(&cloud, &again, settings, hints, DarkFilter::AsSet, run);
    let outcome = match first {
        // A black part on a bright belt makes a dark mode of its own: better no filter than no part.
        Err(Stop::Refused(refusal)) if settings.luminance_min.is_none() => {
            attempt(&cloud, &again, settings, hints, DarkFilter::Off, run).map_err(|second| match second {
                Stop::Refused(_) => Stop::Refused(refusal),
                cancelled => cancelled,
            })?
        }
        other => other?,
    };
    Ok(outcome.into_scan(cloud))
}

fn too_few(points: usize, invalid: usize) -> Refusal {
    let skipped = if invalid > 0 { format!(" ({invalid} without a position were skipped)") } else { String::new() };
    Refusal::new(
        format!("the scan holds {points} points{skipped}, at least {FEWEST_POINTS} are needed"),
        "see whether the measurement worked and whether the file is complete",
    )
}

fn few_places(own: usize, points: usize) -> Refusal {
    Refusal::new(
        format!(
            "only {own} of the scan's {points} points stand at a place of their own, at least {FEWEST_POINTS} are needed"
        ),
        "see whether the measurement worked",
    )
}

/// Whether the automatic luminance threshold may be used.
#[derive(Clone, Copy, PartialEq)]
enum DarkFilter {
    AsSet,
    Off,
}

/// Everything of the result but the cloud itself.
struct Outcome {
    classes: Vec<PointClass>,
    kept: Vec<u32>,
    belt: Option<BeltPlane>,
    belt_clearance_mm: Option<f64>,
    to_camera: Option<UnitVector3>,
    spacing_mm: f64,
    warnings: Vec<String>,
}

impl Outcome {
    fn into_scan(self, cloud: PointCloud) -> ConditionedScan {
        let count = |class| self.classes.iter().filter(|c| **c == class).count();
        let removed = Removed {
            invalid: cloud.skipped_invalid,
            duplicate: count(PointClass::Duplicate),
            belt: count(PointClass::Belt),
            colour: count(PointClass::Colour),
            dark: count(PointClass::Dark),
            stray: count(PointClass::Stray),
            other: 0,
        };
        ConditionedScan {
            cloud,
            classes: self.classes,
            kept: self.kept,
            removed,
            belt: self.belt,
            belt_clearance_mm: self.belt_clearance_mm,
            to_camera: self.to_camera,
            spacing_mm: self.spacing_mm,
            warnings: self.warnings,
        }
    }
}

fn attempt(
    cloud: &PointCloud,
    again: &[u32],
    settings: &BackgroundSettings,
    hints: &ScanHints,
    dark_filter: DarkFilter,
    run: &RunContext,
) -> Result<Outcome, Stop> {
    let mut warnings = Vec::new();
    let colours = BeltColours::new(&settings.belt_colours, settings.colour_tolerance);
    let luminance_min = luminance_threshold(cloud, settings, dark_filter);
    let mut bright = bright_points(cloud, luminance_min);
    run.check()?;
    warn_of_darkness(cloud, &bright, luminance_min, dark_filter, &mut warnings);
    leave_out(&mut bright, again);
    warnings.extend(warning_of_duplicates(again.len(), cloud.len()));
    if bright.len() < FEWEST_POINTS {
        return Err(all_dark(luminance_min).into());
    }
    run.check()?;
    let Some(overall) = texture(&cloud.positions, &bright, 1) else {
        return Err(Refusal::new("all points of the scan lie on one spot", "see whether the measurement worked").into());
    };
    let belt = if settings.belt_plane {
        search_belt(cloud, &bright, &colours, overall, hints, &mut warnings, run)?
    } else {
        None
    };
    run.check()?;
    let rules = rules(cloud, &bright, belt, luminance_min, &colours, overall, settings, hints, &mut warnings)?;
    let mut classes = classify(cloud, &rules);
    for &k in again {
        classes[k as usize] = PointClass::Duplicate;
    }
    run.check()?;
    let (kept, spacing_mm) = settle_kept(cloud, &mut classes, overall, &rules, hints, run)?;
    let told = hints.view_direction.map(|d| -d).or(belt.map(|b| b.normal));
    let to_camera = told.or_else(|| mean_normal(cloud, &kept));
    let belt_clearance_mm = belt.map(|_| rules.clearance_mm);
    Ok(Outcome { classes, kept, belt, belt_clearance_mm, to_camera, spacing_mm, warnings })
}

fn luminance_threshold(cloud: &PointCloud, settings: &BackgroundSettings, dark_filter: DarkFilter) -> Option<f64> {
    let colours = cloud.colours.as_ref()?;
    match (settings.luminance_min, dark_filter) {
        (Some(value), _) => Some(value),
        (None, DarkFilter::Off) => None,
        (None, DarkFilter::AsSet) => {
            automatic_luminance_min(stratified(colours.len(), 100_000, 2).into_iter().map(|k| colours[k as usize]))
        }
    }
}

/// Indices of the points that are not too dark, ascending.
fn bright_points(cloud: &PointCloud, luminance_min: Option<f64>) -> Vec<u32> {
    match (&cloud.colours, luminance_min) {
        (Some(colours), Some(least)) => indices_where(colours, |colour| luminance(*colour) >= least),
        _ => (0..cloud.len() as u32).collect(),
    }
}

fn warn_of_darkness(
    cloud: &PointCloud,
    bright: &[u32],
    luminance_min: Option<f64>,
    dark_filter: DarkFilter,
    warnings: &mut Vec<String>,
) {
    let dark = 1.0 - bright.len() as f64 / cloud.len() as f64;
    if let Some(least) = luminance_min.filter(|_| dark > 0.4) {
        warnings.push(format!(
            "{:.0} % of the points are darker than {least:.0}: more light or a longer exposure would help",
            100.0 * dark
        ));
    }
    if dark_filter == DarkFilter::Off {
        warnings.push("dark points were kept, because without them no part would be left".into());
    }
}

fn all_dark(luminance_min: Option<f64>) -> Refusal {
    Refusal::new(
        format!("nearly all points are darker than {:.0} of 255", luminance_min.unwrap_or(0.0)),
        "give the scan more light, or set background.luminance_min lower",
    )
}

fn search_belt(
    cloud: &PointCloud,
    bright: &[u32],
    colours: &BeltColours,
    texture: Texture,
    hints: &ScanHints,
    warnings: &mut Vec<String>,
    run: &RunContext,
) -> Result<Option<BeltPlane>, Cancelled> {
    const SAMPLE: usize = 6000;
    let places = stratified(bright.len(), SAMPLE, 3);
    let index = |&k: &u32| bright[k as usize] as usize;
    let points: Vec<Point3> = places.iter().map(|k| cloud.positions[index(k)]).collect();
    let belt_coloured = match &cloud.colours {
        Some(all) => (0..places.len() as u32).filter(|&k| colours.matches(all[index(&places[k as usize])])).collect(),
        None => Vec::new(),
    };
    let each_for = bright.len() as f64 / points.len() as f64;
    let sample = Sample { points, belt_coloured, texture, each_for };
    let found = find_belt(&sample, hints);
    run.check()?;
    Ok(match found {
        Verdict::Belt(rough) if are_parts_alone(&cloud.positions, bright, &rough, texture, hints) => {
            warnings.push("no belt plane in view: what is in view are parts, each no larger than the CAD".into());
            None
        }
        Verdict::Belt(rough) => {
            let points: Vec<Point3> =
                stratified(bright.len(), 50_000, 4).iter().map(|k| cloud.positions[index(k)]).collect();
            Some(refine(&points, rough).unwrap_or(rough))
        }
        Verdict::None(why) => {
            warnings.push(format!("no belt plane in view: {why}"));
            None
        }
    })
}

fn classify(cloud: &PointCloud, rules: &Rules) -> Vec<PointClass> {
    let mut classes = vec![PointClass::Kept; cloud.len()];
    classes.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, classes)| {
        let start = chunk * CHUNK;
        for (k, class) in classes.iter_mut().enumerate() {
            let colour = cloud.colours.as_ref().map(|all| all[start + k]);
            *class = rules.class(&cloud.positions[start + k], colour);
        }
    });
    classes
}

fn kept_indices(classes: &[PointClass]) -> Vec<u32> {
    indices_where(classes, |class| *class == PointClass::Kept)
}

/// Indices of the items that pass, ascending.
fn indices_where<T: Sync>(items: &[T], passes: impl Fn(&T) -> bool + Sync) -> Vec<u32> {
    let chunks: Vec<Vec<u32>> = items
        .par_chunks(CHUNK)
        .enumerate()
        .map(|(chunk, items)| {
            let mut found = Vec::with_capacity(items.len());
            found.extend(
                items.iter().enumerate().filter(|(_, item)| passes(item)).map(|(k, _)| (chunk * CHUNK + k) as u32),
            );
            found
        })
        .collect();
    chunks.concat()
}

/// Takes out the stray points and sees whether what is left can be a part. Gives the kept points and their spacing.
fn settle_kept(
    cloud: &PointCloud,
    classes: &mut [PointClass],
    overall: Texture,
    rules: &Rules,
    hints: &ScanHints,
    run: &RunContext,
) -> Result<(Vec<u32>, f64), Stop> {
    let candidates = kept_indices(classes);
    if candidates.len() < FEWEST_POINTS {
        return Err(nothing_left(candidates.len(), rules).into());
    }
    run.check()?;
    let part_mm = if hints.has_size() { hints.diagonal_mm() } else { 200.0 * overall.spacing_mm };
    let found = components(&cloud.positions, &candidates, overall.spacing_mm, 0.1 * part_mm, part_mm);
    run.check()?;
    let point_mm2 = overall.spacing_mm * overall.spacing_mm;
    let body_mm2 = found.body_points as f64 * point_mm2;
    if found.body_points < FEWEST_POINTS || body_mm2 < LEAST_BODY * hints.part_area_mm2 {
        return Err(nothing_left(found.body_points, rules).into());
    }
    for &k in &found.stray {
        classes[k as usize] = PointClass::Stray;
    }
    let kept = kept_indices(classes);
    run.check()?;
    let spacing_mm = texture(&cloud.positions, &kept, 6).map_or(overall.spacing_mm, |t| t.spacing_mm);
    Ok((kept, spacing_mm))
}

fn nothing_left(points: usize, rules: &Rules) -> Refusal {
    if rules.belt.is_some() {
        Refusal::new(
            "no part on the belt: nothing stands out above it",
            "see whether a part is in view; for a very flat part set background.belt_clearance_mm below its thickness",
        )
    } else if rules.colour_use == ColourUse::Everywhere {
        Refusal::new(
            "no part in view: nearly all points have the belt's colour",
            "see whether a part is in view, and whether background.belt_colours leave out its colour",
        )
    } else {
        Refusal::new(
            format!("no part in view: only {points} points form a surface"),
            "see whether a part is in view and whether the scan is complete",
        )
    }
}
