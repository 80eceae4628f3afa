//! What a plan's choice of datums costs, before anything is measured: the uncertainty to expect at every comparison point, and
//! what other datums would leave there.

use super::expected::{ExpectedU, Outlook};
use crate::plan::expected::Expected;
use crate::plan::{AlignmentMethod, ComparisonPoint, SlotReading};

/// What to expect of a plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Foretold {
    /// Distance between points that is reckoned with, mm.
    pub spacing_mm: f64,
    /// Whether the plan's rig tells it; else it is the paper's.
    pub from_rig: bool,
    /// Every comparison point, the worst beside its tolerance first.
    pub points: Vec<ForetoldPoint>,
    /// The plan's datums, then others that its features would allow.
    pub schemes: Vec<Scheme>,
}

/// A comparison point.
#[derive(Debug, Clone, PartialEq)]
pub struct ForetoldPoint {
    /// Its name.
    pub name: String,
    /// `surface`, `edge` or `hole`.
    pub kind: &'static str,
    /// What to expect.
    pub expected: ExpectedU,
    /// Lower limit of the deviation.
    pub lower_mm: f64,
    /// Upper limit of the deviation.
    pub upper_mm: f64,
}

impl ForetoldPoint {
    /// U over half of the tolerance's width: from 1 on nothing can pass.
    pub fn share(&self) -> f64 {
        2.0 * self.expected.u_mm / (self.upper_mm - self.lower_mm)
    }
}

/// Datums and what they leave.
#[derive(Debug, Clone, PartialEq)]
pub struct Scheme {
    /// As a plan says it.
    pub words: String,
    /// Median U and the largest with its point, mm; `None` where these datums do not hold the part.
    pub cost: Option<SchemeCost>,
}

/// Expanded uncertainties over the comparison points.
#[derive(Debug, Clone, PartialEq)]
pub struct SchemeCost {
    /// The middle one, mm.
    pub median_mm: f64,
    /// The largest, mm.
    pub worst_mm: f64,
    /// Where it is.
    pub worst_point: String,
}

/// Looks ahead. `None` for a plan without comparison points, or whose datums do not hold the part.
pub fn foretell(outlook: &Outlook) -> Option<Foretold> {
    let expected = outlook.expected()?;
    let point = |(point, expected): (&ComparisonPoint, ExpectedU)| ForetoldPoint {
        name: point.name.clone(),
        kind: point.geometry.kind(),
        expected,
        lower_mm: point.lower_mm,
        upper_mm: point.upper_mm,
    };
    let mut points: Vec<ForetoldPoint> = outlook.comparison.iter().zip(expected).map(point).collect();
    if points.is_empty() {
        return None;
    }
    points.sort_by(|a, b| b.share().total_cmp(&a.share()));
    let mut schemes = vec![Scheme { words: format!("{} (this plan)", words(outlook.method)), cost: cost(outlook) }];
    let others = others(outlook);
    schemes.extend(others.iter().map(|method| {
        let cost = cost(&Outlook { method, ..*outlook });
        Scheme { words: words(method), cost }
    }));
    let spacing_mm = Expected::of(outlook.rig).spacing_mm;
    Some(Foretold { spacing_mm, from_rig: outlook.rig.is_some(), points, schemes })
}

fn cost(outlook: &Outlook) -> Option<SchemeCost> {
    let u_mm = outlook.expected_u_mm()?;
    let worst = (0..u_mm.len()).max_by(|&a, &b| u_mm[a].total_cmp(&u_mm[b]))?;
    let mut sorted = u_mm.clone();
    sorted.sort_by(f64::total_cmp);
    Some(SchemeCost {
        median_mm: sorted[sorted.len() / 2],
        worst_mm: u_mm[worst],
        worst_point: outlook.comparison[worst].name.clone(),
    })
}

