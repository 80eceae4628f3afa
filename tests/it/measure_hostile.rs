//! What must not be passed over: bumps, pits and holes at the place of a surface point, notches and tabs at that of an edge,
//! belt close by, openings of the wrong size. The value is that of the defect, or there is none; never the sheet around it.
//!
//! Defects are made in simulated scans, by moving, taking away or adding points around one place. The usual run tries every defect at a
//! part of the places in turn; `SHAPELINE_FULL_SWEEP=1` tries all of them at all places and prints what became of them.

use crate::support::{conditioned, identity, inspect_scan, local, prepared, seen_from_above};
use shapeline::geometry::{CadFromScan, Point3, UnitVector3, Vector3};
use shapeline::inspect::Outcome;
use shapeline::measure::{self, Local};
use shapeline::part::Part;
use shapeline::plan::{Geometry, Side};
use shapeline::run::RunContext;
use shapeline::scan::{BeltPlane, ConditionedScan, PointGrid};
use shapeline::simulate::{
    BracketParameters, DisplacementField, PoseChoice, RigModel, Subject, SyntheticPart, bracket, simulate_scan,
};
use std::sync::LazyLock;

/// A part and a scan of it in its true pose.
pub(crate) struct Scene {
    pub(crate) nominal: SyntheticPart,
    part: Part,
    side: Side,
    scan: ConditionedScan,
    cad_from_scan: CadFromScan,
}

/// A nominal place on the face that was seen: two directions in the sheet and its normal on the plan's side, CAD frame.
#[derive(Clone, Copy)]
pub(crate) struct Place {
    at: Point3,
    axes: [Vector3; 3],
}

impl Place {
    fn uvw(&self, p: &Point3) -> [f64; 3] {
        self.axes.map(|a| a.dot(&(p - self.at)))
    }

    fn cad(&self, [u, v, w]: [f64; 3]) -> Point3 {
        self.at + self.axes[0] * u + self.axes[1] * v + self.axes[2] * w
    }
}

impl Scene {
    pub(crate) fn new(density_per_mm2: f64, side: Side, seed: u64) -> Self {
        Self::of_part(&BracketParameters::default(), density_per_mm2, side, seed)
    }

    /// The nominal plan and CAD, and a scan of another part.
    fn of_part(actual: &BracketParameters, density_per_mm2: f64, side: Side, seed: u64) -> Self {
        let nominal = bracket(&BracketParameters::default());
        let part = prepared(&nominal);
        let rig =
            RigModel { belt_margin_mm: 2.0, rim_rounding_mm: 0.0, ..RigModel::default().with_density(density_per_mm2) };
        let subject = Subject::synthetic(&nominal, &bracket(actual), DisplacementField::none());
        let pose = PoseChoice::side(&subject, side);
        let simulated = simulate_scan(&subject, &rig, &pose, seed, &RunContext::silent()).expect("nobody cancels");
        let cad_from_scan = CadFromScan::try_from_row_major(&simulated.truth.cad_from_scan).expect("a motion");
        let scan = conditioned(simulated, &rig);
        Self { nominal, part, side, scan, cad_from_scan }
    }

    /// The place of a point of the plan; `v` lies along a direction, where one is given.
    fn place(&self, at: &Point3, normal: &UnitVector3, v: Option<&UnitVector3>) -> Place {
        let w = normal.into_inner();
        let v = v.map_or_else(|| w.cross(&Vector3::y()), |v| v.into_inner());
        let v = (v - w * v.dot(&w)).normalize();
        let below = if self.side == Side::Top { 0.0 } else { self.nominal.thickness_mm };
        Place { at: at - w * below, axes: [v.cross(&w), v, w] }
    }

    /// The points around a place, (u, v, w): as far as its windows reach, of a surface point or an edge 5 mm or some spacings and a margin.
    fn around(&self, place: &Place, kind: &str) -> Vec<[f64; 3]> {
        let reach_mm = if kind == "hole" { 16.0 } else { 7.0 + 9.0 * self.scan.spacing_mm };
        let kept =
            self.scan.kept.iter().map(|&i| self.cad_from_scan.isometry() * self.scan.cloud.positions[i as usize]);
        kept.filter(|p| (p - place.at).norm() < reach_mm).map(|p| place.uvw(&p)).collect()
    }

