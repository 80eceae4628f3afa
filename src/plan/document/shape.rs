//! A nominal shape as the keys of a row, and back.

use super::tree::{put, take};
use super::{EditError, FieldValue, List, PointSpec, RowInfo};
use crate::geometry::{Point3, UnitVector3, Vector3};
use crate::plan::{Geometry, SurfaceFit, SurfaceMethod};
use toml_edit::{Item, TableLike};

/// Coordinates and directions are written to nine decimals: what computing adds behind them is noise.
const DECIMALS: f64 = 1e9;
/// Directions that differ by less, rad, are the same: half a unit of the ninth decimal in each of three components, twice.
const SAME_DIRECTION: f64 = 2e-9;

/// Keys that tell a shape; those that a kind does not have are taken out.
const SHAPE_KEYS: [&str; 8] =
    ["centre", "position", "axis", "direction", "normal", "diameter_mm", "length_mm", "width_mm"];

/// The keys of a shape with their values, in the order in which they are written.
pub(super) fn values(geometry: &Geometry, list: List) -> Vec<(&'static str, FieldValue)> {
    let at = |p: &Point3| FieldValue::Numbers(p.iter().map(|v| plain(*v)).collect());
    let along = |d: &UnitVector3| FieldValue::Numbers(d.iter().map(|v| plain(*v)).collect());
    let place = if list == List::Feature { "centre" } else { "position" };
    match geometry {
        Geometry::Surface { position, direction } => {
            vec![("position", at(position)), ("direction", along(direction))]
        }
        Geometry::Edge { position, direction, normal } => {
            vec![("position", at(position)), ("direction", along(direction)), ("normal", along(normal))]
        }
        Geometry::Hole { centre, axis, diameter_mm, direction } => {
            let mut values = vec![(place, at(centre)), ("axis", along(axis))];
            values.extend(direction.iter().map(|d| ("direction", along(d))));
            values.push(("diameter_mm", FieldValue::Number(plain(*diameter_mm))));
            values
        }
        Geometry::Slot { centre, axis, direction, length_mm, width_mm } => vec![
            (place, at(centre)),
            ("axis", along(axis)),
            ("direction", along(direction)),
            ("length_mm", FieldValue::Number(plain(*length_mm))),
            ("width_mm", FieldValue::Number(plain(*width_mm))),
        ],
    }
}

/// The shape that a row tells, as far as it is whole: for showing it while other keys of the row are at fault.
pub(super) fn read(row: &RowInfo, list: List) -> Option<Geometry> {
    let triple = |key: &str| match row.value(key)? {
        FieldValue::Numbers(v) => <[f64; 3]>::try_from(v.as_slice()).ok().filter(|v| v.iter().all(|c| c.is_finite())),
        _ => None,
    };
    let at = |key: &str| triple(key).map(Point3::from);
    let along = |key: &str| UnitVector3::try_new(Vector3::from(triple(key)?), 1e-9);
    let length = |key: &str| match row.value(key)? {
        FieldValue::Number(v) => Some(*v).filter(|v| v.is_finite() && *v > 0.0),
        _ => None,
    };
    let centre = || at(if list == List::Feature { "centre" } else { "position" });
    Some(match row.kind.as_str() {
        "surface" => Geometry::Surface { position: at("position")?, direction: along("direction")? },
        "edge" => {
            Geometry::Edge { position: at("position")?, direction: along("direction")?, normal: along("normal")? }
        }
        "hole" => Geometry::Hole {
            centre: centre()?,
            axis: along("axis")?,
            diameter_mm: length("diameter_mm")?,
            direction: along("direction"),
        },
        "slot" => Geometry::Slot {
            centre: centre()?,
            axis: along("axis")?,
            direction: along("direction")?,
            length_mm: length("length_mm")?,
            width_mm: length("width_mm")?,
        },
        _ => return None,
    })
}

