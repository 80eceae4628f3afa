//! Clicks on the simulated bracket, whose features are known exactly.

use super::super::PartSettings;
use super::*;
use crate::geometry::{Mesh, UnitVector3, Vector3};
use crate::plan::CadSide;
use crate::run::RunContext;
use crate::simulate::{BracketParameters, SyntheticPart, bracket};
use std::sync::Arc;

fn picker(mesh: Mesh, cad_side: CadSide) -> Picker {
    let settings = PartSettings { cad_side, thickness_mm: 1.2, plan_directions: Vec::new() };
    let part = super::super::Part::prepare(mesh, String::new(), &settings, &RunContext::silent()).unwrap();
    Picker::new(Arc::new(part))
}

fn sample(cad_side: CadSide) -> (SyntheticPart, Picker) {
    let made = bracket(&BracketParameters::default());
    let mesh = made.mesh.clone();
    (made, picker(mesh, cad_side))
}

const SIDES: [CadSide; 3] = [CadSide::Top, CadSide::Bottom, CadSide::Middle];

/// A look at a place from 20 mm off along a direction, leaned a little: no click is quite square.
fn look(at: &Point3, from: &UnitVector3) -> Ray {
    let aside = from.cross(&Vector3::new(0.3, 0.5, 0.8)).normalize();
    let towards = -(from.into_inner() + aside * 0.1).normalize();
    Ray { origin: at - towards * 20.0, direction: UnitVector3::new_unchecked(towards) }
}

fn degrees(a: &UnitVector3, b: &UnitVector3) -> f64 {
    a.angle(b).to_degrees()
}

#[test]
fn surface_points_lie_where_they_are_clicked_with_the_normal_of_the_cad() {
    for side in SIDES {
        let (made, picker) = sample(side);
        for point in &made.comparison {
            let Geometry::Surface { position, direction } = &point.geometry else { continue };
            for from in [*direction, -*direction] {
                let told = picker.surface_point(&look(position, &from)).unwrap();
                let Geometry::Surface { position: p, direction: d } = &told.geometry else { panic!() };
                // Rounded to 0.0001 mm: half of it off in each of three coordinates. The truth lies on a facet along its own normal, which a
                // ray leaned by 6 degrees meets up to a tenth of their distance (rounding) aside.
                assert!((p - position).norm() < 2e-4, "{side:?} {}: {p} {position}", point.name);
                // Facets of 2.4 mm on crowns and beads of 30 mm radius and more turn by 5 degrees at most from one to the next; smoothed
                // between their corners a fifth of that is left.
                assert!(degrees(d, direction) < 1.0, "{side:?} {}: {:.3}", point.name, degrees(d, direction));
            }
        }
    }
}

#[test]
fn edge_points_snap_to_the_boundary_and_point_outwards() {
    for side in SIDES {
        let (made, picker) = sample(side);
        for point in &made.comparison {
            let Geometry::Edge { position, direction, normal } = &point.geometry else { continue };
            for inwards_mm in [1.5, -1.5] {
                let click = position - direction.into_inner() * inwards_mm;
                let told = picker.edge_point(&look(&click, normal), 3.0).unwrap();
                let Geometry::Edge { position: p, direction: d, normal: n } = &told.geometry else { panic!() };
                // A ray leaned by 6 degrees passes nearest to the edge up to 0.15 mm along it.
                let along = direction.cross(normal);
                let off = p - position;
                assert!(off.dot(&along).abs() < 0.2, "{side:?} {}: {off}", point.name);
                // Across it: the tessellation's sagitta of 0.002 mm and the curve of the edge in 0.2 mm.
                assert!((off - along * off.dot(&along)).norm() < 0.01, "{side:?} {}: {off}", point.name);
                // Beside E06 the facets turn by 2.8 degrees from one row to the next, and the edge is where the next row would begin.
                let off = degrees(d, direction).max(degrees(n, normal));
                assert!(off < 2.8, "{side:?} {}: {off}", point.name);
                // In the sheet's plane it stands square to the edge: vertices 0.002 mm off over the 2 mm that are looked at, and as much of
                // forming.
                assert!(d.dot(&along).abs() < 0.004, "{side:?} {}: {d:?}", point.name);
                assert!(d.dot(n).abs() < 1e-9);
            }
        }
    }
}

