//! The why-card: what a value rests on, and every question that was asked on the way to it, with its answer and its limit.
//!
//! A measurement writes its card as it goes, so that the card of a place that could not be measured ends with the question that
//! it failed.

use crate::geometry::Vector3;

/// Which side of its limit a value has to be on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rule {
    /// Not below the limit.
    AtLeast,
    /// Not above the limit.
    AtMost,
}

impl Rule {
    /// The word for files.
    pub fn key(self) -> &'static str {
        match self {
            Rule::AtLeast => "at_least",
            Rule::AtMost => "at_most",
        }
    }
}

/// One question and its answer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gate {
    /// What was asked, as people would say it: `points in the window`.
    pub name: &'static str,
    /// Of `value` and `limit`; empty for a number or a share.
    pub unit: &'static str,
    /// What was found; not a number passes no gate.
    pub value: f64,
    /// What was asked for.
    pub limit: f64,
    /// On which side of it.
    pub rule: Rule,
}

impl Gate {
    /// Whether it was passed.
    pub fn passed(&self) -> bool {
        match self.rule {
            Rule::AtLeast => self.value >= self.limit,
            Rule::AtMost => self.value <= self.limit,
        }
    }
}

/// What a value rests on. Fields are `None` where the measurement ended before they were known. CAD frame.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Card {
    /// Surface: radius of the window. Edge: its length along the edge. Hole: its radius about the nominal centre. mm.
    pub window_mm: Option<f64>,
    /// Normal of the measured sheet there, on the plan's side.
    pub normal: Option<Vector3>,
    /// Standard deviation of the sheet's points about the sheet as fitted, mm.
    pub residual_mm: Option<f64>,
    /// Mean spacing of the points around the place, mm.
    pub spacing_mm: Option<f64>,
    /// Distance of the nominal place to the nearest trimmed edge or rim of the CAD, mm; infinite when it has none.
    pub cad_edge_mm: Option<f64>,
    /// Share of the window, or of the rim, beside which points stand, 0 to 1.
    pub covered: Option<f64>,
    /// Every question asked, in order.
    pub gates: Vec<Gate>,
    /// Where windows of several sizes made the value: how much each counts. The rest of the card is that of the one that counts most.
    pub blended: Vec<WindowShare>,
}

/// How much of a value is told by a window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WindowShare {
    /// Its radius.
    pub window_mm: f64,
    /// 0 to 1.
    pub share: f64,
}

impl Card {
    /// Notes a question whose value must not be below its limit; whether it was passed.
    pub fn at_least(&mut self, name: &'static str, unit: &'static str, value: f64, limit: f64) -> bool {
        self.ask(Gate { name, unit, value, limit, rule: Rule::AtLeast })
    }

    /// Notes a question whose value must not be above its limit; whether it was passed.
    pub fn at_most(&mut self, name: &'static str, unit: &'static str, value: f64, limit: f64) -> bool {
        self.ask(Gate { name, unit, value, limit, rule: Rule::AtMost })
    }

    /// A question asked again, in a smaller window say, counts as last answered.
    fn ask(&mut self, gate: Gate) -> bool {
        self.gates.retain(|g| g.name != gate.name);
        self.gates.push(gate);
        gate.passed()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gate_is_passed_at_its_limit_and_never_by_what_is_no_number() {
        let mut card = Card::default();
        assert!(card.at_least("points", "", 12.0, 12.0) && card.at_most("lean", "deg", 60.0, 60.0));
        assert!(!card.at_least("points", "", 11.0, 12.0) && !card.at_most("lean", "deg", 60.1, 60.0));
        assert!(!card.at_least("gain", "", f64::NAN, 1.0) && !card.at_most("gain", "", f64::NAN, 1.0));
        // Asked again: the last answer counts, once.
        let names: Vec<&str> = card.gates.iter().map(|g| g.name).collect();
        assert_eq!(names, ["points", "lean", "gain"]);
        assert!(card.gates.iter().all(|g| !g.passed()));
    }
}
