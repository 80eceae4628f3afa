//! The CAD face around a feature as heights over the feature's plane.
//!
//! Points are compared with the CAD before a surface is fitted to them: a plane fitted to the points of a curved face is wrong
//! by curvature x radius² / 4, a quadratic by what is not quadratic. Where the face is smooth, a quadratic through some rays stands for it, which costs nothing
//! per point and evens out the CAD's facets; where it is not (a bend within the window), each point asks the face.

use super::Local;
use super::frame::{FeatureFrame, Uvw};
use nalgebra::{SMatrix, SVector};

/// A quadratic is good enough when it misses no sampled height by more than this, mm: around an opening or beside an edge,
/// where heights only tell which points belong to the sheet.
pub const ROUGH_MM: f64 = 0.02;
/// The same for a surface point, whose value takes over what the quadratic misses.
pub const FINE_MM: f64 = 0.003;

/// Heights of the CAD's seen face above the plane w = 0 of a feature's frame.
pub enum CadPatch<'a> {
    /// Coefficients of 1, u, v, u², uv, v², with u and v over `scale`.
    Quadratic([f64; 6], f64),
    /// Each point asks the face; the number is the face's height at the origin (0 over no material).
    Exact(&'a FeatureFrame, Local<'a>, f64),
}

impl<'a> CadPatch<'a> {
    /// Samples the face at places of the feature's plane (those over no material are skipped) within `depth_mm`; the quadratic
    /// may miss them by `limit_mm`.
    pub fn sample(
        local: &Local<'a>,
        frame: &'a FeatureFrame,
        places: &[[f64; 2]],
        depth_mm: f64,
        limit_mm: f64,
    ) -> Self {
        let mut rows = Vec::with_capacity(places.len());
        let height_at = |p: &[f64; 2]| face_height(local, frame, *p, depth_mm);
        for p in places {
            if let Some(height) = height_at(p) {
                rows.push([p[0], p[1], height]);
            }
        }
        match fit_quadratic(&rows) {
            Some((c, scale)) if worst(&rows, &c, scale) < limit_mm => CadPatch::Quadratic(c, scale),
            _ => CadPatch::Exact(frame, *local, height_at(&[0.0; 2]).unwrap_or(0.0)),
        }
    }

    /// Height of a point above the CAD face, along w.
    pub fn residual(&self, p: &Uvw) -> f64 {
        match self {
            CadPatch::Quadratic(c, scale) => p[2] - height(c, *scale, p[0], p[1]),
            // Past a trimmed edge the tangent plane at the edge goes on.
            CadPatch::Exact(frame, local, _) => {
                let point = frame.on_seen_face(*p);
                let Some(hit) = local.face.closest(&point, f64::INFINITY) else { return f64::NAN };
                let slope = hit.normal.dot(&frame.axes[2]) * frame.outward;
                (point - hit.point).dot(&hit.normal) * frame.outward / slope.max(0.3)
            }
        }
    }

    /// How much the face rises from the origin to a place; 0 where only the face itself could tell.
    pub fn rise(&self, u: f64, v: f64) -> f64 {
        match self {
            CadPatch::Quadratic(c, scale) => height(c, *scale, u, v) - c[0],
            CadPatch::Exact(..) => 0.0,
        }
    }

    /// Slopes of the face along u and v at the origin; 0 where only the face itself could tell.
    pub fn slopes(&self) -> [f64; 2] {
        match self {
            CadPatch::Quadratic(c, scale) => [c[1] / scale, c[2] / scale],
            CadPatch::Exact(..) => [0.0; 2],
        }
    }

    /// Height of the face at the origin: how far the CAD's facets are from the nominal place.
    pub fn at_origin(&self) -> f64 {
        match self {
            CadPatch::Quadratic(c, _) => c[0],
            CadPatch::Exact(_, _, height) => *height,
        }
    }
}

/// Height along w of the seen face nearest to the plane w = 0 of a frame, at most `depth_mm` away. Only what turns its outside
/// the way the frame does counts: the opposite wall of a channel or the turned-back leaf of a hem is no reference.
pub fn face_height(local: &Local, frame: &FeatureFrame, [u, v]: [f64; 2], depth_mm: f64) -> Option<f64> {
    // Both rays start a little on the other side of the plane, so that a face in the plane is not missed.
    const BACK_MM: f64 = 0.01;
    // A ray through more leaves than this is in no sheet.
    const LEAVES: usize = 8;
    let cast = |sense: f64| {
        let direction = frame.vector([0.0, 0.0, sense]);
        let mut start = -BACK_MM;
        for _ in 0..LEAVES {
            let origin = frame.on_seen_face([u, v, sense * start]);
            let hit = local.face.bvh.ray(&origin, &direction, depth_mm - start)?;
            let at = start + hit.t;
            let normal = local.face.mesh.normal(hit.triangle as usize)?;
            if normal.dot(&frame.axes[2]) * frame.outward > 0.0 {
                return Some(sense * at);
            }
            start = at + 1e-6;
        }
        None
    };
    [cast(1.0), cast(-1.0)].into_iter().flatten().min_by(|a, b| a.abs().total_cmp(&b.abs()))
}

fn terms(u: f64, v: f64) -> [f64; 6] {
    [1.0, u, v, u * u, u * v, v * v]
}

fn height(c: &[f64; 6], scale: f64, u: f64, v: f64) -> f64 {
    terms(u / scale, v / scale).iter().zip(c).map(|(t, c)| t * c).sum()
}

/// Least squares over (u, v, height); `None` with fewer than ten rows or rows along a line.
fn fit_quadratic(rows: &[Uvw]) -> Option<([f64; 6], f64)> {
    if rows.len() < 10 {
        return None;
    }
    let scale = rows.iter().map(|r| r[0].hypot(r[1])).fold(0.0, f64::max);
    let mut normal = SMatrix::<f64, 6, 6>::zeros();
    let mut right = SVector::<f64, 6>::zeros();
    for r in rows {
        let t = SVector::from(terms(r[0] / scale, r[1] / scale));
        normal += t * t.transpose();
        right += t * r[2];
    }
    let cholesky = normal.cholesky()?;
    // Pivots tell how well a term stands apart from those before it; heights need 1e-4 of the window at most.
    let pivots = cholesky.l_dirty().diagonal();
    (pivots.min() > 1e-4 * pivots.max()).then(|| (cholesky.solve(&right).into(), scale))
}

fn worst(rows: &[Uvw], c: &[f64; 6], scale: f64) -> f64 {
    rows.iter().map(|r| (r[2] - height(c, scale, r[0], r[1])).abs()).fold(0.0, f64::max)
}
