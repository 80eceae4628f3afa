//! The bundled demo project, inside the program: plan, CAD and scans in one folder.
//!
//! The files are made by `simulate::demo`; here they only lie.

use crate::diagnostic::Diagnostic;
use crate::report::atomic;
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// The demo's plan as it lies in the repository.
const PLAN: &str = include_str!("../settings/demo.toml");
/// Where the plan in the repository finds its files.
const REPOSITORY_FOLDER: &str = "../assets/demo/";

/// The demo's files as (path with `/` relative to the demo's folder, content): `demo.toml`, `bracket.stl` and `scans/`.
///
/// The scans: a good part from the top, a good part from the bottom, a part out of tolerance in three points, a part with
/// a flange sunk into the belt, and a file that ends in the middle of a point.
pub fn files() -> Vec<(&'static str, Cow<'static, [u8]>)> {
    let plan = PLAN.replace(REPOSITORY_FOLDER, "").replace("settings/demo.toml", "demo.toml");
    vec![
        ("demo.toml", Cow::Owned(plan.into_bytes())),
        ("bracket.stl", Cow::Borrowed(include_bytes!("../assets/demo/bracket.stl"))),
        ("scans/01_good_top.ply", Cow::Borrowed(include_bytes!("../assets/demo/scans/01_good_top.ply"))),
        ("scans/02_good_bottom.ply", Cow::Borrowed(include_bytes!("../assets/demo/scans/02_good_bottom.ply"))),
        (
            "scans/03_out_of_tolerance.ply",
            Cow::Borrowed(include_bytes!("../assets/demo/scans/03_out_of_tolerance.ply")),
        ),
        ("scans/04_flange_on_belt.ply", Cow::Borrowed(include_bytes!("../assets/demo/scans/04_flange_on_belt.ply"))),
        ("scans/05_cut_off.ply", Cow::Borrowed(include_bytes!("../assets/demo/scans/05_cut_off.ply"))),
    ]
}

/// Writes into the folder what of the demo is not there yet; returns its plan. What somebody changed stays as it is.
pub fn unpack(folder: &Path) -> Result<PathBuf, Diagnostic> {
    for (name, bytes) in files() {
        let path = folder.join(name);
        if path.exists() {
            continue;
        }
        let parent = path.parent().unwrap_or(folder);
        std::fs::create_dir_all(parent)
            .map_err(|e| Diagnostic::error(format!("the folder cannot be made: {e}")).in_file(parent))?;
        atomic::write(&path, &bytes)?;
    }
    Ok(folder.join("demo.toml"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::LengthUnit;
    use crate::run::RunContext;

    #[test]
    fn the_folder_is_a_project_of_its_own_and_only_the_last_scan_is_broken() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("scans")).unwrap();
        let files = files();
        for (path, content) in &files {
            std::fs::write(folder.path().join(path), content).unwrap();
        }
        let loaded = crate::plan::load(&folder.path().join("demo.toml"));
        assert!(loaded.problems.is_empty(), "{:?}", loaded.problems);
        let plan = loaded.plan.unwrap();
        assert_eq!(plan.cad.path, folder.path().join("bracket.stl"));
        assert_eq!(plan.scans.path, folder.path().join("scans"));
        for (path, content) in files.iter().filter(|(path, _)| path.ends_with(".ply")) {
            let read = crate::io::read_cloud(content, Path::new(path), LengthUnit::Mm, &RunContext::silent());
            assert_eq!(read.is_err(), path.contains("cut_off"), "{path}");
        }
        assert!(files.iter().map(|(_, content)| content.len()).sum::<usize>() < 12_000_000);
    }
}
