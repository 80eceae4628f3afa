//! A point on a trimmed edge.
//!
//! Points are taken into (along the edge, outwards) coordinates and straightened: the CAD's own edge is subtracted along
//! the outward direction, a shear that keeps areas. In these coordinates the edge is a straight line whatever the CAD's
//! outline does, and the straight-edge likelihood holds with its closed-form area.

use super::card::Card;
use super::edge_place::{EdgeAtPlace, deep_mm, edge_at_place, other_edge_mm};
use super::frame::{
    FeatureFrame, Uvw, clear_of_belt, cut_face_tangent, lean_tangent, or_too_near_the_belt, sheet_gate_mm,
    sheet_normal_of,
};
use super::layer::{Layer, fit_layer, height, most_frequent_height};
use super::patch::{CadPatch, ROUGH_MM};
use super::rim::{Rim, is_of_a_leaf_behind, rims_near};
use super::sight::{Sight, check_in_sight, own_heights};
use super::{LEAST_COVERED, Local, NotFound, SHARPNESS_U};
use crate::fit::soft_edge::{
    Edge, Outline, SoftEdgeError, SoftEdgeFit, SoftEdgeSettings, Window, clutter_share, fit_soft_edge, refine_soft_edge,
};
use crate::geometry::{Point3, UnitVector3, Vector3};
use crate::part::{Face, Part};

/// A point on a trimmed edge as found. CAD frame, on the CAD's own face.
#[derive(Debug, Clone, PartialEq)]
pub struct EdgeFound {
    /// The edge on the plane through the nominal place across it.
    pub position: Point3,
    /// Normal of the sheet there, on the plan's side.
    pub normal: Vector3,
    /// Along the plan's outward direction, the calibrated edge offset taken out.
    pub deviation_mm: f64,
    /// k = 1, from the scatter of the points, and what the edge at the place itself lies off the one beside it.
    pub standard_uncertainty_mm: f64,
    /// k = 1 of the sheet's height at the edge, along `normal`, from the scatter of the points alone.
    pub u_height_mm: f64,
    /// Rms of the sheet's points about their plane.
    pub rms_mm: f64,
    /// Points of the fit.
    pub points_used: usize,
}

/// Fewest points of a fit.
const NEEDED: usize = 24;
/// The window's length along the edge, mm; 18 spacings at least.
const LENGTH_MM: f64 = 6.0;
/// The sheet beside the edge is told from a stretch this deep, mm; 8 spacings at least.
const BESIDE_MM: f64 = 5.0;
/// And reaches further along the edge than the window, mm.
const BESIDE_WIDER_MM: f64 = 1.5;
/// The CAD's edge is followed from the nominal place until it has turned by this slope.
const MAX_SLOPE: f64 = 0.35;
/// An edge that is turned by more than this against the CAD's is half one edge and half another: that of a notch.
const MOST_TURNED: f64 = 0.25;
/// Density beyond an edge over that of the sheet above which nobody can tell it from what lies behind.
const MOST_CLUTTER: f64 = 0.05;
/// Spacings of an edge below which its place is biased by some tenth of a spacing.
const LEAST_SPACINGS: f64 = 12.0;

/// Measures how far outwards (along `direction`, in the sheet) the edge lies from `position`, at most `search_mm` away;
/// `normal` is the sheet's.
pub fn edge(
    local: &Local,
    position: &Point3,
    direction: &UnitVector3,
    normal: &UnitVector3,
    search_mm: f64,
) -> Result<EdgeFound, NotFound> {
    edge_with_card(local, position, direction, normal, search_mm, &mut Card::default())
}

/// The same, with the card of what was asked on the way.
pub fn edge_with_card(
    local: &Local,
    position: &Point3,
    direction: &UnitVector3,
    normal: &UnitVector3,
    search_mm: f64,
    card: &mut Card,
) -> Result<EdgeFound, NotFound> {
    let found = find_edge(local, position, direction, normal, search_mm, card);
    or_too_near_the_belt(local, position, found, card)
}

