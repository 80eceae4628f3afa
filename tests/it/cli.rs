//! The real program from the command line: what it says, what it writes, how it ends.

use super::project::{Project, Running, demo_file, demo_files, files_of, run_in, tiny_scan};
use std::path::Path;

fn status_of(result: &serde_json::Value) -> &str {
    result["status"].as_str().expect("a status")
}

#[test]
fn a_good_part_ends_with_0_and_says_one_line() {
    let project = Project::new();
    project.add_real_scan("01.ply");
    let ran = project.run(["run", "demo.toml", "--quiet"]);
    ran.assert_ended(0, &[]);
    assert_eq!(ran.stderr, "", "quiet");
    assert!(ran.lines().len() == 1 && ran.stdout.starts_with("01.ply\tpass\t"), "{ran:?}");
    let files: Vec<String> = project.files("results").into_keys().collect();
    assert_eq!(files, ["01.json", "01.txt", "manifest.sha256", "sequence.csv"]);
    project.assert_verified("results");
}

#[test]
fn a_part_out_of_tolerance_ends_with_1() {
    let project = Project::new();
    // A good part is not half a millimetre high at its first point.
    project.change_plan(&[("lower_mm = -0.5\nupper_mm = 0.5", "lower_mm = 0.45\nupper_mm = 0.5")]);
    project.add_real_scan("01.ply");
    let ran = project.run(["run", "demo.toml", "--out", "elsewhere"]);
    ran.assert_ended(1, &[]);
    assert_eq!(project.json("elsewhere/01.json")["verdict"], "fail");
    assert!(!project.has("results"));
    assert!(!ran.stderr.contains("part 1 of 1"), "a bar without a terminal: {ran:?}");
}

#[test]
fn a_sequence_goes_on_after_scans_that_fail() {
    let project = Project::new();
    let whole = tiny_scan(1);
    project.write("scans/1_cut.ply", &whole[..whole.len() - 5]);
    project.write("scans/2_empty.ply", b"");
    project.write("scans/3_noise.ply", b"\x00\xff\x13no scan\n\n");
    std::fs::create_dir(project.path("scans/4_folder.ply")).unwrap();
    project.add_real_scan("5.ply");
    let scans = ["scans/1_cut.ply", "scans/2_empty.ply", "scans/3_noise.ply", "scans/4_folder.ply", "no/6.ply"];
    let ran = project.run(["run", "demo.toml"].iter().chain(&scans).chain(&["scans/5.ply"]));
    ran.assert_ended(1, &[]);
    let names: Vec<&str> = ran.lines().iter().map(|line| line.split('\t').next().unwrap()).collect();
    assert_eq!(names, ["1_cut.ply", "2_empty.ply", "3_noise.ply", "4_folder.ply", "6.ply", "5.ply"]);
    for name in ["1_cut", "2_empty", "3_noise", "4_folder", "6"] {
        let result = project.json(&format!("results/{name}.json"));
        assert_eq!(status_of(&result), "refused", "{name}");
        let said = |key: &str| result[key].as_str().is_some_and(|words| !words.is_empty());
        assert!(said("reason") && said("help"), "{result}");
        assert!(project.has(&format!("results/{name}.txt")));
    }
    assert_eq!(status_of(&project.json("results/5.json")), "measured");
    let table = String::from_utf8(project.read("results/sequence.csv")).unwrap();
    assert_eq!(table.lines().count(), 7, "{table}");
    project.assert_verified("results");
}

#[test]
fn nothing_to_inspect_ends_with_2_and_says_why() {
    let project = Project::new();
    project.run(["run", "demo.toml"]).assert_ended(2, &["no scan matches \"*.ply\"", "help: "]);
    project.run(["run", "none.toml"]).assert_ended(2, &["none.toml", "help: "]);
    project.write("scans/1.ply", &tiny_scan(1));
    let all_refused = project.run(["run", "demo.toml"]);
    all_refused.assert_ended(2, &[]);
    assert_eq!(all_refused.lines().len(), 1);
    // Below a regular file no folder can be made, not even by root.
    project.run(["run", "demo.toml", "--out", "demo.toml/results"]).assert_ended(2, &["results folder", "--out"]);
    project.run(["run", "demo.toml", "--timings", "none/t.jsonl"]).assert_ended(2, &["timings", "--timings"]);
    project.run(["run", "demo.toml", "--settle=-1"]).assert_ended(2, &["0 to 86400"]);
    std::fs::rename(project.path("scans"), project.path("away")).unwrap();
    project.run(["run", "demo.toml"]).assert_ended(2, &["scan folder", "[scans] folder"]);
    std::fs::remove_file(project.path("bracket.stl")).unwrap();
    project.run(["run", "demo.toml"]).assert_ended(2, &["demo.toml:", "bracket.stl"]);
}

