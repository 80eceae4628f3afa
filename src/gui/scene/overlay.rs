//! What is drawn over a scene: markers, flags with leaders, features of the alignment, the axes.

use super::camera::{Camera, ViewSize};
use super::content::PartContent;
use super::linked::size_of;
use super::pick;
use crate::geometry::{Point3, UnitVector3, Vector3};
use crate::gui::fonts;
use crate::gui::theme::{Theme, size};
use crate::gui::widgets::sign::Sign;
use crate::inspect::Verdict;
use crate::plan::{Feature, Geometry};
use crate::report::flags::{Margin, Room, place_around, split};
use egui::{
    Align2, Color32, CornerRadius, Painter, Pos2, Rect, Response, Role, Sense, Shape, Stroke, StrokeKind, Ui,
    WidgetInfo, pos2, vec2,
};

/// A comparison point to be marked.
#[derive(Debug, Clone, PartialEq)]
pub struct Mark {
    /// `surface`, `edge` or `hole`.
    pub kind: &'static str,
    /// Its verdict.
    pub verdict: Verdict,
    /// Nominal place, CAD frame.
    pub place: Point3,
    /// Its name.
    pub name: String,
    /// Its deviation as it is written.
    pub value: String,
}

/// Where a mark stands in a view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placed {
    /// In the window.
    pub pos: Pos2,
    /// The part stands before it.
    pub hidden: bool,
}

/// Where all marks stand; `None` for one behind the eye.
pub fn placed(marks: &[Mark], camera: &Camera, at: Rect, content: &PartContent) -> Vec<Option<Placed>> {
    let size = size_of(at);
    let face = content.part.face(content.face);
    let one = |mark: &Mark| {
        let pos = project(camera, &mark.place, at, size)?;
        let hidden = pick::is_hidden(&face.bvh, camera, &mark.place, size);
        Some(Placed { pos, hidden })
    };
    marks.iter().map(one).collect()
}

/// Where a place stands in the window; `None` behind the eye.
pub fn project(camera: &Camera, point: &Point3, at: Rect, size: ViewSize) -> Option<Pos2> {
    camera.project(point, size).map(|p| pos2(at.left() + p.x as f32, at.top() + p.y as f32))
}

/// Draws all markers, the chosen one last.
pub fn markers(painter: &Painter, marks: &[Mark], places: &[Option<Placed>], chosen: Option<usize>, theme: &Theme) {
    let last = chosen.filter(|k| *k < marks.len());
    let order = (0..marks.len()).filter(|k| Some(*k) != last).chain(last);
    for k in order {
        let Some(Placed { pos, hidden }) = places[k] else { continue };
        let mut painter = painter.clone();
        if hidden && Some(k) != last {
            painter.multiply_opacity(0.3);
        }
        marker(&painter, marks[k].kind, marks[k].verdict, pos, theme);
        if Some(k) == last {
            painter.circle_stroke(pos, 12.0, Stroke::new(4.5, theme.panel));
            painter.circle_stroke(pos, 12.0, Stroke::new(2.5, theme.accent));
        }
    }
}

/// One marker: its form tells the kind, its colour the verdict; without a value it is dashed and empty.
pub fn marker(painter: &Painter, kind: &str, verdict: Verdict, pos: Pos2, theme: &Theme) {
    if verdict == Verdict::NotMeasured {
        empty_form(painter, kind, theme.verdict(verdict), theme.panel, pos);
    } else {
        form(painter, kind, theme.verdict(verdict), pos);
    }
}

/// A triangle around a place.
fn triangle(pos: Pos2, r: f32) -> [Pos2; 3] {
    [vec2(0.0, -r), vec2(1.05 * r, 0.78 * r), vec2(-1.05 * r, 0.78 * r)].map(|v| pos + v)
}

