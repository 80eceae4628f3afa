//! STL, binary and text, as a triangle soup.
//!
//! The facets are decoded here and not by `stl_io`: its reader tells neither the line nor the facet of an error, accepts
//! NaN and surplus facets, and knows only lower-case keywords. `stl_io` writes our STL files (see `write`).

use super::columns::Lengths;
use super::fault::Fault;
use super::field::{excerpt, not_a_number, number, words};
use super::lines::Lines;
use super::{LARGEST_COORDINATE_MM, TOO_FAR_HELP, format, resolution, too_far};
use crate::diagnostic::{Diagnostic, ReadError};
use crate::geometry::{Mesh, Point3};
use crate::run::RunContext;

/// Bytes before the first facet: 80 free ones and the count.
const HEADER: usize = 84;
/// Bytes of a facet: normal, three corners, two spare ones.
const FACET: usize = 50;
/// Facets between two looks at the cancel flag.
const FACETS_BETWEEN_CHECKS: usize = 65_536;
/// Most triangles whose corners still have 32-bit indices.
const MOST_FACETS: u64 = u32::MAX as u64 / 3;

/// What the header claims; `None` when there is no whole header.
fn claimed_facets(bytes: &[u8]) -> Option<u64> {
    let count: [u8; 4] = bytes.get(80..HEADER)?.try_into().ok()?;
    Some(u64::from(u32::from_le_bytes(count)))
}

/// Whether the size is exactly that of a binary STL with the facets it claims.
pub fn size_fits(bytes: &[u8]) -> bool {
    claimed_facets(bytes).is_some_and(|n| HEADER as u64 + FACET as u64 * n == bytes.len() as u64)
}

/// Reads a binary STL.
pub fn read_binary(bytes: &[u8], mm_per_unit: f64, run: &RunContext) -> Result<Mesh, ReadError> {
    let again = "the file was cut off or damaged; export or copy it again";
    let Some(claimed) = claimed_facets(bytes) else {
        let message = format!("a binary STL of {} bytes, expected at least {HEADER}", bytes.len());
        return Err(Fault::cut_off(Diagnostic::error(message).with_help(again)).into());
    };
    if !size_fits(bytes) {
        let expected = HEADER as u64 + FACET as u64 * claimed;
        let diagnostic = Diagnostic::error(format!(
            "the header at byte 80 counts {claimed} facets, which makes {expected} bytes, but the file has {}",
            bytes.len()
        ))
        .with_help(again);
        return Err(Fault::from(diagnostic).cut_off_if((bytes.len() as u64) < expected).into());
    }
    check_count(claimed)?;
    let mut soup = Soup::new(mm_per_unit, claimed as usize);
    for (facet, record) in bytes[HEADER..].chunks_exact(FACET).enumerate() {
        if facet % FACETS_BETWEEN_CHECKS == 0 {
            run.check()?;
        }
        for corner in 0..3 {
            let at = 12 + 12 * corner;
            let xyz = std::array::from_fn(|axis| {
                let k = at + 4 * axis;
                f64::from(f32::from_le_bytes([record[k], record[k + 1], record[k + 2], record[k + 3]]))
            });
            soup.push(xyz).map_err(|mut diagnostic| {
                let byte = HEADER + FACET * facet + at;
                diagnostic.message =
                    format!("facet {} (byte {byte}), corner {}: {}", facet + 1, corner + 1, diagnostic.message);
                diagnostic
            })?;
        }
    }
    resolution::check(&soup.vertices, [true; 3], Lengths::in_mm(mm_per_unit))?;
    Ok(soup.into_mesh())
}

fn check_count(facets: u64) -> Result<(), Diagnostic> {
    if facets > MOST_FACETS {
        return Err(Diagnostic::error(format!("{facets} facets, expected at most {MOST_FACETS}"))
            .with_help("export the CAD with a coarser tessellation"));
    }
    Ok(())
}

/// Corners collected three by three.
struct Soup {
    mm_per_unit: f64,
    vertices: Vec<Point3>,
}

impl Soup {
    fn new(mm_per_unit: f64, facets: usize) -> Self {
        Self { mm_per_unit, vertices: Vec::with_capacity(3 * facets) }
    }

    fn push(&mut self, xyz: [f64; 3]) -> Result<(), Diagnostic> {
        self.vertices.push(cad_vertex(xyz, self.mm_per_unit)?);
        Ok(())
    }

