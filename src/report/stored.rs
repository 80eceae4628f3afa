//! What `NAME.json` says, read back for people to look at: identity, verdicts, values and reasons. Poses, gates and the map stay in the file.

use super::words::SCHEMA;
use crate::diagnostic::{Diagnostic, Refusal};
use crate::geometry::{Point3, Vector3};
use crate::inspect::verdict::{decide, of_part};
use crate::inspect::{Budget, HoleMeasurement, Identity, Measurement, PointResult, Verdict};
use crate::measure::Card;
use crate::plan::Decision;
use serde::Deserialize;

/// A result that was written earlier.
#[derive(Debug, Clone, PartialEq)]
pub struct Stored {
    /// Who and what was inspected, as of then.
    pub identity: Identity,
    /// What came out.
    pub outcome: StoredOutcome,
}

/// Measured, or refused with a reason.
#[derive(Debug, Clone, PartialEq)]
pub enum StoredOutcome {
    /// The scan was measured.
    Measured(StoredInspection),
    /// The scan could not be measured.
    Refused(Refusal),
}

/// What was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredInspection {
    /// Verdict of the part.
    pub verdict: Verdict,
    /// Comparison points in the order of the plan of then, CAD frame, mm; their cards hold no gates.
    pub points: Vec<PointResult>,
    /// Why the alignment was not the plan's own.
    pub degraded: Option<String>,
    /// What somebody should have known.
    pub warnings: Vec<String>,
}

/// Reads a result. The error: it is no result of this program, or says what cannot be: a pass
/// without a value or outside its limits, a part better than its points and its alignment allow.
pub fn read_stored(bytes: &[u8]) -> Result<Stored, Diagnostic> {
    let report: Report =
        serde_json::from_slice(bytes).map_err(|e| Diagnostic::error(format!("cannot be read as a result: {e}")))?;
    if report.schema != SCHEMA {
        let message = format!("found schema \"{}\", expected \"{SCHEMA}\"", report.schema);
        return Err(Diagnostic::error(message).with_help("it may be of another version of the program"));
    }
    let outcome = match report.status.as_str() {
        "refused" => {
            let [reason, help] = [report.reason, report.help].map(Option::unwrap_or_default);
            StoredOutcome::Refused(Refusal::new(reason, help))
        }
        "measured" => {
            StoredOutcome::Measured(inspection(report.verdict, report.points, report.alignment, report.warnings)?)
        }
        other => return Err(Diagnostic::error(format!("found status \"{other}\", expected measured or refused"))),
    };
    let identity = Identity {
        part_name: report.part.name,
        part_number: report.part.number,
        part_revision: report.part.revision,
        plan_file: report.plan.file,
        plan_sha256: report.plan.sha256,
        cad_file: report.cad.file,
        cad_sha256: report.cad.sha256,
        cad_triangles: report.cad.triangles,
        scan_file: report.scan.file,
        scan_sha256: report.scan.sha256,
        scan_taken: report.scan.taken,
    };
    Ok(Stored { identity, outcome })
}

fn inspection(
    verdict: Option<String>,
    points: Vec<Point>,
    alignment: Option<Alignment>,
    warnings: Vec<String>,
) -> Result<StoredInspection, Diagnostic> {
    let verdict = verdict_of(verdict.as_deref().unwrap_or(""))?;
    let points = points.into_iter().map(point).collect::<Result<Vec<_>, _>>()?;
    let degraded = alignment.and_then(|a| a.reason);
    if of_part(&points, degraded.is_some()) > verdict {
        return Err(Diagnostic::error("the part has a better verdict than its points and its alignment allow"));
    }
    Ok(StoredInspection { verdict, points, degraded, warnings })
}

fn verdict_of(word: &str) -> Result<Verdict, Diagnostic> {
    match word {
        "pass" => Ok(Verdict::Pass),
        "undecided" => Ok(Verdict::Undecided),
        "not_measured" | "incomplete" => Ok(Verdict::NotMeasured),
        "fail" => Ok(Verdict::Fail),
        other => Err(Diagnostic::error(format!("found verdict \"{other}\", which is none"))),
    }
}

