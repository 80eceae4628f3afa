//! Who is placed, who is left out and why, and what the pairs say in the final poses.

use super::cycles::closures;
use super::joint::Refined;
use super::matches::Sample;
use super::motion;
use super::network::{Between, Edge, LEAST_WEIGHT};
use super::order::{cycles_by_name, pairs_by_name};
use super::pairwise::{Fit, LEAST_AGREEMENT, fit_of};
use super::pipeline::Work;
use super::progress::{self, Step};
use super::result::{Cycle, Gauge, LeftOut, Pair, PairState, Placed, Registration, ViewOutcome, Weak};
use super::sight::{Says, Sight, of_rims};
use super::surface::Surface;
use super::weak::weak_motions;
use crate::fit::robust::median;
use crate::geometry::Isometry3;
use crate::plan::short_number;
use crate::run::Cancelled;
use nalgebra::Matrix6;
use rayon::prelude::*;

/// Patches of each view by which a pair is judged in its final pose.
const JUDGED: usize = 3000;
/// A view that hangs on one pair alone must not move further than this many standard deviations of its prior.
const MOST_SIGMAS: f64 = 6.0;
/// What disagrees with a view's neighbours may be so many times what is usual, and this share in any case.
const UNUSUAL: f64 = 5.0;
const LEAST_UNUSUAL: f64 = 0.1;
/// Views of which nine of ten tell what is usual.
const MANY: usize = 20;
/// Surfaces of a pair differ by no more than so many times what the first quarter of all pairs does, or by no more than the noise of a point.
const MOST_UNLIKE: f64 = 3.0;
/// A motion that is held no better than to so many times the noise of a point, one standard deviation, is weak: it shows among single points.
const WEAK_NOISES: f64 = 2.0;
/// Looking for the worst view leaves this part of the work to settle, for progress only.
const LEFT: f64 = 0.75;
/// Pairs named in the reason of a view that is left out.
const NAMED: usize = 2;

/// Does not believe pairs whose surfaces differ much more than usual: a robust fit of a plane to a cylinder leaves less than points
/// scatter by, and several times what two views of one surface do. Pairs of a wrong view do not tell what is usual.
pub(super) fn doubt_unlike(work: &mut Work) {
    let fits = || work.tried.iter().filter_map(|(pair, t)| Some((*pair, t.fitted.as_ref()?.fit.scale)));
    let mut scales: Vec<f64> = fits().map(|(_, scale)| scale).collect();
    scales.sort_by(f64::total_cmp);
    let Some(usual) = scales.get(scales.len().saturating_sub(1) / 4).copied() else { return };
    let most = |pair: (usize, usize)| Some(work.two(pair.0, pair.1)?.noise(&work.options).max(MOST_UNLIKE * usual));
    let doubt = |(pair, scale): ((usize, usize), f64)| {
        (scale > most(pair)?).then(|| {
            let (scale, usual) = (short_number(scale), short_number(usual));
            (
                pair,
                format!(
                    "their surfaces differ by {scale} (one standard deviation), those of many other pairs by {usual}"
                ),
            )
        })
    };
    let doubted: Vec<((usize, usize), String)> = fits().filter_map(doubt).collect();
    for (pair, why) in doubted {
        work.tried.entry(pair).and_modify(|tried| _ = tried.why_not.get_or_insert(why));
    }
}

/// How a pair lies in the final poses.
pub(super) fn final_fit(work: &Work, pair: &(usize, usize)) -> Option<Fit> {
    let two = work.two(pair.0, pair.1)?;
    let b_from_a = work.poses[pair.1]?.inverse() * work.poses[pair.0]?;
    let scale = work.tried.get(pair).and_then(|t| t.fitted.as_ref()).filter(|_| work.is_good(pair));
    let scale = scale.map_or(0.0, |fitted| fitted.fit.scale);
    let reach = 2.0 * two.a.spacing.max(two.b.spacing) + 10.0 * two.noise(&work.options);
    let posed = two.posed(&b_from_a, reach);
    let overlap = posed.overlap();
    let few = |all: &[u32]| all.iter().step_by(all.len().div_ceil(JUDGED).max(1)).copied().collect();
    let matches = posed.matched(&Sample { a: few(&overlap.a), b: few(&overlap.b) });
    Some(fit_of(two, &matches, &overlap, scale, &work.options))
}