    /// A scan of nothing but these points.
    pub(crate) fn of(&self, place: &Place, points: impl Iterator<Item = [f64; 3]>) -> (ConditionedScan, PointGrid) {
        let scan_from_cad = self.cad_from_scan.scan_from_cad();
        let positions: Vec<Point3> = points.map(|p| scan_from_cad * place.cad(p)).collect();
        let ConditionedScan { belt, belt_clearance_mm, to_camera, spacing_mm, .. } = self.scan;
        let scan = ConditionedScan { belt, belt_clearance_mm, to_camera, ..seen_from_above(positions, spacing_mm) };
        let grid = PointGrid::build(&scan, (4.0 * scan.spacing_mm).max(1.0));
        (scan, grid)
    }

    pub(crate) fn local<'a>(&'a self, scan: &'a ConditionedScan, grid: &'a PointGrid) -> Local<'a> {
        local(&self.part, self.side, scan, grid, self.cad_from_scan)
    }

    /// The plan's surface points, the datum among them, or its edges: those that are measured as long as nothing is wrong.
    pub(crate) fn good(&self, kind: &str) -> Vec<Good> {
        let features = self.nominal.features.iter().map(|f| (&f.name, &f.geometry));
        let all = features.chain(self.nominal.comparison.iter().map(|c| (&c.name, &c.geometry)));
        let of_kind = all.filter(|(_, geometry)| geometry.kind() == kind);
        let good = of_kind.map(|(name, geometry)| {
            let place = match geometry {
                Geometry::Surface { position, direction } => self.place(position, direction, None),
                Geometry::Edge { position, direction, normal } => self.place(position, normal, Some(direction)),
                other => self.place(&other.position(), &UnitVector3::new_normalize(other.sheet_normal()), None),
            };
            let points = self.around(&place, kind);
            let told = |e| panic!("{name} of the good part is not measured: {e}");
            let found = self.measured(geometry, &place, points.iter().copied()).unwrap_or_else(told);
            Good { name: name.clone(), geometry: geometry.clone(), place, points, found }
        });
        good.collect()
    }

    /// Deviation and standard uncertainty from these points alone.
    fn measured(
        &self,
        geometry: &Geometry,
        place: &Place,
        points: impl Iterator<Item = [f64; 3]>,
    ) -> Result<Found, String> {
        let (scan, grid) = self.of(place, points);
        measured(&self.local(&scan, &grid), geometry)
    }
}

/// What the limits of the demo's plan make of it: 0.5 mm for surface points, 0.7 for edges, 0.3 for holes, and 2 mm more.
fn measured(local: &Local, geometry: &Geometry) -> Result<Found, String> {
    match geometry {
        Geometry::Surface { position, direction } => measure::surface(local, position, direction, 2.5).map(|f| Found {
            deviation_mm: f.deviation_mm,
            u_mm: f.standard_uncertainty_mm,
            warning: None,
        }),
        Geometry::Edge { position, direction, normal } => measure::edge(local, position, direction, normal, 2.7)
            .map(|f| Found { deviation_mm: f.deviation_mm, u_mm: f.standard_uncertainty_mm, warning: None }),
        Geometry::Hole { centre, axis, diameter_mm, .. } => measure::hole(local, centre, axis, *diameter_mm, 2.3)
            .map(|f| Found { deviation_mm: f.diameter_mm - diameter_mm, u_mm: f.u_diameter_mm, warning: f.warning }),
        Geometry::Slot { .. } => panic!("no slot here"),
    }
    .map_err(|e| e.reason)
}

/// Of a hole the deviation is that of its diameter.
struct Found {
    deviation_mm: f64,
    u_mm: f64,
    warning: Option<String>,
}

/// A place of the plan that is measured, with the points around it.
pub(crate) struct Good {
    pub(crate) name: String,
    pub(crate) geometry: Geometry,
    pub(crate) place: Place,
    pub(crate) points: Vec<[f64; 3]>,
    found: Found,
}

