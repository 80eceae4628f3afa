//! PLY: one parser for clouds and meshes, text and binary of both byte orders, elements in any order.
//!
//! Points come from the element `vertex`, faces from the list `vertex_indices` or `vertex_index` of the element `face`;
//! other elements and lists are passed over, but must be there in full.

mod binary;
mod header;
mod text;

use super::columns::{ColourScale, Layout, Lengths, Role};
use super::fault::Fault;
use super::{format, polygon, resolution};
use crate::diagnostic::{Diagnostic, ReadError};
use crate::geometry::{Mesh, PointCloud};
use crate::run::RunContext;
use header::{Element, Encoding, Header, Kind, Number};

/// Reads the vertices as a cloud, with colours, normals and all further single properties.
pub fn read_cloud(bytes: &[u8], lengths: Lengths, run: &RunContext) -> Result<PointCloud, ReadError> {
    let bytes = format::without_mark(bytes);
    let header = header::parse(bytes)?;
    let layout = layout_of(header.vertices()?)?;
    let wanted = Wanted { layout: &layout, lengths, faces: false };
    let mut body = read_body(bytes, &header, &wanted, run)?;
    Ok(std::mem::take(&mut body.cloud))
}

/// Whether a header tells of faces.
pub fn has_faces(start: &[u8]) -> bool {
    header::parse(start).is_ok_and(|header| header.elements.iter().any(|e| e.name == "face" && e.count > 0))
}

/// Reads vertices and faces; a vertex that is not finite is refused.
pub fn read_mesh(bytes: &[u8], mm_per_unit: f64, run: &RunContext) -> Result<Mesh, ReadError> {
    let bytes = format::without_mark(bytes);
    let header = header::parse(bytes)?;
    let mut layout = layout_of(header.vertices()?)?;
    check_faces(&header)?;
    // A mesh keeps positions only.
    for role in &mut layout.roles {
        if !matches!(role, Role::Position(_)) {
            *role = Role::Ignored;
        }
    }
    layout.scalar_names.clear();
    let wanted = Wanted { layout: &layout, lengths: Lengths::in_mm(mm_per_unit), faces: true };
    let body = read_body(bytes, &header, &wanted, run)?;
    let vertices = body.cloud.positions;
    if body.cloud.skipped_invalid > 0 {
        let message = format!("{} vertices with a coordinate that is not finite", body.cloud.skipped_invalid);
        return Err(Diagnostic::error(message).with_help("the CAD is damaged; export it again").into());
    }
    let mut triangles = Vec::new();
    let mut work = polygon::Work::default();
    for (record, corners) in (0_u64..).zip(body.faces.iter()) {
        if work.is_due(corners.len()) {
            run.check()?;
        }
        polygon::triangulate(corners, &vertices, &mut triangles)
            .map_err(|diagnostic| Fault::from(diagnostic).at_record("face", record))?;
    }
    Ok(Mesh { vertices, triangles })
}

/// What to take from the body.
struct Wanted<'a> {
    layout: &'a Layout,
    lengths: Lengths,
    faces: bool,
}

/// What the body gave.
#[derive(Default)]
struct Body {
    cloud: PointCloud,
    faces: Faces,
}

/// Polygons one behind the other.
#[derive(Default)]
struct Faces {
    corners: Vec<u32>,
    ends: Vec<usize>,
}

impl Faces {
    /// Closes the polygon whose corners were pushed last.
    fn close(&mut self) {
        self.ends.push(self.corners.len());
    }

    fn iter(&self) -> impl Iterator<Item = &[u32]> {
        (0..self.ends.len()).map(|k| {
            let begin = if k == 0 { 0 } else { self.ends[k - 1] };
            &self.corners[begin..self.ends[k]]
        })
    }
}

fn read_body(bytes: &[u8], header: &Header, wanted: &Wanted, run: &RunContext) -> Result<Body, ReadError> {
    match header.encoding {
        // What a text holds may be finer than the type that its header names.
        Encoding::Text => text::read(bytes, header, wanted, run),
        Encoding::LittleEndian | Encoding::BigEndian => {
            let body = binary::read(bytes, header, wanted, run)?;
            let is_float32 = is_float32(header.vertices()?, wanted.layout);
            resolution::check(&body.cloud.positions, is_float32, wanted.lengths)?;
            Ok(body)
        }
    }
}

/// Whether x, y and z are stored as float32.
fn is_float32(vertices: &Element, layout: &Layout) -> [bool; 3] {
    let mut stored = [false; 3];
    for (property, role) in vertices.properties.iter().zip(&layout.roles) {
        if let Role::Position(axis) = role {
            stored[usize::from(*axis)] = property.kind == Kind::Single(Number::F32);
        }
    }
    stored
}

/// The corner that an index names, checked against the number of vertices.
fn corner(index: f64, vertices: u64) -> Result<u32, Diagnostic> {
    // An index is a whole number below 2^53 in every type of the format, so f64 holds it exactly.
    if index >= 0.0 && index < vertices as f64 && index.fract() == 0.0 && index <= f64::from(u32::MAX) {
        return Ok(index as u32);
    }
    Err(Diagnostic::error(format!("face names vertex {index}, expected 0 to {}", vertices.saturating_sub(1)))
        .with_help("the file is damaged; export it again"))
}

/// The property that lists the corners of a face.
fn corners_property(element: &Element) -> Option<usize> {
    if element.name != "face" {
        return None;
    }
    element.properties.iter().position(|property| {
        matches!(property.kind, Kind::List { .. })
            && matches!(property.name.as_str(), "vertex_indices" | "vertex_index")
    })
}

fn check_faces(header: &Header) -> Result<(), Diagnostic> {
    let has_faces = header.elements.iter().any(|e| e.count > 0 && corners_property(e).is_some());
    if has_faces {
        return Ok(());
    }
    if header.elements.iter().any(|e| e.name == "tristrips") {
        return Err(Diagnostic::error("triangle strips found, expected an element \"face\"")
            .with_help("export the CAD with single faces, or as STL"));
    }
    Err(Diagnostic::error("no faces found, expected an element \"face\" with a list \"vertex_indices\"")
        .with_help("this looks like a point cloud; give the CAD as a mesh, and the scan under [scans]"))
}

fn layout_of(vertex: &Element) -> Result<Layout, Diagnostic> {
    let names: Vec<Option<&str>> = vertex
        .properties
        .iter()
        .map(|property| matches!(property.kind, Kind::Single(_)).then_some(property.name.as_str()))
        .collect();
    let mut layout = Layout::by_names(&names).map_err(|diagnostic| diagnostic.at_line(vertex.line))?;
    let colour_type = layout.roles.iter().position(|role| *role == Role::Colour(0)).map(|k| vertex.properties[k].kind);
    layout.colour_scale = match colour_type {
        Some(Kind::Single(Number::F32 | Number::F64)) => ColourScale::ByLargest,
        Some(Kind::Single(Number::U16)) => ColourScale::Short,
        _ => ColourScale::Byte,
    };
    Ok(layout)
}

#[cfg(test)]
mod tests;
