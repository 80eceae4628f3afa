//! The robust best fit of a scan to the CAD: which way the part lies, which side is seen, and how certain that is.
//!
//! ```text
//! kept points --sample--> work cloud --height map x templates--> modes --register, halve--> candidates
//!   --turns and partners--> contest on the cells where poses disagree --> winner, margin --> polish
//! ```
//!
//! A wrong pose is worse than none: whatever is not clearly better than every distinct pose is refused, with the numbers.

use super::candidates::{self, Candidate};
use super::evidence::{self, Contest, Gaps, Ground, RESIDUAL_LIMIT_MM, Witness};
use super::faces::{self, FACE_POINTS};
use super::fit_uncertainty::{Ended, pose_motions};
use super::height_map::{HeightMap, Raster};
use super::icp::{Beyond, Registered, Settings, distances, register};
use super::pose::{BestFit, PoseUncertainty};
use super::pose_search;
use super::refuse;
use super::rim::{DenseIndex, RimLock};
use super::rounds::{corners, furthest_mm};
use super::sampling::WorkCloud;
use super::template::{Detail, Template};
use super::view::{View, directions};
use crate::diagnostic::{Rivals, Stop};
use crate::geometry::{CadFromScan, Isometry3, Point3};
use crate::part::Part;
use crate::plan::Side;
use crate::run::RunContext;
use crate::scan::ConditionedScan;
use rayon::prelude::*;
use std::cmp::Ordering;

/// The margin below which a scan is refused.
pub const MARGIN_LIMIT: f64 = 1.5;
/// Points for residuals in the contest.
const FINE_POINTS: usize = 2000;
/// Points that tell where the data's edges are while poses are many.
const RIM_POINTS: usize = 60_000;
/// Hopeless poses that stay in the contest, so that it has a second.
const HOPELESS_KEPT: usize = 3;
/// The last registrations: points, most steps, and the motion at which they end, mm.
const POLISH: [(usize, usize, f64); 3] = [(1200, 25, 1e-3), (4000, 20, 1e-4), (BEST_FIT_POINTS, 20, 1e-7)];
/// Points that the pose is in the end told by: what lies across a nearly flat part is known by few of them.
pub const BEST_FIT_POINTS: usize = 30_000;

/// Finds the pose and the side of a scan.
///
/// # Errors
/// `Refused` with the reason when there is no part in the scan, the side cannot be told, the scan does not look like the
/// part, or two distinct poses fit almost alike; `Cancelled` when the job was.
pub fn best_fit(part: &Part, scan: &ConditionedScan, run: &RunContext) -> Result<BestFit, Stop> {
    run.check()?;
    refuse::without_points(scan)?;
    let view = View::of(part, scan)?;
    let cloud = WorkCloud::new(scan, &view);
    refuse::wrong_size(part, &cloud.dense)?;
    let mut found = align(part, scan, &cloud, run);
    if view.both_ends {
        // Nobody knows from which end of z the sheet was seen: the face that clearly fits better is the answer.
        let flipped = cloud.flipped();
        let other = align(part, scan, &flipped, run);
        found = match (found, other) {
            (Ok(a), Ok(b)) => Ok(better_face(part, [(a, &cloud), (b, &flipped)])),
            (Ok(one), Err(Stop::Refused(other))) | (Err(Stop::Refused(other)), Ok(one)) => {
                Ok(Found { open_face: refuse::open_face_beside(&other), ..one })
            }
            (_, Err(Stop::Cancelled(cancelled))) => Err(cancelled.into()),
            (a, _) => a,
        };
    }
    let found = found?;
    let rotation = found.cad_from_scan.isometry().rotation.to_rotation_matrix();
    assert!((rotation.matrix().determinant() - 1.0).abs() < 1e-9, "a pose is a proper rotation");
    Ok(BestFit {
        cad_from_scan: found.cad_from_scan,
        side: view.tells_side.then_some(found.side),
        face: if view.tells_side || view.both_ends { found.side } else { Side::Top },
        rms_mm: found.registered.rms_mm,
        inlier_ratio: found.registered.inlier_ratio,
        margin: found.margin,
        margin_limit: MARGIN_LIMIT,
        poses_tried: found.poses_tried,
        uncertainty: found.uncertainty,
        converged: found.settled,
        unfinished_mm: found.unfinished_mm,
        open_face: found.open_face,
    })
}

