//! The difference of two clouds around one place.

use super::WearError;
use crate::geometry::{Point3, Vector3, decompose};
use crate::run::RunContext;
use crate::stitch::cells::{Around, Cells, TooManyCells};
use nalgebra::{Matrix3, Vector2};
use rayon::prelude::*;

/// Fewer points of a cloud tell no height.
const LEAST_POINTS: usize = 10;
/// The middle of a cloud's points lies no further from the place than this share of the radius: else the place is at the cloud's rim.
const OFF_MIDDLE: f64 = 0.5;
/// Points are looked for along the normal up to so many radii: wear that is deeper has no counterpart.
pub(super) const REACH: f64 = 1.5;
/// Points that reach so much less far one way than the other (in squares) lay no plane.
const STRIP: f64 = 0.05;
/// A slope and a scatter that noise does not make, in standard deviations.
const SURE: [f64; 2] = [2.0, 3.0];
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
    /// Area of the surface that the new point stands for.
    pub area: f64,
    /// The worse mean badness of the two clouds; no number where it is not known.
    pub badness: f64,
    /// Scatter of single points about the planes, of the new cloud and of the old one.
    pub scatter: [f64; 2],
    /// The difference over the radius that tells it best.
    pub sharp: Sharp,
    /// The difference over the least radius that holds enough points, where the largest one is blurred.
    pub finest: Sharp,
}

/// A difference over the radius at which noise and blur together are least.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sharp {
    /// New less old along the normal.
    pub difference: f64,
    /// Its standard uncertainty by the noise of both.
    pub u: f64,
    /// How far the difference itself goes up and down within the radius, as a standard deviation: what is there may be off the mean by that.
    pub blur: f64,
    /// The radius.
    pub radius: f64,
}

/// Smaller radii to choose from.
#[derive(Debug, Clone, Copy)]
pub(super) struct Finer {
    /// Falling.
    pub radii: [f64; 2],
    /// New variance of single points less old one where nothing is worn: the clouds may be of different noise.
    pub excess: f64,
}

