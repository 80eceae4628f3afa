//! Clouds as binary PLY and meshes as binary STL.

use crate::geometry::{LengthUnit, Mesh, Point3};
use std::io::{self, BufWriter, Write};

/// From this distance on, in mm, coordinates are written as `double`: below it, rounding to `float` costs at most
/// 2^-13 mm = 0.00012 mm, a tenth of what a structured-light scanner resolves.
const LARGEST_FLOAT_COORDINATE_MM: f64 = 4096.0;

/// Writes points, whose coordinates are in `unit`, as a binary little-endian PLY with a comment that names the unit: `x y z`
/// as `float` (as `double` when one lies 4096 mm or more from the origin on some axis), then normals, colours as `uchar`, and further properties as `float`.
///
/// Numbers that are `f32` already come back from [`read_cloud`](super::read_cloud) with the same bits.
///
/// # Errors
/// `InvalidInput` when an array has not the length of `points` or a name is empty or holds blanks; else what `out` says.
pub fn write_ply_cloud(
    out: &mut impl Write,
    points: &[Point3],
    unit: LengthUnit,
    colours: Option<&[[u8; 3]]>,
    normals: Option<&[[f32; 3]]>,
    scalars: &[(&str, &[f32])],
) -> io::Result<()> {
    let wide = points.iter().any(|p| unit.in_mm() * p.coords.amax() >= LARGEST_FLOAT_COORDINATE_MM);
    let scalars: Vec<(&str, Numbers)> = scalars.iter().map(|(name, values)| (*name, Numbers::Float(values))).collect();
    let shape = Shape { wide, unit, colours, normals, scalars: &scalars };
    shape.write(out, points)
}

/// The values of a property.
#[derive(Debug, Clone, Copy)]
pub enum Numbers<'a> {
    /// `float`.
    Float(&'a [f32]),
    /// `int`.
    Int(&'a [i32]),
}

impl Numbers<'_> {
    fn len(&self) -> usize {
        match self {
            Numbers::Float(values) => values.len(),
            Numbers::Int(values) => values.len(),
        }
    }

    fn bytes(&self, index: usize) -> [u8; 4] {
        match self {
            Numbers::Float(values) => values[index].to_le_bytes(),
            Numbers::Int(values) => values[index].to_le_bytes(),
        }
    }
}

/// Writes points, whose coordinates are in `unit`, as a binary little-endian PLY with `x y z` as `double` and further properties of
/// either kind: nothing of a coordinate is lost.
///
/// # Errors
/// Those of [`write_ply_cloud`].
pub fn write_ply_points(
    out: &mut impl Write,
    points: &[Point3],
    unit: LengthUnit,
    properties: &[(&str, Numbers)],
) -> io::Result<()> {
    Shape { wide: true, unit, colours: None, normals: None, scalars: properties }.write(out, points)
}

/// What there is beside the places of points.
struct Shape<'a> {
    /// Coordinates as `double`.
    wide: bool,
    unit: LengthUnit,
    colours: Option<&'a [[u8; 3]]>,
    normals: Option<&'a [[f32; 3]]>,
    scalars: &'a [(&'a str, Numbers<'a>)],
}

impl Shape<'_> {
    fn write(&self, out: &mut impl Write, points: &[Point3]) -> io::Result<()> {
        let Self { wide, unit, colours, normals, scalars } = *self;
        check_arrays(points, colours, normals, scalars)?;
        let mut out = BufWriter::with_capacity(1 << 16, out);
        write_header(&mut out, points.len(), wide, unit, colours.is_some(), normals.is_some(), scalars)?;
        let mut record = Vec::new();
        for (index, point) in points.iter().enumerate() {
            record.clear();
            for x in point.iter() {
                if wide {
                    record.extend(x.to_le_bytes());
                } else {
                    record.extend((*x as f32).to_le_bytes());
                }
            }
            if let Some(normals) = normals {
                normals[index].iter().for_each(|x| record.extend(x.to_le_bytes()));
            }
            if let Some(colours) = colours {
                record.extend(colours[index]);
            }
            scalars.iter().for_each(|(_, values)| record.extend(values.bytes(index)));
            out.write_all(&record)?;
        }
        out.flush()
    }
}