/// The face that fits better, of those that were seen from either end; marked where they fit alike. A pose is worth having then, a
/// judgement is not.
fn better_face(part: &Part, ends: [(Found, &WorkCloud); 2]) -> Found {
    let places = ends[0].1.subset(FACE_POINTS);
    let [first, second] = ends.each_ref().map(|(found, cloud)| {
        faces::heights(part.face(found.side), &cloud.subset(FACE_POINTS), &found.registered.cad_from_work)
    });
    let better = faces::better(&places, &first, &second, MARGIN_LIMIT);
    let [(a, _), (b, _)] = ends;
    match better {
        Some(Ordering::Less) => a,
        Some(_) => b,
        None => {
            let open_face = Some(refuse::open_face([a.registered.rms_mm, b.registered.rms_mm]));
            Found { open_face, ..if b.registered.rms_mm < a.registered.rms_mm { b } else { a } }
        }
    }
}

/// A pose with what is known about it.
struct Found {
    cad_from_scan: CadFromScan,
    side: Side,
    registered: Registered,
    uncertainty: PoseUncertainty,
    settled: bool,
    unfinished_mm: f64,
    /// Why it is not known which face of a solid was seen.
    open_face: Option<String>,
    margin: f64,
    poses_tried: usize,
}

fn align(part: &Part, scan: &ConditionedScan, cloud: &WorkCloud, run: &RunContext) -> Result<Found, Stop> {
    let diagonal = part.diagonal_mm();
    let spacing = scan.spacing_mm * (scan.kept.len() as f64 / cloud.dense.len() as f64).sqrt();
    let raster = |cell_mm: f64| Raster::over(&cloud.dense, cell_mm, 0.06 * diagonal, 1.2 * diagonal);
    let coarse = raster((2.2 * spacing).max(2.0).max(diagonal / 250.0));
    let map = HeightMap::build(&cloud.dense, coarse).ok_or_else(|| refuse::no_part(scan))?;
    let templates: Vec<Template> = directions(part, cloud)
        .into_par_iter()
        .map(|up| {
            run.check()?;
            Ok(Template::draw(part, candidates::seen_side(part, &up), &up, Detail::Samples))
        })
        .collect::<Result<_, Stop>>()?;
    let mut modes = Vec::new();
    for which in 0..templates.len() {
        modes.extend(pose_search::search(&map, &templates, which, diagonal, run)?);
    }
    pose_search::refine(&map, &templates, &mut modes, run)?;
    let starts = candidates::starts(part, &templates, &mut modes);
    let mut poses_tried = starts.len();

    let ground =
        Ground::new(&cloud.dense, raster((2.1 * spacing).max(1.0).max(diagonal / 1000.0)), low_mm(scan, cloud));
    let per_mm2 = ground.usual / ground.cell_mm2();
    let rim_points = cloud.subset(RIM_POINTS);
    let rim_per_mm2 = per_mm2 * rim_points.len() as f64 / cloud.dense.len() as f64;
    let index = DenseIndex::build(&rim_points, raster(f64::max(2.0, diagonal / 500.0)), rim_per_mm2);
    let subsets = candidates::stage_subsets(cloud);
    let mut list = candidates::halve(part, &subsets, &index, starts, run)?;
    let mut views = Views { part, templates: Vec::new() };
    poses_tried += add_turned(part, cloud, &subsets, &index, &mut views, &mut list, run)?;

    sort(&mut list);
    shorten(&mut list);
    for k in 0..list.len().min(2) {
        let partners = candidates::improved_partners(part, &subsets, &index, &list, k, run)?;
        poses_tried += candidates::merge(part, &mut list, partners);
    }
    sort(&mut list);
    let best_cost = list.first().map_or(0.0, |c| c.cost);
    let mut hopeless = 0;
    list.retain(|c| {
        hopeless += usize::from(candidates::is_hopeless(c, best_cost));
        !candidates::is_hopeless(c, best_cost) || hopeless <= HOPELESS_KEPT
    });
    let mut outcome = judge(part, cloud, &ground, &mut views, &list, run)?;
    if outcome.winner > 1 {
        // No winner without its partners in the contest, as far as they are in the running at all.
        let mut partners = candidates::improved_partners(part, &subsets, &index, &list, outcome.winner, run)?;
        partners.retain(|p| !candidates::is_hopeless(p, list[outcome.winner].cost));
        let added = candidates::merge(part, &mut list, partners);
        if added > 0 {
            poses_tried += added;
            outcome = judge(part, cloud, &ground, &mut views, &list, run)?;
        }
    }
    outcome.refuse_unless_certain(part, &list)?;
    let winner = &list[outcome.winner];
    let every_point = DenseIndex::build(&cloud.dense, raster(f64::max(2.0, diagonal / 500.0)), per_mm2);
    // Errors of neighbouring points reach a few spacings.
    let cell_mm = (8.0 * scan.spacing_mm).max(diagonal / 40.0);
    let polished = polish(part, cloud, &every_point, winner, cell_mm, run)?;
    let Polished { registered, uncertainty, settled, unfinished_mm } = polished;
    Ok(Found {
        cad_from_scan: CadFromScan::new(registered.cad_from_work * cloud.work_from_scan),
        side: winner.side,
        registered,
        uncertainty,
        settled,
        unfinished_mm,
        open_face: None,
        margin: outcome.contest.margin,
        poses_tried,
    })
}

