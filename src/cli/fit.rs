//! `shapeline fit`: a least-squares shape for each file of points, one JSON object a file.

use super::{Exit, diagnostic_of, terminal};
use crate::diagnostic::Diagnostic;
use crate::fit::{CoordinatePlane, FitError, FitKind, FitMethod, FitOutcome, Fitted, Known, fit_points_knowing};
use crate::geometry::{LengthUnit, Point3, UnitVector3};
use crate::io;
use crate::run::RunContext;
use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// `shapeline fit KIND FILE…`.
#[derive(Debug, Args)]
pub(super) struct FitArguments {
    /// The shape.
    #[arg(value_parser = fit_kind())]
    kind: FitKind,
    /// Files of points: delimited text or PLY.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Tukey's biweight instead of plain least squares, from a start that outliers cannot pull away: for up to a third of them.
    #[arg(long, conflicts_with = "three_sigma")]
    robust: bool,
    /// Fit, leave out the points beyond three standard deviations, fit once more: for few outliers; from a ninth of the points on none
    /// is left out.
    #[arg(long)]
    three_sigma: bool,
    /// The plane of a circle: x=VALUE, y=VALUE or z=VALUE.
    #[arg(long, value_name = "x=VALUE", value_parser = coordinate_plane)]
    plane: Option<CoordinatePlane>,
    /// The radius of a circle, sphere or cylinder where it is known, in the unit of the files.
    #[arg(long, value_name = "R", value_parser = positive)]
    radius: Option<f64>,
}

/// One of the shapes by its word.
fn fit_kind() -> impl TypedValueParser<Value = FitKind> {
    PossibleValuesParser::new(FitKind::ALL.map(FitKind::key)).map(|word| {
        let named = FitKind::ALL.into_iter().find(|kind| kind.key() == word);
        named.expect("the parser takes no other word")
    })
}

fn positive(text: &str) -> Result<f64, String> {
    let value = text.trim().parse::<f64>().ok().filter(|v| v.is_finite() && *v > 0.0);
    value.ok_or_else(|| "expected a number above 0".to_string())
}

fn coordinate_plane(text: &str) -> Result<CoordinatePlane, String> {
    let expected = || "expected a plane such as x=12.5, y=0 or z=-3".to_string();
    let (name, value) = text.split_once('=').ok_or_else(expected)?;
    let axis = ["x", "y", "z"].iter().position(|a| *a == name.trim()).ok_or_else(expected)?;
    let value = value.trim().parse::<f64>().ok().filter(|v| v.is_finite()).ok_or_else(expected)?;
    Ok(CoordinatePlane { axis, value })
}

pub(super) fn run(arguments: &FitArguments) -> Result<Exit, Diagnostic> {
    if arguments.plane.is_some() && arguments.kind != FitKind::Circle {
        return Err(Diagnostic::error("--plane goes with circles only"));
    }
    if arguments.radius.is_some() && !matches!(arguments.kind, FitKind::Circle | FitKind::Sphere | FitKind::Cylinder) {
        return Err(Diagnostic::error("--radius goes with circles, spheres and cylinders only"));
    }
    let known = Known { plane: arguments.plane, radius: arguments.radius };
    let method = match (arguments.robust, arguments.three_sigma) {
        (true, _) => FitMethod::Robust,
        (_, true) => FitMethod::ThreeSigma,
        _ => FitMethod::LeastSquares,
    };
    let mut failed = 0;
    for file in &arguments.files {
        match fit_file(file, arguments.kind, method, known) {
            Ok((outcome, not_finite)) => {
                if not_finite > 0 {
                    let message =
                        format!("{not_finite} points with a coordinate that is no number (nan, inf) are left out");
                    terminal::error(&Diagnostic::warning(message).in_file(file));
                }
                terminal::line(json(file, arguments.kind, &outcome, not_finite));
            }
            Err(diagnostic) => {
                failed += 1;
                terminal::error(&diagnostic);
            }
        }
    }
    Ok(match failed {
        0 => Exit::Good,
        n if n == arguments.files.len() => Exit::Unusable,
        _ => Exit::NotGood,
    })
}

/// The fit, and how many points were no numbers.
fn fit_file(file: &Path, kind: FitKind, method: FitMethod, known: Known) -> Result<(FitOutcome, usize), Diagnostic> {
    let bytes = io::read_file(file).map_err(diagnostic_of)?;
    // The file's own unit is kept: nothing is compared with a CAD here.
    let cloud = io::read_cloud(&bytes, file, LengthUnit::Mm, &RunContext::silent()).map_err(diagnostic_of)?;
    let fit = fit_points_knowing(kind, &cloud.positions, method, known).map_err(|e| {
        let robust = method == FitMethod::Robust;
        let help = match e {
            FitError::OffPlane { .. } => "give the plane in which the points lie, or leave --plane out",
            FitError::NotOfRadius => {
                "check --radius and the unit of the file, or leave --radius out and let the fit tell it"
            }
            _ if robust => {
                "give more points, spread over more of the shape; no more than a third of them may be outliers"
            }
            _ => "give more points, spread over more of the shape; if some of them are outliers, try --robust",
        };
        Diagnostic::error(format!("no {} fits: {e}", kind.key())).in_file(file).with_help(help)
    })?;
    Ok((fit, cloud.skipped_invalid))
}

