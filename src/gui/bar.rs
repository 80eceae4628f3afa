//! The bar above every screen (tabs, Open, View, Help) and the line below it.

use super::action::{Action, Screen};
use super::bar_places::{self, BarPlaces, LOCK, Wishes};
use super::engineer::{Command, EngineerView};
use super::fonts;
use super::icon::BEND;
use super::menus;
use super::scope::Scope;
use super::settings::{Settings, WindowPlace};
use super::text::Words;
use super::theme::size;
use super::widgets::buttons::{self, Weight};
use super::widgets::{sign, words};
use egui::{Align2, Frame, Margin, Panel, Rect, Role, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};

/// The bar with the tabs.
pub(super) fn top_ui(ui: &mut Ui, scope: &mut Scope) {
    let height = bar_places::height(ui.max_rect().size());
    let frame = Frame::NONE.fill(scope.theme.panel);
    Panel::top("bar").frame(frame).exact_size(height).show_separator_line(false).show(ui, |ui| {
        let bar = ui.max_rect();
        let rule = Stroke::new(1.0, scope.theme.stroke);
        ui.painter().hline(bar.x_range(), bar.bottom() - 0.5, rule);
        let places = bar_places::places(bar, &wishes(ui, scope.words));
        if let Some(name) = places.name {
            name_ui(ui, name, scope);
        }
        for (screen, tab) in Screen::ALL.into_iter().zip(&places.tabs) {
            tab_ui(ui, *tab, places.font, screen, scope);
        }
        match places.menu {
            Some(menu) => folded_ui(ui, menu, scope),
            None => menus_ui(ui, &places, scope),
        }
    });
}

/// How wide the words of the bar are. The room for locking is kept on every screen: tabs never move.
pub(super) fn wishes(ui: &Ui, texts: &Words) -> Wishes {
    let of = |key: &str, points: f32| words::width(ui, texts.text(key), fonts::semibold(points));
    let lock = |screen: Screen| if screen == Screen::Engineer { LOCK } else { 0.0 };
    Wishes {
        tabs: Screen::ALL.into_iter().map(|screen| of(screen.key(), size::CARD) + lock(screen)).collect(),
        buttons: ["bar.help", "bar.view", "bar.open", "lock.now"].map(|key| of(key, size::BAR)).to_vec(),
        menu: of("bar.menu", size::BAR),
    }
}

/// The program's mark and name.
fn name_ui(ui: &mut Ui, place: Rect, scope: &Scope) {
    let (x, y) = (place.left(), place.center().y);
    let points = BEND.map(|[along, up]| pos2(x + 20.0 * along, y + 20.0 * up)).to_vec();
    ui.painter().line(points, Stroke::new(2.5, scope.theme.accent));
    ui.painter().hline(x..=x + 20.0, y + 9.0, Stroke::new(1.5, scope.theme.strong_stroke));
    let text = place.with_min_x(x + 34.0);
    words::line(ui, text, Align2::LEFT_CENTER, "Shapeline", fonts::semibold(size::BAR), scope.theme.text);
}

fn tab_ui(ui: &mut Ui, tab: Rect, points: f32, screen: Screen, scope: &mut Scope) {
    let text = scope.words.text(screen.key());
    let chosen = scope.view.screen == screen;
    // The engineer's tab bears a lock.
    let lock_room = if screen == Screen::Engineer { LOCK } else { 0.0 };
    let points = words::fitting_size(ui, text, fonts::semibold, tab.width() - lock_room - 6.0, points, 11.0);
    let font = if chosen { fonts::semibold(points) } else { fonts::regular(points) };
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
}

/// How long the engineer's screen stays open, while it is shown.
fn lock_left(scope: &Scope) -> Option<std::time::Duration> {
    scope.lock.left(scope.now).filter(|_| scope.view.screen == Screen::Engineer)
}

