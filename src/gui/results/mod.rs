//! The results screen: where a part is out of tolerance, and why.

mod controls;
mod earlier;
mod header;
mod histogram;
mod keys;
mod layout;
mod lower;
mod number_line;
mod numbers;
pub(super) mod order;
mod picture;
mod section;
mod section_plot;
mod sentence;
pub(in crate::gui) mod still_plot;
mod table;
pub(in crate::gui) mod trend;
mod view_bar;
mod views;
mod why;

use super::action::Action;
use super::facts::{FinishedPart, Job};
use super::fonts;
use super::scene::builder::Builder;
use super::scene::camera::ViewSize;
use super::scene::canvas::Canvas;
use super::scene::content::{MapContent, PartContent};
use super::scene::linked::{Linked, size_of};
use super::scene::pick::Pick;
use super::scene::renderer::{Classes, Layer};
use super::scope::Scope;
use super::theme::size;
use super::widgets::{cards, words as write};
use crate::gui::breadth::Breadth;
use crate::inspect::{Inspection, Outcome, PointResult};
use crate::part::Part;
use crate::report::palette::Scale;
use egui::{Align2, Button, Rect, RichText, Ui, pos2, vec2};
use header::Head;
use layout::Places;
use lower::{Lower, Lowers};
use std::sync::Arc;
use table::{Columns, TableView};
use views::{Content, Labels};

/// The thing that a narrow window shows.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
enum Tab {
    #[default]
    Scene,
    Points,
    Why,
    Trend,
}

/// What is looked at on this screen.
pub struct ResultsView {
    builder: Builder,
    canvas: Canvas,
    linked: Linked,
    layer: Option<Layer>,
    classes: Classes,
    labels: Labels,
    scale: Scale,
    /// The part and range for which camera and scale were set.
    of: Option<(Arc<Part>, f64)>,
    table: TableView,
    tab: Tab,
    lower: Lower,
    picture: picture::Pictures,
    sections: section_plot::Sections,
    trend_span: trend::Span,
    measuring: bool,
    picks: Vec<Pick>,
    /// The whole part is to be shown in the next frame.
    fit: bool,
    /// Room that a fit leaves.
    margin: [f64; 2],
    /// The size of the view into which the part is fitted.
    fit_size: ViewSize,
    /// The point to which the camera flew.
    visited: Option<usize>,
    /// Points beyond the scale of a map.
    counted: Option<(Arc<MapContent>, f64, [usize; 2])>,
    /// What the camera turns in the next frame.
    turn: Option<f64>,
    /// The map of the part looked at is ready.
    map_ready: bool,
}

impl std::fmt::Debug for ResultsView {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("ResultsView")
    }
}

impl Default for ResultsView {
    fn default() -> Self {
        Self {
            builder: Builder::default(),
            canvas: Canvas::default(),
            linked: Linked::default(),
            layer: None,
            classes: Classes::VALUES,
            labels: Labels::default(),
            scale: views::scale_of(1.0),
            of: None,
            table: TableView::default(),
            tab: Tab::default(),
            lower: Lower::default(),
            picture: picture::Pictures::default(),
            sections: section_plot::Sections::default(),
            trend_span: trend::Span::default(),
            measuring: false,
            picks: Vec::new(),
            fit: false,
            margin: super::scene::linked::FLAG_MARGIN,
            fit_size: ViewSize { width: 640.0, height: 480.0 },
            visited: None,
            counted: None,
            turn: None,
            map_ready: false,
        }
    }
}

impl ResultsView {
    /// What the map view shows. Beside a view of the CAD, never the CAD again.
    fn layer(&self, alone: bool) -> Layer {
        match self.layer {
            Some(Layer::Cad) if !alone => Layer::Surface,
            Some(layer) => layer,
            None => Layer::Surface,
        }
    }

    /// Points of a map over and under the ends of the scale; counted when either changes.
    fn beyond(&mut self, map: &Arc<MapContent>) -> [usize; 2] {
        let range_mm = self.scale.range_mm;
        match &self.counted {
            Some((of, range, counts)) if Arc::ptr_eq(of, map) && *range == range_mm => *counts,
            _ => {
                let count =
                    |out: fn(f32, f32) -> bool| map.cloud.values.iter().filter(|v| out(**v, range_mm as f32)).count();
                let counts = [count(|v, range| v > range), count(|v, range| v < -range)];
                self.counted = Some((map.clone(), range_mm, counts));
                counts
            }
        }
    }

    /// Whether map and pictures are ready and whole.
    pub(super) fn is_whole(&self) -> bool {
        self.map_ready && self.canvas.is_whole()
    }

    /// Turns the camera in the next frame, as a pointer that moves so many points to the right would.
    pub(super) fn turn(&mut self, right: f64) {
        self.turn = Some(right);
    }

    /// What the map view shows from now on.
    pub(super) fn show_layer(&mut self, layer: Layer) {
        self.layer = Some(layer);
    }

