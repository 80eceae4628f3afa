//! What the hand can do next, in a plate at the foot of the view; and why a click proposed nothing, beside it.

use crate::gui::engineer::{Draft, Tool};
use crate::gui::fonts;
use crate::gui::text::Words;
use crate::gui::theme::{Theme, size};
use crate::gui::widgets::words as write;
use crate::part::propose::NoProposal;
use egui::{Align2, Color32, CornerRadius, Pos2, Rect, Stroke, StrokeKind, Ui, pos2, vec2};

/// A key as it stands on the keyboard.
pub fn key_cap(ui: &Ui, at: Rect, name: &str, theme: &Theme) {
    let painter = ui.painter();
    painter.rect(at, CornerRadius::same(3), theme.panel, Stroke::new(1.0, theme.strong_stroke), StrokeKind::Inside);
    painter.text(at.center(), Align2::CENTER_CENTER, name, fonts::mono(11.0), theme.quiet);
}

/// The sentence for a tool.
fn sentence(tool: Tool, draft: Option<&Draft>) -> &'static str {
    match (tool, draft.map(|d| d.spec.geometry.kind())) {
        (_, Some("edge")) => "pick.hint_edge_draft",
        (_, Some("surface")) => "pick.hint_surface_draft",
        (_, Some(_)) => "pick.hint_opening_draft",
        (Tool::Choose, None) => "pick.hint_choose",
        (Tool::Surface | Tool::Feature, None) => "pick.hint_surface",
        (Tool::Edge, None) => "pick.hint_edge",
        (Tool::Hole | Tool::FeatureHole, None) => "pick.hint_hole",
        (Tool::Slot, None) => "pick.hint_slot",
        (Tool::Measure, None) => "pick.hint_measure",
    }
}

/// A word with the blank behind it, or a key.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Piece<'a> {
    text: &'a str,
    is_key: bool,
}

/// Parts a sentence into words and keys, which stand in square brackets.
fn pieces(sentence: &str) -> Vec<Piece<'_>> {
    let mut all = Vec::new();
    for (k, part) in sentence.split(['[', ']']).enumerate() {
        // Every other part stood in brackets.
        if k % 2 == 1 {
            all.push(Piece { text: part, is_key: true });
        } else {
            all.extend(part.split_inclusive(' ').map(|text| Piece { text, is_key: false }));
        }
    }
    all
}

const ROW: f32 = 24.0;
const PAD: f32 = 12.0;

/// The largest share of a scene's height that the plate may take; a part that is not seen is not clicked.
const SHARE: f32 = 0.16;

/// Draws the plate at the lower left of a scene; returns where it stands. A scene that is too small for it has none.
pub fn hint_ui(
    ui: &mut Ui,
    scene: Rect,
    tool: Tool,
    draft: Option<&Draft>,
    words: &Words,
    theme: &Theme,
) -> Option<Rect> {
    let text = words.text(sentence(tool, draft));
    let most = scene.width() - 16.0 - 2.0 * PAD;
    let width_of = |piece: &Piece<'_>| match piece.is_key {
        true => write::width(ui, piece.text, fonts::mono(11.0)) + 12.0,
        false => write::width(ui, piece.text, fonts::regular(size::TABLE)),
    };
    let (mut x, mut row, mut widest) = (0.0_f32, 0.0_f32, 0.0_f32);
    let mut placed: Vec<(Piece<'_>, Pos2, f32)> = Vec::new();
    for piece in pieces(text) {
        let wide = width_of(&piece);
        if x > 0.0 && x + wide > most {
            (x, row) = (0.0, row + 1.0);
        }
        placed.push((piece, pos2(x, (row + 0.5) * ROW), wide));
        x += wide;
        widest = widest.max(x);
    }
    let area = vec2(widest + 2.0 * PAD, (row + 1.0) * ROW + 10.0);
    if area.y > SHARE * scene.height() {
        return None;
    }
    let plate = Rect::from_min_size(pos2(scene.left() + 8.0, scene.bottom() - 8.0 - area.y), area);
    let frame = Stroke::new(1.0, theme.stroke);
    ui.painter().rect(plate, CornerRadius::same(4), theme.panel, frame, StrokeKind::Inside);
    let origin = plate.min + vec2(PAD, 5.0);
    for (piece, at, wide) in placed {
        let left = origin + at.to_vec2();
        if piece.is_key {
            key_cap(ui, Rect::from_min_size(left - vec2(0.0, 9.0), vec2(wide, 18.0)), piece.text, theme);
        } else {
            ui.painter().text(left, Align2::LEFT_CENTER, piece.text, fonts::regular(size::TABLE), theme.text);
        }
    }
    write::named(ui, plate, &text.replace(['[', ']'], ""));
    Some(plate)
}

