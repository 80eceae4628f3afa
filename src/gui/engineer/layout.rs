//! Where everything stands on the engineer's screen, by the width of the window.

use egui::{Rect, pos2};

/// How many things stand beside each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Breadth {
    /// Tree, view and form; problems beside changes.
    Wide,
    /// The same with a narrow tree; problems and changes share a place.
    Middle,
    /// The form lies over the view's right side.
    Narrow,
    /// The same without a tree: its sections are a menu in the header.
    Small,
}

/// The places; those that share one are equal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Places {
    /// How much there is room for.
    pub breadth: Breadth,
    /// The line with the plan's name, undo and save.
    pub header: Rect,
    /// Sections and rows; `None` when `Small`.
    pub tree: Option<Rect>,
    /// The part.
    pub view: Rect,
    /// The problems.
    pub problems: Rect,
    /// What changed.
    pub changes: Rect,
    /// The form.
    pub form: Rect,
}

const GAP: f32 = 8.0;
const EDGE: f32 = 16.0;
/// Height of the header.
pub const HEADER: f32 = 48.0;
/// Widths from which there is room for more, points.
const NARROW_FROM: f32 = 800.0;
const MIDDLE_FROM: f32 = 1200.0;
const WIDE_FROM: f32 = 1600.0;

/// Divides a place.
pub fn places(all: Rect) -> Places {
    let (left, right) = (all.left() + EDGE, all.right() - EDGE);
    let header = Rect::from_min_max(pos2(left, all.top()), pos2(right, all.top() + HEADER));
    let body = Rect::from_min_max(pos2(left, header.bottom()), pos2(right, all.bottom() - GAP));
    let breadth = match all.width() {
        w if w >= WIDE_FROM => Breadth::Wide,
        w if w >= MIDDLE_FROM => Breadth::Middle,
        w if w >= NARROW_FROM => Breadth::Narrow,
        _ => Breadth::Small,
    };
    let tree_width = match breadth {
        Breadth::Wide => Some(300.0),
        Breadth::Middle | Breadth::Narrow => Some(200.0),
        Breadth::Small => None,
    };
    let tree = tree_width.map(|width| body.with_max_x(body.left() + width));
    let rest = tree.map_or(body, |tree| body.with_min_x(tree.right() + GAP));
    let over_view = matches!(breadth, Breadth::Narrow | Breadth::Small);
    let form_width = match breadth {
        Breadth::Wide => 440.0,
        Breadth::Middle => 400.0,
        Breadth::Narrow | Breadth::Small => f32::min(380.0, 0.6 * rest.width()),
    };
    let form = rest.with_min_x(rest.right() - form_width);
    let centre = if over_view { rest } else { rest.with_max_x(form.left() - GAP) };
    let lower_height = (0.31 * centre.height()).clamp(120.0, 300.0);
    let lower = centre.with_min_y(centre.bottom() - lower_height);
    let view = centre.with_max_y(lower.top() - GAP);
    // The form ends where the problems begin: those stand over the whole width then.
    let form = if over_view { form.with_max_y(view.bottom()) } else { form };
    let (problems, changes) = if breadth == Breadth::Wide {
        let middle = 0.5 * (lower.left() + lower.right());
        (lower.with_max_x(middle - 0.5 * GAP), lower.with_min_x(middle + 0.5 * GAP))
    } else {
        (lower, lower)
    };
    Places { breadth, header, tree, view, problems, changes, form }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_place_is_inside_and_nothing_overlaps_but_what_shares_a_place() {
        for width in [480.0, 799.0, 800.0, 1199.0, 1200.0, 1280.0, 1599.0, 1600.0, 1920.0, 3840.0] {
            for height in [400.0, 700.0, 980.0, 2000.0] {
                let all = Rect::from_min_size(pos2(3.0, 72.0), egui::vec2(width, height));
                let p = places(all);
                let over_view = matches!(p.breadth, Breadth::Narrow | Breadth::Small);
                let form = (!over_view).then_some(p.form);
                let of: Vec<Rect> = [Some(p.header), p.tree, Some(p.view), Some(p.problems), Some(p.changes), form]
                    .into_iter()
                    .flatten()
                    .collect();
                for (k, a) in of.iter().enumerate() {
                    assert!(all.contains_rect(*a) && a.is_positive(), "{width} x {height}: {a:?}");
                    for b in &of[k + 1..] {
                        assert!(a == b || !a.shrink(0.5).intersects(b.shrink(0.5)), "{width} x {height}: {a:?} {b:?}");
                    }
                }
                assert!(!over_view || p.view.contains_rect(p.form));
                assert!(p.view.width() >= 280.0 && p.view.height() >= 120.0, "{width} x {height}: {:?}", p.view);
            }
        }
    }
}
