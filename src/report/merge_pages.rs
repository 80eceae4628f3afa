//! The report of a merge on paper, from what is known of it.

use super::merge_json::merge_json;
use super::pdf::merge::{FeatureRow, MergeReport, PairRow, ViewRow, merge_pdf};
use crate::geometry::Point3;
use crate::plan::merge::{Judge, MergePlan};
use crate::stitch::register::{Pair, PairState};
use crate::stitch::wear::Wear;
use crate::stitch::{MergeResult, ViewEnd};

/// Weak motions that are printed; the JSON has all.
const MOST_WEAK: usize = 20;

/// What a merge tells beside its cloud.
#[derive(Debug, Clone, Default)]
pub struct MergeExtras {
    /// Features before and after.
    pub features: Vec<FeatureRow>,
    /// The difference to the earlier cloud.
    pub wear: Option<Wear>,
    /// Why there is none, where it was asked for.
    pub not_compared: Option<String>,
}

/// The PDF report; `eye` is the side from which the cloud is drawn.
pub fn merge_pages(plan: &MergePlan, result: &MergeResult, extras: &MergeExtras, eye: Point3) -> Vec<u8> {
    let name = |file: &std::path::Path| file.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let old = plan.output.compare_with.as_ref().map(|old| old.file.clone()).unwrap_or_default();
    let merged_by = match &plan.merge.judge.value {
        Judge::Mean => "the plain mean of each cell".to_owned(),
        Judge::Metrics(metrics) => {
            let words: Vec<&str> = metrics.iter().map(|m| m.key()).collect();
            format!("the best by {} within d_s", words.join(" + "))
        }
    };
    let notes = result.placed.warnings.iter().chain(&result.merged.warnings);
    let registration = result.placed.registration.as_ref();
    let indices = &result.placed.indices;
    let pairs = registration.into_iter().flat_map(|r| &r.pairs).map(|pair| pair_row(pair, indices)).collect();
    let weak = registration.into_iter().flat_map(|r| &r.weak).take(MOST_WEAK);
    let weak = weak.map(|weak| format!("view {}: {}", indices[weak.view], weak.words));
    let seed = merge_json(plan, result, extras);
    merge_pdf(&MergeReport {
        file: &name(&plan.path),
        unit: plan.unit.key(),
        merged_by,
        d_grid: result.placed.d_grid,
        d_s: result.merged.d_s,
        points_in: result.merged.points_in,
        positions: &result.merged.positions,
        source: &result.merged.view,
        eye,
        views: views(result),
        pairs,
        features: extras.features.clone(),
        wear: extras.wear.as_ref().map(|wear| (wear, old.as_str())),
        not_compared: extras.not_compared.as_deref(),
        notes: notes.cloned().chain(weak).collect(),
        seed: seed.as_bytes(),
    })
}

fn views(result: &MergeResult) -> Vec<ViewRow> {
    let points_out = result.points_out();
    let row = |(k, file): (usize, &crate::stitch::ViewFile)| {
        let ready = match file.end {
            ViewEnd::Ready(ready) => Some(ready),
            ViewEnd::Unusable(_) => None,
        };
        let counts = ready.map(|r| &result.placed.counts[r]);
        let placed = ready.and_then(|r| result.placed.registration.as_ref()?.views[r].placed());
        ViewRow {
            name: file.name.clone(),
            points: counts.map_or([0; 4], |c| [c.points_read, c.points_masked, c.points_kept, points_out[k]]),
            moved: placed.and_then(|p| p.moved),
            turned_deg: placed.and_then(|p| p.turned_rad).map(f64::to_degrees),
            place_u: placed.map(|p| p.translation_u()),
            agreement: placed.map(|p| p.agreement),
            left_out: result.why_left_out(file).map(str::to_owned),
        }
    };
    result.files.iter().enumerate().map(row).collect()
}

fn pair_row(pair: &Pair, indices: &[usize]) -> PairRow {
    let unused = match &pair.state {
        PairState::Used { .. } => None,
        PairState::Rejected { why } => Some(why.clone()),
    };
    PairRow { views: [indices[pair.a], indices[pair.b]], share: pair.share, rms: pair.rms, mean: pair.mean, unused }
}
