//! A small project in a folder of its own, and the real program run on it.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// For what must happen on a busy machine sooner or later.
const PATIENCE: Duration = Duration::from_secs(120);

/// A good part of the demo, a second and a half of work.
pub const REAL_SCAN: &str = "scans/02_good_bottom.ply";

/// The demo's plan and CAD in a folder of their own, without scans, and with results as JSON and ASCII only.
pub struct Project {
    folder: TempDir,
}

impl Project {
    pub fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let project = Self { folder };
        std::fs::create_dir(project.path("scans")).expect("scans folder");
        for (name, bytes) in demo_files().iter().filter(|(name, _)| !name.starts_with("scans/")) {
            project.write(name, bytes);
        }
        project.change_plan(&[("\"ascii\", \"json\", \"pdf\"", "\"ascii\", \"json\"")]);
        project
    }

    pub fn root(&self) -> &Path {
        self.folder.path()
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.root().join(name)
    }

    pub fn write(&self, name: &str, bytes: &[u8]) {
        std::fs::write(self.path(name), bytes).expect("a file of the test");
    }

    pub fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    pub fn has(&self, name: &str) -> bool {
        self.path(name).exists()
    }

    /// Replaces texts of the plan; each must be there.
    pub fn change_plan(&self, changes: &[(&str, &str)]) {
        let mut plan = String::from_utf8(self.read("demo.toml")).expect("text");
        for (from, to) in changes {
            assert!(plan.contains(from), "the demo's plan has no {from}");
            plan = plan.replacen(from, to, 1);
        }
        self.write("demo.toml", plan.as_bytes());
    }

    /// Puts a scan of the demo among the scans, under another name if need be.
    pub fn add_real_scan(&self, name: &str) {
        self.write(&format!("scans/{name}"), &real_scan());
    }

    /// Runs the program in the project's folder.
    pub fn run<I: AsRef<OsStr>>(&self, arguments: impl IntoIterator<Item = I>) -> Ran {
        run_in(self.root(), arguments)
    }

    pub fn json(&self, name: &str) -> serde_json::Value {
        serde_json::from_slice(&self.read(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    /// Content of each file of a folder; none may be hidden or half-written.
    pub fn files(&self, folder: &str) -> BTreeMap<String, Vec<u8>> {
        files_of(&self.path(folder))
    }

    /// How many scans have a result in `results`.
    pub fn results(&self) -> usize {
        self.results_in("results")
    }

    /// How many scans have a result in a folder.
    pub fn results_in(&self, folder: &str) -> usize {
        self.files(folder).keys().filter(|name| name.ends_with(".json")).count()
    }

    pub fn assert_verified(&self, folder: &str) {
        let verified = self.run(["verify", folder]);
        assert_eq!(verified.code, Some(0), "{verified:?}");
    }
}

pub fn files_of(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let read = |entry: std::io::Result<std::fs::DirEntry>| {
        let entry = entry.expect("an entry");
        (entry.file_name().to_string_lossy().into_owned(), std::fs::read(entry.path()).expect("a file"))
    };
    entries.map(read).collect()
}

pub fn demo_files() -> Vec<(&'static str, std::borrow::Cow<'static, [u8]>)> {
    shapeline::demo::files()
}

pub fn real_scan() -> Vec<u8> {
    demo_file(REAL_SCAN)
}

pub fn demo_file(wanted: &str) -> Vec<u8> {
    let files = demo_files();
    files.iter().find(|(name, _)| *name == wanted).expect("a file of the demo").1.to_vec()
}

/// A whole file of a few points that belong to no part: read at once, refused at once. Each number gives another file.
pub fn tiny_scan(number: u32) -> Vec<u8> {
    let mut bytes = b"ply\nformat binary_little_endian 1.0\nelement vertex 40\n".to_vec();
    bytes.extend(b"property float x\nproperty float y\nproperty float z\nend_header\n");
    for k in 0..40 {
        let (x, y) = ((k % 8) as f32, (k / 8) as f32 + number as f32);
        for value in [10.0 * x, 10.0 * y, 600.0] {
            bytes.extend(value.to_le_bytes());
        }
    }
    bytes
}

/// How the program ended and what it said.
#[derive(Debug)]
pub struct Ran {
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

impl Ran {
    /// The lines of standard output, one a scan.
    pub fn lines(&self) -> Vec<&str> {
        self.stdout.lines().collect()
    }

    #[track_caller]
    pub fn assert_ended(&self, code: i32, words: &[&str]) {
        assert_eq!(self.code, Some(code), "{self:?}");
        for word in words {
            assert!(self.stderr.contains(word), "no \"{word}\" in {self:?}");
        }
        assert!(!self.stderr.contains("panicked") && !self.stderr.contains("internal fault"), "{self:?}");
    }
}

fn program<I: AsRef<OsStr>>(folder: &Path, arguments: impl IntoIterator<Item = I>) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_shapeline"));
    command.current_dir(folder).args(arguments).stdin(Stdio::null());
    // No test opens a window on somebody's screen.
    command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
    command
}

pub fn run_in<I: AsRef<OsStr>>(folder: &Path, arguments: impl IntoIterator<Item = I>) -> Ran {
    let output = program(folder, arguments).output().expect("the program starts");
    Ran {
        code: output.status.code(),
        stdout: String::from_utf8(output.stdout).expect("text"),
        stderr: String::from_utf8(output.stderr).expect("text"),
    }
}

/// The program while it runs. Killed when dropped.
pub struct Running {
    child: Child,
    out: Said,
    err: Said,
}

struct Said {
    lines: Arc<Mutex<Vec<String>>>,
    reader: Option<JoinHandle<()>>,
}

impl Said {
    fn listen(pipe: impl Read + Send + 'static) -> Self {
        let lines = Arc::new(Mutex::new(Vec::new()));
        let writer = lines.clone();
        let reader = std::thread::spawn(move || {
            for line in BufReader::new(pipe).lines().map_while(Result::ok) {
                writer.lock().expect("no panic").push(line);
            }
        });
        Self { lines, reader: Some(reader) }
    }

    fn so_far(&self) -> Vec<String> {
        self.lines.lock().expect("no panic").clone()
    }
}

impl Running {
    pub fn start<I: AsRef<OsStr>>(folder: &Path, arguments: impl IntoIterator<Item = I>) -> Self {
        let mut child = program(folder, arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let out = Said::listen(child.stdout.take().expect("piped"));
        let err = Said::listen(child.stderr.take().expect("piped"));
        Self { child, out, err }
    }

    pub fn out(&self) -> Vec<String> {
        self.out.so_far()
    }

    /// Waits until something is so; the program must not have ended before.
    #[track_caller]
    pub fn wait_until(&mut self, what: &str, so: impl Fn(&Self) -> bool) {
        let start = Instant::now();
        while !so(self) {
            let ended = self.child.try_wait().expect("a child").is_some() && !so(self);
            assert!(!ended && start.elapsed() < PATIENCE, "{what}: {:?} {:?}", self.out.so_far(), self.err.so_far());
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    #[track_caller]
    pub fn wait_for_lines(&mut self, count: usize) {
        self.wait_until(&format!("{count} lines of results"), |run| run.out.so_far().len() >= count);
    }

    /// Waits for a line on standard error that has all these words.
    #[track_caller]
    pub fn wait_for_words(&mut self, words: &[&str]) {
        let has_all = |line: &String| words.iter().all(|word| line.contains(word));
        self.wait_until(&format!("{words:?}"), |run| run.err.so_far().iter().any(has_all));
    }

    /// Ctrl-C.
    pub fn interrupt(&self) {
        let signal = format!("kill -INT {}", self.child.id());
        assert!(Command::new("sh").args(["-c", &signal]).status().expect("a shell").success());
    }

    pub fn kill(mut self) {
        self.child.kill().expect("a child");
        self.end();
    }

    /// Waits for its end, but not for ever.
    #[track_caller]
    pub fn end_in_time(mut self) -> Ran {
        let start = Instant::now();
        while self.child.try_wait().expect("a child").is_none() {
            assert!(start.elapsed() < PATIENCE, "no end: {:?} {:?}", self.out.so_far(), self.err.so_far());
            std::thread::sleep(Duration::from_millis(10));
        }
        self.end()
    }

    /// Waits for its end.
    pub fn end(&mut self) -> Ran {
        let code = self.child.wait().expect("a child").code();
        for said in [&mut self.out, &mut self.err] {
            if let Some(reader) = said.reader.take() {
                reader.join().expect("no panic");
            }
        }
        Ran { code, stdout: self.out.so_far().join("\n"), stderr: self.err.so_far().join("\n") }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
