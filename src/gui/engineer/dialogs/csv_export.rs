//! Comparison points into a table: a comparison file, or what a spreadsheet opens.

use super::End;
use super::fields::{fault_ui, foot_ui};
use crate::gui::later::{Asked, Later, PathDialog};
use crate::gui::scope::Scope;
use crate::plan::ComparisonPoint;
use crate::plan::document::{CsvStyle, Document, List, csv_of_points};
use crate::report::atomic;
use egui::{Button, RichText, TextEdit, Ui, vec2};
use std::path::{Path, PathBuf};

/// How a file was written, or not.
#[derive(Debug, Clone, PartialEq)]
enum Written {
    Done(PathBuf),
    /// Another file lies there.
    Taken(PathBuf),
    Failed(String),
}

/// What was chosen.
#[derive(Debug)]
pub struct CsvExport {
    style: CsvStyle,
    path: String,
    /// The path that the system's dialog gave: that asked before it gave a file that is there.
    asked_for: Option<PathBuf>,
    dialog: PathDialog,
    writing: Later<Written>,
    written: Option<Written>,
    copied: bool,
}

impl Default for CsvExport {
    fn default() -> Self {
        Self {
            style: CsvStyle::DecimalComma,
            path: String::new(),
            asked_for: None,
            dialog: PathDialog::default(),
            writing: Later::default(),
            written: None,
            copied: false,
        }
    }
}

/// The key of a kind's name.
pub fn kind_key(kind: &str) -> &'static str {
    match kind {
        "surface" => "results.surface",
        "edge" => "results.edge",
        _ => "results.hole",
    }
}

/// Draws the half of the dialog.
pub fn form_ui(ui: &mut Ui, form: &mut CsvExport, document: &Document, scope: &mut Scope) -> End {
    let words = scope.words;
    let points = document.read().draft.comparison;
    let left_out = document.rows(List::Comparison).len().saturating_sub(points.len());
    ui.label(words.count("tables.export_points", points.len()));
    if left_out > 0 {
        fault_ui(ui, &words.count("tables.left_out", left_out), scope.theme);
    }
    let styles =
        [(CsvStyle::DecimalComma, "tables.style_semicolons"), (CsvStyle::ComparisonFile, "tables.style_commas")];
    for (style, key) in styles {
        if ui.radio(form.style == style, words.text(key)).clicked() {
            (form.style, form.written) = (style, None);
        }
    }
    ui.add_space(8.0);
    path_ui(ui, form, document, scope);
    ui.horizontal(|ui| {
        if ui.add(Button::new(words.text("tables.copy")).min_size(vec2(0.0, 30.0))).clicked() {
            ui.ctx().copy_text(csv_of_points(&points, CsvStyle::Tabs));
            form.copied = true;
        }
        if form.copied {
            ui.label(RichText::new(words.text("tables.copied")).color(scope.theme.quiet));
        }
    });
    if let Some(Ok(written)) = form.writing.poll() {
        form.written = Some(written);
    }
    let may = match (&form.written, form.path.trim().is_empty()) {
        _ if points.is_empty() => Err(words.text("tables.no_rows").to_owned()),
        (_, true) => Err(words.text("tables.name_a_file").to_owned()),
        (Some(Written::Taken(_)), _) => Ok(words.text("tables.replace").to_owned()),
        _ => Ok(words.text("tables.write").to_owned()),
    };
    told_ui(ui, form, scope);
    let (pressed, end) = foot_ui(ui, &may, words.text("tables.write"), false, scope);
    if pressed {
        write(ui, form, &points);
        return End::Open;
    }
    end
}

fn path_ui(ui: &mut Ui, form: &mut CsvExport, document: &Document, scope: &Scope) {
    let words = scope.words;
    ui.horizontal(|ui| {
        let label = ui.label(words.text("tables.into_file"));
        let room = (ui.available_width() - 130.0).max(120.0);
        let field = ui.add(TextEdit::singleline(&mut form.path).desired_width(room)).labelled_by(label.id);
        if field.changed() {
            form.written = None;
        }
        if ui.add(Button::new(words.text("tables.choose_file")).min_size(vec2(0.0, 28.0))).clicked() {
            let stem =
                document.path().file_stem().map_or_else(|| "points".into(), |s| s.to_string_lossy().into_owned());
            form.dialog.ask(ui.ctx(), Asked::Save(format!("{stem}.csv")), document.path().parent());
        }
    });
    if let Some(path) = form.dialog.answer() {
        form.path = path.display().to_string();
        (form.asked_for, form.written) = (Some(path), None);
    }
    if form.dialog.failed {
        ui.label(RichText::new(words.text("tables.no_dialog")).color(scope.theme.quiet));
    }
}

fn told_ui(ui: &mut Ui, form: &CsvExport, scope: &Scope) {
    let words = scope.words;
    let name = |path: &Path| path.display().to_string();
    match &form.written {
        Some(Written::Done(path)) => {
            ui.label(words.fill("tables.written", &[("file", &name(path))]));
        }
        Some(Written::Taken(path)) => fault_ui(ui, &words.fill("tables.taken", &[("file", &name(path))]), scope.theme),
        Some(Written::Failed(fault)) => fault_ui(ui, &scope.words.library(fault), scope.theme),
        None => {}
    }
}

/// Writes the table; a file that is there only when somebody said so.
fn write(ui: &Ui, form: &mut CsvExport, points: &[ComparisonPoint]) {
    let path = PathBuf::from(form.path.trim().trim_matches('"'));
    let replace = form.asked_for.as_ref() == Some(&path) || form.written == Some(Written::Taken(path.clone()));
    let text = csv_of_points(points, form.style);
    form.writing.start(ui.ctx(), move || {
        if !replace && path.exists() {
            return Written::Taken(path);
        }
        match atomic::write(&path, text.as_bytes()) {
            Ok(()) => Written::Done(path),
            Err(fault) => Written::Failed(fault.in_a_row()),
        }
    });
}
