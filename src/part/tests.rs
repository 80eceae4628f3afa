use super::shapes::*;
use super::*;
use crate::diagnostic::ReadError;
use crate::geometry::{Mesh, Point3, Vector3};
use crate::plan::{CadSide, Side};
use crate::run::RunContext;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

#[test]
fn loops_of_a_plate_with_a_hole_run_along_all_its_edges() {
    let part = prepared(&soup(&plate()), &settings(CadSide::Top, 1.0));
    assert!(part.warnings.is_empty(), "{:?}", part.warnings);
    for side in [Side::Top, Side::Bottom] {
        let face = part.face(side);
        let length = |l: &Vec<Point3>| l.windows(2).map(|w| (w[1] - w[0]).norm()).sum::<f64>();
        let mut lengths: Vec<f64> = face.boundary_loops.iter().map(length).collect();
        lengths.sort_by(f64::total_cmp);
        assert_eq!(lengths, [40.0, 320.0]);
        assert!(face.boundary_loops.iter().all(|l| l.first() == l.last()), "closed");
        // Surface on the left: the outer loop turns with the normal, the hole against it.
        let outer = face.boundary_loops.iter().find(|l| length(l) > 100.0).unwrap();
        let turn: f64 = outer.windows(2).map(|w| w[0].x * w[1].y - w[1].x * w[0].y).sum();
        assert_eq!(turn.signum(), side.sign());
    }
}

#[test]
fn edges_and_holes_are_told_from_the_surface() {
    let part = prepared(&plate(), &settings(CadSide::Top, 1.0));
    let face = part.face(Side::Top);
    let inside = face.closest(&Point3::new(71.3, 22.2, 0.4), 10.0).unwrap();
    assert!(!inside.on_boundary && (inside.signed_mm - 0.4).abs() < 1e-12);
    // In the hole (x 30..40, y 25..35), 1 mm from its rim; past the outer edge; past a corner.
    for (p, d) in [([31.0, 29.0, 0.0], 1.0), ([103.0, 22.0, 4.0], 5.0), ([-3.0, -4.0, 0.0], 5.0)] {
        let hit = face.closest(&Point3::from(p), 10.0).unwrap();
        assert!(hit.on_boundary && (hit.signed_mm.abs() - d).abs() < 1e-12, "{p:?}");
        assert!((face.edge_distance_mm(&Point3::from(p)) - d).abs() < 1e-12);
    }
    assert!((face.edge_distance_mm(&Point3::new(50.0, 30.0, 0.0)) - 10.0).abs() < 1e-12);
    assert!(face.closest(&Point3::new(50.0, 30.0, 11.0), 10.0).is_none());
    let closed = prepared(&cuboid([10.0, 20.0, 30.0]), &settings(CadSide::Top, 0.0));
    assert!(closed.face(Side::Top).edge_distance_mm(&Point3::origin()).is_infinite());
}

#[test]
fn both_sides_measure_out_of_the_sheet() {
    // The sheet lies one thickness below its CAD surface.
    let part = prepared(&plate(), &settings(CadSide::Top, 1.5));
    let above = part.face(Side::Top).closest(&Point3::new(70.0, 20.0, 0.25), 5.0).unwrap();
    let below = part.face(Side::Bottom).closest(&Point3::new(70.0, 20.0, -1.75), 5.0).unwrap();
    assert!((above.signed_mm - 0.25).abs() < 1e-12 && (above.normal.into_inner() - Vector3::z()).norm() < 1e-12);
    assert!((below.signed_mm - 0.25).abs() < 1e-12 && (below.normal.into_inner() + Vector3::z()).norm() < 1e-12);
    let middle = prepared(&plate(), &settings(CadSide::Middle, 1.5));
    let z = |part: &Part, side| part.face(side).mesh.vertices[0].z;
    assert_eq!((z(&middle, Side::Top), z(&middle, Side::Bottom)), (0.75, -0.75));
    let bottom = prepared(&plate(), &settings(CadSide::Bottom, 1.5));
    assert_eq!((z(&bottom, Side::Top), z(&bottom, Side::Bottom)), (1.5, 0.0));
}

