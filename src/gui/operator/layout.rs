//! Where the cards of the operator's screen stand, for every size of the window. The screen never scrolls: cards leave in
//! the order map, sub-lines, takt, worst points, older lamps; the verdict and the button never leave.

use egui::{Rect, Vec2, pos2, vec2};

/// How many lamps there are at most.
pub const LAMPS: usize = 20;

/// Which arrangement it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// As pictured, 1600 and wider.
    Full,
    /// 1200 to 1599.
    Compact,
    /// One column, 800 to 1199.
    Column,
    /// Verdict, button and one line.
    Bare,
}

/// The places of the cards; those that left are `None`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Places {
    /// Which arrangement.
    pub form: Form,
    /// Part, number, revision, plan, folder.
    pub loaded: Option<Rect>,
    /// The verdict.
    pub verdict: Rect,
    /// Run or Stop.
    pub run: Rect,
    /// What goes on.
    pub now: Rect,
    /// Worst points, or what is checked before the first part.
    pub worst: Option<Rect>,
    /// How many rows of it there are.
    pub worst_rows: usize,
    /// Seconds a part.
    pub takt: Option<Rect>,
    /// Parts that wait.
    pub waiting: Option<Rect>,
    /// The switch for watching.
    pub watch: Option<Rect>,
    /// The part in detail, or another plan.
    pub show: Option<Rect>,
    /// The last parts.
    pub lamps: Option<Rect>,
    /// How many of them.
    pub lamp_count: usize,
}

/// The places in a window's inside.
pub fn places(inside: Rect) -> Places {
    let size = inside.size();
    match size {
        s if s.x < 800.0 || s.y < 420.0 => bare(inside),
        s if s.x < 1200.0 && s.y >= TALL => tall_column(inside),
        s if s.x < 1200.0 || s.y < 600.0 => column(inside),
        s if s.x < 1600.0 || s.y < 860.0 => compact(inside),
        _ => full(inside),
    }
}

/// The height from which one column has room for the small cards, too.
const TALL: f32 = 840.0;

/// A rectangle by its edges.
fn edges(left: f32, top: f32, right: f32, bottom: f32) -> Rect {
    Rect::from_min_max(pos2(left, top), pos2(right, bottom))
}

fn full(inside: Rect) -> Places {
    let gap = 24.0;
    let (left, right) = (inside.left() + gap, inside.right() - gap);
    let split = right - 592.0;
    let loaded = edges(left, inside.top() + 6.0, right, inside.top() + 62.0);
    let lamps = edges(left, inside.bottom() - 8.0 - 126.0, right, inside.bottom() - 8.0);
    let (top, bottom) = (loaded.bottom() + 4.0, lamps.top() - gap);
    // Spare height goes to the verdict and the worst points alike.
    let middle = top + 0.5 * (bottom - top - gap);
    let run = edges(split, top, right, top + 132.0);
    let buttons = edges(split, bottom - 92.0, right, bottom);
    let half = 0.5 * (buttons.width() - gap);
    let waiting = edges(split, buttons.top() - gap - 88.0, right, buttons.top() - gap);
    Places {
        form: Form::Full,
        loaded: Some(loaded),
        verdict: edges(left, top, split - gap, middle),
        run,
        now: edges(split, run.bottom() + gap, right, middle),
        worst: Some(edges(left, middle + gap, split - gap, bottom)),
        worst_rows: 4,
        takt: Some(edges(split, middle + gap, right, waiting.top() - gap)),
        waiting: Some(waiting),
        watch: Some(edges(split, buttons.top(), split + half, bottom)),
        show: Some(edges(right - half, buttons.top(), right, bottom)),
        lamps: Some(lamps),
        lamp_count: LAMPS,
    }
}

/// The places of the worst points and of the map beside them.
pub fn beside_the_map(place: Rect) -> (Rect, Rect) {
    let middle = place.left() + 0.55 * place.width();
    (place.with_max_x(middle - 12.0), place.with_min_x(middle + 12.0))
}

