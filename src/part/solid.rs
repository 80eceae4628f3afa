//! The two faces of a sheet whose CAD is a closed solid.
//!
//! A triangle belongs to a face of the sheet when the ray from its middle into the material meets a triangle that looks the other
//! way, about one thickness further on; the rim walls around the sheet and its holes have nothing opposite so near. Face triangles
//! are joined into patches over smooth edges, and the patches are dealt out: the largest is one face, what lies opposite it the other,
//! and sharp creases hand a face on from patch to patch.

use super::PartSettings;
use crate::geometry::boundary::Adjacency;
use crate::geometry::{Bvh, Mesh, Point3, Vector3};
use rayon::prelude::*;

/// Distances to the opposite face that count, as shares of the thickness.
const ONE_THICKNESS: std::ops::RangeInclusive<f64> = 0.3..=2.0;
/// cos of the angle between a normal and the reversed one opposite: 60 degrees.
const OPPOSED: f64 = -0.5;
/// cos 40 degrees: edges bent less are smooth.
const SMOOTH: f64 = 0.766;
/// cos 25 degrees: triangles at the rim, from which the ray misses the opposite face, join their face up to this bend.
const RIM: f64 = 0.906;
/// The smaller face has at least this share of the larger one's area, or the split is not believed.
const ALIKE: f64 = 0.5;
/// Share of the solid's area that both faces together must have.
const MOST_OF_IT: f64 = 0.5;

/// A solid taken apart.
pub(super) struct Split {
    /// Top and bottom, normals out of the material.
    pub(super) faces: [Mesh; 2],
    /// Distance between the faces that most of their area has.
    pub(super) found_mm: f64,
}

/// What lies opposite a triangle.
#[derive(Clone, Copy)]
struct Opposite {
    distance: f64,
    triangle: u32,
}

/// Takes a closed solid with outward normals apart; `None` when it is not a sheet.
pub(super) fn split(mesh: &Mesh, settings: &PartSettings) -> Option<Split> {
    let normals: Vec<Vector3> =
        (0..mesh.triangles.len()).map(|t| mesh.normal(t).map_or(Vector3::zeros(), |n| n.into_inner())).collect();
    let areas: Vec<f64> = (0..mesh.triangles.len()).map(|t| 0.5 * mesh.area_vector_twice(t).norm()).collect();
    let opposite = opposites(mesh, &normals);
    let found_mm = usual_distance(&opposite, &areas)?;
    let thickness_mm = if settings.thickness_mm > 0.0 { settings.thickness_mm } else { found_mm };
    let near = |o: &Option<Opposite>| {
        o.filter(|o| ONE_THICKNESS.contains(&(o.distance / thickness_mm))).map(|o| o.triangle as usize)
    };
    let partner: Vec<Option<usize>> = opposite.iter().map(near).collect();
    let adjacency = Adjacency::of(mesh);
    let patches = Patches::of(&adjacency, &normals, &areas, &partner);
    let patch_face = deal_out(mesh, &adjacency, &patches, &areas, &partner)?;
    let mut face: Vec<Option<usize>> = patches.patch.iter().map(|p| p.and_then(|p| patch_face[p])).collect();
    grow_to_rim(&adjacency, &normals, &mut face);
    let area =
        |wanted: usize| -> f64 { face.iter().zip(&areas).filter(|(f, _)| **f == Some(wanted)).map(|(_, a)| a).sum() };
    let (a, b, whole) = (area(0), area(1), areas.iter().sum::<f64>());
    if a.min(b) < ALIKE * a.max(b) || a + b < MOST_OF_IT * whole {
        return None;
    }
    let mut faces = [extract(mesh, &face, 0), extract(mesh, &face, 1)];
    if second_is_top(&faces, [a, b], &settings.plan_directions) {
        faces.swap(0, 1);
    }
    Some(Split { faces, found_mm })
}