#[test]
fn planes_beside_a_crease_move_by_exactly_the_thickness() {
    for angle in [-1.5f64, -0.6, 0.1, 0.5, 1.3] {
        let mesh = folded(angle);
        let slanted = Vector3::new(-angle.sin(), 0.0, angle.cos());
        for offset in [-1.2, 0.8] {
            let moved = skin::offset(&mesh, offset);
            assert_eq!(moved.folded, 0);
            for (before, after) in mesh.vertices.iter().zip(&moved.mesh.vertices) {
                let step = after - before;
                // Exact but for rounding and a singular-value cut that does not bind at these angles.
                if before.x <= 0.0 {
                    assert!((step.z - offset).abs() < 1e-12, "level plane, {angle}");
                }
                if before.x >= 0.0 {
                    assert!((step.dot(&slanted) - offset).abs() < 1e-12, "slanted plane, {angle}");
                }
                assert!(step.y.abs() < 1e-12, "edges stay where they were trimmed");
            }
        }
    }
}

#[test]
fn a_radius_below_the_thickness_is_told() {
    let tight = grid(
        [24, 4],
        |_, _| true,
        |u, v| {
            let a = (u - 12.0) * 0.12;
            Point3::new(0.8 * a.sin(), 3.0 * v, 0.8 * a.cos())
        },
    );
    let wide = Mesh {
        vertices: tight.vertices.iter().map(|v| Point3::new(4.0 * v.x, v.y, 4.0 * v.z)).collect(),
        ..tight.clone()
    };
    let folded =
        |mesh: &Mesh| prepared(mesh, &settings(CadSide::Top, 1.2)).warnings.iter().any(|w| w.contains("fold over"));
    assert!(folded(&tight) && !folded(&wide));
}

#[test]
fn a_minority_that_winds_the_other_way_is_turned() {
    let mut mesh = plate();
    for t in mesh.triangles.iter_mut().step_by(3) {
        t.swap(0, 1);
    }
    let part = prepared(&mesh, &settings(CadSide::Top, 0.0));
    assert!((0..part.mesh.triangles.len()).all(|t| part.mesh.area_vector_twice(t).z > 0.0));
    assert_eq!(part.warnings.len(), 1);
    // All of them the other way: the file's normals mean something and stay.
    let mut mesh = plate();
    mesh.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    let part = prepared(&mesh, &settings(CadSide::Top, 0.0));
    assert!((0..part.mesh.triangles.len()).all(|t| part.mesh.area_vector_twice(t).z < 0.0));
}

#[test]
fn signs_are_right_around_edges_and_corners_of_a_box() {
    let size = [10.0, 20.0, 30.0];
    let part = prepared(&cuboid(size), &settings(CadSide::Top, 0.0));
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    for _ in 0..5000 {
        let p: [f64; 3] = std::array::from_fn(|k| size[k] * (2.0 * rng.random::<f64>() - 0.5));
        // Distance to a box: outside by Pythagoras, inside to the nearest side.
        let over: [f64; 3] = std::array::from_fn(|k| (p[k] - size[k]).max(-p[k]));
        let outside = over.iter().map(|o| o.max(0.0).powi(2)).sum::<f64>().sqrt();
        let expected = if outside > 0.0 { outside } else { over.into_iter().fold(f64::MIN, f64::max) };
        let hit = part.face(Side::Top).closest(&Point3::from(p), f64::INFINITY).unwrap();
        assert!((hit.signed_mm - expected).abs() < 1e-12, "{p:?}: {} instead of {expected}", hit.signed_mm);
    }
}

