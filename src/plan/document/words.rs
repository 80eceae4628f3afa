//! The keys of a plan in the words of the trade.

/// What people call a key of a table, with its unit: `sheet thickness`, `mm`.
pub(super) fn key(table: &str, key: &str) -> (&'static str, &'static str) {
    match (table, key) {
        ("part", "name") => ("part name", ""),
        ("part", "number") => ("part number", ""),
        ("part", "revision") => ("revision", ""),
        ("part", "thickness_mm") => ("sheet thickness", "mm"),
        ("part", "decision") => ("decision rule", ""),
        ("part", "cad_side") => ("side of the CAD", ""),
        ("cad", "file") => ("CAD file", ""),
        ("cad", "unit") => ("unit of the CAD", ""),
        ("scans", "folder") => ("scan folder", ""),
        ("scans", "pattern") => ("pattern of the scans", ""),
        ("scans", "unit") => ("unit of the scans", ""),
        ("scans", "order") => ("order of the scans", ""),
        ("scans", "taken") => ("date of the scans", ""),
        ("scans", "view_direction") => ("view direction", ""),
        ("scans", "views") => ("views", ""),
        ("background", "belt_plane") => ("belt plane", ""),
        ("background", "belt_clearance_mm") => ("belt clearance", "mm"),
        ("background", "belt_colours") => ("belt colours", ""),
        ("background", "colour_tolerance") => ("colour tolerance", ""),
        ("background", "luminance_min") => ("least luminance", ""),
        ("alignment", "method") => ("alignment method", ""),
        ("alignment", "hole") => ("datum hole", ""),
        ("alignment", "slot") => ("datum slot", ""),
        ("alignment", "slot_reading") => ("reading of the slot", ""),
        ("alignment", "point") => ("datum point", ""),
        ("alignment", "freeze") => ("frozen freedoms", ""),
        ("alignment", "rps") => ("locks", ""),
        ("alignment", "region") => ("regions", ""),
        ("rig", "distance_mm") => ("distance of the cameras", "mm"),
        ("rig", "base_mm") => ("base of the cameras", "mm"),
        ("rig", "focal_mm") => ("focal length", "mm"),
        ("rig", "pixel_um") => ("pixel size", "um"),
        ("rig", "image_accuracy_px") => ("image accuracy", "pixels"),
        ("rig", "resolution_level") => ("resolution level", ""),
        ("rig", "point_spacing_mm") => ("spacing of the points", "mm"),
        ("uncertainty", "scale_ppm") => ("uncertainty of the scale", "ppm"),
        ("uncertainty", "thickness_mm") => ("uncertainty of the thickness", "mm"),
        ("uncertainty", "system_mm") => ("uncertainty of the system", "mm"),
        ("uncertainty", "edge_offset_mm") => ("edge offset", "mm"),
        ("uncertainty", "edge_offset_u_mm") => ("uncertainty of the edge offset", "mm"),
        ("output", "folder") => ("results folder", ""),
        ("output", "formats") => ("report formats", ""),
        ("output", "map_range_mm") => ("range of the colour scale", "mm"),
        ("comparison_file", "file") => ("comparison file", ""),
        (_, other) => row_key(other),
    }
}

/// The same for a key of a feature or point.
pub(super) fn row_key(key: &str) -> (&'static str, &'static str) {
    match key {
        "name" => ("name", ""),
        "kind" => ("kind", ""),
        "centre" => ("centre", ""),
        "position" => ("position", ""),
        "axis" => ("axis", ""),
        "direction" => ("direction", ""),
        "normal" => ("normal", ""),
        "diameter_mm" => ("diameter", "mm"),
        "length_mm" => ("length", "mm"),
        "width_mm" => ("width", "mm"),
        "method" => ("method", ""),
        "radius_mm" => ("radius", "mm"),
        "lower_mm" => ("lower tolerance", "mm"),
        "upper_mm" => ("upper tolerance", "mm"),
        "lock" => ("locked direction", ""),
        "size_mm" => ("size", "mm"),
        "weight" => ("weight", ""),
        "schema" => ("schema", ""),
        _ => ("another key", ""),
    }
}

/// A setting as a step names it.
pub(super) fn setting(table: &str, name: &str) -> &'static str {
    key(table, name).0
}