#[test]
fn all_problems_of_a_plan_are_told_at_once() {
    let project = Project::new();
    let check = project.run(["check", "demo.toml"]);
    assert!(check.code == Some(0) && check.stdout.contains("no problems"), "{check:?}");
    project.change_plan(&[
        ("thickness_mm = 1.2", "thickness_mm = -1.2"),
        ("[background]\n", "[background]\nbelt_plain = true\n"),
        ("upper_mm = 0.5", "upper_mm = -0.6"),
        ("name = \"P05\"", "name = \"P04\""),
    ]);
    let words = ["thickness_mm", "belt_plain", "belt_plane", "upper_mm", "demo.toml:"];
    let check = project.run(["check", "demo.toml"]);
    check.assert_ended(2, &words);
    assert!(check.stdout.contains("errors"), "{check:?}");
    let run = project.run(["run", "demo.toml"]);
    run.assert_ended(2, &words);
    assert!(run.stdout.is_empty() && !project.has("results"), "{run:?}");
}

#[test]
fn a_plan_with_warnings_only_ends_check_with_1() {
    let project = Project::new();
    project.change_plan(&[
        ("name = \"P05\"", "name = \"P04\""),
        // Far above the CAD, and a direction far from its normal.
        ("position = [-14.9999, 20.0, 4.3699]", "position = [-14.9999, 20.0, 14.0]"),
        ("direction = [-0.045446277, 0.048043207, 0.997810847]", "direction = [1.0, 0.0, 0.0]"),
    ]);
    let check = project.run(["check", "demo.toml"]);
    check.assert_ended(1, &["warning: ", "P04", "P01", "P02", "mm"]);
    assert!(check.stdout.contains("3 warnings"), "{check:?}");
}

#[test]
fn check_expected_tells_u_at_every_point_and_what_other_datums_cost() {
    let project = Project::new();
    let plain = project.run(["check", "demo.toml"]);
    let told = project.run(["check", "demo.toml", "--expected"]);
    assert_eq!((plain.code, told.code), (Some(0), Some(0)), "{told:?}");
    let lines: Vec<&str> = told.stdout.lines().collect();
    let points = (1..=10).map(|k| format!("P{k:02}")).filter(|name| lines.iter().any(|l| l.starts_with(name))).count();
    assert_eq!(points, 10, "{}", told.stdout);
    for words in ["mm between points", "U / half tolerance", "(this plan)", "slot_reading = \"axis\"", "best_fit"] {
        assert!(told.stdout.contains(words), "{words}: {}", told.stdout);
    }
    let share = |line: &&str| line.strip_suffix(" %").and_then(|l| l.rsplit(' ').next()).and_then(|n| n.parse().ok());
    let shares: Vec<f64> = lines.iter().filter_map(share).collect();
    assert!(shares.len() > 10 && shares.is_sorted_by(|a, b| a >= b), "{shares:?}");
    assert_eq!(lines.last(), Some(&"no problems"));
    project.change_plan(&[("upper_mm = 0.5", "upper_mm = -0.6")]);
    project.run(["check", "demo.toml", "--expected"]).assert_ended(2, &["upper_mm"]);
}

