//! `shapeline merge`: many overlapping views made one cloud.

use super::{Exit, Manner, terminal};
use crate::diagnostic::{Diagnostic, Severity};
use crate::plan::short_number;
use crate::report::pdf::merge::FeatureRow;
use crate::run::{RunContext, Stage};
use crate::stitch::feature::FeatureFit;
use crate::stitch::wear::{Verdict, Wear};
use crate::stitch::{MergeResult, PointCounts, StitchError, ViewEnd, ViewFile};
use crate::worker::StopSwitch;
use crate::worker::merge::{MergeEvent, MergeJob, MergeRequest, merge_files};
use clap::Args;
use indicatif::ProgressBar;
use std::path::PathBuf;
use std::sync::Mutex;

/// `shapeline merge MERGE.toml`.
#[derive(Debug, Args)]
#[command(after_long_help = "\
Each view is read, masked and cleaned by itself; then all are registered and merged: of points that lie within d_s of each other the best one
stays. Writes the cloud (PLY with the metrics of each point and its view) and a report beside it (JSON). docs/merge.md tells every key.

Prints a line a view, parted by tabs: file, `merged` or `left out`, then points read, invalid, masked, noise and averaged (each but masked only
where there are some), kept (what is left of those read) and in the cloud, or the reason.

Points that memory has no room for are put away in a folder beside the cloud (merged.ply.unfinished) until it is written; the cloud is the same. A
merge stopped by Ctrl-C leaves that folder, and the same command goes on with it.

Exit status: 0 every view is in the cloud; 1 a view was left out, or the wear that was asked for is not told; 2 nothing could be merged; 130
stopped by Ctrl-C.

Examples:
  shapeline merge tool/merge.toml
  shapeline merge tool/merge.toml --out tool/2026-03.ply --memory-limit 8GiB")]
pub(super) struct MergeArguments {
    /// The settings of the merge.
    merge: PathBuf,
    /// The merged cloud, instead of the file that the settings name.
    #[arg(long, value_name = "FILE.ply")]
    out: Option<PathBuf>,
    /// Memory that the points may take, such as 8GiB or 500MiB [default: three quarters of what is free]; with more points, views are put away on
    /// the disk beside the cloud meanwhile.
    #[arg(long, value_name = "SIZE", value_parser = bytes)]
    memory_limit: Option<u64>,
}

fn bytes(text: &str) -> Result<u64, String> {
    const UNITS: [(&str, u64); 10] = [
        ("KiB", 1 << 10),
        ("MiB", 1 << 20),
        ("GiB", 1 << 30),
        ("KB", 1_000),
        ("MB", 1_000_000),
        ("GB", 1_000_000_000),
        ("K", 1 << 10),
        ("M", 1 << 20),
        ("G", 1 << 30),
        ("", 1),
    ];
    let upper = text.trim().to_ascii_uppercase();
    let unit = UNITS.iter().find(|(unit, _)| upper.ends_with(&unit.to_ascii_uppercase()));
    let value = unit.and_then(|(unit, size)| {
        let number: f64 = upper[..upper.len() - unit.len()].trim().parse().ok()?;
        let bytes = number * *size as f64;
        (1.0..1e18).contains(&bytes).then_some(bytes as u64)
    });
    value.ok_or_else(|| "expected a size such as 8GiB or 500MiB".into())
}

pub(super) fn run(arguments: &MergeArguments, manner: Manner) -> Result<Exit, Diagnostic> {
    let stop = StopSwitch::default();
    // One merge is one piece of work: what it has is worth nothing before its end.
    terminal::stop_on_ctrl_c(&stop, "stopping")?;
    let request = MergeRequest {
        plan_path: arguments.merge.clone(),
        out: arguments.out.clone(),
        memory_limit: arguments.memory_limit,
        settings: None,
    };
    let screen = Screen { manner, bar: Mutex::default(), stage: Mutex::default() };
    let observe = |stage| screen.show(MergeEvent::Stage(stage));
    let share = |share| screen.done(share);
    let run = RunContext::new(&stop.after_part, &observe).with_share(&share);
    let mut problems = Vec::new();
    let ended = merge_files(&request, &run, &mut problems, &|event| screen.show(event));
    screen.clear();
    end(ended, &problems, manner, tell)
}

