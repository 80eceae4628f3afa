//! Edges of a plain sheet: measured, or the reason told.

use super::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const SPACING: f64 = 0.2;

/// Sheet below v = 0, and a share of its density beyond; where the density falls most, and the fit there.
fn measured(along: [f64; 2], beyond: f64, search_mm: f64) -> Result<f64, NotFound> {
    let strip = Strip {
        along,
        inner: search_mm + 1.6,
        outer: search_mm + 0.8,
        least_length: 12.0 * SPACING,
        edge: vec![[0.0; 3]],
    };
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let steps = |low: f64, high: f64| ((high - low) / SPACING) as i32;
    let mut sheet = Vec::new();
    for i in 0..steps(along[0], along[1]) {
        for j in 0..steps(-strip.inner, strip.outer) {
            let mut jittered = |from: f64, k: i32| from + SPACING * (f64::from(k) + rng.random_range(0.0..1.0));
            let place = [jittered(along[0], i), jittered(-strip.inner, j)];
            if place[1] < 0.0 || rng.random_range(0.0..1.0) < beyond {
                sheet.push(place);
            }
        }
    }
    let rough = steepest_step(&sheet, &strip, search_mm, SPACING)?;
    let fit = final_fit(&sheet, &strip, rough, SPACING)?;
    check(&fit, search_mm, &mut Card::default())?;
    Ok(fit.outline.offset)
}

fn reason(found: Result<f64, NotFound>) -> String {
    found.unwrap_err().reason
}

#[test]
fn an_edge_is_measured_or_the_reason_is_told() {
    // 25 spacings along the edge fix it to `sqrt(0.3 / (0.9 * 25))` = 0.12 of them; three times that.
    let found = measured([-2.5, 2.5], 0.0, 1.0).unwrap();
    assert!(found.abs() < 3.0 * 0.12 * SPACING, "{found}");
    assert!(measured([-2.5, 2.5], 0.02, 1.0).is_ok());
    let past = reason(measured([-2.5, 2.5], 0.2, 1.0));
    assert!(
        past.starts_with("points go on past this edge (") && past.ends_with(" % of the density of the sheet)"),
        "{past}"
    );
    assert_eq!(reason(measured([-2.5, 2.5], 1.0, 1.0)), "no edge within ±1.0 mm");
    let short = reason(measured([-1.0, 1.0], 0.0, 1.0));
    assert!(short.ends_with(" point spacings long here, 12 are needed"), "{short}");
}
