//! Names say nothing about where views lie.

use super::synthetic_tests::{ONE_DEGREE, Part, look, prior, run};
use super::{Prior, Registration};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// What is told of views and pairs, views by their places in the first order.
fn told(found: &Registration, first: &[usize]) -> Vec<String> {
    let mut told: Vec<String> = Vec::new();
    for (k, view) in found.views.iter().enumerate() {
        told.push(format!("view {}: {:?}", first[k], view.placed()));
    }
    for pair in &found.pairs {
        let (a, b) = (first[pair.a], first[pair.b]);
        let mean = if a < b { pair.mean } else { -pair.mean };
        told.push(format!(
            "pair {} {}: {} {:?} {:?} {mean:?} {:?} {:?}",
            a.min(b),
            a.max(b),
            pair.shared,
            pair.share,
            pair.rms,
            pair.agreement,
            pair.state
        ));
    }
    for weak in &found.weak {
        told.push(format!("weak {}: {:?}", first[weak.view], weak.uncertainty));
    }
    told.sort();
    told
}

/// The last one of another part, so that somebody is left out.
#[test]
fn other_names_change_the_places_of_results_and_not_a_bit_of_them() {
    let at = [[0.0, 0.0], [11.0, 2.0], [3.0, 12.0], [13.0, 11.0], [6.0, 5.0]];
    let part = |k: usize| if k == 4 { Part::other() } else { Part::formed() };
    let names = ["a", "b", "c", "d", "e"];
    let looks = |names: [&str; 5]| -> Vec<_> {
        (0..5).map(|k| look(&part(k), names[k], at[k], 20.0, 0.35, 0.01, 40 + k as u64)).collect()
    };
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let priors: Vec<Option<Prior>> = looks(names).iter().map(|l| Some(prior(l, 0.3, ONE_DEGREE, &mut rng))).collect();
    let same: Vec<usize> = (0..5).collect();
    let first = run(&looks(names), &priors);
    assert_eq!(first.views.iter().filter(|view| view.placed().is_some()).count(), 4, "{:?}", first.views);
    let first = told(&first, &same);
    for renamed in [["e", "d", "c", "b", "a"], ["c", "a", "e", "b", "d"]] {
        let again = run(&looks(renamed), &priors);
        // Pairs are told with the first name first, and in the order of names.
        let name = |view: usize| renamed[view];
        assert!(again.pairs.iter().all(|pair| name(pair.a) < name(pair.b)));
        assert!(again.pairs.is_sorted_by_key(|pair| (name(pair.a), name(pair.b))));
        assert_eq!(told(&again, &same), first, "{renamed:?}");
    }
}

/// Where no pose is known the first name has the gauge; the views lie beside each other as before.
#[test]
fn without_poses_the_first_name_gives_the_frame() {
    let looks = |names: [&str; 2]| -> Vec<_> {
        let at = [[0.0, 0.0], [8.0, 2.0]];
        (0..2).map(|k| look(&Part::formed(), names[k], at[k], 20.0, 0.35, 0.01, 40 + k as u64)).collect()
    };
    let between = |found: &Registration| {
        let pose = |k: usize| found.views[k].placed().map(|placed| placed.world_from_view);
        (pose(1).unwrap().inverse() * pose(0).unwrap()).to_homogeneous()
    };
    let (one, other) = (run(&looks(["a", "b"]), &[None; 2]), run(&looks(["b", "a"]), &[None; 2]));
    assert_eq!((&one.gauge, &other.gauge), (&super::Gauge::View(0), &super::Gauge::View(1)));
    // The solve stops where nothing moves by more than a ten thousandth of the residuals' scale of 0.01 mm.
    assert!((between(&one) - between(&other)).norm() < 1e-5, "{}", (between(&one) - between(&other)).norm());
}
