//! Where labels stand beside their markers so that none covers another: plain places, no drawing.

use egui::{Pos2, Rect, Vec2, pos2, vec2};
use std::collections::HashMap;

/// A label that wants a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wish {
    /// What it names.
    pub anchor: Pos2,
    /// Its size.
    pub size: Vec2,
    /// Free room between the anchor and the label at least.
    pub gap: f32,
    /// How far from the anchor it may go, points; what is nearest is taken.
    pub reach: f32,
}

/// Places that are taken.
#[derive(Debug, Default)]
pub struct Taken {
    places: Vec<Rect>,
    cells: HashMap<(i32, i32), Vec<u32>>,
}

/// Edge of a cell of the search, points: about the width of a label.
const CELL: f32 = 64.0;

impl Taken {
    /// Keeps a place free of labels.
    pub fn add(&mut self, place: Rect) {
        if !(place.is_finite() && place.area() < 1e8) {
            return;
        }
        let index = self.places.len() as u32;
        self.places.push(place);
        for cell in cells(place) {
            self.cells.entry(cell).or_default().push(index);
        }
    }

    /// Keeps a line free of labels.
    pub fn add_line(&mut self, [from, to]: [Pos2; 2]) {
        let steps = ((to - from).length() / 12.0).ceil().clamp(1.0, 400.0) as u32;
        for k in 0..=steps {
            let at = from + (to - from) * (k as f32 / steps as f32);
            self.add(Rect::from_center_size(at, Vec2::splat(6.0)));
        }
    }

    fn is_free(&self, place: Rect) -> bool {
        let hit =
            |cell| self.cells.get(&cell).is_some_and(|all| all.iter().any(|k| covers(self.places[*k as usize], place)));
        !cells(place).any(hit)
    }
}

fn covers(a: Rect, b: Rect) -> bool {
    a.left() < b.right() && b.left() < a.right() && a.top() < b.bottom() && b.top() < a.bottom()
}

fn cells(place: Rect) -> impl Iterator<Item = (i32, i32)> {
    let at = |v: f32| (v / CELL).floor() as i32;
    let (rows, columns) = (at(place.top())..=at(place.bottom()), at(place.left())..=at(place.right()));
    rows.flat_map(move |row| columns.clone().map(move |column| (row, column)))
}

/// Directions in which a place is looked for, the best first: beside and above the marker, as people write on drawings.
const DIRECTIONS: [[f32; 2]; 12] = [
    [1.0, -0.6],
    [1.0, 0.0],
    [1.0, 0.6],
    [-1.0, -0.6],
    [-1.0, 0.6],
    [-1.0, 0.0],
    [0.0, -1.0],
    [0.0, 1.0],
    [0.5, -1.0],
    [-0.5, -1.0],
    [0.5, 1.0],
    [-0.5, 1.0],
];
/// From one ring of places to the next, points.
const RING: f32 = 14.0;

/// The places of labels, those that come first before the others; each then counts as taken. `None`: there is no free place within reach.
pub fn place(wishes: &[Wish], taken: &mut Taken, within: Rect) -> Vec<Option<Rect>> {
    let one = |wish: &Wish| {
        let found = candidates(wish).find(|place| within.contains_rect(*place) && taken.is_free(*place))?;
        taken.add(found);
        Some(found)
    };
    wishes.iter().map(one).collect()
}

/// All places of a label, the nearest ring first.
fn candidates(wish: &Wish) -> impl Iterator<Item = Rect> {
    let Wish { anchor, size, gap, reach } = *wish;
    let rings = ((reach - gap).max(0.0) / RING).floor() as u32;
    (0..=rings).flat_map(move |ring| {
        let off = gap + ring as f32 * RING;
        DIRECTIONS.map(|[x, y]| {
            let along = vec2(x, y).normalized() * off;
            // The side or corner of the label that looks at the anchor stands at the end of the way there.
            let corner = pos2(anchor.x + along.x, anchor.y + along.y);
            let min = pos2(corner.x - size.x * share(x), corner.y - size.y * share(y));
            Rect::from_min_size(min, size)
        })
    })
}

