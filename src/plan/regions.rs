//! `[[alignment.region]]` and `freeze`: a best fit to chosen regions of the CAD, some of its freedoms kept from the best fit to all.

use super::reader::{Entry, NumberRule, TableReader, quoted};
use super::sections::finish;
use super::suggest::{list_or, nearest};
use super::values::{POSITIVE_MM, name, position, triple};
use crate::geometry::{Aabb, Point3, Vector3};

/// A freedom of the part: a shift along an axis of the CAD frame, or a turn about one through the middle of the regions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Freedom {
    /// Shift along x.
    X,
    /// Shift along y.
    Y,
    /// Shift along z.
    Z,
    /// Turn about x.
    Rx,
    /// Turn about y.
    Ry,
    /// Turn about z.
    Rz,
}

impl Freedom {
    /// All six, with their words in plans.
    pub const ALL: [(&'static str, Freedom); 6] = [
        ("x", Freedom::X),
        ("y", Freedom::Y),
        ("z", Freedom::Z),
        ("rx", Freedom::Rx),
        ("ry", Freedom::Ry),
        ("rz", Freedom::Rz),
    ];

    /// Its place among shift along x, y, z and turn about x, y, z.
    pub fn index(self) -> usize {
        self as usize
    }
}

/// The extent of a region.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RegionShape {
    /// A ball of this radius.
    Ball {
        /// The radius.
        radius_mm: f64,
    },
    /// A box along the axes of the CAD frame, of this size.
    Box {
        /// Its whole extents.
        size_mm: Vector3,
    },
}

/// `[[alignment.region]]`: the surface of the CAD in there is fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct FitRegion {
    /// What people call it; `region 2` where the plan does not.
    pub name: String,
    /// Its middle, CAD frame.
    pub centre: Point3,
    /// How far it reaches.
    pub shape: RegionShape,
    /// How much it counts beside the others, however many points it has.
    pub weight: f64,
    /// Line in the plan file, from 1.
    pub line: usize,
}

impl FitRegion {
    /// Whether a place of the CAD lies in it.
    pub fn contains(&self, place: &Point3) -> bool {
        let off = place - self.centre;
        match self.shape {
            RegionShape::Ball { radius_mm } => off.norm() <= radius_mm,
            RegionShape::Box { size_mm } => (0..3).all(|k| 2.0 * off[k].abs() <= size_mm[k]),
        }
    }

    /// Radius of a ball about its middle that holds all of it.
    pub fn reach_mm(&self) -> f64 {
        match self.shape {
            RegionShape::Ball { radius_mm } => radius_mm,
            RegionShape::Box { size_mm } => 0.5 * size_mm.norm(),
        }
    }
}

/// A best fit to regions.
#[derive(Debug, Clone, PartialEq)]
pub struct RegionFit {
    /// At least one.
    pub regions: Vec<FitRegion>,
    /// What stays as the best fit to the whole part has it; not all six.
    pub freeze: Vec<Freedom>,
}

impl RegionFit {
    /// The middle of the regions' box, about which turns are told.
    pub fn middle(&self) -> Point3 {
        let centres: Vec<Point3> = self.regions.iter().map(|region| region.centre).collect();
        Aabb::of_points(&centres).map_or_else(Point3::origin, |bounds| bounds.centre())
    }
}

/// Reads the regions and `freeze` of a best fit. The inner `None`: neither is there.
pub(super) fn region_fit(table: &TableReader<'_>) -> Option<Option<RegionFit>> {
    let frozen = table.optional("freeze");
    let freeze = frozen.map_or(Some(Vec::new()), freedoms);
    let rows = table.sections("region", "[[alignment.region]]");
    let given = table.optional("region").is_some();
    let mut regions = Vec::with_capacity(rows.len());
    let mut complete = true;
    for (k, row) in rows.into_iter().enumerate() {
        let read = region(&row, k + 1);
        finish(row);
        complete &= read.is_some();
        regions.extend(read);
    }
    if !given {
        if let Some(entry) = frozen {
            let words = "is not used without [[alignment.region]]: all of the best fit is kept";
            entry.odd(words, "add regions, or remove it");
        }
        return freeze.map(|_| None);
    }
    if let Some(entry) = table.optional("region").filter(|_| complete && regions.is_empty()) {
        entry.wrong("found no region, expected at least one", "begin each with a line [[alignment.region]]");
    }
    (complete && !regions.is_empty()).then_some(())?;
    Some(Some(RegionFit { regions, freeze: freeze? }))
}

