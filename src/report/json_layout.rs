//! Layout of JSON text: two blanks a level, one key a line, but the numbers of an array on one line.

use serde_json::ser::Formatter;
use std::io;

/// Where the next value of an array goes: known only when its kind is.
#[derive(Clone, Copy, PartialEq)]
enum Pending {
    Nothing,
    First,
    Later,
}

/// A [`Formatter`] that holds a value's line break back until it knows whether the value is a number.
pub struct Layout {
    depth: usize,
    /// For each open array or object: whether it has lines of its own.
    lines: Vec<bool>,
    pending: Pending,
}

impl Default for Layout {
    fn default() -> Self {
        Self { depth: 0, lines: Vec::new(), pending: Pending::Nothing }
    }
}

impl Layout {
    fn new_line<W: ?Sized + io::Write>(&self, writer: &mut W) -> io::Result<()> {
        writer.write_all(b"\n")?;
        (0..self.depth).try_for_each(|_| writer.write_all(b"  "))
    }

    /// Writes what was held back before a number: a blank.
    fn inline<W: ?Sized + io::Write>(&mut self, writer: &mut W) -> io::Result<()> {
        if self.pending == Pending::Later {
            writer.write_all(b" ")?;
        }
        self.pending = Pending::Nothing;
        Ok(())
    }

    /// Writes what was held back before anything else: a line break.
    fn block<W: ?Sized + io::Write>(&mut self, writer: &mut W) -> io::Result<()> {
        if self.pending != Pending::Nothing {
            self.pending = Pending::Nothing;
            if let Some(lines) = self.lines.last_mut() {
                *lines = true;
            }
            self.new_line(writer)?;
        }
        Ok(())
    }

    fn open<W: ?Sized + io::Write>(&mut self, writer: &mut W, bracket: &[u8]) -> io::Result<()> {
        self.block(writer)?;
        self.depth += 1;
        self.lines.push(false);
        writer.write_all(bracket)
    }

    fn close<W: ?Sized + io::Write>(&mut self, writer: &mut W, bracket: &[u8]) -> io::Result<()> {
        self.depth = self.depth.saturating_sub(1);
        if self.lines.pop() == Some(true) {
            self.new_line(writer)?;
        }
        writer.write_all(bracket)
    }
}

impl Formatter for Layout {
    fn begin_array<W: ?Sized + io::Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.open(writer, b"[")
    }

    fn end_array<W: ?Sized + io::Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.close(writer, b"]")
    }

    fn begin_array_value<W: ?Sized + io::Write>(&mut self, writer: &mut W, first: bool) -> io::Result<()> {
        if !first {
            writer.write_all(b",")?;
        }
        self.pending = if first { Pending::First } else { Pending::Later };
        Ok(())
    }

    fn begin_object<W: ?Sized + io::Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.open(writer, b"{")
    }

    fn end_object<W: ?Sized + io::Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.close(writer, b"}")
    }

    fn begin_object_key<W: ?Sized + io::Write>(&mut self, writer: &mut W, first: bool) -> io::Result<()> {
        if !first {
            writer.write_all(b",")?;
        }
        self.pending = Pending::First;
        self.block(writer)
    }

    fn begin_object_value<W: ?Sized + io::Write>(&mut self, writer: &mut W) -> io::Result<()> {
        writer.write_all(b": ")
    }

    fn begin_string<W: ?Sized + io::Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.block(writer)?;
        writer.write_all(b"\"")
    }

    fn write_f64<W: ?Sized + io::Write>(&mut self, writer: &mut W, value: f64) -> io::Result<()> {
        self.inline(writer)?;
        // serde_json writes the shortest text that reads back as the same number; it hands over finite ones only.
        serde_json::to_writer(writer, &value).map_err(io::Error::from)
    }

    fn write_u64<W: ?Sized + io::Write>(&mut self, writer: &mut W, value: u64) -> io::Result<()> {
        self.inline(writer)?;
        write!(writer, "{value}")
    }

    fn write_null<W: ?Sized + io::Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.inline(writer)?;
        writer.write_all(b"null")
    }
}
