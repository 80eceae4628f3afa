//! What is so of a merge: its settings, the views, what its masks leave, what came out.

use crate::diagnostic::{Diagnostic, Severity};
use crate::plan::merge::{Better, Loaded};
use crate::plan::merge::{Mask, MergePlan, Metric};
use crate::run::Stage;
use crate::stitch::mask_study::{Knee, MaskStudy};
use crate::stitch::mask_worth::Worth;
use crate::worker::merge::{MergeJob, Preview};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A merge that is looked at.
#[derive(Debug, Clone)]
pub struct Merging {
    /// Its settings' file.
    pub path: PathBuf,
    /// What that holds.
    pub bytes: Arc<Vec<u8>>,
    /// The settings, if they can be used.
    pub plan: Option<Arc<MergePlan>>,
    /// Their problems, in the words of the command line.
    pub problems: Vec<Diagnostic>,
    /// The masks as they are set in the window.
    pub masks: Vec<Mask>,
    /// Another number after every change of the masks.
    pub version: u64,
    /// The views.
    pub views: ViewsState,
    /// What no mask leaves: all points.
    pub unmasked: Option<Arc<Worth>>,
    /// What masks leave, with the version of them.
    pub worth: Option<(u64, Arc<Worth>)>,
    /// What each mask would be worth.
    pub study: StudyState,
    /// The last merge that was made here.
    pub done: Option<Arc<Done>>,
    /// Why the last one gave nothing.
    pub fault: Option<Diagnostic>,
    /// The last one was stopped before its end.
    pub stopped: bool,
}

/// The views of a merge.
#[derive(Debug, Clone)]
pub enum ViewsState {
    /// Settings that cannot be used name none.
    None,
    /// They are read: which one, of how many, its name; none yet.
    Reading(Option<(usize, usize, String)>),
    /// They are here.
    Ready(Arc<Preview>),
    /// They cannot be read.
    Failed(Diagnostic),
}

/// A study of masks.
#[derive(Debug, Clone)]
pub enum StudyState {
    /// No feature is named, or no view is there.
    None,
    /// So many curves of so many are done.
    Running(usize, usize),
    /// It is done; of every how many points.
    Done(Arc<MaskStudy>, usize),
    /// There is none, for this reason.
    Failed(Diagnostic),
}

/// A merge that was made.
#[derive(Debug)]
pub struct Done {
    /// What came out; the points of its views are let go.
    pub job: MergeJob,
    /// Points of each file that are in the cloud.
    pub points_out: Vec<usize>,
    /// The masks it was made with.
    pub masks: Vec<Mask>,
    /// How long it took.
    pub took: Duration,
}

/// A merge under way.
#[derive(Debug, Clone)]
pub struct MergeRun {
    /// When it was begun.
    pub since: Instant,
    /// The masks it is made with.
    pub masks: Vec<Mask>,
    /// The view at hand, from 1, of how many, its name.
    pub view: Option<(usize, usize, String)>,
    /// What is done with it.
    pub stage: Option<Stage>,
    /// How much of that is done, where registering or merging tells: the most so far.
    pub of_stage: f32,
    /// Somebody pressed Stop.
    pub stopping: bool,
}

impl MergeRun {
    /// How far it is, 0 to 1: reading, registering, merging and writing each have a share of it as they take about as long.
    pub fn share(&self) -> f32 {
        match self.stage {
            Some(Stage::Register) => 0.5 + 0.3 * self.of_stage,
            Some(Stage::Merge) => 0.8 + 0.15 * self.of_stage,
            Some(Stage::Report) => 0.95,
            _ => self.view.as_ref().map_or(0.0, |(index, of, _)| 0.5 * (*index as f32 - 1.0) / *of as f32),
        }
    }
}

impl Merging {
    /// Of a file.
    pub fn new(path: PathBuf, bytes: Vec<u8>, loaded: Loaded) -> Self {
        let plan = loaded.plan.map(Arc::new);
        let masks = plan.as_ref().map(|plan| plan.masks.iter().map(|mask| mask.value).collect()).unwrap_or_default();
        let views = if plan.is_some() { ViewsState::Reading(None) } else { ViewsState::None };
        Self {
            path,
            bytes: Arc::new(bytes),
            plan,
            problems: loaded.problems,
            masks,
            version: 0,
            views,
            unmasked: None,
            worth: None,
            study: StudyState::None,
            done: None,
            fault: None,
            stopped: false,
        }
    }

    /// The file's name.
    pub fn name(&self) -> String {
        self.path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
    }

