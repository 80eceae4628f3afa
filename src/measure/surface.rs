//! A point of the surface: where the line through the nominal place meets the measured sheet.
//!
//! The heights of the points above the CAD face are told along the plan's direction, a quadratic is fitted to them in a
//! disc around the line, and its height on the line is the deviation. Telling heights along the direction (and not along the
//! face's normal) makes the quadratic's value on the line the intersection itself, at any tilt.
//!
//! The disc is large and the surface bends with the deviation, rather than a small disc and a plane: of errors that
//! neighbours have in common only area averages out, a quadratic needs twice the plane's radius for the same noise, and a bend of
//! radius R leaves it no bias where it leaves the plane `radius² / 4R`. Where the deviation changes faster than a
//! quadratic can follow, the middle of the disc stands off it, and the disc shrinks.

use super::bend::{Bend, fit_bend};
use super::card::Card;
use super::frame::{FeatureFrame, clear_of_belt, or_too_near_the_belt};
use super::layer::{Layer, fit_layer, height, most_frequent_height};
use super::patch::{CadPatch, FINE_MM, face_height};
use super::place::{Place, noise_mm};
use super::sight::{check_in_sight, is_of_another_wall, own_heights};
use super::windows::Windows;
use super::{Local, NotFound};
use crate::geometry::{Point3, UnitVector3, Vector3};
use crate::plan::{SurfaceFit, SurfaceMethod};

/// A point of the surface as found. CAD frame, on the CAD's own face.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceFound {
    /// Where the line meets the measured surface.
    pub position: Point3,
    /// Normal of the measured surface there, on the plan's side.
    pub normal: Vector3,
    /// Along the plan's direction.
    pub deviation_mm: f64,
    /// k = 1, from the scatter of the points, what neighbours' errors have in common, and what the middle of the window and the
    /// points at the place itself stand off the fitted surface.
    pub standard_uncertainty_mm: f64,
    /// Radius of the window.
    pub window_mm: f64,
    /// Rms of the points about the fitted surface.
    pub rms_mm: f64,
    /// Points of the fit.
    pub points_used: usize,
}

/// Fewest points of a fit.
pub const NEEDED: usize = 12;
/// The plan's direction must not lean over more than this from the normal, degrees.
const MOST_LEAN_DEG: f64 = 60.0;

/// Measures where the line through `position` along `direction` meets the sheet, at most `search_mm` away.
pub fn surface(
    local: &Local,
    position: &Point3,
    direction: &UnitVector3,
    search_mm: f64,
) -> Result<SurfaceFound, NotFound> {
    surface_with_card(local, position, direction, search_mm, &SurfaceFit::default(), &mut Card::default())
}

/// The same as the plan asks for it, with the card of what was asked on the way.
pub fn surface_with_card(
    local: &Local,
    position: &Point3,
    direction: &UnitVector3,
    search_mm: f64,
    how: &SurfaceFit,
    card: &mut Card,
) -> Result<SurfaceFound, NotFound> {
    let found = find_surface(local, position, direction, search_mm, how, card);
    or_too_near_the_belt(local, position, found, card)
}

fn find_surface(
    local: &Local,
    position: &Point3,
    direction: &UnitVector3,
    search_mm: f64,
    how: &SurfaceFit,
    card: &mut Card,
) -> Result<SurfaceFound, NotFound> {
    let side = local.face.side;
    let near =
        local.face.closest(position, f64::INFINITY).ok_or_else(|| NotFound::new("the CAD has no face here", 0))?;
    let normal = UnitVector3::new_unchecked(near.normal.into_inner() * side.sign());
    // A direction that points into the sheet is the plan's to choose; only how far it leans matters.
    let cosine = normal.dot(direction).abs();
    let angle = cosine.clamp(0.0, 1.0).acos().to_degrees();
    if !card.at_most("lean of the plan's direction from the sheet's normal", "deg", angle, MOST_LEAN_DEG) {
        return Err(NotFound::new(
            format!("the plan's direction leans {angle:.0}° away from the sheet's normal, 60° are allowed"),
            0,
        ));
    }
    let frame = FeatureFrame::new(local, *position, &normal, direction, None);
    if face_height(local, &frame, [0.0; 2], search_mm + 2.0).is_none() {
        return Err(NotFound::new("the CAD has no surface here", 0));
    }
    check_in_sight(local, &frame, &[[0.0; 2]])?;
    let cad_edge_mm = local.face.edge_distance_mm(&frame.seen);
    card.cad_edge_mm = Some(cad_edge_mm);
    let wanted_mm = window_radius_mm(how, local.scan.spacing_mm, cad_edge_mm);
    let place = Place::gather(local, &frame, wanted_mm, search_mm, card)?;
    place.check_gaps(wanted_mm, &|p| face_height(local, &frame, p, search_mm + 2.0).is_some(), card)?;
    let found = match how.method {
        SurfaceMethod::Plane => in_plane(local, &frame, &place, wanted_mm, search_mm, card)?,
        SurfaceMethod::Local if how.radius_mm.is_some() => {
            let window = Window::gather(local, &frame, wanted_mm, search_mm);
            let (found, lack) = measure_in(&frame, &window, &place, card)?;
            found.with_lack(&lack)
        }
        SurfaceMethod::Local => in_shrinking_windows(local, &frame, &place, wanted_mm, search_mm, card)?,
    };
    card.window_mm = Some(found.window_mm);
    card.normal = Some(found.normal);
    clear_of_belt(local, &[frame.on_seen_face([0.0, 0.0, found.deviation_mm])], found.points_used, card)?;
    Ok(found)
}

