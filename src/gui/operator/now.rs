//! What goes on now: the part at hand, its stage, how long it takes. It never colours the verdict.

use super::layout::Form;
use crate::gui::facts::{Facts, Job, Running, Wanted};
use crate::gui::fonts;
use crate::gui::messages::sentence;
use crate::gui::perform::may_run;
use crate::gui::scope::Scope;
use crate::gui::text::Words;
use crate::gui::theme::size;
use crate::gui::widgets::{cards, words};
use crate::inspect::Outcome;
use crate::report::words::{capital, clean};
use crate::run::Stage;
use egui::{Align2, Rect, Ui, pos2};
use std::path::Path;
use std::time::Duration;

/// The steps of a part as people count them.
const STEPS: [&str; 6] =
    ["step.read", "step.background", "step.best_fit", "step.features", "step.comparison", "step.report"];

/// Draws the card; in the barest window one line. While nothing runs it tells what did not stand whole in the verdict's card: `cut`.
pub(super) fn now_ui(ui: &mut Ui, place: Rect, form: Form, cut: Option<&str>, scope: &Scope) {
    let title = title(scope);
    let theme = scope.theme;
    let cut = cut.filter(|_| is_quiet(scope.facts));
    if let (Form::Bare, Some(cut)) = (form, cut) {
        let size = if words::fits(ui, cut, fonts::semibold(size::NOTE), place.width(), 2) { size::NOTE } else { 11.0 };
        words::block(ui, place, Align2::CENTER_CENTER, cut, fonts::semibold(size), theme.text, 2);
        return;
    }
    if form == Form::Bare {
        words::line(ui, place, Align2::CENTER_CENTER, &title, fonts::semibold(size::BAR), theme.text);
        return;
    }
    cards::card(ui, place, theme);
    let inner = place.shrink2(egui::vec2(if form == Form::Full { 20.0 } else { 16.0 }, 10.0));
    let mut y = inner.top();
    if form == Form::Full && inner.height() > 170.0 {
        let caption = Rect::from_min_max(inner.min, pos2(inner.right(), y + 26.0));
        words::line(
            ui,
            caption,
            Align2::LEFT_CENTER,
            scope.words.text("operator.now"),
            fonts::regular(size::BAR),
            theme.quiet,
        );
        y += 28.0;
    }
    let (largest, height) = match form {
        Form::Full => (size::NOW, 44.0),
        Form::Compact => (size::HEADER, 36.0),
        _ => (20.0, 28.0),
    };
    let fit = words::fitting_size(ui, &title, fonts::semibold, inner.width(), largest, size::BAR);
    let line = Rect::from_min_max(pos2(inner.left(), y), pos2(inner.right(), y + height));
    words::line(ui, line, Align2::LEFT_CENTER, &title, fonts::semibold(fit), theme.text);
    y = line.bottom() + 6.0;
    let names = STEPS.map(|key| scope.words.text(key));
    let bar = Rect::from_min_max(pos2(inner.left(), y), pos2(inner.right(), (y + 38.0).min(inner.bottom())));
    cards::steps(ui, bar, &names, step(scope), theme);
    y = bar.bottom() + if form == Form::Full { 10.0 } else { 4.0 };
    let (note, rows) = match note(scope) {
        (note, _) if note.is_empty() => (cut.unwrap_or_default().to_owned(), 3),
        told => told,
    };
    let rest = Rect::from_min_max(pos2(inner.left(), y), inner.max);
    if rest.height() >= 16.0 {
        let points = if form == Form::Full { size::BAR } else { size::BODY };
        let rows = rows.min((rest.height() / (1.25 * points)) as usize).max(1);
        words::block(ui, rest, Align2::LEFT_TOP, &note, fonts::regular(points), theme.quiet, rows);
    }
}