/// The placed view that agrees least with what its neighbours see in the same place, if that is too little, and why it is left out.
pub(super) fn worst(work: &Work, step: &Step) -> Result<Option<(usize, String)>, Cancelled> {
    work.run.check()?;
    let placed = work.poses.iter().flatten().count();
    if placed < 2 {
        return Ok(None);
    }
    let mut worst: Option<(f64, usize)> = None;
    let near = work.near(|work, k| work.poses[k], |_, _| 0.0);
    let one = LEFT.powf(1.0 / near.len().max(1) as f64);
    let agreements = agreements(work, &near, &|| step.leaves(one))?;
    let least = least_agreement(&agreements);
    for (view, (agreement, _)) in agreements.into_iter().enumerate() {
        if agreement < least && worst.is_none_or(|(least, _)| agreement < least) {
            worst = Some((agreement, view));
        }
    }
    if let Some((agreement, view)) = worst {
        let (found, least) = (100.0 * agreement, 100.0 * least);
        let why = format!(
            "only {found:.0} % of what its neighbours see in the same place agrees with it, expected at least {least:.0} %"
        );
        return Ok(Some((view, why)));
    }
    let seen_through = seen_through(work);
    work.run.check()?;
    if let Some(seen_through) = seen_through {
        return Ok(Some(seen_through));
    }
    Ok((0..work.views.len()).find_map(|view| Some((view, strayed(work, view)?))))
}

/// The share that must agree: what disagrees may be several times what it is in nine of ten views, within limits. Of a few views one may be
/// wrong, so that the middle one of them is usual.
fn least_agreement(agreements: &[(f64, usize)]) -> f64 {
    let mut off: Vec<f64> = agreements.iter().map(|(agreement, _)| 1.0 - agreement).filter(|d| d.is_finite()).collect();
    off.sort_by(f64::total_cmp);
    let usual = if off.len() < MANY { off.len() / 2 } else { off.len() * 9 / 10 };
    let usual = off.get(usual).copied().unwrap_or(1.0);
    1.0 - (UNUSUAL * usual).clamp(LEAST_UNUSUAL, 1.0 - LEAST_AGREEMENT)
}

/// The view that has a surface where most of the rims speak against it that several others confirm. Rims that are contradicted by more views than
/// confirm them are those of shadows, or of the view that is wrong.
fn seen_through(work: &Work) -> Option<(usize, String)> {
    let near = work.near(|work, k| work.poses[k], |_, _| 0.0);
    let both: Vec<(usize, usize)> = near.iter().flat_map(|(a, b)| [(*a, *b), (*b, *a)]).collect();
    let says = |(own, other): &(usize, usize)| {
        // What is left out is asked for by nobody: the caller ends.
        work.run.check().ok()?;
        let other_from_own = work.poses[*other]?.inverse() * work.poses[*own]?;
        let (own, other) = (work.surfaces[*own].as_ref()?, work.surfaces[*other].as_ref()?);
        Some(of_rims(own, other, &other_from_own))
    };
    let said: Vec<Option<Vec<Says>>> = both.par_iter().map(says).collect();
    let rims = |view: &Option<Surface>| view.as_ref().map_or(0, |s| s.rims.len());
    let mut of_rim: Vec<Vec<Sight>> = work.surfaces.iter().map(|s| vec![Sight::default(); rims(s)]).collect();
    for ((own, _), said) in both.iter().zip(&said) {
        said.iter().flatten().zip(&mut of_rim[*own]).for_each(|(says, sight)| sight.count(*says));
    }
    let mut of_view = vec![Sight::default(); work.views.len()];
    for ((own, other), said) in both.iter().zip(&said) {
        let confirmed = |sight: &Sight| sight.agree > 0 && sight.agree >= sight.against;
        let counts = said.iter().flatten().zip(&of_rim[*own]).filter(|(_, sight)| confirmed(sight));
        counts.for_each(|(says, _)| of_view[*other].count(*says));
    }
    let doubtful = of_view.iter().enumerate().filter_map(|(view, s)| Some((s.against, view, s.doubt()?)));
    let worst = doubtful.max_by(|a, b| a.0.cmp(&b.0).then(b.1.cmp(&a.1)))?;
    Some((worst.1, worst.2))
}

