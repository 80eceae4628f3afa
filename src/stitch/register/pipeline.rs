//! The way from views to poses, step by step.

use super::inputs::check;
use super::joint::{Joined, Refined, refine};
use super::network::{Anchor, Edge, LEAST_WEIGHT, graph};
use super::order;
use super::overlap::{Guess, candidates};
use super::pairwise::{Tried, Two, register as register_pair, way_from};
use super::progress::{self, Step};
use super::result::{RegisterError, Registration};
use super::rim::Field;
use super::surface::{NoSurface, Surface};
use super::verdict;
use super::{Options, Prior};
use crate::geometry::{Isometry3, Point3};
use crate::run::{Cancelled, RunContext};
use crate::stitch::View;
use crate::stitch::shelf::{InMemory, Shelf};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

/// A view may be off by this many standard deviations of its prior.
const SIGMAS: f64 = 3.0;
/// Cells by which the sensor's field of view is told, in distances of patches.
const FIELD_CELL: f64 = 4.0;
/// A view whose pose nothing holds may move by this many times the noise, and not by more than its size: for numbers only.
const LOOSE: f64 = 1e5;

/// All that is known on the way; views are told by their place in the order of what they show.
pub(super) struct Work<'a> {
    pub views: Vec<&'a View>,
    /// Of each view its place in the order given.
    pub given: Vec<usize>,
    /// And in the order of names: views without poses follow each other in it, and the first is their gauge.
    pub by_name: Vec<usize>,
    pub priors: Vec<Option<Prior>>,
    /// Nothing for a view that is no surface.
    pub surfaces: Vec<Option<Surface>>,
    /// Why a view is not used.
    pub left_out: Vec<Option<String>>,
    /// Pairs, the lower view first.
    pub tried: BTreeMap<(usize, usize), Tried>,
    /// Weights of the pairs that were in the graph.
    pub weights: BTreeMap<(usize, usize), f64>,
    /// Poses of the views that are connected.
    pub poses: Vec<Option<Isometry3>>,
    pub options: Options,
    /// Without the share that is done, which only `told` hears of.
    pub run: RunContext<'a>,
    pub told: RunContext<'a>,
}

/// Registers views. A prior for each view, `None` where nothing is known of its pose.
///
/// # Errors
/// No views, not as many priors as views, a coordinate that is not finite, a prior or an option out of its range, points that are too few for
/// their extent, or the job was stopped. A view that fits nowhere is no error: it is left out by name.
pub fn register(
    views: &[View],
    priors: &[Option<Prior>],
    options: &Options,
    run: &RunContext,
) -> Result<Registration, RegisterError> {
    register_from(views, &InMemory(views), priors, options, run)
}

/// The same of views whose points lie on a shelf: of `views` only names and sensors are asked for.
///
/// # Errors
/// Those of [`register`], and those of the shelf.
pub fn register_from(
    views: &[View],
    shelf: &dyn Shelf,
    priors: &[Option<Prior>],
    options: &Options,
    run: &RunContext,
) -> Result<Registration, RegisterError> {
    check(views, priors, options)?;
    let mut given: Vec<usize> = (0..views.len()).collect();
    given.sort_by(|a, b| views[*a].name.cmp(&views[*b].name).then(a.cmp(b)));
    let mut work = Work {
        views: given.iter().map(|k| &views[*k]).collect(),
        priors: given.iter().map(|k| priors[*k]).collect(),
        given,
        by_name: (0..views.len()).collect(),
        surfaces: Vec::new(),
        left_out: vec![None; views.len()],
        tried: BTreeMap::new(),
        weights: BTreeMap::new(),
        poses: vec![None; views.len()],
        options: *options,
        run: run.without_share(),
        told: *run,
    };
    work.lay_surfaces(shelf)?;
    work.try_neighbours()?;
    work.search_unknown()?;
    verdict::doubt_unlike(&mut work);
    work.connect()?;
    work.try_again()?;
    verdict::doubt_unlike(&mut work);
    work.connect()?;
    let refined = work.settle()?;
    Ok(verdict::tell(&work, refined)?)
}

/// One view is the gauge, to the last digit.
fn hold(poses: &mut [Isometry3], gauge: usize) {
    let held = poses[gauge];
    poses.iter_mut().for_each(|pose| *pose = held.inverse() * *pose);
    poses[gauge] = Isometry3::identity();
}

