//! The report of a merge as JSON, for other programs. Lengths are in the unit that it names; nothing of a clock is in it.

use super::json_layout::Layout;
use super::merge_pages::MergeExtras;
use super::pdf::merge::FeatureRow;
use super::words::PROGRAM;
use crate::geometry::Isometry3;
use crate::plan::merge::{Judge, MergePlan};
use crate::stitch::feature::FeatureFit;
use crate::stitch::register::{Cycle, Pair, PairState, Placed, Registration, Weak};
use crate::stitch::wear::{Verdict, Wear, WornRegion};
use crate::stitch::{FileIdentity, MergeResult, PointCounts, ViewEnd, ViewFile};
use serde::Serialize;

/// The name and version of the layout.
pub const MERGE_SCHEMA: &str = "shapeline-merge/1";

#[derive(Serialize)]
struct Report<'a> {
    schema: &'static str,
    program: &'static str,
    merge: Option<FileJson<'a>>,
    poses: Option<FileJson<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    cad: Option<FileJson<'a>>,
    calibration: CalibrationJson<'a>,
    unit: &'static str,
    metric: MetricJson,
    d_grid: f64,
    d_s: f64,
    points_in: usize,
    points_out: usize,
    columns: Vec<&'static str>,
    views: Vec<ViewJson<'a>>,
    #[serde(flatten)]
    registration: Option<RegistrationJson<'a>>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    features: Vec<FeatureJson<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    wear: Option<ComparedJson<'a>>,
    warnings: Vec<&'a str>,
}

/// A feature before (all points of the placed views) and after merging.
#[derive(Serialize)]
struct FeatureJson<'a> {
    name: &'a str,
    radius: Option<f64>,
    radius_u: Option<f64>,
    before: FitJson<'a>,
    after: FitJson<'a>,
}

#[derive(Serialize)]
#[serde(untagged)]
enum FitJson<'a> {
    Fitted {
        radius: Option<f64>,
        radius_u: Option<f64>,
        d_r: Option<f64>,
        sigma_dev: f64,
        points: usize,
        rejected: usize,
    },
    Not {
        reason: &'a str,
    },
}

#[derive(Serialize)]
#[serde(untagged)]
enum ComparedJson<'a> {
    Told(Box<WearJson<'a>>),
    Not { compare_with: &'a str, reason: &'a str },
}

/// The difference to an earlier cloud; uncertainties are standard ones.
#[derive(Serialize)]
struct WearJson<'a> {
    compare_with: &'a str,
    verdict: &'static str,
    doubt: Option<&'static str>,
    reason: Option<String>,
    old_from_new: PoseJson,
    moved: f64,
    free_motions: usize,
    as_before: f64,
    otherwise: f64,
    radius: f64,
    least_radius: f64,
    smooth_u: f64,
    not_measured: usize,
    old_not_seen: usize,
    least_area: f64,
    least_significance: f64,
    least_difference: f64,
    regions: Vec<RegionJson>,
}

#[derive(Serialize)]
struct RegionJson {
    area: f64,
    area_u: f64,
    area_told: f64,
    mean: f64,
    mean_u: f64,
    extreme: f64,
    extreme_u: f64,
    extreme_radius: f64,
    blurred: bool,
    extreme_at: [f64; 3],
    centre: [f64; 3],
    normal: [f64; 3],
    significance: f64,
    points: usize,
}

#[derive(Serialize)]
struct FileJson<'a> {
    file: &'a str,
    sha256: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    features: Option<usize>,
}

#[derive(Serialize)]
struct CalibrationJson<'a> {
    camera: Option<FileJson<'a>>,
    projector: Option<FileJson<'a>>,
}

#[derive(Serialize)]
#[serde(untagged)]
enum MetricJson {
    One(&'static str),
    Several(Vec<&'static str>),
}

#[derive(Serialize)]
struct ViewJson<'a> {
    index: usize,
    file: &'a str,
    sha256: Option<&'a str>,
    status: &'static str,
    reason: Option<&'a str>,
    #[serde(flatten)]
    counts: Option<&'a PointCounts>,
    points_out: usize,
    pose: Option<PoseJson>,
    #[serde(flatten)]
    refined: Option<RefinedJson>,
}

/// What registration did to a view; lengths are told at the middle of its points.
#[derive(Serialize)]
struct RefinedJson {
    moved: Option<f64>,
    turned_deg: Option<f64>,
    translation_u: f64,
    rotation_u_deg: f64,
    agreement: f64,
}

#[derive(Serialize)]
struct RegistrationJson<'a> {
    noise: f64,
    pairs: Vec<PairJson<'a>>,
    cycles: Vec<CycleJson>,
    weak: Vec<WeakJson<'a>>,
}

