//! Rows whose answer is known by construction.

use super::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const SIZE_MM: f64 = 300.0;

/// From a best fit of a deformed part to its datums.
fn planted() -> Isometry3 {
    Isometry3::new(Vector3::new(1.3, -0.7, 0.4), Vector3::new(0.02, -0.013, 0.031))
}

fn unit(v: [f64; 3]) -> UnitVector3 {
    UnitVector3::new_normalize(Vector3::from(v))
}

fn random_unit(rng: &mut ChaCha8Rng) -> UnitVector3 {
    loop {
        let v = Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0));
        if (0.1..1.0).contains(&v.norm()) {
            return UnitVector3::new_normalize(v);
        }
    }
}

/// The row of a lock at a place, as measured on a body moved so.
fn lock(place: [f64; 3], along: [f64; 3], moved: &Isometry3) -> Row {
    let nominal = Point3::from(place);
    Row { told: Told::Point { measured: moved * nominal, nominal, along: unit(along) }, u: 0.0 }
}

fn across(axis: &UnitVector3) -> [UnitVector3; 2] {
    let first = UnitVector3::new_normalize(axis.cross(&Vector3::ith(axis.iamin(), 1.0)));
    [first, UnitVector3::new_unchecked(axis.cross(&first))]
}

/// Locks, surfaces and axes at random; `count` rows that hold the body well, exact for the moved body.
fn random_scheme(rng: &mut ChaCha8Rng, count: usize, moved: &Isometry3) -> Vec<Row> {
    loop {
        let mut rows = Vec::new();
        while rows.len() < count {
            let nominal = Point3::from(Vector3::from_fn(|_, _| rng.random_range(-150.0..150.0)));
            let direction = random_unit(rng);
            let told = match rng.random_range(0..4) {
                0 => {
                    // A surface is told by another of its points, as a fit would tell it.
                    let beside = across(&direction)[0].into_inner() * 2.3;
                    Told::Surface {
                        measured: moved * (nominal + beside),
                        normal: UnitVector3::new_unchecked(moved * direction.into_inner()),
                        nominal,
                    }
                }
                1 => Told::Axis {
                    measured: UnitVector3::new_unchecked(moved * direction.into_inner()),
                    across: across(&direction)[0],
                },
                _ => Told::Point { measured: moved * nominal, nominal, along: direction },
            };
            // An axis is told in rad: 1e-5 to 2e-4 are 3 to 60 um at the body's size.
            let u = rng.random_range(0.005..0.1);
            rows.push(Row { told, u: if matches!(told, Told::Axis { .. }) { u / 500.0 } else { u } });
        }
        // Locks that hold poorly may have another answer nearby.
        if hold(&rows, SIZE_MM).is_ok_and(|(condition, _)| condition < 20.0) {
            return rows;
        }
    }
}

fn apart_mm(a: &Isometry3, b: &Isometry3) -> f64 {
    let corners = [[150.0, 150.0, 150.0], [-150.0, 150.0, 0.0], [150.0, -150.0, -150.0]].map(Point3::from);
    corners.iter().map(|c| (a * c - b * c).norm()).fold(0.0, f64::max)
}

/// f64 at 300 mm keeps 6e-14 mm; a few dozen operations passed on twentyfold stay below 1e-10 mm.
#[test]
fn exact_rows_of_any_scheme_bring_the_planted_motion_back() {
    let mut rng = ChaCha8Rng::seed_from_u64(31);
    for k in 0..300 {
        let moved = Isometry3::new(
            Vector3::from_fn(|_, _| rng.random_range(-3.0..3.0)),
            random_unit(&mut rng).into_inner() * rng.random_range(0.0..0.03),
        );
        let count = 6 + k % 5;
        let rows = random_scheme(&mut rng, count, &moved);
        let held = solve(&rows, SIZE_MM).unwrap();
        let back = held.motion * moved;
        assert!(apart_mm(&back, &Isometry3::identity()) < 1e-9, "{k}: {}", apart_mm(&back, &Isometry3::identity()));
        assert!(back.rotation.angle() < 1e-11 && held.residuals.iter().all(|r| r.abs() < 1e-9));
        assert_eq!(held.normalised.iter().any(Option::is_some), count > 6);
    }
}

