//! The scans of a plan: which files, in which order, taken when.

use super::merge::part_folder;
use super::watch::Listed;
use crate::diagnostic::{Diagnostic, os_words};
use crate::plan::{ScanOrder, ScanSettings, Taken};
use std::path::Path;
use std::time::SystemTime;

/// Whether links in the folder count as files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Links {
    /// A link to a file is a file.
    Follow,
    /// Links are left alone: nobody lays one into a watched folder by honest means.
    Ignore,
}

/// Hidden files are programs' own affairs (copies under way, other systems' side files), unless the pattern names them.
pub(super) const MATCHING: glob::MatchOptions =
    glob::MatchOptions { case_sensitive: true, require_literal_separator: true, require_literal_leading_dot: true };

/// Lists the scans of the plan's folder, in the plan's order; of a plan with views the folders of parts, each as one scan. The plan's CAD is none. Files that end in `.part` are still being written and
/// are left out.
pub fn list_scans(settings: &ScanSettings, links: Links) -> Result<Vec<Listed>, Diagnostic> {
    let pattern = glob::Pattern::new(&settings.pattern)
        .map_err(|e| Diagnostic::error(format!("pattern \"{}\": {e}", settings.pattern)))?;
    let folder = std::fs::read_dir(&settings.path).map_err(|e| {
        Diagnostic::error(format!("the scan folder cannot be read: {}", os_words(&e)))
            .in_file(&settings.path)
            .with_help("see whether the share is connected, and whether the plan names the right folder")
    })?;
    let mut files = Vec::new();
    for entry in folder.flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if !pattern.matches_with(&name, MATCHING) || name.to_ascii_lowercase().ends_with(".part") {
            continue;
        }
        let path = entry.path();
        if is_cad(settings, &path) {
            continue;
        }
        if settings.views.is_some() {
            // One part a folder; a link to one is left alone where links are.
            let is_link = || std::fs::symlink_metadata(&path).is_ok_and(|m| m.is_symlink());
            if path.is_dir() && (links == Links::Follow || !is_link()) {
                files.extend(part_folder::listed(&path));
            }
            continue;
        }
        let metadata = match links {
            Links::Follow => std::fs::metadata(&path),
            Links::Ignore => std::fs::symlink_metadata(&path),
        };
        match metadata {
            Ok(m) if m.is_file() => files.push(Listed { path, size: m.len(), modified: m.modified().ok() }),
            _ => {}
        }
    }
    sort(&mut files, settings.order);
    Ok(files)
}

/// Whether a file is the plan's CAD. A copy of that under another name is told by its content when it is read.
fn is_cad(settings: &ScanSettings, file: &Path) -> bool {
    let Some(cad) = settings.cad.as_deref().filter(|cad| cad.file_name() == file.file_name()) else { return false };
    match (std::fs::canonicalize(cad), std::fs::canonicalize(file)) {
        (Ok(cad), Ok(file)) => cad == file,
        _ => false,
    }
}

/// Puts files into the plan's order.
pub fn sort(files: &mut [Listed], order: ScanOrder) {
    match order {
        ScanOrder::Name => files.sort_by(|a, b| a.path.cmp(&b.path)),
        ScanOrder::Modified => {
            files.sort_by(|a, b| a.modified.cmp(&b.modified).then_with(|| a.path.cmp(&b.path)));
        }
    }
}

/// The date of a scan as the plan asks for it, ISO 8601; the error says in words why the name gave none.
pub fn taken(taken: &Taken, path: &Path) -> Result<Option<String>, String> {
    match taken {
        Taken::None => Ok(None),
        Taken::Name(format) => {
            let stem = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
            let moment = jiff::civil::DateTime::strptime(format, &stem)
                .map(|t| t.to_string())
                .or_else(|_| jiff::civil::Date::strptime(format, &stem).map(|d| d.to_string()));
            moment.map(Some).map_err(|_| format!("the name \"{stem}\" does not match [scans] taken \"name:{format}\""))
        }
        Taken::Modified => {
            let modified = std::fs::metadata(path).and_then(|m| m.modified()).map_err(|e| e.to_string())?;
            Ok(Some(iso_utc(modified)?))
        }
    }
}

fn iso_utc(time: SystemTime) -> Result<String, String> {
    let timestamp = jiff::Timestamp::try_from(time).map_err(|e| e.to_string())?;
    Ok(timestamp.round(jiff::Unit::Second).map_err(|e| e.to_string())?.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_date_comes_from_the_name() {
        let by_name = Taken::Name("press2_%Y%m%d_%H%M%S".into());
        let date = taken(&by_name, Path::new("x/press2_20260314_153000.ply")).unwrap();
        assert_eq!(date.as_deref(), Some("2026-03-14T15:30:00"));
        assert!(taken(&by_name, Path::new("x/0007.ply")).unwrap_err().contains("0007"));
        assert_eq!(taken(&Taken::None, Path::new("x/0007.ply")), Ok(None));
    }

    #[test]
    fn listing_takes_the_pattern_and_leaves_parts_and_folders() {
        let dir = tempfile::tempdir().unwrap();
        for name in ["b.ply", "a.ply", "c.ply.part", "d.txt", "._a.ply", "part.ply"] {
            std::fs::write(dir.path().join(name), b"x").unwrap();
        }
        std::fs::create_dir(dir.path().join("e.ply")).unwrap();
        let settings = ScanSettings {
            folder: "x".into(),
            path: dir.path().to_path_buf(),
            pattern: "*.p*y*".into(),
            cad: Some(dir.path().join(".").join("part.ply")),
            unit: crate::plan::LengthUnit::Mm,
            order: ScanOrder::Name,
            taken: Taken::None,
            view_direction: None,
            views: None,
        };
        let names: Vec<_> = list_scans(&settings, Links::Follow)
            .unwrap()
            .iter()
            .map(|l| l.path.file_name().unwrap().to_string_lossy().into_owned())
            .collect();
        assert_eq!(names, ["a.ply", "b.ply"]);
    }
}