#[test]
fn a_solid_sheet_is_split_into_its_two_faces() {
    for (sheet, area, loops) in [(plate(), 5900.0, 2), (folded(1.57), 1800.0, 1), (folded(-0.5), 1800.0, 1)] {
        let solid = soup(&thick(&sheet, 1.5));
        let mut settings = settings(CadSide::Solid, 0.0);
        let n = sheet.area_vector_twice(0).normalize();
        for sign in [1.0, -1.0] {
            settings.plan_directions = vec![(sheet.corners(0)[1], n * sign)];
            let part = prepared(&solid, &settings);
            assert!(part.warnings.is_empty(), "{:?}", part.warnings);
            assert!((part.thickness_mm - 1.5).abs() < 1e-5, "{}", part.thickness_mm);
            let (top, bottom) = (part.face(Side::Top), part.face(Side::Bottom));
            assert_eq!((top.boundary_loops.len(), bottom.boundary_loops.len()), (loops, loops));
            let drawn = if sign > 0.0 { top } else { bottom };
            assert!((drawn.mesh.area() - area).abs() < 1e-9, "{}", drawn.mesh.area());
            assert!(drawn.mesh.area_vector_twice(0).dot(&n) > 0.0);
        }
    }
}

#[test]
fn a_curved_solid_keeps_all_of_both_faces() {
    // A dome of radius 30 mm with a hole, 0.8 mm thick; 40 facets to the arc of 2 rad.
    let dome = grid(
        [40, 40],
        |i, j| !((5..9).contains(&i) && (20..24).contains(&j)),
        |u, v| {
            let (a, b) = (0.05 * (u - 20.0), 0.05 * (v - 20.0));
            Point3::new(30.0 * a.sin() * b.cos(), 30.0 * b.sin(), 30.0 * a.cos() * b.cos())
        },
    );
    let mut settings = settings(CadSide::Solid, 0.8);
    settings.plan_directions = vec![(Point3::new(0.0, 0.0, 30.0), Vector3::z())];
    let part = prepared(&soup(&thick(&dome, 0.8)), &settings);
    assert!(part.warnings.is_empty(), "{:?}", part.warnings);
    let (top, bottom) = (part.face(Side::Top), part.face(Side::Bottom));
    assert_eq!((top.mesh.triangles.len(), bottom.mesh.triangles.len()), (dome.triangles.len(), dome.triangles.len()));
    assert!((top.mesh.area() - dome.area()).abs() < 1e-6);
    assert_eq!((top.boundary_loops.len(), bottom.boundary_loops.len()), (2, 2));
    // A plan that says 1 mm is told; so is nothing when it says 0.
    settings.thickness_mm = 1.0;
    let other = prepared(&thick(&dome, 0.8), &settings);
    assert!(other.warnings.iter().any(|w| w.contains("0.8") && w.contains("1.000")), "{:?}", other.warnings);
    // Three times as much as the CAD's does not hide its faces either.
    settings.thickness_mm = 2.5;
    let far_off = prepared(&thick(&dome, 0.8), &settings);
    assert!((far_off.thickness_mm - 0.8).abs() < 0.02, "{}", far_off.thickness_mm);
    settings.thickness_mm = 0.0;
    let found = prepared(&thick(&dome, 0.8), &settings).thickness_mm;
    // The chord of a facet of 0.05 rad lies within 30 (1 - cos 0.025) = 0.01 mm of the arc, on either face.
    assert!((found - 0.8).abs() < 0.02, "{found}");
}

#[test]
fn a_solid_that_is_no_sheet_is_refused() {
    let run = RunContext::silent();
    let block = cuboid([10.0, 20.0, 30.0]);
    let Err(ReadError::Bad(fault)) = Part::prepare(block, "0".repeat(64), &settings(CadSide::Solid, 1.0), &run) else {
        panic!("a block has no two faces of a sheet")
    };
    assert!(fault.message.contains("cannot be told apart") && fault.help.is_some(), "{fault}");
}

