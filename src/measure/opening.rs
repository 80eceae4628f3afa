//! What holes and slots share: points of the surrounding sheet, search, fit, and whether it is the opening looked for.

use super::card::Card;
use super::chance::{check_size, left_out, needed_gain};
use super::frame::{FeatureFrame, Uvw, clear_of_belt, lean_tangent, sheet_gate_mm, sheet_normal};
use super::gap::{Gap, final_fit, margin_mm};
use super::layer::{Layer, fit_layer, height, most_frequent_height};
use super::patch::{CadPatch, ROUGH_MM};
use super::rim::{is_of_a_leaf_behind, rims_near};
use super::rim_steps::{RimSteps, rim_steps};
use super::sight::{Sight, check_in_sight, own_heights};
use super::thin::is_taken;
use super::{LEAST_COVERED, Local, NotFound};
use crate::fit::soft_edge::outline::MAX_SHAPE;
use crate::fit::soft_edge::{Outline, SoftEdgeFit, SoftEdgeSettings, Window, refine_soft_edge};
use crate::geometry::{Point3, UnitVector3, Vector3};
use nalgebra::Matrix3;

/// An outline that encloses a void: what the search needs to know of it.
pub trait Opening: Outline {
    /// The word for people.
    const WORD: &'static str;
    /// What its rim should be.
    const SHAPE_WORD: &'static str;
    /// Shape parameters that are sizes, kept nominal while searching.
    const SIZES: [bool; MAX_SHAPE];
    /// Its centre.
    fn centre(&self) -> [f64; 2];
    /// The same outline elsewhere.
    fn centred_at(&self, centre: [f64; 2]) -> Self;
    /// Distance from the centre to its furthest place, mm.
    fn reach_mm(&self) -> f64;
    /// Corners of the outline grown by a distance, counter-clockwise, enclosing the same area as the true curve.
    fn grown(&self, by_mm: f64) -> Vec<[f64; 2]>;
    /// Largest difference of a size (diameter, length, width) between two outlines of the family, mm.
    fn size_difference_mm(&self, other: &Self) -> f64;
    /// Length of its rim, mm.
    fn rim_mm(&self) -> f64;
    /// Of the place of the rim nearest to a point: how far along the rim it lies, counter-clockwise, mm, and the curvature there, per mm.
    fn rim_place(&self, p: [f64; 2]) -> (f64, f64);
    /// Its smallest size, mm.
    fn least_size_mm(&self) -> f64;
    /// Its sizes in words.
    fn sizes_in_words(&self) -> String;
}

/// An opening as found, in its feature's frame.
pub struct OpeningFound<O> {
    /// The fit, about the frame's origin.
    pub fit: SoftEdgeFit<O>,
    /// The surrounding sheet, heights above the CAD.
    pub layer: Layer,
    /// Slopes of the sheet about the frame: those of layer and CAD together.
    slopes: [f64; 2],
    /// The lines of sight along which its points were moved to the layer.
    sight: Sight,
    /// Height of the CAD at the found centre over the plane through the nominal one, mm.
    pub cad_mm: f64,
    /// Spacing of the points around it, mm.
    pub spacing_mm: f64,
    /// What somebody should know of it.
    pub warning: Option<String>,
}

impl<O: Opening> OpeningFound<O> {
    /// The centre with its height on the seen face.
    pub fn centre(&self) -> Uvw {
        let [u, v] = self.fit.outline.centre();
        [u, v, height(&self.layer.plane, u, v) + self.cad_mm]
    }

    /// Normal of the measured sheet, on the side of w.
    pub fn normal(&self) -> Uvw {
        let [eu, ev] = self.slopes;
        let length = (1.0 + eu * eu + ev * ev).sqrt();
        [-eu / length, -ev / length, 1.0 / length]
    }

    /// Covariance of the centre about the frame, mm². An error of the layer's height moves the centre along the line of sight,
    /// one of the outline moves it within the sheet.
    pub fn centre_covariance(&self) -> Matrix3<f64> {
        let c = &self.fit.covariance;
        let [u, v] = self.fit.outline.centre();
        let height_variance = self.layer.u_height_at(u, v).powi(2);
        let own = Matrix3::new(c[(0, 0)], c[(0, 1)], 0.0, c[(1, 0)], c[(1, 1)], 0.0, 0.0, 0.0, height_variance);
        let ([su, sv], [eu, ev]) = (self.sight.per_mm(), self.slopes);
        let moves = Matrix3::new(1.0, 0.0, su, 0.0, 1.0, sv, eu, ev, 1.0 + eu * su + ev * sv);
        moves * own * moves.transpose()
    }

