//! Parts that are hard to align: nearly symmetric, nearly round, or truly symmetric.

use super::blank::{Corner, FlatMesh, Opening, Uv, UvVector, filleted, square_lattice, subdivided, triangulate};
use super::forming::{Bead, Flange, Forming, ProfilePiece, Revolved};
use super::part::{SyntheticPart, edge_geometry, opening_geometry, surface_geometry};

/// A rail of about 300 x 44 mm with a shallow profile: it looks the same after half a turn, but for one hole of 7 mm.
///
/// Features H1 and A1 at one end and the middle, slot S1 towards the other end, six comparison points.
pub fn rail() -> SyntheticPart {
    let outline = rectangle(150.0, 22.0, 6.0);
    let slot =
        |u: f64| Opening::Slot { centre: Uv::new(u, 0.0), direction: UvVector::x(), length_mm: 20.0, width_mm: 8.0 };
    let hole = |u: f64, v: f64, diameter_mm: f64| Opening::Hole { centre: Uv::new(u, v), diameter_mm };
    let openings = [hole(-125.0, 0.0, 10.0), slot(75.0), hole(125.0, 0.0, 10.0), slot(-75.0), hole(95.0, 14.0, 7.0)];
    let beads = [-1.0, 1.0].map(|s| Bead {
        ends: [Uv::new(-40.0, 9.0 * s), Uv::new(40.0, -9.0 * s)],
        half_width_mm: 9.0,
        height_mm: 2.5,
    });
    let forming = Forming { beads: beads.into(), ..flat_forming() };
    let mut part = SyntheticPart::form("rail", &blank(&outline, &openings, 1.5), &forming, 1.0);
    part.add_feature("H1", opening_geometry(&forming, &openings[0], None));
    part.add_feature("S1", opening_geometry(&forming, &openings[1], None));
    part.add_feature("A1", surface_geometry(&forming, &Uv::new(-60.0, 16.0)));
    part.add_comparison("P01", surface_geometry(&forming, &Uv::new(-100.0, -12.0)), 0.5);
    part.add_comparison("P02", surface_geometry(&forming, &Uv::new(55.0, 13.0)), 0.5);
    part.add_comparison("E01", edge_geometry(&forming, &outline[1].at, &outline[2].at, 0.5), 0.7);
    part.add_comparison("E02", edge_geometry(&forming, &outline[2].at, &outline[3].at, 0.5), 0.7);
    part.add_comparison("C01", opening_geometry(&forming, &openings[4], Some(UvVector::x())), 0.3);
    part.add_comparison("C02", opening_geometry(&forming, &openings[2], Some(UvVector::y())), 0.3);
    part.put_surface_points_on_facets(1.0);
    part
}

/// A deep round cover: rim diameter about 160 mm, depth 35 mm, a tab on the rim and off-centre openings in the top.
///
/// The top is level and points up, the wall falls at 60 degrees. Features H1, S1 (top) and A1 (rim).
pub fn cover() -> SyntheticPart {
    let turn = 60f64.to_radians();
    let arc = |radius_mm: f64, turn_rad: f64| ProfilePiece { length_mm: radius_mm * turn, turn_rad };
    // Depth: two arcs of 8 mm fall 8 mm together, the straight wall the other 27 mm.
    let wall = ProfilePiece { length_mm: 27.0 / turn.sin(), turn_rad: 0.0 };
    let sheet = Revolved { level_radius_mm: 42.0, profile: vec![arc(8.0, -turn), wall, arc(8.0, turn)] };
    let developed = 42.0 + 2.0 * 8.0 * turn + wall.length_mm;
    let rim_radius = developed + 8.0;
    let outline = round_with_tab(rim_radius, 9.0, 7.0);
    let hole = |u: f64, v: f64, diameter_mm: f64| Opening::Hole { centre: Uv::new(u, v), diameter_mm };
    let openings = [
        hole(20.0, 14.0, 12.0),
        Opening::Slot {
            centre: Uv::new(-16.0, -14.0),
            direction: UvVector::new(0.8, 0.6),
            length_mm: 20.0,
            width_mm: 7.0,
        },
        hole(-18.0, 20.0, 8.0),
    ];
    let mut rims = vec![outline.clone()];
    rims.extend(openings.iter().map(|o| o.rim(0.001)));
    let flat = triangulate(&rims, &rings(rim_radius, 42.0, &[8.0 * turn, wall.length_mm, 8.0 * turn, 12.0]))
        .expect("the cover's rims keep away from each other");
    let mut part = SyntheticPart::form("cover", &flat, &sheet, 1.0);
    part.add_feature("H1", opening_geometry(&sheet, &openings[0], None));
    part.add_feature("S1", opening_geometry(&sheet, &openings[1], None));
    part.add_feature("A1", surface_geometry(&sheet, &Uv::new(0.72 * (rim_radius - 4.0), -0.694 * (rim_radius - 4.0))));
    part.add_comparison("P01", surface_geometry(&sheet, &Uv::new(0.0, 0.0)), 0.5);
    part.add_comparison("P02", surface_geometry(&sheet, &Uv::new(-0.5 * (42.0 + developed), 0.0)), 0.5);
    part.add_comparison("P03", surface_geometry(&sheet, &Uv::new(0.0, rim_radius - 4.0)), 0.5);
    part.add_comparison("C01", opening_geometry(&sheet, &openings[2], Some(UvVector::x())), 0.3);
    let tab = outline.len() - 1;
    part.add_comparison("E01", edge_geometry(&sheet, &outline[tab], &outline[0], 0.5), 0.7);
    part.put_surface_points_on_facets(1.0);
    part
}

