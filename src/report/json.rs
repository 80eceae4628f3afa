//! `NAME.json`: the result for other programs, key by key as the interface says.
//!
//! A number that was not measured is `null`. Every number is the shortest text that reads back as the same `f64`; nothing
//! is rounded, so that poses stay proper motions.

use super::json_layout::Layout;
use super::json_why::{WhyJson, why_json};
use super::words::{PROGRAM, SCHEMA};
use crate::align::{BestFit, FeatureAlignment, LockResidual, MeasuredFeature};
use crate::diagnostic::{Refusal, Rivals};
use crate::geometry::Vector3;
use crate::inspect::{Inspection, InspectionResult, MapStatistics, Outcome, PointResult};
use crate::scan::Removed;
use serde::Serialize;

#[derive(Serialize)]
struct Report<'a> {
    schema: &'static str,
    program: &'static str,
    part: Part<'a>,
    plan: Plan<'a>,
    cad: Cad<'a>,
    scan: Scan<'a>,
    status: &'static str,
    #[serde(flatten)]
    refused: Option<Refused<'a>>,
    #[serde(flatten)]
    measured: Option<Measured<'a>>,
}

#[derive(Serialize)]
struct Part<'a> {
    name: &'a str,
    number: &'a str,
    revision: &'a str,
}

#[derive(Serialize)]
struct Plan<'a> {
    file: &'a str,
    sha256: &'a str,
}

#[derive(Serialize)]
struct Cad<'a> {
    file: &'a str,
    sha256: &'a str,
    triangles: usize,
}

#[derive(Serialize)]
struct Scan<'a> {
    file: &'a str,
    sha256: Option<&'a str>,
    taken: Option<&'a str>,
    points_read: Option<usize>,
    points_kept: Option<usize>,
    removed: Option<&'a Removed>,
}

#[derive(Serialize)]
struct Refused<'a> {
    reason: &'a str,
    help: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    best_fit: Option<RivalsJson>,
}

/// What is known of a best fit that was not certain: no pose, so that nobody takes it for one.
#[derive(Serialize)]
struct RivalsJson {
    margin: f64,
    margin_limit: f64,
    apart_deg: Option<f64>,
    apart_mm: Option<f64>,
}

#[derive(Serialize)]
struct Measured<'a> {
    verdict: &'static str,
    side: Option<&'static str>,
    best_fit: BestFitJson,
    alignment: AlignmentJson<'a>,
    points: Vec<PointJson<'a>>,
    map: MapJson,
    warnings: &'a [String],
}

#[derive(Serialize)]
struct BestFitJson {
    cad_from_scan: [f64; 16],
    rms_mm: f64,
    inlier_ratio: f64,
    margin: f64,
    margin_limit: f64,
    poses_tried: usize,
}

#[derive(Serialize)]
struct AlignmentJson<'a> {
    method: &'static str,
    cad_from_scan: [f64; 16],
    degraded: bool,
    reason: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    condition: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    weak: Option<&'a str>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    residuals: Vec<ResidualJson<'a>>,
    features: Vec<FeatureJson<'a>>,
}

/// What is left of a lock where there are more than six.
#[derive(Serialize)]
struct ResidualJson<'a> {
    name: &'a str,
    lock: [f64; 3],
    residual_mm: f64,
    normalised: Option<f64>,
}

#[derive(Serialize)]
struct FeatureJson<'a> {
    name: &'a str,
    kind: &'static str,
    fixes: &'a str,
    centre: [f64; 3],
    axis: [f64; 3],
    #[serde(skip_serializing_if = "Option::is_none")]
    direction: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    diameter_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    nominal_diameter_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    length_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    nominal_length_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    width_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    nominal_width_mm: Option<f64>,
    points_used: usize,
    rms_mm: f64,
}

#[derive(Serialize)]
struct PointJson<'a> {
    name: &'a str,
    kind: &'static str,
    nominal: [f64; 3],
    direction: Option<[f64; 3]>,
    measured: Option<[f64; 3]>,
    deviation_mm: Option<f64>,
    uncertainty_mm: Option<f64>,
    lower_mm: f64,
    upper_mm: f64,
    verdict: &'static str,
    reason: Option<&'a str>,
    points_used: usize,
    rms_mm: Option<f64>,
    #[serde(flatten)]
    hole: Option<HoleJson>,
    why: WhyJson,
}

