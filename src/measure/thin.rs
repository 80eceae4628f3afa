//! Some of the points of a window, chosen by where they lie in it: one point more or less, another order or another scan frame changes
//! nothing of which others are taken.

/// Points of the same cell are taken together or not at all; few are, at the densities that need thinning, mm.
const CELL_MM: f64 = 0.1;

/// Whether a place belongs to the one of so many that are taken.
pub fn is_taken(u_mm: f64, v_mm: f64, one_of: usize) -> bool {
    one_of <= 1 || mixed(cell(u_mm), cell(v_mm)).is_multiple_of(one_of as u64)
}

fn cell(mm: f64) -> u64 {
    (mm / CELL_MM).floor() as i64 as u64
}

/// The finaliser of SplitMix64 (Steele, Lea and Flood 2014) over both numbers: neighbours have nothing in common.
fn mixed(a: u64, b: u64) -> u64 {
    let mut x = a.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(b).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of 40,000 places one in seven is 5714, and 70 is a standard deviation; of those taken the places to the right are taken as often
    /// as any.
    #[test]
    fn one_in_so_many_is_taken_whatever_its_neighbours() {
        let at = |i: i32, j: i32| is_taken(0.1 * f64::from(i) + 0.05, 0.1 * f64::from(j) + 0.05, 7);
        let places = || (-100..100).flat_map(|i| (-100..100).map(move |j| (i, j)));
        let taken = places().filter(|(i, j)| at(*i, *j)).count();
        assert!(taken.abs_diff(5714) < 280, "{taken}");
        for (di, dj) in [(1, 0), (0, 1), (1, 1)] {
            let both = places().filter(|(i, j)| at(*i, *j) && at(i + di, j + dj)).count();
            // A seventh of those taken, 816, give or take 27.
            assert!(both.abs_diff(816) < 110, "{both}");
        }
        assert!(is_taken(3.3, -2.1, 1) && is_taken(3.3, -2.1, 0));
    }
}
