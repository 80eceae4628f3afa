//! The tables of `MERGE.toml`: what is read, how it is registered, what is written.

use super::model::*;
use super::{ViewsOf, quality, schema};
use crate::geometry::{LengthUnit, Point3};
use crate::plan::CadSettings;
use crate::plan::reader::{Entry, NumberRule, TableReader, quoted};
use crate::plan::sections::{cad, scan_pattern};
use crate::plan::suggest::list_or;
use crate::plan::values::{UNITS, location, triple};
use std::path::Path;

/// Lengths in the views' unit.
pub(super) struct Length;

impl Length {
    /// No view of any unit has numbers this large.
    pub const LARGEST: f64 = 1e9;
}

/// A length that is there.
pub(super) const LENGTH: NumberRule =
    NumberRule { expected: "a length in the views' unit above 0", accepts: |v| v > 0.0 && v <= Length::LARGEST };

/// The keys of each table, to say where a key belongs that stands in the wrong one.
const HOMES: [(&str, &[&str]); 9] = [
    ("[views]", &["folder", "pattern", "prealign", "poses", "sensor"]),
    ("[calibration]", &["camera", "projector"]),
    ("[delta_n]", &["normal_radius", "mean_radius"]),
    ("[noise]", &["neighbours", "sigmas"]),
    ("[density]", &["cell"]),
    ("[registration]", &["enabled", "translation_sigma", "rotation_sigma_deg"]),
    ("[merge]", &["metric", "radius_grid", "radius"]),
    ("[[feature]]", &["kind", "name", "radius", "radius_u"]),
    ("[output]", &["file", "report", "report_pdf", "compare_with"]),
];

/// Refuses unknown keys; a key of another table is told its home.
pub(super) fn finish(table: TableReader<'_>) {
    table.finish(|key, _| {
        let homes: Vec<&str> = HOMES.iter().filter(|(_, keys)| keys.contains(&key)).map(|(home, _)| *home).collect();
        (!homes.is_empty())
            .then(|| (format!("unknown key \"{key}\""), format!("{key} belongs in {}", list_or(&homes, ""))))
    });
}

/// A number that may be left out. The outer `None`: it is wrong.
pub(super) fn optional(table: &TableReader<'_>, key: &'static str, rule: NumberRule) -> Option<Option<f64>> {
    table.optional(key).map_or(Some(None), |entry| entry.number(rule).map(Some))
}

/// The whole file.
pub(super) fn root(
    root: TableReader<'_>,
    path: &Path,
    sha256: &str,
    look_for_files: Option<ViewsOf>,
) -> Option<MergePlan> {
    let folder = path.parent().unwrap_or(Path::new(""));
    schema(&root);
    let unit = root.required("unit", "the unit of the views and of every length here", "write unit = \"um\"");
    let unit = unit.and_then(unit_of);
    let views = views_and_cad(&root, folder);
    let masks = root.section("mask").map_or(Some(Vec::new()), quality::masks);
    let calibration = root.section("calibration");
    let calibration =
        calibration.map_or(Some(CalibrationSettings::default()), |table| self::calibration(table, folder));
    let non_uniformity =
        root.section("delta_n").map_or(Some(NonUniformitySettings::default()), quality::non_uniformity);
    let noise = root.section("noise").map_or(Some(None), |table| quality::noise(table).map(Some));
    let density = root.section("density").map_or(Some(None), |table| quality::density(table).map(Some));
    let registration = root.section("registration").map_or(Some(RegistrationSettings::default()), registration);
    let merge = quality::merge(root.section("merge"));
    let features = root.sections("feature", "[[feature]]");
    let named = features.len();
    let features: Vec<MergeFeature> =
        features.into_iter().zip(1..).filter_map(|(table, k)| quality::feature(table, k)).collect();
    let output = output(root.section("output"), folder);
    if let Some(whose) = look_for_files {
        tell_missing_files(whose, &root, views.as_ref(), calibration.as_ref(), output.as_ref());
    }
    finish(root);
    Some(MergePlan {
        path: path.to_path_buf(),
        sha256: sha256.to_owned(),
        unit: unit?,
        views: views?,
        masks: masks?,
        calibration: calibration?,
        non_uniformity: non_uniformity?,
        noise: noise?,
        density: density?,
        registration: registration?,
        merge: merge?,
        features: (features.len() == named).then_some(features)?,
        output: output?,
    })
}

