//! `[alignment]`: which features hold the part, and whether they can.

use super::nominal::{AlignmentMethod, Feature, Geometry, RpsLock, SlotReading};
use super::reader::{Entry, TableReader, quoted};
use super::regions::region_fit;
use super::sections::finish;
use super::shapes::ReadFeature;
use super::suggest::nearest;
use super::values::{direction, short};
use crate::fit::hold::{HoldError, Named, Row, Told, Twist, WEAK_CONDITION, hold};
use crate::geometry::{Aabb, Point3, UnitVector3};

/// A hole and a slot nearer than this share a place.
const SAME_PLACE_MM: f64 = 1.0;
/// Below this distance the line between them is a poor axis.
const SHORT_LINE_MM: f64 = 20.0;
/// A surface point that the turn moves by less than this a radian does not hold it.
const NO_LEVER_MM: f64 = 1.0;
/// Below this it holds it poorly.
const SHORT_LEVER_MM: f64 = 10.0;
/// Locks of one feature that differ by less are the same, rad.
const SAME_LOCK_RAD: f64 = 0.02;
/// A lock may be turned this far out of what its feature can measure: warning, and error, rad.
const LOCK_SLANT: (f64, f64) = (15.0 * std::f64::consts::PI / 180.0, 60.0 * std::f64::consts::PI / 180.0);

#[derive(Clone, Copy, PartialEq, Eq)]
enum Method {
    Features,
    Rps,
    BestFit,
}

/// Reads the table; references are indices into `features`.
pub(super) fn alignment(table: TableReader<'_>, features: &[ReadFeature]) -> Option<AlignmentMethod> {
    let methods = [("features", Method::Features), ("rps", Method::Rps), ("best_fit", Method::BestFit)];
    let expected = "\"features\", \"rps\" or \"best_fit\"";
    let help = "write method = \"features\" (hole, slot, surface point), \"rps\" or \"best_fit\"";
    let method = table.required("method", expected, help).and_then(|entry| entry.choice(&methods));
    let result = match method {
        Some(Method::Features) => by_features(&table, features),
        Some(Method::Rps) => by_rps(&table, features),
        Some(Method::BestFit) => {
            region_fit(&table).map(|fit| fit.map_or(AlignmentMethod::BestFit, AlignmentMethod::Regions))
        }
        None => None,
    };
    for key in ["hole", "slot", "slot_reading", "point", "rps", "region", "freeze"] {
        let unused = match method {
            Some(Method::Features) => ["rps", "region", "freeze"].contains(&key),
            Some(Method::Rps) => key != "rps",
            Some(Method::BestFit) => key != "region" && key != "freeze",
            None => false,
        };
        if let Some(entry) = table.optional(key)
            && unused
        {
            let word = methods.iter().find(|(_, m)| Some(*m) == method).map_or("", |(word, _)| word);
            entry.odd(format!("is not used with method = \"{word}\""), "remove it, or choose the method that uses it");
        }
    }
    finish(table);
    result
}

fn by_features(table: &TableReader<'_>, features: &[ReadFeature]) -> Option<AlignmentMethod> {
    let hole_entry = table.required("hole", "the name of a feature of kind \"hole\"", "write hole = \"H1\"");
    let slot_entry = table.required("slot", "the name of a feature of kind \"slot\"", "write slot = \"S1\"");
    let point_entry = table.required("point", "the name of a feature of kind \"surface\"", "write point = \"A1\"");
    let hole = hole_entry.and_then(|entry| reference(entry, features, Some("hole")));
    let slot = slot_entry.and_then(|entry| reference(entry, features, Some("slot")));
    let point = point_entry.and_then(|entry| reference(entry, features, Some("surface")));
    let slot_reading = match table.optional("slot_reading") {
        Some(entry) => entry.choice(&[("centre_line", SlotReading::CentreLine), ("axis", SlotReading::Axis)]),
        None => Some(SlotReading::CentreLine),
    };
    let (hole, slot, point, slot_reading) = (hole?, slot?, point?, slot_reading?);
    let shapes = [hole, slot, point].map(|k| features[k].feature.as_ref().map(|f| &f.geometry));
    if let [Some(hole_shape), Some(slot_shape), Some(point_shape)] = shapes {
        let [hole_name, slot_name] = [hole_entry?, slot_entry?].map(|entry| entry.text().unwrap_or_default());
        let line = match slot_reading {
            SlotReading::CentreLine => format!("the line through {hole_name} and {slot_name}"),
            SlotReading::Axis => format!("the line through {hole_name} along the axis of {slot_name}"),
        };
        check_levers(slot_entry?, point_entry?, [hole_shape, slot_shape, point_shape], slot_reading, &line);
    }
    Some(AlignmentMethod::Features { hole, slot, slot_reading, point })
}

