//! A view as a surface: smoothed places with normals, spread evenly.
//!
//! A quadratic over the tangent plane is laid through the points around a seed; its height at the seed and its slope there are a patch. The
//! quadratic keeps curved surfaces where they are, where a mean would lie inside; and forty points tell a place better than one. Seeds are
//! those that stand apart in the order of the points, so that they do not depend on how the view is turned.

use super::rim::{Rim, rim_at};
use crate::fit::robust::{SIGMA_OF_MAD, TUKEY_WIDTH_SIGMAS, median, tukey_weight};
use crate::geometry::{Point3, Vector3, decompose};
use crate::run::{Cancelled, RunContext};
use crate::stitch::View;
use crate::stitch::adaptive::{MergeError, Rank, survivors};
pub(super) use crate::stitch::cells::Around;
use crate::stitch::cells::Cells;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nalgebra::{Matrix3, Matrix6, Vector6};
use rayon::prelude::*;
use std::num::NonZeroUsize;

/// Radius of a patch in d_grid: about forty points.
const RADIUS_GRID: f64 = 3.5;
/// Largest radius, for points that scatter so much that their normals would not tell a motion along the surface.
const MOST_RADIUS_GRID: f64 = 7.0;
/// Scatter of normals that is sought by a larger radius, rad.
const WANTED_NORMAL_RAD: f64 = 0.01;
/// A larger radius must not scatter more than this, else it no longer follows the surface.
const SAME_SCATTER: f64 = 1.15;
/// Radius within which a rim is told: seven strips of points.
const RIM_RADIUS_GRID: f64 = 6.0;
/// Distance, in that radius, of the points that are asked for a rim: some must lie near enough to it.
const RIM_SEEDS: f64 = 0.25;
/// Distance of patches in their radius.
const SPACING: f64 = 0.5;
/// Standard deviation of normal residuals over the root of their mean square weighted by Tukey's biweight at its usual width.
const SIGMA_OF_TUKEY: f64 = 1.0989;
/// Fewer points tell no quadratic.
const LEAST_POINTS: usize = 12;
/// The middle of the points must lie within this part of the radius: half a disc has 0.42.
const MOST_OFF_MIDDLE: f64 = 0.4;
/// Patches that scatter more than this many times the middle one lie on edges; those within a fiftieth of their radius stay.
const MOST_SCATTER: f64 = 5.0;
const FINE_SCATTER: f64 = 0.02;
/// Fewer points of a view are not looked at.
const LEAST_OF_VIEW: usize = 100;
/// Points whose surroundings tell the distance of points, and neighbours that are counted.
const LOOKED_AT: usize = 2000;
const NEIGHBOURS: f64 = 25.0;
/// Patches looked at to choose the radius.
const TRIED: usize = 400;
/// Fewer patches tell no pose.
const LEAST_PATCHES: usize = 30;

/// A smoothed place of a surface, view frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Patch {
    pub centre: Point3,
    /// Unit normal towards the sensor.
    pub normal: Vector3,
    /// Height of the measured point in its middle over it.
    pub lift: f64,
    scatter: f64,
}

/// A view's patches.
pub(super) struct Surface {
    pub patches: Vec<Patch>,
    tree: ImmutableKdTree<f64, 3>,
    /// Places where it ends, in the sight of the sensor.
    pub rims: Vec<Rim>,
    rim_tree: Option<ImmutableKdTree<f64, 3>>,
    /// Distance of points.
    pub grid: f64,
    /// Least distance of patches.
    pub spacing: f64,
    /// Standard deviation of a point about its patch.
    pub noise: f64,
    /// Measured points for each patch.
    pub points_of_patch: f64,
    /// Mean of the patches' places.
    pub middle: Point3,
    /// Root mean square distance from the middle.
    pub extent: f64,
}

/// Why a view is no surface.
pub(super) enum NoSurface {
    /// In words.
    Because(String),
    /// The points reach too far for their distance.
    Extent(String),
    Cancelled(Cancelled),
}

