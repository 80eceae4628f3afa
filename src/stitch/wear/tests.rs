use super::*;
use crate::geometry::LengthUnit;
use crate::geometry::Vector3;
use crate::simulate::endoscope::{Pocket, PriorError, Scene, SensorModel, Shape, Station, Surface, facing};
use crate::stitch::adaptive::{Rank, survivors};
use nalgebra::{Translation3, UnitQuaternion};

/// Points of all views of a scene in the world's frame, with the sensors.
struct Measured {
    positions: Vec<Point3>,
    sensors: Vec<Point3>,
    seen_from: Vec<u32>,
    badness: Vec<f32>,
}

impl Measured {
    /// Every ninth of the masked points, as nine views see every place about nine times over in the middle.
    fn of(scene: &Scene) -> Self {
        Self::masked(scene, |positions, _| (0..positions.len() as u32).step_by(9).collect())
    }

    /// Merged by d_cal at about two grid distances.
    fn merged(scene: &Scene) -> Self {
        Self::masked(scene, |positions, ranks| survivors(positions, ranks, 20.0, &RunContext::silent()).unwrap())
    }

    /// The masked views from their true poses, thinned.
    fn masked(scene: &Scene, thin: impl Fn(&[Point3], &[Rank]) -> Vec<u32>) -> Self {
        let (mut positions, mut ranks, mut sensors) = (Vec::new(), Vec::new(), Vec::new());
        for (k, station) in scene.stations.iter().enumerate() {
            let view = scene.view(k);
            sensors.push(Point3::from(station.world_from_view.translation.vector));
            for (i, p) in view.positions.iter().enumerate() {
                if view.sigma_i[i] >= 0.002 && view.d_cal[i] <= 150.0 {
                    positions.push(station.world_from_view * p);
                    ranks.push(Rank { score: -f64::from(view.d_cal[i]), view: k as u32, index: i as u32 });
                }
            }
        }
        let kept = thin(&positions, &ranks);
        let seen_from = kept.iter().map(|k| ranks[*k as usize].view).collect();
        let badness = kept.iter().map(|k| -ranks[*k as usize].score as f32).collect();
        Self { positions: kept.iter().map(|k| positions[*k as usize]).collect(), sensors, seen_from, badness }
    }

    fn moved(mut self, motion: &Isometry3) -> Self {
        self.positions.iter_mut().chain(&mut self.sensors).for_each(|p| *p = motion * *p);
        self
    }

    fn compare(&self, old: &Measured) -> Wear {
        compare(&self.new_cloud(), &old.old_cloud(), &RunContext::silent()).unwrap()
    }

    fn new_cloud(&self) -> NewCloud<'_> {
        let Self { positions, sensors, seen_from, badness } = self;
        NewCloud { positions, sensors, seen_from, badness: Some(badness) }
    }

    fn old_cloud(&self) -> OldCloud<'_> {
        OldCloud { positions: &self.positions, badness: Some(&self.badness) }
    }
}

/// A tool: a sphere cap of 3 mm, whose radius fixes all shifts, seen in nine patches. The noise's seed is the scene's.
fn tool(pockets: Vec<Pocket>, sensor: SensorModel, seed: u64) -> Scene {
    let mut surface = Surface::unworn(Shape::Sphere { radius: RADIUS });
    surface.pockets = pockets;
    let mut scene = Scene::new("tool", LengthUnit::Um, sensor, surface, seed);
    for k in 0..9 {
        let (x, y) = (0.4 * f64::from(k % 3 - 1), 0.4 * f64::from(k / 3 - 1));
        let normal = Vector3::new(f64::sin(x), f64::sin(y), 1.0).normalize();
        let pose = facing(&Point3::from(normal * RADIUS), &normal, 10_000.0, &Vector3::x(), 0.0);
        scene.stations.push(Station { world_from_view: pose, prior: pose, is_wrong: false });
    }
    scene
}

const RADIUS: f64 = 3000.0;
/// The paper's sensor without its smooth error: random errors only.
fn noisy() -> SensorModel {
    SensorModel { bias: 0.0, ..SensorModel::paper() }
}

fn at(x: f64, y: f64) -> Point3 {
    Point3::from(Vector3::new(x, y, (RADIUS * RADIUS - x * x - y * y).sqrt()))
}

