//! How long a frame of the results screen takes: a scripted window over one scan of a plan, its times written into a file.

use super::engineer::lock::Lock;
use super::facts::{Facts, FinishedPart};
use super::results::{ResultsView, results_ui};
use super::scene::gl::finish;
use super::scene::renderer::Layer;
use super::scope::{Scope, ViewState};
use super::settings::Settings;
use super::text::{Language, Words};
use super::theme::Theme;
use super::{Screen, fonts};
use crate::diagnostic::Diagnostic;
use crate::plan;
use crate::run::RunContext;
use crate::worker::scans::{Links, list_scans};
use crate::worker::{Examiner, prepare_part};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// The window, points.
const WINDOW: [f32; 2] = [1920.0, 1080.0];
/// Frames of one turn of the camera.
const FRAMES: usize = 60;
/// How far the pointer would have moved in each, points.
const STEP: f64 = 8.0;
/// How long nothing is done, to see that nothing is drawn.
const IDLE: Duration = Duration::from_secs(2);

/// Milliseconds of some frames.
#[derive(Debug, Clone, Default, Serialize)]
struct Spread {
    median: f64,
    p95: f64,
    longest: f64,
}

/// What was measured.
#[derive(Debug, Clone, Default, Serialize)]
struct Times {
    window_points: [f32; 2],
    triangles: usize,
    points: usize,
    /// While the camera moves, the map on the CAD beside the CAD itself.
    surface_moving_ms: Spread,
    /// While the camera moves, the scan's points beside the CAD.
    cloud_moving_ms: Spread,
    /// The longest frame while the still picture of all points comes together.
    cloud_still_longest_ms: f64,
    /// From the last movement to the whole picture of all points.
    cloud_whole_ms: f64,
    /// Frames drawn in two seconds in which nothing happens.
    idle_frames: usize,
}

/// What the script does now.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Act {
    /// Waits for the picture.
    Ready,
    /// Turns the camera.
    Turn(Layer, usize),
    /// Waits for the still picture of all points.
    Still(Instant),
    /// Waits and does nothing.
    Idle(Instant),
}

struct Script {
    facts: Facts,
    view: ViewState,
    settings: Settings,
    lock: Lock,
    results: ResultsView,
    act: Act,
    before: Option<Instant>,
    frames_ms: Vec<f64>,
    times: Times,
    done: Arc<Mutex<Option<Times>>>,
}

/// Opens the window on the first scan of a plan, moves the camera, and writes the times as JSON. Nothing else is written.
pub fn frame_times(plan_path: &Path, file: &Path) -> Result<(), Diagnostic> {
    let part = inspected(plan_path)?;
    let done = Arc::new(Mutex::new(None));
    let script_done = done.clone();
    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default().with_title("Shapeline, frame times").with_inner_size(WINDOW),
        renderer: eframe::Renderer::Glow,
        depth_buffer: 24,
        ..eframe::NativeOptions::default()
    };
    let create: eframe::AppCreator = Box::new(|context| {
        fonts::install(&context.egui_ctx);
        Ok(Box::new(Script::new(part, script_done)))
    });
    eframe::run_native("shapeline-frame-times", options, create)
        .map_err(|e| Diagnostic::error(format!("the window cannot be opened: {e}").replace('\n', " ")))?;
    let times = done.lock().ok().and_then(|times| times.clone());
    let times = times.ok_or_else(|| Diagnostic::error("the window was closed before all frames were measured"))?;
    let text = serde_json::to_string_pretty(&times).unwrap_or_default() + "\n";
    std::fs::write(file, text).map_err(|e| Diagnostic::error(format!("cannot be written: {e}")).in_file(file))
}

/// The first scan of a plan, inspected.
fn inspected(plan_path: &Path) -> Result<FinishedPart, Diagnostic> {
    let loaded = plan::load(plan_path);
    let Some(plan) = loaded.plan else {
        let help = format!("see `shapeline check {}`", plan_path.display());
        return Err(Diagnostic::error("the plan has errors").in_file(plan_path).with_help(help));
    };
    let run = RunContext::silent();
    let scans = list_scans(&plan.scans, Links::Follow)?;
    let first = scans.into_iter().next().ok_or_else(|| {
        Diagnostic::error("the plan's folder holds no scan").in_file(plan_path).with_help("put one there")
    })?;
    let scan_path: PathBuf = first.path;
    let cancelled = || Diagnostic::error("cancelled");
    let (part, _) = prepare_part(&plan, &run).map_err(|e| match e {
        crate::diagnostic::ReadError::Bad(fault) | crate::diagnostic::ReadError::CutOff(fault) => *fault,
        crate::diagnostic::ReadError::Cancelled(_) => cancelled(),
    })?;
    let (plan, part) = (Arc::new(plan), Arc::new(part));
    let examiner = Examiner { plan: plan.clone(), part: part.clone() };
    let begin = Instant::now();
    let inspected = examiner.look_again(&scan_path, &run).map_err(|_| cancelled())?;
    if let crate::inspect::Outcome::Refused(refusal) = &inspected.result.outcome {
        return Err(Diagnostic::error(refusal.reason.clone()).in_file(&scan_path).with_help(refusal.help.clone()));
    }
    let (result, scan) = (Arc::new(inspected.result), inspected.scan.map(Arc::new));
    let (index, of, files, took) = (1, Some(1), Vec::new(), begin.elapsed());
    Ok(FinishedPart { index, of, scan_path, result, scan, plan, part, files, again: false, took })
}

