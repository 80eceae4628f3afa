//! The bar above every screen (tabs, Open, View, Help) and the line below it.

use super::action::{Action, Screen};
use super::engineer::{Command, EngineerView};
use super::fonts;
use super::icon::BEND;
use super::new_plan;
use super::scope::Scope;
use super::settings::{SCALES, Settings, ThemeChoice, WindowPlace};
use super::text::{Language, typed_number};
use super::theme::size;
use super::widgets::buttons::{self, Weight};
use super::widgets::{sign, words};
use egui::{
    Align2, Frame, Margin, Panel, Popup, PopupCloseBehavior, Rect, RichText, Role, Sense, Stroke, Ui, WidgetInfo, pos2,
    vec2,
};

/// Width below which the bar is lower and its name gives way.
const NARROW: f32 = 1600.0;
const VERY_NARROW: f32 = 860.0;

/// The bar with the tabs.
pub(super) fn top_ui(ui: &mut Ui, scope: &mut Scope) {
    let width = ui.available_width();
    let height = if width < NARROW { 64.0 } else { 72.0 };
    let frame = Frame::NONE.fill(scope.theme.panel);
    Panel::top("bar").frame(frame).exact_size(height).show_separator_line(false).show(ui, |ui| {
        let place = ui.max_rect();
        let rule = Stroke::new(1.0, scope.theme.stroke);
        ui.painter().hline(place.x_range(), place.bottom() - 0.5, rule);
        let mut x = place.left() + 16.0;
        if width >= VERY_NARROW {
            x = name_ui(ui, place, x, scope);
        }
        for screen in Screen::BUILT {
            x = tab_ui(ui, place, x, screen, scope);
        }
        menus_ui(ui, place, x, scope);
    });
}

/// The program's mark and name; returns where the tabs begin.
fn name_ui(ui: &mut Ui, place: Rect, x: f32, scope: &Scope) -> f32 {
    let y = place.center().y;
    let points = BEND.map(|[along, up]| pos2(x + 20.0 * along, y + 20.0 * up)).to_vec();
    ui.painter().line(points, Stroke::new(2.5, scope.theme.accent));
    ui.painter().hline(x..=x + 20.0, y + 9.0, Stroke::new(1.5, scope.theme.strong_stroke));
    let text = Rect::from_min_max(pos2(x + 34.0, place.top()), pos2(x + 130.0, place.bottom()));
    words::line(ui, text, Align2::LEFT_CENTER, "Shapeline", fonts::semibold(size::BAR), scope.theme.text);
    x + 130.0
}

fn tab_ui(ui: &mut Ui, place: Rect, x: f32, screen: Screen, scope: &mut Scope) -> f32 {
    let text = scope.words.text(screen.key());
    let chosen = scope.view.screen == screen;
    let font = if chosen { fonts::semibold(size::CARD) } else { fonts::regular(size::CARD) };
    // The engineer's tab bears a lock.
    let lock_room = if screen == Screen::Engineer { 22.0 } else { 0.0 };
    let wide = words::width(ui, text, fonts::semibold(size::CARD)) + 48.0 + lock_room;
    let tab = Rect::from_min_size(pos2(x, place.top()), vec2(wide, place.height()));
    let response = ui.interact(tab, ui.scope_id().with(("tab", screen)), Sense::click());
    response.widget_info(|| WidgetInfo::selected(Role::Tab, true, chosen, text));
    let theme = scope.theme;
    if response.has_focus() {
        ui.painter().rect_stroke(tab.shrink(3.0), 4, Stroke::new(2.0, theme.accent), egui::StrokeKind::Inside);
    }
    let colour = if chosen || response.hovered() { theme.text } else { theme.quiet };
    let centre = tab.center() - vec2(0.5 * lock_room, 0.0);
    let written = ui.painter().text(centre, Align2::CENTER_CENTER, text, font, colour);
    if lock_room > 0.0 {
        let at = pos2(written.right() + 15.0, tab.center().y);
        sign::padlock(ui.painter(), at, scope.lock.is_open(scope.now), colour);
    }
    if chosen {
        let under = Rect::from_min_max(pos2(tab.left(), tab.bottom() - 3.0), tab.max);
        ui.painter().rect_filled(under, 0, theme.accent);
    }
    if response.clicked() {
        scope.ask(Action::Show(screen));
    }
    tab.right()
}