/// The length along the CAD's edge over which a measurement can go by it, mm, for points that lie `spacing_mm` apart: what is asked of the
/// CAD before any point is looked at.
///
/// # Errors
/// There is no edge, or it turns or meets another one too soon: no scan will tell this point.
pub fn edge_length_mm(
    part: &Part,
    face: &Face,
    [direction, normal]: [&UnitVector3; 2],
    position: &Point3,
    search_mm: f64,
    spacing_mm: f64,
) -> Result<f64, NotFound> {
    let frame = frame_at(part, face, position, direction, normal);
    let [half, inner] = first_window(search_mm, spacing_mm);
    let rims = rims_near(face, &frame, half.hypot(inner) + 2.0, 0.25);
    let strip = strip_along_edge(&frame, &rims, half, inner, search_mm + 4.0 * spacing_mm, spacing_mm)?;
    Ok(strip.along[1] - strip.along[0])
}

fn frame_at(
    part: &Part,
    face: &Face,
    position: &Point3,
    direction: &UnitVector3,
    normal: &UnitVector3,
) -> FeatureFrame {
    let thickness_normal = thickness_normal(part, face, position, normal);
    FeatureFrame::on_cad(part, face, *position, &thickness_normal, normal, Some(direction))
}

/// Half the length along the edge, and the reach into the sheet, of the stretch in which an edge is looked for first, mm.
fn first_window(search_mm: f64, spacing_mm: f64) -> [f64; 2] {
    [0.5 * (18.0 * spacing_mm).max(LENGTH_MM), search_mm + (8.0 * spacing_mm).max(1.5)]
}

fn find_edge(
    local: &Local,
    position: &Point3,
    direction: &UnitVector3,
    normal: &UnitVector3,
    search_mm: f64,
    card: &mut Card,
) -> Result<EdgeFound, NotFound> {
    let h = local.scan.spacing_mm;
    let frame = frame_at(local.part, local.face, position, direction, normal);
    // Right inside the edge.
    check_in_sight(local, &frame, &[[0.0, -0.1], [0.0, -0.3]])?;
    let [half, inner] = first_window(search_mm, h);
    let beside = (8.0 * h).max(BESIDE_MM);
    let rims = rims_near(local.face, &frame, half.hypot(inner) + 2.0, 0.25);
    let strip = strip_along_edge(&frame, &rims, half, inner, search_mm + 4.0 * h, h)?;
    let depth = search_mm + 2.0 + 0.5 * half;
    let patch = CadPatch::sample(local, &frame, &strip.sample_places(), depth, ROUGH_MM);
    let radius = (half + BESIDE_WIDER_MM).hypot(inner) + 1.0;
    let gathered = frame.gather(local, [0.0, 0.0], radius, depth);
    let around = own_heights(local, &frame, &patch, &gathered, f64::INFINITY);
    let points = in_strip(&around, &strip);
    card.cad_edge_mm = Some(local.face.edge_distance_mm(&frame.seen));
    if !card.at_least("points in the window", "", points.len() as f64, NEEDED as f64) {
        return Err(NotFound::too_few(points.len(), NEEDED));
    }
    let layer = layer_inside(&points, &strip, search_mm, frame.outward)?;
    let cad_slopes = patch.slopes();
    let on_sheet = |layer: &Layer, gate: [f64; 2], strip: &Strip| {
        let slopes = [cad_slopes[0] + layer.plane[1], cad_slopes[1] + layer.plane[2]];
        let sight = Sight::new(local, &frame, slopes);
        in_layer(&around, layer, frame.outward, gate, &sight, strip)
    };
    let wide = (3.5 * layer.sigma_mm).max(0.15);
    let rough = steepest_step(&on_sheet(&layer, [wide, wide], &strip), &strip, search_mm, h)?;
    // The sheet beside the edge as found decides on which points belong to it.
    let reach = [half + BESIDE_WIDER_MM, beside];
    let layer = layer_beside(&around, &layer, &strip, rough, reach).unwrap_or(layer);
    // Only what the fit looks at need be clear of other edges now.
    let strip =
        strip_along_edge(&frame, &rims, half, (8.0 * h).max(1.5) + h - rough, (4.0 * h).max(0.8) + h + rough, h)?;
    let gate = sheet_gate_mm(local, cut_face_tangent(local, &frame), layer.sigma_mm);
    let sheet = on_sheet(&layer, gate, &strip);
    let fit = final_fit(&sheet, &strip, rough, h)?;
    card.residual_mm = Some(layer.sigma_mm);
    card.window_mm = Some(strip.along[1] - strip.along[0]);
    check(&fit, search_mm, card)?;
    // A notch or a tab reaches further than what the fit looks at.
    let further = deep_mm(h) + h;
    let deep_strip = strip_along_edge(&frame, &rims, half, further - rough, further + rough, h);
    let deep_strip = deep_strip.as_ref().unwrap_or(&strip);
    let u_place =
        u_at_place(&fit, [wide, wide + BENT_MM].map(|gate| on_sheet(&layer, [gate; 2], deep_strip)), deep_strip, card)?;
    let spacing = fit.density_per_mm2.sqrt().recip();
    let offset = fit.outline.offset;
    // The fit tells the edge from the CAD's own, whose place may differ from the nominal one.
    let at_place = offset + strip.edge_at(0.0);
    let deviation_mm = at_place - local.uncertainty.edge_offset_mm;
    let [_, eu, ev] = layer.plane;
    // The CAD's height over a place of the nominal plane is minus that of the place over the CAD.
    let w = height(&layer.plane, 0.0, at_place) - patch.residual(&[0.0, at_place, 0.0]);
    clear_of_belt(local, &[frame.on_seen_face([0.0, at_place, w])], fit.points, card)?;
    let sheet_normal = frame.vector([-(cad_slopes[0] + eu), -(cad_slopes[1] + ev), 1.0]).normalize();
    card.normal = Some(sheet_normal);
    // Where the sheet leans, an error of the layer's height at the edge is one of the place that was seen there. It is never
    // worse than one point's.
    let u_height_mm = layer.u_height_at(0.0, at_place);
    let u_gate = lean_tangent(local, &frame) * u_height_mm.min(layer.sigma_mm);
    let u_fit = fit.covariance[(0, 0)].max(0.0).sqrt();
    Ok(EdgeFound {
        position: frame.on_own_face([0.0, deviation_mm, w]),
        normal: sheet_normal,
        deviation_mm,
        standard_uncertainty_mm: u_fit.hypot(SHARPNESS_U * spacing).hypot(u_gate).hypot(u_place),
        u_height_mm,
        rms_mm: layer.rms_mm,
        points_used: fit.points,
    })
}

