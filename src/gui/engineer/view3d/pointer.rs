//! Pointer and keys over the part: clicks choose, propose and measure; drags move a point, the proposal, or the camera.

use super::marks::{Mark, Placed, under};
use super::snap::{self, Pointer};
use super::{Refused, View3d, toolbar};
use crate::gui::action::Action;
use crate::gui::engineer::{Draft, Edit, EngineerView, Section, Tool};
use crate::gui::scene::camera::Camera;
use crate::gui::scene::content::PartContent;
use crate::gui::scene::linked::size_of;
use crate::gui::scene::pick::{self, Pick};
use crate::gui::scope::Scope;
use crate::part::propose::{NoProposal, Picker, Proposal};
use crate::plan::Geometry;
use crate::plan::document::{Document, FieldValue, List, PointSpec};
use egui::{Key, Modifiers, PointerButton, Pos2, Rect, Response, Ui, Vec2};
use std::sync::Arc;

/// What a drag moves.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum Drag {
    /// Nothing, or the camera.
    #[default]
    Camera,
    /// A row of the plan; `off` leads from the pointer to its place.
    Row { list: List, row: usize, off: Vec2 },
    /// The proposal.
    Draft { off: Vec2 },
    /// What was dragged went back; the hand has not let go yet.
    Dropped,
}

/// What the pointer is over.
pub struct Target<'a> {
    /// What clicks are told from.
    pub picker: &'a Picker,
    /// The part as it is drawn.
    pub content: &'a Arc<PartContent>,
    /// From where it is seen.
    pub camera: &'a Camera,
    /// The scene in the window.
    pub at: Rect,
    /// The plan's rows.
    pub marks: &'a [Mark],
    /// Where they stand.
    pub places: &'a [Option<Placed>],
    /// The plan.
    pub document: &'a Document,
}

impl Target<'_> {
    fn pointer(&self, pos: Pos2) -> Pointer<'_> {
        let pixel = [f64::from(pos.x - self.at.left()), f64::from(pos.y - self.at.top())];
        Pointer { picker: self.picker, camera: self.camera, pixel, size: size_of(self.at) }
    }

    fn project(&self, geometry: &Geometry) -> Option<Pos2> {
        crate::gui::scene::overlay::project(self.camera, &geometry.position(), self.at, size_of(self.at))
    }
}

/// Acts on the pointer.
pub fn listen(ui: &Ui, response: &Response, target: &Target<'_>, view: &mut EngineerView, scope: &mut Scope) {
    if response.drag_started_by(PointerButton::Primary) && !ui.input(|i| i.modifiers.shift) {
        let pos = ui.input(|i| i.pointer.press_origin()).or_else(|| response.interact_pointer_pos());
        view.view3d.drag = pos.map_or(Drag::Camera, |pos| grab(pos, target, view, scope));
    }
    match view.view3d.drag {
        Drag::Camera => view.view3d.linked.pointer(ui, response, target.at, target.content),
        Drag::Dropped => {}
        Drag::Row { .. } | Drag::Draft { .. } => drag(response, target, view, scope),
    }
    if response.drag_stopped() || !ui.input(|i| i.pointer.any_down()) {
        if matches!(view.view3d.drag, Drag::Row { .. }) {
            scope.ask(Action::Edit(Edit::EndGesture));
        }
        view.view3d.drag = Drag::Camera;
    }
    if response.clicked()
        && let Some(pos) = response.interact_pointer_pos()
    {
        click(ui, pos, target, view, scope);
    }
    hover(ui, response, target, view);
}

/// What lies under a press: the proposal, a row that can be moved, else the part.
fn grab(pos: Pos2, target: &Target<'_>, view: &mut EngineerView, scope: &mut Scope) -> Drag {
    const REACH: f32 = 14.0;
    let draft = view.draft.as_ref().and_then(|draft| target.project(&draft.spec.geometry));
    if let Some(at) = draft.filter(|at| at.distance(pos) <= REACH) {
        return Drag::Draft { off: at - pos };
    }
    let Some(mark) = under(target.places, pos).filter(|_| view.tool == Tool::Choose) else { return Drag::Camera };
    let (Some(at), Mark { list, row, .. }) = (target.places[mark], &target.marks[mark]) else { return Drag::Camera };
    view.choose(*list, *row);
    view.view3d.shown = view.chosen.clone();
    scope.ask(Action::Edit(Edit::BeginGesture));
    Drag::Row { list: *list, row: *row, off: at.pos - pos }
}

