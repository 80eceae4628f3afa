//! What speaks for one pose against another: the places where they predict different things.
//!
//! A ratio of mean costs cannot tell the poses of a 300 x 40 mm rail whose only asymmetry is one 7 mm hole: the wrong pose
//! costs 0.2 % more. So every pose is a witness over the same raster of cells, seen along z of the work frame, and two
//! poses are compared only on the cells where they say different things:
//!
//! - *predicted but absent*: the face covers the cell and no data does, although data surrounds it (a hole of the part that the
//!   pose puts elsewhere; a large uncovered region is unknown and speaks against nobody);
//! - *present but not predicted*: data where the pose has a hole, nothing past an edge, or its surface well above or below.
//!
//! Edges may be off by the rim tolerance and heights by the part's deformation. The area of the contradictions, over a small
//! base so that noise of a few mm² decides nothing, is the cost; a bounded factor from the residuals covers poses
//! that differ in no hole or edge (a slightly oval cover).

use super::height_map::Raster;
use super::template::Template;
use crate::geometry::{Isometry3, Point3};

/// Heights off the surface by up to this much are deformation, mm.
const HEIGHT_TOLERANCE_MM: f64 = 2.0;
/// The area that contradictions are compared with, mm², at least.
const BASE_MM2: f64 = 7.0;
/// Share of the part's area that is added to it: a larger part has more places for chance.
const BASE_SHARE: f64 = 2e-4;
/// Cells of that base, at least.
const BASE_CELLS: f64 = 2.0;
/// Residual scale that deformation reaches without meaning anything, mm.
const RESIDUAL_FLOOR_MM: f64 = 0.15;
/// Residuals from here on are outliers, mm.
pub(super) const RESIDUAL_LIMIT_MM: f64 = 2.5;
/// The most that residuals may say on their own: just above the limit of the margin.
const RESIDUAL_FACTOR: f64 = 1.6;
/// How far round an empty cell data is looked for, mm.
const SURROUND_MM: f64 = 16.0;

/// The raster of cells and what of it is data.
pub(super) struct Ground {
    pub raster: Raster,
    /// Cell of each dense point.
    cells: Vec<u32>,
    /// Usual number of points in a filled cell.
    pub usual: f64,
    /// Work height below which a face may have been removed with the belt.
    pub low_mm: f64,
}

const OUTSIDE: u32 = u32::MAX;

impl Ground {
    /// Sorts the dense points into cells.
    pub fn new(dense: &[Point3], raster: Raster, low_mm: f64) -> Self {
        let cells: Vec<u32> = dense.iter().map(|p| raster.index(p.x, p.y).map_or(OUTSIDE, |c| c as u32)).collect();
        let mut counts = vec![0u32; raster.len()];
        for &c in cells.iter().filter(|&&c| c != OUTSIDE) {
            counts[c as usize] += 1;
        }
        Self { raster, cells, usual: super::height_map::usual_count(&counts), low_mm }
    }

    /// Area of a cell, mm².
    pub fn cell_mm2(&self) -> f64 {
        self.raster.cell_mm * self.raster.cell_mm
    }
}

/// What one pose says about every cell.
pub(super) struct Witness {
    /// Points near the predicted surface.
    explained: Vec<u16>,
    /// Points that are not.
    off: Vec<u16>,
    /// Whether the pose predicts visible surface all over the cell, well inside its outline.
    predicted: Vec<bool>,
    /// Distance of each fine point to the face, mm.
    residuals: Vec<f64>,
}

impl Witness {
    /// Hears one pose.
    pub fn hear(
        ground: &Ground,
        dense: &[Point3],
        template: &Template,
        cad_from_work: &Isometry3,
        residuals: Vec<f64>,
    ) -> Self {
        let template_from_work = template.template_from_cad * cad_from_work;
        let cells = ground.raster.len();
        let (mut explained, mut off) = (vec![0u16; cells], vec![0u16; cells]);
        for (p, &cell) in dense.iter().zip(&ground.cells) {
            if cell == OUTSIDE {
                continue;
            }
            let close = template.height_off(&(template_from_work * p)).is_some_and(|off| off <= HEIGHT_TOLERANCE_MM);
            let count = if close { &mut explained[cell as usize] } else { &mut off[cell as usize] };
            *count = count.saturating_add(1);
        }
        let work_from_template = template_from_work.inverse();
        let mut pixels = vec![0u16; cells];
        for place in &template.inside {
            let p = work_from_template * Point3::new(place[0].into(), place[1].into(), place[2].into());
            if p.z >= ground.low_mm
                && let Some(cell) = ground.raster.index(p.x, p.y)
            {
                pixels[cell] = pixels[cell].saturating_add(1);
            }
        }
        let full = ground.cell_mm2() / (template.pixel_mm * template.pixel_mm);
        let predicted = pixels.iter().map(|&n| f64::from(n) >= 0.6 * full).collect();
        Self { explained, off, predicted, residuals }
    }

