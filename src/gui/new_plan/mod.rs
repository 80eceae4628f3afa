//! A plan for a part never seen, in five steps: CAD, scan, thickness and side, features and points, first run.
//!
//! ```text
//! Entries (typed and chosen) --look: threads--> CadLook, ScanLook --Command::Begin--> Facts::editing (a plan never saved)
//!   step 4 is the engineer's own screen over it; step 5 --Command::Run--> saved, opened, the scan inspected
//! ```

pub mod act;
mod look;
mod pick;
mod run;
mod show;
mod state;
mod steps;

pub use act::Command;
pub use state::Step;

use super::engineer::{Editing, EngineerView};
use super::later::{Later, PathDialog};
use super::scope::Scope;
use super::text::Words;
use super::widgets::buttons::{self, Weight};
use super::widgets::{cards, words as write};
use crate::gui::action::Action;
use crate::gui::fonts;
use crate::gui::theme::size;
use crate::plan::document::Document;
use egui::{
    Align, Align2, Button, Layout, Rect, RichText, Role, ScrollArea, Sense, Stroke, Ui, WidgetInfo, pos2, vec2,
};
use show::{Show, What, show_ui};
use state::Entries;
use std::path::{Path, PathBuf};

/// The five steps with all that was chosen. Kept until the plan runs or somebody cancels.
#[derive(Debug, Default)]
pub struct Assistant {
    entries: Entries,
    dialog: PathDialog,
    show: Show,
    /// Somebody wants to cancel, and there is something to lose.
    asking: bool,
    /// Why the plan could not be made or saved.
    fault: Option<String>,
    /// Another file lies under the plan's name, which was this one.
    taken: Option<PathBuf>,
    /// The plan on its way to the disk; an error without words: another file lies there.
    writing: Later<Result<PathBuf, Option<String>>>,
    /// A scan that was named is looked at as soon as its CAD is known.
    scan_waits: bool,
    /// The plan in step 4 and 5 is this one's.
    pub(super) begun: bool,
}

impl Assistant {
    /// With a CAD or a scan that is known already.
    pub fn new(ctx: &egui::Context, cad: Option<&Path>, scan: Option<&Path>) -> Self {
        let mut assistant = Self::default();
        assistant.give(ctx, cad, scan);
        assistant
    }

    /// Takes files that were dropped.
    fn give(&mut self, ctx: &egui::Context, cad: Option<&Path>, scan: Option<&Path>) {
        if let Some(scan) = scan {
            self.entries.scan.choose(scan);
            (self.entries.cloud, self.scan_waits) = (None, true);
        }
        if let Some(cad) = cad {
            self.entries.cad.choose(cad);
            self.look_at_cad(ctx);
        }
    }

    fn look_at_cad(&mut self, ctx: &egui::Context) {
        let entries = &mut self.entries;
        (entries.cad.look, entries.cad.fault) = (None, None);
        // The scan was looked at for another CAD.
        self.scan_waits |= entries.scan.look.is_some();
        (entries.scan.look, entries.cloud) = (None, None);
        if !entries.cad.path.trim().is_empty() {
            entries.looking.at_cad(ctx, entries.cad.file(), entries.cad.unit);
        }
    }

    fn look_at_scan(&mut self, ctx: &egui::Context) {
        let entries = &mut self.entries;
        (entries.scan.look, entries.scan.fault, entries.cloud) = (None, None, None);
        if let (Some(cad), false) = (&entries.cad.look, entries.scan.path.trim().is_empty()) {
            entries.looking.at_scan(ctx, entries.scan.file(), entries.scan.unit, cad.part.clone());
        }
    }

    /// Takes what was found since the last frame, and looks at a scan that was waiting for its CAD.
    fn hear(&mut self, ctx: &egui::Context) {
        if let Some(looked) = self.entries.looking.poll() {
            self.entries.take(looked);
        }
        let known = self.entries.cad.look.is_some() && !self.entries.looking.is_busy();
        if self.scan_waits && known {
            self.scan_waits = false;
            self.look_at_scan(ctx);
        }
    }

    /// What came of saving: the plan's file, once.
    fn written(&mut self, words: &Words) -> Option<PathBuf> {
        match self.writing.poll()? {
            Ok(Ok(path)) => return Some(path),
            Ok(Err(Some(fault))) => self.fault = Some(fault),
            Ok(Err(None)) => {
                self.taken = Some(self.entries.plan_file());
                self.fault = Some(words.text("new_plan.file_taken").to_owned());
            }
            Err(_) => self.fault = Some(words.text("new_plan.not_saved").to_owned()),
        }
        None
    }
}

/// Height of the line of steps and of that with the buttons; the second one in a low window.
const STRIP: [f32; 2] = [64.0, 48.0];
const LOW: f32 = 480.0;
const FORM: f32 = 460.0;

