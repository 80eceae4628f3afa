//! Where the labels of points stand: in the left and right margin of the map, none over another, no leader across another.

/// The margin in which a flag stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Margin {
    /// Left of the map.
    Left,
    /// Right of the map.
    Right,
}

/// A flag's place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flag {
    /// Which of the given points it names.
    pub point: usize,
    /// Its margin.
    pub margin: Margin,
    /// Its middle, from the top.
    pub y: f64,
}

/// The room for flags.
#[derive(Debug, Clone, Copy)]
pub struct Room {
    /// Inner edge of the left flags: leaders start here.
    pub left_x: f64,
    /// Inner edge of the right flags.
    pub right_x: f64,
    /// Highest middle of a flag.
    pub top: f64,
    /// Lowest middle of a flag.
    pub bottom: f64,
    /// Least distance between the middles of two flags.
    pub pitch: f64,
}

impl Room {
    /// How many flags fit into one margin.
    pub fn capacity(&self) -> usize {
        if self.bottom < self.top { 0 } else { ((self.bottom - self.top) / self.pitch + 1e-9) as usize + 1 }
    }

    fn inner_x(&self, margin: Margin) -> f64 {
        match margin {
            Margin::Left => self.left_x,
            Margin::Right => self.right_x,
        }
    }
}

/// Which of the points (x, y) get their flag in which margin. The points left of a vertical line go left, the others right,
/// so that leaders of different margins cannot meet; the line is moved off the middle only as far as one margin is too full.
pub fn split(points: &[[f64; 2]], middle_x: f64, capacity: usize) -> Vec<Margin> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|&a, &b| points[a][0].total_cmp(&points[b][0]));
    let natural = order.iter().filter(|&&i| points[i][0] < middle_x).count();
    // Neither margin gets more than five eighths, when both can take that many.
    let most = (points.len() * 5).div_ceil(8).min(capacity);
    let left = natural.max(points.len().saturating_sub(most)).min(most);
    let mut margins = vec![Margin::Right; points.len()];
    order[..left].iter().for_each(|&i| margins[i] = Margin::Left);
    margins
}

/// Places the flags; points that find no room get none.
pub fn place(points: &[[f64; 2]], margins: &[Margin], room: &Room) -> Vec<Flag> {
    let mut flags = Vec::new();
    for margin in [Margin::Left, Margin::Right] {
        let mut mine: Vec<usize> = (0..points.len()).filter(|&i| margins[i] == margin).collect();
        mine.truncate(room.capacity());
        mine.sort_by(|&a, &b| points[a][1].total_cmp(&points[b][1]));
        let heights = spread(&mine.iter().map(|&i| points[i][1]).collect::<Vec<_>>(), room);
        uncross(&mut mine, points, &heights, room.inner_x(margin));
        flags.extend(mine.iter().zip(&heights).map(|(&point, &y)| Flag { point, margin, y }));
    }
    flags
}

/// Places the flags as `place` does, and keeps them off what is taken of each margin (left, right): heights from, to.
/// Points that find no room get none, the last ones first.
pub fn place_around(points: &[[f64; 2]], margins: &[Margin], room: &Room, taken: [&[[f64; 2]]; 2]) -> Vec<Flag> {
    let mut flags = Vec::new();
    for (margin, taken) in [Margin::Left, Margin::Right].into_iter().zip(taken) {
        let mut mine: Vec<usize> = (0..points.len()).filter(|&i| margins[i] == margin).collect();
        let heights = loop {
            let mut wished: Vec<f64> = mine.iter().map(|&i| points[i][1]).collect();
            wished.sort_by(f64::total_cmp);
            match spread_around(&wished, room, taken) {
                Some(heights) => break heights,
                None => mine.truncate(mine.len().saturating_sub(1)),
            }
        };
        mine.sort_by(|&a, &b| points[a][1].total_cmp(&points[b][1]));
        uncross(&mut mine, points, &heights, room.inner_x(margin));
        flags.extend(mine.iter().zip(&heights).map(|(&point, &y)| Flag { point, margin, y }));
    }
    flags
}

/// Steps in which heights are looked for, in a pitch.
const STEPS: f64 = 16.0;

