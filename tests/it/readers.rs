//! Every odd, broken and valid file of other programs' tests is read, or refused with a message and a help.
//!
//! Those files are not part of the project: `SHAPELINE_REFERENCE_DATA` names the folder that has them in `odd_files/`. A few small ones
//! of our own, beside the tests, are always read.

use shapeline::diagnostic::{Diagnostic, ReadError};
use shapeline::geometry::{LengthUnit, Mesh, PointCloud};
use shapeline::io::{read_cloud, read_file, read_mesh};
use shapeline::run::RunContext;
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};

/// The folder, when somebody named one.
#[allow(clippy::print_stderr, reason = "a test that checks nothing must say so")]
fn odd_files() -> Option<PathBuf> {
    let folder = std::env::var_os("SHAPELINE_REFERENCE_DATA").map(|folder| Path::new(&folder).join("odd_files"));
    if folder.is_none() {
        eprintln!("SHAPELINE_REFERENCE_DATA is not set: no odd files read");
    }
    folder
}

fn mesh_of(file: &Path) -> Result<Mesh, ReadError> {
    read_mesh(&read_file(file)?, file, LengthUnit::Mm, &RunContext::silent())
}

fn cloud_of(file: &Path) -> Result<PointCloud, ReadError> {
    read_cloud(&read_file(file)?, file, LengthUnit::Mm, &RunContext::silent())
}

/// The one file whose name ends so.
fn named(folder: &Path, ending: &str) -> PathBuf {
    let mut found: Vec<PathBuf> =
        all_files(folder).into_iter().filter(|f| f.to_string_lossy().ends_with(ending)).collect();
    assert_eq!(found.len(), 1, "files that end with {ending}");
    found.remove(0)
}

fn all_files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

fn diagnostic(error: ReadError) -> Diagnostic {
    match error {
        ReadError::Bad(diagnostic) | ReadError::CutOff(diagnostic) => *diagnostic,
        ReadError::Cancelled(_) => panic!("cancelled by nobody"),
    }
}

fn assert_helpful(error: ReadError) {
    let said = diagnostic(error);
    assert!(!said.message.is_empty() && said.file.is_some(), "{said}");
    assert!(said.help.as_ref().is_some_and(|help| !help.is_empty()), "{said}");
    assert!(said.to_string().len() < 1000, "{said}");
}

/// The folder of our own.
fn own_odd_files() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/odd_files")
}

#[test]
fn every_odd_file_is_read_or_refused_with_help() {
    let own = all_files(&own_odd_files());
    assert_eq!(own.len(), 18);
    read_or_refused(own);
    let Some(folder) = odd_files() else { return };
    let files = all_files(&folder);
    assert!(files.len() >= 100, "only {} files in {}", files.len(), folder.display());
    read_or_refused(files);
}

fn read_or_refused(files: Vec<PathBuf>) {
    for file in files {
        let name = file.display();
        let mesh = catch_unwind(|| mesh_of(&file)).unwrap_or_else(|_| panic!("{name}: panic as a mesh"));
        match mesh {
            Ok(mesh) => {
                assert!(!mesh.triangles.is_empty(), "{name}");
                let count = mesh.vertices.len();
                assert!(mesh.triangles.iter().flatten().all(|v| (*v as usize) < count), "{name}");
                assert!(mesh.vertices.iter().all(|v| v.coords.iter().all(|x| x.is_finite())), "{name}");
            }
            Err(error) => assert_helpful(error),
        }
        let cloud = catch_unwind(|| cloud_of(&file)).unwrap_or_else(|_| panic!("{name}: panic as a cloud"));
        match cloud {
            Ok(cloud) => {
                assert!(!cloud.is_empty(), "{name}");
                assert!(cloud.positions.iter().all(|p| p.coords.iter().all(|x| x.is_finite())), "{name}");
                assert!(cloud.colours.as_ref().is_none_or(|c| c.len() == cloud.len()), "{name}");
                assert!(cloud.normals.as_ref().is_none_or(|n| n.len() == cloud.len()), "{name}");
                assert!(cloud.scalars.iter().all(|(_, values)| values.len() == cloud.len()), "{name}");
            }
            Err(error) => assert_helpful(error),
        }
    }
}

#[test]
fn meshes_have_the_triangles_that_their_programs_wrote() {
    let Some(folder) = odd_files() else { return };
    for (name, triangles) in [
        ("bunny_99.stl", 99),
        ("bunny_99_ascii.stl", 99),
        ("unit_cube.STL", 12),
        ("featuretype.STL", 3476),
        ("octagonal_pocket.stl", 3262),
        ("two_objects_mixed_case_names.stl", 24),
        ("joined_tetrahedra.obj", 8),
        ("negative_indices.obj", 12),
        ("polygonfaces.obj", 3),
        ("tobj__obj__quad.obj", 5),
        ("cube.OBJ", 12),
        ("metadata.ply", 2),
        ("greg_turk_example1_ok_ascii.ply", 12),
        ("fuze.ply", 1000),
        ("suzanne.ply", 968),
    ] {
        let mesh = mesh_of(&named(&folder, name)).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(mesh.triangles.len(), triangles, "{name}");
    }
}

