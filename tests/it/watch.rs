//! A watched folder: each scan once, only when whole, through everything that happens to a folder on a shop floor.

use super::project::{Project, Running, tiny_scan};
use shapeline::io::sha256_hex;
use std::io::Write;
use std::time::Duration;

fn watch(project: &Project) -> Running {
    let mut running = Running::start(project.root(), ["run", "demo.toml", "--watch", "--settle", "0.3"]);
    running.wait_for_words(&["watching"]);
    running
}

/// Ends the watch with Ctrl-C; what it wrote must be consistent. Returns its lines.
fn stop(mut running: Running, project: &Project) -> Vec<String> {
    running.interrupt();
    let ran = running.end();
    ran.assert_ended(130, &[]);
    if project.has("results/manifest.sha256") {
        project.assert_verified("results");
    }
    ran.stdout.lines().map(str::to_owned).collect()
}

fn assert_whole(project: &Project, result: &str, scan: &[u8]) {
    assert_eq!(project.json(result)["scan"]["sha256"], sha256_hex(scan), "{result}");
}

#[test]
fn a_file_written_slowly_is_taken_once_and_whole() {
    let project = Project::new();
    let mut running = watch(&project);
    let scan = tiny_scan(1);
    let mut file = std::fs::File::create(project.path("scans/slow.ply")).unwrap();
    for piece in scan.chunks(100) {
        file.write_all(piece).unwrap();
        file.flush().unwrap();
        // Only makes it slow: whatever the pause, the result must be that of the whole file.
        std::thread::sleep(Duration::from_millis(100));
    }
    project.write("scans/renamed.ply.part", &tiny_scan(2));
    running.wait_for_lines(1);
    assert!(!project.has("results/renamed.json") && !project.has("results/renamed.ply.json"));
    std::fs::rename(project.path("scans/renamed.ply.part"), project.path("scans/renamed.ply")).unwrap();
    running.wait_for_lines(2);
    let lines = stop(running, &project);
    assert!(lines.len() == 2 && lines[0].starts_with("slow.ply\t") && lines[1].starts_with("renamed.ply\t"));
    assert_whole(&project, "results/slow.json", &scan);
    assert_eq!(project.results(), 2);
}

#[test]
fn a_file_cut_off_waits_in_sight_and_is_inspected_when_whole() {
    let project = Project::new();
    let scan = tiny_scan(1);
    // Refused by an ordinary run, which has no time to wait: the watch still waits for the rest.
    project.write("scans/cut.ply", &scan[..scan.len() - 7]);
    project.run(["run", "demo.toml"]).assert_ended(2, &[]);
    project.write("scans/new.ply", &scan[..scan.len() - 9]);
    project.write("scans/nothing.ply", b"");
    let mut running = watch(&project);
    for name in ["cut.ply", "new.ply", "nothing.ply"] {
        running.wait_for_words(&["warning: ", name]);
    }
    running.wait_for_words(&["waiting for the rest"]);
    assert!(running.out().is_empty() && !project.has("results/new.json") && !project.has("results/nothing.json"));
    project.write("scans/cut.ply", &scan);
    running.wait_for_lines(1);
    let lines = stop(running, &project);
    assert!(lines.len() == 1 && lines[0].starts_with("cut.ply\t"), "{lines:?}");
    assert_whole(&project, "results/cut.json", &scan);
    assert_eq!(project.results(), 1);
}

#[test]
fn the_same_content_is_inspected_once_and_refused_as_another_part() {
    let project = Project::new();
    let mut running = watch(&project);
    project.write("scans/1.ply", &tiny_scan(1));
    running.wait_for_lines(1);
    project.write("scans/copy.ply", &tiny_scan(1));
    // A scanner that delivers its buffer again has measured nothing.
    running.wait_for_lines(2);
    let refused = project.json("results/copy.json");
    assert_eq!(refused["status"], "refused");
    assert!(refused.to_string().contains("not measured: the scan has the same content as 1.ply"), "{refused}");
    let first = stop(running, &project);
    let before = project.files("results");
    let mut running = watch(&project);
    running.wait_for_words(&["1.ply was inspected before as 1.ply"]);
    running.wait_for_words(&["copy.ply was inspected before as 1.ply"]);
    assert!(project.files("results") == before, "nothing was written again");
    // The stem is taken by a scan of the earlier run.
    project.write("scans/1.xyz", b"no pattern matches it");
    project.write("scans/2.ply", &tiny_scan(2));
    running.wait_for_lines(1);
    let second = stop(running, &project);
    assert_eq!((first.len(), second.len(), project.results()), (2, 1, 3));
    // Another plan is another question: everything is inspected again, each content once.
    project.change_plan(&[("upper_mm = 0.5", "upper_mm = 0.6")]);
    let mut running = watch(&project);
    running.wait_for_lines(3);
    stop(running, &project);
    assert!(project.json("results/copy.json").to_string().contains("the same content as 1.ply"));
}

#[test]
fn a_scan_delivered_again_under_its_own_name_keeps_its_result_and_is_told() {
    let project = Project::new();
    let mut running = watch(&project);
    project.write("scans/1.ply", &tiny_scan(1));
    running.wait_for_lines(1);
    let before = project.json("results/1.json");
    let file = std::fs::File::options().append(true).open(project.path("scans/1.ply")).unwrap();
    file.set_modified(std::time::SystemTime::now() + Duration::from_secs(5)).unwrap();
    running.wait_for_words(&["not measured: the scan has the same content as 1.ply"]);
    let lines = stop(running, &project);
    assert_eq!((lines.len(), project.results()), (1, 1));
    assert_eq!(project.json("results/1.json"), before);
}

