//! Global search of (x, y, z, turn about z) by height maps: truncated distance of the face's visible samples to the data.
//!
//! The samples ask the data, not the other way round, so outliers beside the part cost nothing; data that is missing costs
//! the same in every pose.

use super::height_map::HeightMap;
use super::sampling::spread;
use super::template::Template;
use crate::geometry::{Isometry3, Point3};
use crate::run::{Cancelled, RunContext};
use nalgebra::{Translation3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Turns tried.
const TURNS: usize = 72;
/// Offsets tried each way, in x and y.
const OFFSETS: i32 = 3;

/// A place of a template over the data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Mode {
    /// Which template.
    pub template: usize,
    /// x, y, z in mm and the turn about z in rad: work from template.
    pub place: [f64; 4],
    /// Mean truncated squared distance of visible samples to the data, mm².
    pub cost: f64,
}

impl Mode {
    /// The pose it stands for, work from template.
    pub fn work_from_template(&self) -> Isometry3 {
        let [x, y, z, turn] = self.place;
        Isometry3::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn))
    }

    /// The same, as the motion from work to CAD.
    pub fn cad_from_work(&self, templates: &[Template]) -> Isometry3 {
        (self.work_from_template() * templates[self.template].template_from_cad).inverse()
    }
}

fn mean_cost(map: &HeightMap, samples: &[Point3], place: &[f64; 4], width_mm: f64) -> f64 {
    let (sin, cos) = place[3].sin_cos();
    let most = width_mm * width_mm;
    let sum: f64 = samples
        .iter()
        .map(|p| {
            let (x, y) = (cos * p.x - sin * p.y + place[0], sin * p.x + cos * p.y + place[1]);
            map.distance_sq(x, y, p.z + place[2]).min(most)
        })
        .sum();
    sum / samples.len().max(1) as f64
}

/// Searches all turns of one template; the local optima over the turn, each refined.
pub(super) fn search(
    map: &HeightMap,
    templates: &[Template],
    which: usize,
    diagonal_mm: f64,
    run: &RunContext,
) -> Result<Vec<Mode>, Cancelled> {
    let template = &templates[which];
    let thinned = |n: usize| -> Vec<Point3> {
        spread(template.samples.len(), n).into_iter().map(|k| template.samples[k as usize]).collect()
    };
    let (few, many) = (thinned(140), thinned(500));
    if few.is_empty() {
        return Ok(Vec::new());
    }
    let middle = template.sample_middle();
    let data = data_middle(map, &few, &middle);
    let step = 0.045 * diagonal_mm;
    let coarse: Vec<Mode> = (0..TURNS)
        .into_par_iter()
        .map(|k| {
            run.check()?;
            let turn = TAU * k as f64 / TURNS as f64;
            let turned = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn) * middle;
            let mut best = Mode { template: which, place: [0.0; 4], cost: f64::INFINITY };
            for i in -OFFSETS..=OFFSETS {
                for j in -OFFSETS..=OFFSETS {
                    let (x, y) = (data.x - turned.x + f64::from(i) * step, data.y - turned.y + f64::from(j) * step);
                    let place = [x, y, data.z, turn];
                    let cost = mean_cost(map, &few, &place, step);
                    if cost < best.cost {
                        best = Mode { place, cost, ..best };
                    }
                }
            }
            Ok(descend(map, &few, best, step, [0.5 * step, 0.5 * step, 3.0, 0.03], 1))
        })
        .collect::<Result<_, Cancelled>>()?;
    let lowest = (0..TURNS).filter(|&k| {
        coarse[k].cost <= coarse[(k + 1) % TURNS].cost && coarse[k].cost <= coarse[(k + TURNS - 1) % TURNS].cost
    });
    Ok(lowest.map(|k| refine(map, &many, coarse[k])).collect())
}

/// Refines a mode with steps of a few mm and a few degrees.
pub(super) fn refine(map: &HeightMap, samples: &[Point3], start: Mode) -> Mode {
    descend(map, samples, start, 6.0, [4.0, 4.0, 2.0, 0.04], 3)
}

/// Pattern search: halves its steps `halvings` times.
fn descend(map: &HeightMap, samples: &[Point3], start: Mode, width_mm: f64, steps: [f64; 4], halvings: usize) -> Mode {
    let mut best = Mode { cost: mean_cost(map, samples, &start.place, width_mm), ..start };
    let mut steps = steps;
    for _ in 0..=halvings {
        for _round in 0..6 {
            let before = best.cost;
            for axis in 0..4 {
                for sign in [-1.0, 1.0] {
                    let mut place = best.place;
                    place[axis] += sign * steps[axis];
                    let cost = mean_cost(map, samples, &place, width_mm);
                    if cost < best.cost {
                        best = Mode { place, cost, ..best };
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

/// Where the template's middle goes at first: mean of the filled cells in x and y, and the height that makes the medians equal.
fn data_middle(map: &HeightMap, samples: &[Point3], _middle: &Point3) -> Point3 {
    let median = |mut values: Vec<f64>| {
        let half = values.len() / 2;
        *values.select_nth_unstable_by(half, f64::total_cmp).1
    };
    let places: Vec<Point3> = map.filled.iter().map(|&c| map.place(c)).collect();
    let sum = places.iter().fold(Vector3::zeros(), |s, p| s + p.coords) / places.len() as f64;
    let heights = median(places.iter().map(|p| p.z).collect());
    let own = median(samples.iter().map(|p| p.z).collect());
    Point3::new(sum.x, sum.y, heights - own)
}
