//! Every odd, broken and valid file of other programs' tests is read, or refused with a message and a help.
//!
//! The files are not part of the project: `SHAPELINE_REFERENCE_DATA` names the folder that has them in `odd_files/`.

use shapeline::diagnostic::{Diagnostic, ReadError};
use shapeline::geometry::{LengthUnit, Mesh, PointCloud};
use shapeline::io::{read_cloud, read_file, read_mesh};
use shapeline::run::RunContext;
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};

/// The folder, when somebody named one.
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

#[test]
fn every_odd_file_is_read_or_refused_with_help() {
    let Some(folder) = odd_files() else { return };
    let files = all_files(&folder);
    assert!(files.len() >= 100, "only {} files in {}", files.len(), folder.display());
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
