//! One change taken back by itself, whatever was edited after it.

use super::fields::infos;
use super::rows::{new_row, push, rows, shift};
use super::{Change, ChangedAt, Document, EditError, FieldValue, Step, Verb, tree};

impl Document {
    /// Takes one change since the plan was saved back, as an edit of its own: what is as it was saved again, the rest stays.
    ///
    /// # Errors
    /// A row that is no longer there, a name that is taken meanwhile, a text that is no TOML. A change that cannot be taken back by itself
    /// leaves everything as it is.
    pub fn take_back(&mut self, change: &Change) -> Result<(), EditError> {
        let saved = tree::parse(self.saved_text())?;
        match &change.at {
            ChangedAt::Setting(table, key) => {
                let old = saved.get(table).and_then(|t| t.as_table_like()?.get(key)).map(FieldValue::of);
                match old {
                    Some(old) => self.set_setting(table, key, &old),
                    None => self.remove_setting(table, key),
                }
            }
            ChangedAt::Key(list, name, key) => {
                let row = self.row_named(*list, name)?;
                // A row that has another name now had this one's values under its old name.
                let renamed = self.changes().into_iter().find_map(|c| match c.at {
                    ChangedAt::Renamed(of, old, new) if of == *list && new == *name => Some(old),
                    _ => None,
                });
                let old_name = renamed.as_deref().unwrap_or(name);
                let old = infos(&saved, *list).into_iter().find(|row| row.name == old_name);
                match old.as_ref().and_then(|row| row.value(key)) {
                    Some(old) => self.set_value(*list, row, key, old),
                    None => self.remove_value(*list, row, key),
                }
            }
            ChangedAt::Added(list, name) => {
                let row = self.row_named(*list, name)?;
                self.remove(*list, &[row])
            }
            ChangedAt::Renamed(list, old, new) => {
                let row = self.row_named(*list, new)?;
                self.rename(*list, row, old)
            }
            ChangedAt::Removed(list, name, at) => {
                if self.row_named(*list, name).is_ok() {
                    return Err(EditError::NameTaken(name.clone()));
                }
                self.points_here(*list)?;
                let last = self.rows(*list).len();
                self.edit(Step::new(Verb::Add, name.as_str()), |tree| {
                    let mut row = new_row(tree, list.path());
                    if let Some(old) = rows(&saved, list.path()).get(*at) {
                        old.iter().for_each(|(key, item)| drop(row.insert(key, item.clone())));
                    }
                    push(tree, list.path(), row)?;
                    shift(tree, list.path(), last, (*at).min(last));
                    Ok(())
                })
            }
            ChangedAt::Other => Ok(()),
        }
    }

    fn row_named(&self, list: super::List, name: &str) -> Result<usize, EditError> {
        let rows = self.rows(list);
        let missing = EditError::NoSuchRow { what: list.word(), number: rows.len() + 1 };
        rows.iter().position(|row| row.name == name).ok_or(missing)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::document::tests::{FULL, open};
    use crate::plan::document::{List, PointSpec};

    /// Every kind of change, each taken back alone and in any order: what is left is the plan as it was saved.
    #[test]
    fn each_change_is_taken_back_by_itself() {
        let mut document = open(FULL);
        document.set_setting("part", "thickness_mm", &FieldValue::Number(1.7)).unwrap();
        document.set_setting("part", "number", &FieldValue::Text("9".into())).unwrap();
        document.set_tolerances(&[1], None, Some(0.9)).unwrap();
        let spec = PointSpec::from(&document.read().draft.comparison[0]);
        document.add(List::Comparison, &[PointSpec { name: "New".into(), ..spec }]).unwrap();
        document.rename(List::Comparison, 0, "Rib").unwrap();
        document.remove(List::Comparison, &[2]).unwrap();
        let all = document.changes();
        assert!(all.iter().all(Change::can_be_taken_back) && all.len() == 6, "{all:?}");
        for first in &all {
            let mut copy = document.clone();
            copy.take_back(first).unwrap();
            let left = copy.changes();
            assert_eq!(left.len(), 5, "{first:?}: {left:?}");
            for change in left {
                copy.take_back(&change).unwrap();
            }
            // A row that was removed comes back without the comments around it.
            let left: Vec<String> = copy.changes().iter().map(ToString::to_string).collect();
            assert!(left.is_empty() || left == ["plan: comments or layout"], "{left:?}");
            assert_eq!(copy.read().draft.comparison.len(), document.read().draft.comparison.len());
        }
        let gone = all.iter().find(|c| matches!(c.at, ChangedAt::Added(..))).unwrap();
        document.take_back(gone).unwrap();
        assert!(document.take_back(gone).is_err());
    }
}