/// Thickness of the hemmed part's sheet.
pub const HEMMED_THICKNESS_MM: f64 = 0.8;

/// A plate of about 120 x 90 mm whose sheet comes near itself: at its right a hem, turned back over the plate with `gap_mm` between
/// the leaves; in front a groove with walls of 70 degrees, four millimetres apart, and a level rim beyond it.
///
/// Features H1, S1, A1 on the plate. Comparison points: P01 and E01, C01 on the plate, P02 under the hem's leaf, P03 on the leaf
/// (its CAD normal looks down, into the hem), E02 the leaf's trimmed edge, W01 and W02 on the groove's walls, P04 and E03 beyond it.
pub fn hemmed(gap_mm: f64) -> SyntheticPart {
    let (up, turn) = (std::f64::consts::PI, 70f64.to_radians());
    let bend = |radius_mm: f64, turn_rad: f64| ProfilePiece { length_mm: radius_mm * turn_rad.abs(), turn_rad };
    let straight = |length_mm: f64| ProfilePiece { length_mm, turn_rad: 0.0 };
    let (hem_bend, wall_mm, radius_mm) = (bend(0.5 * gap_mm, up), 5.0, 1.0);
    let hem = Flange::new(60.0, 0.0, vec![hem_bend]);
    let walls = [bend(radius_mm, -turn), straight(wall_mm), bend(radius_mm, 2.0 * turn), straight(wall_mm)];
    let groove = Flange::new(25.0, -0.5 * up, walls.into_iter().chain([bend(radius_mm, -turn)]).collect());
    let groove_mm: f64 = groove.profile.iter().map(|p| p.length_mm).sum();
    let leaf_end = 60.0 + hem_bend.length_mm + 14.0;
    let front = -(25.0 + groove_mm + 12.0);
    let outline = [
        Corner::new(-60.0, front, 5.0),
        Corner::new(48.0, front, 8.0),
        Corner::new(48.0, -18.0, 2.0),
        Corner::new(leaf_end, -18.0, 1.0),
        Corner::new(leaf_end, 34.0, 1.0),
        Corner::new(52.0, 34.0, 2.0),
        Corner::new(40.0, 46.0, 6.0),
        Corner::new(-60.0, 40.0, 10.0),
    ];
    let hole = |u: f64, v: f64, diameter_mm: f64| Opening::Hole { centre: Uv::new(u, v), diameter_mm };
    let slot = Opening::Slot { centre: Uv::new(22.0, -12.0), direction: UvVector::x(), length_mm: 16.0, width_mm: 7.0 };
    let openings = [hole(-48.0, 26.0, 10.0), slot, hole(-10.0, 22.0, 12.0), hole(20.0, 30.0, 6.0)];
    let flanges = vec![hem, groove];
    let bent = |q: &Uv| flanges.iter().any(|f| f.is_curved_at(q, 0.3));
    let mut rims = vec![subdivided(&filleted(&outline, 0.002), |q| if bent(q) { 0.1 } else { 1.5 })];
    rims.extend(openings.iter().map(|o| o.rim(0.001)));
    let mut lattice = square_lattice(Uv::new(-60.0, -25.0), Uv::new(60.0, 46.0), 1.5);
    lattice.retain(|(q, _)| flanges.iter().all(|f| f.beyond_mm(q) < -0.7));
    for flange in &flanges {
        lattice.extend(bend_rows(flange, 65.0, 16.0));
    }
    let flat = triangulate(&rims, &lattice).expect("the part's rims keep away from each other");
    let forming = Forming { flanges, ..flat_forming() };
    let mut part = SyntheticPart::form("hemmed plate", &flat, &forming, HEMMED_THICKNESS_MM);
    part.add_feature("H1", opening_geometry(&forming, &openings[0], None));
    part.add_feature("S1", opening_geometry(&forming, &openings[1], None));
    part.add_feature("A1", surface_geometry(&forming, &Uv::new(-45.0, -15.0)));
    let [hem, groove] = [&forming.flanges[0], &forming.flanges[1]];
    let wall = |s: f64, k: usize| {
        groove.place(s, groove.profile[..k].iter().map(|p| p.length_mm).sum::<f64>() + 0.5 * wall_mm)
    };
    let leaf = hem_bend.length_mm + 7.0;
    for (name, q) in [
        ("P01", Uv::new(0.0, 0.0)),
        ("P02", Uv::new(52.0, 8.0)),
        ("P03", hem.place(8.0, leaf)),
        ("P04", groove.place(10.0, groove_mm + 6.0)),
        ("W01", wall(0.0, 1)),
        ("W02", wall(0.0, 3)),
    ] {
        part.add_comparison(name, surface_geometry(&forming, &q), 0.5);
    }
    for (name, side) in [("E01", 7), ("E02", 3), ("E03", 0)] {
        let (a, b) = (outline[side].at, outline[(side + 1) % outline.len()].at);
        part.add_comparison(name, edge_geometry(&forming, &a, &b, 0.5), 0.7);
    }
    part.add_comparison("C01", opening_geometry(&forming, &openings[2], Some(UvVector::x())), 0.3);
    part.put_surface_points_on_facets(0.1);
    part
}

