//! A fixed shuffle: its first points are a fair sample of all, however many are drawn.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// The numbers below `n` in an order that is always the same and without pattern.
pub fn shuffled(n: usize) -> Vec<u32> {
    let mut rng = ChaCha8Rng::seed_from_u64(0x5CA1_AB1E);
    let mut order: Vec<u32> = (0..n as u32).collect();
    for k in (1..n).rev() {
        // The product's upper half is uniform over 0..=k to 2^-32 * k, far below what an eye sees.
        let other = (u64::from(rng.next_u32()) * (k as u64 + 1)) >> 32;
        order.swap(k, other as usize);
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_once_and_the_first_ones_from_everywhere() {
        let n = 100_000;
        let order = shuffled(n);
        assert_eq!(order, shuffled(n));
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert!(sorted.iter().enumerate().all(|(k, &v)| k == v as usize));
        // A tenth of a fair sample of 10,000 in each tenth of the numbers: 1000, standard deviation 30; five of them are 150.
        for tenth in 0..10u32 {
            let there = order[..10_000].iter().filter(|&&v| v / 10_000 == tenth).count();
            assert!(there.abs_diff(1000) < 150, "{tenth}: {there}");
        }
        assert!(shuffled(0).is_empty() && shuffled(1) == [0]);
    }
}