    /// The views, when they are here.
    pub fn preview(&self) -> Option<&Arc<Preview>> {
        match &self.views {
            ViewsState::Ready(preview) => Some(preview),
            _ => None,
        }
    }

    /// The masks in the file.
    pub fn masks_of_file(&self) -> Vec<Mask> {
        self.plan.as_ref().map(|plan| plan.masks.iter().map(|mask| mask.value).collect()).unwrap_or_default()
    }

    /// Whether the masks are others than those in the file.
    pub fn is_changed(&self) -> bool {
        self.masks != self.masks_of_file()
    }

    /// The mask of a metric.
    pub fn mask(&self, metric: Metric) -> Option<&Mask> {
        self.masks.iter().find(|mask| mask.metric == metric)
    }

    /// Sets the bound of a mask that its better direction asks for; `None` takes the mask away.
    pub fn set(&mut self, metric: Metric, bound: Option<f64>) {
        let at = self.masks.iter().position(|mask| mask.metric == metric);
        match (at, bound) {
            (Some(at), None) => {
                self.masks.remove(at);
            }
            (None, None) => return,
            (at, Some(bound)) => {
                let mut mask = at.map_or_else(|| all_of(metric), |at| self.masks[at]);
                match metric.better() {
                    Better::Larger => mask.min = bound.min(mask.max),
                    Better::Smaller => mask.max = bound.max(mask.min),
                }
                match at {
                    Some(at) if self.masks[at] == mask => return,
                    Some(at) => self.masks[at] = mask,
                    None => self.masks.push(mask),
                }
                self.masks.sort_by_key(|mask| mask.metric);
            }
        }
        self.version += 1;
    }

    /// What the masks at hand leave; what was computed for the ones before while that is not known.
    pub fn latest_worth(&self) -> Option<&Arc<Worth>> {
        self.worth.as_ref().map(|(_, worth)| worth)
    }

    /// Whether the last merge was made with other masks than those at hand.
    pub fn is_stale(&self) -> bool {
        self.done.as_ref().is_some_and(|done| done.masks != self.masks)
    }

    /// The threshold that the study suggests for a metric, by the first feature that has one.
    pub fn suggested(&self, metric: Metric) -> Option<f64> {
        let StudyState::Done(study, _) = &self.study else { return None };
        study.curves.iter().filter(|curve| curve.metric == metric).find_map(|curve| match curve.knee {
            Knee::At { step, .. } => Some(curve.steps[step].threshold),
            _ => None,
        })
    }

    /// Whether the settings can be used.
    pub fn is_sound(&self) -> bool {
        self.plan.is_some() && self.problems.iter().all(|problem| problem.severity != Severity::Error)
    }
}

/// A mask that keeps all.
fn all_of(metric: Metric) -> Mask {
    Mask { metric, min: f64::NEG_INFINITY, max: f64::INFINITY }
}

/// The bound of a mask that its better direction asks for.
pub fn bound(mask: &Mask) -> Option<f64> {
    let bound = match mask.metric.better() {
        Better::Larger => mask.min,
        Better::Smaller => mask.max,
    };
    bound.is_finite().then_some(bound)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::merge::parse;
    use std::path::Path;

    fn merging() -> Merging {
        let text = "schema = 1\nunit = \"um\"\n[mask]\nb = { min = 1.0, max = 9.0 }\n";
        let loaded = parse(text.as_bytes(), Path::new("m.toml"));
        Merging::new("m.toml".into(), text.into(), loaded)
    }

    #[test]
    fn a_bound_is_set_where_it_is_better_and_the_other_one_stays() {
        let mut merging = merging();
        assert!(merging.is_sound() && !merging.is_changed());
        merging.set(Metric::Strength, Some(2.0));
        assert_eq!(merging.masks, [Mask { metric: Metric::Strength, min: 2.0, max: 9.0 }]);
        merging.set(Metric::CalibrationDistance, Some(150.0));
        assert_eq!((bound(&merging.masks[0]), bound(&merging.masks[1])), (Some(2.0), Some(150.0)));
        assert!(merging.is_changed() && merging.version == 2);
        merging.set(Metric::CalibrationDistance, Some(150.0));
        assert_eq!(merging.version, 2, "nothing changed");
        // Beyond its other bound a mask would keep nothing.
        merging.set(Metric::Strength, Some(20.0));
        assert_eq!(bound(&merging.masks[0]), Some(9.0));
        merging.set(Metric::CalibrationDistance, None);
        merging.set(Metric::Strength, Some(1.0));
        assert!(!merging.is_changed());
    }
}
