//! What a face looks like from one direction: a picture of its heights, drawn once and compared with many poses.
//!
//! Template frame: z is the direction of view reversed (towards the camera), origin at the part's centroid.

use super::sampling::{rotation_to_z, spread};
use crate::geometry::{Aabb, Isometry3, Point3, Vector3};
use crate::part::{Face, Part};
use crate::plan::Side;
use nalgebra::Translation3;

/// Edges of the CAD and of the part may differ by this much without speaking against a pose, mm.
pub(super) const RIM_TOLERANCE_MM: f64 = 0.9;
/// Finest pixel, mm.
const PIXEL_MM: f64 = 0.45;
/// Most pixels along the part's diagonal.
const PIXELS_ACROSS: f64 = 700.0;
/// Triangles steeper than this (normal times view) are drawn by their edges.
const STEEP: f64 = 0.25;

/// How much is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Detail {
    /// Only what decides which samples are visible.
    Samples,
    /// All that poses are compared with.
    Full,
}

/// A face seen from one direction.
pub(super) struct Template {
    /// The face.
    pub side: Side,
    /// CAD to template.
    pub template_from_cad: Isometry3,
    /// Edge of a pixel, mm.
    pub pixel_mm: f64,
    /// Corner of the picture.
    corner: [f64; 2],
    /// Pixels along x and y.
    size: [usize; 2],
    /// Height of the topmost surface; NaN where there is none.
    top: Vec<f32>,
    /// Lowest surface within the rim tolerance; infinite where there is none.
    low: Vec<f32>,
    /// Highest surface within the rim tolerance; minus infinite where there is none.
    high: Vec<f32>,
    /// Places of the visible surface at least the rim tolerance inside its outline, one a pixel.
    pub inside: Vec<[f32; 3]>,
    /// Visible samples of the face, evenly spread.
    pub samples: Vec<Point3>,
    /// Area of the outline, mm².
    pub footprint_mm2: f64,
}

impl Template {
    /// Draws the face of a side as seen from `up` (unit, CAD frame).
    pub fn draw(part: &Part, side: Side, up: &Vector3, detail: Detail) -> Self {
        let face = part.face(side);
        let turn = rotation_to_z(up);
        let template_from_cad = Isometry3::from_parts(Translation3::from(-(turn * part.centroid).coords), turn);
        let diagonal = part.diagonal_mm();
        let pixel_mm = match detail {
            Detail::Samples => (4.0 * PIXEL_MM).max(diagonal / (0.25 * PIXELS_ACROSS)),
            Detail::Full => PIXEL_MM.max(diagonal / PIXELS_ACROSS),
        };
        let margin = 2.0 * RIM_TOLERANCE_MM + 2.0 * pixel_mm;
        let placed: Vec<Point3> = face.mesh.vertices.iter().map(|v| template_from_cad * v).collect();
        let bounds = Aabb::of_points(&placed).unwrap_or(Aabb { min: Point3::origin(), max: Point3::origin() });
        let corner = [bounds.min.x - margin, bounds.min.y - margin];
        let pixels = |k: usize| ((bounds.max[k] + margin - corner[k]) / pixel_mm).ceil() as usize;
        let size = [pixels(0), pixels(1)];
        let mut template = Self {
            side,
            template_from_cad,
            pixel_mm,
            corner,
            size,
            top: vec![f32::NAN; size[0] * size[1]],
            low: Vec::new(),
            high: Vec::new(),
            inside: Vec::new(),
            samples: Vec::new(),
            footprint_mm2: 0.0,
        };
        template.draw_triangles(face, &placed);
        let covered = template.top.iter().filter(|z| !z.is_nan()).count();
        template.footprint_mm2 = covered as f64 * pixel_mm * pixel_mm;
        if detail == Detail::Full {
            template.find_range(face, &placed);
            template.find_inside();
        }
        template.find_samples(face);
        template
    }

    /// The pixel under a place in the template frame.
    fn pixel(&self, x: f64, y: f64) -> Option<usize> {
        let (i, j) = ((x - self.corner[0]) / self.pixel_mm, (y - self.corner[1]) / self.pixel_mm);
        if i < 0.0 || j < 0.0 || i >= self.size[0] as f64 || j >= self.size[1] as f64 {
            return None;
        }
        Some(j as usize * self.size[0] + i as usize)
    }

    /// How far a place (template frame) lies above or below the surface near it, mm; `None` past the outline by more than the
    /// rim tolerance. Zero at any height between the lowest and the highest surface within that tolerance.
    pub fn height_off(&self, place: &Point3) -> Option<f64> {
        let pixel = self.pixel(place.x, place.y)?;
        let (low, high) = (f64::from(self.low[pixel]), f64::from(self.high[pixel]));
        (low <= high).then(|| (low - place.z).max(place.z - high).max(0.0))
    }

    fn draw_triangles(&mut self, face: &Face, placed: &[Point3]) {
        for corners in &face.mesh.triangles {
            let [a, b, c] = corners.map(|v| placed[v as usize]);
            if !is_steep(&a, &b, &c) {
                self.draw_triangle(&a, &b, &c);
            }
        }
    }