/// Other ways to hold the part by what the plan has.
fn others(outlook: &Outlook) -> Vec<AlignmentMethod> {
    let first = |kind: &str| outlook.features.iter().position(|feature| feature.geometry.kind() == kind);
    let datums = match *outlook.method {
        AlignmentMethod::Features { hole, slot, point, .. } => Some((hole, slot, point)),
        _ => first("hole").zip(first("slot")).zip(first("surface")).map(|((hole, slot), point)| (hole, slot, point)),
    };
    let by_features = [SlotReading::CentreLine, SlotReading::Axis].into_iter().filter_map(|slot_reading| {
        let (hole, slot, point) = datums?;
        Some(AlignmentMethod::Features { hole, slot, slot_reading, point })
    });
    let by_fit = outlook.part.map(|_| AlignmentMethod::BestFit);
    by_features.chain(by_fit).filter(|method| method != outlook.method).collect()
}

fn words(method: &AlignmentMethod) -> String {
    match method {
        AlignmentMethod::Features { slot_reading: SlotReading::CentreLine, .. } => {
            "features, slot_reading = \"centre_line\"".to_owned()
        }
        AlignmentMethod::Features { slot_reading: SlotReading::Axis, .. } => {
            "features, slot_reading = \"axis\"".to_owned()
        }
        AlignmentMethod::Rps(locks) => format!("rps, {} locks", locks.len()),
        AlignmentMethod::BestFit => "best_fit".to_owned(),
        AlignmentMethod::Regions(fit) => format!("best_fit, {} regions", fit.regions.len()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::part::{Part, PartSettings};
    use crate::plan::{CadSide, RpsLock};
    use crate::run::RunContext;
    use crate::simulate::{BracketParameters, bracket};

    #[test]
    fn the_worst_point_comes_first_and_each_choice_of_datums_has_its_price() {
        let made = bracket(&BracketParameters { spacing_mm: 4.0, ..BracketParameters::default() });
        let settings = PartSettings { cad_side: CadSide::Top, thickness_mm: 1.2, plan_directions: Vec::new() };
        let part = Part::prepare(made.mesh.clone(), String::new(), &settings, &RunContext::silent()).unwrap();
        let mut plan = made.plan();
        let outlook = Outlook { part: Some(&part), ..Outlook::of(&plan) };
        let foretold = foretell(&outlook).unwrap();
        assert_eq!(foretold.points.len(), plan.comparison.len());
        assert!(foretold.points.is_sorted_by(|a, b| a.share() >= b.share()) && !foretold.from_rig);
        assert!(foretold.points.iter().all(|p| {
            let ExpectedU { u_mm, point_mm, pose_mm, common_mm } = p.expected;
            point_mm > 0.0 && pose_mm > 0.0 && common_mm == 0.0 && (u_mm - point_mm.hypot(pose_mm)).abs() < 1e-12
        }));
        let told: Vec<&str> = foretold.schemes.iter().map(|s| s.words.as_str()).collect();
        let [own, axis, fit] = foretold.schemes.each_cost();
        assert_eq!(
            told,
            ["features, slot_reading = \"centre_line\" (this plan)", "features, slot_reading = \"axis\"", "best_fit"]
        );
        // The slot of 30 x 9 mm tells a direction ten times worse than the line over 180 mm does. The whole face holds heights best, shifts
        // along itself by its slopes alone.
        assert!(axis.worst_mm > 3.0 * own.worst_mm, "{foretold:?}");
        assert!(fit.median_mm < own.median_mm && fit.worst_mm < axis.worst_mm, "{foretold:?}");
        assert!(own.median_mm <= own.worst_mm);
        // Locks that leave a motion free tell nothing.
        plan.alignment =
            AlignmentMethod::Rps(vec![RpsLock { feature: 0, lock: crate::geometry::Vector3::z_axis() }; 6]);
        assert_eq!(foretell(&Outlook::of(&plan)), None);
    }

    trait EachCost {
        fn each_cost(&self) -> [SchemeCost; 3];
    }

    impl EachCost for Vec<Scheme> {
        fn each_cost(&self) -> [SchemeCost; 3] {
            std::array::from_fn(|k| self[k].cost.clone().unwrap())
        }
    }
}