    /// Area of predicted surface, mm², within the raster.
    pub fn predicted_mm2(&self, ground: &Ground) -> f64 {
        self.predicted.iter().filter(|&&p| p).count() as f64 * ground.cell_mm2()
    }

    /// Share of the predicted cells that hold data on the surface.
    pub fn coverage(&self, ground: &Ground) -> f64 {
        let (mut all, mut seen) = (0usize, 0usize);
        for (predicted, &n) in self.predicted.iter().zip(&self.explained) {
            if *predicted {
                all += 1;
                seen += usize::from(f64::from(n) >= 0.35 * ground.usual);
            }
        }
        seen as f64 / all.max(1) as f64
    }

    /// Share of the dense points in the raster that lie near the predicted surface.
    pub fn explained_share(&self) -> f64 {
        let sum = |counts: &[u16]| counts.iter().map(|&c| f64::from(c)).sum::<f64>();
        let explained = sum(&self.explained);
        explained / (explained + sum(&self.off)).max(1.0)
    }
}

/// How well data surrounds each cell that has little, 0 to 1; 0 for cells with data.
pub(super) struct Gaps {
    surrounded: Vec<f32>,
    /// Which connected gap a cell belongs to; meaningful where `surrounded` is above 0.
    component: Vec<u32>,
    /// How many there are.
    components: usize,
    /// How much a gap says. Where the scan is full of gaps, one more says little: the logarithm of the share of gaps in what
    /// surely is surface, over that of one in a hundred.
    weight: f64,
}

impl Gaps {
    /// Finds them: a cell has data if some witness explains enough points in it.
    pub fn find(ground: &Ground, witnesses: &[Witness]) -> Self {
        let raster = &ground.raster;
        let enough = 0.5 * ground.usual;
        let solid: Vec<bool> =
            (0..raster.len()).map(|c| witnesses.iter().any(|w| f64::from(w.explained[c]) >= enough)).collect();
        let reach = (SURROUND_MM / raster.cell_mm).ceil() as i64;
        let (nx, ny) = (raster.nx as i64, raster.ny as i64);
        let surrounded = (0..raster.len())
            .map(|c| {
                // Gaps matter only where a pose predicts surface.
                if solid[c] || !witnesses.iter().any(|w| w.predicted[c]) {
                    return 0.0;
                }
                let (i, j) = (c as i64 % nx, c as i64 / nx);
                let sees = |di: i64, dj: i64| {
                    (1..=reach).any(|k| {
                        let (p, q) = (i + k * di, j + k * dj);
                        p >= 0 && q >= 0 && p < nx && q < ny && solid[(q * nx + p) as usize]
                    })
                };
                let directions = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)];
                let hits = directions.iter().filter(|(di, dj)| sees(*di, *dj)).count();
                ((hits as f32 - 5.0) / 3.0).clamp(0.0, 1.0)
            })
            .collect::<Vec<f32>>();
        let surface = |c: &usize| witnesses.iter().all(|w| w.predicted[*c]);
        let (mut gaps, mut all) = (0usize, 0usize);
        for c in (0..raster.len()).filter(surface) {
            all += 1;
            gaps += usize::from(surrounded[c] > 0.0);
        }
        let share = ((gaps + 1) as f64 / (all + 100) as f64).clamp(0.01, 1.0);
        let (component, components) = connected(raster, &surrounded);
        Self { surrounded, component, components, weight: share.ln() / 0.01f64.ln() }
    }
}

/// Numbers the connected regions of cells above 0, over edges and corners.
fn connected(raster: &Raster, values: &[f32]) -> (Vec<u32>, usize) {
    let (nx, ny) = (raster.nx as i64, raster.ny as i64);
    let mut component = vec![u32::MAX; raster.len()];
    let mut count = 0;
    let mut todo = Vec::new();
    for start in 0..raster.len() {
        if values[start] <= 0.0 || component[start] != u32::MAX {
            continue;
        }
        component[start] = count;
        todo.push(start);
        while let Some(c) = todo.pop() {
            let (i, j) = (c as i64 % nx, c as i64 / nx);
            for (p, q) in (-1..=1).flat_map(|dj| (-1..=1).map(move |di| (i + di, j + dj))) {
                if p < 0 || q < 0 || p >= nx || q >= ny {
                    continue;
                }
                let neighbour = (q * nx + p) as usize;
                if values[neighbour] > 0.0 && component[neighbour] == u32::MAX {
                    component[neighbour] = count;
                    todo.push(neighbour);
                }
            }
        }
        count += 1;
    }
    (component, count as usize)
}

