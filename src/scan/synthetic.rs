//! Clouds with known labels for the tests of this folder: a belt, a simple part on it, noise, spikes, wear and shadow.
//!
//! The camera stands above (+z) before the cloud is moved; it sees one surface a place, so that the belt is missing
//! under the part.

use super::hints::ScanHints;
use crate::geometry::{Isometry3, Point3, PointCloud, UnitVector3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// What a point really is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Label {
    Belt,
    Part,
    Spike,
    Shadow,
}

/// Shapes by the height of their upper face above the belt, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Shape {
    /// 120 x 80 plate lying flat.
    Plate,
    /// 400 x 300 panel: larger than most views.
    Panel,
    /// 140 x 100 hat: 25 mm flanges on the belt all round, slopes, a flat top 20 mm up.
    Hat,
    /// Dome of 60 mm radius, 30 mm high.
    Dome,
    /// 120 x 60 base on the belt and a wall 50 mm high that leans out.
    Bracket,
    /// Nothing.
    None,
}

impl Shape {
    /// Height in mm of the upper face without the thickness; `None` beside the part.
    fn height(self, x: f64, y: f64) -> Option<f64> {
        let box_rim = |a: f64, b: f64| (a - x.abs()).min(b - y.abs());
        match self {
            Shape::None => None,
            Shape::Plate => (box_rim(60.0, 40.0) >= 0.0 && x.hypot(y) > 8.0).then_some(0.0),
            Shape::Panel => (box_rim(200.0, 150.0) >= 0.0).then_some(0.0),
            Shape::Hat => {
                let rim = box_rim(70.0, 50.0);
                (rim >= 0.0).then(|| ((rim - 25.0) * 2.0).clamp(0.0, 20.0))
            }
            Shape::Dome => {
                let r = x.hypot(y);
                (r <= 60.0).then(|| 30.0 * (1.0 - (r / 60.0).powi(2)))
            }
            Shape::Bracket => (box_rim(60.0, 40.0) >= 0.0).then_some(if y > 20.0 { (y - 20.0) * 2.5 } else { 0.0 }),
        }
    }

    fn extents_mm(self) -> [f64; 3] {
        match self {
            Shape::Plate | Shape::None => [120.0, 80.0, 1.0],
            Shape::Panel => [400.0, 300.0, 1.0],
            Shape::Hat => [140.0, 100.0, 20.0],
            Shape::Dome => [120.0, 120.0, 30.0],
            Shape::Bracket => [120.0, 80.0, 50.0],
        }
    }
}

/// A scene; change what the test is about.
#[derive(Debug, Clone)]
pub(crate) struct Scene {
    pub shape: Shape,
    pub thickness_mm: f64,
    /// Half sides of the view.
    pub view_mm: [f64; 2],
    /// Where the part's centre lies in the view.
    pub part_at_mm: [f64; 2],
    pub belt: bool,
    pub points: usize,
    pub noise_mm: f64,
    pub spikes: f64,
    /// Share of the belt that is worn to the part's grey.
    pub wear: f64,
    pub belt_colour: [u8; 3],
    pub part_colour: [u8; 3],
    /// Share of points in deep shadow.
    pub shadow: f64,
    pub colours: bool,
    /// Height of waves of the belt (and of what lies on it), mm.
    pub wave_mm: f64,
    pub tilt_deg: f64,
    pub seed: u64,
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            shape: Shape::Hat,
            thickness_mm: 0.8,
            view_mm: [130.0, 100.0],
            part_at_mm: [12.0, -8.0],
            belt: true,
            points: 120_000,
            noise_mm: 0.12,
            spikes: 0.01,
            wear: 0.3,
            belt_colour: [40, 110, 70],
            part_colour: [150, 152, 155],
            shadow: 0.0,
            colours: true,
            wave_mm: 0.0,
            tilt_deg: 3.0,
            seed: 1,
        }
    }
}

/// A cloud with the truth about it.
pub(crate) struct Labelled {
    pub cloud: PointCloud,
    pub labels: Vec<Label>,
    /// Height above the true belt without noise, mm.
    pub heights_mm: Vec<f64>,
    pub hints: ScanHints,
    pub scan_from_belt: Isometry3,
}

impl Scene {
    pub fn make(&self) -> Labelled {
        let tilt = self.tilt_deg.to_radians();
        self.make_moved(Isometry3::new(Vector3::new(30.0, -20.0, 600.0), Vector3::new(0.8 * tilt, -0.6 * tilt, 0.0)))
    }

    pub fn make_moved(&self, scan_from_belt: Isometry3) -> Labelled {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        let mut cloud = PointCloud { colours: self.colours.then(Vec::new), ..PointCloud::default() };
        let (mut labels, mut heights_mm) = (Vec::new(), Vec::new());
        while labels.len() < self.points {
            let x = rng.random_range(-self.view_mm[0]..self.view_mm[0]);
            let y = rng.random_range(-self.view_mm[1]..self.view_mm[1]);
            let on_part = self.shape.height(x - self.part_at_mm[0], y - self.part_at_mm[1]);
            let Some(height) = on_part.map(|h| h + self.thickness_mm).or(self.belt.then_some(0.0)) else { continue };
            let worn = (0.05 * x).sin() * (0.07 * y).cos() < 2.0 * self.wear - 1.0;
            let mut colour = if on_part.is_some() || worn { self.part_colour } else { self.belt_colour };
            let mut label = if on_part.is_some() { Label::Part } else { Label::Belt };
            let normal = |rng: &mut ChaCha8Rng| -> f64 { StandardNormal.sample(rng) };
            let wave = self.wave_mm * (x / 40.0).sin() * (y / 55.0).cos();
            let mut z = height + wave + self.noise_mm * normal(&mut rng);
            if rng.random_range(0.0..1.0) < self.spikes {
                z += rng.random_range(-40.0..40.0);
                label = Label::Spike;
            }
            if rng.random_range(0.0..1.0) < self.shadow {
                colour = [8, 8, 9];
                z += 2.0 * normal(&mut rng);
                label = Label::Shadow;
            }
            let shade = 4.0 * normal(&mut rng);
            let shaded = colour.map(|c| (f64::from(c) + shade).clamp(0.0, 255.0) as u8);
            cloud.positions.push(scan_from_belt * Point3::new(x, y, z));
            if let Some(colours) = &mut cloud.colours {
                colours.push(shaded);
            }
            labels.push(label);
            heights_mm.push(height);
        }
        let extents = self.shape.extents_mm();
        let hints = ScanHints {
            view_direction: Some(UnitVector3::new_normalize(scan_from_belt.rotation * -Vector3::z())),
            part_extents_mm: extents,
            part_area_mm2: extents[0] * extents[1] * 1.1,
            thickness_mm: self.thickness_mm,
        };
        Labelled { cloud, labels, heights_mm, hints, scan_from_belt }
    }
}
