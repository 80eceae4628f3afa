//! Which triangles meet at which edge; consistent winding; the loops of the open edges.

use super::{Mesh, Point3};

/// No triangle on the other side: the edge of the sheet.
pub const BOUNDARY: u32 = u32::MAX;
/// More than two triangles meet, or the mesh folds back on itself: nothing is followed across.
pub const NON_MANIFOLD: u32 = u32::MAX - 1;

/// For each triangle and each of its edges (edge k runs from corner k to corner k + 1) what lies across.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Adjacency {
    /// `3 * triangle + edge` of the neighbour, or [`BOUNDARY`], or [`NON_MANIFOLD`].
    pub across: Vec<[u32; 3]>,
}

impl Adjacency {
    /// Finds the neighbours, whichever way the triangles wind. Vertex indices must be valid.
    pub fn of(mesh: &Mesh) -> Self {
        // Half-edges sorted into buckets by their lower vertex; edges at one vertex are few.
        let ends = |half_edge: u32| {
            let triangle = mesh.triangles[half_edge as usize / 3];
            let (a, b) = (triangle[half_edge as usize % 3], triangle[(half_edge as usize + 1) % 3]);
            (a.min(b), a.max(b))
        };
        let count = 3 * mesh.triangles.len() as u32;
        let mut start = vec![0u32; mesh.vertices.len() + 1];
        for half_edge in 0..count {
            start[ends(half_edge).0 as usize + 1] += 1;
        }
        for k in 1..start.len() {
            start[k] += start[k - 1];
        }
        let mut filled = start.clone();
        let mut sorted = vec![(0u32, 0u32); count as usize];
        for half_edge in 0..count {
            let (low, high) = ends(half_edge);
            sorted[filled[low as usize] as usize] = (high, half_edge);
            filled[low as usize] += 1;
        }
        let mut across = vec![[BOUNDARY; 3]; mesh.triangles.len()];
        for bucket in start.windows(2) {
            let bucket = &mut sorted[bucket[0] as usize..bucket[1] as usize];
            bucket.sort_unstable();
            for same in bucket.chunk_by(|a, b| a.0 == b.0) {
                let mut set = |half_edge: u32, value| across[half_edge as usize / 3][half_edge as usize % 3] = value;
                match same {
                    [_] => {}
                    [a, b] => {
                        set(a.1, b.1);
                        set(b.1, a.1);
                    }
                    more => more.iter().for_each(|h| set(h.1, NON_MANIFOLD)),
                }
            }
        }
        Self { across }
    }

    /// The triangle across an edge, when there is exactly one.
    pub fn neighbour(&self, triangle: usize, edge: usize) -> Option<usize> {
        let across = self.across[triangle][edge];
        (across < NON_MANIFOLD).then_some(across as usize / 3)
    }

    /// Number of boundary edges.
    pub fn boundary_edges(&self) -> usize {
        self.across.iter().flatten().filter(|a| **a == BOUNDARY).count()
    }
}

/// What [`orient`] did.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Oriented {
    /// Triangles turned round.
    pub flipped: usize,
    /// Edges across which the winding still disagrees: the surface has one side only, like a Moebius strip.
    pub twisted_edges: usize,
    /// Pieces connected over manifold edges.
    pub components: usize,
}