/// For each triangle the one that its inward ray meets, if that looks the other way.
fn opposites(mesh: &Mesh, normals: &[Vector3]) -> Vec<Option<Opposite>> {
    let bvh = Bvh::build(mesh);
    let step = 1e-7 * mesh.bounds().map_or(0.0, |b| b.diagonal());
    (0..mesh.triangles.len())
        .into_par_iter()
        .with_min_len(512)
        .map(|t| {
            let [a, b, c] = mesh.corners(t).map(|p| p.coords);
            let inward = -normals[t];
            let start = Point3::from((a + b + c) / 3.0) + inward * step;
            let hit = bvh.ray(&start, &inward, f64::INFINITY)?;
            let opposed = normals[hit.triangle as usize].dot(&normals[t]) < OPPOSED;
            opposed.then_some(Opposite { distance: hit.t + step, triangle: hit.triangle })
        })
        .collect()
}

/// The distance that most area has, within steps of 5 percent.
fn usual_distance(opposite: &[Option<Opposite>], areas: &[f64]) -> Option<f64> {
    let known: Vec<(f64, f64)> = opposite.iter().zip(areas).filter_map(|(o, a)| o.map(|o| (o.distance, *a))).collect();
    let bin = |d: f64| (d.max(1e-6).ln() / 0.05).floor() as i64;
    let lowest = known.iter().map(|k| bin(k.0)).min()?;
    let highest = known.iter().map(|k| bin(k.0)).max()?;
    let mut area = vec![0.0; (highest - lowest + 1) as usize];
    known.iter().for_each(|(d, a)| area[(bin(*d) - lowest) as usize] += a);
    // Pairs of bins, because a border may lie on the thickness itself.
    let pair = |k: usize| area[k] + area.get(k + 1).copied().unwrap_or(0.0);
    let best = (0..area.len()).fold(0, |best, k| if pair(k) > pair(best) { k } else { best });
    let in_pair = |d: f64| (best..=best + 1).contains(&((bin(d) - lowest) as usize));
    let (sum, weight) = known.iter().filter(|(d, _)| in_pair(*d)).fold((0.0, 0.0), |(s, w), (d, a)| (s + d * a, w + a));
    (weight > 0.0).then(|| sum / weight)
}

/// Face triangles joined over smooth edges.
struct Patches {
    /// Patch of each triangle; `None` for walls.
    patch: Vec<Option<usize>>,
    area: Vec<f64>,
}

impl Patches {
    fn of(adjacency: &Adjacency, normals: &[Vector3], areas: &[f64], partner: &[Option<usize>]) -> Self {
        let mut patches = Patches { patch: vec![None; areas.len()], area: Vec::new() };
        let mut waiting = Vec::new();
        for first in 0..areas.len() {
            if partner[first].is_none() || patches.patch[first].is_some() {
                continue;
            }
            let this = patches.area.len();
            patches.area.push(0.0);
            patches.patch[first] = Some(this);
            waiting.push(first);
            while let Some(t) = waiting.pop() {
                patches.area[this] += areas[t];
                for n in (0..3).filter_map(|k| adjacency.neighbour(t, k)) {
                    if patches.patch[n].is_none() && partner[n].is_some() && normals[t].dot(&normals[n]) > SMOOTH {
                        patches.patch[n] = Some(this);
                        waiting.push(n);
                    }
                }
            }
        }
        patches
    }
}

