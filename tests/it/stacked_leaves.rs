//! Two leaves of one sheet over each other, as in a channel: what belongs to the leaf behind must not be taken for the one in front.

use super::flat_plate::{HALF_MM, Pattern, local, scan, scatter};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use shapeline::geometry::{Mesh, Point3, Vector3};
use shapeline::measure;
use shapeline::part::{Part, PartSettings};
use shapeline::plan::{CadSide, Side};
use shapeline::run::RunContext;
use shapeline::scan::PointGrid;

const CELL_MM: f64 = 5.0;
const CELLS: usize = 30;
/// The leaf behind lies this much deeper, mm.
const DEEP_MM: f64 = 3.0;
const PER_MM2: f64 = 10.0;
/// The edge of the leaf in front really ends this far beyond the CAD's, mm.
const SHIFT_MM: f64 = 0.3;

/// A leaf at z = 0, a web down from its far end (y), and a leaf behind it that ends at `behind_x`, with or without an opening of 10 mm
/// square under the origin. The outside of the sheet is the outside of the channel.
fn channel(behind_x: f64, opening_behind: bool) -> Part {
    let mut mesh = Mesh::default();
    let mut quad = |corners: [[f64; 3]; 4]| {
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend(corners.map(Point3::from));
        mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    };
    let at = |k: usize| CELL_MM * k as f64 - HALF_MM;
    let behind = |k: usize| if k == CELLS { behind_x } else { at(k) };
    for i in 0..CELLS {
        for j in 0..CELLS {
            let (x, y) = ([at(i), at(i + 1)], [at(j), at(j + 1)]);
            quad([[x[0], y[0], 0.0], [x[1], y[0], 0.0], [x[1], y[1], 0.0], [x[0], y[1], 0.0]]);
            let x = [behind(i), behind(i + 1)];
            let opening = opening_behind && [i, j].iter().all(|k| (CELLS / 2 - 1..=CELLS / 2).contains(k));
            if !opening {
                let z = -DEEP_MM;
                quad([[x[0], y[0], z], [x[0], y[1], z], [x[1], y[1], z], [x[1], y[0], z]]);
            }
        }
        let (up, down) = ([at(i), at(i + 1)], [behind(i), behind(i + 1)]);
        let y = HALF_MM;
        quad([[up[0], y, 0.0], [up[1], y, 0.0], [down[1], y, -DEEP_MM], [down[0], y, -DEEP_MM]]);
    }
    let settings = PartSettings { cad_side: CadSide::Top, thickness_mm: 1.0, plan_directions: Vec::new() };
    Part::prepare(mesh, "00".into(), &settings, &RunContext::silent()).unwrap()
}

/// The edge behind ends with the one in front, or lies nearer to the nominal place in the plane than that does.
#[test]
fn of_edges_over_each_other_the_one_at_the_nominal_height_is_measured() {
    let mut rng = ChaCha8Rng::seed_from_u64(45);
    // The plate's points end at its CAD's edge: moved along by the shift, so does the sheet.
    let mut made = scan(&scatter(Pattern::Lattice, PER_MM2, &mut rng), PER_MM2, |_| true, &mut rng);
    made.cloud.positions.iter_mut().for_each(|p| p.x += SHIFT_MM);
    let grid = PointGrid::build(&made, 1.0);
    for (behind_x, nominal_x) in [(HALF_MM, HALF_MM), (HALF_MM - 1.2, HALF_MM - 1.0)] {
        let part = channel(behind_x, false);
        let local = local(&part, Side::Top, &made, &grid);
        let place = Point3::new(nominal_x, 2.0, 0.0);
        let found = measure::edge(&local, &place, &Vector3::x_axis(), &Vector3::z_axis(), 2.0).unwrap();
        let error = found.deviation_mm - (HALF_MM + SHIFT_MM - nominal_x);
        // Four standard uncertainties of this one seed.
        assert!(error.abs() < 4.0 * found.standard_uncertainty_mm, "{error} {found:?}");
        assert!(found.standard_uncertainty_mm < 0.05, "{found:?}");
    }
}

/// An opening of the leaf behind, a little larger than the hole, changes nothing.
#[test]
fn an_opening_behind_a_hole_does_not_narrow_its_window() {
    let mut rng = ChaCha8Rng::seed_from_u64(46);
    let made = scan(&scatter(Pattern::Lattice, PER_MM2, &mut rng), PER_MM2, |p| p[0].hypot(p[1]) > 4.0, &mut rng);
    let grid = PointGrid::build(&made, 1.0);
    let [alone, over_opening] = [false, true].map(|opening_behind| {
        let part = channel(HALF_MM, opening_behind);
        let local = local(&part, Side::Top, &made, &grid);
        measure::hole(&local, &Point3::origin(), &Vector3::z_axis(), 8.0, 2.0).unwrap()
    });
    assert_eq!(alone, over_opening);
}
