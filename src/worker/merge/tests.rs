//! A merge that is stopped.

use super::{MergeEvent, MergeRequest, merge_files};
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