impl SurfaceFound {
    /// What the middle of the window stands off the fitted surface is uncertain.
    fn with_lack(self, lack: &Lack) -> Self {
        let standard_uncertainty_mm = self.standard_uncertainty_mm.hypot(lack.mean_mm);
        Self { standard_uncertainty_mm, ..self }
    }
}

/// A plane through the points themselves: heights above a plane across the direction in place of the CAD's.
fn in_plane(
    local: &Local,
    frame: &FeatureFrame,
    place: &Place,
    radius_mm: f64,
    search_mm: f64,
    card: &mut Card,
) -> Result<SurfaceFound, NotFound> {
    let over_cad = CadPatch::sample(local, frame, &disc_places(radius_mm), search_mm + 2.0 + radius_mm, FINE_MM);
    // Which points belong to the sheet is told by the CAD here, too; what is fitted is where they are.
    let gathered = frame.gather(local, [0.0; 2], radius_mm, search_mm + 1.8 * radius_mm);
    let own = gathered.into_iter().filter(|p| {
        let above_mm = over_cad.residual(p);
        above_mm.abs() <= search_mm && !is_of_another_wall(local, frame, p, above_mm, 0.0)
    });
    let points: Vec<[f64; 3]> = own.collect();
    let layer = layer_about_line(frame, &points, radius_mm, card)?;
    place.check_height(&|p| p[2] - height(&layer.plane, p[0], p[1]), noise_mm(&points), card)?;
    let [deviation_mm, eu, ev] = layer.plane;
    // What a plane through the CAD's own heights at these points is off the CAD: the plane has it, and the value is uncertain by it.
    let of_cad: Vec<[f64; 3]> = points.iter().map(|p| [p[0], p[1], p[2] - over_cad.residual(p)]).collect();
    let cad_mm = over_cad.at_origin();
    let bend_mm = fit_layer(&of_cad, cad_mm, NEEDED).map_or(0.0, |cad| cad.plane[0] - cad_mm);
    Ok(SurfaceFound {
        position: frame.on_own_face([0.0, 0.0, deviation_mm]),
        normal: frame.vector([-eu, -ev, 1.0]).normalize(),
        deviation_mm,
        standard_uncertainty_mm: layer.u_height_mm.hypot(bend_mm),
        window_mm: radius_mm,
        rms_mm: layer.rms_mm,
        points_used: layer.points,
    })
}

