//! How strongly rows hold each motion of a body, and motions in words.
//!
//! A row sees a small motion (shift v, turn w about the middle) as `v·d + w·(p x d)`: six numbers a row. The singular values of these
//! rows, turns told by what they move at the body's size, are the strengths with which the rows hold six motions.

use crate::geometry::{Point3, Vector3, decompose};
use nalgebra::{DMatrix, Vector6};

/// Below this part of the strongest motion a motion counts as free: directions that differ by rounding or by what a fit finds.
const FREE: f64 = 1e-4;
/// From this condition on the weakest motion is told: an error of a datum comes back a hundredfold.
pub const WEAK_CONDITION: f64 = 100.0;
/// A shift or turn below this share of a motion is not mentioned.
const NEGLIGIBLE: f64 = 0.1;
/// A direction this near to an axis of the frame is called by its name, rad.
const SAME_DIRECTION: f64 = 1.0 * std::f64::consts::PI / 180.0;
/// An axis passes through a place when it does to this share of the body's size.
const SAME_PLACE: f64 = 0.01;

/// A place with a name, to tell where an axis lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Named<'a> {
    /// Its name.
    pub name: &'a str,
    /// The place.
    pub place: Point3,
}

/// A small motion of a body, of any size: a shift and a turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Twist {
    /// Where the shift is told.
    pub centre: Point3,
    /// Shift of that place, mm.
    pub shift: Vector3,
    /// Turn about it, mm at the body's size.
    pub turn: Vector3,
    /// The body's size, mm.
    pub length_mm: f64,
}

/// Strengths of six motions, and these motions, the weakest first.
pub(super) struct Strengths {
    values: [f64; 6],
    motions: [Vector6<f64>; 6],
}

impl Strengths {
    /// Of rows of six numbers; `None` where one is not finite.
    pub(super) fn of(matrix: &DMatrix<f64>) -> Option<Self> {
        let svd = decompose::svd(matrix.clone(), false, true)?;
        let v_t = svd.v_t?;
        let mut order: [usize; 6] = std::array::from_fn(|k| k);
        order.sort_by(|&a, &b| svd.singular_values[a].total_cmp(&svd.singular_values[b]));
        Some(Self {
            values: order.map(|k| svd.singular_values[k]),
            motions: order.map(|k| Vector6::from_fn(|c, _| v_t[(k, c)])),
        })
    }

    /// The condition and the weakest motion.
    ///
    /// # Errors
    /// The motions that stay free.
    pub(super) fn judged(&self, centre: &Point3, length_mm: f64) -> Result<(f64, Twist), Vec<Twist>> {
        let strongest = self.values[5];
        let twist = |v: &Vector6<f64>| Twist {
            centre: *centre,
            shift: Vector3::new(v[0], v[1], v[2]),
            turn: Vector3::new(v[3], v[4], v[5]),
            length_mm,
        };
        let free = self.values.iter().filter(|value| **value <= FREE * strongest).count();
        if free > 0 {
            return Err(turned(&self.motions[..free]).iter().map(twist).collect());
        }
        Ok((strongest / self.values[0], twist(&self.motions[0])))
    }
}

/// Another basis of a space of motions: pure shifts stand alone, turns come first.
fn turned(basis: &[Vector6<f64>]) -> Vec<Vector6<f64>> {
    let turns = DMatrix::from_fn(3, basis.len(), |row, k| basis[k][row + 3]);
    let Some(eigen) = decompose::symmetric_eigen(turns.transpose() * &turns) else { return basis.to_vec() };
    let mut order: Vec<usize> = (0..basis.len()).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let mixed = |k: usize| basis.iter().zip(eigen.eigenvectors.column(k).iter()).map(|(b, f)| b * *f).sum();
    order.into_iter().map(mixed).collect()
}

impl Twist {
    /// As people would say it, with the names of places where it can be: `turn about the line through H1 and S1`, `shift along x`.
    pub fn in_words(&self, names: &[Named]) -> String {
        let size = self.shift.norm().hypot(self.turn.norm());
        if self.turn.norm() < NEGLIGIBLE * size {
            return format!("shift along {}", direction_words(&self.shift));
        }
        let axis = self.turn.normalize();
        // The place that does not move across the axis: c + (turn x shift) / |turn|², lengths back in mm.
        let through = self.centre + self.turn.cross(&self.shift) * (self.length_mm / self.turn.norm_squared());
        let near = |p: &Point3| axis.cross(&(p - through)).norm() < SAME_PLACE * self.length_mm;
        let on_axis: Vec<&Named> = names.iter().filter(|named| near(&named.place)).collect();
        let place = match on_axis.as_slice() {
            [first, others @ ..] => {
                let apart = |other: &&&Named| (other.place - first.place).norm() > 10.0 * SAME_PLACE * self.length_mm;
                match others.iter().find(apart) {
                    Some(other) => format!("turn about the line through {} and {}", first.name, other.name),
                    None => format!("turn about {} through {}", direction_words(&axis), first.name),
                }
            }
            [] => format!("turn about {} through {}", direction_words(&axis), triple_words(&through.coords, 1)),
        };
        let lead = self.shift.dot(&axis);
        if lead.abs() < NEGLIGIBLE * size {
            return place;
        }
        let mm_per_degree = lead.abs() * self.length_mm / self.turn.norm() * 1_f64.to_radians();
        format!("{place} with a shift along it of {mm_per_degree:.2} mm a degree")
    }
}

/// `x` for a direction along x, else its components; either sense is the same.
fn direction_words(d: &Vector3) -> String {
    let d = d.normalize();
    for (axis, name) in [(Vector3::x(), "x"), (Vector3::y(), "y"), (Vector3::z(), "z")] {
        if axis.cross(&d).norm() < SAME_DIRECTION {
            return name.to_owned();
        }
    }
    let d = d.map(|c| (c * 1e3).round() / 1e3);
    let sign = d.iter().find(|c| **c != 0.0).map_or(1.0, |c| c.signum());
    triple_words(&(d * sign), 3)
}

/// `[0.6, 0, -0.8]`: without idle zeros.
fn triple_words(v: &Vector3, digits: usize) -> String {
    let short = |value: f64| {
        let text = format!("{:.digits$}", value + 0.0);
        let text = text.trim_end_matches('0').trim_end_matches('.');
        if text == "-0" { "0".to_owned() } else { text.to_owned() }
    };
    format!("[{}, {}, {}]", short(v.x), short(v.y), short(v.z))
}
