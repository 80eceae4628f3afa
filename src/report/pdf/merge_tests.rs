//! Reports of merges and of masks: the same bytes twice, and everything inside the page.

use super::mask_study::mask_study_pdf;
use super::merge::{FeatureRow, MergeReport, PairRow, ViewRow, merge_pdf, pages};
use super::page::{Fonts, Page, Placed};
use super::tests::assert_whole;
use crate::geometry::Point3;
use crate::plan::merge;
use crate::run::RunContext;
use crate::simulate::endoscope::{Pocket, PriorError, Scene};
use crate::stitch::adaptive::{Rank, survivors};
use crate::stitch::feature::fit_feature;
use crate::stitch::mask_study::mask_study;
use crate::stitch::wear::{NewCloud, OldCloud, Wear, compare};
use crate::stitch::{Metric, View};
use std::collections::BTreeMap;
use std::path::Path;

const EXACT: PriorError = PriorError { shift: 0.0, turn_rad: 0.0 };

/// A merged cylinder.
struct Merged {
    positions: Vec<Point3>,
    source: Vec<i32>,
    badness: Vec<f32>,
    sensors: Vec<Point3>,
    before: Vec<Point3>,
}

fn merged(scene: &Scene) -> Merged {
    let (mut before, mut ranks, mut sensors) = (Vec::new(), Vec::new(), Vec::new());
    for (k, station) in scene.stations.iter().enumerate() {
        let view = scene.view(k);
        sensors.push(Point3::from(station.world_from_view.translation.vector));
        for i in (0..view.positions.len()).filter(|i| view.sigma_i[*i] >= 0.002 && view.d_cal[*i] <= 150.0) {
            before.push(station.world_from_view * view.positions[i]);
            ranks.push(Rank { score: -f64::from(view.d_cal[i]), view: k as u32, index: i as u32 });
        }
    }
    let kept = survivors(&before, &ranks, 20.0, &RunContext::silent()).unwrap();
    let positions = kept.iter().map(|k| before[*k as usize]).collect();
    let source = kept.iter().map(|k| ranks[*k as usize].view as i32).collect();
    let badness = kept.iter().map(|k| -ranks[*k as usize].score as f32).collect();
    Merged { positions, source, badness, sensors, before }
}

fn wear_of(new: &Merged, old: &Merged) -> Wear {
    let seen_from: Vec<u32> = new.source.iter().map(|v| *v as u32).collect();
    let old = OldCloud { positions: &old.positions, badness: Some(&old.badness) };
    let Merged { positions, badness, sensors, .. } = new;
    let new = NewCloud { positions, sensors, seen_from: &seen_from, badness: Some(badness) };
    compare(&new, &old, &RunContext::silent()).unwrap()
}

