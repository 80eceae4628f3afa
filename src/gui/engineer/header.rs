//! The line below the bar: which plan, what of it is not saved, undo and redo, trying and saving. In small windows the tabs of what is
//! looked at stand in the name's place, and the buttons fold into a menu as far as there is no room for them.

use super::act::Command;
use super::editing::{Edit, Editing};
use super::layout::Breadth;
use super::save;
use super::state::{EngineerView, Pane};
use crate::gui::action::Action;
use crate::gui::facts::Job;
use crate::gui::fonts;
use crate::gui::operator::stage_words;
use crate::gui::scope::Scope;
use crate::gui::theme::size;
use crate::gui::widgets::words as write;
use egui::{Align, Align2, Button, Layout, Popup, Rect, Response, RichText, Role, Ui, WidgetInfo, vec2};

/// What a button of the line does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Does {
    Undo,
    Redo,
    Try,
    StopTrying,
    Save,
}

/// A button of the line, or a row of the menu that they fold into.
#[derive(Debug, Clone)]
struct Item {
    does: Does,
    text: String,
    key: &'static str,
    enabled: bool,
    hint: Option<String>,
}

/// How much of the buttons has room.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd)]
enum Fold {
    /// Words, keys, and why a plan cannot be saved.
    Nothing,
    /// The keys give way.
    Keys,
    /// The reason, too.
    Reason,
    /// Only saving is a button of its own.
    AllButSave,
    /// All stand in the menu.
    All,
}

impl Fold {
    const ALL: [Fold; 5] = [Fold::Nothing, Fold::Keys, Fold::Reason, Fold::AllButSave, Fold::All];

    fn is_button(self, item: &Item) -> bool {
        self < Fold::AllButSave || (self == Fold::AllButSave && item.does == Does::Save)
    }
}

/// Width of the reason why a plan cannot be saved, which keeps its place.
const REASON: f32 = 126.0;
const SPACING: f32 = 8.0;

/// Draws it.
pub fn header_ui(
    ui: &mut Ui,
    at: Rect,
    breadth: Breadth,
    scope: &mut Scope,
    view: &mut EngineerView,
    editing: &Editing,
) {
    let items = items(scope, editing);
    let reason = reason(scope, editing);
    let tabs: f32 = breadth.panes().iter().map(|pane| tab_width(ui, &pane_words(*pane, scope, editing))).sum();
    let name = if tabs > 0.0 { tabs } else { name_width(ui, editing).min(260.0) + 90.0 };
    let room = at.width() - name - 16.0;
    let fits = |fold: &Fold| buttons_width(ui, &items, *fold, scope) <= room;
    let fold = Fold::ALL.into_iter().find(fits).unwrap_or(Fold::All);
    let builder = egui::UiBuilder::new().max_rect(at).layout(Layout::right_to_left(Align::Center));
    let shown = ui.scope_builder(builder, |ui| {
        ui.spacing_mut().item_spacing.x = SPACING;
        let done = buttons_ui(ui, &items, reason.as_deref(), fold, scope);
        (ui.min_rect(), done)
    });
    let (used, done) = shown.inner;
    let left = at.with_max_x(used.left() - 16.0);
    if tabs > 0.0 {
        panes_ui(ui, left, breadth, scope, view, editing);
    } else {
        name_ui(ui, left, scope, editing);
    }
    match done {
        Some(Does::Undo) => scope.ask(Action::Edit(Edit::Undo)),
        Some(Does::Redo) => scope.ask(Action::Edit(Edit::Redo)),
        Some(Does::Try) => scope.ask(Action::Engineer(Command::Try)),
        Some(Does::StopTrying) => scope.ask(Action::Engineer(Command::StopTrying)),
        Some(Does::Save) => view.ask_to_save(Some(editing)),
        None => {}
    }
}

/// The tabs of a small window, from the left; nothing where all is in sight. Returns where they end.
pub fn panes_ui(
    ui: &mut Ui,
    at: Rect,
    breadth: Breadth,
    scope: &Scope,
    view: &mut EngineerView,
    editing: &Editing,
) -> f32 {
    let mut x = at.left();
    let shown = breadth.shown(view.pane);
    let texts: Vec<String> = breadth.panes().iter().map(|pane| pane_words(*pane, scope, editing)).collect();
    let all: f32 = texts.iter().map(|text| tab_width(ui, text)).sum();
    // First the room around the words gives way, then their size.
    let spare = TAB_PAD * texts.len() as f32;
    let pad = (TAB_PAD - (all - at.width()).max(0.0) / spare.max(1.0) * TAB_PAD).max(LEAST_PAD);
    let words = all - spare - SPACING * texts.len() as f32;
    let room = at.width() - (pad + SPACING) * texts.len() as f32;
    let points = if words > room { (size::TABLE * room / words).floor().max(11.0) } else { size::TABLE };
    for (pane, text) in breadth.panes().iter().zip(&texts) {
        let wide = write::width(ui, text, fonts::semibold(points)) + pad;
        let place = Rect::from_min_size(egui::pos2(x, at.center().y - 16.0), vec2(wide, 32.0));
        ui.scope(|ui| {
            ui.spacing_mut().button_padding.x = 2.0;
            let button = Button::selectable(shown == *pane, RichText::new(text).font(fonts::semibold(points)));
            let response = ui.put(place, button.frame_when_inactive(true));
            response.widget_info(|| WidgetInfo::selected(Role::Tab, true, shown == *pane, text));
            if response.clicked() {
                view.pane = *pane;
            }
        });
        x = place.right() + SPACING;
    }
    x
}

