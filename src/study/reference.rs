//! Reference values of one part: delimited text with the columns `name` and `deviation_mm`, such as a coordinate measuring machine's
//! list or a report of this program (`NAME.csv`).

use crate::diagnostic::{Diagnostic, ReadError};
use crate::io;
use crate::plan::ComparisonPoint;
use std::path::Path;

const HELP: &str = "write a first line name,deviation_mm and a line a comparison point, such as P01,0.035";

/// The known deviation of each comparison point, in the plan's order; `None` where the file has none.
///
/// # Errors
/// The file cannot be read, lacks a column, or has a line that cannot be used: with file, line, and what was expected.
pub(super) fn read(path: &Path, comparison: &[ComparisonPoint]) -> Result<Vec<Option<f64>>, Box<Diagnostic>> {
    let bytes = io::read_file(path).map_err(|e| match e {
        ReadError::Bad(diagnostic) | ReadError::CutOff(diagnostic) => diagnostic,
        ReadError::Cancelled(_) => Box::new(Diagnostic::error("stopped").in_file(path)),
    })?;
    parse(&String::from_utf8_lossy(&bytes), comparison).map_err(|d| Box::new(d.in_file(path)))
}

fn parse(text: &str, comparison: &[ComparisonPoint]) -> Result<Vec<Option<f64>>, Diagnostic> {
    let told = |line: &(usize, &str)| !line.1.trim().is_empty() && !line.1.trim_start().starts_with('#');
    let mut lines = text.trim_start_matches('\u{feff}').lines().enumerate().map(|(k, l)| (k + 1, l)).filter(told);
    let Some((at, header)) = lines.next() else {
        return Err(Diagnostic::error("found no line, expected reference values").with_help(HELP));
    };
    let separator = ['\t', ';', ','].into_iter().find(|c| header.contains(*c)).unwrap_or(',');
    let names = cells(header, separator);
    let column = |wanted: &str| {
        names.iter().position(|name| name.eq_ignore_ascii_case(wanted)).ok_or_else(|| {
            let message = format!("found the columns {}, expected one named {wanted}", names.join(", "));
            Diagnostic::error(message).at_line(at).with_help(HELP)
        })
    };
    let (name_at, value_at) = (column("name")?, column("deviation_mm")?);
    let mut known = vec![None; comparison.len()];
    for (line, text) in lines {
        let wrong = |message: String| Diagnostic::error(message).at_line(line).with_help(HELP);
        let row = cells(text, separator);
        let name = row.get(name_at).map_or("", String::as_str);
        let Some(index) = comparison.iter().position(|p| p.name == name) else {
            return Err(wrong(format!("found \"{name}\", expected the name of a comparison point of the plan")));
        };
        let cell = row.get(value_at).map_or("", String::as_str);
        if cell.is_empty() {
            continue;
        }
        let Some(value) = cell.parse::<f64>().ok().filter(|v| v.is_finite()) else {
            return Err(wrong(format!("found \"{cell}\", expected a deviation in mm with a decimal point")));
        };
        if known[index].replace(value).is_some() {
            return Err(wrong(format!("found a second value of \"{name}\", expected one")));
        }
    }
    Ok(known)
}

/// The cells of a line, blanks around them and quotes undone.
fn cells(line: &str, separator: char) -> Vec<String> {
    let mut cells = vec![String::new()];
    let mut quoted = false;
    let mut letters = line.trim_end_matches('\r').chars().peekable();
    while let Some(c) = letters.next() {
        let last = cells.len() - 1;
        match c {
            '"' if quoted && letters.peek() == Some(&'"') => {
                letters.next();
                cells[last].push('"');
            }
            '"' => quoted = !quoted,
            c if c == separator && !quoted => cells.push(String::new()),
            c => cells[last].push(c),
        }
    }
    cells.iter().map(|cell| cell.trim().to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::symmetric_plate;

    fn points() -> Vec<ComparisonPoint> {
        let point = symmetric_plate().plan().comparison[0].clone();
        ["A", "B; 2", "C"].map(|name| ComparisonPoint { name: name.into(), ..point.clone() }).to_vec()
    }

    #[test]
    fn values_are_found_by_name_and_column() {
        let text = "# by the machine\nNo;name;deviation_mm\r\n1;C;-0.25\r\n\n2;\"B; 2\";\n3; A ; 1e-3\n";
        assert_eq!(parse(text, &points()).unwrap(), [Some(0.001), None, Some(-0.25)]);
        assert_eq!(parse("\u{feff}name,deviation_mm\n", &points()).unwrap(), [None; 3]);
    }

    #[test]
    fn what_cannot_be_used_is_told_with_its_line() {
        for (text, line, words) in [
            ("", None, "no line"),
            ("name,value\nA,1\n", Some(1), "deviation_mm"),
            ("name,deviation_mm\nA,1\nD,2\n", Some(3), "\"D\""),
            ("name,deviation_mm\nA,0.1.2\n", Some(2), "0.1.2"),
            ("name,deviation_mm\nA,nan\n", Some(2), "nan"),
            ("name;deviation_mm\n\nA;0,5\n", Some(3), "0,5"),
            ("name,deviation_mm\nA,1\nA,1\n", Some(3), "second value"),
        ] {
            let fault = parse(text, &points()).unwrap_err();
            assert!(fault.line == line && fault.message.contains(words) && fault.help.is_some(), "{fault}");
        }
    }
}
