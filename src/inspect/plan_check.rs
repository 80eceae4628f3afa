//! The plan against the CAD: points that are not where the CAD has its surface, directions that do not fit it, holes that are
//! not there.
//!
//! Everything is compared with the CAD's own surface, not with the face moved by the sheet's thickness.

use super::region_check::check_regions;
use crate::diagnostic::Diagnostic;
use crate::geometry::{Point3, UnitVector3, Vector3};
use crate::part::{Face, Part, Rim, rims};
use crate::plan::{CadSide, ComparisonPoint, Draft, Feature, Geometry, Plan, Side};
use std::path::Path;

/// A position this far from the CAD is told: rounding in a drawing stays below.
const FAR_MM: f64 = 1.0;
/// A point this far from a trimmed edge or a hole's centre is told.
const FAR_FROM_EDGE_MM: f64 = 2.0;
/// Farther than this, or than a tenth of the part, and the plan belongs to another CAD, unit or frame.
const ELSEWHERE_MM: f64 = 25.0;
/// The same as a share of the CAD's diagonal.
const ELSEWHERE_SHARE: f64 = 0.1;
/// A direction this far off the CAD's is told, rad.
const SLANT: f64 = 15.0 * std::f64::consts::PI / 180.0;
/// Sizes that differ by more than this share are told: a tessellated rim of a hole stays below.
const SIZE_SHARE: f64 = 0.1;
/// How far outwards and inwards of a trimmed edge the surface is looked for, mm.
const STEP_MM: f64 = 2.0;

/// Compares every feature and comparison point of a plan with the CAD. Warnings, and errors where a point is so far away that the
/// plan cannot belong to this CAD; in the plan's order of files and lines.
pub fn check_against_part(plan: &Plan, part: &Part) -> Vec<Diagnostic> {
    let mut found = check_points(&plan.path, &plan.features, &plan.comparison, part);
    found.extend(check_regions(&plan.path, Some(&plan.alignment), part));
    found
}

/// The same for what is sound of a plan.
pub fn check_draft(draft: &Draft, part: &Part) -> Vec<Diagnostic> {
    let mut found = check_points(&draft.path, &draft.features, &draft.comparison, part);
    found.extend(check_regions(&draft.path, draft.alignment.as_ref(), part));
    found
}

fn check_points(path: &Path, features: &[Feature], comparison: &[ComparisonPoint], part: &Part) -> Vec<Diagnostic> {
    let nominal = Nominal::of(part);
    let mut found = Vec::new();
    for feature in features {
        let place = format!("[[feature]] \"{}\"", feature.name);
        let mut notes = Notes { file: path, line: feature.line, place, position_key: "position", found: &mut found };
        if matches!(feature.geometry, Geometry::Hole { .. } | Geometry::Slot { .. }) {
            notes.position_key = "centre";
        }
        nominal.check(&feature.geometry, &mut notes);
    }
    for point in comparison {
        let place = format!("[[comparison]] \"{}\"", point.name);
        let mut notes =
            Notes { file: &point.file, line: point.line, place, position_key: "position", found: &mut found };
        nominal.check(&point.geometry, &mut notes);
    }
    found.sort_by_key(|d| (d.file.as_deref() != Some(path), d.line));
    found
}

/// Where the findings about one point go.
struct Notes<'a> {
    file: &'a Path,
    line: usize,
    place: String,
    position_key: &'static str,
    found: &'a mut Vec<Diagnostic>,
}

