//! A view that is ready, as a file: what is known of it, its points, and a hash over both.

use crate::diagnostic::Diagnostic;
use crate::geometry::{Isometry3, Point3};
use crate::io;
use crate::plan::merge::Metric;
use crate::report::atomic;
use crate::run::RunContext;
use crate::stitch::{Conditioned, NoStart, PointCounts, Ready, StitchError, View, ViewFacts};
use nalgebra::{Quaternion, Translation3, UnitQuaternion};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// What every such file begins with; the number changes with the layout.
const MAGIC: &[u8] = b"shapeline-view-2\n";
/// Letters of a SHA-256, which end the file.
const HASH: usize = 64;

/// What is told before the points.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Header {
    settings: String,
    name: String,
    sha256: String,
    index: usize,
    sensor: [f64; 3],
    points: usize,
    columns: Vec<String>,
    read: usize,
    invalid: usize,
    masked: usize,
    masked_by: Vec<(String, usize)>,
    noise: usize,
    averaged: usize,
    unjudged: usize,
    size: f64,
    middle: Option<[f64; 3]>,
    d_grid: Option<f64>,
    start: Start,
}

/// What is known of the pose.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
enum Start {
    At { rotation: [f64; 4], translation: [f64; 3] },
    Unknown,
    Refused(String),
}

/// Of what a stored view is made.
#[derive(Debug, Clone, Copy)]
pub(super) struct Origin<'a> {
    /// A hash over all settings that have a say in it.
    pub settings: &'a str,
    /// Its place in the order of names.
    pub index: usize,
    /// Its file's name.
    pub name: &'a str,
    /// SHA-256 of its file.
    pub sha256: &'a str,
}

/// A view that is put away.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Stored {
    path: PathBuf,
    header: Header,
}

/// Whether a file is one of these.
pub(super) fn is_ours(path: &Path) -> bool {
    let mut start = [0; MAGIC.len()];
    let read = std::fs::File::open(path).and_then(|mut file| std::io::Read::read_exact(&mut file, &mut start));
    read.is_ok() && start == MAGIC
}

/// Writes a view with what is known of it; its points are in `ready`.
///
/// # Errors
/// What the disk says, or that the job was stopped.
pub(super) fn store(
    path: &Path,
    of: Origin,
    ready: &Ready,
    facts: &ViewFacts,
    run: &RunContext,
) -> Result<Stored, StitchError> {
    let view = &ready.conditioned.view;
    let header = header(of, ready, facts);
    let text = serde_json::to_vec(&header).map_err(|e| Diagnostic::error(e.to_string()).in_file(path))?;
    let mut bytes = Vec::with_capacity(MAGIC.len() + 8 + text.len() + payload(&header).unwrap_or(0) + HASH);
    bytes.extend_from_slice(MAGIC);
    bytes.extend((text.len() as u64).to_le_bytes());
    bytes.extend(text);
    view.positions.iter().for_each(|p| p.iter().for_each(|c| bytes.extend(c.to_le_bytes())));
    view.columns.values().for_each(|values| values.iter().for_each(|v| bytes.extend(v.to_le_bytes())));
    let sha256 = io::sha256_of(&bytes, run)?;
    bytes.extend(sha256.as_bytes());
    atomic::write(path, &bytes)?;
    Ok(Stored { path: path.to_path_buf(), header })
}

fn header(of: Origin, ready: &Ready, facts: &ViewFacts) -> Header {
    let Conditioned { view, counts } = &ready.conditioned;
    let start = match &ready.start {
        Ok(pose) => Start::At { rotation: pose.rotation.coords.into(), translation: pose.translation.vector.into() },
        Err(NoStart::Unknown) => Start::Unknown,
        Err(NoStart::Refused(why)) => Start::Refused(why.clone()),
    };
    Header {
        settings: of.settings.to_owned(),
        name: of.name.to_owned(),
        sha256: of.sha256.to_owned(),
        index: of.index,
        sensor: view.sensor.coords.into(),
        points: view.positions.len(),
        columns: view.columns.keys().map(|metric| metric.key().to_owned()).collect(),
        read: counts.points_read,
        invalid: counts.points_invalid,
        masked: counts.points_masked,
        masked_by: counts.masked_by.iter().map(|(key, count)| ((*key).to_owned(), *count)).collect(),
        noise: counts.points_noise,
        averaged: counts.points_averaged,
        unjudged: counts.points_unjudged,
        size: facts.size,
        middle: facts.middle.map(|p| p.coords.into()),
        d_grid: facts.d_grid,
        start,
    }
}

/// Bytes of the points and their columns.
fn payload(header: &Header) -> Option<usize> {
    header.points.checked_mul(header.columns.len().checked_mul(4)?.checked_add(24)?)
}