    /// The range that the plan of the part looked at gives.
    fn range_of_plan(&self) -> Option<f64> {
        self.of.as_ref().map(|(_, range_mm)| views::scale_of(*range_mm).range_mm)
    }

    /// Measuring on or off; begins anew.
    fn toggle_measuring(&mut self) {
        self.measuring = !self.measuring;
        self.picks.clear();
    }

    /// Another part begins with its own view and scale; the next scan of the same part leaves both.
    fn begin(&mut self, part: &Arc<Part>, range_mm: f64) {
        // A sequence that is run again reads the same CAD again.
        let same_part = self.of.as_ref().is_some_and(|(p, _)| p.cad_sha256 == part.cad_sha256);
        let same_range = self.of.as_ref().is_some_and(|(_, r)| *r == range_mm);
        if !(same_part && same_range) {
            let other_part = !same_part;
            self.scale = views::scale_of(range_mm);
            if other_part {
                self.linked = Linked::default();
                self.picks.clear();
                self.visited = None;
            }
            self.of = Some((part.clone(), range_mm));
        }
    }
}

/// What is ready to be shown of a part.
struct Ready {
    part: Arc<PartContent>,
    map: Option<Arc<MapContent>>,
}

/// Draws the screen.
pub(super) fn results_ui(ui: &mut Ui, scope: &mut Scope, view: &mut ResultsView) {
    let all = ui.max_rect();
    if let Some(place) = scope.view.earlier.filter(|k| *k < scope.facts.earlier_results().len()) {
        return earlier::earlier_ui(ui, all, place, view, scope);
    }
    let Some(part) = scope.part().cloned() else { return earlier::nothing_yet_ui(ui, all, scope) };
    let place = scope.view.part.filter(|k| *k < scope.facts.parts.len()).unwrap_or(scope.facts.parts.len() - 1);
    if scope.view.part.is_none() {
        // The part that is looked at stays when another one arrives.
        scope.ask(Action::ChoosePart(Some(place)));
    }
    let places = layout::places(all);
    header::header_ui(ui, places.header, &Head::of_part(&part, place, scope.words), scope);
    view.picture.ui(ui, scope);
    match &part.result.outcome {
        Outcome::Refused(refusal) => {
            // There are no tabs either.
            let others = [places.table, places.why, places.trend, places.histogram].into_iter();
            let at = others.chain(places.cad).chain(places.tabs).fold(places.map, Rect::union);
            refused_ui(ui, at, refusal, scope);
        }
        Outcome::Measured(inspection) => measured_ui(ui, &places, &part, place, inspection, view, scope),
    }
}

/// Why the scan was refused and what to do.
fn refused_ui(ui: &mut Ui, at: Rect, refusal: &crate::diagnostic::Refusal, scope: &Scope) {
    cards::card(ui, at, scope.theme);
    let room = at.shrink2(vec2(if at.width() < 640.0 { 16.0 } else { 40.0 }, 12.0));
    let low = room.height() < 260.0;
    let (large, small) = if low { (size::CARD, size::BODY) } else { (size::HEADER, size::CARD) };
    let text = Rect::from_center_size(room.center(), vec2(room.width().min(800.0), room.height().min(260.0)));
    let rows = |height: f32, points: f32| ((height / (1.35 * points)) as usize).max(1);
    let reason = scope.words.told(&refusal.reason);
    let lines = rows(0.6 * text.height(), large).min(4);
    let first = write::block(ui, text, Align2::CENTER_TOP, &reason, fonts::semibold(large), scope.theme.text, lines);
    let help = scope.words.told(&refusal.help);
    let below = text.with_min_y(first.bottom() + if low { 8.0 } else { 16.0 });
    let lines = rows(below.height(), small).min(4);
    write::block(ui, below, Align2::CENTER_TOP, &help, fonts::regular(small), scope.theme.quiet, lines);
}

fn measured_ui(
    ui: &mut Ui,
    places: &Places,
    part: &Arc<FinishedPart>,
    place: usize,
    inspection: &Inspection,
    view: &mut ResultsView,
    scope: &mut Scope,
) {
    view.begin(&part.part, part.result.map_range_mm);
    let points = &inspection.points;
    let chosen = scope.view.point.and_then(|k| points.get(k));
    let ready = ready(ui, part, place, inspection, view, scope);
    let narrow = places.breadth == Breadth::Narrow;
    if let Some(tabs) = places.tabs {
        tabs_ui(ui, tabs, &Tab::ALL, view, scope);
    }
    if !narrow || view.tab == Tab::Scene {
        scenes_ui(ui, places, part, inspection, ready.as_ref(), view, scope);
    }
    if !narrow || view.tab == Tab::Points {
        let columns = Columns::in_width(places.table.width());
        if let Some(k) = table::table_ui(ui, places.table, (points, true), &mut view.table, columns, scope) {
            // A click on the chosen row flies there again.
            view.visited = None;
            scope.ask(Action::ChoosePoint(Some(k)));
        }
    }
    if !narrow || view.tab == Tab::Why {
        why::why_ui(ui, places.why, (part, inspection), chosen, &mut view.sections, scope);
    }
    let lower_ui = Lowers { part, place, inspection, chosen, map: ready.as_ref().and_then(|r| r.map.as_deref()) };
    match places.breadth {
        Breadth::Wide => {
            lower_ui.histogram(ui, places.histogram, view, scope);
            lower_ui.trend(ui, places.trend, &mut view.trend_span, scope);
        }
        Breadth::Middle => lower_ui.either(ui, places.trend, view, scope),
        Breadth::Narrow if view.tab == Tab::Trend => lower_ui.either(ui, places.trend, view, scope),
        Breadth::Narrow => {}
    }
    // When all that could be typed into has been drawn.
    keys::keys(ui, points, places, ready.as_ref().map(|r| &r.part), view, scope);
}

