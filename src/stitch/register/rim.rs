//! Rims: where the surface that a view saw ends, though the sensor looked further.
//!
//! A sheet that is flat holds another one nowhere along itself; the rims of its holes and its trimmed edges do. Around a point beside which the
//! surface ends, the points furthest out, strip by strip, make a parabola; its top is a rim's place, and the way out across it in the tangent
//! plane its direction. The ends of the sensor's own field of view are no rims: [`Field`] tells them apart.

use super::surface::{Around, near_points};
use crate::geometry::{Point3, Vector3, decompose};
use crate::stitch::cells::Cells;
use nalgebra::{Matrix3, Vector3 as Parabola};
use std::collections::{BTreeMap, BTreeSet};

/// A rim lies this far beside a point that tells of it, in the radius looked at.
const MOST_BESIDE: f64 = 0.7;
/// Strips reach this far to both sides, in the radius.
const STRIPS_REACH: f64 = 0.7;
/// Width of a strip in d_grid: hardly any is empty.
const STRIP_GRID: f64 = 1.3;
/// Fewer strips make no parabola.
const LEAST_STRIPS: usize = 5;
/// Beyond a rim nothing lies for so many d_grid.
const FREE_GRID: f64 = 1.7;
/// Tops of strips scatter by no more than this about the parabola, in d_grid: evenly spread over one they make 0.29.
const MOST_SCATTER_GRID: f64 = 0.6;
/// Steepest parabola, as a slope against the direction that the missing half has.
const MOST_SLOPE: f64 = 0.7;
/// Fewer points tell nothing.
const LEAST_POINTS: usize = 10;
/// The middle of the points lies off by this part of the radius where a rim is near.
const LEAST_OFF_MIDDLE: f64 = 0.12;
/// A line of sight is one of the field when this share of the most views that see something along any one sees something along it; one more may look
/// through a hole there.
const FIELD_SHARE: f64 = 0.7;
/// And at least so many: where two or three views end tells nothing of their sensor.
const LEAST_FIELD: f64 = 4.0;
/// What lies so far beyond a rim must be in the field, in cells.
const BEYOND_CELLS: f64 = 1.5;

/// A place on the rim of a surface, view frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rim {
    pub centre: Point3,
    /// Unit vector in the tangent plane, away from the surface.
    pub outward: Vector3,
    /// Unit normal of the surface, towards the sensor.
    pub upright: Vector3,
}

/// The rim near a point, if the surface ends within the radius.
pub(super) fn rim_at(cells: &Cells, k: usize, around: &Around, radius: f64, grid: f64, sensor: &Point3) -> Option<Rim> {
    let at = cells.positions[k];
    let near = near_points(cells, k, around, radius);
    if near.len() < LEAST_POINTS {
        return None;
    }
    let mean = near.iter().sum::<Vector3>() / near.len() as f64;
    if mean.norm() < LEAST_OFF_MIDDLE * radius {
        return None;
    }
    let spread: Matrix3<f64> = near.iter().map(|d| (d - mean) * (d - mean).transpose()).sum();
    let eigen = decompose::symmetric_eigen(spread / (radius * radius))?;
    let axis: Vector3 = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    let upright = if axis.dot(&(sensor - at)) < 0.0 { -axis } else { axis };
    let outward = -(mean - upright * mean.dot(&upright)).try_normalize(1e-9 * radius)?;
    let across = upright.cross(&outward);
    let flat: Vec<[f64; 2]> = near.iter().map(|d| [d.dot(&outward), d.dot(&across)]).collect();
    let [top, slope] = parabola(&flat, radius, grid)?;
    let outward = (outward - across * slope).normalize();
    let height = upright.dot(&mean);
    Some(Rim { centre: at + upright * height + flat_place(&outward, top, slope), outward, upright })
}

/// The place on the rim next to the point, which need not lie straight out of it.
fn flat_place(outward: &Vector3, top: f64, slope: f64) -> Vector3 {
    outward * (top / (1.0 + slope * slope).sqrt())
}