fn compact(inside: Rect) -> Places {
    let gap = 16.0;
    let (left, right) = (inside.left() + gap, inside.right() - gap);
    let split = right - 420.0;
    let loaded = edges(left, inside.top() + 4.0, right, inside.top() + 52.0);
    let lamps = edges(left, inside.bottom() - 8.0 - 108.0, right, inside.bottom() - 8.0);
    let (top, bottom) = (loaded.bottom() + 4.0, lamps.top() - gap);
    let middle = top + 0.53 * (bottom - top - gap);
    let run = edges(split, top, right, top + 104.0);
    let small = edges(split, bottom - 104.0, right, bottom);
    let rows = if bottom - middle > 300.0 { 4 } else { 3 };
    Places {
        form: Form::Compact,
        loaded: Some(loaded),
        verdict: edges(left, top, split - gap, middle),
        run,
        now: edges(split, run.bottom() + gap, right, middle),
        worst: Some(edges(left, middle + gap, split - gap, bottom)),
        worst_rows: rows,
        takt: Some(edges(split, middle + gap, right, small.top() - gap)),
        waiting: Some(edges(split, small.top(), split + 128.0, bottom)),
        watch: Some(edges(split + 144.0, small.top(), right, bottom)),
        show: None,
        lamps: Some(lamps),
        lamp_count: LAMPS,
    }
}

fn column(inside: Rect) -> Places {
    let gap = 12.0;
    let (left, right) = (inside.left() + gap, inside.right() - gap);
    let loaded = edges(left, inside.top() + 4.0, right, inside.top() + 52.0);
    let lamps = edges(left, inside.bottom() - 8.0 - 100.0, right, inside.bottom() - 8.0);
    let (top, bottom) = (loaded.bottom() + 4.0, lamps.top() - gap);
    // From the bottom: worst points while there is room for two, then what goes on, beside the switch.
    let worst_height = 112.0;
    let worst = (bottom - top >= 220.0 + 104.0 + 76.0 + worst_height + 3.0 * gap)
        .then(|| edges(left, bottom - worst_height, right, bottom));
    let bottom = worst.map_or(bottom, |w| w.top() - gap);
    // In a low window the verdict gets what the button can spare: 88 is enough for gloves.
    let high = if inside.height() < 480.0 { 88.0 } else { 104.0 };
    let button = edges(left, bottom - high, left + 0.5 * (right - left - gap), bottom);
    let now = edges(button.right() + gap, button.top(), right, bottom);
    Places {
        form: Form::Column,
        loaded: Some(loaded),
        verdict: edges(left, top, right, button.top() - gap),
        run: button,
        now,
        worst,
        worst_rows: 2,
        takt: None,
        waiting: None,
        watch: None,
        show: None,
        lamps: Some(lamps),
        lamp_count: 8,
    }
}

/// One column with everything in it. What is spare goes to the verdict up to a height, then to the worst points.
fn tall_column(inside: Rect) -> Places {
    let gap = 12.0;
    let (left, right) = (inside.left() + gap, inside.right() - gap);
    let half = 0.5 * (right - left - gap);
    let loaded = edges(left, inside.top() + 4.0, right, inside.top() + 52.0);
    let lamps = edges(left, inside.bottom() - 8.0 - 100.0, right, inside.bottom() - 8.0);
    let (top, bottom) = (loaded.bottom() + 4.0, lamps.top() - gap);
    let (run, small, worst) = (104.0, 90.0, 112.0);
    let spare = bottom - top - (run + 2.0 * small + worst + 4.0 * gap);
    let verdict = edges(left, top, right, top + spare.min(330.0));
    let pair = |from: f32, high: f32| {
        [edges(left, from, left + half, from + high), edges(right - half, from, right, from + high)]
    };
    let [run, now] = pair(verdict.bottom() + gap, run);
    let [takt, waiting] = pair(run.bottom() + gap, small);
    let [watch, show] = pair(takt.bottom() + gap, small);
    let worst = edges(left, watch.bottom() + gap, right, bottom);
    Places {
        form: Form::Column,
        loaded: Some(loaded),
        verdict,
        run,
        now,
        worst: Some(worst),
        worst_rows: (((worst.height() - 50.0) / 48.0) as usize).clamp(2, 8),
        takt: Some(takt),
        waiting: Some(waiting),
        watch: Some(watch),
        show: Some(show),
        lamps: Some(lamps),
        lamp_count: 8,
    }
}

