//! `NAME.csv`: one row a comparison point, for spreadsheets.
//!
//! Fields are quoted as in RFC 4180. A text that a spreadsheet would take for a formula gets an apostrophe in front; a
//! field is empty where nothing was measured.

use super::ascii::number;
use super::words::clean;
use crate::geometry::Vector3;
use crate::inspect::{InspectionResult, Outcome, PointResult};

const HEADER: &str = "name,kind,x_mm,y_mm,z_mm,i,j,k,lower_mm,upper_mm,measured_x_mm,measured_y_mm,measured_z_mm,\
deviation_mm,uncertainty_mm,verdict,points_used,rms_mm,position_mm,diameter_mm,diameter_deviation_mm,reason\n";

/// The CSV report; only its header when the scan was refused.
pub fn csv(result: &InspectionResult) -> String {
    let mut text = String::from(HEADER);
    if let Outcome::Measured(inspection) = &result.outcome {
        for point in &inspection.points {
            text.push_str(&row(point).join(","));
            text.push('\n');
        }
    }
    text
}

fn row(point: &PointResult) -> Vec<String> {
    let m = point.measurement.as_ref();
    let hole = m.and_then(|m| m.hole.as_ref());
    let direction = (point.direction != Vector3::zeros()).then_some(point.direction);
    let mut fields = vec![text_field(&point.name), point.kind.to_owned()];
    fields.extend(point.nominal.iter().map(|&v| number(v)));
    fields.extend((0..3).map(|k| optional(direction.map(|d| d[k]))));
    fields.extend([number(point.lower_mm), number(point.upper_mm)]);
    fields.extend((0..3).map(|k| optional(m.map(|m| m.measured[k]))));
    fields.extend([optional(m.map(|m| m.deviation_mm)), optional(m.map(|m| m.uncertainty_mm))]);
    fields.extend([point.verdict.point_key().to_owned(), point.points_used.to_string()]);
    fields.push(optional(m.map(|m| m.rms_mm)));
    fields.push(optional(hole.map(|h| h.position_mm)));
    fields.push(optional(hole.map(|h| h.diameter_mm)));
    fields.push(optional(hole.map(|h| h.diameter_deviation_mm)));
    fields.push(text_field(point.reason.as_deref().unwrap_or("")));
    fields
}

/// A number, or nothing.
pub(super) fn optional(value: Option<f64>) -> String {
    value.filter(|v| v.is_finite()).map(number).unwrap_or_default()
}

/// A text as one field: no control characters, no formula, quoted when it must be.
pub fn text_field(text: &str) -> String {
    let mut text = clean(text);
    if text.trim_start().starts_with(['=', '+', '-', '@', '|', '%']) {
        text.insert(0, '\'');
    }
    if text.contains([',', '"', ';', '\'']) || text != text.trim() {
        text = format!("\"{}\"", text.replace('"', "\"\""));
    }
    text
}

/// Splits text into records of fields, quotes undone. Never fails: a quote that is not closed ends with the text.
pub(super) fn parse(text: &str) -> Vec<Vec<String>> {
    let mut records = Vec::new();
    let mut record = Vec::new();
    let mut field = String::new();
    let mut quoted = false;
    let mut chars = text.chars().peekable();
    while let Some(c) = chars.next() {
        match c {
            '"' if quoted && chars.peek() == Some(&'"') => {
                chars.next();
                field.push('"');
            }
            '"' => quoted = !quoted,
            ',' if !quoted => record.push(std::mem::take(&mut field)),
            '\r' if !quoted => {}
            '\n' if !quoted => {
                record.push(std::mem::take(&mut field));
                records.push(std::mem::take(&mut record));
            }
            c => field.push(c),
        }
    }
    if !field.is_empty() || !record.is_empty() {
        record.push(field);
        records.push(record);
    }
    records
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;

    #[test]
    fn one_row_a_point_and_empty_where_nothing_was_measured() {
        let records = parse(&csv(&example::bracket()));
        let column = |name: &str| records[0].iter().position(|c| c == name).unwrap();
        assert_eq!(records.len(), 12);
        assert!(records.iter().all(|r| r.len() == records[0].len()));
        let e05 = records.iter().find(|r| r[0] == "E05").unwrap();
        assert_eq!(e05[column("deviation_mm")], "");
        assert_eq!(e05[column("verdict")], "not_measured");
        let c04 = records.iter().find(|r| r[0] == "C04").unwrap();
        assert_eq!(c04[column("position_mm")], "0.640000");
        assert_eq!(c04[column("deviation_mm")], "-0.320000");
    }

    #[test]
    fn formulas_are_disarmed_and_quotes_survive() {
        assert_eq!(text_field("=HYPERLINK(\"x\")"), "\"'=HYPERLINK(\"\"x\"\")\"");
        assert_eq!(text_field(" @cmd"), "\"' @cmd\"");
        assert_eq!(text_field("\t-1+1"), "\"' -1+1\"");
        assert_eq!(text_field("P01"), "P01");
        for odd in ["a,b", "say \"hi\"", "it's;", " pad "] {
            assert_eq!(parse(&format!("{},x\n", text_field(odd))), [[odd.to_owned(), "x".to_owned()]]);
        }
    }

    #[test]
    fn a_refused_scan_has_only_the_header() {
        assert_eq!(csv(&example::refused()), HEADER);
    }
}
