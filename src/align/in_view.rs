//! Which of the things in view is the plan's part.
//!
//! A scan with one body, or with several that can be one part together, is aligned as it is. Where more is in view, every group of bodies
//! that can be the part by its size is aligned on its own, and the one whose pose is accepted is the part. Its pose then tells of every
//! body whether it lies on the part or beside it; what lies beside it is named and takes no part in anything that follows.
//!
//! Two parts of the plan's kind are refused: a scan has one verdict, and a green light would be taken for both of them. Only where the
//! second one is cut off by the border of the view, so that nobody takes it for inspected, is the whole one inspected.

use super::best_fit::best_fit;
use super::pose::BestFit;
use super::refuse;
use crate::diagnostic::{Refusal, Stop};
use crate::geometry::{Point3, PointCloud, UnitVector3, Vector3};
use crate::part::Part;
use crate::run::RunContext;
use crate::scan::{BeltPlane, Bodies, Body, ConditionedScan, PointClass, ScanHints};

/// A group with less of the part's surface than this is not tried: half of what a deep part shows of itself would be more.
const LEAST_TRIED: f64 = 0.25;
/// Half of a body's points within this of the part's face: it is of the part.
const ON_PART_MM: f64 = 3.0;
/// A second part with less than this share of the first one's points may be one that is cut off.
const CUT_OFF: f64 = 0.8;
/// Where everything in view could be one part by its size and is not, a body that holds this share of it may still be the part.
const NEARLY_ALL: f64 = 0.7;
/// Share of a body's places over or under the part's face at which it contradicts a pose that does not put it on that face.
const CONTRADICTS: f64 = 0.2;
/// Points of the mirrored cloud that tells a twin.
const TWIN_POINTS: usize = 150_000;

/// The plan's part among the things in view.
#[derive(Debug, Clone, PartialEq)]
pub struct InView {
    /// Its best fit.
    pub best_fit: BestFit,
    /// What else is in view: how large, where, and why it is not the part.
    pub warnings: Vec<String>,
}

/// Finds the plan's part. Points of other things lose their place among the kept ones and get the class
/// [`PointClass::Other`].
///
/// # Errors
/// As [`best_fit`]; and when several things could be the part, none is, or more than one is.
pub fn find_part(part: &Part, scan: &mut ConditionedScan, hints: &ScanHints, run: &RunContext) -> Result<InView, Stop> {
    let bodies = Bodies::find(scan, hints);
    if bodies.list.len() < 2 {
        let found = best_fit(part, scan, run).map_err(|stop| touching(stop, &bodies, &[true], hints, scan));
        return Ok(InView { best_fit: found?, warnings: too_much(&bodies, &[true], hints).into_iter().collect() });
    }
    let everything = std::mem::take(&mut scan.kept);
    let (accepted, refused) = (Vec::new(), Vec::new());
    let mut search = Search { part, hints, bodies, run, accepted, refused, of_all: None };
    let chosen = search.try_all(scan).and_then(|()| search.choose(scan));
    match chosen {
        Ok(which) => {
            let mut warnings = search.name_others(scan, which)?;
            let accepted = search.accepted.swap_remove(which);
            warnings.extend(too_much(&search.bodies, &accepted.bodies, hints));
            scan.set_other(&everything, search.bodies.kept_of(&accepted.bodies));
            Ok(InView { best_fit: accepted.best_fit, warnings })
        }
        Err(stop) => {
            scan.kept = everything;
            Err(stop)
        }
    }
}

/// A warning of a part that something hangs together with.
fn too_much(bodies: &Bodies, group: &[bool], hints: &ScanHints) -> Option<String> {
    let area_mm2 = bodies.area_mm2(group);
    (area_mm2 > 1.5 * hints.part_area_mm2).then(|| {
        format!(
            "{:.0} cm² are left, more than the part's {:.0} cm²: something else is in view, or belt was left",
            area_mm2 / 100.0,
            hints.part_area_mm2 / 100.0
        )
    })
}