#[test]
fn a_box_rests_on_its_six_sides() {
    let part = prepared(&cuboid([30.0, 40.0, 50.0]), &settings(CadSide::Top, 0.0));
    assert_eq!(part.resting_poses.len(), 6);
    for pose in &part.resting_poses {
        let axis = pose.up_cad.iamax();
        // The hull's points are moved by a millionth of 70 mm.
        assert!(pose.up_cad[axis].abs() > 1.0 - 1e-9);
        assert!((pose.height_mm - [30.0, 40.0, 50.0][axis]).abs() < 1e-3);
    }
    assert!(part.resting_poses.windows(2).all(|w| w[0].stability >= w[1].stability));
    assert!((part.resting_poses[0].height_mm - 30.0).abs() < 1e-3, "the flattest first");
}

#[test]
fn a_flat_plate_rests_on_its_two_faces_and_each_shows_its_side() {
    let part = prepared(&plate(), &settings(CadSide::Top, 1.0));
    let [first, second] = [part.resting_poses[0], part.resting_poses[1]];
    assert!(first.up_cad.dot(&second.up_cad) < -0.999_999);
    for pose in [first, second] {
        assert_eq!(pose.side, if pose.up_cad.z > 0.0 { Side::Top } else { Side::Bottom });
        assert!((pose.height_mm - 1.0).abs() < 1e-3 && pose.stability > 0.3);
    }
    // Without any thickness the same.
    let part = prepared(&plate(), &settings(CadSide::Top, 0.0));
    assert!(part.resting_poses[..2].iter().all(|p| p.up_cad.z.abs() > 0.999_999));
}

#[test]
fn an_angle_rests_on_either_leg_and_like_a_roof() {
    // Legs of 30 mm along -x and +z, 30 mm wide. The roof stands on both free edges and the back, both 45 degrees about y.
    let part = prepared(&folded(std::f64::consts::FRAC_PI_2), &settings(CadSide::Top, 1.0));
    let rests = |up: [f64; 3]| part.resting_poses.iter().any(|p| p.up_cad.angle(&Vector3::from(up)).to_degrees() < 5.0);
    assert!(rests([0.0, 0.0, 1.0]) && rests([-1.0, 0.0, 0.0]), "on a leg");
    assert!(rests([1.0, 0.0, -1.0]), "like a roof");
    assert!(!rests([0.0, 0.0, -1.0]) && !rests([-1.0, 0.0, 1.0]), "not on a leg's free edge, not on the crease");
}

#[test]
fn samples_cover_the_face_evenly() {
    let part = prepared(&plate(), &settings(CadSide::Top, 1.0));
    let face = part.face(Side::Bottom);
    let count = face.samples.len();
    assert!((3500..4500).contains(&count), "{count}");
    let spacing = (face.mesh.area() / count as f64).sqrt();
    for s in &face.samples {
        let hit = face.closest(&s.point, 1.0).unwrap();
        assert!(hit.signed_mm.abs() < 1e-9 && (hit.normal.into_inner() - s.normal.into_inner()).norm() < 1e-9);
    }
    let nearest = |p: &Point3, skip: usize| {
        let others = face.samples.iter().enumerate().filter(|(k, _)| *k != skip);
        others.map(|(_, s)| (s.point - p).norm()).fold(f64::INFINITY, f64::min)
    };
    // Random packing at this density leaves no two nearer than 0.75 and no gap wider than about 1.3 spacings.
    for k in (0..count).step_by(20) {
        assert!(nearest(&face.samples[k].point, k) > 0.7 * spacing);
    }
    for t in 0..face.mesh.triangles.len() {
        let [a, b, c] = face.mesh.corners(t).map(|p| p.coords);
        assert!(nearest(&Point3::from((a + b + c) / 3.0), usize::MAX) < 1.6 * spacing);
    }
}

#[test]
fn the_same_for_any_number_of_threads() {
    let mesh = soup(&grid([60, 50], |_, _| true, |u, v| Point3::new(u, v, (0.2 * u).sin() + (0.1 * v).cos())));
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| prepared(&mesh, &settings(CadSide::Bottom, 0.8)))
    };
    assert!(with(1) == with(3));
}

