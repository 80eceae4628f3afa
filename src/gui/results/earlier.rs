//! A result from before this start: its table and reasons as they stand in its file, and its scan inspected again on demand.

use super::header::{self, Head};
use super::layout::{self, EarlierPlaces};
use super::table::{self, Columns};
use super::{ResultsView, Tab, measured_ui, refused_ui, tabs_ui, why};
use crate::gui::action::Action;
use crate::gui::earlier::may_inspect;
use crate::gui::facts::{FinishedPart, Job, Wanted};
use crate::gui::fonts;
use crate::gui::scope::Scope;
use crate::gui::theme::size;
use crate::gui::widgets::sign::{self, Sign};
use crate::gui::widgets::{cards, words as write};
use crate::inspect::Outcome;
use crate::report::stored::{StoredInspection, StoredOutcome};
use crate::worker::earlier::{Earlier, Seal};
use egui::{Align, Align2, Button, Label, Layout, Rect, RichText, ScrollArea, Ui, Vec2, vec2};
use std::sync::Arc;

/// What stands on the screen before the first part: that there is none, and the way to those from before this start.
pub(super) fn nothing_yet_ui(ui: &mut Ui, all: Rect, scope: &mut Scope) {
    let words = scope.words;
    let earlier = scope.facts.earlier_results().len();
    let text = words.text(if earlier > 0 { "operator.none_since" } else { "results.nothing_yet" });
    let line = Rect::from_center_size(all.center() - vec2(0.0, 24.0), vec2(all.width() - 24.0, 48.0));
    write::block(ui, line, Align2::CENTER_CENTER, text, fonts::regular(size::CARD), scope.theme.quiet, 2);
    if earlier > 0 {
        let text = words.count("results.show_earlier", earlier);
        let wide = write::width(ui, &text, fonts::regular(size::BODY)) + 32.0;
        let place = Rect::from_center_size(all.center() + vec2(0.0, 32.0), vec2(wide.min(all.width() - 24.0), 40.0));
        if ui.put(place, Button::new(RichText::new(text).size(size::BODY))).clicked() {
            scope.ask(Action::ChooseEarlier(earlier - 1));
        }
    }
}

/// Draws the one at a place.
pub(super) fn earlier_ui(ui: &mut Ui, all: Rect, place: usize, view: &mut ResultsView, scope: &mut Scope) {
    let facts = scope.facts;
    let earlier = &facts.earlier_results()[place];
    let places = layout::earlier_places(all);
    let again = facts.again(place).cloned();
    let head = match &again {
        Some(part) => Head::of_again(part, place, scope.words),
        None => Head::of_earlier(earlier, place, facts.is_of_another_plan(earlier), scope.words),
    };
    header::header_ui(ui, places.header, &head, scope);
    notes_ui(ui, places.notes, (place, earlier, again.as_deref()), scope);
    if let Some(part) = again {
        return again_ui(ui, &places, &part, view, scope);
    }
    match &earlier.stored.outcome {
        StoredOutcome::Refused(refusal) => refused_ui(ui, places.body, refusal, scope),
        StoredOutcome::Measured(inspection) => {
            stored_ui(ui, &places, (inspection, earlier.is_vouched_for()), view, scope)
        }
    }
}

/// Its scan as the plan at hand sees it, like any part.
fn again_ui(ui: &mut Ui, places: &EarlierPlaces, part: &Arc<FinishedPart>, view: &mut ResultsView, scope: &mut Scope) {
    match &part.result.outcome {
        Outcome::Refused(refusal) => refused_ui(ui, places.body, refusal, scope),
        Outcome::Measured(inspection) => {
            // It is none of the parts of the trend.
            let place = scope.facts.parts.len();
            view.picture.ui(ui, scope);
            measured_ui(ui, &layout::below(places), part, place, inspection, view, scope);
        }
    }
}

fn stored_ui(
    ui: &mut Ui,
    places: &EarlierPlaces,
    (inspection, vouched_for): (&StoredInspection, bool),
    view: &mut ResultsView,
    scope: &mut Scope,
) {
    let points = &inspection.points;
    let alone = places.tabs.is_some();
    if let Some(tabs) = places.tabs {
        tabs_ui(ui, tabs, &[Tab::Points, Tab::Why], view, scope);
    }
    let why = view.tab == Tab::Why;
    if !(alone && why) {
        let columns = Columns::in_width(places.table.width());
        if let Some(k) = table::table_ui(ui, places.table, (points, vouched_for), &mut view.table, columns, scope) {
            scope.ask(Action::ChoosePoint(Some(k)));
        }
    }
    if !alone || why {
        let chosen = scope.view.point.and_then(|k| points.get(k));
        why::stored_ui(ui, places.why, chosen, vouched_for, scope);
    }
}

