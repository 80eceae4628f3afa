//! A synthetic part: its faces as meshes and the exact geometry of its features.

use super::blank::{FlatMesh, Opening, Uv};
use super::caster::Caster;
use super::forming::FormedSheet;
use crate::geometry::{LengthUnit, Mesh, Point3, UnitVector3};
use crate::plan::{
    AlignmentMethod, BackgroundSettings, CadSettings, CadSide, ComparisonPoint, Decision, Feature, Geometry,
    OutputFormat, OutputSettings, PartInfo, Plan, ScanOrder, ScanSettings, SlotReading, SurfaceFit, Taken,
    UncertaintySettings,
};
use std::path::PathBuf;

/// A part whose shape is known exactly. CAD frame, mm, `cad_side = "top"`.
#[derive(Debug, Clone, PartialEq)]
pub struct SyntheticPart {
    /// What it is called.
    pub name: String,
    /// The upper face, normals out of the sheet: what the CAD file holds.
    pub mesh: Mesh,
    /// The lower face, one thickness behind, normals out of the sheet.
    pub lower: Mesh,
    /// Sheet thickness.
    pub thickness_mm: f64,
    /// Features for the alignment: H1, S1, A1 where the part has them.
    pub features: Vec<Feature>,
    /// Comparison points with tolerances.
    pub comparison: Vec<ComparisonPoint>,
}

impl SyntheticPart {
    /// Both faces and the exact geometry from a triangulated blank and its forming.
    pub fn form(name: &str, flat: &FlatMesh, forming: &impl FormedSheet, thickness_mm: f64) -> Self {
        let mesh = flat.mapped(|q| forming.point(q));
        let mut lower = flat.mapped(|q| forming.point(q) - forming.normal(q).into_inner() * thickness_mm);
        reverse(&mut lower);
        Self { name: name.into(), mesh, lower, thickness_mm, features: Vec::new(), comparison: Vec::new() }
    }

