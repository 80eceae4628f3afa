//! The plan as it is edited, tried on a scan: what changes.

use super::editing::Editing;
use super::lower::{entry_ui, quiet_ui};
use crate::diagnostic::Severity;
use crate::gui::app::App;
use crate::gui::bridge::{self, TryOrder};
use crate::gui::facts::{Facts, FinishedPart, Job};
use crate::gui::fonts;
use crate::gui::scope::Scope;
use crate::gui::text::Words;
use crate::gui::theme::size;
use crate::gui::widgets::sign::Sign;
use crate::report::differences::{PointDifference, Reading};
use crate::worker::NoTrial;
use egui::{RichText, Ui};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The scan to try on: that of the last part that was measured, else the first one of the folder. Else the key of why there is none.
pub fn scan(facts: &Facts) -> Result<(PathBuf, Option<Arc<FinishedPart>>), &'static str> {
    if facts.running().is_some() {
        return Err("engineer.not_while_running");
    }
    // A scan that was refused tells little of a plan.
    let measured = |part: &&Arc<FinishedPart>| matches!(part.result.outcome, crate::inspect::Outcome::Measured(_));
    if let Some(part) = facts.parts.iter().rfind(measured).or(facts.parts.last()) {
        return Ok((part.scan_path.clone(), Some(part.clone())));
    }
    match facts.scans.as_ref() {
        Some(Ok(scans)) if !scans.is_empty() => Ok((scans[0].clone(), None)),
        _ => Err("engineer.no_scan"),
    }
}

/// Begins.
pub(super) fn begin(app: &mut App) {
    let Ok((scan, part)) = scan(&app.facts) else { return };
    let Some(editing) = &app.facts.editing else { return };
    if !matches!(app.facts.job, Job::Idle | Job::Fetching { .. }) {
        return;
    }
    let order = TryOrder {
        document: editing.document.snapshot(),
        version: editing.version,
        known: app.facts.plan.clone().zip(app.facts.part.clone()),
        before: part.map(|part| part.result.clone()),
        scan: scan.clone(),
    };
    app.facts.job = Job::Trying { scan, stage: None };
    app.begin(bridge::Job::Try(Box::new(order)));
}

/// Why there was no trial, as a message.
pub(in crate::gui) fn fault(why: &NoTrial) -> Option<crate::diagnostic::Diagnostic> {
    match why {
        NoTrial::Cancelled(_) => None,
        NoTrial::Cad(told) => Some((**told).clone()),
        NoTrial::NotSound(_) => {
            let told = crate::diagnostic::Diagnostic::error(why.to_string());
            Some(told.with_help("solve the problems that are listed, then try again"))
        }
    }
}

/// Draws what changes.
pub fn trial_ui(ui: &mut Ui, scope: &Scope, editing: &Editing) {
    let words = scope.words;
    let Some((version, trial)) = &editing.trial else { return };
    let trial = match trial {
        Ok(trial) => trial,
        Err(told) => {
            let error = told.severity == Severity::Error;
            let help = told.help.as_deref().map(|help| words.told(help)).unwrap_or_default();
            entry_ui(ui, scope, Some(error), &words.told(&told.message), &help, None);
            return;
        }
    };
    if *version != editing.version {
        quiet_ui(ui, scope, words.text("engineer.trial_old"));
    }
    let scan = &trial.inspected.result.identity.scan_file;
    ui.add_space(8.0);
    ui.horizontal(|ui| {
        ui.add_space(14.0);
        let (at, _) = ui.allocate_exact_size(egui::Vec2::splat(20.0), egui::Sense::hover());
        Sign::of(&trial.inspected.result).paint(ui.painter(), at, scope.theme);
        let text = verdict_words(words, trial);
        ui.label(RichText::new(text).font(fonts::semibold(size::BODY)));
        ui.label(RichText::new(scan.as_str()).size(size::NOTE).color(scope.theme.quiet));
    });
    ui.add_space(4.0);
    let changed = changes(words, &trial.points);
    for point in &changed {
        entry_ui(ui, scope, None, &difference_words(words, point), "", None);
    }
    let same = trial.points.len() - changed.len();
    quiet_ui(ui, scope, &words.count("engineer.as_before", same));
}

