//! What the datum features tell, how well they tell it, and what their errors do to the part.

use super::common::Common;
use super::datum::{DatumError, solve};
use super::pose::{PoseUncertainty, Source};
use crate::geometry::{Point3, UnitVector3, Vector3};
use crate::plan::{AlignmentMethod, Feature, Geometry, SlotReading, UncertaintySettings};

/// What a plan holds a part by.
#[derive(Debug, Clone, Copy)]
pub struct Datums<'a> {
    /// How.
    pub method: &'a AlignmentMethod,
    /// The plan's features, to which the method refers.
    pub features: &'a [Feature],
    /// The part's size, mm.
    pub length_mm: f64,
}

/// How far a datum feature may be off, k = 1. CAD frame.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct DatumErrors {
    /// Independent shifts of its position, mm.
    pub shifts: Vec<Vector3>,
    /// Independent turns of a slot's long axis, rad, as rotation vectors.
    pub turns: Vec<Vector3>,
    /// What the calibrated edge offset's uncertainty moves an edge by, mm; 0 for the others, whose rims it moves all round.
    pub edge_offset: Vector3,
    /// What a sheet that is thicker by one standard uncertainty moves it by, mm: all datums together.
    pub thickness: Vector3,
    /// What a scale that is larger by one standard uncertainty moves it by, mm: all datums together.
    pub scale: Vector3,
}

impl DatumErrors {
    /// With what the scan itself cannot show and the plan's `[uncertainty]` tells. The measuring system may be off in any
    /// direction at every datum; the ends of a slot, whose middles are its length less its width apart, differ by that error
    /// twice, and its axis turns.
    #[must_use]
    pub fn with_settings(mut self, geometry: &Geometry, settings: &UncertaintySettings) -> Self {
        let UncertaintySettings { system_mm, edge_offset_u_mm, .. } = *settings;
        if system_mm > 0.0 {
            self.shifts.extend([Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| axis * system_mm));
        }
        match geometry {
            Geometry::Slot { axis, direction, length_mm, width_mm, .. } if system_mm > 0.0 => {
                let apart_mm = (length_mm - width_mm).max(0.1 * length_mm);
                let turn_rad = std::f64::consts::SQRT_2 * system_mm / apart_mm;
                self.turns.extend([axis.into_inner() * turn_rad, axis.cross(direction) * turn_rad]);
            }
            Geometry::Edge { direction, .. } => self.edge_offset = direction.into_inner() * edge_offset_u_mm,
            _ => {}
        }
        self
    }

    /// Standard uncertainty of the position along a direction, mm.
    pub(super) fn along_mm(&self, direction: &Vector3) -> f64 {
        let shifts = self.shifts.iter().chain([&self.edge_offset]);
        shifts.map(|shift| shift.dot(direction).powi(2)).sum::<f64>().sqrt()
    }
}

/// One datum feature as the alignment sees it. CAD frame.
#[derive(Debug, Clone, PartialEq)]
pub struct DatumValue {
    /// Index into the plan's features.
    pub index: usize,
    /// Where it was found.
    pub position: Point3,
    /// Slot: its long axis, in either sense.
    pub direction: Option<UnitVector3>,
    /// Surface: the normal of what was measured. It steers the search only: where that has ended the surface passes through
    /// the nominal place, and an error of the normal moves nothing.
    pub normal: Option<UnitVector3>,
    /// How far it may be off.
    pub errors: DatumErrors,
}

impl DatumValue {
    /// A feature exactly where the plan has it.
    fn nominal(index: usize, feature: &Feature, errors: DatumErrors) -> Self {
        let (direction, normal) = match &feature.geometry {
            Geometry::Slot { direction, .. } => (Some(*direction), None),
            Geometry::Surface { direction, .. } => (None, Some(*direction)),
            _ => (None, None),
        };
        Self { index, position: feature.geometry.position(), direction, normal, errors }
    }
}