/// Says of a refused group that is larger than one part that its parts may touch.
fn touching(stop: Stop, bodies: &Bodies, group: &[bool], hints: &ScanHints, scan: &ConditionedScan) -> Stop {
    let is_one_part = bodies.list.is_empty() || bodies.can_be_one_part(group, hints);
    match stop {
        Stop::Refused(refusal) if !is_one_part && refusal.rivals.is_none() => {
            let sizes_mm2 = [bodies.area_mm2(group), hints.part_area_mm2];
            refuse::touching(sizes_mm2, scan.spacing_mm, &refusal).into()
        }
        other => other,
    }
}

/// A group of bodies that is the plan's part.
struct Accepted {
    best_fit: BestFit,
    bodies: Vec<bool>,
}

/// A group that is not, and why.
type NotThePart = (Vec<bool>, Refusal);

struct Search<'a> {
    part: &'a Part,
    hints: &'a ScanHints,
    bodies: Bodies,
    run: &'a RunContext<'a>,
    accepted: Vec<Accepted>,
    refused: Vec<NotThePart>,
    /// Why everything in view together is not the part, where it could be by its size.
    of_all: Option<Refusal>,
}

impl Search<'_> {
    /// Tries every group that can be the part by its size, the largest first.
    fn try_all(&mut self, scan: &mut ConditionedScan) -> Result<(), Stop> {
        let all = vec![true; self.bodies.list.len()];
        let mut groups = self.bodies.groups(self.hints);
        let mut least_mm2 = LEAST_TRIED * self.hints.part_area_mm2;
        if self.bodies.can_be_one_part(&all, self.hints) {
            groups = vec![(0..all.len()).map(|k| k == 0).collect()];
            least_mm2 = least_mm2.max(NEARLY_ALL * self.bodies.area_mm2(&all));
            match self.aligned(scan, all)? {
                Ok(accepted) => {
                    self.accepted.push(accepted);
                    return Ok(());
                }
                // What cannot be told of the whole is not to be told of a piece of it.
                Err((_, refusal)) if refusal.rivals.is_some() => return Err(refusal.into()),
                Err((_, refusal)) => self.of_all = Some(refusal),
            }
        }
        groups.retain(|group| self.bodies.area_mm2(group) >= least_mm2);
        for group in groups {
            if !self.accepted.iter().any(|a| overlap(&a.bodies, &group)) {
                match self.aligned(scan, group)? {
                    Ok(accepted) => self.accepted.push(accepted),
                    Err(refused) => self.refused.push(refused),
                }
            }
        }
        Ok(())
    }

    /// Aligns a group; where its pose says that other bodies belong to the part, or some of these do not, once more with those.
    fn aligned(&self, scan: &mut ConditionedScan, group: Vec<bool>) -> Result<Result<Accepted, NotThePart>, Stop> {
        let first = match self.align(scan, &group)? {
            Ok(found) => found,
            Err(refusal) => return Ok(Err((group, refusal))),
        };
        let Some(own) = self.lying_on_part(&first, &group) else {
            return Ok(Err((group, refuse::contradicted())));
        };
        if own == group {
            return Ok(Ok(Accepted { best_fit: first, bodies: own }));
        }
        Ok(match self.align(scan, &own)? {
            Ok(best_fit) => Ok(Accepted { best_fit, bodies: own }),
            Err(refusal) => Err((own, refusal)),
        })
    }

    fn align(&self, scan: &mut ConditionedScan, group: &[bool]) -> Result<Result<BestFit, Refusal>, Stop> {
        scan.kept = self.bodies.kept_of(group);
        let found = best_fit(self.part, scan, self.run);
        match found.map_err(|stop| touching(stop, &self.bodies, group, self.hints, scan)) {
            Ok(found) => Ok(Ok(found)),
            Err(Stop::Refused(refusal)) => Ok(Err(refusal)),
            Err(cancelled) => Err(cancelled),
        }
    }

    /// Which bodies are the part's in that pose: those that lie on its face; and those of the group that lie over or under
    /// it as the camera sees them, since sheet that is bent far off is the part's, too. `None` where a body outside the group does so:
    /// the pose leaves out what speaks against it.
    fn lying_on_part(&self, found: &BestFit, group: &[bool]) -> Option<Vec<bool>> {
        let face = self.part.face(found.face);
        let away = found.cad_from_scan.vector(&self.bodies.to_camera);
        let high_mm = 2.0 * self.part.diagonal_mm();
        let is_over = |p: &Point3| face.bvh.ray(&(p + away * high_mm), &-away, 2.0 * high_mm).is_some();
        let is_own = |(body, in_group): (&Body, &bool)| {
            let places: Vec<Point3> = body.places.iter().map(|p| found.cad_from_scan.point(p)).collect();
            let share = |count: usize| count as f64 / places.len().max(1) as f64;
            let on = share(places.iter().filter(|p| face.closest(p, ON_PART_MM).is_some()).count());
            let over = share(places.iter().filter(|p| is_over(p)).count());
            match in_group {
                _ if on >= 0.5 => Some(true),
                true => Some(over >= 0.5),
                false if over >= CONTRADICTS => None,
                false => Some(false),
            }
        };
        self.bodies.list.iter().zip(group).map(is_own).collect()
    }

    /// Which of the accepted groups is inspected.
    fn choose(&mut self, scan: &ConditionedScan) -> Result<usize, Stop> {
        let area = |k: usize| self.bodies.area_mm2(&self.accepted[k].bodies);
        let mut order: Vec<usize> = (0..self.accepted.len()).collect();
        order.sort_by(|&a, &b| area(b).total_cmp(&area(a)).then(a.cmp(&b)));
        let Some(&largest) = order.first() else { return Err(self.none_is_the_part().into()) };
        let whole = |&&k: &&usize| !self.is_cut_off(scan, k, largest);
        if let Some(&second) = order[1..].iter().find(whole) {
            let middle = |k: usize| self.bodies.middle(&self.accepted[k].bodies);
            return Err(refuse::two_parts(&middle(largest), &middle(second)).into());
        }
        Ok(largest)
    }

    /// Whether an accepted group is so much smaller than another, and so near the border of the view, that it goes on beyond.
    fn is_cut_off(&self, scan: &ConditionedScan, which: usize, beside: usize) -> bool {
        let [own, other] = [which, beside].map(|k| &self.accepted[k].bodies);
        self.bodies.area_mm2(own) < CUT_OFF * self.bodies.area_mm2(other) && self.bodies.reach_the_border(scan, own)
    }

    fn none_is_the_part(&self) -> Refusal {
        match (&self.of_all, self.refused.as_slice()) {
            (Some(refusal), _) | (None, [(_, refusal)]) => refusal.clone(),
            (None, []) => refuse::pieces(self.hints.part_area_mm2),
            (None, [(_, largest), ..]) => refuse::none_of(self.refused.len(), largest),
        }
    }

    /// What else is in view, in words.
    fn name_others(&self, scan: &ConditionedScan, chosen: usize) -> Result<Vec<String>, Stop> {
        let own = &self.accepted[chosen].bodies;
        let mut warnings = Vec::new();
        for mut group in self.bodies.groups(self.hints) {
            group.iter_mut().zip(own).for_each(|(g, own)| *g &= !own);
            if group.iter().any(|g| *g) {
                warnings.push(self.name(scan, &group)?);
            }
        }
        Ok(warnings)
    }

    fn name(&self, scan: &ConditionedScan, group: &[bool]) -> Result<String, Stop> {
        let area = self.bodies.area_mm2(group);
        let middle = self.bodies.middle(group);
        let place = format!("{:.0} cm² around {} of the scan", area / 100.0, place(&middle));
        if self.accepted.iter().any(|a| overlap(&a.bodies, group)) {
            return Ok(format!(
                "another part of the plan's kind, cut off by the border of the view, was not inspected: {place}"
            ));
        }
        let Some((tried, refusal)) = self.refused.iter().find(|(tried, _)| overlap(tried, group)) else {
            return Ok(format!(
                "something else is in view and was left out: {place}, too little to be the part ({:.0} cm²)",
                self.hints.part_area_mm2 / 100.0
            ));
        };
        if self.is_mirrored_twin(scan, tried)? {
            return Ok(format!(
                "a second part is in view and was not inspected: {place}, the mirrored twin of the plan's part"
            ));
        }
        Ok(format!(
            "something else is in view and was left out: {place}; it is not the plan's part: {}",
            refusal.reason
        ))
    }

    /// Whether a group is accepted once it is mirrored.
    fn is_mirrored_twin(&self, scan: &ConditionedScan, group: &[bool]) -> Result<bool, Stop> {
        let kept = self.bodies.kept_of(group);
        let mirrored = mirrored(scan, &kept, &self.bodies.to_camera);
        match best_fit(self.part, &mirrored, self.run) {
            Ok(_) => Ok(true),
            Err(Stop::Refused(_)) => Ok(false),
            Err(cancelled) => Err(cancelled),
        }
    }
}

