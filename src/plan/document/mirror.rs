//! The plan of the other hand: everything in the CAD frame mirrored in a plane across one of its axes.

use super::rows::{row_mut, rows};
use super::tree::put;
use super::{Document, EditError, FieldValue, List, Step, Verb};
use toml_edit::{DocumentMut, Item, TableLike};

/// An axis of the CAD frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// x.
    X,
    /// y.
    Y,
    /// z.
    Z,
}

/// A plane across an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MirrorPlane {
    /// The axis that it is perpendicular to.
    pub across: Axis,
    /// Where it crosses that axis, mm.
    pub at_mm: f64,
}

/// What becomes of the names.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum MirrorNames {
    /// They are the same.
    Keep,
    /// One ending becomes the other, and the other way round: `_L` and `_R`. Names with neither stay.
    Swap {
        /// An ending.
        one: String,
        /// The other.
        other: String,
    },
}

/// Keys that hold a place, and keys that hold a direction.
const PLACES: [&str; 2] = ["position", "centre"];
const DIRECTIONS: [&str; 4] = ["direction", "axis", "normal", "lock"];

impl MirrorPlane {
    fn component(self) -> usize {
        self.across as usize
    }

    /// The mirrored triple; whole numbers and short decimals stay what they look like.
    fn mirrored(self, written: &FieldValue, is_place: bool) -> Option<FieldValue> {
        let FieldValue::Numbers(v) = written else { return None };
        let mut v = v.clone();
        let component = v.get_mut(self.component())?;
        let about = if is_place { 2.0 * self.at_mm } else { 0.0 };
        let exact = about - *component;
        *component = if about == 0.0 || exact.abs() >= 1e6 { exact } else { (exact * 1e9).round() / 1e9 } + 0.0;
        Some(FieldValue::Numbers(v))
    }
}

impl MirrorNames {
    fn of(&self, name: &str) -> String {
        let MirrorNames::Swap { one, other } = self else { return name.to_owned() };
        let swapped = |from: &str, to: &str| {
            let stem = name.strip_suffix(from).filter(|_| !from.is_empty());
            stem.map(|stem| format!("{stem}{to}"))
        };
        swapped(one, other).or_else(|| swapped(other, one)).unwrap_or_else(|| name.to_owned())
    }
}

impl Document {
    /// Mirrors features, comparison points, locks and regions in a plane, and renames them by a rule. The CAD, the part's name and number
    /// and what is told in the scan frame are left to their own edits. Numbers keep their decimals.
    ///
    /// # Errors
    /// Points in a file of their own, two features that would have one name, a plane that is nowhere, a text that is no TOML.
    pub fn mirror(&mut self, plane: MirrorPlane, names: &MirrorNames) -> Result<(), EditError> {
        self.points_here(List::Comparison)?;
        if !plane.at_mm.is_finite() {
            return Err(EditError::NotFinite(plane.at_mm));
        }
        for list in [List::Feature, List::Comparison] {
            let mut new: Vec<String> = self.rows(list).iter().map(|row| names.of(&row.name)).collect();
            let old = self.rows(list).iter().map(|row| row.name.clone()).collect::<std::collections::BTreeSet<_>>();
            new.sort();
            if let Some(pair) = new.windows(2).find(|pair| pair[0] == pair[1] && !pair[0].is_empty())
                && old.len() == new.len()
            {
                return Err(EditError::NameTaken(pair[0].clone()));
            }
        }
        let axis = ["x", "y", "z"][plane.component()];
        let what = format!("the plan in {axis} = {}", crate::plan::values::short(plane.at_mm));
        self.edit(Step::new(Verb::Mirror, what), |tree| mirror(tree, plane, names))
    }
}

fn mirror(tree: &mut DocumentMut, plane: MirrorPlane, names: &MirrorNames) -> Result<(), EditError> {
    let lists: [&[&str]; 4] = [&["feature"], &["comparison"], &["alignment", "rps"], &["alignment", "region"]];
    for path in lists {
        for k in 0..rows(tree, path).len() {
            if let Some(row) = row_mut(tree, path, k) {
                mirror_row(row, plane)?;
                rename(row, &["name", "feature"], names);
            }
        }
    }
    if let Some(table) = tree.get_mut("alignment").and_then(Item::as_table_like_mut) {
        rename(table, &["hole", "slot", "point"], names);
    }
    Ok(())
}

fn mirror_row(row: &mut dyn TableLike, plane: MirrorPlane) -> Result<(), EditError> {
    for key in PLACES.into_iter().chain(DIRECTIONS) {
        let Some(item) = row.get(key) else { continue };
        if let Some(value) = plane.mirrored(&FieldValue::of(item), PLACES.contains(&key)) {
            put(row, key, value.to_toml(false)?);
        }
    }
    Ok(())
}

fn rename(table: &mut dyn TableLike, keys: &[&str], names: &MirrorNames) {
    for key in keys {
        let Some(old) = table.get(key).and_then(Item::as_str).map(str::to_owned) else { continue };
        let new = names.of(&old);
        if new != old {
            put(table, key, new.into());
        }
    }
}
