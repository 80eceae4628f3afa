//! Comparison points as a table of text: what a comparison file, a spreadsheet and the import read.

use super::List;
use super::settings::FieldValue;
use super::shape::values;
use crate::plan::{ComparisonPoint, SurfaceMethod};

/// How a table is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CsvStyle {
    /// Commas between cells, decimal points: a `[comparison_file]` of a plan.
    ComparisonFile,
    /// Tabs between cells, decimal points.
    Tabs,
    /// Semicolons between cells, decimal commas: what a spreadsheet of a country with decimal commas opens.
    DecimalComma,
}

const VECTORS: [&str; 4] = ["position", "direction", "normal", "axis"];

/// All points with all keys, a line each under a line of names; what a kind does not have is left empty. Read after written gives
/// the same points.
pub fn csv_of_points(points: &[ComparisonPoint], style: CsvStyle) -> String {
    let separator = match style {
        CsvStyle::ComparisonFile => ",",
        CsvStyle::Tabs => "\t",
        CsvStyle::DecimalComma => ";",
    };
    let mut header = vec!["name".to_owned(), "kind".to_owned()];
    header.extend(VECTORS.iter().flat_map(|v| ["x", "y", "z"].map(|c| format!("{v}_{c}"))));
    header.extend(["diameter_mm", "method", "radius_mm", "lower_mm", "upper_mm"].map(str::to_owned));
    let mut text = header.join(separator) + "\n";
    for point in points {
        text.push_str(&cells(point, style, separator).join(separator));
        text.push('\n');
    }
    text
}

fn cells(point: &ComparisonPoint, style: CsvStyle, separator: &str) -> Vec<String> {
    let number = |v: f64| {
        let text = format!("{v}");
        if style == CsvStyle::DecimalComma { text.replace('.', ",") } else { text }
    };
    let values = values(&point.geometry, List::Comparison);
    let value = |key: &str| values.iter().find(|(k, _)| *k == key).map(|(_, value)| value);
    let mut cells = vec![quoted(&point.name, separator), point.geometry.kind().to_owned()];
    for key in VECTORS {
        match value(key) {
            Some(FieldValue::Numbers(v)) => cells.extend(v.iter().map(|v| number(*v))),
            _ => cells.extend([const { String::new() }; 3]),
        }
    }
    cells.push(match value("diameter_mm") {
        Some(FieldValue::Number(v)) => number(*v),
        _ => String::new(),
    });
    cells.push(if point.surface_fit.method == SurfaceMethod::Plane { "plane".to_owned() } else { String::new() });
    cells.push(point.surface_fit.radius_mm.map_or(String::new(), number));
    cells.extend([number(point.lower_mm), number(point.upper_mm)]);
    cells
}

/// A name that holds a separator or a quote stands in quotes; so does one that a reader would take for a comment.
fn quoted(name: &str, separator: &str) -> String {
    let plain = !name.contains(separator) && !name.contains('"') && !name.starts_with('#');
    if plain { name.to_owned() } else { format!("\"{}\"", name.replace('"', "\"\"")) }
}