fn point(point: Point) -> Result<PointResult, Diagnostic> {
    let verdict = verdict_of(&point.verdict)?;
    let kind = match point.kind.as_str() {
        "surface" => "surface",
        "edge" => "edge",
        "hole" => "hole",
        other => return Err(Diagnostic::error(format!("point \"{}\": found kind \"{other}\"", point.name))),
    };
    let measurement = measurement(&point);
    if measurement.is_none() != (verdict == Verdict::NotMeasured) {
        let message =
            format!("point \"{}\": its verdict \"{}\" and its value do not go together", point.name, point.verdict);
        return Err(Diagnostic::error(message));
    }
    // A side without a limit has none in the file.
    let lower_mm = point.lower_mm.unwrap_or(f64::NEG_INFINITY);
    let upper_mm = point.upper_mm.unwrap_or(f64::INFINITY);
    let why = point.why.unwrap_or_default();
    let card = Card {
        window_mm: why.window_mm,
        normal: why.normal.map(Into::into),
        residual_mm: why.residual_mm,
        spacing_mm: why.spacing_mm,
        cad_edge_mm: why.cad_edge_mm,
        covered: why.covered_ratio,
        ..Card::default()
    };
    // A pass proved by no rule at all.
    if let (Verdict::Pass, Some(m)) = (verdict, &measurement)
        && decide(Decision::Plain, m.deviation_mm, m.uncertainty_mm, lower_mm, upper_mm).0 != Verdict::Pass
    {
        return Err(Diagnostic::error(format!("point \"{}\": it passes with a value outside its limits", point.name)));
    }
    Ok(PointResult {
        name: point.name,
        kind,
        nominal: point.nominal.into(),
        direction: point.direction.map_or_else(Vector3::zeros, Into::into),
        lower_mm,
        upper_mm,
        verdict,
        reason: point.reason,
        points_used: point.points_used,
        card,
        measurement,
    })
}

/// The numbers, where all are there.
fn measurement(point: &Point) -> Option<Measurement> {
    let parts = point.why.as_ref().and_then(|why| why.standard_uncertainties_mm.as_ref());
    let budget = parts.map_or_else(Budget::default, |u| Budget {
        fit_mm: u.fit,
        pose_mm: u.pose,
        thickness_mm: u.thickness,
        scale_mm: u.scale,
        edge_offset_mm: u.edge_offset,
        system_mm: u.system,
    });
    let hole = match (point.position_mm, point.delta_mm, point.diameter_mm, point.diameter_deviation_mm) {
        (Some(position_mm), Some(delta), Some(diameter_mm), Some(diameter_deviation_mm)) => {
            Some(HoleMeasurement { position_mm, delta_mm: delta.into(), diameter_mm, diameter_deviation_mm })
        }
        _ => None,
    };
    Some(Measurement {
        measured: Point3::from(point.measured?),
        deviation_mm: point.deviation_mm?,
        uncertainty_mm: point.uncertainty_mm?,
        budget,
        rms_mm: point.rms_mm?,
        hole,
    })
}

#[derive(Deserialize)]
struct Report {
    schema: String,
    part: Part,
    plan: File,
    cad: Cad,
    scan: Scan,
    status: String,
    reason: Option<String>,
    help: Option<String>,
    verdict: Option<String>,
    #[serde(default)]
    points: Vec<Point>,
    alignment: Option<Alignment>,
    #[serde(default)]
    warnings: Vec<String>,
}

#[derive(Deserialize)]
struct Part {
    name: String,
    number: String,
    revision: String,
}

#[derive(Deserialize)]
struct File {
    file: String,
    sha256: String,
}

#[derive(Deserialize)]
struct Cad {
    file: String,
    sha256: String,
    triangles: usize,
}

#[derive(Deserialize)]
struct Scan {
    file: String,
    sha256: Option<String>,
    taken: Option<String>,
}

#[derive(Deserialize)]
struct Alignment {
    reason: Option<String>,
}