fn check_arrays(
    points: &[Point3],
    colours: Option<&[[u8; 3]]>,
    normals: Option<&[[f32; 3]]>,
    scalars: &[(&str, Numbers)],
) -> io::Result<()> {
    let same = |length: usize| length == points.len();
    let lengths_agree = colours.is_none_or(|c| same(c.len()))
        && normals.is_none_or(|n| same(n.len()))
        && scalars.iter().all(|(_, values)| same(values.len()));
    if !lengths_agree {
        return Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            "an array has not as many entries as there are points",
        ));
    }
    if let Some((name, _)) = scalars.iter().find(|(name, _)| name.is_empty() || name.contains(char::is_whitespace)) {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, format!("\"{name}\" cannot name a property")));
    }
    Ok(())
}

fn write_header(
    out: &mut impl Write,
    count: usize,
    wide: bool,
    unit: LengthUnit,
    colours: bool,
    normals: bool,
    scalars: &[(&str, Numbers)],
) -> io::Result<()> {
    let coordinate = if wide { "double" } else { "float" };
    let unit = unit.key();
    write!(out, "ply\nformat binary_little_endian 1.0\ncomment lengths in {unit}\nelement vertex {count}\n")?;
    for name in ["x", "y", "z"] {
        writeln!(out, "property {coordinate} {name}")?;
    }
    for name in ["nx", "ny", "nz"].iter().filter(|_| normals) {
        writeln!(out, "property float {name}")?;
    }
    for name in ["red", "green", "blue"].iter().filter(|_| colours) {
        writeln!(out, "property uchar {name}")?;
    }
    for (name, values) in scalars {
        let kind = if matches!(values, Numbers::Int(_)) { "int" } else { "float" };
        writeln!(out, "property {kind} {name}")?;
    }
    out.write_all(b"end_header\n")
}

