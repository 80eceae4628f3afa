//! The operator's screen: is the last part good, and does the line keep up? Nothing here changes the plan.

mod lamps;
mod layout;
mod loaded;
mod map;
mod now;
mod ready;
mod run_button;
mod side;
mod verdict;
mod worst;

pub(in crate::gui) use now::stage_words;

use super::messages;
use super::picture::Painter;
use super::scope::Scope;
use crate::inspect::Outcome;
use egui::{Rect, Ui};
use layout::Form;

/// Draws the screen.
pub(super) fn operator_ui(ui: &mut Ui, scope: &mut Scope, pictures: &mut Painter) {
    let inside = ui.max_rect();
    let mut places = layout::places(inside);
    let head = inside.with_max_y(inside.top() + messages::HEIGHT);
    // What the verdict's card says is not said twice.
    let message = scope.facts.message.is_some() && !verdict::tells_the_message(scope);
    match (message, places.loaded) {
        // A message stands beside what part it is, so that neither verdict nor button moves.
        (true, Some(place)) => {
            let end = loaded::who_ui(ui, place, scope);
            messages::place_ui(ui, head.with_min_x(end + 16.0), scope);
        }
        (true, None) => {
            places = layout::places(inside.with_min_y(head.bottom()));
            messages::place_ui(ui, head, scope);
        }
        (false, Some(place)) => loaded::loaded_ui(ui, place, scope),
        (false, None) => {}
    }
    let cut = verdict::verdict_ui(ui, place_of(places.verdict), &places, scope);
    run_button::run_ui(ui, places.run, scope);
    now::now_ui(ui, places.now, places.form, cut.as_deref(), scope);
    if let Some(place) = places.worst {
        let part = scope.facts.judged().cloned();
        match part.filter(|part| matches!(part.result.outcome, Outcome::Measured(_))) {
            Some(part) if places.form == Form::Full => {
                let (worst, map) = layout::beside_the_map(place);
                worst::worst_ui(ui, worst, places.worst_rows, scope);
                map::map_ui(ui, map, &part, pictures, scope);
            }
            _ if scope.facts.judged().is_none() => ready::ready_ui(ui, place, places.worst_rows, scope),
            _ => worst::worst_ui(ui, place, places.worst_rows, scope),
        }
    }
    if let Some(place) = places.takt {
        side::takt_ui(ui, place, scope);
    }
    if let Some(place) = places.waiting {
        side::waiting_ui(ui, place, scope);
    }
    if let Some(place) = places.watch {
        side::watch_ui(ui, place, scope);
    }
    if let Some(place) = places.show {
        side::show_ui(ui, place, scope);
    }
    if let Some(place) = places.lamps {
        lamps::lamps_ui(ui, place, places.lamp_count, scope);
    }
}

/// On whole points, so that thick frames are even.
fn place_of(place: Rect) -> Rect {
    Rect::from_min_max(place.min.round(), place.max.round())
}