/// Draws the assistant over the whole screen.
pub(super) fn new_plan_ui(ui: &mut Ui, scope: &mut Scope, assistant: &mut Assistant, view: &mut EngineerView) {
    assistant.hear(ui.ctx());
    if let Some(path) = assistant.written(scope.words) {
        scope.ask(Action::NewPlan(Command::Saved(path)));
    }
    let all = ui.max_rect();
    let strip = STRIP[usize::from(all.height() < LOW)];
    let foot = all.with_min_y(all.bottom() - strip);
    let strip = all.with_max_y(all.top() + strip);
    let body = Rect::from_min_max(strip.left_bottom(), foot.right_top());
    strip_ui(ui, strip, scope, assistant);
    match assistant.entries.step {
        Step::Pick => pick::pick_ui(ui, body, scope, assistant, view),
        Step::Run => run::run_ui(ui, body, scope, assistant),
        step => first_steps_ui(ui, body, step, scope, assistant),
    }
    foot_ui(ui, foot, scope, assistant);
    if assistant.asking {
        ask_ui(ui, scope, assistant);
    }
}

/// The plan that is made, once step 3 was left.
fn document<'a>(scope: &Scope<'a>, assistant: &Assistant) -> Option<&'a Document> {
    let facts = scope.facts;
    facts.editing.as_ref().filter(|_| assistant.begun).map(|editing: &Editing| &editing.document)
}

fn first_steps_ui(ui: &mut Ui, body: Rect, step: Step, scope: &Scope, assistant: &mut Assistant) {
    let inner = body.shrink2(vec2(16.0, 8.0));
    let narrow = inner.width() < 1.6 * FORM;
    let form = if narrow { inner } else { inner.with_max_x(inner.left() + FORM) };
    cards::card(ui, form, scope.theme);
    let builder = egui::UiBuilder::new().max_rect(form.shrink(18.0)).layout(Layout::top_down(Align::Min));
    ui.scope_builder(builder, |ui| {
        ScrollArea::vertical().id_salt(("new plan", step as usize)).auto_shrink(false).show(ui, |ui| {
            ui.label(RichText::new(scope.words.text(step.key())).font(fonts::semibold(size::CARD)));
            ui.add_space(4.0);
            match step {
                Step::Cad => steps::cad_ui(ui, assistant, scope),
                Step::Scan => steps::scan_ui(ui, assistant, scope),
                _ => steps::sheet_ui(ui, assistant, scope),
            }
        });
    });
    if narrow {
        return;
    }
    let view = inner.with_min_x(form.right() + 8.0);
    let entries = &assistant.entries;
    let (cad, cloud) = (entries.cad.look.clone(), entries.cloud.clone());
    let spacing = entries.scan.look.as_ref().map_or(1.0, |look| look.scan.spacing_mm);
    let side = entries.cad_side();
    let what = match (step, &cad, &cloud) {
        (Step::Scan, _, Some(cloud)) => What::Scan(cloud, spacing),
        (Step::Scan, ..) => What::Nothing(scope.words.text("new_plan.no_scan_yet")),
        (Step::Sheet, Some(cad), _) => What::Cad(&cad.part, side),
        (_, Some(cad), _) => What::Cad(&cad.part, None),
        (_, None, _) => What::Nothing(scope.words.text("new_plan.no_cad_yet")),
    };
    show_ui(ui, view, what, &mut assistant.show, scope);
}

/// The five steps; those that can be reached are buttons.
fn strip_ui(ui: &mut Ui, strip: Rect, scope: &mut Scope, assistant: &Assistant) {
    let furthest = assistant.entries.furthest(document(scope, assistant));
    let inner = strip.shrink2(vec2(16.0, if strip.height() < 60.0 { 6.0 } else { 10.0 }));
    let now = assistant.entries.step;
    let text_of = |k: usize, step: Step| format!("{}  {}", k + 1, scope.words.text(step.key()));
    let wide = |text: &str| write::width(ui, text, fonts::semibold(size::BODY)) + 24.0;
    let widest = Step::ALL.into_iter().enumerate().map(|(k, step)| wide(&text_of(k, step))).fold(0.0, f32::max);
    let even = inner.width() / Step::ALL.len() as f32;
    // Where not all names have room, only the step at hand has its own; the others are numbers.
    let whole = widest <= even;
    let (few, rest) = (56.0, inner.width() - 4.0 * 56.0);
    let mut left = inner.left();
    for (k, step) in Step::ALL.into_iter().enumerate() {
        let each = match whole {
            true => even,
            false if step == now => rest,
            false => few,
        };
        let place = Rect::from_min_size(pos2(left, inner.top()), vec2(each - 8.0, inner.height()));
        left += each;
        // The plan is made on the way from 3 to 4, by Next.
        let open = step <= furthest && (step < Step::Pick || assistant.begun);
        let response =
            ui.interact(place, ui.scope_id().with(("step", k)), if open { Sense::click() } else { Sense::hover() });
        let text = text_of(k, step);
        response.widget_info(|| WidgetInfo::selected(Role::Tab, open, step == now, &text));
        let theme = scope.theme;
        let (fill, colour) = match () {
            () if step == now => (theme.choice, theme.text),
            () if open && response.hovered() => (theme.raised, theme.text),
            () => (theme.panel, if open { theme.text } else { theme.quiet }),
        };
        let frame = if step == now || response.has_focus() {
            Stroke::new(2.0, theme.accent)
        } else {
            Stroke::new(1.0, theme.stroke)
        };
        ui.painter().rect(place, 4, fill, frame, egui::StrokeKind::Inside);
        let font = if step == now { fonts::semibold } else { fonts::regular };
        let shown = if whole || step == now { text.clone() } else { (k + 1).to_string() };
        let fit = write::fitting_size(ui, &shown, font, place.width() - 16.0, size::BODY, 11.0);
        ui.painter().with_clip_rect(place.shrink(4.0)).text(
            place.center(),
            Align2::CENTER_CENTER,
            &shown,
            font(fit),
            colour,
        );
        if response.clicked() {
            scope.ask(Action::NewPlan(Command::Go(step)));
        }
    }
}

