//! Numbers sorted by some of their bits, in time that goes with how many there are.

/// Bits of one pass.
const DIGIT: u32 = 11;

/// Sorts by the bits from `low` to below `high`; numbers equal in these keep their order. `spare` is for scratch.
pub(super) fn sort_by_bits(numbers: &mut Vec<u64>, spare: &mut Vec<u64>, low: u32, high: u32) {
    spare.clear();
    spare.resize(numbers.len(), 0);
    for shift in (low..high).step_by(DIGIT as usize) {
        let mask = (1_u64 << DIGIT.min(high - shift)) - 1;
        let digit = |number: u64| ((number >> shift) & mask) as usize;
        let mut places = [0_usize; 1 << DIGIT];
        numbers.iter().for_each(|number| places[digit(*number)] += 1);
        if places.contains(&numbers.len()) {
            continue;
        }
        let mut sum = 0;
        for place in &mut places {
            sum += std::mem::replace(place, sum);
        }
        for number in numbers.iter() {
            let place = &mut places[digit(*number)];
            spare[*place] = *number;
            *place += 1;
        }
        std::mem::swap(numbers, spare);
    }
}

/// Positions of scores (smaller keys are better) from the best to the worst; of equal ones the first is better. At most 2^32 of them.
pub(super) fn by_rank(keys: &[u64], numbers: &mut Vec<u64>, spare: &mut Vec<u64>) {
    const INDEX: u32 = 32;
    let (best, worst) = keys.iter().fold((u64::MAX, 0), |(a, b), key| (a.min(*key), b.max(*key)));
    let bits = u64::BITS - worst.saturating_sub(best).leading_zeros();
    // What does not fit beside the index is cut off first and looked at afterwards.
    let cut = bits.saturating_sub(u64::BITS - INDEX);
    numbers.clear();
    numbers.extend(keys.iter().enumerate().map(|(k, key)| (((key - best) >> cut) << INDEX) | k as u64));
    sort_by_bits(numbers, spare, INDEX, INDEX + bits - cut);
    if cut == 0 {
        return;
    }
    let whole = |number: &u64| (keys[(*number & u64::from(u32::MAX)) as usize], *number);
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
            let mut numbers: Vec<u64> = (0..5000).map(|_| rng.random::<u64>() >> rng.random_range(0..40)).collect();
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

    /// Keys that differ in their lowest bits only, over all bits, and not at all.
    #[test]
    fn ranks_go_by_the_whole_key_and_ties_by_the_index() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let near: Vec<u64> = (0..3000).map(|_| (1 << 63) | rng.random_range(0..40)).collect();
        let far: Vec<u64> = near.iter().enumerate().map(|(k, n)| if k % 5 == 0 { n % 7 } else { *n }).collect();
        let any: Vec<u64> = (0..3000).map(|_| rng.random()).collect();
        for keys in [near, far, any, vec![7; 50], vec![u64::MAX, 0, u64::MAX], Vec::new()] {
            let mut expected: Vec<usize> = (0..keys.len()).collect();
            expected.sort_by_key(|k| (keys[*k], *k));
            let mut numbers = Vec::new();
            by_rank(&keys, &mut numbers, &mut Vec::new());
            let found: Vec<usize> = numbers.iter().map(|n| *n as u32 as usize).collect();
            assert_eq!(found, expected);
        }
    }
}
