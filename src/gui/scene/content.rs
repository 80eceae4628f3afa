//! What a scene shows, computed from a part and a result away from the window's thread.

use super::map_values::{Measured, on_vertices, smoothed};
use super::permutation::shuffled;
use super::shape::{Shape, refined, single};
use crate::geometry::hull::convex_hull;
use crate::geometry::{Aabb, Mesh, Point3, Vector3};
use crate::inspect::Inspection;
use crate::part::{Part, PartSettings};
use crate::plan::{CadSide, Side};
use crate::run::{Cancelled, RunContext};
use crate::scan::{ConditionedScan, PointClass};
use std::sync::Arc;

/// A part as it is drawn: the same for all its scans seen from one side.
#[derive(Debug, Clone)]
pub struct PartContent {
    /// The CAD; also answers rays.
    pub part: Arc<Part>,
    /// The face that was seen.
    pub face: Side,
    /// About which all coordinates are stored.
    pub centre: Point3,
    /// The CAD's own surface.
    pub cad: Shape,
    /// The face that was seen, fine enough for a map.
    pub map: Shape,
    /// Triangles over the vertices of `cad`, for a picture that moves and no graphics card; as many as those of `cad` where these are few.
    pub cad_coarse: Vec<u32>,
    /// The same over those of `map`.
    pub map_coarse: Vec<u32>,
    /// Trimmed edges and rims: pairs of ends.
    pub outline: Vec<[f32; 3]>,
    /// Corners of its convex hull, CAD frame, for fitting.
    pub corners: Vec<Point3>,
    /// Mean normal of the face that was seen.
    pub facing: Vector3,
    fine: Mesh,
    normals: Vec<Vector3>,
    longest_mm: f64,
}

/// The map's mesh has about twice as many triangles of even size as this.
const MAP_CELLS: f64 = 50_000.0;
/// And no edge shorter than this is halved, mm.
const LEAST_EDGE_MM: f64 = 0.4;

/// Cells of a coarse surface over the whole part, each about two triangles; surfaces with few triangles stay as they are.
const COARSE_CELLS: f64 = 16_000.0;
const FEW_TRIANGLES: usize = 40_000;

impl PartContent {
    /// Of a part whose face was seen from one side of the sheet.
    pub fn of(part: &Arc<Part>, face: Side) -> PartContent {
        let seen = part.face(face);
        let centre = part.bounds.centre();
        let longest_mm = (seen.mesh.area() / MAP_CELLS).sqrt().max(LEAST_EDGE_MM);
        let fine = refined(&seen.mesh, longest_mm);
        let mut normals = vec![Vector3::zeros(); fine.vertices.len()];
        for (t, corners) in fine.triangles.iter().enumerate() {
            let area = fine.area_vector_twice(t);
            corners.iter().for_each(|&v| normals[v as usize] += area);
        }
        let (cad, map) = (Shape::of(&part.mesh, &centre), Shape::of(&fine, &centre));
        let cell_mm = (part.mesh.area() / COARSE_CELLS).sqrt();
        let coarse = |shape: &Shape| match shape.triangles.len() / 3 {
            few if few < FEW_TRIANGLES => shape.triangles.clone(),
            _ => shape.coarse(cell_mm),
        };
        let (cad_coarse, map_coarse) = (coarse(&cad), coarse(&map));
        let pairs = seen.boundary_loops.iter().flat_map(|chain| chain.windows(2));
        PartContent {
            part: part.clone(),
            face,
            centre,
            cad,
            map,
            cad_coarse,
            map_coarse,
            outline: pairs.flatten().map(|p| single(&(p - centre))).collect(),
            corners: convex_hull(&part.mesh.vertices).vertices,
            facing: (0..seen.mesh.triangles.len()).map(|t| seen.mesh.area_vector_twice(t)).sum(),
            fine,
            normals,
            longest_mm,
        }
    }
}

