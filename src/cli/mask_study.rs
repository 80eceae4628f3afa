//! `shapeline mask-study`: what each mask of a merge is worth.

use super::merge::end;
use super::{Exit, Manner, terminal};
use crate::diagnostic::{Diagnostic, Severity};
use crate::plan::merge::Metric;
use crate::report::mask_study::advice;
use crate::report::words::clean;
use crate::run::RunContext;
use crate::stitch::mask_study::Knee;
use crate::worker::StopSwitch;
use crate::worker::merge::{MaskStudyJob, MaskStudyRequest, MergeEvent, study_masks};
use clap::Args;
use indicatif::ProgressBar;
use std::path::PathBuf;

/// `shapeline mask-study MERGE.toml`.
#[derive(Debug, Args)]
#[command(after_long_help = "\
For every metric that is in the views, or can be computed of them, and every [[feature]]: how much the points scatter about the fitted feature
(sigma_dev), and how many are left, over a range of thresholds. Each view is fitted by itself, so that neither poses nor registration matter.
Suggests the loosest threshold from which on sigma_dev lies within 5 % of its best; \"no knee\" where a metric does not help, or only at the cost of
more than half of the points.

delta_n and delta_n_angle are computed with the radii of [delta_n] in the settings, else with 2.5 and 6 times each view's d_grid; a column of that name
in a view's file is used as it is, and a warning says so where the settings name radii. A metric that the settings ask for and that cannot be known
of every view is warned of.

Writes mask-study.csv and mask-study.pdf (plots) beside the merged cloud, or as --out says. Prints a line a metric, parted by tabs: feature, metric,
what is suggested.

Exit status: 0 at least one threshold is suggested; 1 none is, or a view could not be read; 2 nothing could be studied; 130 stopped by Ctrl-C.

Examples:
  shapeline mask-study tool/merge.toml
  shapeline mask-study tool/merge.toml --out tool/masks-2026-03
  shapeline mask-study tool/merge.toml --metric delta_n")]
pub(super) struct MaskStudyArguments {
    /// The settings of the merge.
    merge: PathBuf,
    /// Name of both files, without ending.
    #[arg(long, value_name = "NAME")]
    out: Option<PathBuf>,
    /// Study this metric only, such as delta_n; may be given several times. One that cannot be known of every view is an error then.
    #[arg(long, value_name = "METRIC", value_parser = metric)]
    metric: Vec<Metric>,
}

fn metric(text: &str) -> Result<Metric, String> {
    let known = || Metric::ALL.map(Metric::key).join(", ");
    Metric::of_key(&text.to_ascii_lowercase()).ok_or_else(|| format!("expected one of {}", known()))
}

pub(super) fn run(arguments: &MaskStudyArguments, manner: Manner) -> Result<Exit, Diagnostic> {
    let stop = StopSwitch::default();
    terminal::stop_on_ctrl_c(&stop, "stopping")?;
    let bar = terminal::bar(manner.quiet, Some(1));
    let run = RunContext::new(&stop.after_part, &|_| {});
    let mut problems = Vec::new();
    let show = |event| show(&bar, event);
    let told = |done: usize, of: usize| {
        bar.set_length(of as u64);
        bar.set_position(done as u64);
        bar.set_message(format!("metric {done} of {of}"));
        terminal::show_time_left(&bar);
    };
    let request = MaskStudyRequest {
        plan_path: arguments.merge.clone(),
        out: arguments.out.clone(),
        metrics: arguments.metric.clone(),
    };
    let ended = study_masks(&request, &run, &mut problems, &show, &told);
    bar.finish_and_clear();
    end(ended, &problems, manner, tell)
}

fn show(bar: &ProgressBar, event: MergeEvent) {
    match event {
        MergeEvent::View { index, of, name } => {
            bar.set_length(of as u64);
            bar.set_position(index as u64 - 1);
            bar.set_message(format!("view {index} of {of}, {name}"));
        }
        MergeEvent::Unusable(fault) => {
            bar.suspend(|| terminal::error(&Diagnostic { severity: Severity::Warning, ..fault.clone() }));
        }
        MergeEvent::Stage(_) | MergeEvent::Share(_) => {}
    }
}

fn tell(job: &MaskStudyJob, manner: Manner) -> Exit {
    for curve in &job.study.curves {
        let feature = clean(&job.plan.features[curve.feature].name);
        terminal::line(format!("{feature}\t{}\t{}", curve.metric.key(), advice(curve)));
    }
    if !manner.quiet {
        job.files.iter().for_each(|file| terminal::note(format!("written: {}", file.display())));
    }
    let any = job.study.curves.iter().any(|curve| matches!(curve.knee, Knee::At { .. }));
    if any && job.unusable == 0 { Exit::Good } else { Exit::NotGood }
}