    /// Turn of the outline, rad, per rad by which the layer leans too much along a unit direction of its plane: the far end of a
    /// long outline is seen shifted across it.
    pub fn turn_by_lean(&self, [cos, sin]: [f64; 2]) -> f64 {
        let [su, sv] = self.sight.per_mm();
        sv * cos - su * sin
    }
}

/// That far outside the nominal outline there is sheet, also where facets cut the outline's corners, mm.
const RIM_MM: f64 = 0.3;

/// The frame of an opening: w along the plan's axis, v along `v`; the sheet's normal is that around its rim.
pub fn frame_of<O: Opening>(
    local: &Local,
    centre: &Point3,
    axis: &UnitVector3,
    v: Option<&Vector3>,
    nominal: &O,
) -> FeatureFrame {
    // Only the axes of this one are used.
    let plain = FeatureFrame::new(local, *centre, axis, axis, v);
    let ring = nominal.grown(0.5);
    let around: Vec<Vector3> =
        ring.iter().step_by((ring.len() / 16).max(1)).map(|p| plain.vector([p[0], p[1], 0.0])).collect();
    FeatureFrame::new(local, *centre, &sheet_normal(local, centre, axis, &around), axis, v)
}

/// Measures an opening whose centre is nominally the frame's origin.
pub fn measure_opening<O: Opening>(
    local: &Local,
    frame: &FeatureFrame,
    nominal: &O,
    search_mm: f64,
    card: &mut Card,
) -> Result<OpeningFound<O>, NotFound> {
    check_in_sight(local, frame, &ring(nominal, RIM_MM))?;
    check_size(local, nominal, search_mm)?;
    let h = local.scan.spacing_mm;
    let reach = nominal.reach_mm() + margin_mm(h);
    let depth = search_mm + 2.0 + 0.3 * reach;
    let patch = CadPatch::sample(local, frame, &sample_places(nominal, margin_mm(h)), depth + reach, ROUGH_MM);
    let gathered = frame.gather(local, [0.0, 0.0], reach + search_mm, depth);
    let Sheet { points: sheet, wide, layer, slopes, sight } =
        sheet_around(local, frame, &patch, &gathered, nominal, search_mm)?;
    let rough = search(&sheet, nominal, h, search_mm, reach)?;
    let obstacles = obstacles(local, frame, &patch, nominal, reach + search_mm + 2.0);
    let Gap { mut fit, gain } = final_fit(&sheet, &rough, &obstacles, h)?;
    let spacing_mm = fit.density_per_mm2.sqrt().recip();
    card.window_mm = Some(reach);
    card.residual_mm = Some(layer.sigma_mm);
    card.spacing_mm = Some(spacing_mm);
    check_gain(&fit, gain, search_mm, card)?;
    let inside = check(&fit, nominal, &sheet, spacing_mm, search_mm, card)?;
    let not_round = check_rim(&mut fit, &sheet, &wide, card)?;
    let rim = fit.outline.grown(0.0);
    // The CAD's height over a place of the nominal plane is minus that of the place over the CAD.
    let cad = |p: &[f64; 2]| -patch.residual(&[p[0], p[1], 0.0]);
    let on_seen = |p: &[f64; 2]| frame.on_seen_face([p[0], p[1], height(&layer.plane, p[0], p[1]) + cad(p)]);
    let rim: Vec<Point3> = rim.iter().step_by((rim.len() / 32).max(1)).map(on_seen).collect();
    clear_of_belt(local, &rim, fit.points, card)?;
    let [u, v] = fit.outline.centre();
    let around: Vec<f64> = ring(nominal, RIM_MM).iter().map(cad).collect();
    let cad_mm = off_face_mm(&patch, &around) + patch.rise(u, v);
    let told: Vec<String> = [warning(&fit.outline, nominal, inside), not_round].into_iter().flatten().collect();
    let warning = (!told.is_empty()).then(|| told.join("; "));
    Ok(OpeningFound { fit, layer, slopes, sight, cad_mm, spacing_mm, warning })
}

