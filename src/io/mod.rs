//! Files in and out: CAD meshes, measured clouds, and the guard against wrong units.
//!
//! A reader gets the bytes of the whole file and gives back plain data in mm, or one [`Diagnostic`] that says what was
//! found at which line (text) or at which record and byte (binary), what was expected, and what to do. The format is
//! told by content; the file's extension only breaks ties. What a header counts is a claim: it is checked against the
//! bytes that are there before anything is allocated for it. No reader opens a second file.
//!
//! A text file that is cut off can end in the middle of a number and still look whole, which would shift a point
//! silently. So the last line of a text file must end with a line end, unless it can be shown to be whole (see
//! `lines` for the rule).

mod columns;
mod fault;
mod field;
mod format;
mod lines;
mod obj;
mod ply;
mod polygon;
mod resolution;
mod stl;
mod text_cloud;
pub mod unit_guard;
mod write;

pub use write::{Numbers, write_ply_cloud, write_ply_points, write_stl};

use crate::diagnostic::{Diagnostic, ReadError, os_words};
use crate::geometry::{LengthUnit, Mesh, PointCloud};
use crate::run::{Cancelled, RunContext};
use columns::Lengths;
use format::Format;
use sha2::{Digest, Sha256};
use std::io::Read;
use std::path::Path;

#[cfg(test)]
mod fuzz;

/// Largest coordinate of a CAD or a cloud, mm: a kilometre, as in a plan.
pub const LARGEST_COORDINATE_MM: f64 = 1e6;

/// What is read, and hashed, between two looks at whether the job was cancelled, bytes.
const PIECE: usize = 1 << 22;

/// Whether a file is a PLY whose header tells of faces: a mesh, as a CAD is. A file that cannot be read has none.
pub fn ply_has_faces(path: &Path) -> bool {
    /// No header is longer by honest means.
    const HEADER: u64 = 1 << 16;
    let mut start = Vec::new();
    let plain = std::fs::metadata(path).is_ok_and(|file| file.is_file());
    let read = plain && std::fs::File::open(path).and_then(|file| file.take(HEADER).read_to_end(&mut start)).is_ok();
    read && ply::has_faces(&start)
}

/// The whole of a plain file. Pipes and devices, which might never end, are refused before they are opened, and no more
/// is read than the file held when it was opened.
///
/// # Errors
/// The file is not there, is no plain file, or cannot be read.
pub fn read_plain(path: &Path) -> std::io::Result<Vec<u8>> {
    let (file, length) = open_plain(path)?;
    let mut bytes = room_for(length)?;
    file.take(length).read_to_end(&mut bytes)?;
    Ok(bytes)
}

fn open_plain(path: &Path) -> std::io::Result<(std::fs::File, u64)> {
    let about = std::fs::metadata(path)?;
    if about.is_dir() {
        return Err(std::io::Error::new(std::io::ErrorKind::IsADirectory, "it is a folder"));
    }
    if !about.is_file() {
        return Err(std::io::Error::new(std::io::ErrorKind::InvalidInput, "it is no plain file"));
    }
    let file = std::fs::File::open(path)?;
    let length = file.metadata()?.len();
    Ok((file, length))
}

fn room_for(length: u64) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(usize::try_from(length).unwrap_or(usize::MAX))?;
    Ok(bytes)
}

/// The whole file.
///
/// # Errors
/// The file cannot be opened or read, or is a folder; the message carries the system's reason.
pub fn read_file(path: &Path) -> Result<Vec<u8>, ReadError> {
    read_file_while(path, &RunContext::silent())
}

/// The same in a job that may be cancelled.
///
/// # Errors
/// Those of [`read_file`], or the job was cancelled.
pub fn read_file_while(path: &Path, run: &RunContext) -> Result<Vec<u8>, ReadError> {
    let in_words = |error: std::io::Error| -> ReadError {
        let help = match error.kind() {
            std::io::ErrorKind::NotFound => "check the name and the folder; names in a plan start at the plan's folder",
            std::io::ErrorKind::PermissionDenied => "give this user the right to read the file",
            _ => "check that the file, its disk and the network are there",
        };
        Diagnostic::error(format!("the file cannot be read: {}", os_words(&error))).in_file(path).with_help(help).into()
    };
    let (file, length) = open_plain(path).map_err(in_words)?;
    let mut bytes = room_for(length).map_err(in_words)?;
    let mut rest = file.take(length);
    loop {
        run.check()?;
        let read = rest.by_ref().take(PIECE as u64).read_to_end(&mut bytes).map_err(in_words)?;
        if read == 0 {
            return Ok(bytes);
        }
    }
}

/// SHA-256 of some bytes as 64 lower-case hexadecimal digits: the identity of scan, plan and CAD in reports.
pub fn sha256_hex(bytes: &[u8]) -> String {
    in_hex(Sha256::digest(bytes).as_ref())
}

/// The same of many bytes, in a job that may be cancelled.
pub fn sha256_of(bytes: &[u8], run: &RunContext) -> Result<String, Cancelled> {
    let mut hash = Sha256::new();
    for piece in bytes.chunks(PIECE) {
        run.check()?;
        hash.update(piece);
    }
    Ok(in_hex(hash.finalize().as_ref()))
}

