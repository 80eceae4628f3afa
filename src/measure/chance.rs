//! How clear a gap between points must be before it is taken for an opening.
//!
//! Points that lie at random leave gaps, and a search finds the largest of them. What a gap gains over closed sheet, in
//! log-likelihood, is about the number `n` of points that would stand in it. Of a Poisson pattern the largest empty discs are
//! those around Delaunay triangles: two of them a point, the disc of each expected to hold `n` points or more with probability
//! `(1 + n) exp(-n)`. A search over an area that holds `N` points thus meets `2 N (1 + n) exp(-n)` of them by chance. Every shape
//! parameter beyond a circle's (a slot's angle and length) lets the outline seek among about `1 + n` more. Lattices, and scans are
//! something in between, leave smaller gaps.

use super::opening::Opening;
use super::{Local, NotFound};

/// Odds against chance: that of one false opening in exp(10) searches, 20,000. As for edges.
const CERTAINTY: f64 = 10.0;

/// Shape parameters of a circle.
const OF_A_CIRCLE: usize = 3;

/// What a gap must gain over closed sheet to be an opening, when the places within `search_mm` were searched:
/// `n = 10 + ln(2 N) + (1 + parameters beyond a circle's) ln(1 + n)`.
pub fn needed_gain<O: Opening>(search_mm: f64, density_per_mm2: f64) -> f64 {
    let searched = std::f64::consts::PI * search_mm * search_mm * density_per_mm2;
    let start = CERTAINTY + (2.0 * searched).max(1.0).ln();
    let freedom = (1 + O::SHAPE.saturating_sub(OF_A_CIRCLE)) as f64;
    // Contracts: the slope of the right side is freedom / (1 + n), below a third.
    (0..40).fold(start, |gain, _| start + freedom * gain.ln_1p())
}

/// Points of the scan's density that an outline leaves out: the most that its gap can gain.
pub fn left_out<O: Opening>(outline: &O, density_per_mm2: f64) -> f64 {
    outline.void(0.0).0[0] * density_per_mm2
}

/// Sees to it that an opening of this size can be told at all.
///
/// # Errors
/// The points are too far apart for it.
pub fn check_size<O: Opening>(local: &Local, nominal: &O, search_mm: f64) -> Result<(), NotFound> {
    let h = local.scan.spacing_mm;
    let density = (h * h).recip();
    let (expected, needed) = (left_out(nominal, density), needed_gain::<O>(search_mm, density));
    if expected >= needed && nominal.least_size_mm() > h {
        return Ok(());
    }
    let size = nominal.sizes_in_words();
    let why = if expected < needed {
        format!("it leaves out {expected:.0} points, {needed:.0} are needed to tell it from a gap by chance")
    } else {
        "it must be wider than that".to_owned()
    };
    Err(NotFound::new(format!("the {} ({size}) is too small for a point spacing of {h:.2} mm: {why}", O::WORD), 0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::soft_edge::{Circle, Slot};

    /// `n - ln(1 + n) = 10 + ln(2 * 1.3 * pi * 2.3²)` has the solution 16.65, by hand.
    #[test]
    fn needed_gain_solves_its_equation() {
        let gain = needed_gain::<Circle>(2.3, 1.3);
        assert!((gain - 16.65).abs() < 0.02, "{gain}");
        assert!(needed_gain::<Slot>(2.3, 1.3) > gain + 4.0);
        // No area to search still asks for the odds.
        assert!(needed_gain::<Circle>(0.0, 1.3) > CERTAINTY);
    }
}
