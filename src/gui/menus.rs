//! What the bar's buttons open: plans, the window's looks; and both as one menu where the bar has no room for buttons.

use super::action::Action;
use super::engineer::Command;
use super::fonts;
use super::new_plan;
use super::scope::Scope;
use super::settings::{SCALES, ThemeChoice};
use super::text::{Language, typed_number};
use super::theme::size;
use super::widgets::sign;
use egui::{Context, Frame, Id, Popup, PopupCloseBehavior, Response, RichText, ScrollArea, Ui, vec2};

/// The pages of the menu that holds all others.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
enum Page {
    #[default]
    All,
    Open,
    View,
}

fn page_id() -> Id {
    Id::unique("page of the menu")
}

/// The menu begins with its first page whenever it is opened.
pub(super) fn begin(ctx: &Context) {
    ctx.data_mut(|d| d.remove::<Page>(page_id()));
}

/// What a button of the bar opens.
pub(super) fn popup<'a>(ui: &Ui, button: &'a Response) -> Popup<'a> {
    let frame = Frame::menu(ui.style()).inner_margin(12);
    Popup::menu(button).frame(frame).close_behavior(PopupCloseBehavior::CloseOnClickOutside)
}

/// No menu is higher than the window below its button.
pub(super) fn scrolled(ui: &mut Ui, add: impl FnOnce(&mut Ui)) {
    let room = (ui.ctx().content_rect().height() - 100.0).max(120.0);
    // A page that is higher than the one before it is shown whole, too.
    ScrollArea::vertical().max_height(room).min_scrolled_height(room).show(ui, add);
}

/// All buttons as rows; Open and View lead to pages of their own.
pub(super) fn all_ui(ui: &mut Ui, can_lock: bool, scope: &mut Scope) {
    let words = scope.words;
    let page = ui.data(|d| d.get_temp::<Page>(page_id())).unwrap_or_default();
    if page != Page::All && row(ui, false, words.text("new_plan.back")) {
        begin(ui.ctx());
        return;
    }
    match page {
        Page::Open => open_ui(ui, scope),
        Page::View => view_ui(ui, scope),
        Page::All => {
            if can_lock && row(ui, false, words.text("lock.now")) {
                scope.ask(Action::Engineer(Command::LockNow));
                ui.close();
            }
            for (key, page) in [("bar.open", Page::Open), ("bar.view", Page::View)] {
                if row(ui, false, words.text(key)) {
                    ui.data_mut(|d| d.insert_temp(page_id(), page));
                }
            }
            if row(ui, false, words.text("bar.help")) {
                scope.ask(Action::Help(true));
                ui.close();
            }
        }
    }
}

/// Height of what a glove can hit though it is rarely wanted.
const ROW: f32 = 48.0;

/// A row of a menu that a glove can hit.
fn row(ui: &mut Ui, chosen: bool, text: &str) -> bool {
    let button = egui::Button::selectable(chosen, RichText::new(text).size(size::BAR)).min_size(vec2(220.0, ROW));
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

/// Plans to open.
pub(super) fn open_ui(ui: &mut Ui, scope: &mut Scope) {
    let words = scope.words;
    if row(ui, false, words.text("bar.open_plan")) {
        scope.ask(Action::AskForPlan);
        ui.close();
    }
    if row(ui, false, words.text("bar.new_plan")) {
        scope.ask(Action::NewPlan(new_plan::Command::Start { cad: None, scan: None }));
        ui.close();
    }
    if row(ui, false, words.text("bar.type_path")) {
        scope.ask(Action::TypePath(true));
        ui.close();
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
            ui.close();
        }
    }
}

/// How the window looks and speaks, and what of the shift is kept.
pub(super) fn view_ui(ui: &mut Ui, scope: &mut Scope) {
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
                egui::Button::selectable(chosen, RichText::new(text).size(size::BODY)).min_size(vec2(56.0, ROW));
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
    let watch = scope.settings.watch;
    if (watch || scope.facts.plan.is_some()) && row(ui, watch, words.text("operator.watch")) {
        scope.ask(Action::Watch(!watch));
    }
    new_shift_ui(ui, scope);
    if row(ui, false, words.text("view.full_screen")) {
        scope.ask(Action::FullScreen);
    }
}

/// A day: no press is slower, and what is longer is a slip of the pen.
const LONGEST_TAKT_S: f64 = 86_400.0;

/// The field for the takt of the press at which the open plan is used; empty = not known.
fn takt_ui(ui: &mut Ui, scope: &mut Scope) {
    let Some(plan) = &scope.facts.plan_path else { return };
    let words = scope.words;
    let now = scope.settings.takt_s(plan);
    let id = egui::Id::unique("takt").with(plan);
    let shown = || now.map(|takt| words.number(takt, 1)).unwrap_or_default();
    let mut text = ui.ctx().data_mut(|d| d.get_temp::<String>(id)).unwrap_or_else(shown);
    ui.horizontal(|ui| {
        ui.set_min_height(ROW);
        let label = ui.label(words.text("view.takt"));
        let field = egui::TextEdit::singleline(&mut text).desired_width(72.0).font(fonts::mono(size::BAR));
        ui.add(field.min_size(vec2(72.0, ROW)).align(egui::Align2::LEFT_CENTER)).labelled_by(label.id);
    });
    let typed = typed_number(&text).filter(|takt| *takt > 0.0 && *takt <= LONGEST_TAKT_S);
    if typed.is_none() && !text.trim().is_empty() {
        ui.horizontal(|ui| {
            let (square, _) = ui.allocate_exact_size(egui::Vec2::splat(16.0), egui::Sense::hover());
            sign::problem(ui.painter(), square, true, scope.theme);
            ui.label(RichText::new(words.text("view.no_takt")).size(size::BODY));
        });
    }
    if typed != now && (typed.is_some() || text.trim().is_empty()) {
        scope.ask(Action::Takt(typed));
    }
    ui.ctx().data_mut(|d| d.insert_temp(id, text));
}