/// Of each view the share of what it and its neighbours see in the same place that agrees, and how many neighbours.
fn agreements(work: &Work, near: &[(usize, usize)], done: &(dyn Fn() + Sync)) -> Result<Vec<(f64, usize)>, Cancelled> {
    let fit = |pair: &(usize, usize)| {
        work.run.check()?;
        let fit = final_fit(work, pair);
        done();
        Ok(fit)
    };
    let fits: Vec<Option<Fit>> = near.par_iter().map(fit).collect::<Result<_, Cancelled>>()?;
    let mut sums = vec![(0.0, 0.0, 0_usize); work.views.len()];
    for (pair, fit) in near.iter().zip(fits) {
        let Some(fit) = fit.filter(|fit| fit.agreement > 0.0) else { continue };
        for view in [pair.0, pair.1] {
            let seen = fit.share / fit.agreement;
            sums[view].0 += fit.share;
            sums[view].1 += seen;
            sums[view].2 += 1;
        }
    }
    let of_view = |(agree, seen, count)| (if seen > 0.0 { agree / seen } else { f64::NAN }, count);
    Ok(sums.into_iter().map(of_view).collect())
}

/// Why a view that hangs on one pair alone is not believed: it lies too far from where its prior has it.
fn strayed(work: &Work, view: usize) -> Option<String> {
    let (prior, pose) = (work.priors[view]?, work.poses[view]?);
    let good = |pair: &&(usize, usize)| (pair.0 == view || pair.1 == view) && work.is_good(pair);
    let pairs: Vec<&(usize, usize)> = work.tried.keys().filter(good).collect();
    let [pair] = pairs.as_slice() else { return None };
    let other = if pair.0 == view { pair.1 } else { pair.0 };
    // Of two views neither is the one that strayed.
    if work.poses.iter().flatten().count() < 3 {
        return None;
    }
    let (moved, turned) = moved(work, view, &pose)?;
    let sigmas = (moved / prior.translation_sigma).max(turned / prior.rotation_sigma_rad);
    (sigmas > MOST_SIGMAS).then(|| {
        let moved = short_number(moved);
        format!(
            "it fits {} only, and there it lies {moved} and {:.2} degrees off its given pose, {sigmas:.0} standard deviations of it",
            work.views[other].name,
            turned.to_degrees()
        )
    })
}

fn moved(work: &Work, view: usize, pose: &Isometry3) -> Option<(f64, f64)> {
    let prior = work.priors[view]?.world_from_view;
    let middle = work.surfaces[view].as_ref()?.middle;
    Some(((pose * middle - prior * middle).norm(), (pose.rotation * prior.rotation.inverse()).angle()))
}

