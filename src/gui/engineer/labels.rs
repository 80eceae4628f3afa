//! What people call the settings and keys of a plan.

use crate::gui::text::Words;
use crate::plan::document::List;

/// The text of a setting's name.
pub fn setting(words: &Words, table: &str, key: &str) -> String {
    let text = match (table, key) {
        ("part", "name") => "setting.part_name",
        ("part", "number") => "setting.part_number",
        ("part", "revision") => "setting.revision",
        ("part", "thickness_mm") => "setting.thickness",
        ("part", "decision") => "setting.decision",
        ("part", "cad_side") => "setting.cad_side",
        ("cad", "file") => "setting.cad_file",
        ("cad" | "scans", "unit") => "setting.unit",
        ("scans", "folder") => "setting.scan_folder",
        ("scans", "pattern") => "setting.pattern",
        ("scans", "order") => "setting.order",
        ("scans", "taken") => "setting.taken",
        ("scans", "view_direction") => "setting.view_direction",
        ("background", "belt_plane") => "setting.belt_plane",
        ("background", "belt_clearance_mm") => "setting.belt_clearance",
        ("background", "belt_colours") => "setting.belt_colours",
        ("background", "colour_tolerance") => "setting.colour_tolerance",
        ("background", "luminance_min") => "setting.luminance",
        ("alignment", "method") => "setting.method",
        ("alignment", "hole") => "setting.datum_hole",
        ("alignment", "slot") => "setting.datum_slot",
        ("alignment", "slot_reading") => "setting.slot_reading",
        ("alignment", "point") => "setting.datum_point",
        ("alignment", "freeze") => "setting.freeze",
        ("rig", "distance_mm") => "setting.distance",
        ("rig", "base_mm") => "setting.base",
        ("rig", "focal_mm") => "setting.focal",
        ("rig", "pixel_um") => "setting.pixel",
        ("rig", "image_accuracy_px") => "setting.image_accuracy",
        ("rig", "resolution_level") => "setting.resolution_level",
        ("uncertainty", "scale_ppm") => "setting.u_scale",
        ("uncertainty", "thickness_mm") => "setting.u_thickness",
        ("uncertainty", "system_mm") => "setting.u_system",
        ("uncertainty", "edge_offset_mm") => "setting.edge_offset",
        ("uncertainty", "edge_offset_u_mm") => "setting.u_edge_offset",
        ("output", "folder") => "setting.results_folder",
        ("output", "formats") => "setting.formats",
        ("output", "map_range_mm") => "setting.map_range",
        _ => return key.to_owned(),
    };
    words.text(text).to_owned()
}

/// The text of a row's key.
pub fn row_key(words: &Words, key: &str) -> String {
    let text = match key {
        "name" => "setting.name",
        "kind" => "setting.kind",
        "position" => "setting.position",
        "centre" => "setting.centre",
        "axis" => "setting.axis",
        "direction" => "setting.direction",
        "normal" => "setting.normal",
        "diameter_mm" => "setting.diameter",
        "length_mm" => "setting.length",
        "width_mm" => "setting.width",
        "method" => "setting.fit_method",
        "radius_mm" => "setting.radius",
        "lower_mm" => "setting.lower",
        "upper_mm" => "setting.upper",
        _ => return key.to_owned(),
    };
    words.text(text).to_owned()
}

/// The text of a word that a setting may hold; the word itself where it is the same in every language.
pub fn choice<'a>(words: &'a Words, word: &'a str) -> &'a str {
    match word {
        "iso14253" => words.text("choice.iso14253"),
        "plain" => words.text("choice.plain"),
        "top" => words.text("choice.top"),
        "bottom" => words.text("choice.bottom"),
        "middle" => words.text("choice.middle"),
        "solid" => words.text("choice.solid"),
        "name" => words.text("choice.by_name"),
        "modified" => words.text("choice.by_time"),
        "features" => words.text("choice.features"),
        "rps" => words.text("choice.rps"),
        "best_fit" => words.text("choice.best_fit"),
        "centre_line" => words.text("choice.centre_line"),
        "axis" => words.text("choice.axis"),
        "local" => words.text("choice.local"),
        "plane" => words.text("choice.plane"),
        "surface" => words.text("engineer.kind_surface"),
        "edge" => words.text("engineer.kind_edge"),
        "hole" => words.text("engineer.kind_hole"),
        "slot" => words.text("engineer.kind_slot"),
        other => other,
    }
}

/// One of a list, with its kind: `Trimmed edge point`.
pub fn row_of_kind<'a>(words: &'a Words, list: List, kind: &str) -> &'a str {
    words.text(match (list, kind) {
        (List::Feature, "hole") => "engineer.feature_hole",
        (List::Feature, "slot") => "engineer.feature_slot",
        (List::Feature, "edge") => "engineer.feature_edge",
        (List::Feature, _) => "engineer.feature_surface",
        (List::Comparison, "edge") => "engineer.point_edge",
        (List::Comparison, "hole") => "engineer.point_hole",
        (List::Comparison, _) => "engineer.point_surface",
    })
}