/// Help, View and Open, from the right.
fn menus_ui(ui: &mut Ui, place: Rect, tabs_end: f32, scope: &mut Scope) {
    let texts = scope.words;
    let mut right = place.right() - 16.0;
    let mut next = |ui: &mut Ui, key: &str| {
        let text = texts.text(key);
        let wide = (words::width(ui, text, fonts::semibold(size::BAR)) + 32.0).max(72.0);
        let button = Rect::from_min_max(pos2(right - wide, place.top() + 8.0), pos2(right, place.bottom() - 8.0));
        right = button.left() - 12.0;
        buttons::with_words(ui, key, button, Weight::Quiet, text, fonts::semibold(size::BAR), scope.theme)
    };
    let help = next(ui, "bar.help");
    let view = next(ui, "bar.view");
    let open = next(ui, "bar.open");
    let left = scope.lock.left(scope.now).filter(|_| scope.view.screen == Screen::Engineer);
    if let Some(left) = left {
        let lock = next(ui, "lock.now");
        if lock.clicked() {
            scope.ask(Action::Engineer(Command::LockNow));
        }
        // Where there is room for it: how long it stays open.
        let seconds = left.as_secs();
        let time = format!("{}:{:02}", seconds / 60, seconds % 60);
        let text = texts.fill("lock.left", &[("time", &time)]);
        let wide = words::width(ui, &text, fonts::regular(size::TABLE));
        let note = Rect::from_min_max(
            pos2(lock.rect.left() - 16.0 - wide, place.top()),
            pos2(lock.rect.left() - 16.0, place.bottom()),
        );
        if note.left() > tabs_end + 24.0 {
            words::line(
                ui,
                note.expand2(vec2(1.0, 0.0)),
                Align2::RIGHT_CENTER,
                &text,
                fonts::regular(size::TABLE),
                scope.theme.quiet,
            );
        }
    }
    if help.clicked() {
        scope.ask(Action::Help(true));
    }
    let frame = Frame::menu(ui.style()).inner_margin(12);
    let stays = PopupCloseBehavior::CloseOnClickOutside;
    Popup::menu(&view).frame(frame).close_behavior(stays).show(|ui| view_menu_ui(ui, scope));
    Popup::menu(&open).frame(frame).show(|ui| open_menu_ui(ui, scope));
}

/// A row of a menu that a glove can hit.
fn row(ui: &mut Ui, chosen: bool, text: &str) -> bool {
    let button = egui::Button::selectable(chosen, RichText::new(text).size(size::BAR)).min_size(vec2(220.0, 40.0));
    ui.add(button).clicked()
}

/// Counts that are put to zero do not come back: a second press says that it was meant.
fn new_shift_ui(ui: &mut Ui, scope: &mut Scope) {
    let id = egui::Id::unique("new shift");
    let asked = ui.data(|d| d.get_temp::<Option<std::time::Instant>>(id)).flatten();
    let asked = asked.is_some_and(|at| scope.now.saturating_duration_since(at) < SURE);
    let key = if asked { "view.new_shift_sure" } else { "view.new_shift" };
    if !row(ui, asked, scope.words.text(key)) {
        return;
    }
    if asked || scope.settings.shift.total() == 0 {
        ui.data_mut(|d| d.insert_temp(id, None::<std::time::Instant>));
        scope.ask(Action::NewShift);
    } else {
        ui.data_mut(|d| d.insert_temp(id, Some(scope.now)));
        ui.ctx().request_repaint_after(SURE);
    }
}