/// Whatever is wrong with one part of a plan, the others are looked at, also against the CAD.
#[test]
fn a_dozen_problems_of_all_sorts_are_told_at_once_in_order() {
    let project = Project::new();
    project.write("results", b"a file");
    project.change_plan(&[
        ("revision = \"C\"", "revison = \"C\""),
        ("unit = \"mm\"\norder", "unit = \"mn\"\norder"),
        ("slot = \"S1\"", "slot = \"S1\"\nslot_reading = \"axis\""),
        ("diameter_mm = 16.0", "diameter_mm = 21.0"),
        ("length_mm = 30.0", "length_mm = 36.0"),
        ("lower_mm = -0.5\nupper_mm = 0.5", "lower_mm = -1e-9\nupper_mm = 1e-9"),
        ("position = [-29.9999, 44.9999, 2.6337]", "position = [-29.9999, 44.9999, 6.6337]"),
        ("direction = [0.184615335, 0.088179379, 0.978847064]", "direction = [0.9, 0.1, 0.42]"),
        ("name = \"P05\"", "name = \"P04\""),
        ("position = [-60.0, -5.0, 1.6897]", "position = [-60.0, -5.0]"),
        (
            "direction = [-0.025296386, -0.044832555, 0.998674189]",
            "direction = [0.025296386, 0.044832555, -0.998674189]",
        ),
        ("map_range_mm = 1.0", "map_range_mm = 0.0"),
    ]);
    let check = project.run(["check", "demo.toml"]);
    let told = [
        "unknown key \"revison\"",
        "[scans] unit: found text \"mn\"",
        "[alignment] slot_reading: the axis of slot \"S1\"",
        "[[feature]] \"H1\" diameter_mm: is 21",
        "[[feature]] \"S1\" length_mm: is 36",
        "[[comparison]] \"P01\" lower_mm: the tolerance is 2",
        "[[comparison]] \"P02\" position: is 3.9",
        "[[comparison]] \"P03\" direction: is ",
        "[[comparison]] name: found \"P04\" again",
        "[[comparison]] \"P06\" position: found 2 numbers",
        "[[comparison]] \"P07\" direction: points against",
        "[output] folder: found",
        "[output] map_range_mm: found 0",
    ];
    check.assert_ended(2, &told);
    let mut last = 0;
    for words in told {
        let line = check.stderr.lines().find(|line| line.contains(words)).expect("asserted above");
        let number = line.split("demo.toml:").nth(1).and_then(|rest| rest.split(':').next()?.parse::<usize>().ok());
        let number = number.unwrap_or_else(|| panic!("no line: {line}"));
        assert!(number >= last, "{}", check.stderr);
        last = number;
    }
    let problems = check.stderr.lines().filter(|line| line.starts_with("error: ") || line.starts_with("warning: "));
    let helps = check.stderr.lines().filter(|line| line.starts_with("help: "));
    // By the slot's axis some points can be told to a millimetre only; that comes on top.
    let unjudged: Vec<&str> = check.stderr.lines().filter(|line| line.contains("U (k = 2) is expected")).collect();
    assert!(
        unjudged.len() == 1 && unjudged[0].contains("due to the datums") && unjudged[0].contains("P09"),
        "{unjudged:?}"
    );
    let all = told.len() + 1;
    assert_eq!((problems.count(), helps.count()), (all, all), "{}", check.stderr);
}

#[test]
fn odd_results_folders_are_told_before_a_run() {
    let project = Project::new();
    project.write("a_file", b"in the way");
    let folder = "folder = \"results\"";
    for (changed, code, words) in [
        ("folder = \"a_file\"", 2, "which is a file, expected a folder"),
        ("folder = \"a_file/results\"", 2, "cannot be written"),
        ("folder = \"scans\"", 0, "no problems"),
        ("folder = \"scans\"\nformats = [\"ply\"]", 1, "results would lie among the scans"),
    ] {
        let other = Project::new();
        other.write("a_file", b"in the way");
        other.change_plan(&[(folder, changed)]);
        if changed.contains("formats") {
            other.change_plan(&[("formats = [\"ascii\", \"json\"]", "")]);
        }
        let check = other.run(["check", "demo.toml"]);
        assert_eq!(check.code, Some(code), "{check:?}");
        assert!(check.stderr.contains(words) || check.stdout.contains(words), "{check:?}");
        assert!(code == 0 || check.stderr.contains("demo.toml:"), "{check:?}");
    }
    assert_eq!(project.files("scans").len(), 0);
}

#[test]
fn verify_tells_what_changed() {
    let project = Project::new();
    project.write("scans/1.ply", &tiny_scan(1));
    project.write("scans/2.ply", &tiny_scan(2));
    project.run(["run", "demo.toml"]).assert_ended(2, &[]);
    project.assert_verified("results");
    project.write("results/1.txt", b"in tolerance");
    std::fs::remove_file(project.path("results/2.json")).unwrap();
    project.write("results/3.json", b"{}");
    let verified = project.run(["verify", "results"]);
    verified.assert_ended(1, &["1.txt: was changed", "2.json: is in the manifest but not", "3.json: is not in the"]);
    assert_eq!(verified.lines(), ["3 problems, 3 files as written"]);
    project.run(["verify", "scans"]).assert_ended(2, &["manifest.sha256"]);
    project.run(["verify", "nowhere"]).assert_ended(2, &["no such folder"]);
}