/// The free ones before the locked ones, the cheapest first.
fn sort(list: &mut [Candidate]) {
    list.sort_by(|a, b| a.locked.cmp(&b.locked).then(a.cost.total_cmp(&b.cost)));
}

/// Leaves the candidates that may win or come second: the cheapest free ones, then the cheapest locked ones.
fn shorten(list: &mut Vec<Candidate>) {
    let (mut free, mut locked) = (0, 0);
    list.retain(|c| {
        let (count, most) = if c.locked { (&mut locked, 4) } else { (&mut free, 10) };
        *count += 1;
        *count <= most
    });
}

/// Height above the belt up to which a face may have been taken away with it.
fn low_mm(scan: &ConditionedScan, cloud: &WorkCloud) -> f64 {
    match &scan.belt {
        Some(belt) if cloud.on_belt => (5.0 * belt.sigma_mm).max(0.6),
        _ => f64::NEG_INFINITY,
    }
}

/// Templates by direction of view; one is drawn when none is near enough.
struct Views<'a> {
    part: &'a Part,
    templates: Vec<Template>,
}

impl Views<'_> {
    /// The template for a candidate, drawn if need be.
    fn of(&mut self, candidate: &Candidate) -> usize {
        let up = candidate.up_cad();
        let near =
            |t: &Template| t.side == candidate.side && (t.template_from_cad.rotation * up).z > 2f64.to_radians().cos();
        if let Some(k) = self.templates.iter().position(near) {
            return k;
        }
        self.templates.push(Template::draw(self.part, candidate.side, &up, Detail::Full));
        self.templates.len() - 1
    }
}

/// Adds turned poses of the best candidate of each side; how many were tried.
fn add_turned(
    part: &Part,
    cloud: &WorkCloud,
    subsets: &[Vec<Point3>],
    index: &DenseIndex,
    views: &mut Views,
    list: &mut Vec<Candidate>,
    run: &RunContext,
) -> Result<usize, Stop> {
    let sweep_points = cloud.subset(8000);
    let mut tried = 0;
    for side in [Side::Top, Side::Bottom] {
        let Some(best) = list.iter().find(|c| c.side == side && !c.locked).cloned() else { continue };
        if candidates::is_hopeless(&best, list[0].cost) {
            continue;
        }
        run.check()?;
        let template = views.of(&best);
        let turned = candidates::turned(part, &views.templates[template], &sweep_points, &best);
        tried += turned.len();
        let improved = candidates::improve_hopeful(part, subsets, index, turned, list[0].cost, run)?;
        candidates::merge(part, list, improved);
    }
    Ok(tried)
}