#[test]
fn a_watch_goes_on_by_the_plan_that_lies_on_the_disk() {
    let project = Project::new();
    let mut running = watch(&project);
    project.write("scans/1.ply", &tiny_scan(1));
    running.wait_for_lines(1);
    let plan = project.read("demo.toml");
    let before = project.json("results/1.json")["plan"]["sha256"].clone();
    assert!(before.is_string());
    std::fs::remove_file(project.path("demo.toml")).unwrap();
    running.wait_for_words(&["trying again until the plan can be used"]);
    // No scan is begun meanwhile.
    project.write("scans/2.ply", &tiny_scan(2));
    project.write("demo.toml", &plan);
    running.wait_for_words(&["the plan is back"]);
    running.wait_for_lines(2);
    project.change_plan(&[("upper_mm = 0.5", "upper_mm = 0.6")]);
    running.wait_for_words(&["the plan on the disk has changed"]);
    running.wait_for_lines(4);
    stop(running, &project);
    assert_ne!(project.json("results/1.json")["plan"]["sha256"], before);
}

#[test]
fn a_folder_that_vanishes_is_waited_for() {
    let project = Project::new();
    project.write("scans/1.ply", &tiny_scan(1));
    let mut running = watch(&project);
    running.wait_for_lines(1);
    std::fs::rename(project.path("scans"), project.path("away")).unwrap();
    running.wait_for_words(&["trying again until it is back"]);
    std::fs::rename(project.path("away"), project.path("scans")).unwrap();
    running.wait_for_words(&["the scan folder is back"]);
    project.write("scans/2.ply", &tiny_scan(2));
    running.wait_for_lines(2);
    let lines = stop(running, &project);
    assert!(lines.len() == 2 && lines[1].starts_with("2.ply\t"), "{lines:?}");
}

#[test]
fn results_that_cannot_be_written_are_tried_again_and_none_is_lost() {
    let project = Project::new();
    project.change_plan(&[("folder = \"results\"", "folder = \"share/results\"")]);
    project.write("scans/1.ply", &tiny_scan(1));
    let mut running = watch(&project);
    running.wait_for_lines(1);
    // With the folder around it gone the disk is away: it is waited for, and nothing is made in its place.
    std::fs::rename(project.path("share"), project.path("away")).unwrap();
    project.write("scans/2.ply", &tiny_scan(2));
    running.wait_for_words(&["no scan is lost"]);
    std::fs::rename(project.path("away"), project.path("share")).unwrap();
    running.wait_for_lines(2);
    running.wait_for_words(&["results can be written again"]);
    let lines = stop(running, &project);
    assert_eq!((lines.len(), project.results_in("share/results")), (2, 2));
    project.assert_verified("share/results");
}

#[test]
fn a_results_folder_that_somebody_removes_is_made_again() {
    let project = Project::new();
    project.write("scans/1.ply", &tiny_scan(1));
    let mut running = watch(&project);
    running.wait_for_lines(1);
    std::fs::remove_dir_all(project.path("results")).unwrap();
    project.write("scans/2.ply", &tiny_scan(2));
    running.wait_for_words(&["no scan is lost"]);
    running.wait_for_lines(2);
    running.wait_for_words(&["results can be written again"]);
    stop(running, &project);
    assert!(project.has("results/2.json") && project.has("results/sequence.csv"));
}

#[test]
fn two_runs_do_not_share_a_results_folder() {
    let project = Project::new();
    project.write("scans/1.ply", &tiny_scan(1));
    let mut running = watch(&project);
    running.wait_for_lines(1);
    project.run(["run", "demo.toml"]).assert_ended(2, &["another run", "--out"]);
    project.run(["run", "demo.toml", "--out", "other"]).assert_ended(2, &[]);
    assert!(project.has("other/1.json"));
    stop(running, &project);
}

#[test]
fn ctrl_c_ends_the_watch_after_the_running_part_and_a_restart_goes_on() {
    const SCANS: usize = 4;
    let project = Project::new();
    for k in 0..SCANS {
        // The same part each time, and another content: nobody reads a comment.
        let mut scan = super::project::real_scan();
        let header = b"ply\n".len();
        let format_end = header + scan[header..].iter().position(|b| *b == b'\n').unwrap() + 1;
        let comment = format!("comment number {k}\n");
        scan.splice(format_end..format_end, comment.into_bytes());
        project.write(&format!("scans/{k}.ply"), &scan);
    }
    let mut running = watch(&project);
    running.wait_for_lines(1);
    let first = stop(running, &project);
    assert!(first.len() < SCANS && first.len() == project.results(), "{first:?}");
    assert!(first.iter().all(|line| line.contains("\tpass\t")), "{first:?}");
    let mut running = watch(&project);
    running.wait_for_words(&["0.ply was inspected before as 0.ply"]);
    running.wait_for_lines(SCANS - first.len());
    let second = stop(running, &project);
    assert_eq!((first.len() + second.len(), project.results()), (SCANS, SCANS));
}
