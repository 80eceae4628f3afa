//! Values of the trade: positions, directions, names, files. What comes out of here is not doubted again.

use super::reader::{Entry, NumberRule, TableReader, quoted};
use crate::geometry::{LengthUnit, Point3, UnitVector3, Vector3};
use std::path::{Path, PathBuf};

/// A kilometre: nothing that is pressed from sheet is larger, and squares of it keep their digits.
pub const LARGEST_MM: f64 = 1e6;

/// Names longer than this do not fit a report.
const LONGEST_NAME: usize = 120;

/// How far a direction's length may be off from 1 without a word: rounding to two decimals stays below.
const LENGTH_SLACK: f64 = 0.01;

/// How far from perpendicular two directions may be without a word, rad.
const PERPENDICULAR_SLACK: f64 = 5.0 * std::f64::consts::PI / 180.0;

/// Beyond this a second direction says nothing about the plane it should lie in, rad.
const PERPENDICULAR_LIMIT: f64 = 60.0 * std::f64::consts::PI / 180.0;

/// Any length, either sign.
pub(super) const SIGNED_MM: NumberRule =
    NumberRule { expected: "a number in mm between -1000000 and 1000000", accepts: |v| v.abs() <= LARGEST_MM };
/// A length that is there.
pub(super) const POSITIVE_MM: NumberRule =
    NumberRule { expected: "a number in mm above 0", accepts: |v| v > 0.0 && v <= LARGEST_MM };
/// A length that may be nothing.
pub(super) const AT_LEAST_ZERO_MM: NumberRule =
    NumberRule { expected: "a number in mm, 0 or more", accepts: |v| (0.0..=LARGEST_MM).contains(&v) };

/// The units a plan may name.
pub(super) const UNITS: [(&str, LengthUnit); 5] = [
    ("mm", LengthUnit::Mm),
    ("cm", LengthUnit::Cm),
    ("m", LengthUnit::M),
    ("inch", LengthUnit::Inch),
    ("um", LengthUnit::Um),
];

/// One line of text without control characters; reports print it as it is.
pub(super) fn line_of_text<'r>(entry: Entry<'r>) -> Option<&'r str> {
    let text = entry.text()?;
    if let Some(control) = text.chars().find(|c| c.is_control() || matches!(c, '\u{2028}' | '\u{2029}')) {
        let words = format!("found {} with the control character U+{:04X}", quoted(text), u32::from(control));
        entry.wrong(
            format!("{words}, expected one line of text"),
            "remove tabs, line breaks and other control characters",
        );
        return None;
    }
    if text.chars().count() > LONGEST_NAME {
        let count = text.chars().count();
        entry.wrong(format!("found {count} characters, expected {LONGEST_NAME} at most"), "shorten it");
        return None;
    }
    Some(text)
}

/// A name: one line of text that is not blank at its ends and not empty.
pub(super) fn name<'r>(entry: Entry<'r>) -> Option<&'r str> {
    let text = line_of_text(entry)?;
    if text.is_empty() || text.trim() != text {
        let words = format!("found {}, expected a name without blanks at its ends", quoted(text));
        entry.wrong(words, "give it a name such as \"P01\"");
        return None;
    }
    Some(text)
}

/// A file or folder as written, and resolved against the plan's folder.
pub(super) fn location(entry: Entry<'_>, folder: &Path) -> Option<(String, PathBuf)> {
    let text = entry.text()?;
    let shown = quoted(text);
    if text.is_empty() || text.chars().any(char::is_control) {
        entry.wrong(format!("found {shown}, expected a path"), "write it relative to the plan's folder");
        return None;
    }
    let remote = text.contains("://") || ["\\\\", "//", "\\/", "/\\"].iter().any(|start| text.starts_with(start));
    if remote {
        let words = format!("found {shown}, a place in the network, expected a file or folder of this computer");
        entry.wrong(words, "copy it here, or connect the share as a drive or folder and name that");
        return None;
    }
    Some((text.to_owned(), folder.join(text)))
}

/// Three coordinates in mm, CAD frame.
pub(super) fn position(entry: Entry<'_>) -> Option<Point3> {
    let [x, y, z] = triple(entry, "three coordinates in mm", "[10.0, 40.0, 8.0]")?;
    if [x, y, z].iter().any(|v| v.abs() > LARGEST_MM) {
        let words = format!("found {}, expected coordinates between -1000000 and 1000000 mm", triple_words([x, y, z]));
        entry.wrong(words, "check the numbers and their unit");
        return None;
    }
    Some(Point3::new(x, y, z))
}

