//! Why the chosen point has its verdict: sentence, number line, gates, what its uncertainty is made of.

use super::number_line::number_line_ui;
use super::order::{kind_key, verdict_word};
use super::section_plot::{self, Sections};
use super::{numbers, sentence};
use crate::gui::facts::FinishedPart;
use crate::gui::fonts;
use crate::gui::scope::Scope;
use crate::gui::text::Words;
use crate::gui::theme::{Theme, size};
use crate::gui::widgets::sign::{self, Sign};
use crate::gui::widgets::{cards, words as write};
use crate::inspect::{Budget, Inspection, PointResult, Verdict};
use crate::measure::{Gate, Rule, WindowShare};
use egui::{Align, Align2, Grid, Label, Layout, Rect, RichText, ScrollArea, Ui, vec2};

/// Draws the card of a point, or what to do to see one.
pub fn why_ui(
    ui: &mut Ui,
    at: Rect,
    (part, of): (&FinishedPart, &Inspection),
    point: Option<&PointResult>,
    sections: &mut Sections,
    scope: &mut Scope,
) {
    let (theme, words) = (scope.theme, scope.words);
    card_ui(ui, at, ("why", point, true), scope, |ui, point| {
        body_ui(ui, (part, of, point), sections, words, theme);
    });
}

/// Draws the card of a point as it was written earlier: what stands in its file, without gates and section.
/// Of a file that nothing vouches for, the numbers alone.
pub fn stored_ui(ui: &mut Ui, at: Rect, point: Option<&PointResult>, vouched_for: bool, scope: &Scope) {
    card_ui(ui, at, ("stored why", point, vouched_for), scope, |ui, point| {
        stored_body_ui(ui, point, vouched_for, scope);
    });
}

/// The frame of a card: the point's name and verdict above `body_ui`, which scrolls; without a point, what to do to see one.
fn card_ui(
    ui: &mut Ui,
    at: Rect,
    (name, point, vouched_for): (&str, Option<&PointResult>, bool),
    scope: &Scope,
    body_ui: impl FnOnce(&mut Ui, &PointResult),
) {
    let (theme, words) = (scope.theme, scope.words);
    cards::card(ui, at, theme);
    let inner = at.shrink2(vec2(16.0, 12.0));
    let Some(point) = point else {
        let text = words.text("results.choose_a_point");
        write::line(ui, inner, Align2::CENTER_CENTER, text, fonts::regular(size::BODY), theme.quiet);
        return;
    };
    let head = inner.with_max_y(inner.top() + 28.0);
    head_ui(ui, head, point, vouched_for, scope);
    let body = inner.with_min_y(head.bottom() + 6.0);
    let builder = egui::UiBuilder::new().max_rect(body).layout(Layout::top_down(Align::Min));
    ui.scope_builder(builder, |ui| {
        ScrollArea::vertical().id_salt((name, &point.name)).auto_shrink(false).show(ui, |ui| {
            ui.set_width(body.width() - 12.0);
            body_ui(ui, point);
        });
    });
}

fn stored_body_ui(ui: &mut Ui, point: &PointResult, vouched_for: bool, scope: &Scope) {
    let (theme, words) = (scope.theme, scope.words);
    if vouched_for {
        ui.add(Label::new(RichText::new(sentence::of_point(point, words)).size(size::BODY)).wrap());
        ui.add_space(6.0);
        number_line_ui(ui, point, words, theme);
    } else {
        let text = words.text("results.untrusted_point");
        ui.add(Label::new(RichText::new(text).size(size::BODY)).wrap());
    }
    if let Some(m) = &point.measurement {
        budget_ui(ui, &m.budget, m.uncertainty_mm, words, theme);
    }
    facts_ui(ui, point, words, theme);
    ui.add_space(8.0);
    let rest = RichText::new(words.text("results.earlier_more")).size(size::NOTE).color(theme.quiet);
    ui.add(Label::new(rest).wrap());
}

fn head_ui(ui: &mut Ui, head: Rect, point: &PointResult, vouched_for: bool, scope: &Scope) {
    let (theme, words) = (scope.theme, scope.words);
    let sign = if vouched_for { Sign::from(point.verdict) } else { Sign::Untrusted };
    let verdict = if vouched_for { verdict_word(point.verdict, words) } else { sign.word(words) };
    let place = Rect::from_min_size(head.min + vec2(0.0, 3.0), vec2(22.0, 22.0));
    sign.paint(ui.painter(), place, theme);
    let title =
        format!("{}, {}, {}", point.name, words.noun_within(words.text(kind_key(point.kind))), verdict.to_lowercase());
    let copy = head.with_min_x(head.right() - 90.0);
    let line = Rect::from_min_max(head.min + vec2(32.0, 0.0), head.max - vec2(98.0, 0.0));
    write::line(ui, line, Align2::LEFT_CENTER, &title, fonts::semibold(size::BAR), theme.text);
    if vouched_for && ui.put(copy, egui::Button::new(words.text("results.copy"))).clicked() {
        ui.ctx().copy_text(as_text(point, words));
    }
}