/// For each gap, the share of it that at least one of two poses explains. A hole of the part is a gap that one of them
/// explains all of; of a blot without data both predict surface in most of it, and the rest proves no hole either.
fn explained_by_either(gaps: &Gaps, first: &Witness, second: &Witness) -> Vec<f64> {
    let (mut all, mut neither) = (vec![0u32; gaps.components], vec![0u32; gaps.components]);
    for (c, _) in gaps.surrounded.iter().enumerate().filter(|(_, s)| **s > 0.0) {
        let gap = gaps.component[c] as usize;
        all[gap] += 1;
        neither[gap] += u32::from(first.predicted[c] && second.predicted[c]);
    }
    all.iter().zip(&neither).map(|(&all, &neither)| 1.0 - f64::from(neither) / f64::from(all.max(1))).collect()
}

/// The contradictions of two poses, mm², and their comparison.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Contest {
    /// Against the first pose, where the second has none.
    pub against_first_mm2: f64,
    /// Against the second pose, where the first has none.
    pub against_second_mm2: f64,
    /// Cost of the second over cost of the first.
    pub margin: f64,
}

/// Compares two witnesses.
pub(super) fn contest(ground: &Ground, gaps: &Gaps, first: &Witness, second: &Witness) -> Contest {
    let (mut against_first, mut against_second) = (0.0, 0.0);
    let explained = explained_by_either(gaps, first, second);
    for c in 0..ground.raster.len() {
        if gaps.surrounded[c] > 0.0 {
            let whole = explained[gaps.component[c] as usize];
            let gap = f64::from(gaps.surrounded[c]) * gaps.weight * whole * whole;
            let says = |w: &Witness| if w.predicted[c] { sparse(ground, w.explained[c]) } else { 0.0 };
            let more = says(first) - says(second);
            against_first += gap * more.max(0.0);
            against_second += gap * (-more).max(0.0);
        }
        // Points that neither explains (outliers, belt) cancel.
        let more = (f64::from(first.off[c]) - f64::from(second.off[c])) / ground.usual.max(1.0);
        let weight = ((more.abs() - 0.3) / 0.4).clamp(0.0, 1.0);
        if more > 0.0 {
            against_first += weight;
        } else {
            against_second += weight;
        }
    }
    let cell = ground.cell_mm2();
    let base = (BASE_MM2 + BASE_SHARE * first.predicted_mm2(ground)).max(BASE_CELLS * cell);
    let (against_first_mm2, against_second_mm2) = (against_first * cell, against_second * cell);
    let area = (base + against_second_mm2) / (base + against_first_mm2);
    Contest {
        against_first_mm2,
        against_second_mm2,
        margin: area * residual_factor(&first.residuals, &second.residuals),
    }
}

/// How empty a cell is of points near the surface, 0 to 1.
fn sparse(ground: &Ground, explained: u16) -> f64 {
    ((0.6 - f64::from(explained) / ground.usual.max(1.0)) / 0.35).clamp(0.0, 1.0)
}

/// Mean squared residual of the second over that of the first, on points that at least one of them explains, bounded.
fn residual_factor(first: &[f64], second: &[f64]) -> f64 {
    let (mut a, mut b, mut n) = (0.0, 0.0, 0.0);
    for (&r, &s) in first.iter().zip(second) {
        if r.min(s) < RESIDUAL_LIMIT_MM {
            a += r * r;
            b += s * s;
            n += 1.0;
        }
    }
    let floor = RESIDUAL_FLOOR_MM * RESIDUAL_FLOOR_MM * f64::max(n, 1.0);
    ((b + floor) / (a + floor)).clamp(1.0 / RESIDUAL_FACTOR, RESIDUAL_FACTOR)
}

/// Contradictions against a pose on its own, as shares of its predicted area.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Against {
    /// Predicted but absent, in gaps that data surrounds, weighted as in a contest.
    pub absent: f64,
    /// Present but not predicted: cells with many more unexplained points than the usual cell of the part.
    pub surplus: f64,
}

