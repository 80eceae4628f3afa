//! Wavefront OBJ: vertices and faces; everything else is passed over, and no material file is ever opened.

use super::fault::Fault;
use super::field::{excerpt, integer, not_a_number, number, words};
use super::lines::{Line, Lines, may_be_cut_off};
use super::polygon::{Work, triangulate};
use super::{format, stl};
use crate::diagnostic::{Diagnostic, ReadError};
use crate::geometry::Mesh;
use crate::run::RunContext;
use std::borrow::Cow;

/// Lines between two looks at the cancel flag.
const LINES_BETWEEN_CHECKS: usize = 65_536;

/// Reads an OBJ.
pub fn read(bytes: &[u8], mm_per_unit: f64, run: &RunContext) -> Result<Mesh, ReadError> {
    let mut lines = Lines::new(format::without_mark(bytes), 0, 1);
    let mut reader = Reader { mm_per_unit, ..Reader::default() };
    while let Some(line) = lines.next_filled()? {
        if line.number % LINES_BETWEEN_CHECKS == 0 {
            run.check()?;
        }
        let (statement, ended) = with_continuation(line, &mut lines)?;
        if reader.work.is_due(reader.corners.len()) {
            run.check()?;
        }
        reader.statement(&statement, line, ended).map_err(|diagnostic| diagnostic.at_line(line.number))?;
    }
    Ok(reader.mesh)
}

/// A statement that may go on over lines that end with a backslash, and whether its last line has a line end.
fn with_continuation<'a>(first: Line<'a>, lines: &mut Lines<'a>) -> Result<(Cow<'a, [u8]>, bool), Fault> {
    let mut statement = Cow::Borrowed(first.text);
    let mut ended = first.ended;
    while let Some(begun) = statement.strip_suffix(b"\\") {
        let mut longer = begun.to_vec();
        let Some(line) = lines.next_line()? else {
            let diagnostic = Diagnostic::error("the file ends, expected the continuation of this line")
                .with_help("the file was cut off; export or copy it again");
            return Err(Fault::cut_off(diagnostic.at_line(first.number)));
        };
        longer.push(b' ');
        longer.extend_from_slice(line.text);
        statement = Cow::Owned(longer);
        ended = line.ended;
    }
    Ok((statement, ended))
}

#[derive(Default)]
struct Reader {
    mm_per_unit: f64,
    mesh: Mesh,
    /// Faces cut so far; counted when the next statement is read.
    work: Work,
    /// Corners of the face at hand.
    corners: Vec<u32>,
    /// Corners that all faces so far have; 0 none yet, `usize::MAX` they differ.
    corners_of_all: usize,
}

impl Reader {
    fn statement(&mut self, statement: &[u8], line: Line, ended: bool) -> Result<(), Fault> {
        let mut fields = words(statement);
        match fields.next() {
            Some(b"v") if !ended => Err(may_be_cut_off(&line)),
            Some(b"v") => Ok(self.vertex(fields)?),
            Some(b"f") => self.face(fields, ended, line).map_err(|fault| fault.cut_off_if(!ended)),
            _ => Ok(()),
        }
    }

