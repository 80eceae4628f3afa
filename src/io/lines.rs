//! Lines of text files in chunks of a fixed number of lines, so that they can be read side by side in any number of
//! threads with the same result.
//!
//! **The last line.** Cut a text file at a random byte and in one case of five it still reads, with its last number
//! shortened. So a last line without a line end is refused, unless the reader can show it to be whole: a writer with a
//! fixed number of decimals would have written more of them ([`FixedDecimals`]), or one more digit would have made the
//! last number too large for its column.

use super::fault::Fault;
use super::field;
use crate::diagnostic::Diagnostic;

/// Longest line that is read, in bytes.
pub const LONGEST_LINE: usize = 64 * 1024;
/// Lines that hold something, in one chunk.
const LINES_IN_CHUNK: usize = 16 * 1024;

/// Where we are in a text.
#[derive(Debug, Clone)]
pub struct Lines<'a> {
    bytes: &'a [u8],
    offset: usize,
    /// Number of the next line, from 1.
    next: usize,
}

/// One line without its line end.
#[derive(Debug, Clone, Copy)]
pub struct Line<'a> {
    /// Its number, from 1.
    pub number: usize,
    /// Its text, without line end and surrounding blanks.
    pub text: &'a [u8],
    /// Whether a line end follows.
    pub ended: bool,
}

impl<'a> Lines<'a> {
    /// From a byte of the file on, whose line has this number.
    pub fn new(bytes: &'a [u8], offset: usize, number: usize) -> Self {
        Self { bytes, offset, next: number }
    }

    /// The next line that is not blank; `None` at the end.
    pub fn next_filled(&mut self) -> Result<Option<Line<'a>>, Diagnostic> {
        while let Some(line) = self.next_line()? {
            if !line.text.is_empty() {
                return Ok(Some(line));
            }
        }
        Ok(None)
    }

    /// The next line, blank or not; `None` at the end.
    pub fn next_line(&mut self) -> Result<Option<Line<'a>>, Diagnostic> {
        let rest = &self.bytes[self.offset..];
        if rest.is_empty() {
            return Ok(None);
        }
        let end = rest[..rest.len().min(LONGEST_LINE + 1)].iter().position(|&byte| byte == b'\n');
        if end.is_none() && rest.len() > LONGEST_LINE {
            return Err(Diagnostic::error(format!(
                "line longer than {LONGEST_LINE} bytes, expected one row of numbers"
            ))
            .at_line(self.next)
            .with_help("the file is damaged, or its line ends are not those of a text file; export it again"));
        }
        let line =
            Line { number: self.next, text: rest[..end.unwrap_or(rest.len())].trim_ascii(), ended: end.is_some() };
        self.offset += end.map_or(rest.len(), |end| end + 1);
        self.next += 1;
        Ok(Some(line))
    }

    /// Number of the next line, from 1.
    pub fn next_number(&self) -> usize {
        self.next
    }

    /// Takes up to `wanted` filled lines off the front, in chunks of a fixed number of lines.
    pub fn take_chunks(&mut self, wanted: u64) -> Result<Chunks<'a>, Diagnostic> {
        let mut chunks = Chunks { chunks: Vec::new(), filled: 0, last: None };
        let (mut start, mut number, mut in_chunk) = (self.offset, self.next, 0);
        while chunks.filled < wanted {
            let Some(line) = self.next_filled()? else { break };
            chunks.last = Some(line);
            chunks.filled += 1;
            in_chunk += 1;
            if in_chunk == LINES_IN_CHUNK {
                chunks.chunks.push(Lines::new(&self.bytes[..self.offset], start, number));
                (start, number, in_chunk) = (self.offset, self.next, 0);
            }
        }
        if in_chunk > 0 {
            chunks.chunks.push(Lines::new(&self.bytes[..self.offset], start, number));
        }
        Ok(chunks)
    }
}

/// A run of filled lines.
#[derive(Debug, Clone)]
pub struct Chunks<'a> {
    /// Its pieces in order.
    pub chunks: Vec<Lines<'a>>,
    /// How many filled lines there are.
    pub filled: u64,
    /// The last of them.
    pub last: Option<Line<'a>>,
}

/// Whether every row had the same number of decimals in its last field; then a last line with as many is whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum FixedDecimals {
    /// No row yet.
    #[default]
    Unknown,
    /// So many in every row.
    Always(usize),
    /// Rows differ, or are not plain decimals.
    Varies,
}

impl FixedDecimals {
    /// Looks at the last field of one more row.
    pub fn see(&mut self, last_field: &[u8]) {
        *self = self.and(field::decimals(last_field).filter(|&n| n > 0).map_or(Self::Varies, Self::Always));
    }

    /// Both together.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        match (self, other) {
            (Self::Unknown, known) | (known, Self::Unknown) => known,
            (a, b) if a == b => a,
            _ => Self::Varies,
        }
    }
}

/// The message for a last line that may be cut off.
pub fn may_be_cut_off(line: &Line) -> Fault {
    let diagnostic = Diagnostic::error("the last line has no line end, so its last number may be cut off")
        .at_line(line.number)
        .with_help(
            "the file may still be being written or was cut off; copy it again, or end its last line with a line end",
        );
    Fault::cut_off(diagnostic)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_numbered_over_blank_ones_and_line_ends_of_all_kinds() {
        let mut lines = Lines::new(b"a\r\n\n  b \n\t\nc", 0, 1);
        let mut seen = Vec::new();
        while let Some(line) = lines.next_filled().unwrap() {
            seen.push((line.number, line.text.to_vec(), line.ended));
        }
        assert_eq!(seen, vec![(1, b"a".to_vec(), true), (3, b"b".to_vec(), true), (5, b"c".to_vec(), false)]);
    }

    #[test]
    fn chunks_hold_each_filled_line_once_with_its_number() {
        let text: Vec<u8> = (0..40_000).flat_map(|i| format!("{i}\n\n").into_bytes()).collect();
        let mut lines = Lines::new(&text, 0, 1);
        let chunks = lines.take_chunks(35_000).unwrap();
        assert_eq!(chunks.filled, 35_000);
        let mut expected = 0;
        for mut chunk in chunks.chunks {
            while let Some(line) = chunk.next_filled().unwrap() {
                assert_eq!(line.number, 2 * expected + 1);
                assert_eq!(line.text, expected.to_string().as_bytes());
                expected += 1;
            }
        }
        assert_eq!(expected, 35_000);
        assert_eq!(lines.next_filled().unwrap().unwrap().text, b"35000");
    }

    #[test]
    fn an_endless_line_is_refused_with_its_number() {
        let mut text = b"1 2 3\n".to_vec();
        text.resize(LONGEST_LINE * 4, b'7');
        let mut lines = Lines::new(&text, 0, 1);
        lines.next_line().unwrap();
        assert_eq!(lines.next_line().unwrap_err().line, Some(2));
    }

    #[test]
    fn decimals_are_fixed_only_when_all_agree() {
        let of = |fields: &[&[u8]]| {
            let mut fixed = FixedDecimals::default();
            fields.iter().for_each(|field| fixed.see(field));
            fixed
        };
        assert_eq!(of(&[b"1.25", b"-7.00"]), FixedDecimals::Always(2));
        assert_eq!(of(&[b"1.25", b"1.2"]), FixedDecimals::Varies);
        assert_eq!(of(&[b"255", b"25"]), FixedDecimals::Varies);
        assert_eq!(of(&[b"1."]), FixedDecimals::Varies);
    }
}