#[test]
fn holes_and_slots_are_fitted_to_their_rims() {
    for side in SIDES {
        let (made, picker) = sample(side);
        let features = made.features.iter().map(|f| (&f.name, &f.geometry));
        for (name, truth) in features.chain(made.comparison.iter().map(|p| (&p.name, &p.geometry))) {
            let (centre, axis, clicks) = match truth {
                Geometry::Hole { centre, axis, diameter_mm, .. } => {
                    let aside = axis.cross(&Vector3::new(0.9, 0.1, 0.2)).normalize();
                    (centre, axis, [0.0, 0.5 * diameter_mm + 1.0].map(|r| centre + aside * r))
                }
                Geometry::Slot { centre, axis, direction, width_mm, .. } => {
                    let aside = axis.cross(direction) * (0.5 * width_mm + 1.0);
                    (centre, axis, [*centre, centre + aside])
                }
                _ => continue,
            };
            for click in clicks {
                let told = picker.hole_or_slot(&look(&click, axis), 2.0).unwrap();
                assert_eq!(told.geometry.kind(), truth.kind(), "{side:?} {name}");
                // Rims are tessellated to 0.001 mm with their vertices on the curve; the pads are flat, those of flanges bent by less.
                assert!((told.geometry.position() - centre).norm() < 0.005, "{side:?} {name}: {:?}", told.geometry);
                match (&told.geometry, truth) {
                    (Geometry::Hole { axis: a, diameter_mm: d, .. }, Geometry::Hole { diameter_mm, .. }) => {
                        assert!(
                            (d - diameter_mm).abs() < 0.005 && degrees(a, axis) < 0.1,
                            "{side:?} {name}: {d} {a:?}"
                        );
                    }
                    (
                        Geometry::Slot { axis: a, direction: along, length_mm: l, width_mm: w, .. },
                        Geometry::Slot { direction, length_mm, width_mm, .. },
                    ) => {
                        let turn = degrees(along, direction).min(degrees(&-*along, direction));
                        assert!((l - length_mm).abs() < 0.005 && (w - width_mm).abs() < 0.005, "{l} {w}");
                        assert!(turn < 0.02 && degrees(a, axis) < 0.1, "{turn}");
                    }
                    _ => panic!("{name}"),
                }
                assert!(told.off_mm < 0.01, "{name}: {}", told.off_mm);
            }
        }
    }
}

#[test]
fn where_nothing_fits_words_say_why() {
    let (made, picker) = sample(CadSide::Top);
    let up = Vector3::z_axis();
    let past = look(&Point3::new(500.0, 0.0, 0.0), &up);
    assert_eq!(picker.surface_point(&past), Err(NoProposal::PastThePart));
    let slot = made.features.iter().find(|f| f.name == "S1").unwrap().geometry.position();
    let not_round = picker.hole(&look(&slot, &up), 2.0).unwrap_err();
    assert!(not_round.to_string().starts_with("the opening of 30.0") && !not_round.help().is_empty(), "{not_round}");
    let hole = made.features.iter().find(|f| f.name == "H1").unwrap().geometry.position();
    assert!(matches!(picker.slot(&look(&hole, &up), 2.0), Err(NoProposal::Round { .. })));
    let middle = look(&Point3::new(40.0, 5.0, 3.7), &up);
    assert!(matches!(picker.hole(&middle, 2.0), Err(NoProposal::OpeningTooFar { nearest_mm }) if nearest_mm > 2.0));
    assert!(matches!(picker.edge_point(&middle, 2.0), Err(NoProposal::EdgeTooFar { nearest_mm }) if nearest_mm > 2.0));
}

/// A plate of 100 x 60 mm with a rectangular opening of 30 x 20 mm, in the plane z = 0.
fn plate() -> Mesh {
    let xs = [0.0, 30.0, 60.0, 100.0];
    let ys = [0.0, 20.0, 40.0, 60.0];
    let mut mesh = Mesh::default();
    mesh.vertices.extend(ys.iter().flat_map(|y| xs.iter().map(|x| Point3::new(*x, *y, 0.0))));
    for (i, j) in (0..3u32).flat_map(|i| (0..3u32).map(move |j| (i, j))).filter(|cell| *cell != (1, 1)) {
        let a = 4 * j + i;
        mesh.triangles.extend([[a, a + 1, a + 5], [a, a + 5, a + 4]]);
    }
    mesh
}

#[test]
fn corners_and_square_openings_are_refused() {
    let picker = picker(plate(), CadSide::Top);
    let up = Vector3::z_axis();
    let straight = |x, y| Ray { origin: Point3::new(x, y, 20.0), direction: -up };
    let told = picker.edge_point(&straight(100.5, 33.0), 1.0).unwrap();
    let expected = Geometry::Edge { position: Point3::new(100.0, 33.0, 0.0), direction: Vector3::x_axis(), normal: up };
    assert_eq!(told.geometry, expected);
    // Two millimetres of the rim are looked at; the corner is 0.5 mm off.
    assert!(
        matches!(picker.edge_point(&straight(99.8, 0.5), 1.0), Err(NoProposal::Corner { degrees }) if degrees > 89.0)
    );
    assert!(matches!(picker.hole(&straight(45.0, 30.0), 1.0), Err(NoProposal::NotRound { .. })));
    assert!(
        matches!(picker.hole_or_slot(&straight(45.0, 30.0), 1.0), Err(NoProposal::NoSlot { off_mm, .. }) if off_mm > 1.0)
    );
    let rim = picker.edge_point(&straight(45.0, 20.4), 1.0).unwrap();
    let expected = Geometry::Edge { position: Point3::new(45.0, 20.0, 0.0), direction: Vector3::y_axis(), normal: up };
    assert_eq!(rim.geometry, expected);
}