/// Tells the problems of the settings, then what came out, or why nothing did.
pub(super) fn end<Job>(
    ended: Result<Job, Option<StitchError>>,
    problems: &[Diagnostic],
    manner: Manner,
    tell: impl Fn(&Job, Manner) -> Exit,
) -> Result<Exit, Diagnostic> {
    for problem in problems.iter().filter(|p| p.severity == Severity::Error || !manner.quiet) {
        terminal::error(problem);
    }
    match ended {
        Ok(job) => Ok(tell(&job, manner)),
        Err(None) => Ok(Exit::Unusable),
        Err(Some(StitchError::Cancelled(_))) => Ok(Exit::Stopped),
        Err(Some(StitchError::Fault(fault) | StitchError::CutOff(fault))) => Err(*fault),
    }
}

/// Prints what came out.
fn tell(job: &MergeJob, manner: Manner) -> Exit {
    let MergeJob { plan, result, cloud, report, pdf, extras } = job;
    let points_out = result.points_out();
    for (view, out) in result.files.iter().zip(points_out) {
        terminal::line(view_line(result, view, out));
    }
    let unit = plan.unit.key();
    let merged = result.files.len() - result.left_out().count();
    terminal::line(format!(
        "{}\t{} points of {merged} views\td_grid {} {unit}\td_s {} {unit}",
        cloud.display(),
        result.merged.positions.len(),
        short_number(result.placed.d_grid),
        short_number(result.merged.d_s),
    ));
    extras.features.iter().for_each(|row| terminal::line(feature_line(row, unit)));
    if let Some(wear) = &extras.wear {
        terminal::line(wear_line(wear, unit));
    } else if let Some(why) = &extras.not_compared {
        terminal::line(format!("wear\tnot told\t{}", crate::report::words::clean(why)));
    }
    if !manner.quiet {
        for warning in result.placed.warnings.iter().chain(&result.merged.warnings) {
            terminal::note(format!("warning: {warning}"));
        }
        for file in [report].into_iter().chain(pdf) {
            terminal::note(format!("written: {}", file.display()));
        }
    }
    let is_whole = result.left_out().next().is_none() && extras.not_compared.is_none();
    if is_whole { Exit::Good } else { Exit::NotGood }
}

/// A feature before and after, in one line.
fn feature_line(row: &FeatureRow, unit: &str) -> String {
    let certified = row.certified.map(|c| c.0);
    let told = |fit: &Result<FeatureFit, String>| match fit {
        Err(why) => format!("does not fit: {}", crate::report::words::clean(why)),
        Ok(fit) => {
            let d_r = fit.d_r(certified).map_or_else(String::new, |d| format!("d_r {d:+.3} {unit}, "));
            format!("{d_r}sigma_dev {} {unit}", short_number(fit.sigma_dev))
        }
    };
    let name = crate::report::words::clean(&row.name);
    format!("{name}\tbefore: {}\tafter: {}", told(&row.before), told(&row.after))
}

/// What was found of wear, in one line.
fn wear_line(wear: &Wear, unit: &str) -> String {
    let measured = wear.difference.len() - wear.not_measured;
    let number = short_number;
    let regions = wear.regions.first().map(|largest| {
        let blurred = if largest.blurred { ", blurred" } else { "" };
        format!(
            "{} regions differ, the largest by {:+.3} {unit} (u {}) on average over {} {unit}² (u {}){blurred}",
            wear.regions.len(),
            largest.mean,
            number(largest.mean_u),
            number(largest.area),
            number(largest.area_u)
        )
    });
    let told = match (&wear.verdict, regions) {
        (Verdict::CannotBeTold(doubt), None) => format!("cannot be told: {}", doubt.words(unit)),
        (Verdict::CannotBeTold(doubt), Some(regions)) => format!("cannot be told: {}\t{regions}", doubt.words(unit)),
        (_, Some(regions)) => regions,
        (_, None) => format!("no region differs by {} {unit} or more", number(wear.least_difference)),
    };
    format!(
        "wear\t{told}\t{measured} points compared, {} not measured\tfitted by moving up to {} {unit}",
        wear.not_measured,
        number(wear.fit.moved)
    )
}

fn view_line(result: &MergeResult, view: &ViewFile, points_out: usize) -> String {
    let name = crate::report::words::clean(&view.name);
    if let Some(why) = result.why_left_out(view) {
        return format!("{name}\tleft out\t{}", crate::report::words::clean(why));
    }
    let counts = match view.end {
        ViewEnd::Ready(k) => result.placed.counts.get(k),
        ViewEnd::Unusable(_) => None,
    };
    let counts = counts.map_or_else(String::new, counts_line);
    format!("{name}\tmerged{counts}\t{points_out} in the cloud")
}

