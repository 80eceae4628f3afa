//! What to expect of a plan, as tables for people.

use crate::inspect::{Foretold, ForetoldPoint, Scheme};

/// The tables, without a line feed at their end.
pub fn foretold(foretold: &Foretold) -> String {
    let spacing = format!("{:.3} mm between points", foretold.spacing_mm);
    let source = if foretold.from_rig { "from [rig]" } else { "the paper's, the plan has no [rig]" };
    let mut lines = vec![format!(
        "U to expect of a good scan (k = 2, mm) at {spacing} ({source}), the worst beside its tolerance first;"
    )];
    lines.push(
        "U is made of what the point's own measurement, the datums, and thickness and scale (from [uncertainty]) owe:"
            .to_owned(),
    );
    lines.extend(table(
        &["point", "kind", "U", "own", "datums", "common", "lower", "upper", "U / half tolerance"],
        &[Left, Left, Right, Right, Right, Right, Right, Right, Right],
        foretold.points.iter().map(point_cells).collect(),
    ));
    lines.push(String::new());
    lines.push("what the choice of datums costs (U, mm):".to_owned());
    lines.extend(table(
        &["datums", "median", "worst", "at"],
        &[Left, Right, Right, Left],
        foretold.schemes.iter().map(scheme_cells).collect(),
    ));
    lines.join("\n")
}

fn point_cells(point: &ForetoldPoint) -> Vec<String> {
    let mm = |value: f64| format!("{value:.3}");
    let e = &point.expected;
    let share = format!("{:.0} %", 100.0 * point.share());
    let mut cells = vec![point.name.clone(), point.kind.to_owned()];
    cells.extend([e.u_mm, e.point_mm, e.pose_mm, e.common_mm, point.lower_mm, point.upper_mm].map(mm));
    cells.push(share);
    cells
}

fn scheme_cells(scheme: &Scheme) -> Vec<String> {
    match &scheme.cost {
        Some(cost) => {
            let [median, worst] = [cost.median_mm, cost.worst_mm].map(|mm| format!("{mm:.3}"));
            vec![scheme.words.clone(), median, worst, cost.worst_point.clone()]
        }
        None => vec![scheme.words.clone(), "-".into(), "-".into(), "does not hold the part".into()],
    }
}

#[derive(Clone, Copy)]
enum Align {
    Left,
    Right,
}
use Align::{Left, Right};

/// Lines of columns as wide as their widest cell, two blanks between.
fn table(head: &[&str], align: &[Align], rows: Vec<Vec<String>>) -> Vec<String> {
    let head: Vec<String> = head.iter().map(|cell| (*cell).to_owned()).collect();
    let rows: Vec<Vec<String>> = std::iter::once(head).chain(rows).collect();
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..align.len()).map(width).collect();
    let cell = |(text, (align, width)): (&String, (&Align, &usize))| match align {
        Left => format!("{text:<width$}"),
        Right => format!("{text:>width$}"),
    };
    let line = |row: &Vec<String>| {
        let cells: Vec<String> = row.iter().zip(align.iter().zip(&widths)).map(cell).collect();
        cells.join("  ").trim_end().to_owned()
    };
    rows.iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inspect::{ExpectedU, SchemeCost};

    #[test]
    fn columns_stand_under_each_other() {
        let point = |name: &str, pose_mm: f64| ForetoldPoint {
            name: name.into(),
            kind: "surface",
            expected: ExpectedU { u_mm: 0.005_f64.hypot(pose_mm), point_mm: 0.005, pose_mm, common_mm: 0.0 },
            lower_mm: -0.5,
            upper_mm: 0.5,
        };
        let cost = Some(SchemeCost { median_mm: 0.02, worst_mm: 0.05, worst_point: "P01".into() });
        let text = foretold(&Foretold {
            spacing_mm: 0.168,
            from_rig: false,
            points: vec![point("P01", 0.05), point("Prüfpunkt", 0.01)],
            schemes: vec![
                Scheme { words: "best_fit (this plan)".into(), cost },
                Scheme { words: "rps, 6 locks".into(), cost: None },
            ],
        });
        let expected = "\
U to expect of a good scan (k = 2, mm) at 0.168 mm between points (the paper's, the plan has no [rig]), the worst beside its tolerance first;
U is made of what the point's own measurement, the datums, and thickness and scale (from [uncertainty]) owe:
point      kind         U    own  datums  common   lower  upper  U / half tolerance
P01        surface  0.050  0.005   0.050   0.000  -0.500  0.500                10 %
Prüfpunkt  surface  0.011  0.005   0.010   0.000  -0.500  0.500                 2 %

what the choice of datums costs (U, mm):
datums                median  worst  at
best_fit (this plan)   0.020  0.050  P01
rps, 6 locks               -      -  does not hold the part";
        assert_eq!(text, expected);
    }
}