fn pockets() -> Vec<Pocket> {
    let pocket = |x, y, depth| Pocket { centre: at(x, y), radius: 250.0, flat: 0.7, depth };
    vec![pocket(-900.0, 300.0, 20.0), pocket(300.0, 800.0, 10.0), pocket(700.0, -700.0, 5.0)]
}

fn nudge() -> Isometry3 {
    let turn = UnitQuaternion::new(Vector3::new(0.0005, -0.0004, 0.0005));
    Isometry3::from_parts(Translation3::new(4.0, -3.0, 15.0), turn)
}

/// Pockets of 20, 10 and 5 µm, each found where it is, with its depth and area, though the cloud was moved; nothing else is told.
#[test]
fn worn_pockets_are_found_with_their_depth_and_nothing_else_is() {
    let old = Measured::of(&tool(Vec::new(), noisy(), 1));
    let new = Measured::of(&tool(pockets(), noisy(), 2)).moved(&nudge());
    let wear = new.compare(&old);
    assert_eq!(wear.regions.len(), 3, "{:?}", wear.regions.iter().map(|r| (r.mean, r.area)).collect::<Vec<_>>());
    for pocket in pockets() {
        let region = wear.regions.iter().min_by(|a, b| {
            let off = |r: &&WornRegion| (r.centre - pocket.centre).norm();
            off(a).total_cmp(&off(b))
        });
        let region = region.unwrap();
        // The sphere leaves turns free: what of the nudge is a turn about its middle stays, up to 5 µm and 0.0008 at 3 mm. A mean place is one
        // of points, and these lie denser where more views see: r² / 4 times a slope of 1 / mm is 16 µm. Rims told here and there by tens of
        // µm over dozens of places leave some more.
        assert!((region.centre - pocket.centre).norm() < 45.0, "{pocket:?} {:?}", region.centre);
        // In the middle the floor is flat over more than a cylinder's radius: noise alone, four standard uncertainties of the largest
        // of some ten independent places (1.5 on top).
        assert!(
            (region.extreme + pocket.depth).abs() < 5.5 * region.extreme_u,
            "{pocket:?} {} {}",
            region.extreme,
            region.extreme_u
        );
        // Half the depth is at 0.85 of the radius, and the mean within is 0.939 of the depth. Three standard uncertainties.
        let area = std::f64::consts::PI * (0.85 * 250.0f64).powi(2);
        assert!((region.area - area).abs() < 3.0 * region.area_u, "{pocket:?} {} {}", region.area, region.area_u);
        let mean = -0.939 * pocket.depth;
        assert!((region.mean - mean).abs() < 3.0 * region.mean_u, "{pocket:?} {} {}", region.mean, region.mean_u);
        assert!(region.significance > wear.least_significance);
    }
    // Away from the pockets the differences are what their uncertainties say.
    let mut scores = Vec::new();
    for (k, p) in new.positions.iter().enumerate().step_by(37) {
        let place = wear.old_from_new * p;
        if wear.difference[k].is_finite() && pockets().iter().all(|q| (place - q.centre).norm() > 250.0 + wear.radius) {
            scores.push(f64::from(wear.difference[k] / wear.difference_u[k]));
        }
    }
    let rms = (scores.iter().map(|s| s * s).sum::<f64>() / scores.len() as f64).sqrt();
    // Some 200 independent cylinders tell that to 5 %, three times that; smooth errors of which there are none here are told as a little.
    assert!((0.8..1.15).contains(&rms), "{rms}");
}

fn no_region(old: &Measured, new: Measured) {
    let wear = new.moved(&nudge()).compare(old);
    let told = |r: &WornRegion| (r.mean, r.extreme, r.area, r.significance, r.centre);
    assert!(wear.regions.is_empty(), "{:?}", wear.regions.iter().map(told).collect::<Vec<_>>());
}

#[test]
fn an_unworn_pair_gives_no_region() {
    for seed in [3, 13, 23] {
        let [old, new] = [seed, seed + 1].map(|seed| Measured::of(&tool(Vec::new(), noisy(), seed)));
        no_region(&old, new);
    }
}

#[test]
fn an_unworn_pair_of_merged_clouds_gives_no_region() {
    let [old, new] = [3, 4].map(|seed| Measured::merged(&tool(Vec::new(), noisy(), seed)));
    no_region(&old, new);
}

/// Another seed is another calibration: smooth errors of the two do not cancel.
#[test]
fn smooth_errors_of_two_calibrations_are_no_wear() {
    for seed in [3, 13] {
        let [old, new] = [seed, seed + 1].map(|seed| Measured::merged(&tool(Vec::new(), SensorModel::paper(), seed)));
        no_region(&old, new);
    }
}