#[test]
fn what_cannot_be_a_part_is_refused_with_help() {
    let p = |x: f64, y: f64| Point3::new(x, y, 0.0);
    let one = |vertices: Vec<Point3>, triangles| Mesh { vertices, triangles };
    let cases = [
        (Mesh::default(), "no triangles"),
        (one(vec![p(0.0, 0.0), p(f64::NAN, 0.0), p(0.0, 9.0)], vec![[0, 1, 2]]), "vertex 2"),
        (one(vec![p(1e30, 0.0), p(1e30, 90.0), p(1e30, 100.0)], vec![[0, 1, 2]]), "vertex 1 of the CAD at"),
        (one(vec![p(0.0, 0.0), p(9.0, 0.0), p(9.0, -1_000_001.0)], vec![[0, 1, 2]]), "vertex 3 of the CAD at"),
        (one(vec![p(0.0, 0.0), p(9.0, 0.0)], vec![[0, 1, 2]]), "not there"),
        (one(vec![p(0.0, 0.0), p(0.01, 0.0), p(0.0, 0.01)], vec![[0, 1, 2]]), "across"),
        (one(vec![p(0.0, 0.0), p(9.0, 0.0), p(5.0, 0.0)], vec![[0, 1, 2]]), "area"),
        (one(vec![p(0.0, 0.0), p(9.0, 0.0), p(9.0, 0.0)], vec![[0, 1, 2]]), "area"),
    ];
    for (mesh, words) in cases {
        let result = Part::prepare(mesh, String::new(), &settings(CadSide::Top, 1.0), &RunContext::silent());
        let Err(ReadError::Bad(diagnostic)) = result else { panic!("accepted: {words}") };
        assert!(diagnostic.message.contains(words) && diagnostic.help.is_some(), "{diagnostic}");
    }
}

/// A needle a kilometre off: its area would put samples closer than numbers can count.
#[test]
fn a_surface_next_to_a_line_is_prepared_without_panic() {
    for height in [1e-5, 1e-30, 1e-300] {
        for far in [0.0, 9e5] {
            let vertices =
                vec![Point3::new(far, far, 0.0), Point3::new(far + 9.0, far, 0.0), Point3::new(far + 5.0, far, height)];
            let mesh = Mesh { vertices, triangles: vec![[0, 1, 2]] };
            let settings = settings(CadSide::Top, 1.0);
            match Part::prepare(mesh, String::new(), &settings, &RunContext::silent()) {
                Ok(part) => assert!(part.face(Side::Top).samples.iter().all(|s| s.point.coords.amax() < 1e6)),
                Err(ReadError::Bad(diagnostic)) => assert!(diagnostic.message.contains("area"), "{diagnostic}"),
                Err(other) => panic!("{other}"),
            }
        }
    }
}

#[test]
fn odd_meshes_are_prepared_without_panic() {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    for round in 0..60 {
        let count = 4 + round % 20;
        let vertices: Vec<Point3> = (0..count)
            .map(|_| {
                Point3::new(
                    (4.0 * rng.random::<f64>()).floor(),
                    (4.0 * rng.random::<f64>()).floor(),
                    rng.random::<f64>().round(),
                )
            })
            .collect();
        let triangles = (0..3 * count).map(|_| std::array::from_fn(|_| rng.random_range(0..count as u32))).collect();
        let mesh = Mesh { vertices, triangles };
        for side in [CadSide::Top, CadSide::Middle, CadSide::Solid] {
            if let Ok(part) = Part::prepare(mesh.clone(), String::new(), &settings(side, 0.7), &RunContext::silent()) {
                let hit = part.face(Side::Bottom).closest(&Point3::new(1.3, 2.1, 0.4), f64::INFINITY).unwrap();
                assert!(hit.normal.iter().all(|c| c.is_finite()) && hit.signed_mm.is_finite());
                part.face(Side::Top).edge_distance_mm(&Point3::origin());
            }
        }
    }
}