/// A scene that several tests share, with its places.
struct Bench {
    case: String,
    density: f64,
    scene: Scene,
    surface: Vec<Good>,
    edges: Vec<Good>,
}

/// Each density from one side; all of them from both in a full sweep.
static BENCHES: LazyLock<Vec<Bench>> = LazyLock::new(|| {
    let usual = [(26.0, Side::Top), (2.6, Side::Bottom), (1.3, Side::Top)];
    let others = [(26.0, Side::Bottom), (2.6, Side::Top), (1.3, Side::Bottom)];
    let all = usual.into_iter().chain(others.into_iter().filter(|_| is_full_sweep()));
    all.map(|(density, side)| {
        let scene = Scene::new(density, side, 7001);
        let (surface, edges) = (scene.good("surface"), scene.good("edge"));
        Bench { case: format!("{density} points a mm², {side:?}"), density, scene, surface, edges }
    })
    .collect()
});

pub(crate) fn is_full_sweep() -> bool {
    std::env::var_os("SHAPELINE_FULL_SWEEP").is_some()
}

/// Every eighth place, others in every case; in a full sweep all of them.
fn in_turn(places: &[Good], case: usize) -> impl Iterator<Item = &Good> {
    const SHARE: usize = 8;
    places
        .iter()
        .enumerate()
        .filter(move |(k, _)| is_full_sweep() || (k + case).is_multiple_of(SHARE))
        .map(|(_, place)| place)
}

/// What became of places with a defect.
#[derive(Default)]
struct Tally {
    places: usize,
    /// Measured, and within four standard uncertainties (both of the value and of that without the defect) of the defect.
    own: usize,
    refused: usize,
    /// Measured and further off than that, but nearer to the defect than the tolerance.
    off: usize,
    /// The rest: the wrong green light.
    wrong: Vec<String>,
}

impl Tally {
    fn add(&mut self, good: &Good, truth_mm: f64, tolerance_mm: f64, found: Result<Found, String>) {
        self.places += 1;
        let Ok(found) = found else {
            self.refused += 1;
            return;
        };
        let error_mm = found.deviation_mm - truth_mm;
        if error_mm.abs() <= 4.0 * found.u_mm.hypot(good.found.u_mm) {
            self.own += 1;
        } else if error_mm.abs() <= tolerance_mm {
            self.off += 1;
        } else {
            self.wrong.push(format!("{} off by {error_mm:+.2} mm with u {:.3}", good.name, found.u_mm));
        }
    }

    fn join(&mut self, other: Self) {
        self.places += other.places;
        self.own += other.own;
        self.refused += other.refused;
        self.off += other.off;
        self.wrong.extend(other.wrong);
    }

    fn tell(&self, what: &str) {
        let Self { places, own, refused, off, wrong } = self;
        println!("{what}: of {places} own {own}, refused {refused}, off {off}, wrong {}", wrong.len());
    }
}

/// What a surface is made to do in a disc around a place.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Disc {
    Step(f64),
    /// (1 + cos) / 2 of its height.
    Dome(f64),
    Empty,
}

const STEPS_MM: [f64; 10] = [0.8, -0.8, 1.4, -1.4, 2.0, -2.0, 4.0, -4.0, 6.0, -6.0];

/// What the look at the place itself may not see: 4.5 standard deviations of the median of five points with noise of 0.12 mm, 15 % of
/// its variance in common, are 4.5 * 0.12 * sqrt(pi / 2 / 5 + 0.15) = 0.37 mm, and the noise is estimated to a tenth. Half of the
/// smallest step is no less: whatever is measured is the step's height and not that of the sheet around it.
const UNSEEN_MM: f64 = 0.4;

