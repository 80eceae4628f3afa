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
    &["inspect", "stitch"],
    &["report"],
    &["worker"],
    &["demo", "study"],
    &["gui"],
    &["cli"],
];

/// What `simulate` must not know, so that no estimator can be tuned to it.
const NOT_FOR_SIMULATE: &[&str] = &["fit", "scan"];
/// The only rooms that may know `simulate`, besides tests and examples: no estimator may peep at the truth.
const MAY_SIMULATE: &[&str] = &["simulate", "demo", "study", "cli"];

/// What prints, looks at a clock or at the environment, or starts a thread.
const NOT_BELOW_THE_WORKER: &[&str] = &[
    "println!",
    "print!(",
    "eprintln!",
    "eprint!",
    "io::stdout",
    "io::stderr",
    "Instant::now",
    "SystemTime::now",
    "thread::spawn",
    "thread::scope",
    "thread::Builder",
    "mpsc::",
    "std::env::",
];

/// What never ends on a matrix with a NaN in it, beside the room that asks first.
const WITHOUT_END: &[&str] = &[
    ".svd(",
    ".svd_unordered(",
    "SVD::new",
    ".symmetric_eigen()",
    ".symmetric_eigenvalues()",
    "SymmetricEigen::new",
    ".singular_values()",
    ".pseudo_inverse(",
];

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

/// A source file without comments and tests.
struct Source {
    /// The room it belongs to.
    room: String,
    /// Below `src`.
    path: PathBuf,
    /// How many names its module's path has: 1 for a room itself.
    depth: usize,
    code: String,
}

impl Source {
    fn new(path: &Path, text: &str) -> Self {
        let names: Vec<String> =
            path.with_extension("").iter().map(|n| n.to_string_lossy().into_owned()).filter(|n| n != "mod").collect();
        let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
        let code: Vec<&str> = code.lines().filter(|l| !l.trim_start().starts_with("//")).collect();
        Self { room: names[0].clone(), path: path.to_owned(), depth: names.len(), code: code.join("\n") }
    }
}

/// A file that holds only tests.
fn is_test(path: &Path) -> bool {
    path.file_stem().is_some_and(|stem| stem == "tests" || stem.to_string_lossy().ends_with("_tests"))
}

fn rooms() -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&root, &mut files);
    files.sort();
    let relative = files.into_iter().map(|path| path.strip_prefix(&root).expect("under src").to_path_buf());
    relative
        .filter(|path| !is_test(path))
        .map(|path| Source::new(&path, &fs::read_to_string(root.join(&path)).expect("source text")))
        .collect()
}

fn name(text: &str) -> String {
    text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
}

/// The names that a path goes on with: one, or those of a list in braces.
fn names_of(rest: &str) -> Vec<String> {
    let Some(list) = rest.strip_prefix('{') else { return vec![name(rest)] };
    let mut names = Vec::new();
    let mut depth = 0usize;
    let mut start = true;
    for (k, c) in list.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth == 0 => break,
            '}' => depth -= 1,
            ',' if depth == 0 => start = true,
            c if start && !c.is_whitespace() => {
                names.push(name(&list[k..]));
                start = false;
            }
            _ => {}
        }
    }
    names
}

/// Rooms named after `crate::`, also within braces (`use crate::{fit, io::read_file}`), and after as many `super::` as lead
/// out of a module whose path has `depth` names.
fn imported_rooms(code: &str, depth: usize) -> Vec<String> {
    let mut rooms = Vec::new();
    for (at, _) in code.match_indices("crate::") {
        rooms.extend(names_of(&code[at + "crate::".len()..]));
    }
    let mut end = 0;
    for (at, _) in code.match_indices("super::") {
        if at < end {
            continue;
        }
        let mut rest = &code[at..];
        let mut ups = 0;
        while let Some(further) = rest.strip_prefix("super::") {
            (rest, ups) = (further, ups + 1);
        }
        end = code.len() - rest.len();
        if ups >= depth {
            rooms.extend(names_of(rest));
        }
    }
    rooms
}

#[test]
fn lower_layers_never_import_higher_ones() {
    let mut faults = Vec::new();
    for Source { room, path, depth, code } in rooms() {
        if room == "lib" || room == "main" {
            continue;
        }
        let own = layer_of(&room).unwrap_or_else(|| panic!("{room} has no layer in this test"));
        for import in imported_rooms(&code, depth) {
            let allowed = match layer_of(&import) {
                None => true,
                Some(layer) => layer < own || import == room || (layer == 0 && own == 0),
            };
            let barred = (room == "simulate" && NOT_FOR_SIMULATE.contains(&import.as_str()))
                || (import == "simulate" && !MAY_SIMULATE.contains(&room.as_str()));
            if !allowed || barred {
                faults.push(format!("{} imports {import}", path.display()));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn nothing_below_the_worker_prints_looks_around_or_starts_a_thread() {
    let worker = layer_of("worker").expect("worker has a layer");
    let mut faults = Vec::new();
    for Source { room, path, code, .. } in rooms() {
        if layer_of(&room).is_none_or(|layer| layer >= worker) {
            continue;
        }
        for word in NOT_BELOW_THE_WORKER {
            if code.contains(word) {
                faults.push(format!("{} contains {word}", path.display()));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn matrices_are_decomposed_where_they_are_asked_for_nans_first() {
    let mut faults = Vec::new();
    for Source { path, code, .. } in rooms() {
        let asks_first = path.ends_with("geometry/decompose.rs");
        faults
            .extend(WITHOUT_END.iter().filter(|word| !asks_first && code.contains(**word)).map(|w| (path.clone(), w)));
    }
    assert!(faults.is_empty(), "{faults:?}");
}

#[test]
fn only_the_window_names_window_crates() {
    for Source { room, path, code, .. } in rooms() {
        for name in ["egui", "eframe", "egui_extras", "egui_plot", "three_d", "rfd"] {
            assert!(room == "gui" || !code.contains(&format!("{name}::")), "{} names {name}", path.display());
        }
    }
}

#[test]
fn braces_and_plain_paths_are_both_seen() {
    let code =
        "use crate::{fit::{self, a}, io::read, run::Stage};\nuse crate::geometry::Point3; let x = crate::align::f();";
    assert_eq!(imported_rooms(code, 1), ["fit", "io", "run", "geometry", "align"]);
}

#[test]
fn supers_that_leave_a_room_are_seen() {
    let code = "use super::a; use super::super::b::c;\nuse super::super::super::{d::e, f};";
    let of = |path: &str| {
        let source = Source::new(Path::new(path), code);
        imported_rooms(&source.code, source.depth)
    };
    assert_eq!(of("room.rs"), ["a", "b", "d", "f"]);
    assert_eq!(of("room/mod.rs"), ["a", "b", "d", "f"]);
    assert_eq!(of("room/file.rs"), ["b", "d", "f"]);
    assert_eq!(of("room/deep/file.rs"), ["d", "f"]);
    assert!(of("room/deep/er/file.rs").is_empty());
}

#[test]
fn code_after_a_line_that_names_a_file_of_tests_is_read() {
    let code =
        "use crate::fit;\n#[cfg(test)]\nmod tests;\nuse crate::io;\n#[cfg(test)]\nmod tests {\n use crate::cli;\n}";
    assert_eq!(imported_rooms(&Source::new(Path::new("room/mod.rs"), code).code, 1), ["fit", "io"]);
}