/// All of it, views told by their places in the order given.
pub(super) fn tell(work: &Work, refined: Option<Refined>) -> Result<Registration, Cancelled> {
    let order = &work.given;
    let members: Vec<usize> = (0..work.views.len()).filter(|k| work.poses[*k].is_some()).collect();
    let covariances = refined.as_ref().map(|r| r.solved.factor.covariances(&work.run)).transpose()?.unwrap_or_default();
    let between = refined.map(|r| r.between).unwrap_or_default();
    let gauge = work.gauge(&members);
    let near = work.near(|work, k| work.poses[k], |_, _| 0.0);
    let step = Step::new(&work.told, progress::TELLING, near.len() + work.tried.len());
    let agreements = agreements(work, &near, &|| step.one())?;
    let mut views = vec![None; order.len()];
    for (k, place) in order.iter().enumerate() {
        let at = members.binary_search(&k).ok();
        let known = at.filter(|_| at != gauge).and_then(|at| covariances.get(at));
        let covariance = known.copied().unwrap_or_else(Matrix6::zeros);
        views[*place] = Some(outcome(work, k, covariance, agreements[k].0));
    }
    let mut noises: Vec<f64> = work.surfaces.iter().flatten().map(|s| s.noise).collect();
    let mut rank = vec![0; order.len()];
    order.iter().zip(&work.by_name).for_each(|(place, name)| rank[*place] = *name);
    let mut weak = weak(work, &members, &between, order);
    weak.sort_by_key(|weak| rank[weak.view]);
    Ok(Registration {
        views: views.into_iter().flatten().collect(),
        pairs: pairs_by_name(pairs(work, order, &step)?, &rank),
        cycles: cycles_by_name(cycles(work, &members, order), &rank),
        weak,
        gauge: gauge.map_or(Gauge::Priors, |at| Gauge::View(order[members[at]])),
        noise: work.options.noise.or_else(|| median(&mut noises)).unwrap_or(0.0),
    })
}

fn outcome(work: &Work, view: usize, covariance: Matrix6<f64>, agreement: f64) -> ViewOutcome {
    let surface = work.surfaces[view].as_ref();
    let Some((world_from_view, surface)) = work.poses[view].zip(surface) else {
        let reason = work.left_out[view].clone().unwrap_or_else(|| reason(work, view));
        return ViewOutcome::LeftOut(LeftOut { name: work.views[view].name.clone(), reason });
    };
    let moved = moved(work, view, &world_from_view);
    let placed = Placed {
        world_from_view,
        middle: world_from_view * surface.middle,
        covariance,
        moved: moved.map(|m| m.0),
        turned_rad: moved.map(|m| m.1),
        agreement,
    };
    ViewOutcome::Placed(Box::new(placed))
}

/// Why no pair connects a view with the others.
fn reason(work: &Work, view: usize) -> String {
    let of_view = |pair: &&(usize, usize)| pair.0 == view || pair.1 == view;
    let other = |pair: &(usize, usize)| if pair.0 == view { pair.1 } else { pair.0 };
    let mut tried: Vec<&(usize, usize)> = work.tried.keys().filter(of_view).collect();
    if tried.is_empty() {
        return if work.priors[view].is_some() {
            format!(
                "it shares less than {:.0} % with every other view where its given pose has it",
                100.0 * work.options.least_share
            )
        } else {
            "there is no other view to register it with".to_owned()
        };
    }
    let good: Vec<&str> =
        tried.iter().filter(|p| work.is_good(p)).map(|p| work.views[other(p)].name.as_str()).collect();
    if !good.is_empty() {
        return format!("it fits {} only, which fit none of the others", good.join(", "));
    }
    let share = |pair: &(usize, usize)| {
        work.tried[pair].fitted.as_ref().map_or(0.0, |fitted| fitted.fit.share * fitted.fit.agreement)
    };
    tried.sort_by(|a, b| share(b).total_cmp(&share(a)).then(a.cmp(b)));
    let count = tried.len();
    let named =
        tried.iter().take(NAMED).map(|pair| format!("with {}: {}", work.views[other(pair)].name, why(work, pair)));
    let more = (count > NAMED).then(|| format!("{} more pairs", count - NAMED));
    let named: Vec<String> = named.chain(more).collect();
    format!("it fits none of the others: {}", named.join("; "))
}

