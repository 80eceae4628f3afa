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
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Mutex;

/// `shapeline merge MERGE.toml`.
#[derive(Debug, Args)]
#[command(after_long_help = "\
Each view is read, masked and cleaned by itself; then all are registered and merged: of points that lie within d_s of each other the best one
stays. Writes the cloud (PLY with the metrics of each point and its view) and a report beside it (JSON). docs/merge.md tells every key.

Prints a line a view, parted by tabs: file, `merged` or `left out`, then points read, invalid, masked, noise and averaged (each but masked only
where there are some), kept (what is left of those read) and in the cloud, or the reason. Then a line of the cloud (its points, d_grid, d_s), one a
[[feature]] (radius less certified, sigma_dev, before and after), and one of the wear where compare_with names an earlier cloud.

Points that memory has no room for are put away in a folder beside the cloud (merged.ply.unfinished) until it is written; the cloud is the same. A
merge stopped by Ctrl-C leaves that folder, and the same command goes on with it. While it runs, a bar tells what is done and the time left.

Exit status: 0 every view is in the cloud; 1 a view was left out, or the wear that was asked for is not told; 2 nothing could be merged; 130
stopped by Ctrl-C.

Examples:
  shapeline merge tool/merge.toml
  shapeline mask-study tool/merge.toml      which masks the views ask for
  shapeline merge tool/merge.toml --out tool/2026-03.ply --memory-limit 8GiB")]
pub(super) struct MergeArguments {
    /// The settings of the merge.
    merge: PathBuf,
    /// The merged cloud, instead of the file that the settings name.
    #[arg(long, value_name = "FILE.ply")]
    out: Option<PathBuf>,
    /// Memory that the points may take, such as 8GiB or 500MiB [default: three quarters of what is free].
    ///
    /// A number with KiB, MiB or GiB (1024 bytes each the one before; K, M, G are the same), KB, MB or GB (1000), or with nothing: bytes. With more
    /// points than that, views are put away on the disk beside the cloud meanwhile; the cloud is the same.
    ///
    /// A view of N points with M metrics takes (24 + 4 M) N bytes, and merging two of the largest for each thread at least: some 170 MiB for views of
    /// a million points with five metrics on two cores, some 6 MiB for views of 36,000 points. A limit that is too small is refused once the views are
    /// ready, with the size that they take: give more than that, use fewer --threads, tighten the masks, or ask for the density step. The views that are ready
    /// stay, and the same command with a larger limit goes on with them. The limit does not count the program itself (some 20 MiB), the view that is
    /// being read, and what registration knows of surfaces.
    #[arg(long, value_name = "SIZE", value_parser = bytes, verbatim_doc_comment)]
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
    let bytes = value.ok_or_else(|| {
        "expected a size such as 8GiB or 500MiB: a number with KiB, MiB, GiB, KB, MB or GB, or of bytes".to_owned()
    })?;
    if bytes < LEAST_LIMIT {
        return Err(format!("found {bytes} bytes, expected 64KiB or more: was a unit meant, such as GiB?"));
    }
    Ok(bytes)
}

/// Less than this holds no two views that merge, and is a unit left out.
const LEAST_LIMIT: u64 = 64 << 10;

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
    let screen = Screen::new(manner);
    let observe = |stage| screen.show(MergeEvent::Stage(stage));
    let run = RunContext::new(&stop.after_part, &observe);
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

/// Where on the bar views are ready, they are registered, and merged: shares of the whole, by about how long each takes.
const READY: f64 = 0.36;
const REGISTERED: f64 = 0.75;
const MERGED: f64 = 0.90;
/// Steps of the bar.
const STEPS: f64 = 10_000.0;

/// What a person at the terminal sees of a merge under way.
struct Screen {
    manner: Manner,
    bar: Mutex<Option<(ProgressBar, String)>>,
    /// What the stage at hand has of the bar, where it tells how far it is.
    span: Mutex<Option<Range<f64>>>,
}