#[derive(Serialize)]
struct HoleJson {
    position_mm: Option<f64>,
    delta_mm: Option<[f64; 3]>,
    diameter_mm: Option<f64>,
    diameter_deviation_mm: Option<f64>,
}

#[derive(Serialize)]
struct MapJson {
    points: usize,
    mean_mm: Option<f64>,
    rms_mm: Option<f64>,
    p05_mm: Option<f64>,
    p95_mm: Option<f64>,
    within_range_ratio: Option<f64>,
    past_edge: usize,
    far: usize,
}

/// The JSON report, with a line feed at its end.
pub fn json(result: &InspectionResult) -> String {
    let id = &result.identity;
    let (measured, refused) = match &result.outcome {
        Outcome::Measured(inspection) => (Some(&**inspection), None),
        Outcome::Refused(refusal) => (None, Some(refused_json(refusal))),
    };
    let report = Report {
        schema: SCHEMA,
        program: PROGRAM,
        part: Part { name: &id.part_name, number: &id.part_number, revision: &id.part_revision },
        plan: Plan { file: &id.plan_file, sha256: &id.plan_sha256 },
        cad: Cad { file: &id.cad_file, sha256: &id.cad_sha256, triangles: id.cad_triangles },
        scan: Scan {
            file: &id.scan_file,
            sha256: id.scan_sha256.as_deref(),
            taken: id.scan_taken.as_deref(),
            points_read: result.counts.points_read,
            points_kept: result.counts.points_kept,
            removed: result.counts.removed.as_ref(),
        },
        status: if refused.is_some() { "refused" } else { "measured" },
        refused,
        measured: measured.map(measured_json),
    };
    let mut bytes = Vec::new();
    let mut serializer = serde_json::Serializer::with_formatter(&mut bytes, Layout::default());
    report.serialize(&mut serializer).expect("plain data with string keys into memory always serialises");
    bytes.push(b'\n');
    String::from_utf8(bytes).expect("JSON is written as UTF-8")
}

fn refused_json(refusal: &Refusal) -> Refused<'_> {
    let rivals = |r: Rivals| RivalsJson {
        margin: r.margin,
        margin_limit: r.margin_limit,
        apart_deg: r.apart.map(|(angle, _)| angle.to_degrees()),
        apart_mm: r.apart.map(|(_, distance)| distance),
    };
    Refused { reason: &refusal.reason, help: &refusal.help, best_fit: refusal.rivals.map(rivals) }
}

fn measured_json(inspection: &Inspection) -> Measured<'_> {
    Measured {
        verdict: inspection.verdict.part_key(),
        side: inspection.best_fit.side.map(|side| side.key()),
        best_fit: best_fit_json(&inspection.best_fit),
        alignment: alignment_json(&inspection.alignment),
        points: inspection.points.iter().map(point_json).collect(),
        map: map_json(&inspection.map.statistics),
        warnings: &inspection.warnings,
    }
}

fn best_fit_json(fit: &BestFit) -> BestFitJson {
    BestFitJson {
        cad_from_scan: fit.cad_from_scan.row_major(),
        rms_mm: fit.rms_mm,
        inlier_ratio: fit.inlier_ratio,
        margin: fit.margin,
        margin_limit: fit.margin_limit,
        poses_tried: fit.poses_tried,
    }
}

fn alignment_json(alignment: &FeatureAlignment) -> AlignmentJson<'_> {
    let hold = alignment.hold.as_ref();
    AlignmentJson {
        method: alignment.method,
        cad_from_scan: alignment.cad_from_scan.row_major(),
        degraded: alignment.degraded.is_some(),
        reason: alignment.degraded.as_deref(),
        condition: hold.map(|hold| hold.condition),
        weak: hold.and_then(|hold| hold.weak.as_deref()),
        residuals: hold.map_or_else(Vec::new, |hold| hold.residuals.iter().map(residual_json).collect()),
        features: alignment.features.iter().map(feature_json).collect(),
    }
}

fn residual_json(left: &LockResidual) -> ResidualJson<'_> {
    ResidualJson {
        name: &left.name,
        lock: left.lock.into(),
        residual_mm: left.residual_mm,
        normalised: left.normalised,
    }
}

