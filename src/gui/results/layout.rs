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

/// The places for a result from before this start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EarlierPlaces {
    /// The line with the verdict.
    pub header: Rect,
    /// What should be known of it, and what can be done.
    pub notes: Rect,
    /// All below.
    pub body: Rect,
    /// Tabs, where table and card have one place.
    pub tabs: Option<Rect>,
    /// The table.
    pub table: Rect,
    /// The card of the chosen point.
    pub why: Rect,
}

/// Width from which the card stands beside the table.
const BESIDE_FROM: f32 = 1000.0;
/// Height from which it stands below.
const BELOW_FROM: f32 = 400.0;

/// Divides a place for a result from before this start.
pub fn earlier_places(all: Rect) -> EarlierPlaces {
    let header = places(all).header;
    let low = all.height() < LOW;
    let inner =
        Rect::from_min_max(pos2(all.left() + EDGE, header.bottom()), pos2(all.right() - EDGE, all.bottom() - GAP));
    let notes = inner.with_max_y(inner.top() + if low { 40.0 } else { 64.0 });
    let body = inner.with_min_y(notes.bottom() + if low { 4.0 } else { GAP });
    if all.width() >= BESIDE_FROM {
        let table = body.with_max_x(body.left() + 0.55 * body.width());
        let why = body.with_min_x(table.right() + GAP);
        return EarlierPlaces { header, notes, body, tabs: None, table, why };
    }
    if body.height() < BELOW_FROM {
        let tabs = body.with_max_y(body.top() + TABS[1]);
        let rest = body.with_min_y(tabs.bottom() + 4.0);
        return EarlierPlaces { header, notes, body, tabs: Some(tabs), table: rest, why: rest };
    }
    let table = body.with_max_y(body.top() + 0.55 * body.height());
    let why = body.with_min_y(table.bottom() + GAP);
    EarlierPlaces { header, notes, body, tabs: None, table, why }
}

/// The places of a part that is shown below those notes.
pub fn below(earlier: &EarlierPlaces) -> Places {
    let low = earlier.body.height() < LOW;
    let top = earlier.body.top() - HEADER[usize::from(low)];
    let all = Rect::from_min_max(pos2(earlier.body.left() - EDGE, top), earlier.body.max + egui::vec2(EDGE, GAP));
    places(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_result_from_before_has_its_places_inside_and_apart() {
        for width in (480..=3840).step_by(20) {
            for height in (260..=2060).step_by(20) {
                let all = Rect::from_min_size(pos2(3.0, 72.0), egui::vec2(width as f32, height as f32));
                let e = earlier_places(all);
                let of: Vec<Rect> = [e.header, e.notes, e.table, e.why].into_iter().chain(e.tabs).collect();
                for (k, a) in of.iter().enumerate() {
                    assert!(all.contains_rect(*a) && a.is_positive(), "{width} x {height}: {a:?}");
                    for b in &of[k + 1..] {
                        let apart = !a.shrink(0.5).intersects(b.shrink(0.5));
                        assert!(apart || (a == b && e.tabs.is_some()), "{width} x {height}: {a:?} {b:?}");
                    }
                }
                assert!(e.body.contains_rect(e.table) && e.body.contains_rect(e.why));
                assert!(e.table.height() >= 110.0 && e.why.height() >= 110.0, "{width} x {height}: {e:?}");
                let p = below(&e);
                for a in [p.tabs, p.cad, Some(p.map), Some(p.table), Some(p.why), Some(p.trend)].into_iter().flatten() {
                    assert!(e.body.expand(0.5).contains_rect(a) && a.height() > 30.0, "{width} x {height}: {a:?}");
                }
            }
        }
    }

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
