//! Pre-alignment of views by the CAD.

use crate::align::best_fit;
use crate::diagnostic::{Diagnostic, ReadError, Stop};
use crate::geometry::{Aabb, Isometry3, Point3, PointCloud, UnitVector3};
use crate::part::Part;
use crate::plan::merge::MergePlan;
use crate::plan::{BackgroundSettings, CadSettings, CadSide, Side};
use crate::run::{Cancelled, RunContext, Stage};
use crate::scan::{ScanHints, condition};
use crate::stitch::units::size;
use crate::stitch::{NoStart, View};
use crate::worker::examine::{prepare_cad, settings_for};

/// The CAD as a part of no thickness: views are fitted to its surface.
pub(super) fn prepare(cad: &CadSettings, run: &RunContext) -> Result<Part, ReadError> {
    let settings = settings_for(CadSide::Top, 0.0, &[], &[]);
    prepare_cad(cad, &settings, None, run).map(|(part, _)| part)
}

/// Whether the CAD's size can be that of the views' part.
///
/// # Errors
/// It cannot, in words for units.
pub(super) fn check_size(plan: &MergePlan, cad: &CadSettings, part: &Part, view: &View) -> Result<(), Diagnostic> {
    // A view shows no more than the part, and some of what lies beside it; of the largest tool it shows a five hundredth.
    const SMALLEST: f64 = 1.0 / 500.0;
    const LARGEST: f64 = 20.0;
    let (view_mm, cad_mm) = (size(&view.positions) * plan.unit.in_mm(), part.diagonal_mm());
    let ratio = view_mm / cad_mm;
    if (SMALLEST..=LARGEST).contains(&ratio) {
        return Ok(());
    }
    let message = format!(
        "{} measures {view_mm:.4} mm across and the CAD {cad_mm:.4} mm, expected a view of its part",
        view.name
    );
    let help = format!(
        "check `unit` ({}) and [cad] unit ({}): one of the two may be 1000 times off",
        plan.unit.key(),
        cad.unit.key()
    );
    Err(Diagnostic::error(message).in_file(&plan.path).at_line(plan.views.folder.line).with_help(help))
}

/// Where a view fits the CAD: `cad_from_view` in the view's unit, `mm_per_unit` of it; or why it does not.
pub(super) fn start(
    part: &Part,
    view: &View,
    mm_per_unit: f64,
    run: &RunContext,
) -> Result<Result<Isometry3, NoStart>, Cancelled> {
    run.enter(Stage::BestFit)?;
    let positions: Vec<Point3> = view.positions.iter().map(|p| p * mm_per_unit).collect();
    let middle = Aabb::of_points(&positions).map_or_else(Point3::origin, |bounds| bounds.centre());
    let extents = part.bounds.extents();
    let hints = ScanHints {
        view_direction: UnitVector3::try_new(middle - view.sensor * mm_per_unit, 1e-9),
        part_extents_mm: [extents.x, extents.y, extents.z],
        part_area_mm2: part.face(Side::Top).mesh.area(),
        thickness_mm: part.thickness_mm,
    };
    let cloud = PointCloud { positions, ..PointCloud::default() };
    let background = BackgroundSettings { belt_plane: false, ..BackgroundSettings::default() };
    let fitted = condition(cloud, &background, &hints, run).and_then(|scan| best_fit(part, &scan, run));
    match fitted {
        Ok(fit) => {
            let mut pose = *fit.cad_from_scan.isometry();
            pose.translation.vector /= mm_per_unit;
            Ok(Ok(pose))
        }
        Err(Stop::Refused(refusal)) => Ok(Err(NoStart::Refused(format!("by the CAD: {}", refusal.reason)))),
        Err(Stop::Cancelled(cancelled)) => Err(cancelled),
    }
}