impl From<MergeError> for NoSurface {
    fn from(error: MergeError) -> Self {
        match error {
            MergeError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            MergeError::TooManyCells(cells) => Self::Extent(cells.to_string()),
        }
    }
}

impl Surface {
    /// Of a view whose points are all finite.
    pub(super) fn new(view: &View, d_grid: Option<f64>, run: &RunContext) -> Result<Self, NoSurface> {
        run.check().map_err(NoSurface::Cancelled)?;
        let points = &view.positions;
        let count = points.len();
        let found = if count < LEAST_OF_VIEW { None } else { d_grid.or_else(|| point_distance(points)) };
        let Some(grid) = found else {
            return Err(NoSurface::Because(format!(
                "its {count} points are too few for a surface, or lie in one place"
            )));
        };
        let radius = chosen_radius(view, grid, run)?;
        let patches = patches(view, radius, usize::MAX, run)?;
        let mut scatters: Vec<f64> = patches.iter().map(|p| p.scatter).collect();
        let noise = median(&mut scatters).unwrap_or(0.0);
        let most = (MOST_SCATTER * noise).max(FINE_SCATTER * radius);
        let patches: Vec<Patch> = patches.into_iter().filter(|p| p.scatter <= most).collect();
        if patches.len() < LEAST_PATCHES {
            let found = patches.len();
            return Err(NoSurface::Because(format!(
                "only {found} places of its {count} points lie on a surface, too few to register"
            )));
        }
        let rims = rims(view, grid, run)?;
        let mut surface = Self::of_patches(patches, SPACING * radius, noise, count as f64)?;
        surface.grid = grid;
        surface.set_rims(rims);
        Ok(surface)
    }

    /// Keeps some of the rims.
    pub(super) fn keep_rims(&mut self, keep: impl Fn(&Rim) -> bool) {
        let kept = std::mem::take(&mut self.rims).into_iter().filter(keep).collect();
        self.set_rims(kept);
    }

    fn set_rims(&mut self, rims: Vec<Rim>) {
        let entries: Vec<[f64; 3]> = rims.iter().map(|rim| rim.centre.coords.into()).collect();
        self.rim_tree = if rims.is_empty() { None } else { ImmutableKdTree::new_from_slice(&entries).ok() };
        self.rims = rims;
    }

    /// The nearest rim.
    pub(super) fn nearest_rim(&self, place: &Point3) -> Option<&Rim> {
        let found =
            self.rim_tree.as_ref()?.query(&place.coords.into()).nearest_one::<SquaredEuclidean<f64>>().execute();
        self.rims.get(found.item as usize)
    }

    fn of_patches(patches: Vec<Patch>, spacing: f64, noise: f64, points: f64) -> Result<Self, NoSurface> {
        let entries: Vec<[f64; 3]> = patches.iter().map(|p| p.centre.coords.into()).collect();
        let tree = ImmutableKdTree::new_from_slice(&entries).map_err(|e| NoSurface::Because(e.to_string()))?;
        let count = patches.len() as f64;
        let sum: Vector3 = patches.iter().map(|p| p.centre - patches[0].centre).sum();
        let middle = patches[0].centre + sum / count;
        let extent = (patches.iter().map(|p| (p.centre - middle).norm_squared()).sum::<f64>() / count).sqrt();
        let points_of_patch = points / count;
        let (rims, rim_tree) = (Vec::new(), None);
        Ok(Self { points_of_patch, patches, tree, rims, rim_tree, grid: spacing, spacing, noise, middle, extent })
    }

    /// About that many of its patches, evenly spread: the same surface seen coarsely.
    pub(super) fn coarser(&self, count: usize, run: &RunContext) -> Result<Self, NoSurface> {
        let spacing = self.spacing * (self.patches.len() as f64 / count as f64).sqrt().max(1.0);
        let centres: Vec<Point3> = self.patches.iter().map(|p| p.centre).collect();
        let kept = apart(&centres, spacing, run)?;
        let patches = kept.iter().map(|k| self.patches[*k as usize]).collect();
        Self::of_patches(patches, spacing, self.noise, self.points_of_patch * self.patches.len() as f64)
    }

