//! Buttons, menus and fields of the views.

use super::ResultsView;
use super::views::{Content, Labels};
use crate::gui::action::Action;
use crate::gui::engineer::Edit;
use crate::gui::fonts;
use crate::gui::scene::content::Shown;
use crate::gui::scene::renderer::Layer;
use crate::gui::scope::Scope;
use crate::gui::text::Words;
use crate::gui::theme::size;
use crate::plan::document::{Document, FORM, FieldValue};
use crate::report::palette::Palette;
use egui::{Align, Button, Layout, Popup, Rect, RichText, Role, Stroke, Ui, WidgetInfo, pos2, vec2};

/// Words of the controls.
pub fn small(text: &str) -> RichText {
    RichText::new(text).size(size::TABLE)
}

/// What a button with words takes, with the gap behind it.
pub fn button_width(ui: &Ui, text: &str) -> f32 {
    crate::gui::widgets::words::width(ui, text, fonts::regular(size::TABLE)) + 16.0 + 6.0
}

/// The same of one that opens a menu.
pub fn menu_width(ui: &Ui, text: &str) -> f32 {
    button_width(ui, &format!("{text}{TRIANGLE}"))
}

/// Room for the triangle behind the words.
const TRIANGLE: &str = "      ";

/// A button that opens a menu: its words and a small triangle.
pub fn menu_button(ui: &mut Ui, text: &str) -> egui::Response {
    let button = ui.add(Button::new(small(&format!("{text}{TRIANGLE}"))));
    let at = pos2(button.rect.right() - 13.0, button.rect.center().y);
    let corners = [vec2(-4.0, -2.0), vec2(4.0, -2.0), vec2(0.0, 3.5)].map(|v| at + v);
    let colour = ui.style().visuals.text_color();
    ui.painter().add(egui::Shape::convex_polygon(corners.to_vec(), colour, Stroke::NONE));
    button.widget_info(|| WidgetInfo::labeled(Role::Button, true, text));
    button
}

/// The whole part.
pub fn fit_ui(ui: &mut Ui, view: &mut ResultsView, words: &Words) {
    let fit = ui.add(Button::new(small(&format!("{} F", words.text("results.fit_view")))));
    fit.widget_info(|| WidgetInfo::labeled(Role::Button, true, words.text("results.fit_view")));
    if fit.clicked() {
        view.fit = true;
    }
}

/// Which points have a flag, in words.
pub fn labels_words(labels: Labels, words: &Words) -> &str {
    words.text(match labels {
        Labels::Worst => "results.labels_worst",
        Labels::All => "results.labels_all",
        Labels::None => "results.labels_none",
    })
}

/// What the map view shows, in words.
pub fn layer_words(layer: Layer, words: &Words) -> &str {
    words.text(match layer {
        Layer::Cad => "results.layer_cad",
        Layer::Surface => "results.layer_surface",
        Layer::Cloud => "results.layer_cloud",
    })
}

/// Which points have a flag.
pub fn labels_ui(ui: &mut Ui, view: &mut ResultsView, words: &Words) {
    let of = |labels| labels_words(labels, words);
    let button = menu_button(ui, of(view.labels));
    button.widget_info(|| WidgetInfo::labeled(Role::Button, true, of(view.labels)));
    Popup::menu(&button).show(|ui| {
        for labels in [Labels::Worst, Labels::All, Labels::None] {
            if ui.add(Button::selectable(view.labels == labels, of(labels))).clicked() {
                view.labels = labels;
            }
        }
    });
}

/// What the map view shows, and which points.
pub fn layer_ui(ui: &mut Ui, alone: bool, content: &Content<'_>, view: &mut ResultsView, words: &Words) {
    let of = |layer| layer_words(layer, words);
    let now = view.layer(alone);
    let button = menu_button(ui, of(now));
    button.widget_info(|| WidgetInfo::labeled(Role::Button, true, of(now)));
    let close = egui::PopupCloseBehavior::CloseOnClickOutside;
    Popup::menu(&button).close_behavior(close).show(|ui| {
        for layer in [Layer::Cad, Layer::Surface, Layer::Cloud] {
            if (alone || layer != Layer::Cad) && ui.add(Button::selectable(now == layer, of(layer))).clicked() {
                view.layer = Some(layer);
            }
        }
        ui.separator();
        let keys = [
            (Shown::Flagged, "results.points_flagged"),
            (Shown::Belt, "results.points_belt"),
            (Shown::Colour, "results.points_colour"),
            (Shown::Stray, "results.points_stray"),
            (Shown::Other, "results.points_other"),
        ];
        ui.label(small(words.text("results.points_shown")));
        for (class, key) in keys {
            let count = content.map.map_or(0, |m| m.cloud.counts[class as usize]);
            let mut on = view.classes.has(class);
            let text = format!("{} ({})", words.text(key), words.thousands(count));
            if ui.add_enabled(count > 0, egui::Checkbox::new(&mut on, text)).changed() {
                view.classes = view.classes.with(class, on);
                view.layer = Some(Layer::Cloud);
            }
        }
    });
}