#[test]
fn text_and_binary_files_of_one_shape_agree() {
    let Some(folder) = odd_files() else { return };
    let shelf = mesh_of(&named(&folder, "platonic_shelf.ply")).unwrap();
    assert_eq!((shelf.vertices.len(), shelf.triangles.len()), (50, 80));
    for (name, tolerance_mm) in [("platonic_shelf_big_endian.ply", 0.0), ("platonic_shelf_ascii.ply", 1e-4)] {
        let same = mesh_of(&named(&folder, name)).unwrap();
        assert_eq!(same.triangles, shelf.triangles, "{name}");
        // The text was written with six digits, and the shelf is less than 20 mm long.
        let far = same.vertices.iter().zip(&shelf.vertices).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(far <= tolerance_mm, "{name}: {far} mm");
    }
    let binary = mesh_of(&named(&folder, "bunny_99.stl")).unwrap();
    let text = mesh_of(&named(&folder, "bunny_99_ascii.stl")).unwrap();
    // Decimal text is read as f64, the binary file holds f32: one rounding apart, relative 2^-24.
    for (a, b) in text.vertices.iter().zip(&binary.vertices) {
        assert!((a - b).norm() <= 1.2e-7 * b.coords.norm(), "{a} {b}");
    }
}

#[test]
fn clouds_keep_what_their_programs_wrote() {
    let Some(folder) = odd_files() else { return };
    for (name, points, colours, normals, scalars) in [
        ("ripple_bin.ply", 10_201, true, true, 0),
        ("train-1000.ply", 1000, false, true, 56),
        ("ply_points_bin.ply", 8, false, true, 0),
        ("points_ascii_with_lists.ply", 5, false, false, 0),
        ("multi.ply", 4, true, false, 2),
    ] {
        let cloud = cloud_of(&named(&folder, name)).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(cloud.len(), points, "{name}");
        assert_eq!((cloud.colours.is_some(), cloud.normals.is_some()), (colours, normals), "{name}");
        assert_eq!(cloud.scalars.len(), scalars, "{name}");
    }
    // Coordinates of a map: five kilometres from the origin is no part.
    for name in ["points_agisoft.xyz", "points_cloudcompare.xyz"] {
        let refused = cloud_of(&named(&folder, name)).unwrap_err().to_string();
        assert!(refused.contains("5648349.895035 mm") && refused.contains("unit of the file"), "{refused}");
    }
}

#[test]
fn faults_are_told_with_their_line() {
    let Some(folder) = odd_files() else { return };
    let refused = |name: &str| diagnostic(mesh_of(&named(&folder, name)).unwrap_err());
    assert_eq!(refused("invalid_index.obj").line, Some(12));
    let surplus = diagnostic(cloud_of(&named(&folder, "points_emptyascii.ply")).unwrap_err());
    assert_eq!(surplus.line, Some(23));
    assert!(refused("points_agisoft.xyz").help.unwrap().contains("STL"));
    assert!(refused("emptyIO__stl_empty_bin.stl").message.contains("no faces"));
}

#[test]
fn small_valid_files_of_other_systems_are_read() {
    let folder = own_odd_files();
    for (name, triangles) in
        [("text_crlf.stl", 2), ("binary_named_solid.stl", 1), ("crlf.ply", 1), ("crlf_quad.obj", 2)]
    {
        let mesh = mesh_of(&folder.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(mesh.triangles.len(), triangles, "{name}");
    }
    let cloud = cloud_of(&folder.join("vertex_nan.ply")).expect("a cloud may have gaps");
    assert_eq!((cloud.len(), cloud.skipped_invalid), (2, 1));
}

#[test]
fn small_broken_files_are_refused_with_their_fault_and_place() {
    let folder = own_odd_files();
    for (name, as_mesh, cut_off, line, words) in [
        ("text_cut_off.stl", true, true, Some(12), "expected a coordinate"),
        (
            "binary_counts_too_many.stl",
            true,
            true,
            None,
            "counts 3 facets, which makes 234 bytes, but the file has 134",
        ),
        ("vertex_nan.stl", true, false, Some(5), "coordinate NaN, expected a finite number"),
        ("count_huge.ply", false, true, Some(3), "of 18446744073709551615 points"),
        ("count_four_of_three.ply", false, true, Some(10), "ends after 3 of 4 points"),
        ("type_unknown.ply", false, false, Some(6), "\"half\" found, expected a number type"),
        ("vertex_nan.ply", true, false, None, "1 vertices with a coordinate that is not finite"),
        ("corner_out_of_range.ply", true, false, Some(13), "face names vertex 7, expected 0 to 2"),
        ("index_zero.obj", true, false, Some(4), "face names vertex 0, expected 1 to 3 or -3 to -1"),
        ("decimal_comma.txt", false, false, Some(1), "\"1,5\" found, expected a number"),
        ("decimal_comma.csv", false, false, Some(2), "\"1,5\" found, expected a number"),
        ("count_too_many.pts", false, true, Some(3), "2 points found, expected 3 as line 1 says"),
        ("row_short.xyz", false, false, Some(2), "2 columns found, expected 3"),
        ("empty.xyz", false, true, None, "the file is empty"),
    ] {
        let file = folder.join(name);
        let read = if as_mesh { mesh_of(&file).map(drop) } else { cloud_of(&file).map(drop) };
        let error = read.expect_err(name);
        assert_eq!(matches!(error, ReadError::CutOff(_)), cut_off, "{name}");
        let told = diagnostic(error);
        assert_eq!(told.line, line, "{name}: {told}");
        assert!(told.message.contains(words), "{name}: {told}");
    }
}