/// Six rows are met exactly whatever they weigh and whatever is wrong with them; more are not.
#[test]
fn six_rows_are_met_exactly_and_the_order_of_rows_does_not_matter() {
    let mut rng = ChaCha8Rng::seed_from_u64(32);
    for k in 0..100 {
        let mut rows = random_scheme(&mut rng, 6 + k % 4, &planted());
        for row in &mut rows {
            if let Told::Point { measured, .. } | Told::Surface { measured, .. } = &mut row.told {
                *measured += Vector3::from_fn(|_, _| rng.random_range(-0.05..0.05));
            }
        }
        let first = solve(&rows, SIZE_MM).unwrap();
        if rows.len() == 6 {
            assert!(first.residuals.iter().all(|r| r.abs() < 1e-9), "{:?}", first.residuals);
        }
        for _ in 0..3 {
            for k in (1..rows.len()).rev() {
                rows.swap(k, rng.random_range(0..=k));
            }
            let second = solve(&rows, SIZE_MM).unwrap();
            assert!(apart_mm(&first.motion, &second.motion) < 1e-9);
            assert!((first.condition / second.condition - 1.0).abs() < 1e-9);
        }
    }
}

/// Hole, slot and surface point.
struct Sivpro {
    hole: Point3,
    slot: Point3,
    point: Point3,
    normal: UnitVector3,
}

fn sivpro() -> Sivpro {
    Sivpro {
        hole: Point3::new(-76.0, 56.0, 4.1),
        slot: Point3::new(72.0, -54.0, 3.0),
        point: Point3::new(10.0, 40.0, 8.0),
        normal: unit([0.1, -0.05, 1.0]),
    }
}

impl Sivpro {
    /// Rows where hole and slot were found there, and the surface through a point with a normal.
    fn rows(&self, hole: Point3, slot: Point3, surface: (Point3, UnitVector3)) -> Vec<Row> {
        let told = Told::Surface { measured: surface.0, normal: surface.1, nominal: self.point };
        self.five(hole, slot).into_iter().chain([Row { told, u: 0.0 }]).collect()
    }

    fn five(&self, hole: Point3, slot: Point3) -> Vec<Row> {
        let line = UnitVector3::new_normalize(self.slot - self.hole);
        let at_hole = [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()].map(|along| Told::Point {
            measured: hole,
            nominal: self.hole,
            along,
        });
        let at_slot = across(&line).map(|along| Told::Point { measured: slot, nominal: self.slot, along });
        at_hole.into_iter().chain(at_slot).map(|told| Row { told, u: 0.0 }).collect()
    }
}

/// The paper's scheme, and the same as locks: the surface is then measured where the locked line through the nominal place meets it,
/// again in each pose. Hole, slot and surface are off by some tenths of a mm each.
#[test]
fn hole_slot_and_point_are_the_same_as_their_locks() {
    let s = sivpro();
    let (hole, slot) =
        (planted() * s.hole + Vector3::new(0.2, -0.1, 0.3), planted() * s.slot + Vector3::new(-0.3, 0.1, 0.2));
    let surface = (
        planted() * s.point + Vector3::new(0.1, 0.2, -0.4),
        UnitVector3::new_unchecked(planted() * s.normal.into_inner()),
    );
    let by_scheme = solve(&s.rows(hole, slot, surface), SIZE_MM).unwrap().motion;
    let mut by_locks = Isometry3::identity();
    for _ in 0..40 {
        let (p, n) = (by_locks * surface.0, by_locks * surface.1.into_inner());
        let met = s.point + s.normal.into_inner() * ((p - s.point).dot(&n) / s.normal.dot(&n));
        let mut rows = s.five(by_locks * hole, by_locks * slot);
        rows.push(Row { told: Told::Point { measured: met, nominal: s.point, along: s.normal }, u: 0.0 });
        by_locks = solve(&rows, SIZE_MM).unwrap().motion * by_locks;
    }
    // Each round shrinks what is left to the share by which the surface leans, a few hundredths.
    assert!(apart_mm(&by_scheme, &by_locks) < 1e-9, "{}", apart_mm(&by_scheme, &by_locks));
}

