//! The window's loop: `logic` hears the worker and carries out what was asked; `ui` draws and collects what is asked.

use super::action::{Action, Screen};
use super::bridge::{Bridge, Job};
use super::clock::Clock;
use super::earlier;
use super::engineer::desk::Desk;
use super::engineer::lock::Lock;
use super::engineer::{self, EngineerView};
use super::facts::{Facts, FinishedPart, Job as FactsJob};
use super::later::Later;
use super::lookout::{self, Lookout};
use super::merge::{self, MergeView};
use super::new_plan::{self, Assistant};
use super::operator;
use super::picture::Painter;
use super::results::{self, ResultsView};
use super::scope::{Scope, ViewState};
use super::settings::Settings;
use super::text::Words;
use super::theme::Theme;
use super::{bar, dialog, fonts, hear, help, keys, messages, perform};
use crate::diagnostic::{Diagnostic, Severity};
use crate::worker::earlier::EarlierResults;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// What a window is opened with.
#[derive(Debug, Clone, Default)]
pub struct Setup {
    /// The plan to open; none = the last one, or else the demo.
    pub plan: Option<PathBuf>,
    /// Where settings are kept; `None` = nowhere.
    pub settings_file: Option<PathBuf>,
    /// What time it is.
    pub clock: Clock,
    /// Where the demo project is unpacked to at the first start; `None` = nowhere, and no demo.
    pub data_folder: Option<PathBuf>,
}

/// How long a warning is in sight at least.
const WARNED: Duration = Duration::from_secs(20);

/// The window without its frame: what eframe and the tests run.
pub struct App {
    pub(super) facts: Facts,
    pub(super) view: ViewState,
    pub(super) settings: Settings,
    pub(super) setup: Setup,
    pub(super) bridge: Bridge,
    pub(super) lookout: Lookout,
    /// Results from before this start, while they are read.
    pub(super) earlier: Later<(PathBuf, EarlierResults)>,
    pub(super) dialog: dialog::Dialog,
    results: ResultsView,
    pub(super) engineer: EngineerView,
    pub(super) merge: MergeView,
    pub(super) merge_desk: merge::Desk,
    pub(super) lock: Lock,
    pub(super) desk: Desk,
    /// The plan that is to be read again when the sequence has ended.
    pub(super) reload: Option<PathBuf>,
    /// The watch that was stopped for that goes on by the new plan.
    pub(super) resume_watch: bool,
    /// The warning in sight, since when it is, and the part that was the newest then.
    warned: Option<(Diagnostic, Instant, Option<Arc<FinishedPart>>)>,
    /// A plan in the making.
    pub(super) new_plan: Option<Assistant>,
    /// The scan to be inspected as soon as a plan that was just made is open.
    pub(super) first_scan: Option<(PathBuf, PathBuf)>,
    pictures: Painter,
    actions: Vec<Action>,
    /// A field had the focus when the last frame ended: egui takes it away before a frame begins in which Esc or Tab is pressed.
    typing: bool,
}

impl App {
    /// A window's content: settings are read and the first plan is being opened when it returns.
    pub fn new(ctx: &egui::Context, setup: Setup) -> Result<Self, Diagnostic> {
        let waker = ctx.clone();
        let bridge = Bridge::start(move || waker.request_repaint())
            .map_err(|e| Diagnostic::error(format!("the worker cannot be started: {e}")))?;
        let waker = ctx.clone();
        let lookout = Lookout::start(move || waker.request_repaint())
            .map_err(|e| Diagnostic::error(format!("the thread for the scan folder cannot be started: {e}")))?;
        let waker = ctx.clone();
        let desk = Desk::start(move || waker.request_repaint())
            .map_err(|e| Diagnostic::error(format!("the threads for editing cannot be started: {e}")))?;
        let read = setup.settings_file.as_deref().map(Settings::open).unwrap_or_default();
        let (settings, damaged) = read;
        ctx.set_theme(settings.theme.preference());
        let mut app = Self {
            facts: Facts::default(),
            view: ViewState::default(),
            settings,
            setup,
            bridge,
            lookout,
            earlier: Later::default(),
            dialog: dialog::Dialog::default(),
            results: ResultsView::default(),
            engineer: EngineerView::default(),
            merge: MergeView::default(),
            merge_desk: merge::Desk::default(),
            lock: Lock::default(),
            desk,
            reload: None,
            resume_watch: false,
            warned: None,
            new_plan: None,
            first_scan: None,
            pictures: Painter::start(ctx),
            actions: Vec::new(),
            typing: false,
        };
        app.open_first(ctx);
        app.facts.message = app.facts.message.take().or(damaged);
        Ok(app)
    }

