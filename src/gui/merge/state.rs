//! What is looked at on the screen: never part of a merge, gone with the window.

use super::colours::{By, ColourKey, Colours, Scenes, ScenesKey};
use crate::gui::scene::builder::Pending;
use crate::gui::scene::canvas::Canvas;
use crate::gui::scene::linked::Linked;
use crate::plan::merge::Metric;
use std::sync::Arc;

/// Which cloud a 3D view shows.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Cloud {
    /// The views' points.
    #[default]
    Measured,
    /// What was merged of them.
    Merged,
}

/// What stands alone in a small window.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Pane {
    /// The list of views.
    #[default]
    Views,
    /// The sliders.
    Masks,
    /// The points.
    Scene,
    /// The study of masks.
    Study,
    /// What came out.
    Result,
}

impl Pane {
    /// In the order of the tabs.
    pub const ALL: [Pane; 5] = [Pane::Views, Pane::Masks, Pane::Scene, Pane::Study, Pane::Result];

    /// The key of its name.
    pub fn key(self) -> &'static str {
        match self {
            Pane::Views => "merge.views",
            Pane::Masks => "merge.masks",
            Pane::Scene => "results.tab_scene",
            Pane::Study => "merge.study",
            Pane::Result => "merge.result",
        }
    }
}

/// What is looked at.
#[derive(Default)]
pub struct MergeView {
    /// The chosen view, by its place among the files.
    pub chosen: Option<usize>,
    /// What stands alone.
    pub pane: Pane,
    /// What shares the lower place in a middle window: study or result.
    pub lower: Pane,
    /// The cloud that is shown where there is room for one.
    pub cloud: Cloud,
    /// Colours of the measured points.
    pub measured_by: By,
    /// Colours of the merged points.
    pub merged_by: By,
    /// The metric of the study's curve.
    pub metric: Option<Metric>,
    /// Half the range of deviations, where somebody set one.
    pub range: Option<f64>,
    /// Fit the camera to the cloud.
    pub(super) fit: bool,
    pub(super) linked: Linked,
    pub(super) canvas: Canvas,
    pub(super) scenes: Option<(ScenesKey, Arc<Scenes>)>,
    pub(super) scenes_pending: Option<Pending<ScenesKey, Scenes>>,
    pub(super) colours: [Option<(ColourKey, Arc<Colours>)>; 2],
    pub(super) colours_pending: [Option<Pending<ColourKey, Colours>>; 2],
}

impl std::fmt::Debug for MergeView {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "MergeView of view {:?}, {:?}, {:?}", self.chosen, self.pane, self.cloud)
    }
}

impl MergeView {
    /// Another merge is opened.
    pub(in crate::gui) fn forget(&mut self) {
        *self = Self { lower: Pane::Study, canvas: self.canvas.clone(), ..Self::default() };
    }

    /// A merge gave nothing: why stands with the result.
    pub(in crate::gui) fn show_result(&mut self) {
        (self.lower, self.pane) = (Pane::Result, Pane::Result);
    }

    /// A merge is done.
    pub(in crate::gui) fn show_merged(&mut self) {
        self.cloud = Cloud::Merged;
        self.lower = Pane::Result;
    }
}