/// What lies behind the surface that is clicked is not taken, however near it looks.
#[test]
fn an_edge_behind_the_surface_is_not_taken() {
    let mut mesh = plate();
    // A second plate 60 mm behind, its edge under the middle of the first one's left part.
    let first = mesh.vertices.len() as u32;
    mesh.vertices
        .extend([[15.0, -5.0], [15.0, 65.0], [-40.0, 65.0], [-40.0, -5.0]].map(|[x, y]| Point3::new(x, y, -60.0)));
    mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    let picker = picker(mesh, CadSide::Top);
    let ray = Ray { origin: Point3::new(14.0, 30.0, 20.0), direction: -Vector3::z_axis() };
    let Ok(told) = picker.edge_point(&ray, 15.0) else { panic!() };
    // Its own left edge 14 mm off, in sight; the hidden one is 1 mm off.
    assert_eq!(told.geometry.position(), Point3::new(0.0, 30.0, 0.0));
}

/// What was turned round against the CAD stays so where it is dragged to.
#[test]
fn a_shape_that_is_dragged_stays_turned_as_it_was() {
    for side in SIDES {
        let (made, picker) = sample(side);
        let of_kind = |kind: &str| {
            let points = made.comparison.iter().map(|p| &p.geometry).chain(made.features.iter().map(|f| &f.geometry));
            points.filter(|g| g.kind() == kind).cloned().collect::<Vec<_>>()
        };
        for kind in ["surface", "edge", "hole", "slot"] {
            let all = of_kind(kind);
            let (from, to) = (&all[0], all.last().unwrap());
            let ray = look(&to.position(), &UnitVector3::new_normalize(to.sheet_normal()));
            let told = picker.again(from, &ray, 3.0).unwrap().geometry;
            assert_eq!(told.kind(), kind);
            // Places as in the tests of each kind; an edge's along the edge, too: the lean of the look.
            assert!((told.position() - to.position()).norm() < 0.2, "{side:?} {kind} {told:?}");
            assert!(told.sheet_normal().dot(&to.sheet_normal()) > 0.99, "{side:?} {kind}");
            let turned = picker.again(&against(from), &ray, 3.0).unwrap().geometry;
            let expected = against(&told);
            assert!((turned.sheet_normal() - expected.sheet_normal()).norm() < 1e-12, "{side:?} {kind}");
            if let (Geometry::Edge { direction: a, .. }, Geometry::Edge { direction: b, .. }) = (&turned, &expected) {
                assert!((a.into_inner() - b.into_inner()).norm() < 1e-12);
            }
        }
    }
}

/// The other side of the sheet; of an edge, into it as well.
fn against(shape: &Geometry) -> Geometry {
    match shape.clone() {
        Geometry::Surface { position, direction } => Geometry::Surface { position, direction: -direction },
        Geometry::Edge { position, direction, normal } => {
            Geometry::Edge { position, direction: -direction, normal: -normal }
        }
        Geometry::Hole { centre, axis, diameter_mm, direction } => {
            Geometry::Hole { centre, axis: -axis, diameter_mm, direction }
        }
        Geometry::Slot { centre, axis, direction, length_mm, width_mm } => {
            Geometry::Slot { centre, axis: -axis, direction, length_mm, width_mm }
        }
    }
}

#[test]
fn the_piece_of_an_edge_goes_as_far_as_asked_and_round_corners() {
    let picker = picker(plate(), CadSide::Top);
    let length = |piece: &[Point3]| piece.windows(2).map(|w| (w[1] - w[0]).norm()).sum::<f64>();
    let piece = picker.edge_piece(&Point3::new(100.0, 33.0, 0.1), 5.0);
    assert!((length(&piece) - 10.0).abs() < 1e-9 && piece.iter().all(|p| p.x == 100.0), "{piece:?}");
    let ends = [piece[0].y, piece.last().unwrap().y];
    assert!((ends[0] - ends[1]).abs() > 9.999 && piece.iter().any(|p| p.y == 33.0), "{ends:?}");
    // Two millimetres before a corner, five are gone: three of them along the other side.
    let piece = picker.edge_piece(&Point3::new(98.0, 60.0, 0.0), 5.0);
    assert!((length(&piece) - 10.0).abs() < 1e-9);
    assert!(piece.contains(&Point3::new(100.0, 60.0, 0.0)) && piece.iter().any(|p| p.y == 57.0), "{piece:?}");
    // A rim of 100 mm is gone around once, no further.
    assert!((length(&picker.edge_piece(&Point3::new(45.0, 20.0, 0.0), 500.0)) - 100.0).abs() < 1e-9);
}
