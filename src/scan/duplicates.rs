//! Points that stand exactly where another one does: of an export that holds each point twice, of two exports that overlap, or the
//! places that a scanner writes for empty pixels. They tell nothing new, and would make everything look twice as certain.

use super::neighbourhood::CHUNK;
use crate::geometry::Point3;
use crate::run::{Cancelled, RunContext};
use rayon::prelude::*;
use std::collections::HashSet;
use std::sync::atomic::{AtomicU64, Ordering};

/// Indices of the points whose place an earlier point has, to the last bit; ascending.
///
/// Two tables of bits, one a hash, tell which places may be taken twice; only those are looked up exactly. Which bits end up set
/// does not depend on the order in which they are.
pub(super) fn duplicates(positions: &[Point3], run: &RunContext) -> Result<Vec<u32>, Cancelled> {
    const BITS_PER_POINT: usize = 8;
    let bits = (BITS_PER_POINT * positions.len()).next_power_of_two().max(64);
    let table = || -> Vec<AtomicU64> { (0..bits / 64).map(|_| AtomicU64::new(0)).collect() };
    let (once, twice) = (table(), table());
    let bit = |p: &Point3| {
        let slot = hash(&key(p)) as usize & (bits - 1);
        (slot / 64, 1_u64 << (slot % 64))
    };
    positions.par_chunks(CHUNK).try_for_each(|points| {
        run.check()?;
        for (word, mask) in points.iter().map(bit) {
            if once[word].fetch_or(mask, Ordering::Relaxed) & mask != 0 {
                twice[word].fetch_or(mask, Ordering::Relaxed);
            }
        }
        Ok(())
    })?;
    let suspect = |p: &Point3| {
        let (word, mask) = bit(p);
        twice[word].load(Ordering::Relaxed) & mask != 0
    };
    let suspects: Vec<Vec<u32>> = positions
        .par_chunks(CHUNK)
        .enumerate()
        .map(|(chunk, points)| {
            run.check()?;
            let those = points.iter().enumerate().filter(|(_, p)| suspect(p));
            Ok(those.map(|(k, _)| (chunk * CHUNK + k) as u32).collect())
        })
        .collect::<Result<_, Cancelled>>()?;
    let mut taken = HashSet::new();
    let mut again = Vec::new();
    for some in suspects.concat().chunks(CHUNK) {
        run.check()?;
        again.extend(some.iter().copied().filter(|&k| !taken.insert(key(&positions[k as usize]))));
    }
    Ok(again)
}

/// Takes some indices out of others; both ascend.
pub(super) fn leave_out(indices: &mut Vec<u32>, taken: &[u32]) {
    let mut taken = taken.iter().peekable();
    indices.retain(|k| {
        while taken.next_if(|t| *t < k).is_some() {}
        taken.peek() != Some(&k)
    });
}

/// The words for duplicates among a scan's points, if there are any.
pub(super) fn warning_of_duplicates(duplicates: usize, points: usize) -> Option<String> {
    (duplicates > 0).then(|| {
        format!(
            "{duplicates} of {points} points stand exactly where another one does and were left out: see whether the file holds an \
             export twice"
        )
    })
}

/// A place as bits: the same for both zeros.
fn key(p: &Point3) -> [u64; 3] {
    [p.x, p.y, p.z].map(|c| (c + 0.0).to_bits())
}

/// Mixes a place's bits; neighbours on a lattice get unrelated values.
fn hash(key: &[u64; 3]) -> u64 {
    const ODD: u64 = 0x9e37_79b9_7f4a_7c15;
    let mixed = key.iter().fold(0_u64, |h, bits| {
        let h = (h ^ bits).wrapping_mul(ODD);
        h ^ (h >> 32)
    });
    mixed.wrapping_mul(ODD) >> 20
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(positions: &[Point3]) -> Vec<u32> {
        duplicates(positions, &RunContext::silent()).unwrap()
    }

    #[test]
    fn indices_are_left_out() {
        let mut indices = vec![1, 2, 5, 7, 9];
        leave_out(&mut indices, &[0, 2, 3, 9]);
        assert_eq!(indices, [1, 5, 7]);
    }

    /// A lattice of 70,000 places, more than two chunks.
    fn lattice() -> Vec<Point3> {
        (0..70_000).map(|k| Point3::new(f64::from(k % 300) * 0.1, f64::from(k / 300) * 0.1, 0.0)).collect()
    }

    #[test]
    fn points_of_their_own_are_no_duplicates() {
        assert!(found(&lattice()).is_empty());
        assert!(found(&[]).is_empty());
        // Next to each other, or with coordinates swapped, is elsewhere.
        let near = [[1.0, 2.0, 3.0], [1.0, 2.0, 3.0_f64.next_up()], [2.0, 1.0, 3.0], [3.0, 2.0, 1.0]];
        assert!(found(&near.map(Point3::from)).is_empty());
    }

    #[test]
    fn all_but_the_first_at_a_place_are_told() {
        let mut points = lattice();
        let again: Vec<Point3> = points.iter().skip(7).step_by(100).copied().collect();
        points.extend(again.iter().copied().chain(again.iter().take(3).copied()));
        let expected: Vec<u32> = (70_000..points.len() as u32).collect();
        assert_eq!(found(&points), expected);
        let zeros = [[0.0, 1.0, 0.0], [-0.0, 1.0, 0.0]];
        assert_eq!(found(&zeros.map(Point3::from)), [1]);
    }
}
