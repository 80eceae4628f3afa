//! Shapes with a least-squares solution known by construction: residuals laid on so that they are orthogonal to every
//! derivative of the shape leave its parameters where they are (null-space data).

use super::*;
use nalgebra::{DMatrix, DVector, Isometry3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn motion() -> Isometry3<f64> {
    Isometry3::new(Vector3::new(120.0, -35.0, 410.0), Vector3::new(0.4, -0.9, 0.3))
}

/// Points on a shape, moved along its normals by residuals orthogonal to the columns of the Jacobian given per point.
/// A point moved along its normal keeps its normal, so the gradient stays zero and the shape stays the solution.
fn with_null_space_noise(on_shape: &[(Point3, Vector3, Vec<f64>)], amplitude: f64) -> Vec<Point3> {
    let n = on_shape.len();
    let columns = on_shape[0].2.len();
    let jacobian = DMatrix::from_fn(n, columns, |k, c| on_shape[k].2[c]);
    let raw = DVector::from_fn(n, |k, _| ((k * 7919 % 1000) as f64 / 500.0 - 1.0) * amplitude);
    let q = jacobian.qr().q();
    let residual = &raw - &q * (q.transpose() * &raw);
    on_shape.iter().enumerate().map(|(k, (p, normal, _))| motion() * (p + normal * residual[k])).collect()
}

fn angles(count: usize, from: f64, to: f64) -> impl Iterator<Item = f64> {
    (0..count).map(move |k| from + (to - from) * k as f64 / (count - 1) as f64)
}

fn assert_near(a: f64, b: f64, tolerance: f64, what: &str) {
    assert!((a - b).abs() < tolerance, "{what}: {a} against {b}");
}

// Rounding of f64 at coordinates of 500 is 1e-13; the solve amplifies it by its condition, below 1e3 here, and the parts
// of a shape told over a short arc by some tens more: 1e-9 is far above that and far below any use.
const EXACT: f64 = 1e-9;

#[test]
fn the_cylinder_is_found_from_a_third_of_its_girth() {
    let mut data = Vec::new();
    for phi in angles(40, 0.0, 2.0) {
        for z in angles(15, -20.0, 45.0) {
            let normal = Vector3::new(phi.cos(), phi.sin(), 0.0);
            let row = vec![-phi.cos(), -phi.sin(), -z * phi.cos(), -z * phi.sin(), -1.0];
            data.push((Point3::new(25.0 * phi.cos(), 25.0 * phi.sin(), z), normal, row));
        }
    }
    let fit =
        fit_points(FitKind::Cylinder, &with_null_space_noise(&data, 0.05), FitMethod::LeastSquares, None).unwrap();
    let Fitted::Cylinder(c) = fit.shape else { panic!("a cylinder") };
    assert_near(c.radius, 25.0, EXACT, "radius");
    let axis = motion() * Vector3::z();
    assert!(c.axis.cross(&axis).norm() < EXACT);
    assert!((c.point - motion() * Point3::origin()).cross(&axis).norm() < 1e-8);
}

#[test]
fn the_cone_points_to_its_growing_radius() {
    let (t, half) = (12.0, 0.35f64);
    let (sin, cos) = half.sin_cos();
    let mut data = Vec::new();
    for phi in angles(36, 0.0, 6.1) {
        for z in angles(12, -15.0, 30.0) {
            let rho = (t + z * sin) / cos;
            let normal = Vector3::new(cos * phi.cos(), cos * phi.sin(), -sin);
            let (x, y) = (rho * phi.cos(), rho * phi.sin());
            let row = vec![
                -phi.cos() * cos,
                -phi.sin() * cos,
                -z * phi.cos() * cos - x * sin,
                -z * phi.sin() * cos - y * sin,
                -1.0,
                -rho * sin - z * cos,
            ];
            data.push((Point3::new(x, y, z), normal, row));
        }
    }
    let points = with_null_space_noise(&data, 0.05);
    let fit = fit_points(FitKind::Cone, &points, FitMethod::LeastSquares, None).unwrap();
    let Fitted::Cone(c) = fit.shape else { panic!("a cone") };
    assert_near(c.half_angle_rad, half, EXACT, "half angle");
    let axis = motion() * Vector3::z();
    assert!((c.axis.into_inner() - axis).norm() < EXACT, "sense and direction");
    let height = (c.point - motion() * Point3::origin()).dot(&axis);
    assert_near(c.distance_at_point, t + height * sin, 1e-8, "distance at its point");
}

#[test]
fn sphere_circle_plane_and_line_are_exact() {
    let mut sphere = Vec::new();
    for phi in angles(20, 0.0, 6.0) {
        for theta in angles(10, 0.2, 1.2) {
            let n = Vector3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
            sphere.push((Point3::from(n * 50.0), n, vec![-n.x, -n.y, -n.z, -1.0]));
        }
    }
    let fit = fit_points(FitKind::Sphere, &with_null_space_noise(&sphere, 0.2), FitMethod::LeastSquares, None).unwrap();
    let Fitted::Sphere(s) = fit.shape else { panic!("a sphere") };
    assert_near(s.radius, 50.0, EXACT, "radius");
    assert!((s.centre - motion() * Point3::origin()).norm() < EXACT);

    let mut plane = Vec::new();
    for x in angles(12, -30.0, 40.0) {
        for y in angles(9, -20.0, 10.0) {
            plane.push((Point3::new(x, y, 0.0), Vector3::z(), vec![1.0, x, y]));
        }
    }
    let fit = fit_points(FitKind::Plane, &with_null_space_noise(&plane, 0.2), FitMethod::LeastSquares, None).unwrap();
    let Fitted::Plane(p) = fit.shape else { panic!("a plane") };
    assert!(
        p.normal.cross(&(motion() * Vector3::z())).norm() < 1e-12
            && p.distance(&(motion() * Point3::origin())).abs() < EXACT
    );
}

/// A normal with the derivatives of the distance along it.
type Residual = (Vector3, Vec<f64>);

/// Places with two normals each, moved along both by residuals orthogonal to the derivatives given for each normal.
fn with_two_residuals(on_shape: &[(Point3, [Residual; 2])]) -> Vec<Point3> {
    let rows: Vec<(Point3, Vector3, Vec<f64>)> =
        on_shape.iter().flat_map(|(p, two)| two.iter().map(|(n, row)| (*p, *n, row.clone()))).collect();
    let moved = with_null_space_noise(&rows, 0.05);
    // Each place was moved twice from where it was: both moves together.
    let both = |k: usize| moved[2 * k] + (moved[2 * k + 1] - motion() * on_shape[k].0);
    (0..on_shape.len()).map(both).collect()
}

#[test]
fn circle_and_line_with_residuals_both_ways_are_exact() {
    let circle: Vec<_> = angles(50, 0.0, 4.0)
        .map(|phi| {
            let n = Vector3::new(phi.cos(), phi.sin(), 0.0);
            // Radially: centre and radius; across: height and two tilts.
            let radial = (n, vec![-n.x, -n.y, -1.0, 0.0, 0.0, 0.0]);
            let across = (Vector3::z(), vec![0.0, 0.0, 0.0, -1.0, 8.0 * n.x, 8.0 * n.y]);
            (Point3::from(n * 8.0), [radial, across])
        })
        .collect();
    let fit = fit_points(FitKind::Circle, &with_two_residuals(&circle), FitMethod::LeastSquares, None).unwrap();
    let Fitted::Circle(c) = fit.shape else { panic!("a circle") };
    // A residual across turns the radial one's derivatives by their product over the radius, but neither gradient: both stay zero.
    assert_near(c.radius, 8.0, EXACT, "radius");
    assert!(
        (c.centre - motion() * Point3::origin()).norm() < EXACT
            && c.axis.cross(&(motion() * Vector3::z())).norm() < EXACT
    );

    let line: Vec<_> = angles(30, -5.0, 90.0)
        .map(|s| {
            let one = (Vector3::y(), vec![1.0, s, 0.0, 0.0]);
            (Point3::new(s, 0.0, 0.0), [one, (Vector3::z(), vec![0.0, 0.0, 1.0, s])])
        })
        .collect();
    let fit = fit_points(FitKind::Line, &with_two_residuals(&line), FitMethod::LeastSquares, None).unwrap();
    let Fitted::Line(l) = fit.shape else { panic!("a line") };
    assert!(l.direction.cross(&(motion() * Vector3::x())).norm() < EXACT);
    assert!(l.distance(&(motion() * Point3::origin())) < EXACT && fit.rms > 0.01);
}

#[test]
fn a_circle_in_a_given_plane_with_residuals_is_exact() {
    let flat: Vec<(Point3, Vector3, Vec<f64>)> = angles(40, 0.0, 4.0)
        .map(|phi| {
            let n = Vector3::new(0.0, phi.cos(), phi.sin());
            (Point3::new(3.0, 7.0, -1.0) + n * 8.0, n, vec![n.y, n.z, 1.0])
        })
        .collect();
    let back = motion().inverse();
    let points: Vec<Point3> = with_null_space_noise(&flat, 0.05).iter().map(|p| back * p).collect();
    let plane = Some(CoordinatePlane { axis: 0, value: 3.0 });
    let fit = fit_points(FitKind::Circle, &points, FitMethod::LeastSquares, plane).unwrap();
    let Fitted::Circle(c) = fit.shape else { panic!("a circle") };
    assert!(
        (c.centre - Point3::new(3.0, 7.0, -1.0)).norm() < EXACT && (c.radius - 8.0).abs() < EXACT && fit.rms > 0.01
    );
}

#[test]
fn a_circle_in_a_coordinate_plane_keeps_that_plane() {
    let points: Vec<Point3> =
        angles(20, 0.0, 5.0).map(|phi| Point3::new(3.0, 7.0 + 2.0 * phi.cos(), -1.0 + 2.0 * phi.sin())).collect();
    let plane = Some(CoordinatePlane { axis: 0, value: 3.0 });
    let fit = fit_points(FitKind::Circle, &points, FitMethod::LeastSquares, plane).unwrap();
    let Fitted::Circle(c) = fit.shape else { panic!("a circle") };
    assert!((c.centre - Point3::new(3.0, 7.0, -1.0)).norm() < 1e-12 && (c.radius - 2.0).abs() < 1e-12);
    assert_eq!(c.axis.into_inner(), Vector3::x());
}

/// Sphere points with every tenth one far off.
fn sphere_with_outliers() -> Vec<Point3> {
    let mut points = Vec::new();
    for (k, phi) in angles(400, 0.0, 60.0).enumerate() {
        let theta = 0.1 + 1.3 * k as f64 / 400.0;
        let n = Vector3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
        let noise = 0.01 * ((k * 7919 % 1000) as f64 / 500.0 - 1.0);
        let off = if k % 10 == 3 { 4.0 } else { 0.0 };
        points.push(Point3::from(n * (50.0 + noise + off)));
    }
    points
}

#[test]
fn outliers_are_rejected_by_the_robust_fit() {
    let points = sphere_with_outliers();
    let plain = fit_points(FitKind::Sphere, &points, FitMethod::LeastSquares, None).unwrap();
    let robust = fit_points(FitKind::Sphere, &points, FitMethod::Robust, None).unwrap();
    let radius = |f: &FitOutcome| match f.shape {
        Fitted::Sphere(s) => s.radius,
        _ => f64::NAN,
    };
    assert!((radius(&plain) - 50.0).abs() > 0.1, "the outliers pull the plain fit: {}", radius(&plain));
    // 360 points of rms 0.006 mm over a cap fix the radius to about 0.006 / sqrt(360) times the cap's condition of some ten.
    assert!((radius(&robust) - 50.0).abs() < 0.01, "{}", radius(&robust));
    assert_eq!(robust.rejected, 40);
}

#[test]
fn what_does_not_fix_a_shape_is_refused() {
    let one_place = vec![Point3::new(1.0, 2.0, 3.0); 20];
    let in_line: Vec<Point3> = angles(20, 0.0, 1.0).map(|s| Point3::new(s, 2.0 * s, -s)).collect();
    for kind in [FitKind::Line, FitKind::Plane, FitKind::Circle, FitKind::Sphere, FitKind::Cylinder, FitKind::Cone] {
        assert!(fit_points(kind, &one_place, FitMethod::LeastSquares, None).is_err(), "{kind:?} of one place");
        assert!(fit_points(kind, &[], FitMethod::Robust, None).is_err(), "{kind:?} of nothing");
        let nan = vec![Point3::new(f64::NAN, 0.0, 0.0); 20];
        assert_eq!(
            fit_points(kind, &nan, FitMethod::LeastSquares, None).unwrap_err(),
            FitError::NotFinite { index: 0 }
        );
    }
    for kind in [FitKind::Plane, FitKind::Circle] {
        assert!(fit_points(kind, &in_line, FitMethod::LeastSquares, None).is_err(), "{kind:?} of a line");
    }
}

/// Scatter of -1..1 along each axis, the same for the same k.
fn scatter(k: usize) -> Vector3 {
    let mut rng = ChaCha8Rng::seed_from_u64(k as u64);
    Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0))
}

