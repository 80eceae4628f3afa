//! The naming rule: P01 for surface points, E01 for edges, C01 for holes; features H1, S1, A1, B1.

use super::List;

/// The letter of a kind in a list.
fn letter(list: List, kind: &str) -> char {
    match (list, kind) {
        (List::Comparison, "surface") => 'P',
        (List::Comparison, "edge") => 'E',
        (List::Comparison, _) => 'C',
        (List::Feature, "hole") => 'H',
        (List::Feature, "slot") => 'S',
        (List::Feature, "edge") => 'B',
        (List::Feature, _) => 'A',
    }
}

/// The next free name by the rule: one above the highest number in use, so that a name that was given up is not given again while
/// later ones stand.
pub(super) fn next<'n>(list: List, kind: &str, taken: impl Iterator<Item = &'n str>) -> String {
    let letter = letter(list, kind);
    let number = |name: &str| {
        let digits = name.strip_prefix(letter)?;
        let plain = !digits.is_empty() && digits.len() <= 6 && digits.bytes().all(|b| b.is_ascii_digit());
        digits.parse::<u32>().ok().filter(|_| plain)
    };
    let highest = taken.filter_map(number).max().unwrap_or(0);
    match list {
        List::Comparison => format!("{letter}{:02}", highest + 1),
        List::Feature => format!("{letter}{}", highest + 1),
    }
}

/// Whether a plan takes a name.
pub(super) fn is_good(name: &str) -> bool {
    let unreadable = |c: char| c.is_control() || matches!(c, '\u{2028}' | '\u{2029}');
    !name.is_empty() && name.trim() == name && name.chars().count() <= 120 && !name.contains(unreadable)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_go_on_by_kind() {
        let taken = ["P01", "P09", "E01", "Pillar", "P", "C12x", "H1"];
        let of = |list, kind| next(list, kind, taken.into_iter());
        assert_eq!(of(List::Comparison, "surface"), "P10");
        assert_eq!(of(List::Comparison, "edge"), "E02");
        assert_eq!(of(List::Comparison, "hole"), "C01");
        assert_eq!(of(List::Feature, "hole"), "H2");
        assert_eq!(of(List::Feature, "slot"), "S1");
        assert_eq!(next(List::Comparison, "edge", ["E99"].into_iter()), "E100");
        assert!(is_good("Bracket 4") && !is_good(" P1") && !is_good("") && !is_good("a\tb"));
    }
}