/// Heights as near as possible (least squares, in steps) to the wished ones, which ascend, at least a pitch apart, inside the room and half
/// a pitch off what is taken; `None` = they have no room. The best heights of the first k flags that end at a step, for one flag after the
/// other.
fn spread_around(wished: &[f64], room: &Room, taken: &[[f64; 2]]) -> Option<Vec<f64>> {
    if wished.is_empty() {
        return Some(Vec::new());
    }
    let (step, off) = (room.pitch / STEPS, 0.5 * room.pitch);
    let count = ((room.bottom - room.top) / step + 1e-9).floor();
    if !(0.0..1e5).contains(&count) {
        return None;
    }
    let heights: Vec<f64> = (0..=count as usize).map(|k| room.top + k as f64 * step).collect();
    let is_free = |y: &f64| taken.iter().all(|[from, to]| y + off <= *from || y - off >= *to);
    let free: Vec<bool> = heights.iter().map(is_free).collect();
    // For each flag, the best cost up to each step and the step where it was reached.
    let mut best: Vec<Vec<(f64, usize)>> = Vec::with_capacity(wished.len());
    for (k, wish) in wished.iter().enumerate() {
        let mut so_far = (f64::INFINITY, 0);
        let line = (0..heights.len()).map(|s| {
            let before = match (k, s.checked_sub(STEPS as usize)) {
                (0, _) => 0.0,
                (_, Some(s)) => best[k - 1][s].0,
                (_, None) => f64::INFINITY,
            };
            let cost = before + (heights[s] - wish).powi(2);
            if free[s] && cost < so_far.0 {
                so_far = (cost, s);
            }
            so_far
        });
        let line = line.collect();
        best.push(line);
    }
    let mut end = heights.len() - 1;
    let mut found = vec![0.0; wished.len()];
    for k in (0..wished.len()).rev() {
        let (cost, s) = best[k][end];
        if cost.is_infinite() {
            return None;
        }
        found[k] = heights[s];
        end = s.saturating_sub(STEPS as usize);
    }
    Some(found)
}

/// Heights as near as possible (least squares) to the wished ones, which ascend, at least a pitch apart, inside the room:
/// pooling of neighbours that are too close, then a shift into the room.
fn spread(wished: &[f64], room: &Room) -> Vec<f64> {
    let mut blocks: Vec<(f64, usize)> = Vec::new();
    for (k, y) in wished.iter().enumerate() {
        blocks.push((y - k as f64 * room.pitch, 1));
        while let [.., (a, m), (b, n)] = blocks[..] {
            if a <= b {
                break;
            }
            blocks.truncate(blocks.len() - 2);
            blocks.push(((a * m as f64 + b * n as f64) / (m + n) as f64, m + n));
        }
    }
    let highest = room.bottom - wished.len().saturating_sub(1) as f64 * room.pitch;
    let bases = blocks.iter().flat_map(|&(base, n)| std::iter::repeat_n(base, n));
    bases.enumerate().map(|(k, base)| base.clamp(room.top, highest.max(room.top)) + k as f64 * room.pitch).collect()
}

/// Exchanges flags until no two leaders cross. Each exchange shortens the leaders' total length (two sides of a
/// quadrilateral are shorter than its diagonals), so it ends.
fn uncross(mine: &mut [usize], points: &[[f64; 2]], heights: &[f64], x: f64) {
    loop {
        let mut crossed = None;
        for a in 0..mine.len() {
            for b in a + 1..mine.len() {
                if cross([x, heights[a]], points[mine[a]], [x, heights[b]], points[mine[b]]) {
                    crossed = Some((a, b));
                }
            }
        }
        match crossed {
            Some((a, b)) => mine.swap(a, b),
            None => return,
        }
    }
}