/// What each shape slides on, of size 20 about the origin.
fn degenerate_sets() -> Vec<(&'static str, Vec<FitKind>, Vec<Point3>)> {
    use FitKind::{Circle, Cone, Cylinder, Plane, Sphere};
    let ring = |z: f64| angles(120, 0.0, 6.2).map(move |a| Point3::new(20.0 * a.cos(), 20.0 * a.sin(), z));
    let disc = (0..200).map(|k| {
        let (r, a) = (20.0 * (k as f64 / 200.0).sqrt(), 2.4 * k as f64);
        Point3::new(r * a.cos(), r * a.sin(), 0.0)
    });
    let spots = (0..120).map(|k| Point3::new(10.0 * (k % 3) as f64, 4.0 * (k % 3) as f64, 0.0));
    vec![
        ("a line", vec![Plane, Circle, Sphere, Cylinder, Cone], {
            angles(120, -20.0, 20.0).map(|s| Point3::new(s, 0.4 * s, -0.2 * s)).collect()
        }),
        ("a few spots on a line", vec![Plane, Circle, Sphere, Cylinder, Cone], spots.collect()),
        ("a disc", vec![Sphere, Cylinder, Cone], disc.collect()),
        ("a ring", vec![Sphere, Cylinder, Cone], ring(3.0).collect()),
    ]
}