/// Finds a feature by name and kind; tells the nearest name when there is none.
fn reference(entry: Entry<'_>, features: &[ReadFeature], kind: Option<&'static str>) -> Option<usize> {
    let name = entry.text()?;
    let Some(index) = features.iter().position(|f| f.name.as_deref() == Some(name)) else {
        let fitting = features.iter().filter(|f| kind.is_none() || f.kind == kind || f.kind.is_none());
        let names: Vec<&str> = fitting.filter_map(|f| f.name.as_deref()).collect();
        let of_kind = kind.map_or(String::new(), |kind| format!(" of kind \"{kind}\""));
        let help = match nearest(name, names.iter().copied()) {
            Some((known, true)) => format!("did you mean \"{known}\"?"),
            Some((known, false)) if names.len() == 1 => format!("the plan's only feature{of_kind} is \"{known}\""),
            Some((known, false)) => format!("the nearest name is \"{known}\""),
            None => format!("add a [[feature]]{of_kind} with name = {}", quoted(name)),
        };
        entry.wrong(format!("found {}, expected the name of a feature{of_kind}", quoted(name)), help);
        return None;
    };
    match (features[index].kind, kind) {
        (Some(found), Some(expected)) if found != expected => {
            let names: Vec<&str> =
                features.iter().filter(|f| f.kind == kind).filter_map(|f| f.name.as_deref()).collect();
            let help = match names.as_slice() {
                [] => format!("add a [[feature]] of kind \"{expected}\""),
                [only] => format!("the plan's only feature of kind \"{expected}\" is \"{only}\""),
                several => format!("features of kind \"{expected}\" are {}", super::suggest::list_or(several, "\"")),
            };
            entry.wrong(
                format!(
                    "found {}, which is of kind \"{found}\", expected a feature of kind \"{expected}\"",
                    quoted(name)
                ),
                help,
            );
            None
        }
        _ => Some(index),
    }
}

/// Whether hole, slot and surface point hold all six motions. `shapes`: hole, slot, point; `axis_words`: about what the last turn is.
fn check_levers(
    slot_entry: Entry<'_>,
    point_entry: Entry<'_>,
    shapes: [&Geometry; 3],
    reading: SlotReading,
    axis_words: &str,
) {
    let [hole, slot, point] = shapes;
    let (hole_centre, slot_centre) = (hole.position(), slot.position());
    let line = slot_centre - hole_centre;
    let distance = line.norm();
    let axis = match (reading, slot) {
        (SlotReading::Axis, Geometry::Slot { direction, .. }) => direction.into_inner(),
        _ => {
            if distance < SAME_PLACE_MM {
                let words = format!(
                    "found a slot {} mm from the hole, expected it well away: the line between them holds two rotations",
                    short(distance)
                );
                slot_entry.wrong(words, "choose a slot far from the hole, or slot_reading = \"axis\"");
                return;
            }
            if distance < SHORT_LINE_MM {
                let words = format!(
                    "the slot is only {} mm from the hole, so the line between them turns easily",
                    short(distance)
                );
                slot_entry.odd(words, "choose a slot farther from the hole");
            }
            line / distance
        }
    };
    let Geometry::Surface { position, direction } = point else { return };
    // A turn of one rad about the axis moves the point by axis x (p - hole); the part of it along its direction is what holds.
    let moved = axis.cross(&(position - hole_centre));
    let holds = moved.dot(direction).abs();
    let lever = moved.norm();
    let words = || {
        format!(
            "the surface point lies {} mm from the axis through the hole and its direction meets the turn with {} mm of lever",
            short(lever),
            short(holds)
        )
    };
    let help =
        "choose a surface point far from the line through hole and slot, on a face that this turn lifts or lowers";
    if holds < NO_LEVER_MM {
        point_entry.wrong(
            format!("{}, expected at least {NO_LEVER_MM} mm: the turn about {axis_words} stays free", words()),
            help,
        );
    } else if holds < SHORT_LEVER_MM {
        point_entry.odd(
            format!("{}, expected {SHORT_LEVER_MM} mm or more: the turn about {axis_words} is held weakly", words()),
            help,
        );
    }
}

fn by_rps(table: &TableReader<'_>, features: &[ReadFeature]) -> Option<AlignmentMethod> {
    let rows = table.sections("rps", "[[alignment.rps]]");
    let line = rows.first().map_or(table.line(), TableReader::line);
    let mut locks = Vec::with_capacity(rows.len());
    let mut complete = true;
    for row in rows {
        let lock = rps_row(&row, features);
        finish(row);
        complete &= lock.is_some();
        locks.extend(lock);
    }
    if !complete {
        return None;
    }
    let mut used: Vec<usize> = locks.iter().map(|l| l.feature).collect();
    used.sort_unstable();
    used.dedup();
    if used.len() < 3 || locks.len() < 6 {
        let words = format!(
            "[alignment] rps: found {} features with {} locks, expected at least three features and six locks",
            used.len(),
            locks.len()
        );
        let help = "each [[alignment.rps]] names a feature and one locked direction; 3-2-1 needs six of them";
        table.problems().error(line, words, help);
        return None;
    }
    let mut held = Vec::with_capacity(locks.len());
    for lock in &locks {
        held.push((features[lock.feature].feature.as_ref()?, lock.lock));
    }
    warn_of_locks_given_twice(table, line, &held);
    check_hold(table, line, &held)?;
    Some(AlignmentMethod::Rps(locks))
}

