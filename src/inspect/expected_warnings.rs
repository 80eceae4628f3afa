//! Warnings of a plan by what can be expected of it: tolerances that nobody can judge, windows and regions with too few points, a slot's
//! axis that turns the part.

use super::comparison::search_mm;
use super::expected::{ExpectedU, Figures, Outlook, error_mm, pose};
use crate::align::{REGION_LEAST_POINTS, region_places};
use crate::diagnostic::Diagnostic;
use crate::measure::{edge_length_mm, surface};
use crate::plan::expected::{Expected, OpeningStd, point_spacing_mm};
use crate::plan::{AlignmentMethod, ComparisonPoint, FitRegion, Geometry, Side, SlotReading, UncertaintySettings};
use std::path::Path;

/// All of them but that of the slot's axis, which has a place of its own.
pub fn expected_warnings(outlook: &Outlook) -> Vec<Diagnostic> {
    tolerance_warnings(outlook).into_iter().chain(window_warnings(outlook)).chain(edge_warnings(outlook)).collect()
}

/// What most of an expected uncertainty is due to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Cause {
    Scale,
    Thickness,
    System,
    EdgeOffset,
    Datums,
    Points,
}

impl Cause {
    /// Those that a setting of the plan tells, each with the settings without it.
    fn without(settings: UncertaintySettings) -> [(Cause, UncertaintySettings); 4] {
        [
            (Cause::Scale, UncertaintySettings { scale_ppm: 0.0, ..settings }),
            (Cause::Thickness, UncertaintySettings { thickness_mm: 0.0, ..settings }),
            (Cause::System, UncertaintySettings { system_mm: 0.0, ..settings }),
            (Cause::EdgeOffset, UncertaintySettings { edge_offset_u_mm: 0.0, ..settings }),
        ]
    }

    fn words(self) -> &'static str {
        match self {
            Cause::Scale => "the scale ([uncertainty] scale_ppm)",
            Cause::Thickness => "the sheet's thickness ([uncertainty] thickness_mm)",
            Cause::System => "the measuring system ([uncertainty] system_mm)",
            Cause::EdgeOffset => "the edges' offset ([uncertainty] edge_offset_u_mm)",
            Cause::Datums => "the datums",
            Cause::Points => "the scatter and spacing of the points",
        }
    }

    fn help(self) -> &'static str {
        match self {
            Cause::Scale => "calibrate the scale better, hold the part nearer to this point, or widen the tolerance",
            Cause::Thickness => "measure the sheet's thickness better, or widen the tolerance",
            Cause::System => {
                "tell the measuring system's uncertainty as it is, use a better one, or widen the tolerance"
            }
            Cause::EdgeOffset => "calibrate the edge offset better, or widen the tolerance",
            Cause::Datums => "hold the part by datums nearer to this point or further apart, or widen the tolerance",
            Cause::Points => {
                "measure with a finer rig, give a surface point a larger radius_mm, or widen the tolerance"
            }
        }
    }
}

/// Points of one cause are told one by one up to this many, together from there on.
const TOLD_APART: usize = 3;
/// Names told of points that are told together.
const NAMES_TOLD: usize = 8;

/// Warns of every comparison point whose tolerance the measuring system cannot judge: with U as large as half of the tolerance's
/// width (of a distance that may be 0: as its upper limit), or larger, not even the best deviation could pass. Points with the same
/// main cause are told together where they are many, at the one that is worst.
fn tolerance_warnings(outlook: &Outlook) -> Vec<Diagnostic> {
    let Some(u_mm) = outlook.expected_u_mm() else { return Vec::new() };
    let shares = |k: &usize| u_mm[*k] / most_mm(&outlook.comparison[*k]);
    let mut hopeless: Vec<usize> = (0..u_mm.len()).filter(|k| is_hopeless(&outlook.comparison[*k], u_mm[*k])).collect();
    if hopeless.is_empty() {
        return Vec::new();
    }
    let causes = Causes::of(outlook);
    let mut groups: Vec<(Cause, Vec<usize>)> = Vec::new();
    // The worst first; the sort is stable.
    hopeless.sort_by(|a, b| shares(b).total_cmp(&shares(a)));
    for k in hopeless {
        let cause = causes.largest(k, u_mm[k]);
        match groups.iter_mut().find(|(known, _)| *known == cause) {
            Some((_, points)) => points.push(k),
            None => groups.push((cause, vec![k])),
        }
    }
    let told = |(cause, points): &(Cause, Vec<usize>)| -> Vec<Diagnostic> {
        if points.len() <= TOLD_APART {
            points.iter().map(|k| tolerance_warning(outlook, *k, u_mm[*k], *cause, &[])).collect()
        } else {
            vec![tolerance_warning(outlook, points[0], u_mm[points[0]], *cause, &points[1..])]
        }
    };
    groups.iter().flat_map(told).collect()
}

