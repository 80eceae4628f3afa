//! Where everything stands on the screen of a merge, by the size of the window.

use crate::gui::breadth::{Breadth, MIDDLE_FROM, WIDE_FROM};
use egui::{Rect, pos2};

/// The places; those that share one are equal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Places {
    /// How much there is room for.
    pub breadth: Breadth,
    /// Which merge, and its buttons.
    pub header: Rect,
    /// Tabs, when `Narrow`.
    pub tabs: Option<Rect>,
    /// The list of views.
    pub views: Rect,
    /// The sliders.
    pub masks: Rect,
    /// The measured points; where the merged ones have no place of their own, these, too.
    pub measured: Rect,
    /// The merged points.
    pub merged: Option<Rect>,
    /// The study.
    pub study: Rect,
    /// What came out.
    pub result: Rect,
    /// How far a merge under way is.
    pub job: Rect,
}

const GAP: f32 = 8.0;
const EDGE: f32 = 16.0;
/// Heights of the header, the tabs and the line of the job; the second ones hold in a low window.
const HEADER: [f32; 2] = [52.0, 42.0];
const TABS: [f32; 2] = [44.0, 34.0];
const JOB: [f32; 2] = [52.0, 36.0];
const LOW: f32 = 400.0;
/// Height under which lists and sliders do not both have room.
const MIDDLE_HIGH: f32 = 560.0;

/// Divides a place. `busy`: a merge is under way, and the line that tells of it takes its room. `wish`: the height of a list of views that is
/// shown whole.
pub fn places(all: Rect, busy: bool, wish: f32) -> Places {
    let low = usize::from(all.height() < LOW);
    let inside = Rect::from_min_max(pos2(all.left() + EDGE, all.top()), pos2(all.right() - EDGE, all.bottom() - GAP));
    let header = inside.with_max_y(inside.top() + HEADER[low]);
    let body = inside.with_min_y(header.bottom());
    let job = body.with_min_y(body.bottom() - JOB[low]);
    if all.width() < MIDDLE_FROM || all.height() < MIDDLE_HIGH {
        let tabs = body.with_max_y(body.top() + TABS[low]);
        let end = if busy { job.top() - GAP } else { body.bottom() };
        let rest = Rect::from_min_max(
            pos2(body.left(), tabs.bottom() + if low == 1 { 4.0 } else { GAP }),
            pos2(body.right(), end),
        );
        return Places {
            breadth: Breadth::Narrow,
            header,
            tabs: Some(tabs),
            views: rest,
            masks: rest,
            measured: rest,
            merged: None,
            study: rest,
            result: rest,
            job,
        };
    }
    beside(header, body, all.width() >= WIDE_FROM, busy, wish)
}

/// Lists at the left, clouds above study and result at the right.
fn beside(header: Rect, body: Rect, wide: bool, busy: bool, wish: f32) -> Places {
    let left_width =
        if wide { (0.3 * body.width()).clamp(520.0, 620.0) } else { (0.34 * body.width()).clamp(400.0, 480.0) };
    let left = body.with_max_x(body.left() + left_width);
    let right = body.with_min_x(left.right() + GAP);
    let views = left.with_max_y(left.top() + wish.clamp(0.3 * left.height(), 0.46 * left.height()).round());
    let masks = left.with_min_y(views.bottom() + GAP);
    let job = right.with_min_y(right.bottom() - JOB[0]);
    let right = if busy { right.with_max_y(job.top() - GAP) } else { right };
    let lower_height = (0.42 * right.height()).clamp(220.0, 400.0).round();
    let lower = right.with_min_y(right.bottom() - lower_height);
    let upper = right.with_max_y(lower.top() - GAP);
    let breadth = Breadth::Middle;
    let one = Places {
        breadth,
        header,
        tabs: None,
        views,
        masks,
        measured: upper,
        merged: None,
        study: lower,
        result: lower,
        job,
    };
    if !wide {
        return one;
    }
    let measured = upper.with_max_x(upper.left() + 0.5 * (upper.width() - GAP));
    let study = lower.with_max_x(measured.right());
    let merged = Some(upper.with_min_x(measured.right() + GAP));
    Places { breadth: Breadth::Wide, measured, merged, study, result: lower.with_min_x(study.right() + GAP), ..one }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_place_is_inside_and_only_shared_ones_overlap() {
        for width in (480..=3840).step_by(20) {
            for height in (260..=2060).step_by(20) {
                for busy in [false, true] {
                    let all = Rect::from_min_size(pos2(3.0, 72.0), egui::vec2(width as f32, height as f32));
                    let p = places(all, busy, 300.0);
                    let of = [p.header, p.views, p.masks, p.measured, p.study, p.result];
                    let mut of: Vec<Rect> = of.into_iter().chain(p.tabs).chain(p.merged).collect();
                    if busy {
                        of.push(p.job);
                    }
                    for (k, a) in of.iter().enumerate() {
                        assert!(all.contains_rect(*a) && a.is_positive(), "{width} x {height}: {a:?}");
                        for b in &of[k + 1..] {
                            let apart = !a.shrink(0.5).intersects(b.shrink(0.5));
                            assert!(a == b || apart, "{width} x {height}: {a:?} {b:?}");
                        }
                    }
                    assert_eq!(p.merged.is_some(), width >= 1600 && height >= 560);
                    // A row of the list, a slider, and something of the points.
                    assert!(p.views.height() >= 110.0 && p.views.width() >= 400.0, "{width} x {height}: {:?}", p.views);
                    assert!(p.measured.height() >= 110.0 && p.measured.width() >= 400.0, "{width} x {height}");
                }
            }
        }
    }
}
