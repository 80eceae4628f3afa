//! A merge that is stopped; a part whose views do not hold each other.

use super::{MergeEvent, MergeRequest, merge_files, part_folder};
use crate::plan::merge::ViewsOf;
use crate::run::{CancelToken, RunContext, Stage};
use crate::stitch::StitchError;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::Mutex;

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

/// Registering tells its share as merging does, through the job's events.
#[test]
fn registering_and_merging_tell_how_far_they_are() {
    let folder = tempfile::tempdir().unwrap();
    views(folder.path());
    let path = folder.path().join("merge.toml");
    let text = std::fs::read_to_string(&path).unwrap().replace("enabled = false", "enabled = true");
    std::fs::write(&path, text).unwrap();
    let (stage, told) = (Mutex::new(Stage::Read), Mutex::new(Vec::new()));
    let observe = |now| *stage.lock().unwrap() = now;
    let stop = CancelToken::default();
    let hear = |event: MergeEvent| {
        if let MergeEvent::Share(share) = event {
            told.lock().unwrap().push((*stage.lock().unwrap(), share));
        }
    };
    let request = MergeRequest { plan_path: path, ..MergeRequest::default() };
    // Whether the two flat views find each other is no matter here.
    let ended = merge_files(&request, &RunContext::new(&stop, &observe), &mut Vec::new(), &hear);
    let told = told.into_inner().unwrap();
    let of = |stage: Stage| told.iter().filter(|(at, share)| *at == stage && (0.0..=1.0).contains(share)).count();
    // Two views, one pair.
    assert!(of(Stage::Register) >= 3, "{told:?}");
    assert!(ended.is_err() || of(Stage::Merge) >= 2, "{told:?}");
    assert_eq!(told.len(), of(Stage::Register) + of(Stage::Merge), "{told:?}");
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

/// Twenty views in a row, with ties.
fn many_views(folder: &Path) {
    std::fs::create_dir(folder.join("views")).unwrap();
    for k in 0..20 {
        let mut text = String::from("x y z d_cal sigma_i\n");
        for (x, y) in (0..40_u32).flat_map(|x| (0..40_u32).map(move |y| (x, y))) {
            let _ = writeln!(text, "{}.{k} {y} {} {} 0.{}", x + 5 * k, (x * y) % 7, x.abs_diff(20), (x * 7 + y) % 89);
        }
        std::fs::write(folder.join(format!("views/v{k}.txt")), text).unwrap();
    }
    settings(folder, "");
}

fn settings(folder: &Path, more: &str) {
    let text = "schema = 1\nunit = \"mm\"\n[views]\npattern = \"v*.txt\"\n[registration]\nenabled = false\n";
    std::fs::write(folder.join("merge.toml"), format!("{text}{more}")).unwrap();
}

/// Points of the twenty views need 2.3 MB in memory: 32 bytes each in a view and 40 to merge, and by two metrics 1 MB more.
const LITTLE: u64 = 700_000;

/// Merges and gives the bytes of the cloud and of the report, and what was told.
fn bytes(folder: &Path, memory_limit: Option<u64>, run: &RunContext) -> Result<([Vec<u8>; 2], String), StitchError> {
    let request = MergeRequest { plan_path: folder.join("merge.toml"), memory_limit, ..MergeRequest::default() };
    let mut problems = Vec::new();
    // The limit has to hold views for each thread.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let ended = pool.install(|| merge_files(&request, run, &mut problems, &|_| {}));
    let told = problems.iter().map(|problem| problem.to_string()).collect::<Vec<_>>().join("\n");
    ended.map_err(|error| error.unwrap_or_else(|| panic!("{told}")))?;
    assert!(!folder.join("merged.ply.unfinished").exists());
    Ok((["merged.ply", "merged.json"].map(|name| std::fs::read(folder.join(name)).unwrap()), told))
}

/// Whether its points fit into memory or not: the same bytes, by one metric or by several.
#[test]
fn views_that_are_put_away_give_the_same_cloud() {
    let folder = tempfile::tempdir().unwrap();
    many_views(folder.path());
    for more in [
        "[merge]\nradius = 2.0\n",
        "[noise]\n[merge]\nradius = 2.0\nmetric = [\"d_cal\", \"sigma_i\"]\n[[feature]]\nkind = \"plane\"\n",
    ] {
        settings(folder.path(), more);
        let (whole, _) = bytes(folder.path(), None, &RunContext::silent()).unwrap();
        // Scores by several metrics take 32 bytes a point more.
        let (away, told) = bytes(folder.path(), Some(LITTLE + 1_100_000), &RunContext::silent()).unwrap();
        assert!(whole == away && told.is_empty(), "{told}");
    }
    settings(folder.path(), "[merge]\nradius = 2.0\n");
    let (whole, _) = bytes(folder.path(), None, &RunContext::silent()).unwrap();
    assert!(bytes(folder.path(), Some(LITTLE), &RunContext::silent()).unwrap().0 == whole);
    let refused = bytes(folder.path(), Some(100_000), &RunContext::silent()).unwrap_err().to_string();
    // The views are ready, and stay for a run with more memory.
    assert!(refused.contains("more than the limit of") && folder.path().join("merged.ply.unfinished").exists());
    let (again, told) = bytes(folder.path(), Some(LITTLE), &RunContext::silent()).unwrap();
    assert!(again == whole && told.contains("went on with 20 views"), "{told}");
    settings(folder.path(), "[merge]\nradius = 2.0\nmetric = \"mean\"\n");
    let refused = bytes(folder.path(), Some(LITTLE), &RunContext::silent()).unwrap_err().to_string();
    assert!(refused.contains("needs all points in memory"), "{refused}");
}

/// Stops a merge when it comes to a stage for the so many-th time.
fn stop_at(folder: &Path, at: Stage, times: usize) {
    let stop = CancelToken::default();
    let seen = std::sync::atomic::AtomicUsize::new(0);
    let observe = |stage| {
        if stage == at && seen.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1 == times {
            stop.cancel();
        }
    };
    let ended = bytes(folder, Some(LITTLE), &RunContext::new(&stop, &observe));
    assert!(matches!(ended, Err(StitchError::Cancelled(_))), "{at:?}");
    assert!(!folder.join("merged.ply").exists());
}

#[test]
fn a_merge_that_was_stopped_is_gone_on_with() {
    let folder = tempfile::tempdir().unwrap();
    many_views(folder.path());
    let away = folder.path().join("merged.ply.unfinished");
    let clean = || ["merged.ply", "merged.json"].map(|name| std::fs::remove_file(folder.path().join(name)).unwrap());
    let (whole, _) = bytes(folder.path(), None, &RunContext::silent()).unwrap();
    clean();
    for (at, times) in [(Stage::Read, 15), (Stage::Register, 1), (Stage::Merge, 1), (Stage::Report, 1)] {
        stop_at(folder.path(), at, times);
        assert!(std::fs::read_dir(&away).unwrap().count() > 5, "{at:?}");
        let (again, told) = bytes(folder.path(), Some(LITTLE), &RunContext::silent()).unwrap();
        assert!(again == whole && told.contains("went on with"), "{at:?} {told}");
        clean();
    }
}

/// Where a file cannot be written at the end, those of before stay as they are, and the views that were put away stay for the next run.
#[test]
fn what_is_ready_stays_until_everything_is_written() {
    let folder = tempfile::tempdir().unwrap();
    many_views(folder.path());
    let path = |name: &str| folder.path().join(name);
    settings(folder.path(), "[output]\nreport_pdf = \"m.pdf\"\n[merge]\nradius = 3.0\n");
    let (whole, _) = bytes(folder.path(), None, &RunContext::silent()).unwrap();
    for blocked in ["merged.ply", "merged.json", "m.pdf"] {
        std::fs::remove_file(path(blocked)).unwrap();
        let others: Vec<&str> =
            ["merged.ply", "merged.json", "m.pdf"].into_iter().filter(|name| *name != blocked).collect();
        others.iter().for_each(|name| std::fs::write(path(name), "of before").unwrap());
        // A folder takes the name while the views are merged.
        let observe = |stage| {
            if stage == Stage::Merge {
                std::fs::create_dir(path(blocked)).unwrap();
            }
        };
        let stop = CancelToken::default();
        let told = bytes(folder.path(), Some(LITTLE), &RunContext::new(&stop, &observe)).unwrap_err().to_string();
        assert!(told.contains("a folder has this name"), "{told}");
        assert!(others.iter().all(|name| std::fs::read(path(name)).unwrap() == b"of before"), "{blocked}");
        assert!(std::fs::read_dir(path("merged.ply.unfinished")).unwrap().count() == 20, "{blocked}");
        std::fs::remove_dir(path(blocked)).unwrap();
        let (again, told) = bytes(folder.path(), Some(LITTLE), &RunContext::silent()).unwrap();
        assert!(again == whole && told.contains("went on with 20 views"), "{blocked}: {told}");
    }
}

/// What another run, a broken disk or somebody else has left is not taken for views, and what is somebody else's stays.
#[test]
fn what_was_left_is_taken_only_if_it_is_whole_and_of_the_same_merge() {
    let folder = tempfile::tempdir().unwrap();
    many_views(folder.path());
    let away = folder.path().join("merged.ply.unfinished");
    let left = |k: usize| away.join(format!("{k:06}.view"));
    settings(folder.path(), "[merge]\nradius = 3.0\n");
    let (whole, _) = bytes(folder.path(), None, &RunContext::silent()).unwrap();
    let clean = || std::fs::remove_file(folder.path().join("merged.ply")).unwrap();
    clean();
    // Of other settings.
    settings(folder.path(), "[merge]\nradius = 2.0\n");
    stop_at(folder.path(), Stage::Merge, 1);
    settings(folder.path(), "[merge]\nradius = 3.0\n");
    let (again, told) = bytes(folder.path(), Some(LITTLE), &RunContext::silent()).unwrap();
    assert!(again == whole && told.contains("begun again"), "{told}");
    clean();
    // Cut off, turned over, and a header that lies.
    stop_at(folder.path(), Stage::Merge, 1);
    let first = std::fs::read(left(0)).unwrap();
    std::fs::write(left(0), &first[..first.len() / 2]).unwrap();
    let mut turned = std::fs::read(left(1)).unwrap();
    let middle = turned.len() / 2;
    turned[middle] ^= 1;
    std::fs::write(left(1), &turned).unwrap();
    let lies = String::from_utf8_lossy(&first[..600]).replace("\"points\":1600", "\"points\":9999999999999");
    std::fs::write(left(2), lies.as_bytes()).unwrap();
    let (again, told) = bytes(folder.path(), Some(LITTLE), &RunContext::silent()).unwrap();
    assert!(again == whole && told.contains("went on with 17 views"), "{told}");
    clean();
    // A file of somebody else's where a view is to be put.
    std::fs::create_dir(&away).unwrap();
    std::fs::write(left(3), "notes").unwrap();
    let request = MergeRequest {
        plan_path: folder.path().join("merge.toml"),
        memory_limit: Some(LITTLE),
        ..MergeRequest::default()
    };
    let ended = merge_files(&request, &RunContext::silent(), &mut Vec::new(), &|_| {});
    let told = ended.unwrap_err().unwrap().to_string();
    assert!(told.contains("is not one of these"), "{told}");
    assert!(std::fs::read_dir(&away).unwrap().count() == 1 && std::fs::read(left(3)).unwrap() == b"notes");
}
