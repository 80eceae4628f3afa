//! Views of analytic parts with known poses, and what registration makes of them.

use super::{Gauge, Options, Prior, RegisterError, Registration, ViewOutcome, register};
use crate::geometry::{Isometry3, Point3, Vector3};
use crate::run::RunContext;
use crate::stitch::View;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::collections::BTreeMap;

/// A sheet that is a height over x and y, with holes.
pub(super) struct Part {
    height: fn(f64, f64) -> f64,
    hole: fn(f64, f64) -> bool,
}

fn no_hole(_: f64, _: f64) -> bool {
    false
}

impl Part {
    /// Drawn 6 deep, with beads 2 high and round holes.
    pub(super) fn formed() -> Self {
        let height = |x: f64, y: f64| {
            // Beads at no steady distance, so that no other place looks alike.
            let beads = (x / 3.0 + 0.7 * (x / 11.0).sin()).sin() * (y / 3.4 + 0.6 * (y / 13.0).cos()).sin();
            6.0 * (x / 25.0).sin() * (y / 30.0).cos() + 2.0 * beads
        };
        let hole = |x: f64, y: f64| (x - 17.0 * (x / 17.0).round()).hypot(y - 19.0 * (y / 19.0).round()) < 2.0;
        Self { height, hole }
    }

    /// A part of the same kind with another shape.
    pub(super) fn other() -> Self {
        let height =
            |x: f64, y: f64| 5.0 * (x / 21.0 + 1.0).cos() + 0.8 * (x / 4.4 + 0.7).sin() + 0.6 * (y / 3.1).sin();
        Self { height, hole: no_hole }
    }

    pub(super) fn flat() -> Self {
        Self { height: |_, _| 0.0, hole: no_hole }
    }

    /// Along y, of radius 30.
    pub(super) fn cylinder() -> Self {
        Self { height: |x, _| (30.0_f64.powi(2) - x * x).sqrt() - 30.0, hole: no_hole }
    }

    /// Flat but for one dent.
    pub(super) fn dented() -> Self {
        Self { height: |x, y| -1.5 * (-(x - 2.0).powi(2) / 8.0 - (y + 3.0).powi(2) / 8.0).exp(), hole: no_hole }
    }

    pub(super) fn height(&self, x: f64, y: f64) -> f64 {
        (self.height)(x, y)
    }

    pub(super) fn normal(&self, x: f64, y: f64) -> Vector3 {
        let d = 1e-5;
        let slope = |dx: f64, dy: f64| (self.height(x + dx, y + dy) - self.height(x - dx, y - dy)) / (2.0 * d);
        Vector3::new(-slope(d, 0.0), -slope(0.0, d), 1.0).normalize()
    }
}

/// A view and where it truly lies.
pub(super) struct Look {
    pub view: View,
    pub truth: Isometry3,
}

/// A square window of a part about a place, seen from 150 above by a camera that is turned by up to a few degrees and stands in any turn about its own axis;
/// points in a grid of a pitch, each off by noise along each axis.
pub(super) fn look(part: &Part, name: &str, [x, y]: [f64; 2], size: f64, pitch: f64, noise: f64, seed: u64) -> Look {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut even = |most: f64| most * (2.0 * rng.random::<f64>() - 1.0);
    let turn = Vector3::new(even(0.05), even(0.05), even(0.4));
    let truth = Isometry3::new(Vector3::new(x, y, 150.0), turn);
    let (shift_u, shift_v) = (even(pitch), even(pitch));
    let steps = (size / pitch) as i32;
    let mut positions = Vec::new();
    for k in 0..steps {
        for l in 0..steps {
            let u = (f64::from(k) - 0.5 * f64::from(steps)) * pitch + shift_u;
            let v = (f64::from(l) - 0.5 * f64::from(steps)) * pitch + shift_v;
            let (sin, cos) = turn.z.sin_cos();
            let (px, py) = (x + cos * u - sin * v, y + sin * u + cos * v);
            let off = Vector3::from_fn(|_, _| noise * Distribution::<f64>::sample(&StandardNormal, &mut rng));
            if !(part.hole)(px, py) {
                positions.push(truth.inverse() * (Point3::new(px, py, part.height(px, py)) + off));
            }
        }
    }
    let view =
        View { name: name.to_owned(), positions, columns: BTreeMap::new(), pixels: None, sensor: Point3::origin() };
    Look { view, truth }
}

