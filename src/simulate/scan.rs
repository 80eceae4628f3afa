//! One scan: the part on the belt, seen by the rig, with the label of every point and the truth of the pose.
//!
//! Rays run straight down on the pixels of the image plane (a fused depth map); a place is measured when both cameras of
//! one of the two bars see it. Points on the belt and on the part get the rig's noise; the sheet's cut faces are seen
//! where they look up far enough.

use super::blank::Uv;
use super::field::SmoothField;
use super::placing::{PoseChoice, across, put_down, scan_from_belt, signed, unit};
use super::rig::{RigModel, Sampling, Stream, stream};
use super::standing::{InView, Neighbour, Standing, stand_beside};
use super::subject::Subject;
use super::truth::ScanTruth;
use crate::geometry::{CadFromScan, Isometry3, Point3, PointCloud, Vector3};
use crate::plan::{Geometry, Side};
use crate::run::{Cancelled, RunContext};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Poisson, StandardNormal};
use rayon::prelude::*;

/// Pixel rows a chunk of work.
const CHUNK_ROWS: usize = 16;
/// Where the flash stands, belt frame, for rigs of 600 mm height; it scales with the height.
const FLASH: [f64; 3] = [-450.0, 300.0, 650.0];
/// Where the flash does not reach: share of the light, and by how much the noise grows. The rig's white walls light the part
/// from all sides, but hardly the belt under its holes and edges.
const SHADOW_ON_PART: (f64, f64) = (0.55, 1.25);
const SHADOW_ON_BELT: (f64, f64) = (0.22, 3.0);

/// `l` in the covariance exp(-r² / 2 l²) of the measuring system's errors: what is measured from one window moves together, features
/// 50 mm apart have nothing in common.
const DISTORTION_LENGTH_MM: f64 = 20.0;

/// What a simulated point really is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Label {
    /// The part (either face, or the sheet's cut face).
    Part,
    /// Something else beside the part.
    Other,
    /// The belt.
    Belt,
    /// A point at a wrong depth.
    Outlier,
    /// A wrong point hanging in a hole.
    Clutter,
}

/// A scan with all that is known about it.
#[derive(Debug, Clone)]
pub struct SimulatedScan {
    /// The cloud, mm, scan frame, with colours.
    pub cloud: PointCloud,
    /// What each point is.
    pub labels: Vec<Label>,
    /// The exact answers.
    pub truth: ScanTruth,
}

/// Where everything stands.
struct Scene<'a> {
    rig: &'a RigModel,
    subject: &'a Subject,
    /// The part, then its neighbours.
    standing: Vec<Standing<'a>>,
    scan_from_belt: Isometry3,
    /// The measured area.
    view: (Uv, Uv),
    cameras: [Point3; 4],
    flash: Point3,
    depth: Option<SmoothField>,
    /// Along x, y and z of the belt frame.
    distortion: Option<[SmoothField; 3]>,
    texture: SmoothField,
    wear: SmoothField,
    wear_limit: f64,
    blots: Vec<Uv>,
}

/// A point in the belt frame on its way into the cloud.
struct Sample {
    place: Point3,
    colour: [u8; 3],
    label: Label,
}

/// Simulates one scan. The same subject, rig, pose and seed give the same scan, with any number of threads.
pub fn simulate_scan(
    subject: &Subject,
    rig: &RigModel,
    pose: &PoseChoice,
    seed: u64,
    run: &RunContext,
) -> Result<SimulatedScan, Cancelled> {
    simulate_scene((subject, pose), &[], InView::ThePart, rig, seed, run)
}