#[test]
fn the_cache_is_used_when_good_and_rebuilt_when_not() {
    let project = Project::new();
    let prepare = |word: &str| {
        let ran = project.run(["prepare", "demo.toml"]);
        ran.assert_ended(0, &[]);
        assert!(ran.stdout.starts_with(word), "{ran:?}");
    };
    prepare("prepared");
    prepare("up to date");
    let cache = "bracket.stl.shapeline-cache";
    let good = project.read(cache);
    let mut flipped = good.clone();
    flipped[good.len() / 2] ^= 0x10;
    project.write(cache, &flipped);
    prepare("prepared");
    assert!(project.read(cache) == good, "the cache is the same again");
    project.write(cache, &good[..good.len() / 3]);
    prepare("prepared");
    prepare("up to date");
    project.write("bracket.stl", b"solid nothing\nendsolid\n");
    project.run(["prepare", "demo.toml"]).assert_ended(2, &["bracket.stl"]);
}

#[test]
fn the_same_scan_gives_the_same_bytes_wherever_and_however_it_is_run() {
    let project = Project::new();
    project.change_plan(&[("\"ascii\", \"json\"", "\"ascii\", \"json\", \"pdf\", \"csv\", \"ply\"")]);
    project.add_real_scan("01.ply");
    let tiny = tiny_scan(1);
    project.write("scans/02.ply", &tiny[..tiny.len() - 1]);
    let root = project.root();
    // Relative path, one thread.
    project.run(["--threads", "1", "run", "demo.toml"]).assert_ended(1, &[]);
    let first = project.files("results");
    let names: Vec<&str> = first.keys().map(String::as_str).collect();
    let both = ["01.csv", "01.json", "01.pdf", "01.ply", "01.txt", "02.csv", "02.json", "02.pdf", "02.txt"];
    assert_eq!(names, [&both[..], &["manifest.sha256", "sequence.csv"]].concat());
    // Again into the same folder, from elsewhere, two threads, with timings.
    let elsewhere = tempfile::tempdir().unwrap();
    let plan = root.join("demo.toml");
    let arguments = ["run", plan.to_str().unwrap(), "--threads", "2", "--timings", "t.jsonl"];
    run_in(elsewhere.path(), arguments).assert_ended(1, &[]);
    assert_same(&first, &project.files("results"));
    // The project's copy in another place, the plan by a crooked path, scans by name in another order of the results.
    let copy = elsewhere.path().join("a copy");
    copy_folder(root, &copy);
    std::fs::remove_dir_all(copy.join("results")).unwrap();
    let scans = ["../a copy/scans/01.ply", "scans/02.ply"];
    let arguments = ["run", "../a copy/demo.toml", scans[0], scans[1], "--out", "deep/er", "--threads", "2"];
    run_in(&copy, arguments).assert_ended(1, &[]);
    assert_same(&first, &files_of(&copy.join("deep/er")));
}

#[track_caller]
fn assert_same(a: &std::collections::BTreeMap<String, Vec<u8>>, b: &std::collections::BTreeMap<String, Vec<u8>>) {
    assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>());
    for (name, bytes) in a {
        assert!(*bytes == b[name], "{name} differs");
    }
}

fn copy_folder(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap().flatten() {
        let target = to.join(entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            copy_folder(&entry.path(), &target);
        } else {
            std::fs::copy(entry.path(), target).unwrap();
        }
    }
}

#[test]
fn timings_are_appended_and_stand_nowhere_else() {
    let project = Project::new();
    project.write("scans/1.ply", &tiny_scan(1));
    project.write("scans/2.ply", &tiny_scan(2));
    for _ in 0..2 {
        project.run(["run", "demo.toml", "--timings", "t.jsonl"]).assert_ended(2, &[]);
    }
    let text = String::from_utf8(project.read("t.jsonl")).unwrap();
    let lines: Vec<serde_json::Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let scans: Vec<&str> = lines.iter().map(|line| line["scan"].as_str().unwrap()).collect();
    assert_eq!(scans, ["1.ply", "2.ply", "1.ply", "2.ply"]);
    let keys = ["read", "hash", "background", "best_fit", "features", "comparison", "map", "report", "total"];
    for (k, line) in lines.iter().enumerate() {
        let milliseconds = |key: &str| line[key].as_f64().unwrap_or_else(|| panic!("{key} in {line}"));
        let sum: f64 = keys[..8].iter().map(|key| milliseconds(key)).sum();
        // Each figure is rounded to a thousandth.
        assert!(sum <= milliseconds("total") + 0.01, "{line}");
        assert_eq!(line.get("prepare").is_some(), k % 2 == 0, "once a run: {line}");
    }
}