/// One line of JSON, numbers with 17 significant digits.
fn json(file: &Path, kind: FitKind, outcome: &FitOutcome, not_finite: usize) -> String {
    let mut text = String::from("{");
    let name = serde_json::Value::from(file.display().to_string());
    let _ = write!(text, "\"file\": {name}, \"kind\": \"{}\", \"points\": {}", kind.key(), outcome.points);
    let point = |text: &mut String, key: &str, p: &Point3| {
        let _ = write!(text, ", \"{key}\": [{}, {}, {}]", digits(p.x), digits(p.y), digits(p.z));
    };
    let direction = |text: &mut String, key: &str, d: &UnitVector3| {
        let _ = write!(text, ", \"{key}\": [{}, {}, {}]", digits(d.x), digits(d.y), digits(d.z));
    };
    let number = |text: &mut String, key: &str, value: f64| {
        let _ = write!(text, ", \"{key}\": {}", digits(value));
    };
    match &outcome.shape {
        Fitted::Line(s) => {
            point(&mut text, "point", &s.point);
            direction(&mut text, "direction", &s.direction);
        }
        Fitted::Plane(s) => {
            point(&mut text, "point", &s.point);
            direction(&mut text, "normal", &s.normal);
        }
        Fitted::Circle(s) => {
            point(&mut text, "centre", &s.centre);
            direction(&mut text, "axis", &s.axis);
            number(&mut text, "diameter", 2.0 * s.radius);
        }
        Fitted::Sphere(s) => {
            point(&mut text, "centre", &s.centre);
            number(&mut text, "diameter", 2.0 * s.radius);
        }
        Fitted::Cylinder(s) => {
            point(&mut text, "point", &s.point);
            direction(&mut text, "axis", &s.axis);
            number(&mut text, "diameter", 2.0 * s.radius);
        }
        Fitted::Cone(s) => {
            point(&mut text, "point", &s.point);
            direction(&mut text, "direction", &s.axis);
            number(&mut text, "diameter", s.diameter());
            number(&mut text, "apex_angle_deg", 2.0 * s.half_angle_rad.to_degrees());
        }
    }
    number(&mut text, "rms", outcome.rms);
    number(&mut text, "sigma", outcome.sigma.unwrap_or(f64::NAN));
    let _ = write!(text, ", \"rejected\": {}, \"not_finite\": {not_finite}", outcome.rejected);
    number(&mut text, "condition", outcome.condition);
    add_uncertainty(&mut text, outcome);
    text.push('}');
    text
}

/// Standard uncertainties, k = 1 as the key says.
fn add_uncertainty(text: &mut String, outcome: &FitOutcome) {
    let Some(u) = &outcome.uncertainty else { return };
    let [x, y, z] = [0, 1, 2].map(|k| digits(u.place[(k, k)].max(0.0).sqrt()));
    let (place, direction) = match outcome.shape {
        Fitted::Line(_) | Fitted::Cone(_) => ("point", "direction"),
        Fitted::Plane(_) => ("point", "normal"),
        Fitted::Circle(_) => ("centre", "axis"),
        Fitted::Sphere(_) => ("centre", ""),
        Fitted::Cylinder(_) => ("point", "axis"),
    };
    let _ = write!(text, ", \"k\": 1, \"{place}_u\": [{x}, {y}, {z}]");
    let numbers = [
        (format!("{direction}_u_deg"), u.direction_rad.map(f64::to_degrees)),
        ("diameter_u".into(), u.diameter),
        ("apex_angle_u_deg".into(), u.apex_angle_rad.map(f64::to_degrees)),
    ];
    for (key, value) in numbers {
        if let Some(value) = value {
            let _ = write!(text, ", \"{key}\": {}", digits(value));
        }
    }
}

/// 17 significant digits, which name an f64 without doubt; `null` for what is no number.
fn digits(value: f64) -> String {
    if value.is_finite() { format!("{value:.16e}") } else { "null".into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_comes_back_from_its_digits() {
        for value in [0.1, -1.0 / 3.0, 1e-300, 123_456_789.123_456_79, 0.0] {
            assert_eq!(digits(value).parse::<f64>().unwrap(), value);
        }
        assert_eq!(digits(f64::INFINITY), "null");
    }

    #[test]
    fn uncertainties_are_told_by_the_names_of_what_they_belong_to() {
        let places = [[0.0, 0.0], [4.0, 0.1], [8.0, -0.1], [3.0, 5.0], [6.0, 6.1]];
        let points: Vec<Point3> = places.iter().map(|p| Point3::new(p[0], p[1], 0.1 * (p[0] * 7.0).sin())).collect();
        let fit = fit_points_knowing(FitKind::Plane, &points, FitMethod::LeastSquares, Known::default()).unwrap();
        let told: serde_json::Value = serde_json::from_str(&json(Path::new("p"), FitKind::Plane, &fit, 0)).unwrap();
        assert_eq!(told["k"], 1);
        assert!(told["point_u"][2].as_f64().unwrap() > 0.0 && told["normal_u_deg"].as_f64().unwrap() > 0.0);
        assert_eq!(told.get("diameter_u"), None);
        assert!(positive("-1").is_err() && positive("inf").is_err() && positive("2.5") == Ok(2.5));
    }

    #[test]
    fn planes_are_read_as_people_type_them() {
        assert_eq!(coordinate_plane("y=-2.5"), Ok(CoordinatePlane { axis: 1, value: -2.5 }));
        for bad in ["w=1", "x", "x=", "x=nan"] {
            assert!(coordinate_plane(bad).is_err(), "{bad}");
        }
    }
}
