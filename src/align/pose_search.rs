//! Global search of position and turn about z by height maps: truncated distance of the face's visible samples to the data.
//!
//! The samples ask the data, not the other way round, so outliers beside the part cost nothing; data that is missing costs
//! the same in every pose.

use super::height_map::HeightMap;
use super::sampling::spread;
use super::template::Template;
use crate::fit::robust::{middle_value, tukey_weight};
use crate::geometry::{Isometry3, Point3};
use crate::run::{Cancelled, RunContext};
use nalgebra::{Matrix3, Translation3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Turns tried.
const TURNS: usize = 72;
/// Offsets tried each way, in x and y.
const OFFSETS: i32 = 2;
/// Most tilt in one round of levelling.
const MOST_TILT_RAD: f64 = 0.06;
/// Modes refined, of all templates together.
const REFINED: usize = 48;

/// A place of a template over the data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Mode {
    /// Which template.
    pub template: usize,
    /// The pose.
    pub work_from_template: Isometry3,
    /// Mean truncated squared distance of visible samples to the data, mm².
    pub cost: f64,
}

impl Mode {
    /// The pose as the motion from work to CAD.
    pub fn cad_from_work(&self, templates: &[Template]) -> Isometry3 {
        (self.work_from_template * templates[self.template].template_from_cad).inverse()
    }
}

fn mean_cost(map: &HeightMap, samples: &[Point3], pose: &Isometry3, width_mm: f64) -> f64 {
    let most = width_mm * width_mm;
    let turn = pose.rotation.to_rotation_matrix();
    let shift = pose.translation.vector;
    let sum: f64 = samples
        .iter()
        .map(|p| {
            let q = turn * p + shift;
            map.distance_sq(q.x, q.y, q.z).min(most)
        })
        .sum();
    sum / samples.len().max(1) as f64
}

/// What data beside the outline costs, as a share of the most a sample may cost: an edge-on view fits anywhere.
fn uncovered(map: &HeightMap, template: &Template) -> f64 {
    (1.0 - template.footprint_mm2 / map.area_mm2()).max(0.0)
}

fn thinned(template: &Template, wanted: usize) -> Vec<Point3> {
    spread(template.samples.len(), wanted).into_iter().map(|k| template.samples[k as usize]).collect()
}

/// Searches all turns of one template; the local optima over the turn.
pub(super) fn search(
    map: &HeightMap,
    templates: &[Template],
    which: usize,
    diagonal_mm: f64,
    run: &RunContext,
) -> Result<Vec<Mode>, Cancelled> {
    let template = &templates[which];
    let few = thinned(template, 100);
    if few.is_empty() {
        return Ok(Vec::new());
    }
    let middle = template.sample_middle();
    let data = data_middle(map, &few);
    let step = 0.06 * diagonal_mm;
    let coarse: Vec<Mode> = (0..TURNS)
        .into_par_iter()
        .map(|k| {
            run.check()?;
            let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), TAU * k as f64 / TURNS as f64);
            let turned = turn * middle;
            let mut best = Mode { template: which, work_from_template: Isometry3::identity(), cost: f64::INFINITY };
            for i in -OFFSETS..=OFFSETS {
                for j in -OFFSETS..=OFFSETS {
                    let (x, y) = (data.x - turned.x + f64::from(i) * step, data.y - turned.y + f64::from(j) * step);
                    let pose = Isometry3::from_parts(Translation3::new(x, y, data.z), turn);
                    let cost = mean_cost(map, &few, &pose, step);
                    if cost < best.cost {
                        best = Mode { work_from_template: pose, cost, ..best };
                    }
                }
            }
            Ok(descend(map, &few, &middle, best, step, [0.5 * step, 0.03], 1))
        })
        .collect::<Result<_, Cancelled>>()?;
    let lowest = (0..TURNS).filter(|&k| {
        coarse[k].cost <= coarse[(k + 1) % TURNS].cost && coarse[k].cost <= coarse[(k + TURNS - 1) % TURNS].cost
    });
    Ok(lowest.map(|k| coarse[k]).collect())
}

/// Refines the best of the modes of all templates: levelled on the data, then moved by mm and degrees, twice.
pub(super) fn refine(
    map: &HeightMap,
    templates: &[Template],
    modes: &mut Vec<Mode>,
    run: &RunContext,
) -> Result<(), Cancelled> {
    // A quick look at all of them first: levelled, with few samples.
    *modes = modes
        .par_iter()
        .map(|mode| {
            run.check()?;
            let template = &templates[mode.template];
            let few = thinned(template, 120);
            let pose = levelled(map, &few, &mode.work_from_template, 10.0);
            let levelled = Mode { work_from_template: pose, cost: mean_cost(map, &few, &pose, 8.0), ..*mode };
            let as_it_was = Mode { cost: mean_cost(map, &few, &mode.work_from_template, 8.0), ..*mode };
            let better = if levelled.cost < as_it_was.cost { levelled } else { as_it_was };
            Ok(Mode { cost: better.cost + 64.0 * uncovered(map, template), ..better })
        })
        .collect::<Result<_, _>>()?;
    modes.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    modes.truncate(REFINED);
    *modes = modes
        .par_iter()
        .map(|mode| {
            run.check()?;
            let template = &templates[mode.template];
            let samples = thinned(template, 350);
            let middle = template.sample_middle();
            let mut mode = *mode;
            for (width_mm, halvings) in [(10.0, 1), (5.0, 3)] {
                mode = descend(map, &samples, &middle, mode, width_mm, [0.4 * width_mm, 0.03], halvings);
                let pose = levelled(map, &samples, &mode.work_from_template, width_mm);
                let cost = mean_cost(map, &samples, &pose, width_mm);
                if cost < mode.cost {
                    mode = Mode { work_from_template: pose, cost, ..mode };
                }
            }
            mode.cost = mean_cost(map, &samples, &mode.work_from_template, 5.0) + 25.0 * uncovered(map, template);
            Ok(mode)
        })
        .collect::<Result<_, _>>()?;
    Ok(())
}

