//! `shapeline fit`: a least-squares shape for each file of points, one JSON object a file.

use super::{Exit, diagnostic_of, terminal};
use crate::diagnostic::Diagnostic;
use crate::fit::{CoordinatePlane, FitError, FitKind, FitMethod, FitOutcome, Fitted, fit_points};
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
    /// Tukey's biweight instead of plain least squares.
    #[arg(long, conflicts_with = "three_sigma")]
    robust: bool,
    /// Fit, leave out the points beyond three standard deviations, fit once more.
    #[arg(long)]
    three_sigma: bool,
    /// The plane of a circle: x=VALUE, y=VALUE or z=VALUE.
    #[arg(long, value_name = "x=VALUE", value_parser = coordinate_plane)]
    plane: Option<CoordinatePlane>,
}

/// One of the shapes by its word.
fn fit_kind() -> impl TypedValueParser<Value = FitKind> {
    PossibleValuesParser::new(FitKind::ALL.map(FitKind::key)).map(|word| {
        let named = FitKind::ALL.into_iter().find(|kind| kind.key() == word);
        named.expect("the parser takes no other word")
    })
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
    let method = match (arguments.robust, arguments.three_sigma) {
        (true, _) => FitMethod::Robust,
        (_, true) => FitMethod::ThreeSigma,
        _ => FitMethod::LeastSquares,
    };
    let mut failed = 0;
    for file in &arguments.files {
        match fit_file(file, arguments.kind, method, arguments.plane) {
            Ok(outcome) => terminal::line(json(file, arguments.kind, &outcome)),
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

fn fit_file(
    file: &Path,
    kind: FitKind,
    method: FitMethod,
    plane: Option<CoordinatePlane>,
) -> Result<FitOutcome, Diagnostic> {
    let bytes = io::read_file(file).map_err(diagnostic_of)?;
    // The file's own unit is kept: nothing is compared with a CAD here.
    let cloud = io::read_cloud(&bytes, file, LengthUnit::Mm, &RunContext::silent()).map_err(diagnostic_of)?;
    fit_points(kind, &cloud.positions, method, plane).map_err(|e| {
        let help = match e {
            FitError::OffPlane { .. } => "give the plane in which the points lie, or leave --plane out",
            _ => "give more points, spread over more of the shape; if some of them are outliers, try --robust",
        };
        Diagnostic::error(format!("no {} fits: {e}", kind.key())).in_file(file).with_help(help)
    })
}

/// One line of JSON, numbers with 17 significant digits.
fn json(file: &Path, kind: FitKind, outcome: &FitOutcome) -> String {
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
    number(&mut text, "sigma", outcome.sigma);
    let _ = write!(text, ", \"rejected\": {}", outcome.rejected);
    number(&mut text, "condition", outcome.condition);
    text.push('}');
    text
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
    fn planes_are_read_as_people_type_them() {
        assert_eq!(coordinate_plane("y=-2.5"), Ok(CoordinatePlane { axis: 1, value: -2.5 }));
        for bad in ["w=1", "x", "x=", "x=nan"] {
            assert!(coordinate_plane(bad).is_err(), "{bad}");
        }
    }
}