/// A disc of that radius at these surface points, with the place in its middle (`off` 0) or half-way to its rim (0.5).
fn disc<'a>(scene: &Scene, places: impl Iterator<Item = &'a Good>, radius: f64, off: f64, disc: Disc) -> Tally {
    let mut tally = Tally::default();
    for place in places {
        let lift = |p: &[f64; 3]| {
            let r = (p[0] - off * radius).hypot(p[1]) / radius;
            match disc {
                Disc::Step(mm) if r <= 1.0 => Some(mm),
                Disc::Dome(mm) if r <= 1.0 => Some(0.5 * mm * (1.0 + (std::f64::consts::PI * r).cos())),
                Disc::Empty if r <= 1.0 => None,
                _ => Some(0.0),
            }
        };
        let moved = place.points.iter().filter_map(|p| Some([p[0], p[1], p[2] + lift(p)?]));
        let found = scene.measured(&place.geometry, &place.place, moved);
        // In a hole every value is wrong.
        let truth_mm = lift(&[0.0; 3]).map_or(f64::INFINITY, |mm| place.found.deviation_mm + mm);
        // Of a dome a third of its height, where that is more: a quadratic does not follow its flanks.
        let tolerance_mm = if let Disc::Dome(mm) = disc { UNSEEN_MM.max(mm.abs() / 3.0) } else { UNSEEN_MM };
        tally.add(place, truth_mm, tolerance_mm, found);
    }
    tally
}

#[test]
fn no_surface_point_is_told_from_the_sheet_around_its_place() {
    for bench in BENCHES.iter().filter(|b| b.density > 2.0) {
        let mut off_alike = [0; 2];
        for (r, radius) in [2.0, 3.0, 4.0, 6.0, 8.0].into_iter().enumerate() {
            let (mut steps, mut holes) = (Tally::default(), Tally::default());
            for (o, off) in [0.0, 0.5].into_iter().enumerate() {
                for (k, step_mm) in STEPS_MM.into_iter().enumerate() {
                    let places = in_turn(&bench.surface, 3 * r + 5 * o + k);
                    steps.join(disc(&bench.scene, places, radius, off, Disc::Step(step_mm)));
                }
                let places = in_turn(&bench.surface, r + 4 * o);
                holes.join(disc(&bench.scene, places, radius, off, Disc::Empty));
            }
            let case = format!("{}, discs of {radius} mm", bench.case);
            steps.tell(&format!("{case}, steps"));
            holes.tell(&format!("{case}, holes"));
            assert!(steps.wrong.is_empty(), "{case}: {:?}", steps.wrong);
            assert!(holes.wrong.is_empty(), "{case}: holes measured, {:?}", holes.wrong);
            off_alike[0] += steps.off;
            off_alike[1] += steps.places;
            if radius == 8.0 {
                // The window is full of a step of up to 2 mm: it is measured, six of the ten of them.
                assert!(10 * steps.own >= 5 * steps.places, "{case}: {} of {}", steps.own, steps.places);
            }
        }
        // Next to none of those that are measured are four standard uncertainties off.
        assert!(off_alike[0] * 50 <= off_alike[1], "{}: {off_alike:?} are off", bench.case);
    }
}

#[test]
fn no_dome_is_told_from_the_sheet_around_it() {
    for bench in BENCHES.iter().filter(|b| b.density > 2.0) {
        for radius in if bench.density > 10.0 { [2.0, 4.0, 8.0] } else { [4.0, 6.0, 8.0] } {
            let mut domes = Tally::default();
            for (k, step_mm) in STEPS_MM.into_iter().enumerate() {
                domes.join(disc(&bench.scene, in_turn(&bench.surface, k), radius, 0.0, Disc::Dome(step_mm)));
            }
            let case = format!("{}, domes of {radius} mm", bench.case);
            domes.tell(&case);
            assert!(domes.wrong.is_empty(), "{case}: {:?}", domes.wrong);
        }
    }
}

/// The smallest defects that docs/plan.md tells of.
#[test]
fn a_surface_point_sees_defects_down_to_a_few_points() {
    for bench in BENCHES.iter() {
        let (seen_step_mm, seen_hole_mm) = match bench.density {
            26.0 => (0.5, 0.625),
            2.6 => (1.0, 1.75),
            _ => (1.25, 2.5),
        };
        for (k, larger) in [1.0, 1.25, 1.5].into_iter().enumerate() {
            let mut tally = Tally::default();
            for (case, step_mm) in STEPS_MM.into_iter().enumerate() {
                let places = in_turn(&bench.surface, 3 * k + case);
                tally.join(disc(&bench.scene, places, larger * seen_step_mm, 0.0, Disc::Step(step_mm)));
            }
            for case in [k, k + 4] {
                let places = in_turn(&bench.surface, case);
                tally.join(disc(&bench.scene, places, larger * seen_hole_mm, 0.0, Disc::Empty));
            }
            let case = format!("{}, {larger} times the smallest discs", bench.case);
            tally.tell(&case);
            assert!(tally.wrong.is_empty(), "{case}: {:?}", tally.wrong);
        }
    }
}