impl Notes<'_> {
    fn warn(&mut self, key: &str, words: String, help: String) {
        let message = format!("{} {key}: {words}", self.place);
        self.add(Diagnostic::warning(message).at_key(key).with_help(help));
    }

    fn add(&mut self, diagnostic: Diagnostic) {
        self.found.push(diagnostic.in_file(self.file).at_line(self.line));
    }

    /// A place that is `distance_mm` from the nearest fitting place of the CAD.
    fn distance(&mut self, limit_mm: f64, elsewhere_mm: f64, distance_mm: f64, of: &str, nearest: &Point3) {
        if distance_mm <= limit_mm {
            return;
        }
        let key = self.position_key;
        let message = format!("{} {key}: is {distance_mm:.3} mm from {of}, expected {limit_mm} mm at most", self.place);
        if distance_mm > elsewhere_mm {
            let help =
                format!("check the unit and the frame of the CAD; its nearest place is {}", position_words(nearest));
            self.add(Diagnostic::error(message).at_key(key).with_help(help));
        } else {
            let help = format!("the nearest place of the CAD is {key} = {}", position_words(nearest));
            self.add(Diagnostic::warning(message).at_key(key).with_help(help));
        }
    }

    /// A direction against the CAD's own; more than a right angle off has its own words, because signs change then.
    fn slant(&mut self, key: &str, given: &UnitVector3, cad: &UnitVector3, what: &str) {
        let angle = given.angle(cad);
        if angle <= SLANT {
            return;
        }
        let help = format!("the CAD has {key} = {}", direction_words(cad));
        if angle > std::f64::consts::FRAC_PI_2 {
            let words = format!(
                "points against {what} of the CAD ({:.1} degrees off), so that deviations change their sign",
                angle.to_degrees()
            );
            self.warn(key, words, help);
        } else {
            let limit = SLANT.to_degrees();
            let words =
                format!("is {:.1} degrees off {what} of the CAD, expected {limit:.0} at most", angle.to_degrees());
            self.warn(key, words, help);
        }
    }

    fn size(&mut self, key: &str, given_mm: f64, cad_mm: f64, what: &str) {
        if (given_mm / cad_mm - 1.0).abs() > SIZE_SHARE {
            let words = format!("is {given_mm}, but {what} of the CAD there is {cad_mm:.2} mm");
            self.warn(
                key,
                words,
                format!("check the size, or whether another opening is meant; the CAD has {key} = {cad_mm:.2}"),
            );
        }
    }
}

/// A face whose surface is the CAD's, apart from a shift along its normals.
struct NominalFace<'a> {
    face: &'a Face,
    /// Turns the face's outward normal into the CAD's.
    sign: f64,
    /// From the CAD to the face along the CAD's normal.
    shift_mm: f64,
    rims: Vec<Rim>,
}

/// A place of the CAD.
struct CadPlace {
    point: Point3,
    normal: UnitVector3,
    distance_mm: f64,
}

impl NominalFace<'_> {
    fn closest(&self, p: &Point3) -> Option<CadPlace> {
        let hit = self.face.closest(p, f64::INFINITY)?;
        let normal = self.cad_normal(&hit.normal);
        let point = hit.point - normal.into_inner() * self.shift_mm;
        Some(CadPlace { point, normal, distance_mm: (p - point).norm() })
    }

    /// Nearest place on a trimmed edge or rim, on the CAD itself.
    fn closest_edge(&self, p: &Point3) -> Option<CadPlace> {
        let on_face = self.face.closest_edge(p, f64::INFINITY)?;
        let mut place = self.closest(&on_face)?;
        place.point = on_face - place.normal.into_inner() * self.shift_mm;
        place.distance_mm = (p - place.point).norm();
        Some(place)
    }

    fn cad_normal(&self, outward: &UnitVector3) -> UnitVector3 {
        UnitVector3::new_unchecked(outward.into_inner() * self.sign)
    }
}

/// The CAD's own surface.
struct Nominal<'a> {
    faces: Vec<NominalFace<'a>>,
    elsewhere_mm: f64,
}

impl<'a> Nominal<'a> {
    fn of(part: &'a Part) -> Self {
        let sides: &[(Side, f64)] = match part.cad_side {
            CadSide::Top | CadSide::Middle => &[(Side::Top, 1.0)],
            CadSide::Bottom => &[(Side::Bottom, -1.0)],
            CadSide::Solid => &[(Side::Top, 1.0), (Side::Bottom, 1.0)],
        };
        let face = |(side, sign): &(Side, f64)| {
            let face = part.face(*side);
            let shift_mm = part.cad_side.face_offset_mm(*side, part.thickness_mm);
            NominalFace { face, sign: *sign, shift_mm, rims: rims(face) }
        };
        let elsewhere_mm = ELSEWHERE_MM.min(ELSEWHERE_SHARE * part.diagonal_mm()).max(FAR_FROM_EDGE_MM);
        Self { faces: sides.iter().map(face).collect(), elsewhere_mm }
    }

