//! Where everything stands on the engineer's screen, by the size of the window.

use super::state::Pane;
use egui::{Rect, pos2};

/// How many things stand beside each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Breadth {
    /// Tree, view and form; problems beside changes.
    Wide,
    /// The same with a narrow tree; problems and changes share a place.
    Middle,
    /// One of view, plan and problems, chosen by tabs; the form beside it.
    Small,
    /// One thing at a time, the form as well.
    Single,
}

impl Breadth {
    /// What can be chosen by tabs; nothing where all of it is in sight.
    pub fn panes(self) -> &'static [Pane] {
        match self {
            Breadth::Wide | Breadth::Middle => &[],
            Breadth::Small => &[Pane::View, Pane::Plan, Pane::Problems],
            Breadth::Single => &[Pane::View, Pane::Plan, Pane::Form, Pane::Problems],
        }
    }

    /// The pane that is shown when one is looked at: the form stands beside the view.
    pub fn shown(self, pane: Pane) -> Pane {
        if pane == Pane::Form && self != Breadth::Single { Pane::View } else { pane }
    }
}

/// The places; what is not shown has none, and those that share one are equal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Places {
    /// How much there is room for.
    pub breadth: Breadth,
    /// The line with the plan's name or tabs, undo and save.
    pub header: Rect,
    /// Sections and rows.
    pub tree: Option<Rect>,
    /// The part.
    pub view: Option<Rect>,
    /// The problems.
    pub problems: Option<Rect>,
    /// What changed.
    pub changes: Option<Rect>,
    /// The form.
    pub form: Option<Rect>,
}

const GAP: f32 = 8.0;
const EDGE: f32 = 16.0;
/// Height of the header.
pub const HEADER: f32 = 48.0;
/// Widths from which there is room for more, points: for view and form, with the tree, with a wider form, for all.
const SMALL_FROM: f32 = 640.0;
const MIDDLE_FROM: f32 = 1000.0;
const FORM_FROM: f32 = 1200.0;
const WIDE_FROM: f32 = 1600.0;
/// Height under which view and problems do not both have room.
const LOW: f32 = 400.0;
/// The narrowest form: three numbers of a place beside each other below their words.
pub const FORM: f32 = 320.0;

/// Divides a place; `pane` is what is looked at where not everything is in sight.
pub fn places(all: Rect, pane: Pane) -> Places {
    let (left, right) = (all.left() + EDGE, all.right() - EDGE);
    let header = Rect::from_min_max(pos2(left, all.top()), pos2(right, all.top() + HEADER));
    let body = Rect::from_min_max(pos2(left, header.bottom()), pos2(right, all.bottom() - GAP));
    let breadth = match all.width() {
        w if w < SMALL_FROM => Breadth::Single,
        w if w < MIDDLE_FROM || all.height() < LOW => Breadth::Small,
        w if w < WIDE_FROM => Breadth::Middle,
        _ => Breadth::Wide,
    };
    let form_width = match all.width() {
        w if w < FORM_FROM => FORM,
        w if w < WIDE_FROM => 400.0,
        _ => 440.0,
    };
    let form = body.with_min_x(body.right() - form_width);
    let rest = body.with_max_x(form.left() - GAP);
    let nothing = Places { breadth, header, tree: None, view: None, problems: None, changes: None, form: Some(form) };
    let only = match breadth {
        Breadth::Wide | Breadth::Middle => return all_places(rest, nothing),
        Breadth::Small => nothing,
        Breadth::Single => Places { form: None, ..nothing },
    };
    let rest = if breadth == Breadth::Single { body } else { rest };
    match breadth.shown(pane) {
        Pane::View => Places { view: Some(rest), ..only },
        Pane::Plan => Places { tree: Some(rest), ..only },
        Pane::Form => Places { form: Some(rest), ..only },
        Pane::Problems => Places { problems: Some(rest), changes: Some(rest), ..only },
    }
}

/// Tree, view and what stands below it, left of the form.
fn all_places(rest: Rect, places: Places) -> Places {
    let tree = rest.with_max_x(rest.left() + if places.breadth == Breadth::Wide { 300.0 } else { 200.0 });
    let centre = rest.with_min_x(tree.right() + GAP);
    let lower_height = (0.31 * centre.height()).clamp(120.0, 300.0);
    let lower = centre.with_min_y(centre.bottom() - lower_height);
    let view = centre.with_max_y(lower.top() - GAP);
    let (problems, changes) = if places.breadth == Breadth::Wide {
        let middle = 0.5 * (lower.left() + lower.right());
        (lower.with_max_x(middle - 0.5 * GAP), lower.with_min_x(middle + 0.5 * GAP))
    } else {
        (lower, lower)
    };
    Places { tree: Some(tree), view: Some(view), problems: Some(problems), changes: Some(changes), ..places }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every size of the window from the least to two screens, inside bar and status line, whatever is looked at.
    #[test]
    fn every_place_is_inside_and_nothing_overlaps_but_what_shares_a_place() {
        for width in (480..=3840).step_by(20) {
            for height in (260..=2060).step_by(20) {
                for pane in [Pane::View, Pane::Plan, Pane::Form, Pane::Problems] {
                    let all = Rect::from_min_size(pos2(3.0, 72.0), egui::vec2(width as f32, height as f32));
                    let p = places(all, pane);
                    let of = [Some(p.header), p.tree, p.view, p.problems, p.changes, p.form];
                    let of: Vec<Rect> = of.into_iter().flatten().collect();
                    let at = format!("{width} x {height}, {pane:?}");
                    for (k, a) in of.iter().enumerate() {
                        assert!(all.contains_rect(*a) && a.is_positive(), "{at}: {a:?}");
                        for b in &of[k + 1..] {
                            assert!(a == b || !a.shrink(0.01).intersects(b.shrink(0.01)), "{at}: {a:?} {b:?}");
                        }
                    }
                    assert!(p.form.is_none_or(|form| form.width() >= FORM && form.height() >= 200.0), "{at}");
                    assert!(p.view.is_none_or(|view| view.width() >= 280.0 && view.height() >= 190.0), "{at}: {p:?}");
                    assert!(p.tree.is_none_or(|tree| tree.width() >= 200.0 && tree.height() >= 200.0), "{at}: {p:?}");
                    let shown = p.breadth.shown(pane);
                    assert!(p.breadth.panes().is_empty() || p.breadth.panes().contains(&shown), "{at}");
                    let there = match shown {
                        Pane::View => p.view,
                        Pane::Plan => p.tree,
                        Pane::Form => p.form,
                        Pane::Problems => p.problems,
                    };
                    assert!(there.is_some(), "{at}");
                }
            }
        }
    }
}
