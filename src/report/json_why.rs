//! The why-card of a comparison point in `NAME.json`: what its value rests on, every question that was asked on the way with its
//! answer and its limit, and what its uncertainty is made of.

use crate::inspect::{Budget, PointResult};
use crate::measure::Gate;
use serde::Serialize;

/// `why`; what was not known when the measurement ended is `null`.
#[derive(Serialize)]
pub(super) struct WhyJson {
    window_mm: Option<f64>,
    normal: Option<[f64; 3]>,
    residual_mm: Option<f64>,
    spacing_mm: Option<f64>,
    cad_edge_mm: Option<f64>,
    covered_ratio: Option<f64>,
    gates: Vec<GateJson>,
    /// Empty where one window tells the value.
    blended: Vec<WindowShareJson>,
    /// k = 1.
    standard_uncertainties_mm: Option<BudgetJson>,
}

#[derive(Serialize)]
struct WindowShareJson {
    window_mm: f64,
    share_ratio: f64,
}

#[derive(Serialize)]
struct GateJson {
    gate: &'static str,
    value: Option<f64>,
    rule: &'static str,
    limit: f64,
    unit: &'static str,
    passed: bool,
}

#[derive(Serialize)]
struct BudgetJson {
    fit: f64,
    pose: f64,
    thickness: f64,
    scale: f64,
    edge_offset: f64,
    system: f64,
}

/// The card of a point.
pub(super) fn why_json(point: &PointResult) -> WhyJson {
    let card = &point.card;
    WhyJson {
        window_mm: card.window_mm,
        normal: card.normal.map(Into::into),
        residual_mm: card.residual_mm,
        spacing_mm: card.spacing_mm,
        // A CAD without edges is infinitely far from them.
        cad_edge_mm: card.cad_edge_mm.filter(|mm| mm.is_finite()),
        covered_ratio: card.covered,
        gates: card.gates.iter().map(gate_json).collect(),
        blended: card
            .blended
            .iter()
            .map(|w| WindowShareJson { window_mm: w.window_mm, share_ratio: w.share })
            .collect(),
        standard_uncertainties_mm: point.measurement.as_ref().map(|m| budget_json(&m.budget)),
    }
}

fn gate_json(gate: &Gate) -> GateJson {
    GateJson {
        gate: gate.name,
        value: Some(gate.value).filter(|v| v.is_finite()),
        rule: gate.rule.key(),
        limit: gate.limit,
        unit: gate.unit,
        passed: gate.passed(),
    }
}

fn budget_json(budget: &Budget) -> BudgetJson {
    let Budget { fit_mm, pose_mm, thickness_mm, scale_mm, edge_offset_mm, system_mm } = *budget;
    BudgetJson {
        fit: fit_mm,
        pose: pose_mm,
        thickness: thickness_mm,
        scale: scale_mm,
        edge_offset: edge_offset_mm,
        system: system_mm,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::{Card, WindowShare};
    use crate::report::example;

    #[test]
    fn a_card_tells_its_gates_and_what_its_uncertainty_is_made_of() {
        let result = example::bracket();
        let mut point = example::inspection(&result).points[0].clone();
        let mut card = Card { window_mm: Some(5.0), cad_edge_mm: Some(f64::INFINITY), ..Card::default() };
        card.at_least("points in the window", "", 431.0, 12.0);
        card.at_most("height", "mm", f64::NAN, 2.0);
        card.blended = vec![WindowShare { window_mm: 5.0, share: 0.75 }, WindowShare { window_mm: 3.5, share: 0.25 }];
        point.card = card;
        let why = serde_json::to_value(why_json(&point)).unwrap();
        assert_eq!(why["window_mm"], 5.0);
        assert_eq!((&why["blended"][1]["window_mm"], &why["blended"][1]["share_ratio"]), (&3.5.into(), &0.25.into()));
        assert!(why["cad_edge_mm"].is_null() && why["normal"].is_null());
        assert_eq!((&why["gates"][0]["value"], &why["gates"][0]["passed"]), (&431.0.into(), &true.into()));
        assert_eq!((&why["gates"][1]["value"], &why["gates"][1]["passed"]), (&serde_json::Value::Null, &false.into()));
        // The parts make up U (k = 2).
        let parts = why["standard_uncertainties_mm"].as_object().unwrap();
        let sum: f64 = parts.values().map(|v| v.as_f64().unwrap().powi(2)).sum();
        let stated = point.measurement.as_ref().unwrap().uncertainty_mm;
        assert!((2.0 * sum.sqrt() - stated).abs() < 1e-12, "{sum} {stated}");
        point.measurement = None;
        assert!(serde_json::to_value(why_json(&point)).unwrap()["standard_uncertainties_mm"].is_null());
    }
}
