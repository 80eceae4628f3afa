use super::*;
use crate::geometry::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A wavy sheet of `nx` x `ny` cells with open edges.
fn sheet(nx: u32, ny: u32, size: [f64; 2]) -> Mesh {
    let mut mesh = Mesh::default();
    for j in 0..=ny {
        for i in 0..=nx {
            let (x, y) = (size[0] * f64::from(i) / f64::from(nx), size[1] * f64::from(j) / f64::from(ny));
            mesh.vertices.push(Point3::new(x, y, 6.0 * (0.05 * x).sin() * (0.07 * y).cos()));
        }
    }
    for j in 0..ny {
        for i in 0..nx {
            let a = j * (nx + 1) + i;
            mesh.triangles.extend([[a, a + 1, a + nx + 2], [a, a + nx + 2, a + nx + 1]]);
        }
    }
    mesh
}

/// Slivers 45 mm by 0.16 mm and thinner, duplicates, needles, points, zero areas, far from the origin.
fn nasty() -> Mesh {
    let mut mesh = sheet(3, 280, [45.0 * 3.0, 45.0]);
    let add = |mesh: &mut Mesh, corners: [[f64; 3]; 3]| {
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend(corners.map(Point3::from));
        mesh.triangles.push([first, first + 1, first + 2]);
    };
    for k in 0..40 {
        let thin = 10f64.powi(-(k % 14));
        let x = f64::from(k) * 3.0;
        add(&mut mesh, [[x, 0.0, 10.0], [x + 40.0, 1.0, 12.0], [x + 20.0, 0.5 + thin, 11.0]]);
        add(&mut mesh, [[x, 20.0, 15.0], [x, 20.0, 15.0], [x + 7.0, 28.0, 15.0]]);
        add(&mut mesh, [[x, 30.0, -9.0]; 3]);
    }
    mesh.triangles.extend(mesh.triangles.clone().iter().step_by(7));
    let far = Vector3::new(2500.0, -800.0, 400.0);
    mesh.vertices.iter_mut().for_each(|v| *v += far);
    mesh
}

/// An independent judge: closest point by minimising over the edges and, if it falls inside, the plane, in f64 with the normal
/// taken about the corner nearest to the query.
fn brute(mesh: &Mesh, p: &Point3) -> f64 {
    let segment = |a: Point3, b: Point3| {
        let e = b - a;
        let t = if e.norm_squared() > 0.0 { ((p - a).dot(&e) / e.norm_squared()).clamp(0.0, 1.0) } else { 0.0 };
        (p - (a + e * t)).norm()
    };
    let one = |t: usize| {
        let [a, b, c] = mesh.corners(t);
        let around = segment(a, b).min(segment(b, c)).min(segment(c, a));
        let n = (b - a).cross(&(c - a));
        let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
        let height = n.norm() / longest.max(1e-300);
        // Where the triangle is lower than this, its edges are as near as its inside.
        if height < 1e-10 {
            return around;
        }
        let n = n.normalize();
        let inside = [(a, b), (b, c), (c, a)].iter().all(|(s, e)| (e - s).cross(&(p - s)).dot(&n) > 0.0);
        if inside { (p - a).dot(&n).abs() } else { around }
    };
    (0..mesh.triangles.len()).map(one).fold(f64::INFINITY, f64::min)
}

fn near_surface(mesh: &Mesh, count: usize, seed: u64) -> Vec<Point3> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut draw = move || rng.random::<f64>();
    (0..count)
        .map(|k| {
            let t = ((draw() * mesh.triangles.len() as f64) as usize).min(mesh.triangles.len() - 1);
            let [a, b, c] = mesh.corners(t);
            let (u, v) = (1.5 * draw() - 0.25, 1.5 * draw() - 0.25);
            let off = [0.0, 1e-7, 0.1, 5.0, 300.0][k % 5];
            let away = Vector3::new(draw() - 0.5, draw() - 0.5, draw() - 0.5) * off;
            a + (b - a) * u + (c - a) * v + away
        })
        .collect()
}

/// Distances agree with the judge to 1e-9 of the mesh's diagonal, the place lies where it says, and a seed changes nothing.
fn check_closest(mesh: &Mesh, queries: usize) {
    let bvh = Bvh::build(mesh);
    let allowed = 1e-9 * mesh.bounds().unwrap().diagonal();
    for (k, p) in near_surface(mesh, queries, 17).iter().enumerate() {
        let found = bvh.closest(p, f64::INFINITY).unwrap();
        let d = found.distance_sq.sqrt();
        assert!((d - brute(mesh, p)).abs() < allowed, "query {k}: {d} instead of {}", brute(mesh, p));
        assert!(((found.point - p).norm() - d).abs() < allowed);
        let single = Mesh { vertices: mesh.corners(found.triangle as usize).to_vec(), triangles: vec![[0, 1, 2]] };
        assert!(brute(&single, &found.point) < allowed, "the place is on its triangle");
        let seed = (k * 7919 % mesh.triangles.len()) as u32;
        assert_eq!(bvh.closest_seeded(p, f64::INFINITY, seed), Some(found));
        assert_eq!(bvh.closest_seeded(p, f64::INFINITY, found.triangle), Some(found));
        assert_eq!(bvh.closest_seeded(p, f64::INFINITY, u32::MAX), Some(found));
        assert_eq!(bvh.closest(p, d * 1.000_001 + 1e-9), Some(found));
        assert!(d == 0.0 || bvh.closest(p, d * 0.999_999).is_none());
    }
}

