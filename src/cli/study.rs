//! `shapeline study`: which tolerances of a plan can be judged.

use super::{Exit, Manner, terminal};
use crate::diagnostic::{Diagnostic, Severity};
use crate::report::atomic;
use crate::study::{self, Source, Study, StudyRequest, run_study};
use crate::worker::{Event, StopSwitch};
use clap::{ArgGroup, Args};
use indicatif::ProgressBar;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// `shapeline study PLAN.toml --count N --seed S`, or `--scans DIR`.
#[derive(Debug, Args)]
#[command(
    group(ArgGroup::new("source").required(true).args(["count", "scans"])),
    after_long_help = "\
Simulated scans show the plan's part, either side up, anywhere on the belt, with the noise of the plan's [rig]; what its [uncertainty]
states is drawn anew for each. Every scan is inspected as by `run`. For each comparison point, worst first:

  bias, s   mean and standard deviation of measured minus true
  U         median of the stated uncertainties (k = 2)
  within U  share of errors that the stated U covers
  Cg, Cgk   0.2 T / (6 s) and (0.1 T - |bias|) / (3 s) with T = upper - lower: capable from 1.33 on, in both
  least T   the least tolerance that would be capable

\"cannot say\" stands where fewer than ten values, or (else capable) fewer than nine tenths of the scans gave a value. With --scans and no
--reference nothing is known of the part: bias, coverage and Cgk are left out, and \"repeats\" is all that can be said.

Writes study.csv (the plan's order) and study.txt (the table). Exit status: 0 every point is capable (or repeats); 1 some point is not, or
cannot be told; 2 nothing could be studied; 130 stopped by Ctrl-C (once: after the running scan, with what was found till then).

Examples:
  shapeline study bracket.toml --count 50 --seed 1
  shapeline study bracket.toml --scans repeats --reference cmm.csv --out study-of-part-17"
)]
pub(super) struct StudyArguments {
    /// The inspection plan.
    plan: PathBuf,
    /// Simulate so many scans.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    count: Option<u64>,
    /// Seed: the same seed gives the same scans.
    #[arg(long, value_name = "S", default_value_t = 1, conflicts_with = "scans")]
    seed: u64,
    /// Bend the simulated parts by about so much at their ends, mm (0.3 when left out; 0 with best_fit).
    #[arg(long, value_name = "MM", value_parser = bend, conflicts_with = "scans")]
    deform: Option<f64>,
    /// Instead: scans of one and the same part, each laid down anew.
    #[arg(long, value_name = "DIR")]
    scans: Option<PathBuf>,
    /// What is known of that part: delimited text with the columns name and deviation_mm.
    #[arg(long, value_name = "FILE", requires = "scans", conflicts_with = "count")]
    reference: Option<PathBuf>,
    /// Folder for study.csv and study.txt; `study` beside the plan when left out.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

fn bend(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (0.0..=20.0).contains(&value) => Ok(value),
        _ => Err("expected millimetres from 0 to 20".into()),
    }
}

impl StudyArguments {
    fn request(&self) -> StudyRequest {
        let simulated = |count| Source::Simulated { count, seed: self.seed, springback_mm: self.deform };
        let repeats =
            || Source::Repeats { folder: self.scans.clone().unwrap_or_default(), reference: self.reference.clone() };
        StudyRequest { plan_path: self.plan.clone(), source: self.count.map_or_else(repeats, simulated) }
    }

    fn folder(&self) -> PathBuf {
        let beside = || self.plan.parent().unwrap_or(Path::new("")).join("study");
        self.out.clone().unwrap_or_else(beside)
    }
}

pub(super) fn run(arguments: &StudyArguments, manner: Manner) -> Result<Exit, Diagnostic> {
    // Before anything is simulated: a study that cannot be kept is no use.
    let folder = arguments.folder();
    folder_takes_files(&folder)?;
    let stop = StopSwitch::default();
    terminal::stop_on_ctrl_c(&stop, "stopping after this scan; Ctrl-C again drops what was found")?;
    let screen = Screen { manner, bar: Mutex::default() };
    let ended = run_study(&arguments.request(), &stop, &|event| screen.show(event));
    screen.clear();
    let study = match ended {
        Ok(Some(study)) => study,
        Ok(None) => return Ok(Exit::Stopped),
        Err(Some(diagnostic)) => return Err(*diagnostic),
        Err(None) => return Ok(Exit::Unusable),
    };
    terminal::line(study::text(&study).trim_end());
    std::fs::create_dir_all(&folder).map_err(|e| no_folder(&folder, &e.to_string()))?;
    for path in study::write(&folder, &study)? {
        if !manner.quiet {
            terminal::note(format!("written: {}", path.display()));
        }
    }
    Ok(exit_of(&study, stop.is_on()))
}