fn feature_json(feature: &MeasuredFeature) -> FeatureJson<'_> {
    let slot = feature.kind == "slot";
    let only = |when: bool, value: Option<f64>| if when { value } else { None };
    FeatureJson {
        name: &feature.name,
        kind: feature.kind,
        fixes: &feature.fixes,
        centre: feature.centre.coords.into(),
        axis: feature.axis.into(),
        direction: feature.direction.map(Into::into),
        diameter_mm: only(!slot, feature.diameter_mm),
        nominal_diameter_mm: only(!slot, feature.nominal_diameter_mm),
        length_mm: feature.length_mm,
        nominal_length_mm: feature.nominal_length_mm,
        width_mm: only(slot, feature.diameter_mm),
        nominal_width_mm: only(slot, feature.nominal_diameter_mm),
        points_used: feature.points_used,
        rms_mm: feature.rms_mm,
    }
}

fn point_json(point: &PointResult) -> PointJson<'_> {
    let m = point.measurement.as_ref();
    let hole = m.and_then(|m| m.hole.as_ref());
    PointJson {
        name: &point.name,
        kind: point.kind,
        nominal: point.nominal.coords.into(),
        direction: (point.direction != Vector3::zeros()).then(|| point.direction.into()),
        measured: m.map(|m| m.measured.coords.into()),
        deviation_mm: m.map(|m| m.deviation_mm),
        uncertainty_mm: m.map(|m| m.uncertainty_mm),
        lower_mm: point.lower_mm,
        upper_mm: point.upper_mm,
        verdict: point.verdict.point_key(),
        reason: point.reason.as_deref(),
        points_used: point.points_used,
        rms_mm: m.map(|m| m.rms_mm),
        why: why_json(point),
        hole: (point.kind == "hole").then(|| HoleJson {
            position_mm: hole.map(|h| h.position_mm),
            delta_mm: hole.map(|h| h.delta_mm.into()),
            diameter_mm: hole.map(|h| h.diameter_mm),
            diameter_deviation_mm: hole.map(|h| h.diameter_deviation_mm),
        }),
    }
}