/// How long a question in a menu stands.
const SURE: std::time::Duration = std::time::Duration::from_secs(5);

fn open_menu_ui(ui: &mut Ui, scope: &mut Scope) {
    let words = scope.words;
    if row(ui, false, words.text("bar.open_plan")) {
        scope.ask(Action::AskForPlan);
    }
    if row(ui, false, words.text("bar.new_plan")) {
        scope.ask(Action::NewPlan(new_plan::Command::Start { cad: None, scan: None }));
    }
    if row(ui, false, words.text("bar.type_path")) {
        scope.ask(Action::TypePath(true));
    }
    if !scope.settings.recent.is_empty() {
        ui.separator();
        ui.label(RichText::new(words.text("bar.recent")).color(scope.theme.quiet));
    }
    for recent in scope.settings.recent.clone() {
        let name = recent.path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let folder = recent.path.parent().and_then(|p| p.file_name()).map(|n| n.to_string_lossy().into_owned());
        let text = folder.map_or_else(|| name.clone(), |folder| format!("{name}  ({folder})"));
        let open = scope.facts.plan_path.as_ref() == Some(&recent.path);
        if row(ui, open, &text) {
            scope.ask(Action::Open(recent.path));
        }
    }
}

fn view_menu_ui(ui: &mut Ui, scope: &mut Scope) {
    let words = scope.words;
    let title = |ui: &mut Ui, key| ui.label(RichText::new(words.text(key)).color(scope.theme.quiet));
    title(ui, "view.theme");
    for choice in ThemeChoice::ALL {
        if row(ui, scope.settings.theme == choice, words.text(&format!("view.{}", choice.code()))) {
            scope.actions.push(Action::Theme(choice));
        }
    }
    ui.separator();
    title(ui, "view.scale");
    ui.horizontal(|ui| {
        for scale in SCALES {
            let text = format!("{:.0} %", 100.0 * scale);
            let chosen = (scope.settings.magnification() - scale).abs() < 1e-3;
            let button =
                egui::Button::selectable(chosen, RichText::new(text).size(size::BODY)).min_size(vec2(56.0, 40.0));
            if ui.add(button).clicked() {
                scope.actions.push(Action::Scale(scale));
            }
        }
    });
    ui.separator();
    title(ui, "view.language");
    for language in Language::ALL {
        if row(ui, scope.settings.language == language, language.name()) {
            scope.actions.push(Action::Language(language));
        }
    }
    ui.separator();
    takt_ui(ui, scope);
    new_shift_ui(ui, scope);
    if row(ui, false, words.text("view.full_screen")) {
        scope.ask(Action::FullScreen);
    }
}

/// The field for the takt of the press at which the open plan is used; empty = not known.
fn takt_ui(ui: &mut Ui, scope: &mut Scope) {
    let Some(plan) = &scope.facts.plan_path else { return };
    let words = scope.words;
    let now = scope.settings.takt_s(plan);
    let id = egui::Id::unique("takt").with(plan);
    let shown = || now.map(|takt| words.number(takt, 1)).unwrap_or_default();
    let mut text = ui.ctx().data_mut(|d| d.get_temp::<String>(id)).unwrap_or_else(shown);
    ui.horizontal(|ui| {
        let label = ui.label(words.text("view.takt"));
        let field = egui::TextEdit::singleline(&mut text).desired_width(72.0).font(fonts::mono(size::BAR));
        ui.add(field.min_size(vec2(72.0, 40.0)).align(egui::Align2::LEFT_CENTER)).labelled_by(label.id);
    });
    let typed = typed_number(&text).filter(|takt| *takt > 0.0);
    if typed != now && (typed.is_some() || text.trim().is_empty()) {
        scope.ask(Action::Takt(typed));
    }
    ui.ctx().data_mut(|d| d.insert_temp(id, text));
}