/// The form of a kind, dashed and empty: `ground` shows between the dashes, whatever lies behind.
fn empty_form(painter: &Painter, kind: &str, colour: Color32, ground: Color32, pos: Pos2) {
    let dashes = |points: &[Pos2]| Shape::dashed_line(points, Stroke::new(1.8, colour), 3.0, 2.2);
    if kind == "edge" {
        painter.add(Shape::convex_polygon(triangle(pos, 8.4).to_vec(), ground, Stroke::NONE));
        let [a, b, c] = triangle(pos, 5.8);
        painter.extend(dashes(&[a, b, c, a]));
    } else {
        painter.circle_filled(pos, 7.2, ground);
        let ring = (0..=24).map(|k| pos + 5.0 * egui::Vec2::angled(k as f32 * std::f32::consts::TAU / 24.0));
        painter.extend(dashes(&ring.collect::<Vec<_>>()));
    }
}

/// The form of a kind in a colour, with a white rim.
pub fn form(painter: &Painter, kind: &str, colour: Color32, pos: Pos2) {
    let white = Color32::WHITE;
    match kind {
        "edge" => {
            painter.add(Shape::convex_polygon(triangle(pos, 8.4).to_vec(), white, Stroke::NONE));
            painter.add(Shape::convex_polygon(triangle(pos, 5.8).to_vec(), colour, Stroke::NONE));
        }
        "hole" => {
            painter.circle_filled(pos, 6.8, white);
            painter.circle_stroke(pos, 4.3, Stroke::new(2.6, colour));
        }
        _ => {
            painter.circle_filled(pos, 6.6, white);
            painter.circle_filled(pos, 5.1, colour);
        }
    }
}

/// Height of a flag and the distance from one to the next, points.
const FLAG: [f32; 2] = [26.0, 34.0];

/// A flag's place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Banner {
    /// Which of the marks it names.
    pub mark: usize,
    /// The flag.
    pub rect: Rect,
    /// The leader, from the flag to the mark.
    pub leader: [Pos2; 2],
}

/// Where the flags of some marks stand, in the margins of a view, over no marker and nothing of `kept`; marks outside of the view get none.
pub fn banners(
    ui: &Ui,
    at: Rect,
    marks: &[Mark],
    places: &[Option<Placed>],
    flagged: &[usize],
    kept: &[Rect],
) -> Vec<Banner> {
    let shown: Vec<(usize, Pos2)> =
        flagged.iter().filter_map(|&k| Some((k, places[k]?.pos))).filter(|(_, pos)| at.contains(*pos)).collect();
    let wide = shown.iter().map(|(k, _)| flag_width(ui, &marks[*k])).fold(0.0, f32::max);
    if at.width() < 2.0 * wide + 120.0 || at.height() < 3.0 * FLAG[1] {
        return Vec::new();
    }
    let room = Room {
        left_x: f64::from(at.left() + 8.0 + wide),
        right_x: f64::from(at.right() - 8.0 - wide),
        top: f64::from(at.top() + 0.5 * FLAG[0] + 8.0),
        bottom: f64::from(at.bottom() - 0.5 * FLAG[0] - 8.0),
        pitch: f64::from(FLAG[1]),
    };
    let markers = places.iter().flatten().map(|p| Rect::from_center_size(p.pos, vec2(16.0, 16.0)));
    let kept: Vec<Rect> = markers.chain(kept.iter().copied()).collect();
    let taken = [at.left() + 8.0, at.right() - 8.0 - wide].map(|left| {
        let column = Rect::from_x_y_ranges(left..=left + wide, at.y_range());
        let inside = kept.iter().filter(|kept| kept.intersects(column));
        inside.map(|kept| [f64::from(kept.top()), f64::from(kept.bottom())]).collect::<Vec<_>>()
    });
    let points: Vec<[f64; 2]> = shown.iter().map(|(_, p)| [f64::from(p.x), f64::from(p.y)]).collect();
    let margins = split(&points, f64::from(at.center().x), room.capacity());
    let banner = |flag: &crate::report::flags::Flag| {
        let (left, inner) = match flag.margin {
            Margin::Left => (at.left() + 8.0, room.left_x),
            Margin::Right => (room.right_x as f32, room.right_x),
        };
        let (mark, pos) = shown[flag.point];
        let rect = Rect::from_min_size(pos2(left, flag.y as f32 - 0.5 * FLAG[0]), vec2(wide, FLAG[0]));
        Banner { mark, rect, leader: [pos2(inner as f32, flag.y as f32), pos] }
    };
    place_around(&points, &margins, &room, [&taken[0], &taken[1]]).iter().map(banner).collect()
}