/// A tab may be bent off the sheet by this much and is still looked for, mm.
const BENT_MM: f64 = 0.8;

/// Sees to it that the edge at the place is that beside it, for each of these sets of points: of the sheet alone, so that nothing below
/// it fills a notch, and of what is around it, where a tab may be bent. Tells what they leave uncertain, mm.
fn u_at_place(
    fit: &SoftEdgeFit<Edge>,
    sheets: [Vec<[f64; 2]>; 2],
    strip: &Strip,
    card: &mut Card,
) -> Result<f64, NotFound> {
    let mut left_mm = 0.0_f64;
    let other_mm = other_edge_mm(fit);
    for sheet in &sheets {
        let at_place = edge_at_place(fit, sheet, strip.along, [-strip.inner, strip.outer]);
        let (EdgeAtPlace::Same(off_mm) | EdgeAtPlace::Other(off_mm)) = at_place;
        left_mm = left_mm.max(off_mm.abs());
        card.at_most("edge at the place itself off the edge beside it", "mm", left_mm, other_mm);
        match at_place {
            EdgeAtPlace::Same(_) => {}
            EdgeAtPlace::Other(mm) => {
                let reason = format!("the edge at the place itself lies {mm:+.1} mm off the edge beside it");
                return Err(NotFound::new(reason, fit.points));
            }
        }
    }
    Ok(left_mm)
}

/// The direction in which the sheet's thickness lies: the plan's normal. Where that leans away from the CAD's by more than a
/// drawing's rounding or a facet's width explains, the CAD's.
fn thickness_normal(part: &Part, face: &Face, position: &Point3, normal: &UnitVector3) -> UnitVector3 {
    const AGREES_COSINE: f64 = 0.996; // 5 degrees
    let cad_normal = sheet_normal_of(part, face, position, normal, &[Vector3::zeros()]);
    let cosine = cad_normal.dot(normal);
    if cosine.abs() < AGREES_COSINE {
        cad_normal
    } else {
        UnitVector3::new_unchecked(normal.into_inner() * cosine.signum())
    }
}