/// Two views only: few places, of which those at the rim are the worst.
#[test]
fn smooth_errors_at_the_rim_of_a_small_cloud_are_no_wear() {
    let exact = PriorError { shift: 0.0, turn_rad: 0.0 };
    for seed in [1, 3, 5] {
        let [old, new] = [seed, seed + 1].map(|seed| Measured::merged(&Scene::cylinder(exact, seed)));
        no_region(&old, new);
    }
}

/// With smooth errors of some µm in both, the deep pocket is still told, with its depth within its uncertainty.
#[test]
fn a_deep_pocket_is_told_in_spite_of_smooth_errors() {
    let old = Measured::merged(&tool(Vec::new(), SensorModel::paper(), 3));
    let deep = Pocket { depth: 40.0, ..pockets()[0] };
    let wear = Measured::merged(&tool(vec![deep], SensorModel::paper(), 4)).compare(&old);
    let region = wear.regions.iter().find(|r| (r.centre - deep.centre).norm() < 60.0).expect("the pocket");
    assert!((region.extreme + deep.depth).abs() < 4.0 * region.extreme_u, "{} {}", region.extreme, region.extreme_u);
}

#[test]
fn material_that_came_on_has_the_other_sign() {
    let old = Measured::of(&tool(Vec::new(), noisy(), 5));
    let burr = Pocket { centre: at(0.0, 0.0), radius: 250.0, flat: 0.7, depth: -15.0 };
    let wear = Measured::of(&tool(vec![burr], noisy(), 6)).compare(&old);
    assert_eq!(wear.regions.len(), 1);
    // Half of the burr's disc is slope.
    assert!(wear.regions[0].mean > 7.0, "{}", wear.regions[0].mean);
}

/// What the old cloud did not see is not measured, and never told as unworn.
#[test]
fn places_without_a_counterpart_are_not_measured() {
    let mut old = Measured::of(&tool(Vec::new(), noisy(), 7));
    old.badness = old.positions.iter().zip(&old.badness).filter(|(p, _)| p.x < 0.0).map(|(_, b)| *b).collect();
    old.positions.retain(|p| p.x < 0.0);
    let new = Measured::of(&tool(pockets(), noisy(), 8));
    let wear = new.compare(&old);
    assert_eq!(wear.not_measured, wear.difference.iter().filter(|d| d.is_nan()).count());
    for (k, p) in new.positions.iter().enumerate() {
        assert_eq!(wear.difference[k].is_nan(), wear.difference_u[k].is_nan());
        assert!(p.x < wear.radius || wear.difference[k].is_nan(), "{p}");
    }
    assert_eq!(wear.regions.len(), 1, "the pocket of 20 µm alone lies where both saw");
}

#[test]
fn clouds_apart_and_clouds_of_nothing_are_refused() {
    let scene = tool(Vec::new(), noisy(), 9);
    let old = Measured::of(&scene);
    let far = Measured::of(&scene).moved(&Isometry3::translation(0.0, 0.0, 6000.0));
    let told = |old: &OldCloud| compare(&far.new_cloud(), old, &RunContext::silent());
    assert!(matches!(told(&old.old_cloud()), Err(WearError::Apart { .. })));
    let few = OldCloud { positions: &old.positions[..4], badness: None };
    assert!(matches!(told(&few), Err(WearError::TooFew { .. })));
}

#[test]
fn threads_do_not_change_a_bit() {
    let old = Measured::of(&tool(Vec::new(), noisy(), 1));
    let new = Measured::of(&tool(pockets(), noisy(), 2));
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let bits = |wear: &Wear| wear.difference.iter().map(|d| d.to_bits()).collect::<Vec<u32>>();
    assert_eq!(bits(&one.install(|| new.compare(&old))), bits(&new.compare(&old)));
}

#[test]
fn scenes_of_the_simulator_tell_their_own_wear() {
    let prior = PriorError { shift: 0.0, turn_rad: 0.0 };
    let mut scene = Scene::plane(prior, 1);
    scene.surface.pockets = vec![Pocket { centre: Point3::origin(), radius: 200.0, flat: 0.5, depth: 12.0 }];
    assert_eq!(scene.surface.raised(&Point3::new(50.0, 0.0, 0.0)), -12.0);
}
