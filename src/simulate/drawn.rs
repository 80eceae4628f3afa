//! Errors that a plan's `[uncertainty]` states, drawn once for a scan: what the scan itself cannot show.
//!
//! Each is drawn from a normal distribution with the standard uncertainty that the plan states, and acts as the uncertainty of a
//! comparison point counts it: the sheet has another thickness than the plan says; all lengths of the scan are too long or too
//! short; trimmed edges and rims are seen off their place, by the calibrated offset and its error; the measuring system misplaces
//! features that stand apart independently of each other, along every axis.

use super::rig::{RigModel, Stream, stream};
use crate::plan::{Plan, UncertaintySettings};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

/// A sheet is never thinner than this share of its nominal thickness, whatever is drawn.
const THINNEST: f64 = 0.2;
/// No scale is off by more than half, whatever is drawn.
const FARTHEST_SCALE: f64 = 0.5;

/// What was drawn for a scan.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Drawn {
    /// The sheet's actual thickness.
    pub thickness_mm: f64,
    /// Lengths of the scan are longer by this share.
    pub scale_error: f64,
    /// Edges and rims are seen so far outwards of their place.
    pub edge_shift_mm: f64,
    /// Standard deviation of the system's errors along each axis; they differ from place to place.
    pub distortion_mm: f64,
}

impl Drawn {
    /// Draws for the scan of that seed. `None` when the plan states nothing that could be drawn.
    pub fn of_plan(plan: &Plan, seed: u64) -> Option<Self> {
        if plan.uncertainty == UncertaintySettings::default() {
            return None;
        }
        let UncertaintySettings { scale_ppm, thickness_mm, system_mm, edge_offset_mm, edge_offset_u_mm } =
            plan.uncertainty;
        let mut rng = stream(seed, Stream::SystemErrors);
        let nominal_mm = plan.part.thickness_mm;
        Some(Self {
            thickness_mm: (nominal_mm + thickness_mm * normal(&mut rng)).max(THINNEST * nominal_mm),
            scale_error: (scale_ppm * 1e-6 * normal(&mut rng)).clamp(-FARTHEST_SCALE, FARTHEST_SCALE),
            edge_shift_mm: edge_offset_mm + edge_offset_u_mm * normal(&mut rng),
            distortion_mm: system_mm,
        })
    }

