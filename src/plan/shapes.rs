//! Nominal features and comparison points.

use super::nominal::{ComparisonPoint, Feature, Geometry, SurfaceFit, SurfaceMethod};
use super::problems::Problems;
use super::reader::{Entry, NumberRule, TableReader, quoted};
use super::suggest::list_or;
use super::values::{POSITIVE_MM, SIGNED_MM, direction, direction_in_plane, name, position, short};
use std::collections::BTreeMap;

/// Every key that some kind of feature or point has.
const SHAPE_KEYS: [&str; 10] = [
    "centre",
    "position",
    "axis",
    "direction",
    "normal",
    "diameter_mm",
    "length_mm",
    "width_mm",
    "radius_mm",
    "method",
];

/// Radius of a surface point's window that a plan may ask for: below, no scan has points enough; above, it is no point any more.
const WINDOW_RADIUS_MM: NumberRule =
    NumberRule { expected: "a radius in mm between 0.2 and 50", accepts: |v| (0.2..=50.0).contains(&v) };

/// A limit farther from nominal than this is a slip of the pen, mm: no part that is so far off is found at all.
const FARTHEST_MM: f64 = 100.0;

/// A tolerance narrower than this is beyond any scan of sheet metal, mm.
pub const NARROWEST_MM: f64 = 0.01;

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Hole,
    Slot,
    Surface,
    Edge,
}

/// A feature as far as it could be read: references are checked by name and kind even when a number of it is wrong.
pub(super) struct ReadFeature {
    /// Its name, if it has a good one.
    pub name: Option<String>,
    /// Its kind, if it has a good one.
    pub kind: Option<&'static str>,
    /// The whole of it, if nothing is wrong.
    pub feature: Option<Feature>,
}

/// Reads `[[feature]]`; as many come back as stand in the plan.
pub(super) fn features(root: &TableReader<'_>) -> Vec<ReadFeature> {
    let mut first_lines = BTreeMap::new();
    root.sections("feature", "[[feature]]").into_iter().map(|table| feature(table, &mut first_lines)).collect()
}

fn feature(mut table: TableReader<'_>, first_lines: &mut BTreeMap<String, usize>) -> ReadFeature {
    let line = table.line();
    let named = read_name(&mut table, "[[feature]]");
    if let Some((name, name_line)) = &named
        && let Some(first) = first_lines.get(name)
    {
        let message = format!(
            "[[feature]] name: found {} again, first used on line {first}, expected a name of its own",
            quoted(name)
        );
        table.problems().error(*name_line, message, "rename one of them: the alignment refers to features by name");
    } else if let Some((name, name_line)) = &named {
        first_lines.insert(name.clone(), *name_line);
    }
    let kinds = [("hole", Kind::Hole), ("slot", Kind::Slot), ("surface", Kind::Surface), ("edge", Kind::Edge)];
    let kind = table.required("kind", "\"hole\", \"slot\", \"surface\" or \"edge\"", "write kind = \"hole\"");
    let known_kind = kind.is_some();
    let kind = kind.and_then(|entry| entry.choice(&kinds));
    let geometry = kind.and_then(|kind| read_shape(&table, kind, "centre", false));
    let word = kind.and_then(|kind| kinds.iter().find(|(_, k)| *k == kind)).map(|(word, _)| *word);
    finish(table, word, known_kind);
    let name = named.map(|(name, _)| name);
    let feature = name.clone().zip(geometry).map(|(name, geometry)| Feature { name, geometry, line });
    ReadFeature { name, kind: word, feature }
}

/// A comparison point as far as it could be read: its name is compared with others even when a number of it is wrong.
pub(super) struct ReadPoint {
    /// Its name, if it has a good one, with the line.
    pub name: Option<(String, usize)>,
    /// The whole of it, if nothing is wrong.
    pub point: Option<ComparisonPoint>,
}