fn overlap(a: &[bool], b: &[bool]) -> bool {
    a.iter().zip(b).any(|(a, b)| *a && *b)
}

/// A place in words.
fn place(p: &Point3) -> String {
    format!("({:.0}, {:.0}, {:.0})", p.x, p.y, p.z)
}

/// Some of a scan's points as a mirror shows them that stands upright on the belt, or along the camera's direction.
fn mirrored(scan: &ConditionedScan, kept: &[u32], to_camera: &UnitVector3) -> ConditionedScan {
    let upright = scan.belt.map_or(*to_camera, |belt| belt.normal);
    let across = UnitVector3::new_normalize(upright.cross(&Vector3::ith(upright.iamin(), 1.0)));
    let at = kept.first().map_or(Point3::origin(), |&k| scan.cloud.positions[k as usize]);
    let vector = |d: &Vector3| d - across.into_inner() * (2.0 * d.dot(&across));
    let point = |p: &Point3| at + vector(&(p - at));
    let unit = |d: UnitVector3| UnitVector3::new_normalize(vector(&d));
    let step = kept.len().div_ceil(TWIN_POINTS).max(1);
    let positions: Vec<Point3> = kept.iter().step_by(step).map(|&k| point(&scan.cloud.positions[k as usize])).collect();
    ConditionedScan {
        classes: vec![PointClass::Kept; positions.len()],
        kept: (0..positions.len() as u32).collect(),
        removed: Default::default(),
        belt: scan.belt.map(|b| BeltPlane { point: point(&b.point), normal: unit(b.normal), sigma_mm: b.sigma_mm }),
        belt_clearance_mm: scan.belt_clearance_mm,
        to_camera: scan.to_camera.map(unit),
        spacing_mm: scan.spacing_mm * (step as f64).sqrt(),
        warnings: Vec::new(),
        cloud: PointCloud { positions, ..PointCloud::default() },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::Removed;

    #[test]
    fn a_mirror_keeps_the_belt_and_turns_left_into_right() {
        let normal = UnitVector3::new_normalize(Vector3::new(0.1, -0.2, 1.0));
        let belt = BeltPlane { point: Point3::new(3.0, 4.0, 5.0), normal, sigma_mm: 0.1 };
        let positions = vec![
            Point3::new(0.0, 0.0, 9.0),
            Point3::new(10.0, 0.0, 9.0),
            Point3::new(0.0, 7.0, 9.0),
            Point3::new(0.0, 0.0, 12.0),
        ];
        let scan = ConditionedScan {
            classes: vec![PointClass::Kept; 4],
            kept: vec![0, 1, 2, 3],
            cloud: PointCloud { positions, ..PointCloud::default() },
            removed: Removed::default(),
            belt: Some(belt),
            belt_clearance_mm: Some(0.4),
            to_camera: Some(normal),
            spacing_mm: 1.0,
            warnings: Vec::new(),
        };
        let seen = mirrored(&scan, &scan.kept, &normal);
        let (before, after) = (&scan.cloud.positions, &seen.cloud.positions);
        let mirrored_belt = seen.belt.unwrap();
        for (p, q) in before.iter().zip(after) {
            assert!((belt.height_mm(p) - mirrored_belt.height_mm(q)).abs() < 1e-12);
        }
        let volume = |of: &[Point3]| (of[1] - of[0]).cross(&(of[2] - of[0])).dot(&(of[3] - of[0]));
        assert!((volume(before) + volume(after)).abs() < 1e-9 && volume(before) > 100.0);
        assert!((seen.to_camera.unwrap().into_inner() - normal.into_inner()).norm() < 1e-12);
    }
}