/// A prior off by that much in each of six motions (standard deviations), about the view's middle.
pub(super) fn prior(look: &Look, shift: f64, turn: f64, rng: &mut ChaCha8Rng) -> Prior {
    let mut normal = |sigma: f64| Vector3::from_fn(|_, _| sigma * Distribution::<f64>::sample(&StandardNormal, rng));
    let middle = look.truth * Point3::new(0.0, 0.0, -150.0);
    let off = super::motion::about(&middle, &super::motion::motion(&normal(turn), &normal(shift)));
    Prior { world_from_view: off * look.truth, translation_sigma: shift, rotation_sigma_rad: turn }
}

fn views(looks: &[Look]) -> Vec<View> {
    looks.iter().map(|look| look.view.clone()).collect()
}

pub(super) fn run(looks: &[Look], priors: &[Option<Prior>]) -> Registration {
    register(&views(looks), priors, &Options::default(), &RunContext::silent()).unwrap()
}

/// How far the place half way between two views' middles is off in the second one, by their relative pose.
pub(super) fn relative_error(looks: &[Look], found: &Registration, a: usize, b: usize) -> f64 {
    let (x, y) = (found.views[a].placed().unwrap(), found.views[b].placed().unwrap());
    let found = y.world_from_view.inverse() * x.world_from_view;
    let truth = looks[b].truth.inverse() * looks[a].truth;
    let middle = |k: usize| looks[k].truth * Point3::new(0.0, 0.0, -150.0);
    let place = looks[a].truth.inverse() * nalgebra::center(&middle(a), &middle(b));
    (found * place - truth * place).norm()
}

pub(super) const ONE_DEGREE: f64 = std::f64::consts::PI / 180.0;

/// The demand: poses of neighbours to 0.6 of a point's noise, which the information of all points of single overlaps gives to 0.15 in the middle and 0.21 at the worst,
/// priors off by 0.5 mm and 1 degree, two views of another part left out.
#[test]
fn a_hundred_views_with_poor_priors_come_to_their_places_and_two_of_another_part_do_not() {
    let noise = 0.01;
    let mut rng = ChaCha8Rng::seed_from_u64(77);
    let place = |k: usize| [12.0 * (k % 10) as f64, 12.0 * (k / 10) as f64];
    let mut looks: Vec<Look> = (0..100)
        .map(|k| look(&Part::formed(), &format!("view_{k:03}"), place(k), 20.0, 0.2, noise, k as u64))
        .collect();
    for (k, at) in [[30.0, 40.0], [44.0, 43.0]].into_iter().enumerate() {
        looks.push(look(&Part::other(), &format!("view_{}", 100 + k), at, 20.0, 0.2, noise, 900 + k as u64));
    }
    let priors: Vec<Option<Prior>> = looks.iter().map(|l| Some(prior(l, 0.5, ONE_DEGREE, &mut rng))).collect();
    let found = run(&looks, &priors);
    for (k, view) in found.views.iter().enumerate() {
        match view {
            ViewOutcome::Placed(_) => assert!(k < 100, "view {k} is of another part: {:?}", found.pairs),
            ViewOutcome::LeftOut(left) => assert!(k >= 100, "{left:?}"),
        }
    }
    let mut worst = 0.0_f64;
    for a in 0..100 {
        for b in [a + 1, a + 10].into_iter().filter(|b| *b < 100 && (*b != a + 1 || b % 10 != 0)) {
            worst = worst.max(relative_error(&looks, &found, a, b));
        }
    }
    assert!(worst <= 0.6 * noise, "{worst}");

    assert_eq!(found.gauge, Gauge::Priors);
    // The noise of a point is that along the normal.
    assert!((found.noise / noise - 1.0).abs() < 0.1, "{}", found.noise);
    for pair in found.pairs.iter().filter(|p| p.is_used()) {
        // Two single points about each other's surfaces, the patch's own third beside them; the mean of thousands is near zero.
        assert!(pair.rms > 0.9 * noise && pair.rms < 1.3 * noise && pair.mean.abs() < 0.3 * noise, "{pair:?}");
    }
    assert!(found.cycles.len() >= 100);
    let mut normalised: Vec<f64> = found.cycles.iter().map(|c| c.normalised).collect();
    let middle = crate::fit::robust::median(&mut normalised).unwrap();
    // Closure errors are no larger than the pairs foretell, which think smooth errors possible that these views do not have.
    assert!(middle > 0.02 && middle < 2.0, "{middle}");
    assert!(found.weak.is_empty(), "{:?}", found.weak);
}

