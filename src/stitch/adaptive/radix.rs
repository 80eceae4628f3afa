//! Numbers sorted by some of their bits, in time that goes with how many there are.

use super::points::score_key;

/// Bits of one pass: of a few numbers, and of so many that as many counters do not count.
const DIGIT: u32 = 11;
const WIDE_DIGIT: u32 = 15;
const MANY: usize = 1 << WIDE_DIGIT;

/// Sorts by the bits from `low` to below `high`; numbers equal in these keep their order. `spare` is for scratch.
pub(super) fn sort_by_bits(numbers: &mut Vec<u64>, spare: &mut Vec<u64>, low: u32, high: u32) {
    spare.clear();
    spare.resize(numbers.len(), 0);
    let widest = if numbers.len() < MANY { DIGIT } else { WIDE_DIGIT };
    let passes = (high - low).div_ceil(widest).max(1);
    let wide = (high - low).div_ceil(passes).max(1);
    let mut places = vec![0_u32; 1 << wide];
    for shift in (low..high).step_by(wide as usize) {
        let mask = (1_u64 << wide.min(high - shift)) - 1;
        let digit = |number: u64| ((number >> shift) & mask) as usize;
        places.fill(0);
        numbers.iter().for_each(|number| places[digit(*number)] += 1);
        let mut sum = 0;
        for place in &mut places {
            sum += std::mem::replace(place, sum);
        }
        for number in numbers.iter() {
            let place = &mut places[digit(*number)];
            spare[*place as usize] = *number;
            *place += 1;
        }
        std::mem::swap(numbers, spare);
    }
}

/// Steps into which scores are cut, as bits.
const STEPS: u32 = 22;

/// Positions of scores from the best (the largest) to the worst, what is no number last; of equal ones the first is better. At most 2^32 of them.
/// They are cut into even steps first, and what falls into one is looked at afterwards.
pub(super) fn by_rank(scores: &[f64], numbers: &mut Vec<u64>, spare: &mut Vec<u64>) {
    const INDEX: u32 = 32;
    let least_and_most = |(a, b): (f64, f64), score: &f64| (a.min(*score), b.max(*score));
    let (worst, best) =
        scores.iter().filter(|s| s.is_finite()).fold((f64::INFINITY, f64::NEG_INFINITY), least_and_most);
    let last = (1_u32 << STEPS) - 1;
    // Halves, since the whole may be more than there are numbers.
    let per_score = f64::from(last - 1) / (0.5 * best - 0.5 * worst).max(f64::MIN_POSITIVE);
    let step = |score: f64| {
        if score.is_nan() { last } else { (((0.5 * best - 0.5 * score) * per_score) as u32).min(last - 1) }
    };
    numbers.clear();
    numbers.extend(scores.iter().enumerate().map(|(k, score)| (u64::from(step(*score)) << INDEX) | k as u64));
    sort_by_bits(numbers, spare, INDEX, INDEX + STEPS);
    let whole = |number: &u64| (score_key(scores[*number as u32 as usize]), *number);
    let alike = numbers.chunk_by_mut(|a, b| a >> INDEX == b >> INDEX);
    alike.filter(|run| run.len() > 1).for_each(|run| run.sort_unstable_by_key(whole));
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn bits_are_sorted_and_the_rest_keeps_its_order() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for (low, high) in [(0, 64), (3, 20), (32, 33), (5, 5)] {
            // As many as are sorted by more bits at once, too.
            let count = if low == 3 { 2 * MANY } else { 5000 };
            let mut numbers: Vec<u64> = (0..count).map(|_| rng.random::<u64>() >> rng.random_range(0..40)).collect();
            let mut expected = numbers.clone();
            let mask = if high - low == 64 { u64::MAX } else { (1 << (high - low)) - 1 };
            expected.sort_by_key(|n| (n >> low) & mask);
            sort_by_bits(&mut numbers, &mut Vec::new(), low, high);
            assert_eq!(numbers, expected, "{low} to {high}");
        }
        let mut none = Vec::new();
        sort_by_bits(&mut none, &mut Vec::new(), 0, 64);
        assert!(none.is_empty());
    }

    /// Scores that differ in their last digits only, with a few far off, over all magnitudes, none of them a number, and all alike.
    #[test]
    fn ranks_go_by_the_whole_score_and_ties_by_the_index() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let near: Vec<f64> = (0..3000).map(|_| 1.0 + f64::EPSILON * f64::from(rng.random_range(0..40))).collect();
        let far: Vec<f64> =
            near.iter().enumerate().map(|(k, n)| if k % 5 == 0 { 1e308 * (n - 2.0) } else { *n }).collect();
        let mut any: Vec<f64> =
            (0..40_000).map(|_| rng.random_range(-1.0..1.0) * 2f64.powi(rng.random_range(-990..990))).collect();
        let odd = [f64::NAN, f64::INFINITY, 0.0, f64::NEG_INFINITY, -0.0, f64::NAN, f64::MAX, f64::MIN, f64::INFINITY];
        any.extend(odd);
        for scores in [near, far, any, odd.to_vec(), vec![7.0; 50], vec![f64::NAN; 3], odd[1..2].to_vec(), Vec::new()] {
            let mut expected: Vec<usize> = (0..scores.len()).collect();
            expected.sort_by_key(|k| (score_key(scores[*k]), *k));
            let mut numbers = Vec::new();
            by_rank(&scores, &mut numbers, &mut Vec::new());
            let found: Vec<usize> = numbers.iter().map(|n| *n as u32 as usize).collect();
            assert_eq!(found, expected);
        }
    }
}
