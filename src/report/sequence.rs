//! `sequence.csv`: one row a scan, rewritten after each of them.

use super::csv::{optional, parse, text_field};
use super::words::{Counts, worst_first};
use super::{ascii::number, atomic};
use crate::diagnostic::Diagnostic;
use crate::inspect::{InspectionResult, Outcome};
use crate::io::read_plain;
use std::collections::BTreeMap;
use std::path::Path;

/// The table's file name.
pub const FILE: &str = "sequence.csv";

/// Its columns.
pub const HEADER: &str = "scan,result,taken,status,verdict,side,points_kept,best_fit_rms_mm,margin,pass,fail,undecided,\
not_measured,worst_point,worst_deviation_mm,worst_tolerance_ratio,reason,scan_sha256,plan_sha256,cad_sha256";

/// The row of one scan, without its line feed; `name` is that of its result files, without their ending. Empty fields
/// where nothing was measured.
pub fn row(name: &str, result: &InspectionResult) -> String {
    let id = &result.identity;
    let mut fields = [&id.scan_file, name, id.scan_taken.as_deref().unwrap_or("")].map(text_field).to_vec();
    match &result.outcome {
        Outcome::Refused(refusal) => {
            fields.push("refused".to_owned());
            fields.extend(std::iter::repeat_n(String::new(), 12));
            fields.push(text_field(&refusal.reason));
        }
        Outcome::Measured(inspection) => {
            let fit = &inspection.best_fit;
            let counts = Counts::of(&inspection.points);
            let worst = worst_first(&inspection.points).first().map(|&i| &inspection.points[i]);
            let deviation = worst.and_then(|p| p.measurement.as_ref()).map(|m| m.deviation_mm);
            let reason = inspection.alignment.degraded.as_deref().or(worst.and_then(|p| p.reason.as_deref()));
            fields.extend([
                "measured".to_owned(),
                inspection.verdict.part_key().to_owned(),
                fit.side.map_or("", |side| side.key()).to_owned(),
                inspection.points_kept.to_string(),
                number(fit.rms_mm),
                optional(Some(fit.margin)),
            ]);
            fields.extend([counts.pass, counts.fail, counts.undecided, counts.not_measured].map(|n| n.to_string()));
            fields.extend([
                worst.map_or(String::new(), |p| text_field(&p.name)),
                optional(deviation),
                optional(worst.and_then(|p| p.tolerance_ratio())),
                text_field(reason.unwrap_or("")),
            ]);
        }
    }
    fields.push(id.scan_sha256.clone().unwrap_or_default());
    fields.extend([id.plan_sha256.clone(), id.cad_sha256.clone()]);
    fields.join(",")
}

/// A scan that has a row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Row {
    /// The scan's file name.
    pub scan: String,
    /// The name of its result files, without their ending; no two rows share it.
    pub result: String,
    /// Whether the scan was refused.
    pub refused: bool,
    /// The whole row as it stands in the file.
    text: String,
    /// Hashes of scan, plan and CAD; `None` when the scan's bytes could not be read.
    content: Option<String>,
}

impl Row {
    /// A row from its fields and its text; `None` when it has not the table's columns.
    fn try_new(fields: &[String], text: String) -> Option<Self> {
        let [scan, result, _, status, .., scan_sha256, plan_sha256, cad_sha256] = fields else { return None };
        let complete = fields.len() == HEADER.split(',').count();
        complete.then(|| Self {
            scan: scan.clone(),
            result: result.clone(),
            refused: status == "refused",
            text,
            content: (!scan_sha256.is_empty()).then(|| content_key(scan_sha256, plan_sha256, cad_sha256)),
        })
    }
}

impl Row {
    /// A row with fields that were written before, as they were: text by our quoting, numbers need none (and must not get
    /// one).
    fn from_file(fields: &[String]) -> Option<Self> {
        let text = fields.iter().map(|field| quoted(field)).collect::<Vec<_>>().join(",");
        Self::try_new(fields, text)
    }

    /// Whether both are of the same scan, plan and CAD by content.
    pub fn has_content_of(&self, other: &Row) -> bool {
        self.content.is_some() && self.content == other.content
    }

    /// Hash of the scan; `None` when its bytes could not be read.
    pub fn scan_sha256(&self) -> Option<&str> {
        self.content.as_ref()?.split(' ').next()
    }
}

fn content_key(scan_sha256: &str, plan_sha256: &str, cad_sha256: &str) -> String {
    format!("{scan_sha256} {plan_sha256} {cad_sha256}")
}

