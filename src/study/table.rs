//! A study as a table for people and as CSV for machines; nothing is computed here. No clock, no folder: the same study gives the
//! same bytes.

use super::figures::{PointFigures, Word};
use super::request::Study;
use super::statistics::LIMIT;
use crate::diagnostic::Diagnostic;
use crate::report::atomic;
use crate::report::csv::text_field;
use crate::report::words::{PROGRAM, clean, signed_mm};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Refused scans named at most in the text.
const MOST_REFUSED: usize = 20;

/// Points named at most in the last line, worst first.
const MOST_NAMES: usize = 12;

/// The file for machines.
pub const CSV_FILE: &str = "study.csv";
/// The file for people.
pub const TEXT_FILE: &str = "study.txt";

const HEADER: &str = "name,kind,lower_mm,upper_mm,scans,measured,bias_mm,standard_deviation_mm,uncertainty_mm,coverage,cg,cgk,\
least_tolerance_mm,word,not_measured_reason\n";

/// Names of the columns and, below them, their units.
const COLUMNS: [(&str, &str); 12] = [
    ("point", ""),
    ("kind", ""),
    ("lower", "mm"),
    ("upper", "mm"),
    ("measured", ""),
    ("bias", "mm"),
    ("s", "mm"),
    ("U", "mm"),
    ("within U", "%"),
    ("Cg", ""),
    ("Cgk", ""),
    ("least T", "mm"),
];

/// One row a comparison point, in the plan's order; a field is empty where nothing is known.
pub fn csv(study: &Study) -> String {
    let mut text = String::from(HEADER);
    for p in &study.points {
        let number = |value: Option<f64>| value.map(exact).unwrap_or_default();
        let fields = [
            text_field(&p.name),
            p.kind.to_owned(),
            exact(p.lower_mm),
            exact(p.upper_mm),
            study.scans.to_string(),
            p.measured.to_string(),
            number(p.bias_mm),
            number(p.standard_deviation_mm),
            number(p.uncertainty_mm),
            number(p.coverage),
            number(p.cg),
            number(p.cgk),
            number(p.least_tolerance_mm),
            p.word.words().to_owned(),
            text_field(p.reason.as_deref().unwrap_or("")),
        ];
        text.push_str(&fields.join(","));
        text.push('\n');
    }
    text
}

/// Six decimals; zero without a sign; `inf` where nothing scatters.
fn exact(value: f64) -> String {
    let text = format!("{value:.6}");
    if text == "-0.000000" { "0.000000".to_owned() } else { text }
}

/// The study for people: where it comes from, the points, worst first, and what the columns mean.
pub fn text(study: &Study) -> String {
    let mut text = String::new();
    let mut line = |words: String| {
        writeln!(text, "{words}").expect("writing to a string cannot fail");
    };
    line(format!("{PROGRAM}, capability of {} for {}", study.plan.0, study.part));
    let [top, bottom] = study.seen;
    line(format!("{}; {top} seen from the top, {bottom} from the bottom", study.source));
    line(format!("plan {}\ncad  {} {}", study.plan.1, study.cad.1, study.cad.0));
    study.rig.iter().for_each(|rig| line(format!("rig: {rig}")));
    study.notes.iter().for_each(|note| line(format!("note: {note}")));
    line(String::new());
    rows(study).into_iter().for_each(&mut line);
    line(String::new());
    not_measured(study).into_iter().chain(refused(study)).for_each(&mut line);
    line(format!(
        "T = upper - lower; Cg = 0.2 T / (6 s), Cgk = (0.1 T - |bias|) / (3 s), {LIMIT} at least (type-1 study); least T: the tolerance that \
         would do"
    ));
    line(
        "bias and s: mean and standard deviation of the errors; U: median of the stated uncertainties (k = 2)"
            .to_owned(),
    );
    if let Some(coverage) = study.coverage() {
        line(format!("within U: errors that the stated U covers; {:.1} % over all points", 100.0 * coverage));
    }
    line(summary(study));
    text
}