impl Script {
    fn new(part: FinishedPart, done: Arc<Mutex<Option<Times>>>) -> Self {
        let times = Times {
            triangles: part.part.triangles_in_file,
            points: part.result.counts.points_read.unwrap_or(0),
            ..Times::default()
        };
        let mut facts = Facts::default();
        facts.push_part(part);
        Self {
            facts,
            view: ViewState { screen: Screen::Results, ..ViewState::default() },
            settings: Settings::default(),
            lock: Lock::default(),
            results: ResultsView::default(),
            act: Act::Ready,
            before: None,
            frames_ms: Vec::new(),
            times,
            done,
        }
    }

    /// One step of the script, after everything of the frame before was drawn.
    fn step(&mut self, ctx: &egui::Context, frame_ms: Option<f64>) {
        match self.act {
            Act::Ready if self.results.is_whole() => {
                self.begin(Layer::Surface);
                ctx.request_repaint();
            }
            Act::Ready => ctx.request_repaint_after(Duration::from_millis(20)),
            Act::Turn(layer, frame) => {
                // The first frame shows the layer and may still upload it.
                self.frames_ms.extend(frame_ms.filter(|_| frame > 1));
                self.results.turn(if frame < FRAMES / 2 { STEP } else { -STEP });
                self.act = Act::Turn(layer, frame + 1);
                if frame >= FRAMES {
                    self.end_turn(layer);
                }
                ctx.request_repaint();
            }
            Act::Still(since) => {
                self.times.cloud_still_longest_ms = self.times.cloud_still_longest_ms.max(frame_ms.unwrap_or(0.0));
                ctx.request_repaint();
                if self.results.is_whole() {
                    self.times.cloud_whole_ms = since.elapsed().as_secs_f64() * 1e3;
                    self.act = Act::Idle(Instant::now());
                    ctx.request_repaint_after(IDLE);
                }
            }
            Act::Idle(since) if since.elapsed() < IDLE => {
                self.times.idle_frames += 1;
                ctx.request_repaint_after(IDLE.saturating_sub(since.elapsed()));
            }
            Act::Idle(_) => {
                if let Ok(mut done) = self.done.lock() {
                    *done = Some(self.times.clone());
                }
                ctx.send_viewport_cmd(egui::ViewportCommand::Close);
            }
        }
    }

    fn begin(&mut self, layer: Layer) {
        self.results.show_layer(layer);
        self.frames_ms.clear();
        self.act = Act::Turn(layer, 0);
    }

    fn end_turn(&mut self, layer: Layer) {
        let spread = spread(&mut self.frames_ms);
        if layer == Layer::Surface {
            self.times.surface_moving_ms = spread;
            self.begin(Layer::Cloud);
        } else {
            self.times.cloud_moving_ms = spread;
            self.act = Act::Still(Instant::now());
        }
    }
}

fn spread(frames_ms: &mut [f64]) -> Spread {
    frames_ms.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let rank = (frames_ms.len() as f64 * share).ceil() as usize;
        frames_ms.get(rank.max(1) - 1).copied().unwrap_or(f64::NAN)
    };
    Spread { median: at(0.5), p95: at(0.95), longest: at(1.0) }
}

impl eframe::App for Script {
    fn ui(&mut self, ui: &mut egui::Ui, frame: &mut eframe::Frame) {
        if let Some(gl) = frame.gl() {
            finish(gl);
        }
        let now = Instant::now();
        let frame_ms = self.before.replace(now).map(|before| (now - before).as_secs_f64() * 1e3);
        self.times.window_points = ui.max_rect().size().into();
        self.step(&ui.ctx().clone(), frame_ms);
        let mut actions = Vec::new();
        let mut scope = Scope {
            facts: &self.facts,
            view: &self.view,
            words: Words::of(Language::English),
            theme: Theme::of(ui.ctx()),
            settings: &self.settings,
            settings_file: None,
            lock: &self.lock,
            now,
            typing: false,
            actions: &mut actions,
        };
        results_ui(ui, &mut scope, &mut self.results);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_is_told_by_nearest_rank() {
        let mut frames: Vec<f64> = (1..=20).rev().map(f64::from).collect();
        let told = spread(&mut frames);
        assert_eq!((told.median, told.p95, told.longest), (10.0, 19.0, 20.0));
        assert!(spread(&mut []).median.is_nan());
    }
}