/// The surface in the largest window whose middle does not stand off it; what it stands off in the smallest is uncertain. Where
/// chance may or may not explain what it stands off, something of the window and the rest of the next smaller one: a window that switched
/// would make the value jump with single points. A smaller window that tells nothing leaves the word to the larger ones.
fn in_shrinking_windows(
    local: &Local,
    frame: &FeatureFrame,
    place: &Place,
    wanted_mm: f64,
    search_mm: f64,
    card: &mut Card,
) -> Result<SurfaceFound, NotFound> {
    let smallest_mm = SMALLEST_MM.max(SMALLEST_SPACINGS * local.scan.spacing_mm);
    let mut window = Window::with_points(local, frame, wanted_mm, search_mm);
    // A window that had to grow has no points to spare for a smaller one.
    let grown = window.radius_mm > wanted_mm;
    let before = card.clone();
    let mut told = Windows::default();
    loop {
        let smaller_mm = SHRINK * window.radius_mm;
        let last = grown || smaller_mm < smallest_mm;
        *card = before.clone();
        match measure_in(frame, &window, place, card) {
            Ok((found, lack)) => {
                let of_smaller = if last { 0.0 } else { lack.of_smaller() };
                told.push(found.with_lack(&lack), card.clone(), of_smaller);
                if of_smaller == 0.0 {
                    break;
                }
            }
            Err(not) if last && told.is_empty() => return Err(not),
            Err(_) if last => break,
            Err(_) => {}
        }
        window = Window::gather(local, frame, smaller_mm, search_mm);
    }
    let (found, of_windows) = told.together().ok_or_else(|| NotFound::new("no window tells the surface", 0))?;
    *card = of_windows;
    Ok(found)
}

/// The window's radius: in mm, and in spacings at least.
const WINDOW_MM: f64 = 5.0;
const WINDOW_SPACINGS: f64 = 6.0;
/// By what a window shrinks when its middle stands off the fitted surface, and where that ends.
const SHRINK: f64 = 0.7;
const SMALLEST_MM: f64 = 2.0;
const SMALLEST_SPACINGS: f64 = 3.6;

/// The radius of a plane's window, mm; six spacings at least. A wider one would tell more of the bend than of the place.
const PLANE_WINDOW_MM: f64 = 1.5;

/// The radius of a surface point's window, mm: the plan's, else five millimetres or six spacings, but at most half-way to the next trimmed
/// edge, unless that leaves too few points.
pub fn window_radius_mm(how: &SurfaceFit, spacing_mm: f64, cad_edge_mm: f64) -> f64 {
    let least_mm = if how.method == SurfaceMethod::Plane { PLANE_WINDOW_MM } else { WINDOW_MM };
    let wanted = least_mm.max(WINDOW_SPACINGS * spacing_mm);
    how.radius_mm.unwrap_or_else(|| wanted.min(0.5 * cad_edge_mm).max(SMALLEST_SPACINGS * spacing_mm))
}

/// The points around the line, and the CAD under them.
struct Window<'a> {
    radius_mm: f64,
    patch: CadPatch<'a>,
    /// (u, v, height above the CAD).
    points: Vec<[f64; 3]>,
}

impl<'a> Window<'a> {
    fn gather(local: &Local<'a>, frame: &'a FeatureFrame, radius_mm: f64, search_mm: f64) -> Self {
        let patch = CadPatch::sample(local, frame, &disc_places(radius_mm), search_mm + 2.0 + radius_mm, FINE_MM);
        let points = heights(local, frame, &patch, radius_mm, search_mm);
        Self { radius_mm, patch, points }
    }

    /// The points within a radius, which grows to some eleven spacings at most where there are too few.
    fn with_points(local: &Local<'a>, frame: &'a FeatureFrame, wanted_mm: f64, search_mm: f64) -> Self {
        let mut radius_mm = wanted_mm;
        loop {
            let window = Self::gather(local, frame, radius_mm, search_mm);
            if window.points.len() >= 2 * NEEDED || radius_mm > 8.0 * local.scan.spacing_mm {
                return window;
            }
            radius_mm *= 1.4;
        }
    }
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
    own_heights(local, frame, patch, &gathered, search_mm)
}

/// The surface as found, and what the middle of the window stands off it.
fn measure_in(
    frame: &FeatureFrame,
    window: &Window,
    place: &Place,
    card: &mut Card,
) -> Result<(SurfaceFound, Lack), NotFound> {
    let (points, patch, radius) = (&window.points, &window.patch, window.radius_mm);
    let layer = layer_about_line(frame, points, radius, card)?;
    let (middle, lack) = middle(points, &layer, radius);
    let off = |p: &[f64; 3]| patch.residual(p) - middle.height_at(p[0], p[1]);
    let u_place_mm = place.check_height(&off, noise_mm(points), card)?;
    card.residual_mm = Some(middle.sigma_mm);
    let deviation_mm = middle.height_mm + patch.at_origin();
    let cad = patch.slopes();
    let slope = [middle.slope[0] + cad[0], middle.slope[1] + cad[1]];
    let found = SurfaceFound {
        position: frame.on_own_face([0.0, 0.0, deviation_mm]),
        normal: frame.vector([-slope[0], -slope[1], 1.0]).normalize(),
        deviation_mm,
        standard_uncertainty_mm: middle.standard_uncertainty_mm.hypot(u_place_mm),
        window_mm: radius,
        rms_mm: middle.rms_mm,
        points_used: middle.points,
    };
    Ok((found, lack))
}