/// How far the face is from a nominal centre, given the heights of the face `around` the opening.
///
/// Over an opening a face has no place. In a dome's, the plan may put the centre in the plane of the rim or where the face would go on,
/// and both are right, as is everything between. Where the face is no quadratic (a hole across a bead), everything between
/// the lowest and the highest place of the rim is right.
fn off_face_mm(patch: &CadPatch, around: &[f64]) -> f64 {
    let [low, high] = match patch {
        CadPatch::Quadratic(..) => {
            let rim = around.iter().sum::<f64>() / around.len() as f64;
            [rim.min(patch.at_origin()), rim.max(patch.at_origin())]
        }
        CadPatch::Exact(..) => {
            around.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], w| [low.min(*w), high.max(*w)])
        }
    };
    if low <= high { 0.0_f64.clamp(low, high) } else { 0.0 }
}

/// Where the CAD is sampled: three rings around the outline.
fn sample_places<O: Opening>(nominal: &O, margin: f64) -> Vec<[f64; 2]> {
    [0.08, 0.5, 1.0].into_iter().flat_map(|share| ring(nominal, share * margin)).collect()
}

/// Some sixteen places along the outline grown by a distance.
fn ring<O: Opening>(nominal: &O, by_mm: f64) -> Vec<[f64; 2]> {
    let all = nominal.grown(by_mm);
    all.iter().step_by(all.len() / 16).copied().collect()
}

/// The sheet around an opening.
struct Sheet {
    /// (u, v) of its points, each where its line of sight meets the layer.
    points: Vec<[f64; 2]>,
    /// The same with those below the layer by as much as its scatter explains, and with them what hangs from a rim into the thickness.
    wide: Vec<[f64; 2]>,
    layer: Layer,
    /// Slopes of layer and CAD together.
    slopes: [f64; 2],
    sight: Sight,
}

/// The points that lie in the sheet around the opening.
fn sheet_around<O: Opening>(
    local: &Local,
    frame: &FeatureFrame,
    patch: &CadPatch,
    gathered: &[Uvw],
    nominal: &O,
    search_mm: f64,
) -> Result<Sheet, NotFound> {
    let margin = margin_mm(local.scan.spacing_mm);
    const NEEDED: usize = 40;
    if gathered.len() < NEEDED {
        return Err(NotFound::too_few(gathered.len(), NEEDED));
    }
    let mut unused = [0.0; MAX_SHAPE];
    let heights = own_heights(local, frame, patch, gathered, f64::INFINITY);
    let ring: Vec<[f64; 3]> = heights
        .iter()
        .filter(|p| (0.3..margin).contains(&nominal.signed_mm([p[0], p[1]], &mut unused)))
        .filter(|p| p[2].abs() <= search_mm)
        .copied()
        .collect();
    let scattered =
        || NotFound::new(format!("no sheet around the {} within ±{search_mm:.1} mm of its place", O::WORD), ring.len());
    if ring.len() < NEEDED {
        return Err(NotFound::too_few(ring.len(), NEEDED));
    }
    let ring_heights: Vec<f64> = ring.iter().map(|p| p[2]).collect();
    let start = most_frequent_height(&ring_heights, frame.outward).ok_or_else(scattered)?;
    let layer = fit_layer(&ring, start, NEEDED / 2).ok_or_else(scattered)?;
    let [below, above] = sheet_gate_mm(local, lean_tangent(local, frame), layer.sigma_mm);
    let cad = patch.slopes();
    let slopes = [layer.plane[1] + cad[0], layer.plane[2] + cad[1]];
    let sight = Sight::new(local, frame, slopes);
    let within = |p: &[f64; 3], below: f64| {
        let over = p[2] - height(&layer.plane, p[0], p[1]);
        (-below..above).contains(&(over * frame.outward)).then(|| sight.on_sheet(p[0], p[1], over))
    };
    let points = heights.iter().filter_map(|p| within(p, below)).collect();
    let wide = heights.iter().filter_map(|p| within(p, above)).collect();
    Ok(Sheet { points, wide, layer, slopes, sight })
}

