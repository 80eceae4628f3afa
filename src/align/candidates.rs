//! From many rough poses to a few fine ones: successive halving, partners of near-symmetry, a sweep of turns.

use super::icp::{Beyond, Registered, Settings, distances, register};
use super::pose_search::Mode;
use super::rim::{DenseIndex, RimLock};
use super::template::Template;
use crate::fit::robust::{SIGMA_OF_MAD, TUKEY_WIDTH_SIGMAS, middle_value, tukey_weight};
use crate::geometry::{CadFromScan, Isometry3, Point3, UnitVector3, Vector3, decompose};
use crate::part::{Face, FaceSample, Part};
use crate::plan::Side;
use crate::run::{Cancelled, RunContext};
use nalgebra::{Matrix3, Matrix5, Translation3, UnitQuaternion, Vector5};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Two poses are distinct from here on, measured at the part's centre.
pub(super) const DISTINCT_RAD: f64 = 5.0 * PI / 180.0;
/// Two poses are distinct from here on, measured at the part's centre.
pub(super) const DISTINCT_MM: f64 = 5.0;
/// Motions less certain than this (see [`Registered::weakest_mm`]) need the rims.
pub(super) const WEAK_MM: f64 = 0.06;
/// Distances beyond this are outliers when poses are ranked, mm.
const RANK_LIMIT_MM: f64 = 3.0;
/// Points used in the three stages.
const STAGE_POINTS: [usize; 2] = [180, 500];
/// A pose this many times as costly as the best one is not worth more work.
const HOPELESS: f64 = 3.0;
/// Places on the rims used while poses are many.
const RIM_PLACES: usize = 250;
/// Poses kept after each stage.
const STAGE_KEPT: [usize; 2] = [8, 6];

/// A pose under test.
#[derive(Debug, Clone)]
pub(super) struct Candidate {
    /// The pose.
    pub cad_from_work: Isometry3,
    /// The face it lays the points on.
    pub side: Side,
    /// Mean truncated squared distance of points to the face, mm².
    pub cost: f64,
    /// How the registration ended.
    pub registered: Option<Registered>,
    /// Made to stay distinct from a better one; never the answer.
    pub locked: bool,
}

impl Candidate {
    fn new(cad_from_work: Isometry3, side: Side) -> Self {
        Self { cad_from_work, side, cost: f64::INFINITY, registered: None, locked: false }
    }

    /// Direction of the work frame's z in CAD coordinates.
    pub fn up_cad(&self) -> Vector3 {
        self.cad_from_work.rotation * Vector3::z()
    }
}

/// Angle and distance between two poses at the part's centre.
pub(super) fn difference(part: &Part, a: &Isometry3, b: &Isometry3) -> (f64, f64) {
    CadFromScan::new(*a).difference(&CadFromScan::new(*b), &part.centroid)
}

/// Whether two poses are distinct in the sense of the margin.
pub(super) fn distinct(part: &Part, a: &Candidate, b: &Candidate) -> bool {
    let (angle, distance) = difference(part, &a.cad_from_work, &b.cad_from_work);
    angle > DISTINCT_RAD || distance > DISTINCT_MM
}

/// Whether a start pose lies in the reach of a pose that was registered already.
fn alike(part: &Part, registered: &Candidate, start: &Candidate) -> bool {
    let (angle, distance) = difference(part, &registered.cad_from_work, &start.cad_from_work);
    !registered.locked && registered.side == start.side && angle < 0.3f64.to_radians() && distance < 0.3
}

/// The best modes that differ from each other, and their partners: half a turn on the belt, and turned over.
pub(super) fn starts(part: &Part, templates: &[Template], modes: &mut [Mode]) -> Vec<Candidate> {
    modes.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let mut chosen: Vec<Candidate> = Vec::new();
    for mode in modes.iter() {
        let candidate = Candidate::new(mode.cad_from_work(templates), templates[mode.template].side);
        if add_if_new(part, &mut chosen, candidate, 7f64.to_radians(), 8.0) && chosen.len() == 14 {
            break;
        }
    }
    for best in chosen.clone().iter().take(2) {
        for partner in partners(part, best) {
            add_if_new(part, &mut chosen, partner, 10f64.to_radians(), 10.0);
        }
    }
    chosen
}

