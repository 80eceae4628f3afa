//! The part of the plane from which points were taken.

use super::outline::Moments;

/// A convex part of the plane: its area and first moments, and which places belong to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Window {
    /// Area in mm², first moments along u and v in mm³.
    pub moments: Moments,
    /// Half its size, mm: the length over which a density gradient is told.
    pub reach_mm: f64,
    border: Border,
}

/// Where a window ends.
#[derive(Debug, Clone, PartialEq)]
enum Border {
    Disc(f64),
    /// Corners of a convex polygon, counter-clockwise.
    Polygon(Vec<[f64; 2]>),
}

impl Window {
    /// A disc about the origin.
    pub fn disc(radius_mm: f64) -> Self {
        let area = std::f64::consts::PI * radius_mm * radius_mm;
        Self { moments: [area, 0.0, 0.0], reach_mm: radius_mm, border: Border::Disc(radius_mm) }
    }

    /// The rectangle between two corners.
    pub fn rectangle(low: [f64; 2], high: [f64; 2]) -> Self {
        let (w, h) = (high[0] - low[0], high[1] - low[1]);
        let area = w * h;
        Self {
            moments: [area, area * 0.5 * (low[0] + high[0]), area * 0.5 * (low[1] + high[1])],
            reach_mm: 0.5 * w.max(h),
            border: Border::Polygon(vec![low, [high[0], low[1]], high, [low[0], high[1]]]),
        }
    }

    /// A convex polygon, counter-clockwise.
    pub fn polygon(corners: &[[f64; 2]]) -> Self {
        let (mut area, mut mu, mut mv, mut reach) = (0.0, 0.0, 0.0, 0.0_f64);
        for (k, a) in corners.iter().enumerate() {
            let b = corners[(k + 1) % corners.len()];
            let cross = a[0] * b[1] - b[0] * a[1];
            area += 0.5 * cross;
            mu += cross * (a[0] + b[0]) / 6.0;
            mv += cross * (a[1] + b[1]) / 6.0;
            reach = reach.max(a[0].hypot(a[1]));
        }
        Self { moments: [area, mu, mv], reach_mm: reach, border: Border::Polygon(corners.to_vec()) }
    }

    /// The least and the greatest u, and v, that belong to it.
    pub fn bounds(&self) -> [[f64; 2]; 2] {
        match &self.border {
            Border::Disc(radius) => [[-radius, *radius]; 2],
            Border::Polygon(corners) => [0, 1].map(|axis| {
                let of_axis = corners.iter().map(|p| p[axis]);
                of_axis.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
            }),
        }
    }

    /// Its stretches along u at `count` heights v, from `first` in equal steps; empty (from beyond to) where there is none.
    pub fn rows(&self, first: f64, step: f64, count: usize) -> Vec<[f64; 2]> {
        let mut rows = vec![[f64::INFINITY, f64::NEG_INFINITY]; count];
        match &self.border {
            Border::Disc(radius) => {
                for (k, row) in rows.iter_mut().enumerate() {
                    let v = first + step * k as f64;
                    let half = (radius * radius - v * v).max(0.0).sqrt();
                    if v.abs() < *radius {
                        *row = [-half, half];
                    }
                }
            }
            Border::Polygon(corners) => {
                for (k, a) in corners.iter().enumerate() {
                    let b = corners[(k + 1) % corners.len()];
                    let (low, high) = if a[1] <= b[1] { (a, &b) } else { (&b, a) };
                    let from = ((low[1] - first) / step).ceil().max(0.0) as usize;
                    let to = ((high[1] - first) / step).ceil().max(0.0) as usize;
                    for (row, k) in rows.iter_mut().enumerate().take(to).skip(from).map(|(k, row)| (row, k)) {
                        let v = first + step * k as f64;
                        let u = low[0] + (high[0] - low[0]) * (v - low[1]) / (high[1] - low[1]);
                        *row = [row[0].min(u), row[1].max(u)];
                    }
                }
            }
        }
        rows
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Area and first moments summed over rows of each window against what it says of itself.
    #[test]
    fn rows_make_up_the_window() {
        let hexagon = [[3.0, 0.5], [2.0, 3.0], [-1.0, 3.5], [-3.0, 1.0], [-2.0, -2.0], [1.5, -2.5]];
        for window in [Window::disc(3.0), Window::rectangle([-1.0, -2.0], [4.0, 1.0]), Window::polygon(&hexagon)] {
            let [_, [low, high]] = window.bounds();
            let steps = 4000;
            let step = (high - low) / steps as f64;
            let mut sum = [0.0; 3];
            for (k, [from, to]) in window.rows(low + 0.5 * step, step, steps).into_iter().enumerate() {
                let v = low + (k as f64 + 0.5) * step;
                let width = to - from;
                sum = [sum[0] + width * step, sum[1] + width * step * 0.5 * (from + to), sum[2] + width * step * v];
            }
            for (found, told) in sum.iter().zip(window.moments) {
                // The midpoint rule over 4000 rows: a kink costs step² = 2e-6, the disc's ends (root of a distance) 3e-5.
                assert!((found - told).abs() < 1e-4, "{window:?}: {sum:?}");
            }
            let [[from, to]] = window.rows(high + 1.0, 1.0, 1)[..] else { panic!("one row") };
            assert!(from > to);
        }
    }
}
