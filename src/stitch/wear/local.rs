//! The difference of two clouds around one place.

use super::WearError;
use crate::geometry::{Point3, Vector3, decompose};
use crate::run::RunContext;
use crate::stitch::cells::{Around, Cells, TooManyCells};
use nalgebra::Matrix3;
use rayon::prelude::*;

/// Fewer points of a cloud tell no height.
const LEAST_POINTS: usize = 10;
/// The middle of a cloud's points lies no further from the place than this share of the radius: else the place is at the cloud's rim.
const OFF_MIDDLE: f64 = 0.5;
/// Points are looked for along the normal up to so many radii: wear that is deeper has no counterpart.
pub(super) const REACH: f64 = 1.5;
/// Points that reach so much less far one way than the other (in squares) lay no plane.
const STRIP: f64 = 0.05;
/// Cells that one task walks.
const CHUNK: usize = 256;

/// How the clouds differ at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Local {
    /// New less old along the normal.
    pub difference: f64,
    /// Its standard uncertainty by the noise of both.
    pub u: f64,
    /// Unit normal of the old cloud, towards the sensor.
    pub normal: Vector3,
    /// New points in the cylinder.
    pub new_points: usize,
    /// The worse mean badness of the two clouds; no number where it is not known.
    pub badness: f64,
}

/// Both clouds in one set of cells, the new one first.
pub(super) struct Pair {
    cells: Cells,
    new: usize,
    radius: f64,
    /// In the order of the cells; empty where it is not known.
    badness: Vec<f32>,
}

/// Heights over the old cloud's plane at places across the normal.
type Heights = Vec<[f64; 3]>;

/// Differences by the index of the place that was asked for.
type Indexed = Vec<(u32, Option<Local>)>;

impl Pair {
    /// `badness` is that of the new points, then of the old ones, or nothing.
    pub(super) fn new(new: &[Point3], old: &[Point3], badness: &[f32], radius: f64) -> Result<Self, TooManyCells> {
        let both: Vec<Point3> = new.iter().chain(old).copied().collect();
        let cells = Cells::new(&both, REACH * radius)?;
        let badness = match badness.len() == both.len() {
            true => cells.order.iter().map(|k| badness[*k as usize]).collect(),
            false => Vec::new(),
        };
        Ok(Self { cells, new: new.len(), radius, badness })
    }

    /// Differences at some of the new points (by index, rising), in their order.
    pub(super) fn differences(
        &self,
        at: &[u32],
        toward: &(dyn Fn(usize) -> Point3 + Sync),
        run: &RunContext,
    ) -> Result<Vec<Option<Local>>, WearError> {
        let mut place = vec![u32::MAX; self.new];
        at.iter().enumerate().for_each(|(k, i)| place[*i as usize] = k as u32);
        let walked: Vec<(usize, Around)> = self.cells.walk(0).collect();
        let found: Result<Vec<Indexed>, WearError> = walked
            .par_chunks(CHUNK)
            .map(|some| {
                run.check()?;
                let mut found = Vec::new();
                for (cell, around) in some {
                    for k in self.cells.points(*cell) {
                        let index = self.cells.order[k] as usize;
                        if index < self.new && place[index] != u32::MAX {
                            found.push((place[index], self.difference(k, around, &toward(index))));
                        }
                    }
                }
                Ok(found)
            })
            .collect();
        let mut differences = vec![None; at.len()];
        found?.into_iter().flatten().for_each(|(k, local)| differences[k as usize] = local);
        Ok(differences)
    }

    fn difference(&self, k: usize, around: &Around, sensor: &Point3) -> Option<Local> {
        let at = self.cells.positions[k];
        let reach = REACH * self.radius;
        let (mut new, mut old) = (Vec::new(), Vec::new());
        let mut badness = [[0.0; 2]; 2];
        for j in around.points() {
            let off = self.cells.positions[j] - at;
            if off.norm_squared() <= reach * reach {
                let is_old = (self.cells.order[j] as usize) >= self.new;
                if is_old {
                    old.push(off)
                } else {
                    new.push(off)
                }
                let sum = &mut badness[usize::from(is_old)];
                *sum = [sum[0] + self.badness.get(j).map_or(f64::NAN, |b| f64::from(*b)), sum[1] + 1.0];
            }
        }
        let badness = badness.map(|[sum, count]| sum / count);
        let normal = normal_of(&old, &(sensor - at), self.radius)?;
        let [u, v] = across(&normal);
        let cut = |cloud: &[Vector3]| -> Heights {
            let in_axes = cloud.iter().map(|d| [d.dot(&u), d.dot(&v), d.dot(&normal)]);
            in_axes.filter(|[x, y, _]| x * x + y * y <= self.radius * self.radius).collect()
        };
        let (new, old) = (height(&cut(&new), self.radius)?, height(&cut(&old), self.radius)?);
        Some(Local {
            difference: new.0 - old.0,
            u: new.1.hypot(old.1),
            normal,
            new_points: new.2,
            badness: badness[0].max(badness[1]),
        })
    }