/// How far out the rim lies beside the origin, and its slope there; `None` where the points go on beyond the radius, or end raggedly.
fn parabola(flat: &[[f64; 2]], radius: f64, grid: f64) -> Option<[f64; 2]> {
    let width = STRIP_GRID * grid;
    let half = (STRIPS_REACH * radius / width).floor();
    let count = 2 * half as usize + 1;
    let mut tops: Vec<Option<[f64; 2]>> = vec![None; count];
    for [x, y] in flat {
        let strip = (y / width + half + 0.5).floor();
        if strip >= 0.0 && (strip as usize) < count {
            let top = &mut tops[strip as usize];
            if top.is_none_or(|[best, _]| *x > best) {
                *top = Some([*x, *y]);
            }
        }
    }
    let free = |[x, y]: [f64; 2]| x + FREE_GRID * grid < (radius * radius - y * y).max(0.0).sqrt();
    let ends: Vec<[f64; 2]> = tops.into_iter().flatten().collect();
    if ends.len() < LEAST_STRIPS.max(count - 1) || !ends.iter().all(|end| free(*end)) {
        return None;
    }
    let row = |y: f64| Parabola::new(1.0, y / radius, (y / radius).powi(2));
    let (mut matrix, mut right) = (Matrix3::zeros(), Parabola::zeros());
    for [x, y] in &ends {
        matrix += row(*y) * row(*y).transpose();
        right += row(*y) * *x;
    }
    let shape = matrix.cholesky()?.solve(&right);
    let squares: f64 = ends.iter().map(|[x, y]| (x - row(*y).dot(&shape)).powi(2)).sum();
    let scatter = (squares / (ends.len() as f64 - 3.0).max(1.0)).sqrt();
    let slope = shape[1] / radius;
    let is_rim =
        scatter < MOST_SCATTER_GRID * grid && slope.abs() < MOST_SLOPE && shape[0].abs() < MOST_BESIDE * radius;
    is_rim.then_some([shape[0], slope])
}

/// Where the sensor sees something at all: cells of its own frame that some view had a surface in, and columns along its lines of sight, each
/// with how many views had a surface there.
pub(super) struct Field {
    side: f64,
    cells: BTreeSet<[i64; 3]>,
    columns: BTreeMap<[i64; 3], u32>,
    /// Width of a column at a distance of one.
    width: f64,
    /// So many views make a column one of the field.
    least: u32,
}

impl Field {
    /// Of where each view's sensor stood, with the places of its surface; cells of a side.
    pub(super) fn new(side: f64, views: &[(Point3, Vec<Point3>)]) -> Self {
        let (mut cells, mut columns) = (BTreeSet::new(), BTreeMap::new());
        let seen = || views.iter().flat_map(|(sensor, places)| places.iter().map(move |p| p - sensor));
        let distance = seen().map(|v| v.norm()).sum::<f64>() / seen().count().max(1) as f64;
        let width = side / distance;
        for (sensor, places) in views {
            cells.extend(places.iter().map(|p| cell(&(p - sensor), side)));
            let own: BTreeSet<[i64; 3]> = places.iter().filter_map(|p| column(&(p - sensor), width)).collect();
            own.into_iter().for_each(|c| *columns.entry(c).or_default() += 1);
        }
        let most = columns.values().copied().max().unwrap_or(0);
        let least = (FIELD_SHARE * f64::from(most) - 1.0).ceil().max(LEAST_FIELD) as u32;
        Self { side, cells, columns, width, least }
    }

    /// Whether views had surfaces where nothing is beyond a rim: what ends there is the sheet.
    pub(super) fn sees_beyond(&self, rim: &Rim, sensor: &Point3) -> bool {
        let beyond = rim.centre + rim.outward * (BEYOND_CELLS * self.side) - sensor;
        let views = column(&beyond, self.width).and_then(|c| self.columns.get(&c));
        views.is_some_and(|views| *views >= self.least) && self.cells.contains(&cell(&beyond, self.side))
    }
}

fn cell(from_sensor: &Vector3, side: f64) -> [i64; 3] {
    [from_sensor.x, from_sensor.y, from_sensor.z].map(|c| (c / side).floor() as i64)
}

/// The column of a place: its line of sight.
fn column(from_sensor: &Vector3, width: f64) -> Option<[i64; 3]> {
    from_sensor.try_normalize(0.0).map(|along| cell(&along, width))
}