/// Help, View, Open, and locking.
fn menus_ui(ui: &mut Ui, places: &BarPlaces, scope: &mut Scope) {
    let texts = scope.words;
    let button = |ui: &mut Ui, k: usize, key: &str| {
        let (text, font) = (texts.text(key), fonts::semibold(size::BAR));
        buttons::with_words(ui, key, places.buttons[k], Weight::Quiet, text, font, scope.theme)
    };
    let help = button(ui, 0, "bar.help");
    let view = button(ui, 1, "bar.view");
    let open = button(ui, 2, "bar.open");
    if let Some(left) = lock_left(scope) {
        let lock = button(ui, 3, "lock.now");
        if lock.clicked() {
            scope.ask(Action::Engineer(Command::LockNow));
        }
        let tabs_end = places.tabs.last().map_or(0.0, |tab| tab.right());
        let room = Rect::from_x_y_ranges(tabs_end + 24.0..=lock.rect.left() - 16.0, lock.rect.y_range());
        left_ui(ui, room, left, scope);
    }
    if help.clicked() {
        scope.ask(Action::Help(true));
    }
    menus::popup(ui, &view).show(|ui| menus::scrolled(ui, |ui| menus::view_ui(ui, scope)));
    menus::popup(ui, &open).show(|ui| menus::scrolled(ui, |ui| menus::open_ui(ui, scope)));
}

/// Where there is room for it: how long the screen stays open.
fn left_ui(ui: &mut Ui, room: Rect, left: std::time::Duration, scope: &Scope) {
    let seconds = left.as_secs();
    let time = format!("{}:{:02}", seconds / 60, seconds % 60);
    let text = scope.words.fill("lock.left", &[("time", &time)]);
    let font = fonts::regular(size::TABLE);
    if room.width() > words::width(ui, &text, font.clone()) + 1.0 {
        words::line(ui, room, Align2::RIGHT_CENTER, &text, font, scope.theme.quiet);
    }
}

/// The button that holds all others where they have no room.
fn folded_ui(ui: &mut Ui, place: Rect, scope: &mut Scope) {
    let text = scope.words.text("bar.menu");
    let font = fonts::semibold(size::BAR);
    let menu = buttons::with_words(ui, "bar.menu", place, Weight::Quiet, text, font, scope.theme);
    let can_lock = lock_left(scope).is_some();
    if menu.clicked() {
        menus::begin(ui.ctx());
    }
    menus::popup(ui, &menu).show(|ui| menus::scrolled(ui, |ui| menus::all_ui(ui, can_lock, scope)));
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
        let merging = scope.facts.merging.as_ref().filter(|_| scope.view.screen == Screen::Merge);
        let left = match &scope.facts.plan {
            _ if scope.view.screen == Screen::Merge => {
                let plan = merging.and_then(|merging| merging.plan.as_ref());
                let file = plan.map(|plan| plan.output.file.path.display().to_string());
                file.map(|file| texts.fill("status.merged_to", &[("file", &file)])).unwrap_or_default()
            }
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
    let kinds: Vec<String> = kinds.iter().filter(|(n, _)| *n > 0).map(|(n, key)| words.count(key, *n)).collect();
    format!("{} {}", words.count("status.inspected", shift.total()), kinds.join(", "))
}

/// Notes where the window stands, to put it there again: in points at the scale that was chosen, which is not the one it is drawn at
/// while it is too small for that.
pub(super) fn note_window_place(ctx: &egui::Context, settings: &mut Settings) {
    let share = ctx.zoom_factor() / settings.magnification();
    ctx.input(|i| {
        let viewport = i.viewport();
        let (Some(inner), false) = (viewport.inner_rect, viewport.fullscreen.unwrap_or(false)) else { return };
        let maximized = viewport.maximized.unwrap_or(false);
        let position = viewport.outer_rect.map(|r| [share * r.left(), share * r.top()]);
        let size = [share * inner.width(), share * inner.height()];
        settings.place = Some(match settings.place {
            // The place it has when it does not fill the screen is kept for then.
            Some(before) if maximized => WindowPlace { maximized, ..before },
            _ => WindowPlace { position, size, maximized },
        });
    });
}