    /// What is so; for tests.
    pub fn facts(&self) -> &Facts {
        &self.facts
    }

    /// What is looked at; for tests.
    pub fn view(&self) -> &ViewState {
        &self.view
    }

    /// What is kept; for tests.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// What is looked at on the engineer's screen; for tests.
    pub fn engineer(&self) -> &EngineerView {
        &self.engineer
    }

    /// The same, to be changed as a click into the 3D view would; for tests, which have no OpenGL.
    pub fn engineer_mut(&mut self) -> &mut EngineerView {
        &mut self.engineer
    }

    /// What is looked at of a merge; for tests.
    pub fn merge_view(&self) -> &MergeView {
        &self.merge
    }

    /// Opens a plan, or asks for anything else, as a press of a button would.
    pub fn ask(&mut self, action: Action) {
        self.actions.push(action);
    }

    /// Hears the worker, then carries out what was asked. Never waits.
    pub fn logic(&mut self, ctx: &egui::Context) {
        for event in self.bridge.events() {
            hear::event(self, event);
        }
        if let Some(action) = self.dialog.answer() {
            self.actions.push(action);
        }
        let typing = self.typing || ctx.text_edit_focused();
        let Settings { watch, .. } = self.settings;
        let scale = self.settings.magnification();
        keys::collect(ctx, &self.facts, &self.view, typing, scale, watch, &mut self.actions);
        self.guard_close(ctx);
        let fresh = self.new_plan.is_some() || self.facts.plan_path.is_none();
        dialog::dropped(ctx, fresh, &mut self.actions);
        for action in std::mem::take(&mut self.actions) {
            perform::action(self, ctx, action);
        }
        engineer::tick(self, ctx);
        lookout::tick(self);
        earlier::tick(self, ctx);
        self.forget_old_warning();
        if let Some(left) = self.facts.troubles.tick(self.setup.clock.now()) {
            ctx.request_repaint_after(left);
        }
        merge::tick(self, ctx);
        if !matches!(self.facts.job, FactsJob::Running(_) | FactsJob::Merging(_))
            && let Some(path) = self.reload.take()
        {
            engineer::reload(self, path);
        }
        // Seconds go on while a part is at hand; else nothing moves by itself.
        let merging = matches!(self.facts.job, FactsJob::Merging(_));
        if merging || self.facts.running().is_some_and(|running| running.scan.is_some()) {
            ctx.request_repaint_after(std::time::Duration::from_millis(200));
        }
    }