/// A map without points has no mean: its numbers are `null`.
fn map_json(statistics: &MapStatistics) -> MapJson {
    let some = |value| (statistics.points > 0).then_some(value);
    MapJson {
        points: statistics.points,
        mean_mm: some(statistics.mean_mm),
        rms_mm: some(statistics.rms_mm),
        p05_mm: some(statistics.p05_mm),
        p95_mm: some(statistics.p95_mm),
        within_range_ratio: some(statistics.within_range_ratio),
        past_edge: statistics.past_edge,
        far: statistics.far,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;
    use serde_json::Value;

    /// The keys of an object in the order in which the text has them.
    fn keys_in_text(text: &str, blanks: usize) -> Vec<String> {
        let start = format!("{}\"", " ".repeat(blanks));
        text.lines()
            .filter_map(|l| l.strip_prefix(&start).and_then(|l| l.split_once("\": ")).map(|(key, _)| key.to_owned()))
            .collect()
    }

    #[test]
    fn keys_stand_as_the_interface_has_them() {
        let text = json(&example::bracket());
        let expected = "schema program part plan cad scan status verdict side best_fit alignment points map warnings";
        assert_eq!(keys_in_text(&text, 2), expected.split(' ').collect::<Vec<_>>());
        let value: Value = serde_json::from_str(&text).unwrap();
        let has = |at: &Value, keys: &str| keys.split(' ').all(|k| at.get(k).is_some());
        assert!(has(&value["scan"], "file sha256 taken points_read points_kept removed"));
        assert!(has(&value["scan"]["removed"], "invalid duplicate belt colour dark stray other"));
        assert!(has(&value["best_fit"], "cad_from_scan rms_mm inlier_ratio margin poses_tried"));
        assert!(has(&value["alignment"], "method cad_from_scan degraded features"));
        assert!(has(&value["alignment"]["features"][0], "name kind centre axis diameter_mm points_used rms_mm"));
        let point = "name kind nominal direction measured deviation_mm uncertainty_mm lower_mm upper_mm verdict reason points_used";
        assert!(value["points"].as_array().unwrap().iter().all(|p| has(p, point)));
        assert!(has(&value["points"][10], "position_mm delta_mm diameter_mm diameter_deviation_mm"));
        assert!(value["points"][0].get("position_mm").is_none());
        assert!(has(&value["map"], "points mean_mm rms_mm p05_mm p95_mm within_range_ratio"));
    }

    #[test]
    fn numbers_read_back_as_they_were() {
        let result = example::bracket();
        let inspection = example::inspection(&result);
        let value: Value = serde_json::from_str(&json(&result)).unwrap();
        let pose: Vec<f64> = serde_json::from_value(value["best_fit"]["cad_from_scan"].clone()).unwrap();
        assert_eq!(pose, inspection.best_fit.cad_from_scan.row_major());
        for (point, p) in inspection.points.iter().zip(value["points"].as_array().unwrap()) {
            assert_eq!(p["name"], *point.name);
            assert_eq!(p["deviation_mm"].as_f64(), point.measurement.as_ref().map(|m| m.deviation_mm));
            let nominal: [f64; 3] = serde_json::from_value(p["nominal"].clone()).unwrap();
            assert_eq!(nominal, [point.nominal.x, point.nominal.y, point.nominal.z]);
        }
    }

    #[test]
    fn what_was_not_measured_is_null_and_never_zero() {
        let mut result = example::bracket();
        example::inspection_mut(&mut result).map = Default::default();
        example::inspection_mut(&mut result).points[9].direction = Vector3::zeros();
        example::inspection_mut(&mut result).best_fit.margin = f64::INFINITY;
        example::inspection_mut(&mut result).best_fit.side = None;
        let text = json(&result);
        let value: Value = serde_json::from_str(&text).unwrap();
        let e05 = &value["points"][8];
        assert_eq!(e05["name"], "E05");
        for key in ["measured", "deviation_mm", "uncertainty_mm", "rms_mm"] {
            assert!(e05[key].is_null(), "{key}");
        }
        assert!(value["points"][9]["direction"].is_null());
        assert!(value["map"]["mean_mm"].is_null() && value["map"]["points"] == 0);
        assert!(value["best_fit"]["margin"].is_null() && value["side"].is_null() && value["scan"]["taken"].is_null());
        assert!(!text.contains("inf") && !text.contains("NaN"));
    }

    #[test]
    fn refused_and_degraded() {
        let value: Value = serde_json::from_str(&json(&example::refused())).unwrap();
        assert_eq!(value["status"], "refused");
        assert!(value["reason"].as_str().unwrap().contains("cut off") && value["help"].is_string());
        assert!(value.get("verdict").is_none() && value["scan"]["points_read"].is_null());

        assert!(value.get("best_fit").is_none());

        let mut between_two = example::refused();
        let Outcome::Refused(refusal) = &mut between_two.outcome else { panic!("a refused scan") };
        refusal.rivals = Some(Rivals { margin: 1.25, margin_limit: 1.5, apart: Some((std::f64::consts::PI, 0.5)) });
        between_two.counts.points_kept = Some(17);
        let value: Value = serde_json::from_str(&json(&between_two)).unwrap();
        assert_eq!(value["best_fit"]["margin"], 1.25);
        assert_eq!(value["best_fit"]["margin_limit"], 1.5);
        assert_eq!((&value["best_fit"]["apart_deg"], &value["best_fit"]["apart_mm"]), (&180.0.into(), &0.5.into()));
        assert_eq!(value["scan"]["points_kept"], 17);

        let value: Value = serde_json::from_str(&json(&example::degraded())).unwrap();
        assert_eq!(value["verdict"], "incomplete");
        assert_eq!(value["alignment"]["method"], "best_fit");
        assert_eq!(value["alignment"]["degraded"], true);
        assert!(value["alignment"]["reason"].as_str().unwrap().contains("S1"));
        assert!(value["points"].as_array().unwrap().iter().all(|p| p["verdict"] == "not_measured"));
    }

    #[test]
    fn numbers_of_an_array_stand_on_one_line() {
        let text = json(&example::bracket());
        assert!(text.contains("\"nominal\": [-60.0, 30.0, 5.416],"), "{text}");
        assert!(text.contains("\"warnings\": []\n}\n"), "{text}");
    }
}
