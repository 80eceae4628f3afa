//! One seed: views, masks, merging, fit.

use shapeline::geometry::Point3;
use shapeline::plan::merge::FeatureKind;
use shapeline::run::RunContext;
use shapeline::simulate::endoscope::{PriorError, Scene, SimulatedView};
use shapeline::stitch::feature::fit_feature;
use shapeline::stitch::non_uniformity::{MEAN_RADIUS_GRID, NORMAL_RADIUS_GRID, non_uniformity};
use shapeline::stitch::spacing::grid_distance;
use shapeline::stitch::voxel::voxel_means;
use shapeline::stitch::{Mask, Metric, Rank, survivors};
use std::error::Error;

/// The cylinder's radius by its certificate, µm.
pub const RADIUS_UM: f64 = 1001.5;
/// d_s in d_grid.
pub const RADII: [f64; 3] = [1.0, 2.0, 5.0];
/// What is left out before merging.
pub const MASKS: [(&str, bool, bool); 4] =
    [("none", false, false), ("sigma_I", true, false), ("d_cal", false, true), ("both", true, true)];
/// How points are merged.
pub const JUDGES: [(&str, Option<Metric>); 4] = [
    ("voxel mean", None),
    ("d_cal", Some(Metric::CalibrationDistance)),
    ("sigma_I", Some(Metric::PhaseShiftVariation)),
    ("delta_n", Some(Metric::NonUniformity)),
];

type Failed = Box<dyn Error>;

/// What a cloud tells of the cylinder.
#[derive(Clone, Copy)]
pub struct Figures {
    /// Fitted less true radius, µm.
    pub d_r: f64,
    /// Standard deviation of all points about the fit, µm.
    pub sigma_dev: f64,
    /// Points.
    pub n: usize,
}

/// Everything of one seed.
pub struct Trial {
    /// µm.
    pub d_grid: f64,
    /// By mask, nothing merged.
    pub unmerged: [Figures; 4],
    /// By radius, mask and judge.
    pub merged: [[[Figures; 4]; 4]; 3],
}

/// Points of both views in the world's frame, with what is known of each.
struct Cloud {
    positions: Vec<Point3>,
    ranks: Vec<(u32, u32)>,
    sigma_i: Vec<f32>,
    d_cal: Vec<f32>,
    delta_n: Vec<f32>,
}

const EXACT: PriorError = PriorError { shift: 0.0, turn_rad: 0.0 };

/// The two views of the cylinder, put together by their true poses.
pub fn cylinder(seed: u64) -> Result<Trial, Failed> {
    let scene = Scene::cylinder(EXACT, seed);
    let views = scene.views();
    let mut distances = Vec::new();
    for view in &views {
        distances.extend(grid_distance(&view.positions)?);
    }
    let d_grid = distances.iter().sum::<f64>() / distances.len() as f64;
    let cloud = together(&scene, &views, d_grid)?;
    let masked = MASKS.map(|(_, sigma_i, d_cal)| cloud.kept(sigma_i, d_cal));
    let unmerged = each(&masked, |kept| figures(&cloud.at(kept)))?;
    let merged = each(&RADII, |radius| {
        each(&masked, |kept| each(&JUDGES, |(_, judge)| figures(&cloud.merged(kept, *judge, radius * d_grid)?)))
    })?;
    Ok(Trial { d_grid, unmerged, merged })
}

fn each<A, B, const N: usize>(of: &[A; N], what: impl Fn(&A) -> Result<B, Failed>) -> Result<[B; N], Failed> {
    let all: Result<Vec<B>, Failed> = of.iter().map(what).collect();
    all?.try_into().map_err(|_| "as many out as in".into())
}