/// Takes along what is dragged. Where nothing of its kind is, it stays, and words say why.
fn drag(response: &Response, target: &Target<'_>, view: &mut EngineerView, scope: &mut Scope) {
    let Some(pos) = response.interact_pointer_pos().filter(|_| response.drag_delta() != Vec2::ZERO) else { return };
    let moved = |geometry: &Geometry, off: Vec2| target.pointer(pos + off).drag(geometry);
    let refused = match view.view3d.drag {
        Drag::Row { list, row, off } => {
            let Some(mark) = target.marks.iter().find(|m| (m.list, m.row) == (list, row)) else { return };
            match moved(&mark.geometry, off) {
                Ok(Proposal { geometry, .. }) => {
                    if geometry != mark.geometry {
                        scope.ask(Action::Edit(Edit::Reshape { list, index: row, geometry }));
                    }
                    None
                }
                Err(why) => Some(why),
            }
        }
        Drag::Draft { off } => {
            let Some(draft) = &mut view.draft else { return };
            match moved(&draft.spec.geometry, off) {
                Ok(proposal) => {
                    draft.note = note(&proposal, scope);
                    draft.spec.geometry = proposal.geometry;
                    None
                }
                Err(why) => Some(why),
            }
        }
        Drag::Camera | Drag::Dropped => None,
    };
    // Past the part nothing has to be said while the hand moves.
    view.view3d.refused = refused.filter(|why| *why != NoProposal::PastThePart).map(|why| Refused { pos, why });
}

fn click(ui: &Ui, pos: Pos2, target: &Target<'_>, view: &mut EngineerView, scope: &mut Scope) {
    view.view3d.refused = None;
    match view.tool {
        Tool::Choose => choose(ui, pos, target, view),
        Tool::Measure => measure(pos, target, &mut view.view3d),
        tool => match target.pointer(pos).propose(tool) {
            Some(Ok(proposal)) => propose(tool, proposal, target.document, view, scope),
            Some(Err(why)) => view.view3d.refused = Some(Refused { pos, why }),
            None => {}
        },
    }
}

fn choose(ui: &Ui, pos: Pos2, target: &Target<'_>, view: &mut EngineerView) {
    let more = ui.input(|i| i.modifiers.shift || i.modifiers.command);
    match under(target.places, pos).map(|k| &target.marks[k]) {
        Some(mark) if more => {
            view.chosen.toggle(mark.list, mark.row);
            view.draft = None;
        }
        Some(mark) => view.choose(mark.list, mark.row),
        None if !more => view.chosen = Default::default(),
        None => {}
    }
    view.view3d.shown = view.chosen.clone();
}

fn measure(pos: Pos2, target: &Target<'_>, view: &mut View3d) {
    let pointer = target.pointer(pos);
    let Some(hit) =
        snap::ray(pointer.camera, pointer.pixel, pointer.size).and_then(|ray| pointer.picker.hit(&ray).ok())
    else {
        return;
    };
    if view.picks.len() >= 2 {
        view.picks.clear();
    }
    view.picks.push(Pick { place: hit.point, triangle: 0, normal: hit.normal });
}

/// Makes a proposal the draft of the form. What was typed for the one before stays, if it is of the same kind.
fn propose(tool: Tool, proposal: Proposal, document: &Document, view: &mut EngineerView, scope: &Scope) {
    let Some(list) = snap::list_of(tool) else { return };
    let note = note(&proposal, scope);
    let spec = match view.draft.take() {
        Some(before) if before.list == list && before.spec.geometry.kind() == proposal.geometry.kind() => {
            PointSpec { geometry: proposal.geometry, ..before.spec }
        }
        _ => new_row(list, proposal.geometry, document),
    };
    view.draft = Some(Draft { list, spec, note });
    view.chosen = Default::default();
    view.view3d.shown = view.chosen.clone();
    view.section = if list == List::Feature { Section::Alignment } else { Section::Points };
}

/// A new row: a comparison point with the limits of the last one of its kind, else of the last one, else half a millimetre.
pub fn new_row(list: List, geometry: Geometry, document: &Document) -> PointSpec {
    if list == List::Feature {
        return PointSpec::feature("", geometry);
    }
    let rows = document.rows(list);
    let limit = |key: &str, row: &crate::plan::document::RowInfo| match row.value(key) {
        Some(FieldValue::Number(v)) => Some(*v),
        _ => None,
    };
    let limits = |row: &crate::plan::document::RowInfo| Some([limit("lower_mm", row)?, limit("upper_mm", row)?]);
    let of_kind = rows.iter().rev().filter(|row| row.kind == geometry.kind()).find_map(limits);
    let [lower_mm, upper_mm] = of_kind.or_else(|| rows.iter().rev().find_map(limits)).unwrap_or([-0.5, 0.5]);
    PointSpec::point("", geometry, lower_mm, upper_mm)
}