#[test]
fn sets_on_which_a_shape_may_slide_are_refused_with_and_without_scatter() {
    for (name, kinds, points) in degenerate_sets() {
        for kind in kinds {
            for scatter_by in [0.0, 1e-6, 0.01, 0.3] {
                let points: Vec<Point3> =
                    points.iter().enumerate().map(|(k, p)| motion() * (p + scatter(k) * scatter_by)).collect();
                for method in [FitMethod::LeastSquares, FitMethod::ThreeSigma, FitMethod::Robust] {
                    let fit = fit_points(kind, &points, method, None);
                    assert!(fit.is_err(), "{kind:?} of {name}, scatter {scatter_by}, {method:?}: {fit:?}");
                }
            }
        }
    }
    let cloud: Vec<Point3> = (0..400).map(|k| Point3::origin() + scatter(k) * 5.0).collect();
    assert!(matches!(fit_points(FitKind::Line, &cloud, FitMethod::LeastSquares, None), Err(FitError::NotFixed { .. })));
}

#[test]
fn weakly_but_truly_fixed_shapes_are_fitted() {
    // A cap of 12 degrees: its rise is 1.1 mm, its scatter 0.05 mm; the ratio of the sums of squares is about 50.
    let cap: Vec<Point3> = (0..400)
        .map(|k| {
            let (tilt, turn) = (0.21 * (k as f64 / 400.0).sqrt(), 2.4 * k as f64);
            let n = Vector3::new(tilt.sin() * turn.cos(), tilt.sin() * turn.sin(), tilt.cos());
            motion() * (Point3::from(n * 50.0) + scatter(k) * 0.05)
        })
        .collect();
    let Fitted::Sphere(sphere) = fit_points(FitKind::Sphere, &cap, FitMethod::LeastSquares, None).unwrap().shape else {
        panic!("a sphere")
    };
    // The radius is uncertain by about scatter / rise * radius / sqrt(n) * 3 = 0.2 mm.
    assert!((sphere.radius - 50.0).abs() < 1.0, "{}", sphere.radius);
    // Three points, and no freedom left, are enough for a circle; four for a sphere.
    let corners = [[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 5.0]].map(Point3::from);
    let Fitted::Circle(circle) =
        fit_points(FitKind::Circle, &corners[..3], FitMethod::LeastSquares, None).unwrap().shape
    else {
        panic!("a circle")
    };
    assert_near(circle.radius, 2.5, 1e-12, "circumscribed circle of the triangle 3, 4, 5");
    let sphere = fit_points(FitKind::Sphere, &corners, FitMethod::LeastSquares, None).unwrap();
    assert!(sphere.rms < 1e-12 && sphere.uncertainty.is_none());
}

