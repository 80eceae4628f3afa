//! From many rough poses to a few fine ones: successive halving, partners of near-symmetry, a sweep of turns.

use super::icp::{Registered, Settings, distances, register};
use super::pose_search::Mode;
use super::rim::{DenseIndex, RimLock};
use super::template::Template;
use crate::geometry::{CadFromScan, Isometry3, Point3, UnitVector3, Vector3};
use crate::part::{FaceSample, Part};
use crate::plan::Side;
use crate::run::{Cancelled, RunContext};
use nalgebra::{Matrix3, SymmetricEigen, Translation3, UnitQuaternion};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Two poses are distinct from here on, measured at the part's centre.
pub(super) const DISTINCT_RAD: f64 = 5.0 * PI / 180.0;
/// Two poses are distinct from here on, measured at the part's centre.
pub(super) const DISTINCT_MM: f64 = 5.0;
/// Motions less certain than this (see [`Registered::weakest_mm`]) need the rims.
pub(super) const WEAK_MM: f64 = 0.05;
/// Distances beyond this are outliers when poses are ranked, mm.
const RANK_LIMIT_MM: f64 = 3.0;
/// Points used in the three stages.
const STAGE_POINTS: [usize; 2] = [250, 600];
/// Poses kept after each stage.
const STAGE_KEPT: [usize; 2] = [10, 7];

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

/// The best modes that differ from each other, and their partners: half a turn on the belt, and turned over.
pub(super) fn starts(part: &Part, templates: &[Template], modes: &mut [Mode]) -> Vec<Candidate> {
    modes.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let mut chosen: Vec<Candidate> = Vec::new();
    for mode in modes.iter() {
        let candidate = Candidate::new(mode.cad_from_work(templates), templates[mode.template].side);
        if add_if_new(part, &mut chosen, candidate, 10f64.to_radians(), 10.0) && chosen.len() == 16 {
            break;
        }
    }
    for best in chosen.clone().iter().take(3) {
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
    (middle, SymmetricEigen::new(spread).eigenvectors)
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
        let (steps, width_mm) = [(7, 10.0), (14, 4.0)][stage];
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
    let settings = Settings { steps, width_mm, least_scale_mm: 0.02, stop_mm: 1e-3, locked_axis };
    let mut registered = register(face, points, &candidate.cad_from_work, &settings, None, run)?;
    if let Some(index) = rims
        && registered.weakest_mm > WEAK_MM
    {
        let up = registered.cad_from_work.rotation * Vector3::z();
        let rim = RimLock::new(face, &up, index);
        let settings = Settings { steps: 10, width_mm: registered.width_mm, ..settings };
        registered = register(face, points, &registered.cad_from_work, &settings, Some(&rim), run)?;
    }
    let distances = distances(face, points, &registered.cad_from_work, RANK_LIMIT_MM);
    let cost = distances.iter().map(|d| d * d).sum::<f64>() / distances.len().max(1) as f64;
    Ok(Candidate { cad_from_work: registered.cad_from_work, cost, registered: Some(registered), ..candidate })
}

/// Poses turned about the view axis from a given one: the best ones elsewhere, and the nearest that count as distinct.
pub(super) fn turned(part: &Part, template: &Template, points: &[Point3], from: &Candidate) -> Vec<Candidate> {
    const STEPS: usize = 240;
    let middle = from.cad_from_work.inverse() * (template.template_from_cad.inverse() * template.sample_middle());
    let pose = |angle: f64| {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
        from.cad_from_work * (Translation3::from(middle.coords) * turn * Translation3::from(-middle.coords))
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
    let mut minima: Vec<usize> = (apart..=STEPS - apart)
        .filter(|&k| cost[k] <= cost[(k + 1) % STEPS] && cost[k] < cost[k - 1] || k == apart || k == STEPS - apart)
        .collect();
    minima.sort_by(|&a, &b| cost[a].total_cmp(&cost[b]));
    minima.truncate(4);
    let nearest = [1.02 * DISTINCT_RAD, -1.02 * DISTINCT_RAD];
    let free = minima.iter().map(|&k| Candidate::new(pose(angle(k)), from.side));
    let locked = minima.iter().take(2).map(|&k| angle(k)).chain(nearest);
    let held = locked.map(|a| Candidate { locked: true, ..Candidate::new(pose(a), from.side) });
    let all: Vec<Candidate> = free.chain(held).collect();
    debug_assert!(all.iter().all(|c| part.face(c.side).side == from.side));
    all
}
