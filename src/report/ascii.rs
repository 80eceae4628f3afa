//! `NAME.txt`: the result as tab-separated text for spreadsheets, databases and people with a text editor.
//!
//! Numbers are in mm with a decimal point, directions are unit vectors, `nan` stands where nothing was measured (and for
//! the direction of a hole that has none).

use super::words::{PROGRAM, clean};
use crate::geometry::{Point3, Vector3};
use crate::inspect::{Inspection, InspectionResult, Outcome, PointResult};
use std::fmt::Write as _;

const COLUMNS: &str =
    "name kind x y z i j k lower upper measured_x measured_y measured_z deviation uncertainty verdict";

/// The ASCII report. A refused scan has its reason and help in the head and no rows.
pub fn ascii(result: &InspectionResult) -> String {
    let mut text = String::from("# shapeline 1\n");
    let id = &result.identity;
    line(&mut text, "program", PROGRAM);
    line(&mut text, "part", &id.part_name);
    line(&mut text, "number", &id.part_number);
    line(&mut text, "revision", &id.part_revision);
    line(&mut text, "plan", &id.plan_file);
    line(&mut text, "plan_sha256", &id.plan_sha256);
    line(&mut text, "cad", &id.cad_file);
    line(&mut text, "cad_sha256", &id.cad_sha256);
    line(&mut text, "scan", &id.scan_file);
    line(&mut text, "scan_sha256", id.scan_sha256.as_deref().unwrap_or("none"));
    if let Some(taken) = &id.scan_taken {
        line(&mut text, "taken", taken);
    }
    match &result.outcome {
        Outcome::Refused(refusal) => {
            line(&mut text, "status", "refused");
            line(&mut text, "reason", &refusal.reason);
            line(&mut text, "help", &refusal.help);
            line(&mut text, "columns", COLUMNS);
        }
        Outcome::Measured(inspection) => measured(&mut text, inspection),
    }
    text
}

fn measured(text: &mut String, inspection: &Inspection) {
    let fit = &inspection.best_fit;
    let alignment = &inspection.alignment;
    line(text, "status", "measured");
    line(text, "verdict", inspection.verdict.part_key());
    line(text, "side", fit.side.map_or("none", |side| side.key()));
    line(text, "points_read", &inspection.points_read.to_string());
    line(text, "points_kept", &inspection.points_kept.to_string());
    line(text, "best_fit_rms_mm", &number(fit.rms_mm));
    line(text, "best_fit_inlier_ratio", &number(fit.inlier_ratio));
    line(text, "best_fit_margin", &number(fit.margin));
    line(text, "alignment", alignment.method);
    line(text, "degraded", if alignment.degraded.is_some() { "yes" } else { "no" });
    if let Some(reason) = &alignment.degraded {
        line(text, "alignment_reason", reason);
    }
    for warning in &inspection.warnings {
        line(text, "warning", warning);
    }
    line(text, "columns", COLUMNS);
    for point in &inspection.points {
        row(text, point);
    }
}

fn line(text: &mut String, key: &str, value: &str) {
    let value = clean(value);
    writeln!(text, "# {key}: {}", value.trim()).expect("a String takes every write");
}

fn row(text: &mut String, point: &PointResult) {
    let mut fields = vec![clean(&point.name), point.kind.to_owned()];
    fields.extend(triple(&point.nominal));
    fields.extend(direction(&point.direction));
    fields.extend([number(point.lower_mm), number(point.upper_mm)]);
    match &point.measurement {
        Some(m) => {
            fields.extend(triple(&m.measured));
            fields.extend([number(m.deviation_mm), number(m.uncertainty_mm)]);
        }
        None => fields.extend(std::iter::repeat_n("nan".to_owned(), 5)),
    }
    fields.push(point.verdict.point_key().to_owned());
    text.push_str(&fields.join("\t"));
    text.push('\n');
}

/// Coordinates as fields.
pub(super) fn triple(p: &Point3) -> [String; 3] {
    [number(p.x), number(p.y), number(p.z)]
}

/// A direction as fields; a hole without a direction has none.
pub(super) fn direction(d: &Vector3) -> [String; 3] {
    if d.norm_squared() == 0.0 { std::array::from_fn(|_| "nan".to_owned()) } else { [d.x, d.y, d.z].map(number) }
}

/// Six decimals: a nanometre is finer than any scan. Zero has no sign, and what is not finite is `nan`.
pub(super) fn number(value: f64) -> String {
    if !value.is_finite() {
        return "nan".to_owned();
    }
    let text = format!("{value:.6}");
    if text == "-0.000000" { "0.000000".to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;

    #[test]
    fn golden() {
        let mut result = example::bracket();
        let inspection = example::inspection_mut(&mut result);
        inspection.points.retain(|p| p.name == "E03" || p.name == "E05");
        inspection.points[1].direction = Vector3::zeros();
        let expected = "\
# shapeline 1
# program: shapeline 0.1.0
# part: Bracket RH
# number: 4711-02
# revision: C
# plan: bracket_rh.toml
# plan_sha256: 64879f7d6b960a01909762d911a32d4582c20010c5641ee90278b644a9e3b525
# cad: bracket.stl
# cad_sha256: 2afe5e26e9c8cbec2eab056f3b79013cbef3b4b38f5cc51a84a64103ecb720ad
# scan: 0017.ply
# scan_sha256: 59ad1b2fc74287ded1bba7af67765d23ad4a49f1ae51902cc2ed3f8ebee96cfa
# status: measured
# verdict: fail
# side: top
# points_read: 2000000
# points_kept: 1313042
# best_fit_rms_mm: 0.112000
# best_fit_inlier_ratio: 0.970000
# best_fit_margin: 4.200000
# alignment: features
# degraded: no
# columns: name kind x y z i j k lower upper measured_x measured_y measured_z deviation uncertainty verdict
E03\tedge\t-34.000000\t-92.000000\t7.700000\t0.600000\t0.800000\t0.000000\t-0.700000\t0.700000\t-34.574800\t-92.766400\t7.700000\t-0.958000\t0.054000\tfail
E05\tedge\t-107.800000\t10.000000\t-0.200000\tnan\tnan\tnan\t-0.700000\t0.700000\tnan\tnan\tnan\tnan\tnan\tnot_measured
";
        assert_eq!(ascii(&result), expected);
    }

    #[test]
    fn hostile_names_cannot_break_a_row() {
        let mut result = example::bracket();
        result.identity.part_name = "Bracket\n# verdict: pass".into();
        example::inspection_mut(&mut result).points[0].name = "P\t01\r\nX\u{2028}".into();
        let text = ascii(&result);
        let columns = COLUMNS.split(' ').count();
        for row in text.lines().filter(|l| !l.starts_with('#')) {
            assert_eq!(row.split('\t').count(), columns, "{row}");
        }
        assert_eq!(text.lines().filter(|l| l.starts_with("# verdict:")).count(), 1);
    }

    #[test]
    fn refused_says_reason_and_help() {
        let text = ascii(&example::refused());
        assert!(text.contains("# status: refused\n# reason: the scan is cut off after 1,204,331"));
        assert!(text.contains("# help: copy it again"));
        assert!(text.lines().all(|l| l.starts_with('#')));
    }
}
