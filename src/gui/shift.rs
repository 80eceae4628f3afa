//! The parts of a shift by what was said of them, each scan counted once, however often it is inspected and the window opened.

use crate::inspect::{InspectionResult, Outcome, Verdict};
use toml_edit::{Array, DocumentMut, Item, Table, value};

/// Scans that are remembered; a shift of eight hours has fewer.
const MOST: usize = 10_000;
/// Digits of a content's hash that are kept: two scans of one name agree in them by one chance in 2^64.
const DIGITS: usize = 16;
/// Stands for the content of a scan that could not be read.
const UNREAD: &str = "-";

/// The keys of the counts in the settings, in the order of [`Counted::ALL`].
const KEYS: [&str; 5] = ["pass", "fail", "undecided", "incomplete", "refused"];

/// As what a part is counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Counted {
    /// Good.
    Pass,
    /// Bad.
    Fail,
    /// Nothing can be said of it.
    Undecided,
    /// A point of it was not measured.
    Incomplete,
    /// Its scan was refused.
    Refused,
}

/// A scan that was counted.
#[derive(Debug, Clone, PartialEq, Eq)]
struct CountedScan {
    name: String,
    /// The first digits of its content's hash; [`UNREAD`] of one that could not be read.
    content: String,
    kind: Counted,
}

/// The counts of a shift.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Shift {
    /// Good ones.
    pub pass: usize,
    /// Bad ones.
    pub fail: usize,
    /// Ones that nothing can be said of.
    pub undecided: usize,
    /// Ones with a point that was not measured.
    pub incomplete: usize,
    /// Scans that were refused.
    pub refused: usize,
    /// The scans behind the counts, the newest last.
    pub scans: CountedScans,
}

/// The scans that were counted.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct CountedScans(Vec<CountedScan>);

impl Counted {
    const ALL: [Counted; 5] = [Counted::Pass, Counted::Fail, Counted::Undecided, Counted::Incomplete, Counted::Refused];

    /// What came of a part.
    fn of(outcome: &Outcome) -> Self {
        match outcome {
            Outcome::Refused(_) => Counted::Refused,
            Outcome::Measured(inspection) => match inspection.verdict {
                Verdict::Pass => Counted::Pass,
                Verdict::Undecided => Counted::Undecided,
                Verdict::NotMeasured => Counted::Incomplete,
                Verdict::Fail => Counted::Fail,
            },
        }
    }

    fn key(self) -> &'static str {
        KEYS[Self::ALL.iter().position(|kind| *kind == self).unwrap_or_default()]
    }
}

impl Shift {
    /// Counts a part, once: who runs a sequence again has not made more parts. What is said of its scan now takes the place of what was said before.
    pub fn count(&mut self, result: &InspectionResult) {
        let id = &result.identity;
        self.count_scan(&id.scan_file, id.scan_sha256.as_deref(), Counted::of(&result.outcome));
    }

    fn count_scan(&mut self, name: &str, sha256: Option<&str>, kind: Counted) {
        let known = |scan: &CountedScan| scan.name == name;
        let content = match sha256 {
            Some(sha256) => sha256.chars().take(DIGITS).collect(),
            // What could not be read, or whose result was lost, is counted by its name until it can be, and never beside the scan of that name.
            None if self.scans.0.iter().any(|scan| known(scan) && scan.content != UNREAD) => return,
            None => UNREAD.to_owned(),
        };
        let again = |scan: &CountedScan| known(scan) && (scan.content == UNREAD || scan.content == content);
        let before: Vec<Counted> = self.scans.0.iter().filter(|scan| again(scan)).map(|scan| scan.kind).collect();
        self.scans.0.retain(|scan| !again(scan));
        for kind in before {
            let count = self.count_mut(kind);
            *count = count.saturating_sub(1);
        }
        *self.count_mut(kind) += 1;
        if self.scans.0.len() >= MOST {
            self.scans.0.remove(0);
        }
        self.scans.0.push(CountedScan { name: name.to_owned(), content, kind });
    }

    fn count_mut(&mut self, kind: Counted) -> &mut usize {
        match kind {
            Counted::Pass => &mut self.pass,
            Counted::Fail => &mut self.fail,
            Counted::Undecided => &mut self.undecided,
            Counted::Incomplete => &mut self.incomplete,
            Counted::Refused => &mut self.refused,
        }
    }

    /// All of them.
    pub fn total(&self) -> usize {
        self.pass + self.fail + self.undecided + self.incomplete + self.refused
    }

