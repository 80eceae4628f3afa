//! The measuring rig: four cameras above a conveyor belt, and what they do to a surface.

use crate::geometry::UnitVector3;
use crate::plan::rig::SHARED_DEPTH_VARIANCE;
use crate::plan::{Plan, Rig};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// How the places on the surface are chosen, seen along the viewing direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sampling {
    /// One place a ground pixel, moved at random by up to this share of the pixel either way: a depth map.
    Lattice {
        /// 0 = strict lattice, 0.5 = anywhere in the pixel.
        jitter: f64,
    },
    /// Places independent of each other.
    Poisson,
}

/// The rig and the belt. Lengths in mm in the belt frame: z up, z = 0 on the belt, origin below the middle of the cameras.
#[derive(Debug, Clone, PartialEq)]
pub struct RigModel {
    /// Points a mm² of the image plane (the belt seen from above) that remain after dropout. The paper's cloud has 26.
    pub density_per_mm2: f64,
    /// How the places are chosen.
    pub sampling: Sampling,
    /// Standard deviation of a point within the image plane, along each of its axes.
    pub noise_plane_mm: f64,
    /// Standard deviation of a point along the viewing direction.
    pub noise_depth_mm: f64,
    /// Share of the depth *variance* that neighbouring points have in common.
    pub depth_correlated_variance_share: f64,
    /// `l` in the covariance exp(-r² / 2 l²) of the common part; r in the image plane.
    pub correlation_length_mm: f64,
    /// Share of pixels without a point, at random.
    pub dropout: f64,
    /// Share of points at a wrong depth.
    pub outlier_share: f64,
    /// Outliers lie up to this far above or below their place, evenly spread.
    pub outlier_spread_mm: f64,
    /// Wrong points hanging in each hole and slot of the plan, near the sheet.
    pub clutter_per_hole: usize,
    /// Trimmed edges and rims are rounded with this radius.
    pub rim_rounding_mm: f64,
    /// Whether the sheet's cut faces give points where they look up far enough. Off: in a depth map they are a few pixels of
    /// glare. On: trimmed edges of flanges that bend towards the camera get points below the edge, as a sharp sensor sees.
    pub cut_faces_seen: bool,
    /// Share of the view lost in blots of `missing_radius_mm` (oil, reflections).
    pub missing_share: f64,
    /// Radius of those blots.
    pub missing_radius_mm: f64,
    /// The belt is seen this far around the part's outermost points.
    pub belt_margin_mm: f64,
    /// The part's lowest point lies this deep in the (soft) belt; 0 = on it.
    pub belt_sink_mm: f64,
    /// Colour of the unworn belt.
    pub belt_colour: [u8; 3],
    /// Share of the belt worn to the part's colour.
    pub belt_wear_share: f64,
    /// Colour of the part.
    pub part_colour: [u8; 3],
    /// The cameras' height above the belt.
    pub distance_mm: f64,
    /// Side of the square in whose corners the cameras stand.
    pub base_mm: f64,
    /// A camera sees a surface up to this angle between its line of sight and the surface's normal.
    pub incidence_max_deg: f64,
    /// Where the camera looks, scan frame.
    pub view_direction: UnitVector3,
    /// The belt is not exactly square to the view: by this angle.
    pub camera_tilt_deg: f64,
    /// Parts lie up to this far from the middle of the rig, along x and y.
    pub wander_mm: f64,
    /// Relative error of the scale: lengths of the scan are longer by this share.
    pub scale_error: f64,
    /// Trimmed edges and rims are seen so far outwards of where they are, in the sheet: the part looks larger, its openings smaller.
    pub edge_shift_mm: f64,
    /// Standard deviation, along each axis, by which the measuring system misplaces what lies together within 10 mm; places
    /// 50 mm apart are misplaced independently of each other.
    pub distortion_mm: f64,
}

