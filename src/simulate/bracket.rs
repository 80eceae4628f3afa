//! The demo part: a stamped bracket with crown, bead, three flanges, holes, slots and a trimmed outline, without symmetry.

use super::blank::{
    Corner, Opening, Uv, UvVector, filleted, segments, square_lattice, subdivided, triangulate, with_sides_moved,
};
use super::forming::{Bead, Flange, Forming, Pad, ProfilePiece};
use super::part::{SyntheticPart, edge_geometry, opening_geometry, surface_geometry};
use crate::plan::Geometry;

/// Sheet thickness of the bracket.
pub const THICKNESS_MM: f64 = 1.2;
/// Spacing of a mesh with about 184 000 triangles, for measuring times.
pub const BENCHMARK_SPACING_MM: f64 = 0.602;
/// Side of the outline (from corner k to k + 1) whose trimmed edge is each comparison point E01..E06, and where on it.
const EDGES: [(&str, usize, f64); 6] =
    [("E01", 10, 0.45), ("E02", 2, 0.5), ("E03", 7, 0.45), ("E04", 12, 0.5), ("E05", 17, 0.4), ("E06", 0, 0.5)];
/// Comparison points on the surface, as places on the base.
const SURFACE: [(&str, f64, f64); 12] = [
    ("P01", -15.0, 20.0),
    ("P02", -30.0, 45.0),
    ("P03", 45.0, 52.0),
    ("P04", 40.0, 5.0),
    ("P05", -8.0, 70.0),
    ("P06", -60.0, -5.0),
    ("P07", -55.0, -58.0),
    ("P08", -15.0, -62.0),
    ("P09", 25.0, -62.0),
    ("P10", 75.0, -40.0),
    ("P11", 65.0, 45.0),
    ("P12", 75.0, 5.0),
];

