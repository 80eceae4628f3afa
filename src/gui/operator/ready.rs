//! What is checked before the first part: plan, CAD, scan folder, results folder; or the problems that keep
//! it from running.

use super::worst::{Row, RowSign, rows_ui};
use crate::diagnostic::{Diagnostic, Severity};
use crate::gui::scope::Scope;
use crate::gui::widgets::cards;
use crate::report::words::capital;
use egui::{Rect, Ui};

/// Draws the card.
pub(super) fn ready_ui(ui: &mut Ui, place: Rect, rows: usize, scope: &Scope) {
    cards::card(ui, place, scope.theme);
    let problems: Vec<Row> = scope
        .facts
        .problems
        .iter()
        .map(|problem| Row {
            sign: RowSign::Problem(problem.severity == Severity::Error),
            sentence: capital(&problem.message),
            note: note(problem),
        })
        .collect();
    if problems.is_empty() {
        rows_ui(ui, place, scope.words.text("operator.before"), rows, &checks(scope), scope.theme);
    } else {
        let title = scope.words.count("operator.problems", problems.len());
        rows_ui(ui, place, &title, rows, &problems, scope.theme);
    }
}

/// What to do about a problem, and where it stands.
fn note(problem: &Diagnostic) -> String {
    let help = problem.help.as_deref().map(capital);
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
    vec![
        row(true, "operator.plan_is_sound", format!("{}, {points}", name(&plan.path))),
        row(cad.is_some(), "operator.cad_is_ready", cad.unwrap_or_default()),
        row(matches!(&facts.scans, Some(Ok(_))), "operator.folder_is_read", scans),
        row(true, "operator.results_are_written", plan.output.folder.clone()),
    ]
}
