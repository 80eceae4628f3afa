//! `shapeline run`: a sequence of scans, or a watched folder.

use super::{Exit, Manner, terminal};
use crate::diagnostic::{Diagnostic, Severity};
use crate::inspect::Outcome;
use crate::part::CacheUse;
use crate::report::words::clean;
use crate::worker::{Event, SequenceJob, SequenceRequest, SequenceSummary, StopSwitch, WatchSettings, one_line};
use clap::Args;
use indicatif::ProgressBar;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// `shapeline run PLAN.toml [SCAN…]`.
#[derive(Debug, Args)]
pub(super) struct RunArguments {
    /// The inspection plan.
    plan: PathBuf,
    /// Scans to inspect; none = all that the plan finds, in the plan's order.
    scans: Vec<PathBuf>,
    /// Results folder instead of the plan's.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Go on with each new scan that arrives, until Ctrl-C.
    #[arg(long, conflicts_with = "scans")]
    watch: bool,
    /// With --watch: seconds for which a file's size and time must be quiet before it is taken.
    #[arg(long, value_name = "SECONDS", default_value_t = 2.0, value_parser = seconds)]
    settle: f64,
    /// Append one JSON object of milliseconds a scan to this file.
    #[arg(long, value_name = "FILE")]
    timings: Option<PathBuf>,
}

fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (0.0..=86_400.0).contains(&value) => Ok(value),
        _ => Err("expected seconds from 0 to 86400".into()),
    }
}

pub(super) fn run(arguments: &RunArguments, manner: Manner) -> Result<Exit, Diagnostic> {
    let watch = arguments
        .watch
        .then(|| WatchSettings { settle: Duration::from_secs_f64(arguments.settle), ..WatchSettings::default() });
    let request = SequenceRequest {
        plan_path: arguments.plan.clone(),
        scans: arguments.scans.clone(),
        out: arguments.out.clone(),
        watch,
        timings: arguments.timings.clone(),
    };
    let (summary, _) = run_to_end(request, manner)?;
    if let Some(diagnostic) = &summary.error {
        terminal::error(diagnostic);
    }
    Ok(exit_of(&summary))
}

/// Runs a sequence and prints its lines; also returns the files it wrote.
pub(super) fn run_to_end(
    request: SequenceRequest,
    manner: Manner,
) -> Result<(SequenceSummary, Vec<PathBuf>), Diagnostic> {
    let stop = StopSwitch::default();
    terminal::stop_on_ctrl_c(&stop, "stopping after this part; Ctrl-C again drops it")?;
    let job = SequenceJob::start(request, stop, || {})
        .map_err(|e| Diagnostic::error(format!("the worker cannot be started: {e}")))?;
    let mut screen = Screen { manner, bar: None, part: String::new(), scan: String::new(), files: Vec::new() };
    for event in &job.events {
        screen.show(event);
    }
    screen.clear();
    Ok((job.join(), screen.files))
}

fn exit_of(summary: &SequenceSummary) -> Exit {
    let all_written = summary.unwritten == 0 && summary.error.is_none();
    let all_good = summary.pass == summary.measured() && summary.refused == 0 && all_written;
    match summary {
        s if s.stopped => Exit::Stopped,
        s if s.measured() == 0 => Exit::Unusable,
        _ if all_good => Exit::Good,
        _ => Exit::NotGood,
    }
}

/// What a person at the terminal sees of a job.
struct Screen {
    manner: Manner,
    bar: Option<ProgressBar>,
    part: String,
    scan: String,
    files: Vec<PathBuf>,
}