/// Gives one key of a shape another value; `None` where it cannot hold that.
pub(super) fn set_key(geometry: &mut Geometry, key: &str, value: Option<&FieldValue>) -> Option<()> {
    let triple = || match value {
        Some(FieldValue::Numbers(v)) => <[f64; 3]>::try_from(v.as_slice()).ok().map(Vector3::from),
        _ => None,
    };
    let place_of = || triple().map(Point3::from);
    let along = || triple().and_then(|v| UnitVector3::try_new(v, 1e-9));
    let number = || match value {
        Some(FieldValue::Number(v)) => Some(*v),
        _ => None,
    };
    match (geometry, key) {
        (Geometry::Surface { position, .. } | Geometry::Edge { position, .. }, "position") => *position = place_of()?,
        (Geometry::Hole { centre, .. } | Geometry::Slot { centre, .. }, "position" | "centre") => *centre = place_of()?,
        (
            Geometry::Surface { direction, .. } | Geometry::Edge { direction, .. } | Geometry::Slot { direction, .. },
            "direction",
        ) => *direction = along()?,
        (Geometry::Hole { direction, .. }, "direction") => {
            *direction = value.map(|_| along()).map_or(Some(None), |d| d.map(Some))?
        }
        (Geometry::Edge { normal, .. }, "normal") => *normal = along()?,
        (Geometry::Hole { axis, .. } | Geometry::Slot { axis, .. }, "axis") => *axis = along()?,
        (Geometry::Hole { diameter_mm, .. }, "diameter_mm") => *diameter_mm = number()?,
        (Geometry::Slot { length_mm, .. }, "length_mm") => *length_mm = number()?,
        (Geometry::Slot { width_mm, .. }, "width_mm") => *width_mm = number()?,
        _ => return None,
    }
    Some(())
}

fn plain(v: f64) -> f64 {
    if v.abs() < 1e6 { (v * DECIMALS).round() / DECIMALS + 0.0 } else { v }
}

/// Puts a shape into a row: keys whose value is the same already stay as they are written.
pub(super) fn write(row: &mut dyn TableLike, geometry: &Geometry, list: List) -> Result<(), EditError> {
    if list == List::Comparison && matches!(geometry, Geometry::Slot { .. }) {
        return Err(EditError::SlotCompared);
    }
    let values = values(geometry, list);
    for key in SHAPE_KEYS.iter().filter(|key| !values.iter().any(|(k, _)| k == *key)) {
        take(row, key);
    }
    let kind = FieldValue::Text(geometry.kind().to_owned());
    for (key, value) in std::iter::once(("kind", kind)).chain(values) {
        let is_direction = ["axis", "direction", "normal"].contains(&key);
        if !row.get(key).is_some_and(|old| is_same(&FieldValue::of(old), &value, is_direction)) {
            put(row, key, value.to_toml(false)?);
        }
    }
    Ok(())
}

/// Whether a value says the same as another; directions count with length one.
pub(super) fn is_same(a: &FieldValue, b: &FieldValue, direction: bool) -> bool {
    match (a, b) {
        (FieldValue::Numbers(a), FieldValue::Numbers(b)) if direction => {
            let unit =
                |v: &[f64]| (v.len() == 3).then(|| Vector3::new(v[0], v[1], v[2])).and_then(|v| v.try_normalize(0.0));
            unit(a).zip(unit(b)).is_some_and(|(a, b)| (a - b).norm() < SAME_DIRECTION)
        }
        _ => a == b,
    }
}

/// Puts a whole point into a row.
pub(super) fn write_point(row: &mut dyn TableLike, point: &PointSpec, list: List) -> Result<(), EditError> {
    set(row, "name", &FieldValue::Text(point.name.clone()))?;
    write(row, &point.geometry, list)?;
    if list == List::Feature {
        return Ok(());
    }
    write_fit(row, &point.surface_fit, matches!(point.geometry, Geometry::Surface { .. }))?;
    set(row, "lower_mm", &FieldValue::Number(point.lower_mm))?;
    set(row, "upper_mm", &FieldValue::Number(point.upper_mm))
}

fn write_fit(row: &mut dyn TableLike, fit: &SurfaceFit, is_surface: bool) -> Result<(), EditError> {
    match fit.method {
        SurfaceMethod::Plane if is_surface => set(row, "method", &FieldValue::Text("plane".to_owned()))?,
        SurfaceMethod::Local if is_surface && row.get("method").and_then(Item::as_str) == Some("local") => {}
        _ => drop(take(row, "method")),
    }
    match fit.radius_mm.filter(|_| is_surface) {
        Some(radius_mm) => set(row, "radius_mm", &FieldValue::Number(radius_mm)),
        None => {
            take(row, "radius_mm");
            Ok(())
        }
    }
}

/// Puts a value where it is another.
pub(super) fn set(row: &mut dyn TableLike, key: &str, value: &FieldValue) -> Result<(), EditError> {
    if row.get(key).is_some_and(|old| FieldValue::of(old) == *value) {
        return Ok(());
    }
    let whole = row.get(key).is_some_and(Item::is_integer);
    put(row, key, value.to_toml(whole)?);
    Ok(())
}
