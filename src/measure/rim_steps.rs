//! Whether the rim of an opening lies where the outline fitted to it does, all around: a tear, a burr or an oval must not pass for a
//! shift of the whole.
//!
//! In stretches of the rim of several lengths, half over each other, the hard step of greatest likelihood is looked for, as at the
//! place of an edge. A stretch has a rim of its own when its step gains enough over the outline. Of points strewn at random as much
//! sheet stays empty by chance once in exp(9) tries, and there are some eighty stretches: one good opening in a hundred at most.

use super::edge_place::{Densities, Steps};
use super::opening::Opening;
use crate::fit::soft_edge::SoftEdgeFit;
use crate::fit::soft_edge::outline::MAX_SHAPE;

/// Gain in log-likelihood beyond which a stretch has a step of its own.
const STEP_GAIN: f64 = 9.0;
/// The finest parts of a rim, and the lengths that are looked at, in those.
const PARTS: usize = 48;
const LENGTHS: [usize; 4] = [16, 12, 6, 3];
/// How far from the rim is looked, in spacings and, where those are smaller, mm; into the opening at most this share of its radius.
const DEEP: (f64, f64) = (4.0, 2.5);
const INWARDS: f64 = 0.6;
/// Emptier than this share of that depth is a void and not a tear.
const SEEN_SHARE: f64 = 0.8;
/// Differences that count for none.
const LEAST: (f64, f64) = (0.5, 0.25);
/// Beyond this it is not the outline that was looked for.
const OTHER_SHAPE: (f64, f64) = (1.0, 0.5);

/// How a rim departs from the outline fitted to it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct RimSteps {
    /// Where it is furthest off: into the opening above 0, into the sheet below, mm; 0 where all of it is as fitted.
    pub off_mm: f64,
    /// Share of the rim that is off.
    pub share: f64,
    /// What is too far off for this outline, mm.
    pub most_mm: f64,
}

/// Looks along the rim. `sheet` are the points that were fitted; `wide` those that lie within the layer's whole scatter: where the sheet
/// leans, stretches that noise moved down are missing among the former, which is no tear.
pub fn rim_steps<O: Opening>(fit: &SoftEdgeFit<O>, sheet: &[[f64; 2]], wide: &[[f64; 2]]) -> RimSteps {
    let spacing = fit.density_per_mm2.sqrt().recip();
    let length = |(spacings, mm): (f64, f64)| (spacings * spacing).max(mm);
    let deep = length(DEEP);
    let inwards = INWARDS * 0.5 * fit.outline.least_size_mm();
    let high = inwards.min(deep);
    let tried = [(sheet, 1.0), (wide, wide.len() as f64 / sheet.len().max(1) as f64)];
    let tried = tried.map(|(points, more)| {
        let densities = Densities::new(fit.density_per_mm2 * more, fit.clutter);
        (by_part(&fit.outline, points, deep, inwards), densities)
    });
    let mut off = [false; PARTS];
    let mut furthest = 0.0_f64;
    for count in LENGTHS {
        for first in (0..PARTS).step_by(count / 2) {
            let own = (first..first + count).map(|part| part % PARTS);
            let step = |(parts, densities): &(Vec<Vec<f64>>, Densities)| {
                let v = own.clone().flat_map(|part| parts[part].iter().copied()).filter(|v| *v < high).collect();
                let steps = Steps::new(v, fit.outline.rim_mm() * count as f64 / PARTS as f64);
                let here = steps.best(-deep, *densities);
                let gain = steps.likelihood(here, *densities) - steps.likelihood(0.0, *densities);
                (here.abs() > length(LEAST) && gain > STEP_GAIN).then_some(here)
            };
            let found = match step(&tried[0]) {
                Some(here) if here < 0.0 => step(&tried[1]).filter(|wide| *wide < 0.0),
                found => found,
            };
            // Where next to nothing stands as deep as is looked the sheet was not seen: voids are left out of the fit, and tell of no rim.
            if let Some(here) = found.filter(|here| *here > -SEEN_SHARE * deep) {
                own.clone().for_each(|part| off[part] = true);
                furthest = if here.abs() > furthest.abs() { here } else { furthest };
            }
        }
    }
    let share = off.iter().filter(|off| **off).count() as f64 / PARTS as f64;
    RimSteps { off_mm: furthest, share, most_mm: length(OTHER_SHAPE) }
}

/// Of the points beside each part of the rim, how far they are from it: into the opening above 0, the length by which a strip of the rim's own
/// length would have the area that lies between, so that a round rim is as good as a straight one.
fn by_part<O: Opening>(outline: &O, sheet: &[[f64; 2]], deep: f64, inwards: f64) -> Vec<Vec<f64>> {
    let mut parts = vec![Vec::new(); PARTS];
    let mut unused = [0.0; MAX_SHAPE];
    for p in sheet {
        let into = -outline.signed_mm(*p, &mut unused);
        if !(-deep..inwards).contains(&into) {
            continue;
        }
        let (along_mm, per_radius) = outline.rim_place(*p);
        let v = into - 0.5 * per_radius * into * into;
        let part = (along_mm / outline.rim_mm() * PARTS as f64) as usize;
        if v > -deep {
            parts[part.min(PARTS - 1)].push(v);
        }
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::soft_edge::{Circle, Slot};

    /// Places along the rim are told in order, once around, and the area beside a stretch is its length times the depth.
    #[test]
    fn a_rim_is_unrolled_without_stretching_an_area() {
        let circle = Circle { centre: [1.0, -2.0], radius: 5.0 };
        let slot = Slot { centre: [0.5, 0.25], angle: 0.7, half_straight: 4.0, radius: 3.0 };
        check(&circle);
        check(&slot);
    }

    fn check<O: Opening>(outline: &O) {
        // A fine lattice stands for the area; parts of 3 mm², told to the lattice's 0.02 mm along their edges.
        let step = 0.02;
        let lattice: Vec<[f64; 2]> =
            (-600..600).flat_map(|i| (-600..600).map(move |j| [f64::from(i) * step, f64::from(j) * step])).collect();
        let parts = by_part(outline, &lattice, 1.5, 1.5);
        let width = outline.rim_mm() / PARTS as f64;
        for (low, high) in [(-1.4, 0.0), (0.0, 1.0)] {
            for (k, part) in parts.iter().enumerate() {
                let area = part.iter().filter(|v| (low..high).contains(*v)).count() as f64 * step * step;
                assert!((area / (width * (high - low)) - 1.0).abs() < 0.04, "part {k}: {area} mm²");
            }
        }
        let corners = outline.grown(0.0);
        let places: Vec<f64> = corners.iter().map(|c| outline.rim_place(*c).0).collect();
        let wraps = (0..places.len()).filter(|&k| places[(k + 1) % places.len()] < places[k]).count();
        assert!(wraps == 1 && places.iter().all(|mm| (0.0..=outline.rim_mm() + 1e-9).contains(mm)), "{places:?}");
    }
}