/// Both clouds in one set of cells, the new one first.
pub(super) struct Pair {
    cells: Cells,
    new: usize,
    radius: f64,
    /// In the order of the cells; empty where it is not known.
    badness: Vec<f32>,
    /// What else than the radius itself a difference may be told over.
    finer: Option<Finer>,
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
        Ok(Self { cells, new: new.len(), radius, badness, finer: None })
    }

    /// Differences are told over the best of several radii.
    pub(super) fn sharpened(self, finer: Finer) -> Self {
        Self { finer: Some(finer), ..self }
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
        let in_axes = |cloud: &[Vector3]| -> Heights {
            let heights = cloud.iter().map(|d| [d.dot(&u), d.dot(&v), d.dot(&normal)]);
            heights.filter(|[x, y, _]| x * x + y * y <= self.radius * self.radius).collect()
        };
        let (mut new, mut old) = (in_axes(&new), in_axes(&old));
        flatten(&mut new, &mut old, self.radius)?;
        let whole = Cut::new(&new, &old, self.radius)?;
        let [sharp, finest] = match &self.finer {
            None => [whole.sharp(0.0, SURE); 2],
            Some(finer) => sharpest(&whole, &new, &old, finer),
        };
        Some(Local {
            difference: whole.difference,
            u: whole.u,
            normal,
            new_points: new.len(),
            area: covered(&new, self.radius) / new.len() as f64,
            badness: badness[0].max(badness[1]),
            scatter: [whole.planes[0].sigma, whole.planes[1].sigma],
            sharp,
            finest,
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

/// Both clouds cut out by one cylinder.
struct Cut {
    radius: f64,
    difference: f64,
    u: f64,
    /// Of the new cloud and of the old one.
    planes: [HeightPlane; 2],
    counts: [usize; 2],
}

impl Cut {
    fn new(new: &Heights, old: &Heights, radius: f64) -> Option<Self> {
        let planes = [height(new, radius)?, height(old, radius)?];
        let difference = planes[0].at - planes[1].at;
        Some(Self { radius, difference, u: planes[0].u.hypot(planes[1].u), planes, counts: [new.len(), old.len()] })
    }

    /// With its blur. A mean over a disc tells neither the height of a step nor the depth of a pit in it; both leave a slope or a scatter in the disc
    /// that the old surface has not. What noise may have done, at so many standard deviations of a slope and of a scatter, does not count.
    fn sharp(&self, excess: f64, [slopes, scatters]: [f64; 2]) -> Sharp {
        let [new, old] = &self.planes;
        // A plane of slope s over a disc of radius r has the standard deviation s r / 2.
        let slope = (new.slope - old.slope).norm_squared() * self.radius * self.radius / 4.0;
        let slope_noise = (new.slope_u.powi(2) + old.slope_u.powi(2)) * self.radius * self.radius / 4.0;
        let scatter = new.sigma.powi(2) - old.sigma.powi(2) - excess;
        let variance_u = |k: usize| self.planes[k].sigma.powi(2) * (2.0 / (self.counts[k] as f64 - 3.0)).sqrt();
        let scatter_noise = variance_u(0).hypot(variance_u(1));
        let counted = |found: f64, least: f64| if found > least { found } else { 0.0 };
        let blur = counted(slope, slopes * slopes * slope_noise) + counted(scatter, scatters * scatter_noise);
        Sharp { difference: self.difference, u: self.u, blur: blur.max(0.0).sqrt(), radius: self.radius }
    }
}

/// Over the radius of least noise and blur together, of equal ones the largest; and over the least one.
fn sharpest(whole: &Cut, new: &Heights, old: &Heights, finer: &Finer) -> [Sharp; 2] {
    // Where the widest one is blurred, something goes up and down here: of a narrower one the slope counts, sure or not.
    let mut best = whole.sharp(finer.excess, SURE);
    let mut finest = best;
    let both = |s: &Sharp| s.u.hypot(s.blur);
    for radius in finer.radii {
        // A disc over which the difference is even is told best by all of its points.
        if finest.blur == 0.0 {
            break;
        }
        let within = |cloud: &Heights| -> Heights {
            cloud.iter().filter(|[x, y, _]| x * x + y * y <= radius * radius).copied().collect()
        };
        let Some(cut) = Cut::new(&within(new), &within(old), radius) else { break };
        let found = cut.sharp(finer.excess, [0.0, 1.0]);
        finest = found;
        if both(&found) < both(&best) {
            best = found;
        }
    }
    [best, finest]
}

/// Takes the curvature out that both clouds have in common: where the one reaches further than the other, planes through curved heights would not be
/// comparable. Least squares of a plane for each cloud and one quadric for both, the planes projected out first (Frisch and Waugh).
fn flatten(new: &mut Heights, old: &mut Heights, radius: f64) -> Option<()> {
    let quadric = |[x, y, _]: &[f64; 3]| Vector3::new(x * x, x * y, y * y) / (radius * radius);
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for heights in [&*new, &*old] {
        let first = plane(heights, radius)?;
        let off = |[x, y, z]: &[f64; 3]| z - first.at - first.slope[0] * x - first.slope[1] * y;
        let kept: Heights = heights.iter().filter(|p| off(p).abs() <= 3.0 * first.sigma).copied().collect();
        let row = |[x, y, _]: &[f64; 3]| Vector3::new(1.0, x / radius, y / radius);
        let planes: Matrix3<f64> = kept.iter().map(|p| row(p) * row(p).transpose()).sum();
        let across: Matrix3<f64> = kept.iter().map(|p| row(p) * quadric(p).transpose()).sum();
        let up: Vector3 = kept.iter().map(|p| row(p) * p[2]).sum();
        let inverse = planes.try_inverse()?;
        normal += kept.iter().map(|p| quadric(p) * quadric(p).transpose()).sum::<Matrix3<f64>>();
        normal -= across.transpose() * inverse * across;
        right += kept.iter().map(|p| quadric(p) * p[2]).sum::<Vector3>() - across.transpose() * (inverse * up);
    }
    // Points on a few lines hold no quadric: then there is none.
    let ridge = Matrix3::identity() * (1e-6 * normal.trace());
    let Some(shape) = (normal + ridge).try_inverse().map(|m| m * right).filter(|v| v.iter().all(|v| v.is_finite()))
    else {
        return Some(());
    };
    new.iter_mut().chain(old.iter_mut()).for_each(|p| p[2] -= shape.dot(&quadric(p)));
    Some(())
}

/// Area of the part of a disc that has points, where a straight rim of the surface may cut it. A part s of a disc of radius r has its middle aside by
/// (1 - s) r / 1.18: that is right within 0.01 for s from 0.5 to 1. Chance puts the middle of n points aside by r / sqrt(2 n).
fn covered(points: &Heights, radius: f64) -> f64 {
    let count = points.len() as f64;
    let middle = points.iter().fold([0.0, 0.0], |m, [x, y, _]| [m[0] + x / count, m[1] + y / count]);
    let aside = (middle[0] * middle[0] + middle[1] * middle[1]) / (radius * radius) - 0.5 / count;
    (1.0 - 1.18 * aside.max(0.0).sqrt()) * std::f64::consts::PI * radius * radius
}

/// Plane through heights; what stands off by three standard deviations is left out once.
fn height(points: &Heights, radius: f64) -> Option<HeightPlane> {
    let first = plane(points, radius)?;
    let off = |[x, y, z]: &[f64; 3]| z - first.at - first.slope[0] * x - first.slope[1] * y;
    let kept: Heights = points.iter().filter(|p| off(p).abs() <= 3.0 * first.sigma).copied().collect();
    let second = plane(&kept, radius)?;
    // Leaving out shrinks a normal scatter to 0.9866 of itself.
    Some(HeightPlane { u: second.u / 0.9866, slope_u: second.slope_u / 0.9866, ..second })
}

struct HeightPlane {
    /// Height on the axis.
    at: f64,
    slope: Vector2<f64>,
    /// Scatter about it.
    sigma: f64,
    /// Standard uncertainty of the height on the axis.
    u: f64,
    /// Of the slopes, both together.
    slope_u: f64,
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
    let root = |variance: f64| sigma * variance.max(0.0).sqrt();
    Some(HeightPlane {
        at: solved.x,
        slope: Vector2::new(solved.y, solved.z) / radius,
        sigma,
        u: root(inverse[(0, 0)]),
        slope_u: root(inverse[(1, 1)] + inverse[(2, 2)]) / radius,
    })
}
