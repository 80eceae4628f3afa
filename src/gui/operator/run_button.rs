//! The one large button: Run sequence, which turns into Stop.

use crate::gui::action::Action;
use crate::gui::fonts;
use crate::gui::perform::may_run;
use crate::gui::scope::Scope;
use crate::gui::theme::size;
use crate::gui::widgets::buttons::{self, Weight};
use crate::gui::widgets::{sign, words};
use egui::{Align2, Color32, Rect, Ui, vec2};

/// Draws the button.
pub(super) fn run_ui(ui: &mut Ui, place: Rect, scope: &mut Scope) {
    let words = scope.words;
    match scope.facts.running() {
        Some(running) => {
            let key = if running.stopping { "operator.stop_now" } else { "operator.stop" };
            let text = words.text(key);
            let (response, colour) = buttons::at(ui, "run", place, Weight::Stop, true, text, scope.theme);
            face(ui, place, text, "Esc", colour, scope.theme.quiet, sign::stop);
            if buttons::clicked_once(&response) {
                scope.ask(Action::Stop);
            }
        }
        None => {
            let may = may_run(scope.facts);
            // A plan that was mended meanwhile is read again.
            let again = may == Err("operator.plan_has_errors");
            let may = if again { Ok(()) } else { may.map(|_| ()) };
            let text = words.text(if again {
                "operator.check_again"
            } else if scope.settings.watch {
                "operator.watch_run"
            } else {
                "operator.run"
            });
            let (response, colour) = buttons::at(ui, "run", place, Weight::Main, may.is_ok(), text, scope.theme);
            let face_place = if may.is_ok() { place } else { place.with_max_y(place.bottom() - 24.0) };
            face(ui, face_place, text, "F5", colour, colour, sign::play);
            if let Err(why) = may {
                let below = place.with_min_y(place.bottom() - 32.0).shrink2(vec2(12.0, 0.0));
                let (font, colour) = (fonts::regular(size::BODY), scope.theme.quiet);
                words::line(ui, below, Align2::CENTER_CENTER, words.text(why), font, colour);
            }
            if buttons::clicked_once(&response) {
                scope.ask(Action::Run);
            }
        }
    }
}

/// Mark, words and key, as one group in the middle.
fn face(
    ui: &Ui,
    place: Rect,
    text: &str,
    key: &str,
    colour: Color32,
    key_colour: Color32,
    mark: fn(&egui::Painter, egui::Pos2, f32, Color32),
) {
    let r = (0.13 * place.height()).clamp(10.0, 18.0);
    let rest = place.width() - 2.0 * r - 24.0 - 24.0 - 60.0;
    let points = words::fitting_size(ui, text, fonts::semibold, rest, (0.34 * place.height()).min(46.0), 18.0);
    let wide = words::width(ui, text, fonts::semibold(points));
    let key_font = fonts::mono(0.48 * points);
    let all = 2.0 * r + 24.0 + wide + 24.0 + words::width(ui, key, key_font.clone());
    let middle = place.center().y;
    let mut x = place.center().x - 0.5 * all;
    mark(ui.painter(), egui::pos2(x + r, middle), r, colour);
    x += 2.0 * r + 24.0;
    ui.painter().text(egui::pos2(x, middle), Align2::LEFT_CENTER, text, fonts::semibold(points), colour);
    ui.painter().text(egui::pos2(x + wide + 24.0, middle), Align2::LEFT_CENTER, key, key_font, key_colour);
}