    /// The nearest patch.
    pub(super) fn nearest(&self, place: &Point3) -> usize {
        self.tree.query(&place.coords.into()).nearest_one::<SquaredEuclidean<f64>>().execute().item as usize
    }

    /// Half the points' size, roughly: of an even disc the radius.
    pub(super) fn half_size(&self) -> f64 {
        self.extent * std::f64::consts::SQRT_2
    }
}

/// About the distance of points (up to 5 % more than d_grid where they lie in a square grid), by how far away their twenty-fifth neighbour is.
/// Unlike by cells it comes out the same however a view is turned, and with it all patches.
fn point_distance(points: &[Point3]) -> Option<f64> {
    let entries: Vec<[f64; 3]> = points.iter().map(|p| p.coords.into()).collect();
    let tree: ImmutableKdTree<f64, 3> = ImmutableKdTree::new_from_slice(&entries).ok()?;
    let wanted = NonZeroUsize::new(NEIGHBOURS as usize + 1)?;
    let furthest = |entry: &[f64; 3]| {
        let near = tree.query(entry).nearest_n::<SquaredEuclidean<f64>>(wanted).execute();
        near.iter().map(|n| n.distance).fold(0.0, f64::max).sqrt()
    };
    let looked_at: Vec<&[f64; 3]> = entries.iter().step_by(points.len().div_ceil(LOOKED_AT).max(1)).collect();
    let mut reaches: Vec<f64> = looked_at.into_par_iter().map(furthest).collect();
    // The point itself counts, and the furthest one, on the rim, by half.
    let reach = median(&mut reaches)?;
    Some(reach * (std::f64::consts::PI / (NEIGHBOURS + 0.5)).sqrt()).filter(|d| *d > 0.0 && d.is_finite())
}

/// Points that stand apart, the first ones first.
fn apart(points: &[Point3], distance: f64, run: &RunContext) -> Result<Vec<u32>, NoSurface> {
    let ranks: Vec<Rank> = (0..points.len() as u32).map(|index| Rank { score: 0.0, view: 0, index }).collect();
    Ok(survivors(points, &ranks, distance, run)?)
}

/// The usual radius, or a larger one where points scatter much and the surface is smooth enough.
fn chosen_radius(view: &View, grid: f64, run: &RunContext) -> Result<f64, NoSurface> {
    let usual = RADIUS_GRID * grid;
    let scatter = |radius: f64| -> Result<f64, NoSurface> {
        let mut scatters: Vec<f64> = patches(view, radius, TRIED, run)?.iter().map(|p| p.scatter).collect();
        Ok(median(&mut scatters).unwrap_or(0.0))
    };
    let noise = scatter(usual)?;
    // Slope of a line through N points even over a disc: 2 s / (r sqrt(N)), with N = pi (r / d)².
    let normal_rad = |radius: f64| 2.0 * noise * grid / (radius * radius * std::f64::consts::PI.sqrt());
    let wanted = usual * (normal_rad(usual) / WANTED_NORMAL_RAD).sqrt();
    let larger = wanted.min(MOST_RADIUS_GRID * grid);
    if larger <= usual || scatter(larger)? > SAME_SCATTER * noise {
        return Ok(usual);
    }
    Ok(larger)
}

/// Patches of a radius, in the order of the points; of about `most` seeds.
fn patches(view: &View, radius: f64, most: usize, run: &RunContext) -> Result<Vec<Patch>, NoSurface> {
    at_seeds(view, [radius, SPACING * radius], most, run, |cells, k, around| {
        patch_at(cells, k, around, radius, &view.sensor)
    })
}