/// The U from which on nothing passes.
fn most_mm(point: &ComparisonPoint) -> f64 {
    // A distance of 0 passes when U is within its only limit.
    if point.judged_lower_mm().is_finite() { 0.5 * (point.upper_mm - point.lower_mm) } else { point.upper_mm }
}

fn is_hopeless(point: &ComparisonPoint, u_mm: f64) -> bool {
    // The plan's own check tells limits that nobody can measure.
    point.upper_mm - point.lower_mm >= crate::plan::NARROWEST_MM && u_mm >= most_mm(point)
}

fn tolerance_warning(outlook: &Outlook, k: usize, u_mm: f64, cause: Cause, others: &[usize]) -> Diagnostic {
    let point = &outlook.comparison[k];
    let u_words = match outlook.rig {
        Some(_) => format!("{} by [rig]", mm(u_mm)),
        None => format!("{} without [rig]", mm(u_mm)),
    };
    let mut due = cause.words().to_owned();
    if !others.is_empty() {
        let names: Vec<&str> = others.iter().take(NAMES_TOLD).map(|k| outlook.comparison[*k].name.as_str()).collect();
        let more = if others.len() > NAMES_TOLD { ", …" } else { "" };
        let named = names.join(", ") + more;
        due = format!("{due}; so it is at {} more: {named}", others.len());
    }
    let message = format!(
        "[[comparison]] \"{}\": U (k = 2) is expected to be about {u_words}, too much for the tolerance from {} to {} mm: no \
         deviation could pass. Most of it is due to {due}",
        point.name, point.lower_mm, point.upper_mm,
    );
    Diagnostic::warning(message).in_file(&point.file).at_line(point.line).with_help(cause.help())
}

/// What each comparison point's uncertainty would be without one of its causes.
struct Causes {
    without: Vec<(Cause, Vec<f64>)>,
    /// By points and datums alone.
    bare: Vec<ExpectedU>,
}

impl Causes {
    fn of(outlook: &Outlook) -> Self {
        let u_mm = |uncertainty| Outlook { uncertainty, ..*outlook }.expected_u_mm().unwrap_or_default();
        let without = Cause::without(outlook.uncertainty).map(|(cause, settings)| (cause, u_mm(settings)));
        let bare = Outlook { uncertainty: UncertaintySettings::default(), ..*outlook };
        Self { without: without.into(), bare: bare.expected().unwrap_or_default() }
    }

    /// The one that takes most off the variance when it is gone.
    fn largest(&self, k: usize, u_mm: f64) -> Cause {
        let by_settings = self.without.iter().filter_map(|(cause, without)| {
            let left_mm = without.get(k)?;
            Some((*cause, u_mm * u_mm - left_mm * left_mm))
        });
        let bare = self
            .bare
            .get(k)
            .map(|bare| [(Cause::Datums, bare.pose_mm * bare.pose_mm), (Cause::Points, bare.point_mm * bare.point_mm)]);
        let all = by_settings.chain(bare.into_iter().flatten());
        all.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(Cause::Points, |(cause, _)| cause)
    }
}

/// Times the points needed below which a window or region is told: single scans have fewer than the mean, and lean takes some.
const SPARE: f64 = 1.5;

/// Warns of windows and regions of the plan that will hold too few points.
fn window_warnings(outlook: &Outlook) -> Vec<Diagnostic> {
    let source = if outlook.rig.is_some() { "by [rig]" } else { "without [rig]" };
    let points_on = |geometry: &Geometry, area_mm2: f64| {
        // From the side that sees less of it.
        let of = |side| outlook.expected_at(geometry, side).points_on(area_mm2);
        of(Side::Top).min(of(Side::Bottom))
    };
    let window = |point: &ComparisonPoint| {
        let radius_mm = point.surface_fit.radius_mm?;
        let count = points_on(&point.geometry, std::f64::consts::PI * radius_mm * radius_mm);
        (count < SPARE * surface::NEEDED as f64).then(|| {
            let message = format!(
                "[[comparison]] \"{}\" radius_mm: a window of {radius_mm} mm will hold about {count:.0} points {source}, \
                 {} are needed: the point may not be measured",
                point.name,
                surface::NEEDED,
            );
            let help = "give a larger radius, or leave radius_mm out: the scan's spacing tells the window then";
            Diagnostic::warning(message).in_file(&point.file).at_line(point.line).with_help(help)
        })
    };
    outlook.comparison.iter().filter_map(window).collect()
}