    /// Draws the window and collects what is asked in it.
    pub fn ui(&mut self, ui: &mut egui::Ui) {
        let zoom = ui.ctx().zoom_factor();
        let scale = self.settings.magnification_in(ui.ctx().content_rect().size() * zoom);
        // A window that is too small for its scale is measured in rounded pixels.
        if (zoom - scale).abs() > 1e-3 {
            ui.ctx().set_zoom_factor(scale);
        }
        let theme = Theme::of(ui.ctx());
        let mut scope = Scope {
            facts: &self.facts,
            view: &self.view,
            words: Words::of(self.settings.language),
            theme,
            settings: &self.settings,
            settings_file: self.setup.settings_file.as_deref(),
            lock: &self.lock,
            now: self.setup.clock.now(),
            typing: self.typing || ui.ctx().text_edit_focused(),
            actions: &mut self.actions,
        };
        let screen = self.view.screen;
        bar::top_ui(ui, &mut scope);
        bar::status_ui(ui, &mut scope, &self.engineer);
        // On the operator's screen nothing may move.
        if screen != Screen::Operator {
            messages::message_ui(ui, &mut scope);
        }
        let frame = egui::Frame::NONE.fill(theme.window);
        egui::CentralPanel::no_frame().frame(frame).show(ui, |ui| match screen {
            Screen::Results => results::results_ui(ui, &mut scope, &mut self.results),
            Screen::Engineer => match &mut self.new_plan {
                Some(assistant) if scope.lock.is_open(scope.now) => {
                    new_plan::new_plan_ui(ui, &mut scope, assistant, &mut self.engineer)
                }
                _ => engineer::engineer_ui(ui, &mut scope, &mut self.engineer),
            },
            Screen::Merge => merge::merge_ui(ui, &mut scope, &mut self.merge),
            Screen::Operator => operator::operator_ui(ui, &mut scope, &mut self.pictures),
        });
        help::help_ui(ui, &mut scope);
        dialog::typed_path_ui(ui, &mut scope);
        engineer::leave_ui(ui, &mut scope);
        dialog::drop_hint_ui(ui, &scope);
        self.typing = ui.ctx().text_edit_focused();
        if !self.actions.is_empty() {
            ui.ctx().request_repaint();
        }
    }

    /// A warning goes by itself once it was in sight for a while and a later part was inspected; an error stays until somebody saw it.
    fn forget_old_warning(&mut self) {
        let now = self.setup.clock.now();
        let facts = &mut self.facts;
        let Some(told) = facts.message.as_ref().filter(|told| told.severity == Severity::Warning) else {
            self.warned = None;
            return;
        };
        let newest = facts.parts.last();
        match &self.warned {
            Some((known, since, then)) if known == told => {
                let later = newest.map(Arc::as_ptr) != then.as_ref().map(Arc::as_ptr);
                if later && now.saturating_duration_since(*since) >= WARNED {
                    facts.message = None;
                    self.warned = None;
                }
            }
            _ => self.warned = Some((told.clone(), now, newest.cloned())),
        }
    }

    /// A window with work that is not saved asks before it closes.
    fn guard_close(&mut self, ctx: &egui::Context) {
        let unsaved = self.facts.editing.as_ref().is_some_and(|editing| editing.document.is_modified());
        if unsaved && ctx.input(|i| i.viewport().close_requested()) {
            ctx.send_viewport_cmd(egui::ViewportCommand::CancelClose);
            self.view.leaving = Some(Action::Close);
        }
    }

    /// Starts a job of the worker.
    pub(super) fn begin(&mut self, job: Job) {
        self.bridge.begin(job);
    }

    /// Writes what is kept; a folder that cannot be written costs comfort, never work.
    pub fn keep_settings(&mut self) {
        if let Some(path) = &self.setup.settings_file
            && let Err(fault) = self.settings.write(path)
            && self.facts.message.is_none()
        {
            let message = format!("the window's settings cannot be written: {fault}");
            self.facts.message = Some(Diagnostic::warning(message).in_file(path));
        }
    }
}

/// Fonts and themes; once a context, before its first frame.
pub fn install(ctx: &egui::Context) {
    fonts::install(ctx);
}

impl eframe::App for App {
    fn logic(&mut self, ctx: &egui::Context, _frame: &mut eframe::Frame) {
        self.logic(ctx);
    }

    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        bar::note_window_place(ui.ctx(), &mut self.settings);
        self.ui(ui);
    }

    fn on_exit(&mut self, _gl: Option<&eframe::glow::Context>) {
        // What is not saved is never lost, however the window ends.
        if let Some(editing) = self.facts.editing.as_ref().filter(|e| e.recovery.is_none()) {
            let _ = crate::worker::plan_file::autosave(&editing.document);
        }
        self.keep_settings();
    }
}
