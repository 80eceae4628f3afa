//! What stays fixed while a state is estimated: the points, sorted by whether the outline may be near, and their region.

use super::Window;
use super::likelihood::State;
use super::outline::{MAX_SHAPE, Moments, Outline};

/// A window, or what is left of it.
#[derive(Debug, Clone)]
pub struct Region {
    /// Area and first moments of what is left.
    pub moments: Moments,
    /// Half the window's size, mm.
    pub reach_mm: f64,
    /// The part left out, in pieces.
    pub cut: Vec<Piece>,
}

/// A small square that was cut out of a window, or the part of it that belonged there.
#[derive(Debug, Clone, Copy)]
pub struct Piece {
    /// Its middle.
    pub place: [f64; 2],
    /// Its area, mm².
    pub area: f64,
    /// Variance of a place within it along any direction, mm²: the square blurs the edge by as much.
    pub blur_sq: f64,
}

impl Region {
    /// All of a window.
    pub fn whole(window: &Window) -> Self {
        Self { moments: window.moments, reach_mm: window.reach_mm, cut: Vec::new() }
    }

    /// Area of an outline's void that is left, mm², its edge sharp.
    pub fn void_area<O: Outline>(&self, outline: &O) -> f64 {
        let (distance, mut unused) = (outline.distances(), [0.0; MAX_SHAPE]);
        let cut = self.cut.iter().filter(|piece| distance(piece.place, &mut unused) < 0.0);
        outline.void(0.0).0[0] - cut.map(|piece| piece.area).sum::<f64>()
    }
}

/// The largest distance, mm, by which two outlines may differ anywhere in a window of that reach.
pub fn apart_mm<O: Outline>(a: &O, b: &O, reach_mm: f64) -> f64 {
    let (a, b) = (a.parameters(), b.parameters());
    (0..O::SHAPE).map(|k| (a[k] - b[k]).abs() * if O::IS_ANGLE[k] { reach_mm } else { 1.0 }).sum()
}

/// Beyond this many tau a point counts as material or clutter for certain.
pub const FAR: f64 = 6.5;
/// Points whose density is looked at together.
pub const LANES: usize = 8;
/// The band is so much wider than that: some room to move and to blur, so that few states need a new one.
const ROOM: f64 = 1.4;

/// Points and their region, for states near one outline.
pub struct Data<'a, O> {
    points: &'a [[f64; 2]],
    /// Where they were taken.
    pub region: &'a Region,
    /// Share of clutter where there is no material.
    pub clutter: f64,
    /// Standard deviation of the prior on the density gradient; keeps it from imitating an edge.
    pub gradient_sigma: f64,
    /// All points over the region's reach, u and v apart; filled up with zeros to a multiple of [`LANES`].
    pub scaled: [Vec<f64>; 2],
    /// Those within the band about the outline, mm.
    pub near: Vec<[f64; 2]>,
    /// How many of the others lie in the void.
    pub far_in_void: usize,
    /// The outline about which the points were sorted, and the width of the band to either side.
    sorted_about: O,
    band_mm: f64,
}

impl<'a, O: Outline> Data<'a, O> {
    /// Sorts points for states near the one given.
    pub fn new(
        points: &'a [[f64; 2]],
        region: &'a Region,
        clutter: f64,
        gradient_sigma: f64,
        state: &State<O>,
    ) -> Self {
        let scale = 1.0 / region.reach_mm;
        let filled = points.len().next_multiple_of(LANES);
        let scaled = [0, 1].map(|axis| {
            let mut all = Vec::with_capacity(filled);
            all.extend(points.iter().map(|p| p[axis] * scale));
            all.resize(filled, 0.0);
            all
        });
        let sorted_about = state.outline.clone();
        let near = Vec::with_capacity(points.len());
        let mut data =
            Self { points, region, clutter, gradient_sigma, scaled, near, far_in_void: 0, sorted_about, band_mm: 0.0 };
        data.sort(state);
        data
    }

    /// Number of points.
    pub fn count(&self) -> f64 {
        self.points.len() as f64
    }

    /// Sorts the points anew where a state has come too far from the one they were sorted for, or the band has become much too wide.
    pub fn follow(&mut self, state: &State<O>) {
        if !self.holds(state) || self.band_mm > 1.5 * ROOM * FAR * state.tau_mm {
            self.sort(state);
        }
    }

    /// Whether every point far from the outline is known to be far from the state's.
    pub fn holds(&self, state: &State<O>) -> bool {
        FAR * state.tau_mm + apart_mm(&state.outline, &self.sorted_about, self.region.reach_mm) <= self.band_mm
    }

    fn sort(&mut self, state: &State<O>) {
        self.band_mm = ROOM * FAR * state.tau_mm;
        self.sorted_about = state.outline.clone();
        self.near.clear();
        self.far_in_void = 0;
        let (distance, mut unused) = (self.sorted_about.distances(), [0.0; MAX_SHAPE]);
        for p in self.points {
            let s = distance(*p, &mut unused);
            if s.abs() <= self.band_mm {
                self.near.push(*p);
            } else if s < 0.0 {
                self.far_in_void += 1;
            }
        }
    }
}