/// The features that the plan's alignment uses, each once, in the order of their first mention: for `features` the hole,
/// the slot and the surface point.
pub(super) fn datum_indices(method: &AlignmentMethod) -> Vec<usize> {
    match method {
        AlignmentMethod::Features { hole, slot, point, .. } => vec![*hole, *slot, *point],
        AlignmentMethod::Rps(locks) => {
            let mut seen = Vec::new();
            for lock in locks {
                if !seen.contains(&lock.feature) {
                    seen.push(lock.feature);
                }
            }
            seen
        }
        AlignmentMethod::BestFit | AlignmentMethod::Regions(_) => Vec::new(),
    }
}

/// One error of one datum, to see what it does to the pose.
#[derive(Clone, Copy)]
pub(super) enum Nudge {
    Shift {
        datum: usize,
        by: Vector3,
    },
    /// Of a slot's long axis.
    Turn {
        datum: usize,
        by: Vector3,
    },
    /// Every edge by what its offset may be off.
    EdgeOffsets,
    /// Every datum by what a thicker sheet does to it.
    Thickness,
    /// Every datum by what a larger scale does to it.
    Scale,
}

/// Moves every datum value by its standard uncertainty and keeps what that does to the part.
pub(super) fn pose_uncertainty(
    datums: Datums,
    values: &[DatumValue],
    scale_about: Point3,
) -> Result<PoseUncertainty, DatumError> {
    let back = solve(datums, values, None)?.motion.inverse();
    let nudged = |nudge: Nudge| Ok(solve(datums, values, Some(nudge))?.motion * back);
    // By its axis a slot holds directions only; by its centre it turns nothing else.
    let by_axis = matches!(datums.method, AlignmentMethod::Features { slot_reading: SlotReading::Axis, .. });
    let mut known = PoseUncertainty::none(scale_about);
    for (datum, value) in values.iter().enumerate() {
        let slot_axis = by_axis && value.direction.is_some();
        let shifts = value.errors.shifts.iter().filter(|_| !slot_axis).map(|by| Nudge::Shift { datum, by: *by });
        let turns = value.errors.turns.iter().filter(|_| slot_axis).map(|by| Nudge::Turn { datum, by: *by });
        for nudge in shifts.chain(turns) {
            match nudge {
                Nudge::Shift { by, .. } => known.add_shift(value.index, by, nudged(nudge)?),
                _ => known.add(nudged(nudge)?),
            }
        }
    }
    let edges = values.iter().enumerate().filter(|(_, value)| value.errors.edge_offset != Vector3::zeros());
    let each: Vec<Source> = edges
        .map(|(datum, value)| {
            let by = value.errors.edge_offset;
            Ok(Source { motion: nudged(Nudge::Shift { datum, by })?, of: Some((value.index, by)) })
        })
        .collect::<Result<_, DatumError>>()?;
    if !each.is_empty() {
        known.set_edge_offset(each, nudged(Nudge::EdgeOffsets)?);
    }
    if values.iter().any(|value| value.errors.thickness != Vector3::zeros()) {
        known.set_thickness(nudged(Nudge::Thickness)?);
    }
    if values.iter().any(|value| value.errors.scale != Vector3::zeros()) {
        known.set_scale(nudged(Nudge::Scale)?);
    }
    Ok(known)
}