/// Vertices along a flange: rows 0.1 rad apart where it bends, 1.5 mm elsewhere, `half_mm` to either side and until `beyond_mm`
/// after the last bend.
fn bend_rows(flange: &Flange, half_mm: f64, beyond_mm: f64) -> Vec<(Uv, f64)> {
    let mut rows = vec![(0.0, 0.1)];
    let mut from = 0.0;
    for piece in flange.profile.iter().chain([&ProfilePiece { length_mm: beyond_mm, turn_rad: 0.0 }]) {
        let steps = (piece.turn_rad.abs() / 0.1).max(piece.length_mm / 1.5).ceil();
        let clear = if piece.turn_rad == 0.0 { 0.6 } else { 0.1 };
        rows.extend((1..=steps as usize).map(|k| (from + piece.length_mm * k as f64 / steps, clear)));
        from += piece.length_mm;
    }
    let across = (half_mm / 1.5) as i64;
    let row = |(w, clear): (f64, f64)| (-across..=across).map(move |k| (flange.place(1.5 * k as f64, w), clear));
    rows.into_iter().flat_map(row).collect()
}

/// A flat plate of 200 x 100 mm that is the same after half a turn: an alignment cannot tell the two and must say so.
pub fn symmetric_plate() -> SyntheticPart {
    let outline = rectangle(100.0, 50.0, 8.0);
    let pairs = [(-70.0, 25.0, 14.0), (-60.0, -30.0, 9.0), (-20.0, 10.0, 20.0)];
    let openings: Vec<Opening> = pairs
        .iter()
        .flat_map(|(u, v, diameter_mm)| {
            [1.0, -1.0].map(|s| Opening::Hole { centre: Uv::new(s * u, s * v), diameter_mm: *diameter_mm })
        })
        .collect();
    let forming = flat_forming();
    let mut part = SyntheticPart::form("symmetric plate", &blank(&outline, &openings, 3.0), &forming, 1.2);
    part.add_comparison("P01", surface_geometry(&forming, &Uv::new(40.0, 30.0)), 0.5);
    part.add_comparison("E01", edge_geometry(&forming, &outline[1].at, &outline[2].at, 0.5), 0.7);
    part.add_comparison("C01", opening_geometry(&forming, &openings[0], Some(UvVector::x())), 0.3);
    part
}

fn flat_forming() -> Forming {
    Forming {
        crown_mm: 0.0,
        crown_centre: Uv::origin(),
        crown_width_mm: [1.0, 1.0],
        flanges: Vec::new(),
        pads: Vec::new(),
        beads: Vec::new(),
    }
}

fn rectangle(half_u: f64, half_v: f64, radius_mm: f64) -> [Corner; 4] {
    [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(a, b)| Corner::new(a * half_u, b * half_v, radius_mm))
}

