//! The page.

use crate::trial::{Figures, JUDGES, MASKS, Masking, RADII, Trial};
use std::fmt::Write;

/// What a reader must know before, and after.
const OPENING: &str = include_str!("opening.md");
const CLOSING: &str = include_str!("closing.md");
/// Masking and merging together give a sum of |d_r| of at most this share of the voxel mean's.
const DEMAND: f64 = 0.85;
/// Where the demand is asked: the middle radius, 2 d_grid.
const ASKED: usize = 1;
/// The certificate's uncertainty of the radius, µm.
const CERTIFICATE_U_UM: f64 = 0.7;
const NO_MASK: usize = 0;
const BOTH_MASKS: usize = 3;
const MEAN: usize = 0;
const BY_D_CAL: usize = 1;

pub fn page(trials: &[Trial], masking: &[Masking]) -> String {
    let mut page = OPENING.to_owned();
    let d_grid = mean(trials.iter().map(|t| t.d_grid));
    let _ = writeln!(page, "\n{} seeds; d_grid is {d_grid:.1} µm.\n", trials.len());
    page += "## Masking, one view by itself\n\n";
    page += &masking_table(masking);
    page += "\n## What masking and merging gain\n\n";
    page += &demand(trials);
    page += "\n## Nothing merged\n\n| masked by | mean of \\|d_r\\| | mean of d_r | sigma_dev | points |\n|---|---|---|---|---|\n";
    for (m, (mask, ..)) in MASKS.iter().enumerate() {
        let of: Vec<Figures> = trials.iter().map(|t| t.unmerged[m]).collect();
        let _ = writeln!(page, "| {mask} | {} |", cells(&of));
    }
    for (r, radius) in RADII.iter().enumerate() {
        let _ = write!(page, "\n## Merged within d_s = {radius} d_grid = {:.1} µm\n\n", radius * d_grid);
        page += "| masked by | merged by | mean of \\|d_r\\| | mean of d_r | sigma_dev | points |\n|---|---|---|---|---|---|\n";
        for (m, (mask, ..)) in MASKS.iter().enumerate() {
            for (j, (judge, _)) in JUDGES.iter().enumerate() {
                let of: Vec<Figures> = trials.iter().map(|t| t.merged[r][m][j]).collect();
                let _ = writeln!(page, "| {mask} | {judge} | {} |", cells(&of));
            }
        }
    }
    page += CLOSING;
    page
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
    sum / count
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    mean(values.map(|v| v * v)).sqrt()
}

fn cells(of: &[Figures]) -> String {
    format!(
        "{:.2} | {:+.2} | {:.2} | {:.0}",
        mean(of.iter().map(|f| f.d_r.abs())),
        mean(of.iter().map(|f| f.d_r)),
        rms(of.iter().map(|f| f.sigma_dev)),
        mean(of.iter().map(|f| f.n as f64))
    )
}

fn masking_table(masking: &[Masking]) -> String {
    let mut table =
        "| masked by | plane: sigma_dev | points left | sphere: sigma_dev | points left |\n|---|---|---|---|---|\n"
            .to_owned();
    for (m, (mask, ..)) in MASKS.iter().enumerate() {
        let _ = write!(table, "| {mask} |");
        for subject in 0..2 {
            let sigma = rms(masking.iter().map(|t| t.sigma_dev[subject][m].0));
            let share = mean(masking.iter().map(|t| {
                let [all, left] = [0, m].map(|m| t.sigma_dev[subject][m].1 as f64);
                100.0 * left / all
            }));
            let _ = write!(table, " {sigma:.2} | {share:.0} % |");
        }
        table.push('\n');
    }
    table
}

/// Sums of |d_r| beside the voxel mean's.
fn demand(trials: &[Trial]) -> String {
    let sizes = |mask: usize, judge: usize| -> Vec<f64> {
        trials.iter().map(|t| t.merged[ASKED][mask][judge].d_r.abs()).collect()
    };
    let plain = sizes(NO_MASK, MEAN);
    let rows = [
        ("voxel mean of all points", plain.clone()),
        ("masking alone: sigma_I at least 0.002 and d_cal at most 150 µm, voxel mean", sizes(BOTH_MASKS, MEAN)),
        ("merging alone: by d_cal", sizes(NO_MASK, BY_D_CAL)),
        ("both", sizes(BOTH_MASKS, BY_D_CAL)),
    ];
    let mut table = format!(
        "Sum of |d_r| over the seeds at d_s = 2 d_grid (the voxel mean's cells are as wide). The certificate's own uncertainty is {CERTIFICATE_U_UM} µm a radius: {:.1} µm over {} seeds.\n\n",
        CERTIFICATE_U_UM * trials.len() as f64,
        trials.len()
    );
    table += "| what | sum of \\|d_r\\|, µm | of the voxel mean's | demand | |\n|---|---|---|---|---|\n";
    for (k, (what, sizes)) in rows.iter().enumerate() {
        let ratio = total(sizes) / total(&plain);
        let spread = if k == 0 { String::new() } else { format!(" ± {:.2}", jackknife(sizes, &plain)) };
        let (demand, met) = match k {
            3 => (format!("{DEMAND}"), if ratio <= DEMAND { "met" } else { "**missed**" }),
            _ => ("–".to_owned(), ""),
        };
        let _ = writeln!(table, "| {what} | {:.1} | {ratio:.2}{spread} | {demand} | {met} |", total(sizes));
    }
    table += "\n± is the standard error of the ratio over seeds (jackknife).\n";
    table
}

fn total(values: &[f64]) -> f64 {
    values.iter().sum()
}

/// Standard error of a ratio of sums.
fn jackknife(above: &[f64], below: &[f64]) -> f64 {
    let n = above.len() as f64;
    let without: Vec<f64> = (0..above.len()).map(|k| (total(above) - above[k]) / (total(below) - below[k])).collect();
    let middle = total(&without) / n;
    ((n - 1.0) / n * without.iter().map(|r| (r - middle).powi(2)).sum::<f64>()).sqrt()
}
