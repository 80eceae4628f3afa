//! The plan's regions against the CAD: whether there is surface in them, and whether together they hold the part.

use crate::align::{region_hold, region_places};
use crate::diagnostic::Diagnostic;
use crate::fit::hold::{Named, Twist, WEAK_CONDITION};
use crate::part::Part;
use crate::plan::{AlignmentMethod, FitRegion, RegionFit, Side};
use std::path::Path;

/// Errors of regions without surface and of motions that stay free, and the warning of one that is held weakly.
pub(super) fn check_regions(path: &Path, method: Option<&AlignmentMethod>, part: &Part) -> Vec<Diagnostic> {
    let Some(AlignmentMethod::Regions(fit)) = method else { return Vec::new() };
    let side = [Side::Top, Side::Bottom].into_iter().find(|side| all_have_surface(part, *side, fit));
    let Some(side) = side else {
        let empty = |region: &&FitRegion| region_places(part, Side::Top, region).places.is_empty();
        return fit.regions.iter().filter(empty).map(|region| off_the_part(path, region, part)).collect();
    };
    let names: Vec<Named> = fit.regions.iter().map(|r| Named { name: &r.name, place: r.centre }).collect();
    let words = |motion: &Twist| format!("the {}", motion.in_words(&names));
    let line = fit.regions.first().map_or(1, |region| region.line);
    let told = match region_hold(part, side, fit) {
        Err(free) => {
            let motions: Vec<String> = free.iter().map(words).collect();
            let message = match motions.as_slice() {
                [only] => format!("[[alignment.region]]: {only} stays free, expected all to be held"),
                all => format!("[[alignment.region]]: {} stay free, expected all to be held", all.join(" and ")),
            };
            let help = "add a region whose surface meets this motion, or keep it from the best fit with freeze";
            Some(Diagnostic::error(message).with_help(help))
        }
        Ok((condition, weakest)) => (condition > WEAK_CONDITION).then(|| {
            let held = words(&weakest);
            let message = format!(
                "[[alignment.region]]: {held} is held {condition:.0} times more weakly than the best held motion"
            );
            let help = "add a region whose surface meets this motion, or keep it from the best fit with freeze";
            Diagnostic::warning(message).with_help(help)
        }),
    };
    told.map(|told| told.in_file(path).at_line(line)).into_iter().collect()
}

fn all_have_surface(part: &Part, side: Side, fit: &RegionFit) -> bool {
    fit.regions.iter().all(|region| !region_places(part, side, region).places.is_empty())
}

fn off_the_part(path: &Path, region: &FitRegion, part: &Part) -> Diagnostic {
    let message =
        format!("[[alignment.region]] \"{}\": found no surface of the CAD within it, expected some", region.name);
    let nearest = part.face(Side::Top).closest(&region.centre, f64::INFINITY);
    let help = nearest.map_or_else(
        || "check the CAD".to_owned(),
        |hit| {
            let [x, y, z]: [f64; 3] = hit.point.coords.into();
            format!("check centre and unit; the nearest place of the CAD is centre = [{x:.3}, {y:.3}, {z:.3}]")
        },
    );
    Diagnostic::error(message).in_file(path).at_line(region.line).with_help(help)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Point3, Vector3};
    use crate::part::PartSettings;
    use crate::plan::{CadSide, Freedom, RegionShape};
    use crate::run::RunContext;
    use crate::simulate::{BracketParameters, bracket};

    fn region(name: &str, centre: [f64; 3], radius_mm: f64) -> FitRegion {
        let shape = RegionShape::Ball { radius_mm };
        FitRegion { name: name.into(), centre: Point3::from(centre), shape, weight: 1.0, line: 7 }
    }

    fn told(part: &Part, regions: Vec<FitRegion>, freeze: Vec<Freedom>) -> Vec<String> {
        let method = AlignmentMethod::Regions(RegionFit { regions, freeze });
        check_regions(Path::new("p.toml"), Some(&method), part).iter().map(ToString::to_string).collect()
    }

    #[test]
    fn regions_off_the_part_and_motions_that_stay_free_are_told() {
        for cad_side in [CadSide::Top, CadSide::Bottom] {
            let made = bracket(&BracketParameters { spacing_mm: 4.0, ..BracketParameters::default() });
            let settings = PartSettings { cad_side, thickness_mm: 1.2, plan_directions: Vec::new() };
            let part = Part::prepare(made.mesh, String::new(), &settings, &RunContext::silent()).unwrap();
            let right = region("right flange", [93.4, 40.3, -7.4], 8.0);
            let front = region("front flange", [10.0, -89.3, 7.9], 8.0);
            let base = [region("A", [40.0, 5.0, 3.7], 12.0), region("B", [75.0, -40.0, 1.1], 12.0)];
            let all: Vec<FitRegion> = base.iter().cloned().chain([right.clone(), front.clone()]).collect();
            // Two small flanges hold the turn in the plane, weakly.
            let weak = told(&part, all.clone(), Vec::new());
            assert!(weak.len() == 1 && weak[0].starts_with("warning: p.toml:7: "), "{cad_side:?}: {weak:?}");
            assert!(weak[0].contains("the turn about ") && weak[0].contains(" times more weakly"), "{weak:?}");
            assert_eq!(told(&part, all, vec![Freedom::Rz]), Vec::<String>::new(), "{cad_side:?}");
            let off = told(&part, vec![right.clone(), region("C", [0.0, 0.0, 60.0], 20.0)], Vec::new());
            assert!(
                off.len() == 1 && off[0].contains("p.toml:7: ") && off[0].contains("\"C\": found no surface"),
                "{off:?}"
            );
            // The foot of the bracket is a plane: three motions along and about it stay free, and are no matter once they are frozen.
            let foot = vec![region("foot", [-103.1, 30.0, -13.6], 4.0)];
            let free = told(&part, foot.clone(), Vec::new());
            assert!(free.len() == 1 && free[0].starts_with("error: ") && free[0].contains("turn about z"), "{free:?}");
            assert!(free[0].contains("shift along"), "{free:?}");
            let held = told(&part, foot, vec![Freedom::X, Freedom::Y, Freedom::Rz]);
            assert!(held.iter().all(|told| told.starts_with("warning: ")), "{held:?}");
        }
    }

    /// The area of a ball's disc on a nearly plane part of the face, to the step of the lattice.
    #[test]
    fn places_of_a_region_are_spread_over_its_area() {
        let made = bracket(&BracketParameters::default());
        let settings = PartSettings { cad_side: CadSide::Top, thickness_mm: 1.2, plan_directions: Vec::new() };
        let part = Part::prepare(made.mesh, String::new(), &settings, &RunContext::silent()).unwrap();
        for side in [Side::Top, Side::Bottom] {
            let places = region_places(&part, side, &region("B", [75.0, -40.0, 1.1], 8.0));
            let disc = std::f64::consts::PI * 64.0;
            assert!((places.area_mm2 / disc - 1.0).abs() < 0.15, "{} {disc}", places.area_mm2);
            let outwards = Vector3::z() * side.sign();
            assert!(places.places.iter().all(|(_, normal)| normal.dot(&outwards) > 0.9));
        }
    }
}