/// The same with other things beside the part; the truth is that of the part alone.
pub fn simulate_scene(
    (subject, pose): (&Subject, &PoseChoice),
    neighbours: &[Neighbour],
    in_view: InView,
    rig: &RigModel,
    seed: u64,
    run: &RunContext,
) -> Result<SimulatedScan, Cancelled> {
    let seen = subject.with_rims_shifted(rig.edge_shift_mm);
    let scene = Scene::new((&seen, pose), neighbours, in_view, rig, seed);
    run.check()?;
    let rows = ((scene.view.1.y - scene.view.0.y) / rig.pixel_mm()).ceil() as usize;
    let chunks: Result<Vec<Vec<Sample>>, Cancelled> = (0..rows.div_ceil(CHUNK_ROWS))
        .into_par_iter()
        .map(|chunk| {
            run.check()?;
            let rows = chunk * CHUNK_ROWS..rows.min((chunk + 1) * CHUNK_ROWS);
            Ok(scene.chunk(rows, &mut stream(seed, Stream::Chunk(chunk))))
        })
        .collect();
    let mut samples: Vec<Sample> = chunks?.into_iter().flatten().collect();
    samples.extend(scene.clutter(&mut stream(seed, Stream::Clutter)));
    let cad_from_belt = scene.standing[0].cad_from_belt;
    let cad_from_scan = CadFromScan::new(cad_from_belt * scene.scan_from_belt.inverse());
    let up_cad = cad_from_belt * Vector3::z_axis();
    let side = if subject.upper_direction().dot(&up_cad) >= 0.0 { Side::Top } else { Side::Bottom };
    let truth = ScanTruth::new(subject, cad_from_scan, side, seed);
    Ok(SimulatedScan {
        cloud: PointCloud {
            positions: samples.iter().map(|s| scene.in_scan(&s.place)).collect(),
            colours: Some(samples.iter().map(|s| s.colour).collect()),
            ..PointCloud::default()
        },
        labels: samples.iter().map(|s| s.label).collect(),
        truth,
    })
}

