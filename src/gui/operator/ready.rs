//! What is checked before the first part: plan, CAD, scan folder, results folder; or the problems that keep
//! it from running.

use super::worst::{Row, RowSign, rows_ui};
use crate::diagnostic::{Diagnostic, Severity};
use crate::gui::NewPlanCommand as Command;
use crate::gui::action::Action;
use crate::gui::facts::{Facts, Job};
use crate::gui::fonts;
use crate::gui::scope::Scope;
use crate::gui::text::Words;
use crate::gui::theme::size;
use crate::gui::widgets::buttons::{self, Weight};
use crate::gui::widgets::{cards, sign, words};
use egui::{Align2, Rect, Stroke, Ui, Vec2, pos2, vec2};

/// Draws the card.
pub(super) fn ready_ui(ui: &mut Ui, place: Rect, rows: usize, scope: &mut Scope) {
    cards::card(ui, place, scope.theme);
    if problems(scope.facts).is_empty() {
        // What is needed to go on, once there was a part.
        let begun = scope.facts.run_from < scope.facts.parts.len();
        let title = scope.words.text(if begun { "operator.to_go_on" } else { "operator.before" });
        rows_ui(ui, place, title, rows, &checks(scope), scope.theme);
    } else {
        problems_ui(ui, place, scope);
    }
    if matches!(scope.facts.job, Job::Idle) {
        new_plan_ui(ui, place, scope);
    }
}

/// The way to a plan for another part; the engineer's password stands before it.
fn new_plan_ui(ui: &mut Ui, place: Rect, scope: &mut Scope) {
    let text = scope.words.text("bar.new_plan");
    let wide = words::width(ui, text, fonts::regular(size::BAR)) + 40.0;
    let corner = pos2(place.right() - 16.0, place.top() + 6.0);
    let at = Rect::from_min_max(pos2(corner.x - wide, corner.y), pos2(corner.x, corner.y + 32.0));
    let font = fonts::regular(size::BAR);
    if buttons::with_words(ui, "new plan", at, Weight::Quiet, text, font, scope.theme).clicked() {
        scope.ask(Action::NewPlan(Command::Start { cad: None, scan: None }));
    }
}

/// What was told when the plan was opened and by the last run, errors first, each once. What concerns a single scan stands with its part.
fn problems(facts: &Facts) -> Vec<&Diagnostic> {
    let scans = facts.plan.as_ref().map(|plan| &plan.scans.path);
    let is_of_scan = |p: &Diagnostic| p.file.as_ref().is_some_and(|file| file.parent() == scans.map(|s| s.as_path()));
    let is_of_plan = |p: &Diagnostic| {
        let file = p.file.as_ref();
        facts.plan.as_ref().is_some_and(|plan| file == Some(&plan.path) || file == Some(&plan.cad.path))
    };
    let failure = facts.failure().filter(|failure| is_of_plan(failure));
    let of_run = facts.run_problems.iter().filter(|problem| !is_of_scan(problem)).chain(failure);
    let mut problems: Vec<&Diagnostic> = facts.problems.iter().collect();
    for problem in of_run {
        if !problems.iter().any(|known| known.message == problem.message) {
            problems.push(problem);
        }
    }
    problems.sort_by_key(|problem| problem.severity != Severity::Error);
    problems
}

