//! Figures of many records, and rows of tables.

use crate::parts::EdgeOffset;
use crate::record::{PointRecord, ScanRecord};
use shapeline::study::{mean, median, standard_deviation};
use std::collections::BTreeMap;

/// Kinds of comparison points, in the order of the tables, with the word for many.
pub const KINDS: [(&str, &str); 3] =
    [("surface", "Surface points"), ("edge", "Trimmed edges"), ("hole", "Hole centres")];

/// Bias and standard deviation, mm; not a number where there are too few values.
#[derive(Clone, Copy)]
pub struct Spread {
    pub bias: f64,
    pub sd: f64,
    pub count: usize,
}

impl Spread {
    pub fn of(values: &[f64]) -> Self {
        let or_nan = |v: Option<f64>| v.unwrap_or(f64::NAN);
        Self { bias: or_nan(mean(values)), sd: or_nan(standard_deviation(values)), count: values.len() }
    }

    /// Bias and standard deviation in two cells.
    pub fn cells(&self) -> String {
        format!("{:+.4} | {:.4}", self.bias, self.sd)
    }
}

/// All points of all scans that were measured.
pub fn points(records: &[ScanRecord]) -> impl Iterator<Item = (&ScanRecord, &PointRecord)> {
    records.iter().flat_map(|r| r.points.iter().map(move |p| (r, p)))
}

/// One list of the numbers that a closure takes from the points it is asked about.
pub fn collect<'a>(records: &'a [ScanRecord], of: impl Fn(&'a PointRecord) -> Vec<f64>) -> Vec<f64> {
    points(records).flat_map(|(_, p)| of(p)).collect()
}

/// Errors of the reported deviations; of a hole those of its centre along two axes.
pub fn aligned_errors(point: &PointRecord) -> Vec<f64> {
    match point.kind {
        "hole" => point.centre.map(Vec::from).unwrap_or_default(),
        _ => point.aligned.map(|(error, _)| error).into_iter().collect(),
    }
}

/// Errors of what the simple estimator tells: one, or the two of a hole's centre.
pub fn simple_errors(point: &PointRecord) -> Vec<f64> {
    point.simple.iter().take(if point.kind == "hole" { 2 } else { 1 }).copied().collect()
}

/// How many of the reported values U covers, and how many there are.
#[derive(Clone, Copy, Default)]
pub struct Covered {
    pub covered: usize,
    pub of: usize,
}

impl Covered {
    pub fn of<'a>(points: impl Iterator<Item = &'a PointRecord>) -> Self {
        points.filter_map(|p| p.aligned).fold(Self::default(), |sum, (error, u)| Self {
            covered: sum.covered + usize::from(error.abs() <= u),
            of: sum.of + 1,
        })
    }

    pub fn share(&self) -> f64 {
        100.0 * self.covered as f64 / self.of as f64
    }
}

/// Where the optical edge lies: what trimmed edges and holes are off by, in the middle and from one to the other.
pub fn edge_offset(records: &[ScanRecord]) -> EdgeOffset {
    let mut places: BTreeMap<(&str, &str), Vec<f64>> = BTreeMap::new();
    for (record, point) in points(records) {
        let outwards = match point.kind {
            "edge" => point.aligned.map(|(error, _)| error),
            // A rim that is seen outwards of the material's end makes the hole smaller.
            _ => point.diameter_error_mm.map(|error| -0.5 * error),
        };
        places.entry((&point.name, record.side.key())).or_default().extend(outwards);
    }
    let means: Vec<f64> = places.values().filter_map(|values| mean(values)).collect();
    let Spread { bias, sd, .. } = Spread::of(&means);
    EdgeOffset { mm: bias, u_mm: sd }
}

/// What of the points that the rig sees well, in a cloud that is dense enough, was not measured: these and all.
pub fn not_measured(records: &[ScanRecord]) -> (usize, usize) {
    const SEEN_DEG: f64 = 60.0;
    let seen = points(records).map(|(_, p)| p).filter(|p| p.seen_deg <= SEEN_DEG);
    seen.fold((0, 0), |(not, all), p| (not + usize::from(p.aligned.is_none()), all + 1))
}

/// Median U over the standard deviation of the reported values' errors.
pub fn u_over_spread(records: &[ScanRecord], kind: &str) -> f64 {
    let of_kind: Vec<(f64, f64)> =
        points(records).filter(|(_, p)| p.kind == kind).filter_map(|(_, p)| p.aligned).collect();
    let errors: Vec<f64> = of_kind.iter().map(|(error, _)| *error).collect();
    let stated: Vec<f64> = of_kind.iter().map(|(_, u)| *u).collect();
    median(&stated).unwrap_or(f64::NAN) / Spread::of(&errors).sd
}

/// Differences of the surface deviations told from above and from below, the same part twice.
pub fn above_minus_below(records: &[ScanRecord]) -> Vec<f64> {
    let told = |p: &PointRecord| p.aligned.map(|(error, _)| error + p.truth_mm);
    let pairs = records.chunks_exact(2).flat_map(|pair| pair[0].points.iter().zip(&pair[1].points));
    pairs.filter(|(a, _)| a.kind == "surface").filter_map(|(a, b)| Some(told(a)? - told(b)?)).collect()
}

/// Standard deviation, along an axis, that no estimator can go below for a hole in the middle of sheet whose points have this
/// noise: the Fisher information of a Poisson process whose density falls as the noise's distribution function does,
/// `rho / sigma * c` a length of rim, `c` the integral of `phi² / Phi`.
pub fn least_centre_sd_mm(diameter_mm: f64, density_per_mm2: f64, noise_mm: f64) -> f64 {
    const STEP: f64 = 1e-3;
    let phi = |x: f64| (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt();
    let (mut c, mut below) = (0.0, 0.0);
    for k in 0..16_000 {
        let x = -8.0 + (f64::from(k) + 0.5) * STEP;
        below += phi(x) * STEP;
        c += phi(x) * phi(x) / below * STEP;
    }
    (noise_mm / (density_per_mm2 * c * std::f64::consts::PI * 0.5 * diameter_mm)).sqrt()
}