#[test]
fn closest_agrees_with_brute_force_on_a_sheet() {
    check_closest(&sheet(40, 30, [250.0, 180.0]), 5000);
}

#[test]
fn closest_agrees_with_brute_force_on_slivers_needles_and_duplicates() {
    check_closest(&nasty(), 5000);
}

#[test]
fn equal_distances_go_to_the_lowest_index() {
    let mut mesh = sheet(20, 20, [100.0, 100.0]);
    mesh.triangles.extend(mesh.triangles.clone());
    let bvh = Bvh::build(&mesh);
    for p in near_surface(&mesh, 500, 5) {
        assert!(bvh.closest(&p, 1e3).unwrap().triangle < 800);
        assert_eq!(bvh.closest_seeded(&p, 1e3, 1599), bvh.closest(&p, 1e3));
    }
}

#[test]
fn odd_queries_and_meshes_give_nothing() {
    let bvh = Bvh::build(&sheet(4, 4, [10.0, 10.0]));
    let p = Point3::new(1.0, 1.0, 1.0);
    assert!(bvh.closest(&Point3::new(f64::NAN, 0.0, 0.0), 1.0).is_none());
    assert!(bvh.closest(&p, f64::NAN).is_none() && bvh.closest(&p, -1.0).is_none());
    assert!(bvh.closest(&Point3::new(1e200, 0.0, 0.0), f64::INFINITY).is_some());
    assert!(bvh.closest(&Point3::new(1e30, -1e30, 0.0), f64::INFINITY).is_some());
    let empty = Bvh::build(&Mesh::default());
    assert!(empty.closest(&p, f64::INFINITY).is_none());
    assert!(empty.ray(&p, &Vector3::z(), 1.0).is_none());
    assert!(bvh.ray(&p, &Vector3::zeros(), 1.0).is_none());
}

#[test]
fn thousands_of_equal_triangles_build_and_answer() {
    let mesh = Mesh {
        vertices: vec![Point3::origin(), Point3::new(1.0, 0.0, 0.0), Point3::new(0.0, 1.0, 0.0)],
        triangles: vec![[0, 1, 2]; 30_000],
    };
    let bvh = Bvh::build(&mesh);
    let found = bvh.closest(&Point3::new(0.2, 0.2, 3.0), f64::INFINITY).unwrap();
    assert_eq!((found.triangle, found.distance_sq), (0, 9.0));
}

#[test]
fn rays_agree_with_brute_force_and_do_not_slip_through() {
    let mesh = sheet(40, 30, [250.0, 180.0]);
    let bvh = Bvh::build(&mesh);
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    for k in 0..4000 {
        let aim = Point3::new(250.0 * rng.random::<f64>(), 180.0 * rng.random::<f64>(), 0.0);
        let origin =
            Point3::new(125.0 + 200.0 * (rng.random::<f64>() - 0.5), 90.0, if k % 2 == 0 { 80.0 } else { -60.0 });
        let direction = aim - origin;
        let brute = (0..mesh.triangles.len())
            .filter_map(|t| {
                let [a, b, c] = mesh.corners(t);
                let n = (b - a).cross(&(c - a));
                let t = (a - origin).dot(&n) / direction.dot(&n);
                let p = origin + direction * t;
                let inside = [(a, b), (b, c), (c, a)].iter().all(|(s, e)| (e - s).cross(&(p - s)).dot(&n) >= -1e-9);
                (inside && t > 0.0).then_some(t)
            })
            .fold(f64::INFINITY, f64::min);
        match bvh.ray(&origin, &direction, 1e9) {
            Some(hit) => assert!((hit.t - brute).abs() < 1e-9),
            None => assert!(brute.is_infinite()),
        }
    }
    // Straight down onto vertices and edges, with two direction components exactly zero.
    for v in &mesh.vertices {
        let inner = v.x > 0.0 && v.x < 250.0 && v.y > 0.0 && v.y < 180.0;
        let hit = bvh.ray(&Point3::new(v.x, v.y, 50.0), &-Vector3::z(), 100.0);
        assert!(!inner || (hit.unwrap().t - (50.0 - v.z)).abs() < 1e-9);
    }
}

#[test]
fn building_does_not_depend_on_the_number_of_threads() {
    let mesh = sheet(160, 100, [250.0, 180.0]);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| Bvh::build(&mesh))
    };
    assert_eq!(with(1).tree, with(3).tree);
    let built = with(2);
    let shape = built.shape();
    assert_eq!(Bvh::try_from_shape(&mesh, &shape), Some(built));
    let mut broken = shape;
    broken.children[0][0] = 0;
    assert!(Bvh::try_from_shape(&mesh, &broken).is_none(), "a node inside itself");
}

#[test]
fn a_tree_serves_a_mesh_that_was_moved_a_little() {
    let mesh = sheet(40, 30, [250.0, 180.0]);
    let mut moved = mesh.clone();
    moved.vertices.iter_mut().for_each(|v| *v += Vector3::new(0.3, 0.2 * v.x.sin(), -1.5));
    let refitted = Bvh::try_from_shape(&moved, &Bvh::build(&mesh).shape()).unwrap();
    let built = Bvh::build(&moved);
    for p in near_surface(&moved, 2000, 3) {
        assert_eq!(refitted.closest(&p, f64::INFINITY), built.closest(&p, f64::INFINITY));
    }
}