/// The table with a row for every scan inspected so far, in the order of their first inspection.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct SequenceTable {
    rows: Vec<Row>,
    by_result: BTreeMap<String, usize>,
    by_content: BTreeMap<String, usize>,
}

impl SequenceTable {
    /// Reads the table of a results folder, to go on with it; an empty one when there is none. A table with other
    /// columns is refused rather than lost.
    pub fn load(folder: &Path) -> Result<Self, Diagnostic> {
        let path = folder.join(FILE);
        let text = match read_plain(&path).and_then(|b| String::from_utf8(b).map_err(std::io::Error::other)) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Self::default()),
            Err(error) => return Err(Diagnostic::error(format!("cannot read: {error}")).in_file(&path)),
        };
        let records = parse(&text);
        let foreign = || {
            Diagnostic::error("has other columns than this program writes")
                .in_file(&path)
                .with_help("move the file away, or give another results folder")
        };
        let Some((header, records)) = records.split_first() else { return Ok(Self::default()) };
        if header.join(",") != HEADER {
            return Err(foreign());
        }
        let mut table = Self::default();
        for record in records {
            table.insert(Row::from_file(record).ok_or_else(foreign)?);
        }
        Ok(table)
    }

    /// Where the same bytes were inspected before, by the same plan and CAD.
    pub fn inspected_as(&self, scan_sha256: &str, plan_sha256: &str, cad_sha256: &str) -> Option<&Row> {
        let index = self.by_content.get(&content_key(scan_sha256, plan_sha256, cad_sha256))?;
        self.rows.get(*index)
    }

    /// Whether a scan of this name and content has a row, by whatever plan and CAD.
    pub fn has_inspected(&self, scan: &str, scan_sha256: &str) -> bool {
        let of_content = self.by_content.range(content_key(scan_sha256, "", "")..);
        let mut of_content = of_content.take_while(|(key, _)| key.split(' ').next() == Some(scan_sha256));
        of_content.any(|(_, row)| self.rows.get(*row).is_some_and(|row| row.scan == scan))
    }

    /// Whether a scan of this name has a row.
    pub fn has_scan(&self, scan: &str) -> bool {
        self.rows.iter().any(|row| row.scan == scan)
    }

    /// The row of the scan whose result files have this name.
    pub fn row_of(&self, result: &str) -> Option<&Row> {
        self.rows.get(*self.by_result.get(result)?)
    }

    /// The rows in their order.
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// Adds the row of a scan whose result files have this name, or replaces the row of the same name.
    pub fn put(&mut self, name: &str, result: &InspectionResult) {
        let text = row(name, result);
        let fields = parse(&text).into_iter().next().unwrap_or_default();
        // Our own row has the table's columns.
        if let Some(row) = Row::try_new(&fields, text) {
            self.insert(row);
        }
    }

    /// Gives the result files of a row another name; a row that had that name goes.
    pub fn rename(&mut self, name: &str, new_name: &str) {
        let mut rows = std::mem::take(self).rows;
        rows.retain(|row| row.result != new_name);
        for mut row in rows {
            if row.result == name {
                let mut fields = parse(&row.text).into_iter().next().unwrap_or_default();
                if let Some(field) = fields.get_mut(1) {
                    new_name.clone_into(field);
                }
                // Our own row has the table's columns.
                row = Row::from_file(&fields).unwrap_or(row);
            }
            self.insert(row);
        }
    }

    fn insert(&mut self, row: Row) {
        let content = row.content.clone();
        match self.by_result.get(&row.result) {
            Some(&index) => {
                let content_changed = self.rows[index].content != row.content;
                self.rows[index] = row;
                if content_changed {
                    let contents = self.rows.iter().enumerate();
                    self.by_content = contents.filter_map(|(k, row)| Some((row.content.clone()?, k))).collect();
                }
            }
            None => {
                self.by_result.insert(row.result.clone(), self.rows.len());
                if let Some(content) = content {
                    self.by_content.insert(content, self.rows.len());
                }
                self.rows.push(row);
            }
        }
    }

    /// The whole file.
    pub fn to_csv(&self) -> String {
        let mut text = format!("{HEADER}\n");
        for row in &self.rows {
            text.push_str(&row.text);
            text.push('\n');
        }
        text
    }

    /// Rewrites `sequence.csv` in the folder, whole or not at all.
    pub fn write(&self, folder: &Path) -> Result<(), Diagnostic> {
        atomic::write(&folder.join(FILE), self.to_csv().as_bytes())
    }
}