/// A few views of the formed part with priors.
fn few(noise: f64) -> (Vec<Look>, Vec<Option<Prior>>) {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let at = [[0.0, 0.0], [11.0, 2.0], [3.0, 12.0], [13.0, 11.0]];
    let looks: Vec<Look> =
        (0..4).map(|k| look(&Part::formed(), &format!("v{k}"), at[k], 20.0, 0.35, noise, 40 + k as u64)).collect();
    let priors = looks.iter().map(|l| Some(prior(l, 0.3, ONE_DEGREE, &mut rng))).collect();
    (looks, priors)
}

#[test]
fn neither_threads_nor_the_order_of_views_change_a_bit() {
    let (looks, priors) = few(0.01);
    let first = run(&looks, &priors);
    for threads in [1, 2, 5] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        assert_eq!(format!("{:?}", pool.install(|| run(&looks, &priors))), format!("{first:?}"), "{threads} threads");
    }
    let order = [2, 0, 3, 1];
    let shuffled: Vec<View> = order.iter().map(|k| looks[*k].view.clone()).collect();
    let shuffled_priors: Vec<Option<Prior>> = order.iter().map(|k| priors[*k]).collect();
    let again = register(&shuffled, &shuffled_priors, &Options::default(), &RunContext::silent()).unwrap();
    for (k, place) in order.iter().enumerate() {
        assert_eq!(format!("{:?}", again.views[k]), format!("{:?}", first.views[*place]));
    }
}

/// Without priors: turned by up to 0.8 rad about the camera's axis the views would be out of reach, so that they are moved back first, each to within
/// 7.5 degrees: any two then lie within 15.
#[test]
fn without_priors_views_within_fifteen_degrees_find_each_other() {
    let (mut looks, _) = few(0.01);
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    for look in &mut looks {
        let axis = Vector3::from_fn(|_, _| rng.random::<f64>() - 0.5).normalize();
        let middle = look.truth * Point3::new(0.0, 0.0, -150.0);
        let off =
            super::motion::motion(&(axis * (7.5 * ONE_DEGREE * rng.random::<f64>())), &Vector3::new(2.0, -1.0, 1.0));
        let moved = super::motion::about(&middle, &off) * look.truth;
        look.view.positions.iter_mut().for_each(|p| *p = moved * *p);
        look.view.sensor = moved * look.view.sensor;
        look.truth *= moved.inverse();
    }
    let found = run(&looks, &[None; 4]);
    assert_eq!(found.gauge, Gauge::View(0));
    let first = found.views[0].placed().unwrap();
    assert!(first.world_from_view == Isometry3::identity() && first.translation_u() == 0.0);
    for (k, look) in looks.iter().enumerate().skip(1) {
        let placed = found.views[k].placed().unwrap_or_else(|| panic!("{:?}", found.views[k]));
        let truth = looks[0].truth.inverse() * look.truth;
        let place = truth.inverse() * placed.middle;
        let error = (placed.world_from_view * place - truth * place).norm();
        // A thousand points or more of two views, slopes of 0.1 and more: 0.01 * 1.4 / (30 * 0.1) = 0.005, and three times that.
        assert!(error < 0.015, "view {k}: {error}");
    }
}

