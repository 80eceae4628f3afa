//! Things to measure from many poses: the paper's standards in µm, the demo part in mm.

use super::bias::SmoothVolume;
use super::calibration::CalibratedVolume;
use super::poses::{PriorError, facing, spread_over};
use super::sensor::SensorModel;
use super::surface::{Shape, Surface};
use super::view::{Eye, SimulatedView};
use super::{Stream, stream};
use crate::geometry::{Isometry3, LengthUnit, Mesh, Point3, Vector3};
use crate::simulate::{BracketParameters, bracket, cover};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Radius of the cylinder on the paper's contour standard, µm, and its uncertainty by the certificate.
pub const CYLINDER_RADIUS_UM: f64 = 1001.5;
/// See [`CYLINDER_RADIUS_UM`].
pub const CYLINDER_RADIUS_U_UM: f64 = 0.7;
/// Radius of the sphere, µm.
pub const SPHERE_RADIUS_UM: f64 = 1500.0;
/// Spacing of the demo part's mesh, mm: finer than its CAD, so that its facets stay below a µm.
const PART_SPACING_MM: f64 = 1.2;

/// One measurement to be made.
#[derive(Debug, Clone, PartialEq)]
pub struct Station {
    /// Where the sensor truly stands; of a wrong view, over the other part.
    pub world_from_view: Isometry3,
    /// Where stage or robot says that it stands.
    pub prior: Isometry3,
    /// Whether it sees another part.
    pub is_wrong: bool,
}

/// What is measured, by what and from where. Its fields and the seed alone decide what comes out.
#[derive(Debug, Clone)]
pub struct Scene {
    /// A word for it.
    pub name: String,
    /// Unit of all its lengths.
    pub unit: LengthUnit,
    /// The sensor.
    pub sensor: SensorModel,
    /// Its calibration.
    pub volume: CalibratedVolume,
    bias: SmoothVolume,
    /// What is measured, world frame.
    pub surface: Surface,
    /// What wrong views see.
    pub other: Option<Surface>,
    /// From where.
    pub stations: Vec<Station>,
    seed: u64,
}

impl Scene {
    /// A surface with no view of it yet. The seed draws calibration, smooth error and noise.
    pub fn new(name: &str, unit: LengthUnit, sensor: SensorModel, surface: Surface, seed: u64) -> Self {
        let volume = CalibratedVolume::new(&sensor, seed);
        let bias = SmoothVolume::new(seed, sensor.bias_length);
        Self { name: name.into(), unit, sensor, volume, bias, surface, other: None, stations: Vec::new(), seed }
    }

    /// The cylinder of the contour standard (about the world's x axis), µm, from two poses 40 degrees apart and half a mm along.
    pub fn cylinder(prior: PriorError, seed: u64) -> Self {
        let surface = Surface::unworn(Shape::Cylinder { radius: CYLINDER_RADIUS_UM });
        let mut scene = Self::new("cylinder", LengthUnit::Um, SensorModel::paper(), surface, seed);
        let places = [(-20.0, -250.0), (20.0, 250.0)].map(|(lean, along)| {
            let lean = f64::to_radians(lean);
            let normal = Vector3::new(0.0, lean.sin(), lean.cos());
            // The working distance lies 200 µm below the crest: both its sides stay in focus.
            (Point3::from(Vector3::new(along, 0.0, 0.0) + normal * (CYLINDER_RADIUS_UM - 200.0)), normal)
        });
        scene.stand(&places, prior);
        scene
    }

    /// A pin: the same cylinder from two rows of three poses, and a view of a sphere among them that claims to be a seventh of the pin.
    pub fn pin(prior: PriorError, seed: u64) -> Self {
        let mut scene = Self::cylinder(prior, seed);
        (scene.name, scene.stations) = ("pin".into(), Vec::new());
        let place = |lean: f64, along: f64, radius: f64| {
            let normal = Vector3::new(0.0, f64::to_radians(lean).sin(), f64::to_radians(lean).cos());
            (Point3::from(Vector3::new(along, 0.0, 0.0) + normal * (radius - 200.0)), normal)
        };
        let rows = [-20.0, 20.0].into_iter().flat_map(|lean| [-500.0, 0.0, 500.0].map(|along| (lean, along)));
        let places: Vec<_> = rows.map(|(lean, along)| place(lean, along, CYLINDER_RADIUS_UM)).collect();
        scene.stand(&places, prior);
        scene.other = Some(Surface::unworn(Shape::Sphere { radius: SPHERE_RADIUS_UM }));
        let mut rng = stream(seed, Stream::Poses);
        rng.set_word_pos(1 << 40);
        let (target, normal) = place(5.0, 60.0, SPHERE_RADIUS_UM);
        let (world_from_view, _) = scene.station_at(&target, &normal, &mut rng);
        let (claim, normal) = place(0.0, 250.0, CYLINDER_RADIUS_UM);
        let (claimed, _) = scene.station_at(&claim, &normal, &mut rng);
        scene.stations.push(Station { world_from_view, prior: claimed, is_wrong: true });
        scene
    }

