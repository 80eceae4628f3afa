//! A result in one line.

use crate::inspect::{InspectionResult, Outcome, Verdict};
use crate::report::words::clean;

/// What a result says in one line, for lists and the command line.
pub fn one_line(result: &InspectionResult) -> String {
    let scan = clean(&result.identity.scan_file);
    match &result.outcome {
        Outcome::Refused(refusal) => format!("{scan}\trefused\t{}", clean(&refusal.reason)),
        Outcome::Measured(inspection) => {
            let side = inspection.best_fit.side.map_or("side unknown".into(), |s| format!("seen from the {}", s.key()));
            let count = |verdict| inspection.points.iter().filter(|p| p.verdict == verdict).count();
            let counts: Vec<String> = [
                (count(Verdict::Fail), "out of tolerance"),
                (count(Verdict::NotMeasured), "not measured"),
                (count(Verdict::Undecided), "undecided"),
                (count(Verdict::Pass), "in tolerance"),
            ]
            .iter()
            .filter(|(n, _)| *n > 0)
            .map(|(n, words)| format!("{n} {words}"))
            .collect();
            format!("{scan}\t{}\t{side}\t{}", inspection.verdict.part_key(), counts.join(", "))
        }
    }
}
