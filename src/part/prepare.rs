//! From the triangles of a CAD file to a part.

use super::{Face, Part, PartSettings, resting, skin, solid};
use crate::diagnostic::{Diagnostic, ReadError};
use crate::geometry::boundary::{self, Adjacency};
use crate::geometry::weld::weld;
use crate::geometry::{Aabb, Bvh, Mesh, Point3, Vector3};
use crate::io::LARGEST_COORDINATE_MM;
use crate::plan::{CadSide, Side};
use crate::run::{Cancelled, RunContext};

/// Vertices nearer than this share of the diagonal are one.
const WELD_TOLERANCE: f64 = 1e-6;
/// A CAD smaller than this is not a stamped part: its unit is wrong.
const SMALLEST_MM: f64 = 0.1;
/// A solid's thickness may differ from the plan's by this share: tessellation and thinning in bends.
const THICKNESS_AGREES: f64 = 0.1;

impl Part {
    /// Prepares a CAD mesh (mm, as read: a soup or indexed). Fails when it holds nothing that could be inspected; everything else that is
    /// odd about it is kept and told in `warnings`. The result depends on the arguments only.
    pub fn prepare(
        mesh: Mesh,
        cad_sha256: String,
        settings: &PartSettings,
        run: &RunContext,
    ) -> Result<Part, ReadError> {
        let triangles_in_file = mesh.triangles.len();
        let diagonal = check(&mesh)?;
        let mut warnings = Vec::new();
        let mesh = clean(&mesh, diagonal, settings.cad_side, &mut warnings, run)?;
        run.check()?;
        let bounds = mesh.bounds().ok_or_else(|| Diagnostic::error("the CAD has no vertices"))?;
        let (faces, thickness_mm) = match settings.cad_side {
            CadSide::Solid => solid_faces(&mesh, settings, &mut warnings)?,
            _ => (sheet_faces(&mesh, settings, &mut warnings, run)?, settings.thickness_mm),
        };
        run.check()?;
        let centroid = centroid(&mesh, &bounds);
        let points: Vec<Point3> = faces.iter().flat_map(|f| &f.mesh.vertices).copied().collect();
        let resting_poses = resting::resting_poses(&points, &faces[0].mesh, &centroid);
        Ok(Part {
            cad_sha256,
            triangles_in_file,
            mesh,
            bounds,
            cad_side: settings.cad_side,
            thickness_mm,
            centroid,
            resting_poses,
            warnings,
            faces,
        })
    }
}

/// Refuses what cannot be a part and returns the diagonal of its box.
pub(super) fn check(mesh: &Mesh) -> Result<f64, Diagnostic> {
    if mesh.triangles.is_empty() {
        return Err(Diagnostic::error("the CAD has no triangles, expected the surface of a part")
            .with_help("export the part's surface as a triangle mesh"));
    }
    if let Some(k) = mesh.vertices.iter().position(|v| !v.coords.iter().all(|c| c.is_finite())) {
        return Err(Diagnostic::error(format!("vertex {} of the CAD is not a finite position", k + 1))
            .with_help("export the CAD again"));
    }
    let far = |v: &Point3| v.coords.amax() > LARGEST_COORDINATE_MM;
    if let Some((k, v)) = mesh.vertices.iter().enumerate().find(|(_, v)| far(v)) {
        let message = format!(
            "vertex {} of the CAD at [{}, {}, {}] mm, expected coordinates between -{LARGEST_COORDINATE_MM:.0} and {LARGEST_COORDINATE_MM:.0} mm",
            k + 1,
            v.x,
            v.y,
            v.z
        );
        return Err(Diagnostic::error(message)
            .with_help("check `unit` under [cad] in the plan, and whether the CAD is damaged"));
    }
    let count = mesh.vertices.len();
    if let Some(t) = mesh.triangles.iter().position(|t| t.iter().any(|v| *v as usize >= count)) {
        let message = format!("triangle {} of the CAD names a vertex that is not there; there are {count}", t + 1);
        return Err(Diagnostic::error(message).with_help("export the CAD again"));
    }
    let diagonal = mesh.bounds().map_or(0.0, |b| b.diagonal());
    if !(diagonal >= SMALLEST_MM && diagonal.is_finite()) {
        let message = format!("the CAD is {diagonal} mm across, expected a part of at least {SMALLEST_MM} mm");
        return Err(Diagnostic::error(message).with_help("check `unit` under [cad] in the plan"));
    }
    Ok(diagonal)
}

