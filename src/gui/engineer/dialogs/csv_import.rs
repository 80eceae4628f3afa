//! Comparison points from a table: pasted from a spreadsheet, or out of a file. What each row would do is shown first; all is taken, or
//! nothing.

use super::End;
use super::csv_export::{self, CsvExport};
use super::fields::{fault_ui, foot_ui};
use crate::diagnostic::Severity;
use crate::gui::action::Action;
use crate::gui::engineer::Edit;
use crate::gui::fonts;
use crate::gui::later::{Asked, Later, PathDialog};
use crate::gui::scope::Scope;
use crate::gui::text::Words;
use crate::gui::theme::{Theme, size};
use crate::io;
use crate::plan::document::{Document, EditError, Import, ImportedRow, Rest, RowChange};
use egui::{Button, Key, RichText, ScrollArea, TextEdit, Ui, vec2};
use std::path::PathBuf;

/// The endings of tables.
const TABLES: &[&str] = &["csv", "txt", "tsv"];

/// Which half of the dialog is looked at.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
enum Half {
    #[default]
    Import,
    Export,
}

/// A table that was given.
#[derive(Debug, Clone, PartialEq)]
struct Table {
    bytes: Vec<u8>,
    /// Its name in messages.
    source: PathBuf,
}

type Told = Result<Import, EditError>;

/// What was pasted or chosen.
#[derive(Debug)]
pub struct CsvImport {
    half: Half,
    pasted: String,
    path: String,
    dialog: PathDialog,
    file: Later<(PathBuf, Result<Vec<u8>, String>)>,
    fault: Option<String>,
    table: Option<Table>,
    reading: Later<(Table, Told)>,
    told: Option<(Table, Told)>,
    rest: Rest,
}

impl Default for CsvImport {
    fn default() -> Self {
        Self {
            half: Half::Import,
            pasted: String::new(),
            path: String::new(),
            dialog: PathDialog::default(),
            file: Later::default(),
            fault: None,
            table: None,
            reading: Later::default(),
            told: None,
            rest: Rest::Keep,
        }
    }
}

/// Draws the dialog.
pub fn form_ui(
    ui: &mut Ui,
    form: &mut CsvImport,
    export: &mut CsvExport,
    document: &Document,
    scope: &mut Scope,
) -> End {
    let words = scope.words;
    ui.horizontal(|ui| {
        for (half, key) in [(Half::Import, "tables.import"), (Half::Export, "tables.export")] {
            let button = Button::selectable(form.half == half, words.text(key)).min_size(vec2(120.0, 30.0));
            if ui.add(button).clicked() {
                form.half = half;
            }
        }
    });
    ui.add_space(8.0);
    match form.half {
        Half::Export => csv_export::form_ui(ui, export, document, scope),
        Half::Import if document.points_file().is_some() => own_file_ui(ui, document, scope),
        Half::Import => import_ui(ui, form, document, scope),
    }
}

/// Points that stand in a file of their own are edited there, or come into the plan first.
fn own_file_ui(ui: &mut Ui, document: &Document, scope: &mut Scope) -> End {
    let words = scope.words;
    let file = document.points_file().unwrap_or_default().display().to_string();
    ui.label(words.fill("tables.points_in_file", &[("file", &file)]));
    ui.add_space(8.0);
    if ui.button(words.text("tables.take_points")).clicked() {
        scope.ask(Action::Edit(Edit::TakePointsIntoPlan));
    }
    foot_ui(ui, &Err(String::new()), words.text("tables.import_do"), true, scope).1
}

fn import_ui(ui: &mut Ui, form: &mut CsvImport, document: &Document, scope: &mut Scope) -> End {
    let words = scope.words;
    let in_box = source_ui(ui, form, document, scope);
    read(ui, form, document);
    if let Some(fault) = &form.fault {
        fault_ui(ui, &words.library(fault), scope.theme);
    }
    let may = match (&form.told, form.reading.is_busy()) {
        (_, true) => Err(words.text("tables.reading").to_owned()),
        (None, false) => Err(words.text("tables.paste_first").to_owned()),
        (Some((_, Err(fault))), false) => {
            fault_ui(ui, &words.with_help(&fault.to_string(), Some(fault.help())), scope.theme);
            Err(words.text("tables.cannot").to_owned())
        }
        (Some((_, Ok(import))), false) => {
            preview_ui(ui, import, words, scope.theme);
            rest_ui(ui, import, &mut form.rest, words);
            may_import(import, form.rest, words)
        }
    };
    let (pressed, end) = foot_ui(ui, &may, words.text("tables.import_do"), in_box, scope);
    if pressed && let Some((_, Ok(import))) = form.told.take() {
        scope.ask(Action::Edit(Edit::Import(Box::new(import), form.rest)));
    }
    end
}

