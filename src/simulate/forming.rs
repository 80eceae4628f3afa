//! From the flat blank to the stamped surface: bends about lines, and heights (crown, bead) pressed normal to the sheet.
//!
//! Everything is a smooth closed formula, so places and normals of the nominal surface are known without any mesh.

use super::blank::{Opening, Uv, UvVector};
use crate::geometry::{Point3, UnitVector3, Vector3};

/// A piece of a flange's cross-section: constant curvature over a developed length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProfilePiece {
    /// Developed length on the CAD face.
    pub length_mm: f64,
    /// Angle turned over that length; positive bends up. 0 = straight.
    pub turn_rad: f64,
}

/// A flange: everything beyond a line of the blank, bent along a profile and straight beyond its last piece.
#[derive(Debug, Clone, PartialEq)]
pub struct Flange {
    /// The bend line lies where `outwards . q = distance_mm`.
    pub distance_mm: f64,
    /// Across the bend line, away from the base; length one.
    pub outwards: UvVector,
    /// The profile, from the bend line on.
    pub profile: Vec<ProfilePiece>,
}

impl Flange {
    /// A flange whose outward direction has this angle to the blank's u axis.
    pub fn new(distance_mm: f64, angle_rad: f64, profile: Vec<ProfilePiece>) -> Self {
        Self { distance_mm, outwards: UvVector::new(angle_rad.cos(), angle_rad.sin()), profile }
    }

    /// Along the bend line.
    pub fn along(&self) -> UvVector {
        UvVector::new(-self.outwards.y, self.outwards.x)
    }

    /// A place on the blank: `s` along the bend line, `w` beyond it.
    pub fn place(&self, s: f64, w: f64) -> Uv {
        Uv::origin() + self.outwards * (self.distance_mm + w) + self.along() * s
    }

    /// How far beyond the bend line a place lies (negative on the base).
    pub fn beyond_mm(&self, q: &Uv) -> f64 {
        self.outwards.dot(&q.coords) - self.distance_mm
    }

    /// Whether a place lies where the profile is curved.
    pub fn is_curved_at(&self, q: &Uv, margin_mm: f64) -> bool {
        let w = self.beyond_mm(q);
        let mut from = 0.0;
        self.profile.iter().any(|piece| {
            let to = from + piece.length_mm;
            let hit = piece.turn_rad != 0.0 && w > from - margin_mm && w < to + margin_mm;
            from = to;
            hit
        })
    }
}

/// Across and up, mm, at developed length `w` of a profile that starts level and goes on straight after its last piece.
fn section(profile: &[ProfilePiece], w: f64) -> (f64, f64) {
    let (mut across, mut up, mut angle, mut left) = (0.0, 0.0, 0.0f64, w);
    for piece in profile {
        let length = left.min(piece.length_mm);
        let turn = piece.turn_rad * length / piece.length_mm;
        let middle = angle + 0.5 * turn;
        let half = 0.5 * turn;
        let chord = if half.abs() < 1e-9 { length } else { length * half.sin() / half };
        across += chord * middle.cos();
        up += chord * middle.sin();
        angle += turn;
        left -= length;
        if left <= 0.0 {
            return (across, up);
        }
    }
    (across + left * angle.cos(), up + left * angle.sin())
}

/// A round drawn part: a level bottom of a radius, then a profile outwards all around.
#[derive(Debug, Clone, PartialEq)]
pub struct Revolved {
    /// Radius of the level middle.
    pub level_radius_mm: f64,
    /// The profile from there on.
    pub profile: Vec<ProfilePiece>,
}

impl FormedSheet for Revolved {
    fn point(&self, q: &Uv) -> Point3 {
        let radius = q.coords.norm();
        if radius <= self.level_radius_mm {
            return Point3::new(q.x, q.y, 0.0);
        }
        let (across, up) = section(&self.profile, radius - self.level_radius_mm);
        let scale = (self.level_radius_mm + across) / radius;
        Point3::new(q.x * scale, q.y * scale, up)
    }
}

/// A round or slot-shaped area that is kept flat at the crown's height in its middle, blending into the crown around it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pad {
    /// The opening within it.
    pub around: Opening,
    /// Flat to this distance from the rim.
    pub flat_mm: f64,
    /// Blended over this distance.
    pub blend_mm: f64,
}

/// A smooth straight rib.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bead {
    /// Its ends on the blank.
    pub ends: [Uv; 2],
    /// Half of its width.
    pub half_width_mm: f64,
    /// Its height.
    pub height_mm: f64,
}