#[test]
fn scans_of_one_name_do_not_share_a_result() {
    let project = Project::new();
    std::fs::create_dir(project.path("other")).unwrap();
    project.write("scans/1.ply", &tiny_scan(1));
    project.write("other/1.ply", &tiny_scan(2));
    project.write("scans/sequence.ply", &tiny_scan(3));
    let run = || {
        let arguments = ["run", "demo.toml", "scans/1.ply", "other/1.ply", "./scans/1.ply", "scans/sequence.ply"];
        project.run(arguments).assert_ended(2, &[]);
        project.files("results")
    };
    let first = run();
    let names: Vec<&str> = first.keys().map(String::as_str).filter(|name| name.ends_with(".json")).collect();
    assert_eq!(names, ["1.json", "1.ply.json", "sequence.ply.json"]);
    let table = String::from_utf8(first["sequence.csv"].clone()).unwrap();
    let results: Vec<&str> = table.lines().map(|line| line.split(',').nth(1).unwrap()).collect();
    assert_eq!(results, ["result", "1", "1.ply", "sequence.ply"]);
    assert_ne!(project.json("results/1.json")["scan"], project.json("results/1.ply.json")["scan"]);
    assert_same(&first, &run());
}

#[test]
fn a_scan_name_used_again_keeps_the_earlier_result() {
    let project = Project::new();
    project.change_plan(&[("\"ascii\", \"json\"", "\"json\", \"csv\"")]);
    project.add_real_scan("1.ply");
    project.run(["run", "demo.toml"]).assert_ended(0, &[]);
    let first = project.files("results");
    project.write("scans/1.ply", &tiny_scan(1));
    let aside = ["warning: ", "scans/1.ply", "kept as \"1 (earlier 1)\""];
    project.run(["run", "demo.toml"]).assert_ended(2, &aside);
    // The name that everybody reads is that of the scan that lies there now.
    assert_eq!(status_of(&project.json("results/1.json")), "refused");
    project.assert_verified("results");
    let kept = |project: &Project| {
        let files = project.files("results");
        for kind in ["json", "csv"] {
            assert_eq!(files[&format!("1 (earlier 1).{kind}")], first[&format!("1.{kind}")], "{kind}");
        }
        let table = String::from_utf8(files["sequence.csv"].clone()).unwrap();
        assert_eq!(table.lines().count(), 3, "{table}");
        assert!(table.contains("1.ply,1 (earlier 1),,measured"), "{table}");
    };
    kept(&project);
    // The part comes back under its name: its result stands twice, a refusal is not kept.
    project.add_real_scan("1.ply");
    let ran = project.run(["run", "demo.toml"]);
    ran.assert_ended(0, &[]);
    assert!(!ran.stderr.contains("warning"), "{ran:?}");
    assert_eq!(project.read("results/1.json"), first["1.json"]);
    kept(&project);
    project.assert_verified("results");
}

#[test]
#[cfg(unix)]
fn a_part_whose_results_are_too_large_fails_and_the_next_is_tried() {
    let project = Project::new();
    project.change_plan(&[("\"ascii\", \"json\"", "\"json\", \"ply\"")]);
    project.add_real_scan("1.ply");
    project.write("scans/2.ply", &tiny_scan(2));
    // 100 blocks of 512 or 1024 bytes: room for the JSON of a scan, not for its points.
    let limited = format!("ulimit -f 100; exec {} run demo.toml", env!("CARGO_BIN_EXE_shapeline"));
    let output = std::process::Command::new("sh").args(["-c", &limited]).current_dir(project.root()).output().unwrap();
    let words = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{words}");
    assert!(words.contains("results of 1.ply") && words.contains("larger than"), "{words}");
    let names: Vec<String> = project.files("results").into_keys().collect();
    assert_eq!(names, ["2.json", "manifest.sha256", "sequence.csv"], "{words}");
    project.assert_verified("results");
    project.run(["run", "demo.toml"]).assert_ended(1, &[]);
    assert_eq!(project.results(), 2);
}

