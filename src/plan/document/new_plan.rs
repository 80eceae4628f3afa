//! A plan from nothing, with a line of comment to each setting that a beginner must know.

use super::settings::FieldValue;
use super::{Document, EditError};
use crate::geometry::LengthUnit;
use crate::plan::CadSide;
use std::path::Path;

/// What the five steps ask for before features and points are picked. Paths are as the plan will have them: relative to its own
/// folder, or whole.
#[derive(Debug, Clone, PartialEq)]
pub struct NewPlan {
    /// What people call the part.
    pub name: String,
    /// The CAD file.
    pub cad_file: String,
    /// Its unit.
    pub cad_unit: LengthUnit,
    /// The folder in which scans arrive.
    pub scans_folder: String,
    /// The names of the scans' files.
    pub scans_pattern: String,
    /// Thickness of the sheet, mm.
    pub thickness_mm: f64,
    /// Where the CAD surface lies in the sheet.
    pub cad_side: CadSide,
    /// How far apart the points of a scan lie, mm.
    pub point_spacing_mm: f64,
}

const TEMPLATE: &str = r#"# Inspection plan. Lengths are millimetres, angles degrees; paths start at this file's folder.
schema = 1

[part]
name = ""
number = ""
revision = ""
thickness_mm = 0.0           # of the sheet; 0 = no compensation
decision = "iso14253"        # the uncertainty is taken off the tolerance before a point passes or fails; or "plain"
cad_side = "top"             # where the CAD surface lies in the sheet: "top", "bottom", "middle", or "solid"

[cad]
file = ""
unit = "mm"

[scans]
folder = "scans"
pattern = "*.ply"

[background]
belt_plane = true            # what lies on the conveyor belt or below it is not part

# To all of the part, until a hole, a slot and a surface point are chosen.
[alignment]
method = "best_fit"

# What the uncertainty is foretold by. The spacing is that of the first scan; the rest is a typical rig: tell the figures of yours.
[rig]
distance_mm = 600.0
base_mm = 200.0
focal_mm = 35.0
pixel_um = 4.88
image_accuracy_px = 0.3
resolution_level = 2
point_spacing_mm = 0.5

[output]
folder = "results"
formats = ["ascii", "json", "pdf"]
map_range_mm = 1.0           # the colour scale goes from minus to plus this value
"#;

impl Document {
    /// A new plan: held by a best fit, without features and points, never saved. Undo begins here.
    ///
    /// # Errors
    /// A thickness that is not finite.
    pub fn new_plan(path: &Path, plan: &NewPlan) -> Result<Self, EditError> {
        let mut document = Self::unsaved(TEMPLATE, path);
        let text = |text: &str| FieldValue::Text(text.to_owned());
        let side = match plan.cad_side {
            CadSide::Top => "top",
            CadSide::Bottom => "bottom",
            CadSide::Middle => "middle",
            CadSide::Solid => "solid",
        };
        for (table, key, value) in [
            ("part", "name", text(&plan.name)),
            ("part", "thickness_mm", FieldValue::Number(plan.thickness_mm)),
            ("part", "cad_side", text(side)),
            ("cad", "file", text(&plan.cad_file)),
            ("cad", "unit", text(plan.cad_unit.key())),
            ("scans", "folder", text(&plan.scans_folder)),
            ("scans", "pattern", text(&plan.scans_pattern)),
            ("rig", "point_spacing_mm", FieldValue::Number((1e3 * plan.point_spacing_mm).round() / 1e3)),
        ] {
            document.set_setting(table, key, &value)?;
        }
        document.history = super::history::History::default();
        Ok(document)
    }
}

/// A path as a plan in a folder names it: relative where it lies below that folder, else whole.
pub fn seen_from(folder: &Path, path: &Path) -> String {
    let below = path.strip_prefix(folder).ok().filter(|_| !folder.as_os_str().is_empty());
    match below {
        Some(below) if below.as_os_str().is_empty() => ".".to_owned(),
        Some(below) => below.iter().map(|part| part.to_string_lossy()).collect::<Vec<_>>().join("/"),
        None => path.display().to_string(),
    }
}
