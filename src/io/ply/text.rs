//! The body of a text PLY: one line a record.

use super::super::columns::{Rows, read_chunks, too_many_points};
use super::super::fault::Fault;
use super::super::field::{excerpt, not_a_number, number, words};
use super::super::lines::{Chunks, FixedDecimals, Line, Lines, may_be_cut_off};
use super::header::{Element, Header, Kind, Number};
use super::{Body, Faces, Wanted, corner, corners_property};
use crate::diagnostic::{Diagnostic, ReadError};
use crate::run::RunContext;

/// Reads all elements in their order; every filled line must be accounted for.
pub fn read(bytes: &[u8], header: &Header, wanted: &Wanted, run: &RunContext) -> Result<Body, ReadError> {
    let mut body = Body::default();
    let vertices = header.vertices()?.count;
    let mut lines = Lines::new(bytes, header.body_offset, header.body_line);
    for element in header.elements.iter().filter(|element| !element.properties.is_empty()) {
        let chunks = lines.take_chunks(element.count)?;
        if chunks.filled < element.count {
            return Err(too_few(element, &chunks, lines.next_number()).into());
        }
        if element.name == "vertex" {
            if element.count > u64::from(u32::MAX) {
                return Err(too_many_points(element.count).at_line(element.line).into());
            }
            body.cloud = read_vertices(&chunks, element, wanted, run)?.into_cloud();
        } else {
            let property = if wanted.faces { corners_property(element) } else { None };
            let faces = read_others(&chunks, element, property, vertices, run)?;
            if property.is_some() {
                body.faces = faces;
            }
        }
    }
    if let Some(line) = lines.next_filled()? {
        return Err(Diagnostic::error(format!(
            "\"{}\" found behind the last record, expected the end of the file",
            excerpt(line.text)
        ))
        .at_line(line.number)
        .with_help("the counts in the header are wrong or the file is damaged; export it again")
        .into());
    }
    Ok(body)
}

fn too_few(element: &Element, chunks: &Chunks, end: usize) -> Fault {
    let diagnostic =
        Diagnostic::error(format!("the file ends after {} of {} {}", chunks.filled, element.count, element.records()))
            .at_line(end.saturating_sub(1))
            .with_help(
                "the file was cut off, is still being written, or its header counts wrong; copy or export it again",
            );
    Fault::cut_off(diagnostic)
}

fn read_vertices<'a>(
    chunks: &Chunks,
    element: &Element,
    wanted: &Wanted<'a>,
    run: &RunContext,
) -> Result<Rows<'a>, ReadError> {
    if let Some(last) = chunks.last.filter(|last| !last.ended) {
        check_last_vertex(chunks, &last, element)?;
    }
    let expected = element.count as usize;
    read_chunks(&chunks.chunks, wanted.layout, wanted.lengths, expected, run, |chunk| {
        let mut chunk = chunk.clone();
        let mut rows = Rows::new(wanted.layout, wanted.lengths, 0);
        while let Some(line) = chunk.next_filled()? {
            read_vertex(&mut rows, line.text, element).map_err(|diagnostic| diagnostic.at_line(line.number))?;
        }
        Ok(rows)
    })
}

fn read_vertex(rows: &mut Rows, line: &[u8], element: &Element) -> Result<(), Diagnostic> {
    let mut record = Record { fields: words(line), line, found: 0 };
    // Every column is read, wanted or not, so that each line is checked in full.
    let mut values = [0.0; 16];
    let mut more = Vec::new();
    let values: &mut [f64] = if element.properties.len() <= values.len() {
        &mut values
    } else {
        more.resize(element.properties.len(), 0.0);
        &mut more
    };
    for (property, value) in element.properties.iter().zip(values.iter_mut()) {
        match property.kind {
            Kind::Single(kind) => *value = record.number(kind)?,
            Kind::List { count, item } => {
                for _ in 0..record.list_length(count)? {
                    record.number(item)?;
                }
            }
        }
    }
    record.end()?;
    rows.push(|column| Ok(values[column]))
}