impl Assistant {
    fn go(&mut self, step: Step) {
        self.entries.step = step;
        self.fault = None;
    }
}

/// Cancel, Back and Next; what is missing stands beside them.
fn foot_ui(ui: &mut Ui, foot: Rect, scope: &mut Scope, assistant: &mut Assistant) {
    let (words, step) = (scope.words, assistant.entries.step);
    let document = document(scope, assistant);
    let missing = assistant.entries.missing(step, document);
    let inner = foot.shrink2(vec2(16.0, if foot.height() < 60.0 { 6.0 } else { 10.0 }));
    // What is missing is to be read: the buttons give way to it.
    let wide = (0.2 * inner.width()).clamp(88.0, 164.0);
    let button = |k: f32| {
        let right = inner.right() - k * (wide + 8.0);
        Rect::from_min_max(pos2(right - wide, inner.top()), pos2(right, inner.bottom()))
    };
    let last = step == Step::Run;
    let name = words.text(if last { "new_plan.run" } else { "new_plan.next" });
    let may = missing.is_none() && !assistant.writing.is_busy();
    let weight = if may { Weight::Main } else { Weight::Quiet };
    let (next, colour) = buttons::at(ui, "next", button(0.0), weight, may, name, scope.theme);
    let points = write::fitting_size(ui, name, fonts::semibold, wide - 20.0, size::BAR, 11.0);
    ui.painter().text(button(0.0).center(), Align2::CENTER_CENTER, name, fonts::semibold(points), colour);
    if next.clicked() {
        scope.ask(Action::NewPlan(if last { Command::Run } else { Command::Go(step.next()) }));
    }
    let back = words.text("new_plan.back");
    if step != Step::Cad
        && buttons::with_words(ui, "back", button(1.0), Weight::Plain, back, fonts::semibold(size::BAR), scope.theme)
            .clicked()
    {
        assistant.go(step.back());
    }
    let cancel = Rect::from_min_size(inner.min, vec2(wide.min(130.0), inner.height()));
    let text = words.text("dialog.cancel");
    if buttons::with_words(ui, "cancel", cancel, Weight::Quiet, text, fonts::regular(size::BAR), scope.theme).clicked()
    {
        match assistant.entries.has_something() {
            true => assistant.asking = true,
            false => scope.ask(Action::NewPlan(Command::Cancel)),
        }
    }
    let behind = if step == Step::Cad { 0.0 } else { 1.0 };
    let between = Rect::from_min_max(
        pos2(cancel.right() + 16.0, inner.top()),
        pos2(button(behind).left() - 16.0, inner.bottom()),
    );
    let missing_words = |key| match key {
        "new_plan.thickness_limits" => steps::limits(words),
        key => words.text(key).to_owned(),
    };
    let fault = assistant.fault.as_deref().map(|fault| words.library(fault).into_owned());
    let told = fault.or_else(|| missing.map(missing_words));
    if let Some(told) = told {
        let colour = if assistant.fault.is_some() { scope.theme.fail } else { scope.theme.quiet };
        let points = if between.width() < 240.0 { size::NOTE } else { size::BODY };
        write::block(ui, between, Align2::RIGHT_CENTER, &told, fonts::regular(points), colour, 3);
    }
}

/// What was chosen and picked would be lost.
fn ask_ui(ui: &mut Ui, scope: &mut Scope, assistant: &mut Assistant) {
    let words = scope.words;
    let shown = cards::modal(ui, egui::Id::unique("leave new plan")).show(ui.ctx(), |ui| {
        ui.set_width(f32::min(420.0, ui.ctx().content_rect().width() - 64.0));
        ui.heading(words.text("new_plan.leave_title"));
        ui.add_space(6.0);
        ui.label(words.text("new_plan.leave_text"));
        ui.add_space(14.0);
        ui.horizontal(|ui| {
            let stay = ui.add(Button::new(words.text("new_plan.stay")).min_size(vec2(140.0, 34.0))).clicked();
            let leave = ui.add(Button::new(words.text("new_plan.leave")).min_size(vec2(140.0, 34.0))).clicked();
            (stay, leave)
        })
        .inner
    });
    let (stay, leave) = shown.inner;
    if leave {
        scope.ask(Action::NewPlan(Command::Cancel));
    }
    if stay || leave || shown.should_close() {
        assistant.asking = false;
    }
}
