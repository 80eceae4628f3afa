//! A point of the surface: where the line through the nominal place meets the measured sheet.
//!
//! The heights of the points above the CAD face are told along the plan's direction, a plane is fitted to them in a small
//! disc around the line (where the deviation bends, as in a dent, a quadratic), and its height on the line is the deviation. Telling heights along the direction (and not along the
//! face's normal) makes the plane's value on the line the intersection itself, at any tilt.

use super::bend::fit_bend;
use super::frame::{FeatureFrame, clear_of_belt};
use super::layer::{Layer, fit_layer, height, most_frequent_height};
use super::patch::{CadPatch, face_height};
use super::sight::{check_in_sight, is_of_another_wall};
use super::{Local, NotFound};
use crate::fit::robust::median;
use crate::geometry::{Point3, UnitVector3, Vector3};

/// A point of the surface as found. CAD frame, on the CAD's own face.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceFound {
    /// Where the line meets the measured surface.
    pub position: Point3,
    /// Normal of the measured surface there, on the plan's side.
    pub normal: Vector3,
    /// Along the plan's direction.
    pub deviation_mm: f64,
    /// k = 1, from the scatter of the points, what neighbours' errors have in common, and the bend of the deviation within
    /// the window that a plane may have missed.
    pub standard_uncertainty_mm: f64,
    /// Rms of the points about the fitted surface.
    pub rms_mm: f64,
    /// Points of the fit.
    pub points_used: usize,
}

/// Fewest points of a fit.
const NEEDED: usize = 12;
/// The plan's direction must not lean over more than this from the normal (cosine).
const LEAST_COSINE: f64 = 0.5;

/// Measures where the line through `position` along `direction` meets the sheet, at most `search_mm` away.
pub fn surface(
    local: &Local,
    position: &Point3,
    direction: &UnitVector3,
    search_mm: f64,
) -> Result<SurfaceFound, NotFound> {
    let side = local.face.side;
    let near =
        local.face.closest(position, f64::INFINITY).ok_or_else(|| NotFound::new("the CAD has no face here", 0))?;
    let normal = UnitVector3::new_unchecked(near.normal.into_inner() * side.sign());
    // A direction that points into the sheet is the plan's to choose; only how far it leans matters.
    let cosine = normal.dot(direction).abs();
    if cosine < LEAST_COSINE {
        let angle = cosine.clamp(0.0, 1.0).acos().to_degrees();
        return Err(NotFound::new(
            format!("the plan's direction leans {angle:.0}° away from the sheet's normal, 60° are allowed"),
            0,
        ));
    }
    let frame = FeatureFrame::new(local, *position, &normal, direction, None);
    if face_height(local, &frame, [0.0; 2], search_mm + 2.0).is_none() {
        return Err(NotFound::new("the CAD has no surface here", 0));
    }
    check_in_sight(local, &frame)?;
    let mut radius = window_radius(local, &frame.seen);
    let core = Core::gather(local, &frame, radius, search_mm)?;
    let (patch, points) = loop {
        let places = disc_places(radius);
        let patch = CadPatch::sample(local, &frame, &places, search_mm + 2.0 + radius);
        let points = heights(local, &frame, &patch, radius, search_mm);
        if points.len() >= 2 * NEEDED || radius > 8.0 * local.scan.spacing_mm {
            break (patch, points);
        }
        radius *= 1.4;
    };
    let found = measure_in(&frame, &patch, &points, radius, &core)?;
    clear_of_belt(local, &[frame.on_seen_face([0.0, 0.0, found.deviation_mm])], found.points_used)?;
    Ok(found)
}

/// What was measured at the place itself, whatever its height. The window around it may be full of good sheet while the
/// place is a hole, a pit or a bump: the many around it must not answer for it.
struct Core {
    /// (u, v, w) of every point, also of those too far off to be looked at by the fit.
    points: Vec<[f64; 3]>,
}

/// The place itself reaches half the window, and one and a half spacings at least.
const CORE_SHARE: f64 = 0.5;
const CORE_SPACINGS: f64 = 1.5;
/// Points that must stand there: a quarter of what the scan's density promises (a face that leans by 60 degrees gets half
/// of it, and noise takes some), and this many.
const CORE_NEEDED: usize = 4;
const CORE_FILLED: f64 = 0.25;
/// Share of them that must lie on the surface as fitted, within this many of its standard deviations.
const CORE_AGREES: f64 = 0.6;
const CORE_SIGMAS: f64 = 3.5;
/// How far beyond the search points at the place still speak against the surface around it, mm.
const CORE_BEYOND_MM: f64 = 4.0;

impl Core {
    fn gather(local: &Local, frame: &FeatureFrame, radius: f64, search_mm: f64) -> Result<Self, NotFound> {
        let h = local.scan.spacing_mm;
        let reach = (CORE_SHARE * radius).max(CORE_SPACINGS * h);
        let mut points = frame.gather(local, [0.0, 0.0], reach, search_mm + CORE_BEYOND_MM);
        // Heights are told from the place, not from the face: within the reach it may rise by as much as twice that.
        points.retain(|p| !is_of_another_wall(local, frame, p, p[2], 2.0 * reach));
        let expected = std::f64::consts::PI * (reach / h).powi(2);
        let needed = ((CORE_FILLED * expected) as usize).max(CORE_NEEDED);
        if points.len() < needed {
            return Err(NotFound::new(
                format!("{} points stand at the place itself, within {reach:.1} mm, {needed} are needed", points.len()),
                points.len(),
            ));
        }
        Ok(Self { points })
    }

