//! Ways to a plan's file: the system's dialog on a thread of its own, a typed path where that does not open,
//! files dropped.

use super::action::Action;
use super::fonts;
use super::new_plan::Command;
use super::scope::Scope;
use super::theme::size;
use super::widgets::cards;
use crate::diagnostic::Diagnostic;
use crate::io::ply_has_faces;
use egui::{Align2, RichText, TextEdit, Ui};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Nobody shuts a dialog that fast: it did not open (no portal, no zenity).
const NOT_SHOWN: Duration = Duration::from_millis(300);

/// The endings of files that can only be a CAD.
const CADS: [&str; 2] = ["stl", "obj"];
/// The endings of files that can be scans.
const SCANS: [&str; 6] = ["ply", "xyz", "txt", "asc", "csv", "pts"];

/// The system's file dialog, while it is open.
#[derive(Debug, Default)]
pub(super) struct Dialog {
    open: Option<Receiver<Answer>>,
}

#[derive(Debug)]
struct Answer {
    path: Option<PathBuf>,
    after: Duration,
}

impl Dialog {
    /// Opens the dialog, in the folder of the plan at hand.
    pub fn ask(&mut self, ctx: &egui::Context, plan: Option<&Path>) {
        if self.open.is_some() {
            return;
        }
        let folder = plan.and_then(Path::parent).map(Path::to_path_buf);
        let (sender, receiver) = channel();
        let ctx = ctx.clone();
        let shown = std::thread::Builder::new().name("file dialog".into()).spawn(move || {
            let begin = Instant::now();
            let mut dialog = rfd::FileDialog::new().add_filter("TOML", &["toml"]);
            if let Some(folder) = folder {
                dialog = dialog.set_directory(folder);
            }
            // A panic in the system's dialog closes the channel, and the path is typed.
            let path = dialog.pick_file();
            let _ = sender.send(Answer { path, after: begin.elapsed() });
            ctx.request_repaint();
        });
        self.open = shown.is_ok().then_some(receiver);
    }

    /// What came of it, if it is shut.
    pub fn answer(&mut self) -> Option<Action> {
        use std::sync::mpsc::TryRecvError;
        let answer = match self.open.as_ref()?.try_recv() {
            Ok(answer) => Some(answer),
            Err(TryRecvError::Empty) => return None,
            Err(TryRecvError::Disconnected) => None,
        };
        self.open = None;
        match answer {
            Some(Answer { path: Some(path), .. }) => Some(Action::Open(path)),
            Some(Answer { path: None, after }) if after > NOT_SHOWN => None,
            _ => Some(Action::TypePath(true)),
        }
    }
}

/// Opens a plan that was dropped on the window, or inspects scans.
/// `fresh`: there is no plan to inspect them by, or one is being made.
pub(super) fn dropped(ctx: &egui::Context, fresh: bool, actions: &mut Vec<Action>) {
    let files: Vec<PathBuf> = ctx.input(|i| i.raw.dropped_files.iter().map(|f| f.path().to_path_buf()).collect());
    if !files.is_empty() {
        actions.push(for_files(files, fresh));
    }
}

/// What to do with files, told by their endings: one plan, a CAD to make one of, or else scans.
pub(super) fn for_files(files: Vec<PathBuf>, fresh: bool) -> Action {
    let ending = |path: &Path| path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    if let Some(plan) = files.iter().find(|path| ending(path) == "toml") {
        return Action::Open(plan.clone());
    }
    let cad = files.iter().find(|path| CADS.contains(&&*ending(path))).cloned();
    // Without a plan nobody has said yet what is what: a PLY of triangles is the CAD, unless there is another one.
    let mesh = |path: &&PathBuf| fresh && ending(path) == "ply" && ply_has_faces(path);
    let cad = cad.or_else(|| files.iter().find(mesh).cloned());
    let mut scans = files.iter().filter(|path| SCANS.contains(&&*ending(path)) && Some(*path) != cad.as_ref());
    let scan = scans.next().cloned();
    if cad.is_some() || (fresh && scan.is_some()) {
        return Action::NewPlan(Command::Start { cad, scan });
    }
    match files.iter().find(|path| !SCANS.contains(&&*ending(path))) {
        None => Action::Inspect(files),
        Some(other) => {
            let help = format!(
                "drop a plan (.toml) to open it, scans ({}) to inspect them, or a CAD ({}) to make a plan of it",
                SCANS.join(", "),
                CADS.join(", ")
            );
            let message = Diagnostic::warning("this file is neither a plan nor a scan nor a CAD").in_file(other);
            Action::Say(message.with_help(help))
        }
    }
}

