//! The exact answers that belong to a scan, from the actual part's mesh and parameters.
//!
//! A deviation follows the plan's rules: positive along the plan's direction, whichever side is seen; the nominal point is
//! moved to the seen face by the thickness. It is told twice: in the pose in which the part was made (`in_true_pose`), and
//! after the plan's own alignment computed on the exact features (`aligned`): that is what a measurement must find.

use super::actual::Actual;
use super::datum::alignment;
use super::drawn::Drawn;
use super::subject::Subject;
use crate::geometry::{CadFromScan, Isometry3};
use crate::plan::Side;
use serde::{Deserialize, Serialize};

/// What a measurement of the scan should find. Lengths in mm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ScanTruth {
    /// `shapeline-truth/1`.
    pub schema: String,
    /// Scan to CAD, row-major: the pose in which the scan was made.
    pub cad_from_scan: [f64; 16],
    /// Scan to CAD after the plan's alignment on the exact features, row-major; `null` for `best_fit`, which has no exact
    /// answer, and for features that the actual part does not have.
    pub aligned_cad_from_scan: Option<[f64; 16]>,
    /// `top` or `bottom`: the side of the sheet that the cameras stand on.
    pub side: String,
    /// The seed of the scan.
    pub seed: u64,
    /// What was drawn from the plan's `[uncertainty]`; left out where it states nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drawn: Option<Drawn>,
    /// The plan's features, in its order, in the true pose.
    pub features: Vec<FeatureTruth>,
    /// The plan's comparison points, in its order.
    pub points: Vec<PointTruth>,
}

/// A feature of the actual part on the CAD's own face (thickness taken out), CAD frame, in the true pose.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FeatureTruth {
    /// Its name in the plan.
    pub name: String,
    /// `hole`, `slot`, `surface` or `edge`.
    pub kind: String,
    /// Centre or position.
    pub centre: [f64; 3],
    /// Normal of the sheet there (hole and slot), or the plan's direction.
    pub axis: [f64; 3],
    /// Hole: mean diameter.
    pub diameter_mm: Option<f64>,
    /// Slot: direction of its long axis.
    pub direction: Option<[f64; 3]>,
}

/// The deviation of a comparison point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PointTruth {
    /// Its name in the plan.
    pub name: String,
    /// `hole`, `surface` or `edge`.
    pub kind: String,
    /// With the part where it was made; `null` where the actual part has nothing.
    pub in_true_pose: Option<Deviation>,
    /// After the plan's alignment; `null` as well when that has no exact answer.
    pub aligned: Option<Deviation>,
}

/// What of a comparison point deviates.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Deviation {
    /// Positive along the plan's direction; of a hole without one the distance of its centre in the sheet.
    pub deviation_mm: f64,
    /// Hole: actual minus nominal centre, in the sheet.
    pub delta_mm: Option<[f64; 3]>,
    /// Hole: mean diameter.
    pub diameter_mm: Option<f64>,
}

impl ScanTruth {
    /// The truth of a subject seen in a pose from a side.
    pub fn new(subject: &Subject, cad_from_scan: CadFromScan, side: Side, seed: u64) -> Self {
        let actual = Actual::new(subject, side);
        let aligned_from_true = alignment(&actual);
        let points = subject.plan.comparison.iter().enumerate().map(|(k, point)| PointTruth {
            name: point.name.clone(),
            kind: point.geometry.kind().into(),
            in_true_pose: actual.deviation(k, &Isometry3::identity()),
            aligned: aligned_from_true.and_then(|motion| actual.deviation(k, &motion)),
        });
        let features = subject.plan.features.iter().enumerate().filter_map(|(k, feature)| {
            let found = actual.feature(k, &Isometry3::identity())?;
            Some(FeatureTruth {
                name: feature.name.clone(),
                kind: feature.geometry.kind().into(),
                centre: found.place.coords.into(),
                axis: found.axis.into(),
                diameter_mm: found.diameter_mm,
                direction: found.direction.map(Into::into),
            })
        });
        Self {
            schema: "shapeline-truth/1".into(),
            cad_from_scan: cad_from_scan.row_major(),
            aligned_cad_from_scan: aligned_from_true
                .map(|motion| CadFromScan::new(motion * cad_from_scan.isometry()).row_major()),
            side: side.key().into(),
            seed,
            drawn: None,
            features: features.collect(),
            points: points.collect(),
        }
    }

    /// The pose in which the scan was made.
    pub fn pose(&self) -> Option<CadFromScan> {
        CadFromScan::try_from_row_major(&self.cad_from_scan)
    }

