//! The merge screen: the views of a part or tool, the masks that leave out their bad points, and the one cloud that is made of them.
//!
//! ```text
//! MERGE.toml --act::open--> Merging --desk: views, what masks leave, study--> Merging      on threads of their own, nothing is written
//! Merge --worker--> the command line's files --hear--> Merging::done
//! ```

mod act;
mod colours;
mod desk;
mod facts;
mod figures;
mod header;
mod job;
mod layout;
mod legend;
mod masks;
mod plot;
mod result;
mod scene;
mod scene_bar;
mod state;
mod study;
mod told;
mod views;

pub use act::Command;
pub(in crate::gui) use act::{command, ended, hear, is_merge, open};
pub use colours::By;
pub(in crate::gui) use desk::{Desk, tick};
pub use facts::{Done, MergeRun, Merging, StudyState, ViewsState};
pub use state::{Cloud, MergeView, Pane};

use super::action::Action;
use super::facts::Job;
use super::fonts;
use super::scope::Scope;
use super::theme::size;
use super::widgets::buttons::{self, Weight};
use super::widgets::words as write;
use crate::gui::breadth::Breadth;
use egui::{Align2, Rect, Ui, vec2};

/// Draws the screen.
pub(super) fn merge_ui(ui: &mut Ui, scope: &mut Scope, view: &mut MergeView) {
    let facts = scope.facts;
    let Some(merging) = &facts.merging else { return nothing_ui(ui, scope) };
    let busy = match &facts.job {
        Job::Merging(run) => Some(run),
        _ => None,
    };
    let rows = merging.preview().map_or(0, |preview| preview.files.len());
    let places = layout::places(ui.max_rect(), busy.is_some(), views::wish(rows));
    header::header_ui(ui, places.header, places.breadth, merging, scope);
    if let Some(run) = busy {
        job::job_ui(ui, places.job, run, scope);
    }
    scene::refresh(ui, merging, view, scope);
    let shown = |pane: Pane, view: &MergeView| match places.breadth {
        Breadth::Narrow => view.pane == pane,
        Breadth::Middle => !matches!(pane, Pane::Study | Pane::Result) || view.lower == pane,
        Breadth::Wide => true,
    };
    if let Some(tabs) = places.tabs {
        header::tabs_ui(ui, tabs, view, scope);
    }
    if shown(Pane::Views, view) {
        views::views_ui(ui, places.views, merging, view, scope);
    }
    if shown(Pane::Masks, view) {
        masks::masks_ui(ui, places.masks, merging, scope);
    }
    if shown(Pane::Scene, view) {
        scene::scenes_ui(ui, &places, merging, view, scope);
    }
    let shared = places.breadth == Breadth::Middle;
    if shown(Pane::Study, view) {
        study::study_ui(ui, places.study, shared, merging, view, scope);
    }
    if shown(Pane::Result, view) {
        result::result_ui(ui, places.result, shared, merging, view, scope);
    }
    scene::keys(ui, view, scope);
}

/// There is no merge yet.
fn nothing_ui(ui: &mut Ui, scope: &mut Scope) {
    let all = ui.max_rect().shrink(32.0);
    let (theme, words) = (scope.theme, scope.words);
    let upper = all.with_max_y(all.center().y - 8.0);
    write::block(
        ui,
        upper,
        Align2::CENTER_BOTTOM,
        words.text("merge.none"),
        fonts::regular(size::CARD),
        theme.quiet,
        5,
    );
    let text = words.text("merge.open");
    let wide = write::width(ui, text, fonts::semibold(size::BAR)) + 48.0;
    let place = Rect::from_center_size(all.center() + vec2(0.0, 40.0), vec2(wide.min(all.width()), 48.0));
    let font = fonts::semibold(size::BAR);
    if buttons::with_words(ui, "open merge", place, Weight::Main, text, font, theme).clicked() {
        scope.ask(Action::AskForPlan);
    }
}