/// The plane through the heights in a window about the line.
fn layer_about_line(
    frame: &FeatureFrame,
    points: &[[f64; 3]],
    radius_mm: f64,
    card: &mut Card,
) -> Result<Layer, NotFound> {
    card.window_mm = Some(radius_mm);
    card.covered = Some(covered_sectors(points));
    if !card.at_least("points in the window", "", points.len() as f64, NEEDED as f64) {
        return Err(NotFound::too_few(points.len(), NEEDED));
    }
    card.spacing_mm = Some(radius_mm * (std::f64::consts::PI / points.len() as f64).sqrt());
    let heights: Vec<f64> = points.iter().map(|p| p[2]).collect();
    let scattered = || NotFound::new("the points within the window lie on no common surface", points.len());
    let start = most_frequent_height(&heights, frame.outward).ok_or_else(scattered)?;
    let layer = fit_layer(points, start, NEEDED).ok_or_else(scattered)?;
    card.residual_mm = Some(layer.sigma_mm);
    // Were the points spread evenly around the line, its height would be as certain as their mean: 1 / points. Five times
    // that variance means that they stand beside it.
    let spread = layer.covariance[(0, 0)] * layer.points as f64 / (layer.sigma_mm * layer.sigma_mm);
    if !card.at_most("variance of the height over that of points all around", "", spread, 5.0) {
        let reason = format!("the points stand to one side of the place, over a window of {radius_mm:.1} mm");
        return Err(NotFound::new(reason, points.len()));
    }
    Ok(layer)
}

/// Share of 24 sectors around the line in which points stand.
fn covered_sectors(points: &[[f64; 3]]) -> f64 {
    const SECTORS: usize = 24;
    let mut seen = [false; SECTORS];
    for p in points {
        let turn = p[1].atan2(p[0]) / std::f64::consts::TAU + 0.5;
        seen[((turn * SECTORS as f64) as usize).min(SECTORS - 1)] = true;
    }
    seen.iter().filter(|s| **s).count() as f64 / SECTORS as f64
}

/// The measured surface around the line.
pub(super) struct Middle {
    /// Height above the CAD.
    pub height_mm: f64,
    /// Slopes along u and v against the CAD.
    pub slope: [f64; 2],
    /// Coefficients of u², uv, v².
    bend: [f64; 3],
    /// k = 1.
    pub standard_uncertainty_mm: f64,
    /// Standard deviation of the points about it.
    sigma_mm: f64,
    /// By what a variance is larger than if every point's error were its own.
    inflation: f64,
    /// Of the points with weight.
    pub rms_mm: f64,
    /// Points with weight.
    pub points: usize,
    /// Points further off than this have no weight.
    width_mm: f64,
}

impl Middle {
    fn of_plane(layer: &Layer) -> Self {
        let [height_mm, eu, ev] = layer.plane;
        Self {
            height_mm,
            slope: [eu, ev],
            bend: [0.0; 3],
            standard_uncertainty_mm: layer.u_height_mm,
            sigma_mm: layer.sigma_mm,
            inflation: layer.inflation(),
            rms_mm: layer.rms_mm,
            points: layer.points,
            width_mm: layer.width_mm,
        }
    }

    fn of_bend(bend: &Bend) -> Self {
        Self {
            height_mm: bend.height_mm,
            slope: bend.slope,
            bend: bend.second,
            standard_uncertainty_mm: bend.u_height_mm,
            sigma_mm: bend.sigma_mm,
            inflation: bend.inflation,
            rms_mm: bend.rms_mm,
            points: bend.points,
            width_mm: bend.width_mm,
        }
    }

    fn height_at(&self, u: f64, v: f64) -> f64 {
        let [a, b, c] = self.bend;
        self.height_mm + self.slope[0] * u + self.slope[1] * v + a * u * u + b * u * v + c * v * v
    }
}

/// Fewest points from which a bend can be told.
const NEEDED_FOR_BEND: usize = 24;
/// The middle of the window, as a share of its radius.
const MIDDLE_SHARE: f64 = 0.4;
/// Standard deviations that its mean may stand off the fitted surface by chance, which one in a hundred does, and from which on chance
/// explains nothing, less than one in 100,000.
const BY_CHANCE: f64 = 2.5;
const BEYOND_CHANCE: f64 = 4.5;