    fn check(&self, geometry: &Geometry, notes: &mut Notes<'_>) {
        match geometry {
            Geometry::Surface { position, direction } => {
                let Some(place) = self.nearest(|face| face.closest(position)) else { return };
                notes.distance(FAR_MM, self.elsewhere_mm, place.distance_mm, "the CAD's surface", &place.point);
                if place.distance_mm <= self.elsewhere_mm {
                    notes.slant("direction", direction, &place.normal, "the surface normal");
                }
            }
            Geometry::Edge { position, direction, normal } => self.check_edge(position, direction, normal, notes),
            Geometry::Hole { centre, axis, diameter_mm, .. } => {
                let Some(rim) = self.check_rim(centre, axis, notes) else { return };
                if rim.length_mm > rim.width_mm * (1.0 + 2.0 * SIZE_SHARE) {
                    let words = format!(
                        "lies in an opening of {:.2} x {:.2} mm, expected a round one",
                        rim.length_mm, rim.width_mm
                    );
                    notes.warn(
                        notes.position_key,
                        words,
                        "check whether another opening is meant, or kind = \"slot\"".to_owned(),
                    );
                } else {
                    notes.size("diameter_mm", *diameter_mm, rim.diameter_mm, "the hole");
                }
            }
            Geometry::Slot { centre, axis, direction, length_mm, width_mm } => {
                let Some(rim) = self.check_rim(centre, axis, notes) else { return };
                notes.size("length_mm", *length_mm, rim.length_mm, "the opening's length");
                notes.size("width_mm", *width_mm, rim.width_mm, "the opening's width");
                // A long axis has no sense: either way round is right.
                let along = if rim.long_axis.dot(direction) < 0.0 { -rim.long_axis } else { rim.long_axis };
                if rim.length_mm > rim.width_mm * (1.0 + 2.0 * SIZE_SHARE) {
                    notes.slant("direction", direction, &along, "the slot's long axis");
                }
            }
        }
    }

    fn check_edge(&self, position: &Point3, direction: &UnitVector3, normal: &UnitVector3, notes: &mut Notes<'_>) {
        let Some(place) = self.nearest(|face| face.closest_edge(position)) else {
            let words = "lies on a CAD without any trimmed edge".to_owned();
            notes.warn(notes.position_key, words, "check whether the CAD is one face of the sheet".to_owned());
            return;
        };
        notes.distance(
            FAR_FROM_EDGE_MM,
            self.elsewhere_mm,
            place.distance_mm,
            "the nearest trimmed edge",
            &place.point,
        );
        if place.distance_mm > self.elsewhere_mm {
            return;
        }
        notes.slant("normal", normal, &place.normal, "the surface normal");
        let off_surface = |step: f64| {
            let beside = place.point + direction.into_inner() * step;
            self.nearest(|face| face.closest(&beside)).map_or(0.0, |p| p.distance_mm)
        };
        let (outside, inside) = (off_surface(STEP_MM), off_surface(-STEP_MM));
        if outside < inside {
            let words = "points into the sheet, expected outwards, so that deviations change their sign".to_owned();
            notes.warn("direction", words, format!("turn it round: direction = {}", direction_words(&-*direction)));
        } else if let Some(outwards) = self.outwards(&place.point, direction, &place.normal) {
            notes.slant("direction", direction, &outwards, "the outward direction");
        }
    }

    /// The direction out of the sheet at an edge: from the edge's nearest place to a point a step outside.
    fn outwards(&self, on_edge: &Point3, direction: &UnitVector3, normal: &UnitVector3) -> Option<UnitVector3> {
        let outside = on_edge + direction.into_inner() * STEP_MM;
        let edge = self.nearest(|face| face.closest_edge(&outside))?;
        let away: Vector3 = outside - edge.point;
        let in_sheet = away - normal.into_inner() * away.dot(normal);
        UnitVector3::try_new(in_sheet, 0.1 * STEP_MM)
    }

