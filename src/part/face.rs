//! One face of the sheet as a camera sees it: closest point with sign, edges, samples.
//!
//! The sign of a distance comes from angle-weighted pseudo-normals (Baerentzen & Aanaes 2005): the normal of a single triangle
//! gives a wrong sign near edges and vertices of a bent surface, the pseudo-normal of the nearest feature never does.

use super::samples;
use crate::geometry::boundary::{Adjacency, BOUNDARY, NON_MANIFOLD, boundary_loops, loop_points};
use crate::geometry::{Bvh, Closest, Feature, Mesh, Point3, UnitVector3, Vector3};
use crate::plan::Side;
use rayon::prelude::*;

/// One face of the sheet, CAD frame, normals out of the sheet towards the camera on `side`.
#[derive(Debug, Clone, PartialEq)]
pub struct Face {
    /// The side of the sheet from which this face is seen.
    pub side: Side,
    /// The face, already moved by the sheet's thickness; triangle normals point out of the sheet.
    pub mesh: Mesh,
    /// Search tree over `mesh`.
    pub bvh: Bvh,
    /// Points spread evenly over the area, about 4000, always the same ones.
    pub samples: Vec<FaceSample>,
    /// Trimmed edges and hole rims. A closed loop repeats its first point at its end; the surface lies on the left when the normal
    /// points to the viewer.
    pub boundary_loops: Vec<Vec<Point3>>,
    /// Neighbours across the edges of `mesh`.
    pub adjacency: Adjacency,
    pub(super) vertex_normals: Vec<Vector3>,
    vertex_on_boundary: Vec<bool>,
    /// Search tree over the boundary edges, as triangles of two distinct corners; `None` when there are none.
    edges: Option<Bvh>,
}

/// A point of a face with its outward normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FaceSample {
    /// On the face.
    pub point: Point3,
    /// Out of the sheet, towards the camera.
    pub normal: UnitVector3,
}

/// The closest place of a face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FaceHit {
    /// The place.
    pub point: Point3,
    /// Outward normal there; at edges and vertices the angle-weighted pseudo-normal.
    pub normal: UnitVector3,
    /// Distance, positive outside, along the outward normal.
    pub signed_mm: f64,
    /// Triangle of the face's mesh.
    pub triangle: u32,
    /// The place is on a trimmed edge or a hole rim: the query lies past it, or exactly on it.
    pub on_boundary: bool,
}

impl Face {
    /// Makes a face of a mesh whose normals already point out of the sheet.
    pub(super) fn new(side: Side, mesh: Mesh) -> Face {
        let bvh = Bvh::build(&mesh);
        Self::over(side, mesh, bvh)
    }

    /// The same with the search tree given.
    pub(super) fn over(side: Side, mesh: Mesh, bvh: Bvh) -> Face {
        let (vertex_normals, samples) = rayon::join(|| vertex_normals(&mesh), || samples::spread(&mesh));
        Self::from_parts(side, mesh, bvh, samples, vertex_normals)
    }

    /// Puts a face together from what a cache keeps, and derives the rest.
    pub(super) fn from_parts(
        side: Side,
        mesh: Mesh,
        bvh: Bvh,
        samples: Vec<FaceSample>,
        vertex_normals: Vec<Vector3>,
    ) -> Face {
        let adjacency = Adjacency::of(&mesh);
        let loops = boundary_loops(&mesh, &adjacency);
        let boundary_loops = loop_points(&mesh, &loops);
        let mut vertex_on_boundary = vec![false; mesh.vertices.len()];
        for &v in loops.iter().flatten() {
            vertex_on_boundary[v as usize] = true;
        }
        let edges = edge_tree(&boundary_loops);
        Face { side, mesh, bvh, samples, boundary_loops, adjacency, vertex_normals, vertex_on_boundary, edges }
    }

    /// The closest place within `max_distance_mm` (which may be infinite).
    pub fn closest(&self, p: &Point3, max_distance_mm: f64) -> Option<FaceHit> {
        self.bvh.closest(p, max_distance_mm).map(|c| self.hit(p, &c))
    }

    /// Like [`Face::closest`], with the same answer, faster when `seed_triangle` is near the query.
    pub fn closest_seeded(&self, p: &Point3, max_distance_mm: f64, seed_triangle: u32) -> Option<FaceHit> {
        self.bvh.closest_seeded(p, max_distance_mm, seed_triangle).map(|c| self.hit(p, &c))
    }

