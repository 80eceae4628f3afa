//! How the part is held: the choice of method with what each would leave, then its datums, locks or regions.

use super::desk::{Choice, ChoiceKind};
use super::editing::{Edit, Editing};
use super::fields::{Commit, Field, label_width, line_ui, note_ui, plain_number, problems_of, problems_ui, worst};
use super::row_form::Triple;
use super::section_form::{setting_ui, small_button, table_ui};
use super::state::EngineerView;
use super::uncertainty::choice_words;
use crate::diagnostic::Severity;
use crate::geometry::{Point3, UnitVector3, Vector3};
use crate::gui::action::Action;
use crate::gui::fonts;
use crate::gui::scope::Scope;
use crate::gui::text::typed_number;
use crate::gui::theme::size;
use crate::plan::RegionShape;
use crate::plan::document::{At, FORM, FieldValue, List, Lock, Region};
use egui::{ComboBox, RichText, Ui, WidgetInfo};

/// The ways to hold a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Method {
    Features,
    Locks,
    Regions,
    BestFit,
}

/// Draws the form.
pub fn alignment_ui(ui: &mut Ui, scope: &mut Scope, view: &mut EngineerView, editing: &Editing) {
    let method = method_of(editing);
    methods_ui(ui, scope, editing, method);
    problems_ui(ui, scope, &problems_of(editing, At::Settings("alignment"), Some("method")));
    ui.separator();
    match method {
        Some(Method::Features) => features_ui(ui, scope, view, editing),
        Some(Method::Locks) => locks_ui(ui, scope, view, editing),
        Some(Method::Regions) => regions_ui(ui, scope, view, editing),
        Some(Method::BestFit) | None => {}
    }
    let drawn: &[&str] = &["method", "hole", "slot", "slot_reading", "point", "freeze"];
    table_ui(ui, scope, view, editing, "alignment", drawn);
    ui.add_space(8.0);
    let note = RichText::new(scope.words.text("engineer.features_below")).size(size::NOTE).color(scope.theme.quiet);
    ui.label(note);
}

fn method_of(editing: &Editing) -> Option<Method> {
    match editing.document.setting("alignment", "method") {
        Some(FieldValue::Text(word)) => match word.as_str() {
            "features" => Some(Method::Features),
            "rps" => Some(Method::Locks),
            "best_fit" if editing.document.regions().is_empty() => Some(Method::BestFit),
            "best_fit" => Some(Method::Regions),
            _ => None,
        },
        _ => None,
    }
}

/// What a choice would leave, in words.
fn cost_words(scope: &Scope, choice: Option<&Choice>) -> String {
    let words = scope.words;
    let cost = choice.and_then(|c| c.foretold.as_ref()).and_then(|f| f.schemes.first()?.cost.as_ref());
    match (choice, cost) {
        (_, Some(cost)) => {
            let [median, worst] = [cost.median_mm, cost.worst_mm].map(|mm| words.number(mm, 3));
            let values = [("median", median.as_str()), ("worst", &worst), ("point", &cost.worst_point)];
            words.fill("engineer.u_cost", &values)
        }
        (Some(_), None) => words.text("engineer.u_not_held").to_owned(),
        (None, None) => String::new(),
    }
}

fn methods_ui(ui: &mut Ui, scope: &mut Scope, editing: &Editing, now: Option<Method>) {
    let words = scope.words;
    let of = |kind: fn(&ChoiceKind) -> bool| editing.choices.iter().find(|c| kind(&c.kind));
    let current = of(|kind| *kind == ChoiceKind::Now);
    let all = [
        (Method::Features, "choice.features", of(|k| matches!(k, ChoiceKind::CentreLine(_)))),
        (Method::Locks, "choice.rps", None),
        (Method::Regions, "choice.regions", None),
        (Method::BestFit, "choice.best_fit", of(|k| *k == ChoiceKind::BestFit)),
    ];
    for (method, key, choice) in all {
        let chosen = now == Some(method);
        let response = ui.radio(chosen, RichText::new(words.text(key)).font(fonts::semibold(size::TABLE)));
        let told = cost_words(scope, if chosen { current } else { choice });
        if !told.is_empty() {
            ui.horizontal(|ui| {
                ui.add_space(24.0);
                note_ui(ui, scope, &told);
            });
        }
        if response.clicked() && !chosen {
            scope.ask(Action::Edit(first_of(editing, method)));
        }
    }
    for choice in &editing.choices {
        if let ChoiceKind::Axis(_) = &choice.kind {
            let told = format!("{}: {}", choice_words(words, &choice.kind), cost_words(scope, Some(choice)));
            note_ui(ui, scope, &told);
        }
    }
}