/// Two views of a sheet, one with its prior 0.4 to the side, and priors that are known to be off by that.
fn two_of(part: &Part, off: Vector3) -> (Vec<Look>, Vec<Prior>) {
    let looks: Vec<Look> =
        (0..2).map(|k| look(part, &format!("v{k}"), [0.0, 6.0 * k as f64], 20.0, 0.3, 0.01, 60 + k as u64)).collect();
    let prior = |k: usize| Prior {
        world_from_view: if k == 1 { nalgebra::Translation3::from(off) * looks[k].truth } else { looks[k].truth },
        translation_sigma: 0.5,
        rotation_sigma_rad: ONE_DEGREE,
    };
    let priors = (0..2).map(prior).collect();
    (looks, priors)
}

/// What surfaces cannot tell the priors keep: along it the views stay as far from each other as the priors have them, across it they come together.
#[test]
fn planes_and_cylinders_do_not_slide_where_priors_hold_them_and_are_said_to_be_weak() {
    let along = [(Part::flat(), vec![Vector3::x(), Vector3::y()]), (Part::cylinder(), vec![Vector3::y()])];
    for (part, free) in along {
        let off = Vector3::new(0.3, -0.25, 0.2);
        let (looks, priors) = two_of(&part, off);
        let found = run(&looks, &priors.iter().copied().map(Some).collect::<Vec<_>>());
        let middle = Point3::new(0.0, 3.0, 0.0);
        let moved = |k: usize| found.views[k].placed().unwrap().world_from_view * (looks[k].truth.inverse() * middle);
        let apart = moved(1) - moved(0);
        for axis in &free {
            // Nothing tells this motion; noise must not either. A turn of the other view's overlap lends it second order.
            assert!((apart.dot(axis) - off.dot(axis)).abs() < 0.03, "{axis}: {apart}");
        }
        // Across the surface a thousand points of 0.01 hold it.
        assert!(apart.z.abs() < 0.005, "{apart}");
        let free_words = found.weak.iter().filter(|w| w.uncertainty.is_infinite()).count();
        // A plane leaves two shifts and a turn, a cylinder a shift and a turn, of each of the two views.
        assert_eq!(free_words, if free.len() == 2 { 6 } else { 4 }, "{:?}", found.weak);
        assert!(found.weak.iter().any(|w| w.words.contains("its pose as given before holds it")));
        let u = found.views[1].placed().unwrap().translation_u();
        assert!(u > 0.2 && u < 0.6, "{u}: half of it is the other view's");
    }
}

#[test]
fn planes_without_priors_are_said_to_be_weak_or_left_out() {
    let (looks, _) = two_of(&Part::flat(), Vector3::zeros());
    let mut looks = looks;
    for look in &mut looks {
        let truth = look.truth;
        look.view.positions.iter_mut().for_each(|p| *p = truth * *p);
        look.view.sensor = truth * look.view.sensor;
    }
    let found = run(&looks, &[None, None]);
    let placed = found.views.iter().filter(|v| v.placed().is_some()).count();
    assert_eq!(placed, 2, "{:?}", found.views);
    assert!(
        found.weak.iter().any(|w| w.uncertainty.is_infinite() && w.words.contains("give poses")),
        "{:?}",
        found.weak
    );
    let u = found.views[1].placed().unwrap().translation_u();
    assert!(u > 5.0, "its size, since nothing holds it: {u}");
}

