//! The simple estimators, on the same points in the same pose: a raw plane for a surface point (as the SIVPRO paper does), a circle
//! through the rim's points for a hole. They know the true pose, which side is seen, and where to look.

use crate::parts::axes;
use shapeline::fit::boundary::{RimPoints, boundary_circle};
use shapeline::fit::soft_edge::Circle;
use shapeline::geometry::{Point3, Vector3};
use shapeline::measure::{Card, Local, surface_with_card};
use shapeline::plan::{Geometry, SurfaceFit, SurfaceMethod};
use shapeline::simulate::Deviation;

/// Points so far from the sheet belong to it, mm: four times the noise along the line of sight.
const LAYER_MM: f64 = 0.5;
/// Points so far from the nominal rim are looked at, mm.
const AROUND_MM: f64 = 2.0;

/// What they are off by: one number, two for a hole's centre and a third for its diameter; nothing where they find nothing.
pub fn errors(local: &Local, geometry: &Geometry, truth: &Deviation) -> Vec<f64> {
    match geometry {
        Geometry::Surface { position, direction } => {
            let plane = SurfaceFit { method: SurfaceMethod::Plane, ..SurfaceFit::default() };
            let found = surface_with_card(local, position, direction, 3.0, &plane, &mut Card::default());
            found.map(|f| vec![f.deviation_mm - truth.deviation_mm]).unwrap_or_default()
        }
        Geometry::Hole { .. } => hole(local, geometry, truth).unwrap_or_default(),
        _ => Vec::new(),
    }
}

fn hole(local: &Local, geometry: &Geometry, truth: &Deviation) -> Option<Vec<f64>> {
    let Geometry::Hole { centre, axis, diameter_mm, .. } = geometry else { return None };
    let [x, y] = axes(axis);
    let radius = 0.5 * truth.diameter_mm?;
    let actual = Vector3::from(truth.delta_mm?);
    let near = Circle { centre: [x.dot(&actual), y.dot(&actual)], radius };
    let layer_mm = layer_mm(local, centre, &axis.into_inner(), *diameter_mm);
    let reach = 0.5 * diameter_mm + AROUND_MM;
    let points: Vec<[f64; 2]> = around(local, centre, reach + layer_mm.abs())
        .iter()
        .filter(|off| (off.dot(axis) - layer_mm).abs() < LAYER_MM)
        .map(|off| [x.dot(off), y.dot(off)])
        .filter(|p| p[0].hypot(p[1]) < reach)
        .collect();
    let found = boundary_circle(&points, &near, local.scan.spacing_mm, RimPoints::AngularGap)?;
    let off = [found.centre[0] - near.centre[0], found.centre[1] - near.centre[1]];
    Some(vec![off[0], off[1], 2.0 * (found.radius - radius)])
}

/// Offsets, in the CAD frame, of the kept points near a place.
fn around(local: &Local, centre: &Point3, reach_mm: f64) -> Vec<Vector3> {
    let middle = local.cad_from_scan.scan_from_cad() * centre;
    let mut near = Vec::new();
    local.grid.for_each_in_sphere(&middle, reach_mm, |_, p| near.push(local.cad_from_scan.point(p) - centre));
    near
}

/// Height of the seen sheet over the nominal centre along the axis: the middle of the heights around the hole.
fn layer_mm(local: &Local, centre: &Point3, axis: &Vector3, diameter_mm: f64) -> f64 {
    let mut heights: Vec<f64> =
        around(local, centre, 0.5 * diameter_mm + 2.0 * AROUND_MM).iter().map(|off| off.dot(axis)).collect();
    heights.sort_unstable_by(f64::total_cmp);
    heights.get(heights.len() / 2).copied().unwrap_or(0.0)
}