#[test]
fn results_among_the_scans_are_no_scans_and_replace_none() {
    let project = Project::new();
    project.change_plan(&[("\"ascii\", \"json\"", "\"ply\""), ("folder = \"results\"", "folder = \"scans\"")]);
    project.add_real_scan("01.ply");
    let scan = project.read("scans/01.ply");
    for _ in 0..2 {
        let ran = project.run(["run", "demo.toml"]);
        ran.assert_ended(0, &[]);
        assert_eq!(ran.lines().len(), 1, "{ran:?}");
        assert!(project.read("scans/01.ply") == scan, "the scan is as it was");
        let names: Vec<String> = project.files("scans").into_keys().collect();
        assert_eq!(names, ["01.ply", "01.ply.json", "01.ply.ply", "manifest.sha256", "sequence.csv"]);
    }
}

#[test]
fn a_damaged_table_is_kept_and_does_not_stop_production() {
    let project = Project::new();
    project.write("scans/1.ply", &tiny_scan(1));
    project.run(["run", "demo.toml"]).assert_ended(2, &[]);
    project.write("results/sequence.csv", b"scan\n1.ply,what?\n");
    project.write("results/manifest.sha256", b"123  1.json\n");
    let ran = project.run(["run", "demo.toml"]);
    ran.assert_ended(2, &["warning: ", "sequence.csv.damaged", "manifest.sha256.damaged"]);
    assert_eq!(ran.lines().len(), 1);
    assert_eq!(project.read("results/sequence.csv.damaged"), b"scan\n1.ply,what?\n");
    project.assert_verified("results");
}

#[test]
fn ctrl_c_ends_after_the_running_part_with_whole_files() {
    let project = Project::new();
    for k in 0..8 {
        project.add_real_scan(&format!("{k}.ply"));
    }
    let mut running = Running::start(project.root(), ["run", "demo.toml"]);
    running.wait_for_lines(1);
    running.interrupt();
    let ran = running.end();
    ran.assert_ended(130, &["stopping after this part"]);
    assert_eq!(ran.lines().len(), project.results());
    assert!(project.results() < 8, "{ran:?}");
    project.assert_verified("results");
}

#[test]
fn a_killed_run_leaves_whole_files_and_a_manifest_that_fits() {
    const SCANS: u32 = 60;
    let project = Project::new();
    for k in 0..SCANS {
        project.write(&format!("scans/{k:02}.ply"), &tiny_scan(k));
    }
    for lines in [1, 4, 9, 17, 30] {
        let mut running = Running::start(project.root(), ["run", "demo.toml"]);
        running.wait_for_lines(lines);
        running.kill();
        for (name, bytes) in project.files("results").iter().filter(|(name, _)| name.ends_with(".json")) {
            let result: serde_json::Value = serde_json::from_slice(bytes).unwrap_or_else(|e| panic!("{name}: {e}"));
            assert_eq!(status_of(&result), "refused");
        }
        project.assert_verified("results");
    }
    let ran = project.run(["run", "demo.toml"]);
    ran.assert_ended(2, &[]);
    assert_eq!((ran.lines().len(), project.results()), (SCANS as usize, SCANS as usize));
    let verified = project.run(["verify", "results"]);
    assert!(verified.code == Some(0) && verified.stderr.is_empty(), "{verified:?}");
    let leftover = project.files("results").into_keys().find(|name| name.starts_with('.'));
    assert_eq!(leftover, None);
}

