//! A mark for each point of a tile, that many threads may set.

use std::sync::atomic::{AtomicU64, Ordering};

/// Points of one number.
const WORD: usize = 64;

/// A bit for each point; set once, never taken back.
pub(super) struct Marks(Vec<AtomicU64>);

impl Marks {
    pub fn none(points: usize) -> Self {
        // One more than is needed, so that what lies on two can always be read.
        Self((0..points / WORD + 2).map(|_| AtomicU64::new(0)).collect())
    }

    #[inline]
    pub fn has(&self, point: usize) -> bool {
        self.0[point / WORD].load(Ordering::Relaxed) >> (point % WORD) & 1 == 1
    }

    /// A bit for each of up to 32 points from one on that has no mark.
    #[inline]
    pub fn without(&self, from: usize, count: usize) -> u32 {
        let (word, shift) = (from / WORD, from % WORD);
        let [low, high] = [word, word + 1].map(|k| self.0[k].load(Ordering::Relaxed));
        let marks = (u128::from(high) << WORD | u128::from(low)) >> shift;
        !(marks as u32) & ((1_u64 << count) - 1) as u32
    }

    /// Marks points; those near each other at once, where they stand one after the other.
    pub fn set(&self, points: impl IntoIterator<Item = usize>) {
        let mut word = 0;
        let mut bits = 0;
        for point in points {
            if point / WORD != word {
                self.set_bits(word, bits);
                (word, bits) = (point / WORD, 0);
            }
            bits |= 1 << (point % WORD);
        }
        self.set_bits(word, bits);
    }

    fn set_bits(&self, word: usize, bits: u64) {
        if bits != 0 {
            self.0[word].fetch_or(bits, Ordering::Relaxed);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_no_mark_is_told_over_the_bounds_of_words() {
        let marks = Marks::none(200);
        let marked = |k: usize| k.is_multiple_of(3) || (60..70).contains(&k);
        marks.set((0..200).filter(|k| marked(*k)));
        for from in 0..200 {
            assert_eq!(marks.has(from), marked(from));
            for count in [1, 5, 16, 32] {
                let expected =
                    (0..count).filter(|k| from + k < 200 && !marked(from + k)).map(|k| 1_u32 << k).sum::<u32>();
                let found = marks.without(from, count.min(200 - from));
                assert_eq!(found, expected, "{from} {count}");
            }
        }
    }
}
