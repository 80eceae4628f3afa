//! The page: tables with the demands beside what was found, and what they leave open.

use crate::parts::{EdgeOffset, Scene};
use crate::record::{PointRecord, ScanRecord};
use crate::tables::{
    Covered, KINDS, Spread, above_minus_below, aligned_errors, collect, least_centre_sd_mm, not_measured, points,
    simple_errors, u_over_spread,
};
use shapeline::plan::Side;
use shapeline::study::median;
use std::fmt::Write;

/// What a reader must know before, and after.
const OPENING: &str = include_str!("opening.md");
const CLOSING: &str = include_str!("closing.md");
/// Holes from here on have a demand in mm; smaller ones are compared with the information limit.
const LARGE_HOLE_MM: f64 = 10.0;
const DENSITY_PER_MM2: f64 = 26.0;
const NOISE_MM: f64 = 0.05;

pub fn page(
    scene: &Scene,
    dense: &[ScanRecord],
    rounded: &[ScanRecord],
    calibration: &EdgeOffset,
    sparse: &[ScanRecord],
) -> String {
    let mut page = OPENING.to_owned();
    let _ = write!(page, "\n## Sharp rims, 26 points/mm², {} scans of {} parts\n\n", dense.len(), dense.len() / 2);
    page += &demands(dense);
    page += "\n## How often U covers the error\n\n";
    page += &coverage(dense);
    let _ = write!(page, "\n## Rims rounded by 0.3 mm, clutter outside them, {} scans\n\n", rounded.len());
    let _ = writeln!(
        page,
        "Calibrated on as many scans of other parts: `edge_offset_mm = {:.3}`, `edge_offset_u_mm = {:.3}` (what edges and holes differ in).\n",
        calibration.mm, calibration.u_mm
    );
    page += &repeatability(rounded);
    let _ = write!(page, "\n## 1.3 points/mm², sharp rims, {} scans\n\n", sparse.len());
    page += &sparse_table(sparse);
    page += "\n## What the estimators gain over simple ones\n\n";
    page += &simple_table(dense, sparse);
    page += "\n## Point by point, 26 points/mm²\n\n";
    page += &by_point(scene, dense);
    page += CLOSING;
    page
}

/// A table whose rows hold a demand.
struct Demands(String);

impl Demands {
    fn new() -> Self {
        Self("| what | found | demand | |\n|---|---|---|---|\n".to_owned())
    }

    fn row(&mut self, what: &str, found: &str, demand: &str, met: bool) {
        let _ = writeln!(self.0, "| {what} | {found} | {demand} | {} |", if met { "met" } else { "**missed**" });
    }

    /// A figure that nothing is demanded of.
    fn told(&mut self, what: &str, found: &str) {
        let _ = writeln!(self.0, "| {what} | {found} | – | |");
    }

    fn bias(&mut self, what: &str, values: &[f64], limit: f64) {
        let bias = Spread::of(values).bias;
        self.row(&format!("{what}, bias"), &format!("{bias:+.4} mm"), &format!("{limit:.3}"), bias.abs() < limit);
    }

    fn sd(&mut self, what: &str, values: &[f64], limit: f64) {
        let sd = Spread::of(values).sd;
        self.row(&format!("{what}, standard deviation"), &format!("{sd:.4} mm"), &format!("{limit:.3}"), sd < limit);
    }
}

fn demands(records: &[ScanRecord]) -> String {
    let mut table = Demands::new();
    let of = |kind: &'static str, from: fn(&PointRecord) -> Vec<f64>| {
        collect(records, move |p| if p.kind == kind { from(p) } else { Vec::new() })
    };
    let in_true_pose: fn(&PointRecord) -> Vec<f64> = |p| p.in_true_pose.clone();
    let surface = [of("surface", in_true_pose), of("surface", aligned_errors)];
    table.bias("surface, true pose", &surface[0], 0.004);
    table.bias("surface, aligned", &surface[1], 0.004);
    table.sd("surface, true pose", &surface[0], 0.020);
    table.sd("surface, aligned", &surface[1], 0.030);
    let large = |from: fn(&PointRecord) -> Vec<f64>| {
        collect(records, move |p| if p.diameter_mm >= Some(LARGE_HOLE_MM) { from(p) } else { Vec::new() })
    };
    table.bias("hole centre an axis, true pose", &of("hole", in_true_pose), 0.005);
    table.bias("hole centre an axis, aligned", &of("hole", aligned_errors), 0.005);
    table.sd("hole centre an axis, from 10 mm, true pose", &large(in_true_pose), 0.015);
    table.sd("hole centre an axis, from 10 mm, aligned", &large(aligned_errors), 0.020);
    small_holes(&mut table, records);
    table.bias("hole diameter", &collect(records, |p| p.diameter_error_mm.into_iter().collect()), 0.010);
    for (what, from) in [("true pose", in_true_pose), ("aligned", aligned_errors)] {
        let edges = of("edge", from);
        table.bias(&format!("trimmed edge, {what}"), &edges, 0.015);
        table.sd(&format!("trimmed edge, {what}"), &edges, 0.030);
    }
    for (kind, words) in KINDS {
        let ratio = u_over_spread(records, kind);
        let what = format!("{}: median U over spread of errors", words.to_lowercase());
        table.row(&what, &format!("{ratio:.2}"), "3", ratio <= 3.0);
    }
    whole_scans(&mut table, records);
    table.0
}

