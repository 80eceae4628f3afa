//! A cut through sheet and points at a comparison point: what the value was read from, seen from the side.
//!
//! The plane of the cut holds the sheet's normal and the direction in which a trimmed edge is measured; of a surface point or a hole without
//! direction any direction in the sheet is as good as the other, and always the same one is taken.

use crate::geometry::{CadFromScan, Mesh, Point3, Vector3};
use crate::inspect::PointResult;
use crate::part::Part;
use crate::plan::Side;
use crate::run::{Cancelled, RunContext};
use crate::scan::ConditionedScan;
use rayon::prelude::*;

/// Points looked at by one task.
const CHUNK: usize = 1 << 16;
/// Points nearer to the plane than this belong to the cut, mm; or nearer than their spacing, where that is more.
const HALF_SLAB_MM: f64 = 0.5;
/// The cut of a trimmed edge reaches so far either way, mm.
const EDGE_REACH_MM: f64 = 6.0;
/// More points than this tell the eye nothing more.
const MOST_POINTS: usize = 3000;

/// The plane of a cut, CAD frame: directions of unit length, square to each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// The nominal place, where both coordinates of the cut are 0.
    pub origin: Point3,
    /// To the right.
    pub across: Vector3,
    /// Up: the sheet's normal.
    pub up: Vector3,
    /// How far the cut reaches right and left, mm; up and down as well.
    pub reach_mm: f64,
    /// The window of a surface point or a hole reaches so far right and left, mm.
    pub window_mm: Option<f64>,
}

impl Frame {
    /// The plane through a point whose sheet has that normal (any length); `None` without a normal.
    pub fn of(point: &PointResult, normal: &Vector3) -> Option<Frame> {
        let up = normal.try_normalize(1e-9)?;
        let in_sheet = |v: &Vector3| v - up * v.dot(&up);
        // The coordinate axis that leans most from the normal lies best in the sheet.
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        let flattest = axes.iter().min_by(|a, b| a.dot(&up).abs().total_cmp(&b.dot(&up).abs()))?;
        let along = in_sheet(&point.direction);
        let across = if along.norm() > 0.5 { along } else { in_sheet(flattest) }.normalize();
        let window_mm = point.card.window_mm.filter(|mm| point.kind != "edge" && mm.is_finite());
        let reach_mm = window_mm.map_or(EDGE_REACH_MM, |mm| (1.4 * mm).clamp(3.0, 30.0));
        Some(Frame { origin: point.nominal, across, up, reach_mm, window_mm })
    }

    /// A place in the cut: mm to the right, mm up.
    pub fn place(&self, p: &Point3) -> [f64; 2] {
        let d = p - self.origin;
        [d.dot(&self.across), d.dot(&self.up)]
    }

    fn beside(&self) -> Vector3 {
        self.up.cross(&self.across)
    }
}

/// What the cut shows, in mm right and up from the nominal place.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Section {
    /// Kept points near the plane.
    pub points: Vec<[f32; 2]>,
    /// Both faces of the sheet, in straight pieces.
    pub sheet: Vec<[[f32; 2]; 2]>,
}

/// Cuts.
pub fn cut(
    frame: &Frame,
    part: &Part,
    scan: &ConditionedScan,
    cad_from_scan: &CadFromScan,
    run: &RunContext,
) -> Result<Section, Cancelled> {
    let mut sheet = Vec::new();
    for side in [Side::Top, Side::Bottom] {
        run.check()?;
        sheet.extend(cut_mesh(frame, &part.face(side).mesh));
    }
    Ok(Section { points: cut_points(frame, scan, cad_from_scan, run)?, sheet })
}

/// The points of the slab about the plane, in the scan's order.
fn cut_points(
    frame: &Frame,
    scan: &ConditionedScan,
    cad_from_scan: &CadFromScan,
    run: &RunContext,
) -> Result<Vec<[f32; 2]>, Cancelled> {
    let half_mm = HALF_SLAB_MM.max(scan.spacing_mm);
    let beside = frame.beside();
    let one = |&k: &u32| {
        let p = cad_from_scan.point(&scan.cloud.positions[k as usize]);
        let [x, y] = frame.place(&p);
        let inside =
            (p - frame.origin).dot(&beside).abs() <= half_mm && x.abs() <= frame.reach_mm && y.abs() <= frame.reach_mm;
        inside.then_some([x as f32, y as f32])
    };
    let chunks: Vec<Vec<[f32; 2]>> = scan
        .kept
        .par_chunks(CHUNK)
        .map(|chunk| {
            run.check()?;
            Ok(chunk.iter().filter_map(one).collect())
        })
        .collect::<Result<_, Cancelled>>()?;
    let all = chunks.concat();
    let every = all.len().div_ceil(MOST_POINTS).max(1);
    Ok(all.into_iter().step_by(every).collect())
}

