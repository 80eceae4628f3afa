//! The alignment on the plan's datum features: pure geometry, no cloud.
//!
//! The paper's scheme (Bergström et al., SIVPRO, section 5.2) holds the hole's centre (three translations), a direction
//! (two rotations) and the surface point along its direction (the last rotation); rps holds points along locked directions. Both are
//! rows of `fit::hold`, which solves them.
//!
//! Everything is in the CAD frame as the current pose has it; the answer is the motion `corrected_from_current`.

use super::datum_values::{DatumValue, Datums, Nudge, datum_indices};
use super::pose::{DatumHold, LockResidual};
use crate::fit::hold::{self, Held, HoldError, Named, Row, Told, WEAK_CONDITION};
use crate::geometry::{UnitVector3, Vector3};
use crate::plan::{AlignmentMethod, Feature, Geometry, RpsLock, SlotReading};
use nalgebra::UnitQuaternion;

/// Why datums do not fix a part.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DatumError {
    /// They leave motions free.
    #[error("the datums leave a motion free: {motion}")]
    FreeMotion {
        /// The motion in words; of several all, joined by `and`.
        motion: String,
    },
    /// The iteration did not settle.
    #[error("the datum equations did not settle after {iterations} steps")]
    NotConverged {
        /// How many were made.
        iterations: usize,
    },
    /// Hole and slot lie in one place.
    #[error("the hole and the slot lie in the same place, and no line runs between their centres")]
    NoLine,
    /// A datum's place or direction is not a number.
    #[error("a datum's place, direction or uncertainty is not a finite number")]
    NotFinite,
}

/// Centres nearer to each other have no line through them, mm.
const SAME_PLACE_MM: f64 = 1e-9;

/// The motion that brings the datums, in the order of `datum_indices`, to their nominal places.
pub(super) fn solve(datums: Datums, values: &[DatumValue], nudge: Option<Nudge>) -> Result<Held, DatumError> {
    hold::solve(&rows(datums, values, nudge)?, datums.length_mm).map_err(|error| match error {
        HoldError::Free(motions) => {
            let names = names(datums);
            let words: Vec<String> = motions.iter().map(|motion| motion.in_words(&names)).collect();
            DatumError::FreeMotion { motion: words.join(" and ") }
        }
        HoldError::NotConverged { iterations } => DatumError::NotConverged { iterations },
        HoldError::NotFinite => DatumError::NotFinite,
    })
}

/// The datums with their nominal places, to tell motions by.
pub(super) fn names<'a>(datums: Datums<'a>) -> Vec<Named<'a>> {
    let named = |k: usize| {
        let Feature { name, geometry, .. } = &datums.features[k];
        Named { name, place: geometry.position() }
    };
    datum_indices(datums.method).into_iter().map(named).collect()
}

/// What the solution tells of how the datums hold the part.
pub(super) fn hold_of(datums: Datums, held: &Held) -> DatumHold {
    let weak = (held.condition > WEAK_CONDITION).then(|| held.weakest.in_words(&names(datums)));
    let residuals = match datums.method {
        AlignmentMethod::Rps(locks) if locks.len() > 6 => {
            let residuals = held.residuals.iter().zip(&held.normalised);
            let one = |(lock, (residual_mm, normalised)): (&RpsLock, (&f64, &Option<f64>))| LockResidual {
                name: datums.features[lock.feature].name.clone(),
                lock: lock.lock.into_inner(),
                residual_mm: *residual_mm,
                normalised: *normalised,
            };
            locks.iter().zip(residuals).map(one).collect()
        }
        _ => Vec::new(),
    };
    DatumHold { condition: held.condition, weak, residuals }
}

fn rows(datums: Datums, values: &[DatumValue], nudge: Option<Nudge>) -> Result<Vec<Row>, DatumError> {
    let measured = |k: usize| match nudge {
        Some(Nudge::Shift { datum, by }) if datum == k => values[k].position + by,
        Some(Nudge::EdgeOffsets) => values[k].position + values[k].errors.edge_offset,
        Some(Nudge::Thickness) => values[k].position + values[k].errors.thickness,
        Some(Nudge::Scale) => values[k].position + values[k].errors.scale,
        _ => values[k].position,
    };
    let nominal = |k: usize| datums.features[values[k].index].geometry.position();
    let point = |k: usize, along: UnitVector3| Row {
        told: Told::Point { measured: measured(k), nominal: nominal(k), along },
        u: values[k].errors.along_mm(&along),
    };
    Ok(match datums.method {
        AlignmentMethod::Features { slot_reading, .. } => {
            let mut rows = vec![point(0, Vector3::x_axis()), point(0, Vector3::y_axis()), point(0, Vector3::z_axis())];
            match slot_reading {
                SlotReading::CentreLine => {
                    let line =
                        UnitVector3::try_new(nominal(1) - nominal(0), SAME_PLACE_MM).ok_or(DatumError::NoLine)?;
                    rows.extend(perpendiculars(&line).map(|across| point(1, across)));
                }
                SlotReading::Axis => rows.extend(axis_rows(&datums.features[values[1].index], &values[1], nudge)),
            }
            let otherwise = || UnitVector3::new_normalize(datums.features[values[2].index].geometry.sheet_normal());
            let normal = values[2].normal.unwrap_or_else(otherwise);
            let told = Told::Surface { measured: measured(2), normal, nominal: nominal(2) };
            rows.push(Row { told, u: values[2].errors.along_mm(&normal) });
            rows
        }
        AlignmentMethod::Rps(locks) => {
            let place = |lock: &RpsLock| values.iter().position(|v| v.index == lock.feature).unwrap_or(0);
            locks.iter().map(|lock| point(place(lock), lock.lock)).collect()
        }
        AlignmentMethod::BestFit | AlignmentMethod::Regions(_) => Vec::new(),
    })
}

/// The slot's long axis, measured in the sense of the plan, against two directions across the nominal one.
fn axis_rows(feature: &Feature, value: &DatumValue, nudge: Option<Nudge>) -> [Row; 2] {
    let nominal = match &feature.geometry {
        Geometry::Slot { direction, .. } => *direction,
        other => UnitVector3::new_normalize(other.sheet_normal()),
    };
    let found = value.direction.map_or(nominal, |found| if found.dot(&nominal) < 0.0 { -found } else { found });
    let measured = match nudge {
        Some(Nudge::Turn { datum: 1, by }) => UnitQuaternion::from_scaled_axis(by) * found,
        _ => found,
    };
    let u = |across: &UnitVector3| {
        value.errors.turns.iter().map(|turn| turn.cross(&found).dot(across).powi(2)).sum::<f64>().sqrt()
    };
    perpendiculars(&nominal).map(|across| Row { told: Told::Axis { measured, across }, u: u(&across) })
}

/// Two directions across another, and across each other.
fn perpendiculars(direction: &UnitVector3) -> [UnitVector3; 2] {
    let first = UnitVector3::new_normalize(direction.cross(&Vector3::ith(direction.iamin(), 1.0)));
    [first, UnitVector3::new_unchecked(direction.cross(&first))]
}
