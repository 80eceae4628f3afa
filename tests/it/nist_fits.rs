//! Least-squares fits against NIST's reference pairs (data sets with fits computed with 60 digits). The pairs are not part
//! of this project: the folder that holds `nist_fits/` is named by `SHAPELINE_REFERENCE_DATA`; without it there is nothing
//! to compare with, and the test says so.

use shapeline::fit::{CoordinatePlane, FitKind, FitMethod, Fitted, Known, fit_points, fit_points_knowing};
use shapeline::geometry::{Point3, UnitVector3, Vector3};
use std::path::Path;

/// What is asked of every pair: mm and rad.
const LENGTH: f64 = 1e-6;
const ANGLE: f64 = 1e-8;

fn numbers(path: &Path) -> Vec<f64> {
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    text.split_whitespace().map(|w| w.parse().unwrap()).collect()
}

/// Angle between two lines, either way along them, rad.
fn between(a: &UnitVector3, b: &Vector3) -> f64 {
    a.cross(&b.normalize()).norm()
}

/// Distance of a point from a line.
fn off_line(p: &Point3, on: &Point3, direction: &UnitVector3) -> f64 {
    (p - on).cross(direction).norm()
}

/// Largest error in length and in angle of a fit against the reference numbers.
fn errors(fit: &Fitted, reference: &[f64]) -> (f64, f64) {
    let at = Point3::new(reference[0], reference[1], reference[2]);
    let towards = || Vector3::new(reference[3], reference[4], reference[5]);
    match fit {
        Fitted::Line(_) => unreachable!("there are no pairs for lines"),
        Fitted::Plane(plane) => ((at - plane.point).dot(&plane.normal).abs(), between(&plane.normal, &towards())),
        Fitted::Sphere(sphere) => ((at - sphere.centre).norm().max((2.0 * sphere.radius - reference[3]).abs()), 0.0),
        Fitted::Circle(circle) => {
            let length = (at - circle.centre).norm().max((2.0 * circle.radius - reference[6]).abs());
            (length, between(&circle.axis, &towards()))
        }
        Fitted::Cylinder(cylinder) => {
            let off = off_line(&at, &cylinder.point, &cylinder.axis);
            (off.max((2.0 * cylinder.radius - reference[6]).abs()), between(&cylinder.axis, &towards()))
        }
        Fitted::Cone(cone) => {
            assert!(cone.axis.dot(&towards()) > 0.0, "the axis points to the shrinking radius");
            // Orthogonal distance from the reference's point of the axis to our surface.
            let along = (at - cone.point).dot(&cone.axis);
            let distance = cone.distance_at_point + along * cone.half_angle_rad.sin();
            let apex = (2.0 * cone.half_angle_rad - reference[7].to_radians()).abs();
            let length = off_line(&at, &cone.point, &cone.axis).max((distance - reference[6]).abs());
            (length, between(&cone.axis, &towards()).max(apex))
        }
    }
}

#[test]
fn fits_agree_with_the_reference_pairs() {
    let Some(root) = std::env::var_os("SHAPELINE_REFERENCE_DATA") else {
        std::io::Write::write_all(
            &mut std::io::stderr(),
            b"note: SHAPELINE_REFERENCE_DATA is not set, no reference pairs compared\n",
        )
        .unwrap();
        return;
    };
    let mut report = String::new();
    let mut failed = false;
    for (folder, prefix, kind) in [
        ("plane", "pln", FitKind::Plane),
        ("sphere", "sph", FitKind::Sphere),
        ("circle2d", "cir2d", FitKind::Circle),
        ("cylinder", "cyl", FitKind::Cylinder),
        ("cone", "con", FitKind::Cone),
    ] {
        let mut pairs = 0;
        for entry in std::fs::read_dir(Path::new(&root).join("nist_fits").join(folder)).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_none_or(|e| e != "ds") {
                continue;
            }
            pairs += 1;
            let points: Vec<Point3> =
                numbers(&path)[1..].chunks_exact(3).map(|c| Point3::new(c[0], c[1], c[2])).collect();
            let reference = numbers(&path.with_extension("fit"));
            let plane = (kind == FitKind::Circle).then(|| {
                let axis = Vector3::new(reference[3], reference[4], reference[5]).iamax();
                CoordinatePlane { axis, value: points[0][axis] }
            });
            let name = path.file_stem().unwrap().to_string_lossy().into_owned();
            match fit_points(kind, &points, FitMethod::LeastSquares, plane) {
                Ok(fit) => {
                    let (length, angle) = errors(&fit.shape, &reference);
                    let good = length < LENGTH && angle < ANGLE;
                    failed |= !good;
                    let mark = if good { "ok  " } else { "FAIL" };
                    report +=
                        &format!("{mark} {name}: {length:.2e} mm, {angle:.2e} rad, condition {:.1e}\n", fit.condition);
                }
                Err(e) => {
                    failed = true;
                    report += &format!("FAIL {name}: {e}\n");
                }
            }
        }
        assert!(pairs > 0, "no pairs {prefix}*.ds in {folder}");
    }
    assert!(!failed, "\n{report}");
}

/// NIST's laser-scanner spheres of 50 mm nominal radius, told in metres, as cut out by NIST (`tSPH*.xyz`, separated by commas) and raw
/// with what stands around them (`SPH*.xyz`). mm.
fn scanned_sphere(root: &Path, name: &str) -> Vec<Point3> {
    let path = root.join("nist_spheres").join(format!("{name}.xyz"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let row = |line: &str| -> Vec<f64> {
        let words = line.split(|c: char| c == ',' || c.is_whitespace()).filter(|w| !w.is_empty());
        words.map(|w| 1e3 * w.parse::<f64>().unwrap()).collect()
    };
    text.lines().map(row).filter(|r| r.len() >= 3).map(|r| Point3::new(r[0], r[1], r[2])).collect()
}

#[test]
fn scanned_spheres_are_found_among_what_stands_around_them() {
    let Some(root) = std::env::var_os("SHAPELINE_REFERENCE_DATA") else { return };
    let fit = |points: &[Point3], method: FitMethod, radius: Option<f64>| {
        let fit = fit_points_knowing(FitKind::Sphere, points, method, Known { plane: None, radius }).unwrap();
        let Fitted::Sphere(sphere) = fit.shape else { unreachable!() };
        (sphere, fit.rms)
    };
    for k in 101..=106 {
        let cut = scanned_sphere(Path::new(&root), &format!("tSPH{k}"));
        let raw = scanned_sphere(Path::new(&root), &format!("SPH{k}"));
        let (free, rms) = fit(&cut, FitMethod::LeastSquares, None);
        // Radii of the spheres as scanned: 49.82 to 50.13 mm, rms 0.11 to 0.22 mm.
        assert!((49.8..50.15).contains(&free.radius) && (0.1..0.23).contains(&rms), "{k}: {} {rms}", free.radius);
        // A third of the raw points and more belong to something else. The sphere is found where the cut one is, to a quarter of the
        // scatter; of the smallest set, cut to half of what the fit takes for sphere, to the millimetre.
        let (of_cut, _) = fit(&cut, FitMethod::LeastSquares, Some(50.0));
        let (of_raw, _) = fit(&raw, FitMethod::Robust, Some(50.0));
        let apart = (of_cut.centre - of_raw.centre).norm();
        assert!(apart < if k == 102 { 1.0 } else { 0.1 }, "{k}: {apart}");
        assert!(fit(&raw, FitMethod::LeastSquares, None).0.radius > 60.0);
    }
}
