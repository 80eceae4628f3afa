//! What a face looks like from one direction: a picture of its heights, drawn once and compared with many poses.
//!
//! Template frame: z is the direction of view reversed (towards the camera), origin at the part's centroid.

use super::sampling::{rotation_to_z, spread};
use crate::geometry::{Isometry3, Point3, Vector3};
use crate::part::{Face, Part};
use crate::plan::Side;
use nalgebra::Translation3;

/// Edges of the CAD and of the part may differ by this much without speaking against a pose, mm.
pub(super) const RIM_TOLERANCE_MM: f64 = 1.2;
/// Finest pixel, mm.
const PIXEL_MM: f64 = 0.6;
/// Most pixels along the part's diagonal.
const PIXELS_ACROSS: f64 = 700.0;
/// Triangles steeper than this (normal times view) are drawn by their edges.
const STEEP: f64 = 0.25;

/// A face seen from one direction.
pub(super) struct Template {
    /// The face.
    pub side: Side,
    /// CAD to template.
    pub template_from_cad: Isometry3,
    /// Edge of a pixel, mm.
    pub pixel_mm: f64,
    corner: f64,
    across: usize,
    /// Height of the topmost surface; NaN where there is none.
    top: Vec<f32>,
    /// Lowest and highest surface within the rim tolerance; NaN where there is none.
    range: Vec<(f32, f32)>,
    /// Places of the visible surface at least the rim tolerance inside its outline, one a pixel.
    pub inside: Vec<[f32; 3]>,
    /// Visible samples of the face, evenly spread.
    pub samples: Vec<Point3>,
}

impl Template {
    /// Draws the face of a side as seen from `up` (unit, CAD frame).
    pub fn draw(part: &Part, side: Side, up: &Vector3) -> Self {
        let face = part.face(side);
        let turn = rotation_to_z(up);
        let template_from_cad =
            Isometry3::from_parts(Translation3::from(-(turn * part.centroid).coords), turn);
        let diagonal = part.diagonal_mm();
        let pixel_mm = PIXEL_MM.max(diagonal / PIXELS_ACROSS);
        let reach = face.mesh.vertices.iter().map(|v| (template_from_cad * v).coords.xy().amax()).fold(0.0, f64::max);
        let margin = 2.0 * RIM_TOLERANCE_MM + 2.0 * pixel_mm;
        let across = (2.0 * (reach + margin) / pixel_mm).ceil() as usize;
        let corner = -0.5 * across as f64 * pixel_mm;
        let mut template = Self {
            side,
            template_from_cad,
            pixel_mm,
            corner,
            across,
            top: vec![f32::NAN; across * across],
            range: Vec::new(),
            inside: Vec::new(),
            samples: Vec::new(),
        };
        template.draw_triangles(face);
        template.find_inside();
        template.find_samples(face);
        template
    }

    /// The pixel under a place in the template frame.
    fn pixel(&self, x: f64, y: f64) -> Option<usize> {
        let (i, j) = ((x - self.corner) / self.pixel_mm, (y - self.corner) / self.pixel_mm);
        let limit = self.across as f64;
        if i < 0.0 || j < 0.0 || i >= limit || j >= limit {
            return None;
        }
        Some(j as usize * self.across + i as usize)
    }

    /// How far a place (template frame) lies above or below the surface near it, mm; `None` past the outline by more than the
    /// rim tolerance. Zero at any height between the lowest and the highest surface within that tolerance.
    pub fn height_off(&self, place: &Point3) -> Option<f64> {
        let (low, high) = self.range[self.pixel(place.x, place.y)?];
        if low.is_nan() {
            return None;
        }
        Some((f64::from(low) - place.z).max(place.z - f64::from(high)).max(0.0))
    }

    fn draw_triangles(&mut self, face: &Face) {
        let placed: Vec<Point3> = face.mesh.vertices.iter().map(|v| self.template_from_cad * v).collect();
        let mut range = vec![(f32::NAN, f32::NAN); self.top.len()];
        let mut widen = |pixel: Option<usize>, z: f64| {
            if let Some(k) = pixel {
                let (low, high) = range[k];
                range[k] = (low.min(z as f32), high.max(z as f32));
            }
        };
        for corners in &face.mesh.triangles {
            let [a, b, c] = corners.map(|v| placed[v as usize]);
            let area_vector = (b - a).cross(&(c - a));
            if area_vector.z.abs() >= STEEP * area_vector.norm() {
                self.draw_triangle(&a, &b, &c);
                continue;
            }
            for (p, q) in [(a, b), (b, c), (c, a)] {
                let steps = ((q - p).norm() / self.pixel_mm).ceil().max(1.0);
                for s in 0..=steps as usize {
                    let place = p + (q - p) * (s as f64 / steps);
                    widen(self.pixel(place.x, place.y), place.z);
                }
            }
        }
        for (k, &z) in self.top.iter().enumerate() {
            if !z.is_nan() {
                range[k] = (range[k].0.min(z), range[k].1.max(z));
            }
        }
        self.range = self.widened(&range);
    }