fn rows(study: &Study) -> Vec<String> {
    let mut cells: Vec<Vec<String>> =
        vec![COLUMNS.map(|c| c.0.to_owned()).to_vec(), COLUMNS.map(|c| c.1.to_owned()).to_vec()];
    let worst_first = study.worst_first();
    cells.extend(worst_first.iter().map(|p| row(study, p)));
    let width = |column: usize| cells.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..COLUMNS.len()).map(width).collect();
    let words = ["", ""].into_iter().chain(worst_first.iter().map(|p| p.word.words()));
    cells
        .iter()
        .zip(words)
        .map(|(row, word)| {
            let mut line = String::new();
            for (k, (cell, width)) in row.iter().zip(&widths).enumerate() {
                // Words stand left, numbers right.
                let cell = if k < 2 { format!("{cell:<width$}") } else { format!("{cell:>width$}") };
                line.push_str(&cell);
                line.push_str("  ");
            }
            line.push_str(word);
            line.trim_end().to_owned()
        })
        .collect()
}

fn row(study: &Study, p: &PointFigures) -> Vec<String> {
    let length = |value: Option<f64>| value.map_or("-".to_owned(), |v| format!("{v:.3}"));
    let ratio = |value: Option<f64>| match value {
        Some(v) if v < 100.0 => format!("{v:.2}"),
        Some(_) => ">= 100".to_owned(),
        None => "-".to_owned(),
    };
    vec![
        clean(&p.name),
        p.kind.to_owned(),
        signed_mm(p.lower_mm),
        signed_mm(p.upper_mm),
        format!("{}/{}", p.measured, study.scans),
        p.bias_mm.map_or("-".to_owned(), signed_mm),
        length(p.standard_deviation_mm),
        length(p.uncertainty_mm),
        p.coverage.map_or("-".to_owned(), |c| format!("{:.0}", 100.0 * c)),
        ratio(p.cg),
        ratio(p.cgk),
        p.least_tolerance_mm.map_or("-".to_owned(), |t| format!("{t:.2}")),
    ]
}

fn not_measured(study: &Study) -> Vec<String> {
    let missed = study.points.iter().filter(|p| p.measured < study.measured());
    missed
        .map(|p| {
            let count = study.measured() - p.measured;
            let reason = clean(p.reason.as_deref().unwrap_or("no reason is known"));
            format!("not measured in {count} of {} scans: {}: {reason}", study.measured(), clean(&p.name))
        })
        .collect()
}

fn refused(study: &Study) -> Vec<String> {
    let mut lines: Vec<String> =
        study.refused.iter().take(MOST_REFUSED).map(|(name, why)| format!("refused: {name}: {why}")).collect();
    if study.refused.len() > MOST_REFUSED {
        lines.push(format!("refused: {} more", study.refused.len() - MOST_REFUSED));
    }
    lines
}

/// `3 of 26 points not capable: E03, E01, C02; 23 capable`.
fn summary(study: &Study) -> String {
    let mut parts = Vec::new();
    for word in [Word::NotCapable, Word::CannotSay] {
        let of_word = study.worst_first().into_iter().filter(|p| p.word == word);
        let names: Vec<String> = of_word.take(MOST_NAMES).map(|p| clean(&p.name)).collect();
        if !names.is_empty() {
            let more = if study.count(word) > names.len() { ", .." } else { "" };
            parts.push(format!("{} {}: {}{more}", study.count(word), word.words(), names.join(", ")));
        }
    }
    for word in [Word::Repeats, Word::Capable] {
        if study.count(word) > 0 {
            parts.push(format!("{} {}", study.count(word), word.words()));
        }
    }
    format!("of {} points: {}", study.points.len(), parts.join("; "))
}

