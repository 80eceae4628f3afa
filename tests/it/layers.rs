//! Lower layers never import higher ones, and nothing below the worker prints, looks at a clock or starts a thread.

use std::fs;
use std::path::{Path, PathBuf};

/// Rooms from the lowest layer to the highest; a room may import rooms of lower layers and itself.
const LAYERS: &[&[&str]] = &[
    &["diagnostic", "run"],
    &["geometry"],
    &["fit"],
    &["io", "plan"],
    &["part", "scan"],
    &["simulate"],
    &["measure"],
    &["align"],
    &["inspect"],
    &["report"],
    &["worker"],
    &["demo"],
    &["cli"],
];

/// What `simulate` must not know, so that no estimator can be tuned to it.
const NOT_FOR_SIMULATE: &[&str] = &["fit", "scan"];

fn layer_of(room: &str) -> Option<usize> {
    LAYERS.iter().position(|layer| layer.contains(&room))
}

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("source folder").flatten() {
        let path = entry.path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

/// Source text without comments and without its tests, with the room it belongs to.
fn rooms() -> Vec<(String, PathBuf, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&root, &mut files);
    files.sort();
    files
        .into_iter()
        .map(|path| {
            let relative = path.strip_prefix(&root).expect("under src").to_path_buf();
            let first = relative.components().next().expect("a name").as_os_str().to_string_lossy().into_owned();
            let room = first.trim_end_matches(".rs").to_owned();
            let text = fs::read_to_string(&path).expect("source text");
            let code = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
            let code: Vec<&str> = code.lines().filter(|l| !l.trim_start().starts_with("//")).collect();
            (room, relative, code.join("\n"))
        })
        .collect()
}

/// Rooms named after `crate::`, also within braces: `use crate::{fit, io::read_file}`.
fn imported_rooms(code: &str) -> Vec<String> {
    let name = |text: &str| -> String { text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect() };
    let mut rooms = Vec::new();
    for (at, _) in code.match_indices("crate::") {
        let rest = &code[at + "crate::".len()..];
        match rest.strip_prefix('{') {
            None => rooms.push(name(rest)),
            Some(list) => {
                let mut depth = 0usize;
                let mut start = true;
                for (k, c) in list.char_indices() {
                    match c {
                        '{' => depth += 1,
                        '}' if depth == 0 => break,
                        '}' => depth -= 1,
                        ',' if depth == 0 => start = true,
                        c if start && !c.is_whitespace() => {
                            rooms.push(name(&list[k..]));
                            start = false;
                        }
                        _ => {}
                    }
                }
            }
        }
    }
    rooms
}

#[test]
fn lower_layers_never_import_higher_ones() {
    let mut faults = Vec::new();
    for (room, path, code) in rooms() {
        if room == "lib" || room == "main" {
            continue;
        }
        let own = layer_of(&room).unwrap_or_else(|| panic!("{room} has no layer in this test"));
        for import in imported_rooms(&code) {
            let allowed = match layer_of(&import) {
                None => true,
                Some(layer) => layer < own || import == room || (layer == 0 && own == 0),
            };
            let barred = room == "simulate" && NOT_FOR_SIMULATE.contains(&import.as_str());
            if !allowed || barred {
                faults.push(format!("{} imports {import}", path.display()));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn nothing_below_the_worker_prints_or_looks_at_a_clock_or_starts_a_thread() {
    let worker = layer_of("worker").expect("worker has a layer");
    let mut faults = Vec::new();
    for (room, path, code) in rooms() {
        if layer_of(&room).is_none_or(|layer| layer >= worker) {
            continue;
        }
        for word in ["println!", "eprintln!", "print!(", "Instant::now", "SystemTime::now", "thread::spawn", "mpsc::"] {
            if code.contains(word) {
                faults.push(format!("{} contains {word}", path.display()));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn only_the_window_names_window_crates() {
    for (room, path, code) in rooms() {
        for name in ["egui", "eframe", "three_d", "rfd"] {
            assert!(room == "gui" || !code.contains(&format!("{name}::")), "{} names {name}", path.display());
        }
    }
}

#[test]
fn braces_and_plain_paths_are_both_seen() {
    let code =
        "use crate::{fit::{self, a}, io::read, run::Stage};\nuse crate::geometry::Point3; let x = crate::align::f();";
    assert_eq!(imported_rooms(code), ["fit", "io", "run", "geometry", "align"]);
}