/// Sums them up.
pub(super) fn against(ground: &Ground, gaps: &Gaps, witness: &Witness) -> Against {
    let mut off: Vec<u16> =
        (0..ground.raster.len()).filter(|&c| witness.predicted[c]).map(|c| witness.off[c]).collect();
    off.sort_unstable();
    let background = off.get(off.len() / 2).map_or(0.0, |&n| f64::from(n));
    let (mut absent, mut surplus) = (0.0, 0.0);
    for c in 0..ground.raster.len() {
        if witness.predicted[c] {
            absent += f64::from(gaps.surrounded[c]) * gaps.weight * sparse(ground, witness.explained[c]);
        }
        let more = (f64::from(witness.off[c]) - background) / ground.usual.max(1.0);
        surplus += ((more - 0.55) / 0.35).clamp(0.0, 1.0);
    }
    let area = witness.predicted_mm2(ground).max(1.0) / ground.cell_mm2();
    Against { absent: absent / area, surplus: surplus / area }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 60 x 60 cells of 1 mm with 4 points each; a witness is made by hand.
    fn ground() -> Ground {
        let raster = Raster { x0: 0.0, y0: 0.0, cell_mm: 1.0, nx: 60, ny: 60 };
        let points: Vec<Point3> =
            (0..60 * 60 * 4).map(|k| Point3::new(f64::from(k / 4 % 60) + 0.5, f64::from(k / 240) + 0.5, 0.0)).collect();
        Ground::new(&points, raster, f64::NEG_INFINITY)
    }

    fn in_disc(c: usize, x: f64, y: f64, radius: f64) -> bool {
        ((c % 60) as f64 + 0.5 - x).hypot((c / 60) as f64 + 0.5 - y) < radius
    }

    /// The scan has a hole of 7 mm at `hole`; the pose puts it at `nominal`.
    fn witness(hole: (f64, f64), nominal: (f64, f64)) -> Witness {
        let data = |c: usize| !in_disc(c, hole.0, hole.1, 3.5);
        let surface = |c: usize| !in_disc(c, nominal.0, nominal.1, 3.5 - 0.9);
        let count = |yes: bool| if yes { 4 } else { 0 };
        Witness {
            explained: (0..3600).map(|c| count(data(c) && surface(c))).collect(),
            off: (0..3600).map(|c| count(data(c) && !surface(c))).collect(),
            predicted: (0..3600).map(|c| !in_disc(c, nominal.0, nominal.1, 3.5 + 0.9)).collect(),
            residuals: vec![0.1; 100],
        }
    }

    #[test]
    fn one_small_hole_decides_between_two_poses() {
        let ground = ground();
        let both = [witness((20.0, 30.0), (20.0, 30.0)), witness((20.0, 30.0), (40.0, 30.0))];
        let gaps = Gaps::find(&ground, &both);
        let contest_of = |a: &Witness, b: &Witness| contest(&ground, &gaps, a, b);
        let (right, wrong) = (contest_of(&both[0], &both[1]), contest_of(&both[1], &both[0]));
        // Data in the nominal hole: pi 2.6² = 21 mm². Absent at the real one: pi 3.5² = 38 mm², for cells counted whole.
        assert!(right.against_first_mm2 == 0.0 && (55.0..65.0).contains(&right.against_second_mm2), "{right:?}");
        assert!(right.margin > 4.0 && (right.margin * wrong.margin - 1.0).abs() < 1e-2);
    }

    #[test]
    fn equal_predictions_give_a_margin_of_one() {
        let ground = ground();
        let both = [witness((20.0, 30.0), (40.0, 30.0)), witness((20.0, 30.0), (40.0, 30.0))];
        let gaps = Gaps::find(&ground, &both);
        assert_eq!(contest(&ground, &gaps, &both[0], &both[1]).margin, 1.0);
    }

    #[test]
    fn a_large_uncovered_region_speaks_against_nobody() {
        let ground = ground();
        let mut both = [witness((20.0, 30.0), (20.0, 30.0)), witness((20.0, 30.0), (40.0, 30.0))];
        // The half with the first pose's hole was not measured: 30 mm wide, open to one side.
        for w in &mut both {
            for c in (0..3600).filter(|c| c % 60 < 30) {
                w.explained[c] = 0;
                w.off[c] = 0;
            }
        }
        let gaps = Gaps::find(&ground, &both);
        let contest = contest(&ground, &gaps, &both[0], &both[1]);
        // What is left: data in the hole of the second pose.
        assert!(contest.against_first_mm2 == 0.0 && (18.0..25.0).contains(&contest.against_second_mm2), "{contest:?}");
    }

    #[test]
    fn residuals_alone_are_bounded() {
        assert_eq!(residual_factor(&[0.1; 50], &[2.0; 50]), RESIDUAL_FACTOR);
        assert_eq!(residual_factor(&[2.0; 50], &[0.1; 50]), 1.0 / RESIDUAL_FACTOR);
        // Points that neither pose explains say nothing.
        assert_eq!(residual_factor(&[2.5; 50], &[2.5; 50]), 1.0);
    }
}
