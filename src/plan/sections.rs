//! The tables of the plan that hold settings: part, CAD, scans, background, rig, uncertainty, output.

use super::model::*;
use super::reader::{NumberRule, TableReader, describe_value, quoted, value_number};
use super::suggest::{list_or, nearest};
use super::values::{AT_LEAST_ZERO_MM, POSITIVE_MM, direction, line_of_text, location, name, unit};
use std::path::{Path, PathBuf};
use toml_edit::Value;

/// The keys of each table, to say where a key belongs that stands in the wrong one.
pub const HOMES: [(&str, &[&str]); 8] = [
    ("part", &["name", "number", "revision", "thickness_mm", "decision", "cad_side"]),
    ("cad", &["file", "unit"]),
    ("scans", &["folder", "pattern", "unit", "order", "taken", "view_direction", "views"]),
    ("background", &["belt_plane", "belt_clearance_mm", "belt_colours", "colour_tolerance", "luminance_min"]),
    ("alignment", &["method", "hole", "slot", "slot_reading", "point", "rps", "region", "freeze"]),
    (
        "rig",
        &[
            "distance_mm",
            "base_mm",
            "focal_mm",
            "pixel_um",
            "image_accuracy_px",
            "resolution_level",
            "point_spacing_mm",
        ],
    ),
    ("uncertainty", &["scale_ppm", "thickness_mm", "system_mm", "edge_offset_mm", "edge_offset_u_mm"]),
    ("output", &["folder", "formats", "map_range_mm"]),
];

/// Refuses unknown keys of a settings table; a key of another table is told its home.
pub(super) fn finish(table: TableReader<'_>) {
    table.finish(|key, _| {
        let homes: Vec<String> =
            HOMES.iter().filter(|(_, keys)| keys.contains(&key)).map(|(home, _)| format!("[{home}]")).collect();
        let words: Vec<&str> = homes.iter().map(String::as_str).collect();
        (!words.is_empty())
            .then(|| (format!("unknown key \"{key}\""), format!("{key} belongs in {}", list_or(&words, ""))))
    });
}

fn number_or(table: &TableReader<'_>, key: &'static str, rule: NumberRule, otherwise: f64) -> Option<f64> {
    match table.optional(key) {
        Some(entry) => entry.number(rule),
        None => Some(otherwise),
    }
}

fn text_or_empty(table: &TableReader<'_>, key: &'static str) -> Option<String> {
    match table.optional(key) {
        Some(entry) => line_of_text(entry).map(str::to_owned),
        None => Some(String::new()),
    }
}