/// A direction, made length one; says so when it was off by more than 1 %.
pub(super) fn direction(entry: Entry<'_>) -> Option<UnitVector3> {
    let written = triple(entry, "a direction of three numbers", "[0, 0, 1]")?;
    let largest = written.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    if largest < 1e-9 {
        entry.wrong("has length 0, expected a unit vector", "give a direction such as [0, 0, 1]");
        return None;
    }
    // Scaled first, so that neither huge nor tiny components leave the range of f64 when they are squared.
    let unit = UnitVector3::new_normalize(Vector3::from(written.map(|v| v / largest)));
    let length = largest * Vector3::from(written.map(|v| v / largest)).norm();
    if (length - 1.0).abs() > LENGTH_SLACK {
        let help = format!("write {}; that is what is used", triple_words(unit.into_inner().into()));
        entry.odd(format!("has length {}, expected 1", short(length)), help);
    }
    Some(unit)
}

/// A direction that should be perpendicular to `normal`: made so, with a warning beyond 5 degrees and an error beyond 60.
/// `normal_key` is the normal's name in the plan.
pub(super) fn direction_in_plane(entry: Entry<'_>, normal: &UnitVector3, normal_key: &str) -> Option<UnitVector3> {
    let given = direction(entry)?;
    let off = given.dot(normal).clamp(-1.0, 1.0).asin();
    let degrees = off.abs().to_degrees();
    let in_plane = given.into_inner() - normal.into_inner() * given.dot(normal);
    let made = UnitVector3::try_new(in_plane, 1e-9).filter(|_| off.abs() <= PERPENDICULAR_LIMIT);
    let Some(made) = made else {
        let words = format!("is {degrees:.1} degrees out of the sheet, expected it perpendicular to {normal_key}");
        entry.wrong(words, format!("give the direction in the sheet and in {normal_key} the sheet's normal"));
        return None;
    };
    if off.abs() > PERPENDICULAR_SLACK {
        let words = format!("is {degrees:.1} degrees out of the sheet, expected it perpendicular to {normal_key}");
        let help = format!("write {}; that is what is used", triple_words(made.into_inner().into()));
        entry.odd(words, help);
    }
    Some(made)
}

/// A unit; mm when it is left out.
pub(super) fn unit(reader: &TableReader<'_>) -> Option<LengthUnit> {
    match reader.optional("unit") {
        Some(entry) => entry.choice(&UNITS),
        None => Some(LengthUnit::Mm),
    }
}

pub(super) fn triple(entry: Entry<'_>, what: &str, example: &str) -> Option<[f64; 3]> {
    let numbers = entry.numbers(what, example)?;
    let help = match numbers.as_slice() {
        [x, y, z] => return Some([*x, *y, *z]),
        [_, _, _, _, _, _] => format!("numbers have a decimal point and commas between them, such as {example}"),
        _ => format!("write it such as {example}"),
    };
    let count = if numbers.len() == 1 { "1 number".to_owned() } else { format!("{} numbers", numbers.len()) };
    entry.wrong(format!("found {count}, expected {what}"), help);
    None
}

/// `[0.707, 0, -0.707]`: three decimals without idle zeros.
pub(crate) fn triple_words(v: [f64; 3]) -> String {
    format!("[{}, {}, {}]", short(v[0]), short(v[1]), short(v[2]))
}

/// Three decimals without idle zeros; very large and very small numbers in powers of ten.
pub(crate) fn short(v: f64) -> String {
    if v != 0.0 && !(1e-3..1e7).contains(&v.abs()) {
        return if v.abs() < 5e-4 { tiny(v) } else { format!("{v:e}") };
    }
    let text = format!("{v:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// In a list of rounded components a tiny one is 0; as a length it keeps its size.
fn tiny(v: f64) -> String {
    if v.abs() < 1e-12 { "0".to_owned() } else { format!("{v:.1e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_shortly() {
        for (value, text) in [(0.123456, "0.123"), (-0.0, "0"), (12.0, "12"), (3.2144, "3.214"), (1e-16, "0")] {
            assert_eq!(short(value), text);
        }
        assert_eq!(triple_words([1.0, 0.5, -2.25]), "[1, 0.5, -2.25]");
    }
}