/// A feature that is locked twice along one line counts twice, which nobody means.
fn warn_of_locks_given_twice(table: &TableReader<'_>, line: usize, locks: &[(&Feature, UnitVector3)]) {
    for (k, (feature, lock)) in locks.iter().enumerate() {
        let twice = |(other, known): &(&Feature, UnitVector3)| {
            std::ptr::eq(*other, *feature) && known.cross(lock).norm() < SAME_LOCK_RAD
        };
        if locks[..k].iter().any(twice) {
            let message =
                format!("[alignment] rps: \"{}\" is locked along the same line twice, expected once", feature.name);
            table.problems().warning(line, message, "leave one of the two out, or lock another direction or feature");
        }
    }
}

/// Whether locks hold all six motions, and how strongly; turns are told by what they move at the extent of the locked points.
fn check_hold(table: &TableReader<'_>, line: usize, locks: &[(&Feature, UnitVector3)]) -> Option<()> {
    let places: Vec<Point3> = locks.iter().map(|(feature, _)| feature.geometry.position()).collect();
    let extent_mm = Aabb::of_points(&places).map_or(1.0, |bounds| bounds.diagonal()).max(1e-6);
    let row = |(&along, &nominal): (&UnitVector3, &Point3)| Row {
        told: Told::Point { measured: nominal, nominal, along },
        u: 0.0,
    };
    let rows: Vec<Row> = locks.iter().map(|(_, lock)| lock).zip(&places).map(row).collect();
    let names: Vec<Named> =
        locks.iter().zip(&places).map(|((feature, _), place)| Named { name: &feature.name, place: *place }).collect();
    let words = |motion: &Twist| motion.in_words(&names);
    match hold(&rows, extent_mm) {
        Err(HoldError::Free(free)) => {
            let motions: Vec<String> = free.iter().map(|motion| format!("the {}", words(motion))).collect();
            let message = match motions.as_slice() {
                [only] => format!("[alignment] rps: {only} stays free, expected all six motions to be held"),
                all => format!("[alignment] rps: {} stay free, expected all six motions to be held", all.join(" and ")),
            };
            table.problems().error(line, message, "lock a direction that meets this motion, far from its axis");
            None
        }
        Err(HoldError::NotFinite | HoldError::NotConverged { .. }) => {
            let message = "[alignment] rps: found places or directions that are not finite, expected numbers";
            table.problems().error(line, message, "write the features' places and the locks in mm");
            None
        }
        Ok((condition, weakest)) => {
            if condition > WEAK_CONDITION {
                let message = format!(
                    "[alignment] rps: the {} is held {condition:.0} times more weakly than the best held motion",
                    words(&weakest)
                );
                let help = "spread the locked points, or lock a direction that meets this motion";
                table.problems().warning(line, message, help);
            }
            Some(())
        }
    }
}

fn rps_row(row: &TableReader<'_>, features: &[ReadFeature]) -> Option<RpsLock> {
    let name = row.required("feature", "the name of a feature", "write feature = \"P3\"");
    let entry = row.required("lock", "the direction that is held", "give a direction such as lock = [0, 0, 1]");
    let feature = name.and_then(|entry| reference(entry, features, None));
    let lock = entry.and_then(direction);
    let (feature, lock) = (feature?, lock?);
    if let Some(shape) = features[feature].feature.as_ref().map(|f| &f.geometry) {
        check_lock(entry?, shape, &lock)?;
    }
    Some(RpsLock { feature, lock })
}

/// A surface point is measured along its direction only, an edge point not along the edge: a lock elsewhere holds nothing.
fn check_lock(entry: Entry<'_>, shape: &Geometry, lock: &UnitVector3) -> Option<()> {
    let (measured, what) = match shape {
        Geometry::Surface { direction, .. } => {
            (lock.dot(direction).abs(), "a surface point is measured along its direction only")
        }
        Geometry::Edge { direction, normal, .. } => {
            let along_edge = lock.dot(&direction.cross(normal));
            ((1.0 - along_edge * along_edge).max(0.0).sqrt(), "an edge point is not measured along its edge")
        }
        Geometry::Hole { .. } | Geometry::Slot { .. } => return Some(()),
    };
    let slant = measured.clamp(0.0, 1.0).acos();
    let words = format!("the locked direction is {:.1} degrees off what is measured: {what}", slant.to_degrees());
    let help = "lock a surface point along its direction, an edge point along its direction or its normal";
    if slant > LOCK_SLANT.1 {
        entry.wrong(words, help);
        return None;
    }
    if slant > LOCK_SLANT.0 {
        entry.odd(words, help);
    }
    Some(())
}
