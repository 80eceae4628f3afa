//! A merge that is stopped; a part whose views do not hold each other.

use super::{MergeEvent, MergeRequest, merge_files, part_folder};
use crate::plan::merge::ViewsOf;
use crate::run::{CancelToken, RunContext, Stage};
use crate::stitch::StitchError;
use std::fmt::Write as _;
use std::path::Path;

fn views(folder: &Path) {
    std::fs::create_dir(folder.join("views")).unwrap();
    for k in 0..2 {
        let mut text = String::from("x y z d_cal\n");
        for (x, y) in (0..40_u32).flat_map(|x| (0..40_u32).map(move |y| (x, y))) {
            let _ = writeln!(text, "{}.5 {y} {} {}", x + 20 * k, (x * y) % 7, x.abs_diff(20));
        }
        std::fs::write(folder.join(format!("views/v{k}.txt")), text).unwrap();
    }
    let text = "schema = 1\nunit = \"mm\"\n[views]\npattern = \"v*.txt\"\n[registration]\nenabled = false\n";
    std::fs::write(folder.join("merge.toml"), text).unwrap();
}

/// Whatever the stage in which it is stopped: no cloud, no report, nothing half-written.
#[test]
fn a_merge_that_is_stopped_leaves_no_file() {
    let folder = tempfile::tempdir().unwrap();
    views(folder.path());
    let request = MergeRequest { plan_path: folder.path().join("merge.toml"), ..MergeRequest::default() };
    let names = || {
        let mut names: Vec<String> = std::fs::read_dir(folder.path())
            .unwrap()
            .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    };
    let before = names();
    for at in [Stage::Read, Stage::Register, Stage::Merge, Stage::Report] {
        let stop = CancelToken::default();
        let observe = |stage| {
            if stage == at {
                stop.cancel();
            }
        };
        let ended = merge_files(&request, &RunContext::new(&stop, &observe), &mut Vec::new(), &|_: MergeEvent| {});
        assert!(matches!(ended, Err(Some(StitchError::Cancelled(_)))), "{at:?}");
        assert_eq!(names(), before, "{at:?}");
    }
    let job = merge_files(&request, &RunContext::silent(), &mut Vec::new(), &|_| {}).unwrap();
    assert!(job.result.left_out().next().is_none());
    assert_eq!(names().len(), before.len() + 2);
}

/// Two flat views can slide on each other: no verdict is given on a part that is stitched of them, unless somebody says that the poses are true.
#[test]
fn a_part_whose_views_may_have_slid_is_no_cloud() {
    let folder = tempfile::tempdir().unwrap();
    let identity = r#""R": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "t": [0, 0, 0]"#;
    let poses =
        format!(r#"{{"views": [{{"index": 0, "approx": {{{identity}}}}}, {{"index": 1, "approx": {{{identity}}}}}]}}"#);
    std::fs::write(folder.path().join("poses.json"), poses).unwrap();
    let part = folder.path().join("part");
    std::fs::create_dir(&part).unwrap();
    for k in 0..2_u32 {
        let mut text = String::from("x y z\n");
        for (x, y) in (0..60_u32).flat_map(|x| (0..60_u32).map(move |y| (x, y))) {
            // A little rough, so that a fit has a scatter.
            let _ = writeln!(text, "{}.5 {y} 0.0{}", x + 20 * k, (3 * x + 7 * y + k) % 5);
        }
        std::fs::write(part.join(format!("v{k}.txt")), text).unwrap();
    }
    let cloud = |registration: bool| {
        let text = format!(
            "schema = 1\nunit = \"mm\"\n[views]\npattern = \"v*.txt\"\nposes = \"poses.json\"\n[registration]\nenabled = {registration}\n[merge]\nmetric = \"delta_n\"\n"
        );
        let path = folder.path().join("merge.toml");
        std::fs::write(&path, text).unwrap();
        let loaded = crate::plan::merge::load(&path, ViewsOf::Parts);
        let plan = loaded.plan.unwrap_or_else(|| panic!("{:?}", loaded.problems));
        part_folder::cloud(&plan, &part, false, &RunContext::silent())
    };
    assert!(cloud(false).unwrap().0.len() > 300);
    let told = cloud(true).unwrap_err().to_string();
    assert!(told.contains("may have slid on each other"), "{told}");
}
