//! Telling formats apart by what is in the file.

use super::fault::Fault;
use super::field::{number, words};
use crate::diagnostic::Diagnostic;
use std::path::Path;

/// What a file is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Binary STL: 80 free bytes, a count n, n facets of 50 bytes.
    StlBinary,
    /// Text STL.
    StlText,
    /// Wavefront OBJ.
    Obj,
    /// PLY, text or binary.
    Ply,
    /// Rows of numbers.
    TextCloud,
}

/// Bytes that are looked at for keywords.
const SAMPLE: usize = 64 * 1024;
/// What we read, for messages.
const READABLE: &str = "STL, OBJ or PLY for CAD; PLY or text columns for scans";

/// Decides the format. The size of a binary STL is looked at before any word in it, because many programs begin their
/// binary header with `solid`; the extension decides only what content leaves open.
///
/// # Errors
/// An empty file or one that is none of ours; formats that we know by name are named.
pub fn detect(bytes: &[u8], file: &Path) -> Result<Format, Fault> {
    if bytes.is_empty() {
        let diagnostic = Diagnostic::error("the file is empty").with_help("copy or export the file again");
        return Err(Fault::cut_off(diagnostic));
    }
    let extension = file.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let text = without_mark(bytes);
    if is_ply(text) {
        return Ok(Format::Ply);
    }
    if let Some(name) = known_by_name(bytes) {
        return Err(Diagnostic::error(format!("{name}, expected {READABLE}"))
            .with_help("export the data in one of these formats")
            .into());
    }
    if super::stl::size_fits(bytes) {
        return Ok(Format::StlBinary);
    }
    let sample = &text[..text.len().min(SAMPLE)];
    if sample.contains(&0) {
        // Not text. A binary STL of the wrong size is told about by its reader, with both sizes.
        return match extension.as_str() {
            "stl" => Ok(Format::StlBinary),
            _ => Err(Diagnostic::error(format!("binary data of an unknown format, expected {READABLE}"))
                .with_help("export the data in one of these formats, or copy the file again")
                .into()),
        };
    }
    Ok(by_words(sample, &extension))
}

/// The text without a leading UTF-8 byte order mark.
pub fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)
}

fn is_ply(text: &[u8]) -> bool {
    text.strip_prefix(b"ply").is_some_and(|rest| matches!(rest.first(), None | Some(b'\r' | b'\n' | b' ' | b'\t')))
}

/// Formats that people try, by their first bytes.
fn known_by_name(bytes: &[u8]) -> Option<&'static str> {
    const NAMES: [(&[u8], &str); 12] = [
        (b"ISO-10303-21", "a STEP file"),
        (b"PK\x03\x04", "a ZIP archive (or 3MF)"),
        (b"\x1f\x8b", "a gzip archive"),
        (b"7z\xbc\xaf", "a 7z archive"),
        (b"ASTM-E57", "an E57 scan"),
        (b"LASF", "a LAS or LAZ scan"),
        (b"# .PCD", "a PCD scan"),
        (b"VERSION .", "a PCD scan"),
        (b"glTF", "a glTF file"),
        (b"%PDF", "a PDF document"),
        (b"\xff\xfe", "text in UTF-16"),
        (b"\xfe\xff", "text in UTF-16"),
    ];
    NAMES.iter().find(|(magic, _)| bytes.starts_with(magic)).map(|&(_, name)| name)
}

/// The format of a text by the first line that says something.
fn by_words(sample: &[u8], extension: &str) -> Format {
    const OBJ_WORDS: [&[u8]; 12] =
        [b"v", b"vn", b"vt", b"vp", b"f", b"l", b"o", b"g", b"s", b"mtllib", b"usemtl", b"maplib"];
    let mut lines = sample.split(|&b| b == b'\n').filter(|line| {
        let first = words(line).next();
        first.is_some_and(|word| !word.starts_with(b"#") && !word.starts_with(b"//"))
    });
    let Some(line) = lines.next() else {
        // Only comments: the extension says what was meant.
        return match extension {
            "obj" => Format::Obj,
            "stl" => Format::StlText,
            _ => Format::TextCloud,
        };
    };
    let mut fields = words(line);
    let first = fields.next().unwrap_or_default();
    if first.eq_ignore_ascii_case(b"solid") || first.eq_ignore_ascii_case(b"facet") {
        return Format::StlText;
    }
    // A header line of a cloud may begin with a column called "v" or "s": an OBJ statement has a number or a name
    // behind it, and the extension tells about the rest.
    let is_obj_word = OBJ_WORDS.contains(&first);
    let second_is_number = fields.next().is_some_and(|word| number(word).is_some());
    match extension {
        "stl" => Format::StlText,
        "obj" => Format::Obj,
        _ if is_obj_word && (second_is_number || first.len() > 1 || matches!(first, b"o" | b"g" | b"f")) => Format::Obj,
        _ => Format::TextCloud,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostic::ReadError;

    fn of(bytes: &[u8], name: &str) -> Option<Format> {
        detect(bytes, Path::new(name)).ok()
    }

    #[test]
    fn content_decides_before_the_extension() {
        assert_eq!(of(b"ply\r\nformat", "a.stl"), Some(Format::Ply));
        assert_eq!(of(b"SOLID x\n", "a.ply"), Some(Format::StlText));
        assert_eq!(of(b"# c\nv 1 2 3\n", "a.xyz"), Some(Format::Obj));
        assert_eq!(of(b"1 2 3\n", "a.xyz"), Some(Format::TextCloud));
        assert_eq!(of(b"x y z\n1 2 3\n", "a.csv"), Some(Format::TextCloud));
        assert_eq!(of(b"\xef\xbb\xbfx;y;z\n", "a.csv"), Some(Format::TextCloud));
    }

    #[test]
    fn a_binary_stl_may_begin_with_solid() {
        let mut bytes = b"solid with\na line end".to_vec();
        bytes.resize(80, b' ');
        bytes.extend(1u32.to_le_bytes());
        bytes.resize(134, 0);
        assert_eq!(of(&bytes, "part"), Some(Format::StlBinary));
        bytes.pop();
        assert_eq!(of(&bytes, "part.stl"), Some(Format::StlBinary));
    }

    #[test]
    fn formats_that_we_do_not_read_are_named() {
        for (bytes, name) in [(&b"ISO-10303-21;"[..], "STEP"), (b"PK\x03\x04..", "ZIP"), (b"\xff\xfe1\x00", "UTF-16")] {
            let error = ReadError::from(detect(bytes, Path::new("x.stl")).unwrap_err());
            assert!(matches!(&error, ReadError::Bad(said) if said.message.contains(name)), "{error}");
        }
        let error = ReadError::from(detect(b"", Path::new("x.stl")).unwrap_err());
        assert!(matches!(&error, ReadError::CutOff(said) if said.message.contains("empty")), "{error}");
    }
}