#[derive(Deserialize)]
struct Point {
    name: String,
    kind: String,
    nominal: [f64; 3],
    direction: Option<[f64; 3]>,
    measured: Option<[f64; 3]>,
    deviation_mm: Option<f64>,
    uncertainty_mm: Option<f64>,
    lower_mm: Option<f64>,
    upper_mm: Option<f64>,
    verdict: String,
    reason: Option<String>,
    points_used: usize,
    rms_mm: Option<f64>,
    position_mm: Option<f64>,
    delta_mm: Option<[f64; 3]>,
    diameter_mm: Option<f64>,
    diameter_deviation_mm: Option<f64>,
    why: Option<Why>,
}

#[derive(Deserialize, Default)]
struct Why {
    window_mm: Option<f64>,
    normal: Option<[f64; 3]>,
    residual_mm: Option<f64>,
    spacing_mm: Option<f64>,
    cad_edge_mm: Option<f64>,
    covered_ratio: Option<f64>,
    standard_uncertainties_mm: Option<Uncertainties>,
}

#[derive(Deserialize)]
struct Uncertainties {
    fit: f64,
    pose: f64,
    thickness: f64,
    scale: f64,
    edge_offset: f64,
    system: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::{example, json};

    #[test]
    fn what_was_written_is_read_back_to_the_bit() {
        for result in [example::bracket(), example::degraded()] {
            let stored = read_stored(json(&result).as_bytes()).unwrap();
            assert_eq!(stored.identity, result.identity);
            let StoredOutcome::Measured(read) = stored.outcome else { panic!("it was measured") };
            let written = example::inspection(&result);
            assert_eq!((read.verdict, &read.warnings), (written.verdict, &written.warnings));
            assert_eq!(read.degraded, written.alignment.degraded);
            let without_gates = |p: &PointResult| {
                let card = Card { gates: Vec::new(), blended: Vec::new(), ..p.card.clone() };
                PointResult { card, ..p.clone() }
            };
            assert_eq!(read.points, written.points.iter().map(without_gates).collect::<Vec<_>>());
        }
        let refused = example::refused();
        let stored = read_stored(json(&refused).as_bytes()).unwrap();
        let crate::inspect::Outcome::Refused(refusal) = &refused.outcome else { panic!() };
        let StoredOutcome::Refused(read) = stored.outcome else { panic!("it was refused") };
        assert_eq!((&read.reason, &read.help), (&refusal.reason, &refusal.help));
    }

    #[test]
    fn what_cannot_be_is_no_result() {
        let text = json(&example::bracket());
        let refused = |from: &str, to: &str| {
            assert!(text.contains(from), "{from}");
            read_stored(text.replacen(from, to, 1).as_bytes()).unwrap_err().message
        };
        assert!(refused("shapeline-result/1", "shapeline-result/9").contains("expected \"shapeline-result/1\""));
        // E05 has no value; the part fails by P08 and E03.
        assert!(refused("\"verdict\": \"not_measured\"", "\"verdict\": \"pass\"").contains("\"E05\""));
        assert!(refused("\"verdict\": \"fail\"", "\"verdict\": \"pass\"").contains("than its points"));
        // The part's verdict made a pass and its points taken away; and the limit of P01 drawn in below its deviation of -0.120.
        let (head, rest) = text.split_once("\"points\": [").unwrap();
        let (_, tail) = rest.split_once("\n  ]").unwrap();
        let empty = format!("{head}\"points\": []{tail}").replacen("\"verdict\": \"fail\"", "\"verdict\": \"pass\"", 1);
        assert!(read_stored(empty.as_bytes()).unwrap_err().message.contains("than its points"));
        assert!(refused("\"lower_mm\": -0.5", "\"lower_mm\": -0.1").contains("outside its limits"));
        assert!(refused("\"verdict\": \"fail\"", "\"verdict\": \"good\"").contains("\"good\""));
        assert!(read_stored(&text.as_bytes()[..text.len() / 2]).is_err() && read_stored(b"\xff").is_err());
    }
}