#[test]
fn shapes_are_fitted_from_files_of_points() {
    let project = Project::new();
    type Case = (&'static str, Vec<[f64; 3]>, &'static [&'static str]);
    let mut cases: Vec<Case> = Vec::new();
    let turn = |k: usize| (k as f64 * 2.4).sin_cos();
    let round = |radius: &dyn Fn(usize) -> f64, height: &dyn Fn(usize) -> f64| {
        (0..40).map(|k| [1.0 + radius(k) * turn(k).1, 2.0 + radius(k) * turn(k).0, height(k)]).collect::<Vec<_>>()
    };
    let (five, rising) = (|_: usize| 5.0, |k: usize| 0.5 * k as f64);
    cases.push(("line", (0..10).map(|k| [k as f64, 2.0 * k as f64, 3.0]).collect(), &["point", "direction"]));
    cases.push(("plane", round(&|k| k as f64, &|_| 3.0), &["point", "normal"]));
    cases.push(("circle", round(&five, &|_| 3.0), &["centre", "axis", "diameter"]));
    let ball = |k: usize| 5.0 * (0.07 * k as f64 - 1.4).cos();
    cases.push(("sphere", round(&ball, &|k| 5.0 * (0.07 * k as f64 - 1.4).sin()), &["centre", "diameter"]));
    cases.push(("cylinder", round(&five, &rising), &["point", "axis", "diameter"]));
    let cone = |k: usize| 4.0 + 0.25 * rising(k);
    cases.push(("cone", round(&cone, &rising), &["point", "direction", "diameter", "apex_angle_deg"]));
    for (kind, points, keys) in cases {
        let text: String = points.iter().map(|[x, y, z]| format!("{x:.12} {y:.12} {z:.12}\n")).collect();
        project.write("points.xyz", text.as_bytes());
        let ran = project.run(["fit", kind, "points.xyz"]);
        ran.assert_ended(0, &[]);
        assert_eq!(ran.lines().len(), 1);
        let fit: serde_json::Value = serde_json::from_str(&ran.stdout).unwrap();
        assert_eq!((&fit["file"], &fit["kind"]), (&"points.xyz".into(), &kind.into()));
        assert_eq!((fit["points"].as_u64(), fit["rejected"].as_u64()), (Some(points.len() as u64), Some(0)));
        for key in keys.iter().chain(&["rms", "sigma", "condition"]) {
            assert!(fit.get(key).is_some(), "{kind}: no {key} in {fit}");
        }
        // Exact points, written with twelve digits.
        assert!(fit["rms"].as_f64().unwrap() < 1e-9, "{fit}");
        if keys.contains(&"diameter") && kind != "cone" {
            assert!((fit["diameter"].as_f64().unwrap() - 10.0).abs() < 1e-6, "{fit}");
        }
        if kind == "cone" {
            let angle = 2.0 * 0.25f64.atan().to_degrees();
            assert!((fit["apex_angle_deg"].as_f64().unwrap() - angle).abs() < 1e-6, "{fit}");
            assert!(fit["direction"][2].as_f64().unwrap() > 0.0, "points to the growing radius: {fit}");
        }
    }
    project.write("bad.xyz", b"1 2 three\n");
    let ran = project.run(["fit", "cone", "bad.xyz", "points.xyz", "none.xyz"]);
    ran.assert_ended(1, &["bad.xyz:1:", "none.xyz"]);
    assert_eq!(ran.lines().len(), 1);
    project.run(["fit", "line", "none.xyz"]).assert_ended(2, &["none.xyz"]);
    project.run(["fit", "line", "points.xyz", "--plane", "x=1"]).assert_ended(2, &["circles only"]);
    project
        .run(["fit", "plane", "points.xyz", "--radius", "5"])
        .assert_ended(2, &["circles, spheres and cylinders only"]);
    project.run(["fit", "sphere", "points.xyz", "--radius=0"]).assert_ended(2, &["above 0"]);
    project.run(["fit", "blob", "points.xyz"]).assert_ended(2, &["blob"]);
    project.run(["fit", "circle", "points.xyz", "--robust", "--three-sigma"]).assert_ended(2, &[]);
}

#[test]
fn simulated_scans_come_from_their_seed() {
    let project = Project::new();
    // A sixteenth of the points is enough here.
    project.change_plan(&[("resolution_level = 2\npoint_spacing_mm = 0.6", "resolution_level = 8")]);
    let simulate = |out: &str, seed: &str| {
        let arguments = ["simulate", "demo.toml", "--out", out, "--count", "2", "--seed", seed];
        let ran = project.run(arguments);
        ran.assert_ended(0, &[]);
        assert_eq!(ran.lines().len(), 2, "{ran:?}");
        project.files(out)
    };
    let (first, again, other) = (simulate("a", "7"), simulate("b", "7"), simulate("c", "8"));
    let names: Vec<&str> = first.keys().map(String::as_str).collect();
    assert_eq!(names, ["sim_0001.ply", "sim_0001.truth.json", "sim_0002.ply", "sim_0002.truth.json"]);
    assert_same(&first, &again);
    assert!(first["sim_0001.ply"] != other["sim_0001.ply"] && first["sim_0001.ply"] != first["sim_0002.ply"]);
    assert!(serde_json::from_slice::<serde_json::Value>(&first["sim_0001.truth.json"]).unwrap().is_object());
    project.run(["simulate", "demo.toml", "--out", "demo.toml/a"]).assert_ended(2, &["--out"]);
}

#[test]
fn the_demo_runs_names_files_that_exist_and_leaves_changes_alone() {
    let folder = tempfile::tempdir().unwrap();
    // As if it had been begun before: files that are the demo's own do not hinder it.
    std::fs::create_dir(folder.path().join("show")).unwrap();
    std::fs::write(folder.path().join("show/bracket.stl"), demo_file("bracket.stl")).unwrap();
    let ran = run_in(folder.path(), ["demo", "show"]);
    ran.assert_ended(0, &[]);
    for (name, bytes) in demo_files() {
        assert!(std::fs::read(folder.path().join("show").join(name)).unwrap() == *bytes, "{name}");
    }
    let named: Vec<&str> = ran.stdout.split_whitespace().filter(|word| word.starts_with("show/")).collect();
    assert!(named.len() >= 3, "{ran:?}");
    for path in named {
        assert!(folder.path().join(path).exists(), "{path}");
    }
    // The scan that was refused is known by its content, and has its page.
    let refused: serde_json::Value =
        serde_json::from_slice(&std::fs::read(folder.path().join("show/results/05_cut_off.json")).unwrap()).unwrap();
    let sha256 = shapeline::io::sha256_hex(&demo_file("scans/05_cut_off.ply"));
    assert_eq!((status_of(&refused), refused["scan"]["sha256"].as_str()), ("refused", Some(sha256.as_str())));
    assert!(std::fs::read(folder.path().join("show/results/05_cut_off.pdf")).unwrap().starts_with(b"%PDF"));
    assert_eq!(run_in(folder.path(), ["verify", "show/results"]).code, Some(0));
    let plan = folder.path().join("show/demo.toml");
    std::fs::write(&plan, "mine").unwrap();
    run_in(folder.path(), ["demo", "show"]).assert_ended(2, &["show/demo.toml", "left as it is", "help: "]);
    assert_eq!(std::fs::read(&plan).unwrap(), b"mine");
}

#[test]
fn without_a_display_the_command_line_is_named_and_help_is_at_hand() {
    let folder = tempfile::tempdir().unwrap();
    // Built without the window it says so; with it, that there is no display.
    run_in(folder.path(), ["plan.toml"]).assert_ended(2, &["error: ", "window", "`shapeline run plan.toml`"]);
    let help = run_in(folder.path(), ["--help"]);
    help.assert_ended(0, &[]);
    for command in ["run", "check", "demo", "prepare", "simulate", "study", "merge", "mask-study", "fit", "verify"] {
        assert!(help.stdout.contains(command), "{command}");
    }
    run_in(folder.path(), ["run"]).assert_ended(2, &["PLAN"]);
    run_in(folder.path(), ["--threads", "many", "demo"]).assert_ended(2, &["many"]);
}

/// A slot in the place of the hole: no line runs between them, whether or not the plan asks for that line.
#[test]
fn a_slot_in_the_holes_place_keeps_nothing_for_ever() {
    let project = Project::new();
    project.write("scans/1.ply", &tiny_scan(1));
    let in_time = |arguments: &[&str]| Running::start(project.root(), arguments).end_in_time();
    project.change_plan(&[
        ("centre = [58.0, -50.0, 1.089]", "centre = [-52.0, 64.0, 1.0334]"),
        ("point = \"A1\"\n", "point = \"A1\"\nslot_reading = \"axis\"\n"),
    ]);
    let checked = in_time(&["check", "demo.toml", "--expected"]);
    // The slot is not the CAD's opening: a warning too.
    checked.assert_ended(1, &["slot_reading: the axis of slot \"S1\""]);
    assert!(!checked.stderr.contains("\"centre_line\" would be"), "{checked:?}");
    in_time(&["run", "demo.toml"]).assert_ended(2, &["slot_reading"]);
    let datums = "hole = \"H1\"\nslot = \"S1\"\npoint = \"A1\"\nslot_reading = \"axis\"\n";
    project.change_plan(&[("method = \"features\"", "method = \"best_fit\""), (datums, "")]);
    let checked = in_time(&["check", "demo.toml", "--expected"]);
    checked.assert_ended(1, &["length_mm"]);
    assert!(checked.stdout.contains("best_fit (this plan)"), "{checked:?}");
}