impl Screen {
    fn show(&mut self, event: Event) {
        match event {
            Event::Problems(problems) => {
                for problem in problems {
                    if problem.severity == Severity::Error || !self.manner.quiet {
                        self.above(|| terminal::error(&problem));
                    }
                }
            }
            Event::Prepared { part, cache, .. } => {
                for warning in &part.warnings {
                    self.note(format!("warning: {warning}"));
                }
                match cache {
                    CacheUse::Built => self.note("CAD prepared and cached".into()),
                    CacheUse::NotStored(why) => {
                        self.note(format!("CAD prepared, its cache could not be written: {why}"))
                    }
                    CacheUse::Loaded | CacheUse::NotWanted => {}
                }
            }
            // Told as a problem, too.
            Event::Listed(_) | Event::Lost { .. } => {}
            Event::Started { index, of, scan, .. } => self.begin(index, of, &scan),
            Event::Stage(stage) => {
                if let Some(bar) = &self.bar {
                    bar.set_message(format!("{}, {}, {}", self.part, stage.words(), self.scan));
                }
            }
            Event::Finished { result, files, .. } => {
                self.files.extend(files);
                self.above(|| terminal::line(one_line(&result)));
                if let Outcome::Refused(refusal) = &result.outcome {
                    self.note(format!("help: {}", clean(&refusal.help)));
                }
                self.end_of_part();
            }
            Event::Watching { folder } => {
                self.note(format!("watching {}, stop with Ctrl-C", folder.display()));
            }
            Event::Waiting { scan, why, is_news } => {
                // A part without a verdict concerns everybody, also those who asked for quiet.
                if is_news {
                    self.above(|| terminal::error(&why.in_file(&scan)));
                }
                self.idle();
            }
            Event::LeftAlone { .. } | Event::Queued(_) => self.idle(),
            Event::PlanLost(diagnostic) => {
                self.above(|| terminal::note(format!("{diagnostic}\ntrying again until the plan can be used")));
                self.idle();
            }
            Event::PlanBack => self.note("the plan is back".into()),
            Event::Known { scan, inspected_as } => {
                self.note(format!("{} was inspected before as {inspected_as}", scan.display()));
                self.idle();
            }
            Event::FolderLost(diagnostic) => {
                self.above(|| terminal::note(format!("{diagnostic}\ntrying again until it is back")));
            }
            Event::FolderBack => self.note("the scan folder is back".into()),
            Event::ResultsLost(diagnostic) => {
                self.above(|| terminal::note(format!("{diagnostic}\ntrying again, no scan is lost")));
                self.idle();
            }
            Event::ResultsBack => self.note("results can be written again".into()),
        }
    }

    fn begin(&mut self, index: usize, of: Option<usize>, scan: &Path) {
        self.scan = scan.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        self.part = match of {
            Some(of) => format!("part {index} of {of}"),
            None => format!("part {index}"),
        };
        if self.bar.is_none() {
            self.bar = Some(terminal::bar(self.manner.quiet, of.map(|n| n as u64)));
        }
    }

    fn end_of_part(&self) {
        if let Some(bar) = &self.bar {
            bar.inc(1);
            terminal::show_time_left(bar);
        }
        self.idle();
    }

    /// Between two scans of a watched folder.
    fn idle(&self) {
        if let Some(bar) = self.bar.as_ref().filter(|bar| bar.length().is_none()) {
            bar.set_message("waiting for the next scan");
        }
    }

    fn note(&self, text: String) {
        if !self.manner.quiet {
            self.above(|| terminal::note(text));
        }
    }

    /// Prints without tearing the bar.
    fn above(&self, print: impl FnOnce()) {
        match &self.bar {
            Some(bar) => bar.suspend(print),
            None => print(),
        }
    }

    fn clear(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exit_status_as_in_the_contract() {
        let good = SequenceSummary { pass: 2, ..SequenceSummary::default() };
        assert_eq!(exit_of(&good), Exit::Good);
        assert_eq!(exit_of(&SequenceSummary { undecided: 1, ..good.clone() }), Exit::NotGood);
        assert_eq!(exit_of(&SequenceSummary { incomplete: 1, ..good.clone() }), Exit::NotGood);
        assert_eq!(exit_of(&SequenceSummary { fail: 1, ..good.clone() }), Exit::NotGood);
        assert_eq!(exit_of(&SequenceSummary { refused: 1, ..good.clone() }), Exit::NotGood);
        assert_eq!(exit_of(&SequenceSummary { refused: 3, ..SequenceSummary::default() }), Exit::Unusable);
        assert_eq!(exit_of(&SequenceSummary::default()), Exit::Unusable);
        assert_eq!(exit_of(&SequenceSummary { unwritten: 1, ..good.clone() }), Exit::NotGood);
        assert_eq!(exit_of(&SequenceSummary { unwritten: 1, ..SequenceSummary::default() }), Exit::Unusable);
        let full = SequenceSummary { error: Some(Diagnostic::error("disk full")), ..good.clone() };
        assert_eq!(exit_of(&full), Exit::NotGood);
        assert_eq!(exit_of(&SequenceSummary { pass: 0, ..full }), Exit::Unusable);
        assert_eq!(exit_of(&SequenceSummary { stopped: true, ..good }), Exit::Stopped);
    }
}