/// Why a pair is not used.
fn why(work: &Work, pair: &(usize, usize)) -> String {
    let tried = &work.tried[pair];
    if let Some(why) = &tried.why_not {
        return why.clone();
    }
    let off = tried.fitted.as_ref().and_then(|fitted| {
        let b_from_a = work.poses[pair.1]?.inverse() * work.poses[pair.0]?;
        let off = motion::of_rigid(&(fitted.b_from_a * b_from_a.inverse()), &fitted.centre);
        Some((motion::shift(&off).norm(), motion::turn(&off).norm().to_degrees()))
    });
    match (off, work.weights.get(pair)) {
        (Some((shift, turn)), Some(weight)) if *weight < LEAST_WEIGHT => {
            let shift = short_number(shift);
            format!("it contradicts the other pairs by {shift} and {turn:.3} degrees (weight {weight:.2})")
        }
        (None, Some(weight)) if *weight < LEAST_WEIGHT => {
            format!("it contradicts the other pairs (weight {weight:.2})")
        }
        _ => "one of its views is left out".to_owned(),
    }
}

/// Pairs as they lie in the final poses, or as they were found where one view is left out.
fn pairs(work: &Work, order: &[usize], step: &Step) -> Result<Vec<Pair>, Cancelled> {
    let one = |(pair, tried): (&(usize, usize), &super::pairwise::Tried)| {
        work.run.check()?;
        let none = Fit { share: 0.0, shared: 0, scale: f64::NAN, rms: f64::NAN, mean: f64::NAN, agreement: 0.0 };
        let fit = final_fit(work, pair).or_else(|| Some(tried.fitted.as_ref()?.fit)).unwrap_or(none);
        step.one();
        let placed = work.poses[pair.0].is_some() && work.poses[pair.1].is_some();
        let state = if placed && work.is_good(pair) {
            PairState::Used { weight: work.weights.get(pair).copied().unwrap_or(1.0) }
        } else {
            PairState::Rejected { why: why(work, pair) }
        };
        let Fit { share, shared, rms, mean, agreement, .. } = fit;
        Ok(Pair { a: order[pair.0], b: order[pair.1], shared, share, rms, mean, agreement, state })
    };
    work.tried.par_iter().map(one).collect()
}

/// Rings of used pairs.
fn cycles(work: &Work, members: &[usize], order: &[usize]) -> Vec<Cycle> {
    let poses: Vec<Isometry3> = members.iter().filter_map(|k| work.poses[*k]).collect();
    let place = |view: usize| members.binary_search(&view).ok();
    let good = work.tried.keys().filter(|pair| work.is_good(pair));
    let edges: Vec<Edge> = good.filter_map(|pair| work.edge(pair, place(pair.0)?, place(pair.1)?)).collect();
    let mut cycles = closures(members.len(), &edges, &poses);
    for cycle in &mut cycles {
        cycle.views.iter_mut().for_each(|view| *view = order[members[*view]]);
    }
    cycles
}

fn weak(work: &Work, members: &[usize], between: &[Between], order: &[usize]) -> Vec<Weak> {
    if members.len() < 2 {
        return Vec::new();
    }
    let of_view = |(at, view): (usize, &usize)| {
        let surface = work.surfaces[*view].as_ref()?;
        let pose = work.poses[*view]?;
        let limit = WEAK_NOISES * work.options.noise.unwrap_or(surface.noise).max(1e-6 * surface.extent);
        let name = &work.views[*view].name;
        let found = weak_motions(name, at, surface, &pose, between, work.priors[*view].as_ref(), limit);
        let weak = |m: super::weak::WeakMotion| Weak { view: order[*view], uncertainty: m.uncertainty, words: m.words };
        Some(found.into_iter().map(weak).collect::<Vec<Weak>>())
    };
    members.iter().enumerate().filter_map(of_view).flatten().collect()
}