/// The stretch of sheet in which an edge is looked for: `along` u, from `-inner` to `outer` of the CAD's edge.
struct Strip {
    along: [f64; 2],
    inner: f64,
    outer: f64,
    /// A shorter strip tells no edge.
    least_length: f64,
    /// The CAD's edge, u ascending.
    edge: Vec<Uvw>,
}

impl Strip {
    /// v of the CAD's edge at u, held constant past its ends.
    fn edge_at(&self, u: f64) -> f64 {
        self.edge_place(u)[1]
    }

    /// The place of the CAD's edge at u, held constant past its ends.
    fn edge_place(&self, u: f64) -> Uvw {
        let after = self.edge.partition_point(|p| p[0] < u);
        match (after.checked_sub(1).map(|k| self.edge[k]), self.edge.get(after)) {
            (Some(a), Some(b)) if b[0] > a[0] => {
                let share = (u - a[0]) / (b[0] - a[0]);
                [u, a[1] + (b[1] - a[1]) * share, a[2] + (b[2] - a[2]) * share]
            }
            (Some(a), _) => a,
            (None, Some(b)) => *b,
            (None, None) => [u, 0.0, 0.0],
        }
    }

    /// Where the CAD is sampled: a lattice on the material side of its edge.
    fn sample_places(&self) -> Vec<[f64; 2]> {
        let mut places = Vec::new();
        for i in 0..7 {
            let u = self.along[0] + (self.along[1] - self.along[0]) * f64::from(i) / 6.0;
            for share in [0.02, 0.15, 0.35, 0.6, 1.0] {
                places.push([u, self.edge_at(u) - 0.02 - share * self.inner]);
            }
        }
        places
    }
}

/// Follows the CAD's edge from the nominal place both ways, and keeps the strip clear of other edges. Of edges over each other the one
/// at the nominal height is meant.
fn strip_along_edge(
    frame: &FeatureFrame,
    rims: &[Rim],
    half: f64,
    inner: f64,
    outer: f64,
    spacing_mm: f64,
) -> Result<Strip, NotFound> {
    let distance = |p: &Uvw| p[0].hypot(p[1]).hypot(p[2]);
    let nearest = rims
        .iter()
        .enumerate()
        .flat_map(|(r, rim)| rim.places.iter().enumerate().map(move |(k, p)| (r, k, distance(p))))
        .min_by(|a, b| a.2.total_cmp(&b.2));
    let Some((own, start, _)) = nearest.filter(|n| n.2 < 2.0) else {
        return Err(NotFound::new("the CAD has no trimmed edge within 2.0 mm of the nominal place", 0));
    };
    let (edge, taken) = follow(&rims[own], start, half);
    let along = [edge.first().map_or(0.0, |p| p[0]).max(-half), edge.last().map_or(0.0, |p| p[0]).min(half)];
    let least = (LEAST_SPACINGS * spacing_mm).max(1.5);
    let mut strip = Strip { along, inner, outer, least_length: least, edge };
    for (r, rim) in rims.iter().enumerate() {
        for (k, p) in rim.places.iter().enumerate() {
            if (r != own || !taken[k]) && !is_behind(frame, &strip, p) {
                keep_clear(&mut strip, [p[0], p[1]]);
            }
        }
    }
    let length = strip.along[1] - strip.along[0];
    if length < least || strip.along[0] > 0.0 || strip.along[1] < 0.0 {
        return Err(NotFound::new(
            format!(
                "the edge runs straight over {:.1} mm only, {least:.1} mm are needed for points this far apart",
                length.max(0.0)
            ),
            0,
        ));
    }
    Ok(strip)
}