fn in_hex(digest: &[u8]) -> String {
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Reads a CAD mesh (STL, OBJ or PLY), coordinates converted from `unit` to mm.
///
/// Triangles and vertices come as they stand in the file: STL gives three vertices a triangle, nothing is welded or
/// oriented here. Polygons become triangles; faces with fewer than three distinct vertices are left out.
///
/// # Errors
/// A file that is broken, cut off, without faces, or has a coordinate that is not finite, above
/// [`LARGEST_COORDINATE_MM`], or stored as float32 in steps above 0.01 mm; or the job was cancelled.
pub fn read_mesh(bytes: &[u8], file: &Path, unit: LengthUnit, run: &RunContext) -> Result<Mesh, ReadError> {
    let scale = unit.in_mm();
    let result = match format::detect(bytes, file) {
        Ok(Format::StlBinary) => stl::read_binary(bytes, scale, run),
        Ok(Format::StlText) => stl::read_text(bytes, scale, run),
        Ok(Format::Obj) => obj::read(bytes, scale, run),
        Ok(Format::Ply) => ply::read_mesh(bytes, scale, run),
        Ok(Format::TextCloud) => Err(Diagnostic::error("a text file of points, expected a CAD mesh with faces")
            .with_help("give the CAD as STL, OBJ or PLY; a cloud belongs under [scans]")
            .into()),
        Err(diagnostic) => Err(diagnostic.into()),
    };
    let mesh = result.map_err(|error| placed(error, file))?;
    if mesh.triangles.is_empty() {
        return Err(Diagnostic::error("no faces found, expected a CAD mesh with triangles or polygons")
            .in_file(file)
            .with_help("export the CAD as a triangle mesh (STL, OBJ or PLY with faces)")
            .into());
    }
    Ok(mesh)
}

/// Reads a measured cloud (PLY or delimited text), coordinates converted from `unit` to mm; order as in the file.
///
/// Points with a coordinate that is NaN or infinite are skipped and counted. A PLY mesh gives its vertices.
///
/// # Errors
/// A file that is broken, cut off, of a mesh format without measured points (STL, OBJ), without a single finite point,
/// or has a coordinate above [`LARGEST_COORDINATE_MM`] or stored as float32 in steps above 0.01 mm; or the job was cancelled.
pub fn read_cloud(bytes: &[u8], file: &Path, unit: LengthUnit, run: &RunContext) -> Result<PointCloud, ReadError> {
    read_points(bytes, file, Lengths::in_mm(unit.in_mm()), run)
}

/// The same with coordinates as they stand in the file, which is in `unit`.
///
/// # Errors
/// Those of [`read_cloud`].
pub fn read_cloud_in_its_unit(
    bytes: &[u8],
    file: &Path,
    unit: LengthUnit,
    run: &RunContext,
) -> Result<PointCloud, ReadError> {
    read_points(bytes, file, Lengths::as_they_are(unit.in_mm()), run)
}

fn read_points(bytes: &[u8], file: &Path, lengths: Lengths, run: &RunContext) -> Result<PointCloud, ReadError> {
    let not_a_cloud = |what: &str| -> ReadError {
        Diagnostic::error(format!("{what} mesh, expected a measured cloud"))
            .with_help(
                "export the scan's points as PLY or as text (xyz, txt, asc, csv, pts); a mesh belongs under [cad]",
            )
            .into()
    };
    let result = match format::detect(bytes, file) {
        Ok(Format::StlBinary | Format::StlText) => Err(not_a_cloud("an STL")),
        Ok(Format::Obj) => Err(not_a_cloud("an OBJ")),
        Ok(Format::Ply) => ply::read_cloud(bytes, lengths, run),
        Ok(Format::TextCloud) => text_cloud::read(bytes, lengths, run),
        Err(diagnostic) => Err(diagnostic.into()),
    };
    let cloud = result.map_err(|error| placed(error, file))?;
    if cloud.is_empty() {
        let message = match cloud.skipped_invalid {
            0 => "no points found, expected a measured cloud".to_owned(),
            n => format!("none of the {n} points has finite coordinates, expected a measured cloud"),
        };
        return Err(Diagnostic::error(message)
            .in_file(file)
            .with_help("check the scanner's export and scan again")
            .into());
    }
    Ok(cloud)
}

/// The error with the file's name in it.
fn placed(error: ReadError, file: &Path) -> ReadError {
    match error {
        ReadError::Bad(diagnostic) => diagnostic.in_file(file).into(),
        ReadError::CutOff(diagnostic) => ReadError::CutOff(Box::new(diagnostic.in_file(file))),
        cancelled @ ReadError::Cancelled(_) => cancelled,
    }
}

/// The message for a coordinate that no scan and no CAD has; `own` is the number of the file, as far as it is known.
fn too_far(value_mm: f64, own: f64) -> String {
    // In powers of ten where the digits would fill lines.
    let short = |value: f64| if value.abs() < 1e12 { format!("{value}") } else { format!("{value:.6e}") };
    let told = short(value_mm);
    if (own / value_mm - 1.0).abs() < 1e-9 {
        return format!("coordinate {told} mm, expected at most {LARGEST_COORDINATE_MM:.0} mm: not a plausible part");
    }
    let own = short(own);
    format!("coordinate {own} is {told} mm, expected at most {LARGEST_COORDINATE_MM:.0} mm: not a plausible part")
}

/// What to do about [`too_far`].
const TOO_FAR_HELP: &str = "check the unit of the file ([scans] unit or [cad] unit of a plan, `unit` of a merge), and whether the file is damaged";