/// Room around the words of a tab, and the least of it.
const TAB_PAD: f32 = 24.0;
const LEAST_PAD: f32 = 10.0;

fn tab_width(ui: &Ui, text: &str) -> f32 {
    write::width(ui, text, fonts::semibold(size::TABLE)) + TAB_PAD + SPACING
}

fn pane_words(pane: Pane, scope: &Scope, editing: &Editing) -> String {
    let words = scope.words;
    match pane {
        Pane::View => words.text("results.tab_scene").to_owned(),
        Pane::Plan => words.text("engineer.plan").to_owned(),
        Pane::Form => words.text("engineer.tab_form").to_owned(),
        Pane::Problems => match editing.problems.len() {
            0 => words.text("engineer.problems").to_owned(),
            n => format!("{} {}", words.text("engineer.problems"), words.thousands(n)),
        },
    }
}

/// What the name takes.
fn name_width(ui: &Ui, editing: &Editing) -> f32 {
    let name = editing.document.path().file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    write::width(ui, &name, fonts::semibold(size::BAR))
}

fn name_ui(ui: &mut Ui, at: Rect, scope: &Scope, editing: &Editing) {
    let (words, theme) = (scope.words, scope.theme);
    let path = editing.document.path();
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let wide = write::width(ui, &name, fonts::semibold(size::BAR)) + 12.0;
    write::line(ui, at, Align2::LEFT_CENTER, &name, fonts::semibold(size::BAR), theme.text);
    let mut parts = Vec::new();
    let revision = save::revision(editing);
    if !revision.is_empty() {
        parts.push(words.fill("engineer.revision", &[("revision", &revision)]));
    }
    match editing.changes().len() {
        0 => parts.push(words.text("engineer.all_saved").to_owned()),
        n => {
            parts.push(words.count("engineer.not_saved", n));
            parts.extend(kept_words(scope, editing));
        }
    }
    let note = at.with_min_x(at.left() + wide);
    if note.width() > 40.0 {
        write::line(ui, note, Align2::LEFT_CENTER, &parts.join(", "), fonts::regular(size::TABLE), theme.quiet);
    }
}

/// Whether the unsaved text lies beside the plan.
fn kept_words(scope: &Scope, editing: &Editing) -> Option<String> {
    let words = scope.words;
    let kept = &editing.autosave;
    if kept.fault.is_some() {
        return Some(words.text("engineer.not_kept").to_owned());
    }
    let at = kept.at.filter(|_| kept.version == editing.version)?;
    let seconds = scope.now.saturating_duration_since(at).as_secs();
    Some(match seconds {
        0..60 => words.fill("engineer.kept_s", &[("s", &seconds.to_string())]),
        _ => words.fill("engineer.kept_min", &[("min", &(seconds / 60).to_string())]),
    })
}

/// From the left: back, forth, trying, saving.
fn items(scope: &Scope, editing: &Editing) -> Vec<Item> {
    let words = scope.words;
    let document = &editing.document;
    let step = |does, key: &str, keys, step: Option<_>| Item {
        does,
        text: words.text(key).to_owned(),
        key: keys,
        enabled: step.is_some(),
        hint: step.map(|step| super::told::step(words, step)),
    };
    let next = save::next_revision(&save::revision(editing));
    vec![
        step(Does::Undo, "engineer.undo", "Ctrl Z", document.undo_step()),
        step(Does::Redo, "engineer.redo", "Ctrl Y", document.redo_step()),
        try_item(scope),
        Item {
            does: Does::Save,
            text: words.fill("engineer.save_as", &[("revision", &next)]),
            key: "Ctrl S",
            enabled: save::may_save(editing).is_ok(),
            hint: None,
        },
    ]
}

