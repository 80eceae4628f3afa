//! Where everything stands on the results screen, by the width of the window.

use crate::gui::breadth::{Breadth, MIDDLE_FROM, WIDE_FROM};
use egui::{Rect, pos2};

/// The places; those that share one are equal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Places {
    /// How much there is room for.
    pub breadth: Breadth,
    /// The line with the verdict.
    pub header: Rect,
    /// Tabs, when `Narrow`.
    pub tabs: Option<Rect>,
    /// The CAD with its points; `None` = shares the place of the map.
    pub cad: Option<Rect>,
    /// The map.
    pub map: Rect,
    /// The histogram.
    pub histogram: Rect,
    /// The trend.
    pub trend: Rect,
    /// The table.
    pub table: Rect,
    /// The why-card.
    pub why: Rect,
}

const GAP: f32 = 8.0;
const EDGE: f32 = 16.0;
/// Heights of the header and of the tabs; the second ones hold in a low window.
const HEADER: [f32; 2] = [64.0, 54.0];
const TABS: [f32; 2] = [44.0, 34.0];
const LOW: f32 = 400.0;
/// Height under which view and trend do not both have room.
const MIDDLE_HIGH: f32 = 460.0;

/// Divides a place.
pub fn places(all: Rect) -> Places {
    let low = usize::from(all.height() < LOW);
    let header_to = all.top() + HEADER[low];
    let header = Rect::from_min_max(pos2(all.left() + EDGE, all.top()), pos2(all.right() - EDGE, header_to));
    let body =
        Rect::from_min_max(pos2(all.left() + EDGE, header.bottom()), pos2(all.right() - EDGE, all.bottom() - GAP));
    if all.width() < MIDDLE_FROM || all.height() < MIDDLE_HIGH {
        let tabs = body.with_max_y(body.top() + TABS[low]);
        let rest = body.with_min_y(tabs.bottom() + if low == 1 { 4.0 } else { GAP });
        let breadth = Breadth::Narrow;
        return Places {
            breadth,
            header,
            tabs: Some(tabs),
            cad: None,
            map: rest,
            histogram: rest,
            trend: rest,
            table: rest,
            why: rest,
        };
    }
    let wide = all.width() >= WIDE_FROM;
    let right_width =
        if wide { (0.335 * body.width()).clamp(600.0, 760.0) } else { (0.42 * body.width()).clamp(500.0, 620.0) };
    let right = body.with_min_x(body.right() - right_width);
    let left = body.with_max_x(right.left() - GAP);
    // The table gets what the card leaves.
    let why_height = if wide { 400.0 } else { 330.0 };
    let why_height = f32::min(why_height, 0.52 * right.height());
    let why = right.with_min_y(right.bottom() - why_height);
    let table = right.with_max_y(why.top() - GAP);
    let lower_height = (0.34 * left.height()).clamp(180.0, 380.0);
    let lower = left.with_min_y(left.bottom() - lower_height);
    let upper = left.with_max_y(lower.top() - GAP);
    if wide {
        let cad = upper.with_max_x(upper.left() + 0.40 * upper.width());
        let map = upper.with_min_x(cad.right() + GAP);
        let histogram = lower.with_max_x(lower.left() + 0.37 * lower.width());
        let trend = lower.with_min_x(histogram.right() + GAP);
        let breadth = Breadth::Wide;
        return Places { breadth, header, tabs: None, cad: Some(cad), map, histogram, trend, table, why };
    }
    let breadth = Breadth::Middle;
    Places { breadth, header, tabs: None, cad: None, map: upper, histogram: lower, trend: lower, table, why }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_place_is_inside_and_only_shared_ones_overlap() {
        for width in (480..=3840).step_by(20) {
            for height in (260..=2060).step_by(20) {
                let all = Rect::from_min_size(pos2(3.0, 72.0), egui::vec2(width as f32, height as f32));
                let p = places(all);
                let of = [
                    Some(p.header),
                    p.tabs,
                    p.cad,
                    Some(p.map),
                    Some(p.histogram),
                    Some(p.trend),
                    Some(p.table),
                    Some(p.why),
                ];
                let of: Vec<Rect> = of.into_iter().flatten().collect();
                for (k, a) in of.iter().enumerate() {
                    assert!(all.contains_rect(*a) && a.is_positive(), "{width} x {height}: {a:?}");
                    for b in &of[k + 1..] {
                        assert!(a == b || !a.shrink(0.5).intersects(b.shrink(0.5)), "{width} x {height}: {a:?} {b:?}");
                    }
                }
                assert_eq!(p.cad.is_some(), width >= 1600 && height >= 460);
                // Of the map, something is left beside bar, line and legend.
                assert!(p.map.width() >= 360.0 && p.map.height() >= 150.0, "{width} x {height}: {:?}", p.map);
                assert!(p.table.height() >= 150.0 && p.table.width() >= 440.0, "{width} x {height}: {:?}", p.table);
            }
        }
    }
}