/// Whether there is nothing to tell of what goes on: between two parts of a watched folder, too.
pub(super) fn is_quiet(facts: &Facts) -> bool {
    match &facts.job {
        Job::Idle => true,
        Job::Running(running) => running.watch && running.scan.is_none() && running.stage.is_none(),
        _ => false,
    }
}

/// How many steps are done; `None` = nothing goes on.
fn step(scope: &Scope) -> Option<usize> {
    let stage = scope.facts.running()?.scan.as_ref()?.stage?;
    Some(match stage {
        Stage::Prepare | Stage::Read | Stage::Hash | Stage::Register | Stage::Merge => 0,
        Stage::Background => 1,
        Stage::BestFit => 2,
        Stage::Features => 3,
        Stage::Comparison | Stage::Map => 4,
        Stage::Report => 5,
    })
}

pub(in crate::gui) fn stage_words(words: &Words, stage: Option<Stage>) -> &str {
    stage.map_or("", |stage| {
        words.text(match stage {
            Stage::Prepare => "stage.prepare",
            Stage::Read => "stage.read",
            Stage::Hash => "stage.hash",
            Stage::Background => "stage.background",
            Stage::BestFit => "stage.best_fit",
            Stage::Features => "stage.features",
            Stage::Comparison => "stage.comparison",
            Stage::Map => "stage.map",
            Stage::Report => "stage.report",
            Stage::Register => "stage.register",
            Stage::Merge => "stage.merge",
        })
    })
}

/// The line that tells what goes on.
fn title(scope: &Scope) -> String {
    let (facts, words) = (scope.facts, scope.words);
    match &facts.job {
        Job::Opening { path, stage } => {
            let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
            with_stage(&words.fill("operator.opening", &[("plan", &name)]), stage_words(words, *stage))
        }
        Job::Fetching { wanted: Wanted::Part(part) } => {
            let n = facts.parts.get(*part).map_or(0, |p| p.index);
            words.fill("operator.fetching", &[("n", &words.thousands(n))])
        }
        Job::Fetching { wanted: Wanted::Earlier(at) } => {
            let scan = facts.earlier_results().get(*at).map_or("", |earlier| &earlier.stored.identity.scan_file);
            words.fill("operator.inspecting_again", &[("scan", &clean(scan))])
        }
        Job::Trying { scan, stage } => {
            let name = crate::gui::engineer::short_name(scan);
            with_stage(&words.fill("operator.trying", &[("scan", &name)]), stage_words(words, *stage))
        }
        Job::Running(running) => running_title(running, words),
        Job::Merging(_) => words.text("operator.not_while_merging").to_owned(),
        Job::Idle => idle_title(scope),
    }
}

fn with_stage(what: &str, stage: &str) -> String {
    if stage.is_empty() { what.to_owned() } else { format!("{what}, {stage}") }
}

fn running_title(running: &Running, words: &Words) -> String {
    match &running.scan {
        _ if running.stopping => match &running.scan {
            Some(scan) => words.fill("operator.stopping_after", &[("n", &words.thousands(scan.index))]),
            None => words.text("operator.stopping").to_owned(),
        },
        Some(scan) => {
            let n = words.thousands(scan.index);
            let part = match running.of {
                Some(of) => words.fill("operator.part_n_of", &[("n", &n), ("of", &words.thousands(of))]),
                None => words.fill("operator.part_n", &[("n", &n)]),
            };
            with_stage(&part, stage_words(words, scan.stage))
        }
        None if running.stage.is_some() => capital(stage_words(words, running.stage)),
        None if running.watch => words.text("operator.waiting_for_scans").to_owned(),
        None => words.text("operator.starting").to_owned(),
    }
}