/// A field read from our own file, quoted as it was: formulas were disarmed when it was first written.
fn quoted(field: &str) -> String {
    if field.contains([',', '"', ';', '\'', '\n']) || field != field.trim() {
        format!("\"{}\"", field.replace('"', "\"\""))
    } else {
        field.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;

    fn named(mut result: InspectionResult, scan: &str) -> InspectionResult {
        result.identity.scan_file = scan.to_owned();
        result
    }

    #[test]
    fn golden_rows() {
        let golden = |result: &InspectionResult, fields: &str| {
            let row = row("0017", result);
            let id = &result.identity;
            let hashes = [id.scan_sha256.as_deref().unwrap_or(""), &id.plan_sha256, &id.cad_sha256].join(",");
            assert_eq!(row, format!("{fields},{hashes}"));
        };
        golden(
            &example::bracket(),
            "0017.ply,0017,,measured,fail,top,1313042,0.112000,4.200000,6,2,2,1,E03,-0.958000,1.368571,",
        );
        golden(
            &example::refused(),
            "0017.ply,0017,,refused,,,,,,,,,,,,,\"the scan is cut off after 1,204,331 of 2,000,000 points\"",
        );
        let degraded = row("0017", &example::degraded());
        assert!(
            degraded.contains("P01,,,\"datum S1 not measured: 9 points on the rim, 40 are needed\","),
            "{degraded}"
        );
    }

    #[test]
    fn a_loaded_table_goes_on_byte_for_byte() {
        let folder = tempfile::tempdir().unwrap();
        let mut table = SequenceTable::default();
        for scan in ["0001", "=cmd|x,\"0002\"", "it's; 3"] {
            table.put(scan, &named(example::bracket(), &format!("{scan}.ply")));
        }
        table.put("0004", &named(example::refused(), "0004.ply"));
        table.write(folder.path()).unwrap();
        let mut loaded = SequenceTable::load(folder.path()).unwrap();
        assert_eq!(loaded, table);
        assert_eq!(loaded.to_csv(), table.to_csv());

        // Inspected again: the row changes in its place, no scan gets two.
        loaded.put("=cmd|x,\"0002\"", &named(example::refused(), "=cmd|x,\"0002\".ply"));
        assert_eq!(loaded.rows().len(), 4);
        let text = loaded.to_csv();
        let second = text.lines().nth(2).unwrap();
        assert!(second.starts_with("\"'=cmd") && second.contains("refused"), "{second}");
    }

    #[test]
    fn scans_of_one_name_have_rows_of_their_own() {
        let mut table = SequenceTable::default();
        table.put("0017", &example::bracket());
        table.put("0017.ply", &example::refused());
        let rows: Vec<_> = table.rows().iter().map(|r| (r.scan.as_str(), r.result.as_str(), r.refused)).collect();
        assert_eq!(rows, [("0017.ply", "0017", false), ("0017.ply", "0017.ply", true)]);
    }

    #[test]
    fn a_content_is_known_until_its_row_tells_of_another() {
        let with_content = |content: &str| {
            let mut result = example::bracket();
            result.identity.scan_sha256 = Some(content.to_owned());
            result
        };
        let id = example::bracket().identity;
        let mut table = SequenceTable::default();
        table.put("1", &with_content("aa"));
        table.put("2", &with_content("bb"));
        let known = |table: &SequenceTable, content: &str, plan: &str| {
            table.inspected_as(content, plan, &id.cad_sha256).map(|row| row.result.clone())
        };
        assert_eq!(known(&table, "aa", &id.plan_sha256).as_deref(), Some("1"));
        assert_eq!(known(&table, "bb", &id.plan_sha256).as_deref(), Some("2"));
        assert_eq!(known(&table, "bb", "another plan"), None);
        table.put("1", &with_content("cc"));
        assert_eq!(known(&table, "aa", &id.plan_sha256), None);
        assert_eq!(known(&table, "cc", &id.plan_sha256).as_deref(), Some("1"));
        assert_eq!(known(&table, "bb", &id.plan_sha256).as_deref(), Some("2"));
    }

    #[test]
    fn a_foreign_table_is_not_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        assert!(SequenceTable::load(folder.path()).unwrap().rows().is_empty());
        std::fs::write(folder.path().join(FILE), "a,b\n1,2\n").unwrap();
        assert!(SequenceTable::load(folder.path()).unwrap_err().message.contains("other columns"));
    }
}