/// Faces, or elements that nobody wants, which are checked and passed over.
fn read_others(
    chunks: &Chunks,
    element: &Element,
    corners_property: Option<usize>,
    vertices: u64,
    run: &RunContext,
) -> Result<Faces, ReadError> {
    let mut faces = Faces::default();
    for chunk in &chunks.chunks {
        run.check()?;
        let mut chunk = chunk.clone();
        while let Some(line) = chunk.next_filled()? {
            read_other(&line, element, corners_property, vertices, &mut faces)
                .map_err(|fault| fault.at_line(line.number).cut_off_if(!line.ended))?;
        }
    }
    Ok(faces)
}

fn read_other(
    line: &Line,
    element: &Element,
    corners_property: Option<usize>,
    vertices: u64,
    faces: &mut Faces,
) -> Result<(), Fault> {
    let mut record = Record { fields: words(line.text), line: line.text, found: 0 };
    // The largest value that the last number of the line may have, where we know it.
    let mut largest = None;
    let mut value = 0.0;
    for (index, property) in element.properties.iter().enumerate() {
        match property.kind {
            Kind::Single(kind) => {
                value = record.number(kind)?;
                largest = kind.largest_integer();
            }
            Kind::List { count, item } => {
                let length = record.list_length(count)?;
                for _ in 0..length {
                    value = record.number(item)?;
                    largest = item.largest_integer();
                    if Some(index) == corners_property {
                        faces.corners.push(corner(value, vertices)?);
                        largest = Some(vertices as f64 - 1.0);
                    }
                }
                if length == 0 {
                    (value, largest) = (0.0, None);
                }
                if Some(index) == corners_property {
                    faces.close();
                }
            }
        }
    }
    record.end()?;
    let whole = line.ended || largest.is_some_and(|largest| value.abs() * 10.0 > largest);
    if whole { Ok(()) } else { Err(may_be_cut_off(line)) }
}

/// The fields of one line.
struct Record<'a, F: Iterator<Item = &'a [u8]>> {
    fields: F,
    line: &'a [u8],
    found: usize,
}

impl<'a, F: Iterator<Item = &'a [u8]>> Record<'a, F> {
    fn number(&mut self, kind: Number) -> Result<f64, Diagnostic> {
        let Some(field) = self.fields.next() else {
            return Err(Diagnostic::error(format!("{} numbers found in the line, expected more", self.found))
                .with_help("the file was cut off or damaged; copy or export it again"));
        };
        self.found += 1;
        match number(field) {
            Some(value) if kind.holds(value) => Ok(value),
            Some(_) => Err(not_a_number(field, "a whole number in the range of its type")),
            None => Err(not_a_number(field, "a number")),
        }
    }

    /// The count of a list, which cannot be larger than the line is long.
    fn list_length(&mut self, count: Number) -> Result<usize, Diagnostic> {
        let length = self.number(count)?;
        if length >= 0.0 && length.fract() == 0.0 && length <= self.line.len() as f64 {
            return Ok(length as usize);
        }
        Err(Diagnostic::error(format!("list of length {length}, expected as many numbers as the line has"))
            .with_help("the file is damaged; export it again"))
    }

    fn end(&mut self) -> Result<(), Diagnostic> {
        match self.fields.next() {
            None => Ok(()),
            Some(field) => Err(Diagnostic::error(format!(
                "\"{}\" found behind {} numbers, expected the end of the line",
                excerpt(field),
                self.found
            ))
            .with_help("the properties in the header do not fit the lines; export the file again")),
        }
    }
}

/// A last vertex without a line end is whole when its last number cannot have had another digit.
fn check_last_vertex(chunks: &Chunks, last: &Line, element: &Element) -> Result<(), Fault> {
    let field = words(last.text).last().unwrap_or_default();
    let largest = match element.properties.last().map(|property| property.kind) {
        Some(Kind::Single(kind) | Kind::List { item: kind, .. }) => kind.largest_integer(),
        None => None,
    };
    if let (Some(largest), Some(value)) = (largest, number(field)) {
        return if value.abs() * 10.0 > largest { Ok(()) } else { Err(may_be_cut_off(last)) };
    }
    let mut fixed = FixedDecimals::default();
    for chunk in &chunks.chunks {
        let mut chunk = chunk.clone();
        while let Some(line) = chunk.next_filled()? {
            if line.ended {
                fixed.see(words(line.text).last().unwrap_or_default());
            }
        }
    }
    let mut own = FixedDecimals::default();
    own.see(field);
    if matches!(own, FixedDecimals::Always(_)) && fixed == own { Ok(()) } else { Err(may_be_cut_off(last)) }
}