    /// A plane, z = 0, µm, from two poses that lean by 15 degrees.
    pub fn plane(prior: PriorError, seed: u64) -> Self {
        let mut scene = Self::new("plane", LengthUnit::Um, SensorModel::paper(), Surface::unworn(Shape::Plane), seed);
        let places = [(-15.0, -300.0), (15.0, 300.0)].map(|(lean, along)| {
            let lean = f64::to_radians(lean);
            (Point3::new(along, 0.0, 0.0), Vector3::new(lean.sin(), 0.0, lean.cos()))
        });
        scene.stand(&places, prior);
        scene
    }

    /// A sphere of 1.5 mm about the origin, µm, from three poses.
    pub fn sphere(prior: PriorError, seed: u64) -> Self {
        let surface = Surface::unworn(Shape::Sphere { radius: SPHERE_RADIUS_UM });
        let mut scene = Self::new("sphere", LengthUnit::Um, SensorModel::paper(), surface, seed);
        let places: Vec<(Point3, Vector3)> = (0..3)
            .map(|k| {
                let (turn, lean) = (f64::from(k) * std::f64::consts::TAU / 3.0, 20f64.to_radians());
                let normal = Vector3::new(lean.sin() * turn.cos(), lean.sin() * turn.sin(), lean.cos());
                (Point3::from(normal * (SPHERE_RADIUS_UM - 200.0)), normal)
            })
            .collect();
        scene.stand(&places, prior);
        scene
    }

    /// The demo part's upper face, mm, in `views` overlapping patches (100 cover it three times), and `wrong` views of another part among them.
    pub fn part(views: usize, wrong: usize, prior: PriorError, seed: u64) -> Self {
        let fine = BracketParameters { spacing_mm: PART_SPACING_MM, ..BracketParameters::default() };
        let mesh = bracket(&fine).mesh;
        let other = cover().mesh;
        let sensor = SensorModel::large();
        let reach = 0.6 * sensor.field_radius;
        let surface = Surface::unworn(Shape::mesh(mesh.clone()));
        let mut scene = Self::new("part", LengthUnit::Mm, sensor, surface, seed);
        scene.stand(&spread_over(&mesh, views, reach), prior);
        scene.mislead(&mesh, &other, wrong, reach, prior);
        scene.other = (wrong > 0).then(|| Surface::unworn(Shape::mesh(other)));
        scene
    }

    /// Stations that face places along normals, some 2 degrees and a twentieth of the field off.
    fn stand(&mut self, places: &[(Point3, Vector3)], prior: PriorError) {
        let mut rng = stream(self.seed, Stream::Poses);
        let mut doubt = stream(self.seed, Stream::Priors);
        for (target, normal) in places {
            let (world_from_view, target) = self.station_at(target, normal, &mut rng);
            let prior = prior.spoil(&world_from_view, &target, &mut doubt);
            self.stations.push(Station { world_from_view, prior, is_wrong: false });
        }
    }

    fn station_at(&self, target: &Point3, normal: &Vector3, rng: &mut ChaCha8Rng) -> (Isometry3, Point3) {
        let mut even = |reach: f64| reach * (2.0 * rng.random::<f64>() - 1.0);
        let lean = Vector3::new(even(0.035), even(0.035), even(0.035));
        let off = Vector3::new(even(0.05), even(0.05), even(0.05)) * self.sensor.field_radius;
        let target = target + off;
        let x = if normal.normalize().x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
        let normal = normal.normalize() + lean;
        (facing(&target, &normal, self.sensor.working_distance, &x, even(0.15)), target)
    }

    /// Puts wrong views among the others, evenly; each claims to be where the view after it is, or near that.
    fn mislead(&mut self, mesh: &Mesh, other: &Mesh, wrong: usize, reach: f64, prior: PriorError) {
        let mut rng = stream(self.seed, Stream::Poses);
        rng.set_word_pos(1 << 40);
        let mut doubt = stream(self.seed, Stream::Priors);
        doubt.set_word_pos(1 << 40);
        let claimed = spread_over(mesh, 2 * wrong, reach).split_off(wrong);
        for (k, ((target, normal), (claim, claim_normal))) in
            spread_over(other, wrong, reach).iter().zip(&claimed).enumerate()
        {
            let (world_from_view, _) = self.station_at(target, normal, &mut rng);
            let (claimed, at) = self.station_at(claim, claim_normal, &mut rng);
            let station = Station { world_from_view, prior: prior.spoil(&claimed, &at, &mut doubt), is_wrong: true };
            let among = (k + 1) * self.stations.len() / (wrong + 1);
            self.stations.insert(among, station);
        }
    }

    /// The view of a station.
    pub fn view(&self, index: usize) -> SimulatedView {
        let station = &self.stations[index];
        let surface = self.other.as_ref().filter(|_| station.is_wrong).unwrap_or(&self.surface);
        let eye = Eye { sensor: &self.sensor, volume: &self.volume, bias: &self.bias };
        eye.look(surface, &station.world_from_view, self.seed, index)
    }

    /// All views in their order.
    pub fn views(&self) -> Vec<SimulatedView> {
        (0..self.stations.len()).map(|k| self.view(k)).collect()
    }
}

#[cfg(test)]
mod tests;