/// A unit; what people write who have the letter for a micrometre is taken too, the sign as well as the Greek letter.
fn unit_of(entry: Entry<'_>) -> Option<LengthUnit> {
    match entry.text()? {
        "\u{b5}m" | "\u{3bc}m" => Some(LengthUnit::Um),
        _ => entry.choice(&UNITS),
    }
}

fn place_of(file: &str, folder: &Path, line: usize) -> NamedFile {
    NamedFile { file: file.to_owned(), path: folder.join(file), line }
}

/// A file that may be left out. The outer `None`: it is wrong.
fn named_file(entry: Option<Entry<'_>>, folder: &Path) -> Option<Option<NamedFile>> {
    let Some(entry) = entry else { return Some(None) };
    location(entry, folder).map(|(file, path)| Some(NamedFile { file, path, line: entry.line }))
}

fn views_left_out(folder: &Path) -> ViewSettings {
    ViewSettings {
        folder: place_of("views", folder, 1),
        pattern: "*.ply".to_owned(),
        prealign: Prealign::None,
        sensor: Point3::origin(),
    }
}

/// `[views]` and `[cad]`, which is for nothing but the views' pre-alignment.
fn views_and_cad(root: &TableReader<'_>, folder: &Path) -> Option<ViewSettings> {
    let cad = root.section("cad").map(|table| (table.line(), cad(table, folder).settings()));
    let views = match root.section("views") {
        Some(table) => views(table, folder, cad.as_ref().map(|(_, cad)| cad.as_ref())),
        None => Some(views_left_out(folder)),
    };
    if let (Some((line, _)), Some(views)) = (&cad, &views)
        && !matches!(views.prealign, Prealign::Cad(_))
    {
        let help = "write prealign = \"cad\" in [views], or remove [cad]";
        root.problems().warning(*line, "[cad]: found beside views that are not pre-aligned by it", help);
    }
    views
}

/// What `prealign` says.
#[derive(Clone, Copy, PartialEq)]
enum Way {
    Poses,
    Cad,
    None,
}

/// `[views]`; `cad` is `[cad]`, if it is there, and the inner one if it is sound.
fn views(table: TableReader<'_>, folder: &Path, cad: Option<Option<&CadSettings>>) -> Option<ViewSettings> {
    let line = table.line();
    let place = named_file(table.optional("folder"), folder)
        .map(|place| place.unwrap_or_else(|| place_of("views", folder, line)));
    let pattern = scan_pattern(&table);
    let sensor = match table.optional("sensor") {
        Some(entry) => triple(entry, "three coordinates", "[0.0, 0.0, 0.0]").map(Point3::from),
        None => Some(Point3::origin()),
    };
    let poses_entry = table.optional("poses");
    let poses = named_file(poses_entry, folder);
    let way_entry = table.optional("prealign");
    let way = match way_entry {
        Some(entry) => entry.choice(&[("poses", Way::Poses), ("cad", Way::Cad), ("none", Way::None)]),
        None => Some(if poses_entry.is_some() { Way::Poses } else { Way::None }),
    };
    if let (Some(entry), Some(Way::Cad | Way::None)) = (poses_entry, way) {
        let help = "write prealign = \"poses\", or remove the file";
        entry.wrong("found a file of poses beside another prealign", help);
    }
    let prealign = match way {
        Some(Way::Poses) => {
            let help = "write poses = \"views.json\", or prealign = \"none\"";
            table.required("poses", "the file of poses", help);
            poses.and_then(|poses| poses).map(Prealign::Poses)
        }
        Some(Way::Cad) => {
            if let (None, Some(entry)) = (cad, way_entry) {
                entry.wrong("found \"cad\" without a table [cad], expected one", "add [cad] with file and unit");
            }
            cad.flatten().cloned().map(Prealign::Cad)
        }
        Some(Way::None) => Some(Prealign::None),
        None => None,
    };
    finish(table);
    Some(ViewSettings { folder: place?, pattern: pattern?, prealign: prealign?, sensor: sensor? })
}

