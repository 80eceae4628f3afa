//! Quality by the cloud around a point (endoscope paper, section 4.3): how far its normal stands off the mean normal around.

use super::cells::{Around, Cells, TooManyCells};
use crate::geometry::{Point3, Vector3, decompose};
use nalgebra::Matrix3;
use rayon::prelude::*;

/// Radii in d_grid: of the points through which a normal is laid (about 20), and of those whose normals are averaged (about 113; the
/// paper has 61 to 241).
pub const NORMAL_RADIUS_GRID: f64 = 2.5;
/// See [`NORMAL_RADIUS_GRID`].
pub const MEAN_RADIUS_GRID: f64 = 6.0;
/// Fewer points lay no plane that means anything.
const LEAST_POINTS: usize = 6;

/// How far each point's normal stands off the mean of those around.
#[derive(Debug, Clone, PartialEq)]
pub struct NonUniformity {
    /// Equation (4): length of the difference of normal and mean normal; no number where there are too few points for a normal.
    pub delta_n: Vec<f32>,
    /// Angle between the two, rad.
    pub angle_rad: Vec<f32>,
    /// Unit normals towards the sensor; zero where there are too few points.
    pub normals: Vec<Vector3>,
}

/// Of points seen from `sensor`, with two radii in their unit.
///
/// # Errors
/// Points that reach over more than two million radii.
pub fn non_uniformity(
    positions: &[Point3],
    sensor: &Point3,
    normal_radius: f64,
    mean_radius: f64,
) -> Result<NonUniformity, TooManyCells> {
    let cells = Cells::new(positions, normal_radius)?;
    let mut normals = vec![Vector3::zeros(); positions.len()];
    for (k, normal) in
        of_each(&cells, |k, around| normal_at(&cells, k, around, normal_radius, sensor).unwrap_or_else(Vector3::zeros))
    {
        normals[k] = normal;
    }
    let cells = Cells::new(positions, mean_radius)?;
    let (mut delta_n, mut angle_rad) = (vec![f32::NAN; positions.len()], vec![f32::NAN; positions.len()]);
    let off = of_each(&cells, |k, around| {
        let at = cells.positions[k];
        let near = around.points().filter(|j| (cells.positions[*j] - at).norm_squared() <= mean_radius * mean_radius);
        off_the_mean(&normals[cells.order[k] as usize], near.map(|j| normals[cells.order[j] as usize]))
    });
    for (k, [delta, angle]) in off {
        (delta_n[k], angle_rad[k]) = (delta, angle);
    }
    Ok(NonUniformity { delta_n, angle_rad, normals })
}

/// How far a normal stands off the mean of those around, as a length and as an angle in rad; zero vectors are none.
pub(super) fn off_the_mean(normal: &Vector3, around: impl Iterator<Item = Vector3>) -> [f32; 2] {
    let known = around.filter(|n| *n != Vector3::zeros());
    let (sum, count) = known.fold((Vector3::zeros(), 0.0), |(sum, count), n| (sum + n, count + 1.0));
    if *normal == Vector3::zeros() || sum == Vector3::zeros() {
        return [f32::NAN; 2];
    }
    let mean = sum / count;
    [(normal - mean).norm() as f32, normal.angle(&mean) as f32]
}

/// Something of every point, each with its index among those given.
fn of_each<T: Send>(cells: &Cells, what: impl Fn(usize, &Around) -> T + Sync) -> Vec<(usize, T)> {
    let walked: Vec<(usize, Around)> = cells.walk(0).collect();
    let of_cell = |(cell, around): (usize, Around)| {
        let of_point = |k: usize| (cells.order[k] as usize, what(k, &around));
        cells.points(cell).map(of_point).collect::<Vec<_>>()
    };
    walked.into_par_iter().flat_map_iter(of_cell).collect()
}

/// Normal of the plane of least squares through the points within a radius.
fn normal_at(cells: &Cells, k: usize, around: &Around, radius: f64, sensor: &Point3) -> Option<Vector3> {
    let at = cells.positions[k];
    let near: Vec<Vector3> =
        around.points().map(|j| cells.positions[j] - at).filter(|d| d.norm_squared() <= radius * radius).collect();
    plane_normal(&near, radius, &(sensor - at))
}

/// Normal of the plane of least squares through places that stand off a point within a radius, towards the sensor. `None` for too few.
pub(super) fn plane_normal(near: &[Vector3], radius: f64, to_sensor: &Vector3) -> Option<Vector3> {
    if near.len() < LEAST_POINTS {
        return None;
    }
    let mean = near.iter().sum::<Vector3>() / near.len() as f64;
    let spread: Matrix3<f64> = near.iter().map(|d| (d - mean) * (d - mean).transpose()).sum();
    let eigen = decompose::symmetric_eigen(spread / (radius * radius))?;
    let normal: Vector3 = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    Some(if normal.dot(to_sensor) < 0.0 { -normal } else { normal })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// A sheet of pitch 1 with noise that grows along x, and a lone point beside it.
    fn sheet(noise: f64) -> Vec<Point3> {
        let mut rng = ChaCha8Rng::seed_from_u64(21);
        let mut at = |x: f64, y: f64| Point3::new(x, y, noise * (x / 60.0) * (rng.random::<f64>() - 0.5));
        let mut points: Vec<Point3> =
            (0..60).flat_map(|k| (0..40).map(move |l| (k, l))).map(|(k, l)| at(f64::from(k), f64::from(l))).collect();
        points.push(Point3::new(30.0, 200.0, 0.0));
        points
    }

    #[test]
    fn flat_sheets_are_uniform_and_noise_is_not() {
        let points = sheet(0.0);
        let found =
            non_uniformity(&points, &Point3::new(0.0, 0.0, 500.0), NORMAL_RADIUS_GRID, MEAN_RADIUS_GRID).unwrap();
        assert!(found.delta_n[..2400].iter().all(|d| *d < 1e-6) && found.normals[7].z > 0.999_999);
        assert!(found.delta_n[2400].is_nan() && found.angle_rad[2400].is_nan());
        let noisy = non_uniformity(&sheet(0.5), &Point3::new(0.0, 0.0, -500.0), 2.5, 6.0).unwrap();
        assert!(noisy.normals[7].z < 0.0, "towards the sensor");
        let mean = |from: usize, to: usize| noisy.delta_n[from..to].iter().sum::<f32>() / (to - from) as f32;
        // The noise grows from nothing to its full width over the sheet.
        assert!(mean(1600, 2400) > 3.0 * mean(0, 800), "{} {}", mean(1600, 2400), mean(0, 800));
        // Of small angles the length of the difference is the angle.
        let alike = noisy.delta_n.iter().zip(&noisy.angle_rad).take(2400).all(|(d, a)| (d - a).abs() < 0.05 * a + 0.01);
        assert!(alike);
    }
}