/// The line from hole to slot by its direction alone, as the slot's axis is read.
#[test]
fn an_axis_holds_the_same_turns_as_a_far_point_of_it() {
    let s = sivpro();
    let line = UnitVector3::new_normalize(s.slot - s.hole);
    let surface = (planted() * s.point, UnitVector3::new_unchecked(planted() * s.normal.into_inner()));
    let by_points = s.rows(planted() * s.hole, planted() * s.slot, surface);
    let mut by_axis = by_points.clone();
    let measured = UnitVector3::new_unchecked(planted() * line.into_inner());
    for (row, across) in by_axis[3..5].iter_mut().zip(across(&line)) {
        row.told = Told::Axis { measured, across };
    }
    let motions = [by_points, by_axis].map(|rows| solve(&rows, SIZE_MM).unwrap().motion);
    assert!(apart_mm(&motions[0], &motions[1]) < 1e-9);
    assert!(apart_mm(&(motions[0] * planted()), &Isometry3::identity()) < 1e-9);
}

/// A part drawn a hundred metres from the CAD's origin is held as well as one at it. Places there are told to 1.5e-11 mm
/// (f64 at 1e5 mm), which a lever of ten makes 1.5e-10 mm and a rotation 1e-12 rad; at 1e5 mm those are 1e-7 mm in the
/// motion's shift, not at the part.
#[test]
fn the_distance_of_the_part_from_the_origin_does_not_matter() {
    for k in 0..60 {
        let size = 1e5 * f64::from(k) / 59.0;
        let away = Vector3::new(1.0, -0.7 + 0.02 * f64::from(k), 0.37) * size;
        let near = sivpro();
        let s = Sivpro { hole: near.hole + away, slot: near.slot + away, point: near.point + away, ..near };
        // As planted, but about the part.
        let moved = Translation3::from(away) * planted() * Translation3::from(-away);
        let surface = (moved * s.point, UnitVector3::new_unchecked(moved * s.normal.into_inner()));
        let scheme = s.rows(moved * s.hole, moved * s.slot, surface);
        let locks: Vec<Row> = three_two_one()
            .iter()
            .map(|(place, along)| lock((Point3::from(*place) + away).into(), *along, &moved))
            .collect();
        for rows in [scheme, locks] {
            let back = solve(&rows, SIZE_MM).unwrap_or_else(|e| panic!("{size} mm away: {e:?}")).motion * moved;
            for corner in [[150.0, 100.0, 0.0], [-150.0, 100.0, 30.0]].map(|p| Point3::from(p) + away) {
                let left = (back * corner - corner).norm();
                assert!(left < 1e-8, "{size} mm away: {left}");
            }
        }
    }
}

const Z: [f64; 3] = [0.0, 0.0, 1.0];