/// Welds, orients, and tells what was odd.
fn clean(
    mesh: &Mesh,
    diagonal: f64,
    cad_side: CadSide,
    warnings: &mut Vec<String>,
    run: &RunContext,
) -> Result<Mesh, ReadError> {
    let welded = weld(mesh, WELD_TOLERANCE * diagonal);
    let mut clean = welded.mesh;
    if clean.area() <= 0.0 {
        return Err(Diagnostic::error("no triangle of the CAD has an area, expected the surface of a part")
            .with_help("export the part's surface as a triangle mesh")
            .into());
    }
    run.check()?;
    let mut say = |count: usize, words: &str| {
        if count > 0 {
            warnings.push(format!("CAD: {count} {words}"));
        }
    };
    say(welded.collapsed, "degenerate triangles left out");
    say(welded.duplicate, "duplicate triangles left out");
    let mut adjacency = Adjacency::of(&clean);
    let oriented = boundary::orient(&mut clean, &mut adjacency);
    say(oriented.flipped, "triangles turned round to match their neighbours");
    say(oriented.twisted_edges, "edges across which no consistent side can be told");
    let branching = adjacency.across.iter().flatten().filter(|a| **a == boundary::NON_MANIFOLD).count();
    say(branching, "triangle edges at which more than two triangles meet");
    if cad_side == CadSide::Solid {
        say(adjacency.boundary_edges(), "open edges in a CAD that should be a closed solid");
        point_outwards(&mut clean);
    }
    Ok(clean)
}

/// Turns a solid inside out when its volume is negative.
fn point_outwards(mesh: &mut Mesh) {
    let about = mesh.bounds().map_or(Point3::origin(), |b| b.centre());
    let six_volumes: f64 = (0..mesh.triangles.len())
        .map(|t| mesh.corners(t).map(|c| c - about))
        .map(|[a, b, c]| a.dot(&b.cross(&c)))
        .sum();
    if six_volumes < 0.0 {
        mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
}

/// Both faces of a sheet whose CAD is one surface.
fn sheet_faces(
    mesh: &Mesh,
    settings: &PartSettings,
    warnings: &mut Vec<String>,
    run: &RunContext,
) -> Result<[Face; 2], Cancelled> {
    let one = |side: Side| {
        let mut moved = skin::offset(mesh, settings.cad_side.face_offset_mm(side, settings.thickness_mm));
        if side == Side::Bottom {
            moved.mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        (moved.mesh, moved.folded)
    };
    let ((top, bottom), bvh) = rayon::join(|| (one(Side::Top), one(Side::Bottom)), || Bvh::build(mesh));
    run.check()?;
    // One tree serves all three surfaces: they are a thickness apart.
    let shape = bvh.shape();
    let face = |side: Side, (mesh, folded): (Mesh, usize)| {
        let bvh = Bvh::try_from_shape(&mesh, &shape).unwrap_or_else(|| Bvh::build(&mesh));
        (Face::over(side, mesh, bvh), folded)
    };
    let (top, bottom) = rayon::join(|| face(Side::Top, top), || face(Side::Bottom, bottom));
    for (face, folded) in [&top, &bottom] {
        if *folded > 0 {
            let side = face.side.key();
            warnings.push(format!(
                "CAD: {folded} triangles of the {side} face fold over, because the surface bends more tightly than the sheet is thick"
            ));
        }
    }
    Ok([top.0, bottom.0])
}

/// What is thicker than this share of its size, against the plan, is a block and no sheet.
const MOST_THICKNESS: f64 = 0.05;

/// Both faces of a sheet whose CAD is a closed solid, and its thickness, which is the CAD's.
fn solid_faces(
    mesh: &Mesh,
    settings: &PartSettings,
    warnings: &mut Vec<String>,
) -> Result<([Face; 2], f64), Diagnostic> {
    // A thickness in the plan that is not the CAD's must not hide the faces.
    let unknown = PartSettings { thickness_mm: 0.0, ..settings.clone() };
    let diagonal = mesh.bounds().map_or(0.0, |b| b.diagonal());
    let is_sheet = |split: &solid::Split| split.found_mm < MOST_THICKNESS * diagonal;
    let split = solid::split(mesh, settings).or_else(|| solid::split(mesh, &unknown).filter(is_sheet));
    let Some(split) = split else {
        return Err(Diagnostic::error("the two faces of the sheet cannot be told apart in this solid")
            .with_help("give a closed solid of a sheet of even thickness, or one face of it and cad_side = \"top\""));
    };
    let [top, bottom] = split.faces;
    let (given, found) = (settings.thickness_mm, split.found_mm);
    if given > 0.0 && (found / given - 1.0).abs() > THICKNESS_AGREES {
        warnings.push(format!("CAD: the solid is {found:.3} mm thick, the plan says {given:.3} mm; the CAD's is used"));
    }
    let (top, bottom) = rayon::join(|| Face::new(Side::Top, top), || Face::new(Side::Bottom, bottom));
    Ok(([top, bottom], found))
}

/// Area-weighted centroid of the surface.
fn centroid(mesh: &Mesh, bounds: &Aabb) -> Point3 {
    let about = bounds.centre();
    let (mut sum, mut area) = (Vector3::zeros(), 0.0);
    for t in 0..mesh.triangles.len() {
        let weight = mesh.area_vector_twice(t).norm();
        let [a, b, c] = mesh.corners(t).map(|corner| corner - about);
        sum += (a + b + c) * (weight / 3.0);
        area += weight;
    }
    about + sum / area
}