/// Two views that may overlap, by their indices.
#[derive(Serialize)]
struct PairJson<'a> {
    a: usize,
    b: usize,
    shared: usize,
    share: f64,
    rms: f64,
    mean: f64,
    agreement: f64,
    used: bool,
    weight: Option<f64>,
    reason: Option<&'a str>,
}

#[derive(Serialize)]
struct CycleJson {
    views: Vec<usize>,
    translation: f64,
    angle_deg: f64,
    expected_translation: f64,
    expected_angle_deg: f64,
    normalised: f64,
}

#[derive(Serialize)]
struct WeakJson<'a> {
    view: usize,
    uncertainty: f64,
    words: &'a str,
}

/// `x_world = R x_view + t`.
#[derive(Serialize)]
#[allow(non_snake_case, reason = "as in the file of poses")]
struct PoseJson {
    R: [[f64; 3]; 3],
    t: [f64; 3],
}

impl PoseJson {
    fn new(pose: &Isometry3) -> Self {
        let r = pose.rotation.to_rotation_matrix();
        Self { R: std::array::from_fn(|i| std::array::from_fn(|j| r[(i, j)])), t: pose.translation.vector.into() }
    }
}

/// The report, with a line feed at its end.
pub fn merge_json(plan: &MergePlan, result: &MergeResult, extras: &MergeExtras) -> String {
    let id = &result.identity;
    let metric = match &plan.merge.judge.value {
        Judge::Mean => MetricJson::One("mean"),
        Judge::Metrics(metrics) => match metrics.as_slice() {
            [metric] => MetricJson::One(metric.key()),
            several => MetricJson::Several(several.iter().map(|metric| metric.key()).collect()),
        },
    };
    let points_out = result.points_out();
    let report = Report {
        schema: MERGE_SCHEMA,
        program: PROGRAM,
        merge: id.merge.as_ref().map(|of| file_json(of, None)),
        poses: id.poses.as_ref().map(|of| file_json(of, None)),
        cad: id.cad.as_ref().map(|of| file_json(of, None)),
        calibration: CalibrationJson {
            camera: id.camera.as_ref().map(|(of, features)| file_json(of, Some(*features))),
            projector: id.projector.as_ref().map(|(of, features)| file_json(of, Some(*features))),
        },
        unit: plan.unit.key(),
        metric,
        d_grid: result.placed.d_grid,
        d_s: result.merged.d_s,
        points_in: result.merged.points_in,
        points_out: result.merged.positions.len(),
        columns: result.merged.columns.keys().map(|metric| metric.key()).collect(),
        views: result.files.iter().enumerate().map(|(k, view)| view_json(result, k, view, points_out[k])).collect(),
        registration: result.placed.registration.as_ref().map(|found| registration_json(found, &result.placed.indices)),
        features: extras.features.iter().map(feature_json).collect(),
        wear: compared_json(plan, extras),
        warnings: result.placed.warnings.iter().chain(&result.merged.warnings).map(String::as_str).collect(),
    };
    let mut bytes = Vec::new();
    let mut serializer = serde_json::Serializer::with_formatter(&mut bytes, Layout::default());
    report.serialize(&mut serializer).expect("plain data with string keys into memory always serialises");
    bytes.push(b'\n');
    String::from_utf8(bytes).expect("JSON is written as UTF-8")
}

fn feature_json(row: &FeatureRow) -> FeatureJson<'_> {
    let certified = row.certified.map(|c| c.0);
    fn fit(fit: &Result<FeatureFit, String>, certified: Option<f64>) -> FitJson<'_> {
        match fit {
            Ok(fit) => FitJson::Fitted {
                radius: fit.radius,
                radius_u: fit.radius_u,
                d_r: fit.d_r(certified),
                sigma_dev: fit.sigma_dev,
                points: fit.points,
                rejected: fit.rejected,
            },
            Err(reason) => FitJson::Not { reason },
        }
    }
    FeatureJson {
        name: &row.name,
        radius: certified,
        radius_u: row.certified.map(|c| c.1),
        before: fit(&row.before, certified),
        after: fit(&row.after, certified),
    }
}

fn compared_json<'a>(plan: &'a MergePlan, extras: &'a MergeExtras) -> Option<ComparedJson<'a>> {
    let compare_with = plan.output.compare_with.as_ref().map_or("", |old| old.file.as_str());
    match (&extras.wear, &extras.not_compared) {
        (Some(wear), _) => Some(ComparedJson::Told(Box::new(wear_json(plan, wear)))),
        (None, Some(reason)) => Some(ComparedJson::Not { compare_with, reason }),
        (None, None) => None,
    }
}