    /// The rig with these errors.
    #[must_use]
    pub fn rig(&self, rig: &RigModel) -> RigModel {
        RigModel {
            scale_error: self.scale_error,
            edge_shift_mm: self.edge_shift_mm,
            distortion_mm: self.distortion_mm,
            ..rig.clone()
        }
    }
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Point3, Vector3};
    use crate::plan::Side;
    use crate::run::RunContext;
    use crate::simulate::{PoseChoice, SimulatedScan, Subject, simulate_scan, symmetric_plate};

    #[test]
    fn draws_spread_as_the_plan_states() {
        let mut plan = symmetric_plate().plan();
        assert_eq!(Drawn::of_plan(&plan, 1), None);
        plan.uncertainty = UncertaintySettings {
            scale_ppm: 100.0,
            thickness_mm: 0.03,
            system_mm: 0.02,
            edge_offset_mm: -0.05,
            edge_offset_u_mm: 0.04,
        };
        let draws: Vec<Drawn> = (0..4000).map(|seed| Drawn::of_plan(&plan, seed).unwrap()).collect();
        let check = |of: fn(&Drawn) -> f64, mean: f64, spread: f64| {
            let n = draws.len() as f64;
            let found = draws.iter().map(of).sum::<f64>() / n;
            let variance = draws.iter().map(|d| (of(d) - found).powi(2)).sum::<f64>() / (n - 1.0);
            // 4000 draws: the mean scatters by 1.6 % of the spread, the spread by 1.1 %; four times that.
            assert!((found - mean).abs() < 0.064 * spread, "{found} for {mean}");
            assert!((variance.sqrt() / spread - 1.0).abs() < 0.045, "{} for {spread}", variance.sqrt());
        };
        check(|d| d.thickness_mm, 1.2, 0.03);
        check(|d| d.scale_error, 0.0, 1e-4);
        check(|d| d.edge_shift_mm, -0.05, 0.04);
        assert!(draws.iter().all(|d| d.distortion_mm == 0.02));
        // Independent of each other: a correlation of 4000 pairs scatters by 0.016.
        let both: f64 = draws.iter().map(|d| (d.thickness_mm - 1.2) / 0.03 * d.scale_error / 1e-4).sum();
        assert!((both / 4000.0).abs() < 0.064, "{both}");
    }

    #[test]
    fn absurd_uncertainties_leave_a_sheet_and_a_scale() {
        let mut plan = symmetric_plate().plan();
        plan.uncertainty = UncertaintySettings { scale_ppm: 1e6, thickness_mm: 50.0, ..UncertaintySettings::default() };
        for seed in 0..50 {
            let drawn = Drawn::of_plan(&plan, seed).unwrap();
            assert!(drawn.thickness_mm >= 0.24 && drawn.scale_error.abs() <= 0.5, "{drawn:?}");
        }
    }

    /// A plate seen by a perfect rig with these errors; seeds, pixels and places are the same each time.
    fn seen(drawn: &Drawn) -> SimulatedScan {
        let subject = Subject::perfect(&symmetric_plate());
        let pose = PoseChoice::side(&subject, Side::Top);
        let rig = drawn.rig(&RigModel::perfect(0.5));
        simulate_scan(&subject, &rig, &pose, 5, &RunContext::silent()).unwrap()
    }

    const EXACT: Drawn = Drawn { thickness_mm: 1.2, scale_error: 0.0, edge_shift_mm: 0.0, distortion_mm: 0.0 };

    #[test]
    fn a_wrong_scale_stretches_the_scan_about_the_part_and_leaves_its_truth() {
        let (exact, stretched) = (seen(&EXACT), seen(&Drawn { scale_error: 0.01, ..EXACT }));
        assert_eq!(exact.truth, stretched.truth);
        let (a, b) = (&exact.cloud.positions, &stretched.cloud.positions);
        assert_eq!(a.len(), b.len());
        for k in (0..a.len() - 1000).step_by(500) {
            let (before, after) = ((a[k + 1000] - a[k]).norm(), (b[k + 1000] - b[k]).norm());
            assert!((after - 1.01 * before).abs() < 1e-9 * before.max(1.0), "{before} {after}");
        }
        // About the part: no point of the view, 200 mm from its middle at most, moves by more than 2 mm.
        assert!(a.iter().zip(b).all(|(p, q)| (q - p).norm() < 2.0));
    }

    #[test]
    fn the_systems_errors_spread_as_stated_and_are_the_same_within_a_window_only() {
        let (mut sum, mut near, mut far, mut count) = (0.0, 0.0, 0.0, 0.0);
        let exact = seen(&EXACT);
        let off = seen(&Drawn { distortion_mm: 0.05, ..EXACT });
        let places = exact.cloud.positions.iter().zip(&off.cloud.positions);
        let errors: Vec<(Point3, Vector3)> = places.map(|(p, q)| (*p, (q - p) / 0.05)).collect();
        for (p, e) in errors.iter().step_by(97) {
            let others = errors.iter().step_by(89);
            for (q, f) in others {
                let (apart, product) = ((q - p).norm(), e.dot(f) / 3.0);
                if apart < 5.0 {
                    near += product;
                    sum += e.norm_squared() / 3.0;
                    count += 1.0;
                } else if (60.0..70.0).contains(&apart) {
                    far += product / 10.0;
                }
            }
        }
        // The view holds some 40 places of 50 mm, each with three errors: their variance is known to 1/8 or so.
        assert!((sum / count - 1.0).abs() < 0.4, "{}", sum / count);
        assert!(near / sum > 0.95, "{}", near / sum);
        assert!((far / sum).abs() < 0.5, "{}", far / sum);
    }

    /// A shift of the edges shows in the scan, by so much, and not in the truth.
    #[test]
    fn shifted_edges_are_seen_outwards_of_where_they_are() {
        let exact = seen(&EXACT);
        let pose = exact.truth.pose().unwrap();
        let reach = |scan: &SimulatedScan| {
            let on_part =
                scan.cloud.positions.iter().zip(&scan.labels).filter(|(_, l)| **l == crate::simulate::Label::Part);
            on_part.map(|(p, _)| pose.point(p).x).fold(0.0, f64::max)
        };
        let shifted = seen(&Drawn { edge_shift_mm: 2.0, ..EXACT });
        assert_eq!(exact.truth.points, shifted.truth.points);
        // Pixels of 1.4 mm, turned by any angle: an edge 100 mm long has many, its outermost within a tenth of a millimetre.
        let grown = reach(&shifted) - reach(&exact);
        assert!((grown - 2.0).abs() < 0.3, "{grown}");
        // The hole is smaller: more points of the part within 2 mm inside of its rim.
        let more = shifted.labels.iter().filter(|l| **l == crate::simulate::Label::Part).count();
        let before = exact.labels.iter().filter(|l| **l == crate::simulate::Label::Part).count();
        assert!(more > before);
    }
}
