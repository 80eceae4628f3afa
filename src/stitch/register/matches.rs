//! Places of two surfaces that lie on each other in a pose, and the sums over them.
//!
//! The normal of a match is that between the two patches' normals: the distance along it is zero for any two places of one quadratic
//! surface (Rusinkiewicz 2019), so that it does not matter which patch is the nearest. Half the difference of the two normals is what
//! they are uncertain by: it tells how much of the sums comes from noise. Rims are matched in the same way, along the direction out of the surface
//! in place of the normal.

use super::rim::Rim;
use super::surface::{Patch, Surface};
use crate::fit::robust::{SIGMA_OF_MAD, middle_value, tukey_weight};
use crate::geometry::{Isometry3, Point3, Vector3};
use nalgebra::{Matrix3, Matrix6, Vector6};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// A place has another surface opposite where that one's patch lies within this many of its spacings beside it, or within a share of the distance.
const BESIDE_SPACING: f64 = 1.3;
const BESIDE_DISTANCE: f64 = 0.3;
/// Least cosine of the angle of two normals that may be of one surface.
const LEAST_COSINE: f64 = 0.7;
/// Places matched by one task.
const CHUNK: usize = 512;

/// A patch of one surface and what lies opposite, in the frame of `b`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Match {
    /// Half way between the two.
    pub at: Point3,
    /// Unit normal of both.
    pub normal: Vector3,
    /// Half of what their normals differ by.
    pub tilt: Vector3,
    /// Height of `a` over `b`.
    pub residual: f64,
    /// The same of the single measured point in the middle of the patch.
    pub raw: f64,
}

/// Patches of both surfaces that are looked at.
#[derive(Debug, Clone, Default)]
pub(super) struct Sample {
    pub a: Vec<u32>,
    pub b: Vec<u32>,
}

/// Two surfaces in a pose, to be matched up to a distance along the normal.
#[derive(Clone, Copy)]
pub(super) struct Posed<'a> {
    pub a: &'a Surface,
    pub b: &'a Surface,
    pub b_from_a: &'a Isometry3,
    pub reach: f64,
}

impl Posed<'_> {
    /// What lies opposite a patch of `a`.
    fn of_a(&self, k: u32) -> Option<Match> {
        let p = &self.a.patches[k as usize];
        let q = &self.b.patches[self.b.nearest(&(self.b_from_a * p.centre))];
        let found = between(p, q, self.b_from_a, self.b.spacing, self.reach)?;
        Some(Match { raw: found.residual + p.lift, ..found })
    }

    /// What lies opposite a patch of `b`.
    fn of_b(&self, k: u32) -> Option<Match> {
        let q = &self.b.patches[k as usize];
        let p = &self.a.patches[self.a.nearest(&self.b_from_a.inverse_transform_point(&q.centre))];
        let found = between(p, q, self.b_from_a, self.a.spacing, self.reach)?;
        Some(Match { raw: found.residual - q.lift, ..found })
    }

    /// Matches of the sampled patches both ways, those of `a` first.
    pub(super) fn matched(&self, sample: &Sample) -> Vec<Match> {
        let of_a = |chunk: &[u32]| chunk.iter().filter_map(|k| self.of_a(*k)).collect::<Vec<Match>>();
        let of_b = |chunk: &[u32]| chunk.iter().filter_map(|k| self.of_b(*k)).collect::<Vec<Match>>();
        let ways: Vec<Vec<Match>> =
            sample.a.par_chunks(CHUNK).map(of_a).chain(sample.b.par_chunks(CHUNK).map(of_b)).collect();
        ways.into_iter().flatten().collect()
    }

    /// Matches of all rims both ways up to a distance across them, those of `a` first. They have no single point of their own: `raw` is the residual.
    pub(super) fn rims(&self, reach: f64) -> Vec<Match> {
        let spacing = self.a.spacing.max(self.b.spacing);
        let of_a = self.a.rims.iter().filter_map(|p| {
            let q = self.b.nearest_rim(&(self.b_from_a * p.centre))?;
            between_rims(p, q, self.b_from_a, spacing, reach)
        });
        let of_b = self.b.rims.iter().filter_map(|q| {
            let p = self.a.nearest_rim(&self.b_from_a.inverse_transform_point(&q.centre))?;
            between_rims(p, q, self.b_from_a, spacing, reach)
        });
        of_a.chain(of_b).collect()
    }

    /// All patches with something opposite.
    pub(super) fn overlap(&self) -> Sample {
        let all = |surface: &Surface| 0..surface.patches.len() as u32;
        let a = all(self.a).into_par_iter().filter(|k| self.of_a(*k).is_some()).collect();
        let b = all(self.b).into_par_iter().filter(|k| self.of_b(*k).is_some()).collect();
        Sample { a, b }
    }
}

/// The match of two patches, if they can be of one surface.
fn between(p: &Patch, q: &Patch, b_from_a: &Isometry3, spacing: f64, reach: f64) -> Option<Match> {
    let (place, upright) = (b_from_a * p.centre, b_from_a.rotation * p.normal);
    if upright.dot(&q.normal) < LEAST_COSINE {
        return None;
    }
    let normal = (upright + q.normal).normalize();
    let apart = place - q.centre;
    let residual = apart.dot(&normal);
    let beside = (apart - normal * residual).norm();
    if residual.abs() > reach || beside > BESIDE_SPACING * spacing + BESIDE_DISTANCE * residual.abs() {
        return None;
    }
    Some(Match { at: q.centre + apart * 0.5, normal, tilt: (upright - q.normal) * 0.5, residual, raw: residual })
}

