//! Why a scan is not measured, in words with numbers, and what to do.

use crate::diagnostic::{Refusal, Rivals, Stop};
use crate::geometry::Point3;
use crate::part::Part;
use crate::scan::{APART_SPACINGS, ConditionedScan};

/// Fewer kept points tell no pose.
const LEAST_POINTS: usize = 150;
/// Of the visible face, at least this share must have been measured.
const LEAST_COVERAGE: f64 = 0.5;
/// Of the kept points, at least this share must lie on the part.
const LEAST_EXPLAINED: f64 = 0.5;
/// Data that contradicts the pose, as a share of the visible face: at most 0.02 was seen in right poses with 30 % outliers, at
/// least 0.09 for the mirrored twin of a bracket.
const MOST_CONTRADICTION: f64 = 0.05;
/// The scan may be larger or smaller than the part by this factor before it counts as another thing.
const SIZE_FACTOR: f64 = 2.5;

/// Refuses a scan with next to no points.
pub(super) fn without_points(scan: &ConditionedScan) -> Result<(), Stop> {
    if scan.kept.len() < LEAST_POINTS { Err(no_part(scan).into()) } else { Ok(()) }
}

/// Nothing of a part in the scan.
pub(super) fn no_part(scan: &ConditionedScan) -> Refusal {
    Refusal::new(
        format!("no part in the scan: {} of {} points are not background", scan.kept.len(), scan.cloud.len()),
        "check that a part lies in view, and the [background] settings if one does",
    )
}

/// No pose could be tried at all.
pub(super) fn nothing_fits() -> Refusal {
    Refusal::new("no pose of the part fits the scan", "check that the plan names the CAD of this part")
}

/// The sheet was seen from a side that nobody knows.
pub(super) fn without_side(thickness_mm: f64) -> Refusal {
    Refusal::new(
        format!(
            "the side of the sheet cannot be told: no belt, no view direction and no normals, and the sheet is {thickness_mm} mm thick"
        ),
        "give view_direction in [scans], the direction in which the camera looks in the scan's frame",
    )
}

/// Why nothing is judged when both faces of a solid fit the scan alike and nobody knows which of them was seen.
pub(super) fn open_face(rms_mm: [f64; 2]) -> String {
    let [a, b] = rms_mm;
    format!(
        "the face of the solid that was seen cannot be told: no belt, no view direction and no normals, and both faces fit alike (rms {a:.3} mm and {b:.3} mm); give view_direction in [scans]"
    )
}

/// The same where only one end gave a pose: an end that fits two poses alike fits as well, and may be the one that was seen. An end
/// that was refused for anything else was not.
pub(super) fn open_face_beside(other_end: &Refusal) -> Option<String> {
    other_end.rivals.as_ref().map(|_| {
        format!(
            "the face of the solid that was seen cannot be told: no belt, no view direction and no normals, and the other face may be the one ({}); give view_direction in [scans]",
            other_end.reason
        )
    })
}

/// Refuses a scan whose extent is not the part's.
pub(super) fn wrong_size(part: &Part, points: &[Point3]) -> Result<(), Stop> {
    let extent = bulk_extent(points);
    let nominal = part.diagonal_mm();
    if extent > SIZE_FACTOR * nominal || extent * SIZE_FACTOR < nominal {
        let words = if extent > nominal { "large" } else { "small" };
        return Err(Refusal::new(
            format!("the scan is too {words} for the part: {extent:.0} mm across, the CAD {nominal:.0} mm"),
            "check `unit` of the scan and of the CAD, and that one whole part is in view",
        )
        .into());
    }
    Ok(())
}

/// Diagonal of the box that leaves out 5 % of the points at each end of each axis.
fn bulk_extent(points: &[Point3]) -> f64 {
    let picks = super::sampling::spread(points.len(), 10_001);
    let range = |axis: usize| {
        let mut values: Vec<f64> = picks.iter().map(|&k| points[k as usize][axis]).collect();
        values.sort_unstable_by(f64::total_cmp);
        let at = |share: f64| values[((values.len() - 1) as f64 * share) as usize];
        at(0.95) - at(0.05)
    };
    (range(0).powi(2) + range(1).powi(2) + range(2).powi(2)).sqrt()
}