/// Measuring on or off.
pub fn measure_button_ui(ui: &mut Ui, view: &mut ResultsView, words: &Words) {
    let text = words.text("results.measure");
    let button = ui.add(Button::selectable(view.measuring, small(&format!("{text} M"))).frame_when_inactive(true));
    button.widget_info(|| WidgetInfo::selected(Role::Button, true, view.measuring, text));
    if button.clicked() {
        view.toggle_measuring();
    }
}

/// The picture of a view: copied or saved.
pub fn picture_ui(ui: &mut Ui, at: Rect, view: &mut ResultsView, words: &Words) {
    let button = menu_button(ui, words.text("results.picture"));
    Popup::menu(&button).show(|ui| picture_rows_ui(ui, at, view, words));
}

/// The rows of that menu.
pub fn picture_rows_ui(ui: &mut Ui, at: Rect, view: &mut ResultsView, words: &Words) {
    if ui.button(format!("{}  Ctrl+C", words.text("results.copy_picture"))).clicked() {
        view.picture.copy(ui.ctx(), at);
    }
    if ui.button(format!("{}  Ctrl+Shift+S", words.text("results.save_picture"))).clicked() {
        view.picture.save(ui.ctx(), at);
    }
}

/// Range, bands and palette of this view, in the line below it.
pub fn scale_ui(ui: &mut Ui, line: Rect, view: &mut ResultsView, scope: &mut Scope) {
    let rule = Stroke::new(1.0, scope.theme.stroke);
    ui.painter().hline(line.x_range(), line.top() + 0.5, rule);
    let place = line.shrink2(vec2(12.0, 4.0));
    let builder = egui::UiBuilder::new().max_rect(place).layout(Layout::left_to_right(Align::Center));
    ui.scope_builder(builder, |ui| scale_controls_ui(ui, view, scope));
}

/// The same one after the other, wherever they stand.
pub fn scale_controls_ui(ui: &mut Ui, view: &mut ResultsView, scope: &mut Scope) {
    let words = scope.words;
    ui.spacing_mut().item_spacing.x = 6.0;
    ui.spacing_mut().button_padding.x = 8.0;
    ui.label(small(words.text("results.range")).color(scope.theme.text));
    let id = egui::Id::unique("range of the map");
    let typed = |view: &ResultsView| words.number(view.scale.range_mm, 3);
    let mut text = ui.data_mut(|d| d.get_temp::<String>(id)).unwrap_or_else(|| typed(view));
    let field = egui::TextEdit::singleline(&mut text)
        .desired_width(60.0)
        .min_size(vec2(60.0, 26.0))
        .margin(egui::Margin::symmetric(5, 2))
        .align(egui::Align2::RIGHT_CENTER)
        .font(fonts::mono(size::TABLE));
    let field = ui.add(field);
    field.widget_info(|| WidgetInfo::labeled(Role::TextInput, true, words.text("results.range")));
    if field.has_focus() {
        match crate::gui::text::typed_number(&text).filter(|r| (1e-3..=1e3).contains(r)) {
            Some(range) => view.scale.range_mm = range,
            None if text.trim().is_empty() => {}
            None => no_range_ui(ui, &field, scope),
        }
        ui.data_mut(|d| d.insert_temp(id, text));
    } else {
        ui.data_mut(|d| d.remove_temp::<String>(id));
    }
    // What is typed holds for this view: where it is not the plan's, that is told, with the way back.
    let of_plan = view.range_of_plan().filter(|range| *range != view.scale.range_mm);
    if let Some(range_mm) = of_plan {
        let frame = Stroke::new(2.0, scope.theme.accent);
        ui.painter().rect_stroke(field.rect, 4, frame, egui::StrokeKind::Inside);
        if ui.add(Button::new(small(words.text("results.as_in_plan")))).clicked() {
            view.scale.range_mm = range_mm;
        }
        keep_ui(ui, view.scale.range_mm, scope);
    }
    bands_ui(ui, view, words);
    palette_ui(ui, view, words);
}

