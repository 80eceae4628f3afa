//! Below the 3D view: problems, what changed since the last revision, what the plan makes of a scan.

use super::editing::{Edit, Editing};
use super::fields::without_place;
use super::layout::{Breadth, Places};
use super::state::{EngineerView, Lower};
use super::{tree, trial};
use crate::diagnostic::Severity;
use crate::gui::action::Action;
use crate::gui::fonts;
use crate::gui::scope::Scope;
use crate::gui::theme::size;
use crate::gui::widgets::{cards, sign, words as write};
use crate::plan::document::{At, List, PlanProblem};
use crate::report::words::clean;
use egui::{Align, Align2, Button, Id, Layout, Rect, RichText, ScrollArea, Sense, Stroke, Ui, Vec2, pos2, vec2};

const HEAD: f32 = 36.0;

/// Draws both places, or the one that they share.
pub fn lower_ui(ui: &mut Ui, places: &Places, scope: &mut Scope, view: &mut EngineerView, editing: &Editing) {
    let (Some(problems), Some(changes)) = (places.problems, places.changes) else { return };
    if places.breadth == Breadth::Wide {
        card_ui(ui, problems, Lower::Problems, &[], scope, view, editing);
        let right = if view.lower == Lower::Trial { Lower::Trial } else { Lower::Changes };
        let tabs: &[Lower] = if editing.trial.is_some() { &[Lower::Changes, Lower::Trial] } else { &[] };
        card_ui(ui, changes, right, tabs, scope, view, editing);
    } else {
        let tabs: &[Lower] = match editing.trial {
            Some(_) => &[Lower::Problems, Lower::Changes, Lower::Trial],
            None => &[Lower::Problems, Lower::Changes],
        };
        card_ui(ui, problems, view.lower, tabs, scope, view, editing);
    }
}

fn card_ui(
    ui: &mut Ui,
    at: Rect,
    shown: Lower,
    tabs: &[Lower],
    scope: &mut Scope,
    view: &mut EngineerView,
    editing: &Editing,
) {
    cards::card(ui, at, scope.theme);
    let head = at.with_max_y(at.top() + HEAD).shrink2(vec2(14.0, 0.0));
    if tabs.is_empty() {
        let (title, note) = title(shown, scope, editing);
        let wide = write::width(ui, &title, fonts::semibold(size::BODY)) + 14.0;
        write::line(ui, head, Align2::LEFT_CENTER, &title, fonts::semibold(size::BODY), scope.theme.text);
        let rest = head.with_min_x(head.left() + wide);
        write::line(ui, rest, Align2::LEFT_CENTER, &note, fonts::regular(size::TABLE), scope.theme.quiet);
    } else {
        let builder = egui::UiBuilder::new().max_rect(head).layout(Layout::left_to_right(Align::Center));
        ui.scope_builder(builder, |ui| {
            for tab in tabs {
                let (title, _) = title(*tab, scope, editing);
                if ui.selectable_label(shown == *tab, RichText::new(title).font(fonts::semibold(size::TABLE))).clicked()
                {
                    view.lower = *tab;
                }
            }
        });
    }
    ui.painter().hline(at.x_range(), head.bottom(), Stroke::new(1.0, scope.theme.stroke));
    let body = at.with_min_y(head.bottom() + 1.0).shrink2(vec2(1.0, 1.0));
    ui.scope_builder(egui::UiBuilder::new().max_rect(body), |ui| {
        ui.set_clip_rect(body.intersect(ui.clip_rect()));
        ui.spacing_mut().item_spacing.y = 0.0;
        let area = ScrollArea::vertical().id_salt(Id::unique("engineer lower").with(format!("{shown:?}")));
        area.auto_shrink(false).show(ui, |ui| match shown {
            Lower::Problems => problems_ui(ui, scope, view, editing),
            Lower::Changes => changes_ui(ui, scope, editing),
            Lower::Trial => trial::trial_ui(ui, scope, editing),
        });
    });
}

/// What a card is called, and what it says beside that.
fn title(of: Lower, scope: &Scope, editing: &Editing) -> (String, String) {
    let words = scope.words;
    match of {
        Lower::Problems => {
            let count = |severity| editing.problems.iter().filter(|p| p.diagnostic.severity == severity).count();
            let (errors, warnings) = (count(Severity::Error), count(Severity::Warning));
            let note = match (errors, warnings) {
                _ if editing.checked.is_none() => words.text("engineer.being_checked").to_owned(),
                (0, 0) => words.text("engineer.no_problems").to_owned(),
                _ => format!(
                    "{}, {}, {}",
                    words.count("engineer.errors", errors),
                    words.count("engineer.warnings", warnings),
                    words.text("engineer.checked")
                ),
            };
            let all = errors + warnings;
            let title = words.text("engineer.problems");
            (if all == 0 { title.to_owned() } else { format!("{title} {}", words.thousands(all)) }, note)
        }
        Lower::Changes => {
            let revision = super::save::revision(editing);
            let title = match revision.is_empty() {
                true => words.text("engineer.changed").to_owned(),
                false => words.fill("engineer.changed_since", &[("revision", &revision)]),
            };
            (title, words.count("engineer.changes", editing.changes().len()))
        }
        Lower::Trial => (words.text("engineer.trial").to_owned(), String::new()),
    }
}