fn exit_of(study: &Study, stopped: bool) -> Exit {
    match study {
        _ if stopped => Exit::Stopped,
        s if s.measured() == 0 => Exit::Unusable,
        s if s.all_good() => Exit::Good,
        _ => Exit::NotGood,
    }
}

/// Whether files can be written there; a folder that is not there yet is made in the nearest one that is.
fn folder_takes_files(folder: &Path) -> Result<(), Diagnostic> {
    let or_here = |p: &'_ Path| if p.as_os_str().is_empty() { PathBuf::from(".") } else { p.to_path_buf() };
    let there = folder.ancestors().map(or_here).find(|p| p.exists());
    there.map_or(Ok(()), |there| atomic::try_folder(&there).map_err(|why| no_folder(folder, &why)))
}

fn no_folder(folder: &Path, why: &str) -> Diagnostic {
    let message = format!("the study cannot be written there: {why}");
    Diagnostic::error(message).in_file(folder).with_help("give another folder with --out")
}

/// What a person at the terminal sees of a study under way.
struct Screen {
    manner: Manner,
    bar: Mutex<Option<(ProgressBar, String)>>,
}

impl Screen {
    fn show(&self, event: Event) {
        match event {
            Event::Problems(problems) => {
                for problem in problems.iter().filter(|p| p.severity == Severity::Error || !self.manner.quiet) {
                    terminal::error(problem);
                }
            }
            Event::Prepared { part, .. } if !self.manner.quiet => {
                part.warnings.iter().for_each(|warning| terminal::note(format!("warning: {warning}")));
            }
            Event::Started { index, of, .. } => self.begin(index, of),
            Event::Stage(stage) => self.with_bar(|bar, scan| bar.set_message(format!("{scan}, {}", stage.words()))),
            _ => {}
        }
    }

    fn begin(&self, index: usize, of: Option<usize>) {
        let quiet = self.manner.quiet;
        let scan = format!("scan {index} of {}", of.unwrap_or(index));
        if let Ok(mut shown) = self.bar.lock() {
            let (bar, words) = shown.get_or_insert_with(|| (terminal::bar(quiet, of.map(|n| n as u64)), String::new()));
            bar.set_position(index as u64 - 1);
            bar.set_message(scan.clone());
            if index > 1 {
                terminal::show_time_left(bar);
            }
            *words = scan;
        }
    }

    fn with_bar(&self, act: impl FnOnce(&ProgressBar, &str)) {
        if let Ok(shown) = self.bar.lock()
            && let Some((bar, scan)) = shown.as_ref()
        {
            act(bar, scan);
        }
    }

    fn clear(&self) {
        self.with_bar(|bar, _| bar.finish_and_clear());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Debug, Parser)]
    struct Line {
        #[command(flatten)]
        study: StudyArguments,
    }

    fn parsed(words: &str) -> Result<StudyArguments, String> {
        let line = Line::try_parse_from(["study"].into_iter().chain(words.split_whitespace()));
        line.map(|line| line.study).map_err(|e| e.to_string())
    }

    #[test]
    fn scans_are_simulated_or_given_and_never_both() {
        let simulated = parsed("a/plan.toml --count 20 --seed 3 --deform 0").unwrap();
        assert_eq!(simulated.request().source, Source::Simulated { count: 20, seed: 3, springback_mm: Some(0.0) });
        assert_eq!(simulated.folder(), Path::new("a/study"));
        let repeats = parsed("plan.toml --scans b --reference c.csv --out d").unwrap();
        let source = Source::Repeats { folder: "b".into(), reference: Some("c.csv".into()) };
        assert_eq!((repeats.request().source, repeats.folder()), (source, PathBuf::from("d")));
        assert_eq!(parsed("plan.toml --count 1").unwrap().folder(), Path::new("study"));
        for wrong in [
            "plan.toml",
            "plan.toml --count 0",
            "plan.toml --count 5 --scans b",
            "plan.toml --scans b --seed 2",
            "plan.toml --scans b --deform 1",
            "plan.toml --count 5 --reference c.csv",
            "plan.toml --count 5 --deform -1",
            "plan.toml --count 5 --deform nan",
        ] {
            assert!(parsed(wrong).is_err(), "{wrong}");
        }
    }
}