impl<'a> Scene<'a> {
    fn new(
        (subject, pose): (&'a Subject, &PoseChoice),
        neighbours: &[Neighbour<'a>],
        in_view: InView,
        rig: &'a RigModel,
        seed: u64,
    ) -> Self {
        let own = put_down(subject, rig, pose, &mut stream(seed, Stream::Pose));
        let mut standing = vec![Standing::new(subject, rig, own)];
        for neighbour in neighbours {
            standing.push(stand_beside(&standing[standing.len() - 1], neighbour, rig));
        }
        let seen = if in_view == InView::Everything { standing.len() } else { 1 };
        let low = standing[..seen].iter().fold(standing[0].footprint.0, |low, s| low.inf(&s.footprint.0));
        let high = standing[..seen].iter().fold(standing[0].footprint.1, |high, s| high.sup(&s.footprint.1));
        let margin = nalgebra::Vector2::repeat(rig.belt_margin_mm);
        let view = (low - margin, high + margin);
        let half = 0.5 * rig.base_mm;
        let camera = |x: f64, y: f64| Point3::new(x * half, y * half, rig.distance_mm);
        let correlated = rig.depth_correlated_variance_share > 0.0 && rig.correlation_length_mm > 0.0;
        let wear = SmoothField::new(seed, Stream::WearRow, view.0, view.1, 25.0);
        Self {
            rig,
            subject,
            standing,
            scan_from_belt: scan_from_belt(rig),
            view,
            cameras: [camera(-1.0, -1.0), camera(1.0, -1.0), camera(-1.0, 1.0), camera(1.0, 1.0)],
            flash: Point3::from(Vector3::from(FLASH) * (rig.distance_mm / 600.0)),
            depth: correlated
                .then(|| SmoothField::new(seed, Stream::DepthRow, view.0, view.1, rig.correlation_length_mm)),
            distortion: (rig.distortion_mm > 0.0).then(|| {
                let rows: [fn(usize) -> Stream; 3] = [
                    |row| Stream::DistortionRow(0, row),
                    |row| Stream::DistortionRow(1, row),
                    |row| Stream::DistortionRow(2, row),
                ];
                rows.map(|of_row| SmoothField::new(seed, of_row, view.0, view.1, DISTORTION_LENGTH_MM))
            }),
            texture: SmoothField::new(seed, Stream::TextureRow, view.0, view.1, 2.0),
            wear_limit: if rig.belt_wear_share > 0.0 {
                wear.quantile(1.0 - rig.belt_wear_share)
            } else {
                f64::INFINITY
            },
            wear,
            blots: blots(rig, view, &mut stream(seed, Stream::Blots)),
        }
    }

    /// The points of some pixel rows.
    fn chunk(&self, rows: std::ops::Range<usize>, rng: &mut ChaCha8Rng) -> Vec<Sample> {
        let pixel = self.rig.pixel_mm();
        let columns = ((self.view.1.x - self.view.0.x) / pixel).ceil() as usize;
        let corner = |i: f64, j: f64| self.view.0 + nalgebra::Vector2::new(i, j) * pixel;
        let mut samples = Vec::with_capacity(rows.len() * columns);
        match self.rig.sampling {
            Sampling::Lattice { jitter } => {
                for j in rows {
                    for i in 0..columns {
                        let (a, b) = (signed(rng) * jitter, signed(rng) * jitter);
                        let q = corner(i as f64 + 0.5 + a, j as f64 + 0.5 + b);
                        samples.extend(self.sample(&q, rng));
                    }
                }
            }
            Sampling::Poisson => {
                let mean = (rows.len() * columns) as f64;
                let count = Poisson::new(mean).map_or(0.0, |p| p.sample(rng)) as usize;
                for _ in 0..count {
                    let (a, b) = (0.5 * (signed(rng) + 1.0), 0.5 * (signed(rng) + 1.0));
                    let q = corner(a * columns as f64, rows.start as f64 + b * rows.len() as f64);
                    samples.extend(self.sample(&q, rng));
                }
            }
        }
        samples
    }

    /// The point on one pixel's ray, if it is measured.
    fn sample(&self, q: &Uv, rng: &mut ChaCha8Rng) -> Option<Sample> {
        // Drawn before anything is decided: a point's numbers do not depend on what the ray meets.
        let lost = unit(rng) < self.rig.dropout;
        let outlier = unit(rng) < self.rig.outlier_share;
        let outlier_depth = signed(rng) * self.rig.outlier_spread_mm;
        let [nx, ny, nz, tint]: [f64; 4] = std::array::from_fn(|_| StandardNormal.sample(rng));
        if lost || self.blots.iter().any(|b| (b - q).norm_squared() < self.rig.missing_radius_mm.powi(2)) {
            return None;
        }
        let (place, normal, label, rounded_off) = self.surface(q)?;
        if !self.is_measured(&place, &normal, label) {
            return None;
        }
        let lit = !self.is_hidden(&place, &self.flash);
        let share = self.rig.depth_correlated_variance_share;
        let depth = match &self.depth {
            Some(field) => field.at(q) * share.sqrt() + nz * (1.0 - share).sqrt(),
            None => nz,
        };
        let plane = self.rig.noise_plane_mm;
        let noise = Vector3::new(nx * plane, ny * plane, depth * self.rig.noise_depth_mm);
        let (light, noisier) = match label {
            _ if lit => (1.0, 1.0),
            Label::Part | Label::Other => SHADOW_ON_PART,
            _ => SHADOW_ON_BELT,
        };
        let noise = noise * noisier;
        let colour = self.colour(q, &normal, label, light, tint);
        let (off, label) = if outlier { (outlier_depth, Label::Outlier) } else { (0.0, label) };
        let place = place - normal * rounded_off + noise + Vector3::z() * off;
        let place = self.distortion.as_ref().map_or(place, |fields| {
            place + Vector3::from(fields.each_ref().map(|field| field.at(q))) * self.rig.distortion_mm
        });
        Some(Sample { place, colour, label })
    }

    /// A place of the belt frame as the scan has it: lengths are off by the scale's error about the part's middle, so that the pose is
    /// that without the error.
    fn in_scan(&self, place: &Point3) -> Point3 {
        let scale_error = self.rig.scale_error;
        if scale_error == 0.0 {
            return self.scan_from_belt * place;
        }
        let part = &self.standing[0];
        let middle = nalgebra::center(&part.footprint.0, &part.footprint.1);
        let middle = Point3::new(middle.x, middle.y, 0.5 * part.top_mm);
        self.scan_from_belt * (place + (place - middle) * scale_error)
    }

    /// What the ray down on `q` meets: place and normal in the belt frame, and how far the rounded rim lies below that place
    /// (mm; it is as visible as the sharp one); `None` on a cut face that is not seen.
    fn surface(&self, q: &Uv) -> Option<(Point3, Vector3, Label, f64)> {
        let labels = std::iter::once(Label::Part).chain(std::iter::repeat(Label::Other));
        let met = self.standing.iter().zip(labels).filter_map(|(s, label)| Some((s.met(q, self.rig)?, label)));
        let highest = met.reduce(|a, b| if b.0.place.z > a.0.place.z { b } else { a });
        let Some((met, label)) = highest else {
            return Some((Point3::new(q.x, q.y, 0.0), Vector3::z(), Label::Belt, 0.0));
        };
        met.seen.map(|(normal, rounded_off)| (met.place, normal, label, rounded_off))
    }

    /// Whether both cameras of a bar see the place.
    fn is_measured(&self, place: &Point3, normal: &Vector3, label: Label) -> bool {
        let flattest = self.rig.incidence_max_deg.to_radians().cos();
        let sees = |camera: &Point3| {
            let towards = (camera - place).normalize();
            (label == Label::Belt || towards.dot(normal) > flattest) && !self.is_hidden(place, camera)
        };
        (sees(&self.cameras[0]) && sees(&self.cameras[1])) || (sees(&self.cameras[2]) && sees(&self.cameras[3]))
    }

    /// Whether anything stands between a place and a viewer.
    fn is_hidden(&self, place: &Point3, viewer: &Point3) -> bool {
        self.standing.iter().any(|s| s.hides(place, viewer))
    }

    fn colour(&self, q: &Uv, normal: &Vector3, label: Label, light: f64, tint: f64) -> [u8; 3] {
        let worn = label == Label::Belt && self.wear.at(q) > self.wear_limit;
        let base = if label == Label::Belt && !worn { self.rig.belt_colour } else { self.rig.part_colour };
        let shade = if label == Label::Belt { 1.0 } else { 0.75 + 0.25 * normal.z.abs() };
        let grain = 5.0 * self.texture.at(q) + 3.0 * tint;
        base.map(|c| ((f64::from(c) * shade + grain) * light).round().clamp(0.0, 255.0) as u8)
    }

    /// Wrong points in the plan's holes and slots, within 0.3 mm of the sheet.
    fn clutter(&self, rng: &mut ChaCha8Rng) -> Vec<Sample> {
        let openings = self.subject.actual_features.iter().chain(&self.subject.actual_comparison);
        let mut samples = Vec::new();
        for geometry in openings {
            for _ in 0..self.rig.clutter_per_hole {
                let (a, b, depth) = (signed(rng), signed(rng), 0.3 * signed(rng));
                let Some(place) = in_opening(geometry, a, b, depth) else { continue };
                let place = self.standing[0].belt_from_cad * self.subject.displaced(&place);
                let colour = self.colour(&place.xy(), &Vector3::z(), Label::Clutter, SHADOW_ON_PART.0, 0.0);
                samples.push(Sample { place, colour, label: Label::Clutter });
            }
        }
        samples
    }
}

/// A place within an opening, for coordinates -1..1 in the sheet and a depth; `None` outside or for other geometry.
fn in_opening(geometry: &Geometry, a: f64, b: f64, depth_mm: f64) -> Option<Point3> {
    match geometry {
        Geometry::Hole { centre, axis, diameter_mm, .. } => {
            let x = across(axis);
            let y = axis.cross(&x);
            (a * a + b * b < 1.0).then(|| centre + (x * a + y * b) * (0.5 * diameter_mm) + axis.into_inner() * depth_mm)
        }
        Geometry::Slot { centre, axis, direction, length_mm, width_mm } => {
            let (x, y) = (0.5 * length_mm * a, 0.5 * width_mm * b);
            let past = (x.abs() - 0.5 * (length_mm - width_mm)).max(0.0);
            let across = axis.cross(direction);
            (past.hypot(y) < 0.5 * width_mm)
                .then(|| centre + direction.into_inner() * x + across * y + axis.into_inner() * depth_mm)
        }
        _ => None,
    }
}

/// Middles of the blots: as many as cover the asked share of the view, overlaps counted.
fn blots(rig: &RigModel, (low, high): (Uv, Uv), rng: &mut ChaCha8Rng) -> Vec<Uv> {
    let area = (high.x - low.x) * (high.y - low.y);
    let one = std::f64::consts::PI * rig.missing_radius_mm.powi(2);
    let share = rig.missing_share.clamp(0.0, 0.95);
    let count = if one > 0.0 { (-(1.0 - share).ln() * area / one).round() as usize } else { 0 };
    let middle = nalgebra::center(&low, &high);
    let half = 0.5 * (high - low);
    (0..count).map(|_| middle + nalgebra::Vector2::new(signed(rng) * half.x, signed(rng) * half.y)).collect()
}

#[cfg(test)]
mod tests;