/// Points of which something that is shown is another one, those with another verdict first.
fn changes<'p>(words: &Words, points: &'p [PointDifference]) -> Vec<&'p PointDifference> {
    let shown = |reading: &Option<Reading>| reading.as_ref().map(|r| self::reading(words, r));
    let verdict = |reading: &Option<Reading>| reading.as_ref().map(|r| r.verdict);
    let mut changed: Vec<_> = points.iter().filter(|p| shown(&p.before) != shown(&p.after)).collect();
    changed.sort_by_key(|p| verdict(&p.before) == verdict(&p.after));
    changed
}

fn verdict_words(words: &Words, trial: &crate::worker::Trial) -> String {
    let after = Sign::of(&trial.inspected.result).word(words).to_owned();
    match trial.before.as_deref().map(|before| Sign::of(before).word(words)) {
        Some(before) if before != after => words.fill("engineer.from_to", &[("before", before), ("after", &after)]),
        Some(_) => words.fill("engineer.verdict_as_before", &[("verdict", &after)]),
        None => after,
    }
}

fn reading(words: &Words, reading: &Reading) -> String {
    let verdict = words.text(match reading.verdict {
        crate::inspect::Verdict::Pass => "verdict.pass",
        crate::inspect::Verdict::Fail => "verdict.fail",
        crate::inspect::Verdict::Undecided => "verdict.undecided",
        crate::inspect::Verdict::NotMeasured => "results.no_value",
    });
    match (reading.deviation_mm, reading.uncertainty_mm) {
        (Some(mm), Some(u)) => format!("{} ± {} mm, {verdict}", words.signed_mm(mm), words.number(u, 3)),
        (Some(mm), None) => format!("{} mm, {verdict}", words.signed_mm(mm)),
        _ => verdict.to_owned(),
    }
}

/// `P03: +0.200 ± 0.010 mm, Pass, now +0.250 ± 0.010 mm, Fail`.
fn difference_words(words: &Words, point: &PointDifference) -> String {
    let told = match (&point.before, &point.after) {
        (Some(before), Some(after)) => {
            let (before, after) = (reading(words, before), reading(words, after));
            words.fill("engineer.from_to", &[("before", &before), ("after", &after)])
        }
        (None, Some(after)) => words.fill("engineer.trial_new", &[("after", &reading(words, after))]),
        (Some(before), None) => words.fill("engineer.trial_gone", &[("before", &reading(words, before))]),
        (None, None) => String::new(),
    };
    format!("{}: {told}", point.name)
}

/// What a scan is called in a message.
pub(in crate::gui) fn short_name(scan: &Path) -> String {
    scan.file_stem().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gui::text::Language;
    use crate::inspect::Verdict;

    #[test]
    fn only_what_reads_otherwise_is_a_change_and_other_verdicts_come_first() {
        let reading = |mm: f64, verdict| {
            Some(Reading {
                verdict,
                deviation_mm: Some(mm),
                uncertainty_mm: Some(0.0591),
                reason: None,
                tolerance_ratio: None,
            })
        };
        let point = |name: &str, before, after| PointDifference { name: name.into(), before, after };
        let points = [
            point("P01", reading(-0.0731, Verdict::Pass), reading(-0.0733, Verdict::Pass)),
            point("P02", reading(-0.0731, Verdict::Pass), reading(-0.0751, Verdict::Pass)),
            point("P03", reading(0.4999, Verdict::Undecided), reading(0.5001, Verdict::Fail)),
            point("P04", None, reading(0.1, Verdict::Pass)),
        ];
        let words = Words::of(Language::English);
        let names: Vec<&str> = changes(words, &points).iter().map(|p| &*p.name).collect();
        assert_eq!(names, ["P03", "P04", "P02"]);
    }
}
