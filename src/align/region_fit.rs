//! The alignment on chosen regions: a best fit of only their points, each region with the weight that the plan gives it, some freedoms
//! kept as the best fit to the whole part has them.
//!
//! Minimises the sum over regions of `weight * mean of w r²`, with the distances r of a region's points to the face. A region counts by its
//! weight and not by its number of points, so that neither dropout nor the angle of view shift the part. The biweight w of a
//! point is told by how far it stands from the middle of its own region: it keeps out what is not sheet, and never a whole region, however
//! far that is from its nominal place; that is for the sum of squares to settle.

use super::icp::{Beyond, Pair, pairs_of};
use super::plan_alignment::{AlignmentInput, DATUM_SEARCH_MM, MOST_ROUNDS, Missing, common, degraded};
use super::pose::{BestFit, DatumHold, FeatureAlignment, MeasuredFeature, PoseUncertainty};
use super::region_places::{move_region_fit, on_cad};
use super::region_sums::{Frame, Normal};
use super::rounds::Rounds;
use super::sampling::spread;
use crate::fit::hold::{Named, Twist, WEAK_CONDITION};
use crate::fit::robust::{SIGMA_OF_MAD, TUKEY_WIDTH_SIGMAS, median, tukey_weight};
use crate::geometry::{CadFromScan, Isometry3, Point3, Vector3};
use crate::part::Face;
use crate::plan::{FitRegion, RegionFit};
use crate::run::{Cancelled, RunContext};
use nalgebra::Vector6;
use std::collections::BTreeMap;

/// Points of a region that are looked at.
pub const REGION_POINTS: usize = 3000;
/// Fewer do not tell where a region is.
pub const REGION_LEAST_POINTS: usize = 30;
/// The least scatter that is believed, mm.
const LEAST_SCALE_MM: f64 = 0.02;
/// Rounds after which the regions keep their points: those at their rims would come and go for ever.
const CHOOSING_ROUNDS: usize = 3;
/// Steps of one round.
const STEPS: usize = 30;
/// A step that moves nothing by more ends a round, mm.
const STOP_MM: f64 = 1e-8;
/// Side of the cells within which errors of neighbours are summed, in spacings: they reach a few.
const CELL_SPACINGS: f64 = 8.0;

/// A region with its points, scan frame.
struct Found<'a> {
    region: &'a FitRegion,
    points: Vec<Point3>,
}

/// A region in a pose: each point with its distance from the face and its weight, which sum up to the region's.
struct Weighed {
    pairs: Vec<(Pair, f64)>,
    /// Middle of the distances, mm.
    middle_mm: f64,
    /// Robust standard deviation about it, mm.
    scale_mm: f64,
    /// What the biweight leaves of the slope of its own sum.
    slope: f64,
}

/// Aligns on the plan's regions. A region without points leaves the best fit, marked `degraded`.
pub(super) fn align_on_regions(
    input: &AlignmentInput,
    best_fit: &BestFit,
    fit: &RegionFit,
    run: &RunContext,
) -> Result<(FeatureAlignment, PoseUncertainty), Cancelled> {
    let refused = |reason: String, names: Vec<String>| {
        Ok(degraded(input, best_fit, Missing { reason, names, found: Vec::new() }))
    };
    let kept_as_it_is = !fit.freeze.is_empty();
    if let Some(reason) = best_fit.open_face.clone().or_else(|| best_fit.left_undone().filter(|_| kept_as_it_is)) {
        return refused(reason, Vec::new());
    }
    let frame = Frame::of(fit, input.part.diagonal_mm());
    let start = *best_fit.cad_from_scan.isometry();
    let face = input.part.face(best_fit.face);
    let mut rounds = Rounds::from(best_fit.cad_from_scan, &input.part.bounds);
    let mut numbers = Vector6::zeros();
    let mut found: Vec<Found> = Vec::new();
    for round in 0..MOST_ROUNDS {
        run.check()?;
        if round < CHOOSING_ROUNDS {
            found = find(input, face, fit, &rounds.pose());
        }
        let missing: Vec<&Found> = found.iter().filter(|one| one.points.len() < REGION_LEAST_POINTS).collect();
        if !missing.is_empty() {
            let words = |one: &&Found| {
                let (name, count) = (&one.region.name, one.points.len());
                format!(
                    "datum {name} not measured: {count} points on the part within it, at least {REGION_LEAST_POINTS} are needed"
                )
            };
            let reasons: Vec<String> = missing.iter().map(words).collect();
            return refused(reasons.join("; "), missing.iter().map(|one| one.region.name.clone()).collect());
        }
        if let Err(free) = fit_round(face, &frame, &found, &start, &mut numbers) {
            return refused(format!("the regions leave a motion free: {}", in_words(&free, fit)), Vec::new());
        }
        let motion = frame.motion(&numbers) * start * rounds.pose().isometry().inverse();
        rounds.add(&motion);
        if rounds.have_settled() {
            return Ok(ended(input, best_fit, fit, &frame, &found, &rounds.pose(), motion));
        }
    }
    let moved = rounds.last_moved_mm();
    refused(
        format!("the fit to the regions did not settle: the last round still moved the part by {moved:.3} mm"),
        Vec::new(),
    )
}