fn add_if_new(part: &Part, list: &mut Vec<Candidate>, candidate: Candidate, angle: f64, distance: f64) -> bool {
    let known = list.iter().any(|c| {
        let (a, d) = difference(part, &c.cad_from_work, &candidate.cad_from_work);
        a < angle && d < distance
    });
    if !known {
        list.push(candidate);
    }
    !known
}

/// The pose after half a turn about each principal axis of the face: a nearly symmetric part looks the same in one of them.
fn partners(part: &Part, of: &Candidate) -> Vec<Candidate> {
    let samples = &part.face(of.side).samples;
    let (middle, axes) = principal_axes(samples);
    (0..3)
        .map(|k| {
            let axis = UnitVector3::new_normalize(axes.column(k).into_owned());
            let half_turn = UnitQuaternion::from_axis_angle(&axis, PI);
            let motion = Translation3::from(middle.coords) * half_turn * Translation3::from(-middle.coords);
            let turned = motion * of.cad_from_work;
            let candidate = Candidate::new(turned, of.side);
            let side = seen_side(part, &candidate.up_cad());
            Candidate { side, ..candidate }
        })
        .collect()
}

fn principal_axes(samples: &[FaceSample]) -> (Point3, Matrix3<f64>) {
    let n = samples.len().max(1) as f64;
    let middle = Point3::from(samples.iter().fold(Vector3::zeros(), |s, p| s + p.point.coords) / n);
    let spread = samples.iter().fold(Matrix3::zeros(), |s, p| {
        let d = p.point - middle;
        s + d * d.transpose()
    });
    (middle, decompose::symmetric_eigen(spread).map_or_else(Matrix3::identity, |eigen| eigen.eigenvectors))
}

/// The side of which more is seen from a direction (CAD frame).
pub(super) fn seen_side(part: &Part, up: &Vector3) -> Side {
    let seen = |side: Side| part.face(side).samples.iter().filter(|s| s.normal.dot(up) > 0.1).count();
    if seen(Side::Top) >= seen(Side::Bottom) { Side::Top } else { Side::Bottom }
}

/// Registers all candidates, keeps the better ones, and registers those again with more points.
pub(super) fn halve(
    part: &Part,
    subsets: &[Vec<Point3>],
    index: &DenseIndex,
    starts: Vec<Candidate>,
    run: &RunContext,
) -> Result<Vec<Candidate>, Cancelled> {
    let mut candidates = starts;
    for (stage, points) in subsets.iter().enumerate().take(2) {
        let (steps, width_mm) = [(7, 8.0), (7, 4.0)][stage];
        let rim = (stage == 1).then_some(index);
        candidates = candidates
            .into_par_iter()
            .map(|c| improve(part, points, c, steps, width_mm, rim, run))
            .collect::<Result<_, _>>()?;
        candidates.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        let mut kept: Vec<Candidate> = Vec::new();
        for c in candidates {
            if kept.len() < STAGE_KEPT[stage] {
                add_if_new(part, &mut kept, c, 3f64.to_radians(), 3.0);
            }
        }
        candidates = kept;
    }
    Ok(candidates)
}

/// The subsets that [`halve`] wants.
pub(super) fn stage_subsets(cloud: &super::sampling::WorkCloud) -> Vec<Vec<Point3>> {
    STAGE_POINTS.iter().map(|&n| cloud.subset(n)).collect()
}

/// Whether a pose is out of the running beside one of that cost.
pub(super) fn is_hopeless(candidate: &Candidate, best_cost: f64) -> bool {
    candidate.cost > HOPELESS * (best_cost + 0.05)
}

/// The half-turned partners of a candidate that are not in the list yet, registered.
pub(super) fn improved_partners(
    part: &Part,
    subsets: &[Vec<Point3>],
    index: &DenseIndex,
    list: &[Candidate],
    of: usize,
    run: &RunContext,
) -> Result<Vec<Candidate>, Cancelled> {
    let mut partners = partners(part, &list[of]);
    partners.retain(|p| !list.iter().any(|c| alike(part, c, p)));
    improve_hopeful(part, subsets, index, partners, list[of].cost, run)
}

