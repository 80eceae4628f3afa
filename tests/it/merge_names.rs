//! `shapeline merge`: what views are called changes the order of results and nothing else.

use super::merge::{Views, read_pose};
use serde_json::{Value, json};
use shapeline::geometry::{Isometry3, LengthUnit, Vector3};
use shapeline::io::read_cloud_in_its_unit;
use shapeline::run::RunContext;

/// Poses off by some µm and a quarter of a degree, so that registration has something to do.
fn off(k: usize) -> Isometry3 {
    let k = k as f64;
    Isometry3::new(Vector3::new(4.0, -3.0, 5.0) * (k - 1.0), Vector3::new(0.004, -0.004, 0.006) * k)
}

/// The points of the merged cloud with their d_cal as bits, in the order of their bits.
fn points(views: &Views) -> Vec<[u64; 4]> {
    let path = views.path("merged.ply");
    let bytes = std::fs::read(&path).expect("a cloud");
    let cloud = read_cloud_in_its_unit(&bytes, &path, LengthUnit::Um, &RunContext::silent()).expect("it can be read");
    let d_cal = cloud.scalar("d_cal").expect("a column");
    let mut points: Vec<[u64; 4]> = cloud
        .positions
        .iter()
        .zip(d_cal)
        .map(|(p, d)| [p.x.to_bits(), p.y.to_bits(), p.z.to_bits(), u64::from(d.to_bits())])
        .collect();
    points.sort_unstable();
    points
}

fn report(views: &Views) -> Value {
    serde_json::from_slice(&std::fs::read(views.path("merged.json")).expect("a report")).expect("JSON")
}

#[test]
fn views_under_other_names_get_the_same_poses_and_the_same_cloud() {
    let views = Views::new();
    let settings = std::fs::read_to_string(views.path("merge.toml"))
        .unwrap()
        .replace("enabled = false", "enabled = true\ntranslation_sigma = 10.0\nrotation_sigma_deg = 1.0");
    views.write("merge.toml", &settings);
    let given: Value = serde_json::from_slice(&std::fs::read(views.path("views.json")).unwrap()).unwrap();
    let approx = |k: usize| {
        let rotation = read_pose(&given["views"][k]["approx"]) * off(k);
        let r = rotation.rotation.to_rotation_matrix();
        let rows: Vec<[f64; 3]> = (0..3).map(|i| [r[(i, 0)], r[(i, 1)], r[(i, 2)]]).collect();
        let t: [f64; 3] = rotation.translation.vector.into();
        json!({"R": rows, "t": t})
    };
    let contents: Vec<Vec<u8>> =
        (0..3).map(|k| std::fs::read(views.path(&format!("views/view_{k:02}.ply"))).unwrap()).collect();
    let mut first: Option<(Vec<Value>, Vec<[u64; 4]>)> = None;
    // Which view has the k-th name.
    for named in [[0, 1, 2], [2, 1, 0], [1, 2, 0]] {
        for (name, view) in named.iter().enumerate() {
            std::fs::write(views.path(&format!("views/view_{name:02}.ply")), &contents[*view]).unwrap();
        }
        let poses = named.iter().enumerate().map(|(name, view)| json!({"index": name, "approx": approx(*view)}));
        views.write("views.json", &json!({"views": poses.collect::<Vec<Value>>()}).to_string());
        views.run(&[]).assert_ended(0, &[]);
        let told = report(&views);
        let of_view = |view: usize| &told["views"][named.iter().position(|v| *v == view).unwrap()]["pose"];
        let found = ((0..3).map(|view| of_view(view).clone()).collect::<Vec<Value>>(), points(&views));
        match &first {
            None => {
                // They were moved, else this shows nothing.
                assert_ne!(found.0[0]["t"], approx(0)["t"]);
                first = Some(found);
            }
            Some(first) => assert!(found == *first, "{named:?}: {:?} {:?}", found.0, first.0),
        }
    }
}