/// Where the plane meets the triangles within reach.
fn cut_mesh(frame: &Frame, mesh: &Mesh) -> Vec<[[f32; 2]; 2]> {
    let beside = frame.beside();
    let off: Vec<f64> = mesh.vertices.iter().map(|v| (v - frame.origin).dot(&beside)).collect();
    let crossing = |triangle: &[u32; 3]| {
        let mut ends = Vec::with_capacity(2);
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            let (a, b) = (triangle[a] as usize, triangle[b] as usize);
            // A vertex in the plane counts as in front of it: every crossing has two ends.
            if (off[a] >= 0.0) != (off[b] >= 0.0) {
                let share = off[a] / (off[a] - off[b]);
                let place = frame.place(&(mesh.vertices[a] + (mesh.vertices[b] - mesh.vertices[a]) * share));
                ends.push(place.map(|mm| mm as f32));
            }
        }
        let piece: [[f32; 2]; 2] = ends.try_into().ok()?;
        let reach = frame.reach_mm as f32;
        let beyond = |axis: usize, sign: f32| piece.iter().all(|end| sign * end[axis] > reach);
        let outside = [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)].iter().any(|&(axis, sign)| beyond(axis, sign));
        (!outside).then_some(piece)
    };
    mesh.triangles.iter().filter_map(crossing).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inspect::Outcome;
    use crate::report::example;

    fn points() -> Vec<PointResult> {
        match example::bracket().outcome {
            Outcome::Measured(inspection) => inspection.points,
            Outcome::Refused(refusal) => panic!("{refusal}"),
        }
    }

    #[test]
    fn the_frame_of_an_edge_lies_along_its_direction_and_every_frame_is_square() {
        let all = points();
        for point in &all {
            let normal = if point.kind == "surface" { point.direction } else { Vector3::new(0.0, 0.3, 2.0) };
            let frame = Frame::of(point, &normal).expect("a normal");
            assert!(frame.across.dot(&frame.up).abs() < 1e-12 && (frame.across.norm() - 1.0).abs() < 1e-12);
            assert_eq!(frame.place(&point.nominal), [0.0, 0.0]);
            if point.kind == "edge" {
                let along = point.direction - frame.up * point.direction.dot(&frame.up);
                assert!((frame.across - along.normalize()).norm() < 1e-12 && frame.window_mm.is_none());
            }
        }
        assert!(all.iter().any(|p| p.kind == "edge") && all.iter().any(|p| p.kind == "surface"));
        assert!(Frame::of(&all[0], &Vector3::zeros()).is_none());
    }

    #[test]
    fn points_and_faces_stand_where_they_are_in_the_plane() {
        let part = example::dome_part(40);
        let (cloud, deviations) = example::dome_cloud(120_000, |_| 0.0);
        let (mut result, scan) = example::with_map(example::bracket(), &cloud, deviations, 1.0);
        let pose = example::inspection_mut(&mut result).alignment.cad_from_scan;
        let mut point = points().into_iter().find(|p| p.kind == "surface").expect("a surface point");
        (point.nominal, point.direction) = (example::dome_point(60.0, 0.0), Vector3::z());
        point.card.window_mm = Some(5.0);
        let frame = Frame::of(&point, &Vector3::z()).unwrap();
        assert_eq!((frame.across, frame.reach_mm, frame.window_mm), (Vector3::x(), 7.0, Some(5.0)));
        let section = cut(&frame, &part, &scan, &pose, &RunContext::silent()).unwrap();
        // The cloud lies on the dome. A chord of its 40 triangles stands off it by 0.02 mm, and a millimetre beside the plane, where
        // the dome is level, it is 0.01 mm lower.
        let near = |p: &[f32; 2]| section.sheet.iter().any(|piece| distance(p, piece) < 0.1);
        assert!(section.points.len() > 50 && section.points.iter().all(near), "{} points", section.points.len());
        // The other face lies a thickness below.
        let below = section.points.iter().map(|[x, y]| [*x, y - 1.2]);
        assert!(below.filter(|p| p[0].abs() < 6.0).all(|p| near(&p)));
        assert!(section.points.iter().flatten().all(|mm| mm.abs() <= 7.0));
    }

    fn distance(p: &[f32; 2], [a, b]: &[[f32; 2]; 2]) -> f32 {
        let (d, e) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
        let share = ((d[0] * e[0] + d[1] * e[1]) / (d[0] * d[0] + d[1] * d[1])).clamp(0.0, 1.0);
        (e[0] - share * d[0]).hypot(e[1] - share * d[1])
    }
}