fn choice_or<T: Copy>(
    table: &TableReader<'_>,
    key: &'static str,
    options: &[(&'static str, T)],
    otherwise: T,
) -> Option<T> {
    match table.optional(key) {
        Some(entry) => entry.choice(options),
        None => Some(otherwise),
    }
}

/// `[part]`.
pub(super) fn part(table: TableReader<'_>) -> Option<PartInfo> {
    let name =
        table.required("name", "the part's name", "write name = \"Bracket RH\"").and_then(name).map(str::to_owned);
    let number = text_or_empty(&table, "number");
    let revision = text_or_empty(&table, "revision");
    let decision = choice_or(
        &table,
        "decision",
        &[("iso14253", Decision::Iso14253), ("plain", Decision::Plain)],
        Decision::Iso14253,
    );
    let sides =
        [("top", CadSide::Top), ("bottom", CadSide::Bottom), ("middle", CadSide::Middle), ("solid", CadSide::Solid)];
    let cad_side = choice_or(&table, "cad_side", &sides, CadSide::Top);
    let thickness = if cad_side == Some(CadSide::Solid) {
        table.optional("thickness_mm")
    } else {
        let help = "write thickness_mm = 1.2, or 0 for no compensation";
        table.required("thickness_mm", "the thickness of the sheet in mm", help)
    };
    const SHEET_MM: NumberRule = NumberRule {
        expected: "the thickness of a sheet in mm, from 0 to 100",
        accepts: |v| (0.0..=100.0).contains(&v),
    };
    let thickness_mm = match thickness {
        Some(entry) => entry.number(SHEET_MM),
        None => Some(0.0),
    };
    finish(table);
    Some(PartInfo {
        name: name?,
        number: number?,
        revision: revision?,
        thickness_mm: thickness_mm?,
        decision: decision?,
        cad_side: cad_side?,
    })
}

/// `[cad]` as far as it could be read.
pub(super) struct CadRead {
    /// The file as written and resolved.
    file: Option<(String, PathBuf)>,
    unit: Option<LengthUnit>,
    /// Line on which the file is named.
    pub line: usize,
}

impl CadRead {
    /// Where the file is to be.
    pub fn path(&self) -> Option<&Path> {
        self.file.as_ref().map(|(_, path)| path.as_path())
    }

    /// The whole of it, if nothing is wrong.
    pub fn settings(self) -> Option<CadSettings> {
        let (file, path) = self.file?;
        Some(CadSettings { file, path, unit: self.unit? })
    }
}

/// `[cad]`.
pub(super) fn cad(table: TableReader<'_>, folder: &Path) -> CadRead {
    let entry = table.required("file", "the CAD file", "write file = \"bracket.stl\"");
    let line = entry.map_or(table.line(), |e| e.line);
    let file = entry.and_then(|entry| location(entry, folder));
    let unit = unit(&table);
    finish(table);
    CadRead { file, unit, line }
}

/// `[scans]`, with the line on which the folder is named.
pub(super) fn scans(table: TableReader<'_>, folder: &Path) -> Option<(ScanSettings, usize)> {
    let entry = table.optional("folder");
    let line = entry.map_or(table.line(), |e| e.line);
    let place = match entry {
        Some(entry) => location(entry, folder),
        None => Some(("scans".to_owned(), folder.join("scans"))),
    };
    let pattern = if table.optional("views").is_some() { part_pattern(&table) } else { scan_pattern(&table) };
    let unit = unit(&table);
    let order =
        choice_or(&table, "order", &[("name", ScanOrder::Name), ("modified", ScanOrder::Modified)], ScanOrder::Name);
    let taken = taken(&table);
    let view_direction = match table.optional("view_direction") {
        Some(entry) => direction(entry).map(Some),
        None => Some(None),
    };
    finish(table);
    let (folder, path) = place?;
    let scans = ScanSettings {
        folder,
        path,
        pattern: pattern?,
        cad: None,
        unit: unit?,
        order: order?,
        taken: taken?,
        view_direction: view_direction?,
        views: None,
    };
    Some((scans, line))
}

/// The settings of a plan without `[scans]`: scans are named on the command line.
pub(super) fn scans_left_out(folder: &Path) -> ScanSettings {
    ScanSettings {
        folder: "scans".to_owned(),
        path: folder.join("scans"),
        pattern: "*.ply".to_owned(),
        cad: None,
        unit: LengthUnit::Mm,
        order: ScanOrder::Name,
        taken: Taken::None,
        view_direction: None,
        views: None,
    }
}

/// Of the folders that hold a part's views each.
fn part_pattern(table: &TableReader<'_>) -> Option<String> {
    if table.optional("pattern").is_none() { Some("*".to_owned()) } else { scan_pattern(table) }
}

pub(super) fn scan_pattern(table: &TableReader<'_>) -> Option<String> {
    let Some(entry) = table.optional("pattern") else { return Some("*.ply".to_owned()) };
    let text = entry.text()?;
    if text.is_empty() || text.chars().any(|c| c.is_control() || c == '/' || c == '\\') {
        entry.wrong(
            format!("found {}, expected the names of files", quoted(text)),
            "write pattern = \"*.ply\", and the folder in folder",
        );
        return None;
    }
    if let Err(fault) = glob::Pattern::new(text) {
        entry.wrong(
            format!("found {}, expected a pattern ({})", quoted(text), fault.msg),
            "write * for any letters and ? for one letter",
        );
        return None;
    }
    Some(text.to_owned())
}

fn taken(table: &TableReader<'_>) -> Option<Taken> {
    let Some(entry) = table.optional("taken") else { return Some(Taken::None) };
    let text = entry.text()?;
    match text {
        "none" => return Some(Taken::None),
        "modified" => return Some(Taken::Modified),
        _ => {}
    }
    if let Some(pattern) = text.strip_prefix("name:") {
        if gives_a_date(pattern) {
            return Some(Taken::Name(pattern.to_owned()));
        }
        let words = format!("found {}, expected a pattern with year, month and day", quoted(text));
        entry.wrong(words, "write taken = \"name:%Y%m%d_%H%M%S\" for 20260131_143000.ply");
        return None;
    }
    let help = match nearest(text, ["none", "modified", "name:%Y%m%d_%H%M%S"]) {
        Some((known, true)) => format!("did you mean \"{known}\"?"),
        _ => "write taken = \"name:%Y%m%d_%H%M%S\" for 20260131_143000.ply".to_owned(),
    };
    entry.wrong(format!("found {}, expected \"none\", \"modified\" or \"name:\" and a pattern", quoted(text)), help);
    None
}

/// Whether a date written by the pattern can be read back by it.
fn gives_a_date(pattern: &str) -> bool {
    let sample = jiff::civil::date(2026, 1, 31).at(14, 30, 5, 0);
    let written = jiff::fmt::strtime::format(pattern, sample);
    let read = written.and_then(|text| jiff::fmt::strtime::parse(pattern, text)).and_then(|parts| parts.to_date());
    read.is_ok_and(|date| date == sample.date())
}

/// `[background]`.
pub(super) fn background(table: TableReader<'_>) -> Option<BackgroundSettings> {
    const COLOUR_DISTANCE: NumberRule =
        NumberRule { expected: "a distance of colours between 0 and 442", accepts: |v| (0.0..=442.0).contains(&v) };
    const LUMINANCE: NumberRule =
        NumberRule { expected: "a luminance between 0 and 255", accepts: |v| (0.0..=255.0).contains(&v) };
    let default = BackgroundSettings::default();
    let belt_plane = match table.optional("belt_plane") {
        Some(entry) => entry.truth(),
        None => Some(default.belt_plane),
    };
    let belt_clearance_mm = optional_number(&table, "belt_clearance_mm", AT_LEAST_ZERO_MM);
    let belt_colours = belt_colours(&table);
    let colour_tolerance = number_or(&table, "colour_tolerance", COLOUR_DISTANCE, default.colour_tolerance);
    let luminance_min = optional_number(&table, "luminance_min", LUMINANCE);
    finish(table);
    Some(BackgroundSettings {
        belt_plane: belt_plane?,
        belt_clearance_mm: belt_clearance_mm?,
        belt_colours: belt_colours?,
        colour_tolerance: colour_tolerance?,
        luminance_min: luminance_min?,
    })
}

fn optional_number(table: &TableReader<'_>, key: &'static str, rule: NumberRule) -> Option<Option<f64>> {
    match table.optional(key) {
        Some(entry) => entry.number(rule).map(Some),
        None => Some(None),
    }
}

fn belt_colours(table: &TableReader<'_>) -> Option<Vec<[u8; 3]>> {
    const EXPECTED: &str = "a list of colours, each three whole numbers from 0 to 255";
    const EXAMPLE: &str = "[[96, 98, 101]]";
    let Some(entry) = table.optional("belt_colours") else { return Some(Vec::new()) };
    let values = entry.list(EXPECTED, EXAMPLE)?;
    let mut colours = Vec::with_capacity(values.len());
    for (k, value) in values.iter().enumerate() {
        match colour(value) {
            Some(colour) => colours.push(colour),
            None => {
                let found = value.as_array().map_or_else(
                    || describe_value(value),
                    |list| {
                        let inner: Vec<String> = list.iter().take(4).map(describe_value).collect();
                        format!("[{}]", inner.join(", "))
                    },
                );
                entry.wrong(
                    format!("found {found} as colour {}, expected {EXPECTED}", k + 1),
                    format!("write it such as {EXAMPLE}"),
                );
                return None;
            }
        }
    }
    Some(colours)
}

fn colour(value: &Value) -> Option<[u8; 3]> {
    let list = value.as_array()?;
    let mut channels = [0_u8; 3];
    if list.len() != channels.len() {
        return None;
    }
    for (channel, value) in channels.iter_mut().zip(list.iter()) {
        let number = value_number(value).filter(|v| v.fract() == 0.0 && (0.0..=255.0).contains(v))?;
        *channel = number as u8;
    }
    Some(channels)
}

/// `[rig]`.
pub(super) fn rig(table: TableReader<'_>) -> Option<Rig> {
    const PIXEL: NumberRule = NumberRule { expected: "a number in um above 0", accepts: |v| v > 0.0 && v <= 1000.0 };
    const ACCURACY: NumberRule =
        NumberRule { expected: "a number in pixels above 0 and up to 10", accepts: |v| v > 0.0 && v <= 10.0 };
    const LEVEL: NumberRule = NumberRule {
        expected: "a whole number from 1 to 16",
        accepts: |v| v.fract() == 0.0 && (1.0..=16.0).contains(&v),
    };
    let required = |key, expected, help: &str, rule| table.required(key, expected, help).and_then(|e| e.number(rule));
    let distance_mm =
        required("distance_mm", "the distance to the part in mm", "write distance_mm = 600.0", POSITIVE_MM);
    let base_mm = required("base_mm", "the distance between the cameras in mm", "write base_mm = 200.0", POSITIVE_MM);
    let focal_mm = required("focal_mm", "the focal length in mm", "write focal_mm = 35.0", POSITIVE_MM);
    let pixel_um = required("pixel_um", "the size of a pixel in um", "write pixel_um = 4.88", PIXEL);
    let help = "write image_accuracy_px = 0.3";
    let image_accuracy_px = required("image_accuracy_px", "the accuracy of matching in pixels", help, ACCURACY);
    let resolution_level = number_or(&table, "resolution_level", LEVEL, 1.0);
    let point_spacing_mm = match table.optional("point_spacing_mm") {
        Some(entry) => entry.number(POSITIVE_MM).map(Some),
        None => Some(None),
    };
    finish(table);
    Some(Rig {
        distance_mm: distance_mm?,
        base_mm: base_mm?,
        focal_mm: focal_mm?,
        pixel_um: pixel_um?,
        image_accuracy_px: image_accuracy_px?,
        resolution_level: resolution_level? as u32,
        point_spacing_mm: point_spacing_mm?,
    })
}

/// From here on the scale's uncertainty is told in words: 0.1 mm in 100 mm.
const TELLING_PPM: f64 = 1000.0;

/// `[uncertainty]`.
pub(super) fn uncertainty(table: TableReader<'_>) -> Option<UncertaintySettings> {
    // Beyond these no calibration lies: a system that is 5 % or 10 mm off measures nothing, and no rim is rounded by more than the sheet.
    const PPM: NumberRule = NumberRule {
        expected: "parts per million, from 0 to 50000 (5 %; 10000 ppm is 1 %, 1 mm in 100 mm)",
        accepts: |v| (0.0..=5e4).contains(&v),
    };
    const UP_TO_10_MM: NumberRule =
        NumberRule { expected: "a number in mm from 0 to 10", accepts: |v| (0.0..=10.0).contains(&v) };
    const OFFSET_MM: NumberRule =
        NumberRule { expected: "a number in mm from -5 to 5", accepts: |v| (-5.0..=5.0).contains(&v) };
    let scale = table.optional("scale_ppm");
    let scale_ppm = scale.map_or(Some(0.0), |entry| entry.number(PPM));
    if let (Some(entry), Some(ppm)) = (scale, scale_ppm)
        && ppm >= TELLING_PPM
    {
        entry.warn(
            format!("a scale known to {ppm} ppm only is {} mm in 100 mm (k = 1)", ppm * 1e-4),
            "calibrate with a longer or better known length, or keep comparison points near the datums",
        );
    }
    let thickness_mm = number_or(&table, "thickness_mm", UP_TO_10_MM, 0.0);
    let system_mm = number_or(&table, "system_mm", UP_TO_10_MM, 0.0);
    let edge_offset_mm = number_or(&table, "edge_offset_mm", OFFSET_MM, 0.0);
    let edge_offset_u_mm = number_or(&table, "edge_offset_u_mm", UP_TO_10_MM, 0.0);
    finish(table);
    Some(UncertaintySettings {
        scale_ppm: scale_ppm?,
        thickness_mm: thickness_mm?,
        system_mm: system_mm?,
        edge_offset_mm: edge_offset_mm?,
        edge_offset_u_mm: edge_offset_u_mm?,
    })
}

/// The settings of a plan without `[output]`.
pub(super) fn output_left_out(folder: &Path) -> OutputSettings {
    OutputSettings {
        folder: "results".to_owned(),
        path: folder.join("results"),
        formats: vec![OutputFormat::Ascii, OutputFormat::Json, OutputFormat::Pdf],
        map_range_mm: 1.0,
    }
}

/// `[output]`, and the place for results even where the rest is wrong.
pub(super) fn output(table: TableReader<'_>, folder: &Path) -> (Option<OutputSettings>, Option<ResultsPlace>) {
    let default = output_left_out(folder);
    let entry = table.optional("folder");
    let line = entry.map_or(table.line(), |e| e.line);
    let place = match entry {
        Some(entry) => location(entry, folder),
        None => Some((default.folder, default.path)),
    };
    let formats = formats(&table, default.formats);
    let map_range_mm = number_or(&table, "map_range_mm", POSITIVE_MM, default.map_range_mm);
    finish(table);
    let results = place.as_ref().map(|(_, path)| ResultsPlace { path: path.clone(), line });
    let settings = place.zip(formats).zip(map_range_mm);
    let settings = settings.map(|(((folder, path), formats), map_range_mm)| OutputSettings {
        folder,
        path,
        formats,
        map_range_mm,
    });
    (settings, results)
}

/// Every format once, in a fixed order.
fn formats(table: &TableReader<'_>, otherwise: Vec<OutputFormat>) -> Option<Vec<OutputFormat>> {
    const KNOWN: [(&str, OutputFormat); 5] = [
        ("ascii", OutputFormat::Ascii),
        ("json", OutputFormat::Json),
        ("pdf", OutputFormat::Pdf),
        ("csv", OutputFormat::Csv),
        ("ply", OutputFormat::Ply),
    ];
    const EXAMPLE: &str = "[\"ascii\", \"json\", \"pdf\"]";
    let Some(entry) = table.optional("formats") else { return Some(otherwise) };
    let words = KNOWN.map(|(word, _)| word);
    let expected = format!("a list of {}", list_or(&words, "\""));
    let values = entry.list(&expected, EXAMPLE)?;
    if values.is_empty() {
        entry.wrong(format!("found an empty list, expected {expected}"), format!("write it such as {EXAMPLE}"));
        return None;
    }
    let mut formats = Vec::new();
    let mut all_known = true;
    for value in values {
        match KNOWN.iter().find(|(word, _)| value.as_str() == Some(word)) {
            Some((_, format)) => formats.push(*format),
            None => {
                let help = match value.as_str() {
                    Some("dfq" | "qif") => {
                        "this format is not available yet; \"csv\" or \"json\" carry the same numbers".to_owned()
                    }
                    Some(text) => match nearest(text, words) {
                        Some((known, true)) => format!("did you mean \"{known}\"?"),
                        _ => format!("write it such as {EXAMPLE}"),
                    },
                    None => format!("write it such as {EXAMPLE}"),
                };
                entry.wrong(format!("found {}, expected {expected}", describe_value(value)), help);
                all_known = false;
            }
        }
    }
    formats.sort_unstable();
    formats.dedup();
    all_known.then_some(formats)
}
