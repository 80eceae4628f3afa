//! What was chosen and typed for a new plan, and what is missing. No drawing.

use super::look::{Looked, Looking};
use crate::geometry::LengthUnit;
use crate::gui::scene::content::MapContent;
use crate::gui::text::typed_number;
use crate::plan::CadSide;
use crate::plan::document::{Document, EditError, FieldValue, List, NewPlan, seen_from};
use crate::worker::first_look::{CadLook, ScanLook};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The five steps.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Step {
    /// The CAD file.
    #[default]
    Cad,
    /// A scan.
    Scan,
    /// Thickness and side.
    Sheet,
    /// Features and points.
    Pick,
    /// Name, place, first run.
    Run,
}

impl Step {
    /// In their order.
    pub const ALL: [Step; 5] = [Step::Cad, Step::Scan, Step::Sheet, Step::Pick, Step::Run];

    /// The key of its name among the texts.
    pub fn key(self) -> &'static str {
        match self {
            Step::Cad => "new_plan.step_cad",
            Step::Scan => "new_plan.step_scan",
            Step::Sheet => "new_plan.step_sheet",
            Step::Pick => "new_plan.step_pick",
            Step::Run => "new_plan.step_run",
        }
    }

    /// The step before; the first stays.
    pub fn back(self) -> Self {
        Self::ALL[(self as usize).saturating_sub(1)]
    }

    /// The next one; the last stays.
    pub fn next(self) -> Self {
        Self::ALL[(self as usize + 1).min(Self::ALL.len() - 1)]
    }
}

/// A file of the first two steps: its path as typed, and what was found in it.
#[derive(Debug, Clone)]
pub struct Chosen<T> {
    /// The path as it is typed.
    pub path: String,
    /// The unit that was chosen; `None` = the likely one.
    pub unit: Option<LengthUnit>,
    /// What was found.
    pub look: Option<Arc<T>>,
    /// Why nothing was.
    pub fault: Option<String>,
}

impl<T> Default for Chosen<T> {
    fn default() -> Self {
        Self { path: String::new(), unit: None, look: None, fault: None }
    }
}

impl<T> Chosen<T> {
    /// The path without quotes and blanks around it.
    pub fn file(&self) -> PathBuf {
        PathBuf::from(self.path.trim().trim_matches('"'))
    }

    /// Another file: nothing is known of it yet.
    pub fn choose(&mut self, path: &Path) {
        *self = Self { path: path.display().to_string(), ..Self::default() };
    }
}

/// All that was chosen. Going back and forth between the steps changes nothing of it.
#[derive(Debug, Default)]
pub struct Entries {
    /// The step that is shown.
    pub step: Step,
    /// The CAD.
    pub cad: Chosen<CadLook>,
    /// The scan.
    pub scan: Chosen<ScanLook>,
    /// The scan as it is drawn.
    pub cloud: Option<Arc<MapContent>>,
    /// Thickness as it is typed; `None`: nobody has typed yet, that of the CAD holds.
    pub thickness: Option<String>,
    /// Where the CAD's surface lies in the sheet; `None` = nobody has said yet.
    pub side: Option<CadSide>,
    /// The part's name as typed; `None`: that of the CAD's file.
    pub name: Option<String>,
    /// The plan's file as typed; `None`: beside the CAD, by the part's name.
    pub file: Option<String>,
    /// What is looked at now.
    pub looking: Looking,
    /// What the plan was made of, or brought up to date with.
    made: Option<(NewPlan, LengthUnit)>,
}

/// The thickest sheet, mm, as plans have it.
pub const THICKEST_MM: f64 = 50.0;

impl Entries {
    /// Thickness of the sheet, mm; `None` = nothing or no thickness is typed.
    pub fn thickness_mm(&self) -> Option<f64> {
        match &self.thickness {
            Some(text) => typed_number(text).filter(|mm| (0.0..=THICKEST_MM).contains(mm)),
            None => self.cad.look.as_ref()?.thickness_mm,
        }
    }

    /// Whether something is typed that is no thickness of a sheet.
    pub fn thickness_is_off(&self) -> bool {
        self.thickness.as_ref().is_some_and(|text| !text.trim().is_empty()) && self.thickness_mm().is_none()
    }