/// Says what happens when the files that hover over the window are let go.
pub(super) fn drop_hint_ui(ui: &Ui, scope: &Scope) {
    if ui.ctx().input(|i| i.raw.hovered_files.is_empty()) {
        return;
    }
    let layer = egui::LayerId::new(egui::Order::Foreground, egui::Id::unique("drop"));
    let painter = ui.ctx().layer_painter(layer);
    let place = ui.ctx().content_rect();
    painter.rect_filled(place, 0, scope.theme.choice.gamma_multiply(0.9));
    let text = scope.words.text("dialog.drop");
    painter.text(place.center(), Align2::CENTER_CENTER, text, fonts::semibold(size::NOW), scope.theme.text);
}

/// The field for a typed path, and the recent plans.
pub(super) fn typed_path_ui(ui: &mut Ui, scope: &mut Scope) {
    if scope.view.typed_path.is_none() {
        return;
    }
    let words = scope.words;
    let id = egui::Id::unique("typed path");
    let mut text = ui.ctx().data_mut(|d| d.get_temp::<String>(id)).unwrap_or_default();
    let mut open = None;
    let shown = cards::modal(ui, id.with("modal")).show(ui.ctx(), |ui| {
        ui.set_width(560.0_f32.min(ui.ctx().content_rect().width() - 64.0));
        ui.heading(words.text("dialog.title"));
        ui.label(RichText::new(words.text("dialog.no_dialog")).color(scope.theme.quiet));
        ui.add_space(8.0);
        let label = ui.label(words.text("dialog.path"));
        let field = ui.add(TextEdit::singleline(&mut text).desired_width(f32::INFINITY)).labelled_by(label.id);
        if !field.has_focus() && text.is_empty() {
            field.request_focus();
        }
        let enter = field.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter));
        ui.add_space(8.0);
        ui.horizontal(|ui| {
            let big =
                |text: &str| egui::Button::new(RichText::new(text).size(size::BAR)).min_size(egui::vec2(120.0, 48.0));
            if (ui.add(big(words.text("dialog.open"))).clicked() || enter) && !text.trim().is_empty() {
                open = Some(PathBuf::from(text.trim().trim_matches('"')));
            }
            ui.add(big(words.text("dialog.cancel"))).clicked()
        })
        .inner
    });
    let cancelled = shown.inner || shown.should_close();
    if let Some(path) = open {
        text.clear();
        scope.ask(Action::Open(path));
    } else if cancelled {
        text.clear();
        scope.ask(Action::TypePath(false));
    }
    ui.ctx().data_mut(|d| d.insert_temp(id, text));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_that_are_dropped_do_what_their_endings_say() {
        let paths = |names: &[&str]| names.iter().map(PathBuf::from).collect::<Vec<_>>();
        let of = |names: &[&str]| for_files(paths(names), false);
        assert_eq!(of(&["a.ply", "b.toml"]), Action::Open("b.toml".into()));
        assert_eq!(of(&["a.PLY", "b.xyz"]), Action::Inspect(paths(&["a.PLY", "b.xyz"])));
        assert!(matches!(of(&["a.ply", "part.doc"]), Action::Say(d) if d.file == Some("part.doc".into())));
        let start = |cad: Option<&str>, scan: Option<&str>| {
            Action::NewPlan(Command::Start { cad: cad.map(PathBuf::from), scan: scan.map(PathBuf::from) })
        };
        assert_eq!(of(&["a.ply", "part.STL"]), start(Some("part.STL"), Some("a.ply")));
        assert_eq!(for_files(paths(&["a.ply"]), true), start(None, Some("a.ply")));
    }

    #[test]
    fn a_ply_of_triangles_is_a_cad_where_there_is_no_plan() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, faces: usize| {
            let path = folder.path().join(name);
            let text = format!(
                "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nelement face {faces}\n\
                 property list uchar int vertex_indices\nend_header\n"
            );
            std::fs::write(&path, text).unwrap();
            path
        };
        let (mesh, cloud) = (write("b.ply", 1), write("a.ply", 0));
        let start = |cad: Option<&PathBuf>, scan: Option<&PathBuf>| {
            Action::NewPlan(Command::Start { cad: cad.cloned(), scan: scan.cloned() })
        };
        assert_eq!(for_files(vec![mesh.clone()], true), start(Some(&mesh), None));
        assert_eq!(for_files(vec![cloud.clone(), mesh.clone()], true), start(Some(&mesh), Some(&cloud)));
        let other = folder.path().join("c.stl");
        assert_eq!(for_files(vec![other.clone(), mesh.clone()], true), start(Some(&other), Some(&mesh)));
        assert_eq!(for_files(vec![mesh.clone()], false), Action::Inspect(vec![mesh]));
    }
}