/// Makes neighbouring triangles wind the same way. In each piece connected over manifold edges the larger area keeps the file's
/// winding, because a CAD's normals have a meaning; the smaller one is turned. Equal areas follow the piece's first triangle.
pub fn orient(mesh: &mut Mesh, adjacency: &mut Adjacency) -> Oriented {
    let count = mesh.triangles.len();
    let mut done = Oriented::default();
    // 0 = not visited, +1 / -1 = as in the file / turned, relative to the piece's first triangle.
    let mut sense = vec![0i8; count];
    let mut flips = vec![false; count];
    let mut piece = Vec::new();
    for first in 0..count {
        if sense[first] != 0 {
            continue;
        }
        done.components += 1;
        sense[first] = 1;
        piece.clear();
        piece.push(first);
        let (mut next, mut balance) = (0, 0.0);
        while next < piece.len() {
            let triangle = piece[next];
            next += 1;
            balance += f64::from(sense[triangle]) * mesh.area_vector_twice(triangle).norm();
            for edge in 0..3 {
                let Some(neighbour) = adjacency.neighbour(triangle, edge) else { continue };
                let agrees = agree(mesh, adjacency, triangle, edge);
                let wanted = if agrees { sense[triangle] } else { -sense[triangle] };
                if sense[neighbour] == 0 {
                    sense[neighbour] = wanted;
                    piece.push(neighbour);
                }
            }
        }
        let turned = if balance >= 0.0 { -1 } else { 1 };
        piece.iter().for_each(|&t| flips[t] = sense[t] == turned);
    }
    for (triangle, _) in flips.iter().enumerate().filter(|(_, flip)| **flip) {
        mesh.triangles[triangle].swap(1, 2);
        done.flipped += 1;
    }
    if done.flipped > 0 {
        *adjacency = Adjacency::of(mesh);
    }
    let disagreeing = (0..count)
        .flat_map(|t| (0..3).map(move |e| (t, e)))
        .filter(|&(t, e)| adjacency.neighbour(t, e).is_some() && !agree(mesh, adjacency, t, e));
    done.twisted_edges = disagreeing.count() / 2;
    done
}

/// Whether two neighbours run along their common edge in opposite senses, as they should.
fn agree(mesh: &Mesh, adjacency: &Adjacency, triangle: usize, edge: usize) -> bool {
    let across = adjacency.across[triangle][edge] as usize;
    mesh.triangles[triangle][edge] != mesh.triangles[across / 3][across % 3]
}

/// The open edges as chains of vertices, the surface on the left. A closed loop repeats its first vertex at its end; chains that
/// cannot be closed, because triangles wind differently around them, stay open. Loops begin at their first half-edge in the mesh.
pub fn boundary_loops(mesh: &Mesh, adjacency: &Adjacency) -> Vec<Vec<u32>> {
    let half_edges: Vec<(u32, u32)> = adjacency
        .across
        .iter()
        .enumerate()
        .flat_map(|(t, edges)| (0..3).filter(move |e| edges[*e] == BOUNDARY).map(move |e| (t, e)))
        .map(|(t, e)| (mesh.triangles[t][e], mesh.triangles[t][(e + 1) % 3]))
        .collect();
    let mut by_start: Vec<(u32, u32)> = half_edges.iter().enumerate().map(|(k, h)| (h.0, k as u32)).collect();
    by_start.sort_unstable();
    let mut used = vec![false; half_edges.len()];
    let leaving = |vertex: u32, used: &[bool]| {
        let from = by_start.partition_point(|h| h.0 < vertex);
        by_start[from..].iter().take_while(|h| h.0 == vertex).map(|h| h.1 as usize).find(|&k| !used[k])
    };
    // Chains that begin where no half-edge arrives come first, so that they are not entered in their middle.
    let mut arrives: Vec<u32> = half_edges.iter().map(|h| h.1).collect();
    arrives.sort_unstable();
    let is_loose = |k: usize| arrives.binary_search(&half_edges[k].0).is_err();
    let starts = (0..half_edges.len()).filter(|k| is_loose(*k)).chain(0..half_edges.len());
    let mut loops = Vec::new();
    for start in starts {
        if used[start] {
            continue;
        }
        used[start] = true;
        let (first, mut last) = half_edges[start];
        let mut chain = vec![first, last];
        while last != first {
            let Some(next) = leaving(last, &used) else { break };
            used[next] = true;
            last = half_edges[next].1;
            chain.push(last);
        }
        loops.push(chain);
    }
    loops
}

/// The chains of [`boundary_loops`] as points.
pub fn loop_points(mesh: &Mesh, loops: &[Vec<u32>]) -> Vec<Vec<Point3>> {
    loops.iter().map(|chain| chain.iter().map(|v| mesh.vertices[*v as usize]).collect()).collect()
}