/// The box to paste into, and the field for a file. Returns whether a field has the focus that takes Enter for itself.
fn source_ui(ui: &mut Ui, form: &mut CsvImport, document: &Document, scope: &Scope) -> bool {
    let words = scope.words;
    let label = ui.label(words.text("tables.paste_here"));
    let hint = RichText::new(words.text("tables.paste_hint")).color(scope.theme.quiet);
    let first = form.pasted.is_empty() && form.path.is_empty();
    let edit = TextEdit::multiline(&mut form.pasted)
        .font(fonts::mono(size::TABLE))
        .desired_rows(4)
        .desired_width(f32::INFINITY)
        .hint_text(hint);
    let pasting =
        ScrollArea::vertical().id_salt("pasted").max_height(96.0).show(ui, |ui| ui.add(edit).labelled_by(label.id));
    let pasting = pasting.inner;
    if first && ui.memory(|m| m.focused().is_none()) {
        pasting.request_focus();
    }
    if pasting.changed() {
        let source = PathBuf::from(words.text("tables.pasted"));
        form.table =
            (!form.pasted.trim().is_empty()).then(|| Table { bytes: form.pasted.clone().into_bytes(), source });
        (form.fault, form.told) = (None, None);
    }
    let mut typing = false;
    ui.horizontal(|ui| {
        let label = ui.label(words.text("tables.or_file"));
        let room = ui.available_width() - 220.0;
        let field = ui.add(TextEdit::singleline(&mut form.path).desired_width(room.max(120.0))).labelled_by(label.id);
        typing = field.has_focus();
        let enter = field.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter));
        let read = ui.add(Button::new(words.text("tables.read_file")).min_size(vec2(0.0, 28.0))).clicked();
        if ui.add(Button::new(words.text("tables.choose_file")).min_size(vec2(0.0, 28.0))).clicked() {
            form.dialog.ask(ui.ctx(), Asked::Open(TABLES), document.path().parent());
        }
        if (enter || read) && !form.path.trim().is_empty() {
            fetch(form, ui.ctx());
        }
        typing |= enter;
    });
    if let Some(path) = form.dialog.answer() {
        form.path = path.display().to_string();
        fetch(form, ui.ctx());
    }
    if form.dialog.failed {
        ui.label(RichText::new(words.text("tables.no_dialog")).color(scope.theme.quiet));
    }
    pasting.has_focus() || typing
}

/// Reads the file that is named.
fn fetch(form: &mut CsvImport, ctx: &egui::Context) {
    let path = PathBuf::from(form.path.trim().trim_matches('"'));
    (form.fault, form.told, form.table) = (None, None, None);
    form.file.start(ctx, move || {
        let bytes = io::read_plain(&path).map_err(|fault| fault.to_string());
        (path, bytes)
    });
}

/// Takes what was read, and has the plan say what it would do.
fn read(ui: &Ui, form: &mut CsvImport, document: &Document) {
    match form.file.poll() {
        Some(Ok((path, Ok(bytes)))) => {
            let source = path.file_name().map_or_else(|| path.clone(), PathBuf::from);
            form.pasted.clear();
            form.table = Some(Table { bytes, source });
        }
        Some(Ok((path, Err(fault)))) => form.fault = Some(format!("{}: {fault}", path.display())),
        Some(Err(_)) | None => {}
    }
    if let Some(table) = form.table.take() {
        let (text, path) = (document.text().to_owned(), document.path().to_path_buf());
        form.reading.start(ui.ctx(), move || {
            let told = Document::unsaved(text, &path).read_import(&table.bytes, &table.source);
            (table, told)
        });
    }
    if let Some(Ok(told)) = form.reading.poll() {
        form.told = Some(told);
    }
}

/// How many rows add a point, change one, and leave one as it is.
fn counts(import: &Import) -> [usize; 3] {
    let of = |wanted: fn(&RowChange) -> bool| import.rows.iter().filter(|row| wanted(&row.change)).count();
    [of(|c| *c == RowChange::Added), of(|c| matches!(c, RowChange::Changed(_))), of(|c| *c == RowChange::Same)]
}

fn may_import(import: &Import, rest: Rest, words: &Words) -> Result<String, String> {
    let [added, changed, _] = counts(import);
    let removed = if rest == Rest::Remove { import.not_named.len() } else { 0 };
    match import.faults() {
        0 if added + changed + removed == 0 => Err(words.text("tables.nothing_changes").to_owned()),
        0 => Ok(words.text("tables.import_do").to_owned()),
        faults => Err(words.count("tables.faults_first", faults)),
    }
}