/// `[calibration]`.
fn calibration(table: TableReader<'_>, folder: &Path) -> Option<CalibrationSettings> {
    let camera = named_file(table.optional("camera"), folder);
    let projector = named_file(table.optional("projector"), folder);
    finish(table);
    Some(CalibrationSettings { camera: camera?, projector: projector? })
}

/// `[registration]`.
fn registration(table: TableReader<'_>) -> Option<RegistrationSettings> {
    const ANGLE: NumberRule =
        NumberRule { expected: "an angle in degrees above 0 and up to 180", accepts: |v| v > 0.0 && v <= 180.0 };
    let enabled = table.optional("enabled").map_or(Some(true), |entry| entry.truth());
    let translation_sigma = optional(&table, "translation_sigma", LENGTH);
    let rotation_sigma_deg = optional(&table, "rotation_sigma_deg", ANGLE);
    finish(table);
    Some(RegistrationSettings {
        enabled: enabled?,
        translation_sigma: translation_sigma?,
        rotation_sigma: rotation_sigma_deg?.map(f64::to_radians),
    })
}

/// `[output]`, or what holds without it.
fn output(table: Option<TableReader<'_>>, folder: &Path) -> Option<MergeOutput> {
    const MERGED: &str = "merged.ply";
    let Some(table) = table else {
        let file = place_of(MERGED, folder, 1);
        return Some(MergeOutput { file, report: None, report_pdf: None, compare_with: None });
    };
    let line = table.line();
    let file_entry = table.optional("file");
    let file = named_file(file_entry, folder).map(|file| file.unwrap_or_else(|| place_of(MERGED, folder, line)));
    if let (Some(entry), Some(file)) = (file_entry, &file)
        && !file.path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("ply"))
    {
        let words = format!("found {}, expected a name that ends with .ply", quoted(&file.file));
        entry.wrong(words, "the merged cloud is written as PLY: write file = \"merged.ply\"");
    }
    let report = named_file(table.optional("report"), folder);
    let report_pdf = named_file(table.optional("report_pdf"), folder);
    let compare_entry = table.optional("compare_with");
    let compare_with = named_file(compare_entry, folder);
    if let (Some(entry), Some(Some(earlier)), Some(file)) = (compare_entry, &compare_with, &file)
        && earlier.path == file.path
    {
        entry.wrong(
            "found the file that is written, expected an earlier one",
            "keep the earlier cloud under another name",
        );
    }
    finish(table);
    Some(MergeOutput { file: file?, report: report?, report_pdf: report_pdf?, compare_with: compare_with? })
}

/// Tells which of the named files are not there.
fn tell_missing_files(
    whose: ViewsOf,
    root: &TableReader<'_>,
    views: Option<&ViewSettings>,
    calibration: Option<&CalibrationSettings>,
    output: Option<&MergeOutput>,
) {
    const HELP: &str = "paths start at the folder of this file; check name and folder";
    let problems = root.problems();
    let missing = |what: &str, file: Option<&NamedFile>| {
        if let Some(file) = file.filter(|file| !file.path.is_file()) {
            problems.error(file.line, format!("{what}: found no file {}", file.path.display()), HELP);
        }
    };
    if let (ViewsOf::OwnFolder, Some(views)) = (whose, views) {
        if !views.folder.path.is_dir() {
            let words = format!("[views] folder: found no folder {}", views.folder.path.display());
            problems.error(views.folder.line, words, HELP);
        }
        if let Prealign::Poses(poses) = &views.prealign {
            missing("[views] poses", Some(poses));
        }
    }
    if let Some(Prealign::Cad(cad)) = views.map(|views| &views.prealign)
        && !cad.path.is_file()
    {
        let line = root.section("cad").map_or(1, |table| table.line());
        problems.error(line, format!("[cad] file: found no file {}", cad.path.display()), HELP);
    }
    if let Some(calibration) = calibration {
        missing("[calibration] camera", calibration.camera.as_ref());
        missing("[calibration] projector", calibration.projector.as_ref());
    }
    missing("[output] compare_with", output.and_then(|output| output.compare_with.as_ref()));
}
