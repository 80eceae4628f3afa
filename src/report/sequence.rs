//! `sequence.csv`: one row a scan, rewritten after each of them.

use super::csv::{optional, parse, text_field};
use super::words::{Counts, clean, worst_first};
use super::{ascii::number, atomic};
use crate::diagnostic::Diagnostic;
use crate::inspect::{InspectionResult, Outcome};
use std::fs;
use std::path::Path;

/// The table's file name.
pub const FILE: &str = "sequence.csv";

/// Its columns.
pub const HEADER: &str = "scan,taken,status,verdict,side,points_kept,best_fit_rms_mm,margin,pass,fail,undecided,\
not_measured,worst_point,worst_deviation_mm,worst_tolerance_ratio,reason,scan_sha256,plan_sha256,cad_sha256";

/// The row of one scan, without its line feed. Empty fields where nothing was measured.
pub fn row(result: &InspectionResult) -> String {
    let id = &result.identity;
    let mut fields = vec![text_field(&id.scan_file), text_field(id.scan_taken.as_deref().unwrap_or(""))];
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
            let reason = inspection.alignment.reason.as_deref().or(worst.and_then(|p| p.reason.as_deref()));
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

/// The table with a row for every scan inspected so far, in the order of their first inspection.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct SequenceTable {
    /// Scan name as the file has it, and the whole row.
    rows: Vec<(String, String)>,
}

impl SequenceTable {
    /// Reads the table of a results folder, to go on with it; an empty one when there is none. A table with other
    /// columns is refused rather than lost.
    pub fn load(folder: &Path) -> Result<Self, Diagnostic> {
        let path = folder.join(FILE);
        let text = match fs::read_to_string(&path) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Self::default()),
            Err(error) => return Err(Diagnostic::error(format!("cannot read: {error}")).in_file(&path)),
        };
        let records = parse(&text);
        let columns = HEADER.split(',').count();
        let foreign = || {
            Diagnostic::error("has other columns than this program writes")
                .in_file(&path)
                .with_help("move the file away, or give another results folder")
        };
        let Some((header, records)) = records.split_first() else { return Ok(Self::default()) };
        if header.join(",") != HEADER || records.iter().any(|r| r.len() != columns) {
            return Err(foreign());
        }
        // Fields are written again as they were: text by our quoting, numbers need none (and must not get one).
        let encode = |record: &Vec<String>| {
            let encoded: Vec<String> = record.iter().map(|field| quoted(field)).collect();
            (record[0].clone(), encoded.join(","))
        };
        Ok(Self { rows: records.iter().map(encode).collect() })
    }

    /// Under which scan's name the same bytes were inspected before, by the same plan and CAD.
    pub fn inspected_as(&self, scan_sha256: &str, plan_sha256: &str, cad_sha256: &str) -> Option<String> {
        let hashes = [scan_sha256, plan_sha256, cad_sha256];
        self.rows.iter().find_map(|(name, row)| {
            let fields = parse(row).into_iter().next()?;
            let tail = fields.len().checked_sub(hashes.len())?;
            (fields[tail..] == hashes).then(|| name.clone())
        })
    }

    /// How many scans have a row.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether no scan has a row.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Adds the row of a scan, or replaces it when the scan was inspected before.
    pub fn put(&mut self, result: &InspectionResult) {
        let row = row(result);
        let key = parse(&row).into_iter().flatten().next().unwrap_or_else(|| clean(&result.identity.scan_file));
        match self.rows.iter_mut().find(|(name, _)| *name == key) {
            Some(known) => known.1 = row,
            None => self.rows.push((key, row)),
        }
    }

    /// The whole file.
    pub fn to_csv(&self) -> String {
        let mut text = format!("{HEADER}\n");
        for (_, row) in &self.rows {
            text.push_str(row);
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
        let id = example::bracket().identity;
        let hashes = format!("{},{}", id.plan_sha256, id.cad_sha256);
        let scan = id.scan_sha256.unwrap();
        assert_eq!(
            row(&example::bracket()),
            format!(
                "0017.ply,,measured,fail,top,1313042,0.112000,4.200000,6,2,2,1,E03,-0.958000,1.368571,,{scan},{hashes}"
            )
        );
        // The refused scan of the example could not even be read: it has no hash.
        assert_eq!(
            row(&example::refused()),
            format!(
                "0017.ply,,refused,,,,,,,,,,,,,\"the scan is cut off after 1,204,331 of 2,000,000 points\",,{hashes}"
            )
        );
        let reason = "\"datum S1 not measured: 9 points on the rim, 40 are needed\"";
        assert!(row(&example::degraded()).ends_with(&format!("P01,,,{reason},{scan},{hashes}")));
    }

    #[test]
    fn a_loaded_table_goes_on_byte_for_byte() {
        let folder = tempfile::tempdir().unwrap();
        let mut table = SequenceTable::default();
        for scan in ["0001.ply", "=cmd|x,\"0002\".ply", "it's; 3.ply"] {
            table.put(&named(example::bracket(), scan));
        }
        table.put(&named(example::refused(), "0004.ply"));
        table.write(folder.path()).unwrap();
        let mut loaded = SequenceTable::load(folder.path()).unwrap();
        assert_eq!(loaded, table);
        assert_eq!(loaded.to_csv(), table.to_csv());

        // Inspected again: the row changes in its place, no scan gets two.
        loaded.put(&named(example::refused(), "=cmd|x,\"0002\".ply"));
        assert_eq!(loaded.len(), 4);
        let text = loaded.to_csv();
        let second = text.lines().nth(2).unwrap();
        assert!(second.starts_with("\"'=cmd") && second.contains("refused"), "{second}");
    }

    #[test]
    fn a_foreign_table_is_not_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        assert!(SequenceTable::load(folder.path()).unwrap().is_empty());
        fs::write(folder.path().join(FILE), "a,b\n1,2\n").unwrap();
        assert!(SequenceTable::load(folder.path()).unwrap_err().message.contains("other columns"));
    }
}