/// Warns of edge points where the CAD's edge turns or meets another one too soon for points as far apart as the rig's: no scan will
/// tell them.
fn edge_warnings(outlook: &Outlook) -> Vec<Diagnostic> {
    let Some(part) = outlook.part else { return Vec::new() };
    let spacing_mm = point_spacing_mm(outlook.rig);
    let source = if outlook.rig.is_some() { "by [rig]" } else { "without [rig]" };
    let warning = |point: &ComparisonPoint| {
        let Geometry::Edge { position, direction, normal } = &point.geometry else { return None };
        let of = |side| {
            let axes = [direction, normal];
            edge_length_mm(part, part.face(side), axes, position, search_mm(point), spacing_mm)
        };
        let why = [Side::Top, Side::Bottom].into_iter().find_map(|side| of(side).err())?;
        let message = format!(
            "[[comparison]] \"{}\": {}; {source} they lie {spacing_mm:.2} mm apart: the point will not be measured",
            point.name, why.reason
        );
        let help = "move it along the edge, away from corners and other edges, or measure with points closer together";
        Some(Diagnostic::warning(message).in_file(&point.file).at_line(point.line).with_help(help))
    };
    outlook.comparison.iter().filter_map(warning).collect()
}

/// Warns of regions of a best fit that will hold too few points; they stand in the plan `file`.
pub fn region_warnings(outlook: &Outlook, file: &Path) -> Vec<Diagnostic> {
    let (AlignmentMethod::Regions(fit), Some(part)) = (outlook.method, outlook.part) else { return Vec::new() };
    let expected = Expected::of(outlook.rig);
    let warning = |region: &FitRegion| {
        let area_mm2 = region_places(part, Side::Top, region).area_mm2;
        let count = expected.points_on(area_mm2);
        (count < SPARE * REGION_LEAST_POINTS as f64).then(|| {
            let message = format!(
                "[[alignment.region]] \"{}\": its {area_mm2:.2} mm² of the CAD will hold about {count:.0} points, \
                 {REGION_LEAST_POINTS} are needed: nothing may be measured",
                region.name,
            );
            let help = "give the region a larger radius_mm or size_mm";
            Diagnostic::warning(message).in_file(file).at_line(region.line).with_help(help)
        })
    };
    fit.regions.iter().filter_map(warning).collect()
}

/// Warns of a plan that reads the slot's axis, with the expected error at the comparison point where it is largest. `None` for
/// the other readings, and for datums that do not hold the part (which has its own message). The warning has no place yet.
pub fn axis_reading_warning(outlook: &Outlook) -> Option<Diagnostic> {
    let AlignmentMethod::Features { hole, slot, slot_reading: SlotReading::Axis, point } = *outlook.method else {
        return None;
    };
    let feature = outlook.features.get(slot)?;
    let Geometry::Slot { length_mm, width_mm, .. } = feature.geometry else { return None };
    let by_line = AlignmentMethod::Features { hole, slot, slot_reading: SlotReading::CentreLine, point };
    let errors = outlook.pose_errors_mm()?;
    let (worst, error) = outlook.comparison.iter().zip(&errors).max_by(|a, b| a.1.total_cmp(b.1))?;
    let line = pose(outlook, &by_line, Side::Top, Figures::Scatter);
    let expected = Expected::of(outlook.rig);
    let OpeningStd { turn_rad, tilt_rad, .. } = expected.opening(length_mm, width_mm);
    let source = if outlook.rig.is_some() { "from [rig]" } else { "without [rig]" };
    let other = line.map_or(String::new(), |line| {
        format!("; \"centre_line\" would be about {}", mm(error_mm(&line, &worst.geometry)))
    });
    let message = format!(
        "[alignment] slot_reading: the axis of slot \"{}\" ({length_mm} x {width_mm} mm) is only known to about {:.2} mrad in the \
         sheet and {:.2} mrad out of it at {:.3} mm between points ({source}); expected error (standard deviation) about {} at \
         point \"{}\"{other}",
        feature.name,
        1e3 * turn_rad,
        1e3 * tilt_rad,
        expected.spacing_mm,
        mm(*error),
        worst.name,
    );
    let help = "write slot_reading = \"centre_line\", unless the drawing asks for the slot's axis";
    Some(Diagnostic::warning(message).with_help(help))
}