/// Registers candidates with few points first, and goes on only with those that are not hopeless beside a cost.
pub(super) fn improve_hopeful(
    part: &Part,
    subsets: &[Vec<Point3>],
    index: &DenseIndex,
    list: Vec<Candidate>,
    best_cost: f64,
    run: &RunContext,
) -> Result<Vec<Candidate>, Cancelled> {
    list.into_par_iter()
        .map(|c| {
            let rough = improve(part, &subsets[0], c, 7, 4.0, None, run)?;
            if is_hopeless(&rough, best_cost) {
                return Ok(rough);
            }
            improve(part, &subsets[1], rough, 3, 2.0, Some(index), run)
        })
        .collect()
}

/// One registration, with the rims where the surface leaves the pose free.
pub(super) fn improve(
    part: &Part,
    points: &[Point3],
    candidate: Candidate,
    steps: usize,
    width_mm: f64,
    rims: Option<&DenseIndex>,
    run: &RunContext,
) -> Result<Candidate, Cancelled> {
    let face = part.face(candidate.side);
    let locked_axis = candidate.locked.then(|| UnitVector3::new_normalize(candidate.up_cad()));
    let rough = Settings { steps, width_mm, least_scale_mm: 0.02, stop_mm: 0.05, beyond: Beyond::Pull, locked_axis };
    let mut registered = register(face, points, &candidate.cad_from_work, &rough, None, run)?;
    if let Some(index) = rims {
        let up = registered.cad_from_work.rotation * Vector3::z();
        let mut width_mm = registered.width_mm.max(1.0);
        for (reach_mm, steps) in [(4.0, 7), (2.0, 6)] {
            let rim = RimLock::new(face, &up, index, RIM_PLACES, reach_mm);
            let fine = Settings { steps, width_mm, stop_mm: 2e-3, beyond: Beyond::Nothing, ..rough };
            registered = register(face, points, &registered.cad_from_work, &fine, Some(&rim), run)?;
            width_mm = registered.width_mm;
        }
    }
    let distances = distances(face, points, &registered.cad_from_work, RANK_LIMIT_MM);
    let cost = distances.iter().map(|d| d * d).sum::<f64>() / distances.len().max(1) as f64;
    Ok(Candidate { cad_from_work: registered.cad_from_work, cost, registered: Some(registered), ..candidate })
}

/// The axis (CAD frame), near `up`, about which the face slides best on itself: of a round part its axis of revolution.
///
/// A turn `w x (p - m) + v` slides at a sample with normal `n` when `n . (w x (p - m) + v) = 0`; with `w = up + a e1 + b e2`
/// that is linear in (a, b, v). After the slippage analysis of Gelfand and Guibas 2004, with Tukey weights for the places
/// that are not round.
fn slide_axis(face: &Face, up: &Vector3) -> (Point3, UnitVector3) {
    let seen: Vec<&FaceSample> = face.samples.iter().filter(|s| s.normal.dot(up) > 0.1).collect();
    let middle = Point3::from(seen.iter().fold(Vector3::zeros(), |s, p| s + p.point.coords) / seen.len().max(1) as f64);
    let lever = seen.iter().map(|s| (s.point - middle).norm()).fold(1.0, f64::max);
    let e1 = up.cross(&if up.x.abs() < 0.7 { Vector3::x() } else { Vector3::y() }).normalize();
    let e2 = up.cross(&e1);
    let mut found = Vector5::zeros();
    let mut width = f64::INFINITY;
    for _ in 0..5 {
        let (mut normal, mut right) = (Matrix5::zeros(), Vector5::zeros());
        let mut sizes = Vec::with_capacity(seen.len());
        for s in &seen {
            let arm = (s.point - middle).cross(&s.normal);
            let row = Vector5::new(arm.dot(&e1), arm.dot(&e2), s.normal.x, s.normal.y, s.normal.z);
            let rest = arm.dot(up) + row.dot(&found);
            sizes.push(rest.abs());
            let w = if width.is_finite() { tukey_weight(rest, width) } else { 1.0 };
            normal += row * row.transpose() * w;
            right -= row * (arm.dot(up) * w);
        }
        // Where the face slides in more ways than one (a flat part) the turn about `up` through the middle is as good.
        let stiff = 1e-4 * seen.len() as f64;
        for (k, scale) in [lever * lever, lever * lever, 1.0, 1.0, 1.0].into_iter().enumerate() {
            normal[(k, k)] += stiff * scale;
        }
        let Some(solved) = normal.cholesky().map(|c| c.solve(&right)) else { break };
        found = solved;
        let usual = middle_value(&mut sizes).unwrap_or(0.0).max(0.01);
        width = (TUKEY_WIDTH_SIGMAS * SIGMA_OF_MAD * usual).max(0.05);
    }
    let turn = up + e1 * found[0] + e2 * found[1];
    let shift = Vector3::new(found[2], found[3], found[4]);
    (middle + turn.cross(&shift) / turn.norm_squared(), UnitVector3::new_normalize(turn))
}

