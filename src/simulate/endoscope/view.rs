//! One view: what each pixel of the camera gets of the surface.

use super::bias::SmoothVolume;
use super::calibration::{CalibratedVolume, nearest};
use super::sensor::SensorModel;
use super::surface::Surface;
use super::{Stream, stream};
use crate::geometry::{Isometry3, Point3, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// Beyond this angle neither camera nor projector sees a surface.
const GRAZING_COS: f64 = 0.26;
/// Images of the highest frequency, from which a and b are told.
const PHASE_STEPS: f64 = 8.0;
/// Light that is left at the rim of the image.
const RIM_LIGHT: f64 = 0.4;

/// A view with the truth of every point.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SimulatedView {
    /// Points as measured, view frame.
    pub positions: Vec<Point3>,
    /// Row and column of each.
    pub pixels: Vec<[u32; 2]>,
    /// Background, of full scale 1.
    pub a: Vec<f32>,
    /// Amplitude of the fringes.
    pub b: Vec<f32>,
    /// Standard deviation over the phase shifts.
    pub sigma_i: Vec<f32>,
    /// Distance to the camera's nearest calibrated feature.
    pub d_cal: Vec<f32>,
    /// The same of the projector.
    pub d_cal_projector: Vec<f32>,
    /// Reprojection error of the camera's nearest feature, pixels.
    pub reprojection: Vec<f32>,
    /// True error along the ray from the camera, all parts: the true place is that much nearer to the camera.
    pub error: Vec<f32>,
    /// Its smooth part.
    pub bias: Vec<f32>,
}

/// What a pixel gave.
struct Reading {
    position: Point3,
    pixel: [u32; 2],
    signal: [f64; 3],
    near: [f64; 3],
    error: [f64; 2],
}

/// The sensor with its calibration, ready to look.
#[derive(Debug, Clone)]
pub(super) struct Eye<'a> {
    pub sensor: &'a SensorModel,
    pub volume: &'a CalibratedVolume,
    pub bias: &'a SmoothVolume,
}

impl Eye<'_> {
    /// View number `index` of a surface from a pose.
    pub fn look(&self, surface: &Surface, world_from_view: &Isometry3, seed: u64, index: usize) -> SimulatedView {
        let rows: Vec<Vec<Reading>> = (0..self.sensor.pixels)
            .into_par_iter()
            .map(|row| {
                let mut rng = stream(seed, Stream::Row(index, row));
                let pixel = |column| self.pixel(surface, world_from_view, [row, column], &mut rng);
                (0..self.sensor.pixels).filter_map(pixel).collect()
            })
            .collect();
        let mut view = SimulatedView::default();
        rows.into_iter().flatten().for_each(|reading| view.push(&reading));
        view
    }

    fn pixel(&self, surface: &Surface, pose: &Isometry3, pixel: [u32; 2], rng: &mut ChaCha8Rng) -> Option<Reading> {
        let s = self.sensor;
        // Every pixel takes its numbers, seen or not: neighbours keep theirs whatever lies before this one.
        let mut normal = || -> f64 { StandardNormal.sample(rng) };
        let [n_a, n_b, n_depth] = [normal(), normal(), normal()];
        let [chance, off] = [rng.random::<f64>(), 2.0 * rng.random::<f64>() - 1.0];
        let middle = 0.5 * f64::from(s.pixels - 1);
        let [y, x] = pixel.map(|k| (f64::from(k) - middle) * s.pitch);
        let rim = x.hypot(y) / s.field_radius;
        if rim > 1.0 {
            return None;
        }
        let ray = Vector3::new(x, y, s.working_distance).normalize();
        let [a, b, depth] = self.signal(surface, pose, &ray, rim)?;
        // Eight phase steps tell b to sqrt(2 / 8) of a pixel's noise, a to sqrt(1 / 8).
        let a = a + n_a * s.intensity_noise / PHASE_STEPS.sqrt();
        let clean_sigma = b * std::f64::consts::FRAC_1_SQRT_2;
        let b = (b + n_b * s.intensity_noise * (2.0 / PHASE_STEPS).sqrt()).abs();
        let sigma_i = (0.5 * b * b + s.intensity_noise * s.intensity_noise).sqrt();
        if sigma_i < s.least_sigma_i {
            return None;
        }
        let truth = Point3::from(ray * depth);
        let bias = s.smooth_error(nearest(&self.volume.camera, &truth)?.0) * self.bias.at(&truth);
        let wrong = 0.5 * (-clean_sigma / s.wrong_phase_sigma_i).exp();
        let random = if chance < wrong { off * s.wrong_phase_spread } else { n_depth * s.noise(clean_sigma) };
        let position = Point3::from(ray * (depth + bias + random));
        let (d_cal, mark) = nearest(&self.volume.camera, &position)?;
        let (d_cal_projector, _) = nearest(&self.volume.projector, &position)?;
        let near = [d_cal, d_cal_projector, f64::from(mark.reprojection_px)];
        Some(Reading { position, pixel, signal: [a, b, sigma_i], near, error: [bias + random, bias] })
    }

    /// a, b and the distance along the ray, without noise.
    fn signal(&self, surface: &Surface, pose: &Isometry3, ray: &Vector3, rim: f64) -> Option<[f64; 3]> {
        let s = self.sensor;
        let origin = Point3::from(pose.translation.vector);
        let direction = pose.rotation * ray;
        let met = surface.meet(&origin, &direction)?;
        let place = origin + direction * met.t;
        let lamp = pose * Point3::new(s.working_distance * s.triangulation_rad.tan(), 0.0, 0.0);
        let lit = (lamp - place).normalize().dot(&met.normal);
        if lit < GRAZING_COS || -direction.dot(&met.normal) < GRAZING_COS {
            return None;
        }
        if surface.is_shaded(&place, &lamp, &met.normal, 1e-4 * s.working_distance) {
            return None;
        }
        let a = s.background * lit * (1.0 - (1.0 - RIM_LIGHT) * rim * rim);
        let sharpest = s.working_distance - s.field_curvature * rim * rim;
        let defocus = (met.t * ray.z - sharpest) / s.depth_of_field;
        Some([a, a * s.contrast * (-defocus * defocus).exp(), met.t])
    }
}

impl SimulatedView {
    fn push(&mut self, reading: &Reading) {
        self.positions.push(reading.position);
        self.pixels.push(reading.pixel);
        let [a, b, sigma_i] = reading.signal.map(|v| v as f32);
        let [d_cal, d_cal_projector, reprojection] = reading.near.map(|v| v as f32);
        let [error, bias] = reading.error.map(|v| v as f32);
        for (column, value) in [
            (&mut self.a, a),
            (&mut self.b, b),
            (&mut self.sigma_i, sigma_i),
            (&mut self.d_cal, d_cal),
            (&mut self.d_cal_projector, d_cal_projector),
            (&mut self.reprojection, reprojection),
            (&mut self.error, error),
            (&mut self.bias, bias),
        ] {
            column.push(value);
        }
    }

    /// The quality columns by their names in files.
    pub fn columns(&self) -> [(&'static str, &[f32]); 6] {
        [
            ("a", &self.a),
            ("b", &self.b),
            ("sigma_i", &self.sigma_i),
            ("d_cal", &self.d_cal),
            ("d_cal_projector", &self.d_cal_projector),
            ("reprojection", &self.reprojection),
        ]
    }

    /// Where a point truly is, view frame.
    pub fn true_position(&self, k: usize) -> Point3 {
        let ray = self.positions[k].coords.normalize();
        self.positions[k] - ray * f64::from(self.error[k])
    }
}