fn small_holes(table: &mut Demands, records: &[ScanRecord]) {
    let small: Vec<&PointRecord> =
        points(records).map(|(_, p)| p).filter(|p| p.diameter_mm < Some(LARGE_HOLE_MM)).collect();
    let mut ratios = Vec::new();
    for p in small.iter().filter(|p| p.diameter_mm.is_some()) {
        // A leaning sheet holds fewer points a mm² of itself than the picture.
        let density = DENSITY_PER_MM2 * p.seen_deg.to_radians().cos();
        let limit = least_centre_sd_mm(p.diameter_mm.unwrap_or(LARGE_HOLE_MM), density, NOISE_MM);
        ratios.extend(p.in_true_pose.iter().map(|error| error / limit));
    }
    let rms = (ratios.iter().map(|r| r * r).sum::<f64>() / ratios.len() as f64).sqrt();
    table.row(
        "hole centre an axis, under 10 mm, true pose, over the information limit",
        &format!("{rms:.2}"),
        "1.3",
        rms < 1.3,
    );
}

fn whole_scans(table: &mut Demands, records: &[ScanRecord]) {
    let (not, all) = not_measured(records);
    let share = 100.0 * not as f64 / all as f64;
    table.row("not measured, of what is seen within 60 degrees", &format!("{share:.1} %"), "10 %", share <= 10.0);
    let perfect = || records.iter().filter(|r| r.is_perfect);
    let middle = |corners: Vec<f64>| median(&corners).unwrap_or(f64::NAN);
    let corner = middle(perfect().filter_map(|r| r.best_fit_corner_mm).collect());
    let what = "best fit of perfect parts: worst corner of the box, median";
    table.row(what, &format!("{corner:.4} mm"), "0.020", corner < 0.02);
    let corner = middle(perfect().filter_map(|r| r.corner_mm).collect());
    table.told("plan's alignment of perfect parts: worst corner of the box, median", &format!("{corner:.4} mm"));
    let apart = Spread::of(&above_minus_below(records));
    table.row(
        "surface, same part from above less from below, mean",
        &format!("{:+.4} mm", apart.bias),
        "0.005",
        apart.bias.abs() < 0.005,
    );
    let refused: Vec<&str> = records.iter().filter_map(|r| r.refused.as_deref()).collect();
    table.row("scans refused", &format!("{} of {}", refused.len(), records.len()), "none", refused.is_empty());
}

/// Coverage of a kind; `wanted` in percent.
fn covered_cell(covered: &Covered) -> String {
    let share = covered.share();
    let mark = if (92.0..=98.0).contains(&share) { "" } else { " **!**" };
    format!("{share:.1} % of {}{mark}", covered.of)
}

fn coverage(records: &[ScanRecord]) -> String {
    let mut table = "Stated U (k = 2) is to cover 92 to 98 %; where it does not stands a **!**.\n\n\
                     | kind | all | perfect, top | perfect, bottom | bent, top | bent, bottom |\n|---|---|---|---|---|---|\n"
        .to_owned();
    for (kind, words) in KINDS {
        let of = |wanted: fn(&ScanRecord) -> bool| {
            let chosen = points(records).filter(|(r, p)| p.kind == kind && wanted(r)).map(|(_, p)| p);
            covered_cell(&Covered::of(chosen))
        };
        let cells = [
            of(|_| true),
            of(|r| r.is_perfect && r.side == Side::Top),
            of(|r| r.is_perfect && r.side == Side::Bottom),
            of(|r| !r.is_perfect && r.side == Side::Top),
            of(|r| !r.is_perfect && r.side == Side::Bottom),
        ];
        let _ = writeln!(table, "| {words} | {} |", cells.join(" | "));
    }
    table
}