/// What is ready of the part looked at. An older part whose points were let go is inspected again for them.
fn ready(
    ui: &Ui,
    part: &Arc<FinishedPart>,
    place: usize,
    inspection: &Inspection,
    view: &mut ResultsView,
    scope: &mut Scope,
) -> Option<Ready> {
    let content = view.builder.part(&part.part, inspection.best_fit.face, ui.ctx())?;
    if part.is_thin() && matches!(scope.facts.job, Job::Idle) {
        scope.ask(Action::Fetch(place));
    }
    let map = match &part.scan {
        Some(scan) if !part.is_thin() => view.builder.map(&content, &part.result, scan, ui.ctx()),
        _ => None,
    };
    Some(Ready { part: content, map })
}

fn scenes_ui(
    ui: &mut Ui,
    places: &Places,
    part: &Arc<FinishedPart>,
    inspection: &Inspection,
    ready: Option<&Ready>,
    view: &mut ResultsView,
    scope: &mut Scope,
) {
    view.map_ready = ready.is_some_and(|r| r.map.is_some());
    let Some(ready) = ready else {
        for at in places.cad.into_iter().chain([places.map]) {
            cards::card(ui, at, scope.theme);
            let text = scope.words.text("results.part_is_made");
            write::line(ui, at, Align2::CENTER_CENTER, text, fonts::regular(size::BODY), scope.theme.quiet);
        }
        return;
    };
    let spacing_mm = part.scan.as_ref().map_or(1.0, |s| s.spacing_mm);
    let content = Content { part: &ready.part, map: ready.map.as_ref(), inspection, plan: &part.plan, spacing_mm };
    let scene = views::map_scene(places.map, view.layer(places.cad.is_none()));
    view.margin = views::margin(view.labels, scene);
    view.fit_size = size_of(scene);
    if std::mem::take(&mut view.fit) {
        view.linked.fit(&ready.part, view.fit_size, view.margin, ui);
    }
    if let Some(right) = view.turn.take() {
        view.linked.turn(right, &ready.part, view.fit_size, ui);
    }
    if view.visited != scope.view.point {
        view.visited = scope.view.point;
        if let Some(point) = scope.view.point.and_then(|k| inspection.points.get(k)) {
            let normal = sheet_normal(&part.plan, point);
            view.linked.visit(&point.nominal, &normal, &ready.part, view.fit_size, ui);
        }
    }
    if let Some(cad) = places.cad {
        views::cad_ui(ui, cad, &content, view, scope);
    }
    views::map_ui(ui, places.map, &content, places.cad.is_none(), view, scope);
}

/// The sheet's normal at a point, as its plan says.
fn sheet_normal(plan: &crate::plan::Plan, point: &PointResult) -> crate::geometry::Vector3 {
    let of_plan = plan.comparison.iter().find(|p| p.name == point.name);
    of_plan.map_or(point.direction, |p| p.geometry.sheet_normal())
}

impl Tab {
    const ALL: [Tab; 4] = [Tab::Scene, Tab::Points, Tab::Why, Tab::Trend];

    /// The key of its name among the texts.
    fn key(self) -> &'static str {
        match self {
            Tab::Scene => "results.tab_scene",
            Tab::Points => "results.tab_points",
            Tab::Why => "results.tab_why",
            Tab::Trend => "results.tab_trend",
        }
    }
}

/// Those of the tabs that there are here; one that is not here leaves the first of them.
fn tabs_ui(ui: &mut Ui, at: Rect, tabs: &[Tab], view: &mut ResultsView, scope: &Scope) {
    let chosen = tabs.iter().find(|tab| **tab == view.tab).or(tabs.first()).copied();
    let each = (at.width() / tabs.len() as f32).min(180.0);
    for (k, tab) in tabs.iter().copied().enumerate() {
        let place = Rect::from_min_size(pos2(at.left() + k as f32 * each, at.top()), vec2(each - 8.0, at.height()));
        let text = RichText::new(scope.words.text(tab.key())).size(size::BODY);
        if ui.put(place, Button::selectable(chosen == Some(tab), text)).clicked() {
            view.tab = tab;
        }
    }
}
