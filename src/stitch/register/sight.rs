//! Free sight: where views looked through a hole or past an edge, another one must not have a surface.
//!
//! A single view does not tell that: what ends may be its shadow, or what somebody cut off. Rims count that other views confirm.

use super::surface::Surface;
use crate::geometry::{Isometry3, Point3, Vector3};

/// Places so far beyond a rim, and as far before it, are looked at, in distances of patches: further than poses are off.
const BESIDE_SPACING: f64 = 3.0;
/// A surface is at a place when a patch lies as near, in distances of patches.
const AT_SPACING: f64 = 1.2;
/// Least cosine of the angle of two normals that may be of one surface.
const LEAST_COSINE: f64 = 0.7;
/// Fewer places tell nothing.
const LEAST_PLACES: usize = 8;
/// The share of places that may be against a view.
const MOST_AGAINST: f64 = 0.5;

/// What another view says of a rim.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Says {
    /// It ends there, too.
    Ends,
    /// It goes on.
    GoesOn,
    /// It does not see the place, or only its own end.
    Nothing,
}

/// What a view says of each rim of another one, in a pose.
pub(super) fn of_rims(own: &Surface, other: &Surface, other_from_own: &Isometry3) -> Vec<Says> {
    let reach = BESIDE_SPACING * own.spacing.max(other.spacing);
    let says = |rim: &super::rim::Rim| {
        let at = |beside: f64| other_from_own * (rim.centre + rim.outward * beside);
        let upright = other_from_own.rotation * rim.upright;
        let near = |found: &super::rim::Rim| (found.centre - at(0.0)).norm() < reach;
        if is_surface(other, &at(reach), &upright) {
            Says::GoesOn
        } else if is_surface(other, &at(-reach), &upright) && other.nearest_rim(&at(0.0)).is_some_and(near) {
            Says::Ends
        } else {
            Says::Nothing
        }
    };
    own.rims.iter().map(says).collect()
}

fn is_surface(surface: &Surface, place: &Point3, upright: &Vector3) -> bool {
    let patch = &surface.patches[surface.nearest(place)];
    (patch.centre - place).norm() < AT_SPACING * surface.spacing && patch.normal.dot(upright) > LEAST_COSINE
}

/// Places on rims of which another view says something.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Sight {
    /// It ends there in both.
    pub agree: usize,
    /// One of them goes on.
    pub against: usize,
}

impl Sight {
    /// Counts one more place.
    pub(super) fn count(&mut self, says: Says) {
        match says {
            Says::Ends => self.agree += 1,
            Says::GoesOn => self.against += 1,
            Says::Nothing => {}
        }
    }

    /// Why a view is not of the others' part, if it is not.
    pub(super) fn doubt(&self) -> Option<String> {
        let (against, all) = (self.against, self.agree + self.against);
        let doubtful = against >= LEAST_PLACES && against as f64 > MOST_AGAINST * all as f64;
        doubtful.then(|| {
            format!("it has a surface at {against} of {all} places where several of its neighbours look past a rim")
        })
    }
}
