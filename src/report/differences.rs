//! What differs between two results of one scan, point by point: what another plan makes of it.

use super::words::{part_verdict, point_verdict, signed_mm};
use crate::inspect::{InspectionResult, Outcome, PointResult, Verdict};

/// What a result says of one point.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    /// Its verdict.
    pub verdict: Verdict,
    /// Its deviation, mm; `None`: not measured.
    pub deviation_mm: Option<f64>,
    /// Expanded uncertainty (k = 2), mm.
    pub uncertainty_mm: Option<f64>,
    /// Deviation over tolerance.
    pub tolerance_ratio: Option<f64>,
    /// Why it has no value or no verdict.
    pub reason: Option<String>,
}

impl Reading {
    fn of(point: &PointResult) -> Self {
        Self {
            verdict: point.verdict,
            deviation_mm: point.measurement.as_ref().map(|m| m.deviation_mm),
            uncertainty_mm: point.measurement.as_ref().map(|m| m.uncertainty_mm),
            tolerance_ratio: point.tolerance_ratio(),
            reason: point.reason.clone(),
        }
    }

    fn words(&self) -> String {
        match self.deviation_mm {
            Some(mm) => format!("{} mm, {}", signed_mm(mm), point_verdict(self.verdict)),
            None => point_verdict(self.verdict).to_owned(),
        }
    }
}

/// One point in both results. A point has the name that it has in each plan.
#[derive(Debug, Clone, PartialEq)]
pub struct PointDifference {
    /// Its name.
    pub name: String,
    /// Before; `None`: it was not in the plan, or the scan was refused.
    pub before: Option<Reading>,
    /// After; `None`: it is no longer in the plan, or the scan is refused.
    pub after: Option<Reading>,
}

impl PointDifference {
    /// Whether value, uncertainty, verdict or reason are other ones.
    pub fn is_change(&self) -> bool {
        self.before != self.after
    }

    /// `+0.200 mm, Pass -> +0.250 mm, Fail`.
    pub fn words(&self) -> String {
        match (&self.before, &self.after) {
            (Some(before), Some(after)) if before == after => format!("{}, as before", after.words()),
            (Some(before), Some(after)) => format!("{} -> {}", before.words(), after.words()),
            (None, Some(after)) => format!("new: {}", after.words()),
            (Some(before), None) => format!("gone, was {}", before.words()),
            (None, None) => String::new(),
        }
    }
}

/// All points of both results: those of the one after in its order, then those that are gone. Without a result before, all are new.
pub fn point_differences(before: Option<&InspectionResult>, after: &InspectionResult) -> Vec<PointDifference> {
    let (old, new) = (before.map_or(&[][..], points), points(after));
    let mut left: Vec<Option<&PointResult>> = old.iter().map(Some).collect();
    let mut differences: Vec<PointDifference> = Vec::with_capacity(new.len());
    for point in new {
        // Names may be used twice: each takes its own.
        let partner = left.iter_mut().find(|old| old.is_some_and(|old| old.name == point.name)).and_then(Option::take);
        let (before, after) = (partner.map(Reading::of), Some(Reading::of(point)));
        differences.push(PointDifference { name: point.name.clone(), before, after });
    }
    let gone = left.into_iter().flatten();
    differences.extend(gone.map(|p| PointDifference {
        name: p.name.clone(),
        before: Some(Reading::of(p)),
        after: None,
    }));
    differences
}

/// What became of the verdict of the part: `Pass -> Fail`.
pub fn verdict_words(before: Option<&InspectionResult>, after: &InspectionResult) -> String {
    let words = |result: &InspectionResult| match &result.outcome {
        Outcome::Refused(refusal) => format!("refused ({})", refusal.reason),
        Outcome::Measured(inspection) => part_verdict(inspection.verdict).to_owned(),
    };
    let after = words(after);
    match before.map(words) {
        Some(before) if before != after => format!("{before} -> {after}"),
        Some(_) => format!("{after}, as before"),
        None => after,
    }
}

fn points(result: &InspectionResult) -> &[PointResult] {
    match &result.outcome {
        Outcome::Measured(inspection) => &inspection.points,
        Outcome::Refused(_) => &[],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostic::Refusal;
    use crate::report::example;

    #[test]
    fn each_point_is_told_before_and_after() {
        let before = example::bracket();
        let mut after = before.clone();
        let Outcome::Measured(inspection) = &mut after.outcome else { panic!() };
        let gone = inspection.points.remove(1).name;
        inspection.points[0].verdict = Verdict::Fail;
        inspection.points[2].name = "New".into();
        let changed = point_differences(Some(&before), &after);
        let words = |name: &str| changed.iter().find(|d| d.name == name).unwrap().words();
        let first = &example::inspection(&before).points[0];
        let value = signed_mm(first.measurement.as_ref().unwrap().deviation_mm);
        assert_eq!(words(&first.name), format!("{value} mm, Pass -> {value} mm, Fail"));
        assert!(words(&gone).starts_with("gone, was ") && words("New").starts_with("new: "));
        assert_eq!(changed.len(), example::inspection(&before).points.len() + 1);
        assert_eq!(changed.iter().filter(|d| d.is_change()).count(), 4);
        let untouched = changed.iter().find(|d| !d.is_change()).unwrap();
        assert!(untouched.words().ends_with(", as before"));
        let refused = InspectionResult { outcome: Outcome::Refused(Refusal::new("no part", "look")), ..before.clone() };
        assert!(point_differences(Some(&before), &refused).iter().all(|d| d.after.is_none()));
        assert_eq!(verdict_words(Some(&before), &refused), "Fail -> refused (no part)");
        assert_eq!(verdict_words(Some(&before), &before), "Fail, as before");
    }
}