/// A start for the fit, from points thinned to a few hundred: first with a wide blur from the nominal place, and where that
/// leads nowhere from the place of a grid that fits best.
fn search<O: Opening>(
    sheet: &[[f64; 2]],
    nominal: &O,
    spacing_mm: f64,
    search_mm: f64,
    reach: f64,
) -> Result<O, NotFound> {
    const THINNED: usize = 500;
    // Share of points inside below which a place is an opening's.
    const EMPTY: f64 = 0.15;
    // As many as tell the opening from chance must be left out of the thinned points too.
    let density = (spacing_mm * spacing_mm).recip();
    let spare = (left_out(nominal, density) / needed_gain::<O>(search_mm, density)) as usize;
    let stride = sheet.len().div_ceil(THINNED).min(spare).max(1);
    let thinned = thinned(sheet, stride, reach + search_mm);
    let h = spacing_mm * (stride as f64).sqrt();
    let window = Window::disc(reach + search_mm);
    let mut settings = SoftEdgeSettings::new(h);
    settings.fixed_shape = O::SIZES;
    settings.clutter = 0.02;
    let wide = (0.4 * search_mm).max(h);
    let attempt = |start: &O, taus: &[f64]| {
        let mut outline = start.clone();
        let mut fit = None;
        for tau in taus {
            let next = refine_soft_edge(&thinned, &window, &outline, &settings.with_tau(*tau)).ok()?;
            outline = next.outline.clone();
            fit = Some(next);
        }
        fit
    };
    let near = attempt(nominal, &[wide, 0.7 * h]);
    // Where nobody can tell what stands inside, the search has not found anything.
    let is_empty = |outline: &O, density: f64, below: f64| {
        points_inside(&thinned, outline, 0.5 * h, density).is_some_and(|inside| inside.share < below)
    };
    let good = |fit: &SoftEdgeFit<O>| {
        let [u, v] = fit.outline.centre();
        u.hypot(v) < search_mm && is_empty(&fit.outline, fit.density_per_mm2, EMPTY)
    };
    if let Some(fit) = near.filter(good) {
        return Ok(fit.outline);
    }
    let best = nominal.centred_at(emptiest_place(&thinned, nominal, search_mm, h));
    let again = attempt(&best, &[h.max(0.3), 0.7 * h]);
    if let Some(fit) = again.filter(|fit| is_empty(&fit.outline, fit.density_per_mm2, 0.5)) {
        return Ok(fit.outline);
    }
    // In a gap that is larger than the nominal outline the rim may be too far off for a fit of that size to see.
    if is_empty(&best, (h * h).recip(), EMPTY) {
        return Ok(best);
    }
    Err(NotFound::new(format!("no {} here: the points go on over its place", O::WORD), sheet.len()))
}

/// One of `stride` points.
fn thinned(sheet: &[[f64; 2]], stride: usize, within_mm: f64) -> Vec<[f64; 2]> {
    let within = |p: &&[f64; 2]| p[0].hypot(p[1]) < within_mm && is_taken(p[0], p[1], stride);
    sheet.iter().filter(within).copied().collect()
}

/// Where the nominal outline holds the fewest points: of the places of a grid (step an eighth of the search), the mean of all that
/// are equally empty.
fn emptiest_place<O: Opening>(points: &[[f64; 2]], nominal: &O, search_mm: f64, spacing_mm: f64) -> [f64; 2] {
    const HALF: i32 = 8;
    let mut unused = [0.0; MAX_SHAPE];
    let mut best = (usize::MAX, [0.0; 2], 0.0);
    for i in -HALF..=HALF {
        for j in -HALF..=HALF {
            let place = [search_mm * f64::from(i) / f64::from(HALF), search_mm * f64::from(j) / f64::from(HALF)];
            if place[0].hypot(place[1]) > search_mm {
                continue;
            }
            let outline = nominal.centred_at(place);
            let held = points.iter().filter(|p| outline.signed_mm(**p, &mut unused) < -0.5 * spacing_mm).count();
            if held < best.0 {
                best = (held, place, 1.0);
            } else if held == best.0 {
                best.1 = [best.1[0] + place[0], best.1[1] + place[1]];
                best.2 += 1.0;
            }
        }
    }
    let count = f64::max(best.2, 1.0);
    [best.1[0] / count, best.1[1] / count]
}

/// What stands inside an outline.
#[derive(Debug, Clone, Copy)]
struct Inside {
    /// Number of points.
    points: f64,
    /// Over those that material of the sheet's density would have there.
    share: f64,
}

