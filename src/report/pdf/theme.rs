//! Colours and measures of the paper report (the light theme of the screens).

use crate::inspect::Verdict;
use crate::report::palette::Rgb;

/// Paper and the mark on a filled shape.
pub const WHITE: Rgb = [0xFF, 0xFF, 0xFF];
/// Text.
pub const TEXT: Rgb = [0x17, 0x1D, 0x24];
/// Text that explains.
pub const QUIET: Rgb = [0x4E, 0x59, 0x65];
/// Thin rules.
pub const STROKE: Rgb = [0xCB, 0xD2, 0xD9];
/// Strong rules and frames.
pub const STRONG: Rgb = [0x8B, 0x96, 0xA3];
/// The two greys of "no data".
pub const HATCH: [Rgb; 2] = [[0xCC, 0xD1, 0xD9], [0x85, 0x8F, 0x9C]];
/// The sheet's other side on the map.
pub const REVERSE: Rgb = [0xA6, 0xAD, 0xB5];
/// The mark on the shape of "undecided".
pub const ON_UNDECIDED: Rgb = [0x24, 0x1A, 0x00];

/// What a sign says: a verdict, or that the scan was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sign {
    /// A verdict of a point or of a part.
    Verdict(Verdict),
    /// The scan could not be measured.
    Refused,
}

impl Sign {
    /// Colour of shape and frame.
    pub fn colour(self) -> Rgb {
        match self {
            Sign::Verdict(Verdict::Pass) => [0x00, 0x80, 0x8A],
            Sign::Verdict(Verdict::Fail) => [0xC0, 0x2F, 0x1D],
            Sign::Verdict(Verdict::Undecided) => [0xE0, 0xA0, 0x00],
            Sign::Verdict(Verdict::NotMeasured) | Sign::Refused => [0x2B, 0x30, 0x38],
        }
    }

    /// Colour of the word: dark enough to read.
    pub fn text_colour(self) -> Rgb {
        match self {
            Sign::Verdict(Verdict::Undecided) => [0x7A, 0x56, 0x00],
            other => other.colour(),
        }
    }

    /// Colour behind the word and behind a row.
    pub fn fill(self) -> Rgb {
        match self {
            Sign::Verdict(Verdict::Pass) => [0xD8, 0xEF, 0xF0],
            Sign::Verdict(Verdict::Fail) => [0xFB, 0xE3, 0xDF],
            Sign::Verdict(Verdict::Undecided) => [0xFC, 0xF0, 0xCF],
            Sign::Verdict(Verdict::NotMeasured) | Sign::Refused => [0xE4, 0xE7, 0xEB],
        }
    }
}

/// A4, mm.
pub const PAGE: [f64; 2] = [210.0, 297.0];
/// Left and right end of what is printed, mm.
pub const LEFT: f64 = 13.8;
/// Right end.
pub const RIGHT: f64 = 196.2;
/// Nothing but the footer stands below this, mm from the top.
pub const BOTTOM: f64 = 279.0;
/// Height of a row in the table of the first page, mm.
pub const ROW: f64 = 5.03;
/// Height of a row in the tables of the other pages, mm: 12.5 pt.
pub const DENSE_ROW: f64 = 4.4;