fn blank(outline: &[Corner], openings: &[Opening], spacing_mm: f64) -> FlatMesh {
    let mut rims = vec![subdivided(&filleted(outline, 0.002), |_| spacing_mm)];
    rims.extend(openings.iter().map(|o| o.rim(0.001)));
    let reach = outline.iter().map(|c| c.at.x.abs().max(c.at.y.abs())).fold(0.0, f64::max);
    triangulate(&rims, &square_lattice(Uv::new(-reach, -reach), Uv::new(reach, reach), spacing_mm))
        .expect("the part's rims keep away from each other")
}

/// A circle with a straight-ended tab of this half width and length at angle 0; the last side is the tab's end.
fn round_with_tab(radius: f64, half_width: f64, length: f64) -> Vec<Uv> {
    let opening = (half_width / radius).asin();
    let steps = 400;
    let arc = (0..=steps).map(|k| opening + (std::f64::consts::TAU - 2.0 * opening) * k as f64 / steps as f64);
    let mut outline = vec![Uv::new(radius + length, half_width)];
    outline.extend(arc.map(|a| Uv::new(radius * a.cos(), radius * a.sin())));
    outline.push(Uv::new(radius + length, -half_width));
    outline
}

/// Rings of vertices: 3 mm apart where the sheet is straight, 0.55 mm in the arcs (5 um of sag on 8 mm radius).
fn rings(rim_radius: f64, level_radius: f64, lengths: &[f64]) -> Vec<(Uv, f64)> {
    let mut radii: Vec<f64> = (1..14).map(|k| level_radius * k as f64 / 14.0).collect();
    let mut from = level_radius;
    for (k, length) in lengths.iter().enumerate() {
        let steps = (length / if k == 0 || k == 2 { 0.55 } else { 3.0 }).ceil() as usize;
        radii.extend((0..steps).map(|s| from + length * s as f64 / steps as f64));
        from += length;
    }
    let mut points = vec![(Uv::origin(), 1.0)];
    for (k, radius) in radii.iter().enumerate() {
        let n = ((std::f64::consts::TAU * radius / 3.0) as usize).max(8);
        let start = if radius < &level_radius { 0.1 * k as f64 } else { 0.0 };
        let n = if radius < &level_radius { n } else { (std::f64::consts::TAU * rim_radius / 3.0) as usize };
        points.extend((0..n).map(|i| {
            let angle = start + std::f64::consts::TAU * i as f64 / n as f64;
            (Uv::new(radius * angle.cos(), radius * angle.sin()), 0.8)
        }));
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Point3, Vector3};
    use crate::plan::Geometry;
    use crate::simulate::caster::Caster;

    #[test]
    fn rail_differs_from_its_half_turn_by_one_hole() {
        let part = rail();
        let caster = Caster::new(&part.mesh);
        let Geometry::Hole { centre, .. } = part.comparison[4].geometry else { panic!("C01 is a hole") };
        let mut elsewhere = 0;
        let mut at_hole = 0;
        for t in 0..part.mesh.triangles.len() {
            let [a, b, c] = part.mesh.corners(t);
            let p = Point3::from((a.coords + b.coords + c.coords) / 3.0);
            let above = Point3::new(-p.x, -p.y, 50.0);
            let hit = caster.first(&above, &-Vector3::z(), 0.0, 100.0);
            // Facets of 1.5 mm on the bead's tightest curve (radius 8 mm) stand 0.035 mm off it.
            if hit.is_none_or(|h| (50.0 - h.t - p.z).abs() > 0.07) {
                let near = (p - centre).norm().min((above.xy() - centre.xy()).norm()) < 4.5;
                if near { at_hole += 1 } else { elsewhere += 1 }
            }
        }
        assert!(at_hole > 0 && elsewhere == 0, "{at_hole} {elsewhere}");
    }

    #[test]
    fn cover_is_deep_and_its_normals_point_out() {
        let part = cover();
        let extents = part.mesh.bounds().unwrap().extents();
        assert!((extents.z - 35.0).abs() < 0.05, "{extents}");
        assert!((150.0..175.0).contains(&extents.y), "{extents}");
        assert!((0..part.mesh.triangles.len()).all(|t| part.mesh.area_vector_twice(t).z > 0.0));
    }

    #[test]
    fn mirrored_twin_keeps_its_normals_and_its_area() {
        let part = rail();
        let twin = part.mirrored();
        assert!((part.mesh.area() - twin.mesh.area()).abs() < 1e-6);
        assert!((0..twin.mesh.triangles.len()).all(|t| twin.mesh.area_vector_twice(t).z > 0.0));
    }
}