/// What the points in the middle of a window stand off the fitted surface.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Lack {
    /// Their mean, as a size, mm. Of pure noise its mean square is a little over half the variance of the fitted height; where the
    /// deviation bends too fast for the fit it is a little over half of the error on the line (0.57 of it where the fourth power
    /// is missed), so that it belongs to the uncertainty in either case.
    pub mean_mm: f64,
    /// The same in standard deviations of what noise makes of it.
    pub sigmas: f64,
}

impl Lack {
    /// How much of a smaller window is to be believed: nothing where noise explains it, all where it does not, smoothly from one to the
    /// other.
    fn of_smaller(&self) -> f64 {
        let t = ((self.sigmas - BY_CHANCE) / (BEYOND_CHANCE - BY_CHANCE)).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    }
}

/// The quadratic, or where the points do not tell one the plane; and what the middle stands off it.
/// A plane may hide as much bend as the middle's mean cannot tell, which is a part of its uncertainty.
pub(super) fn middle(points: &[[f64; 3]], layer: &Layer, radius: f64) -> (Middle, Lack) {
    let bend = if layer.points >= NEEDED_FOR_BEND { fit_bend(points, layer, NEEDED_FOR_BEND) } else { None };
    let mut middle = bend.as_ref().map_or_else(|| Middle::of_plane(layer), Middle::of_bend);
    let off = points.iter().filter(|p| p[0].hypot(p[1]) <= MIDDLE_SHARE * radius);
    let off = off.map(|p| p[2] - middle.height_at(p[0], p[1])).filter(|r| r.abs() < middle.width_mm);
    let inner: Vec<f64> = off.collect();
    if inner.len() < 4 {
        return (middle, Lack::default());
    }
    let count = inner.len() as f64;
    let mean_mm = (inner.iter().sum::<f64>() / count).abs();
    let u_mean = (middle.inflation / count).sqrt() * middle.sigma_mm;
    if bend.is_none() {
        middle.standard_uncertainty_mm = middle.standard_uncertainty_mm.hypot(u_mean);
    }
    // The fit follows the middle's noise: its own variance there, 4 / points of a quadratic and 1 / points of a plane, is missing
    // from that of the residuals' mean, 1 / (share² points).
    let followed = MIDDLE_SHARE * MIDDLE_SHARE * if bend.is_some() { 4.0 } else { 1.0 };
    let chance_mm = u_mean * (1.0 - followed).sqrt();
    // Without scatter nothing is chance, but for what rounding makes.
    let sigmas = match mean_mm > 1e-9 * radius {
        true => mean_mm / chance_mm.max(f64::MIN_POSITIVE),
        false => 0.0,
    };
    (middle, Lack { mean_mm, sigmas })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smaller_window_gains_smoothly_on_a_larger_one() {
        let share = |sigmas: f64| Lack { mean_mm: 0.0, sigmas }.of_smaller();
        assert_eq!([share(0.0), share(2.5), share(3.5), share(4.5), share(9.0)], [0.0, 0.0, 0.5, 1.0, 1.0]);
        assert_eq!(share(f64::INFINITY), 1.0);
        for k in 0..500 {
            let sigmas = 0.01 * f64::from(k);
            assert!((0.0..0.0076).contains(&(share(sigmas + 0.01) - share(sigmas))), "{sigmas}");
        }
    }

    /// What is left of exact points is rounding, and no reason for a smaller window.
    #[test]
    fn exact_points_on_a_square_are_followed_to_rounding() {
        let places = (-20..=20).flat_map(|i| (-20..=20).map(move |k| [0.25 * f64::from(i), 0.25 * f64::from(k)]));
        let inside = places.filter(|p| p[0].hypot(p[1]) <= 5.0);
        let points: Vec<[f64; 3]> = inside.map(|[u, v]| [u, v, 1e-3 * (u * u - 2.0 * v * v + u * v)]).collect();
        let layer = fit_layer(&points, 0.0, NEEDED).unwrap();
        let (middle, lack) = middle(&points, &layer, 5.0);
        assert!(lack.sigmas == 0.0 && middle.height_mm.abs() < 1e-9, "{lack:?} {}", middle.height_mm);
    }
}