/// As many problems as fit, errors first, none of them cut; the last line tells how many are left.
fn problems_ui(ui: &mut Ui, place: Rect, scope: &Scope) {
    let (words, theme) = (scope.words, scope.theme);
    let inner = place.shrink2(vec2(20.0, 8.0));
    let head = inner.with_max_y(inner.top() + if place.height() > 150.0 { 34.0 } else { 22.0 });
    let problems = problems(scope.facts);
    let title = words.count("operator.problems", problems.len());
    words::line(ui, head, Align2::LEFT_CENTER, &title, fonts::semibold(size::BAR), theme.text);
    let last_line = 24.0;
    let mut top = head.bottom();
    for (k, problem) in problems.iter().enumerate() {
        let left = inner.left() + 40.0;
        let wrapped = |text: String, font, colour| ui.painter().layout(text, font, colour, inner.right() - left);
        let sentence = wrapped(words.told(&problem.message), fonts::semibold(size::BODY), theme.text);
        let note = wrapped(note(problem, words), fonts::regular(size::TABLE), theme.quiet);
        let height = sentence.size().y + note.size().y + 12.0;
        // Room for the line that tells of the rest, unless this is the last one.
        let needed = height + if k + 1 < problems.len() { last_line } else { 0.0 };
        if top + needed > inner.bottom() {
            let rest = words.count("operator.more_problems", problems.len() - k);
            let line = inner.with_min_y(top).with_max_y(inner.bottom().min(top + last_line));
            words::line(ui, line, Align2::LEFT_CENTER, &rest, fonts::semibold(size::BODY), theme.text);
            break;
        }
        ui.painter().hline(inner.x_range(), top, Stroke::new(1.0, theme.stroke));
        let mark = Rect::from_center_size(pos2(inner.left() + 16.0, top + 18.0), Vec2::splat(20.0));
        sign::problem(ui.painter(), mark, problem.severity == Severity::Error, theme);
        let at = pos2(left, top + 6.0);
        let below = pos2(left, at.y + sentence.size().y);
        ui.painter().galley(at, sentence, theme.text);
        ui.painter().galley(below, note, theme.quiet);
        top += height;
    }
}

/// What to do about a problem, and where it stands.
fn note(problem: &Diagnostic, words: &Words) -> String {
    let help = problem.help.as_deref().map(|help| words.told(help));
    let name = problem.file.as_ref().and_then(|file| file.file_name()).map(|n| n.to_string_lossy().into_owned());
    let place = name.map(|name| problem.line.map_or(name.clone(), |line| format!("{name}:{line}")));
    [place, help].into_iter().flatten().collect::<Vec<_>>().join("   ")
}

fn checks(scope: &Scope) -> Vec<Row> {
    let (facts, words) = (scope.facts, scope.words);
    let Some(plan) = &facts.plan else { return Vec::new() };
    let row = |done: bool, key: &str, note: String| Row {
        sign: if done { RowSign::Check } else { RowSign::Open },
        sentence: words.text(key).to_owned(),
        note,
    };
    let wrong = |key: &str, note: String| Row { sign: RowSign::Wrong, sentence: words.text(key).to_owned(), note };
    let troubles = &facts.troubles;
    let name = |path: &std::path::Path| path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let points = words.count("operator.points", plan.comparison.len());
    let cad = facts.part.as_ref().map(|part| {
        let triangles = words.count("operator.triangles", part.triangles_in_file);
        format!("{}, {triangles}", plan.cad.file)
    });
    let scans = match &facts.scans {
        Some(Ok(scans)) => {
            let count = words.count("operator.scans", scans.len());
            scans.last().map_or(count.clone(), |last| {
                format!("{count}, {}", words.fill("operator.newest", &[("scan", &name(last))]))
            })
        }
        _ => String::new(),
    };
    let unwritten = troubles.results.is_some() || facts.last_end.as_ref().is_some_and(|end| end.unwritten > 0);
    vec![
        match &troubles.plan {
            None => row(true, "operator.plan_is_sound", format!("{}, {points}", name(&plan.path))),
            Some(_) => wrong("operator.plan_is_lost", name(&plan.path)),
        },
        row(cad.is_some(), "operator.cad_is_ready", cad.unwrap_or_default()),
        match &facts.scans {
            Some(Ok(_)) if troubles.folder.is_none() => row(true, "operator.folder_is_read", scans),
            _ => wrong("operator.folder_is_lost", plan.scans.folder.clone()),
        },
        match unwritten {
            false => row(true, "operator.results_are_written", plan.output.folder.clone()),
            true => wrong("operator.results_are_lost", plan.output.folder.clone()),
        },
    ]
}