/// What became of a point, as the view shows it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Shown {
    /// On the map.
    Value = 0,
    /// Kept, but past an edge or too far from the CAD.
    Flagged = 1,
    /// Belt.
    Belt = 2,
    /// Taken by the colour or luminance filter.
    Colour = 3,
    /// A stray point or a duplicate.
    Stray = 4,
    /// Another part or thing.
    Other = 5,
}

impl Shown {
    /// All classes, in the order of their bits in a filter.
    pub const ALL: [Shown; 6] = [Shown::Value, Shown::Flagged, Shown::Belt, Shown::Colour, Shown::Stray, Shown::Other];

    fn of(class: PointClass) -> Shown {
        match class {
            PointClass::Kept => Shown::Flagged,
            PointClass::Belt => Shown::Belt,
            PointClass::Colour | PointClass::Dark => Shown::Colour,
            PointClass::Stray | PointClass::Duplicate => Shown::Stray,
            PointClass::Other => Shown::Other,
        }
    }
}

/// A scan's points as they are drawn, in a shuffled order: the first ones are a fair sample of all.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Cloud {
    /// From the scene's centre, mm.
    pub positions: Vec<[f32; 3]>,
    /// Deviations in mm; 0 where `classes` says that there is none.
    pub values: Vec<f32>,
    /// `Shown` of each point.
    pub classes: Vec<u8>,
    /// How many there are of each class.
    pub counts: [usize; 6],
}

/// A histogram of the map: as many bins as the palette can tell apart, over the plan's range and a little beyond.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Histogram {
    /// Lower end of the first bin, mm.
    pub start_mm: f64,
    /// Width of a bin, mm.
    pub width_mm: f64,
    /// Points in each bin; what lies beyond counts in the first and the last one.
    pub counts: Vec<usize>,
}

/// A result as it is drawn over its part.
#[derive(Debug, Clone)]
pub struct MapContent {
    /// The part.
    pub part: Arc<PartContent>,
    /// For each vertex of the part's map: deviation in mm, 1, the deviation smoothed a little (where lines are drawn), and
    /// much (whether there is form to be drawn); zeros where nothing was measured.
    pub values: Vec<[f32; 4]>,
    /// The points.
    pub cloud: Cloud,
    /// The deviations of all points.
    pub histogram: Histogram,
}

/// Rounds of smoothing for the lines' places (two edges of the mesh) and for what counts as form (five).
const LINE_ROUNDS: usize = 16;
const FORM_ROUNDS: usize = 90;

impl MapContent {
    /// Of a measured scan. The map's indices refer to the scan's cloud; indices beyond it are passed over.
    pub fn of(
        part: &Arc<PartContent>,
        inspection: &Inspection,
        scan: &ConditionedScan,
        range_mm: f64,
        run: &RunContext,
    ) -> Result<MapContent, Cancelled> {
        let (points, deviations_mm) = inspection.map_in_cad(&scan.cloud.positions);
        let measured = Measured { points: &points, deviations_mm: &deviations_mm, spacing_mm: scan.spacing_mm };
        let of_mesh = on_vertices(&part.fine, &part.normals, part.longest_mm, &measured, run)?;
        let smooth = smoothed(&part.fine, &of_mesh, LINE_ROUNDS);
        let form = smoothed(&part.fine, &smooth, FORM_ROUNDS);
        let of_vertex =
            |v: usize| if of_mesh[v].is_finite() { [of_mesh[v], 1.0, smooth[v], form[v]] } else { [0.0; 4] };
        let values = part.map.source.iter().map(|&v| of_vertex(v as usize)).collect();
        run.check()?;
        let cloud = cloud(part, inspection, scan);
        let histogram = histogram(&inspection.map.deviations_mm, range_mm);
        Ok(MapContent { part: part.clone(), values, cloud, histogram })
    }
}