/// What the contest of all candidates says.
struct Outcome {
    winner: usize,
    rival: Option<usize>,
    contest: Contest,
    coverage: f64,
    explained: f64,
    against: evidence::Against,
}

fn judge(
    part: &Part,
    cloud: &WorkCloud,
    ground: &Ground,
    views: &mut Views,
    list: &[Candidate],
    run: &RunContext,
) -> Result<Outcome, Stop> {
    let fine = cloud.subset(FINE_POINTS);
    let seen: Vec<usize> = list.iter().map(|c| views.of(c)).collect();
    let witnesses: Vec<Witness> = (0..list.len())
        .into_par_iter()
        .map(|k| {
            run.check()?;
            let c = &list[k];
            let residuals = distances(part.face(c.side), &fine, &c.cad_from_work, RESIDUAL_LIMIT_MM);
            Ok(Witness::hear(ground, &cloud.dense, &views.templates[seen[k]], &c.cad_from_work, residuals))
        })
        .collect::<Result<_, Stop>>()?;
    let gaps = Gaps::find(ground, &witnesses);
    let compare = |k: usize, m: usize| evidence::contest(ground, &gaps, &witnesses[k], &witnesses[m]);
    // The winner is the one whose worst contest is the best: it beats all others, near ones too.
    let worst = |k: usize| {
        (0..list.len())
            .filter(|&m| m != k && !list[m].locked)
            .map(|m| compare(k, m).margin)
            .fold(f64::INFINITY, f64::min)
    };
    let free: Vec<usize> = (0..list.len()).filter(|&k| !list[k].locked).collect();
    let worsts: Vec<f64> = free.par_iter().map(|&k| worst(k)).collect();
    let mut best: Option<usize> = None;
    for k in 0..free.len() {
        let better =
            |b: usize| worsts[k] > worsts[b] || worsts[k] == worsts[b] && list[free[k]].cost < list[free[b]].cost;
        if best.is_none_or(better) {
            best = Some(k);
        }
    }
    let winner = free[best.ok_or_else(refuse::nothing_fits)?];
    let none = Contest { against_first_mm2: 0.0, against_second_mm2: 0.0, margin: f64::INFINITY };
    let (rival, contest) = (0..list.len())
        .filter(|&m| candidates::distinct(part, &list[winner], &list[m]))
        .map(|m| (Some(m), compare(winner, m)))
        .min_by(|a, b| a.1.margin.total_cmp(&b.1.margin))
        .unwrap_or((None, none));
    let witness = &witnesses[winner];
    Ok(Outcome {
        winner,
        rival,
        contest,
        coverage: witness.coverage(ground),
        explained: witness.explained_share(),
        against: evidence::against(ground, &gaps, witness),
    })
}

impl Outcome {
    fn refuse_unless_certain(&self, part: &Part, list: &[Candidate]) -> Result<(), Stop> {
        refuse::unlike(self.coverage, self.explained, self.against)?;
        if self.contest.margin < MARGIN_LIMIT {
            let apart = self.rival.map(|rival| {
                candidates::difference(part, &list[self.winner].cad_from_work, &list[rival].cad_from_work)
            });
            let margin = self.contest.margin;
            return Err(refuse::ambiguous(Rivals { margin, margin_limit: MARGIN_LIMIT, apart }).into());
        }
        Ok(())
    }
}