fn in_words(motions: &[Twist], fit: &RegionFit) -> String {
    let names: Vec<Named> = fit.regions.iter().map(|r| Named { name: &r.name, place: r.centre }).collect();
    let words: Vec<String> = motions.iter().map(|motion| motion.in_words(&names)).collect();
    words.join(" and ")
}

/// The points of each region: those whose nearest place of the face, within the datums' search, is nominally in it.
fn find<'a>(input: &AlignmentInput, face: &Face, fit: &'a RegionFit, pose: &CadFromScan) -> Vec<Found<'a>> {
    let scan_from_cad = pose.isometry().inverse();
    let one = |region: &'a FitRegion| {
        let reach_mm = region.reach_mm() + DATUM_SEARCH_MM + input.part.thickness_mm;
        let mut near = Vec::new();
        input.grid.for_each_in_sphere(&(scan_from_cad * region.centre), reach_mm, |_, p| near.push(*p));
        // Thinned before they are compared with the face: a box may fill little of its ball.
        let picks = spread(near.len(), 4 * REGION_POINTS);
        let inside = |p: &Point3| {
            let at = pose.isometry() * p;
            face.closest(&at, DATUM_SEARCH_MM).is_some_and(|hit| {
                !hit.on_boundary && region.contains(&on_cad(input.part, face, &hit.point, &hit.normal))
            })
        };
        let points: Vec<Point3> = picks.into_iter().map(|k| near[k as usize]).filter(inside).collect();
        let picks = spread(points.len(), REGION_POINTS);
        Found { region, points: picks.into_iter().map(|k| points[k as usize]).collect() }
    };
    fit.regions.iter().map(one).collect()
}

/// Weighs a region's points in a pose.
fn weigh(face: &Face, found: &Found, pose: &Isometry3, seeds: &mut [u32]) -> Weighed {
    let pairs = pairs_of(face, &found.points, pose, 2.0 * DATUM_SEARCH_MM, Beyond::Nothing, seeds);
    let pairs: Vec<Pair> = pairs.into_iter().flatten().filter(|pair| pair.counts).collect();
    let mut distances: Vec<f64> = pairs.iter().map(|pair| pair.residual_mm).collect();
    let middle_mm = median(&mut distances).unwrap_or(0.0);
    let mut off: Vec<f64> = pairs.iter().map(|pair| (pair.residual_mm - middle_mm).abs()).collect();
    let scale_mm = (SIGMA_OF_MAD * median(&mut off).unwrap_or(0.0)).max(LEAST_SCALE_MM);
    let width_mm = TUKEY_WIDTH_SIGMAS * scale_mm;
    let weights: Vec<f64> = pairs.iter().map(|pair| tukey_weight(pair.residual_mm - middle_mm, width_mm)).collect();
    let total = weights.iter().sum::<f64>().max(1e-9);
    // psi' of the biweight: (1 - u²)(1 - 5 u²), with u² from the weight (1 - u²)².
    let slope = weights.iter().map(|w| w.sqrt() * (5.0 * w.sqrt() - 4.0)).sum::<f64>() / total;
    let share = found.region.weight / total;
    let pairs = pairs.into_iter().zip(weights).map(|(pair, weight)| (pair, weight * share)).collect();
    Weighed { pairs, middle_mm, scale_mm, slope: slope.max(0.2) }
}