/// What is found within a radius about seeds that stand apart by a distance, in the order of the points; of about `most` seeds.
fn at_seeds<T: Send>(
    view: &View,
    [radius, distance]: [f64; 2],
    most: usize,
    run: &RunContext,
    find: impl Fn(&Cells, usize, &Around) -> Option<T> + Sync,
) -> Result<Vec<T>, NoSurface> {
    let mut seeds = apart(&view.positions, distance, run)?;
    if seeds.len() > most {
        seeds = seeds.iter().step_by(seeds.len() / most).copied().collect();
    }
    let mut is_seed = vec![false; view.positions.len()];
    seeds.iter().for_each(|k| is_seed[*k as usize] = true);
    let cells = Cells::new(&view.positions, radius).map_err(|e| NoSurface::Extent(e.to_string()))?;
    let wanted: Vec<(usize, Around)> =
        cells.walk(0).filter(|(cell, _)| cells.points(*cell).any(|k| is_seed[cells.order[k] as usize])).collect();
    let of_cell = |(cell, around): (usize, Around)| {
        let seeds = cells.points(cell).filter(|k| is_seed[cells.order[*k] as usize]);
        let one = |k: usize| Some((cells.order[k], find(&cells, k, &around)?));
        seeds.filter_map(one).collect::<Vec<_>>()
    };
    let mut found: Vec<(u32, T)> = wanted.into_par_iter().flat_map_iter(of_cell).collect();
    found.sort_unstable_by_key(|(k, _)| *k);
    Ok(found.into_iter().map(|(_, one)| one).collect())
}

/// Rims of the surface, apart from each other, in the order of the points that tell of them.
fn rims(view: &View, grid: f64, run: &RunContext) -> Result<Vec<Rim>, NoSurface> {
    let radius = RIM_RADIUS_GRID * grid;
    let rim = |cells: &Cells, k: usize, around: &Around| rim_at(cells, k, around, radius, grid, &view.sensor);
    let found: Vec<Rim> = at_seeds(view, [radius, RIM_SEEDS * radius], usize::MAX, run, rim)?;
    let centres: Vec<Point3> = found.iter().map(|rim| rim.centre).collect();
    Ok(apart(&centres, SPACING * radius, run)?.into_iter().map(|k| found[k as usize]).collect())
}

/// Where the points within a radius of a point lie beside it.
pub(super) fn near_points(cells: &Cells, k: usize, around: &Around, radius: f64) -> Vec<Vector3> {
    let at = cells.positions[k];
    let within = |d: &Vector3| d.norm_squared() <= radius * radius;
    around.points().map(|j| cells.positions[j] - at).filter(within).collect()
}

/// The patch about a point.
fn patch_at(cells: &Cells, k: usize, around: &Around, radius: f64, sensor: &Point3) -> Option<Patch> {
    let at = cells.positions[k];
    let near = near_points(cells, k, around, radius);
    if near.len() < LEAST_POINTS {
        return None;
    }
    let mean = near.iter().sum::<Vector3>() / near.len() as f64;
    let spread: Matrix3<f64> = near.iter().map(|d| (d - mean) * (d - mean).transpose()).sum();
    let eigen = decompose::symmetric_eigen(spread / (radius * radius))?;
    let axis: Vector3 = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    let up = if axis.dot(&(sensor - at)) < 0.0 { -axis } else { axis };
    let along: Vector3 = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    let across = up.cross(&along);
    let off = mean - up * mean.dot(&up);
    if off.norm() > MOST_OFF_MIDDLE * radius {
        return None;
    }
    let local: Vec<[f64; 3]> =
        near.iter().map(|d| [d.dot(&along) / radius, d.dot(&across) / radius, d.dot(&up)]).collect();
    let (shape, scatter) = quadratic(&local)?;
    let normal = (up - along * (shape[1] / radius) - across * (shape[2] / radius)).normalize();
    let centre = at + up * shape[0];
    Some(Patch { centre, normal, lift: (at - centre).dot(&normal), scatter })
}

