//! What is known of views in sentences: of the chosen one, of those that are left out, or why there are none.

use super::facts::{Merging, ViewsState};
use super::figures::{self, NONE};
use super::views::{Row, short};
use crate::diagnostic::{Diagnostic, Severity};
use crate::geometry::LengthUnit;
use crate::gui::fonts;
use crate::gui::messages::sentence;
use crate::gui::scope::Scope;
use crate::gui::text::Words;
use crate::gui::theme::size;
use crate::gui::widgets::sign;
use egui::{Rect, ScrollArea, Sense, Ui, vec2};

/// What is known of the chosen view, or of those that are left out, in sentences.
pub fn told_ui(
    ui: &mut Ui,
    at: Rect,
    rows: &[Row],
    merging: &Merging,
    chosen: Option<usize>,
    unit: LengthUnit,
    scope: &Scope,
) {
    let words = scope.words;
    let mut lines: Vec<(String, bool)> = Vec::new();
    match chosen.and_then(|k| rows.get(k)) {
        Some(row) => lines.extend(sentences(row, unit, words).into_iter().map(|text| (text, false))),
        None => {
            for row in rows {
                if let Some(why) = &row.left_out {
                    let title = words.fill("merge.left_out", &[("view", &short(&row.name))]);
                    lines.push((format!("{title} {}", full_stop(why)), true));
                }
            }
            let weak = rows.iter().filter(|row| !row.weak.is_empty()).count();
            if weak > 0 {
                lines.push((words.count("merge.weak", weak), true));
            }
            if let Some(fault) = merging.preview().and_then(|preview| preview.no_poses.as_ref()) {
                lines.push((words.with_help(&sentence(fault, words), fault.help.as_deref()), true));
            }
            lines.push((words.text("merge.choose_a_view").to_owned(), false));
        }
    }
    lines_ui(ui, at, "told", &lines, scope);
}

/// Sentences below each other, those that people must see with a sign.
pub fn lines_ui(ui: &mut Ui, at: Rect, id: &str, lines: &[(String, bool)], scope: &Scope) {
    let theme = scope.theme;
    ui.scope_builder(egui::UiBuilder::new().max_rect(at), |ui| {
        ScrollArea::vertical().id_salt(id).auto_shrink(false).min_scrolled_height(0.0).show(ui, |ui| {
            ui.spacing_mut().item_spacing.y = 3.0;
            for (text, warns) in lines {
                ui.horizontal_top(|ui| {
                    if *warns {
                        let (mark, _) = ui.allocate_exact_size(vec2(16.0, 16.0), Sense::hover());
                        sign::problem(ui.painter(), mark, false, theme);
                    }
                    let text = egui::RichText::new(text).font(fonts::regular(size::TABLE)).color(theme.text);
                    ui.add(egui::Label::new(text).wrap());
                });
            }
        });
    });
}

fn full_stop(text: &str) -> String {
    if text.ends_with('.') { text.to_owned() } else { format!("{text}.") }
}

/// All that is known of a view.
fn sentences(row: &Row, unit: LengthUnit, words: &Words) -> Vec<String> {
    let view = short(&row.name);
    if let Some(why) = &row.left_out {
        return vec![format!("{} {}", words.fill("merge.left_out", &[("view", &view)]), full_stop(why))];
    }
    let mut all = Vec::new();
    if let (Some(read), Some(kept)) = (row.read, row.kept) {
        let share = figures::percent(1.0 - kept as f64 / read.max(1) as f64, words);
        let (read, kept) = (words.thousands(read), words.thousands(kept));
        let values = [("view", view.as_str()), ("read", &read), ("kept", &kept), ("masked", &share)];
        all.push(words.fill("merge.told_points", &values));
    }
    if let Some(agreement) = row.agreement {
        let rms = row.rms.map_or_else(|| NONE.to_owned(), |rms| figures::with_unit(rms, unit, words));
        let values = [("agreement", figures::percent(agreement, words)), ("rms", rms)];
        all.push(words.fill("merge.told_overlap", &values.each_ref().map(|(key, value)| (*key, value.as_str()))));
    }
    if let (Some(moved), Some(turned)) = (row.moved, row.turned) {
        let u = row.place_u.map_or_else(|| NONE.to_owned(), |u| figures::with_unit(u, unit, words));
        let (moved, turned) = (figures::with_unit(moved, unit, words), words.number(turned.to_degrees(), 3));
        all.push(words.fill("merge.told_moved", &[("moved", &moved), ("deg", &turned), ("u", &u)]));
    }
    all.extend(row.weak.iter().map(|weak| full_stop(weak)));
    all
}

/// What stands where there are no views yet: what is read, or what is wrong.
pub fn states_ui(ui: &mut Ui, at: Rect, merging: &Merging, scope: &Scope) {
    let words = scope.words;
    let mut lines: Vec<(String, bool)> = Vec::new();
    for problem in &merging.problems {
        lines.push((problem_words(problem, merging, words), problem.severity == Severity::Error));
    }
    match &merging.views {
        ViewsState::Failed(fault) => {
            lines.push((words.with_help(&sentence(fault, words), fault.help.as_deref()), true))
        }
        ViewsState::Reading(Some((index, of, name))) => {
            let (n, of) = (words.thousands(*index), words.thousands(*of));
            lines.push((words.fill("merge.reading", &[("n", &n), ("of", &of), ("name", name)]), false));
        }
        ViewsState::Reading(None) => lines.push((words.text("merge.reading_settings").to_owned(), false)),
        ViewsState::None => lines.push((words.text("merge.mend_and_read_again").to_owned(), false)),
        ViewsState::Ready(_) => {}
    }
    lines_ui(ui, at, "states", &lines, scope);
}

/// A problem with its place and what to do. The name of the settings stands over it already.
fn problem_words(problem: &Diagnostic, merging: &Merging, words: &Words) -> String {
    let is_own = problem.file.as_ref().is_none_or(|file| *file == merging.path);
    let told = match (is_own, problem.line) {
        (true, Some(line)) => {
            let what = sentence(&Diagnostic { file: None, ..problem.clone() }, words);
            words.fill("merge.in_line", &[("line", &line.to_string()), ("what", &what)])
        }
        (true, None) => sentence(&Diagnostic { file: None, ..problem.clone() }, words),
        (false, _) => sentence(problem, words),
    };
    words.with_help(&told, problem.help.as_deref())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gui::text::Language;
    use crate::plan::merge::parse;
    use std::path::Path;

    #[test]
    fn a_problem_names_its_place_once() {
        let path = Path::new("/far/away/own.file");
        let text = "schema = 1\nunit = \"um\"\n[mask]\nd_cal = { max = \"far\" }\n";
        let mut merging = Merging::new(path.into(), text.into(), parse(text.as_bytes(), path));
        merging.problems.push(Diagnostic::error("found nothing").in_file(Path::new("/far/views.json")).at_line(4));
        let told = |k: usize| problem_words(&merging.problems[k], &merging, Words::of(Language::English));
        let last = merging.problems.len() - 1;
        let own = (0..last).map(told).find(|text| text.contains("d_cal max")).expect("the mask has no number");
        assert!(own.starts_with("Line 4: [mask] d_cal max: found text") && !own.contains("own.file"), "{own}");
        assert_eq!(told(last), "/far/views.json:4: found nothing");
    }
}