#[test]
fn a_circle_off_its_plane_is_refused() {
    let circle = |x: f64| -> Vec<Point3> {
        angles(60, 0.0, 5.0).map(|a| Point3::new(x, 7.0 + 8.0 * a.cos(), -1.0 + 8.0 * a.sin())).collect()
    };
    let fit = |points: &[Point3], axis: usize, value: f64| {
        fit_points(FitKind::Circle, points, FitMethod::LeastSquares, Some(CoordinatePlane { axis, value }))
    };
    assert!(fit(&circle(3.0), 0, 3.0).is_ok());
    let Err(FitError::OffPlane { off, mean_value }) = fit(&circle(3.0), 0, 2.0) else { panic!("1 off its plane") };
    assert!((off - 1.0).abs() < 1e-12 && (mean_value - 3.0).abs() < 1e-12);
    // Seen edge-on it is a line.
    for (axis, value) in [(1, 7.0), (2, -1.0)] {
        assert!(fit(&circle(3.0), axis, value).is_err(), "edge-on, axis {axis}");
    }
    // A band of a cylinder about the plane is what a slice of a scan looks like.
    let band: Vec<Point3> = circle(3.0).iter().enumerate().map(|(k, p)| p + Vector3::x() * scatter(k).x).collect();
    assert!(fit(&band, 0, 3.0).is_ok());
    let wide: Vec<Point3> =
        circle(3.0).iter().enumerate().map(|(k, p)| p + Vector3::x() * (6.0 * scatter(k).x)).collect();
    assert!(matches!(fit(&wide, 0, 3.0), Err(FitError::OffPlane { .. })));
}

