//! What windows of several sizes tell of one surface point, made one value.

use super::card::{Card, WindowShare};
use super::surface::SurfaceFound;

/// What was told, the largest window first, each with its card and with how much of the next smaller one is to be believed instead.
#[derive(Debug, Default)]
pub(super) struct Windows(Vec<(SurfaceFound, Card, f64)>);

impl Windows {
    /// Adds the next smaller window; one of which nothing is to be believed is left out.
    pub fn push(&mut self, found: SurfaceFound, card: Card, of_smaller: f64) {
        if of_smaller < 1.0 {
            self.0.push((found, card, of_smaller));
        }
    }

    /// Whether no window told anything.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The value of all of them, with the card of the one that counts most; of several windows the card tells the share of each. `None`
    /// where none told anything.
    pub fn together(self) -> Option<(SurfaceFound, Card)> {
        let shares = shares(&self.0);
        // Of two that count alike the smaller one, which is nearer to the place.
        let most = (0..shares.len()).max_by(|&a, &b| shares[a].total_cmp(&shares[b]))?;
        let mut card = self.0[most].1.clone();
        if shares.len() > 1 {
            let share = |((found, _, _), share): (&(SurfaceFound, Card, f64), &f64)| WindowShare {
                window_mm: found.window_mm,
                share: *share,
            };
            card.blended = self.0.iter().zip(&shares).map(share).collect();
        }
        let (window_mm, rms_mm, points_used) = {
            let most = &self.0[most].0;
            (most.window_mm, most.rms_mm, most.points_used)
        };
        let blended = self.0.into_iter().rev().map(|(found, _, of_smaller)| (found, of_smaller));
        let found = blended.reduce(|(smaller, _), (found, of_smaller)| (found.blended(smaller, of_smaller), 0.0))?.0;
        Some((SurfaceFound { window_mm, rms_mm, points_used, ..found }, card))
    }
}

/// How much each window counts, together 1; the smallest has what is left.
fn shares(told: &[(SurfaceFound, Card, f64)]) -> Vec<f64> {
    let mut left = 1.0;
    let mut shares: Vec<f64> = told
        .iter()
        .map(|(_, _, of_smaller)| {
            let own = left * (1.0 - of_smaller);
            left -= own;
            own
        })
        .collect();
    if let Some(smallest) = shares.last_mut() {
        *smallest += left;
    }
    shares
}

impl SurfaceFound {
    /// This and a share of what another window tells; as uncertain as either, and by what they differ (variance of a mixture).
    fn blended(self, other: Self, share: f64) -> Self {
        let mix = |a: f64, b: f64| a + share * (b - a);
        let apart_mm = other.deviation_mm - self.deviation_mm;
        let variance = mix(self.standard_uncertainty_mm.powi(2), other.standard_uncertainty_mm.powi(2))
            + share * (1.0 - share) * apart_mm * apart_mm;
        Self {
            position: self.position + (other.position - self.position) * share,
            normal: (self.normal + (other.normal - self.normal) * share).normalize(),
            deviation_mm: mix(self.deviation_mm, other.deviation_mm),
            standard_uncertainty_mm: variance.sqrt(),
            ..self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Point3, Vector3};

    fn told(deviation_mm: f64, u_mm: f64, window_mm: f64) -> SurfaceFound {
        SurfaceFound {
            position: Point3::new(0.0, 0.0, deviation_mm),
            normal: Vector3::z(),
            deviation_mm,
            standard_uncertainty_mm: u_mm,
            window_mm,
            rms_mm: 0.1,
            points_used: (100.0 * window_mm) as usize,
        }
    }

    fn together(windows: &[(SurfaceFound, f64)]) -> (SurfaceFound, Card) {
        let mut all = Windows::default();
        for (found, of_smaller) in windows {
            let mut card = Card { window_mm: Some(found.window_mm), ..Card::default() };
            card.at_least("points in the window", "", found.points_used as f64, 12.0);
            all.push(found.clone(), card, *of_smaller);
        }
        all.together().unwrap()
    }

    /// Half of 0.1 and half of 0.2: the variance is the mean of both and half the distance squared, sqrt(0.0005 / 2 + 0.0025).
    #[test]
    fn two_windows_blend_without_a_step_and_their_difference_is_uncertain() {
        let (large, small) = (told(0.1, 0.01, 5.0), told(0.2, 0.02, 3.5));
        let (half, _) = together(&[(large.clone(), 0.5), (small.clone(), 0.0)]);
        assert!((half.deviation_mm - 0.15).abs() < 1e-12 && (half.position.z - 0.15).abs() < 1e-12);
        assert!((half.standard_uncertainty_mm - 0.002_75_f64.sqrt()).abs() < 1e-12);
        assert_eq!(together(&[(large.clone(), 0.0)]).0, large);
        assert_eq!(together(&[(large, 1.0), (small.clone(), 0.0)]).0, small);
    }

    /// 0.7 of the first, 0.3 x 0.6 of the second, 0.3 x 0.4 of the third.
    #[test]
    fn the_card_is_of_the_window_that_counts_most_and_tells_the_shares() {
        let windows = [(told(0.1, 0.01, 5.0), 0.3), (told(0.2, 0.02, 3.5), 0.4), (told(0.3, 0.02, 2.5), 0.0)];
        let (found, card) = together(&windows);
        assert_eq!((found.window_mm, found.points_used, card.window_mm), (5.0, 500, Some(5.0)));
        assert_eq!(card.gates[0].value, 500.0);
        let told: Vec<(f64, f64)> =
            card.blended.iter().map(|w| (w.window_mm, (w.share * 1e12).round() / 1e12)).collect();
        assert_eq!(told, [(5.0, 0.7), (3.5, 0.18), (2.5, 0.12)]);
        assert!(together(&windows[..1]).1.blended.is_empty());
    }

    #[test]
    fn a_smaller_window_that_tells_nothing_leaves_the_word_to_the_larger_one() {
        let large = told(0.1, 0.01, 5.0);
        let (found, card) = together(&[(large.clone(), 0.9)]);
        assert!(found == large && card.blended.is_empty());
        assert!(Windows::default().together().is_none() && Windows::default().is_empty());
    }
}