fn repeatability(records: &[ScanRecord]) -> String {
    let mut table = Demands::new();
    for (kind, words, limit) in [("edge", "trimmed edge", 0.08), ("hole", "hole centre an axis", 0.05)] {
        let values = collect(records, |p| if p.kind == kind { aligned_errors(p) } else { Vec::new() });
        table.sd(words, &values, limit);
    }
    for (kind, words) in KINDS {
        let covered = Covered::of(points(records).map(|(_, p)| p).filter(|p| p.kind == kind));
        let met = covered.share() >= 92.0;
        let what = format!("{}: U covers", words.to_lowercase());
        table.row(&what, &format!("{:.1} % of {}", covered.share(), covered.of), "92 % at least", met);
    }
    let (not, all) = not_measured(records);
    let _ = writeln!(table.0, "\nNot measured, of what is seen within 60 degrees: {not} of {all}.");
    table.0
}

fn sparse_table(records: &[ScanRecord]) -> String {
    let mut table = "| kind | bias, mm | standard deviation, mm | U covers |\n|---|---|---|---|\n".to_owned();
    for (kind, words) in KINDS {
        let spread = Spread::of(&collect(records, |p| if p.kind == kind { aligned_errors(p) } else { Vec::new() }));
        let covered = Covered::of(points(records).map(|(_, p)| p).filter(|p| p.kind == kind));
        let _ = writeln!(table, "| {words} | {} | {} |", spread.cells(), covered_cell(&covered));
    }
    let (not, all) = not_measured(records);
    let _ = writeln!(table, "\nHole centres an axis. Not measured, of what is seen within 60 degrees: {not} of {all}.");
    table
}

fn simple_table(dense: &[ScanRecord], sparse: &[ScanRecord]) -> String {
    let mut table = "All in the true pose, on the same points. The simple ones also know the true pose of the sheet, and the circle starts \
                     at the true one.\n\n\
                     | quantity | points/mm² | simple: bias | sd, mm | ours: bias | sd, mm |\n|---|---|---|---|---|---|\n"
        .to_owned();
    for (density, records) in [("26", dense), ("1.3", sparse)] {
        for (what, kind) in
            [("surface point: raw plane", "surface"), ("hole centre an axis: circle through the rim's points", "hole")]
        {
            let of = |from: fn(&PointRecord) -> Vec<f64>| {
                Spread::of(&collect(records, |p| if p.kind == kind { from(p) } else { Vec::new() }))
            };
            let (simple, ours) = (of(simple_errors), of(|p| p.in_true_pose.clone()));
            let _ = writeln!(table, "| {what} | {density} | {} | {} |", simple.cells(), ours.cells());
        }
        let simple = Spread::of(&collect(records, |p| p.simple.get(2).copied().into_iter().collect()));
        let ours = Spread::of(&collect(records, |p| p.diameter_error_mm.into_iter().collect()));
        let _ = writeln!(
            table,
            "| hole diameter: circle through the rim's points | {density} | {} | {} |",
            simple.cells(),
            ours.cells()
        );
    }
    table
}

fn by_point(scene: &Scene, records: &[ScanRecord]) -> String {
    let mut table = "After the alignment; of a hole the distance of its centre, which noise can only lengthen.\n\n\
                     | point | measured | bias | sd | median U | U covers | why not, most often |\n|---|---|---|---|---|---|---|\n"
        .to_owned();
    for point in &scene.plan.comparison {
        let of: Vec<&PointRecord> = points(records).map(|(_, p)| p).filter(|p| p.name == point.name).collect();
        let values: Vec<(f64, f64)> = of.iter().filter_map(|p| p.aligned).collect();
        let spread = Spread::of(&values.iter().map(|v| v.0).collect::<Vec<f64>>());
        let stated = median(&values.iter().map(|v| v.1).collect::<Vec<f64>>()).unwrap_or(f64::NAN);
        let covered = Covered::of(of.iter().copied());
        let _ = writeln!(
            table,
            "| {} | {} of {} | {} | {stated:.4} | {:.1} % | {} |",
            point.name,
            spread.count,
            of.len(),
            spread.cells(),
            covered.share(),
            commonest(of.iter().filter_map(|p| p.reason.as_deref()))
        );
    }
    table
}

/// The reason given most often, numbers left out.
fn commonest<'a>(reasons: impl Iterator<Item = &'a str>) -> String {
    let mut counts = std::collections::BTreeMap::new();
    for reason in reasons {
        let words = reason.split([':', ';']).next().unwrap_or(reason);
        *counts.entry(words.chars().filter(|c| !c.is_ascii_digit()).collect::<String>()).or_insert(0_usize) += 1;
    }
    counts.into_iter().max_by_key(|(_, n)| *n).map_or(String::new(), |(words, n)| format!("{words} ({n})"))
}