/// What is typed is no range of a map; that one stays as it was.
fn no_range_ui(ui: &Ui, field: &egui::Response, scope: &Scope) {
    ui.painter().rect_stroke(field.rect, 4, Stroke::new(2.0, scope.theme.fail), egui::StrokeKind::Inside);
    let area = egui::Area::new(field.id.with("no range")).order(egui::Order::Foreground);
    let text = scope.words.text("results.no_range");
    area.fixed_pos(field.rect.left_bottom() + vec2(0.0, 2.0)).constrain(true).show(ui.ctx(), |ui| {
        egui::Frame::popup(ui.style()).show(ui, |ui| {
            ui.set_max_width(280.0);
            ui.add(egui::Label::new(small(text).color(scope.theme.text)).wrap());
        });
    });
}

/// Puts the range into the plan that is edited, where it has another one.
fn keep_ui(ui: &mut Ui, range_mm: f64, scope: &mut Scope) {
    let facts = scope.facts;
    let editing = facts.editing.as_ref().filter(|_| scope.lock.is_open(scope.now));
    let Some(edit) = editing.and_then(|editing| to_keep(&editing.document, range_mm)) else { return };
    let text = scope.words.text("results.keep_in_plan");
    let room = crate::gui::widgets::words::width(ui, text, fonts::regular(size::TABLE)) + 20.0;
    if ui.available_width() > room && ui.add(Button::new(small(text))).clicked() {
        scope.ask(Action::Edit(edit));
    }
}

/// The edit that keeps a range; `None` where the plan has it already.
fn to_keep(document: &Document, range_mm: f64) -> Option<Edit> {
    let (table, key) = ("output", "map_range_mm");
    let by_default = || FORM.iter().find(|s| (s.table, s.key) == (table, key)).and_then(|s| s.left_out.value());
    let value = FieldValue::Number(range_mm);
    let now = document.setting(table, key).or_else(by_default);
    (now.as_ref() != Some(&value)).then(|| Edit::SetSetting(table.to_owned(), key.to_owned(), value))
}

fn bands_ui(ui: &mut Ui, view: &mut ResultsView, words: &Words) {
    let of = |bands: u8| if bands == 0 { words.text("results.bands_off").to_owned() } else { bands.to_string() };
    let text = format!("{} {}", words.text("results.bands"), of(view.scale.bands));
    let button = menu_button(ui, &text);
    button.widget_info(|| WidgetInfo::labeled(Role::Button, true, words.text("results.bands")));
    Popup::menu(&button).show(|ui| {
        for bands in [0, 4, 8, 16] {
            if ui.add(Button::selectable(view.scale.bands == bands, of(bands))).clicked() {
                view.scale.bands = bands;
            }
        }
    });
}

fn palette_ui(ui: &mut Ui, view: &mut ResultsView, words: &Words) {
    let of = |palette| match palette {
        Palette::BlueGreyOrange => words.text("results.palette_default"),
        Palette::Viridis => words.text("results.palette_viridis"),
        Palette::Rainbow => words.text("results.palette_rainbow"),
    };
    let button = menu_button(ui, words.text("results.colours"));
    button.widget_info(|| WidgetInfo::labeled(Role::Button, true, words.text("results.colours")));
    Popup::menu(&button).show(|ui| {
        for palette in [Palette::BlueGreyOrange, Palette::Viridis, Palette::Rainbow] {
            let hard = palette != Palette::BlueGreyOrange;
            let text = if hard {
                format!("{} ({})", of(palette), words.text("results.palette_hard"))
            } else {
                of(palette).to_owned()
            };
            if ui.add(Button::selectable(view.scale.palette == palette, text)).clicked() {
                view.scale.palette = palette;
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_is_kept_where_the_plan_has_another_one() {
        let of = |text: &str| Document::from_bytes(text.as_bytes(), std::path::Path::new("plan.toml")).unwrap();
        let kept = |text: &str, mm| match to_keep(&of(text), mm) {
            Some(Edit::SetSetting(table, key, FieldValue::Number(mm))) => Some((table, key, mm)),
            None => None,
            Some(other) => panic!("{other:?}"),
        };
        let wide = "[output]\nmap_range_mm = 0.5\n";
        assert_eq!(kept(wide, 0.5), None);
        assert_eq!(kept(wide, 0.75), Some(("output".to_owned(), "map_range_mm".to_owned(), 0.75)));
        // A plan that says nothing has a range, too.
        assert_eq!(kept("schema = 1\n", 1.0), None);
        assert!(kept("schema = 1\n", 2.0).is_some());
    }
}