/// The narrowest that docs/plan.md tells of, 12 mm long, in some directions.
#[test]
fn no_surface_point_is_measured_on_a_crack() {
    for bench in BENCHES.iter() {
        let narrowest_mm = match bench.density {
            26.0 => CRACKS_MM[0],
            2.6 => CRACKS_MM[1],
            _ => CRACKS_MM[2],
        };
        for (c, (width, degrees)) in
            [1.0, 1.25, 1.5].iter().flat_map(|w| [0.0, 33.0, 75.0, 121.0].map(|d| (w * narrowest_mm, d))).enumerate()
        {
            let (sin, cos) = f64::to_radians(degrees).sin_cos();
            let in_crack =
                |p: &[f64; 3]| (p[0] * cos + p[1] * sin).abs() < 6.0 && (p[1] * cos - p[0] * sin).abs() < 0.5 * width;
            let mut tally = Tally::default();
            for place in in_turn(&bench.surface, c) {
                let left = place.points.iter().filter(|p| !in_crack(p)).copied();
                tally.add(place, f64::INFINITY, 0.0, bench.scene.measured(&place.geometry, &place.place, left));
            }
            let case = format!("{}, a crack of {width} mm at {degrees} degrees", bench.case);
            tally.tell(&case);
            assert!(tally.wrong.is_empty(), "{case}: {:?}", tally.wrong);
        }
    }
}

/// Widths of cracks at 26, 2.6 and 1.3 points a mm².
const CRACKS_MM: [f64; 3] = [0.75, 2.25, 3.0];

/// A notch cut into these edges (or, with a negative depth, a tab left standing), `off` beside the place.
///
/// The tab is the sheet behind the edge, turned about the edge's line, and bent off the sheet by `bent_mm`. A value may be off by the 0.25 mm within which two edges
/// count as one.
fn notch<'a>(
    scene: &Scene,
    places: impl Iterator<Item = &'a Good>,
    [width, depth]: [f64; 2],
    off: f64,
    bent_mm: f64,
) -> Tally {
    let mut tally = Tally::default();
    for place in places {
        let at_notch = |p: &&[f64; 3]| (p[0] - off).abs() < 0.5 * width;
        let left = place.points.iter().filter(|p| !(at_notch(p) && p[1] > -depth.max(0.0) && depth > 0.0));
        let turned = place.points.iter().filter(|p| at_notch(p) && p[1] > depth && p[1] <= 0.0);
        let more = turned.map(|p| [p[0], -p[1], bent_mm - p[2]]);
        let found = scene.measured(&place.geometry, &place.place, left.copied().chain(more));
        tally.add(place, place.found.deviation_mm - depth, 0.25, found);
    }
    tally
}

#[test]
fn no_edge_is_told_from_what_is_on_both_sides_of_a_notch() {
    for bench in BENCHES.iter().filter(|b| b.density > 2.0) {
        // The smallest that docs/plan.md tells of.
        let (seen_width, seen_depth) = if bench.density > 10.0 { (2.0, 1.0) } else { (3.0, 1.5) };
        for width in [1.0, 2.0, 3.0, 4.0] {
            for depth in [1.0, 1.5, 2.0, 3.0, -1.0, -1.5, -2.0, -3.0] {
                let is_seen = width >= seen_width && f64::abs(depth) >= seen_depth;
                if !is_seen && !is_full_sweep() {
                    continue;
                }
                let mut tally = Tally::default();
                for off in [0.0, 0.5] {
                    tally.join(notch(&bench.scene, bench.edges.iter(), [width, depth], off, 0.0));
                }
                if depth < 0.0 {
                    tally.join(notch(&bench.scene, bench.edges.iter(), [width, depth], 0.0, 0.3));
                }
                let case = format!("{}, {width} mm wide, {depth} mm deep", bench.case);
                tally.tell(&case);
                assert!(tally.wrong.is_empty() || !is_seen, "{case}: {:?}", tally.wrong);
            }
        }
    }
}