    /// The truth of a comparison point, by its name.
    pub fn point(&self, name: &str) -> Option<&PointTruth> {
        self.points.iter().find(|p| p.name == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Point3, UnitVector3, Vector3};
    use crate::plan::{AlignmentMethod, Geometry, RpsLock, SlotReading};
    use crate::simulate::{BracketParameters, Displacement, DisplacementField, SyntheticPart, bracket};

    fn truth(subject: &Subject, side: Side) -> ScanTruth {
        ScanTruth::new(subject, CadFromScan::identity(), side, 0)
    }

    fn nominal() -> SyntheticPart {
        bracket(&BracketParameters::default())
    }

    #[test]
    fn a_perfect_part_has_no_deviation_and_its_alignment_is_the_identity() {
        let mut subject = Subject::perfect(&nominal());
        for reading in [SlotReading::CentreLine, SlotReading::Axis] {
            if let AlignmentMethod::Features { slot_reading, .. } = &mut subject.plan.alignment {
                *slot_reading = reading;
            }
            for side in [Side::Top, Side::Bottom] {
                let truth = truth(&subject, side);
                let aligned = CadFromScan::try_from_row_major(&truth.aligned_cad_from_scan.unwrap()).unwrap();
                let (angle, distance) = aligned.difference(&CadFromScan::identity(), &Point3::origin());
                // Points of the top lie on its facets; those of the bottom face stand up to half a micrometre off the place one
                // thickness below, where the crown blends into a pad.
                assert!(angle < 1e-6 && distance < 1e-4, "{angle} {distance}");
                for point in &truth.points {
                    let [a, b] = [point.in_true_pose.unwrap(), point.aligned.unwrap()];
                    assert!(
                        a.deviation_mm.abs() < 0.001 && b.deviation_mm.abs() < 0.001,
                        "{side:?} {} {a:?} {b:?}",
                        point.name
                    );
                }
            }
        }
    }

    #[test]
    fn planted_changes_come_back_where_they_were_planted() {
        let parameters = BracketParameters {
            shifts: vec![("C01", 0.4, 0.3), ("C02", 0.1, -0.25), ("C05", 0.2, 0.0)],
            diameter_changes: vec![("C03", 0.35)],
            trims: vec![("E01", -0.8), ("E05", 0.5)],
            ..Default::default()
        };
        let subject = Subject::synthetic(&nominal(), &bracket(&parameters), DisplacementField::none());
        for side in [Side::Top, Side::Bottom] {
            let truth = truth(&subject, side);
            let found = |name: &str| truth.point(name).unwrap().in_true_pose.unwrap();
            for (name, expected) in [("C01", 0.4), ("C02", -0.25), ("C05", 0.2), ("C03", 0.0), ("C04", 0.0)] {
                // Pads and the foot are flat: the answer is exact but for the differences of the forming map.
                assert!((found(name).deviation_mm - expected).abs() < 1e-5, "{name} {:?}", found(name));
            }
            assert!((found("C03").diameter_mm.unwrap() - 10.35).abs() < 1e-5);
            // A slanted crown under the edge changes the way outwards by the cosine of its slope.
            for (name, expected) in [("E01", -0.8), ("E05", 0.5), ("E03", 0.0), ("P01", 0.0)] {
                assert!((found(name).deviation_mm - expected).abs() < 0.003, "{name} {:?}", found(name));
            }
        }
    }

    #[test]
    fn a_moved_part_is_told_as_moved_and_aligned_away() {
        let part = nominal();
        let shift = Vector3::new(0.3, -0.2, 0.4);
        let subject = Subject::synthetic(&part, &part, DisplacementField(vec![Displacement::Shift(shift)]));
        let truth = truth(&subject, Side::Bottom);
        for (point, plan) in truth.points.iter().zip(&subject.plan.comparison) {
            // On a curved face, or past an edge, a shift is not the same as its part along the direction.
            if let Geometry::Hole { direction: Some(d), .. } = &plan.geometry {
                assert!((point.in_true_pose.unwrap().deviation_mm - shift.dot(d)).abs() < 1e-6, "{}", point.name);
            }
            assert!(point.aligned.unwrap().deviation_mm.abs() < 0.001, "{} {:?}", point.name, point.aligned);
        }
        let h1 = &truth.features[0];
        let moved = Point3::from(h1.centre) - subject.plan.features[0].geometry.position();
        assert!((moved - shift).norm() < 1e-6);
    }

    #[test]
    fn datums_hold_after_the_alignment_of_a_bent_part() {
        let part = nominal();
        let springback = Displacement::Springback {
            line: Point3::origin(),
            towards: UnitVector3::new_normalize(Vector3::new(0.8, 0.6, 0.0)),
            up: Vector3::z_axis(),
            at_100_mm: 0.8,
        };
        let field = DisplacementField(vec![springback]);
        let mut subject = Subject::synthetic(&part, &part, field);
        let lock = |feature: usize, v: Vector3| RpsLock { feature, lock: UnitVector3::new_normalize(v) };
        let rps = vec![
            lock(0, Vector3::x()),
            lock(0, Vector3::y()),
            lock(0, Vector3::z()),
            lock(1, Vector3::y()),
            lock(1, Vector3::z()),
            lock(2, Vector3::z()),
        ];
        for method in [subject.plan.alignment.clone(), AlignmentMethod::Rps(rps)] {
            subject.plan.alignment = method;
            let actual = super::super::actual::Actual::new(&subject, Side::Top);
            let motion = alignment(&actual).unwrap();
            assert!(motion.rotation.angle() > 1e-4, "the field must turn the part to be a test");
            let off =
                |k: usize| actual.feature(k, &motion).unwrap().place - subject.plan.features[k].geometry.position();
            assert!(off(0).norm() < 1e-9, "{}", off(0));
            assert!(off(1).z.abs() < 1e-3 && off(1).y.abs() < 0.5);
            // A1 deviates along its direction only, and there not.
            assert!(off(2).norm() < 2e-3, "{}", off(2));
        }
    }
}