/// Hands a report of three views, one of them left out, and of a worn cylinder to `print`.
fn printed<T>(unit: &str, print: impl FnOnce(&MergeReport<'_>) -> T) -> T {
    let mut worn = Scene::cylinder(EXACT, 2);
    let pocket = |x: f64, depth| Pocket { centre: Point3::new(x, 0.0, 1001.5), radius: 220.0, flat: 0.7, depth };
    worn.surface.pockets = vec![pocket(-500.0, 25.0), pocket(420.0, -18.0)];
    let worn = merged(&worn);
    let wear = wear_of(&worn, &merged(&Scene::cylinder(EXACT, 1)));
    let Merged { positions, source, sensors, before, .. } = &worn;
    let view = |name: &str, left_out: Option<&str>| ViewRow {
        name: name.into(),
        points: if left_out.is_some() { [34_105, 5_800, 28_305, 0] } else { [34_105, 5_800, 28_305, 4_702] },
        moved: left_out.is_none().then_some(17.4),
        turned_deg: left_out.is_none().then_some(0.093),
        place_u: left_out.is_none().then_some(0.61),
        agreement: left_out.is_none().then_some(0.994),
        left_out: left_out.map(str::to_owned),
    };
    let fit = |points: &[Point3]| fit_feature(merge::FeatureKind::Cylinder, points).map_err(|e| e.to_string());
    print(&MergeReport {
        file: "merge.toml",
        unit,
        merged_by: "the best by d_cal within d_s".into(),
        d_grid: 10.1,
        d_s: 20.2,
        points_in: before.len(),
        positions,
        source,
        eye: sensors[0],
        views: vec![
            view("view_00.ply", None),
            view("view_01.ply", None),
            view(
                "view_02_with_a_name_that_is_much_too_long_for_its_column.ply",
                Some(
                    "no overlap with any other view fits better than 3 times the noise of a point; the best one is that with view_00.ply, 48.2 at a share of 16 %",
                ),
            ),
        ],
        pairs: vec![
            PairRow { views: [0, 1], share: 0.62, rms: 7.71, mean: -0.12, unused: None },
            PairRow { views: [0, 2], share: 0.16, rms: 48.2, mean: 21.0, unused: Some(UNUSED.into()) },
        ],
        features: vec![FeatureRow {
            name: "cylinder 1".into(),
            certified: Some((1001.5, 0.7)),
            before: fit(before),
            after: fit(positions),
        }],
        wear: Some((&wear, "merged_old.ply")),
        not_compared: None,
        notes: vec!["view 1: turning about the axis of a cylinder is held by the stage alone, to 20 um".into()],
        seed: b"{}",
    })
}

const UNUSED: &str =
    "their surfaces differ by 51.787 (one standard deviation), more than 2 times the noise of their points of 6.972";

fn report_bytes() -> Vec<u8> {
    printed("um", merge_pdf)
}

/// What stands on each page.
fn report_texts(unit: &str) -> Vec<Vec<Placed>> {
    let fonts = Fonts::new();
    printed(unit, |report| pages(&fonts, report).0.iter().map(Page::texts).collect())
}

fn study_bytes() -> Vec<u8> {
    let scene = Scene::sphere(EXACT, 2);
    let views: Vec<View> = (0..2)
        .map(|k| {
            let view = scene.view(k);
            let columns = BTreeMap::from([
                (Metric::PhaseShiftVariation, view.sigma_i),
                (Metric::Strength, view.b),
                (Metric::CalibrationDistance, view.d_cal),
                (Metric::CalibrationDistanceProjector, view.d_cal_projector),
                (Metric::Reprojection, view.reprojection),
            ]);
            View {
                name: format!("view_{k}"),
                positions: view.positions,
                columns,
                pixels: None,
                sensor: Point3::origin(),
            }
        })
        .collect();
    let text = b"schema = 1\nunit = \"um\"\n[views]\nfolder = \".\"\n[mask]\nsigma_i = { min = 0.002 }\nd_cal = { max = 150.0 }\n[[feature]]\nkind = \"sphere\"\nradius = 1500.0\n";
    let plan = merge::parse(text, Path::new("merge.toml")).plan.unwrap();
    let masks: Vec<merge::Mask> = plan.masks.iter().map(|m| m.value).collect();
    let study = mask_study(&views, &plan.features, &masks, &RunContext::silent(), &|_, _| {}).unwrap();
    mask_study_pdf(&plan, &study)
}

#[test]
fn a_merge_and_a_study_give_the_same_bytes_twice() {
    for bytes in [report_bytes, study_bytes] {
        let first = bytes();
        assert!(first.starts_with(b"%PDF-") && first == bytes());
    }
}

#[test]
fn nothing_of_a_merge_is_cut_off_or_printed_over_whatever_its_unit() {
    for unit in ["um", "mm", "inch"] {
        let texts = report_texts(unit);
        assert_whole(unit, &texts);
        // Both maps tell how long lengths are in them.
        let scales = texts.iter().flatten().filter(|t| t.text == format!("500 {unit}")).count();
        assert_eq!(scales, 2, "{unit}");
        let joined: String = texts.iter().flatten().map(|t| format!("{} ", t.text)).collect();
        assert!(joined.contains(&format!("Not used: {UNUSED}")), "{joined}");
    }
}

#[test]
fn the_first_page_of_a_merge_says_what_matters_first() {
    let texts = report_texts("um");
    let mut first: Vec<&Placed> = texts[0].iter().collect();
    first.sort_by(|a, b| (a.y, a.x).partial_cmp(&(b.y, b.x)).unwrap());
    let words: String = first.iter().map(|t| format!("{} ", t.text)).collect();
    let mut from = 0;
    for wanted in [
        "2 of 3 views are in",
        "too_long_for_its_column.ply: no overlap with any other view fits better",
        "Agreement",
        "at least 99.4 % agrees",
        "cylinder 1 d_r = ",
        " um (k = 1) after merging",
        "Wear",
        "regions differ from merged_old.ply, the largest by",
        "cannot be told from that",
        "In the cloud, of points kept",
        "Which view each point came from",
    ] {
        from += words[from..].find(wanted).unwrap_or_else(|| panic!("no {wanted} in {}", &words[from..]));
    }
    // The page is used: what stands lowest on it, the footer aside, stands in its last quarter.
    let lowest = texts[0].iter().filter(|t| t.y < 283.0).map(|t| t.y).fold(0.0, f64::max);
    assert!(lowest > 210.0, "{lowest}");
}
