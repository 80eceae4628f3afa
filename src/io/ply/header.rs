//! The header of a PLY: elements, their counts and properties. Counts are claims until the body is looked at.

use super::super::fault::Fault;
use super::super::field::{excerpt, words};
use super::super::lines::Lines;
use crate::diagnostic::Diagnostic;

/// How the body is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// Rows of decimal numbers.
    Text,
    /// Least significant byte first.
    LittleEndian,
    /// Most significant byte first.
    BigEndian,
}

/// The number types of the format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names say it: signed, unsigned, floating, with their bits")]
pub enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Number {
    fn by_name(name: &[u8]) -> Option<Number> {
        Some(match name {
            b"char" | b"int8" => Number::I8,
            b"uchar" | b"uint8" => Number::U8,
            b"short" | b"int16" => Number::I16,
            b"ushort" | b"uint16" => Number::U16,
            b"int" | b"int32" => Number::I32,
            b"uint" | b"uint32" => Number::U32,
            b"float" | b"float32" => Number::F32,
            b"double" | b"float64" => Number::F64,
            _ => return None,
        })
    }

    /// Bytes of one.
    pub fn size(self) -> usize {
        match self {
            Number::I8 | Number::U8 => 1,
            Number::I16 | Number::U16 => 2,
            Number::I32 | Number::U32 | Number::F32 => 4,
            Number::F64 => 8,
        }
    }

    /// Largest value of a whole-number type; `None` for floating ones.
    pub fn largest_integer(self) -> Option<f64> {
        Some(match self {
            Number::I8 => f64::from(i8::MAX),
            Number::U8 => f64::from(u8::MAX),
            Number::I16 => f64::from(i16::MAX),
            Number::U16 => f64::from(u16::MAX),
            Number::I32 => f64::from(i32::MAX),
            Number::U32 => f64::from(u32::MAX),
            Number::F32 | Number::F64 => return None,
        })
    }

    /// Whether a value of a text file is one of this type.
    pub fn holds(self, value: f64) -> bool {
        match self {
            Number::F32 | Number::F64 => true,
            Number::U8 | Number::U16 | Number::U32 => value.fract() == 0.0 && value >= 0.0 && self.above(value),
            // The negative end lies one further.
            Number::I8 | Number::I16 | Number::I32 => {
                value.fract() == 0.0 && self.above(value) && self.above(-1.0 - value)
            }
        }
    }

    fn above(self, value: f64) -> bool {
        self.largest_integer().is_none_or(|largest| value <= largest)
    }
}

/// One number or a list of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// One number.
    Single(Number),
    /// A count and so many numbers.
    List {
        /// Type of the count.
        count: Number,
        /// Type of the numbers.
        item: Number,
    },
}

/// A property of an element.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Property {
    /// Its name as written.
    pub name: String,
    /// What it holds.
    pub kind: Kind,
}

/// An element, such as `vertex` or `face`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Element {
    /// Its name.
    pub name: String,
    /// How many the header claims.
    pub count: u64,
    /// Its properties in order.
    pub properties: Vec<Property>,
    /// Its line in the header, from 1.
    pub line: usize,
}

impl Element {
    /// What it holds, as people who see no file call it.
    pub fn records(&self) -> String {
        match self.name.as_str() {
            "vertex" => "points".to_owned(),
            name => format!("records of \"{}\"", super::super::field::excerpt(name.as_bytes())),
        }
    }

    /// Bytes that one record has at least in a binary file.
    pub fn least_size(&self) -> usize {
        let size = |property: &Property| match property.kind {
            Kind::Single(number) | Kind::List { count: number, .. } => number.size(),
        };
        self.properties.iter().map(size).sum()
    }

    /// Whether every record has the same size in a binary file.
    pub fn is_fixed_size(&self) -> bool {
        self.properties.iter().all(|property| matches!(property.kind, Kind::Single(_)))
    }
}

/// Everything before the body.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Header {
    /// How the body is written.
    pub encoding: Encoding,
    /// Its elements in order.
    pub elements: Vec<Element>,
    /// First byte of the body.
    pub body_offset: usize,
    /// Line of that byte, from 1.
    pub body_line: usize,
}

impl Header {
    /// The element with the points.
    pub fn vertices(&self) -> Result<&Element, Diagnostic> {
        self.elements.iter().find(|element| element.name == "vertex").ok_or_else(|| {
            let names: Vec<String> =
                self.elements.iter().take(8).map(|e| format!("\"{}\"", excerpt(e.name.as_bytes()))).collect();
            let found =
                if names.is_empty() { "no elements".to_owned() } else { format!("elements {}", names.join(", ")) };
            Diagnostic::error(format!("{found} found, expected an element \"vertex\""))
                .with_help("export the points as a PLY with an element \"vertex\" and its x, y and z")
        })
    }
}