    /// Heights of the topmost surface and of steep walls, widened by the rim tolerance.
    fn find_range(&mut self, face: &Face, placed: &[Point3]) {
        let mut low: Vec<f32> = self.top.iter().map(|z| if z.is_nan() { f32::INFINITY } else { *z }).collect();
        let mut high: Vec<f32> = self.top.iter().map(|z| if z.is_nan() { f32::NEG_INFINITY } else { *z }).collect();
        for corners in &face.mesh.triangles {
            let [a, b, c] = corners.map(|v| placed[v as usize]);
            if !is_steep(&a, &b, &c) {
                continue;
            }
            for (p, q) in [(a, b), (b, c), (c, a)] {
                let steps = ((q - p).norm() / self.pixel_mm).ceil().max(1.0);
                for s in 0..=steps as usize {
                    let place = p + (q - p) * (s as f64 / steps);
                    if let Some(k) = self.pixel(place.x, place.y) {
                        low[k] = low[k].min(place.z as f32);
                        high[k] = high[k].max(place.z as f32);
                    }
                }
            }
        }
        self.low = self.windowed(&low, f32::min);
        self.high = self.windowed(&high, f32::max);
    }

    /// Raises the topmost height of all pixels whose middle lies in the triangle.
    fn draw_triangle(&mut self, a: &Point3, b: &Point3, c: &Point3) {
        let twice = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
        if twice == 0.0 {
            return;
        }
        let span = |axis: usize| {
            let to_pixel = |v: f64| (v - self.corner[axis]) / self.pixel_mm - 0.5;
            let (low, high) = (a[axis].min(b[axis]).min(c[axis]), a[axis].max(b[axis]).max(c[axis]));
            let last = to_pixel(high).floor().min(self.size[axis] as f64 - 1.0);
            (to_pixel(low).ceil().max(0.0) as usize, last)
        };
        let ((i0, i1), (j0, j1)) = (span(0), span(1));
        if i1 < 0.0 || j1 < 0.0 {
            return;
        }
        for j in j0..=j1 as usize {
            let y = self.middle(1, j);
            for i in i0..=i1 as usize {
                let x = self.middle(0, i);
                let wb = ((x - a.x) * (c.y - a.y) - (y - a.y) * (c.x - a.x)) / twice;
                let wc = ((b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x)) / twice;
                // A hair of overlap, so that no pixel falls between two triangles.
                if wb >= -1e-9 && wc >= -1e-9 && wb + wc <= 1.0 + 1e-9 {
                    let z = (a.z + wb * (b.z - a.z) + wc * (c.z - a.z)) as f32;
                    let top = &mut self.top[j * self.size[0] + i];
                    *top = top.max(z);
                }
            }
        }
    }

    /// Coordinate of a pixel's middle.
    fn middle(&self, axis: usize, pixel: usize) -> f64 {
        self.corner[axis] + (pixel as f64 + 0.5) * self.pixel_mm
    }

    fn radius_pixels(&self) -> usize {
        (RIM_TOLERANCE_MM / self.pixel_mm).round().max(1.0) as usize
    }

    /// The least (or greatest) value in a square window about each pixel, by rows and then by columns.
    fn windowed(&self, values: &[f32], pick: impl Fn(f32, f32) -> f32) -> Vec<f32> {
        let ([nx, ny], r) = (self.size, self.radius_pixels());
        let mut rows = values.to_vec();
        for (source, target) in values.chunks_exact(nx).zip(rows.chunks_exact_mut(nx)) {
            for shift in 1..=r.min(nx - 1) {
                for k in shift..nx {
                    target[k] = pick(target[k], source[k - shift]);
                    target[k - shift] = pick(target[k - shift], source[k]);
                }
            }
        }
        let mut out = rows.clone();
        for j in 0..ny {
            for m in (j.saturating_sub(r)..=(j + r).min(ny - 1)).filter(|&m| m != j) {
                let (target, source) = (&mut out[j * nx..(j + 1) * nx], &rows[m * nx..(m + 1) * nx]);
                for (t, s) in target.iter_mut().zip(source) {
                    *t = pick(*t, *s);
                }
            }
        }
        out
    }

    /// Pixels whose whole window is covered.
    fn find_inside(&mut self) {
        let ([nx, ny], r) = (self.size, self.radius_pixels());
        // Pixels since the last empty one, looking left; then the same downwards: a running count replaces the window.
        let mut wide = vec![false; nx * ny];
        for j in 0..ny {
            let mut run = 0;
            for i in 0..nx {
                run = if self.top[j * nx + i].is_nan() { 0 } else { run + 1 };
                if run > 2 * r {
                    wide[j * nx + i - r] = true;
                }
            }
        }
        for i in 0..nx {
            let mut run = 0;
            for j in 0..ny {
                run = if wide[j * nx + i] { run + 1 } else { 0 };
                if run > 2 * r {
                    let k = (j - r) * nx + i;
                    self.inside.push([self.middle(0, i) as f32, self.middle(1, j - r) as f32, self.top[k]]);
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
            .map(|s| (self.template_from_cad * s.point, (turn * *s.normal).z))
            .filter(|(p, up)| {
                // A slanted surface rises by this much within a pixel.
                let rise = self.pixel_mm * (1.0 - up * up).max(0.0).sqrt() / up.max(0.1);
                let top = self.pixel(p.x, p.y).map_or(f32::NAN, |k| self.top[k]);
                *up > 0.1 && (top.is_nan() || f64::from(top) - p.z < 1.0 + rise)
            })
            .map(|(p, _)| p)
            .collect();
        self.samples = spread(visible.len(), 1200).into_iter().map(|k| visible[k as usize]).collect();
    }

    /// The middle of the visible samples.
    pub fn sample_middle(&self) -> Point3 {
        let sum = self.samples.iter().fold(Vector3::zeros(), |s, p| s + p.coords);
        Point3::from(sum / self.samples.len().max(1) as f64)
    }
}

/// Whether a triangle (template frame) is seen so nearly edge-on that its edges stand for it.
fn is_steep(a: &Point3, b: &Point3, c: &Point3) -> bool {
    let area_vector = (b - a).cross(&(c - a));
    area_vector.z.abs() < STEEP * area_vector.norm()
}