/// The edit that holds the part in another way, by what the plan has.
fn first_of(editing: &Editing, method: Method) -> Edit {
    let rows = editing.rows(List::Feature);
    let first = |kind: &str| rows.iter().find(|row| row.kind == kind).map(|row| row.name.clone()).unwrap_or_default();
    match method {
        Method::Features => Edit::HoldByFeatures(["hole", "slot", "surface"].map(first)),
        Method::BestFit => Edit::HoldByRegions(Vec::new()),
        Method::Regions => Edit::HoldByRegions(vec![new_region(editing)]),
        Method::Locks => {
            let name = |k: usize| rows.get(k).map(|row| row.name.clone()).unwrap_or_default();
            let (x, y, z) = (Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis());
            let locks = [(0, z), (1, z), (2, z), (0, x), (0, y), (1, y)];
            Edit::HoldByLocks(locks.map(|(k, lock)| Lock { feature: name(k), lock }).to_vec())
        }
    }
}

fn new_region(editing: &Editing) -> Region {
    let bounds = editing.part.as_ref().and_then(|part| part.mesh.bounds());
    let centre = bounds.map_or(Point3::origin(), |bounds| {
        let middle: Vector3 = 0.5 * (bounds.min.coords + bounds.max.coords);
        Point3::from(middle.map(|v| (10.0 * v).round() / 10.0))
    });
    Region { name: String::new(), centre, shape: RegionShape::Ball { radius_mm: 20.0 }, weight: 1.0 }
}

fn features_ui(ui: &mut Ui, scope: &mut Scope, view: &mut EngineerView, editing: &Editing) {
    for key in ["hole", "slot", "slot_reading", "point"] {
        if let Some(setting) = FORM.iter().find(|s| s.table == "alignment" && s.key == key) {
            setting_ui(ui, scope, view, editing, setting);
        }
    }
}

fn locks_ui(ui: &mut Ui, scope: &mut Scope, view: &mut EngineerView, editing: &Editing) {
    let words = scope.words;
    let locks = editing.document.locks();
    let mut made = None;
    for (k, lock) in locks.iter().enumerate() {
        let label = words.fill("engineer.lock", &[("n", &(k + 1).to_string())]);
        line_ui(ui, scope, &label, |ui, scope| {
            let shown = RichText::new(lock.feature.as_str()).font(fonts::mono(size::TABLE));
            let combo = ComboBox::from_id_salt(("lock", k)).selected_text(shown).width(64.0);
            let shown = combo.show_ui(ui, |ui| {
                for row in editing.rows(List::Feature) {
                    if ui.selectable_label(row.name == lock.feature, &row.name).clicked() {
                        made = Some(changed(&locks, k, |l| l.feature.clone_from(&row.name)));
                    }
                }
            });
            shown.response.widget_info(|| WidgetInfo::labeled(egui::Role::ComboBox, true, &label));
            let now = Some([lock.lock.x, lock.lock.y, lock.lock.z]);
            let key = format!("lock.{k}");
            let triple = Triple { key: &key, label: &label, now, decimals: 3, room: 34.0, severity: None };
            if let Some(along) = triple.ui(ui, scope, view).and_then(|v| UnitVector3::try_new(Vector3::from(v), 1e-9)) {
                made = Some(changed(&locks, k, |l| l.lock = along));
            }
            let remove = words.fill("engineer.remove_lock", &[("n", &(k + 1).to_string())]);
            if small_button(ui, "×", &remove).clicked() {
                made = Some(without(&locks, k));
            }
        });
        problems_ui(ui, scope, &all_at(editing, At::Lock(k)));
    }
    if ui.button(words.text("engineer.add_lock")).clicked() {
        let feature = editing.rows(List::Feature).first().map(|row| row.name.clone()).unwrap_or_default();
        made = Some([locks.clone(), vec![Lock { feature, lock: Vector3::z_axis() }]].concat());
    }
    if let Some(locks) = made {
        scope.ask(Action::Edit(Edit::HoldByLocks(locks)));
    }
}

fn regions_ui(ui: &mut Ui, scope: &mut Scope, view: &mut EngineerView, editing: &Editing) {
    let words = scope.words;
    let regions = editing.document.regions();
    let mut made = None;
    for (k, region) in regions.iter().enumerate() {
        let n = (k + 1).to_string();
        ui.horizontal(|ui| {
            let title = words.fill("engineer.region", &[("n", &n)]);
            ui.label(RichText::new(title).font(fonts::semibold(size::TABLE)));
            if small_button(ui, "×", &words.fill("engineer.remove_region", &[("n", &n)])).clicked() {
                made = Some(without(&regions, k));
            }
        });
        if let Some(region) = region_ui(ui, scope, view, editing, (k, region)) {
            made = Some(changed(&regions, k, |r| r.clone_from(&region)));
        }
        problems_ui(ui, scope, &all_at(editing, At::Region(k)));
    }
    if ui.button(words.text("engineer.add_region")).clicked() {
        made = Some([regions.clone(), vec![new_region(editing)]].concat());
    }
    if let Some(regions) = made {
        scope.ask(Action::Edit(Edit::HoldByRegions(regions)));
    }
    if let Some(freeze) = FORM.iter().find(|s| s.table == "alignment" && s.key == "freeze") {
        setting_ui(ui, scope, view, editing, freeze);
    }
}