fn problems_ui(ui: &mut Ui, scope: &mut Scope, view: &mut EngineerView, editing: &Editing) {
    if editing.problems.is_empty() {
        let key = if editing.checked.is_some() { "engineer.no_problems" } else { "engineer.being_checked" };
        quiet_ui(ui, scope, scope.words.text(key));
    }
    let mut all: Vec<&PlanProblem> = editing.problems.iter().collect();
    all.sort_by_key(|p| std::cmp::Reverse(p.diagnostic.severity));
    for problem in all {
        let (told, error) = (&problem.diagnostic, problem.diagnostic.severity == Severity::Error);
        let what = format!(
            "{}: {}",
            subject(problem, scope, editing),
            clean(without_place(&scope.words.library(&told.message)))
        );
        let help = told.help.as_deref().map(|help| scope.words.told(help)).unwrap_or_default();
        let go = scope.words.text("engineer.go_to_field");
        let clicked = entry_ui(ui, scope, Some(error), &what, &help, Some(go));
        if clicked {
            go_to(view, editing, problem);
        }
    }
}

/// What a problem is about: a point's name, a section.
fn subject(problem: &PlanProblem, scope: &Scope, editing: &Editing) -> String {
    let name = |list, k: usize| editing.rows(list).get(k).map(|row| row.name.clone()).filter(|name| !name.is_empty());
    let row = match problem.place.at {
        At::Feature(k) => name(List::Feature, k),
        At::Comparison(k) => name(List::Comparison, k),
        _ => None,
    };
    if Some(problem.place.at) == editing.proposed() {
        return scope.words.text("engineer.new_point").to_owned();
    }
    row.unwrap_or_else(|| scope.words.text(tree::section_key(tree::section_of(problem.place.at))).to_owned())
}

/// Shows the field of a problem, or the form that is nearest to it.
fn go_to(view: &mut EngineerView, editing: &Editing, problem: &PlanProblem) {
    let key = problem.place.key.as_deref();
    let proposed = Some(problem.place.at) == editing.proposed();
    let (field, list, row) = match problem.place.at {
        _ if proposed => ("draft".to_owned(), None, 0),
        At::Feature(k) => (format!("feature.{k}"), Some(List::Feature), k),
        At::Comparison(k) => (format!("comparison.{k}"), Some(List::Comparison), k),
        At::Settings(table) => (table.to_owned(), None, 0),
        At::Lock(k) => (format!("lock.{k}"), None, 0),
        At::Region(k) => (format!("region.{k}"), None, 0),
        At::Plan | At::PointsFile | At::OtherFile => (String::new(), None, 0),
    };
    match list {
        Some(list) => view.choose(list, row),
        None if !proposed => tree::choose(view, tree::section_of(problem.place.at)),
        None => {}
    }
    let vectors = ["position", "centre", "direction", "axis", "normal", "view_direction", "size_mm"];
    view.focus = key.map(|key| match vectors.contains(&key) {
        true => format!("{field}.{key}.0"),
        false => format!("{field}.{key}"),
    });
}

fn changes_ui(ui: &mut Ui, scope: &mut Scope, editing: &Editing) {
    let words = scope.words;
    for change in editing.changes() {
        let undo = change.can_be_taken_back().then(|| words.text("engineer.undo_this"));
        if entry_ui(ui, scope, None, &super::told::change(words, change), "", undo) {
            scope.ask(Action::Edit(Edit::TakeBack(change.clone())));
        }
    }
    quiet_ui(ui, scope, words.text("engineer.saving_asks"));
}

/// A sentence in quiet words.
pub fn quiet_ui(ui: &mut Ui, scope: &Scope, text: &str) {
    ui.add_space(10.0);
    ui.horizontal_top(|ui| {
        ui.add_space(14.0);
        ui.add(egui::Label::new(RichText::new(text).size(size::TABLE).color(scope.theme.quiet)).wrap());
    });
}

/// An entry of a list: a square where something is wrong, what it is, what to do, a button. Returns whether that was clicked.
pub fn entry_ui(ui: &mut Ui, scope: &Scope, error: Option<bool>, what: &str, help: &str, button: Option<&str>) -> bool {
    let theme = scope.theme;
    let mut clicked = false;
    let top = ui.cursor().top();
    ui.add_space(7.0);
    ui.horizontal_top(|ui| {
        ui.add_space(14.0);
        if let Some(error) = error {
            let (square, _) = ui.allocate_exact_size(Vec2::splat(18.0), Sense::hover());
            sign::problem(ui.painter(), square, error, theme);
        }
        let wide = button.map_or(0.0, |text| write::width(ui, text, fonts::regular(size::NOTE)) + 32.0);
        let text = (ui.available_width() - wide - 20.0).max(80.0);
        ui.allocate_ui_with_layout(vec2(text, 18.0), Layout::top_down(Align::Min), |ui| {
            ui.set_width(text);
            let font = if error.is_some() { fonts::semibold(size::TABLE) } else { fonts::regular(size::TABLE) };
            ui.add(egui::Label::new(RichText::new(what).font(font).color(theme.text)).wrap());
            if !help.is_empty() {
                ui.add(egui::Label::new(RichText::new(help).size(size::NOTE).color(theme.quiet)).wrap());
            }
        });
        if let Some(button) = button {
            clicked = ui.add(Button::new(RichText::new(button).size(size::NOTE)).min_size(vec2(0.0, 24.0))).clicked();
        }
    });
    ui.add_space(7.0);
    let bottom = ui.cursor().top();
    if bottom > top {
        let x = ui.max_rect().x_range();
        ui.painter().line_segment([pos2(x.min, bottom), pos2(x.max, bottom)], Stroke::new(1.0, theme.raised));
    }
    clicked
}
