//! The deviation of every kept point.
//!
//! The sign is taken from the face that the camera saw, never from inside or outside: a sheet has neither. It is
//! positive along the CAD's normals, whichever side was measured. Where that face turns its back to the camera, as the leaf of a
//! hem does, the camera sees the sheet's other face, and the point is compared with that.

use super::crowd;
use super::result::{DeviationMap, MapStatistics};
use crate::geometry::{CadFromScan, Point3, Vector3};
use crate::part::{Face, FaceHit, Part};
use crate::plan::Side;
use crate::run::{Cancelled, RunContext};
use crate::scan::ConditionedScan;
use rayon::prelude::*;

/// Points a chunk: the unit of parallel work and of summing, the same for any number of threads.
const CHUNK: usize = 4096;
/// A point further from the face than this is not counted, whatever the colour scale: it belongs to something else.
const LEAST_REACH_MM: f64 = 3.0;
/// Or this many colour ranges, where that is more.
const REACH_RANGES: f64 = 3.0;

/// What became of one kept point.
#[derive(Clone, Copy, PartialEq)]
enum Fate {
    Value(f32),
    PastEdge,
    Far,
}

/// Cosine between a normal and the direction to the camera below which a face surely turns its back: 105 degrees.
const TURNED_AWAY: f64 = -0.26;

/// Compares every kept point with the face that a camera on `side` sees.
pub fn deviation_map(
    scan: &ConditionedScan,
    part: &Part,
    side: Side,
    cad_from_scan: &CadFromScan,
    range_mm: f64,
    run: &RunContext,
) -> Result<DeviationMap, Cancelled> {
    let reach_mm = LEAST_REACH_MM.max(REACH_RANGES * range_mm);
    let to_camera_cad = scan.to_camera.map(|d| cad_from_scan.vector(&d));
    let skins = Skins { seen: part.face(side), other: part.face(side.opposite()), to_camera_cad };
    let chunks: Vec<Vec<Fate>> = scan
        .kept
        .par_chunks(CHUNK)
        .map(|chunk| {
            run.check()?;
            Ok(compare_chunk(scan, &skins, cad_from_scan, reach_mm, chunk))
        })
        .collect::<Result<_, Cancelled>>()?;
    let mut map = DeviationMap::default();
    let mut far = Vec::new();
    map.indices.reserve(scan.kept.len());
    map.deviations_mm.reserve(scan.kept.len());
    for (&index, fate) in scan.kept.iter().zip(chunks.iter().flatten()) {
        match fate {
            Fate::Value(deviation) => {
                map.indices.push(index);
                map.deviations_mm.push(*deviation);
            }
            Fate::PastEdge => {
                map.statistics.past_edge += 1;
                map.flagged.push(index);
            }
            Fate::Far => {
                map.statistics.far += 1;
                map.flagged.push(index);
                far.push(cad_from_scan.point(&scan.cloud.positions[index as usize]));
            }
        }
    }
    map.far_crowd = crowd::fullest(&far, scan.spacing_mm);
    map.statistics = MapStatistics {
        past_edge: map.statistics.past_edge,
        far: map.statistics.far,
        ..statistics(&map.deviations_mm, range_mm)
    };
    Ok(map)
}

/// Both faces of the sheet, and where the camera stands.
struct Skins<'a> {
    seen: &'a Face,
    other: &'a Face,
    to_camera_cad: Option<Vector3>,
}

impl<'a> Skins<'a> {
    /// The face of which the camera sees the place that was hit, and the place there.
    fn visible(&self, point: &Point3, hit: FaceHit, reach_mm: f64) -> (&'a Face, FaceHit) {
        let turned_away = self.to_camera_cad.is_some_and(|d| hit.normal.dot(&d) < TURNED_AWAY);
        let other = if turned_away { self.other.closest(point, reach_mm) } else { None };
        other.map_or((self.seen, hit), |other| (self.other, other))
    }
}

fn compare_chunk(
    scan: &ConditionedScan,
    skins: &Skins,
    cad_from_scan: &CadFromScan,
    reach_mm: f64,
    chunk: &[u32],
) -> Vec<Fate> {
    let mut last_triangle = None;
    chunk
        .iter()
        .map(|&index| {
            let point = cad_from_scan.point(&scan.cloud.positions[index as usize]);
            let hit = match last_triangle {
                Some(seed) => skins.seen.closest_seeded(&point, reach_mm, seed),
                None => skins.seen.closest(&point, reach_mm),
            };
            let Some(hit) = hit else { return Fate::Far };
            last_triangle = Some(hit.triangle);
            let (face, hit) = skins.visible(&point, hit, reach_mm);
            if hit.on_boundary { Fate::PastEdge } else { Fate::Value((face.side.sign() * hit.signed_mm) as f32) }
        })
        .collect()
}

/// Statistics of the values, summed in fixed chunks.
fn statistics(deviations_mm: &[f32], range_mm: f64) -> MapStatistics {
    let n = deviations_mm.len();
    if n == 0 {
        return MapStatistics::default();
    }
    let (mut sum, mut squares, mut within) = (0.0, 0.0, 0usize);
    for chunk in deviations_mm.chunks(CHUNK) {
        let (mut s, mut q) = (0.0, 0.0);
        for &d in chunk {
            let d = f64::from(d);
            s += d;
            q += d * d;
            within += usize::from(d.abs() <= range_mm);
        }
        sum += s;
        squares += q;
    }
    let mut sorted = deviations_mm.to_vec();
    MapStatistics {
        points: n,
        mean_mm: sum / n as f64,
        rms_mm: (squares / n as f64).sqrt(),
        p05_mm: quantile(&mut sorted, 0.05),
        p95_mm: quantile(&mut sorted, 0.95),
        within_range_ratio: within as f64 / n as f64,
        past_edge: 0,
        far: 0,
    }
}

/// The value at that share of the sorted values (nearest rank).
fn quantile(values: &mut [f32], share: f64) -> f64 {
    let rank = ((values.len() as f64 * share).ceil() as usize).clamp(1, values.len()) - 1;
    let (_, value, _) = values.select_nth_unstable_by(rank, f32::total_cmp);
    f64::from(*value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics_of_known_values() {
        let values: Vec<f32> = (1..=100).map(|k| k as f32 / 100.0).collect();
        let s = statistics(&values, 0.5);
        assert_eq!(s.points, 100);
        // Each value is within half an ulp of f32 (3e-8) of k / 100.
        assert!((s.mean_mm - 0.505).abs() < 1e-7);
        assert!((s.rms_mm - (0.338_35f64).sqrt()).abs() < 1e-7);
        assert!((s.p05_mm - 0.05).abs() < 1e-7 && (s.p95_mm - 0.95).abs() < 1e-7);
        assert_eq!(s.within_range_ratio, 0.5);
    }

    #[test]
    fn no_values_no_statistics() {
        assert_eq!(statistics(&[], 1.0), MapStatistics::default());
    }
}