/// Draws the leaders of flags, below the markers.
pub fn leaders(painter: &Painter, banners: &[Banner], chosen: Option<usize>, theme: &Theme) {
    for banner in banners {
        painter.line_segment(banner.leader, Stroke::new(3.2, theme.panel));
    }
    for banner in banners {
        let is_chosen = Some(banner.mark) == chosen;
        let stroke = if is_chosen { Stroke::new(2.5, theme.accent) } else { Stroke::new(1.0, theme.text) };
        painter.line_segment(banner.leader, stroke);
    }
}

/// Draws flags, above everything. Returns the mark whose flag was clicked.
pub fn flags(ui: &mut Ui, banners: &[Banner], marks: &[Mark], chosen: Option<usize>, theme: &Theme) -> Option<usize> {
    let mut clicked = None;
    for banner in banners {
        if flag_ui(ui, banner.rect, &marks[banner.mark], Some(banner.mark) == chosen, theme).clicked() {
            clicked = Some(banner.mark);
        }
    }
    clicked
}

fn flag_width(ui: &Ui, mark: &Mark) -> f32 {
    let text = |text: &str| crate::gui::widgets::words::width(ui, text, fonts::mono(size::TABLE));
    (8.0 + 14.0 + 6.0 + text(&mark.name) + 14.0 + text(&mark.value) + 8.0).max(112.0)
}

fn flag_ui(ui: &mut Ui, rect: Rect, mark: &Mark, chosen: bool, theme: &Theme) -> Response {
    let response = ui.interact(rect, ui.scope_id().with(("flag", &mark.name)), Sense::click());
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, format!("{} {}", mark.name, mark.value)));
    let frame = match (chosen, response.hovered() || response.has_focus()) {
        (true, _) => Stroke::new(2.5, theme.accent),
        (false, true) => Stroke::new(1.0, theme.accent),
        (false, false) => Stroke::new(1.0, theme.strong_stroke),
    };
    let painter = ui.painter();
    painter.rect(rect, CornerRadius::same(4), theme.panel, frame, StrokeKind::Inside);
    let sign = Rect::from_center_size(pos2(rect.left() + 15.0, rect.center().y), vec2(14.0, 14.0));
    Sign::from(mark.verdict).paint(painter, sign, theme);
    let font = fonts::mono(size::TABLE);
    let (left, right) = (pos2(rect.left() + 28.0, rect.center().y), pos2(rect.right() - 8.0, rect.center().y));
    painter.text(left, Align2::LEFT_CENTER, &mark.name, font.clone(), theme.text);
    painter.text(right, Align2::RIGHT_CENTER, &mark.value, font, theme.text);
    if response.hovered() {
        ui.set_cursor_icon(egui::CursorIcon::PointingHand);
    }
    response
}