    /// The part mirrored in the plane x = 0: the left hand to this right hand.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        let point = |p: &Point3| Point3::new(-p.x, p.y, p.z);
        let direction = |d: &UnitVector3| UnitVector3::new_unchecked(nalgebra::Vector3::new(-d.x, d.y, d.z));
        let geometry = |g: &Geometry| match g {
            Geometry::Hole { centre, axis, diameter_mm, direction: told } => Geometry::Hole {
                centre: point(centre),
                axis: direction(axis),
                diameter_mm: *diameter_mm,
                direction: told.as_ref().map(direction),
            },
            Geometry::Slot { centre, axis, direction: long, length_mm, width_mm } => Geometry::Slot {
                centre: point(centre),
                axis: direction(axis),
                direction: direction(long),
                length_mm: *length_mm,
                width_mm: *width_mm,
            },
            Geometry::Surface { position, direction: d } => {
                Geometry::Surface { position: point(position), direction: direction(d) }
            }
            Geometry::Edge { position, direction: d, normal } => {
                Geometry::Edge { position: point(position), direction: direction(d), normal: direction(normal) }
            }
        };
        let mut twin = self.clone();
        twin.name = format!("{} mirrored", self.name);
        for mesh in [&mut twin.mesh, &mut twin.lower] {
            mesh.vertices.iter_mut().for_each(|v| v.x = -v.x);
            reverse(mesh);
        }
        twin.features.iter_mut().for_each(|f| f.geometry = geometry(&f.geometry));
        twin.comparison.iter_mut().for_each(|c| c.geometry = geometry(&c.geometry));
        twin
    }

    /// The index of a feature, by its name.
    pub fn feature(&self, name: &str) -> Option<usize> {
        self.features.iter().position(|f| f.name == name)
    }

    /// A plan for the part as it would be read from a file: aligned on H1, S1 and A1 where it has them, else best fit.
    pub fn plan(&self) -> Plan {
        let alignment = match (self.feature("H1"), self.feature("S1"), self.feature("A1")) {
            (Some(hole), Some(slot), Some(point)) => {
                AlignmentMethod::Features { hole, slot, slot_reading: SlotReading::CentreLine, point }
            }
            _ => AlignmentMethod::BestFit,
        };
        Plan {
            path: PathBuf::from("synthetic.toml"),
            sha256: String::new(),
            part: PartInfo {
                name: self.name.clone(),
                number: String::new(),
                revision: String::new(),
                thickness_mm: self.thickness_mm,
                decision: Decision::Iso14253,
                cad_side: CadSide::Top,
            },
            cad: CadSettings {
                file: "synthetic.stl".into(),
                path: PathBuf::from("synthetic.stl"),
                unit: LengthUnit::Mm,
            },
            scans: ScanSettings {
                views: None,
                folder: "scans".into(),
                path: PathBuf::from("scans"),
                pattern: "*.ply".into(),
                cad: None,
                unit: LengthUnit::Mm,
                order: ScanOrder::Name,
                taken: Taken::None,
                view_direction: Some(nalgebra::Vector3::z_axis()),
            },
            background: BackgroundSettings::default(),
            alignment,
            alignment_line: 0,
            features: self.features.clone(),
            comparison: self.comparison.clone(),
            rig: None,
            uncertainty: UncertaintySettings::default(),
            output: OutputSettings {
                folder: "results".into(),
                path: PathBuf::from("results"),
                formats: vec![OutputFormat::Ascii, OutputFormat::Json],
                map_range_mm: 1.0,
            },
        }
    }

    /// Moves the surface points along their directions onto the mesh: a plan's points lie on its CAD, and that is the mesh,
    /// which stands a few micrometres off the forming's formula where the sheet is curved. Looks `reach_mm` to either side, less than
    /// to the next leaf of the sheet.
    pub(super) fn put_surface_points_on_facets(&mut self, reach_mm: f64) {
        let caster = Caster::new(&self.mesh);
        let features = self.features.iter_mut().map(|f| &mut f.geometry);
        for geometry in features.chain(self.comparison.iter_mut().map(|c| &mut c.geometry)) {
            let Geometry::Surface { position, direction } = geometry else { continue };
            let start = *position + direction.into_inner() * reach_mm;
            if let Some(hit) = caster.first(&start, &-direction.into_inner(), 0.0, 2.0 * reach_mm) {
                *position += direction.into_inner() * (reach_mm - hit.t);
            }
        }
    }

    pub(super) fn add_feature(&mut self, name: &str, geometry: Geometry) {
        self.features.push(Feature { name: name.into(), geometry, line: 0 });
    }

    pub(super) fn add_comparison(&mut self, name: &str, geometry: Geometry, tolerance_mm: f64) {
        let (name, file) = (name.into(), PathBuf::from("synthetic.toml"));
        self.comparison.push(ComparisonPoint {
            surface_fit: SurfaceFit::default(),
            name,
            geometry,
            lower_mm: -tolerance_mm,
            upper_mm: tolerance_mm,
            file,
            line: 0,
        });
    }
}

fn reverse(mesh: &mut Mesh) {
    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
}

/// The exact geometry in space of an opening on the blank; a hole tells its deviation along `told`, given on the blank.
pub(super) fn opening_geometry(
    forming: &impl FormedSheet,
    opening: &Opening,
    told: Option<super::blank::UvVector>,
) -> Geometry {
    let q = opening.centre();
    let (centre, axis) = (forming.point(&q), forming.normal(&q));
    match opening {
        Opening::Hole { diameter_mm, .. } => Geometry::Hole {
            centre,
            axis,
            diameter_mm: *diameter_mm,
            direction: told.map(|d| UnitVector3::new_normalize(forming.tangent(&q, d))),
        },
        Opening::Slot { direction, length_mm, width_mm, .. } => Geometry::Slot {
            centre,
            axis,
            direction: UnitVector3::new_normalize(forming.tangent(&q, *direction)),
            length_mm: *length_mm,
            width_mm: *width_mm,
        },
    }
}

/// The exact geometry of a surface point: the place and the face's normal there.
pub(super) fn surface_geometry(forming: &impl FormedSheet, q: &Uv) -> Geometry {
    Geometry::Surface { position: forming.point(q), direction: forming.normal(q) }
}

/// The exact geometry of a point on a trimmed edge, the straight line from `a` to `b` with the material on its left.
pub(super) fn edge_geometry(forming: &impl FormedSheet, a: &Uv, b: &Uv, share: f64) -> Geometry {
    let q = a + (b - a) * share;
    let normal = forming.normal(&q);
    let along = forming.tangent(&q, (b - a).normalize());
    let direction = UnitVector3::new_normalize(along.cross(&normal));
    Geometry::Edge { position: forming.point(&q), direction, normal }
}