fn idle_title(scope: &Scope) -> String {
    let (facts, words) = (scope.facts, scope.words);
    let Some(end) = &facts.last_end else {
        let key = may_run(facts).err().unwrap_or("operator.waiting_for_you");
        return words.text(key).to_owned();
    };
    let last = facts.judged().map(|p| words.thousands(p.index));
    match (end.stopped, last) {
        (true, Some(n)) => words.fill("operator.stopped_after", &[("n", &n)]),
        (true, None) => words.text("operator.stopped").to_owned(),
        (false, _) if end.error.is_some() => words.text("operator.ended_early").to_owned(),
        (false, _) if end.unwritten > 0 => words.count("operator.unwritten", end.unwritten),
        (false, _) => words.count("operator.done", end.measured() + end.refused),
    }
}

/// The lines below the steps, and how many of them there may be.
fn note(scope: &Scope) -> (String, usize) {
    let (facts, words) = (scope.facts, scope.words);
    // Why there is no verdict stands on the verdict's card.
    if facts.troubles.results.is_some() || facts.troubles.plan.is_some() {
        return (words.text("operator.trying_again").to_owned(), 1);
    }
    if let Some(unfinished) = facts.troubles.unfinished.last() {
        let name = |scan: &Path| scan.file_name().map(|n| clean(&n.to_string_lossy())).unwrap_or_default();
        let names: Vec<String> = facts.troubles.unfinished.iter().map(|u| name(&u.scan)).collect();
        let values = [("scan", names.join(", ")), ("why", clean(&words.library(&unfinished.why.message)))];
        let key = if names.len() == 1 { "operator.not_whole" } else { "operator.several_not_whole" };
        return (words.fill(key, &values.each_ref().map(|(k, v)| (*k, v.as_str()))), 3);
    }
    match &facts.job {
        Job::Running(running) => (running_note(running, scope), 2),
        Job::Idle => (idle_note(scope), 2),
        _ => (String::new(), 1),
    }
}

fn running_note(running: &Running, scope: &Scope) -> String {
    let words = scope.words;
    let Some(scan) = &running.scan else { return String::new() };
    let name = scan.path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let seconds = words.number(scan.since.elapsed().as_secs_f64(), 1);
    let so_far = words.fill("operator.so_far", &[("scan", &clean(&name)), ("s", &seconds)]);
    match (seconds_a_part(scope), running.of) {
        (Some(each), Some(of)) if running.done > 0 => {
            let left = each * of.saturating_sub(running.done) as f64 - scan.since.elapsed().as_secs_f64();
            format!("{so_far}, {}", words.fill("operator.left", &[("time", &time(words, left.max(0.0)))]))
        }
        _ => so_far,
    }
}

fn idle_note(scope: &Scope) -> String {
    let facts = scope.facts;
    if let Some(end) = &facts.last_end {
        return match &end.error {
            // The reason stands on the verdict's card, its place here.
            Some(error) if facts.failure().is_some() => error.place().unwrap_or_default(),
            Some(error) => capital(&sentence(error, scope.words)),
            None => String::new(),
        };
    }
    String::new()
}

/// Mean seconds of the last ten parts that were measured in the sequence at hand, or else in the last one. A scan that is refused
/// at once would make the line look faster than it is.
pub(super) fn seconds_a_part(scope: &Scope) -> Option<f64> {
    let of_run = scope.facts.parts.get(scope.facts.run_from..)?;
    let measured = of_run.iter().rev().filter(|part| matches!(part.result.outcome, Outcome::Measured(_)));
    let times: Vec<Duration> = measured.take(10).map(|part| part.took).collect();
    (!times.is_empty()).then(|| times.iter().sum::<Duration>().as_secs_f64() / times.len() as f64)
}

/// A time as people say it: seconds, or minutes and seconds.
fn time(words: &Words, seconds: f64) -> String {
    let whole = seconds.round() as u64;
    if whole < 60 {
        words.fill("operator.seconds", &[("s", &whole.to_string())])
    } else {
        let (m, s) = ((whole / 60).to_string(), (whole % 60).to_string());
        words.fill("operator.minutes", &[("m", &m), ("s", &s)])
    }
}