/// How much of the label lies before its corner: none to the right or below, all to the left or above, half straight ahead.
fn share(component: f32) -> f32 {
    match component {
        c if c > 0.3 => 0.0,
        c if c < -0.3 => 1.0,
        _ => 0.5,
    }
}

/// Where a leader from an anchor meets a label.
pub fn leader_end(anchor: Pos2, label: Rect) -> Pos2 {
    let nearest = label.clamp(anchor);
    // To the middle of a side rather than to a corner, where a side looks at the anchor.
    let inside = |v: f32, low: f32, high: f32| v > low && v < high;
    if inside(anchor.x, label.left(), label.right()) {
        pos2(nearest.x, nearest.y)
    } else {
        pos2(nearest.x, label.center().y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    const VIEW: Rect = Rect { min: Pos2::new(100.0, 50.0), max: Pos2::new(900.0, 650.0) };

    fn wish(anchor: Pos2) -> Wish {
        Wish { anchor, size: vec2(34.0, 16.0), gap: 9.0, reach: 40.0 }
    }

    #[test]
    fn no_label_covers_another_or_a_marker_or_leaves_the_view() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(7);
        let anchors: Vec<Pos2> =
            (0..200).map(|_| pos2(rng.random_range(90.0..910.0_f32), rng.random_range(40.0..660.0_f32))).collect();
        let mut taken = Taken::default();
        let markers: Vec<Rect> = anchors.iter().map(|a| Rect::from_center_size(*a, Vec2::splat(14.0))).collect();
        markers.iter().for_each(|m| taken.add(*m));
        let wishes: Vec<Wish> = anchors.iter().map(|a| wish(*a)).collect();
        let placed = place(&wishes, &mut taken, VIEW);
        let shown: Vec<Rect> = placed.iter().flatten().copied().collect();
        // A label takes 544 of 480,000 square points and has at least 24 places: few of 200 find none.
        assert!(shown.len() > 180, "{}", shown.len());
        for (k, a) in shown.iter().enumerate() {
            assert!(VIEW.contains_rect(*a));
            assert!(markers.iter().all(|m| !covers(*a, *m)));
            assert!(shown[k + 1..].iter().all(|b| !covers(*a, *b)));
        }
        for (wish, place) in wishes.iter().zip(&placed) {
            let Some(place) = place else { continue };
            assert!(place.distance_to_pos(wish.anchor) <= wish.reach + 1e-3, "{wish:?} {place:?}");
        }
    }

    #[test]
    fn the_first_of_two_gets_the_better_place_and_the_second_another() {
        let mut taken = Taken::default();
        let anchor = pos2(400.0, 300.0);
        let placed = place(&[wish(anchor), wish(anchor)], &mut taken, VIEW);
        let [Some(first), Some(second)] = placed[..] else { panic!("{placed:?}") };
        assert!(first.left() > anchor.x && first.bottom() <= anchor.y, "{first:?}");
        assert!(!covers(first, second));
        let mut full = Taken::default();
        full.add(VIEW);
        assert_eq!(place(&[wish(anchor)], &mut full, VIEW), [None]);
    }

    #[test]
    fn a_line_is_kept_free() {
        let mut taken = Taken::default();
        let anchor = pos2(400.0, 300.0);
        taken.add_line([anchor, anchor + vec2(60.0, -40.0)]);
        let placed = place(&[wish(anchor)], &mut taken, VIEW)[0].unwrap();
        for k in 0..=60 {
            assert!(!placed.contains(anchor + vec2(60.0, -40.0) * (k as f32 / 60.0)), "{placed:?}");
        }
    }

    #[test]
    fn a_leader_ends_on_its_label() {
        let label = Rect::from_min_size(pos2(10.0, 10.0), vec2(40.0, 20.0));
        assert_eq!(leader_end(pos2(100.0, 90.0), label), pos2(50.0, 20.0));
        assert_eq!(leader_end(pos2(30.0, 90.0), label), pos2(30.0, 30.0));
        assert_eq!(leader_end(pos2(0.0, 0.0), label), pos2(10.0, 20.0));
    }
}
