//! The body of a binary PLY.

use super::super::columns::{Rows, read_chunks, too_many_points};
use super::super::fault::Fault;
use super::header::{Element, Encoding, Header, Kind, Number};
use super::{Body, Faces, Wanted, corner, corners_property};
use crate::diagnostic::{Diagnostic, ReadError};
use crate::run::RunContext;
use std::ops::Range;

/// Records that one thread reads in one go.
const RECORDS_IN_CHUNK: u64 = 65_536;
const CUT_OFF_HELP: &str = "the file was cut off, is still being written, or is damaged; copy or export it again";

/// Reads all elements in their order; every byte must be accounted for.
pub fn read(bytes: &[u8], header: &Header, wanted: &Wanted, run: &RunContext) -> Result<Body, ReadError> {
    let mut body = Body::default();
    let vertices = header.vertices()?.count;
    let mut cursor = Cursor { bytes, offset: header.body_offset, big_endian: header.encoding == Encoding::BigEndian };
    for element in &header.elements {
        cursor.check_claim(element)?;
        if element.name == "vertex" {
            if element.count > u64::from(u32::MAX) {
                return Err(too_many_points(element.count).at_line(element.line).into());
            }
            body.cloud = read_vertices(&mut cursor, element, wanted, run)?.into_cloud();
        } else if let (true, Some(property)) = (wanted.faces, corners_property(element)) {
            body.faces = read_faces(&mut cursor, element, property, vertices, run)?;
        } else {
            pass_over(&mut cursor, element, run)?;
        }
    }
    let surplus = &bytes[cursor.offset..];
    if !surplus.iter().all(u8::is_ascii_whitespace) {
        return Err(Diagnostic::error(format!(
            "{} bytes more than the header's counts account for, from byte {} on",
            surplus.len(),
            cursor.offset
        ))
        .with_help("the counts in the header are wrong or the file is damaged; export it again")
        .into());
    }
    Ok(body)
}

/// A place in the bytes.
struct Cursor<'a> {
    bytes: &'a [u8],
    offset: usize,
    big_endian: bool,
}

impl Cursor<'_> {
    fn left(&self) -> usize {
        self.bytes.len() - self.offset
    }

    /// Checks that the records of an element can be there at all, before anything is allocated for them.
    fn check_claim(&self, element: &Element) -> Result<(), Fault> {
        let size = element.least_size() as u64;
        if element.count.checked_mul(size).is_some_and(|needed| needed <= self.left() as u64) {
            return Ok(());
        }
        let most = if element.is_fixed_size() { "" } else { "at most " };
        let diagnostic = Diagnostic::error(format!(
            "the file ends after {most}{} of {} {}",
            self.left() as u64 / size.max(1),
            element.count,
            element.records(),
        ))
        .at_line(element.line)
        .with_help(CUT_OFF_HELP);
        Err(Fault::cut_off(diagnostic))
    }

    /// The next number.
    fn number(&mut self, number: Number) -> Result<f64, Fault> {
        let end = self.offset + number.size();
        let Some(bytes) = self.bytes.get(self.offset..end) else {
            return Err(self.ends_early());
        };
        self.offset = end;
        Ok(decode(bytes, number, self.big_endian))
    }

    /// The count of a list, checked against the bytes that are left.
    fn list_length(&mut self, count: Number, item: Number) -> Result<usize, Fault> {
        let at = self.offset;
        let length = self.number(count)?;
        if !(length >= 0.0 && length.fract() == 0.0) {
            return Err(Diagnostic::error(format!("list of length {length} at byte {at}, expected 0 or more"))
                .with_help("the file is damaged; export it again")
                .into());
        }
        if length * item.size() as f64 > self.left() as f64 {
            let diagnostic = Diagnostic::error(format!(
                "list of length {length} at byte {at}, but only {} bytes are left",
                self.left()
            ))
            .with_help(CUT_OFF_HELP);
            return Err(Fault::cut_off(diagnostic));
        }
        Ok(length as usize)
    }

    fn ends_early(&self) -> Fault {
        let message = format!("the file ends at byte {}, expected more", self.bytes.len());
        Fault::cut_off(Diagnostic::error(message).with_help(CUT_OFF_HELP))
    }

    /// Steps over one property.
    fn pass(&mut self, kind: Kind) -> Result<(), Fault> {
        let size = match kind {
            Kind::Single(number) => number.size(),
            Kind::List { count, item } => self.list_length(count, item)? * item.size(),
        };
        if size > self.left() {
            return Err(self.ends_early());
        }
        self.offset += size;
        Ok(())
    }
}

/// The number in exactly its bytes.
fn decode(bytes: &[u8], number: Number, big_endian: bool) -> f64 {
    let mut b = [0_u8; 8];
    b[..bytes.len()].copy_from_slice(bytes);
    if big_endian {
        b[..bytes.len()].reverse();
    }
    match number {
        Number::I8 => f64::from(b[0] as i8),
        Number::U8 => f64::from(b[0]),
        Number::I16 => f64::from(i16::from_le_bytes([b[0], b[1]])),
        Number::U16 => f64::from(u16::from_le_bytes([b[0], b[1]])),
        Number::I32 => f64::from(i32::from_le_bytes([b[0], b[1], b[2], b[3]])),
        Number::U32 => f64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]])),
        Number::F32 => f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])),
        Number::F64 => f64::from_le_bytes(b),
    }
}

