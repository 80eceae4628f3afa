use super::*;
use crate::simulate::caster::Caster;
use crate::simulate::{BracketParameters, bracket};

fn scan(rig: &RigModel, side: Side, seed: u64) -> (Subject, SimulatedScan) {
    let subject = Subject::perfect(&bracket(&BracketParameters::default()));
    let pose = PoseChoice::side(&subject, side);
    let scan = simulate_scan(&subject, rig, &pose, seed, &RunContext::silent()).unwrap();
    (subject, scan)
}

#[test]
fn noise_free_points_lie_on_the_part_in_the_true_pose() {
    for (side, seed) in [(Side::Top, 3), (Side::Bottom, 4)] {
        let (subject, scan) = scan(&RigModel::perfect(0.4), side, seed);
        assert_eq!(scan.truth.side, side.key());
        let caster = Caster::new(&subject.solid);
        let cad_from_scan = CadFromScan::try_from_row_major(&scan.truth.cad_from_scan).unwrap();
        let up = subject.upper_direction().normalize();
        let mut on_part = 0;
        for (p, label) in scan.cloud.positions.iter().zip(&scan.labels) {
            let p = cad_from_scan.point(p);
            let near = caster.first(&(p + up * 1e-3), &-up, 0.0, 2e-3);
            match label {
                Label::Part => {
                    let hit = near.expect("a point of the part lies on the part");
                    // Oblique faces stretch the height over a distance by at most 1 / cos 70.
                    assert!((hit.t - 1e-3).abs() < 1e-6, "{side:?} {}", hit.t - 1e-3);
                    on_part += 1;
                }
                _ => assert_eq!(*label, Label::Belt),
            }
        }
        assert!(on_part > 8_000, "{on_part}");
    }
}

/// Points of the part that lie on the flat foot or near H1: (in-plane place, height over the true surface), mm.
fn heights(subject: &Subject, scan: &SimulatedScan, around: Point3, radius_mm: f64) -> Vec<(Point3, f64)> {
    let cad_from_scan = scan.truth.pose().unwrap();
    let caster = Caster::new(&subject.solid);
    let points = scan.cloud.positions.iter().zip(&scan.labels).filter(|(_, l)| **l == Label::Part);
    points
        .map(|(p, _)| cad_from_scan.point(p))
        .filter(|p| (p.xy() - around.xy()).norm() < radius_mm && (p.z - around.z).abs() < 1.2)
        .filter_map(|p| {
            let hit = caster.first(&(p + Vector3::z() * 2.0), &-Vector3::z(), 0.0, 4.0)?;
            Some((p, hit.t - 2.0))
        })
        .collect()
}

#[test]
fn density_and_noise_are_as_asked() {
    let rig = RigModel { outlier_share: 0.0, rim_rounding_mm: 0.0, ..RigModel::default().with_density(13.0) };
    let (subject, scan) = scan(&rig, Side::Top, 21);
    // The flat pad around C01 from 16 to 22.5 mm and the crown near it: a ring of 150 mm².
    let centre = subject.plan.comparison.iter().find(|c| c.name == "C01").unwrap().geometry.position();
    let ring: Vec<(Point3, f64)> = heights(&subject, &scan, centre, 22.5)
        .into_iter()
        .filter(|(p, _)| (p.xy() - centre.xy()).norm() > 16.0)
        .collect();
    let area = std::f64::consts::PI * (22.5f64.powi(2) - 16f64.powi(2));
    let density = ring.len() as f64 / area;
    // A lattice with 20 % binomial dropout over 10 000 points scatters by 0.5 %.
    assert!((density / 13.0 - 1.0).abs() < 0.05, "{density}");
    let n = ring.len() as f64;
    let rms = (ring.iter().map(|(_, h)| h * h).sum::<f64>() / n).sqrt();
    // 10 000 values, a fifth of their variance common to neighbours: 1 % scatter.
    assert!((rms / 0.12 - 1.0).abs() < 0.04, "{rms}");
    // Neighbours within 0.3 mm share 0.2 exp(-r²/2l²), between 0.2 and 0.17 of the variance.
    let (mut sum, mut pairs) = (0.0, 0);
    let mut sorted = ring;
    sorted.sort_by(|a, b| a.0.x.total_cmp(&b.0.x));
    for (k, (p, h)) in sorted.iter().enumerate() {
        for (q, g) in sorted[k + 1..].iter().take_while(|(q, _)| q.x - p.x < 0.4) {
            if (q - p).xy().norm() < 0.4 {
                sum += h * g;
                pairs += 1;
            }
        }
    }
    let share = sum / f64::from(pairs) / 0.0144;
    // About 10 000 pairs of product variance near 1: +-0.02; distances 0.2 to 0.4 mm give 0.15 to 0.18.
    assert!((0.10..0.23).contains(&share), "{share} of {pairs} pairs");
}

#[test]
fn rounded_rims_sink_but_keep_their_points() {
    let sharp = RigModel::perfect(4.0);
    let round = RigModel { rim_rounding_mm: 0.5, ..sharp.clone() };
    let (sharp, round) = (scan(&sharp, Side::Top, 8).1, scan(&round, Side::Top, 8).1);
    assert_eq!(sharp.labels, round.labels);
    let moved: Vec<f64> = sharp
        .cloud
        .positions
        .iter()
        .zip(&round.cloud.positions)
        .map(|(a, b)| (a - b).norm())
        .filter(|d| *d > 0.0)
        .collect();
    let deepest = moved.iter().copied().fold(0.0, f64::max);
    assert!(moved.len() > 1000 && deepest > 0.3 && deepest <= 0.5, "{} {deepest}", moved.len());
}

#[test]
fn same_bytes_with_one_thread_and_with_two() {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let two = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let rig = RigModel { missing_share: 0.02, ..RigModel::default().with_density(0.6) };
    let make = || scan(&rig, Side::Bottom, 9).1;
    let (a, b) = (one.install(make), two.install(make));
    assert_eq!(a.cloud, b.cloud);
    assert_eq!(a.labels, b.labels);
    assert_ne!(a.cloud, scan(&rig, Side::Bottom, 10).1.cloud);
}

#[test]
fn a_part_hides_the_belt_beside_it_and_throws_a_shadow() {
    let (_, scan) = scan(&RigModel::perfect(0.6), Side::Top, 3);
    let luminance = |c: &[u8; 3]| 0.299 * f64::from(c[0]) + 0.587 * f64::from(c[1]) + 0.114 * f64::from(c[2]);
    let colours = scan.cloud.colours.as_ref().unwrap();
    let dark = |label| colours.iter().zip(&scan.labels).filter(|(c, l)| **l == label && luminance(c) < 30.0).count();
    assert!(dark(Label::Belt) > 100, "{}", dark(Label::Belt));
    // Cameras 0.1 m off the middle do not see the belt close under a flange: fewer points than pixels.
    let pixels = scan.labels.len();
    let view_pixels = {
        let subject = Subject::perfect(&bracket(&BracketParameters::default()));
        let rig = RigModel::perfect(0.6);
        let pose = PoseChoice::side(&subject, Side::Top);
        let scene = Scene::new((&subject, &pose), &[], InView::ThePart, &rig, 3);
        let size = (scene.view.1 - scene.view.0) / rig.pixel_mm();
        (size.x.ceil() * size.y.ceil()) as usize
    };
    assert!(pixels < view_pixels - 50, "{pixels} of {view_pixels}");
}