/// The stretch of a rim around a place in which it stays a graph over u with a slope below the limit, u ascending; and which of
/// the rim's places were taken.
fn follow(rim: &Rim, start: usize, half: f64) -> (Vec<Uvw>, Vec<bool>) {
    let n = rim.places.len();
    let mut taken = vec![false; n];
    taken[start] = true;
    let walk = |step: usize, taken: &mut Vec<bool>| {
        let mut out = Vec::new();
        let mut at = start;
        let mut sense = 0.0;
        // Stepping back is stepping on by n - 1.
        for _ in 0..n {
            let next = (at + step) % n;
            let wraps = if step == 1 { next == 0 } else { next == n - 1 };
            if (wraps && !rim.closed) || next == start {
                break;
            }
            let (du, dv) = (rim.places[next][0] - rim.places[at][0], rim.places[next][1] - rim.places[at][1]);
            if sense == 0.0 {
                sense = du.signum();
            }
            // A place or two beyond the slope may be taken: the chord's slope is what the shear uses.
            if du * sense <= 1e-9 || (dv / du).abs() > MAX_SLOPE {
                break;
            }
            out.push(rim.places[next]);
            taken[next] = true;
            if rim.places[next][0].abs() > half {
                break;
            }
            at = next;
        }
        out
    };
    let forward = walk(1, &mut taken);
    let backward = walk(n - 1, &mut taken);
    let mut edge: Vec<Uvw> = backward.into_iter().rev().chain([rim.places[start]]).chain(forward).collect();
    if edge.first().map_or(0.0, |p| p[0]) > edge.last().map_or(0.0, |p| p[0]) {
        edge.reverse();
    }
    (edge, taken)
}

/// Whether another edge's place is one of a leaf behind the sheet at this edge.
fn is_behind(frame: &FeatureFrame, strip: &Strip, p: &Uvw) -> bool {
    let edge = strip.edge_place(p[0]);
    is_of_a_leaf_behind(frame, p[2] - edge[2], (p[0] - edge[0]).hypot(p[1] - edge[1]))
}

/// Shrinks a strip so that another edge's place is half-way outside, in the way that costs the least area.
fn keep_clear(strip: &mut Strip, p: [f64; 2]) {
    let [u, v] = [p[0], p[1] - strip.edge_at(p[0])];
    let inside = u > strip.along[0] && u < strip.along[1] && v > -strip.inner && v < strip.outer;
    // Places next to the taken stretch are that edge itself, turning away; they limit u only.
    if !inside {
        return;
    }
    let (length, across) = (strip.along[1] - strip.along[0], strip.inner + strip.outer);
    let by_along = if u > 0.0 { (strip.along[1] - 0.9 * u) / length } else { (0.9 * u - strip.along[0]) / length };
    let by_across = if v < 0.0 { (strip.inner + 0.6 * v) / across } else { (strip.outer - 0.6 * v) / across };
    let near_edge = v.abs() < 0.25 * strip.inner;
    // Many small cuts along must not eat the strip up to the place: it is told by what stands on both sides of it.
    let at_place = 0.9 * u.abs() < 0.5 * strip.least_length;
    if near_edge || (by_along < by_across && !at_place) {
        if u > 0.0 { strip.along[1] = 0.9 * u } else { strip.along[0] = 0.9 * u }
    } else if v < 0.0 {
        strip.inner = -0.6 * v;
    } else {
        strip.outer = 0.6 * v;
    }
}

/// A point of the strip: its place, its height above the CAD, and v straightened.
struct StripPoint {
    place: [f64; 3],
    straight_v: f64,
}

impl Strip {
    /// v straightened, of places within the strip.
    fn straight(&self, u: f64, v: f64) -> Option<f64> {
        let straight_v = v - self.edge_at(u);
        let within = (self.along[0]..=self.along[1]).contains(&u) && (-self.inner..=self.outer).contains(&straight_v);
        within.then_some(straight_v)
    }
}

fn in_strip(around: &[[f64; 3]], strip: &Strip) -> Vec<StripPoint> {
    let inside = |p: &[f64; 3]| strip.straight(p[0], p[1]).map(|straight_v| StripPoint { place: *p, straight_v });
    around.iter().filter_map(inside).collect()
}