/// Pattern search over x, y, z and the turn about z through `middle`; halves its steps (mm, rad) `halvings` times.
fn descend(
    map: &HeightMap,
    samples: &[Point3],
    middle: &Point3,
    start: Mode,
    width_mm: f64,
    steps: [f64; 2],
    halvings: usize,
) -> Mode {
    let mut best = Mode { cost: mean_cost(map, samples, &start.work_from_template, width_mm), ..start };
    let mut steps = steps;
    for _ in 0..=halvings {
        for _round in 0..6 {
            let before = best.cost;
            for axis in 0..4 {
                for sign in [-1.0, 1.0] {
                    let pose = nudged(&best.work_from_template, middle, axis, sign * steps[usize::from(axis == 3)]);
                    let cost = mean_cost(map, samples, &pose, width_mm);
                    if cost < best.cost {
                        best = Mode { work_from_template: pose, cost, ..best };
                    }
                }
            }
            if best.cost >= before {
                break;
            }
        }
        steps = steps.map(|s| 0.5 * s);
    }
    best
}

/// A pose moved along an axis of the work frame, or (axis 3) turned about z through the middle of the samples.
fn nudged(pose: &Isometry3, middle: &Point3, axis: usize, by: f64) -> Isometry3 {
    if axis < 3 {
        let mut moved = *pose;
        moved.translation.vector[axis] += by;
        return moved;
    }
    let centre = (pose * middle).coords;
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), by);
    Translation3::from(centre) * turn * Translation3::from(-centre) * pose
}

/// Tilts and lifts a pose so that the samples meet the heights below and above them: the part is never quite as flat, nor the
/// belt as level, as the template assumes. Tukey-weighted least squares of `a + b x + c y`, three rounds.
fn levelled(map: &HeightMap, samples: &[Point3], pose: &Isometry3, width_mm: f64) -> Isometry3 {
    let mut pose = *pose;
    for round in 0..3 {
        let width = width_mm * [2.0, 1.5, 1.0][round];
        let centre = samples.iter().fold(Vector3::zeros(), |s, p| s + (pose * p).coords) / samples.len().max(1) as f64;
        let (mut normal, mut right, mut weight) = (Matrix3::zeros(), Vector3::zeros(), 0.0);
        for p in samples {
            let q = pose * p;
            let Some(off) = map.height_above(q.x, q.y).map(|h| h - q.z) else { continue };
            let w = tukey_weight(off, width);
            let row = Vector3::new(1.0, q.x - centre.x, q.y - centre.y);
            normal += row * row.transpose() * w;
            right += row * (off * w);
            weight += w;
        }
        // A little stiffness against tilts that few samples ask for.
        let stiff = 0.02 * weight.max(1e-9);
        let lever = samples.iter().map(|p| p.coords.xy().norm()).fold(1.0, f64::max);
        normal += Matrix3::from_diagonal(&Vector3::new(1e-9 * stiff, stiff * lever * lever, stiff * lever * lever));
        let Some(plane) = normal.cholesky().map(|c| c.solve(&right)) else { return pose };
        let slope = Vector3::new(plane[2], -plane[1], 0.0);
        let tilt = UnitQuaternion::from_scaled_axis(slope * (MOST_TILT_RAD / slope.norm().max(MOST_TILT_RAD)));
        let lift = Translation3::new(0.0, 0.0, plane[0]);
        pose = lift * Translation3::from(centre) * tilt * Translation3::from(-centre) * pose;
    }
    pose
}

/// Where the template's middle goes at first: mean of the filled cells in x and y, and the height that makes the medians equal.
fn data_middle(map: &HeightMap, samples: &[Point3]) -> Point3 {
    let middle_of = |mut values: Vec<f64>| middle_value(&mut values).unwrap_or(0.0);
    let places: Vec<Point3> = map.filled.iter().map(|&c| map.place(c)).collect();
    let sum = places.iter().fold(Vector3::zeros(), |s, p| s + p.coords) / places.len() as f64;
    let heights = middle_of(places.iter().map(|p| p.z).collect());
    let own = middle_of(samples.iter().map(|p| p.z).collect());
    Point3::new(sum.x, sum.y, heights - own)
}
