//! From the CAD file to the part, by way of the cache.

use super::{Part, PartSettings, cache};
use crate::diagnostic::ReadError;
use crate::io;
use crate::plan::CadSettings;
use crate::run::{RunContext, Stage};
use std::path::Path;

/// Whether the cache served.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CacheUse {
    /// The part came from the cache.
    Loaded,
    /// There was no cache, or it belonged to something else, or it was damaged: the part was prepared, and the cache written anew where
    /// that was possible.
    Built,
}

/// The part of a CAD file. Reads and hashes the file's bytes; takes the part from `cache_file` when that was made of the same bytes, unit and
/// settings by the same version, else prepares it and writes `cache_file` (failing to write is not an error). With `None` nothing is
/// cached. Errors name the CAD file; whatever is wrong with the cache never is an error.
pub fn load_or_prepare(
    cad: &CadSettings,
    settings: &PartSettings,
    cache_file: Option<&Path>,
    run: &RunContext,
) -> Result<(Part, CacheUse), ReadError> {
    run.enter(Stage::Prepare)?;
    let bytes = io::read_file(&cad.path)?;
    let cad_sha256 = io::sha256_hex(&bytes);
    let key = cache::key(&cad_sha256, cad.unit, settings);
    if let Some(part) = cache_file.and_then(|file| cache::load(file, &key)) {
        return Ok((part, CacheUse::Loaded));
    }
    run.check()?;
    let mesh = io::read_mesh(&bytes, &cad.path, cad.unit, run)?;
    let part = Part::prepare(mesh, cad_sha256, settings, run).map_err(|error| match error {
        ReadError::Bad(diagnostic) => diagnostic.in_file(&cad.path).into(),
        other => other,
    })?;
    if let Some(file) = cache_file {
        // A folder that cannot be written costs the time of preparing again, nothing else.
        let _ = cache::store(file, &key, &part);
    }
    Ok((part, CacheUse::Built))
}