    /// Reads it from the settings; what is missing or odd counts nothing.
    pub(super) fn of(settings: &DocumentMut) -> Self {
        let mut shift = Self::default();
        for kind in Counted::ALL {
            let count = settings.get("shift").and_then(|t| t.get(kind.key())).and_then(Item::as_integer);
            *shift.count_mut(kind) = count.and_then(|n| usize::try_from(n).ok()).unwrap_or(0);
        }
        let scans = settings.get("shift_scans").and_then(Item::as_array);
        let scans = scans.into_iter().flatten().filter_map(|scan| counted_scan(scan.as_str()?));
        shift.scans = CountedScans(scans.take(MOST).collect());
        shift
    }

    /// Writes it into the settings.
    pub(super) fn write(&self, settings: &mut DocumentMut) {
        let line = |scan: &CountedScan| format!("{} {} {}", scan.kind.key(), scan.content, scan.name);
        settings["shift_scans"] = value(self.scans.0.iter().map(line).collect::<Array>());
        let mut table = Table::new();
        let mut shift = self.clone();
        for kind in Counted::ALL {
            table[kind.key()] = value(*shift.count_mut(kind) as i64);
        }
        settings["shift"] = Item::Table(table);
    }
}

/// Whether settings hold what [`Shift::write`] writes, or nothing.
pub(super) fn is_sound(settings: &DocumentMut) -> bool {
    let counts = settings.get("shift").is_none_or(|shift| {
        shift.as_table_like().is_some_and(|t| t.iter().all(|(_, n)| n.as_integer().is_some_and(|n| n >= 0)))
    });
    let scans = settings.get("shift_scans").is_none_or(|scans| {
        scans.as_array().is_some_and(|scans| scans.iter().all(|s| s.as_str().and_then(counted_scan).is_some()))
    });
    counts && scans
}

/// `pass 0123456789abcdef 0007.ply`.
fn counted_scan(line: &str) -> Option<CountedScan> {
    let mut words = line.splitn(3, ' ');
    let [kind, content, name] = [words.next()?, words.next()?, words.next()?];
    let kind = Counted::ALL.into_iter().find(|known| known.key() == kind)?;
    Some(CountedScan { name: name.to_owned(), content: content.to_owned(), kind })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counts(shift: &Shift) -> [usize; 5] {
        [shift.pass, shift.fail, shift.undecided, shift.incomplete, shift.refused]
    }

    #[test]
    fn a_scan_is_counted_once_a_shift_over_restarts_too() {
        let mut shift = Shift::default();
        let [a, b] = ["aa".repeat(32), "bb".repeat(32)];
        shift.count_scan("1.ply", Some(&a), Counted::Pass);
        shift.count_scan("2 \"x\".ply", Some(&b), Counted::Fail);
        let mut settings = DocumentMut::new();
        shift.write(&mut settings);
        let settings: DocumentMut = settings.to_string().parse().unwrap();
        assert!(is_sound(&settings));
        let mut again = Shift::of(&settings);
        assert_eq!(again, shift);
        again.count_scan("1.ply", Some(&a), Counted::Pass);
        again.count_scan("2 \"x\".ply", Some(&b), Counted::Undecided);
        assert_eq!(counts(&again), [1, 0, 1, 0, 0], "the same two scans");
        // Another part under the same name is another part.
        again.count_scan("1.ply", Some(&b), Counted::Fail);
        assert_eq!(counts(&again), [1, 1, 1, 0, 0]);
    }

    #[test]
    fn a_lost_result_is_not_counted_beside_the_same_scans_earlier_one() {
        let mut shift = Shift::default();
        let a = "aa".repeat(32);
        shift.count_scan("1.ply", Some(&a), Counted::Pass);
        shift.count_scan("1.ply", None, Counted::Refused);
        assert_eq!(counts(&shift), [1, 0, 0, 0, 0]);
        // One that was never read counts as refused, until it is.
        shift.count_scan("2.ply", None, Counted::Refused);
        shift.count_scan("2.ply", None, Counted::Refused);
        assert_eq!(counts(&shift), [1, 0, 0, 0, 1]);
        shift.count_scan("2.ply", Some(&a), Counted::Fail);
        assert_eq!(counts(&shift), [1, 1, 0, 0, 0]);
    }

    #[test]
    fn odd_lists_are_told_and_count_nothing() {
        for text in ["shift_scans = 3", "shift_scans = [\"pass\"]", "shift_scans = [1]", "[shift]\npass = -1"] {
            let settings: DocumentMut = text.parse().unwrap();
            assert!(!is_sound(&settings), "{text}");
            assert_eq!(Shift::of(&settings), Shift::default(), "{text}");
        }
    }
}