/// Reads one `[[comparison]]` or one row of a comparison file.
pub(super) fn comparison_point(mut table: TableReader<'_>) -> ReadPoint {
    let line = table.line();
    let named = read_name(&mut table, "[[comparison]]");
    let kinds = [("surface", Kind::Surface), ("edge", Kind::Edge), ("hole", Kind::Hole)];
    let kind = table.required("kind", "\"surface\", \"edge\" or \"hole\"", "write kind = \"surface\"");
    let known_kind = kind.is_some();
    let kind = kind.and_then(|entry| {
        if entry_is(entry, "slot") {
            let help = "compare a slot by edge points on its rim; as a datum it stands under [[feature]]";
            entry.wrong("found text \"slot\", expected \"surface\", \"edge\" or \"hole\"", help);
            return None;
        }
        entry.choice(&kinds)
    });
    let geometry = kind.and_then(|kind| read_shape(&table, kind, "position", true));
    let word = kind.and_then(|kind| kinds.iter().find(|(_, k)| *k == kind)).map(|(word, _)| *word);
    let surface_fit = if kind == Some(Kind::Surface) { surface_fit(&table) } else { Some(SurfaceFit::default()) };
    let limits = limits(&table);
    if let (Some(Geometry::Hole { direction: None, .. }), Some((lower_mm, _))) = (&geometry, limits)
        && lower_mm > 0.0
        && let Some(entry) = table.optional("lower_mm")
    {
        let words =
            format!("found {lower_mm}, but without a direction the value is a distance: a hole in its place fails");
        entry.odd(words, "write lower_mm = 0, or give the direction in which it is to be off");
    }
    let file = table.problems().file().to_path_buf();
    finish(table, word, known_kind);
    let whole = named.clone().zip(geometry).zip(surface_fit).zip(limits);
    let point = whole.map(|((((name, _), geometry), surface_fit), (lower_mm, upper_mm))| ComparisonPoint {
        name,
        geometry,
        surface_fit,
        lower_mm,
        upper_mm,
        file,
        line,
    });
    ReadPoint { name: named, point }
}

/// How a surface point is measured; every key may be left out.
fn surface_fit(table: &TableReader<'_>) -> Option<SurfaceFit> {
    let methods = [("local", SurfaceMethod::Local), ("plane", SurfaceMethod::Plane)];
    let method = table.optional("method").map_or(Some(SurfaceMethod::default()), |entry| entry.choice(&methods));
    let radius_mm = match table.optional("radius_mm") {
        Some(entry) => entry.number(WINDOW_RADIUS_MM).map(Some),
        None => Some(None),
    };
    Some(SurfaceFit { method: method?, radius_mm: radius_mm? })
}

/// Warns of names that comparison points share.
pub(super) fn warn_of_shared_names(points: &[ReadPoint], problems: &Problems) {
    let mut first_lines: BTreeMap<&str, usize> = BTreeMap::new();
    for (name, line) in points.iter().filter_map(|read| read.name.as_ref()) {
        let line = *line;
        let first = *first_lines.entry(name).or_insert(line);
        if first != line {
            let message = format!(
                "[[comparison]] name: found {} again, first used on line {first}, expected a name of its own",
                quoted(name)
            );
            problems.warning(line, message, "rename one of them, or the report cannot tell them apart");
        }
    }
}

fn entry_is(entry: Entry<'_>, word: &str) -> bool {
    entry.found() == format!("text {}", quoted(word))
}

fn read_name(table: &mut TableReader<'_>, place: &str) -> Option<(String, usize)> {
    let entry = table.required("name", "a name", "give it a name such as name = \"P01\"")?;
    let line = entry.line;
    let name = name(entry)?.to_owned();
    table.call(format!("{place} {}", quoted(&name)));
    Some((name, line))
}

fn limits(table: &TableReader<'_>) -> Option<(f64, f64)> {
    let lower = table.required("lower_mm", "the lower limit of the deviation in mm", "write lower_mm = -0.5");
    let upper = table.required("upper_mm", "the upper limit of the deviation in mm", "write upper_mm = 0.5");
    let lower_mm = lower.and_then(|entry| entry.number(SIGNED_MM));
    let upper_mm = upper.and_then(|entry| entry.number(SIGNED_MM));
    let (lower_mm, upper_mm) = (lower_mm?, upper_mm?);
    if lower_mm >= upper_mm {
        let words = format!("found {lower_mm} with upper_mm = {upper_mm}, expected lower_mm below upper_mm");
        lower?.wrong(words, "lower_mm is the most negative deviation allowed, such as -0.5");
        return None;
    }
    for (entry, limit_mm) in [(lower, lower_mm), (upper, upper_mm)] {
        if let Some(entry) = entry.filter(|_| limit_mm.abs() > FARTHEST_MM) {
            let words = format!(
                "found {limit_mm} mm, farther off than sheet metal can be and still be found: it limits nothing"
            );
            entry.odd(words, "check the number and its unit");
        }
    }
    let width_mm = upper_mm - lower_mm;
    if width_mm < NARROWEST_MM {
        let words =
            format!("the tolerance is {} mm wide, far less than can be measured: a few hundredths", short(width_mm));
        lower?.odd(words, "check both limits and their unit; no part can be told to be within them");
    }
    Some((lower_mm, upper_mm))
}