impl MapContent {
    /// Of a scan without a part: its points with their classes in the scan's own frame, over the outline of the belt where one was found,
    /// else of the floor of its box. `None` where its points span nothing.
    pub fn of_scan(scan: &ConditionedScan, run: &RunContext) -> Option<MapContent> {
        let floor = Part::prepare(floor(scan)?, String::new(), &FLAT, run).ok()?;
        let part = Arc::new(PartContent::of(&Arc::new(floor), Side::Top));
        let classes: Vec<u8> = scan.classes.iter().map(|&c| Shown::of(c) as u8).collect();
        let mut counts = [0; 6];
        classes.iter().for_each(|&c| counts[c as usize] += 1);
        let order = shuffled(scan.cloud.positions.len());
        let place = |&k: &u32| single(&(scan.cloud.positions[k as usize] - part.centre));
        let cloud = Cloud {
            positions: order.iter().map(place).collect(),
            values: vec![0.0; order.len()],
            classes: order.iter().map(|&k| classes[k as usize]).collect(),
            counts,
        };
        let values = vec![[0.0; 4]; part.map.source.len()];
        Some(MapContent { part, values, cloud, histogram: Histogram::default() })
    }
}

/// A sheet of no thickness.
const FLAT: PartSettings = PartSettings { cad_side: CadSide::Top, thickness_mm: 0.0, plan_directions: Vec::new() };

/// A rectangle in the belt around a scan's part, or the floor of the box of its points.
fn floor(scan: &ConditionedScan) -> Option<Mesh> {
    let points = &scan.cloud.positions;
    let kept = scan.kept.iter().filter_map(|k| points.get(*k as usize));
    let seen = Aabb::of_points(kept)?;
    let normal = scan.belt.map_or_else(|| scan.to_camera.unwrap_or_else(Vector3::z_axis), |belt| belt.normal);
    let along = normal.cross(&Vector3::ith(normal.iamin(), 1.0)).try_normalize(1e-9)?;
    let across = normal.cross(&along);
    let origin = scan.belt.map_or(seen.min, |belt| belt.point);
    let corner = |k: usize| Vector3::from_fn(|c, _| if (k >> c) & 1 == 0 { seen.min[c] } else { seen.max[c] });
    let flat: Vec<[f64; 2]> =
        (0..8).map(|k| Point3::from(corner(k)) - origin).map(|d| [d.dot(&along), d.dot(&across)]).collect();
    let range = |axis: usize| {
        let of = |f: fn(f64, f64) -> f64, start| flat.iter().map(|p| p[axis]).fold(start, f);
        let (low, high) = (of(f64::min, f64::INFINITY), of(f64::max, f64::NEG_INFINITY));
        let margin = 0.15 * (high - low) + 1.0;
        [low - margin, high + margin]
    };
    let ([a, b], [c, d]) = (range(0), range(1));
    let at = |u: f64, v: f64| origin + along * u + across * v;
    Some(Mesh { vertices: vec![at(a, c), at(b, c), at(b, d), at(a, d)], triangles: vec![[0, 1, 2], [0, 2, 3]] })
}

fn cloud(part: &PartContent, inspection: &Inspection, scan: &ConditionedScan) -> Cloud {
    let n = scan.cloud.positions.len();
    let mut classes: Vec<u8> = scan.classes.iter().map(|&c| Shown::of(c) as u8).collect();
    classes.resize(n, Shown::Stray as u8);
    let mut values = vec![0.0f32; n];
    for (&i, &d) in inspection.map.indices.iter().zip(&inspection.map.deviations_mm) {
        if (i as usize) < n && d.is_finite() {
            classes[i as usize] = Shown::Value as u8;
            values[i as usize] = d;
        }
    }
    let mut counts = [0; 6];
    classes.iter().for_each(|&c| counts[c as usize] += 1);
    let order = shuffled(n);
    let pose = &inspection.alignment.cad_from_scan;
    let place = |&k: &u32| single(&(pose.point(&scan.cloud.positions[k as usize]) - part.centre));
    Cloud {
        positions: order.iter().map(place).collect(),
        values: order.iter().map(|&k| values[k as usize]).collect(),
        classes: order.iter().map(|&k| classes[k as usize]).collect(),
        counts,
    }
}