    fn into_mesh(self) -> Mesh {
        let triangles = (0..self.vertices.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        Mesh { vertices: self.vertices, triangles }
    }
}

/// A CAD vertex in mm; refuses what is not finite or implausibly far.
pub fn cad_vertex(xyz: [f64; 3], mm_per_unit: f64) -> Result<Point3, Diagnostic> {
    let mm = xyz.map(|x| x * mm_per_unit);
    if let Some(x) = mm.iter().find(|x| !x.is_finite()) {
        return Err(Diagnostic::error(format!("coordinate {x}, expected a finite number"))
            .with_help("the CAD is damaged; export it again"));
    }
    if let Some(x) = mm.iter().find(|x| x.abs() > LARGEST_COORDINATE_MM) {
        return Err(Diagnostic::error(too_far(*x, *x)).with_help(TOO_FAR_HELP));
    }
    Ok(Point3::from(mm))
}

/// What a line of a text STL may be next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Expect {
    Solid,
    FacetOrEnd,
    OuterLoop,
    Vertex(u8),
    EndLoop,
    EndFacet,
}

impl Expect {
    fn words(self) -> &'static str {
        match self {
            Expect::Solid => "\"solid\"",
            Expect::FacetOrEnd => "\"facet normal\" or \"endsolid\"",
            Expect::OuterLoop => "\"outer loop\"",
            Expect::Vertex(_) => "\"vertex\"",
            Expect::EndLoop => "\"endloop\"",
            Expect::EndFacet => "\"endfacet\"",
        }
    }
}

/// Reads a text STL; keywords in any letter case, several solids in one file.
pub fn read_text(bytes: &[u8], mm_per_unit: f64, run: &RunContext) -> Result<Mesh, ReadError> {
    let mut lines = Lines::new(format::without_mark(bytes), 0, 1);
    let mut soup = Soup::new(mm_per_unit, 0);
    let mut expect = Expect::Solid;
    while let Some(line) = lines.next_filled()? {
        if line.number % FACETS_BETWEEN_CHECKS == 0 {
            run.check()?;
        }
        expect = read_line(expect, line.text, &mut soup)
            .map_err(|diagnostic| Fault::from(diagnostic.at_line(line.number)).cut_off_if(!line.ended))?;
    }
    if expect != Expect::Solid || lines.next_number() == 1 {
        let diagnostic = Diagnostic::error(format!("the file ends, expected {}", expect.words()))
            .at_line(lines.next_number().saturating_sub(1).max(1))
            .with_help("the file was cut off; export or copy it again");
        return Err(Fault::cut_off(diagnostic).into());
    }
    check_count(soup.vertices.len() as u64 / 3)?;
    Ok(soup.into_mesh())
}