/// The header of a file's bytes, and where its points begin; nothing where it is not whole.
fn parse(bytes: &[u8]) -> Option<(Header, usize)> {
    let rest = bytes.strip_prefix(MAGIC)?;
    let length = usize::try_from(u64::from_le_bytes(rest.get(..8)?.try_into().ok()?)).ok()?;
    let header: Header = serde_json::from_slice(rest.get(8..length.checked_add(8)?)?).ok()?;
    let begin = MAGIC.len() + 8 + length;
    let whole = begin.checked_add(payload(&header)?)?.checked_add(HASH)? == bytes.len();
    let known = header.columns.iter().all(|key| Metric::of_key(key).is_some());
    (whole && known).then_some((header, begin))
}

/// A view that an earlier run put away, if it is whole, of the same settings and of the same file.
pub(super) fn find(path: &Path, of: Origin, run: &RunContext) -> Result<Option<Stored>, StitchError> {
    if !is_ours(path) {
        return Ok(None);
    }
    let bytes = io::read_file_while(path, run)?;
    let Some((header, _)) = parse(&bytes) else { return Ok(None) };
    let (content, hash) = bytes.split_at(bytes.len() - HASH);
    let same = header.settings == of.settings
        && header.name == of.name
        && header.sha256 == of.sha256
        && header.index == of.index;
    if !same || io::sha256_of(content, run)?.as_bytes() != hash {
        return Ok(None);
    }
    Ok(Some(Stored { path: path.to_path_buf(), header }))
}

impl Stored {
    /// Bytes of its points in memory.
    pub fn size(&self) -> u64 {
        payload(&self.header).unwrap_or(0) as u64
    }

    /// The view without its points.
    pub fn ready(&self) -> Ready {
        let header = &self.header;
        let masked_by = header.masked_by.iter().filter_map(|(key, n)| Some((Metric::of_key(key)?.key(), *n))).collect();
        let counts = PointCounts {
            points_read: header.read,
            points_invalid: header.invalid,
            points_masked: header.masked,
            masked_by,
            points_noise: header.noise,
            points_averaged: header.averaged,
            points_kept: header.points,
            points_unjudged: header.unjudged,
        };
        let start = match &header.start {
            Start::At { rotation, translation } => {
                let rotation = UnitQuaternion::new_unchecked(Quaternion::from(*rotation));
                Ok(Isometry3::from_parts(Translation3::from(*translation), rotation))
            }
            Start::Unknown => Err(NoStart::Unknown),
            Start::Refused(why) => Err(NoStart::Refused(why.clone())),
        };
        Ready { index: header.index, conditioned: Conditioned { view: self.empty(), counts }, start }
    }

    /// What must be known of its points.
    pub fn facts(&self) -> ViewFacts {
        let header = &self.header;
        ViewFacts { size: header.size, middle: header.middle.map(Point3::from), d_grid: header.d_grid }
    }

    fn metrics(&self) -> impl Iterator<Item = Metric> {
        self.header.columns.iter().filter_map(|key| Metric::of_key(key))
    }

    fn empty(&self) -> View {
        let columns = self.metrics().map(|metric| (metric, Vec::new())).collect();
        let (name, sensor) = (self.header.name.clone(), Point3::from(self.header.sensor));
        View { name, positions: Vec::new(), columns, pixels: None, sensor }
    }

    /// The view with its points.
    ///
    /// # Errors
    /// The file is gone or not what was written, or the job was stopped.
    pub fn view(&self, run: &RunContext) -> Result<View, StitchError> {
        let bytes = io::read_file_while(&self.path, run)?;
        let begin = parse(&bytes).filter(|(header, _)| *header == self.header).map(|(_, begin)| begin);
        let Some(begin) = begin else {
            let message = format!("the view {} that was put away here is not as it was written", self.header.name);
            let help = "run the same command again, and let no other program write into this folder";
            return Err(Diagnostic::error(message).in_file(&self.path).with_help(help).into());
        };
        let (places, values) = bytes[begin..bytes.len() - HASH].split_at(24 * self.header.points);
        let mut view = self.empty();
        let number = |bytes: &[u8]| f64::from_le_bytes(std::array::from_fn(|k| bytes[k]));
        let place = |p: &[u8]| Point3::new(number(p), number(&p[8..]), number(&p[16..]));
        view.positions = places.chunks_exact(24).map(place).collect();
        let mut columns = values.chunks_exact((4 * self.header.points).max(1));
        for metric in self.metrics() {
            let own = columns.next().unwrap_or_default();
            let own = own.chunks_exact(4).map(|v| f32::from_le_bytes(std::array::from_fn(|k| v[k])));
            view.columns.insert(metric, own.collect());
        }
        Ok(view)
    }
}