/// A cylinder of radius 1 along z: `count` exact points of a helix that runs through an arc of `degrees` so many times.
fn helix(count: usize, length: f64, degrees: f64, times: f64) -> Vec<Point3> {
    let arc = degrees.to_radians();
    (0..count)
        .map(|k| {
            let share = k as f64 / (count - 1) as f64;
            let through = times * share;
            let phi = arc * if times > 1.0 { through.fract() } else { through };
            motion() * Point3::new(phi.cos(), phi.sin(), length * share)
        })
        .collect()
}

#[test]
fn long_thin_cylinders_are_found_from_full_half_and_quarter_girths() {
    let axis = motion() * Vector3::z();
    for length in [3.0, 10.0, 30.0, 100.0] {
        // Single windings, of three quarters and half a turn too, draw the principal axis far aside.
        let arcs = [(360.0, 5.0), (180.0, 5.0), (90.0, 5.0), (360.0, 1.0), (270.0, 1.0), (180.0, 1.0), (540.0, 1.0)];
        for (degrees, times) in arcs {
            for count in [30, 200, 1000] {
                let points = helix(count, length, degrees, times);
                for radius in [None, Some(1.0)] {
                    let known = Known { plane: None, radius };
                    let what =
                        format!("length {length}, {times} x {degrees} degrees, {count} points, radius {radius:?}");
                    let fit = fit_points_knowing(FitKind::Cylinder, &points, FitMethod::LeastSquares, known);
                    let fit = fit.unwrap_or_else(|e| panic!("{what}: {e}"));
                    let Fitted::Cylinder(c) = fit.shape else { panic!("a cylinder") };
                    // A single winding over a hundred radii fixes the radius some hundred times less well than many.
                    let exact = if times > 1.0 { EXACT } else { 1e-6 };
                    assert_near(c.radius, 1.0, exact, &what);
                    assert!(c.axis.cross(&axis).norm() < exact, "{what}");
                }
            }
        }
    }
}