/// What should be known of it before it is read, and the button that inspects its scan again.
fn notes_ui(
    ui: &mut Ui,
    at: Rect,
    (place, earlier, again): (usize, &Earlier, Option<&FinishedPart>),
    scope: &mut Scope,
) {
    let (theme, words) = (scope.theme, scope.words);
    cards::card(ui, at, theme);
    let inner = at.shrink2(vec2(12.0, 4.0));
    let text = words.text("results.inspect_again");
    let wide = (write::width(ui, text, fonts::semibold(size::TABLE)) + 24.0).min(0.5 * inner.width());
    let high = inner.height().min(32.0);
    let button = Rect::from_center_size(inner.right_center() - vec2(0.5 * wide, 0.0), vec2(wide, high));
    let may = may_inspect(scope.facts, earlier);
    let working = matches!(scope.facts.job, Job::Fetching { wanted: Wanted::Earlier(k) } if k == place);
    let shown = Button::new(RichText::new(text).font(fonts::semibold(size::TABLE))).truncate();
    let response = ui.add_enabled_ui(may.is_ok(), |ui| ui.put(button, shown)).inner;
    if response.clicked() {
        scope.ask(Action::InspectEarlier(place));
    }
    let mut told = notes(earlier, again, scope);
    match may {
        _ if working => told.insert(0, (false, words.text("results.earlier_working").to_owned())),
        Err(why) if again.is_none() => told.push((false, words.text(why).to_owned())),
        _ => {}
    }
    let builder =
        egui::UiBuilder::new().max_rect(inner.with_max_x(button.left() - 12.0)).layout(Layout::top_down(Align::Min));
    ui.scope_builder(builder, |ui| {
        ui.set_clip_rect(inner.intersect(ui.clip_rect()));
        // Of itself it would be no lower than 64 points.
        let scroll = ScrollArea::vertical().id_salt("notes of an earlier result").min_scrolled_height(0.0);
        scroll.auto_shrink(false).show(ui, |ui| {
            for (odd, text) in told {
                ui.horizontal_top(|ui| {
                    if odd {
                        let (square, _) = ui.allocate_exact_size(Vec2::splat(16.0), egui::Sense::hover());
                        sign::problem(ui.painter(), square, false, theme);
                    }
                    ui.add(Label::new(RichText::new(text).size(size::TABLE).color(theme.text)).wrap());
                });
            }
        });
    });
}

/// The notes, each with whether it is odd; what is odd first.
fn notes(earlier: &Earlier, again: Option<&FinishedPart>, scope: &Scope) -> Vec<(bool, String)> {
    let (words, facts) = (scope.words, scope.facts);
    let mut told = Vec::new();
    if let Some(part) = again {
        let verdict = Sign::of(&part.result).word(words);
        told.push((false, words.fill("results.inspected_again", &[("verdict", verdict)])));
    }
    match earlier.seal {
        Seal::Whole => {}
        Seal::Changed => told.push((true, words.text("results.earlier_changed").to_owned())),
        Seal::Unlisted => told.push((true, words.text("results.earlier_unlisted").to_owned())),
    }
    let id = &earlier.stored.identity;
    if let Some(plan) = facts.plan.as_ref().filter(|plan| plan.sha256 != id.plan_sha256) {
        let revisions = [("then", &*id.part_revision), ("now", &*plan.part.revision)];
        told.push((true, words.fill("results.earlier_other_plan", &revisions)));
    }
    let other_cad = |part: &Arc<crate::part::Part>| part.cad_sha256 != id.cad_sha256;
    if facts.part.as_ref().is_some_and(other_cad) {
        told.push((true, words.text("results.earlier_other_cad").to_owned()));
    }
    if let StoredOutcome::Measured(StoredInspection { degraded: Some(why), .. }) = &earlier.stored.outcome {
        told.push((true, words.told(why)));
    }
    told.push((false, words.text("results.earlier_no_verdict").to_owned()));
    let unreadable = facts.earlier.as_ref().map_or(0, |earlier| earlier.unreadable.len());
    if unreadable > 0 {
        told.push((true, words.count("results.earlier_unreadable", unreadable)));
    }
    told
}