fn three_two_one() -> [([f64; 3], [f64; 3]); 6] {
    [
        ([0.0, 0.0, 0.0], Z),
        ([200.0, 0.0, 0.0], Z),
        ([0.0, 150.0, 0.0], Z),
        ([0.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
        ([200.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
        ([0.0, 0.0, 0.0], [1.0, 0.0, 0.0]),
    ]
}

fn locks(of: &[([f64; 3], [f64; 3])]) -> Vec<Row> {
    of.iter().map(|(place, along)| lock(*place, *along, &Isometry3::identity())).collect()
}

/// The free motions in words, with the places named.
fn free(rows: &[Row], names: &[(&str, [f64; 3])]) -> Vec<String> {
    let names: Vec<Named> = names.iter().map(|(name, place)| Named { name, place: Point3::from(*place) }).collect();
    let Err(HoldError::Free(motions)) = hold(rows, SIZE_MM) else { panic!("must be refused") };
    assert_eq!(solve(rows, SIZE_MM), Err(HoldError::Free(motions.clone())));
    motions.iter().map(|motion| motion.in_words(&names)).collect()
}

#[test]
fn what_stays_free_is_named() {
    let all = three_two_one();
    assert!(hold(&locks(&all), SIZE_MM).is_ok());
    assert_eq!(free(&locks(&all[..5]), &[]), ["shift along x"]);
    // Both locks along y at one place: the part turns about it.
    let mut turning = all;
    turning[4].0 = [0.0, 0.0, 0.0];
    assert_eq!(free(&locks(&turning), &[("A", [0.0, 0.0, 0.0]), ("B", [200.0, 0.0, 0.0])]), ["turn about z through A"]);
    assert_eq!(free(&locks(&turning), &[]), ["turn about z through [0, 0, 0]"]);
    // Three locks along z in one line.
    let mut leaning = all;
    leaning[2].0 = [100.0, 0.0, 0.0];
    let named = [("A", [0.0, 0.0, 0.0]), ("B", [200.0, 0.0, 0.0]), ("C", [0.0, 150.0, 0.0])];
    assert_eq!(free(&locks(&leaning), &named), ["turn about the line through A and B"]);
    // Three locks along z alone.
    let two = free(&locks(&all[..3]), &named);
    assert_eq!(two.len(), 3);
    assert!(
        two[0].starts_with("turn about z") && two[1].starts_with("shift") && two[2].starts_with("shift"),
        "{two:?}"
    );
    assert_eq!(free(&[], &[]).len(), 6);
}

/// A surface point on the line from hole to slot does not resist the turn about it, one near it does so weakly.
#[test]
fn the_turn_about_the_line_through_hole_and_slot_is_named() {
    let s = sivpro();
    let names = [Named { name: "H1", place: s.hole }, Named { name: "S1", place: s.slot }];
    let middle = nalgebra::center(&s.hole, &s.slot);
    let at = |point: Point3| Sivpro { point, ..sivpro() }.rows(s.hole, s.slot, (point, s.normal));
    let Err(HoldError::Free(motions)) = hold(&at(middle), SIZE_MM) else { panic!("a motion is free") };
    assert_eq!(
        motions.iter().map(|m| m.in_words(&names)).collect::<Vec<_>>(),
        ["turn about the line through H1 and S1"]
    );
    let across = (s.slot - s.hole).cross(&Vector3::z()).normalize();
    let (condition, weakest) = hold(&at(middle + across * 2.0), SIZE_MM).unwrap();
    assert!(condition > WEAK_CONDITION, "{condition}");
    assert_eq!(weakest.in_words(&names), "turn about the line through H1 and S1");
    let (well, _) = hold(&at(s.point), SIZE_MM).unwrap();
    assert!(well < 0.5 * WEAK_CONDITION, "{well}");
}

/// A screw: what meets turn and shift alike leaves both, one with the other. Turning about x by a degree moves the last place by
/// 100 mm pi / 180 across its lock as shifting along x by as much does.
#[test]
fn a_turn_with_a_shift_tells_both() {
    let y = [0.0, 1.0, 0.0];
    let held = [([0.0; 3], y), ([200.0, 0.0, 0.0], y), ([0.0; 3], Z), ([200.0, 0.0, 0.0], Z)];
    let last = ([0.0, 0.0, 100.0], [0.7, 0.7, 0.0]);
    let words = free(&locks(&[held[0], held[1], held[2], held[3], last]), &[]);
    assert_eq!(words.len(), 1);
    assert!(words[0].starts_with("turn about x through ") && words[0].ends_with(" of 1.75 mm a degree"), "{words:?}");
}

/// Of seven rows the one that is told ten times better outvotes the other: two locks at one place, 0.1 mm apart.
#[test]
fn more_than_six_rows_weigh_as_they_are_known() {
    let mut rows = locks(&three_two_one());
    rows.push(lock([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], &Isometry3::translation(0.1, 0.0, 0.0)));
    let shift = |u: [f64; 2]| {
        let mut rows = rows.clone();
        rows.iter_mut().for_each(|row| row.u = u[0]);
        rows[6].u = u[1];
        let held = solve(&rows, SIZE_MM).unwrap();
        (held.motion.translation.vector.x, held.normalised)
    };
    let (alike, normalised) = shift([0.02, 0.02]);
    assert!((alike + 0.05).abs() < 1e-9, "{alike}");
    // The two differ by 0.1 mm; the standard deviation of that is 0.02 sqrt(2).
    let w = [5, 6].map(|k| normalised[k].unwrap());
    for w in w {
        assert!((w.abs() - 0.1 / (0.02 * 2_f64.sqrt())).abs() < 1e-6, "{w}");
    }
    assert!(w[0] * w[1] < 0.0 && normalised[0].is_none());
    assert!((shift([0.2, 0.02]).0 + 0.1 * 100.0 / 101.0).abs() < 1e-9);
    // Without any uncertainty all weigh alike.
    assert!((shift([0.0, 0.0]).0 + 0.05).abs() < 1e-9);
}

#[test]
fn a_row_that_is_not_a_number_is_refused() {
    for fault in [f64::NAN, f64::INFINITY] {
        for k in 0..6 {
            let mut rows = locks(&three_two_one());
            let Told::Point { measured, .. } = &mut rows[k].told else { panic!("a lock") };
            measured.y = fault;
            assert_eq!(solve(&rows, SIZE_MM), Err(HoldError::NotFinite));
            assert_eq!(hold(&rows, SIZE_MM), Err(HoldError::NotFinite));
        }
    }
}