/// The last registration, with many points and to the end, and how well it knows the pose.
fn polish(
    part: &Part,
    cloud: &WorkCloud,
    index: &DenseIndex,
    winner: &Candidate,
    cell_mm: f64,
    run: &RunContext,
) -> Result<Polished, Stop> {
    let face = part.face(winner.side);
    let weak = winner.registered.as_ref().is_none_or(|r| r.weakest_mm > candidates::WEAK_MM);
    let width_mm = winner.registered.as_ref().map_or(4.0, |r| 1.5 * r.width_mm);
    let rim = weak.then(|| RimLock::new(face, &winner.up_cad(), index, 900, 2.0));
    let mut registered = None;
    let mut pose = winner.cad_from_work;
    let mut width_mm = width_mm;
    for (count, steps, stop_mm) in POLISH {
        let settings =
            Settings { steps, width_mm, least_scale_mm: 0.02, stop_mm, beyond: Beyond::Nothing, locked_axis: None };
        let done = register(face, &cloud.subset(count), &pose, &settings, rim.as_ref(), run)?;
        pose = done.cad_from_work;
        width_mm = done.width_mm;
        registered = Some(done);
    }
    let registered = registered.ok_or_else(refuse::nothing_fits)?;
    let (angle, distance) = candidates::difference(part, &pose, &winner.cad_from_work);
    if angle > candidates::DISTINCT_RAD || distance > candidates::DISTINCT_MM {
        let apart = Some((angle, distance));
        return Err(refuse::ambiguous(Rivals { margin: 1.0, margin_limit: MARGIN_LIMIT, apart }).into());
    }
    let points = cloud.subset(POLISH[POLISH.len() - 1].0);
    let motions = pose_motions(&Ended {
        face,
        points: &points,
        cad_from_work: &registered.cad_from_work,
        width_mm: registered.width_mm,
        scale_mm: registered.scale_mm,
        rim: rim.as_ref(),
        cell_mm,
    });
    let mut uncertainty = PoseUncertainty::none(part.bounds.centre());
    for motion in motions.ok_or_else(refuse::nothing_fits)? {
        uncertainty.add(motion);
    }
    let corners = corners(&part.bounds);
    let unfinished = registered.unfinished.ok_or_else(refuse::nothing_fits)?;
    let negligible = registered.final_width && is_negligible(&unfinished, &corners, &uncertainty);
    uncertainty.add(unfinished);
    Ok(Polished {
        settled: registered.converged || negligible,
        unfinished_mm: furthest_mm(&corners, &unfinished),
        registered,
        uncertainty,
    })
}

/// A motion below this is none for anybody who measures sheet metal, mm, however certain exact points may be.
const NEGLIGIBLE_MM: f64 = 1e-3;

/// Whether a motion that was left undone moves every point by less than it is uncertain anyway. Beyond that the iteration and
/// not the scan would decide what U is.
fn is_negligible(unfinished: &Isometry3, points: &[Point3], uncertainty: &PoseUncertainty) -> bool {
    points.iter().all(|p| (unfinished * p - p).norm() <= uncertainty.anywhere_at(p).max(NEGLIGIBLE_MM))
}

/// The last registration of a pose.
struct Polished {
    registered: Registered,
    uncertainty: PoseUncertainty,
    settled: bool,
    unfinished_mm: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vector3;

    #[test]
    fn what_was_left_undone_counts_beside_what_is_uncertain() {
        let mut uncertainty = PoseUncertainty::none(Point3::origin());
        let points = [Point3::new(200.0, 0.0, 0.0), Point3::new(-200.0, 0.0, 0.0)];
        let turned = |rad: f64| Isometry3::rotation(Vector3::z() * rad);
        assert!(is_negligible(&turned(4e-6), &points, &uncertainty));
        assert!(!is_negligible(&turned(6e-6), &points, &uncertainty));
        uncertainty.add(Isometry3::translation(0.01, 0.0, 0.0));
        assert!(is_negligible(&turned(4.9e-5), &points, &uncertainty));
        assert!(!is_negligible(&turned(5.1e-5), &points, &uncertainty));
    }
}