/// Points read, what became of those that are not merged, where there are any, and the others: read is the sum of the rest.
fn counts_line(counts: &PointCounts) -> String {
    let lost = [
        (counts.points_invalid, "invalid"),
        (counts.points_masked, "masked"),
        (counts.points_noise, "noise"),
        (counts.points_averaged, "averaged"),
    ];
    let lost = lost.into_iter().filter(|(count, word)| *count > 0 || *word == "masked");
    let lost: String = lost.map(|(count, word)| format!("\t{count} {word}")).collect();
    format!("\t{} read{lost}\t{} kept", counts.points_read, counts.points_kept)
}

/// Steps of the bar after the views: registering, merging, writing, each about as long as some views.
const LATER_STEPS: [(Stage, u64); 3] = [(Stage::Register, 4), (Stage::Merge, 2), (Stage::Report, 1)];

/// What a person at the terminal sees of a merge under way.
struct Screen {
    manner: Manner,
    bar: Mutex<Option<(ProgressBar, String)>>,
    /// Where the bar stood when merging began, once it has.
    stage: Mutex<Option<u64>>,
}

/// Steps of the bar for a view.
const VIEW: u64 = 100;

impl Screen {
    fn show(&self, event: MergeEvent) {
        match event {
            MergeEvent::View { index, of, name } => self.begin_view(index, of, &name),
            // Everybody must know that a view is missing, also who asked for quiet.
            MergeEvent::Unusable(fault) => self.above(|| {
                terminal::error(&Diagnostic { severity: Severity::Warning, ..fault.clone() });
            }),
            MergeEvent::Stage(stage) => self.enter(stage),
        }
    }

    fn begin_view(&self, index: usize, of: usize, name: &str) {
        let Ok(mut shown) = self.bar.lock() else { return };
        let of_views = of as u64 * VIEW;
        let later: u64 = LATER_STEPS.iter().map(|(_, share)| of_views * share / 4 + 1).sum();
        let (bar, words) =
            shown.get_or_insert_with(|| (terminal::bar(self.manner.quiet, Some(of_views + later)), String::new()));
        bar.set_position((index as u64 - 1) * VIEW);
        *words = format!("view {index} of {of}, {name}");
        bar.set_message(words.clone());
        if index > 1 {
            terminal::show_time_left(bar);
        }
    }

    fn enter(&self, stage: Stage) {
        let Ok(mut shown) = self.bar.lock() else { return };
        let Some((bar, words)) = shown.as_mut() else { return };
        if LATER_STEPS.iter().any(|(later, _)| *later == stage) {
            let length = bar.length().unwrap_or(0);
            let left: u64 = match stage {
                Stage::Register => return self.set(bar, words, stage),
                Stage::Merge => length / 4,
                _ => length / 10,
            };
            bar.set_position(length - left.min(length));
            if let (Stage::Merge, Ok(mut begun)) = (stage, self.stage.lock()) {
                *begun = Some(bar.position());
            }
            return self.set(bar, words, stage);
        }
        bar.set_message(format!("{words}, {}", stage.words()));
    }

    /// The share of merging that is done; the rest of the bar but a tenth is its.
    fn done(&self, share: f64) {
        let (Ok(begun), Ok(shown)) = (self.stage.lock(), self.bar.lock()) else { return };
        let (Some(begun), Some((bar, _))) = (*begun, shown.as_ref()) else { return };
        let length = bar.length().unwrap_or(0);
        let span = (length - length / 10).saturating_sub(begun);
        bar.set_position(bar.position().max(begun + (share * span as f64) as u64));
    }

    fn set(&self, bar: &ProgressBar, words: &mut String, stage: Stage) {
        *words = stage.words().to_owned();
        bar.set_message(words.clone());
    }

    fn above(&self, print: impl FnOnce()) {
        match self.bar.lock().ok().as_ref().and_then(|shown| shown.as_ref()) {
            Some((bar, _)) => bar.suspend(print),
            None => print(),
        }
    }

    fn clear(&self) {
        if let Some((bar, _)) = self.bar.lock().ok().as_ref().and_then(|shown| shown.as_ref()) {
            bar.finish_and_clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_with_and_without_units() {
        for (text, size) in
            [("8GiB", 8 << 30), ("500 MB", 500_000_000), ("1.5g", 3 << 29), ("4096", 4096), ("2kib", 2048)]
        {
            assert_eq!(bytes(text), Ok(size), "{text}");
        }
        for wrong in ["", "8XB", "-1GB", "0", "nan", "GiB"] {
            assert!(bytes(wrong).is_err(), "{wrong}");
        }
    }
}