impl Default for RigModel {
    /// The rig of the paper at a quarter of its pixels.
    fn default() -> Self {
        Self {
            density_per_mm2: 26.0,
            sampling: Sampling::Lattice { jitter: 0.15 },
            noise_plane_mm: 0.05,
            noise_depth_mm: 0.12,
            depth_correlated_variance_share: 0.2,
            correlation_length_mm: 0.5,
            dropout: 0.2,
            outlier_share: 0.002,
            outlier_spread_mm: 5.0,
            clutter_per_hole: 10,
            rim_rounding_mm: 0.1,
            cut_faces_seen: false,
            missing_share: 0.0,
            missing_radius_mm: 3.0,
            belt_margin_mm: 40.0,
            belt_sink_mm: 0.0,
            belt_colour: [58, 74, 69],
            belt_wear_share: 0.15,
            part_colour: [150, 152, 155],
            distance_mm: 600.0,
            base_mm: 200.0,
            incidence_max_deg: 70.0,
            view_direction: nalgebra::Vector3::z_axis(),
            camera_tilt_deg: 1.5,
            wander_mm: 40.0,
            scale_error: 0.0,
            edge_shift_mm: 0.0,
            distortion_mm: 0.0,
        }
    }
}

impl RigModel {
    /// The same rig without noise, dropout, outliers, clutter and rounding: every point lies on the surface it shows.
    pub fn perfect(density_per_mm2: f64) -> Self {
        Self {
            density_per_mm2,
            noise_plane_mm: 0.0,
            noise_depth_mm: 0.0,
            dropout: 0.0,
            outlier_share: 0.0,
            clutter_per_hole: 0,
            rim_rounding_mm: 0.0,
            ..Self::default()
        }
    }

    /// The rig that a plan describes, by the formulas of [`crate::plan::rig`]: noise in the plane and in depth are its accuracies, the
    /// density is that of the paper's cloud for a spacing like the paper's. Belt colour and viewing direction are the plan's, too.
    pub fn of_plan(plan: &Plan) -> Self {
        let mut model = Self::default();
        if let Some(rig) = &plan.rig {
            let pixels = rig.spacing_mm() / Rig::PAPER.spacing_mm();
            let density = model.density_per_mm2 / (pixels * pixels);
            model = model.with_density(density);
            model.correlation_length_mm = rig.correlation_length_mm();
            model.depth_correlated_variance_share = SHARED_DEPTH_VARIANCE;
            model.noise_plane_mm = rig.planar_accuracy_mm();
            model.noise_depth_mm = rig.depth_accuracy_mm();
            (model.distance_mm, model.base_mm) = (rig.distance_mm, rig.base_mm);
        }
        if let Some(colour) = plan.background.belt_colours.first() {
            model.belt_colour = *colour;
        }
        model.view_direction = plan.scans.view_direction.unwrap_or(model.view_direction);
        model
    }

    /// The same rig with another density; the clutter in holes keeps its proportion, down to one point.
    #[must_use]
    pub fn with_density(self, density_per_mm2: f64) -> Self {
        let clutter = self.clutter_per_hole as f64 * density_per_mm2 / self.density_per_mm2;
        let clutter_per_hole = if self.clutter_per_hole == 0 { 0 } else { clutter.round().max(1.0) as usize };
        Self { density_per_mm2, clutter_per_hole, ..self }
    }

    /// Side of a ground pixel, so that the asked density remains after dropout.
    pub fn pixel_mm(&self) -> f64 {
        ((1.0 - self.dropout) / self.density_per_mm2).sqrt()
    }
}

/// What a stream of random numbers is for; each use has its own, so that none depends on how many another took.
#[derive(Debug, Clone, Copy)]
pub(super) enum Stream {
    Pose,
    Blots,
    Clutter,
    Chunk(usize),
    DepthRow(usize),
    TextureRow(usize),
    WearRow(usize),
    SystemErrors,
    /// Axis and row.
    DistortionRow(u8, usize),
}

/// The random numbers for one use.
pub(super) fn stream(seed: u64, of: Stream) -> ChaCha8Rng {
    let (kind, index) = match of {
        Stream::Pose => (0, 0),
        Stream::Blots => (1, 0),
        Stream::Clutter => (2, 0),
        Stream::Chunk(index) => (3, index),
        Stream::DepthRow(index) => (4, index),
        Stream::TextureRow(index) => (5, index),
        Stream::WearRow(index) => (6, index),
        Stream::SystemErrors => (7, 0),
        Stream::DistortionRow(axis, index) => (8 + u64::from(axis), index),
    };
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream((kind << 48) | index as u64);
    rng
}