/// What becomes of the points that the table does not name.
fn rest_ui(ui: &mut Ui, import: &Import, rest: &mut Rest, words: &Words) {
    let n = import.not_named.len();
    if n == 0 {
        *rest = Rest::Keep;
        return;
    }
    ui.horizontal_wrapped(|ui| {
        ui.label(words.count("tables.not_named", n));
        for (choice, key) in [(Rest::Keep, "tables.rest_keep"), (Rest::Remove, "tables.rest_remove")] {
            if ui.radio(*rest == choice, words.text(key)).clicked() {
                *rest = choice;
            }
        }
    });
}

/// A line of the preview: a row, or a fault.
fn preview_ui(ui: &mut Ui, import: &Import, words: &Words, theme: &Theme) {
    let [added, changed, same] = counts(import).map(|n| words.thousands(n));
    let faults = words.thousands(import.faults());
    let values = [("added", &*added), ("changed", &*changed), ("same", &*same), ("faults", &*faults)];
    ui.label(words.fill("tables.import_changes", &values));
    let height = (ui.ctx().content_rect().height() * 0.34).max(100.0);
    ScrollArea::both().id_salt("import").max_height(height).auto_shrink([false, true]).show(ui, |ui| {
        for problem in &import.problems {
            let line = problem.line.map(|n| format!("{} ", words.fill("tables.line", &[("n", &n.to_string())])));
            let told = words.with_help(&problem.message, problem.help.as_deref());
            let text = format!("{}{told}", line.unwrap_or_default());
            if problem.severity == Severity::Error {
                fault_ui(ui, &text, theme);
            } else {
                ui.label(RichText::new(text).color(theme.undecided_text));
            }
        }
        egui::Grid::new("import rows").striped(true).spacing([18.0, 4.0]).show(ui, |ui| {
            for row in import.rows.iter().take(MOST_SHOWN) {
                row_ui(ui, row, words, theme);
                ui.end_row();
            }
        });
        if import.rows.len() > MOST_SHOWN {
            let n = words.thousands(import.rows.len() - MOST_SHOWN);
            ui.label(RichText::new(words.fill("tables.and_more", &[("n", &n)])).color(theme.quiet));
        }
    });
}

/// Rows of a preview; of longer tables the first ones stand for the rest.
const MOST_SHOWN: usize = 300;

fn row_ui(ui: &mut Ui, row: &ImportedRow, words: &Words, theme: &Theme) {
    let mono = |text: String| RichText::new(text).font(fonts::mono(size::TABLE));
    ui.label(mono(row.line.to_string()).color(theme.quiet));
    ui.label(mono(row.point.name.clone()));
    ui.label(RichText::new(words.text(csv_export::kind_key(row.point.geometry.kind()))).size(size::TABLE));
    let (key, what) = match &row.change {
        RowChange::Added => ("tables.row_new", String::new()),
        RowChange::Same => ("tables.row_same", String::new()),
        RowChange::Changed(changes) => {
            ("tables.row_changed", changes.iter().map(|c| c.what.clone()).collect::<Vec<_>>().join("; "))
        }
    };
    let word = RichText::new(words.text(key)).size(size::TABLE);
    let plain = row.change == RowChange::Same;
    ui.label(if plain { word.color(theme.quiet) } else { word.color(theme.text).strong() });
    ui.label(RichText::new(what).size(size::TABLE));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gui::text::Language;
    use crate::plan::document::{CsvStyle, csv_of_points};
    use std::path::Path;

    #[test]
    fn a_table_is_taken_whole_or_not_at_all() {
        let demo = include_bytes!("../../../../settings/demo.toml");
        let document = Document::from_bytes(demo, Path::new("demo.toml")).unwrap();
        let words = Words::of(Language::English);
        let points = document.read().draft.comparison;
        let same = csv_of_points(&points, CsvStyle::DecimalComma);
        let told = |table: &str| document.read_import(table.as_bytes(), Path::new("pasted")).unwrap();
        let import = told(&same);
        assert_eq!(counts(&import), [0, 0, points.len()]);
        assert!(may_import(&import, Rest::Keep, words).is_err());
        let first = points[0].name.clone();
        let renamed = same.replacen(&first, "NEW1", 1);
        let import = told(&renamed);
        assert_eq!((counts(&import)[0], import.not_named.clone()), (1, vec![first]));
        assert!(may_import(&import, Rest::Keep, words).is_ok());
        let broken = renamed.replacen("surface", "surfoce", 1);
        let import = told(&broken);
        assert!(import.faults() > 0);
        assert!(may_import(&import, Rest::Keep, words).unwrap_err().contains('1'));
    }
}
