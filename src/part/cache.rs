//! A prepared part as a file beside its CAD.
//!
//! ```text
//! magic, format version, key (SHA-256 of everything the part was made of), body, SHA-256 of all before
//! ```
//!
//! All numbers are little-endian. A file with another key, of another length or with one changed bit is not trusted but rebuilt;
//! the checks of lengths and indices behind the checksum only make sure that even a forged file cannot stop the program.

mod codec;

use super::{Face, FaceSample, Part, PartSettings, RestingPose};
use crate::geometry::boundary::{Adjacency, NON_MANIFOLD};
use crate::geometry::bvh::{Node, Tree};
use crate::geometry::{Aabb, Bvh, LengthUnit, Mesh, Point3, UnitVector3};
use crate::plan::{CadSide, Side};
use codec::{Reader, Writer};
use sha2::{Digest, Sha256};
use std::io::Write;
use std::path::{Path, PathBuf};

const MAGIC: &[u8; 8] = b"shplcad\n";
/// Raised whenever the body or the preparation changes.
const FORMAT: u32 = 1;
const HASH: usize = 32;
const HEADER: usize = MAGIC.len() + 4 + HASH;

/// Identity of everything a part is made of.
pub(super) type Key = [u8; HASH];

/// Where the cache of a CAD file lies: beside it, with `.shapeline-cache` appended to its name.
pub fn cache_path(cad_path: &Path) -> PathBuf {
    let mut name = cad_path.as_os_str().to_owned();
    name.push(".shapeline-cache");
    name.into()
}

/// The key of a part: CAD bytes (by their hash), unit, settings, this program's version.
pub(super) fn key(cad_sha256: &str, unit: LengthUnit, settings: &PartSettings) -> Key {
    let mut w = Writer::default();
    w.text(env!("CARGO_PKG_VERSION"));
    w.text(cad_sha256);
    w.text(unit.key());
    w.u64(side_tag(settings.cad_side));
    w.f64(settings.thickness_mm);
    if settings.cad_side == CadSide::Solid {
        for (p, d) in &settings.plan_directions {
            w.point(p);
            w.vector(d);
        }
    }
    Sha256::digest(&w.bytes).into()
}

/// Reads a part back; `None` when the file is not there, not whole or made of something else.
pub(super) fn load(file: &Path, key: &Key) -> Option<Part> {
    decode(&std::fs::read(file).ok()?, key)
}

/// Writes the part beside its CAD, whole or not at all. Nothing waits for the disk: a file torn by a power cut fails its checksum.
pub(super) fn store(file: &Path, key: &Key, part: &Part) -> std::io::Result<()> {
    let folder = file.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut temporary = tempfile::NamedTempFile::new_in(folder)?;
    temporary.write_all(&encode(part, key))?;
    temporary.persist(file)?;
    Ok(())
}

fn encode(part: &Part, key: &Key) -> Vec<u8> {
    let mut w = Writer::default();
    w.bytes.extend(MAGIC);
    w.bytes.extend(FORMAT.to_le_bytes());
    w.bytes.extend(key);
    w.text(&part.cad_sha256);
    w.u64(part.triangles_in_file as u64);
    w.u64(side_tag(part.cad_side));
    w.f64(part.thickness_mm);
    w.point(&part.centroid);
    w.u64(part.warnings.len() as u64);
    part.warnings.iter().for_each(|text| w.text(text));
    w.u64(part.resting_poses.len() as u64);
    for pose in &part.resting_poses {
        w.vector(&pose.up_cad);
        w.u64(if pose.side == Side::Top { 0 } else { 1 });
        w.f64(pose.stability);
        w.f64(pose.height_mm);
    }
    write_mesh(&mut w, &part.mesh);
    part.faces.iter().for_each(|face| write_face(&mut w, face));
    let checksum = Sha256::digest(&w.bytes);
    w.bytes.extend(checksum);
    w.bytes
}

fn decode(bytes: &[u8], key: &Key) -> Option<Part> {
    let content = bytes.len().checked_sub(HASH).filter(|n| *n >= HEADER)?;
    let (content, checksum) = bytes.split_at(content);
    let expected_header =
        content.starts_with(MAGIC) && content[8..12] == FORMAT.to_le_bytes() && content[12..HEADER] == *key;
    if !expected_header || Sha256::digest(content).as_slice() != checksum {
        return None;
    }
    let mut r = Reader::new(&content[HEADER..]);
    let cad_sha256 = r.text()?;
    let triangles_in_file = usize::try_from(r.u64()?).ok()?;
    let cad_side = side_of_tag(r.u64()?)?;
    let thickness_mm = r.f64()?;
    let centroid = r.point()?;
    let warnings = (0..r.count(8)?).map(|_| r.text()).collect::<Option<Vec<_>>>()?;
    let resting_poses = (0..r.count(48)?).map(|_| read_pose(&mut r)).collect::<Option<Vec<_>>>()?;
    let mesh = read_mesh(&mut r)?;
    let (top, bottom) = (StoredFace::read(&mut r)?, StoredFace::read(&mut r)?);
    if !r.is_at_end() {
        return None;
    }
    let (top, bottom) = rayon::join(|| top.into_face(Side::Top), || bottom.into_face(Side::Bottom));
    let bounds: Aabb = mesh.bounds()?;
    let faces = [top?, bottom?];
    Some(Part {
        cad_sha256,
        triangles_in_file,
        mesh,
        bounds,
        cad_side,
        thickness_mm,
        centroid,
        resting_poses,
        warnings,
        faces,
    })
}