/// The forming of a blank.
#[derive(Debug, Clone, PartialEq)]
pub struct Forming {
    /// Height of the crown at its top.
    pub crown_mm: f64,
    /// Where the top is.
    pub crown_centre: Uv,
    /// Width of the crown (one sigma of a Gaussian bell) along u and v.
    pub crown_width_mm: [f64; 2],
    /// Flanges; their areas on the blank do not overlap.
    pub flanges: Vec<Flange>,
    /// Flat places; their flat areas lie outside each other's blends.
    pub pads: Vec<Pad>,
    /// Ribs.
    pub beads: Vec<Bead>,
}

/// A smooth map from the flat blank to the CAD face of the part.
pub trait FormedSheet {
    /// The place in space (CAD frame, mm) of a place on the blank.
    fn point(&self, q: &Uv) -> Point3;

    /// The direction in space of a direction on the blank, not normalised.
    fn tangent(&self, q: &Uv, direction: UvVector) -> Vector3 {
        let step = 1e-4;
        (self.point(&(q + direction * step)) - self.point(&(q - direction * step))) / (2.0 * step)
    }

    /// The unit normal of the face at a place on the blank, on the upper side of the sheet.
    fn normal(&self, q: &Uv) -> UnitVector3 {
        UnitVector3::new_normalize(self.tangent(q, UvVector::x()).cross(&self.tangent(q, UvVector::y())))
    }
}

impl FormedSheet for Forming {
    fn point(&self, q: &Uv) -> Point3 {
        for flange in &self.flanges {
            let w = flange.beyond_mm(q);
            if w > 0.0 {
                let (across, up) = section(&flange.profile, w);
                let foot = q - flange.outwards * (w - across);
                return Point3::new(foot.x, foot.y, up);
            }
        }
        Point3::new(q.x, q.y, self.height(q))
    }
}

impl Forming {
    /// Height of the base, mm.
    fn height(&self, q: &Uv) -> f64 {
        let mut height = self.crown(q);
        for pad in &self.pads {
            let blend = 1.0 - smooth((pad.around.distance_mm(q) - pad.flat_mm) / pad.blend_mm);
            height += blend * (self.crown(&pad.around.centre()) - height);
        }
        for bead in &self.beads {
            let axis = bead.ends[1] - bead.ends[0];
            let t = ((q - bead.ends[0]).dot(&axis) / axis.norm_squared()).clamp(0.0, 1.0);
            let distance = (q - (bead.ends[0] + axis * t)).norm();
            height += bead.height_mm * (1.0 - smooth(distance / bead.half_width_mm));
        }
        for flange in &self.flanges {
            height *= smooth((-flange.beyond_mm(q) - 1.0) / 8.0);
        }
        height
    }

    fn crown(&self, q: &Uv) -> f64 {
        let r = q - self.crown_centre;
        let (a, b) = (r.x / self.crown_width_mm[0], r.y / self.crown_width_mm[1]);
        self.crown_mm * (-0.5 * (a * a + b * b)).exp()
    }
}

/// 0 below 0, 1 above 1, with two continuous derivatives.
fn smooth(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * t * (t * (6.0 * t - 15.0) + 10.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bending_keeps_developed_lengths() {
        let flange = Flange::new(
            10.0,
            0.3,
            vec![
                ProfilePiece { length_mm: 4.0, turn_rad: -1.0 },
                ProfilePiece { length_mm: 6.0, turn_rad: 0.0 },
                ProfilePiece { length_mm: 5.0, turn_rad: 1.0 },
            ],
        );
        let forming = Forming {
            crown_mm: 0.0,
            crown_centre: Uv::origin(),
            crown_width_mm: [1.0, 1.0],
            flanges: vec![flange.clone()],
            pads: vec![],
            beads: vec![],
        };
        let steps = 4000;
        let at = |k: usize| forming.point(&flange.place(3.0, -2.0 + 25.0 * k as f64 / steps as f64));
        let length: f64 = (0..steps).map(|k| (at(k + 1) - at(k)).norm()).sum();
        // Chords of 6 um on arcs of 4 mm radius are short by 1e-7 of their length.
        assert!((length - 25.0).abs() < 1e-5);
        assert!((forming.tangent(&flange.place(3.0, 20.0), flange.outwards).z).abs() < 1e-9);
    }
}