/// Fits until nothing moves; `numbers`: the motion from the start pose, before and after.
fn fit_round(
    face: &Face,
    frame: &Frame,
    found: &[Found],
    start: &Isometry3,
    numbers: &mut Vector6<f64>,
) -> Result<(), Vec<Twist>> {
    let mut seeds: Vec<Vec<u32>> = found.iter().map(|one| vec![u32::MAX; one.points.len()]).collect();
    for _ in 0..STEPS {
        let pose = frame.motion(numbers) * start;
        let mut normal = Normal::zero();
        for (one, seeds) in found.iter().zip(&mut seeds) {
            for (pair, weight) in &weigh(face, one, &pose, seeds).pairs {
                let slope = frame.slope(&pair.at, &pair.normal);
                normal.h += slope * slope.transpose() * *weight;
                normal.g += slope * (pair.residual_mm * weight);
            }
        }
        frame.judged(&normal.h)?;
        let Some(step) = frame.step(&normal.h, &normal.g) else { break };
        *numbers += step;
        if step.norm() < STOP_MM {
            break;
        }
    }
    Ok(())
}

/// The alignment once its rounds have ended; `unsure`: a motion that the last of them still made.
fn ended(
    input: &AlignmentInput,
    best_fit: &BestFit,
    fit: &RegionFit,
    frame: &Frame,
    found: &[Found],
    pose: &CadFromScan,
    unsure: Isometry3,
) -> (FeatureAlignment, PoseUncertainty) {
    let face = input.part.face(best_fit.face);
    let mut normal = Normal::zero();
    let mut features = Vec::new();
    for one in found {
        let mut seeds = vec![u32::MAX; one.points.len()];
        let weighed = weigh(face, one, pose.isometry(), &mut seeds);
        add_information(&mut normal, frame, &weighed, CELL_SPACINGS * input.scan.spacing_mm);
        features.push(report(one, &weighed));
    }
    let free = |motions: &[Twist]| {
        let reason = format!("the regions leave a motion free: {}", in_words(motions, fit));
        degraded(input, best_fit, Missing { reason, names: Vec::new(), found: Vec::new() })
    };
    let (condition, weakest) = match frame.judged(&normal.h) {
        Ok(judged) => judged,
        Err(motions) => return free(&motions),
    };
    let Some(motions) = frame.uncertain_motions(&normal, &best_fit.uncertainty.motions()) else {
        return free(&[weakest]);
    };
    let mut uncertainty = PoseUncertainty::none(input.part.bounds.centre());
    move_region_fit(&common(input, best_fit), fit, &mut uncertainty);
    motions.into_iter().chain([unsure]).for_each(|motion| uncertainty.add(motion));
    let weak = (condition > WEAK_CONDITION).then(|| in_words(&[weakest], fit));
    let alignment = FeatureAlignment {
        method: "best_fit",
        cad_from_scan: *pose,
        degraded: None,
        missing: Vec::new(),
        features,
        hold: Some(DatumHold { condition, weak, residuals: Vec::new() }),
    };
    (alignment, uncertainty)
}

/// Adds what a region tells, and how its errors scatter: sums over cells, within which neighbours have errors in common, of distances from
/// the region's middle. That a region stands off as a whole is form of the part, which the next scan shows again.
fn add_information(normal: &mut Normal, frame: &Frame, weighed: &Weighed, cell_mm: f64) {
    let mut cells: BTreeMap<[i64; 3], Vector6<f64>> = BTreeMap::new();
    for (pair, weight) in &weighed.pairs {
        let slope = frame.slope(&pair.at, &pair.normal);
        normal.h += slope * slope.transpose() * (*weight * weighed.slope);
        let cell = (pair.at - frame.middle).map(|c| (c / cell_mm).floor() as i64);
        let sum = cells.entry(cell.into()).or_insert_with(Vector6::zeros);
        *sum += slope * (weight * (pair.residual_mm - weighed.middle_mm));
    }
    // The middle was taken from the same cells.
    let count = cells.len() as f64;
    let correction = count / (count - 1.0).max(0.5);
    for sum in cells.values() {
        normal.variance += sum * sum.transpose() * correction;
    }
}

fn report(found: &Found, weighed: &Weighed) -> MeasuredFeature {
    let FitRegion { name, centre, weight, .. } = found.region;
    let normals: Vector3 = weighed.pairs.iter().map(|(pair, weight)| pair.normal * *weight).sum();
    let axis = normals.try_normalize(1e-9).unwrap_or_else(Vector3::z);
    MeasuredFeature {
        name: name.clone(),
        kind: "region",
        fixes: format!("weight {weight}"),
        centre: centre + axis * weighed.middle_mm,
        axis,
        direction: None,
        diameter_mm: None,
        length_mm: None,
        nominal_diameter_mm: None,
        nominal_length_mm: None,
        points_used: weighed.pairs.len(),
        rms_mm: weighed.scale_mm,
        warning: None,
    }
}