fn side_tag(side: CadSide) -> u64 {
    match side {
        CadSide::Top => 0,
        CadSide::Bottom => 1,
        CadSide::Middle => 2,
        CadSide::Solid => 3,
    }
}

fn side_of_tag(tag: u64) -> Option<CadSide> {
    [CadSide::Top, CadSide::Bottom, CadSide::Middle, CadSide::Solid].into_iter().find(|side| side_tag(*side) == tag)
}

fn read_pose(r: &mut Reader) -> Option<RestingPose> {
    let up_cad = UnitVector3::new_unchecked(r.vector()?);
    let side = if r.u64()? == 0 { Side::Top } else { Side::Bottom };
    Some(RestingPose { up_cad, side, stability: r.f64()?, height_mm: r.f64()? })
}

fn write_mesh(w: &mut Writer, mesh: &Mesh) {
    w.triples(mesh.vertices.iter().map(|v| [v.x, v.y, v.z]));
    w.words(mesh.triangles.iter().copied());
}

/// A mesh of which every coordinate is finite and every index fits.
fn read_mesh(r: &mut Reader) -> Option<Mesh> {
    let vertices: Vec<Point3> = r.triples()?.map(Point3::from).collect();
    let triangles: Vec<[u32; 3]> = r.words()?.collect();
    let count = vertices.len();
    let sound = vertices.iter().all(|v| v.coords.iter().all(|c| c.is_finite()))
        && triangles.iter().all(|t| t.iter().all(|v| (*v as usize) < count));
    sound.then_some(Mesh { vertices, triangles })
}

fn write_face(w: &mut Writer, face: &Face) {
    write_mesh(w, &face.mesh);
    w.words(face.adjacency.across.iter().copied());
    w.triples(face.vertex_normals.iter().map(|n| [n.x, n.y, n.z]));
    w.triples(face.samples.iter().map(|s| [s.point.x, s.point.y, s.point.z]));
    w.triples(face.samples.iter().map(|s| [s.normal.x, s.normal.y, s.normal.z]));
    let tree = face.bvh.tree();
    w.point(&tree.centre);
    w.words(tree.leaves.iter().copied());
    w.words(tree.nodes.iter().map(|node| node.child));
    w.floats(tree.nodes.iter().flat_map(|node| node.lo));
    w.floats(tree.nodes.iter().flat_map(|node| node.hi));
}

/// A face as stored, before its search tree is put together.
struct StoredFace {
    mesh: Mesh,
    adjacency: Adjacency,
    vertex_normals: Vec<crate::geometry::Vector3>,
    samples: Vec<FaceSample>,
    tree: Tree,
}

impl StoredFace {
    fn read(r: &mut Reader) -> Option<Self> {
        let mesh = read_mesh(r)?;
        let across: Vec<[u32; 3]> = r.words()?.collect();
        let half_edges = 3 * mesh.triangles.len() as u64;
        let inside = across.iter().flatten().all(|a| u64::from(*a) < half_edges || *a >= NON_MANIFOLD);
        let vertex_normals: Vec<_> = r.triples()?.map(crate::geometry::Vector3::from).collect();
        if !inside || across.len() != mesh.triangles.len() || vertex_normals.len() != mesh.vertices.len() {
            return None;
        }
        let points: Vec<[f64; 3]> = r.triples()?.collect();
        let normals: Vec<[f64; 3]> = r.triples()?.collect();
        let samples = points
            .iter()
            .zip(&normals)
            .map(|(p, n)| FaceSample { point: Point3::from(*p), normal: UnitVector3::new_unchecked((*n).into()) });
        let samples = samples.collect();
        let centre = r.point()?;
        let leaves = r.words()?.collect();
        let child: Vec<_> = r.words()?.collect();
        let (lo, hi): (Vec<_>, Vec<_>) = (r.floats()?.collect(), r.floats()?.collect());
        if points.len() != normals.len() || lo.len() != 3 * child.len() || hi.len() != lo.len() {
            return None;
        }
        let nodes = child.into_iter().enumerate().map(|(k, child)| Node {
            lo: [lo[3 * k], lo[3 * k + 1], lo[3 * k + 2]],
            hi: [hi[3 * k], hi[3 * k + 1], hi[3 * k + 2]],
            child,
        });
        let tree = Tree { centre, nodes: nodes.collect(), leaves };
        Some(Self { mesh, adjacency: Adjacency { across }, vertex_normals, samples, tree })
    }

    fn into_face(self, side: Side) -> Option<Face> {
        let bvh = Bvh::try_from_tree(&self.mesh, self.tree)?;
        Some(Face::from_parts(side, self.mesh, bvh, self.samples, self.adjacency, self.vertex_normals))
    }
}

#[cfg(test)]
mod tests;