/// Face (0 or 1) of each patch, the largest on face 0; `None` for patches that touch both or none.
fn deal_out(
    mesh: &Mesh,
    adjacency: &Adjacency,
    patches: &Patches,
    areas: &[f64],
    partner: &[Option<usize>],
) -> Option<Vec<Option<usize>>> {
    let count = patches.area.len();
    let largest = (0..count).reduce(|a, b| if patches.area[b] > patches.area[a] { b } else { a })?;
    // Pairs of patches: what lies opposite, by area, and what adjoins across a crease, by length.
    let (mut facing, mut adjoining) = (Vec::new(), Vec::new());
    for t in 0..areas.len() {
        let Some(this) = patches.patch[t] else { continue };
        if let Some(other) = partner[t].and_then(|p| patches.patch[p]) {
            facing.push((this, other, areas[t]));
        }
        for k in 0..3 {
            if let Some(other) = adjacency.neighbour(t, k).and_then(|n| patches.patch[n]).filter(|o| *o != this) {
                let corners = mesh.corners(t);
                adjoining.push((this, other, (corners[(k + 1) % 3] - corners[k]).norm()));
            }
        }
    }
    let mut face: Vec<Option<usize>> = vec![None; count];
    face[largest] = Some(0);
    loop {
        let mut votes = vec![[0.0f64; 2]; count];
        for (this, other, area) in &facing {
            if let Some(f) = face[*other] {
                votes[*this][1 - f] += area;
            }
            if let Some(f) = face[*this] {
                votes[*other][1 - f] += area;
            }
        }
        // Creases decide only where nothing lies opposite.
        let mut crease_votes = vec![[0.0f64; 2]; count];
        for (this, other, length) in &adjoining {
            if let Some(f) = face[*other] {
                crease_votes[*this][f] += length;
            }
        }
        let clear = |v: &[f64; 2]| match (v[0] > 4.0 * v[1], v[1] > 4.0 * v[0]) {
            (true, _) => Some(0),
            (_, true) => Some(1),
            _ => None,
        };
        let decided: Vec<(usize, usize)> = (0..count)
            .filter(|p| face[*p].is_none())
            .filter_map(|p| clear(&votes[p]).or_else(|| clear(&crease_votes[p])).map(|f| (p, f)))
            .collect();
        if decided.is_empty() {
            return Some(face);
        }
        decided.into_iter().for_each(|(p, f)| face[p] = Some(f));
    }
}

/// Lets each face take the triangles beside it that bend away from it by little.
fn grow_to_rim(adjacency: &Adjacency, normals: &[Vector3], face: &mut [Option<usize>]) {
    let mut front: Vec<(usize, usize)> = (0..face.len()).filter(|t| face[*t].is_some()).map(|t| (t, t)).collect();
    while !front.is_empty() {
        let mut next = Vec::new();
        for (t, origin) in front {
            for n in (0..3).filter_map(|k| adjacency.neighbour(t, k)) {
                if face[n].is_none() && normals[n].dot(&normals[origin]) > RIM {
                    face[n] = face[t];
                    next.push((n, origin));
                }
            }
        }
        front = next;
    }
}

fn extract(mesh: &Mesh, face: &[Option<usize>], wanted: usize) -> Mesh {
    let mut index = vec![u32::MAX; mesh.vertices.len()];
    let mut out = Mesh::default();
    for (triangle, _) in mesh.triangles.iter().zip(face).filter(|(_, f)| **f == Some(wanted)) {
        out.triangles.push(triangle.map(|v| {
            let place = &mut index[v as usize];
            if *place == u32::MAX {
                *place = out.vertices.len() as u32;
                out.vertices.push(mesh.vertices[v as usize]);
            }
            *place
        }));
    }
    out
}

/// Whether the second face is the one that the plan's directions point out of; without a clear answer the larger face is the top, of
/// equal ones (to a thousandth) the one that looks more along +z.
fn second_is_top(faces: &[Mesh; 2], areas: [f64; 2], plan_directions: &[(Point3, Vector3)]) -> bool {
    let trees = [Bvh::build(&faces[0]), Bvh::build(&faces[1])];
    let agreement = |k: usize, position: &Point3, direction: &Vector3| {
        let hit = trees[k].closest(position, f64::INFINITY);
        hit.and_then(|h| faces[k].normal(h.triangle as usize)).map_or(0.0, |n| n.dot(direction))
    };
    let balance: f64 = plan_directions
        .iter()
        .filter_map(|(p, d)| d.try_normalize(0.0).map(|d| (p, d)))
        .map(|(p, d)| agreement(0, p, &d) - agreement(1, p, &d))
        .filter(|b| b.is_finite())
        .sum();
    if balance != 0.0 {
        return balance < 0.0;
    }
    if (areas[0] - areas[1]).abs() > 1e-3 * areas[0].max(areas[1]) {
        return areas[1] > areas[0];
    }
    let up = |k: usize| -> f64 { (0..faces[k].triangles.len()).map(|t| faces[k].area_vector_twice(t).z).sum() };
    up(1) > up(0)
}