/// `place` is the key of the position: comparison points call a hole's centre `position`.
fn read_shape(table: &TableReader<'_>, kind: Kind, place: &'static str, compared: bool) -> Option<Geometry> {
    match kind {
        Kind::Surface => {
            let position = point(table, "position");
            let direction = normal(table, "direction", "the surface normal");
            Some(Geometry::Surface { position: position?, direction: direction? })
        }
        Kind::Edge => {
            let position = point(table, "position");
            let normal = normal(table, "normal", "the normal of the sheet");
            let help = "give the direction in the sheet, outwards, such as [1, 0, 0]";
            let entry = table.required("direction", "a direction in the sheet, outwards", help);
            let normal = normal?;
            let direction = direction_in_plane(entry?, &normal, "normal")?;
            Some(Geometry::Edge { position: position?, direction, normal })
        }
        Kind::Hole => {
            let centre = point(table, place);
            let axis = normal(table, "axis", "the normal of the sheet around the hole")?;
            let diameter = size(table, "diameter_mm", "the hole's diameter in mm", "write diameter_mm = 16.0");
            let told = if compared { table.optional("direction") } else { None };
            let told = match told {
                Some(entry) => Some(direction_in_plane(entry, &axis, "axis")?),
                None => None,
            };
            Some(Geometry::Hole { centre: centre?, axis, diameter_mm: diameter?, direction: told })
        }
        Kind::Slot => {
            let centre = point(table, place);
            let axis = normal(table, "axis", "the normal of the sheet around the slot");
            let help = "give the long axis such as [1, 0, 0]";
            let long = table.required("direction", "the direction of the slot's long axis", help);
            let length = size(table, "length_mm", "the slot's overall length in mm", "write length_mm = 30.0");
            let width = size(table, "width_mm", "the slot's width in mm", "write width_mm = 9.0");
            let sizes = slot_sizes(table, length, width);
            let axis = axis?;
            let direction = direction_in_plane(long?, &axis, "axis")?;
            let (length_mm, width_mm) = sizes?;
            Some(Geometry::Slot { centre: centre?, axis, direction, length_mm, width_mm })
        }
    }
}

fn slot_sizes(table: &TableReader<'_>, length_mm: Option<f64>, width_mm: Option<f64>) -> Option<(f64, f64)> {
    let (length_mm, width_mm) = (length_mm?, width_mm?);
    if length_mm <= width_mm {
        let words = format!("found {length_mm} with width_mm = {width_mm}, expected a length above the width");
        let entry = table.optional("length_mm")?;
        entry.wrong(words, "length_mm is the overall length with both round ends; a round opening is a hole");
        return None;
    }
    Some((length_mm, width_mm))
}

fn point(table: &TableReader<'_>, key: &'static str) -> Option<crate::geometry::Point3> {
    let help = format!("write {key} = [10.0, 40.0, 8.0]");
    table.required(key, "three coordinates in mm, in the CAD frame", help).and_then(position)
}

fn normal(table: &TableReader<'_>, key: &'static str, what: &'static str) -> Option<crate::geometry::UnitVector3> {
    let help = format!("give {what} such as {key} = [0, 0, 1]");
    table.required(key, what, help).and_then(direction)
}

fn size(table: &TableReader<'_>, key: &'static str, what: &'static str, help: &str) -> Option<f64> {
    table.required(key, what, help).and_then(|entry| entry.number(POSITIVE_MM))
}

/// Unknown keys; without a known kind nobody can say which keys belong to it, so none is refused then.
fn finish(table: TableReader<'_>, kind: Option<&'static str>, kind_given: bool) {
    if kind.is_none() && kind_given {
        return;
    }
    if kind.is_none() {
        for key in SHAPE_KEYS.into_iter().chain(["lower_mm", "upper_mm"]) {
            table.optional(key);
        }
    }
    table.finish(|key, asked| {
        let kind = kind?;
        let article = if kind == "edge" { "an" } else { "a" };
        let own: Vec<&str> = asked.iter().copied().filter(|k| *k != "name" && *k != "kind").collect();
        let own_words = list_or(&own, "").replace(" or ", " and ");
        SHAPE_KEYS.contains(&key).then(|| {
            (format!("unknown key \"{key}\" for {article} {kind}"), format!("{article} {kind} has {own_words}"))
        })
    });
}