/// What a bracket may have that the nominal one has not. All zero: the nominal part.
#[derive(Debug, Clone, PartialEq)]
pub struct BracketParameters {
    /// Length of the mesh's edges on the base; 2.4 gives the demo's CAD, `BENCHMARK_SPACING_MM` 184 000 triangles.
    pub spacing_mm: f64,
    /// Openings moved on the blank: name (`H1`, `S1`, `C01`..`C05`) and amount in u and v.
    pub shifts: Vec<(&'static str, f64, f64)>,
    /// Holes drilled too large (+) or too small: name and change of the diameter.
    pub diameter_changes: Vec<(&'static str, f64)>,
    /// Trimmed edges moved outwards: name (`E01`..`E06`) and amount.
    pub trims: Vec<(&'static str, f64)>,
    /// Change of each flange's bend angle (0 foot, 1 right, 2 front), rad; positive bends up.
    pub flange_angles_rad: [f64; 3],
}

impl Default for BracketParameters {
    fn default() -> Self {
        Self {
            spacing_mm: 2.4,
            shifts: Vec::new(),
            diameter_changes: Vec::new(),
            trims: Vec::new(),
            flange_angles_rad: [0.0; 3],
        }
    }
}

/// The bracket with these parameters. Its features and comparison points are the *actual* ones of this part: the nominal
/// ones are those of the bracket with default parameters.
pub fn bracket(parameters: &BracketParameters) -> SyntheticPart {
    let forming = forming(parameters.flange_angles_rad);
    let corners = with_sides_moved(&corners(&forming.flanges), &moved_sides(parameters));
    let openings = openings(&forming.flanges, parameters);
    let flat = triangulate(
        &rims(&corners, &openings, &forming, parameters.spacing_mm),
        &lattice(&forming, parameters.spacing_mm),
    )
    .expect("the bracket's rims keep away from each other for shifts of a few mm");
    let mut part = SyntheticPart::form("bracket", &flat, &forming, THICKNESS_MM);
    add_points(&mut part, &forming, &corners, &openings);
    part
}

fn moved_sides(parameters: &BracketParameters) -> Vec<(usize, f64)> {
    let side = |name: &str| EDGES.iter().find(|(n, ..)| *n == name).map(|(_, side, _)| *side);
    parameters.trims.iter().filter_map(|(name, mm)| Some((side(name)?, *mm))).collect()
}

fn forming(change_rad: [f64; 3]) -> Forming {
    let bend = |degrees: f64, change: f64, radius_mm: f64| {
        let nominal = degrees.to_radians();
        ProfilePiece { length_mm: nominal.abs() * radius_mm, turn_rad: nominal + change }
    };
    let foot =
        vec![bend(-50.0, change_rad[0], 4.0), ProfilePiece { length_mm: 14.0, turn_rad: 0.0 }, bend(50.0, 0.0, 4.0)];
    let flanges = vec![
        Flange::new(78.0, std::f64::consts::PI, foot),
        Flange::new(88.0, 12f64.to_radians(), vec![bend(-35.0, change_rad[1], 4.0)]),
        Flange::new(78.0, -0.5 * std::f64::consts::PI, vec![bend(40.0, change_rad[2], 5.0)]),
    ];
    // Pads lie around the nominal openings: a shifted hole stays on its flat place.
    let pads = openings(&flanges, &BracketParameters::default())
        .into_iter()
        .filter(|(_, opening)| flanges.iter().all(|f| f.beyond_mm(&opening.centre()) < 0.0))
        .map(|(_, around)| Pad { around, flat_mm: 8.0, blend_mm: 12.0 })
        .collect();
    let beads = vec![Bead { ends: [Uv::new(-30.0, 14.0), Uv::new(-8.0, -45.0)], half_width_mm: 9.0, height_mm: 2.5 }];
    Forming { crown_mm: 5.0, crown_centre: Uv::new(5.0, 8.0), crown_width_mm: [45.0, 45.0], flanges, pads, beads }
}

/// The outline on the blank, counter-clockwise.
fn corners(flanges: &[Flange]) -> Vec<Corner> {
    let right = |s: f64, w: f64, radius_mm: f64| Corner { at: flanges[1].place(s, w), radius_mm };
    vec![
        Corner::new(-72.0, -72.0, 12.0),
        Corner::new(-36.0, -72.0, 3.0),
        Corner::new(-33.0, -101.0, 8.0),
        Corner::new(50.0, -104.0, 14.0),
        Corner::new(58.0, -72.0, 3.0),
        Corner::new(84.0, -72.0, 10.0),
        right(-44.0, -6.0, 3.0),
        right(-42.0, 25.0, 8.0),
        right(38.0, 22.0, 12.0),
        right(44.0, -6.0, 3.0),
        Corner::new(68.0, 88.0, 18.0),
        Corner::new(20.0, 94.0, 5.0),
        Corner::new(12.0, 82.0, 6.0),
        Corner::new(-14.0, 82.0, 6.0),
        Corner::new(-20.0, 92.0, 6.0),
        Corner::new(-60.0, 86.0, 20.0),
        Corner::new(-72.0, 62.0, 3.0),
        Corner::new(-118.0, 54.0, 10.0),
        Corner::new(-120.0, -40.0, 6.0),
        Corner::new(-72.0, -52.0, 3.0),
    ]
}

fn openings(flanges: &[Flange], parameters: &BracketParameters) -> Vec<(&'static str, Opening)> {
    let hole = |name: &'static str, at: Uv, diameter_mm: f64| {
        let change: f64 = parameters.diameter_changes.iter().filter(|(n, _)| *n == name).map(|(_, mm)| mm).sum();
        (name, Opening::Hole { centre: at + shift(name, parameters), diameter_mm: diameter_mm + change })
    };
    let slot = |name: &'static str, at: Uv, direction: UvVector, length_mm: f64, width_mm: f64| {
        let centre = at + shift(name, parameters);
        (name, Opening::Slot { centre, direction: direction.normalize(), length_mm, width_mm })
    };
    vec![
        hole("H1", Uv::new(-52.0, 64.0), 16.0),
        slot("S1", Uv::new(58.0, -50.0), UvVector::new(0.97, 0.24), 30.0, 9.0),
        hole("C01", Uv::new(15.0, 42.0), 30.0),
        hole("C02", Uv::new(16.0, -16.0), 20.0),
        hole("C03", Uv::new(-50.0, -35.0), 10.0),
        hole("C04", flanges[1].place(-10.0, 14.0), 8.0),
        hole("C05", Uv::new(-109.5, -12.0), 8.0),
        hole("X1", Uv::new(-52.0, 22.0), 7.0),
        hole("X2", Uv::new(60.0, 20.0), 6.0),
    ]
}

fn shift(name: &str, parameters: &BracketParameters) -> UvVector {
    let of_name = parameters.shifts.iter().filter(|(n, ..)| *n == name);
    of_name.map(|(_, u, v)| UvVector::new(*u, *v)).sum()
}

fn rims(corners: &[Corner], openings: &[(&str, Opening)], forming: &Forming, spacing_mm: f64) -> Vec<Vec<Uv>> {
    let bent = |q: &Uv| forming.flanges.iter().any(|f| f.is_curved_at(q, 0.5));
    let longest = |q: &Uv| if bent(q) { 0.4 } else { spacing_mm };
    let mut rims = vec![subdivided(&filleted(corners, 0.002), longest)];
    rims.extend(openings.iter().map(|(_, opening)| opening.rim(0.001)));
    rims
}

/// Vertices within the rims: a square lattice on the base, finer along the bead, rows along the bends.
fn lattice(forming: &Forming, spacing_mm: f64) -> Vec<(Uv, f64)> {
    let on_base = |q: &Uv, margin: f64| forming.flanges.iter().all(|f| f.beyond_mm(q) < -margin);
    let near_bead = |q: &Uv, margin: f64| {
        forming.beads.iter().any(|b| {
            let along = (b.ends[1] - b.ends[0]).normalize();
            let r = q - nalgebra::center(&b.ends[0], &b.ends[1]);
            let half_length = 0.5 * (b.ends[1] - b.ends[0]).norm() + b.half_width_mm;
            r.dot(&along).abs() < half_length + margin && r.perp(&along).abs() < b.half_width_mm + margin
        })
    };
    let (low, high) = (Uv::new(-130.0, -120.0), Uv::new(130.0, 120.0));
    let mut lattice = square_lattice(low, high, spacing_mm);
    lattice.retain(|(q, _)| on_base(q, 0.4 * spacing_mm) && !near_bead(q, 0.3 * spacing_mm));
    let fine = spacing_mm.min(1.0);
    let mut bead = square_lattice(low, high, fine);
    bead.retain(|(q, _)| near_bead(q, 0.0));
    lattice.extend(bead);
    for flange in &forming.flanges {
        let mut w = 0.0;
        let mut rows = vec![0.0];
        for piece in &flange.profile {
            let steps = if piece.turn_rad == 0.0 {
                (piece.length_mm / spacing_mm).ceil() as usize
            } else {
                segments(piece.length_mm / piece.turn_rad.abs(), piece.turn_rad, 0.005)
                    .max((piece.length_mm / spacing_mm) as usize)
            };
            rows.extend((1..=steps).map(|k| w + piece.length_mm * k as f64 / steps as f64));
            w += piece.length_mm;
        }
        rows.extend((1..=(40.0 / spacing_mm) as usize).map(|k| w + spacing_mm * k as f64));
        let half = (75.0 / spacing_mm) as i64;
        for w in rows {
            let clear = if flange.is_curved_at(&flange.place(0.0, w), 0.01) { 0.25 } else { 0.4 * spacing_mm };
            lattice.extend((-half..=half).map(|k| (flange.place(k as f64 * spacing_mm, w), clear)));
        }
    }
    lattice
}

fn add_points(part: &mut SyntheticPart, forming: &Forming, corners: &[Corner], openings: &[(&str, Opening)]) {
    for (name, opening) in openings {
        match *name {
            "H1" | "S1" => part.add_feature(name, opening_geometry(forming, opening, None)),
            "C01" | "C04" => part.add_comparison(name, opening_geometry(forming, opening, Some(UvVector::x())), 0.3),
            "C02" => part.add_comparison(name, opening_geometry(forming, opening, Some(UvVector::y())), 0.3),
            "C03" | "C05" => part.add_comparison(name, opening_geometry(forming, opening, None), 0.3),
            _ => {}
        }
    }
    part.add_feature("A1", surface_geometry(forming, &Uv::new(52.0, 66.0)));
    let mut surface: Vec<(&str, Uv)> = SURFACE.iter().map(|(name, u, v)| (*name, Uv::new(*u, *v))).collect();
    surface.push(("P13", forming.flanges[1].place(20.0, 14.0)));
    surface.push(("P14", Uv::new(10.0, -92.0)));
    surface.push(("P15", Uv::new(-109.0, 30.0)));
    for (name, q) in surface {
        part.add_comparison(name, surface_geometry(forming, &q), 0.5);
    }
    for (name, side, share) in EDGES {
        let (a, b) = (corners[side].at, corners[(side + 1) % corners.len()].at);
        part.add_comparison(name, edge_geometry(forming, &a, &b, share), 0.7);
    }
    part.comparison.sort_by_key(|c| (kind_order(&c.geometry), c.name.clone()));
    part.put_surface_points_on_facets(1.0);
}

fn kind_order(geometry: &Geometry) -> u8 {
    match geometry {
        Geometry::Surface { .. } => 0,
        Geometry::Edge { .. } => 1,
        Geometry::Hole { .. } | Geometry::Slot { .. } => 2,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nominal_bracket_has_the_size_of_the_demo_part() {
        let part = bracket(&BracketParameters::default());
        let extents = part.mesh.bounds().unwrap().extents();
        assert!((12_000..30_000).contains(&part.mesh.triangles.len()), "{}", part.mesh.triangles.len());
        assert!((220.0..260.0).contains(&extents.x) && (170.0..200.0).contains(&extents.y), "{extents}");
        assert_eq!(part.comparison.len(), 26);
    }

    #[test]
    fn a_fine_mesh_serves_as_benchmark() {
        let part = bracket(&BracketParameters { spacing_mm: BENCHMARK_SPACING_MM, ..Default::default() });
        let triangles = part.mesh.triangles.len();
        assert!((175_000..195_000).contains(&triangles), "{triangles}");
    }
}