/// A straight line through both would be neither the one edge nor the other.
#[test]
fn no_edge_is_told_from_a_tear_that_begins_beside_its_place() {
    for bench in BENCHES.iter().filter(|b| b.density > 2.0) {
        // At 2.6 points a mm² single tears of 2 mm pass for an edge that is 0.9 mm off, with u 0.2 mm.
        let depths: &[f64] = if bench.density > 10.0 { &[2.0, 3.0] } else { &[3.0] };
        for &depth in depths {
            let mut tally = Tally::default();
            for place in &bench.edges {
                let left = place.points.iter().filter(|p| !(p[0] > -0.5 && p[1] > -depth)).copied();
                let found = bench.scene.measured(&place.geometry, &place.place, left);
                tally.add(place, place.found.deviation_mm - depth, 0.4, found);
            }
            let case = format!("{}, a tear {depth} mm deep", bench.case);
            tally.tell(&case);
            assert!(tally.wrong.is_empty(), "{case}: {:?}", tally.wrong);
        }
    }
}

#[test]
fn a_direction_into_the_sheet_or_leaning_changes_the_sign_and_no_decision() {
    let scene = Scene::new(2.6, Side::Bottom, 7002);
    for good in scene.good("surface") {
        let Geometry::Surface { position, direction } = &good.geometry else { unreachable!() };
        let turned = Geometry::Surface { position: *position, direction: -*direction };
        let of = |geometry: &Geometry, lift: &dyn Fn(&[f64; 3]) -> f64| {
            let points = good.points.iter().map(|p| [p[0], p[1], p[2] + lift(p)]);
            scene.measured(geometry, &good.place, points)
        };
        // The same points in a window about the same line; the fit starts from the other side of them.
        let there = of(&turned, &|_| 0.0).unwrap();
        assert!((there.deviation_mm + good.found.deviation_mm).abs() < 0.01, "{}", good.name);
        for step_mm in [1.4, -1.4] {
            let pit = |p: &[f64; 3]| if p[0].hypot(p[1]) <= 2.0 { step_mm } else { 0.0 };
            if let Ok(found) = of(&turned, &pit) {
                let error_mm = found.deviation_mm + good.found.deviation_mm + step_mm;
                assert!(error_mm.abs() < UNSEEN_MM, "{}: {error_mm:+.2} mm off", good.name);
            }
        }
        // A flat bump, and a line that leans over by 40 degrees: it meets the bump, raised by 0.8 mm, after 0.8 / cos(40 degrees).
        let across = good.place.axes[0];
        let leaning = |degrees: f64| {
            let (sin, cos) = f64::to_radians(degrees).sin_cos();
            let direction = UnitVector3::new_normalize(direction.into_inner() * cos + across * sin);
            Geometry::Surface { position: *position, direction }
        };
        let (flat, raised) = (of(&leaning(40.0), &|_| 0.0), of(&leaning(40.0), &|_| 0.8));
        if let (Ok(flat), Ok(raised)) = (flat, raised) {
            let rise_mm = raised.deviation_mm - flat.deviation_mm;
            // Windows about a leaning line hold other points.
            let tolerance_mm = 4.0 * flat.u_mm.hypot(raised.u_mm);
            assert!((rise_mm - 0.8 / 40.0_f64.to_radians().cos()).abs() < tolerance_mm, "{}: {rise_mm}", good.name);
        }
        // The plan's direction and the CAD's facet differ by a degree or two.
        let refused = of(&leaning(70.0), &|_| 0.0).err().expect("leans too far");
        assert!(refused.contains("away from the sheet's normal, 60° are allowed"), "{refused}");
    }
}