/// Widths of the card from which the section stands beside the gates, and of the section there, points.
const BESIDE_FROM: f32 = 560.0;
const BESIDE: f32 = 240.0;
/// Its height.
const SECTION: f32 = 170.0;

fn body_ui(
    ui: &mut Ui,
    (part, of, point): (&FinishedPart, &Inspection, &PointResult),
    sections: &mut Sections,
    words: &Words,
    theme: &Theme,
) {
    ui.add(Label::new(RichText::new(sentence::of_point(point, words)).size(size::BODY)).wrap());
    ui.add_space(6.0);
    number_line_ui(ui, point, words, theme);
    ui.add_space(10.0);
    let width = ui.available_width();
    let mut section_ui = |ui: &mut Ui, wide: f32| {
        section_plot::section_ui(ui, vec2(wide, SECTION), (part, of, point), sections, (words, theme));
    };
    if width >= BESIDE_FROM {
        ui.horizontal_top(|ui| {
            section_ui(ui, BESIDE);
            ui.add_space(6.0);
            ui.vertical(|ui| gates_ui(ui, point, words, theme));
        });
    } else {
        section_ui(ui, width.min(420.0));
        ui.add_space(8.0);
        gates_ui(ui, point, words, theme);
    }
    if let Some(m) = &point.measurement {
        budget_ui(ui, &m.budget, m.uncertainty_mm, words, theme);
    }
    facts_ui(ui, point, words, theme);
}

/// The gates in the order in which they are told: the failed one first.
fn in_order(gates: &[Gate]) -> Vec<&Gate> {
    let (passed, failed): (Vec<&Gate>, Vec<&Gate>) = gates.iter().partition(|g| g.passed());
    failed.into_iter().chain(passed).collect()
}

fn gates_ui(ui: &mut Ui, point: &PointResult, words: &Words, theme: &Theme) {
    if point.card.gates.is_empty() {
        return;
    }
    // The numbers beside the names take 230 points.
    let gate_width = (ui.available_width() - 230.0).clamp(120.0, 420.0);
    let head = |ui: &mut Ui, key| {
        ui.label(RichText::new(words.text(key)).font(fonts::semibold(size::NOTE)).color(theme.quiet))
    };
    Grid::new(("gates", &point.name)).num_columns(4).spacing([12.0, 3.0]).show(ui, |ui| {
        head(ui, "results.gate");
        head(ui, "results.value");
        head(ui, "results.limit");
        ui.end_row();
        for gate in in_order(&point.card.gates) {
            let passed = gate.passed();
            let (font, colour) = if passed {
                (fonts::regular(size::TABLE), theme.text)
            } else {
                (fonts::semibold(size::TABLE), theme.text)
            };
            let name = RichText::new(words.told(gate.name)).font(font).color(colour);
            ui.scope(|ui| {
                ui.set_width(gate_width);
                ui.add(Label::new(name).wrap());
            });
            let [value, limit] = gate_numbers(gate, words);
            let number = |ui: &mut Ui, text: String, colour| {
                ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                    ui.label(RichText::new(text).font(fonts::mono(size::TABLE)).color(colour));
                });
            };
            number(ui, value, theme.text);
            number(ui, limit, theme.quiet);
            let (rect, response) = ui.allocate_exact_size(vec2(16.0, 16.0), egui::Sense::hover());
            let said = words.text(if passed { "results.gate_passed" } else { "results.gate_failed" });
            response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Label, true, said));
            if passed {
                sign::check(ui.painter(), rect.center(), 8.0, theme.text);
            } else {
                sign::problem(ui.painter(), rect, true, theme);
            }
            ui.end_row();
        }
    });
}

/// Value and limit of a gate with their unit.
fn gate_numbers(gate: &Gate, words: &Words) -> [String; 2] {
    let number = |v: f64| {
        if !v.is_finite() {
            return numbers::NONE.to_owned();
        }
        match gate.unit {
            "mm" => format!("{} mm", words.number(v, 3)),
            "deg" => format!("{}°", words.number(v, 1)),
            _ if v.fract() == 0.0 && v.abs() < 1e9 => words.number(v, 0),
            _ => words.number(v, 2),
        }
    };
    let sign = match gate.rule {
        Rule::AtLeast => "≥",
        Rule::AtMost => "≤",
    };
    [number(gate.value), format!("{sign} {}", number(gate.limit))]
}