    /// Whether the surface as fitted is the one at the place.
    fn check(&self, patch: &CadPatch, layer: &Layer, found: usize) -> Result<(), NotFound> {
        let mut off: Vec<f64> =
            self.points.iter().map(|p| patch.residual(p) - height(&layer.plane, p[0], p[1])).collect();
        let near = off.iter().filter(|r| r.abs() <= CORE_SIGMAS * layer.sigma_mm).count();
        if near as f64 >= CORE_AGREES * off.len() as f64 {
            return Ok(());
        }
        let step = median(&mut off).unwrap_or(0.0);
        Err(NotFound::new(format!("the points at the place itself stand {step:+.2} mm off those around it"), found))
    }
}

/// Six spacings or 2 mm, but at most half-way to the next trimmed edge, unless that leaves too few points.
fn window_radius(local: &Local, seen: &Point3) -> f64 {
    let h = local.scan.spacing_mm;
    let wanted = (6.0 * h).max(2.0);
    wanted.min(0.5 * local.face.edge_distance_mm(seen)).max(3.6 * h)
}

/// Where the CAD is sampled: the middle and three rings.
fn disc_places(radius: f64) -> Vec<[f64; 2]> {
    let mut places = vec![[0.0, 0.0]];
    for (share, count) in [(0.4, 6), (0.75, 10), (1.0, 12)] {
        for k in 0..count {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(count)).sin_cos();
            places.push([share * radius * cos, share * radius * sin]);
        }
    }
    places
}

/// (u, v, height above the CAD) of the points in the disc.
fn heights(local: &Local, frame: &FeatureFrame, patch: &CadPatch, radius: f64, search_mm: f64) -> Vec<[f64; 3]> {
    // A face that leans away from the direction reaches further along it.
    let depth = search_mm + 1.8 * radius;
    let gathered = frame.gather(local, [0.0, 0.0], radius, depth);
    let above = gathered.iter().map(|p| (p, patch.residual(p)));
    let own = above
        .filter(|(p, above_mm)| above_mm.abs() <= search_mm && !is_of_another_wall(local, frame, p, *above_mm, 0.0));
    own.map(|(p, above_mm)| [p[0], p[1], above_mm]).collect()
}

fn measure_in(
    frame: &FeatureFrame,
    patch: &CadPatch,
    points: &[[f64; 3]],
    radius: f64,
    core: &Core,
) -> Result<SurfaceFound, NotFound> {
    if points.len() < NEEDED {
        return Err(NotFound::too_few(points.len(), NEEDED));
    }
    let heights: Vec<f64> = points.iter().map(|p| p[2]).collect();
    let scattered = || NotFound::new("the points within the window lie on no common surface", points.len());
    let start = most_frequent_height(&heights, frame.outward).ok_or_else(scattered)?;
    let layer = fit_layer(points, start, NEEDED).ok_or_else(scattered)?;
    // Were the points spread evenly around the line, its height would be as certain as their mean: 1 / points. Five times
    // that variance means that they stand beside it.
    if layer.covariance[(0, 0)] * layer.points as f64 > 5.0 * layer.sigma_mm * layer.sigma_mm {
        return Err(NotFound::new(
            format!("the points stand to one side of the place, over a window of {radius:.1} mm"),
            points.len(),
        ));
    }
    core.check(patch, &layer, points.len())?;
    let Middle { height_mm, slope: [eu, ev], standard_uncertainty_mm, rms_mm, points } = middle(points, &layer);
    let deviation_mm = height_mm + patch.at_origin();
    let slope = [eu + patch.rise(1e-3, 0.0) / 1e-3, ev + patch.rise(0.0, 1e-3) / 1e-3];
    Ok(SurfaceFound {
        position: frame.on_own_face([0.0, 0.0, deviation_mm]),
        normal: frame.vector([-slope[0], -slope[1], 1.0]).normalize(),
        deviation_mm,
        standard_uncertainty_mm,
        rms_mm,
        points_used: points,
    })
}

/// The measured surface on the line.
pub(super) struct Middle {
    /// Height above the CAD.
    pub height_mm: f64,
    /// Slopes along u and v against the CAD.
    pub slope: [f64; 2],
    /// k = 1.
    pub standard_uncertainty_mm: f64,
    /// Of the points with weight.
    pub rms_mm: f64,
    /// Points with weight.
    pub points: usize,
}

/// Fewest points from which a bend can be told.
const NEEDED_FOR_BEND: usize = 30;
/// A bend moves the height on the line away from the plane's; beyond this many standard uncertainties of that shift the bend is
/// taken for real. Leaving it out costs less than the noise of three more terms only up to about one.
const BEND_SIGMAS: f64 = 1.5;

/// Height and slope on the line: the plane's, or the quadratic's where the deviation bends. Where the bend cannot be told
/// from noise it is not corrected, but a bend as large as noise hides (one standard uncertainty of the shift) is a part of the
/// uncertainty.
pub(super) fn middle(points: &[[f64; 3]], layer: &Layer) -> Middle {
    let [height_mm, eu, ev] = layer.plane;
    let plane = |u_bend_mm: f64| Middle {
        height_mm,
        slope: [eu, ev],
        standard_uncertainty_mm: layer.u_height_mm.hypot(u_bend_mm),
        rms_mm: layer.rms_mm,
        points: layer.points,
    };
    let bend = if layer.points >= NEEDED_FOR_BEND { fit_bend(points, layer, NEEDED_FOR_BEND) } else { None };
    let Some(bend) = bend else { return plane(0.0) };
    let shift = bend.height_mm - height_mm;
    if shift.abs() <= BEND_SIGMAS * bend.u_shift_mm {
        return plane(bend.u_shift_mm);
    }
    Middle {
        height_mm: bend.height_mm,
        slope: bend.slope,
        standard_uncertainty_mm: bend.u_height_mm,
        rms_mm: bend.rms_mm,
        points: bend.points,
    }
}
