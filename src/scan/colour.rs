//! The colour and luminance filters: which colours are the belt's, below which luminance a point is not to be trusted.

/// Colours of the unworn belt with their tolerance.
#[derive(Debug, Clone)]
pub(super) struct BeltColours {
    colours: Vec<[i32; 3]>,
    tolerance_sq: f64,
}

impl BeltColours {
    /// Colours within `tolerance` (Euclidean distance in 8-bit RGB) of one of `colours` are the belt's.
    pub fn new(colours: &[[u8; 3]], tolerance: f64) -> Self {
        Self { colours: colours.iter().map(|c| c.map(i32::from)).collect(), tolerance_sq: tolerance * tolerance }
    }

    /// Whether a colour is the belt's.
    pub fn matches(&self, colour: [u8; 3]) -> bool {
        self.colours.iter().any(|belt| {
            let square = |k: usize| (belt[k] - i32::from(colour[k])).pow(2);
            f64::from(square(0) + square(1) + square(2)) <= self.tolerance_sq
        })
    }
}

/// Rec. 601 luminance, 0..255.
pub(super) fn luminance(colour: [u8; 3]) -> f64 {
    // In thousandths, so that the sum is exact and a grey of 25 is not below 25.
    f64::from(299 * u32::from(colour[0]) + 587 * u32::from(colour[1]) + 114 * u32::from(colour[2])) / 1000.0
}

/// Luminance between the darkest mode and the rest of the colours, within 10..40; `None` when there is no dark mode that
/// stands apart: then nothing is too dark.
///
/// Otsu's threshold of the dark end of the histogram (below 100), accepted only where it lies in a valley.
pub(super) fn automatic_luminance_min(colours: impl Iterator<Item = [u8; 3]>) -> Option<f64> {
    const DARK_END: usize = 100;
    const LOWEST: usize = 10;
    const HIGHEST: usize = 40;
    let mut histogram = [0.0f64; 256];
    let mut total = 0.0;
    for colour in colours {
        histogram[(luminance(colour) as usize).min(255)] += 1.0;
        total += 1.0;
    }
    // Averaged over five levels: a camera's gamma leaves empty levels at the dark end.
    let smooth: Vec<f64> = (0..256usize)
        .map(|k| {
            let around = &histogram[k.saturating_sub(2)..(k + 3).min(256)];
            around.iter().sum::<f64>() / around.len() as f64
        })
        .collect();
    let threshold = otsu(&histogram[..DARK_END])?.clamp(LOWEST, HIGHEST);
    let dark: f64 = histogram[..threshold].iter().sum();
    let peak = |levels: &[f64]| levels.iter().copied().fold(0.0, f64::max);
    let (dark_peak, bright_peak) = (peak(&smooth[..threshold]), peak(&smooth[threshold..]));
    // The valley may lie beside Otsu's threshold when the two modes differ much in size.
    let valley = (LOWEST..=HIGHEST).min_by(|&a, &b| smooth[a].total_cmp(&smooth[b]).then(b.cmp(&a)))?;
    let stands_apart = smooth[valley] < 0.3 * dark_peak.min(bright_peak);
    (stands_apart && dark >= 0.001 * total && valley > 0).then_some(valley as f64)
}

/// First level of the upper class that separates the two classes best; `None` for an empty histogram.
fn otsu(histogram: &[f64]) -> Option<usize> {
    let total: f64 = histogram.iter().sum();
    if total <= 0.0 {
        return None;
    }
    let moment: f64 = histogram.iter().enumerate().map(|(k, n)| k as f64 * n).sum();
    let (mut best, mut best_level) = (-1.0, 0);
    let (mut below, mut below_moment) = (0.0, 0.0);
    for (level, n) in histogram.iter().enumerate() {
        let above = total - below;
        if below > 0.0 && above > 0.0 {
            let apart = below_moment / below - (moment - below_moment) / above;
            let between = below * above * apart * apart;
            if between > best {
                (best, best_level) = (between, level);
            }
        }
        below += n;
        below_moment += level as f64 * n;
    }
    Some(best_level)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn luminance_is_rec_601_and_exact_on_greys() {
        for grey in 0..=255u8 {
            assert_eq!(luminance([grey; 3]), f64::from(grey));
        }
        assert!((luminance([100, 50, 200]) - (29.9 + 29.35 + 22.8)).abs() < 1e-12);
    }

    #[test]
    fn the_tolerance_is_a_distance_in_rgb() {
        let belt = BeltColours::new(&[[96, 98, 101], [20, 120, 60]], 5.0);
        assert!(belt.matches([99, 102, 101]), "3-4-0 is exactly 5 away");
        assert!(!belt.matches([99, 102, 102]));
        assert!(belt.matches([20, 124, 63]));
    }

    #[test]
    fn a_dark_mode_is_cut_in_its_valley_and_a_bright_picture_is_left_alone() {
        let spread = |centre: i32, count: i32| (0..count).map(move |k| [(centre - 8 + k % 17) as u8; 3]);
        let with_shadow = spread(12, 2_000).chain(spread(150, 50_000)).chain(spread(90, 20_000));
        let cut = automatic_luminance_min(with_shadow).unwrap();
        assert!((21.0..=40.0).contains(&cut), "between 20 and 82, no higher than 40: {cut}");
        assert_eq!(automatic_luminance_min(spread(150, 50_000).chain(spread(90, 20_000))), None);
        // One broad mode that only begins in the dark has no valley.
        assert_eq!(automatic_luminance_min((0..60_000).map(|k| [(5 + k % 150) as u8; 3])), None);
    }
}
