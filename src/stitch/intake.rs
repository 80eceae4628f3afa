//! A file's points and columns as a view.

use super::metric::Metric;
use super::view::View;
use crate::diagnostic::Diagnostic;
use crate::geometry::{Point3, PointCloud};
use std::collections::BTreeMap;

/// A view as it was read.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// Its points, with the metrics that the file has.
    pub view: View,
    /// The column `a`, background of the fringes, where the file has it.
    pub background: Option<Vec<f32>>,
    /// Records in the file.
    pub points_read: usize,
    /// Those of them without a place: a coordinate is no number, or all three are 0 as many programs write where they saw nothing.
    pub points_invalid: usize,
}

/// A view of the points of a file. Names of columns are taken in either case of letters. A value that is infinite is none: no number.
///
/// # Errors
/// Rows or columns of pixels that are no whole numbers, or nothing but points without a place.
pub fn measured(mut cloud: PointCloud, name: &str, sensor: Point3) -> Result<Measured, Diagnostic> {
    let points_read = cloud.len() + cloud.skipped_invalid;
    let dropped = drop_empty_pixels(&mut cloud);
    if cloud.is_empty() {
        let message = format!("all of the {points_read} points lie at (0, 0, 0), expected a measured view");
        return Err(Diagnostic::error(message).with_help("check the sensor's export"));
    }
    let points_invalid = cloud.skipped_invalid + dropped;
    let mut columns = BTreeMap::new();
    let (mut background, mut rows, mut cols) = (None, None, None);
    for (name, mut values) in cloud.scalars {
        // A division by nothing measures nothing.
        values.iter_mut().filter(|value| value.is_infinite()).for_each(|value| *value = f32::NAN);
        let key = name.to_ascii_lowercase();
        match key.as_str() {
            "a" => background = Some(values),
            "row" => rows = Some(values),
            "col" | "column" => cols = Some(values),
            _ => {
                Metric::of_key(&key).map(|metric| columns.insert(metric, values));
            }
        }
    }
    let pixels = match (rows, cols) {
        (Some(rows), Some(cols)) => Some(pixels(&rows, &cols)?),
        _ => None,
    };
    let view = View { name: name.to_owned(), positions: cloud.positions, columns, pixels, sensor };
    Ok(Measured { view, background, points_read, points_invalid })
}

/// Leaves out points at the origin where there are several, with what is known of them; how many.
fn drop_empty_pixels(cloud: &mut PointCloud) -> usize {
    let origin = Point3::origin();
    let empty = cloud.positions.iter().filter(|p| **p == origin).count();
    if empty < 2 {
        return 0;
    }
    let keep: Vec<bool> = cloud.positions.iter().map(|p| *p != origin).collect();
    for (_, values) in &mut cloud.scalars {
        retain(values, &keep);
    }
    retain(&mut cloud.positions, &keep);
    empty
}

/// Keeps the entries that are marked.
pub(super) fn retain<T>(values: &mut Vec<T>, keep: &[bool]) {
    let mut marks = keep.iter();
    values.retain(|_| marks.next().copied().unwrap_or(false));
}

fn pixels(rows: &[f32], cols: &[f32]) -> Result<Vec<[u32; 2]>, Diagnostic> {
    // Whole numbers beyond are not told apart in a float.
    const LARGEST: f32 = 16_777_216.0;
    let whole = |v: f32| (v.fract() == 0.0 && (0.0..=LARGEST).contains(&v)).then_some(v as u32);
    let pixel = |(row, col): (&f32, &f32)| {
        whole(*row).zip(whole(*col)).map(|(row, col)| [row, col]).ok_or_else(|| {
            let message =
                format!("found the pixel ({row}, {col}), expected whole numbers of row and column, 0 or more");
            Diagnostic::error(message).with_help("export row and col as the camera counts them, or leave both out")
        })
    };
    rows.iter().zip(cols).map(pixel).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cloud(scalars: &[(&str, &[f32])], places: &[[f64; 3]]) -> PointCloud {
        PointCloud {
            positions: places.iter().map(|p| Point3::from(*p)).collect(),
            scalars: scalars.iter().map(|(name, values)| ((*name).to_owned(), values.to_vec())).collect(),
            skipped_invalid: 5,
            ..PointCloud::default()
        }
    }

    #[test]
    fn columns_land_by_name_and_empty_pixels_are_counted() {
        let columns: [(&str, &[f32]); 6] = [
            ("a", &[1.0, 2.0, 3.0, 4.0]),
            ("Sigma_I", &[0.1, 0.2, 0.3, 0.4]),
            ("d_cal", &[9.0, 8.0, 7.0, 6.0]),
            ("row", &[0.0, 0.0, 1.0, 1.0]),
            ("col", &[4.0, 5.0, 4.0, 5.0]),
            ("temperature", &[20.0; 4]),
        ];
        let places = [[1.0, 0.0, 0.0], [0.0; 3], [0.0, 0.0, 2.0], [0.0; 3]];
        let found = measured(cloud(&columns, &places), "v", Point3::origin()).unwrap();
        assert_eq!((found.points_read, found.points_invalid, found.view.positions.len()), (9, 7, 2));
        assert_eq!(found.background, Some(vec![1.0, 3.0]));
        let keys: Vec<Metric> = found.view.columns.keys().copied().collect();
        assert_eq!(keys, [Metric::PhaseShiftVariation, Metric::CalibrationDistance]);
        assert_eq!(found.view.columns[&Metric::CalibrationDistance], [9.0, 7.0]);
        assert_eq!(found.view.pixels, Some(vec![[0, 4], [1, 4]]));
        // A single point may lie there.
        let single = measured(cloud(&[], &places[..2]), "v", Point3::origin()).unwrap();
        assert_eq!((single.points_invalid, single.view.pixels), (5, None));
    }

    #[test]
    fn what_is_infinite_is_not_measured() {
        let columns: [(&str, &[f32]); 2] = [("b", &[f32::INFINITY, 1.0]), ("a", &[2.0, f32::NEG_INFINITY])];
        let found = measured(cloud(&columns, &[[1.0; 3], [2.0; 3]]), "v", Point3::origin()).unwrap();
        let (a, b) = (found.background.unwrap(), &found.view.columns[&Metric::Strength]);
        assert!(b[0].is_nan() && b[1] == 1.0 && a[0] == 2.0 && a[1].is_nan());
    }

    #[test]
    fn nothing_but_empty_pixels_and_halves_of_pixels_are_told() {
        let told = measured(cloud(&[], &[[0.0; 3], [0.0; 3]]), "v", Point3::origin()).unwrap_err();
        assert!(told.message.contains("all of the 7 points"), "{told}");
        let halves: [(&str, &[f32]); 2] = [("row", &[0.5]), ("col", &[1.0])];
        let told = measured(cloud(&halves, &[[1.0; 3]]), "v", Point3::origin()).unwrap_err();
        assert!(told.message.contains("(0.5, 1)"), "{told}");
    }
}
