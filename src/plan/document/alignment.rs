//! How the part is held: datum features, locks, regions. Single keys of `[alignment]` are settings.

use super::rows::{rewrite, rows};
use super::shape::{is_same, set};
use super::tree::{put, section, take};
use super::{Document, EditError, FieldValue, Step, Verb};
use crate::geometry::{Point3, UnitVector3, Vector3};
use crate::plan::RegionShape;
use toml_edit::{DocumentMut, Item, TableLike};

const RPS: &[&str] = &["alignment", "rps"];
const REGION: &[&str] = &["alignment", "region"];

/// A row of `[[alignment.rps]]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Lock {
    /// Name of the feature.
    pub feature: String,
    /// Direction held at nominal, CAD frame.
    pub lock: UnitVector3,
}

/// A row of `[[alignment.region]]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Region {
    /// Its name; empty: none is written.
    pub name: String,
    /// Its middle, CAD frame, mm.
    pub centre: Point3,
    /// How far it reaches.
    pub shape: RegionShape,
    /// How much it counts.
    pub weight: f64,
}

impl Document {
    /// The rows of `[[alignment.rps]]`; what of a row cannot be read is as in a new one: no feature, along z.
    pub fn locks(&self) -> Vec<Lock> {
        let Ok(tree) = self.tree() else { return Vec::new() };
        let lock = |row: &dyn TableLike| Lock {
            feature: row.get("feature").and_then(Item::as_str).unwrap_or_default().to_owned(),
            lock: triple(row, "lock").and_then(|v| UnitVector3::try_new(v, 0.0)).unwrap_or(Vector3::z_axis()),
        };
        rows(tree, RPS).into_iter().map(lock).collect()
    }

    /// The rows of `[[alignment.region]]`; what of a row cannot be read is as in a new one: a ball of 10 mm around the origin.
    pub fn regions(&self) -> Vec<Region> {
        let Ok(tree) = self.tree() else { return Vec::new() };
        let number = |row: &dyn TableLike, key: &str| match row.get(key).map(FieldValue::of) {
            Some(FieldValue::Number(v)) => Some(v),
            _ => None,
        };
        let region = |row: &dyn TableLike| Region {
            name: row.get("name").and_then(Item::as_str).unwrap_or_default().to_owned(),
            centre: triple(row, "centre").map_or(Point3::origin(), Point3::from),
            shape: match triple(row, "size_mm") {
                Some(size_mm) => RegionShape::Box { size_mm },
                None => RegionShape::Ball { radius_mm: number(row, "radius_mm").unwrap_or(10.0) },
            },
            weight: number(row, "weight").unwrap_or(1.0),
        };
        rows(tree, REGION).into_iter().map(region).collect()
    }

    /// Holds the part by a hole, a slot and a surface point, by name. Keys of other methods are left out.
    ///
    /// # Errors
    /// A text that is no TOML.
    pub fn hold_by_features(&mut self, hole: &str, slot: &str, point: &str) -> Result<(), EditError> {
        self.edit(Step::new(Verb::Change, "alignment method"), |tree| {
            let table = method(tree, "features")?;
            for key in ["rps", "region", "freeze"] {
                take(table, key);
            }
            for (key, name) in [("hole", hole), ("slot", slot), ("point", point)] {
                set(table, key, &FieldValue::Text(name.to_owned()))?;
            }
            Ok(())
        })
    }

    /// Holds the part by locked directions of features.
    ///
    /// # Errors
    /// A text that is no TOML.
    pub fn hold_by_locks(&mut self, locks: &[Lock]) -> Result<(), EditError> {
        self.edit(Step::new(Verb::Change, "locks"), |tree| {
            let table = method(tree, "rps")?;
            for key in ["hole", "slot", "slot_reading", "point", "region", "freeze"] {
                take(table, key);
            }
            rewrite(tree, RPS, locks.len(), |k, row| {
                put_other(row, "feature", &FieldValue::Text(locks[k].feature.clone()), false)?;
                put_other(row, "lock", &FieldValue::Numbers(locks[k].lock.iter().copied().collect()), true)
            })
        })
    }

    /// Holds the part by a best fit to regions, or with none by the best fit to all of it.
    ///
    /// # Errors
    /// A text that is no TOML.
    pub fn hold_by_regions(&mut self, regions: &[Region]) -> Result<(), EditError> {
        self.edit(Step::new(Verb::Change, "regions"), |tree| {
            let table = method(tree, "best_fit")?;
            for key in ["hole", "slot", "slot_reading", "point", "rps"] {
                take(table, key);
            }
            rewrite(tree, REGION, regions.len(), |k, row| write_region(row, &regions[k]))
        })
    }
}

fn method<'t>(tree: &'t mut DocumentMut, word: &str) -> Result<&'t mut dyn TableLike, EditError> {
    let table = section(tree, "alignment")?;
    set(table, "method", &FieldValue::Text(word.to_owned()))?;
    Ok(table)
}

fn write_region(row: &mut dyn TableLike, region: &Region) -> Result<(), EditError> {
    if region.name.is_empty() {
        take(row, "name");
    } else {
        put_other(row, "name", &FieldValue::Text(region.name.clone()), false)?;
    }
    put_other(row, "centre", &FieldValue::Numbers(region.centre.iter().copied().collect()), false)?;
    let (key, other, value) = match region.shape {
        RegionShape::Ball { radius_mm } => ("radius_mm", "size_mm", FieldValue::Number(radius_mm)),
        RegionShape::Box { size_mm } => {
            ("size_mm", "radius_mm", FieldValue::Numbers(size_mm.iter().copied().collect()))
        }
    };
    take(row, other);
    put_other(row, key, &value, false)?;
    if region.weight != 1.0 || row.contains_key("weight") {
        put_other(row, "weight", &FieldValue::Number(region.weight), false)?;
    }
    Ok(())
}

fn triple(row: &dyn TableLike, key: &str) -> Option<Vector3> {
    match row.get(key).map(FieldValue::of) {
        Some(FieldValue::Numbers(v)) => <[f64; 3]>::try_from(v).ok().map(Vector3::from),
        _ => None,
    }
}

/// Puts a value where it is another.
fn put_other(row: &mut dyn TableLike, key: &str, value: &FieldValue, direction: bool) -> Result<(), EditError> {
    if !row.get(key).is_some_and(|old| is_same(&FieldValue::of(old), value, direction)) {
        put(row, key, value.to_toml(false)?);
    }
    Ok(())
}

/// Lets the alignment follow a feature to its new name.
pub(super) fn follow(tree: &mut DocumentMut, old: &str, new: &str) -> Result<(), EditError> {
    let is_old = |item: Option<&Item>| item.and_then(Item::as_str) == Some(old);
    let locks = rows(tree, RPS).len();
    for k in 0..locks {
        if let Some(row) = super::rows::row_mut(tree, RPS, k)
            && is_old(row.get("feature"))
        {
            put(row, "feature", new.into());
        }
    }
    if let Some(table) = tree.get_mut("alignment").and_then(Item::as_table_like_mut) {
        for key in ["hole", "slot", "point"] {
            if is_old(table.get(key)) {
                put(table, key, new.into());
            }
        }
    }
    Ok(())
}
