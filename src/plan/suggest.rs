//! The nearest known name for a misspelt one.

/// Words people use for our keys; the right side stands where it is known.
const SYNONYMS: [(&str, &str); 32] = [
    ("millimetre", "mm"),
    ("millimeter", "mm"),
    ("centimetre", "cm"),
    ("centimeter", "cm"),
    ("metre", "m"),
    ("meter", "m"),
    ("inches", "inch"),
    ("micron", "um"),
    ("micrometre", "um"),
    ("micrometer", "um"),
    ("\u{b5}m", "um"),
    ("\u{3bc}m", "um"),
    ("center", "centre"),
    ("center", "position"),
    ("centre", "position"),
    ("position", "centre"),
    ("pos", "position"),
    ("point", "position"),
    ("normal", "direction"),
    ("normal", "axis"),
    ("direction", "axis"),
    ("tol_lower", "lower_mm"),
    ("tol_upper", "upper_mm"),
    ("min", "lower_mm"),
    ("max", "upper_mm"),
    ("radius_mm", "diameter_mm"),
    ("units", "unit"),
    ("path", "file"),
    ("path", "folder"),
    ("id", "name"),
    ("type", "kind"),
    ("points", "comparison"),
];

/// The known name that is nearest to what was written, and whether it is near enough to be meant.
///
/// Distance is Damerau-Levenshtein over lower-case letters with `-` read as `_`; near enough is a third of the letters
/// (two at least), a known synonym, or one name beginning with the other. `None` only without candidates.
pub(super) fn nearest<'c>(written: &str, candidates: impl IntoIterator<Item = &'c str>) -> Option<(&'c str, bool)> {
    // Longer names are no key of ours; the cut keeps the distance cheap on hostile input.
    let plain: String =
        written.chars().take(64).flat_map(char::to_lowercase).map(|c| if c == '-' { '_' } else { c }).collect();
    let candidates: Vec<&'c str> = candidates.into_iter().collect();
    let synonym = SYNONYMS
        .iter()
        .find(|(word, known)| *word == plain && candidates.contains(known))
        .and_then(|(_, known)| candidates.iter().find(|c| *c == known));
    let distance = |c: &str| strsim::damerau_levenshtein(&plain, &c.to_lowercase());
    let (best, steps) = candidates.iter().map(|c| (*c, distance(c))).min_by_key(|(_, steps)| *steps)?;
    if let (Some(known), true) = (synonym, steps > 0) {
        return Some((known, true));
    }
    let enough = (plain.chars().count() / 3).max(2);
    if steps <= enough {
        return Some((best, true));
    }
    // A name of one or two letters begins too much to mean anything.
    let begins = candidates
        .iter()
        .find(|c| plain.len() >= 3 && c.len() >= 3 && (c.starts_with(&plain) || plain.starts_with(**c)));
    Some(begins.map_or((best, false), |c| (*c, true)))
}

/// `a, b or c`, each in quotes when `quote` is `"`.
pub(super) fn list_or(names: &[&str], quote: &str) -> String {
    let quoted: Vec<String> = names.iter().map(|n| format!("{quote}{n}{quote}")).collect();
    match quoted.split_last() {
        None => "nothing".to_owned(),
        Some((only, [])) => only.clone(),
        Some((last, rest)) => format!("{} or {last}", rest.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_slips_synonyms_and_beginnings() {
        let keys = ["name", "number", "thickness_mm", "centre", "diameter_mm"];
        for (written, expected) in [
            ("thicknes_mm", Some(("thickness_mm", true))),
            ("Thickness-mm", Some(("thickness_mm", true))),
            ("thickness", Some(("thickness_mm", true))),
            ("center", Some(("centre", true))),
            ("radius_mm", Some(("diameter_mm", true))),
            ("nmae", Some(("name", true))),
        ] {
            assert_eq!(nearest(written, keys), expected, "{written}");
        }
        assert!(!nearest("colour_of_the_roof", keys).unwrap().1);
        assert_eq!(nearest("x", []), None);
    }

    #[test]
    fn lists_read_as_a_sentence() {
        assert_eq!(list_or(&["a", "b", "c"], "\""), "\"a\", \"b\" or \"c\"");
        assert_eq!(list_or(&["a"], ""), "a");
    }
}
