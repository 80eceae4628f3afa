//! From the CAD file to the part, by way of the cache.

use super::{Part, PartSettings, cache};
use crate::diagnostic::ReadError;
use crate::io;
use crate::plan::CadSettings;
use crate::run::{RunContext, Stage};
use std::path::Path;

/// Whether the cache served.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CacheUse {
    /// The part came from the cache.
    Loaded,
    /// There was no cache, or it belonged to something else, or it was damaged: the part was prepared and the cache written anew.
    Built,
    /// The part was prepared, but the cache could not be written, in the system's words; every start prepares it again.
    NotStored(String),
    /// The part was prepared, and nobody asked for a cache.
    NotWanted,
}

/// The part of a CAD file. Reads and hashes the file's bytes; takes the part from `cache_file` when that was made of the same bytes, unit and
/// settings by the same version, else prepares it and writes `cache_file` (failing to write is told, no error). With `None` nothing is
/// cached. Errors name the CAD file; whatever is wrong with the cache never is an error.
pub fn load_or_prepare(
    cad: &CadSettings,
    settings: &PartSettings,
    cache_file: Option<&Path>,
    run: &RunContext,
) -> Result<(Part, CacheUse), ReadError> {
    run.enter(Stage::Prepare)?;
    let bytes = io::read_file_while(&cad.path, run)?;
    let cad_sha256 = io::sha256_hex(&bytes);
    let key = cache::key(&cad_sha256, cad.unit, settings);
    if let Some(part) = cache_file.and_then(|file| cache::load(file, &key, &cad_sha256, settings)) {
        return Ok((part, CacheUse::Loaded));
    }
    run.check()?;
    let mesh = io::read_mesh(&bytes, &cad.path, cad.unit, run)?;
    let part = Part::prepare(mesh, cad_sha256, settings, run).map_err(|error| match error {
        ReadError::Bad(diagnostic) => diagnostic.in_file(&cad.path).into(),
        other => other,
    })?;
    run.check()?;
    // A folder that cannot be written costs the time of preparing again, nothing else.
    let cache_use = cache_file.map_or(CacheUse::NotWanted, |file| match cache::store(file, &key, &part) {
        Ok(()) => CacheUse::Built,
        Err(error) => CacheUse::NotStored(error.to_string()),
    });
    Ok((part, cache_use))
}