/// Bins of a fortieth of the range: 0.05 mm for a range of 2 mm in all.
const BINS: usize = 40;

fn histogram(deviations_mm: &[f32], range_mm: f64) -> Histogram {
    let width_mm = 2.0 * range_mm / BINS as f64;
    let mut counts = vec![0; BINS];
    for &d in deviations_mm {
        let bin = ((f64::from(d) + range_mm) / width_mm).floor();
        if bin.is_finite() {
            counts[bin.clamp(0.0, BINS as f64 - 1.0) as usize] += 1;
        }
    }
    Histogram { start_mm: -range_mm, width_mm, counts }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;

    #[test]
    fn the_cloud_knows_each_point_by_its_class_and_value() {
        let part = Arc::new(PartContent::of(&Arc::new(example::dome_part(20)), Side::Top));
        let (points, deviations) = example::dome_cloud(4000, |p| 0.01 * p.x);
        let (mut result, mut scan) = example::with_map(example::bracket(), &points, deviations, 3.0);
        let inspection = example::inspection_mut(&mut result);
        // The last ten points lose their value, five of them were belt.
        let n = inspection.map.indices.len();
        inspection.map.indices.truncate(n - 10);
        inspection.map.deviations_mm.truncate(n - 10);
        scan.classes[n - 5..].fill(PointClass::Belt);
        let content = MapContent::of(&part, inspection, &scan, 1.0, &RunContext::silent()).unwrap();
        assert_eq!(content.cloud.counts, [n - 10, 5, 5, 0, 0, 0]);
        for ((p, &value), &class) in
            content.cloud.positions.iter().zip(&content.cloud.values).zip(&content.cloud.classes)
        {
            let x = f64::from(p[0]) + part.centre.x;
            // There and back through the pose and f32: 1e-5 mm, times 0.01.
            let expected = if class == Shown::Value as u8 { 0.01 * x } else { 0.0 };
            assert!((f64::from(value) - expected).abs() < 1e-5, "{value} {expected}");
        }
        assert_eq!(content.values.len(), part.map.positions.len());
        assert_eq!(content.histogram.counts.iter().sum::<usize>(), n - 10);
    }

    #[test]
    fn a_scan_without_a_part_is_shown_in_its_own_frame_over_its_floor() {
        let (points, deviations) = example::dome_cloud(3000, |_| 0.0);
        let (_, mut scan) = example::with_map(example::bracket(), &points, deviations, 3.0);
        let n = scan.classes.len();
        scan.classes[n - 7..].fill(PointClass::Belt);
        let content = MapContent::of_scan(&scan, &RunContext::silent()).unwrap();
        assert_eq!((content.cloud.counts[Shown::Flagged as usize], content.cloud.counts[2]), (n - 7, 7));
        let kept = scan.kept.iter().map(|k| scan.cloud.positions[*k as usize]);
        let centre = content.part.centre;
        let far = kept.map(|p| (p - centre).norm()).fold(0.0, f64::max);
        assert!(far < content.part.part.diagonal_mm() * 1.2, "{far}");
        scan.kept.clear();
        assert!(MapContent::of_scan(&scan, &RunContext::silent()).is_none());
    }

    #[test]
    fn bins_hold_their_values_and_the_ends_what_is_beyond() {
        let histogram = histogram(&[-5.0, -0.99, -0.01, 0.01, 0.06, 0.99, 7.0, f32::NAN], 1.0);
        assert_eq!(
            (histogram.counts[0], histogram.counts[19], histogram.counts[20], histogram.counts[21]),
            (2, 1, 1, 1)
        );
        assert_eq!(histogram.counts[39], 2);
        assert!((histogram.width_mm - 0.05).abs() < 1e-12 && histogram.start_mm == -1.0);
    }
}