fn region(row: &TableReader<'_>, number: usize) -> Option<FitRegion> {
    const WEIGHT: NumberRule =
        NumberRule { expected: "a number above 0 and up to 1000", accepts: |v| v > 0.0 && v <= 1000.0 };
    let called = row.optional("name").map_or_else(|| Some(format!("region {number}")), |e| name(e).map(str::to_owned));
    let centre = row.required("centre", "the middle of the region", "write centre = [10.0, 40.0, 8.0]");
    let centre = centre.and_then(position);
    let shape = match (row.optional("radius_mm"), row.optional("size_mm")) {
        (Some(entry), None) => entry.number(POSITIVE_MM).map(|radius_mm| RegionShape::Ball { radius_mm }),
        (None, Some(entry)) => size(entry),
        (Some(_), Some(entry)) => {
            entry.wrong("found beside radius_mm, expected one of them", "a region is a ball or a box: remove one");
            None
        }
        (None, None) => {
            row.required(
                "radius_mm",
                "how far the region reaches",
                "write radius_mm = 20.0, or size_mm = [40, 20, 10]",
            );
            None
        }
    };
    let weight = row.optional("weight").map_or(Some(1.0), |entry| entry.number(WEIGHT));
    Some(FitRegion { name: called?, centre: centre?, shape: shape?, weight: weight?, line: row.line() })
}

fn size(entry: Entry<'_>) -> Option<RegionShape> {
    let [x, y, z] = triple(entry, "three lengths in mm", "[40.0, 20.0, 10.0]")?;
    if [x, y, z].iter().any(|v| !(POSITIVE_MM.accepts)(*v)) {
        entry.wrong(
            "found a length that is not above 0, expected three lengths above 0",
            "write size_mm = [40, 20, 10]",
        );
        return None;
    }
    Some(RegionShape::Box { size_mm: Vector3::new(x, y, z) })
}

fn freedoms(entry: Entry<'_>) -> Option<Vec<Freedom>> {
    const EXPECTED: &str = "a list of freedoms: x, y, z (shifts), rx, ry, rz (turns)";
    const EXAMPLE: &str = "[\"x\", \"rz\"]";
    let words: Vec<&str> = Freedom::ALL.iter().map(|(word, _)| *word).collect();
    let mut frozen = Vec::new();
    for value in entry.list(EXPECTED, EXAMPLE)? {
        let Some(text) = value.as_str() else {
            entry.wrong(
                format!("found {}, expected {EXPECTED}", super::reader::describe_value(value)),
                format!("write it such as {EXAMPLE}"),
            );
            return None;
        };
        let Some((_, freedom)) = Freedom::ALL.iter().find(|(word, _)| *word == text) else {
            let help = match nearest(text, words.iter().copied()) {
                Some((known, true)) => format!("did you mean \"{known}\"?"),
                _ => format!("write {}", list_or(&words, "\"")),
            };
            entry.wrong(format!("found {}, expected {EXPECTED}", quoted(text)), help);
            return None;
        };
        frozen.push(*freedom);
    }
    frozen.sort_unstable();
    let written = frozen.len();
    frozen.dedup();
    if frozen.len() < written {
        entry.odd("names a freedom twice", "name each once");
    }
    if frozen.len() == Freedom::ALL.len() {
        let words = "freezes all six freedoms, so that the regions would hold nothing";
        entry.wrong(words, "leave out what the regions should hold, or remove the regions");
        return None;
    }
    Some(frozen)
}