    /// Raises the topmost height of all pixels whose middle lies in the triangle.
    fn draw_triangle(&mut self, a: &Point3, b: &Point3, c: &Point3) {
        let twice = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
        if twice == 0.0 {
            return;
        }
        let to_pixel = |v: f64| (v - self.corner) / self.pixel_mm - 0.5;
        let span = |p: f64, q: f64, r: f64| {
            let low = to_pixel(p.min(q).min(r)).ceil().max(0.0) as usize;
            let high = to_pixel(p.max(q).max(r)).floor().min(self.across as f64 - 1.0);
            (low, high)
        };
        let ((i0, i1), (j0, j1)) = (span(a.x, b.x, c.x), span(a.y, b.y, c.y));
        if i1 < 0.0 || j1 < 0.0 {
            return;
        }
        for j in j0..=j1 as usize {
            let y = self.corner + (j as f64 + 0.5) * self.pixel_mm;
            for i in i0..=i1 as usize {
                let x = self.corner + (i as f64 + 0.5) * self.pixel_mm;
                let wb = ((x - a.x) * (c.y - a.y) - (y - a.y) * (c.x - a.x)) / twice;
                let wc = ((b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x)) / twice;
                // A hair of overlap, so that no pixel falls between two triangles.
                if wb >= -1e-9 && wc >= -1e-9 && wb + wc <= 1.0 + 1e-9 {
                    let z = (a.z + wb * (b.z - a.z) + wc * (c.z - a.z)) as f32;
                    let top = &mut self.top[j * self.across + i];
                    *top = top.max(z);
                }
            }
        }
    }

    fn radius_pixels(&self) -> usize {
        (RIM_TOLERANCE_MM / self.pixel_mm).round().max(1.0) as usize
    }

    /// Smallest and largest height in a square window about each pixel, by rows and then by columns.
    fn widened(&self, range: &[(f32, f32)]) -> Vec<(f32, f32)> {
        let (n, r) = (self.across, self.radius_pixels());
        let pass = |source: &[(f32, f32)], stride: usize, other: usize| {
            let mut out = vec![(f32::NAN, f32::NAN); source.len()];
            for line in 0..n {
                for k in 0..n {
                    let (mut low, mut high) = (f32::NAN, f32::NAN);
                    for m in k.saturating_sub(r)..=(k + r).min(n - 1) {
                        let (l, h) = source[line * other + m * stride];
                        low = low.min(l);
                        high = high.max(h);
                    }
                    out[line * other + k * stride] = (low, high);
                }
            }
            out
        };
        let rows = pass(range, 1, n);
        pass(&rows, n, 1)
    }

    /// Pixels whose whole window is covered.
    fn find_inside(&mut self) {
        let (n, r) = (self.across, self.radius_pixels());
        // Pixels since the last empty one, looking left; then the same downwards: a running count replaces the window.
        let mut wide = vec![false; n * n];
        for j in 0..n {
            let mut run = 0;
            for i in 0..n {
                run = if self.top[j * n + i].is_nan() { 0 } else { run + 1 };
                if run > 2 * r {
                    wide[j * n + i - r] = true;
                }
            }
        }
        for i in 0..n {
            let mut run = 0;
            for j in 0..n {
                run = if wide[j * n + i] { run + 1 } else { 0 };
                if run > 2 * r {
                    let k = (j - r) * n + i;
                    let place = |m: usize| (self.corner + (m as f64 + 0.5) * self.pixel_mm) as f32;
                    self.inside.push([place(i), place(j - r), self.top[k]]);
                }
            }
        }
    }

    /// Samples of the face that look up and that nothing covers.
    fn find_samples(&mut self, face: &Face) {
        let turn = self.template_from_cad.rotation;
        let visible: Vec<Point3> = face
            .samples
            .iter()
            .filter(|s| (turn * *s.normal).z > 0.1)
            .map(|s| self.template_from_cad * s.point)
            .filter(|p| {
                // Steep places have a pixel that is higher by less than a window's worth.
                self.pixel(p.x, p.y).is_none_or(|k| self.top[k].is_nan() || f64::from(self.top[k]) - p.z < 1.5)
            })
            .collect();
        self.samples = spread(visible.len(), 1200).into_iter().map(|k| visible[k as usize]).collect();
    }

    /// The middle of the visible samples.
    pub fn sample_middle(&self) -> Point3 {
        let sum = self.samples.iter().fold(Vector3::zeros(), |s, p| s + p.coords);
        Point3::from(sum / self.samples.len().max(1) as f64)
    }
}