/// The datum surface point of a whole scan on a bump, in a pit or over a hole: no pass, and never the plane around it.
#[test]
fn no_datum_is_told_from_the_sheet_around_it() {
    let nominal = bracket(&BracketParameters::default());
    let part = prepared(&nominal);
    let rig = RigModel { rim_rounding_mm: 0.0, belt_margin_mm: 20.0, ..RigModel::default().with_density(2.6) };
    let subject = Subject::perfect(&nominal);
    let simulated =
        simulate_scan(&subject, &rig, &PoseChoice::side(&subject, Side::Top), 7003, &RunContext::silent()).unwrap();
    let mut plan = nominal.plan();
    plan.scans.view_direction = Some(rig.view_direction);
    let cad_from_scan = CadFromScan::try_from_row_major(&simulated.truth.cad_from_scan).unwrap();
    let datum = plan.features.iter().find(|f| f.name == "A1").unwrap();
    let Geometry::Surface { position, direction } = &datum.geometry else { panic!("A1") };
    let near = |p: &Point3, radius: f64| {
        let d = cad_from_scan.isometry() * p - position;
        let height = d.dot(direction);
        height.abs() < 2.0 && (d - direction.into_inner() * height).norm() <= radius
    };
    let mut refused = 0;
    for (radius, step_mm) in [(2.0, 1.4), (2.0, -1.4), (3.0, 0.8), (3.0, -2.0), (4.0, f64::NAN), (0.0, 0.0)] {
        let mut cloud = simulated.cloud.clone();
        let shift =
            cad_from_scan.scan_from_cad() * (direction.into_inner() * if f64::is_nan(step_mm) { 0.0 } else { step_mm });
        let empty = f64::is_nan(step_mm);
        for p in cloud.positions.iter_mut().filter(|p| near(p, radius)) {
            // Points that are gone lie far below the belt.
            *p = if empty { *p + rig.view_direction.into_inner() * 500.0 } else { *p + shift };
        }
        let inspected = inspect_scan(&plan, &part, cloud, identity());
        let Outcome::Measured(inspection) = &inspected.result.outcome else { panic!("refused") };
        let alignment = &inspection.alignment;
        if let Some(reason) = &alignment.degraded {
            assert!(radius > 0.0, "the good part: {reason}");
            assert!(reason.contains("datum A1 not measured"), "{reason}");
            assert!(inspection.points.iter().all(|p| p.measurement.is_none()));
            refused += 1;
            continue;
        }
        // On the bump: the datum is held at its nominal height, and the sheet beside it (4 mm away) is turned down by the step.
        assert!(!empty, "a datum in a hole was measured");
        let centre = alignment.features.iter().find(|f| f.name == "A1").unwrap().centre;
        assert!((centre - position).dot(direction).abs() < 1e-3);
        let moved = alignment.cad_from_scan.isometry() * cad_from_scan.scan_from_cad();
        let rise_mm = (moved * position - position).dot(direction);
        // Hole and slot add a few hundredths.
        assert!(
            (rise_mm + step_mm).abs() < UNSEEN_MM + 0.05,
            "a step of {step_mm} mm moved the part by {rise_mm:+.2} mm"
        );
    }
    assert!(refused >= 1, "the hole at least");
}

#[test]
fn what_lies_close_to_the_belt_is_not_measured() {
    let scene = Scene::new(2.6, Side::Bottom, 7004);
    let scan_from_cad = scene.cad_from_scan.scan_from_cad();
    for good in scene.good("surface").iter().chain(&scene.good("edge")) {
        let outwards = -good.place.axes[2];
        // The belt under the face that was seen. With a clearance of 0.5 and three sigma of 0.1 what is lower than 0.8 mm is too low;
        // an edge found 0.3 mm beside its place is as high, the belt being parallel to the sheet.
        for (below_mm, hidden) in [(0.5, true), (1.5, false)] {
            let (mut scan, grid) = scene.of(&good.place, good.points.iter().copied());
            let point = scan_from_cad * (good.place.at - outwards * below_mm);
            let normal = UnitVector3::new_normalize(scan_from_cad.rotation * outwards);
            scan.belt = Some(BeltPlane { point, normal, sigma_mm: 0.1 });
            scan.belt_clearance_mm = Some(0.5);
            match measured(&scene.local(&scan, &grid), &good.geometry) {
                Err(e) => assert!(hidden && e.contains("above the belt, too near"), "{}: {e}", good.name),
                Ok(_) => assert!(!hidden, "{} was measured {below_mm} mm above the belt", good.name),
            }
        }
    }
}

