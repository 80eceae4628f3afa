//! The simple way to a hole's circle: pick the points that stand at its rim, put a circle through them.
//!
//! It is here to be compared with: the rim falls between points, so that the circle is too wide by about a spacing, by
//! more where points lie irregularly, and a void beside the rim is taken for a part of it. [`super::soft_edge`] is what measures.

use super::robust::{TUKEY_WIDTH_SIGMAS, mad_scale_about_zero, tukey_weight};
use super::soft_edge::Circle;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::TAU;

/// Which points are taken for the rim's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RimPoints {
    /// Those around which a quarter turn holds no other point within two spacings.
    AngularGap,
    /// In each of 36 sectors the one nearest to the centre.
    SectorMinimum,
}

/// A circle through the rim's points near one that is good to three spacings, robustly (Tukey's biweight); (u, v) in mm. `None` where there
/// are too few of them.
pub fn boundary_circle(points: &[[f64; 2]], near: &Circle, spacing_mm: f64, which: RimPoints) -> Option<Circle> {
    const BAND: f64 = 4.0;
    let from_rim = |p: &[f64; 2]| (p[0] - near.centre[0]).hypot(p[1] - near.centre[1]) - near.radius;
    let band: Vec<[f64; 2]> = points.iter().filter(|p| from_rim(p).abs() < BAND * spacing_mm).copied().collect();
    let rim = match which {
        RimPoints::AngularGap => with_gap(&band, points, spacing_mm),
        RimPoints::SectorMinimum => nearest_by_sector(&band, near),
    };
    robust_circle(&rim, near, spacing_mm)
}

fn with_gap(band: &[[f64; 2]], points: &[[f64; 2]], spacing_mm: f64) -> Vec<[f64; 2]> {
    let reach = 2.0 * spacing_mm;
    let mut sorted = points.to_vec();
    sorted.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
    let has_gap = |p: &&[f64; 2]| {
        let from = sorted.partition_point(|q| q[0] < p[0] - reach);
        let to = sorted.partition_point(|q| q[0] <= p[0] + reach);
        let others = sorted[from..to].iter().map(|q| [q[0] - p[0], q[1] - p[1]]);
        let near = others.filter(|d| *d != [0.0, 0.0] && d[0].hypot(d[1]) <= reach);
        let mut angles: Vec<f64> = near.map(|d| d[1].atan2(d[0])).collect();
        angles.sort_unstable_by(f64::total_cmp);
        let turn = match (angles.first(), angles.last()) {
            (Some(first), Some(last)) => first + TAU - last,
            _ => TAU,
        };
        angles.windows(2).map(|w| w[1] - w[0]).fold(turn, f64::max) > TAU / 4.0
    };
    band.iter().filter(has_gap).copied().collect()
}

fn nearest_by_sector(band: &[[f64; 2]], near: &Circle) -> Vec<[f64; 2]> {
    const SECTORS: usize = 36;
    let mut nearest = [(f64::INFINITY, [0.0; 2]); SECTORS];
    for p in band {
        let (x, y) = (p[0] - near.centre[0], p[1] - near.centre[1]);
        let sector = (((y.atan2(x) / TAU).rem_euclid(1.0) * SECTORS as f64) as usize).min(SECTORS - 1);
        if x.hypot(y) < nearest[sector].0 {
            nearest[sector] = (x.hypot(y), *p);
        }
    }
    nearest.iter().filter(|(distance, _)| distance.is_finite()).map(|(_, p)| *p).collect()
}

/// Gauss-Newton with Tukey's weights about the scale that the residuals have at the start of each round.
fn robust_circle(rim: &[[f64; 2]], start: &Circle, spacing_mm: f64) -> Option<Circle> {
    const ROUNDS: usize = 30;
    let mut circle = *start;
    for _ in 0..ROUNDS {
        let residuals: Vec<(f64, [f64; 2])> = rim
            .iter()
            .map(|p| {
                let (x, y) = (p[0] - circle.centre[0], p[1] - circle.centre[1]);
                let distance = x.hypot(y);
                (distance - circle.radius, [x / distance, y / distance])
            })
            .collect();
        let sizes: Vec<f64> = residuals.iter().map(|(r, _)| *r).collect();
        let width = TUKEY_WIDTH_SIGMAS * mad_scale_about_zero(&sizes)?.max(0.05 * spacing_mm);
        let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for (r, n) in residuals {
            let row = Vector3::new(n[0], n[1], 1.0);
            let weight = tukey_weight(r, width);
            matrix += row * row.transpose() * weight;
            right += row * (r * weight);
        }
        let step = matrix.cholesky()?.solve(&right);
        circle.centre = [circle.centre[0] + step[0], circle.centre[1] + step[1]];
        circle.radius += step[2];
        if step.norm() < 1e-6 * spacing_mm {
            break;
        }
    }
    (circle.radius > 0.0).then_some(circle)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// On a square lattice of spacing 0.1 the outermost points of a rim lie between 0 and 0.14 outside it, with a mean of about half
    /// a spacing: the diameter is too wide by a spacing, give or take half of one.
    #[test]
    fn circles_of_a_lattice_are_a_spacing_too_wide() {
        let truth = Circle { centre: [0.03, -0.02], radius: 2.0 };
        let lattice = (-40..=40).flat_map(|i| (-40..=40).map(move |j| [0.1 * f64::from(i), 0.1 * f64::from(j)]));
        let outside = |p: &[f64; 2]| (p[0] - 0.03_f64).hypot(p[1] + 0.02) > truth.radius;
        let points: Vec<[f64; 2]> = lattice.filter(outside).collect();
        let start = Circle { centre: [0.0, 0.0], radius: 2.1 };
        for which in [RimPoints::AngularGap, RimPoints::SectorMinimum] {
            let found = boundary_circle(&points, &start, 0.1, which).unwrap();
            let wider = 2.0 * (found.radius - truth.radius) / 0.1;
            assert!((0.2..1.5).contains(&wider), "{which:?}: {wider}");
            let off = (found.centre[0] - 0.03).hypot(found.centre[1] + 0.02);
            // Sixty points scattered by a third of a spacing each fix the centre to a fifteenth; four times that.
            assert!(off < 0.03, "{which:?}: {off}");
        }
        assert!(boundary_circle(&points[..2], &start, 0.1, RimPoints::AngularGap).is_none());
    }
}
