//! What the columns of a cloud mean, and rows of numbers sorted into the arrays of a cloud.
//!
//! One code path for PLY (text and binary) and for delimited text: a [`Layout`] says what each column is, chunks of rows
//! are read side by side into [`Rows`], and the chunks are joined in their order.

use super::fault::Fault;
use super::{LARGEST_COORDINATE_MM, TOO_FAR_HELP, too_far};
use crate::diagnostic::{Diagnostic, ReadError};
use crate::geometry::{Point3, PointCloud};
use crate::run::RunContext;
use rayon::prelude::*;

/// Chunks that are in memory before they are joined: bounds what a reader holds twice.
const CHUNKS_AT_ONCE: usize = 16;

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Coordinate 0, 1 or 2.
    Position(u8),
    /// Component 0, 1 or 2 of the normal.
    Normal(u8),
    /// Red 0, green 1 or blue 2.
    Colour(u8),
    /// The further property of that index.
    Scalar(u16),
    /// Nothing that we keep.
    Ignored,
}

/// How colour numbers become 8 bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColourScale {
    /// 0..255.
    Byte,
    /// 0..65535.
    Short,
    /// Numbers with a decimal point: 0..1 when none is above 1, else 0..255, else 0..65535.
    ByLargest,
}

/// The columns of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    /// One a column.
    pub roles: Vec<Role>,
    /// Names of the further properties, in the file's order.
    pub scalar_names: Vec<String>,
    /// What the numbers of colours mean.
    pub colour_scale: ColourScale,
}

/// The role of a component of a triple.
type RoleOf = fn(u8) -> Role;

/// Names that mean the same triple, in the order x, y, z or red, green, blue.
const POSITION_NAMES: [[&str; 3]; 2] = [["x", "y", "z"], ["x_mm", "y_mm", "z_mm"]];
const NORMAL_NAMES: [[&str; 3]; 3] =
    [["nx", "ny", "nz"], ["normal_x", "normal_y", "normal_z"], ["normalx", "normaly", "normalz"]];
const COLOUR_NAMES: [[&str; 3]; 4] =
    [["red", "green", "blue"], ["diffuse_red", "diffuse_green", "diffuse_blue"], ["r", "g", "b"], ["rf", "gf", "bf"]];

impl Layout {
    /// Sorts columns by their names; `None` for a column that cannot hold one number (a list).
    ///
    /// # Errors
    /// A name that stands twice, or no x, y and z.
    pub fn by_names(names: &[Option<&str>]) -> Result<Layout, Diagnostic> {
        let lower: Vec<Option<String>> = names.iter().map(|name| name.map(str::to_ascii_lowercase)).collect();
        let mut sorted: Vec<&str> = lower.iter().flatten().map(String::as_str).collect();
        sorted.sort_unstable();
        if let Some(pair) = sorted.windows(2).find(|pair| pair[0] == pair[1] && !pair[0].is_empty()) {
            return Err(Diagnostic::error(format!("column \"{}\" twice, expected each name once", shown(pair[0])))
                .with_help("give each column its own name"));
        }
        let triple = |sets: &[[&str; 3]]| {
            let at = |name: &str| lower.iter().position(|column| column.as_deref() == Some(name));
            sets.iter().find_map(|set| Some([at(set[0])?, at(set[1])?, at(set[2])?]))
        };
        let Some(position) = triple(&POSITION_NAMES) else {
            let found: Vec<String> = names.iter().flatten().take(12).map(|name| shown(name)).collect();
            return Err(Diagnostic::error(format!("columns {} found, expected x, y and z", found.join(", ")))
                .with_help("export the points with columns named x, y and z"));
        };
        let mut roles = vec![None; names.len()];
        let groups = [
            (Some(position), Role::Position as RoleOf),
            (triple(&NORMAL_NAMES), Role::Normal),
            (triple(&COLOUR_NAMES), Role::Colour),
        ];
        for (columns, role) in groups {
            for (axis, column) in columns.into_iter().flatten().enumerate() {
                roles[column] = Some(role(axis as u8));
            }
        }
        Ok(Self::completed(roles, names))
    }

    /// Makes scalars of all columns that have a name and no role yet.
    pub fn completed(roles: Vec<Option<Role>>, names: &[Option<&str>]) -> Layout {
        let mut scalar_names = Vec::new();
        let roles = roles.iter().zip(names).map(|(role, name)| match (role, name) {
            (Some(role), _) => *role,
            (None, Some(name)) if scalar_names.len() < usize::from(u16::MAX) => {
                scalar_names.push((*name).to_owned());
                Role::Scalar(scalar_names.len() as u16 - 1)
            }
            _ => Role::Ignored,
        });
        let roles = roles.collect();
        Layout { roles, scalar_names, colour_scale: ColourScale::Byte }
    }

    /// Whether some column has the role, for component 0 of a triple.
    pub fn has(&self, role: Role) -> bool {
        self.roles.contains(&role)
    }
}

fn shown(name: &str) -> String {
    super::field::excerpt(name.as_bytes())
}