/// Reads the header.
pub fn parse(bytes: &[u8]) -> Result<Header, Fault> {
    let mut lines = Lines::new(bytes, 0, 1);
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    let mut offset = 0;
    loop {
        let number = lines.next_number();
        let Some(line) = lines.next_line()? else {
            return Err(cut_off(number));
        };
        if !line.ended {
            return Err(cut_off(number));
        }
        offset = end_of_line(bytes, offset);
        let fields: Vec<&[u8]> = words(line.text).take(8).collect();
        let done = match fields.first().copied() {
            Some(b"end_header") => true,
            Some(b"format") => {
                encoding = Some(encoding_of(&fields).map_err(|d| d.at_line(number))?);
                false
            }
            Some(b"element") => {
                elements.push(element_of(&fields, number, &elements).map_err(|d| d.at_line(number))?);
                false
            }
            Some(b"property") => {
                let property = property_of(&fields).map_err(|d| d.at_line(number))?;
                let Some(element) = elements.last_mut() else {
                    let diagnostic = strange(line.text, "\"element\" before its first property");
                    return Err(diagnostic.at_line(number).into());
                };
                element.properties.push(property);
                false
            }
            None | Some(b"ply" | b"comment" | b"obj_info") => false,
            Some(_) => return Err(strange(line.text, "a header line of a PLY").at_line(number).into()),
        };
        if done {
            break;
        }
    }
    let Some(encoding) = encoding else {
        return Err(Diagnostic::error("no line \"format\" found in the header, expected one")
            .at_line(lines.next_number() - 1)
            .with_help("the file is damaged; export it again")
            .into());
    };
    Ok(Header { encoding, elements, body_offset: offset, body_line: lines.next_number() })
}

fn end_of_line(bytes: &[u8], begin: usize) -> usize {
    bytes[begin..].iter().position(|&byte| byte == b'\n').map_or(bytes.len(), |end| begin + end + 1)
}

fn cut_off(line: usize) -> Fault {
    let diagnostic = Diagnostic::error("the header ends before \"end_header\"")
        .at_line(line)
        .with_help("the file was cut off or is still being written; copy it again");
    Fault::cut_off(diagnostic)
}

fn strange(line: &[u8], expected: &str) -> Diagnostic {
    Diagnostic::error(format!("\"{}\" found, expected {expected}", excerpt(line)))
        .with_help("the file is damaged or of another kind; export it again")
}

fn encoding_of(fields: &[&[u8]]) -> Result<Encoding, Diagnostic> {
    match fields.get(1).copied().unwrap_or_default() {
        b"ascii" => Ok(Encoding::Text),
        b"binary_little_endian" => Ok(Encoding::LittleEndian),
        b"binary_big_endian" => Ok(Encoding::BigEndian),
        other => Err(strange(other, "ascii, binary_little_endian or binary_big_endian")),
    }
}

fn element_of(fields: &[&[u8]], line: usize, before: &[Element]) -> Result<Element, Diagnostic> {
    let (Some(name), Some(count), None) = (fields.get(1), fields.get(2), fields.get(3)) else {
        return Err(strange(&fields.join(&b' '), "\"element NAME COUNT\""));
    };
    let count = std::str::from_utf8(count)
        .ok()
        .and_then(|text| text.parse().ok())
        .ok_or_else(|| strange(count, "the number of records, 0 or more"))?;
    let name = String::from_utf8_lossy(name).into_owned();
    if matches!(name.as_str(), "vertex" | "face") && before.iter().any(|element| element.name == name) {
        return Err(strange(name.as_bytes(), "each element once"));
    }
    Ok(Element { name, count, properties: Vec::new(), line })
}

fn property_of(fields: &[&[u8]]) -> Result<Property, Diagnostic> {
    let number =
        |name: &[u8]| Number::by_name(name).ok_or_else(|| strange(name, "a number type such as float or uchar"));
    let (name, kind) = match fields {
        [_, b"list", count, item, name] => (name, Kind::List { count: number(count)?, item: number(item)? }),
        [_, single, name] => (name, Kind::Single(number(single)?)),
        _ => return Err(strange(&fields.join(&b' '), "\"property TYPE NAME\" or \"property list TYPE TYPE NAME\"")),
    };
    Ok(Property { name: String::from_utf8_lossy(name).into_owned(), kind })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostic::ReadError;

    #[test]
    fn types_have_their_ranges() {
        assert!(Number::I8.holds(-128.0) && !Number::I8.holds(-129.0) && !Number::I8.holds(128.0));
        assert!(
            Number::U8.holds(255.0) && !Number::U8.holds(256.0) && !Number::U8.holds(-1.0) && !Number::U8.holds(0.5)
        );
        assert!(Number::F32.holds(f64::NAN) && !Number::I32.holds(f64::NAN));
    }

    #[test]
    fn header_faults_carry_their_line() {
        let cases = [
            ("ply\nformat ascii 1.0\nelement vertex -1\n", 3),
            ("ply\nformat ascii 1.0\nelement vertex 99999999999999999999\n", 3),
            ("ply\nformat asci 1.0\n", 2),
            ("ply\nproperty float x\n", 2),
            ("ply\nformat ascii 1.0\nelement vertex 1\nproperty real x\n", 4),
            ("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x", 4),
            ("ply\nelement vertex 1\nend_header\n", 3),
        ];
        for (text, line) in cases {
            let error = ReadError::from(parse(text.as_bytes()).unwrap_err());
            let (ReadError::Bad(said) | ReadError::CutOff(said)) = error else { panic!("{error}") };
            assert_eq!(said.line, Some(line), "{text}");
        }
    }
}