fn read_vertices<'a>(
    cursor: &mut Cursor,
    element: &Element,
    wanted: &Wanted<'a>,
    run: &RunContext,
) -> Result<Rows<'a>, ReadError> {
    if element.is_fixed_size() {
        read_fixed_vertices(cursor, element, wanted, run)
    } else {
        read_varying_vertices(cursor, element, wanted, run)
    }
}

/// Records of one size: chunks of them side by side.
fn read_fixed_vertices<'a>(
    cursor: &mut Cursor,
    element: &Element,
    wanted: &Wanted<'a>,
    run: &RunContext,
) -> Result<Rows<'a>, ReadError> {
    let mut size = 0;
    let mut fields: Vec<(Range<usize>, Number)> = Vec::new();
    for property in &element.properties {
        if let Kind::Single(number) = property.kind {
            fields.push((size..size + number.size(), number));
            size += number.size();
        }
    }
    let (begin, big_endian) = (cursor.offset, cursor.big_endian);
    let all = &cursor.bytes[begin..begin + size * element.count as usize];
    let firsts: Vec<u64> = (0..element.count).step_by(RECORDS_IN_CHUNK as usize).collect();
    let rows = read_chunks(&firsts, wanted.layout, wanted.lengths, element.count as usize, run, |&first| {
        let last = (first + RECORDS_IN_CHUNK).min(element.count);
        let mut rows = Rows::new(wanted.layout, wanted.lengths, (last - first) as usize);
        for (record, bytes) in (first..).zip(all[first as usize * size..last as usize * size].chunks_exact(size)) {
            let value = |column: usize| {
                let (range, number) = &fields[column];
                Ok(decode(&bytes[range.clone()], *number, big_endian))
            };
            rows.push(value).map_err(|mut diagnostic| {
                let byte = begin as u64 + record * size as u64;
                diagnostic.message = format!("(byte {byte}) {}", diagnostic.message);
                Fault::from(diagnostic).at_record("vertex", record)
            })?;
        }
        Ok(rows)
    })?;
    cursor.offset += size * element.count as usize;
    Ok(rows)
}

/// Records with lists in them: one after the other.
fn read_varying_vertices<'a>(
    cursor: &mut Cursor,
    element: &Element,
    wanted: &Wanted<'a>,
    run: &RunContext,
) -> Result<Rows<'a>, ReadError> {
    let mut rows = Rows::new(wanted.layout, wanted.lengths, element.count as usize);
    let mut values = vec![0.0; element.properties.len()];
    for record in 0..element.count {
        if record % RECORDS_IN_CHUNK == 0 {
            run.check()?;
        }
        for (property, value) in element.properties.iter().zip(&mut values) {
            match property.kind {
                Kind::Single(number) => {
                    *value = cursor.number(number).map_err(|fault| fault.at_record("vertex", record))?
                }
                list => cursor.pass(list).map_err(|fault| fault.at_record("vertex", record))?,
            }
        }
        rows.push(|column| Ok(values[column])).map_err(|d| Fault::from(d).at_record("vertex", record))?;
    }
    Ok(rows)
}

fn read_faces(
    cursor: &mut Cursor,
    element: &Element,
    corners_property: usize,
    vertices: u64,
    run: &RunContext,
) -> Result<Faces, ReadError> {
    let mut faces = Faces::default();
    for record in 0..element.count {
        if record % RECORDS_IN_CHUNK == 0 {
            run.check()?;
        }
        for (index, property) in element.properties.iter().enumerate() {
            let result = match property.kind {
                Kind::List { count, item } if index == corners_property => {
                    read_corners(cursor, count, item, vertices, &mut faces)
                }
                other => cursor.pass(other),
            };
            result.map_err(|fault| fault.at_record("face", record))?;
        }
    }
    Ok(faces)
}

fn read_corners(
    cursor: &mut Cursor,
    count: Number,
    item: Number,
    vertices: u64,
    faces: &mut Faces,
) -> Result<(), Fault> {
    for _ in 0..cursor.list_length(count, item)? {
        let index = cursor.number(item)?;
        faces.corners.push(corner(index, vertices)?);
    }
    faces.close();
    Ok(())
}

fn pass_over(cursor: &mut Cursor, element: &Element, run: &RunContext) -> Result<(), ReadError> {
    if element.is_fixed_size() {
        // Checked by `check_claim`.
        cursor.offset += element.least_size() * element.count as usize;
        return Ok(());
    }
    for record in 0..element.count {
        if record % RECORDS_IN_CHUNK == 0 {
            run.check()?;
        }
        for property in &element.properties {
            cursor.pass(property.kind).map_err(|fault| fault.at_record(&element.name, record))?;
        }
    }
    Ok(())
}