    /// The opening nearest to a centre, after its place and axis were compared.
    fn check_rim(&self, centre: &Point3, axis: &UnitVector3, notes: &mut Notes<'_>) -> Option<&Rim> {
        let key = notes.position_key;
        let of = self.faces.iter().flat_map(|f| f.rims.iter().map(move |r| (f, r)));
        let place = |(f, r): (&NominalFace<'_>, &Rim)| r.centre - f.cad_normal(&r.axis).into_inner() * f.shift_mm;
        let nearest = of.min_by(|a, b| {
            (place((a.0, a.1)) - centre).norm_squared().total_cmp(&(place((b.0, b.1)) - centre).norm_squared())
        });
        let Some((face, rim)) = nearest else {
            let help = "check whether the CAD has its holes cut out, and is one face of the sheet".to_owned();
            notes.warn(key, "lies on a CAD without any opening, expected a hole rim around it".to_owned(), help);
            return None;
        };
        let cad_centre = place((face, rim));
        let distance_mm = (cad_centre - centre).norm();
        notes.distance(
            FAR_MM,
            self.elsewhere_mm,
            distance_mm,
            "the centre of the nearest opening of the CAD",
            &cad_centre,
        );
        // Outside the nearest opening the sizes and axis of that opening say nothing about this one.
        if distance_mm > 0.5 * rim.length_mm {
            return None;
        }
        notes.slant("axis", axis, &face.cad_normal(&rim.axis), "the opening's normal");
        Some(rim)
    }

    fn nearest(&self, of: impl Fn(&NominalFace<'a>) -> Option<CadPlace>) -> Option<CadPlace> {
        self.faces.iter().filter_map(of).min_by(|a, b| a.distance_mm.total_cmp(&b.distance_mm))
    }
}

fn position_words(p: &Point3) -> String {
    format!("[{:.3}, {:.3}, {:.3}]", p.x, p.y, p.z)
}

fn direction_words(d: &UnitVector3) -> String {
    let d = d.map(|c| (c * 1e4).round() / 1e4 + 0.0);
    format!("[{}, {}, {}]", d.x, d.y, d.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostic::Severity;
    use crate::part::PartSettings;
    use crate::run::RunContext;
    use crate::simulate::{BracketParameters, SyntheticPart, bracket};

    fn sample(cad_side: CadSide) -> (SyntheticPart, Part) {
        let made = bracket(&BracketParameters::default());
        let settings = PartSettings { cad_side, thickness_mm: made.thickness_mm, plan_directions: Vec::new() };
        let part = Part::prepare(made.mesh.clone(), String::new(), &settings, &RunContext::silent()).unwrap();
        (made, part)
    }

    fn words(plan: &Plan, part: &Part) -> Vec<String> {
        check_against_part(plan, part).iter().map(ToString::to_string).collect()
    }

    #[test]
    fn the_plan_of_a_part_fits_its_cad_whichever_skin_the_cad_is() {
        for side in [CadSide::Top, CadSide::Bottom, CadSide::Middle] {
            let (made, part) = sample(side);
            assert_eq!(words(&made.plan(), &part), Vec::<String>::new(), "{side:?}");
        }
    }

    #[test]
    fn a_point_off_the_surface_is_told_with_its_distance_and_the_nearest_place() {
        let (made, part) = sample(CadSide::Top);
        let mut plan = made.plan();
        let Geometry::Surface { position, direction } = &mut plan.comparison[0].geometry else { panic!() };
        let nominal = *position;
        *position += direction.into_inner() * 3.214;
        plan.comparison[0].line = 41;
        let found = check_against_part(&plan, &part);
        assert_eq!(found.len(), 1, "{found:?}");
        assert_eq!((found[0].severity, found[0].line), (Severity::Warning, Some(41)));
        let name = &plan.comparison[0].name;
        // The CAD is flat to its tessellation there, so that the distance is the shift to 0.01 mm.
        assert!(found[0].message.starts_with(&format!("[[comparison]] \"{name}\" position: is 3.21")), "{}", found[0]);
        let near = &part.face(Side::Top).closest(&nominal, 1.0).unwrap().point;
        // The foot of the moved point and that of the nominal one differ by the tessellation's height times a small slope.
        let told = found[0].help.as_ref().unwrap().split(['[', ',', ']']).nth(1).unwrap().parse::<f64>().unwrap();
        assert!((told - near.x).abs() < 0.05, "{}", found[0]);
        let Geometry::Surface { position, direction } = &mut plan.comparison[0].geometry else { panic!() };
        *position += direction.into_inner() * 40.0;
        assert_eq!(check_against_part(&plan, &part)[0].severity, Severity::Error);
    }

    #[test]
    fn slanted_and_opposite_directions_have_words_of_their_own() {
        let (made, part) = sample(CadSide::Top);
        let tell = |change: &dyn Fn(&mut Plan)| {
            let mut plan = made.plan();
            change(&mut plan);
            words(&plan, &part).join("\n")
        };
        let slanted = tell(&|plan| {
            let Geometry::Surface { direction, .. } = &mut plan.comparison[0].geometry else { panic!() };
            let aside = direction.cross(&Vector3::new(0.3, 1.0, 0.2)).normalize();
            *direction = UnitVector3::new_normalize(direction.into_inner() + aside * 20.0_f64.to_radians().tan());
        });
        assert!(slanted.contains("degrees off the surface normal of the CAD, expected 15 at most"), "{slanted}");
        let turned = tell(&|plan| {
            let Geometry::Surface { direction, .. } = &mut plan.comparison[0].geometry else { panic!() };
            *direction = -*direction;
        });
        assert!(turned.contains("direction: points against the surface normal of the CAD"), "{turned}");
        let edge = made.comparison.iter().position(|c| c.geometry.kind() == "edge").unwrap();
        let inwards = tell(&|plan| {
            let Geometry::Edge { direction, .. } = &mut plan.comparison[edge].geometry else { panic!() };
            *direction = -*direction;
        });
        assert!(inwards.contains("direction: points into the sheet, expected outwards"), "{inwards}");
        let along = tell(&|plan| {
            let Geometry::Edge { direction, normal, .. } = &mut plan.comparison[edge].geometry else { panic!() };
            let tangent = direction.cross(normal);
            *direction = UnitVector3::new_normalize(direction.into_inner() + tangent * 30.0_f64.to_radians().tan());
        });
        assert!(along.contains("degrees off the outward direction of the CAD"), "{along}");
        let away = tell(&|plan| {
            let Geometry::Edge { position, direction, .. } = &mut plan.comparison[edge].geometry else { panic!() };
            *position -= direction.into_inner() * 5.0;
        });
        assert!(away.contains("position: is 5.0") && away.contains("mm from the nearest trimmed edge"), "{away}");
    }

    #[test]
    fn holes_and_slots_are_compared_with_the_rims() {
        let (made, part) = sample(CadSide::Top);
        let (hole, slot) = (made.feature("H1").unwrap(), made.feature("S1").unwrap());
        let tell = |change: &dyn Fn(&mut Plan)| {
            let mut plan = made.plan();
            change(&mut plan);
            words(&plan, &part).join("\n")
        };
        let shifted = tell(&|plan| {
            let Geometry::Hole { centre, .. } = &mut plan.features[hole].geometry else { panic!() };
            centre.x += 2.5;
        });
        assert!(shifted.contains("[[feature]] \"H1\" centre: is 2.50"), "{shifted}");
        let wide = tell(&|plan| {
            let Geometry::Hole { diameter_mm, .. } = &mut plan.features[hole].geometry else { panic!() };
            *diameter_mm *= 1.3;
        });
        assert!(wide.contains("[[feature]] \"H1\" diameter_mm: is"), "{wide}");
        let turned = tell(&|plan| {
            let Geometry::Hole { axis, .. } = &mut plan.features[hole].geometry else { panic!() };
            *axis = -*axis;
        });
        assert!(turned.contains("axis: points against the opening's normal of the CAD"), "{turned}");
        let long = tell(&|plan| {
            let Geometry::Slot { axis, direction, length_mm, .. } = &mut plan.features[slot].geometry else { panic!() };
            *length_mm *= 1.2;
            *direction = UnitVector3::new_normalize(axis.cross(direction));
        });
        assert!(long.contains("\"S1\" length_mm: is") && long.contains("direction: is 90.0 degrees off"), "{long}");
        let swapped = tell(&|plan| plan.features.swap(hole, slot));
        assert_eq!(swapped, "");
        let in_slot = tell(&|plan| {
            let Geometry::Slot { centre, axis, .. } = plan.features[slot].geometry.clone() else { panic!() };
            plan.features[hole].geometry = Geometry::Hole { centre, axis, diameter_mm: 9.0, direction: None };
        });
        assert!(in_slot.contains("centre: lies in an opening of"), "{in_slot}");
    }
}