    /// `v x y z`, with a weight or a colour behind it that a mesh does not need.
    fn vertex<'a>(&mut self, mut fields: impl Iterator<Item = &'a [u8]>) -> Result<(), Diagnostic> {
        let mut xyz = [0.0; 3];
        for x in &mut xyz {
            let field = fields.next().unwrap_or_default();
            *x = number(field).ok_or_else(|| not_a_number(field, "a coordinate"))?;
        }
        if self.mesh.vertices.len() >= u32::MAX as usize {
            return Err(super::columns::too_many_points(self.mesh.vertices.len() as u64 + 1));
        }
        self.mesh.vertices.push(stl::cad_vertex(xyz, self.mm_per_unit)?);
        Ok(())
    }

    /// `f 1 2 3`, `f 1/1 2/2 3/3`, `f 1//1 ...`, `f -3 -2 -1`, any number of corners.
    fn face<'a>(&mut self, fields: impl Iterator<Item = &'a [u8]>, ended: bool, line: Line) -> Result<(), Fault> {
        self.corners.clear();
        let mut last: &[u8] = b"";
        for field in fields.take_while(|field| !field.starts_with(b"#")) {
            self.corners.push(self.index(field)?);
            last = field;
        }
        if !ended && !self.is_whole(last) {
            return Err(may_be_cut_off(&line));
        }
        self.corners_of_all = match self.corners_of_all {
            0 => self.corners.len(),
            n if n == self.corners.len() => n,
            _ => usize::MAX,
        };
        Ok(triangulate(&self.corners, &self.mesh.vertices, &mut self.mesh.triangles)?)
    }

    /// The vertex that a field such as `7/1/2` or `-1` names.
    fn index(&self, field: &[u8]) -> Result<u32, Diagnostic> {
        let digits = field.split(|&byte| byte == b'/').next().unwrap_or_default();
        let index = integer(digits).ok_or_else(|| not_a_number(field, "a vertex index"))?;
        let count = self.mesh.vertices.len() as i64;
        let from_zero = if index < 0 { count.saturating_add(index) } else { index - 1 };
        if index == 0 || from_zero < 0 || from_zero >= count {
            let expected = match count {
                0 => "but no vertex stands above it".to_owned(),
                _ => format!("expected 1 to {count} or -{count} to -1"),
            };
            return Err(Diagnostic::error(format!("face names vertex {}, {expected}", excerpt(digits)))
                .with_help("the file was cut off or damaged; export it again"));
        }
        Ok(from_zero as u32)
    }

    /// Whether a face without a line end is whole: it has as many corners as every other face, and its last index cannot
    /// have had another digit, because a slash follows it or because there are not so many vertices.
    fn is_whole(&self, last: &[u8]) -> bool {
        let as_the_others = self.corners_of_all == 0 || self.corners_of_all == self.corners.len();
        let longer_is_too_large =
            || integer(last).is_some_and(|i| i.unsigned_abs().saturating_mul(10) > self.mesh.vertices.len() as u64);
        as_the_others && self.corners.len() >= 3 && (last.contains(&b'/') || longer_is_too_large())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const QUAD: &str =
        "mtllib ../../etc/never_opened.mtl\nv 0 0 0 1 0 0\nv 2 0 0\nv 2 2 0 # corner\nv 0 2 0\nusemtl m\n";

    fn mesh(text: &str) -> Result<Mesh, ReadError> {
        read(text.as_bytes(), 1.0, &RunContext::silent())
    }

    fn refused_at(text: &str) -> usize {
        match mesh(text) {
            Err(ReadError::Bad(diagnostic) | ReadError::CutOff(diagnostic)) => diagnostic.line.expect("a line"),
            other => panic!("expected a refusal, got {other:?}"),
        }
    }

    #[test]
    fn all_ways_to_write_a_face_give_the_same() {
        let plain = mesh(&format!("{QUAD}f 1 2 3 4\n")).unwrap();
        assert_eq!(plain.area(), 4.0);
        for face in
            ["f 1/1 2/2 3/3 4/4", "f 1//7 2//7 3//7 4//7", "f 1/5/6 2/5/6 3// 4", "f -4 -3 -2 -1", "f 1 2 \\\n 3 4"]
        {
            assert_eq!(mesh(&format!("{QUAD}{face}\n")).unwrap(), plain, "{face}");
        }
    }

    #[test]
    fn indices_out_of_range_are_refused_with_their_line() {
        for face in
            ["f 1 2 5", "f 0 1 2", "f -5 1 2", "f 1 2 x", "f 1 2 9223372036854775807", "f -9223372036854775808 1 2"]
        {
            assert_eq!(refused_at(&format!("{QUAD}{face}\n")), 7, "{face}");
        }
        let refused = mesh("f 1 2 3\n").unwrap_err().to_string();
        assert!(refused.contains("no vertex stands above"), "{refused}");
    }

    #[test]
    fn a_vertex_that_is_not_a_number_is_refused_with_its_line() {
        for vertex in ["v nan 0 0", "v inf 0 0", "v 1,5 0 0", "v 1 2", "v 1e30 0 0"] {
            assert_eq!(refused_at(&format!("{vertex}\n{QUAD}")), 1, "{vertex}");
        }
    }

    #[test]
    fn faces_without_three_corners_give_nothing() {
        assert!(mesh(&format!("{QUAD}f 1 2\nf 1 1 2\nf 3 3 3 3\nl 1 2\n")).unwrap().triangles.is_empty());
    }

    #[test]
    fn a_last_face_that_may_be_cut_off_is_refused() {
        let twelve: String = (0..12).map(|i| format!("v {i} {} 0\n", i * i)).collect();
        assert_eq!(mesh(&format!("{twelve}f 1 2 12")).unwrap().triangles, [[0, 1, 11]]);
        assert_eq!(mesh(&format!("{twelve}f 1/1 2/1 1/1\nf 1/1 2/2 3/3")).unwrap().triangles, [[0, 1, 2]]);
        // Could have been vertex 10, 11 or 12; could have been a quad; could have been 1.25.
        assert_eq!(refused_at(&format!("{twelve}f 2 3 1")), 13);
        assert_eq!(refused_at(&format!("{twelve}f 1 2 3 4\nf 5 6 7")), 14);
        assert_eq!(refused_at("v 0 0 1"), 1);
    }
}