    /// Where the CAD's surface lies in the sheet. A solid holds both faces.
    pub fn cad_side(&self) -> Option<CadSide> {
        let solid = self.cad.look.as_ref().is_some_and(|look| look.thickness_mm.is_some());
        self.side.or_else(|| solid.then_some(CadSide::Solid))
    }

    /// The part's name.
    pub fn part_name(&self) -> String {
        let of_file = || self.cad.file().file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        self.name.clone().unwrap_or_else(of_file)
    }

    /// The plan's file.
    pub fn plan_file(&self) -> PathBuf {
        if let Some(text) = &self.file {
            let typed = PathBuf::from(text.trim().trim_matches('"'));
            return if typed.extension().is_none() { typed.with_extension("toml") } else { typed };
        }
        let plain = |c: char| if c.is_alphanumeric() || "-_. ".contains(c) { c } else { '_' };
        let name: String = self.part_name().trim().chars().map(plain).collect();
        let name = if name.is_empty() { "plan".to_owned() } else { name };
        let folder = self.cad.file().parent().map(Path::to_path_buf).unwrap_or_default();
        folder.join(format!("{name}.toml"))
    }

    /// What keeps a step from being left forwards, as a key among the texts.
    pub fn missing(&self, step: Step, document: Option<&Document>) -> Option<&'static str> {
        match step {
            Step::Cad if self.cad.look.is_none() => Some("new_plan.needs_cad"),
            Step::Scan if self.scan.look.is_none() => Some("new_plan.needs_scan"),
            Step::Sheet if self.thickness_is_off() => Some("new_plan.thickness_limits"),
            Step::Sheet if self.thickness_mm().is_none() => Some("new_plan.needs_thickness"),
            Step::Sheet if self.cad_side().is_none() => Some("new_plan.needs_side"),
            Step::Pick if document.is_none_or(|d| d.rows(List::Comparison).is_empty()) => Some("new_plan.needs_points"),
            Step::Run if self.part_name().trim().is_empty() => Some("new_plan.needs_name"),
            Step::Run if self.plan_file().file_stem().is_none() => Some("new_plan.needs_file"),
            _ => None,
        }
    }

    /// The first step that cannot be left forwards; the last one where all can.
    pub fn furthest(&self, document: Option<&Document>) -> Step {
        Step::ALL.into_iter().find(|step| self.missing(*step, document).is_some()).unwrap_or(Step::Run)
    }

    /// Whether cancelling would lose something.
    pub fn has_something(&self) -> bool {
        !self.cad.path.trim().is_empty() || !self.scan.path.trim().is_empty()
    }

    /// The plan that the first three steps make.
    pub fn new_plan(&self) -> Option<NewPlan> {
        let (cad, scan) = (self.cad.look.as_ref()?, self.scan.look.as_ref()?);
        let folder = self.plan_file().parent().map(Path::to_path_buf).unwrap_or_default();
        let scans = scan.path.parent().map(Path::to_path_buf).unwrap_or_default();
        let ending = scan.path.extension().map_or_else(|| "*".to_owned(), |e| format!("*.{}", e.to_string_lossy()));
        Some(NewPlan {
            name: self.part_name(),
            cad_file: seen_from(&folder, &cad.path),
            cad_unit: cad.unit,
            scans_folder: seen_from(&folder, &scans),
            scans_pattern: ending,
            thickness_mm: self.thickness_mm()?,
            cad_side: self.cad_side()?,
            point_spacing_mm: scan.scan.spacing_mm,
        })
    }

    /// The document that the first three steps make: a new one, or the one that is there with what was chosen otherwise since it was made or
    /// brought up to date. Features, points and what else was edited in it stay.
    ///
    /// # Errors
    /// Of the document.
    pub fn document(&mut self, before: Option<Document>) -> Result<Option<Document>, EditError> {
        let Some(plan) = self.new_plan() else { return Ok(None) };
        let unit = self.scan.look.as_ref().map_or(LengthUnit::Mm, |look| look.unit);
        let of = |path: &Path, plan: &NewPlan, unit: LengthUnit| -> Result<Document, EditError> {
            let mut document = Document::new_plan(path, plan)?;
            if unit != LengthUnit::Mm {
                document.set_setting("scans", "unit", &FieldValue::Text(unit.key().to_owned()))?;
            }
            Ok(document)
        };
        let document = match (before, &self.made) {
            (Some(mut document), Some((made, made_unit))) => {
                let path = document.path().to_path_buf();
                let (old, new) = (of(&path, made, *made_unit)?, of(&path, &plan, unit)?);
                for (table, key) in SETTINGS {
                    match (old.setting(table, key), new.setting(table, key)) {
                        (a, b) if a == b => {}
                        (_, Some(value)) => document.set_setting(table, key, &value)?,
                        (_, None) => document.remove_setting(table, key)?,
                    }
                }
                document
            }
            _ => of(&self.plan_file(), &plan, unit)?,
        };
        self.made = Some((plan, unit));
        Ok(Some(document))
    }

    /// The plan as it is to be saved: under its name, with the part's name, its paths seen from there.
    ///
    /// # Errors
    /// Of the document.
    pub fn to_save(&self, document: &Document) -> Result<Document, EditError> {
        let path = self.plan_file();
        let mut copy = document.copy_to(&path)?;
        copy.set_setting("part", "name", &FieldValue::Text(self.part_name().trim().to_owned()))?;
        let folder = |path: &Path| path.parent().map(Path::to_path_buf).unwrap_or_default();
        for (table, key) in [("cad", "file"), ("scans", "folder")] {
            if let Some(FieldValue::Text(text)) = document.setting(table, key) {
                let whole = folder(document.path()).join(text);
                copy.set_setting(table, key, &FieldValue::Text(seen_from(&folder(&path), &whole)))?;
            }
        }
        // Results lie beside the plan, wherever that is.
        if let Some(folder) = document.setting("output", "folder") {
            copy.set_setting("output", "folder", &folder)?;
        }
        Ok(copy)
    }

    /// Takes what was found in a file; a look that was given up is none.
    pub fn take(&mut self, looked: Looked) {
        match looked {
            Looked::Cad(Ok(look)) => {
                self.cad.fault = None;
                self.cad.look = Some(Arc::new(look));
            }
            Looked::Cad(Err(fault)) => (self.cad.look, self.cad.fault) = (None, Some(fault)),
            Looked::Scan(Ok((look, cloud))) => {
                self.scan.fault = None;
                self.scan.look = Some(Arc::new(look));
                self.cloud = cloud;
            }
            Looked::Scan(Err(fault)) => (self.scan.look, self.cloud, self.scan.fault) = (None, None, Some(fault)),
            Looked::Cancelled => {}
            Looked::Lost => {
                let fault = "an internal fault; this file cannot be used, please send it to the maintainers";
                let fault = Some(fault.to_owned());
                if self.step == Step::Scan { self.scan.fault = fault } else { self.cad.fault = fault }
            }
        }
    }
}