/// Height, slopes and curvatures of the quadratic through places `u, v, height`, with the places' standard deviation about it; places far off it are
/// weighted down.
fn quadratic(local: &[[f64; 3]]) -> Option<(Vector6<f64>, f64)> {
    let row = |[u, v, _]: &[f64; 3]| Vector6::new(1.0, *u, *v, u * u, u * v, v * v);
    let mut weights = vec![1.0; local.len()];
    let mut residuals = vec![0.0; local.len()];
    let mut shape = Vector6::zeros();
    for round in 0..2 {
        let (mut matrix, mut right) = (Matrix6::zeros(), Vector6::zeros());
        for (p, weight) in local.iter().zip(&weights) {
            let row = row(p);
            matrix += row * row.transpose() * *weight;
            right += row * (p[2] * weight);
        }
        shape = matrix.cholesky()?.solve(&right);
        residuals.iter_mut().zip(local).for_each(|(r, p)| *r = p[2] - row(p).dot(&shape));
        if round == 0 {
            let mut sizes: Vec<f64> = residuals.iter().map(|r| r.abs()).collect();
            let width = TUKEY_WIDTH_SIGMAS * SIGMA_OF_MAD * median(&mut sizes)?;
            if width > 0.0 {
                weights.iter_mut().zip(&residuals).for_each(|(w, r)| *w = tukey_weight(*r, width));
            }
        }
    }
    let (sum, square) =
        weights.iter().zip(&residuals).fold((0.0, 0.0), |(sum, square), (w, r)| (sum + w, square + w * r * r));
    let all = sum > 6.5 && shape.iter().all(|c| c.is_finite());
    all.then(|| (shape, SIGMA_OF_TUKEY * (square / (sum - 6.0)).sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stitch::register::synthetic_tests::{Part, look};

    /// A patch of forty points knows its height to 4 / 40 of a point's variance and does not lie inside the curve, as a mean would by
    /// curvature times radius² / 4: at 0.02 / mm and 1.05 mm that is 5 µm, half the noise.
    #[test]
    fn patches_lie_on_the_surface_with_normals_towards_the_sensor() {
        let part = Part::formed();
        let noise = 0.01;
        let view = look(&part, "v", [0.0, 0.0], 12.0, 0.3, noise, 1);
        let surface = Surface::new(&view.view, None, &RunContext::silent()).ok().unwrap();
        assert!((surface.noise / noise - 1.0).abs() < 0.1, "{}", surface.noise);
        let (mut sum, mut square, mut off) = (0.0, 0.0, 0.0);
        for patch in &surface.patches {
            let at = view.truth * patch.centre;
            let normal = part.normal(at.x, at.y);
            let height = (at.z - part.height(at.x, at.y)) * normal.z;
            sum += height;
            square += height * height;
            off += (view.truth.rotation * patch.normal - normal).norm_squared();
        }
        let count = surface.patches.len() as f64;
        assert!((square / count).sqrt() < 0.5 * noise, "{}", (square / count).sqrt());
        // The mean of a thousand patches, each of a third of the noise, with a tenth as many independent ones.
        assert!((sum / count).abs() < 0.1 * noise, "{}", sum / count);
        assert!((off / count).sqrt() < 0.02, "{}", (off / count).sqrt());
    }

    #[test]
    fn the_distance_of_points_is_that_of_their_grid_however_they_are_turned() {
        let view = look(&Part::formed(), "v", [0.0, 0.0], 20.0, 0.3, 0.01, 1);
        let found = point_distance(&view.view.positions).unwrap();
        let turned: Vec<Point3> = view.view.positions.iter().map(|p| view.truth * p).collect();
        // The part's slopes of up to a half stretch the grid by some per cent.
        assert!(found > 0.29 && found < 0.34, "{found}");
        assert!((point_distance(&turned).unwrap() - found).abs() < 1e-12 * 150.0);
        assert_eq!(point_distance(&vec![Point3::origin(); 200]), None);
    }

    #[test]
    fn too_few_points_are_no_surface() {
        let mut view = look(&Part::formed(), "v", [0.0, 0.0], 12.0, 0.3, 0.01, 1).view;
        view.positions.truncate(90);
        assert!(matches!(Surface::new(&view, None, &RunContext::silent()), Err(NoSurface::Because(_))));
    }
}