/// Writes a mesh as binary STL, with the unit normal of each triangle (0 0 0 where it has no area).
///
/// # Errors
/// What `out` says.
pub fn write_stl(out: &mut impl Write, mesh: &Mesh) -> io::Result<()> {
    let vector = |v: [f64; 3]| stl_io::Vector::new(v.map(|x| x as f32));
    let facets = (0..mesh.triangles.len()).map(|t| stl_io::Triangle {
        normal: vector(mesh.normal(t).map_or([0.0; 3], |n| n.into_inner().into())),
        vertices: mesh.corners(t).map(|p| vector(p.coords.into())),
    });
    stl_io::write_stl(out, facets)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::{read_cloud, read_mesh};
    use crate::run::RunContext;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use std::path::Path;

    fn random_f32(rng: &mut ChaCha8Rng, range: f32) -> f32 {
        rng.random_range(-range..range)
    }

    #[test]
    fn a_cloud_read_after_writing_is_the_same() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        // At 1000 mm numbers are `float`, at 10^6 mm `double`; both hold numbers that are f32 already.
        for range in [1000.0, 1e6] {
            let random = |rng: &mut ChaCha8Rng| f64::from(random_f32(rng, range));
            let points: Vec<Point3> =
                (0..500).map(|_| Point3::new(random(&mut rng), random(&mut rng), random(&mut rng))).collect();
            let colours: Vec<[u8; 3]> = (0..500).map(|_| rng.random()).collect();
            let normals: Vec<[f32; 3]> = (0..500).map(|_| [0; 3].map(|_| random_f32(&mut rng, 1.0))).collect();
            let scalar: Vec<f32> = (0..500).map(|_| random_f32(&mut rng, 1e9)).collect();
            let mut bytes = Vec::new();
            let scalars = [("deviation", &scalar[..]), ("Sigma_i", &scalar[..])];
            write_ply_cloud(&mut bytes, &points, LengthUnit::Mm, Some(&colours), Some(&normals), &scalars).unwrap();
            let cloud = read_cloud(&bytes, Path::new("x.ply"), LengthUnit::Mm, &RunContext::silent()).unwrap();
            assert_eq!(cloud.positions, points);
            assert_eq!(cloud.colours.as_deref(), Some(&colours[..]));
            assert_eq!(cloud.normals.as_deref(), Some(&normals[..]));
            assert_eq!(cloud.scalar("deviation"), Some(&scalar[..]));
            assert_eq!(cloud.scalar("Sigma_i"), Some(&scalar[..]));
        }
    }

    #[test]
    fn points_come_back_as_they_were_with_whole_numbers_beside_them() {
        let points = [Point3::new(0.1, 1.0 / 3.0, -2e5), Point3::new(1001.5, 0.7, 4e-9)];
        let properties = [("sigma_i", Numbers::Float(&[0.25, 0.5])), ("view", Numbers::Int(&[-1, 16_777_217]))];
        let mut bytes = Vec::new();
        write_ply_points(&mut bytes, &points, LengthUnit::Um, &properties).unwrap();
        let header = String::from_utf8_lossy(&bytes);
        assert!(header.contains("property float sigma_i\nproperty int view\n"), "{header}");
        assert!(bytes.ends_with(&16_777_217_i32.to_le_bytes()));
        let unit = LengthUnit::Um;
        let back = crate::io::read_cloud_in_its_unit(&bytes, Path::new("x.ply"), unit, &RunContext::silent()).unwrap();
        assert_eq!((back.positions.as_slice(), back.scalar("sigma_i")), (&points[..], Some(&[0.25, 0.5][..])));
        let short = [("view", Numbers::Int(&[1][..]))];
        assert!(write_ply_points(&mut Vec::new(), &points, unit, &short).is_err());
    }

    #[test]
    fn arrays_of_other_lengths_and_odd_names_are_not_written() {
        let points = [Point3::origin()];
        let mut out = Vec::new();
        assert!(write_ply_cloud(&mut out, &points, LengthUnit::Mm, Some(&[]), None, &[]).is_err());
        assert!(write_ply_cloud(&mut out, &points, LengthUnit::Mm, None, None, &[("a b", &[1.0])]).is_err());
        assert!(write_ply_cloud(&mut out, &points, LengthUnit::Mm, None, None, &[("a", &[])]).is_err());
        assert!(out.is_empty());
    }

    #[test]
    fn the_comment_names_the_unit_and_far_points_keep_their_digits_in_any() {
        // 5000 mm, in each unit: beyond the reach of `float`.
        for unit in [LengthUnit::Mm, LengthUnit::Cm, LengthUnit::M, LengthUnit::Inch, LengthUnit::Um] {
            let mut bytes = Vec::new();
            write_ply_cloud(&mut bytes, &[Point3::new(5000.0 / unit.in_mm(), 0.0, 0.0)], unit, None, None, &[])
                .unwrap();
            let header = String::from_utf8_lossy(&bytes);
            assert!(header.contains(&format!("comment lengths in {}\n", unit.key())), "{header}");
            assert!(header.contains("property double x"), "{header}");
        }
    }

    #[test]
    fn a_mesh_read_after_writing_has_the_same_corners() {
        let mesh = Mesh {
            vertices: vec![
                Point3::new(0.0, 0.0, 0.5),
                Point3::new(2.0, 0.0, 0.5),
                Point3::new(0.0, 3.0, 0.5),
                Point3::new(1e3, -7.25, 9.0),
            ],
            triangles: vec![[0, 1, 2], [2, 1, 3], [0, 0, 1]],
        };
        let mut bytes = Vec::new();
        write_stl(&mut bytes, &mesh).unwrap();
        let back = read_mesh(&bytes, Path::new("x.stl"), LengthUnit::Mm, &RunContext::silent()).unwrap();
        assert_eq!(back.triangles.len(), mesh.triangles.len());
        for t in 0..3 {
            assert_eq!(back.corners(t), mesh.corners(t));
        }
    }
}
