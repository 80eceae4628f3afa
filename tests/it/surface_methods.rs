//! The two ways of telling a surface point, on a dome whose points lie exactly on it: heights above the CAD know of its bend, a plane
//! through the points does not.

use crate::flat_plate::{Pattern, local, scatter};
use crate::support::seen_from_above;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use shapeline::geometry::{Mesh, Point3, UnitVector3, Vector3};
use shapeline::measure::{Card, SurfaceFound, surface_with_card};
use shapeline::part::{Part, PartSettings};
use shapeline::plan::{CadSide, Side, SurfaceFit, SurfaceMethod};
use shapeline::run::RunContext;
use shapeline::scan::{ConditionedScan, PointGrid};

const RADIUS_MM: f64 = 100.0;
/// The part stands this far above its CAD.
const RAISED_MM: f64 = 0.2;

/// The top of a sphere, 60 mm wide, in cells of 0.5 mm: facets are 0.0003 mm off it.
fn dome() -> Part {
    const CELLS: u32 = 120;
    let mut mesh = Mesh::default();
    for k in 0..(CELLS + 1) * (CELLS + 1) {
        let at = |i: u32| 0.5 * f64::from(i) - 30.0;
        let (x, y) = (at(k % (CELLS + 1)), at(k / (CELLS + 1)));
        mesh.vertices.push(Point3::new(x, y, height_mm(x, y)));
    }
    for k in 0..CELLS * CELLS {
        let a = k / CELLS * (CELLS + 1) + k % CELLS;
        let b = a + CELLS + 1;
        mesh.triangles.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
    }
    let settings = PartSettings { cad_side: CadSide::Top, thickness_mm: 1.0, plan_directions: Vec::new() };
    Part::prepare(mesh, "00".into(), &settings, &RunContext::silent()).unwrap()
}

fn height_mm(x: f64, y: f64) -> f64 {
    (RADIUS_MM * RADIUS_MM - x * x - y * y).sqrt() - RADIUS_MM
}

/// Points on the raised dome, seen from above, without noise.
fn scan(density: f64) -> ConditionedScan {
    let mut rng = ChaCha8Rng::seed_from_u64(8100);
    let places = scatter(Pattern::Lattice, density, &mut rng);
    let on_dome = places.iter().filter(|p| p[0].abs() < 29.0 && p[1].abs() < 29.0);
    let positions: Vec<Point3> = on_dome.map(|p| Point3::new(p[0], p[1], height_mm(p[0], p[1]) + RAISED_MM)).collect();
    seen_from_above(positions, density.sqrt().recip())
}

fn measured(how: &SurfaceFit, card: &mut Card) -> SurfaceFound {
    let (part, scan) = (dome(), scan(26.0));
    let grid = PointGrid::build(&scan, 1.0);
    let local = local(&part, Side::Top, &scan, &grid);
    let up = UnitVector3::new_unchecked(Vector3::z());
    surface_with_card(&local, &Point3::origin(), &up, 3.0, how, card).expect("a dome without noise")
}

/// The mean of `r² / 2R` over a disc is `radius² / 4R`: 0.09 mm for 6 mm, 0.0056 mm for 1.5 mm. A disc of 700 or 180 points of a
/// jittered lattice is met to a few percent of that.
#[test]
fn a_plane_is_off_by_the_bend_and_heights_above_the_cad_are_not() {
    for radius_mm in [1.5, 6.0] {
        let how = |method| SurfaceFit { method, radius_mm: Some(radius_mm) };
        let plane = measured(&how(SurfaceMethod::Plane), &mut Card::default());
        let bend_mm = radius_mm * radius_mm / (4.0 * RADIUS_MM);
        let off_mm = RAISED_MM - plane.deviation_mm;
        assert!((off_mm - bend_mm).abs() < 0.1 * bend_mm, "{radius_mm}: {off_mm} instead of {bend_mm}");
        let local = measured(&how(SurfaceMethod::Local), &mut Card::default());
        assert!((local.deviation_mm - RAISED_MM).abs() < 1e-3, "{radius_mm}: {}", local.deviation_mm);
        assert_eq!((plane.window_mm, local.window_mm), (radius_mm, radius_mm));
    }
}

#[test]
fn the_card_tells_what_the_value_rests_on() {
    let mut card = Card::default();
    let found = measured(&SurfaceFit::default(), &mut card);
    assert_eq!((card.window_mm, card.normal), (Some(found.window_mm), Some(found.normal)));
    // 26 points a mm², 0.196 mm apart; all around; the nearest edge is the dome's own, 30 mm away and a little down.
    assert!((card.spacing_mm.unwrap() - 0.196).abs() < 0.005, "{card:?}");
    assert_eq!(card.covered, Some(1.0));
    assert!((card.cad_edge_mm.unwrap() - 30.3).abs() < 0.3, "{card:?}");
    assert!(card.gates.len() >= 6 && card.gates.iter().all(|g| g.passed()), "{card:?}");
    // The plan's window.
    let mut of_plan = Card::default();
    measured(&SurfaceFit { method: SurfaceMethod::Local, radius_mm: Some(2.5) }, &mut of_plan);
    assert_eq!(of_plan.window_mm, Some(2.5));
}