impl Screen {
    fn new(manner: Manner) -> Self {
        Self { manner, bar: Mutex::default(), span: Mutex::default() }
    }

    fn show(&self, event: MergeEvent) {
        match event {
            MergeEvent::View { index, of, name } => self.begin_view(index, of, &name),
            // Everybody must know that a view is missing, also who asked for quiet.
            MergeEvent::Unusable(fault) => self.above(|| {
                terminal::error(&Diagnostic { severity: Severity::Warning, ..fault.clone() });
            }),
            MergeEvent::Stage(stage) => self.enter(stage),
            MergeEvent::Share(share) => self.done(share),
        }
    }

    fn begin_view(&self, index: usize, of: usize, name: &str) {
        let Ok(mut shown) = self.bar.lock() else { return };
        let (bar, words) =
            shown.get_or_insert_with(|| (terminal::bar(self.manner.quiet, Some(STEPS as u64)), String::new()));
        bar.set_position((READY * STEPS * (index as f64 - 1.0) / of as f64) as u64);
        *words = format!("view {index} of {of}, {name}");
        bar.set_message(words.clone());
        if index > 1 {
            terminal::show_time_left(bar);
        }
    }

    fn enter(&self, stage: Stage) {
        let Ok(mut shown) = self.bar.lock() else { return };
        let Some((bar, words)) = shown.as_mut() else { return };
        let of_stage = match stage {
            Stage::Register => READY..REGISTERED,
            Stage::Merge => REGISTERED..MERGED,
            Stage::Report => MERGED..1.0,
            _ => return bar.set_message(format!("{words}, {}", stage.words())),
        };
        bar.set_position((of_stage.start * STEPS) as u64);
        if let Ok(mut span) = self.span.lock() {
            *span = Some(of_stage);
        }
        *words = stage.words().to_owned();
        bar.set_message(words.clone());
        terminal::show_time_left(bar);
    }

    /// The share of registering or merging that is done.
    fn done(&self, share: f64) {
        let (Ok(span), Ok(shown)) = (self.span.lock(), self.bar.lock()) else { return };
        let (Some(span), Some((bar, _))) = (span.as_ref(), shown.as_ref()) else { return };
        let at = STEPS * (span.start + share * (span.end - span.start));
        bar.set_position(bar.position().max(at as u64));
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
        for (text, size) in [
            ("8GiB", 8 << 30),
            ("500 MB", 500_000_000),
            ("1.5g", 3 << 29),
            ("5000000", 5_000_000),
            ("128kib", 128 << 10),
        ] {
            assert_eq!(bytes(text), Ok(size), "{text}");
        }
        for wrong in ["", "8XB", "-1GB", "0", "nan", "GiB"] {
            assert!(bytes(wrong).unwrap_err().contains("a number with KiB"), "{wrong}");
        }
        for little in ["8", "4096", "63KiB"] {
            assert!(bytes(little).unwrap_err().contains("expected 64KiB or more: was a unit meant"), "{little}");
        }
    }

    #[test]
    fn the_bar_goes_on_within_registering_and_merging_and_never_back() {
        let screen = Screen::new(Manner { quiet: true });
        let at = || screen.bar.lock().unwrap().as_ref().unwrap().0.position() as f64 / STEPS;
        screen.show(MergeEvent::View { index: 3, of: 4, name: "c.ply".into() });
        assert!((at() - 0.5 * READY).abs() < 1.0 / STEPS);
        for (stage, from, to) in [(Stage::Register, READY, REGISTERED), (Stage::Merge, REGISTERED, MERGED)] {
            screen.show(MergeEvent::Stage(stage));
            assert!((at() - from).abs() < 1.0 / STEPS);
            screen.show(MergeEvent::Share(0.75));
            let most = at();
            assert!((most - (from + 0.75 * (to - from))).abs() < 1.0 / STEPS, "{most}");
            screen.show(MergeEvent::Share(0.5));
            assert_eq!(at(), most);
        }
    }
}