fn together(scene: &Scene, views: &[SimulatedView], d_grid: f64) -> Result<Cloud, Failed> {
    let mut cloud =
        Cloud { positions: Vec::new(), ranks: Vec::new(), sigma_i: Vec::new(), d_cal: Vec::new(), delta_n: Vec::new() };
    for (k, (view, station)) in views.iter().zip(&scene.stations).enumerate() {
        let (near, around) = (NORMAL_RADIUS_GRID * d_grid, MEAN_RADIUS_GRID * d_grid);
        cloud.delta_n.extend(non_uniformity(&view.positions, &Point3::origin(), near, around)?.delta_n);
        cloud.positions.extend(view.positions.iter().map(|p| station.world_from_view * p));
        cloud.ranks.extend((0..view.positions.len() as u32).map(|i| (k as u32, i)));
        cloud.sigma_i.extend(&view.sigma_i);
        cloud.d_cal.extend(&view.d_cal);
    }
    Ok(cloud)
}

/// The paper's thresholds.
fn masks(sigma_i: bool, d_cal: bool) -> [Mask; 2] {
    let free = Mask { metric: Metric::Strength, min: f64::NEG_INFINITY, max: f64::INFINITY };
    [
        Mask { metric: Metric::PhaseShiftVariation, min: if sigma_i { 0.002 } else { free.min }, ..free },
        Mask { metric: Metric::CalibrationDistance, max: if d_cal { 150.0 } else { free.max }, ..free },
    ]
}

impl Cloud {
    fn kept(&self, sigma_i: bool, d_cal: bool) -> Vec<usize> {
        let [signal, near] = masks(sigma_i, d_cal);
        (0..self.positions.len()).filter(|i| signal.keeps(self.sigma_i[*i]) && near.keeps(self.d_cal[*i])).collect()
    }

    fn at(&self, kept: &[usize]) -> Vec<Point3> {
        kept.iter().map(|i| self.positions[*i]).collect()
    }

    fn merged(&self, kept: &[usize], judge: Option<Metric>, radius: f64) -> Result<Vec<Point3>, Failed> {
        let positions = self.at(kept);
        let Some(metric) = judge else {
            return Ok(voxel_means(&positions, radius)?.into_iter().map(|(p, _)| p).collect());
        };
        let column = match metric {
            Metric::CalibrationDistance => &self.d_cal,
            Metric::PhaseShiftVariation => &self.sigma_i,
            _ => &self.delta_n,
        };
        let rank = |i: &usize| {
            let (view, index) = self.ranks[*i];
            Rank { score: metric.score(f64::from(column[*i])), view, index }
        };
        let ranks: Vec<Rank> = kept.iter().map(rank).collect();
        let left = survivors(&positions, &ranks, radius, &RunContext::silent())?;
        Ok(left.into_iter().map(|k| positions[k as usize]).collect())
    }
}

fn figures(points: &[Point3]) -> Result<Figures, Failed> {
    let fit = fit_feature(FeatureKind::Cylinder, points)?;
    let d_r = fit.d_r(Some(RADIUS_UM)).ok_or("a cylinder has a radius")?;
    Ok(Figures { d_r, sigma_dev: fit.sigma_dev, n: fit.points })
}

/// One view of a plane and a sphere by itself, unmasked and masked: sigma_dev, µm, and points.
pub struct Masking {
    /// Plane, sphere; by mask.
    pub sigma_dev: [[(f64, usize); 4]; 2],
}

/// What the masks do to one view, as in sections 5.1 and 5.2 of the paper.
pub fn masking(seed: u64) -> Result<Masking, Failed> {
    let subjects = [(Scene::plane(EXACT, seed), FeatureKind::Plane), (Scene::sphere(EXACT, seed), FeatureKind::Sphere)];
    let sigma_dev = each(&subjects, |(scene, kind)| {
        let view = scene.view(0);
        each(&MASKS, |(_, sigma_i, d_cal)| {
            let [signal, near] = masks(*sigma_i, *d_cal);
            let keeps = |i: &usize| signal.keeps(view.sigma_i[*i]) && near.keeps(view.d_cal[*i]);
            let points: Vec<Point3> = (0..view.positions.len()).filter(keeps).map(|i| view.positions[i]).collect();
            Ok((fit_feature(*kind, &points)?.sigma_dev, points.len()))
        })
    })?;
    Ok(Masking { sigma_dev })
}