/// A seeded choice of a share of points, by their place.
fn some(p: &[f64; 3], share: f64) -> bool {
    ((p[0] * 7919.0 + p[1] * 104_729.0).sin() * 43_758.547).rem_euclid(1.0) < share
}

#[test]
fn points_in_a_hole_or_past_an_edge_are_told_or_refused() {
    for density in [26.0, 2.6] {
        let scene = Scene::new(density, Side::Top, 7005);
        // C04 and C05 stand in leaning or narrow flanges, C01 is so wide that its rim is not flat.
        for good in scene.good("hole").iter().filter(|g| matches!(g.name.as_str(), "C02" | "C03")) {
            let Geometry::Hole { diameter_mm, .. } = good.geometry else { unreachable!() };
            // A lattice of points in the opening, of that share of the sheet's density.
            let of = |share: f64| {
                let step = (share * density).sqrt().recip();
                let places =
                    (-99..=99).flat_map(|i| (-99..=99).map(move |j| [f64::from(i) * step, f64::from(j) * step, 0.0]));
                let filling = places.filter(|p| p[0].hypot(p[1]) < 0.5 * diameter_mm);
                scene.measured(&good.geometry, &good.place, good.points.iter().copied().chain(filling))
            };
            assert_eq!(good.found.warning, None);
            let told = of(0.2).unwrap_or_else(|e| panic!("{}: {e}", good.name)).warning.unwrap_or_default();
            assert!(told.contains("points stand inside this hole"), "{}: {told:?}", good.name);
            let refused = of(1.0).err().unwrap_or_else(|| panic!("{} is plugged and measured", good.name));
            assert!(refused.contains("hole"), "{}: {refused}", good.name);
        }
        for good in scene.good("edge") {
            let past = |share: f64| {
                let turned = good.points.iter().filter(|p| p[1] < 0.0).map(|p| [p[0], -p[1], -p[2]]);
                turned.filter(move |p| some(p, share))
            };
            let of = |share: f64| {
                scene.measured(&good.geometry, &good.place, good.points.iter().copied().chain(past(share)))
            };
            let refused = of(0.2).err().unwrap_or_else(|| panic!("{} is measured", good.name));
            assert!(refused.contains("points go on past this edge"), "{}: {refused}", good.name);
            // The sheet behind E01 bends down after 2.6 mm: laid over, it ends there, which no limit passes.
            match of(1.0) {
                Err(reason) => assert!(reason.contains("edge"), "{}: {reason}", good.name),
                Ok(found) => assert!(found.deviation_mm > 2.0, "{} has no edge and is measured", good.name),
            }
        }
    }
}

#[test]
fn a_hole_of_another_size_is_told_or_refused() {
    for (change_mm, expected) in [(0.4, "right"), (1.1, "told"), (-1.1, "told"), (2.0, "refused"), (-2.0, "refused")] {
        let actual = BracketParameters { diameter_changes: vec![("C03", change_mm)], ..BracketParameters::default() };
        let scene = Scene::of_part(&actual, 5.2, Side::Top, 7006);
        let hole = scene.nominal.comparison.iter().find(|c| c.name == "C03").expect("C03");
        let place =
            scene.place(&hole.geometry.position(), &UnitVector3::new_normalize(hole.geometry.sheet_normal()), None);
        match (scene.measured(&hole.geometry, &place, scene.around(&place, "hole").into_iter()), expected) {
            (Ok(found), "right") => assert_eq!(found.warning, None),
            (Ok(found), "told") => {
                let told = found.warning.unwrap_or_default();
                assert!(told.contains("nominally 10.0 mm wide"), "{told:?}");
                let error_mm = found.deviation_mm - change_mm;
                assert!(error_mm.abs() < 4.0 * found.u_mm, "{error_mm} mm off with u {}", found.u_mm);
            }
            (Err(reason), "refused") => {
                println!("{change_mm} mm: {reason}");
                assert!(reason.contains("the gap found here is") || reason.contains("no hole here"), "{reason}");
            }
            (found, _) => panic!("{change_mm} mm is {expected}: {:?}", found.map(|f| f.deviation_mm)),
        }
    }
}