/// Adds candidates to a list unless a pose half a degree and half a mm away is there already.
pub(super) fn merge(part: &Part, list: &mut Vec<Candidate>, more: Vec<Candidate>) -> usize {
    let before = list.len();
    for c in more {
        add_if_new(part, list, c, 0.5f64.to_radians(), 0.5);
    }
    list.len() - before
}

/// Poses turned about the view axis from a given one: the best ones elsewhere, and the nearest that count as distinct.
pub(super) fn turned(part: &Part, template: &Template, points: &[Point3], from: &Candidate) -> Vec<Candidate> {
    const STEPS: usize = 180;
    let (through, axis) = slide_axis(part.face(from.side), &from.up_cad());
    let pose = |angle: f64| {
        let turn = UnitQuaternion::from_axis_angle(&axis, angle);
        Translation3::from(through.coords) * turn * Translation3::from(-through.coords) * from.cad_from_work
    };
    let angle = |k: usize| 2.0 * PI * k as f64 / STEPS as f64;
    let cost: Vec<f64> = (0..STEPS)
        .into_par_iter()
        .map(|k| {
            let template_from_work = template.template_from_cad * pose(angle(k));
            let one = |p: &Point3| {
                template.height_off(&(template_from_work * p)).map_or(1.0, |off| (off / 2.0).powi(2).min(1.0))
            };
            points.iter().map(one).sum()
        })
        .collect();
    let apart = (DISTINCT_RAD / angle(1)).ceil() as usize;
    let is_minimum = |k: usize| cost[k] <= cost[(k + 1) % STEPS] && cost[k] < cost[k - 1];
    let is_elsewhere = |k: usize| (apart..=STEPS - apart).contains(&k) || cost[k] < cost[0];
    let mut minima: Vec<usize> = (1..STEPS).filter(|&k| is_minimum(k) && is_elsewhere(k)).collect();
    minima.sort_by(|&a, &b| cost[a].total_cmp(&cost[b]));
    // A part with a shape of its own is clearly worse in every other turn: one of them is enough to say so.
    let clear = 0.2 * points.len() as f64 + 1.5 * cost[0];
    let close = minima.iter().filter(|&&k| cost[k] < clear).count();
    minima.truncate(close.clamp(1, 6));
    let nearest = [1.02 * DISTINCT_RAD, -1.02 * DISTINCT_RAD];
    let free = minima.iter().map(|&k| Candidate::new(pose(angle(k)), from.side));
    let far = minima.iter().filter(|&&k| (apart..=STEPS - apart).contains(&k)).take(1);
    let locked = far.map(|&k| angle(k)).chain(nearest);
    let held = locked.map(|a| Candidate { locked: true, ..Candidate::new(pose(a), from.side) });
    free.chain(held).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::part::PartSettings;
    use crate::plan::CadSide;
    use crate::simulate::cover;

    #[test]
    fn a_round_part_slides_about_its_own_axis() {
        let settings = PartSettings { cad_side: CadSide::Top, thickness_mm: 1.0, plan_directions: Vec::new() };
        let part = Part::prepare(cover().mesh, "0".repeat(64), &settings, &RunContext::silent()).unwrap();
        // Seen askew, with a tab and holes: the axis is still that of the revolution, x = y = 0 along z. Facets of 3 mm on a
        // radius of 42 mm and more turn a normal by up to 2 degrees either way, which averages out over 4000 samples.
        for side in [Side::Top, Side::Bottom] {
            let up = Vector3::new(0.03, -0.02, 1.0).normalize() * side.sign();
            let (through, axis) = slide_axis(part.face(side), &up);
            assert!(axis.xy().norm() < 2e-3, "{axis:?}");
            let at_base = through - axis.into_inner() * (through.z / axis.z);
            assert!(at_base.coords.xy().norm() < 0.1, "{at_base}");
        }
    }
}
