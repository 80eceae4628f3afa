//! A scene as files that `shapeline merge` takes, with the truth beside them.

use super::calibration::CalibrationMark;
use super::scene::{CYLINDER_RADIUS_U_UM, CYLINDER_RADIUS_UM, SPHERE_RADIUS_UM, Scene};
use super::surface::Shape;
use super::view::SimulatedView;
use crate::geometry::{Isometry3, Point3};
use crate::io::write_ply_cloud;
use crate::run::RunContext;
use crate::simulate::files::whole;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// What was written.
#[derive(Debug, Clone, PartialEq)]
pub struct Dataset {
    /// The file for `shapeline merge`.
    pub merge: PathBuf,
    /// Views.
    pub views: usize,
    /// Their points.
    pub points: usize,
}

/// Writes `merge.toml`, `views/`, `views.json` (the prior poses), the features of the calibration and `truth/` into a folder that is made if
/// need be.
///
/// `truth/poses.json` holds the true poses, `truth/view_00.ply` the true places of the view's points, with the columns `error` and `bias`.
///
/// # Errors
/// What the system says, or that it was stopped.
pub fn write_dataset(folder: &Path, scene: &Scene, run: &RunContext) -> io::Result<Dataset> {
    for inner in ["views", "truth"] {
        std::fs::create_dir_all(folder.join(inner))?;
    }
    let digits = (scene.stations.len().max(2) - 1).to_string().len().max(2);
    let mut points = 0;
    for index in 0..scene.stations.len() {
        run.check().map_err(io::Error::other)?;
        let view = scene.view(index);
        points += view.positions.len();
        write_view(folder, &format!("view_{index:0digits$}.ply"), scene, &view)?;
    }
    for (name, marks) in
        [("camera_features.csv", &scene.volume.camera), ("projector_features.csv", &scene.volume.projector)]
    {
        whole(&folder.join(name), |out| out.write_all(features(marks).as_bytes()))?;
    }
    let priors = scene.stations.iter().enumerate().map(|(k, s)| json!({"index": k, "approx": pose(&s.prior)}));
    write_json(&folder.join("views.json"), &json!({ "views": priors.collect::<Vec<Value>>() }))?;
    let truth = |(k, s): (usize, &super::Station)| match s.is_wrong {
        true => json!({"index": k, "wrong": true}),
        false => json!({"index": k, "wrong": false, "true": pose(&s.world_from_view)}),
    };
    let truth: Vec<Value> = scene.stations.iter().enumerate().map(truth).collect();
    write_json(&folder.join("truth/poses.json"), &json!({ "views": truth }))?;
    let merge = folder.join("merge.toml");
    let text = merge_text(scene, digits);
    whole(&merge, |out| out.write_all(text.as_bytes()))?;
    Ok(Dataset { merge, views: scene.stations.len(), points })
}

fn write_view(folder: &Path, name: &str, scene: &Scene, view: &SimulatedView) -> io::Result<()> {
    let pixel = |axis: usize| view.pixels.iter().map(|p| p[axis] as f32).collect::<Vec<f32>>();
    let (row, col) = (pixel(0), pixel(1));
    let mut scalars: Vec<(&str, &[f32])> = vec![("row", &row), ("col", &col)];
    scalars.extend(view.columns());
    whole(&folder.join("views").join(name), |out| {
        write_ply_cloud(out, &view.positions, scene.unit, None, None, &scalars)
    })?;
    let places: Vec<Point3> = (0..view.positions.len()).map(|k| view.true_position(k)).collect();
    let errors: [(&str, &[f32]); 2] = [("error", &view.error), ("bias", &view.bias)];
    whole(&folder.join("truth").join(name), |out| write_ply_cloud(out, &places, scene.unit, None, None, &errors))
}

fn write_json(path: &Path, value: &Value) -> io::Result<()> {
    let mut text = serde_json::to_string_pretty(value)?;
    text.push('\n');
    whole(path, |out| out.write_all(text.as_bytes()))
}

fn pose(motion: &Isometry3) -> Value {
    let r = motion.rotation.to_rotation_matrix();
    let rows: Vec<[f64; 3]> = (0..3).map(|k| [r[(k, 0)], r[(k, 1)], r[(k, 2)]]).collect();
    json!({"R": rows, "t": [motion.translation.x, motion.translation.y, motion.translation.z]})
}

fn features(marks: &[CalibrationMark]) -> String {
    let mut text = String::from("x,y,z,reprojection_px\n");
    for mark in marks {
        let p = mark.position;
        let _ = writeln!(text, "{:.6},{:.6},{:.6},{:.4}", p.x, p.y, p.z, mark.reprojection_px);
    }
    text
}

/// The settings of the paper, in the scene's unit.
fn merge_text(scene: &Scene, digits: usize) -> String {
    let (unit, s) = (scene.unit.key(), &scene.sensor);
    let pattern = format!("view_{}.ply", "?".repeat(digits));
    // 150 µm of the paper's sensor.
    let d_cal = 150.0 * s.working_distance / 10_000.0;
    let feature = match &scene.surface.shape {
        Shape::Plane => "\n[[feature]]\nkind = \"plane\"\n".to_owned(),
        Shape::Sphere { .. } => format!("\n[[feature]]\nkind = \"sphere\"\nradius = {SPHERE_RADIUS_UM:?}\n"),
        Shape::Cylinder { .. } => format!(
            "\n[[feature]]\nkind = \"cylinder\"\nradius = {CYLINDER_RADIUS_UM:?}\nradius_u = {CYLINDER_RADIUS_U_UM:?}\n"
        ),
        Shape::Mesh(_) => String::new(),
    };
    format!(
        "# {} simulated views of a {}; truth/ holds what is true of them\nschema = 1\nunit = \"{unit}\"\n
[views]\nfolder = \"views\"\npattern = \"{pattern}\"\nprealign = \"poses\"\nposes = \"views.json\"\n
[mask]\nsigma_i = {{ min = 0.002 }}\nd_cal = {{ max = {d_cal:?} }}\n
[calibration]\ncamera = \"camera_features.csv\"\nprojector = \"projector_features.csv\"\n
[registration]\nenabled = true\n
[merge]\nmetric = \"d_cal\"\nradius_grid = 2.0\n{feature}
[output]\nfile = \"merged.ply\"\nreport = \"merge.json\"\n",
        scene.stations.len(),
        scene.name
    )
}