/// The fields of a region; tells it when somebody changed it.
fn region_ui(
    ui: &mut Ui,
    scope: &mut Scope,
    view: &mut EngineerView,
    editing: &Editing,
    (k, region): (usize, &Region),
) -> Option<Region> {
    let words = scope.words;
    let mut made = None;
    let centre = words.text("setting.centre");
    line_ui(ui, scope, centre, |ui, scope| {
        let (key, now) = (format!("region.{k}.centre"), Some([region.centre.x, region.centre.y, region.centre.z]));
        let severity = severity(editing, k, "centre");
        let triple = Triple { key: &key, label: centre, now, decimals: 3, room: 0.0, severity };
        if let Some(v) = triple.ui(ui, scope, view) {
            made = Some(Region { centre: Point3::from(Vector3::from(v)), ..region.clone() });
        }
    });
    match region.shape {
        RegionShape::Ball { radius_mm } => {
            let severity = severity(editing, k, "radius_mm");
            let (key, label) = (format!("region.{k}.radius_mm"), "setting.radius");
            if let Some(radius_mm) = number_ui(ui, scope, view, (&key, label), radius_mm, severity) {
                made = Some(Region { shape: RegionShape::Ball { radius_mm }, ..region.clone() });
            }
        }
        RegionShape::Box { size_mm } => {
            let label = words.text("setting.size");
            line_ui(ui, scope, label, |ui, scope| {
                let (key, now) = (format!("region.{k}.size_mm"), Some([size_mm.x, size_mm.y, size_mm.z]));
                let severity = severity(editing, k, "size_mm");
                let triple = Triple { key: &key, label, now, decimals: 3, room: 0.0, severity };
                if let Some(v) = triple.ui(ui, scope, view) {
                    made = Some(Region { shape: RegionShape::Box { size_mm: Vector3::from(v) }, ..region.clone() });
                }
            });
        }
    }
    let (key, severity) = (format!("region.{k}.weight"), severity(editing, k, "weight"));
    if let Some(weight) = number_ui(ui, scope, view, (&key, "setting.weight"), region.weight, severity) {
        made = Some(Region { weight, ..region.clone() });
    }
    shape_ui(ui, scope, region).or(made)
}

/// The worst that is told of a key of a region.
fn severity(editing: &Editing, k: usize, key: &str) -> Option<Severity> {
    worst(&problems_of(editing, At::Region(k), Some(key)))
}

/// A ball or a box.
fn shape_ui(ui: &mut Ui, scope: &mut Scope, region: &Region) -> Option<Region> {
    let words = scope.words;
    let mut shape = None;
    ui.horizontal(|ui| {
        ui.add_space(label_width(ui) + 6.0);
        let is_ball = matches!(region.shape, RegionShape::Ball { .. });
        let reach = match region.shape {
            RegionShape::Ball { radius_mm } => radius_mm,
            RegionShape::Box { size_mm } => 0.5 * size_mm.max(),
        };
        if ui.selectable_label(is_ball, words.text("engineer.ball")).clicked() && !is_ball {
            shape = Some(RegionShape::Ball { radius_mm: reach });
        }
        if ui.selectable_label(!is_ball, words.text("engineer.box")).clicked() && is_ball {
            shape = Some(RegionShape::Box { size_mm: Vector3::repeat(2.0 * reach) });
        }
    });
    shape.map(|shape| Region { shape, ..region.clone() })
}

fn number_ui(
    ui: &mut Ui,
    scope: &mut Scope,
    view: &mut EngineerView,
    (key, label): (&str, &'static str),
    now: f64,
    severity: Option<Severity>,
) -> Option<f64> {
    let words = scope.words;
    let label = words.text(label);
    line_ui(ui, scope, label, |ui, scope| {
        let full = plain_number(words, now);
        let field = Field {
            key,
            label,
            shown: full.clone(),
            full,
            hint: String::new(),
            width: 110.0,
            number: true,
            severity,
            commit: Commit::Typed,
        };
        field.ui(ui, scope, view).and_then(|text| typed_number(&text))
    })
}

fn all_at(editing: &Editing, at: At) -> Vec<&crate::plan::document::PlanProblem> {
    editing.problems.iter().filter(|p| p.place.at == at).collect()
}

fn changed<T: Clone>(all: &[T], k: usize, change: impl Fn(&mut T)) -> Vec<T> {
    let mut all = all.to_vec();
    change(&mut all[k]);
    all
}

fn without<T: Clone>(all: &[T], k: usize) -> Vec<T> {
    let mut all = all.to_vec();
    all.remove(k);
    all
}