    /// Distance to the nearest trimmed edge or hole rim; infinite when the face has none.
    pub fn edge_distance_mm(&self, p: &Point3) -> f64 {
        let edges = self.edges.as_ref();
        edges.and_then(|e| e.closest(p, f64::INFINITY)).map_or(f64::INFINITY, |c| c.distance_sq.sqrt())
    }

    /// Nearest place on a trimmed edge or hole rim within a distance.
    pub fn closest_edge(&self, p: &Point3, max_distance_mm: f64) -> Option<Point3> {
        self.edges.as_ref()?.closest(p, max_distance_mm).map(|c| c.point)
    }

    fn hit(&self, p: &Point3, closest: &Closest) -> FaceHit {
        let triangle = closest.triangle as usize;
        let (normal, on_boundary) = match closest.feature {
            Feature::Face => (self.mesh.area_vector_twice(triangle), false),
            Feature::Edge(k) => {
                (self.edge_normal(triangle, k as usize), self.adjacency.across[triangle][k as usize] == BOUNDARY)
            }
            Feature::Vertex(k) => {
                let vertex = self.mesh.triangles[triangle][k as usize] as usize;
                (self.vertex_normals[vertex], self.vertex_on_boundary[vertex])
            }
        };
        let normal = self.unit_or_near(normal, triangle);
        let away = p - closest.point;
        let distance = closest.distance_sq.sqrt();
        let signed_mm = if away.dot(&normal) < 0.0 { -distance } else { distance };
        FaceHit { point: closest.point, normal, signed_mm, triangle: closest.triangle, on_boundary }
    }

    /// Sum of the unit normals of the triangles that meet at an edge.
    fn edge_normal(&self, triangle: usize, edge: usize) -> Vector3 {
        let unit = |t: usize| self.mesh.normal(t).map_or(Vector3::zeros(), |n| n.into_inner());
        let across = self.adjacency.across[triangle][edge];
        if across >= NON_MANIFOLD { unit(triangle) } else { unit(triangle) + unit(across as usize / 3) }
    }

    /// The direction as unit vector; where it has none, because triangles without area meet or the surface folds back on itself, that
    /// of the triangle, of its neighbours, of its vertices.
    fn unit_or_near(&self, direction: Vector3, triangle: usize) -> UnitVector3 {
        let near = (0..3).filter_map(|k| self.adjacency.neighbour(triangle, k)).filter_map(|t| self.mesh.normal(t));
        let vertices = self.mesh.triangles[triangle].iter().map(|v| self.vertex_normals[*v as usize]);
        UnitVector3::try_new(direction, 1e-300)
            .or_else(|| self.mesh.normal(triangle))
            .or_else(|| near.into_iter().next())
            .or_else(|| vertices.filter_map(|n| UnitVector3::try_new(n, 1e-300)).next())
            .unwrap_or_else(Vector3::z_axis)
    }
}

/// Sums of the unit normals around each vertex, weighted by the angle of the triangle there.
pub(super) fn vertex_normals(mesh: &Mesh) -> Vec<Vector3> {
    let weighted: Vec<Option<[Vector3; 3]>> = (0..mesh.triangles.len())
        .into_par_iter()
        .with_min_len(4096)
        .map(|t| mesh.normal(t).map(|n| corner_angles(&mesh.corners(t)).map(|angle| n.into_inner() * angle)))
        .collect();
    let mut normals = vec![Vector3::zeros(); mesh.vertices.len()];
    for (triangle, weighted) in mesh.triangles.iter().zip(&weighted) {
        for (corner, n) in weighted.iter().flatten().enumerate() {
            normals[triangle[corner] as usize] += n;
        }
    }
    normals
}

/// Interior angles of a triangle at its corners, rad.
pub(super) fn corner_angles(corners: &[Point3; 3]) -> [f64; 3] {
    std::array::from_fn(|k| {
        let (a, b) = (corners[(k + 1) % 3] - corners[k], corners[(k + 2) % 3] - corners[k]);
        a.cross(&b).norm().atan2(a.dot(&b))
    })
}

fn edge_tree(loops: &[Vec<Point3>]) -> Option<Bvh> {
    let mut mesh = Mesh::default();
    for chain in loops {
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend(chain);
        mesh.triangles.extend((first..first + chain.len() as u32 - 1).map(|k| [k, k + 1, k + 1]));
    }
    (!mesh.triangles.is_empty()).then(|| Bvh::build(&mesh))
}