impl Work<'_> {
    /// Lays the surfaces, and from then on takes views in their order.
    fn lay_surfaces(&mut self, shelf: &dyn Shelf) -> Result<(), RegisterError> {
        let finite = |p: &Point3| p.coords.iter().all(|c| c.is_finite());
        let step = Step::new(&self.told, progress::SURFACES, self.views.len());
        let lay = |place: &usize| {
            let view = shelf.view(*place).map_err(|fault| RegisterError::NotFetched(Box::new(fault)))?;
            if let Some(index) = view.positions.iter().position(|p| !finite(p)) {
                return Err(RegisterError::NotFinite { name: view.name.clone(), index });
            }
            let laid = Surface::new(&view, self.options.d_grid, &self.run);
            step.one();
            Ok(laid)
        };
        let laid: Vec<Result<Result<Surface, NoSurface>, RegisterError>> = self.given.par_iter().map(lay).collect();
        for (k, laid) in laid.into_iter().enumerate() {
            let laid = laid?;
            let name = || self.views[k].name.clone();
            match laid {
                Ok(surface) => self.surfaces.push(Some(surface)),
                Err(NoSurface::Because(why)) => {
                    self.surfaces.push(None);
                    self.left_out[k] = Some(why);
                }
                Err(NoSurface::Extent(message)) => return Err(RegisterError::Extent { name: name(), message }),
                Err(NoSurface::Cancelled(cancelled)) => return Err(cancelled.into()),
            }
        }
        self.put_in_order();
        self.keep_true_rims();
        Ok(())
    }

    fn put_in_order(&mut self) {
        let order = order::by_content(&self.surfaces, &self.priors);
        self.views = order.iter().map(|k| self.views[*k]).collect();
        self.priors = order.iter().map(|k| self.priors[*k]).collect();
        self.given = order.iter().map(|k| self.given[*k]).collect();
        self.by_name = order.iter().map(|k| self.by_name[*k]).collect();
        self.surfaces = order.iter().map(|k| self.surfaces[*k].take()).collect();
        self.left_out = order.iter().map(|k| self.left_out[*k].take()).collect();
    }

    /// Leaves rims where the sensor's own field of view ends out.
    fn keep_true_rims(&mut self) {
        let seen = || self.views.iter().zip(&self.surfaces).filter_map(|(view, s)| Some((view.sensor, s.as_ref()?)));
        let side = FIELD_CELL * seen().map(|(_, s)| s.spacing).fold(0.0, f64::max);
        let places = |s: &Surface| s.patches.iter().map(|p| p.centre).collect();
        let seen: Vec<(Point3, Vec<Point3>)> = seen().map(|(sensor, s)| (sensor, places(s))).collect();
        let field = Field::new(side, &seen);
        for (view, surface) in self.views.iter().zip(&mut self.surfaces) {
            if let Some(surface) = surface {
                surface.keep_rims(|rim| field.sees_beyond(rim, &view.sensor));
            }
        }
    }

    /// Of views that are surfaces.
    pub(super) fn two(&self, a: usize, b: usize) -> Option<Two<'_>> {
        Some(Two { a: self.surfaces[a].as_ref()?, b: self.surfaces[b].as_ref()? })
    }

    /// How far a view's places may be off by its prior.
    fn off(&self, view: usize) -> f64 {
        let (Some(prior), Some(surface)) = (&self.priors[view], &self.surfaces[view]) else { return 0.0 };
        SIGMAS * prior.translation_sigma.hypot(prior.rotation_sigma_rad * surface.half_size())
    }

    /// Registers pairs from poses, views off by a distance each.
    fn try_pairs(
        &mut self,
        pairs: &[(usize, usize)],
        pose: impl Fn(&Self, usize) -> Option<Isometry3> + Sync,
        off: impl Fn(&Self, usize) -> f64 + Sync,
        share: Range<f64>,
    ) -> Result<(), Cancelled> {
        let this: &Self = self;
        let step = Step::new(&self.told, share, pairs.len());
        let one = |(a, b): &(usize, usize)| -> Result<Option<Tried>, Cancelled> {
            let Some(two) = this.two(*a, *b) else { return Ok(None) };
            let Some((from, to)) = pose(this, *a).zip(pose(this, *b)) else { return Ok(None) };
            let way = way_from(two, off(this, *a).hypot(off(this, *b)), &this.options);
            let tried = register_pair(two, &(to.inverse() * from), way, &this.options, &this.run)?;
            step.one();
            Ok(Some(tried))
        };
        let tried: Vec<Option<Tried>> = pairs.par_iter().map(one).collect::<Result<_, Cancelled>>()?;
        for (pair, tried) in pairs.iter().zip(tried) {
            let Some(tried) = tried else { continue };
            self.tried.insert(*pair, tried);
        }
        Ok(())
    }

    fn try_neighbours(&mut self) -> Result<(), Cancelled> {
        let pairs = self.near(|work, k| work.priors[k].map(|p| p.world_from_view), Self::off);
        self.try_pairs(&pairs, |work, k| work.priors[k].map(|p| p.world_from_view), Self::off, progress::NEIGHBOURS)
    }

    /// Pairs of views that may overlap in poses.
    pub(super) fn near(
        &self,
        pose: impl Fn(&Self, usize) -> Option<Isometry3>,
        off: impl Fn(&Self, usize) -> f64,
    ) -> Vec<(usize, usize)> {
        let guess = |view: usize| {
            let surface = self.surfaces[view].as_ref()?;
            Some(Guess { view, surface, world_from_view: pose(self, view)?, off: off(self, view) })
        };
        let guesses: Vec<Guess> = (0..self.views.len()).filter_map(guess).collect();
        candidates(&guesses, self.options.least_share, self.options.most_neighbours)
    }

    /// Whether a pair is thought to be right.
    pub(super) fn is_good(&self, pair: &(usize, usize)) -> bool {
        let fits = self.tried.get(pair).is_some_and(|t| t.fitted.is_some() && t.why_not.is_none());
        fits && self.weights.get(pair).is_none_or(|w| *w >= LEAST_WEIGHT)
    }

    /// Views that good pairs connect: the largest such set, of equals the one with the first view.
    pub(super) fn main_part(&self) -> BTreeSet<usize> {
        let mut best = BTreeSet::new();
        let mut seen = vec![false; self.views.len()];
        for first in (0..self.views.len()).filter(|k| self.surfaces[*k].is_some() && self.left_out[*k].is_none()) {
            if seen[first] {
                continue;
            }
            let mut part = BTreeSet::from([first]);
            let mut open = vec![first];
            while let Some(at) = open.pop() {
                seen[at] = true;
                for (a, b) in self.tried.keys().filter(|(a, b)| (*a == at || *b == at) && self.is_good(&(*a, *b))) {
                    let other = if *a == at { *b } else { *a };
                    if self.left_out[other].is_none() && part.insert(other) {
                        open.push(other);
                    }
                }
            }
            if part.len() > best.len() {
                best = part;
            }
        }
        best
    }

    /// Poses of the connected views by the graph of pairs.
    fn connect(&mut self) -> Result<(), Cancelled> {
        self.weights.clear();
        let members: Vec<usize> = self.main_part().into_iter().collect();
        let mut poses = self.first_poses(&members);
        let place = |view: usize| members.binary_search(&view).ok();
        let (pairs, edges): (Vec<(usize, usize)>, Vec<Edge>) = self
            .tried
            .keys()
            .filter(|pair| self.is_good(pair))
            .filter_map(|pair| Some((*pair, self.edge(pair, place(pair.0)?, place(pair.1)?)?)))
            .unzip();
        let middles: Vec<Point3> = members.iter().filter_map(|k| Some(self.surfaces[*k].as_ref()?.middle)).collect();
        let anchors = self.anchors(&members, &poses);
        let weights = graph(&mut poses, &middles, &edges, &anchors, &self.run)?;
        let weights = weights.unwrap_or_else(|| vec![1.0; edges.len()]);
        self.weights = pairs.into_iter().zip(weights).collect();
        self.poses = vec![None; self.views.len()];
        members.iter().zip(poses).for_each(|(k, pose)| self.poses[*k] = Some(pose));
        Ok(())
    }

    pub(super) fn edge(&self, pair: &(usize, usize), a: usize, b: usize) -> Option<Edge> {
        let fitted = self.tried.get(pair)?.fitted.as_ref()?;
        let (b_from_a, centre) = (fitted.b_from_a, fitted.centre);
        Some(Edge { a, b, b_from_a, centre, precision: fitted.precision, covariance: fitted.covariance })
    }

    /// Where the views of a part are thought to lie: by their priors, else by the pairs that lead to them.
    fn first_poses(&self, members: &[usize]) -> Vec<Isometry3> {
        let mut known: BTreeMap<usize, Isometry3> =
            members.iter().filter_map(|k| Some((*k, self.priors[*k]?.world_from_view))).collect();
        if known.is_empty() {
            known.extend(self.gauge(members).map(|at| (members[at], Isometry3::identity())));
        }
        let mut open: Vec<usize> = known.keys().copied().collect();
        while let Some(at) = open.pop() {
            for pair in self.tried.keys().filter(|(a, b)| *a == at || *b == at).filter(|p| self.is_good(p)) {
                let Some(fitted) = self.tried[pair].fitted.as_ref() else { continue };
                let (other, at_from_other) =
                    if pair.0 == at { (pair.1, fitted.b_from_a.inverse()) } else { (pair.0, fitted.b_from_a) };
                if !known.contains_key(&other) {
                    known.insert(other, known[&at] * at_from_other);
                    open.push(other);
                }
            }
        }
        members.iter().map(|k| known.get(k).copied().unwrap_or_else(Isometry3::identity)).collect()
    }

    /// Which of the members is the gauge: none where poses are known, else the one whose name comes first.
    pub(super) fn gauge(&self, members: &[usize]) -> Option<usize> {
        let any_prior = members.iter().any(|k| self.priors[*k].is_some());
        (0..members.len()).filter(|_| !any_prior).min_by_key(|at| self.by_name[members[*at]])
    }

    /// What holds each view of a part beside the pairs.
    pub(super) fn anchors(&self, members: &[usize], poses: &[Isometry3]) -> Vec<Anchor> {
        let gauge = self.gauge(members);
        let anchor = |(at, k): (usize, &usize)| {
            let surface = self.surfaces[*k].as_ref()?;
            let noise = self.options.noise.unwrap_or(surface.noise).max(1e-6 * surface.extent);
            let held = |world_from_view, rotation_sigma_rad, translation_sigma, follows| {
                Some(Anchor { view: at, world_from_view, rotation_sigma_rad, translation_sigma, follows })
            };
            match &self.priors[*k] {
                Some(p) => held(p.world_from_view, p.rotation_sigma_rad, p.translation_sigma, false),
                None if gauge == Some(at) => held(poses[at], 1e-4 * noise / surface.extent, 1e-4 * noise, false),
                None => {
                    let loose = surface.half_size().min(LOOSE * noise);
                    held(poses[at], loose / surface.extent, loose, true)
                }
            }
        };
        members.iter().enumerate().filter_map(anchor).collect()
    }

    /// Pairs that did not fit, or were never tried, again from the poses that the others gave.
    fn try_again(&mut self) -> Result<(), Cancelled> {
        let pose = |work: &Self, k: usize| work.poses[k];
        let off = |work: &Self, k: usize| {
            work.surfaces[k].as_ref().map_or(0.0, |s| 2.0 * s.spacing + 10.0 * work.options.noise.unwrap_or(s.noise))
        };
        let near: Vec<(usize, usize)> =
            self.near(pose, |_, _| 0.0).into_iter().filter(|pair| !self.is_good(pair)).collect();
        self.try_pairs(&near, pose, off, progress::AGAIN)
    }

    /// All views that are connected refined together; one that does not agree with what its neighbours see is left out, and the others refined again.
    fn settle(&mut self) -> Result<Option<Refined>, Cancelled> {
        let step = Step::new(&self.told, progress::TOGETHER, 0);
        loop {
            let members: Vec<usize> = self.main_part().into_iter().collect();
            let mut poses: Vec<Isometry3> = members.iter().filter_map(|k| self.poses[*k]).collect();
            let refined = self.refine(&members, &mut poses, &step)?;
            if let Some(gauge) = self.gauge(&members) {
                hold(&mut poses, gauge);
            }
            self.poses = vec![None; self.views.len()];
            members.iter().zip(poses).for_each(|(k, pose)| self.poses[*k] = Some(pose));
            let Some((worst, why)) = verdict::worst(self, &step)? else { return Ok(refined) };
            self.left_out[worst] = Some(why);
        }
    }

    fn refine(&self, members: &[usize], poses: &mut [Isometry3], step: &Step) -> Result<Option<Refined>, Cancelled> {
        let surfaces: Vec<&Surface> = members.iter().filter_map(|k| self.surfaces[*k].as_ref()).collect();
        let place = |view: usize| members.binary_search(&view).ok();
        let joined: Vec<Joined> = self
            .tried
            .iter()
            .filter(|(pair, _)| self.is_good(pair))
            .filter_map(|((a, b), tried)| {
                let fitted = tried.fitted.as_ref()?;
                let (scale, inflation) = (fitted.fit.scale, fitted.inflation);
                let (rim_gain, rim_scale) = (fitted.rim_gain, fitted.rim_scale);
                Some(Joined {
                    a: place(*a)?,
                    b: place(*b)?,
                    sample: &fitted.sample,
                    scale,
                    inflation,
                    rim_gain,
                    rim_scale,
                })
            })
            .collect();
        let anchors = self.anchors(members, poses);
        refine(&surfaces, poses, &joined, &anchors, &self.options, (&self.run, step))
    }
}