/// Refuses a scan that the best pose does not explain.
pub(super) fn unlike(coverage: f64, explained: f64, against: super::evidence::Against) -> Result<(), Stop> {
    let contradiction = against.surplus;
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    if coverage < LEAST_COVERAGE {
        return Err(Refusal::new(
            format!(
                "too little of the part was measured: {} of the visible face, at least {} is needed",
                percent(coverage),
                percent(LEAST_COVERAGE)
            ),
            "check that the whole part is in view and that the [background] settings leave it, or that the plan names its CAD",
        )
        .into());
    }
    if explained < LEAST_EXPLAINED {
        return Err(Refusal::new(
            format!(
                "the scan does not look like the plan's part: only {} of its points lie on it, at least {} must",
                percent(explained),
                percent(LEAST_EXPLAINED)
            ),
            "check that the plan names the CAD of this part, and that one part alone is in view",
        )
        .into());
    }
    if contradiction > MOST_CONTRADICTION {
        return Err(Refusal::new(
            format!(
                "the scan does not look like the plan's part: holes, edges or heights differ on {} of the visible face, at most {} may",
                percent(contradiction),
                percent(MOST_CONTRADICTION)
            ),
            "check that the plan names the CAD of this part and not of its mirrored twin, that the whole part is in view, and that view_direction in [scans] points from the camera to the part",
        )
        .into());
    }
    Ok(())
}

/// Instead of the refusal of something that is larger than the part and hangs together.
pub(super) fn touching([seen_mm2, part_mm2]: [f64; 2], spacing_mm: f64, refusal: &Refusal) -> Refusal {
    let apart_mm = (APART_SPACINGS * spacing_mm).ceil().max(2.0);
    Refusal::new(
        format!(
            "{:.0} cm² hang together in view, the part has {:.0} cm²: parts that touch or overlap, or a part and belt left on it, cannot be told apart ({})",
            seen_mm2 / 100.0,
            part_mm2 / 100.0,
            refusal.reason
        ),
        format!(
            "leave {apart_mm:.0} mm or more between parts, and between the part and anything else, as the camera sees them; where belt was left, see [background]; or {}",
            refusal.help
        ),
    )
}

/// Nothing in view is large enough to be the part, and all of it together is too large.
pub(super) fn pieces(part_mm2: f64) -> Refusal {
    Refusal::new(
        format!("several things are in view, and none is large enough to be the part ({:.0} cm²)", part_mm2 / 100.0),
        "check that the whole part is in view and that the [background] settings leave it, or that the plan names its CAD",
    )
}

/// A pose that leaves out what speaks against it.
pub(super) fn contradicted() -> Refusal {
    Refusal::new(
        "the scan does not look like the plan's part: something lies over or under where a part of it would be",
        "check that the plan names the CAD of this part, and that nothing lies on it or under it",
    )
}

/// Of several things none is the part.
pub(super) fn none_of(count: usize, largest: &Refusal) -> Refusal {
    let reason = format!("of {count} things in view none is the plan's part; of the largest: {}", largest.reason);
    Refusal { reason, ..largest.clone() }
}

/// Two parts of the plan's kind; their middles in the scan's frame.
pub(super) fn two_parts(one: &Point3, other: &Point3) -> Refusal {
    let place = |p: &Point3| format!("({:.0}, {:.0}, {:.0})", p.x, p.y, p.z);
    Refusal::new(
        format!(
            "two parts of the plan's kind are in view, around {} and {} of the scan: one verdict cannot be that of both",
            place(one),
            place(other)
        ),
        "let one of them at a time into view, or cut the scan so that each of its files shows one",
    )
}

/// Two poses fit almost alike.
pub(super) fn ambiguous(rivals: Rivals) -> Refusal {
    let Rivals { margin, margin_limit, apart } = rivals;
    let apart = apart.map_or(String::new(), |(angle, distance)| {
        format!(", {:.0} degrees and {distance:.1} mm apart", angle.to_degrees())
    });
    let refusal = Refusal::new(
        format!("two poses of the part fit almost alike{apart}: margin {margin:.2}, at least {margin_limit} is needed"),
        "make sure that a hole, edge or bend that tells them apart is in view; a symmetric part needs a mark of its own",
    );
    Refusal { rivals: Some(rivals), ..refusal }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_end_that_fits_two_poses_leaves_the_face_open_and_one_that_fits_none_does_not() {
        let rivals = Rivals { margin: 1.1, margin_limit: 1.5, apart: Some((0.5, 2.0)) };
        let told = open_face_beside(&ambiguous(rivals)).expect("it fits");
        assert!(told.contains("two poses of the part fit almost alike") && told.contains("view_direction"), "{told}");
        assert_eq!(open_face_beside(&nothing_fits()), None);
    }
}