/// The match of two places on rims, if they can be of one rim.
fn between_rims(p: &Rim, q: &Rim, b_from_a: &Isometry3, spacing: f64, reach: f64) -> Option<Match> {
    let (place, out, upright) = (b_from_a * p.centre, b_from_a.rotation * p.outward, b_from_a.rotation * p.upright);
    if out.dot(&q.outward) < LEAST_COSINE || upright.dot(&q.upright) < LEAST_COSINE {
        return None;
    }
    let normal = (out + q.outward).normalize();
    let apart = place - q.centre;
    let residual = apart.dot(&normal);
    let beside = (apart - normal * residual).norm();
    if residual.abs() > reach || beside > BESIDE_SPACING * spacing + reach {
        return None;
    }
    Some(Match { at: q.centre + apart * 0.5, normal, tilt: (out - q.outward) * 0.5, residual, raw: residual })
}

/// Matches of one kind, with how they count.
#[derive(Clone, Copy)]
pub(super) struct Group<'a> {
    pub matches: &'a [Match],
    /// Tukey's width: residuals beyond it do not count.
    pub width: f64,
    /// How many times surer a match is than those whose standard deviation is taken for all.
    pub gain: f64,
}

impl Group<'_> {
    /// Matches that count, with their weights.
    fn counted(&self) -> impl Iterator<Item = (&Match, f64)> {
        self.matches.iter().filter(|m| m.residual.abs() < self.width).map(|m| (m, tukey_weight(m.residual, self.width)))
    }
}

/// Robust standard deviation of residuals within a reach; infinite without any.
pub(super) fn scale(matches: &[Match], reach: f64) -> f64 {
    let mut sizes: Vec<f64> = matches.iter().map(|m| m.residual.abs()).filter(|r| *r <= reach).collect();
    middle_value(&mut sizes).map_or(f64::INFINITY, |size| SIGMA_OF_MAD * size)
}

/// Sums over matches: of small motions of `a`, told about a centre.
#[derive(Debug, Clone)]
pub(super) struct Sums {
    pub centre: Point3,
    /// Normal matrix and gradient of half the weighted sum of squared residuals.
    pub h: Matrix6<f64>,
    pub g: Vector6<f64>,
    /// What of the normal matrix comes from normals that are not sure.
    pub unsure: Matrix6<f64>,
    /// The weighted sum of squared displacements of a motion.
    pub displaced: Matrix6<f64>,
    pub weight: f64,
}

/// A row of the problem: what a motion does along a direction at a place beside the centre.
pub(super) fn row(q: &Vector3, along: &Vector3) -> Vector6<f64> {
    let turn = q.cross(along);
    Vector6::new(turn.x, turn.y, turn.z, along.x, along.y, along.z)
}

/// Sums with Tukey's weights; `None` without any weight.
pub(super) fn sums(groups: &[Group]) -> Option<Sums> {
    let counted = || groups.iter().flat_map(|group| group.counted().map(|(m, w)| (m, w, group.gain)));
    let first = counted().next()?.0.at;
    let (offset, weight) = counted()
        .fold((Vector3::zeros(), 0.0), |(offset, weight), (m, w, _)| (offset + (m.at - first) * w, weight + w));
    if weight < 1e-9 {
        return None;
    }
    let centre = first + offset / weight;
    let mut sums = Sums {
        centre,
        h: Matrix6::zeros(),
        g: Vector6::zeros(),
        unsure: Matrix6::zeros(),
        displaced: Matrix6::zeros(),
        weight,
    };
    let mut squares = Matrix3::zeros();
    for (m, w, gain) in counted() {
        let q = m.at - centre;
        let (j, unsure) = (row(&q, &m.normal) * gain, row(&q, &m.tilt) * gain);
        sums.h += j * j.transpose() * w;
        sums.unsure += unsure * unsure.transpose() * w;
        sums.g += j * (w * gain * m.residual);
        squares += (Matrix3::identity() * q.norm_squared() - q * q.transpose()) * w;
    }
    // About the weighted middle turns and shifts displace independently.
    sums.displaced.fixed_view_mut::<3, 3>(0, 0).copy_from(&squares);
    sums.displaced.fixed_view_mut::<3, 3>(3, 3).copy_from(&(Matrix3::identity() * weight));
    Some(sums)
}

/// What residuals of whole neighbourhoods (cells of a side) ask for, one sum for each cell.
pub(super) fn by_neighbourhood(group: &Group, centre: &Point3, side: f64) -> Vec<Vector6<f64>> {
    let mut cells: BTreeMap<[i64; 3], Vector6<f64>> = BTreeMap::new();
    for (m, w) in group.counted() {
        let q = m.at - centre;
        let cell = [q.x, q.y, q.z].map(|c| (c / side).floor() as i64);
        *cells.entry(cell).or_insert_with(Vector6::zeros) +=
            row(&q, &m.normal) * (group.gain * group.gain * w * m.residual);
    }
    cells.into_values().collect()
}
