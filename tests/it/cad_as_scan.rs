//! The CAD inspected as a part would pass, and no part was seen.

use super::project::Project;

/// The CAD lies perfectly on itself: in its own place it is left out, and a copy of it is refused.
#[test]
fn the_cad_is_never_a_scan() {
    let project = Project::new();
    project.change_plan(&[("\"bracket.stl\"", "\"scans/cad.stl\""), ("\"*.ply\"", "\"*.stl\"")]);
    let cad = project.read("bracket.stl");
    project.write("scans/cad.stl", &cad);
    project.run(["check", "demo.toml"]).assert_ended(1, &["takes cad.stl, too, which is the plan's CAD"]);
    project.run(["run", "demo.toml"]).assert_ended(2, &["no scan matches"]);
    project.write("scans/copy.stl", &cad);
    let ran = project.run(["run", "demo.toml"]);
    ran.assert_ended(2, &[]);
    let report = project.json("results/copy.json");
    assert_eq!((project.has("results/cad.json"), &report["status"]), (false, &"refused".into()));
    assert!(report["reason"].as_str().is_some_and(|why| why.contains("the content of the CAD file")), "{report}");
    // Named by hand, too.
    project.run(["run", "demo.toml", "scans/cad.stl"]).assert_ended(2, &[]);
    assert_eq!(project.json("results/cad.json")["status"], "refused");
}