    /// Old points that have no new one within the reach.
    pub(super) fn old_alone(&self) -> usize {
        let reach = self.radius * self.radius;
        let walked: Vec<(usize, Around)> = self.cells.walk(0).collect();
        let alone = |(cell, around): &(usize, Around)| {
            let old = self.cells.points(*cell).filter(|k| self.cells.order[*k] as usize >= self.new);
            old.filter(|k| {
                let is_new_near = |j: usize| {
                    (self.cells.order[j] as usize) < self.new
                        && (self.cells.positions[j] - self.cells.positions[*k]).norm_squared() <= reach
                };
                !around.points().any(is_new_near)
            })
            .count()
        };
        walked.par_iter().map(alone).sum()
    }
}

/// Normal of the plane through points, towards the sensor; none of a strip, or of points that lie aside.
fn normal_of(points: &[Vector3], sensor: &Vector3, radius: f64) -> Option<Vector3> {
    let mean = points.iter().sum::<Vector3>() / points.len().max(1) as f64;
    if points.len() < LEAST_POINTS || mean.norm() > radius {
        return None;
    }
    let spread: Matrix3<f64> = points.iter().map(|d| (d - mean) * (d - mean).transpose()).sum();
    let size = spread.trace();
    let eigen = decompose::symmetric_eigen(spread / size)?;
    let normal: Vector3 = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    let middle = eigen.eigenvalues.sum() - eigen.eigenvalues.max() - eigen.eigenvalues.min();
    (middle > STRIP * eigen.eigenvalues.max()).then_some(())?;
    Some(if normal.dot(sensor) < 0.0 { -normal } else { normal })
}

/// Two directions across a normal.
fn across(normal: &Vector3) -> [Vector3; 2] {
    let least = normal.iamin();
    let u = Vector3::from_fn(|k, _| if k == least { 1.0 } else { 0.0 }).cross(normal).normalize();
    [u, normal.cross(&u)]
}

/// Height on the axis of the plane through heights, its standard uncertainty, and how many there are; what stands off by three standard
/// deviations is left out once.
fn height(points: &Heights, radius: f64) -> Option<(f64, f64, usize)> {
    let first = plane(points, radius)?;
    let off = |[x, y, z]: &[f64; 3]| z - first.at[0] - first.at[1] * x - first.at[2] * y;
    let kept: Heights = points.iter().filter(|p| off(p).abs() <= 3.0 * first.sigma).copied().collect();
    let second = plane(&kept, radius)?;
    // Leaving out shrinks a normal scatter to 0.9866 of itself.
    Some((second.at[0], second.u / 0.9866, points.len()))
}

struct HeightPlane {
    /// Height on the axis and slopes.
    at: Vector3,
    /// Scatter about it.
    sigma: f64,
    /// Standard uncertainty of the height on the axis.
    u: f64,
}

fn plane(points: &Heights, radius: f64) -> Option<HeightPlane> {
    let count = points.len() as f64;
    let middle = points.iter().fold([0.0, 0.0], |m, [x, y, _]| [m[0] + x / count, m[1] + y / count]);
    if points.len() < LEAST_POINTS || middle[0].hypot(middle[1]) > OFF_MIDDLE * radius {
        return None;
    }
    let row = |[x, y, _]: &[f64; 3]| Vector3::new(1.0, x / radius, y / radius);
    let normal: Matrix3<f64> = points.iter().map(|p| row(p) * row(p).transpose()).sum();
    let right: Vector3 = points.iter().map(|p| row(p) * p[2]).sum();
    let inverse = normal.try_inverse().filter(|m| m.iter().all(|v| v.is_finite()))?;
    let solved = inverse * right;
    let squares: f64 = points.iter().map(|p| (p[2] - row(p).dot(&solved)).powi(2)).sum();
    let sigma = (squares / (count - 3.0)).sqrt();
    let at = Vector3::new(solved.x, solved.y / radius, solved.z / radius);
    Some(HeightPlane { at, sigma, u: sigma * inverse[(0, 0)].max(0.0).sqrt() })
}