/// Points inside an outline shrunk by `depth_mm`; `None` where that leaves nothing, or so little that even sheet would hold
/// no point there.
fn points_inside<O: Outline>(points: &[[f64; 2]], outline: &O, depth_mm: f64, density_per_mm2: f64) -> Option<Inside> {
    let mut unused = [0.0; MAX_SHAPE];
    let mut step = [0.0; MAX_SHAPE];
    step[O::DEPTH.0] = -depth_mm * O::DEPTH.1;
    let inner = outline.moved(&step[..O::SHAPE]);
    let expected = if inner.is_sound() { inner.void(0.0).0[0] * density_per_mm2 } else { 0.0 };
    let found = points.iter().filter(|p| inner.signed_mm(**p, &mut unused) < 0.0).count() as f64;
    (expected >= 1.0).then(|| Inside { points: found, share: found / expected })
}

/// Places of the CAD's other trimmed edges near the opening, in the frame's plane: those of loops that do not run along
/// the nominal outline, and are not those of a leaf behind.
fn obstacles<O: Opening>(
    local: &Local,
    frame: &FeatureFrame,
    patch: &CadPatch,
    nominal: &O,
    radius: f64,
) -> Vec<[f64; 2]> {
    let mut unused = [0.0; MAX_SHAPE];
    let own_mm = 0.3 + 0.03 * nominal.reach_mm();
    let mut out = Vec::new();
    for rim in rims_near(local.face, frame, radius, 1.0) {
        let mut away = |p: &Uvw| nominal.signed_mm([p[0], p[1]], &mut unused).abs();
        let on_outline = rim.places.iter().filter(|p| away(p) < own_mm).count();
        if !(rim.closed && 2 * on_outline > rim.places.len()) {
            let own = rim.places.iter().filter(|p| !is_of_a_leaf_behind(frame, patch.residual(p), away(p)));
            out.extend(own.map(|p| [p[0], p[1]]));
        }
    }
    out
}

/// Share of points inside an opening from which on a warning is due, and above which there is none.
const FILLED: [f64; 2] = [0.05, 0.4];
/// That many points inside may be chance, whatever share they are.
const FEW_INSIDE: f64 = 3.0;

/// Share of its smallest size by which an opening may be larger or smaller than its nominal without a warning; the check of a plan
/// against the CAD warns at the same.
const OTHER_SIZE: f64 = 0.1;

/// The words for an opening that is not as empty as it should be, or not of the size that it should have.
fn warning<O: Opening>(found: &O, nominal: &O, inside: Inside) -> Option<String> {
    let word = O::WORD;
    let filled = (inside.share > FILLED[0] && inside.points > FEW_INSIDE).then(|| {
        format!("points stand inside this {word} ({:.0} % of the density of the sheet)", 100.0 * inside.share)
    });
    let other = (found.size_difference_mm(nominal) > OTHER_SIZE * nominal.least_size_mm())
        .then(|| format!("this {word} is {}, nominally {}", found.sizes_in_words(), nominal.sizes_in_words()));
    let told: Vec<String> = [filled, other].into_iter().flatten().collect();
    (!told.is_empty()).then(|| told.join("; "))
}

/// Is the gap more than chance leaves between points of closed sheet?
fn check_gain<O: Opening>(fit: &SoftEdgeFit<O>, gain: f64, search_mm: f64, card: &mut Card) -> Result<(), NotFound> {
    let needed = needed_gain::<O>(search_mm, fit.density_per_mm2);
    // Not a number is no gain.
    if card.at_least("gain in log-likelihood over closed sheet", "", gain, needed) {
        return Ok(());
    }
    let word = O::WORD;
    Err(NotFound::new(format!("no {word} here: no gap is larger than chance leaves between the points"), fit.points))
}

/// Three standard errors of the size of the smallest opening that is told from chance, over its size: a circle that leaves
/// out n = 16 points has a radius of 2.3 spacings, and a rim blurred by half a spacing fixes it to
/// `sqrt(0.5 / (0.9 * 2 pi * 2.3)) = 0.2` spacings. What is off by more is another opening.
const SIZE_SHARE: f64 = 0.3;