#[test]
fn views_that_do_not_overlap_are_left_out_by_name() {
    let part = Part::formed();
    let mut looks: Vec<Look> =
        (0..2).map(|k| look(&part, &format!("v{k}"), [8.0 * k as f64, 0.0], 20.0, 0.35, 0.01, k as u64)).collect();
    looks.push(look(&part, "far", [80.0, 0.0], 20.0, 0.35, 0.01, 9));
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let priors: Vec<Option<Prior>> = looks.iter().map(|l| Some(prior(l, 0.1, 0.2 * ONE_DEGREE, &mut rng))).collect();
    let found = run(&looks, &priors);
    let ViewOutcome::LeftOut(left) = &found.views[2] else { panic!("{:?}", found.views[2]) };
    assert!(left.name == "far" && left.reason.contains("less than 15 %"), "{left:?}");
    assert!(found.views[0].placed().is_some() && found.views[1].placed().is_some());
}

#[test]
fn one_view_empty_views_and_views_all_alike() {
    let (looks, priors) = few(0.01);
    let one = run(&looks[..1], &priors[..1]);
    let placed = one.views[0].placed().unwrap();
    assert!(placed.moved < Some(1e-12));
    assert!(one.pairs.is_empty() && one.weak.is_empty() && one.cycles.is_empty());
    assert_eq!(run(&looks[..1], &[None]).gauge, Gauge::View(0));

    let mut views = views(&looks[..2]);
    views.push(View { name: "empty".to_owned(), positions: Vec::new(), ..views[0].clone() });
    let with_empty = [priors[0], priors[1], None];
    let found = register(&views, &with_empty, &Options::default(), &RunContext::silent()).unwrap();
    let ViewOutcome::LeftOut(left) = &found.views[2] else { panic!("{:?}", found.views) };
    assert!(left.reason.contains("its 0 points are too few"), "{left:?}");
    assert!(found.views[1].placed().is_some());

    let alike = vec![views[0].clone(), views[0].clone(), views[0].clone()];
    let off = |by: f64| {
        priors[0].map(|p| Prior { world_from_view: Isometry3::translation(by, 0.0, 0.0) * p.world_from_view, ..p })
    };
    let alike_priors = [off(0.0), off(0.2), off(-0.1)];
    let found = register(&alike, &alike_priors, &Options::default(), &RunContext::silent()).unwrap();
    let pose = |k: usize| found.views[k].placed().unwrap().world_from_view;
    for k in [1, 2] {
        // The same points: nothing but rounding and the priors' weak pull is left between them.
        let between = pose(0).inverse() * pose(k);
        assert!(between.translation.vector.norm() < 1e-3 && between.rotation.angle() < 1e-5, "{between}");
    }
}

#[test]
fn input_that_cannot_be_registered_is_told_with_its_place() {
    let (looks, priors) = few(0.01);
    let all = views(&looks);
    let of = |views: &[View], priors: &[Option<Prior>], options: &Options| {
        register(views, priors, options, &RunContext::silent()).unwrap_err()
    };
    assert_eq!(of(&[], &[], &Options::default()), RegisterError::NoViews);
    assert_eq!(of(&all, &priors[..2], &Options::default()), RegisterError::Priors { priors: 2, views: 4 });
    let mut broken = all.clone();
    broken[1].positions[7].y = f64::NAN;
    let expected = RegisterError::NotFinite { name: "v1".to_owned(), index: 7 };
    assert_eq!(of(&broken, &priors, &Options::default()), expected);
    let mut bad = priors.clone();
    bad[2] = bad[2].map(|p| Prior { rotation_sigma_rad: 0.0, ..p });
    assert!(matches!(of(&all, &bad, &Options::default()), RegisterError::Prior { .. }));
    bad[2] = bad[2].map(|p| Prior {
        rotation_sigma_rad: 0.1,
        world_from_view: Isometry3::translation(f64::NAN, 0.0, 0.0),
        ..p
    });
    assert!(matches!(of(&all, &bad, &Options::default()), RegisterError::Prior { .. }));
    let options = Options { least_share: f64::NAN, ..Options::default() };
    assert!(matches!(of(&all, &priors, &options), RegisterError::Option { .. }));
    let stop = crate::run::CancelToken::default();
    stop.cancel();
    let cancelled = register(&all, &priors, &Options::default(), &RunContext::new(&stop, &|_| ()));
    assert!(matches!(cancelled, Err(RegisterError::Cancelled(_))));
}
