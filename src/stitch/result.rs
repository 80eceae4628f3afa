//! All that is known of a merge once it is done.

use super::merging::Merged;
use super::place::PlacedViews;
use std::path::Path;

/// A file with its content.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileIdentity {
    /// Its name, without its folder: the same merge gives the same report wherever it lies.
    pub file: String,
    /// SHA-256 of its bytes, lower-case hex.
    pub sha256: String,
}

impl FileIdentity {
    /// Of a path.
    pub fn new(path: &Path, sha256: String) -> Self {
        Self { file: path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default(), sha256 }
    }
}

/// What a merge was made of beside its views.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct MergeIdentity {
    /// `MERGE.toml`.
    pub merge: Option<FileIdentity>,
    /// The poses before.
    pub poses: Option<FileIdentity>,
    /// The CAD by which views were pre-aligned.
    pub cad: Option<FileIdentity>,
    /// Features of the camera's calibration, with how many.
    pub camera: Option<(FileIdentity, usize)>,
    /// The same of the projector.
    pub projector: Option<(FileIdentity, usize)>,
}

/// A file of the folder of views.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewFile {
    /// Its name.
    pub name: String,
    /// SHA-256 of its bytes; nothing where it could not be read.
    pub sha256: Option<String>,
    /// What became of it.
    pub end: ViewEnd,
}

/// What became of a file.
#[derive(Debug, Clone, PartialEq)]
pub enum ViewEnd {
    /// It was made ready: this one of [`PlacedViews`].
    Ready(usize),
    /// It cannot be used, for this reason.
    Unusable(String),
}

/// A merge that is done.
#[derive(Debug, Clone, PartialEq)]
pub struct MergeResult {
    /// What it was made of.
    pub identity: MergeIdentity,
    /// All files, in the order of names.
    pub files: Vec<ViewFile>,
    /// The views in their places.
    pub placed: PlacedViews,
    /// The cloud.
    pub merged: Merged,
}

impl MergeResult {
    /// Names and reasons of the views that are not in the cloud.
    pub fn left_out(&self) -> impl Iterator<Item = (&str, &str)> {
        self.files.iter().filter_map(|file| Some((file.name.as_str(), self.why_left_out(file)?)))
    }

    /// Why a view is not in the cloud, if it is not.
    pub fn why_left_out<'a>(&'a self, file: &'a ViewFile) -> Option<&'a str> {
        match &file.end {
            ViewEnd::Unusable(why) => Some(why),
            ViewEnd::Ready(k) => match &self.placed.outcomes[*k] {
                super::Outcome::LeftOut(why) => Some(why),
                super::Outcome::Placed(_) => None,
            },
        }
    }

    /// Points of each file that are in the cloud.
    pub fn points_out(&self) -> Vec<usize> {
        let mut counts = vec![0; self.files.len()];
        for view in &self.merged.view {
            if let Some(count) = usize::try_from(*view).ok().and_then(|view| counts.get_mut(view)) {
                *count += 1;
            }
        }
        counts
    }
}