/// Why a click means nothing, and what to do, as a sentence or two.
pub fn reason(why: &NoProposal, words: &Words) -> String {
    let mm = |v: f64| words.number(v, 1);
    let opening = |key: &str, length: f64, width: f64, off: f64| {
        let (length, width, off) = (words.number(length, 2), words.number(width, 2), words.number(off, 2));
        words.fill(key, &[("length", &length), ("width", &width), ("off", &off)])
    };
    match why {
        NoProposal::PastThePart => words.text("pick.none_past").to_owned(),
        NoProposal::NoEdge => words.text("pick.none_edge").to_owned(),
        NoProposal::EdgeTooFar { nearest_mm } => words.fill("pick.none_edge_far", &[("mm", &mm(*nearest_mm))]),
        NoProposal::Corner { degrees } => words.fill("pick.none_corner", &[("deg", &words.number(*degrees, 0))]),
        NoProposal::NoOpening => words.text("pick.none_opening").to_owned(),
        NoProposal::OpeningTooFar { nearest_mm } => words.fill("pick.none_opening_far", &[("mm", &mm(*nearest_mm))]),
        NoProposal::NotRound { length_mm, width_mm, off_mm } => {
            opening("pick.none_not_round", *length_mm, *width_mm, *off_mm)
        }
        NoProposal::NoSlot { length_mm, width_mm, off_mm } => opening("pick.none_slot", *length_mm, *width_mm, *off_mm),
        NoProposal::Round { length_mm, width_mm } => {
            let (length, width) = (words.number(*length_mm, 2), words.number(*width_mm, 2));
            words.fill("pick.none_round", &[("length", &length), ("width", &width)])
        }
        NoProposal::Unfitted(why) => words.fill("pick.none_fitted", &[("why", &words.library(&why.to_string()))]),
    }
}

/// Writes a sentence beside a place of the scene, inside of it.
pub fn beside_ui(ui: &mut Ui, scene: Rect, pos: Pos2, text: &str, colour: Color32, theme: &Theme) {
    const WIDE: f32 = 300.0;
    let font = fonts::regular(size::TABLE);
    let galley = ui.painter().layout(text.to_owned(), font, theme.text, WIDE - 24.0);
    let area = galley.size() + vec2(24.0, 14.0);
    let right = if pos.x + 18.0 + area.x > scene.right() { pos.x - 18.0 - area.x } else { pos.x + 18.0 };
    let top = (pos.y + 14.0).min(scene.bottom() - area.y - 6.0);
    let left = right.clamp(scene.left() + 6.0, (scene.right() - area.x - 6.0).max(scene.left() + 6.0));
    let plate = Rect::from_min_size(pos2(left, top.max(scene.top() + 6.0)), area);
    ui.painter().rect(plate, CornerRadius::same(4), theme.panel, Stroke::new(1.5, colour), StrokeKind::Inside);
    ui.painter().galley(plate.min + vec2(12.0, 7.0), galley, theme.text);
    write::named(ui, plate, text);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gui::text::Language;

    #[test]
    fn keys_in_a_sentence_are_told_from_its_words() {
        let told = pieces("Click it. [Enter] adds it");
        let shown: Vec<(&str, bool)> = told.iter().map(|p| (p.text, p.is_key)).collect();
        let expected =
            [("Click ", false), ("it. ", false), ("Enter", true), (" ", false), ("adds ", false), ("it", false)];
        assert_eq!(shown, expected);
    }

    #[test]
    fn every_reason_is_a_sentence_with_its_numbers_in_every_language() {
        let (length_mm, width_mm, off_mm) = (30.0, 12.0, 1.25);
        let all = [
            NoProposal::PastThePart,
            NoProposal::NoEdge,
            NoProposal::EdgeTooFar { nearest_mm: 12.34 },
            NoProposal::Corner { degrees: 89.6 },
            NoProposal::NoOpening,
            NoProposal::OpeningTooFar { nearest_mm: 12.34 },
            NoProposal::NotRound { length_mm, width_mm, off_mm },
            NoProposal::NoSlot { length_mm, width_mm, off_mm },
            NoProposal::Round { length_mm, width_mm },
            NoProposal::Unfitted(crate::fit::FitError::Degenerate),
        ];
        for language in Language::ALL {
            let words = Words::of(language);
            for why in &all {
                let told = reason(why, words);
                assert!(told.ends_with('.') && !told.contains('{') && told.len() > 20, "{language:?} {told}");
            }
            let decimal = if language == Language::English { "12.3 mm" } else { "12,3 mm" };
            assert!(reason(&all[2], words).contains(decimal));
        }
    }
}
