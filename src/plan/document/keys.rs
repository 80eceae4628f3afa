//! The tables and keys of a plan, in the order in which they are written.

pub use crate::plan::sections::HOMES as SETTINGS;

/// Order of the tables in a plan that is written from nothing.
pub(super) const TABLES: [&str; 11] = [
    "part",
    "cad",
    "scans",
    "background",
    "alignment",
    "feature",
    "comparison",
    "comparison_file",
    "rig",
    "uncertainty",
    "output",
];

/// Keys of features and comparison points, in the order in which they are written.
pub const LISTED_KEYS: [&str; 14] = [
    "name",
    "kind",
    "centre",
    "position",
    "axis",
    "direction",
    "normal",
    "diameter_mm",
    "length_mm",
    "width_mm",
    "method",
    "radius_mm",
    "lower_mm",
    "upper_mm",
];

/// Keys that hold a whole number.
pub(super) const WHOLE: [&str; 2] = ["resolution_level", "schema"];

/// Keys that are settings of a table, not rows below it.
pub(super) fn is_setting(table: &str, key: &str) -> bool {
    let rows = table == "alignment" && ["rps", "region"].contains(&key);
    SETTINGS.iter().any(|(name, keys)| *name == table && keys.contains(&key)) && !rows
}