/// What becomes of a file's lengths.
#[derive(Debug, Clone, Copy)]
pub struct Lengths {
    /// What is kept, in one of the file's unit.
    pub kept_per_unit: f64,
    /// Millimetres in one of what is kept.
    pub mm_per_kept: f64,
}

impl Lengths {
    /// Kept as mm.
    pub fn in_mm(mm_per_unit: f64) -> Self {
        Self { kept_per_unit: mm_per_unit, mm_per_kept: 1.0 }
    }

    /// Kept as they are.
    pub fn as_they_are(mm_per_unit: f64) -> Self {
        Self { kept_per_unit: 1.0, mm_per_kept: mm_per_unit }
    }
}

/// Rows read so far.
#[derive(Debug)]
pub struct Rows<'a> {
    layout: &'a Layout,
    lengths: Lengths,
    positions: Vec<Point3>,
    normals: Vec<[f32; 3]>,
    colours: Vec<[f32; 3]>,
    scalars: Vec<Vec<f32>>,
    has_normals: bool,
    has_colours: bool,
    skipped_invalid: usize,
    row_scalars: Vec<f32>,
}

impl<'a> Rows<'a> {
    /// No row yet. `expected` rows must be backed by bytes that are there.
    pub fn new(layout: &'a Layout, lengths: Lengths, expected: usize) -> Self {
        let has_normals = layout.has(Role::Normal(0));
        let has_colours = layout.has(Role::Colour(0));
        Self {
            layout,
            lengths,
            positions: Vec::with_capacity(expected),
            normals: Vec::with_capacity(if has_normals { expected } else { 0 }),
            colours: Vec::with_capacity(if has_colours { expected } else { 0 }),
            scalars: layout.scalar_names.iter().map(|_| Vec::with_capacity(expected)).collect(),
            has_normals,
            has_colours,
            skipped_invalid: 0,
            row_scalars: vec![0.0; layout.scalar_names.len()],
        }
    }

    /// Sorts one row in; `value` gives the number in a column. A point that is not finite is counted and left out.
    ///
    /// # Errors
    /// `value` fails, or a coordinate is larger than any part.
    pub fn push(&mut self, mut value: impl FnMut(usize) -> Result<f64, Diagnostic>) -> Result<(), Diagnostic> {
        let mut position = [0.0_f64; 3];
        let mut normal = [0.0_f32; 3];
        let mut colour = [0.0_f32; 3];
        for (column, role) in self.layout.roles.iter().enumerate() {
            match *role {
                Role::Position(axis) => position[usize::from(axis)] = value(column)? * self.lengths.kept_per_unit,
                Role::Normal(axis) => normal[usize::from(axis)] = value(column)? as f32,
                Role::Colour(axis) => colour[usize::from(axis)] = value(column)? as f32,
                Role::Scalar(index) => self.row_scalars[usize::from(index)] = value(column)? as f32,
                Role::Ignored => {}
            }
        }
        if !position.iter().all(|x| x.is_finite()) {
            self.skipped_invalid += 1;
            return Ok(());
        }
        let mm = position.map(|x| x * self.lengths.mm_per_kept);
        if let Some(x) = mm.iter().find(|x| x.abs() > LARGEST_COORDINATE_MM) {
            let own = x / self.lengths.mm_per_kept / self.lengths.kept_per_unit;
            return Err(Diagnostic::error(too_far(*x, own)).with_help(TOO_FAR_HELP));
        }
        self.positions.push(Point3::from(position));
        if self.has_normals {
            self.normals.push(normal);
        }
        if self.has_colours {
            self.colours.push(colour);
        }
        for (column, value) in self.scalars.iter_mut().zip(&self.row_scalars) {
            column.push(*value);
        }
        Ok(())
    }

    /// The rows of a later piece of the file behind these.
    fn append(&mut self, later: &Rows) {
        self.positions.extend_from_slice(&later.positions);
        self.normals.extend_from_slice(&later.normals);
        self.colours.extend_from_slice(&later.colours);
        for (column, more) in self.scalars.iter_mut().zip(&later.scalars) {
            column.extend_from_slice(more);
        }
        self.skipped_invalid += later.skipped_invalid;
    }

    /// The cloud of all rows.
    pub fn into_cloud(self) -> PointCloud {
        let colours = self.has_colours.then(|| bytes_of(&self.colours, self.layout.colour_scale));
        let scalars = self.layout.scalar_names.iter().cloned().zip(self.scalars).collect();
        PointCloud {
            positions: self.positions,
            colours,
            normals: self.has_normals.then_some(self.normals),
            scalars,
            skipped_invalid: self.skipped_invalid,
        }
    }
}

