//! The poses of the views as a stage or robot tells them: `{"views": [{"index": 0, "approx": {"R": [[..]], "t": [..]}}, …]}` with
//! `x_world = R x_view + t`. The index is a view's place in the order of names.

use crate::diagnostic::Diagnostic;
use crate::geometry::{Isometry3, Vector3};
use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion};
use serde_json::Value;

const EXAMPLE: &str =
    r#"write {"views": [{"index": 0, "approx": {"R": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "t": [0, 0, 0]}}, ..]}"#;
/// How far R may stand off a rotation: text with four decimals stays below.
const ROTATION_SLACK: f64 = 1e-3;
/// Names of missing views that are told.
const NAMED: usize = 5;

/// One pose for each of the views, by their names in order; `world_from_view`.
///
/// # Errors
/// No JSON, another form, an index twice or beyond the last view, a view without a pose, an R that is no rotation.
pub fn poses(bytes: &[u8], views: &[String]) -> Result<Vec<Isometry3>, Diagnostic> {
    // Some editors put a mark before UTF-8.
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let value: Value = serde_json::from_slice(bytes).map_err(|e| {
        let fault = Diagnostic::error(format!("found no JSON ({e}), expected a file of poses")).with_help(EXAMPLE);
        if e.line() > 0 { fault.at_line(e.line()) } else { fault }
    })?;
    let Some(entries) = value.get("views").and_then(Value::as_array) else {
        return Err(Diagnostic::error("found no list \"views\", expected the poses of the views").with_help(EXAMPLE));
    };
    let mut poses: Vec<Option<Isometry3>> = vec![None; views.len()];
    for (k, entry) in entries.iter().enumerate() {
        let index = index_of(entry, k, views)?;
        let pose = pose(entry).map_err(|fault| Diagnostic {
            message: format!("the pose of index {index} ({}): {}", views[index], fault.message),
            ..fault
        })?;
        if poses[index].replace(pose).is_some() {
            let message = format!("found two poses of index {index} ({}), expected one", views[index]);
            return Err(
                Diagnostic::error(message).with_help("give each view its own index, from 0 in the order of names")
            );
        }
    }
    let missing: Vec<&str> =
        poses.iter().zip(views).filter(|(pose, _)| pose.is_none()).map(|(_, name)| name.as_str()).collect();
    if let Some(first) = poses.iter().position(Option::is_none) {
        let names = missing[..missing.len().min(NAMED)].join(", ");
        let more = missing.len().saturating_sub(NAMED);
        let names = if more > 0 { format!("{names} and {more} more") } else { names };
        let message = format!(
            "found no pose of {names}, expected one of each of the {} views (the first missing index is {first})",
            views.len()
        );
        return Err(
            Diagnostic::error(message).with_help("add the poses, or move the views without one out of the folder")
        );
    }
    Ok(poses.into_iter().flatten().collect())
}

fn index_of(entry: &Value, k: usize, views: &[String]) -> Result<usize, Diagnostic> {
    let Some(index) = entry.get("index").and_then(Value::as_u64) else {
        let found = entry.get("index").map_or_else(|| "nothing".to_owned(), Value::to_string);
        let message = format!("views[{k}] index: found {found}, expected a whole number from 0");
        return Err(Diagnostic::error(message).with_help("the index is the view's place in the order of names, from 0"));
    };
    let views = views.len();
    usize::try_from(index).ok().filter(|index| *index < views).ok_or_else(|| {
        let message =
            format!("views[{k}]: found a pose of index {index} for {views} views, expected 0 to {}", views - 1);
        let help = "the poses are more than the views: check [views] pattern, and that every view is in the folder";
        Diagnostic::error(message).with_help(help)
    })
}