fn read_line(expect: Expect, line: &[u8], soup: &mut Soup) -> Result<Expect, Diagnostic> {
    let mut fields = words(line);
    let keyword = fields.next().unwrap_or_default();
    let is = |word: &str| keyword.eq_ignore_ascii_case(word.as_bytes());
    match expect {
        Expect::Solid if is("solid") => Ok(Expect::FacetOrEnd),
        Expect::FacetOrEnd if is("facet") => Ok(Expect::OuterLoop),
        // Some programs write `end solid`.
        Expect::FacetOrEnd if is("endsolid") => Ok(Expect::Solid),
        Expect::FacetOrEnd if is("end") && fields.next().is_some_and(|word| word.eq_ignore_ascii_case(b"solid")) => {
            Ok(Expect::Solid)
        }
        Expect::OuterLoop if is("outer") => Ok(Expect::Vertex(0)),
        Expect::Vertex(corner) if is("vertex") => {
            let mut xyz = [0.0; 3];
            for x in &mut xyz {
                let field = fields.next().unwrap_or_default();
                *x = number(field).ok_or_else(|| not_a_number(field, "a coordinate"))?;
            }
            if let Some(surplus) = fields.next() {
                return Err(not_a_number(surplus, "the end of the line after three coordinates"));
            }
            soup.push(xyz)?;
            Ok(if corner == 2 { Expect::EndLoop } else { Expect::Vertex(corner + 1) })
        }
        Expect::EndLoop if is("endloop") => Ok(Expect::EndFacet),
        Expect::EndFacet if is("endfacet") => Ok(Expect::FacetOrEnd),
        Expect::EndLoop if is("vertex") => {
            Err(Diagnostic::error("a fourth corner, expected facets with three")
                .with_help("export the CAD as triangles"))
        }
        _ => Err(Diagnostic::error(format!("\"{}\" found, expected {}", excerpt(line), expect.words()))
            .with_help("the file was cut off or damaged; export it again")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "SOLID Part A\n facet NORMAL 0 0 1\n  Outer Loop\n   vertex 0 0 0\n   VERTEX 1e1 0 0\n   vertex 0 1 0\n  EndLoop\n endfacet\nendsolid Part A\n";

    fn binary(corners: &[[f32; 3]]) -> Vec<u8> {
        let mut bytes = b"solid but binary\n".to_vec();
        bytes.resize(80, 0);
        bytes.extend((corners.len() as u32 / 3).to_le_bytes());
        for facet in corners.chunks(3) {
            bytes.extend([0; 12]);
            facet.iter().flatten().for_each(|x| bytes.extend(x.to_le_bytes()));
            bytes.extend([0; 2]);
        }
        bytes
    }

    const CORNERS: [[f32; 3]; 6] =
        [[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 5.0], [1.0, 0.0, 5.0], [0.0, 1.0, 5.0]];

    fn said(result: Result<Mesh, ReadError>) -> Diagnostic {
        match result {
            Err(ReadError::Bad(diagnostic) | ReadError::CutOff(diagnostic)) => *diagnostic,
            other => panic!("expected a refusal, got {other:?}"),
        }
    }

    #[test]
    fn text_in_any_letter_case_equals_binary() {
        let run = RunContext::silent();
        let text = read_text(TEXT.as_bytes(), 25.4, &run).unwrap();
        let same = read_binary(&binary(&CORNERS[..3]), 25.4, &run).unwrap();
        assert_eq!(text, same);
        assert_eq!(text.vertices[1], Point3::new(254.0, 0.0, 0.0));
        assert_eq!(text.triangles, [[0, 1, 2]]);
    }

    /// A part at 1e30 mm is a damaged file.
    #[test]
    fn a_vertex_beyond_a_kilometre_is_refused_with_its_facet() {
        let at = |x: f32| {
            read_binary(&binary(&[[x, 0.0, 0.0], [x, 100.0, 0.0], [x, 0.0, 100.0]]), 1.0, &RunContext::silent())
        };
        assert!(at(1e5).is_ok() && at(-1e5).is_ok());
        // A kilometre is allowed, as in a plan, but not in steps of 0.06 mm.
        assert!(said(at(1e6)).message.contains("steps of 0.062 mm"));
        for x in [1_000_001.0, -2e6, 1e30] {
            let told = said(at(x));
            assert!(
                told.message.starts_with("facet 1 (byte 96), corner 1: coordinate")
                    && told.message.contains("1000000 mm"),
                "{told}"
            );
            assert!(told.help.is_some());
        }
    }

    #[test]
    fn a_count_that_is_not_the_sizes_is_refused_with_both_sizes() {
        for count in [0u32, 1, 3, 4_000_000_000] {
            let mut bytes = binary(&CORNERS);
            bytes[80..84].copy_from_slice(&count.to_le_bytes());
            let message = said(read_binary(&bytes, 1.0, &RunContext::silent())).message;
            assert!(
                message.contains("184") && message.contains(&(84 + 50 * u64::from(count)).to_string()),
                "{message}"
            );
        }
    }

    #[test]
    fn a_coordinate_that_is_not_finite_is_refused_with_its_facet() {
        for bad in [f32::NAN, f32::INFINITY, 1e38] {
            let mut corners = CORNERS;
            corners[4][2] = bad;
            let message = said(read_binary(&binary(&corners), 1.0, &RunContext::silent())).message;
            assert!(message.starts_with("facet 2 (byte 158), corner 2:"), "{message}");
        }
    }

    #[test]
    fn text_faults_carry_their_line() {
        let cases =
            [("1e1", "1,5", 5, "decimal comma"), ("1e1", "nan", 5, "finite"), ("0 1 0\n", "0 1\n", 6, "expected")];
        for (from, to, line, word) in cases {
            let diagnostic = said(read_text(TEXT.replace(from, to).as_bytes(), 1.0, &RunContext::silent()));
            assert_eq!(diagnostic.line, Some(line), "{diagnostic}");
            assert!(diagnostic.to_string().contains(word), "{diagnostic}");
        }
    }

    #[test]
    fn every_cut_is_refused() {
        let run = RunContext::silent();
        // The name behind `endsolid` and the last line end are not needed.
        let needed = TEXT.find("endsolid").unwrap() + "endsolid".len();
        for cut in 0..needed {
            assert!(read_text(&TEXT.as_bytes()[..cut], 1.0, &run).is_err(), "{cut}");
        }
        let bytes = binary(&CORNERS);
        for cut in 0..bytes.len() {
            assert!(read_binary(&bytes[..cut], 1.0, &run).is_err(), "{cut}");
        }
    }
}