#[test]
fn points_in_rings_do_not_lead_the_start_astray() {
    // 40 points a ring: every 40th point, or every 10th, lies on a few lines along the cylinder.
    let rings: Vec<Point3> = (0..16_000)
        .map(|k| {
            let (phi, z) = ((k % 40) as f64 * 0.02, (k / 40) as f64 * 0.1);
            motion() * Point3::new(8.0 * phi.cos(), 8.0 * phi.sin(), z)
        })
        .collect();
    let fit = fit_points(FitKind::Cylinder, &rings, FitMethod::LeastSquares, None).unwrap();
    let Fitted::Cylinder(c) = fit.shape else { panic!("a cylinder") };
    assert_near(c.radius, 8.0, EXACT, "radius");
}

#[test]
fn a_refusal_names_what_the_points_are() {
    let ball: Vec<Point3> = (0..300).map(|k| Point3::from(scatter(k).normalize() * 25.0)).collect();
    let said = |kind, points: &[Point3], radius| {
        let known = Known { plane: None, radius };
        fit_points_knowing(kind, points, FitMethod::LeastSquares, known).unwrap_err().to_string()
    };
    assert!(said(FitKind::Plane, &ball, None).contains("lie in no plane"));
    let line: Vec<Point3> = (0..300).map(|k| Point3::new(k as f64, 0.0, 0.0) + scatter(k) * 0.1).collect();
    assert!(said(FitKind::Plane, &line, None).contains("in line"));
    let tube = helix(300, 20.0, 360.0, 5.0);
    assert!(said(FitKind::Cone, &tube, None).contains("a cylinder explains them as well"));
    let scattered: Vec<Point3> = tube.iter().enumerate().map(|(k, p)| p + scatter(k) * 0.01).collect();
    assert!(said(FitKind::Cone, &scattered, None).contains("a cylinder explains them as well"));
    let cube: Vec<Point3> = (0..600).map(|k| Point3::origin() + scatter(k) * 5.0).collect();
    assert!(said(FitKind::Sphere, &cube, None).contains("by more than its radius"));
    let square: Vec<Point3> = cube.iter().map(|p| Point3::new(p.x, p.y, 0.0)).collect();
    assert!(said(FitKind::Circle, &square, None).contains("by more than its radius"));
    let arc = helix(300, 20.0, 90.0, 5.0);
    assert!(said(FitKind::Cylinder, &arc, Some(50.0)).contains("of the radius given"));
}

#[test]
fn sigma_is_not_told_where_no_freedom_is_left() {
    let corners = [[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 4.0, 0.0]].map(Point3::from);
    let plane = fit_points(FitKind::Plane, &corners, FitMethod::LeastSquares, None).unwrap();
    assert!(plane.sigma.is_none() && plane.uncertainty.is_none());
}