fn pose(entry: &Value) -> Result<Isometry3, Diagnostic> {
    let numbers = |value: Option<&Value>| -> Option<[f64; 3]> {
        let list: Option<Vec<f64>> = value?.as_array()?.iter().map(Value::as_f64).collect();
        list?.try_into().ok()
    };
    let approx = entry.get("approx");
    let rows = approx.and_then(|pose| pose.get("R")).and_then(Value::as_array);
    let rows: Option<Vec<[f64; 3]>> = rows.and_then(|rows| rows.iter().map(|row| numbers(Some(row))).collect());
    let Some(Ok(rows)) = rows.map(<[[f64; 3]; 3]>::try_from) else {
        return Err(
            Diagnostic::error("found no \"approx\" with R, expected three rows of three numbers").with_help(EXAMPLE)
        );
    };
    let Some(t) = numbers(approx.and_then(|pose| pose.get("t"))) else {
        return Err(Diagnostic::error("found no t, expected three numbers").with_help(EXAMPLE));
    };
    let r = Matrix3::from_fn(|i, j| rows[i][j]);
    let off = (r * r.transpose() - Matrix3::identity()).abs().max();
    let determinant = r.determinant();
    if determinant < 0.0 && off <= ROTATION_SLACK {
        let message = format!("R mirrors (its determinant is {determinant:.3}), expected a rotation");
        return Err(Diagnostic::error(message).with_help("swap the sign of one axis: views cannot be mirrored"));
    }
    if off > ROTATION_SLACK {
        let message =
            format!("R is no rotation (R Rt is off the identity by {off:.3}, its determinant is {determinant:.3})");
        let help =
            "give R as three rows of unit length that are perpendicular, with a determinant of 1; lengths belong in t";
        return Err(Diagnostic::error(message).with_help(help));
    }
    let rotation = nearest_rotation(r).ok_or_else(|| Diagnostic::error("R is no rotation").with_help(EXAMPLE))?;
    Ok(Isometry3::from_parts(Translation3::from(Vector3::from(t)), rotation))
}

/// What rounding of the text has bent is put straight; what is a rotation already stays as it is to the last digits.
fn nearest_rotation(r: Matrix3<f64>) -> Option<UnitQuaternion<f64>> {
    // Newton's way to the nearest rotation squares the error of 0.001 with each step.
    const STEPS: usize = 4;
    let mut straight = r;
    for _ in 0..STEPS {
        straight = 0.5 * (straight + straight.try_inverse()?.transpose());
    }
    Some(UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(straight)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point3;
    use std::fmt::Write as _;

    const ONE: &str = r#"{"index": 0, "approx": {"R": [[0, -1, 0], [1, 0, 0], [0, 0, 1]], "t": [10, 20.5, -3]}}"#;

    fn names(count: usize) -> Vec<String> {
        (0..count).map(|k| format!("view_{k:02}.ply")).collect()
    }

    #[test]
    fn a_pose_maps_view_to_world_and_rounding_is_taken_out() {
        let file = format!(
            "{{\"views\": [{}, {ONE}]}}",
            ONE.replace("0, \"approx", "1, \"approx").replace("1, 0, 0]", "0.9999, 0.0001, 0]")
        );
        let found = poses(file.as_bytes(), &names(2)).unwrap();
        assert!((found[0] * Point3::new(1.0, 2.0, 3.0) - Point3::new(8.0, 21.5, 0.0)).norm() < 1e-12);
        let r = found[1].rotation.to_rotation_matrix();
        assert!((r.matrix() * r.matrix().transpose() - Matrix3::identity()).abs().max() < 1e-14);
        assert_eq!(poses(format!("\u{feff}{file}").as_bytes(), &names(2)).unwrap(), found);
    }

    #[test]
    fn every_fault_has_its_words() {
        let list = |entries: &[String]| format!("{{\"views\": [{}]}}", entries.join(", "));
        let one = ONE.to_owned();
        let with = |from: &str, to: &str| list(&[ONE.replacen(from, to, 1)]);
        let mut found = String::new();
        for (what, text, views) in [
            ("no JSON", "<html>\n<body>".to_owned(), 1),
            ("cut off", list(std::slice::from_ref(&one))[..40].to_owned(), 1),
            ("no list", "{\"poses\": []}".to_owned(), 1),
            ("too many", list(&[one.clone(), ONE.replacen("0, \"approx", "1, \"approx", 1)]), 1),
            ("missing", list(std::slice::from_ref(&one)), 3),
            ("many missing", list(&[]), 9),
            ("double", list(&[one.clone(), one.clone()]), 1),
            ("index as text", with("\"index\": 0", "\"index\": \"0\""), 1),
            ("no index", with("\"index\": 0", "\"number\": 0"), 1),
            ("negative index", with("\"index\": 0", "\"index\": -1"), 1),
            ("mirrored", with("[0, 0, 1]", "[0, 0, -1]"), 1),
            ("scaled", with("[0, 0, 1]", "[0, 0, 1000]"), 1),
            ("two rows", with(", [0, 0, 1]", ""), 1),
            ("no t", with("\"t\"", "\"T\""), 1),
            ("text in t", with("20.5", "\"20.5\""), 1),
            ("no approx", with("approx", "exact"), 1),
        ] {
            let told = poses(text.as_bytes(), &names(views)).expect_err(what);
            assert!(told.help.is_some(), "{what}");
            let _ = writeln!(
                found,
                "{what}: {}{}",
                told.line.map_or_else(String::new, |l| format!("line {l}: ")),
                told.message
            );
        }
        let expected = include_str!("pose_file_faults.txt");
        assert_eq!(found, expected, "{found}");
    }
}