/// A length with two telling digits.
pub(super) fn mm(length_mm: f64) -> String {
    let digits = if length_mm >= 0.1 { 2 } else { 3 };
    format!("{length_mm:.digits$} mm")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::part::{Part, PartSettings};
    use crate::plan::{CadSide, Plan, RegionFit, RegionShape, SurfaceMethod};
    use crate::run::RunContext;
    use crate::simulate::{BracketParameters, bracket};

    fn demo(reading: SlotReading) -> Plan {
        let mut plan = bracket(&BracketParameters { spacing_mm: 8.0, ..BracketParameters::default() }).plan();
        let AlignmentMethod::Features { slot_reading, .. } = &mut plan.alignment else {
            panic!("the bracket has datums")
        };
        *slot_reading = reading;
        plan
    }

    /// No datum and nothing else can make U smaller than the point's own fit; a plan's contributions add in squares.
    #[test]
    fn a_tolerance_below_the_expected_u_is_told_with_both_figures() {
        let mut plan = demo(SlotReading::CentreLine);
        assert_eq!(tolerance_warnings(&Outlook::of(&plan)), []);
        let u = Outlook::of(&plan).expected_u_mm().unwrap();
        let own = 2.0 * Expected::of(None).as_told().surface_mm(SurfaceMethod::Local, 5.0);
        assert!(u[0] > own && u.iter().all(|u| *u < 0.3), "{u:?}");
        (plan.comparison[0].lower_mm, plan.comparison[0].upper_mm) = (-0.9 * u[0], 0.9 * u[0]);
        (plan.comparison[1].lower_mm, plan.comparison[1].upper_mm) = (-1.1 * u[1], 1.1 * u[1]);
        let told = tolerance_warnings(&Outlook::of(&plan));
        let (name, figure) = (&plan.comparison[0].name, mm(u[0]));
        assert!(told.len() == 1 && told[0].message.contains(name) && told[0].message.contains(&figure), "{told:?}");
        plan.uncertainty.system_mm = 10.0;
        // At the point itself, and at the datums, which lever it.
        let with_system = Outlook::of(&plan).expected().unwrap()[0];
        assert!((with_system.point_mm - own.hypot(20.0)).abs() < 1e-9 && with_system.pose_mm > 10.0);
        let told = tolerance_warnings(&Outlook::of(&plan));
        // All of one cause: together, at the worst one.
        let words = format!("so it is at {} more", plan.comparison.len() - 1);
        assert!(
            told.len() == 1 && told[0].message.contains(&words) && told[0].message.contains("system_mm"),
            "{told:?}"
        );
        plan.alignment = AlignmentMethod::BestFit;
        plan.uncertainty.system_mm = 0.0;
        assert_eq!(Outlook::of(&plan).expected_u_mm().unwrap()[0], own);
    }

    fn sample() -> (Plan, Part) {
        let made = bracket(&BracketParameters { spacing_mm: 4.0, ..BracketParameters::default() });
        let settings = PartSettings { cad_side: CadSide::Top, thickness_mm: 1.2, plan_directions: Vec::new() };
        let part = Part::prepare(made.mesh.clone(), String::new(), &settings, &RunContext::silent()).unwrap();
        (made.plan(), part)
    }

    /// 5000 ppm is 0.5 mm in 100 mm (k = 1), and the bracket is 230 mm long: points far from its datums cannot be judged to 0.5 mm.
    #[test]
    fn a_cause_that_only_the_cad_shows_is_named() {
        let (mut plan, part) = sample();
        plan.uncertainty.scale_ppm = 5000.0;
        assert_eq!(expected_warnings(&Outlook::of(&plan)), []);
        let told = expected_warnings(&Outlook { part: Some(&part), ..Outlook::of(&plan) });
        assert!(!told.is_empty() && told.iter().all(|d| d.message.contains("scale_ppm")), "{told:?}");
        (plan.uncertainty.scale_ppm, plan.uncertainty.thickness_mm) = (0.0, 2.0);
        let told = expected_warnings(&Outlook { part: Some(&part), ..Outlook::of(&plan) });
        assert!(!told.is_empty() && told.iter().all(|d| d.message.contains("thickness_mm")), "{told:?}");
    }

    /// The part is moved until the datum is where it should be: nothing is left of the errors of either.
    #[test]
    fn a_comparison_point_that_is_a_datum_is_known_as_well_as_its_lock() {
        let (mut plan, part) = sample();
        let AlignmentMethod::Features { point, .. } = plan.alignment else { panic!("the bracket has datums") };
        plan.comparison[0].geometry = plan.features[point].geometry.clone();
        for part in [None, Some(&part)] {
            let expected = Outlook { part, ..Outlook::of(&plan) }.expected().unwrap();
            assert!(expected[0].u_mm < 0.2 * expected[1].u_mm, "{expected:?}");
        }
        (plan.comparison[0].lower_mm, plan.comparison[0].upper_mm) = (-0.03, 0.03);
        assert_eq!(expected_warnings(&Outlook { part: Some(&part), ..Outlook::of(&plan) }), []);
    }

    /// The bracket's edge points lie clear of its corners; one that is pushed along its edge comes to where that turns.
    #[test]
    fn an_edge_point_too_near_a_corner_is_told_before_any_scan() {
        let (mut plan, part) = sample();
        let told = |plan: &Plan| edge_warnings(&Outlook { part: Some(&part), ..Outlook::of(plan) });
        plan.rig = Some(crate::plan::Rig { point_spacing_mm: Some(0.6), ..crate::plan::Rig::PAPER });
        assert_eq!(told(&plan), []);
        let at = plan.comparison.iter().position(|p| p.geometry.kind() == "edge").unwrap();
        let Geometry::Edge { position, direction, normal } = plan.comparison[at].geometry.clone() else { panic!() };
        let along = direction.cross(&normal);
        let found = (1..200).find_map(|k| {
            let position = position + along * f64::from(k);
            plan.comparison[at].geometry = Geometry::Edge { position, direction, normal };
            told(&plan).pop().filter(|d| d.message.contains("runs straight over"))
        });
        let told = found.expect("the edge ends").to_string();
        assert!(told.contains("0.60 mm apart: the point will not be measured") && told.contains("7.2 mm"), "{told}");
    }

    /// 0.2 mm: 0.73 pi 0.04 / 0.028 = 3 points; a ball of 0.3 mm: seven.
    #[test]
    fn windows_and_regions_of_too_few_points_are_told() {
        let (mut plan, part) = sample();
        plan.comparison[0].surface_fit.radius_mm = Some(0.2);
        // So small a window cannot judge the tolerance either, which is another warning.
        let told = window_warnings(&Outlook { part: Some(&part), ..Outlook::of(&plan) });
        assert!(told.len() == 1 && told[0].message.contains("about 3 points"), "{told:?}");
        plan.comparison[0].surface_fit.radius_mm = Some(2.0);
        assert_eq!(expected_warnings(&Outlook { part: Some(&part), ..Outlook::of(&plan) }), []);
        let region = |name: &str, point: usize, radius_mm| FitRegion {
            name: name.into(),
            centre: plan.comparison[point].geometry.position(),
            shape: RegionShape::Ball { radius_mm },
            weight: 1.0,
            line: 7,
        };
        let regions = vec![region("tiny", 0, 0.3), region("large", 1, 5.0)];
        plan.alignment = AlignmentMethod::Regions(RegionFit { regions, freeze: Vec::new() });
        let outlook = Outlook { part: Some(&part), ..Outlook::of(&plan) };
        let told = region_warnings(&outlook, Path::new("p.toml"));
        assert!(told.len() == 1 && told[0].message.contains("\"tiny\"") && told[0].line == Some(7), "{told:?}");
    }

    #[test]
    fn only_the_axis_reading_is_warned_of() {
        assert_eq!(axis_reading_warning(&Outlook::of(&demo(SlotReading::CentreLine))), None);
        let told = axis_reading_warning(&Outlook::of(&demo(SlotReading::Axis))).unwrap().to_string();
        assert!(told.contains("at point \"P0"), "{told}");
    }
}