fn wear_json<'a>(plan: &'a MergePlan, wear: &Wear) -> WearJson<'a> {
    let region = |r: &WornRegion| RegionJson {
        area: r.area,
        area_u: r.area_u,
        area_told: r.area_told,
        mean: r.mean,
        mean_u: r.mean_u,
        extreme: r.extreme,
        extreme_u: r.extreme_u,
        extreme_radius: r.extreme_radius,
        blurred: r.blurred,
        extreme_at: r.extreme_at.coords.into(),
        centre: r.centre.coords.into(),
        normal: r.normal.into(),
        significance: r.significance,
        points: r.points.len(),
    };
    let (verdict, doubt) = match wear.verdict {
        Verdict::Differs => ("differs", None),
        Verdict::Same => ("same", None),
        Verdict::CannotBeTold(doubt) => ("cannot_be_told", Some(doubt)),
    };
    WearJson {
        compare_with: plan.output.compare_with.as_ref().map_or("", |old| &old.file),
        verdict,
        doubt: doubt.map(|d| d.key()),
        reason: doubt.map(|d| d.words(plan.unit.key())),
        old_from_new: PoseJson::new(&wear.old_from_new),
        moved: wear.fit.moved,
        free_motions: wear.fit.free_motions,
        as_before: wear.fit.as_before,
        otherwise: wear.fit.otherwise,
        radius: wear.radius,
        least_radius: wear.least_radius,
        smooth_u: wear.smooth_u,
        not_measured: wear.not_measured,
        old_not_seen: wear.old_not_seen,
        least_area: wear.least_area,
        least_significance: wear.least_significance,
        least_difference: wear.least_difference,
        regions: wear.regions.iter().map(region).collect(),
    }
}

fn file_json(of: &FileIdentity, features: Option<usize>) -> FileJson<'_> {
    FileJson { file: &of.file, sha256: &of.sha256, features }
}

fn view_json<'a>(result: &'a MergeResult, index: usize, view: &'a ViewFile, points_out: usize) -> ViewJson<'a> {
    let reason = result.why_left_out(view);
    let ready = match view.end {
        ViewEnd::Ready(k) => Some(k),
        ViewEnd::Unusable(_) => None,
    };
    ViewJson {
        index,
        file: &view.name,
        sha256: view.sha256.as_deref(),
        status: if reason.is_none() { "merged" } else { "left_out" },
        reason,
        counts: ready.map(|k| &result.placed.counts[k]),
        points_out,
        pose: ready.and_then(|k| result.placed.outcomes[k].world_from_view()).map(PoseJson::new),
        refined: ready.and_then(|k| result.placed.registration.as_ref()?.views[k].placed()).map(refined_json),
    }
}

fn refined_json(placed: &Placed) -> RefinedJson {
    RefinedJson {
        moved: placed.moved,
        turned_deg: placed.turned_rad.map(f64::to_degrees),
        translation_u: placed.translation_u(),
        rotation_u_deg: placed.rotation_u_rad().to_degrees(),
        agreement: placed.agreement,
    }
}

/// `indices`: of each registered view its place in the order of names.
fn registration_json<'a>(found: &'a Registration, indices: &[usize]) -> RegistrationJson<'a> {
    let pair = |pair: &'a Pair| {
        let (weight, reason) = match &pair.state {
            PairState::Used { weight } => (Some(*weight), None),
            PairState::Rejected { why } => (None, Some(why.as_str())),
        };
        PairJson {
            a: indices[pair.a],
            b: indices[pair.b],
            shared: pair.shared,
            share: pair.share,
            rms: pair.rms,
            mean: pair.mean,
            agreement: pair.agreement,
            used: pair.is_used(),
            weight,
            reason,
        }
    };
    let cycle = |cycle: &Cycle| CycleJson {
        views: cycle.views.iter().map(|k| indices[*k]).collect(),
        translation: cycle.translation,
        angle_deg: cycle.angle_rad.to_degrees(),
        expected_translation: cycle.expected_translation,
        expected_angle_deg: cycle.expected_angle_rad.to_degrees(),
        normalised: cycle.normalised,
    };
    let weak =
        |weak: &'a Weak| WeakJson { view: indices[weak.view], uncertainty: weak.uncertainty, words: &weak.words };
    RegistrationJson {
        noise: found.noise,
        pairs: found.pairs.iter().map(pair).collect(),
        cycles: found.cycles.iter().map(cycle).collect(),
        weak: found.weak.iter().map(weak).collect(),
    }
}