/// Is it the opening that was looked for, and is enough of its rim seen? Tells what stands inside.
fn check<O: Opening>(
    fit: &SoftEdgeFit<O>,
    nominal: &O,
    sheet: &[[f64; 2]],
    spacing_mm: f64,
    search_mm: f64,
    card: &mut Card,
) -> Result<Inside, NotFound> {
    let word = O::WORD;
    let not = |reason: String| Err(NotFound::new(reason, fit.points));
    let [u, v] = fit.outline.centre();
    let Some(inside) = points_inside(sheet, &fit.outline, 0.5 * spacing_mm, fit.density_per_mm2) else {
        return not(format!("no {word} here: the gap found is hardly wider than the points are apart"));
    };
    if !card.at_most("density inside over that of the sheet", "", inside.share, FILLED[1]) {
        return not(format!("no {word} here: the points go on over its place"));
    }
    if !card.at_most("distance of the centre from its nominal place", "mm", u.hypot(v), search_mm) {
        return not(format!("no {word} within ±{search_mm:.1} mm of its place"));
    }
    let allowed = (0.5 * search_mm).max(4.0 * spacing_mm).min(SIZE_SHARE * nominal.least_size_mm());
    if !card.at_most("difference of its size from the nominal", "mm", fit.outline.size_difference_mm(nominal), allowed)
    {
        return not(format!(
            "the gap found here is {}, the {word} is {}",
            fit.outline.sizes_in_words(),
            nominal.sizes_in_words()
        ));
    }
    let covered = fit.outline_seen;
    card.covered = Some(covered);
    if !card.at_least("share of the rim beside which points stand", "", covered, LEAST_COVERED) {
        return not(format!(
            "the rim is seen over {:.0} % of its length only, {:.0} % are needed",
            100.0 * covered,
            100.0 * LEAST_COVERED
        ));
    }
    if !fit.converged {
        return not(format!("the search for the rim of the {word} did not settle"));
    }
    Ok(inside)
}

/// Is the rim where the outline is, all around? What it is off is uncertain of every place and size, and told.
fn check_rim<O: Opening>(
    fit: &mut SoftEdgeFit<O>,
    sheet: &[[f64; 2]],
    wide: &[[f64; 2]],
    card: &mut Card,
) -> Result<Option<String>, NotFound> {
    let RimSteps { off_mm, share, most_mm } = rim_steps(fit, sheet, wide);
    let is_shape = card.at_most("distance of a stretch of the rim from its outline", "mm", off_mm.abs(), most_mm);
    if off_mm == 0.0 {
        return Ok(None);
    }
    let words = format!(
        "the rim of the {} is not {}: {:.1} mm off over {:.0} % of it",
        O::WORD,
        O::SHAPE_WORD,
        off_mm.abs(),
        100.0 * share
    );
    if !is_shape {
        return Err(NotFound::new(words, fit.points));
    }
    // A turn moves the far end by its angle times the reach.
    let reach_mm = fit.outline.reach_mm();
    for k in 0..O::SHAPE {
        let is_turn = k > 1 && !O::SIZES[k];
        fit.covariance[(k, k)] += (off_mm / if is_turn { reach_mm } else { 1.0 }).powi(2);
    }
    Ok(Some(words))
}

/// An arc about a centre from one angle to another, as corners whose polygon has the area of the sector: the radius is
/// grown by the ratio of chord triangle to sector.
pub fn arc(centre: [f64; 2], radius: f64, from: f64, to: f64, steps: usize, out: &mut Vec<[f64; 2]>) {
    let step = (to - from) / steps as f64;
    let grown = radius * (step / step.sin()).sqrt();
    for k in 0..=steps {
        let (sin, cos) = (from + step * k as f64).sin_cos();
        out.push([centre[0] + grown * cos, centre[1] + grown * sin]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In a dome of radius 100 mm a hole of 10 mm has its rim 0.125 mm below the place where the dome would go on.
    #[test]
    fn a_centre_in_the_rims_plane_or_on_the_face_as_it_would_go_on_is_on_the_face() {
        let dome = |top: f64| CadPatch::Quadratic([top, 0.0, 0.0, -0.005, 0.0, -0.005], 1.0);
        let rim = |top: f64| vec![top - 0.125; 16];
        for top in [0.0, 0.05, 0.125] {
            assert_eq!(off_face_mm(&dome(top), &rim(top)), 0.0);
        }
        // Nominal places above the dome's top, and below the rim.
        assert_eq!(off_face_mm(&dome(-0.8), &rim(-0.8)), -0.8);
        assert!((off_face_mm(&dome(0.925), &rim(0.925)) - 0.8).abs() < 1e-12);
        // Nobody knows.
        assert_eq!(off_face_mm(&dome(0.3), &[f64::NAN]), 0.3);
    }
}