/// Draws the features of the alignment at their nominal places, with their names.
pub fn features(
    painter: &Painter,
    features: &[Feature],
    camera: &Camera,
    at: Rect,
    content: &PartContent,
    theme: &Theme,
) {
    let size = size_of(at);
    let face = content.part.face(content.face);
    for feature in features {
        let position = feature.geometry.position();
        let Some(middle) = project(camera, &position, at, size) else { continue };
        let mut painter = painter.clone();
        if pick::is_hidden(&face.bvh, camera, &position, size) {
            painter.multiply_opacity(0.3);
        }
        let outline = outline(&feature.geometry);
        let line: Vec<Pos2> = outline.iter().filter_map(|p| project(camera, p, at, size)).collect();
        if line.len() > 2 && line.len() == outline.len() {
            painter.add(Shape::closed_line(line.clone(), Stroke::new(5.5, Color32::WHITE)));
            painter.add(Shape::closed_line(line.clone(), Stroke::new(3.5, theme.feature)));
        } else {
            painter.circle_filled(middle, 6.0, Color32::WHITE);
            painter.circle_filled(middle, 4.5, theme.feature);
        }
        let top = line.iter().map(|p| p.y).fold(middle.y - 5.0, f32::min);
        let font = fonts::mono(size::NOTE);
        let text = painter.layout_no_wrap(feature.name.clone(), font, theme.text);
        let label = Rect::from_center_size(pos2(middle.x, top - 12.0), text.size() + vec2(10.0, 4.0));
        painter.rect(label, CornerRadius::same(3), theme.panel, Stroke::new(1.0, theme.feature), StrokeKind::Inside);
        painter.galley(label.min + vec2(5.0, 2.0), text, theme.text);
    }
}

/// The rim of a hole or slot, closed; nothing for a point.
pub fn outline(geometry: &Geometry) -> Vec<Point3> {
    const STEPS: u32 = 40;
    let turn = |k: u32| f64::from(k) * std::f64::consts::TAU / f64::from(STEPS);
    let across = |axis: &UnitVector3| axis.cross(&Vector3::ith(axis.iamin(), 1.0)).normalize();
    match geometry {
        Geometry::Hole { centre, axis, diameter_mm, .. } => {
            let u = across(axis);
            let v = axis.cross(&u);
            (0..STEPS).map(|k| centre + (u * turn(k).cos() + v * turn(k).sin()) * (0.5 * diameter_mm)).collect()
        }
        Geometry::Slot { centre, axis, direction, length_mm, width_mm } => {
            let (u, v) = (direction.into_inner(), axis.cross(direction));
            let straight = 0.5 * (length_mm - width_mm).max(0.0);
            let at = |k: u32| {
                let end = if turn(k).cos() >= 0.0 { straight } else { -straight };
                centre + u * (end + 0.5 * width_mm * turn(k).cos()) + v * (0.5 * width_mm * turn(k).sin())
            };
            (0..STEPS).map(at).collect()
        }
        Geometry::Surface { .. } | Geometry::Edge { .. } => Vec::new(),
    }
}

/// The corner of a view in which the axes stand.
pub fn axes_corner(at: Rect) -> Rect {
    Rect::from_min_max(pos2(at.left(), at.bottom() - 78.0), pos2(at.left() + 82.0, at.bottom()))
}

/// The directions of the CAD's axes, in a corner of a view.
pub fn axes(painter: &Painter, camera: &Camera, at: Rect, theme: &Theme) {
    let origin = pos2(at.left() + 40.0, at.bottom() - 36.0);
    let eye_from_cad = camera.cad_from_eye.inverse();
    let mut arms: Vec<(Vector3, &str, Color32)> = [
        (Vector3::x(), "x", Color32::from_rgb(0xB3, 0x3A, 0x2A)),
        (Vector3::y(), "y", Color32::from_rgb(0x2E, 0x8B, 0x57)),
        (Vector3::z(), "z", Color32::from_rgb(0x2F, 0x6D, 0xB5)),
    ]
    .map(|(axis, name, colour)| (eye_from_cad * axis, name, colour))
    .to_vec();
    arms.sort_by(|a, b| a.0.z.total_cmp(&b.0.z));
    for (arm, name, colour) in arms {
        let tip = vec2(arm.x as f32, -arm.y as f32);
        painter.line_segment([origin, origin + 24.0 * tip], Stroke::new(2.0, colour));
        painter.text(origin + 33.0 * tip, Align2::CENTER_CENTER, name, fonts::regular(size::NOTE), theme.text);
    }
}
