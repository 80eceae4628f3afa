//! A prepared part as a file beside its CAD.
//!
//! ```text
//! magic, format version, key (SHA-256 of everything the part was made of), body, checksum (SHA-256) of all before
//! ```
//!
//! All numbers are little-endian. A file with another key, of another length or with one changed bit is not trusted but rebuilt;
//! the checks behind the checksum (`sound`: finite, in range, consistent) make sure that even a forged file cannot stop the
//! program.

mod codec;
mod sound;

use super::{Face, FaceSample, Part, PartSettings, RestingPose};
use crate::geometry::bvh::Shape;
use crate::geometry::{Aabb, Bvh, LengthUnit, Mesh, Point3, UnitVector3, Vector3};
use crate::plan::{CadSide, Side};
use codec::{Reader, Writer};
use rayon::prelude::*;
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
pub(super) fn load(file: &Path, key: &Key, cad_sha256: &str, settings: &PartSettings) -> Option<Part> {
    let part = decode(&crate::io::read_plain(file).ok()?, key)?;
    // The key says so already, unless the file is forged.
    let same_thickness = settings.cad_side == CadSide::Solid || part.thickness_mm == settings.thickness_mm;
    (part.cad_sha256 == cad_sha256 && part.cad_side == settings.cad_side && same_thickness).then_some(part)
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
    // About what the arrays take; more is found when it is needed.
    w.bytes.reserve(80 * part.mesh.triangles.len() + 130 * part.mesh.vertices.len());
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
    let [top, bottom] = &part.faces;
    write_face(&mut w, top, &part.mesh, None);
    write_face(&mut w, bottom, &part.mesh, Some(&top.bvh.shape()));
    let checksum = checksum(&w.bytes);
    w.bytes.extend(checksum);
    w.bytes
}

fn decode(bytes: &[u8], key: &Key) -> Option<Part> {
    let content = bytes.len().checked_sub(HASH).filter(|n| *n >= HEADER)?;
    let (content, checksum) = bytes.split_at(content);
    let expected_header =
        content.starts_with(MAGIC) && content[8..12] == FORMAT.to_le_bytes() && content[12..HEADER] == *key;
    if !expected_header || self::checksum(content) != checksum {
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
    let top = StoredFace::read(&mut r, &mesh, None)?;
    let bottom = StoredFace::read(&mut r, &mesh, Some(&top.shape))?;
    if !r.is_at_end() {
        return None;
    }
    let (top, bottom) = rayon::join(|| top.into_face(Side::Top), || bottom.into_face(Side::Bottom));
    let bounds: Aabb = mesh.bounds()?;
    let faces = [top?, bottom?];
    let part = Part {
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
    };
    sound::is_sound(&part).then_some(part)
}

/// SHA-256 over the SHA-256 of each mebibyte, so that all threads can help.
fn checksum(bytes: &[u8]) -> Key {
    let each: Vec<Key> = bytes.par_chunks(1 << 20).map(|chunk| Sha256::digest(chunk).into()).collect();
    Sha256::digest(each.as_flattened()).into()
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
    let side = match r.u64()? {
        0 => Side::Top,
        1 => Side::Bottom,
        _ => return None,
    };
    Some(RestingPose { up_cad, side, stability: r.f64()?, height_mm: r.f64()? })
}

fn write_mesh(w: &mut Writer, mesh: &Mesh) {
    w.triples(mesh.vertices.iter().map(|v| [v.x, v.y, v.z]));
    w.words(mesh.triangles.iter().copied());
}

fn read_mesh(r: &mut Reader) -> Option<Mesh> {
    let vertices = r.triples()?.map(Point3::from).collect();
    sound::mesh(vertices, r.words()?.collect())
}

/// How a face's triangles are stored.
mod winding {
    /// Written out.
    pub(super) const OWN: u64 = 0;
    /// Those of the part's mesh.
    pub(super) const SAME: u64 = 1;
    /// Those of the part's mesh, wound the other way.
    pub(super) const TURNED: u64 = 2;
}

fn turned(triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
    triangles.iter().map(|[a, b, c]| [*a, *c, *b]).collect()
}

/// Both faces of a sheet have the triangles and the search tree's shape in common: these are written once.
fn write_face(w: &mut Writer, face: &Face, part_mesh: &Mesh, known: Option<&Shape>) {
    w.triples(face.mesh.vertices.iter().map(|v| [v.x, v.y, v.z]));
    if face.mesh.triangles == part_mesh.triangles {
        w.u64(winding::SAME);
    } else if face.mesh.triangles == turned(&part_mesh.triangles) {
        w.u64(winding::TURNED);
    } else {
        w.u64(winding::OWN);
        w.words(face.mesh.triangles.iter().copied());
    }
    w.triples(face.vertex_normals.iter().map(|n| [n.x, n.y, n.z]));
    w.triples(face.samples.iter().map(|s| [s.point.x, s.point.y, s.point.z]));
    w.triples(face.samples.iter().map(|s| [s.normal.x, s.normal.y, s.normal.z]));
    let shape = face.bvh.shape();
    let is_known = known == Some(&shape);
    w.u64(u64::from(is_known));
    if !is_known {
        w.words(shape.leaves.into_iter());
        w.words(shape.children.into_iter());
    }
}

/// A face as stored, before its search tree is put together.
struct StoredFace {
    mesh: Mesh,
    vertex_normals: Vec<Vector3>,
    samples: Vec<FaceSample>,
    shape: Shape,
}

impl StoredFace {
    fn read(r: &mut Reader, part_mesh: &Mesh, known: Option<&Shape>) -> Option<Self> {
        let vertices = r.triples()?.map(Point3::from).collect();
        let triangles = match r.u64()? {
            winding::SAME => part_mesh.triangles.clone(),
            winding::TURNED => turned(&part_mesh.triangles),
            winding::OWN => r.words()?.collect(),
            _ => return None,
        };
        let mesh = sound::mesh(vertices, triangles)?;
        let vertex_normals: Vec<_> = r.triples()?.map(Vector3::from).collect();
        let points: Vec<[f64; 3]> = r.triples()?.collect();
        let normals: Vec<[f64; 3]> = r.triples()?.collect();
        if points.len() != normals.len() || vertex_normals.len() != mesh.vertices.len() {
            return None;
        }
        let sample = |(p, n): (&[f64; 3], &[f64; 3])| FaceSample {
            point: Point3::from(*p),
            normal: UnitVector3::new_unchecked(Vector3::from(*n)),
        };
        let samples = points.iter().zip(&normals).map(sample).collect();
        let shape = match r.u64()? {
            0 => Shape { leaves: r.words()?.collect(), children: r.words()?.collect() },
            1 => known?.clone(),
            _ => return None,
        };
        Some(Self { mesh, vertex_normals, samples, shape })
    }

    fn into_face(self, side: Side) -> Option<Face> {
        let bvh = Bvh::try_from_shape(&self.mesh, &self.shape)?;
        Some(Face::from_parts(side, self.mesh, bvh, self.samples, self.vertex_normals))
    }
}

#[cfg(test)]
mod tests;
