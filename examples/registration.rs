//! How well 100 simulated views of the demo part find their places: `cargo run --release --example registration -- [SEED]...` (1, 2 and 3 when none is
//! named). Poses given are off by 0.5 mm and 1 degree, and two views of another part are among them. Views are masked as `examples/endoscope.rs` masks them.

use shapeline::geometry::{Isometry3, Point3, Vector3};
use shapeline::run::RunContext;
use shapeline::simulate::endoscope::{PriorError, Scene, SimulatedView};
use shapeline::stitch::View;
use shapeline::stitch::register::{Options, Prior, Registration, register};
use std::collections::{BTreeMap, BTreeSet};
use std::error::Error;
use std::io::Write;

/// Priors off by a length are off by this part of it along each axis, one standard deviation.
const OF_AXIS: f64 = 0.577;

fn main() -> Result<(), Box<dyn Error>> {
    let seeds: Result<Vec<u64>, _> = std::env::args().skip(1).map(|seed| seed.parse()).collect();
    let seeds = Some(seeds?).filter(|seeds| !seeds.is_empty()).unwrap_or_else(|| vec![1, 2, 3]);
    for seed in seeds {
        let off = PriorError { shift: 0.5, turn_rad: 1f64.to_radians() };
        let scene = Scene::part(100, 2, off, seed);
        let views: Vec<View> = scene.views().iter().enumerate().map(|(k, view)| masked(k, view)).collect();
        let prior = |world_from_view: Isometry3| Prior {
            world_from_view,
            translation_sigma: OF_AXIS * off.shift,
            rotation_sigma_rad: OF_AXIS * off.turn_rad,
        };
        let priors: Vec<Option<Prior>> = scene.stations.iter().map(|s| Some(prior(s.prior))).collect();
        let found = register(&views, &priors, &Options::default(), &RunContext::silent())?;
        tell(seed, &scene, &views, &found)?;
    }
    Ok(())
}

/// Points of a sigma_I of at least 0.002 and no further than 3.6 mm from a calibrated place.
fn masked(number: usize, view: &SimulatedView) -> View {
    let kept = (0..view.positions.len()).filter(|k| view.sigma_i[*k] >= 0.002 && view.d_cal[*k] <= 3.6);
    View {
        name: format!("view_{number:03}"),
        positions: kept.map(|k| view.positions[k]).collect(),
        columns: BTreeMap::new(),
        pixels: None,
        sensor: Point3::origin(),
    }
}

/// By how much the place half way between two views is off in the second one, along its line of sight and across.
fn off(scene: &Scene, views: &[View], pair: [usize; 2], pose: impl Fn(usize) -> Isometry3) -> [f64; 2] {
    let truth = |k: usize| scene.stations[k].world_from_view;
    let middle = |k: usize| {
        let sum: Vector3 = views[k].positions.iter().map(|p| p.coords).sum();
        truth(k) * Point3::from(sum / views[k].positions.len() as f64)
    };
    let [a, b] = pair;
    let place = truth(a).inverse() * nalgebra::center(&middle(a), &middle(b));
    let error = pose(b).inverse() * (pose(a) * place) - truth(b).inverse() * (truth(a) * place);
    [error.z.abs(), error.x.hypot(error.y)]
}

fn tell(seed: u64, scene: &Scene, views: &[View], found: &Registration) -> std::io::Result<()> {
    let mut out = std::io::stdout();
    let placed = |k: usize| found.views[k].placed();
    let is_wrong = |k: usize| scene.stations[k].is_wrong;
    let taken = (0..views.len()).filter(|k| is_wrong(*k) && placed(*k).is_some()).count();
    let right = (0..views.len()).filter(|k| !is_wrong(*k) && placed(*k).is_some()).count();
    let weak: BTreeSet<usize> = found.weak.iter().map(|weak| weak.view).collect();
    writeln!(
        out,
        "seed {seed}: {right} of 100 views placed, {taken} of 2 wrong ones; noise of a point {:.3} mm",
        found.noise
    )?;
    let used: Vec<[usize; 2]> =
        found.pairs.iter().filter(|p| p.is_used() && !is_wrong(p.a) && !is_wrong(p.b)).map(|p| [p.a, p.b]).collect();
    let held: Vec<[usize; 2]> = used.iter().filter(|pair| pair.iter().all(|k| !weak.contains(k))).copied().collect();
    let after = |k: usize| placed(k).map_or_else(Isometry3::identity, |placed| placed.world_from_view);
    let before = |k: usize| scene.stations[k].prior;
    for (what, pairs) in [("all", &used), ("of views without weak motions", &held)] {
        let of = |pose: &dyn Fn(usize) -> Isometry3, axis: usize| {
            let mut errors: Vec<f64> = pairs.iter().map(|pair| off(scene, views, *pair, pose)[axis]).collect();
            errors.sort_by(f64::total_cmp);
            let at = |share: f64| {
                errors.get((errors.len().saturating_sub(1) as f64 * share) as usize).copied().unwrap_or(f64::NAN)
            };
            format!("{:.3} / {:.3}", at(0.5), at(0.9))
        };
        writeln!(
            out,
            "  {} neighbours, {what}: along the line of sight {} (given {}), across {} (given {}) mm, median / 90 %",
            pairs.len(),
            of(&after, 0),
            of(&before, 0),
            of(&after, 1),
            of(&before, 1)
        )?;
    }
    writeln!(out, "  {} views with motions that their neighbours do not hold to twice the noise of a point", weak.len())
}
