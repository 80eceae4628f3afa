//! Bodies of points on rectangles.

use super::*;
use crate::geometry::PointCloud;
use crate::scan::{PointClass, Removed};
use rand::{RngExt, SeedableRng};

/// Points at random, two a mm², on rectangles (x0, x1, y0, y1), without those of the discs (x, y, radius).
fn scan(rectangles: &[[f64; 4]], blots: &[[f64; 3]]) -> ConditionedScan {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
    let mut positions = Vec::new();
    for [x0, x1, y0, y1] in rectangles {
        for _ in 0..(2.0 * (x1 - x0) * (y1 - y0)) as usize {
            let p = Point3::new(rng.random_range(*x0..*x1), rng.random_range(*y0..*y1), rng.random_range(0.0..0.3));
            if blots.iter().all(|[x, y, r]| (p.x - x).hypot(p.y - y) > *r) {
                positions.push(p);
            }
        }
    }
    ConditionedScan {
        classes: vec![PointClass::Kept; positions.len()],
        kept: (0..positions.len() as u32).collect(),
        cloud: PointCloud { positions, ..PointCloud::default() },
        removed: Removed::default(),
        belt: None,
        belt_clearance_mm: None,
        to_camera: Some(Vector3::z_axis()),
        spacing_mm: 0.5f64.sqrt(),
        warnings: Vec::new(),
    }
}

fn hints() -> ScanHints {
    ScanHints { view_direction: None, part_extents_mm: [120.0, 60.0, 5.0], part_area_mm2: 7200.0, thickness_mm: 1.0 }
}

#[test]
fn two_parts_five_millimetres_apart_are_two_bodies_and_touching_ones_are_one() {
    let two = scan(&[[0.0, 120.0, 0.0, 60.0], [0.0, 120.0, 65.0, 125.0]], &[]);
    let bodies = Bodies::find(&two, &hints());
    assert_eq!(bodies.list.len(), 2);
    assert!(!bodies.can_be_one_part(&[true, true], &hints()) && bodies.can_be_one_part(&[false, true], &hints()));
    assert_eq!(bodies.groups(&hints()).len(), 2);
    let below = bodies.kept_of(&bodies.list.iter().map(|b| b.middle.y < 60.0).collect::<Vec<_>>());
    assert_eq!(below.len(), 14_400);
    assert!(below.iter().all(|&k| two.cloud.positions[k as usize].y <= 60.0));
    let touching = scan(&[[0.0, 120.0, 0.0, 60.0], [0.0, 120.0, 60.5, 120.5]], &[]);
    let bodies = Bodies::find(&touching, &hints());
    assert_eq!(bodies.list.len(), 1);
    assert!(!bodies.can_be_one_part(&[true], &hints()));
}

/// A blot of 70 mm goes right across one part; beside it lies a whole one, nearer than the blot is wide, and a small box.
#[test]
fn a_blot_across_a_part_leaves_it_one_group_and_a_box_is_another() {
    let parts = [[0.0, 120.0, 0.0, 60.0], [0.0, 120.0, 70.0, 130.0], [140.0, 150.0, 0.0, 10.0]];
    let seen = scan(&parts, &[[60.0, 30.0, 35.0]]);
    let bodies = Bodies::find(&seen, &hints());
    assert_eq!(bodies.list.len(), 4);
    let groups = bodies.groups(&hints());
    let of: Vec<Vec<usize>> = groups.iter().map(|g| (0..4).filter(|&k| g[k]).collect()).collect();
    // Largest first: the whole part is body 0, the halves 1 and 2, the box 3.
    assert_eq!(of[0], [0]);
    assert_eq!(of.iter().map(Vec::len).collect::<Vec<_>>(), [1, 2, 1], "{of:?}");
    assert!(of[1] == [1, 2] && of[2] == [3], "{of:?}");
    assert!(bodies.reach_the_border(&seen, &groups[2]) && !bodies.reach_the_border(&seen, &[false; 4]));
}

#[test]
fn points_at_two_thirds_of_the_density_are_one_piece_and_sparse_noise_is_no_bridge() {
    let mut sparse = scan(&[[0.0, 120.0, 0.0, 60.0]], &[]);
    sparse.spacing_mm *= (2.0f64 / 3.0).sqrt();
    assert_eq!(Bodies::find(&sparse, &hints()).list.len(), 1);
    let mut noisy = scan(&[[0.0, 120.0, 0.0, 60.0], [0.0, 120.0, 65.0, 125.0]], &[]);
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(6);
    // A tenth of the sheet's density in the gap.
    for _ in 0..120 {
        noisy.kept.push(noisy.cloud.positions.len() as u32);
        noisy.cloud.positions.push(Point3::new(rng.random_range(0.0..120.0), rng.random_range(60.0..65.0), 0.0));
    }
    assert_eq!(Bodies::find(&noisy, &hints()).list.len(), 2);
}