/// The parts of the uncertainty in one line.
fn budget_ui(ui: &mut Ui, budget: &Budget, u_mm: f64, words: &Words, theme: &Theme) {
    let parts = [
        ("results.u_fit", budget.fit_mm),
        ("results.u_pose", budget.pose_mm),
        ("results.u_thickness", budget.thickness_mm),
        ("results.u_scale", budget.scale_mm),
        ("results.u_edge_offset", budget.edge_offset_mm),
        ("results.u_system", budget.system_mm),
    ];
    let parts: Vec<String> = parts
        .into_iter()
        .filter(|(_, mm)| *mm > 0.0)
        .map(|(key, mm)| format!("{} {}", words.text(key), words.number(mm, 4)))
        .collect();
    let all = [("parts", &*parts.join(", ")), ("u", &*words.number(u_mm, 3))];
    ui.add_space(8.0);
    let text = RichText::new(words.fill("results.u_parts", &all)).size(size::TABLE).color(theme.text);
    ui.add(Label::new(text).wrap());
}

/// What else the value rests on.
fn facts_ui(ui: &mut Ui, point: &PointResult, words: &Words, theme: &Theme) {
    let card = &point.card;
    let mm = |v: f64| format!("{} mm", words.number(v, 3));
    let mut facts = vec![words.fill("results.fact_points", &[("n", &words.thousands(point.points_used))])];
    let known = [
        ("results.fact_window", card.window_mm.map(mm)),
        ("results.fact_residual", card.residual_mm.map(mm)),
        ("results.fact_spacing", card.spacing_mm.map(mm)),
        ("results.fact_cad_edge", card.cad_edge_mm.filter(|v| v.is_finite()).map(mm)),
        ("results.fact_covered", card.covered.map(|v| format!("{} %", words.number(100.0 * v, 0)))),
    ];
    if !card.blended.is_empty() {
        let share = |w: &WindowShare| format!("{} ({} %)", mm(w.window_mm), words.number(100.0 * w.share, 0));
        let all: Vec<String> = card.blended.iter().map(share).collect();
        facts.push(words.fill("results.fact_blended", &[("v", &all.join(", "))]));
    }
    facts.extend(known.into_iter().filter_map(|(key, value)| Some(words.fill(key, &[("v", &value?)]))));
    if let Some(hole) = point.measurement.as_ref().and_then(|m| m.hole.as_ref()) {
        let diameter = [("v", &*mm(hole.diameter_mm)), ("d", &*words.signed_mm(hole.diameter_deviation_mm))];
        facts.push(words.fill("results.fact_diameter", &diameter));
        facts.push(words.fill("results.fact_position", &[("v", &mm(hole.position_mm))]));
    }
    ui.add_space(8.0);
    let text = RichText::new(facts.join(" · ")).size(size::NOTE).color(theme.quiet);
    ui.add(Label::new(text).wrap());
}

/// The card as text for the clipboard.
fn as_text(point: &PointResult, words: &Words) -> String {
    let mut lines = vec![
        format!("{}, {}", point.name, verdict_word(point.verdict, words)),
        sentence::of_point(point, words),
        format!("{}\t{}", words.text("results.deviation"), numbers::deviation(point, words)),
        format!("{}\t{}", "U (k = 2)", numbers::uncertainty(point, words)),
    ];
    if point.verdict == Verdict::NotMeasured {
        lines.truncate(2);
    }
    for gate in in_order(&point.card.gates) {
        let [value, limit] = gate_numbers(gate, words);
        lines.push(format!("{}\t{value}\t{limit}", words.told(gate.name)));
    }
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gui::text::Language;
    use crate::measure::Card;

    #[test]
    fn the_gate_that_failed_stands_first() {
        let mut card = Card::default();
        card.at_least("points in the window", "", 431.0, 12.0);
        card.at_most("height above the belt", "mm", 0.25, 2.0);
        card.at_least("gain", "", f64::NAN, 1.5);
        let words = Words::of(Language::English);
        let told: Vec<_> = in_order(&card.gates).iter().map(|g| (g.name, gate_numbers(g, words))).collect();
        assert_eq!(told[0], ("gain", ["–".to_owned(), "≥ 1.50".to_owned()]));
        assert_eq!(told[1], ("points in the window", ["431".to_owned(), "≥ 12".to_owned()]));
        assert_eq!(told[2].1, ["0.250 mm".to_owned(), "≤ 2.000 mm".to_owned()]);
    }
}