/// Whether two segments properly cross.
fn cross(a: [f64; 2], b: [f64; 2], c: [f64; 2], d: [f64; 2]) -> bool {
    let turn = |p: [f64; 2], q: [f64; 2], r: [f64; 2]| (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
    turn(a, b, c) * turn(a, b, d) < 0.0 && turn(c, d, a) * turn(c, d, b) < 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::{Rng, SeedableRng};

    #[test]
    fn no_two_flags_overlap_and_no_leaders_cross() {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let mut unit = move || f64::from(rng.next_u32()) / f64::from(u32::MAX);
        for round in 0..3000 {
            // Crowds, columns and rows as well as scattered points.
            let squeeze = [1.0, 0.1, 0.001][round % 3];
            let n = round % 9;
            let points: Vec<[f64; 2]> = (0..n)
                .map(|_| [45.0 + 95.0 * unit() * squeeze, 82.0 + 90.0 * unit() * [1.0, 0.2][round % 2]])
                .collect();
            let room = Room { left_x: 42.0, right_x: 143.0, top: 82.0, bottom: 175.0, pitch: 7.8 };
            let margins = split(&points, 92.0, room.capacity());
            let flags = place(&points, &margins, &room);
            assert_eq!(flags.len(), n);
            let start = |f: &Flag| [room.inner_x(f.margin), f.y];
            for (k, a) in flags.iter().enumerate() {
                assert!(a.y >= room.top - 1e-9 && a.y <= room.bottom + 1e-9);
                for b in &flags[k + 1..] {
                    assert!(a.margin != b.margin || (a.y - b.y).abs() >= room.pitch - 1e-9, "round {round}: overlap");
                    assert!(!cross(start(a), points[a.point], start(b), points[b.point]), "round {round}: crossing");
                }
            }
        }
    }

    #[test]
    fn flags_keep_off_what_is_taken_and_the_first_ones_stay() {
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        let mut unit = move || f64::from(rng.next_u32()) / f64::from(u32::MAX);
        let mut dropped = 0;
        for round in 0..2000 {
            let points: Vec<[f64; 2]> = (0..round % 12).map(|_| [600.0 * unit(), 400.0 * unit()]).collect();
            let room = Room { left_x: 120.0, right_x: 480.0, top: 20.0, bottom: 380.0, pitch: 34.0 };
            let mut taken = || -> Vec<[f64; 2]> {
                let from = (0..round % 7).map(|_| 400.0 * unit()).collect::<Vec<_>>();
                from.into_iter().map(|y| [y, y + 10.0 + 60.0 * unit()]).collect()
            };
            let taken = [taken(), taken()];
            let margins = split(&points, 300.0, room.capacity());
            let flags = place_around(&points, &margins, &room, [&taken[0], &taken[1]]);
            dropped += points.len() - flags.len();
            let start = |f: &Flag| [room.inner_x(f.margin), f.y];
            for (k, a) in flags.iter().enumerate() {
                let side = &taken[usize::from(a.margin == Margin::Right)];
                assert!(a.y >= room.top - 1e-9 && a.y <= room.bottom + 1e-9);
                assert!(side.iter().all(|[from, to]| a.y + 17.0 <= *from || a.y - 17.0 >= *to), "round {round}");
                for b in &flags[k + 1..] {
                    assert!(a.margin != b.margin || (a.y - b.y).abs() >= room.pitch - 1e-9, "round {round}: overlap");
                    assert!(!cross(start(a), points[a.point], start(b), points[b.point]), "round {round}: crossing");
                }
            }
            // Who is left out comes after all who stay in that margin.
            for (point, margin) in margins.iter().enumerate() {
                let stays = |p: usize| flags.iter().any(|f| f.point == p);
                assert!(stays(point) || flags.iter().all(|f| f.margin != *margin || f.point < point));
            }
        }
        assert!(dropped > 0, "some rounds had no room");
    }

    #[test]
    fn flags_that_have_room_stand_within_a_step_of_their_points() {
        let room = Room { left_x: 42.0, right_x: 143.0, top: 82.0, bottom: 175.0, pitch: 7.8 };
        let points = [[50.0, 100.0], [60.0, 130.0], [120.0, 115.0]];
        let margins = split(&points, 92.0, 8);
        for flag in place_around(&points, &margins, &room, [&[], &[]]) {
            assert!((flag.y - points[flag.point][1]).abs() <= 0.5 * room.pitch / STEPS + 1e-9, "{flag:?}");
        }
        // A marker at the first point's own height moves its flag just past it.
        let around = place_around(&points[..1], &margins[..1], &room, [&[[95.0, 104.0]], &[]]);
        assert!(
            (around[0].y - 108.0).abs() <= room.pitch / STEPS + 1e-9 || (around[0].y - 91.0).abs() < 0.6,
            "{around:?}"
        );
    }

    #[test]
    fn flags_stand_at_their_points_when_there_is_room() {
        let points = [[50.0, 100.0], [60.0, 130.0], [120.0, 115.0]];
        let room = Room { left_x: 42.0, right_x: 143.0, top: 82.0, bottom: 175.0, pitch: 7.8 };
        let flags = place(&points, &split(&points, 92.0, 8), &room);
        assert_eq!(flags.len(), 3);
        assert!(flags.iter().all(|f| (f.y - points[f.point][1]).abs() < 1e-9));
        assert!(flags.iter().all(|f| (f.margin == Margin::Left) == (points[f.point][0] < 92.0)));
    }

    #[test]
    fn no_room_means_no_flag() {
        let room = Room { left_x: 0.0, right_x: 9.0, top: 5.0, bottom: 4.0, pitch: 7.8 };
        assert_eq!(room.capacity(), 0);
        assert!(place(&[[1.0, 1.0]], &split(&[[1.0, 1.0]], 5.0, 0), &room).is_empty());
    }
}