fn try_item(scope: &Scope) -> Item {
    let words = scope.words;
    if let Job::Trying { stage, .. } = &scope.facts.job {
        let stage = stage_words(words, *stage);
        let stop = words.text("engineer.stop_trying");
        let text = if stage.is_empty() { stop.to_owned() } else { format!("{stop}: {stage}") };
        return Item { does: Does::StopTrying, text, key: "Esc", enabled: true, hint: None };
    }
    let item = |text: String, hint: Option<&str>| Item {
        does: Does::Try,
        text,
        key: "F6",
        enabled: hint.is_none(),
        hint: hint.map(str::to_owned),
    };
    match super::trial::scan(scope.facts) {
        Ok((scan, _)) => {
            let name = scan.file_stem().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
            item(words.fill("engineer.try_on", &[("scan", &write::cut_in_the_middle(&name, 20))]), None)
        }
        Err(why) => item(words.text("engineer.try").to_owned(), Some(words.text(why))),
    }
}

/// Why the plan cannot be saved.
fn reason(scope: &Scope, editing: &Editing) -> Option<String> {
    let (key, n) = save::may_save(editing).err()?;
    Some(if n == 0 { scope.words.text(key).to_owned() } else { scope.words.count(key, n) })
}

/// What the buttons take. Room for the reason is reckoned with whether there is one or not: nothing folds because of it.
fn buttons_width(ui: &Ui, items: &[Item], fold: Fold, scope: &Scope) -> f32 {
    let of = |text: &str, key: &str| {
        let key = if key.is_empty() { 0.0 } else { 10.0 + write::width(ui, key, fonts::mono(11.0)) };
        write::width(ui, text, fonts::regular(size::TABLE)) + key + 22.0 + SPACING
    };
    let with_keys = fold == Fold::Nothing;
    let own = items.iter().filter(|item| fold.is_button(item));
    let own: f32 = own.map(|item| of(&item.text, if with_keys { item.key } else { "" })).sum();
    let menu = if fold >= Fold::AllButSave { of(scope.words.text("bar.more"), "") } else { 12.0 };
    own + menu + if fold < Fold::Reason { REASON + SPACING } else { 0.0 }
}

/// Draws them from the right; returns what was pressed.
fn buttons_ui(ui: &mut Ui, items: &[Item], reason: Option<&str>, fold: Fold, scope: &Scope) -> Option<Does> {
    let mut done = None;
    if let Some(reason) = reason.filter(|_| fold < Fold::Reason) {
        // Its place is kept, so that nothing moves when the reason changes.
        ui.allocate_ui_with_layout(vec2(REASON, 34.0), Layout::left_to_right(Align::Center), |ui| {
            ui.set_width(REASON);
            ui.add(egui::Label::new(RichText::new(reason).size(size::NOTE).color(scope.theme.quiet)).wrap());
        });
    }
    if fold >= Fold::AllButSave {
        let more = scope.words.text("bar.more");
        let button = ui.add(Button::new(RichText::new(more).size(size::TABLE)).min_size(vec2(0.0, 28.0)));
        Popup::menu(&button).show(|ui| {
            for item in items.iter().filter(|item| !fold.is_button(item)) {
                if item_ui(ui, scope, item, true, 220.0).clicked() {
                    done = Some(item.does);
                }
            }
            if let Some(reason) = reason {
                ui.label(RichText::new(reason).size(size::NOTE).color(scope.theme.quiet));
            }
        });
    }
    for item in items.iter().rev().filter(|item| fold.is_button(item)) {
        if item_ui(ui, scope, item, fold == Fold::Nothing, 0.0).clicked() {
            done = Some(item.does);
        }
        // What changes the plan stands apart from what is done with it.
        if matches!(item.does, Does::Try | Does::StopTrying) {
            ui.add_space(12.0);
        }
    }
    done
}

/// A button with its key behind it, known by its words alone.
fn item_ui(ui: &mut Ui, scope: &Scope, item: &Item, with_key: bool, wide: f32) -> Response {
    let mut job = egui::text::LayoutJob::default();
    let format = |font, colour| egui::text::TextFormat::simple(font, colour);
    let colour = if item.enabled { scope.theme.text } else { scope.theme.quiet };
    job.append(&item.text, 0.0, format(fonts::regular(size::TABLE), colour));
    if with_key {
        job.append(item.key, 10.0, format(fonts::mono(11.0), scope.theme.quiet));
    }
    let response = ui.add_enabled(item.enabled, Button::new(job).min_size(vec2(wide, 28.0)));
    response.widget_info(|| WidgetInfo::labeled(Role::Button, item.enabled, &item.text));
    match &item.hint {
        Some(hint) if item.enabled => response.on_hover_text(hint),
        Some(hint) => response.on_disabled_hover_text(hint),
        None => response,
    }
}