/// The sheet's layer from where there is material for certain, or at least on the nominal's material side.
fn layer_inside(points: &[StripPoint], strip: &Strip, search_mm: f64, outward: f64) -> Result<Layer, NotFound> {
    let below = |limit: f64| -> Vec<[f64; 3]> {
        let inside = points.iter().filter(|p| p.straight_v < limit && p.place[2].abs() <= search_mm);
        inside.map(|p| p.place).collect()
    };
    let certain = below(-search_mm.min(0.6 * strip.inner));
    let sheet = if certain.len() >= 2 * NEEDED { certain } else { below(0.0) };
    if sheet.len() < NEEDED / 2 {
        return Err(NotFound::too_few(sheet.len(), NEEDED / 2));
    }
    let heights: Vec<f64> = sheet.iter().map(|p| p[2]).collect();
    let layer = most_frequent_height(&heights, outward).and_then(|start| fit_layer(&sheet, start, NEEDED / 2));
    let scattered =
        || NotFound::new(format!("no sheet within ±{search_mm:.1} mm of its place at this edge"), sheet.len());
    layer.ok_or_else(scattered)
}

/// The layer of the sheet beside the edge found, near a layer known already: `half` along the edge either way and `deep` into
/// the sheet. Voids do no harm here, so that it may reach further than the strip.
fn layer_beside(
    around: &[[f64; 3]],
    near: &Layer,
    strip: &Strip,
    edge_v: f64,
    [half, deep]: [f64; 2],
) -> Option<Layer> {
    let within = |p: &[f64; 3]| {
        let v = p[1] - strip.edge_at(p[0]) - edge_v;
        // A plane that is off by more than this at the edge would be no help.
        let off_mm = (p[2] - height(&near.plane, p[0], p[1])).abs();
        p[0].abs() < half && (-deep..-0.2).contains(&v) && off_mm < (8.0 * near.sigma_mm).max(0.5)
    };
    let beside: Vec<[f64; 3]> = around.iter().filter(|p| within(p)).copied().collect();
    let middle = beside.iter().map(|p| p[2]).sum::<f64>() / beside.len().max(1) as f64;
    fit_layer(&beside, middle, NEEDED)
}

/// Straightened (u, v) of the points within a gate about the layer, each where its line of sight meets the layer.
fn in_layer(
    around: &[[f64; 3]],
    layer: &Layer,
    outward: f64,
    [below, above]: [f64; 2],
    sight: &Sight,
    strip: &Strip,
) -> Vec<[f64; 2]> {
    let on_sheet = |p: &[f64; 3]| {
        let over = p[2] - height(&layer.plane, p[0], p[1]);
        if !(-below..above).contains(&(over * outward)) {
            return None;
        }
        let [u, v] = sight.on_sheet(p[0], p[1], over);
        Some([u, strip.straight(u, v)?])
    };
    around.iter().filter_map(on_sheet).collect()
}

/// Where the density drops most, by the likelihood of a hard step: `n_in ln(n_in / A_in) + n_out ln(n_out / A_out)`.
fn steepest_step(sheet: &[[f64; 2]], strip: &Strip, search_mm: f64, spacing_mm: f64) -> Result<f64, NotFound> {
    let mut v: Vec<f64> = sheet.iter().map(|p| p[1]).collect();
    v.sort_unstable_by(f64::total_cmp);
    let width = strip.along[1] - strip.along[0];
    let total = v.len() as f64;
    let mut best = (f64::NEG_INFINITY, 0.0);
    let (low, high) = (-(search_mm.min(strip.inner - 2.0 * spacing_mm)), search_mm.min(strip.outer - spacing_mm));
    let steps = ((high - low) / (0.25 * spacing_mm)).ceil().max(1.0);
    for k in 0..=steps as usize {
        let s = low + (high - low) * k as f64 / steps;
        let inside = v.partition_point(|x| *x < s) as f64;
        let (a_in, a_out) = ((s + strip.inner) * width, (strip.outer - s) * width);
        let outside = total - inside;
        if a_in <= 0.0 || a_out <= 0.0 || inside == 0.0 || inside / a_in <= outside / a_out {
            continue;
        }
        let term = |n: f64, a: f64| if n > 0.0 { n * (n / a).ln() } else { 0.0 };
        let value = term(inside, a_in) + term(outside, a_out);
        if value > best.0 {
            best = (value, s);
        }
    }
    let flat = total * (total / ((strip.inner + strip.outer) * width)).ln();
    // Twice the gain is about chi-square; 10 is far beyond chance.
    if best.0 - flat < 10.0 {
        return Err(NotFound::new(format!("no edge within ±{search_mm:.1} mm"), sheet.len()));
    }
    Ok(best.1)
}