/// Colours in 8 bits. What is not a number becomes 0, what is out of range the nearest end of it.
fn bytes_of(colours: &[[f32; 3]], scale: ColourScale) -> Vec<[u8; 3]> {
    let factor = match scale {
        ColourScale::Byte => 1.0,
        ColourScale::Short => 1.0 / 257.0,
        ColourScale::ByLargest => {
            // `max` passes over NaN; the largest of some numbers is the same in any order.
            let largest = colours.par_iter().map(|c| c[0].max(c[1]).max(c[2])).reduce(|| 0.0, f32::max);
            match largest {
                l if l <= 1.0 => 255.0,
                l if l <= 255.0 => 1.0,
                _ => 1.0 / 257.0,
            }
        }
    };
    colours.par_iter().map(|colour| colour.map(|value| (value * factor).round() as u8)).collect()
}

/// Reads chunks side by side and joins them in their order, looking in between whether the job was cancelled.
///
/// `expected` rows must be backed by bytes that are there. The first error in the file's order is returned.
pub fn read_chunks<'a, C: Sync>(
    chunks: &[C],
    layout: &'a Layout,
    lengths: Lengths,
    expected: usize,
    run: &RunContext,
    read: impl Fn(&C) -> Result<Rows<'a>, Fault> + Sync,
) -> Result<Rows<'a>, ReadError> {
    let mut all = Rows::new(layout, lengths, expected);
    for some in chunks.chunks(CHUNKS_AT_ONCE) {
        run.check()?;
        let parts: Vec<Result<Rows, Fault>> = some.par_iter().map(&read).collect();
        for part in parts {
            all.append(&part?);
        }
    }
    Ok(all)
}

/// The refusal of more points than an index can number.
pub fn too_many_points(found: u64) -> Diagnostic {
    Diagnostic::error(format!("{found} points, expected at most {}", u32::MAX))
        .with_help("thin the cloud before reading it")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout(names: &[&str]) -> Layout {
        Layout::by_names(&names.iter().map(|n| Some(*n)).collect::<Vec<_>>()).unwrap()
    }

    #[test]
    fn names_give_roles_in_any_order_and_case() {
        let found = layout(&["Blue", "quality", "Z", "nx", "X", "Y", "red", "green", "ny", "nz"]);
        use Role::{Colour, Normal, Position, Scalar};
        let expected = [
            Colour(2),
            Scalar(0),
            Position(2),
            Normal(0),
            Position(0),
            Position(1),
            Colour(0),
            Colour(1),
            Normal(1),
            Normal(2),
        ];
        assert_eq!(found.roles, expected);
        assert_eq!(found.scalar_names, ["quality"]);
    }

    #[test]
    fn an_incomplete_triple_is_kept_by_name() {
        let found = layout(&["x", "y", "z", "red", "nx"]);
        assert_eq!(found.scalar_names, ["red", "nx"]);
    }

    #[test]
    fn missing_and_double_coordinates_are_refused() {
        assert!(Layout::by_names(&[Some("x"), Some("y")]).unwrap_err().message.contains("expected x, y and z"));
        assert!(Layout::by_names(&[Some("x"), Some("X"), Some("y"), Some("z")]).unwrap_err().message.contains("twice"));
    }

    #[test]
    fn rows_that_are_not_finite_leave_all_arrays_and_are_counted() {
        let layout = layout(&["x", "y", "z", "s"]);
        let mut rows = Rows::new(&layout, Lengths::in_mm(10.0), 0);
        for row in [[1.0, 2.0, 3.0, 7.0], [1.0, f64::NAN, 3.0, 8.0], [4.0, 5.0, 6.0, f64::NAN]] {
            rows.push(|column| Ok(row[column])).unwrap();
        }
        let cloud = rows.into_cloud();
        assert_eq!(cloud.positions, [Point3::new(10.0, 20.0, 30.0), Point3::new(40.0, 50.0, 60.0)]);
        assert_eq!(cloud.skipped_invalid, 1);
        assert!(cloud.scalars[0].1[0] == 7.0 && cloud.scalars[0].1[1].is_nan());
    }

    #[test]
    fn a_point_beyond_a_kilometre_is_refused() {
        let layout = layout(&["x", "y", "z"]);
        let mut rows = Rows::new(&layout, Lengths::in_mm(1000.0), 0);
        assert!(rows.push(|_| Ok(-1000.0)).is_ok());
        let told = rows.push(|column| Ok([1.0, 1000.1, 2.0][column])).unwrap_err();
        assert!(told.message.contains("1000100 mm") && told.help.is_some(), "{told}");
    }

    #[test]
    fn colours_of_all_widths_become_bytes() {
        let colours = [[0.0, 1.0, f32::NAN]];
        assert_eq!(bytes_of(&colours, ColourScale::ByLargest), [[0, 255, 0]]);
        assert_eq!(bytes_of(&colours, ColourScale::Byte), [[0, 1, 0]]);
        assert_eq!(bytes_of(&[[128.0, 255.0, -3.0]], ColourScale::ByLargest), [[128, 255, 0]]);
        assert_eq!(bytes_of(&[[65535.0, 257.0, 0.0]], ColourScale::Short), [[255, 1, 0]]);
        assert_eq!(bytes_of(&[[65535.0, 257.0, 0.0]], ColourScale::ByLargest), [[255, 1, 0]]);
    }
}