/// The settings that the first three steps tell.
const SETTINGS: [(&str, &str); 8] = [
    ("part", "thickness_mm"),
    ("part", "cad_side"),
    ("cad", "file"),
    ("cad", "unit"),
    ("scans", "folder"),
    ("scans", "pattern"),
    ("scans", "unit"),
    ("rig", "point_spacing_mm"),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::RunContext;
    use crate::worker::first_look::{look_at_cad, look_at_scan};

    fn demo(name: &str) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/demo").join(name)
    }

    fn entries() -> Entries {
        let run = RunContext::silent();
        let mut entries = Entries::default();
        entries.cad.choose(&demo("bracket.stl"));
        let cad = look_at_cad(&demo("bracket.stl"), None, &run).unwrap();
        entries.scan.choose(&demo("scans/01_good_top.ply"));
        let scan = look_at_scan(&demo("scans/01_good_top.ply"), None, &cad.part, &run).unwrap();
        entries.take(Looked::Cad(Ok(cad)));
        entries.take(Looked::Scan(Ok((scan, None))));
        entries
    }

    #[test]
    fn every_step_says_what_is_missing_until_it_is_there() {
        let mut entries = Entries::default();
        assert_eq!(entries.missing(Step::Cad, None), Some("new_plan.needs_cad"));
        assert_eq!((entries.furthest(None), entries.has_something()), (Step::Cad, false));
        entries = self::entries();
        assert_eq!((entries.missing(Step::Cad, None), entries.missing(Step::Scan, None)), (None, None));
        assert_eq!(entries.missing(Step::Sheet, None), Some("new_plan.needs_thickness"));
        let (none, off) = (Some("new_plan.needs_thickness"), Some("new_plan.thickness_limits"));
        let side = Some("new_plan.needs_side");
        for (text, missing) in
            [("", none), ("thin", off), ("-1", off), ("100", off), ("50", side), ("1,2", side), ("0", side)]
        {
            entries.thickness = Some(text.into());
            assert_eq!(entries.missing(Step::Sheet, None), missing, "{text}");
        }
        assert_eq!(entries.missing(Step::Sheet, None), Some("new_plan.needs_side"));
        entries.side = Some(CadSide::Top);
        assert_eq!(entries.furthest(None), Step::Pick);
        entries.name = Some("  ".into());
        assert_eq!(entries.missing(Step::Run, None), Some("new_plan.needs_name"));
        assert_eq!(entries.part_name(), "  ");
    }

    #[test]
    fn a_plan_names_its_files_from_its_own_folder() {
        let mut entries = entries();
        (entries.thickness, entries.side) = (Some("1.2".into()), Some(CadSide::Top));
        let plan = entries.new_plan().unwrap();
        assert_eq!((plan.cad_file.as_str(), plan.scans_folder.as_str()), ("bracket.stl", "scans"));
        assert_eq!((plan.scans_pattern.as_str(), plan.name.as_str()), ("*.ply", "bracket"));
        assert_eq!(entries.plan_file(), demo("bracket.toml"));
        entries.file = Some("/elsewhere/mine".into());
        assert_eq!(entries.plan_file(), Path::new("/elsewhere/mine.toml"));
        assert_eq!(entries.new_plan().unwrap().cad_file, demo("bracket.stl").display().to_string());
        entries.file = None;
        entries.name = Some("Bracket 4/5".into());
        assert_eq!(entries.plan_file(), demo("Bracket 4_5.toml"));
    }

    #[test]
    fn going_back_keeps_what_was_picked() {
        let mut entries = entries();
        (entries.thickness, entries.side) = (Some("1.2".into()), Some(CadSide::Top));
        let mut document = entries.document(None).unwrap().unwrap();
        let point = crate::plan::Geometry::Surface {
            position: crate::geometry::Point3::new(1.0, 2.0, 3.0),
            direction: crate::geometry::Vector3::z_axis(),
        };
        document.add(List::Comparison, &[crate::plan::document::PointSpec::point("", point, -0.5, 0.5)]).unwrap();
        entries.thickness = Some("1,5".into());
        // What was edited in the plan itself stays, unless it was chosen otherwise here.
        document.set_setting("scans", "pattern", &FieldValue::Text("a*.ply".into())).unwrap();
        let document = entries.document(Some(document)).unwrap().unwrap();
        assert_eq!(document.setting("part", "thickness_mm"), Some(FieldValue::Number(1.5)));
        assert_eq!(document.setting("scans", "pattern"), Some(FieldValue::Text("a*.ply".into())));
        assert_eq!(document.rows(List::Comparison).len(), 1);
        let text = document.text().to_owned();
        assert_eq!(entries.document(Some(document)).unwrap().unwrap().text(), text);
        assert!(entries.missing(Step::Pick, None).is_some());
        // Saved elsewhere, it still finds its files, and results lie beside it.
        let document = entries.document(None).unwrap().unwrap();
        let folder = tempfile::tempdir().unwrap();
        entries.file = Some(folder.path().join("other").display().to_string());
        let saved = entries.to_save(&document).unwrap();
        assert_eq!(saved.path(), folder.path().join("other.toml"));
        let text = |key: (&str, &str)| saved.setting(key.0, key.1);
        let whole = |name: &str| Some(FieldValue::Text(demo(name).display().to_string()));
        assert_eq!((text(("cad", "file")), text(("scans", "folder"))), (whole("bracket.stl"), whole("scans")));
        assert_eq!(text(("output", "folder")), Some(FieldValue::Text("results".into())));
    }
}