/// The line at the bottom: where reports go, and what this shift brought.
pub(super) fn status_ui(ui: &mut Ui, scope: &mut Scope, engineer: &EngineerView) {
    let frame = Frame::NONE.fill(scope.theme.panel).inner_margin(Margin::symmetric(16, 0));
    Panel::bottom("status").frame(frame).exact_size(28.0).show_separator_line(true).show(ui, |ui| {
        let place = ui.max_rect();
        let texts = scope.words;
        let (font, colour) = (fonts::regular(size::TABLE), scope.theme.quiet);
        if scope.view.screen == Screen::Engineer {
            let [left, right] = engineer_status(scope, engineer);
            words::line(ui, place, Align2::RIGHT_CENTER, &right, font.clone(), colour);
            let end = place.right() - words::width(ui, &right, font.clone()) - 24.0;
            words::line(ui, place.with_max_x(end), Align2::LEFT_CENTER, &left, font, colour);
            return;
        }
        let left = match &scope.facts.plan {
            Some(plan) => texts.fill("status.reports", &[("folder", &plan.output.folder)]),
            None => String::new(),
        };
        let shift = shift_words(scope);
        // What this shift brought is shown whole; where reports go gets the rest.
        let right = place.right() - words::width(ui, &shift, font.clone());
        words::line(ui, place, Align2::RIGHT_CENTER, &shift, font.clone(), colour);
        words::line(ui, place.with_max_x(right - 24.0), Align2::LEFT_CENTER, &left, font, colour);
    });
}

/// Whether the plan can be changed and what is under the pointer; how large the CAD is.
fn engineer_status(scope: &Scope, engineer: &EngineerView) -> [String; 2] {
    let words = scope.words;
    if !scope.lock.is_open(scope.now) {
        return [words.text("lock.status_locked").to_owned(), String::new()];
    }
    let cursor = engineer.view3d.cursor_words(words);
    let left = [Some(words.text("lock.status_open").to_owned()), cursor].into_iter().flatten().collect::<Vec<_>>();
    let part = scope.facts.editing.as_ref().and_then(|editing| editing.part.as_ref());
    let right = part.map(|part| words.count("engineer.triangles", part.mesh.triangles.len()));
    [left.join("      "), right.unwrap_or_default()]
}

/// What this shift brought, in words: only what there was.
fn shift_words(scope: &Scope) -> String {
    let (shift, words) = (&scope.settings.shift, scope.words);
    if shift.total() == 0 {
        return words.text("status.nothing").to_owned();
    }
    let kinds = [
        (shift.pass, "status.pass"),
        (shift.fail, "status.fail"),
        (shift.incomplete, "status.incomplete"),
        (shift.undecided, "status.undecided"),
        (shift.refused, "status.refused"),
    ];
    let kinds: Vec<String> =
        kinds.iter().filter(|(n, _)| *n > 0).map(|(n, key)| words.fill(key, &[("n", &words.thousands(*n))])).collect();
    format!("{} {}", words.fill("status.inspected", &[("n", &words.thousands(shift.total()))]), kinds.join(", "))
}

/// Notes where the window stands, to put it there again.
pub(super) fn note_window_place(ctx: &egui::Context, settings: &mut Settings) {
    ctx.input(|i| {
        let viewport = i.viewport();
        let (Some(inner), false) = (viewport.inner_rect, viewport.fullscreen.unwrap_or(false)) else { return };
        let maximized = viewport.maximized.unwrap_or(false);
        let position = viewport.outer_rect.map(|r| [r.left(), r.top()]);
        let size = [inner.width(), inner.height()];
        settings.place = Some(match settings.place {
            // The place it has when it does not fill the screen is kept for then.
            Some(before) if maximized => WindowPlace { maximized, ..before },
            _ => WindowPlace { position, size, maximized },
        });
    });
}