/// The fit in its own window around the edge found.
fn final_fit(sheet: &[[f64; 2]], strip: &Strip, rough: f64, spacing_mm: f64) -> Result<SoftEdgeFit<Edge>, NotFound> {
    let mut offset = rough;
    let mut slope = 0.0;
    let mut local_spacing_mm = spacing_mm;
    let mut result: Option<SoftEdgeFit<Edge>> = None;
    for wide in [true, false] {
        // Window coordinates: v from the offset, so that a density gradient is told about the edge.
        let low = (-strip.inner - offset).max(-(8.0 * spacing_mm).max(1.5));
        let high = (strip.outer - offset).min((4.0 * spacing_mm).max(0.8));
        let inside = |p: &[f64; 2]| (low..=high).contains(&p[1]);
        let points: Vec<[f64; 2]> = sheet.iter().map(|p| [p[0], p[1] - offset]).filter(inside).collect();
        if points.len() < NEEDED {
            return Err(NotFound::too_few(points.len(), NEEDED));
        }
        let window = Window::rectangle([strip.along[0], low], [strip.along[1], high]);
        let start = Edge { offset: 0.0, slope, along: strip.along, outer_mm: high };
        let mut settings = SoftEdgeSettings::new(local_spacing_mm);
        settings.clutter = clutter_share(&points, &start, &window, local_spacing_mm);
        let fit = if wide {
            refine_soft_edge(&points, &window, &start, &settings.with_tau(0.7 * local_spacing_mm))
        } else {
            fit_soft_edge(&points, &window, &start, &settings)
        };
        let mut fit = fit.map_err(|e| match e {
            SoftEdgeError::TooFewPoints { found, needed } => NotFound::too_few(found, needed),
            SoftEdgeError::NoEdge => NotFound::new("the points show no edge here", points.len()),
        })?;
        fit.outline.offset += offset;
        fit.outline.outer_mm += offset;
        offset = fit.outline.offset;
        slope = fit.outline.slope;
        // The sheet leans, or its gate is narrow: its points are further apart than the scan's typical ones.
        local_spacing_mm = fit.density_per_mm2.sqrt().recip();
        result = Some(fit);
    }
    result.ok_or_else(|| NotFound::new("the search for the edge did not start", sheet.len()))
}

fn check(fit: &SoftEdgeFit<Edge>, search_mm: f64, card: &mut Card) -> Result<(), NotFound> {
    let not = |reason: String| Err(NotFound::new(reason, fit.points));
    let spacing = fit.density_per_mm2.sqrt().recip();
    card.spacing_mm = Some(spacing);
    if !card.at_most("distance of the edge from the CAD's", "mm", fit.outline.offset.abs(), search_mm) {
        return not(format!("no edge within ±{search_mm:.1} mm"));
    }
    if !card.at_most("density past the edge over that of the sheet", "", fit.clutter, MOST_CLUTTER) {
        return not(format!("points go on past this edge ({:.0} % of the density of the sheet)", 100.0 * fit.clutter));
    }
    let spacings = fit.outline.length_mm() / spacing;
    if !card.at_least("length of the edge in point spacings", "", spacings, LEAST_SPACINGS) {
        // Rounded down, so that it reads as less than what is needed.
        let spacings = (10.0 * spacings).floor() / 10.0;
        return not(format!("the edge is {spacings:.1} point spacings long here, {LEAST_SPACINGS:.0} are needed"));
    }
    let angle = fit.outline.slope.atan().to_degrees().abs();
    if !card.at_most("turn of the edge against the CAD's", "deg", angle, MOST_TURNED.atan().to_degrees()) {
        return not(format!("the edge found is turned by {angle:.0}° against the CAD's"));
    }
    let covered = fit.outline_seen;
    card.covered = Some(covered);
    if !card.at_least("share of the edge beside which points stand", "", covered, LEAST_COVERED) {
        return not(format!(
            "the edge is seen over {:.0} % of its length only, {:.0} % are needed",
            100.0 * covered,
            100.0 * LEAST_COVERED
        ));
    }
    if !fit.converged {
        return not("the search for the edge did not settle".to_owned());
    }
    Ok(())
}
#[cfg(test)]
mod tests;