fn bare(inside: Rect) -> Places {
    let gap = 8.0;
    let inner = inside.shrink(gap);
    let line = edges(inner.left(), inner.bottom() - 28.0, inner.right(), inner.bottom());
    let height = (0.3 * inner.height()).clamp(64.0, 104.0);
    let run = edges(inner.left(), line.top() - gap - height, inner.right(), line.top() - gap);
    Places {
        form: Form::Bare,
        loaded: None,
        verdict: edges(inner.left(), inner.top(), inner.right(), run.top() - gap),
        run,
        now: line,
        worst: None,
        worst_rows: 0,
        takt: None,
        waiting: None,
        watch: None,
        show: None,
        lamps: None,
        lamp_count: 0,
    }
}

/// The places of lamps side by side in a card, below its title.
pub fn lamp_places(card: Rect, count: usize) -> impl Iterator<Item = Rect> {
    let inner = card.shrink2(vec2(12.0, 4.0)).with_min_y(card.top() + 30.0);
    let each = inner.width() / count.max(1) as f32;
    (0..count).map(move |k| {
        let place = Rect::from_min_size(inner.min + vec2(k as f32 * each, 0.0), Vec2::new(each, inner.height()));
        place.shrink2(vec2(1.0, 0.0))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(places: &Places) -> Vec<(&'static str, Rect)> {
        let optional = [
            ("loaded", places.loaded),
            ("worst", places.worst),
            ("takt", places.takt),
            ("waiting", places.waiting),
            ("watch", places.watch),
            ("show", places.show),
            ("lamps", places.lamps),
        ];
        let always = [("verdict", places.verdict), ("run", places.run), ("now", places.now)];
        optional.into_iter().filter_map(|(name, place)| Some((name, place?))).chain(always).collect()
    }

    /// Every size of the window from the least to two screens, inside bar and status line.
    #[test]
    fn cards_stay_inside_and_never_overlap() {
        for width in (480..=3840).step_by(40) {
            for height in (260..=2060).step_by(40) {
                let inside = Rect::from_min_size(pos2(0.0, 64.0), vec2(width as f32, height as f32));
                let cards = all(&places(inside));
                for (k, (name, card)) in cards.iter().enumerate() {
                    assert!(inside.contains_rect(*card), "{name} at {width} x {height}: {card:?}");
                    assert!(card.width() >= 100.0 && card.height() >= 28.0, "{name} at {width} x {height}: {card:?}");
                    for (other, place) in &cards[..k] {
                        let common = card.intersect(*place);
                        let apart = common.width() <= 0.0 || common.height() <= 0.0;
                        assert!(apart, "{name} and {other} at {width} x {height}");
                    }
                }
            }
        }
    }

    /// The smallest sizes that gloves can hit, in points (3.78 a millimetre).
    #[test]
    fn targets_are_large_enough_for_gloves_at_the_sizes_of_the_design() {
        for (size, run, lamp) in [
            (vec2(1920.0, 980.0), vec2(592.0, 132.0), vec2(90.0, 80.0)),
            (vec2(1280.0, 708.0), vec2(420.0, 104.0), vec2(59.0, 70.0)),
            (vec2(800.0, 508.0), vec2(380.0, 104.0), vec2(88.0, 60.0)),
            (vec2(900.0, 908.0), vec2(420.0, 104.0), vec2(88.0, 60.0)),
        ] {
            let places = places(Rect::from_min_size(pos2(0.0, 0.0), size));
            assert!(places.run.width() >= run.x && places.run.height() >= run.y, "{size}: {:?}", places.run);
            let lamps = places.lamps.expect("lamps");
            for place in lamp_places(lamps, places.lamp_count) {
                assert!(lamps.contains_rect(place) && place.width() >= lamp.x && place.height() >= lamp.y, "{place:?}");
            }
            for daily in [places.watch, places.show].into_iter().flatten() {
                assert!(daily.height() >= 88.0, "{size}");
            }
        }
    }

    /// 29 mm of cap height at 1280 x 800 ask for a card at least that high.
    #[test]
    fn the_verdict_keeps_its_size() {
        let height = |w, h| places(Rect::from_min_size(pos2(0.0, 0.0), vec2(w, h))).verdict.height();
        assert!(height(1920.0, 980.0) >= 350.0, "{}", height(1920.0, 980.0));
        assert!(height(1280.0, 708.0) >= 260.0, "{}", height(1280.0, 708.0));
        assert!(height(800.0, 508.0) >= 190.0, "{}", height(800.0, 508.0));
    }
}