/// The uncertainty of the pose to expect before anything is measured: every datum at its nominal place, off by the errors that
/// `expected` tells for it, and all together by what is `common` to them.
///
/// # Errors
/// The datums do not hold the part.
pub fn expected_pose_uncertainty(
    datums: Datums,
    expected: impl Fn(&Geometry) -> DatumErrors,
    common: Option<Common>,
) -> Result<PoseUncertainty, DatumError> {
    let value = |index: usize| {
        let feature = &datums.features[index];
        DatumValue::nominal(index, feature, expected(&feature.geometry))
    };
    let mut values: Vec<DatumValue> = datum_indices(datums.method).into_iter().map(value).collect();
    let about = common.map_or_else(Point3::origin, |common| common.part.bounds.centre());
    if let Some(common) = common {
        common.displace(&mut values, datums.features);
    }
    pose_uncertainty(datums, &values, about)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::{Plan, RpsLock};
    use crate::simulate::{BracketParameters, bracket};
    use nalgebra::UnitQuaternion;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    fn plan(reading: SlotReading) -> Plan {
        let mut plan = bracket(&BracketParameters { spacing_mm: 8.0, ..BracketParameters::default() }).plan();
        let AlignmentMethod::Features { slot_reading, .. } = &mut plan.alignment else {
            panic!("the bracket has datums")
        };
        *slot_reading = reading;
        plan
    }

    fn datums(plan: &Plan) -> Datums<'_> {
        Datums { method: &plan.alignment, features: &plan.features, length_mm: 300.0 }
    }

    fn nominal(plan: &Plan) -> Vec<DatumValue> {
        let value = |k: usize| DatumValue::nominal(k, &plan.features[k], DatumErrors::default());
        datum_indices(&plan.alignment).into_iter().map(value).collect()
    }

    /// The surface passes through the nominal place once the search has ended; whichever way it leans there, the part stays.
    #[test]
    fn the_surface_points_normal_has_no_share_in_the_pose() {
        let plan = plan(SlotReading::CentreLine);
        let mut values = nominal(&plan);
        let lean = UnitQuaternion::from_scaled_axis(Vector3::new(0.02, -0.03, 0.01));
        values[2].normal = values[2].normal.map(|n| lean * n);
        let motion = solve(datums(&plan), &values, None).unwrap().motion;
        assert!(motion.rotation.angle() < 1e-12 && motion.translation.vector.norm() < 1e-10, "{motion}");
    }

    /// A slot's axis that leans out of the sheet by 1 mrad lifts the part's far end by its distance along the axis.
    #[test]
    fn a_leaning_axis_lifts_the_far_end() {
        let plan = plan(SlotReading::Axis);
        let errors = |geometry: &Geometry| match geometry {
            Geometry::Slot { axis, direction, .. } => DatumErrors {
                shifts: vec![Vector3::new(0.3, 0.3, 0.3)],
                turns: vec![axis.cross(direction) * 1e-3],
                ..DatumErrors::default()
            },
            _ => DatumErrors::default(),
        };
        let pose = expected_pose_uncertainty(datums(&plan), errors, None).unwrap();
        let [Geometry::Hole { centre, .. }, Geometry::Slot { axis, direction, .. }, ..] =
            [0, 1].map(|k| &plan.features[k].geometry)
        else {
            panic!("H1 and S1 come first");
        };
        let far = centre + direction.into_inner() * 150.0;
        // Turning about the axis, which keeps the surface point in its place, does not move a point on it; second order is 1e-4.
        assert!((pose.at(&far, axis) - 0.150).abs() < 1e-3, "{}", pose.at(&far, axis));
        assert!(pose.at(centre, axis) < 1e-9);
    }

    /// The measuring system's error at the hole moves the part as it is; that at the hole and at the slot turns it, which far out
    /// on their line past the slot is levered.
    #[test]
    fn the_measuring_systems_error_is_levered_by_the_datums() {
        let plan = plan(SlotReading::CentreLine);
        let settings = UncertaintySettings { system_mm: 0.03, ..UncertaintySettings::default() };
        let errors = |geometry: &Geometry| DatumErrors::default().with_settings(geometry, &settings);
        let pose = expected_pose_uncertainty(datums(&plan), errors, None).unwrap();
        let [hole, slot] = [0, 1].map(|k| plan.features[k].geometry.position());
        let along = (slot - hole).normalize();
        let across = along.cross(&plan.features[0].geometry.sheet_normal()).normalize();
        // About the hole: as much as it is off itself, in every direction.
        for direction in [along, across, along.cross(&across)] {
            assert!((pose.at(&hole, &direction) - 0.03).abs() < 1e-4, "{}", pose.at(&hole, &direction));
        }
        // At twice the distance to the slot: -1 times the hole's error and twice the slot's. Second order is 1e-6; the turn about
        // the line leaves a point on it.
        let far = hole + (slot - hole) * 2.0;
        assert!((pose.at(&far, &across) - 0.03 * 5_f64.sqrt()).abs() < 1e-4, "{}", pose.at(&far, &across));
        let axis = self::plan(SlotReading::Axis);
        let pose = expected_pose_uncertainty(datums(&axis), errors, None).unwrap();
        let Geometry::Slot { direction, length_mm, width_mm, axis, .. } = &axis.features[1].geometry else {
            panic!("S1 is second")
        };
        let far = hole + direction.into_inner() * 150.0;
        let turn = 2_f64.sqrt() * 0.03 / (length_mm - width_mm);
        let in_sheet = axis.cross(direction);
        let expected = 0.03_f64.hypot(150.0 * turn);
        assert!((pose.at(&far, &in_sheet) - expected).abs() < 1e-3 * expected, "{}", pose.at(&far, &in_sheet));
    }

    /// A plate held by three surface points, two edges of one side and one of another.
    fn held_by_edges() -> (AlignmentMethod, Vec<Feature>) {
        let z = Vector3::z_axis();
        let surface = |x: f64, y: f64| Geometry::Surface { position: Point3::new(x, y, 0.0), direction: z };
        let edge = |x: f64, y: f64, direction: UnitVector3| Geometry::Edge {
            position: Point3::new(x, y, 0.0),
            direction,
            normal: z,
        };
        let geometries = [
            surface(10.0, 10.0),
            surface(190.0, 10.0),
            surface(10.0, 90.0),
            edge(20.0, 0.0, -Vector3::y_axis()),
            edge(180.0, 0.0, -Vector3::y_axis()),
            edge(0.0, 50.0, -Vector3::x_axis()),
        ];
        let locks = geometries.iter().enumerate().map(|(feature, geometry)| RpsLock {
            feature,
            lock: match geometry {
                Geometry::Edge { direction, .. } => *direction,
                _ => z,
            },
        });
        let locks = locks.collect();
        let named = geometries.into_iter().enumerate().map(|(k, geometry)| Feature {
            name: format!("P{k}"),
            geometry,
            line: 1,
        });
        (AlignmentMethod::Rps(locks), named.collect())
    }

    /// Two edges of one side, off by the same offset, shift the part by it: the edge opposite then tells it twice.
    #[test]
    fn the_edge_offsets_error_shifts_a_part_that_edges_hold() {
        let (method, features) = held_by_edges();
        let datums = Datums { method: &method, features: &features, length_mm: 200.0 };
        let settings = UncertaintySettings { edge_offset_u_mm: 0.05, ..UncertaintySettings::default() };
        let errors = |geometry: &Geometry| DatumErrors::default().with_settings(geometry, &settings);
        let pose = expected_pose_uncertainty(datums, errors, None).unwrap();
        let opposite = Point3::new(100.0, 100.0, 0.0);
        assert!((pose.at(&opposite, &Vector3::y()) - 0.05).abs() < 1e-5, "{}", pose.at(&opposite, &Vector3::y()));
        let with_own = pose.edge_offset_mm(&opposite, &Vector3::y(), 0.05);
        assert!((with_own - 0.1).abs() < 1e-5, "{with_own}");
        // Two edges that are off by themselves turn the part: far out on their line, sqrt(2.25² + 1.25²) of one's error.
        let far = Point3::new(380.0, 0.0, 0.0);
        let levered = 0.05 * 2.25_f64.hypot(1.25);
        assert!((pose.at(&far, &Vector3::y()) - levered).abs() < 1e-4, "{}", pose.at(&far, &Vector3::y()));
        assert!(pose.at(&opposite, &Vector3::z()) < 1e-9);
    }

    /// Two thousand parts measured with errors as they are told: the pose scatters as it is said to, whatever holds the part. A standard
    /// deviation of 2000 values is known to 1.6 %, so that 10 % are six of its own.
    #[test]
    fn the_pose_scatters_over_2000_solutions_as_it_is_said_to() {
        let (plate, plate_features) = held_by_edges();
        let AlignmentMethod::Rps(mut locks) = plate.clone() else { panic!("rps") };
        // Three locks more than are needed.
        locks.push(RpsLock { feature: 4, lock: Vector3::z_axis() });
        locks.push(RpsLock { feature: 5, lock: Vector3::z_axis() });
        locks.push(RpsLock { feature: 3, lock: Vector3::z_axis() });
        let [line, axis] = [SlotReading::CentreLine, SlotReading::Axis].map(plan);
        let cases = [
            (line.alignment.clone(), line.features.clone()),
            (axis.alignment.clone(), axis.features.clone()),
            (plate, plate_features.clone()),
            (AlignmentMethod::Rps(locks), plate_features),
        ];
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(2000);
        for (method, features) in &cases {
            let datums = Datums { method, features, length_mm: 300.0 };
            let values: Vec<DatumValue> = datum_indices(method)
                .into_iter()
                .map(|k| DatumValue::nominal(k, &features[k], unlike_errors(k, &features[k].geometry)))
                .collect();
            let told = pose_uncertainty(datums, &values, Point3::origin()).unwrap();
            let places = [[150.0, 100.0, 0.0], [-150.0, 100.0, 30.0], [0.0, -100.0, 10.0]].map(Point3::from);
            let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
            let mut sums = [[0.0; 3]; 3];
            for _ in 0..2000 {
                let drawn: Vec<DatumValue> = values.iter().map(|value| drawn(value, &mut rng)).collect();
                let motion = solve(datums, &drawn, None).unwrap().motion;
                for (sums, place) in sums.iter_mut().zip(&places) {
                    let off = motion * place - place;
                    sums.iter_mut().zip(&axes).for_each(|(sum, axis)| *sum += off.dot(axis).powi(2));
                }
            }
            for (sums, place) in sums.iter().zip(&places) {
                for (sum, axis) in sums.iter().zip(&axes) {
                    let (found, told) = ((sum / 2000.0).sqrt(), told.at(place, axis));
                    assert!((found / told - 1.0).abs() < 0.1, "{method:?} {place} {axis:?}: {found} told {told}");
                }
            }
        }
    }

    /// Errors that differ from datum to datum and from direction to direction.
    fn unlike_errors(index: usize, geometry: &Geometry) -> DatumErrors {
        let size = 0.01 + 0.004 * index as f64;
        let shifts = vec![Vector3::x() * size, Vector3::y() * 2.0 * size, Vector3::z() * 1.5 * size];
        let turns = match geometry {
            Geometry::Slot { axis, direction, .. } => {
                vec![axis.into_inner() * 1e-3, axis.cross(direction) * 6e-4]
            }
            _ => Vec::new(),
        };
        DatumErrors { shifts, turns, ..DatumErrors::default() }
    }

    /// A datum as found once.
    fn drawn(value: &DatumValue, rng: &mut rand_chacha::ChaCha8Rng) -> DatumValue {
        let mut normal = |_: &Vector3| -> f64 { StandardNormal.sample(rng) };
        let shift: Vector3 = value.errors.shifts.iter().map(|by| by * normal(by)).sum();
        let turn: Vector3 = value.errors.turns.iter().map(|by| by * normal(by)).sum();
        let direction = value.direction.map(|d| UnitQuaternion::from_scaled_axis(turn) * d);
        DatumValue { position: value.position + shift, direction, ..value.clone() }
    }
}