/// A rim may stand off its shape by so much without a word, mm.
const OFF_MM: f64 = 0.02;

/// What somebody should know of a proposal.
fn note(proposal: &Proposal, scope: &Scope) -> Option<String> {
    let words = scope.words;
    let off = || words.fill("pick.note_off", &[("mm", &words.number(proposal.off_mm, 3))]);
    // The only thing that the core notes of a click.
    let sharp = proposal.note.as_ref().map(|_| words.text("pick.note_sharp").to_owned());
    sharp.or_else(|| (proposal.off_mm > OFF_MM).then(off))
}

/// The snap and the place under the pointer.
fn hover(ui: &Ui, response: &Response, target: &Target<'_>, view: &mut EngineerView) {
    let pos = ui.input(|i| i.pointer.hover_pos()).filter(|pos| response.contains_pointer() && target.at.contains(*pos));
    let idle = matches!(view.view3d.drag, Drag::Camera) && !response.dragged();
    view.view3d.cursor = pos.and_then(|pos| target.pointer(pos).place());
    view.view3d.hover = pos.filter(|_| idle).and_then(|pos| target.pointer(pos).propose(view.tool)?.ok());
    let over_mark = pos.filter(|_| view.tool == Tool::Choose).and_then(|pos| under(target.places, pos));
    match (view.view3d.drag, over_mark) {
        (Drag::Row { .. } | Drag::Draft { .. }, _) => ui.set_cursor_icon(egui::CursorIcon::Grabbing),
        (_, Some(_)) => ui.set_cursor_icon(egui::CursorIcon::Grab),
        (Drag::Camera, None) if idle && pos.is_some() && view.tool != Tool::Choose => {
            ui.set_cursor_icon(egui::CursorIcon::Crosshair);
        }
        _ => {}
    }
    // A finger that was lifted has not gone away from what it asked.
    let gone = |refused: &Refused| pos.is_some_and(|pos| pos.distance(refused.pos) > 40.0);
    if view.view3d.refused.as_ref().is_some_and(gone) {
        view.view3d.refused = None;
    }
}

/// Keys of the view, while no field or dialog owns them.
pub fn keys(ui: &Ui, response: &Response, content: &Arc<PartContent>, view: &mut EngineerView, scope: &mut Scope) {
    if !scope.letters_are_free(ui) {
        return;
    }
    let pressed = |key: Key| ui.input_mut(|i| i.consume_key(Modifiers::NONE, key));
    let escape = matches!(view.view3d.drag, Drag::Row { .. }) || view.draft.is_some() || view.tool != Tool::Choose;
    if escape && pressed(Key::Escape) {
        leave(view, scope);
    }
    // A button with the focus takes Enter for itself.
    let free = ui.memory(|m| m.focused().is_none_or(|id| id == response.id));
    let sound = |draft: &Draft| scope.facts.editing.as_ref().is_none_or(|editing| editing.would_take(draft));
    if free
        && view.draft.as_ref().is_some_and(sound)
        && pressed(Key::Enter)
        && let Some(draft) = view.draft.take()
    {
        scope.ask(Action::Edit(Edit::AddRows(draft.list, vec![draft.spec])));
    }
    toolbar::keys(ui, view);
    if free {
        let margin = view.view3d.margin;
        view.view3d.linked.keys(ui, response.rect, content, margin);
    }
}

/// Esc: the drag goes back, else the proposal is left out, else the tool is put away.
fn leave(view: &mut EngineerView, scope: &mut Scope) {
    if matches!(view.view3d.drag, Drag::Row { .. }) {
        scope.ask(Action::Edit(Edit::DropGesture));
        view.view3d.drag = Drag::Dropped;
    } else if view.draft.is_some() {
        view.draft = None;
    } else {
        toolbar::take(view, Tool::Choose);
    }
}

/// Whether something stands between the eye and a shape, or it is outside of the view.
pub fn is_out_of_sight(geometry: &Geometry, camera: &Camera, at: Rect, content: &PartContent) -> bool {
    let (place, size) = (geometry.position(), size_of(at));
    let pos = crate::gui::scene::overlay::project(camera, &place, at, size);
    let face = content.part.face(content.face);
    !pos.is_some_and(|pos| at.contains(pos)) || pick::is_hidden(&face.bvh, camera, &place, size)
}