/// Writes `study.csv` and `study.txt`, each whole or not at all; returns their paths.
///
/// # Errors
/// A file cannot be written, in words.
pub fn write(folder: &Path, study: &Study) -> Result<Vec<PathBuf>, Diagnostic> {
    let files = [(CSV_FILE, csv(study)), (TEXT_FILE, text(study))];
    let mut written = Vec::new();
    for (name, content) in files {
        let path = folder.join(name);
        atomic::write(&path, content.as_bytes())?;
        written.push(path);
    }
    Ok(written)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figures(name: &str, word: Word, cg: f64, measured: usize) -> PointFigures {
        PointFigures {
            name: name.into(),
            kind: "surface",
            lower_mm: -0.5,
            upper_mm: 0.5,
            measured,
            bias_mm: Some(-0.0001),
            standard_deviation_mm: Some(0.2 / (6.0 * cg)),
            uncertainty_mm: Some(0.031),
            coverage: Some(0.95),
            cg: Some(cg),
            cgk: Some(cg - 0.1),
            least_tolerance_mm: Some(0.75),
            word,
            reason: (measured < 20).then(|| "hidden, by the part".to_owned()),
        }
    }

    fn study() -> Study {
        let nothing = PointFigures {
            bias_mm: None,
            standard_deviation_mm: None,
            uncertainty_mm: None,
            coverage: None,
            cg: None,
            cgk: None,
            least_tolerance_mm: None,
            ..figures("E05", Word::CannotSay, 1.0, 0)
        };
        Study {
            part: "Bracket RH".into(),
            plan: ("demo.toml".into(), "aa".into()),
            cad: ("bracket.stl".into(), "bb".into()),
            source: "21 simulated scans, seed 1".into(),
            rig: None,
            notes: vec!["something".into()],
            scans: 21,
            seen: [11, 9],
            refused: vec![("sim_0004".into(), "no part in view".into())],
            points: vec![
                figures("P01", Word::Capable, 2.5, 20),
                figures("=P02", Word::NotCapable, 1.2, 19),
                nothing,
                figures("P04", Word::Capable, f64::INFINITY, 20),
            ],
        }
    }

    #[test]
    fn the_text_is_a_table_worst_first_with_its_words() {
        let told = text(&study());
        let lines: Vec<&str> = told.lines().collect();
        let at = lines.iter().position(|l| l.starts_with("point ")).unwrap();
        let expected = [
            "point  kind      lower   upper  measured   bias      s      U  within U      Cg     Cgk  least T",
            "                    mm      mm               mm     mm     mm         %                       mm",
            "=P02   surface  -0.500  +0.500     19/21  0.000  0.028  0.031        95    1.20    1.10     0.75  not capable",
            "E05    surface  -0.500  +0.500      0/21      -      -      -         -       -       -        -  cannot say",
            "P01    surface  -0.500  +0.500     20/21  0.000  0.013  0.031        95    2.50    2.40     0.75  capable",
            "P04    surface  -0.500  +0.500     20/21  0.000  0.000  0.031        95  >= 100  >= 100     0.75  capable",
        ];
        assert_eq!(lines[at..at + expected.len()], expected, "{told}");
        for words in [
            "not measured in 1 of 20 scans: =P02: hidden, by the part",
            "not measured in 20 of 20 scans: E05",
            "refused: sim_0004: no part in view",
            "95.0 % over all points",
            "of 4 points: 1 not capable: =P02; 1 cannot say: E05; 2 capable",
        ] {
            assert!(told.contains(words), "no \"{words}\" in {told}");
        }
    }

    #[test]
    fn the_csv_has_the_plans_order_and_disarms_names() {
        let told = csv(&study());
        let rows: Vec<Vec<&str>> = told.lines().map(|l| l.split(',').collect()).collect();
        assert_eq!(rows.len(), 5);
        assert_eq!(rows[1][..9].join(","), "P01,surface,-0.500000,0.500000,21,20,-0.000100,0.013333,0.031000");
        assert_eq!(rows[1][9..].join(","), "0.950000,2.500000,2.400000,0.750000,capable,");
        assert!(rows[2][0].starts_with("\"'=P02"), "{told}");
        assert!(told.contains(",not capable,\"hidden, by the part\"\n"), "{told}");
        assert_eq!(rows[3][6..13].join(","), ",,,,,,");
        assert_eq!(rows[4][10], "inf");
    }
}
