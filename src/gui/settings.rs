//! What the window keeps from one start to the next: a TOML file of its own in the user's configuration folder.

use super::shift::{self, Shift};
use super::text::Language;
use crate::diagnostic::Diagnostic;
use std::path::{Path, PathBuf};
use toml_edit::{Array, DocumentMut, Item, Table, value};

/// How many plans are remembered.
const RECENT: usize = 8;
/// The smallest window that still shows the verdict and the button, points; no screen is laid out for less.
pub const LEAST_WINDOW: [f32; 2] = [480.0, 360.0];
/// What everything is magnified by.
pub const SCALES: [f32; 6] = [1.0, 1.25, 1.5, 1.75, 2.0, 2.5];

/// Light or dark.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum ThemeChoice {
    /// As the system says.
    #[default]
    System,
    /// Always light.
    Light,
    /// Always dark.
    Dark,
}

impl ThemeChoice {
    /// In the order of the menu.
    pub const ALL: [ThemeChoice; 3] = [ThemeChoice::System, ThemeChoice::Light, ThemeChoice::Dark];

    /// Its word in the settings; `view.` with it is the key of its text.
    pub fn code(self) -> &'static str {
        match self {
            ThemeChoice::System => "system",
            ThemeChoice::Light => "light",
            ThemeChoice::Dark => "dark",
        }
    }

    /// As egui says it.
    pub fn preference(self) -> egui::ThemePreference {
        match self {
            ThemeChoice::System => egui::ThemePreference::System,
            ThemeChoice::Light => egui::ThemePreference::Light,
            ThemeChoice::Dark => egui::ThemePreference::Dark,
        }
    }
}

/// A plan that was open.
#[derive(Debug, Clone, PartialEq)]
pub struct Recent {
    /// Its file.
    pub path: PathBuf,
    /// Seconds between two parts of its press, where somebody told.
    pub takt_s: Option<f64>,
}

/// Where the window was, points; the size is that of its inside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WindowPlace {
    /// Left upper corner, where the system tells.
    pub position: Option<[f32; 2]>,
    /// Width and height.
    pub size: [f32; 2],
    /// Whether it filled the screen.
    pub maximized: bool,
}

/// All that is kept.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Settings {
    /// Light or dark.
    pub theme: ThemeChoice,
    /// The language.
    pub language: Language,
    /// What everything is magnified by; 0 stands for 1.
    pub scale: f32,
    /// Plans, the latest first.
    pub recent: Vec<Recent>,
    /// Where the window was.
    pub place: Option<WindowPlace>,
    /// Whether a run watches the folder.
    pub watch: bool,
    /// The counts since the shift began.
    pub shift: Shift,
    /// The salted hash of the engineer's password, as a PHC string; `None` = none was set yet.
    pub password: Option<String>,
}

/// The key of the password's line, for who forgot it.
pub const PASSWORD_KEY: &str = "engineer_password";

impl Settings {
    /// Reads the file; what is missing or odd is as at the first start, for nobody should be kept from work by it.
    pub fn read(path: &Path) -> Self {
        let bytes = std::fs::read(path).unwrap_or_default();
        Self::parse(&String::from_utf8_lossy(&bytes))
    }

    /// The same. A file that holds anything odd is kept under another name before it is written over, and that is told.
    pub fn open(path: &Path) -> (Self, Option<Diagnostic>) {
        let odd = match std::fs::read(path) {
            Ok(bytes) => is_odd(&bytes),
            Err(fault) => fault.kind() != std::io::ErrorKind::NotFound,
        };
        let told = odd.then(|| {
            let mut kept = path.as_os_str().to_owned();
            kept.push(".damaged");
            let message = "the window's settings were damaged; what could not be read is as at the first start";
            let told = Diagnostic::warning(message).in_file(path);
            match std::fs::copy(path, &kept) {
                Ok(_) => {
                    told.with_help("the damaged file is kept beside it under the same name with .damaged at its end")
                }
                Err(_) => told.with_help("the damaged file could not be kept"),
            }
        });
        (Self::read(path), told)
    }

    fn parse(text: &str) -> Self {
        let document = text.parse::<DocumentMut>().unwrap_or_default();
        let word = |key: &str| document.get(key).and_then(Item::as_str);
        let recent = document.get("recent").and_then(Item::as_array_of_tables);
        Self {
            theme: ThemeChoice::ALL.into_iter().find(|t| word("theme") == Some(t.code())).unwrap_or_default(),
            language: Language::ALL.into_iter().find(|l| word("language") == Some(l.code())).unwrap_or_default(),
            scale: number(document.get("scale")).filter(|s| (1.0..=2.5).contains(s)).unwrap_or(1.0),
            recent: recent.into_iter().flatten().filter_map(recent_of).take(RECENT).collect(),
            place: document.get("window").and_then(place_of),
            password: word(PASSWORD_KEY).map_or_else(|| password_line(text), |word| Some(word.to_owned())),
            watch: document.get("watch").and_then(Item::as_bool).unwrap_or(false),
            shift: Shift::of(&document),
        }
    }

    /// Writes the file, whole or not at all.
    pub fn write(&self, path: &Path) -> std::io::Result<()> {
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder)?;
        }
        let fault = |d: crate::diagnostic::Diagnostic| std::io::Error::other(d.message);
        crate::report::atomic::write(path, self.text().as_bytes()).map_err(fault)
    }

    fn text(&self) -> String {
        let mut document = DocumentMut::new();
        document["theme"] = value(self.theme.code());
        document["language"] = value(self.language.code());
        document["scale"] = value(f64::from(self.magnification()));
        document["watch"] = value(self.watch);
        if let Some(password) = &self.password {
            document[PASSWORD_KEY] = value(password.as_str());
        }
        self.shift.write(&mut document);
        if let Some(place) = &self.place {
            let pair = |[a, b]: [f32; 2]| value([f64::from(a), f64::from(b)].into_iter().collect::<Array>());
            let mut window = Table::new();
            if let Some(position) = place.position {
                window["position"] = pair(position);
            }
            window["size"] = pair(place.size);
            window["maximized"] = value(place.maximized);
            document["window"] = Item::Table(window);
        }
        let mut recent = toml_edit::ArrayOfTables::new();
        for plan in &self.recent {
            let mut table = Table::new();
            table["plan"] = value(plan.path.display().to_string());
            if let Some(takt) = plan.takt_s {
                table["takt_s"] = value(takt);
            }
            recent.push(table);
        }
        document["recent"] = Item::ArrayOfTables(recent);
        document.to_string()
    }

    /// What everything is to be magnified by.
    pub fn magnification(&self) -> f32 {
        if self.scale > 0.0 { self.scale } else { 1.0 }
    }

    /// What everything is magnified by in a window of a size, points at scale 1: no more than leaves it the least room.
    pub fn magnification_in(&self, window: egui::Vec2) -> f32 {
        let most = (window.x / LEAST_WINDOW[0]).min(window.y / LEAST_WINDOW[1]);
        self.magnification().min(most.max(1.0))
    }

    /// Puts a plan first among the recent ones.
    pub fn remember(&mut self, path: &Path) {
        let known = self.recent.iter().position(|r| r.path == path);
        let takt_s = known.and_then(|k| self.recent.remove(k).takt_s);
        self.recent.insert(0, Recent { path: path.to_path_buf(), takt_s });
        self.recent.truncate(RECENT);
    }

    /// Seconds between two parts of the press at which a plan is used.
    pub fn takt_s(&self, plan: &Path) -> Option<f64> {
        self.recent.iter().find(|r| r.path == plan).and_then(|r| r.takt_s)
    }
}

/// The password's hash in a text that cannot be read otherwise: damage to a file unlocks nothing.
fn password_line(text: &str) -> Option<String> {
    let line = text.lines().find_map(|line| line.trim().strip_prefix(PASSWORD_KEY)?.trim_start().strip_prefix('='))?;
    let hash = line.trim().strip_prefix('"')?.split('"').next()?;
    hash.starts_with("$argon2").then(|| hash.to_owned())
}

/// Whether a file of settings holds what this program does not write: no TOML, or values of other kinds.
fn is_odd(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else { return true };
    let Ok(document) = text.parse::<DocumentMut>() else { return true };
    let is = |key: &str, kind: fn(&Item) -> bool| document.get(key).is_none_or(kind);
    let sound = is("theme", Item::is_str)
        && is("language", Item::is_str)
        && is("scale", |scale| number(Some(scale)).is_some())
        && is("watch", Item::is_bool)
        && is(PASSWORD_KEY, Item::is_str)
        && shift::is_sound(&document)
        && is("window", Item::is_table_like)
        && is("recent", |recent| {
            recent.as_array_of_tables().is_some_and(|plans| plans.iter().all(|plan| recent_of(plan).is_some()))
        });
    !sound
}

fn number(item: Option<&Item>) -> Option<f32> {
    item.and_then(|i| i.as_float().or_else(|| i.as_integer().map(|n| n as f64))).map(|n| n as f32)
}

fn recent_of(table: &Table) -> Option<Recent> {
    let path = PathBuf::from(table.get("plan")?.as_str()?);
    let takt_s = table.get("takt_s").and_then(Item::as_float).filter(|t| t.is_finite() && *t > 0.0);
    Some(Recent { path, takt_s })
}

fn place_of(item: &Item) -> Option<WindowPlace> {
    let pair = |key: &str| {
        let array = item.get(key)?.as_array()?;
        let number = |k: usize| array.get(k).and_then(|v| v.as_float()).filter(|n| n.is_finite()).map(|n| n as f32);
        Some([number(0)?, number(1)?])
    };
    let size = pair("size").filter(|[w, h]| *w >= 320.0 && *h >= 240.0)?;
    let maximized = item.get("maximized").and_then(Item::as_bool).unwrap_or(false);
    Some(WindowPlace { position: pair("position"), size, maximized })
}

/// The user's folder for configuration, for this program.
pub fn config_folder() -> Option<PathBuf> {
    user_folder("XDG_CONFIG_HOME", ".config", "APPDATA")
}

/// The user's folder for data, for this program.
pub fn data_folder() -> Option<PathBuf> {
    user_folder("XDG_DATA_HOME", ".local/share", "LOCALAPPDATA")
}

fn user_folder(unix: &str, below_home: &str, windows: &str) -> Option<PathBuf> {
    let named = |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|p| p.is_absolute());
    let base =
        if cfg!(windows) { named(windows) } else { named(unix).or_else(|| Some(named("HOME")?.join(below_home))) };
    Some(base?.join("shapeline"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_is_magnified_no_more_than_leaves_room_for_the_smallest_layout() {
        for scale in SCALES {
            let settings = Settings { scale, ..Settings::default() };
            for size in [[480.0, 360.0], [800.0, 600.0], [1280.0, 800.0], [1920.0, 1080.0], [3840.0, 2160.0]] {
                let used = settings.magnification_in(egui::Vec2::from(size));
                assert!((1.0..=scale).contains(&used), "{scale} in {size:?}: {used}");
                assert!(size[0] / used >= 479.99 && size[1] / used >= 359.99, "{scale} in {size:?}: {used}");
            }
            assert_eq!(settings.magnification_in(egui::vec2(3840.0, 2160.0)), scale);
        }
    }

    #[test]
    fn what_is_written_is_read_again() {
        let mut settings = Settings {
            theme: ThemeChoice::Dark,
            language: Language::German,
            scale: 1.5,
            watch: true,
            password: Some("$argon2id$v=19$m=19456,t=2,p=1$c2FsdA$aGFzaA".into()),
            place: Some(WindowPlace { position: Some([10.0, -20.5]), size: [1280.0, 800.0], maximized: true }),
            shift: Shift { pass: 3, fail: 1, undecided: 0, incomplete: 2, refused: 5, ..Shift::default() },
            ..Settings::default()
        };
        settings.remember(Path::new("/plans/a \"b\".toml"));
        settings.recent[0].takt_s = Some(8.5);
        settings.remember(Path::new("/plans/c.toml"));
        assert_eq!(Settings::parse(&settings.text()), settings);
    }

    #[test]
    fn odd_files_start_afresh() {
        let fresh = Settings { scale: 1.0, ..Settings::default() };
        for text in ["", "not toml [", "theme = 3\nscale = 99.0\n[window]\nsize = [1.0, nan]\n[[recent]]\nplan = 1"] {
            assert_eq!(Settings::parse(text), fresh, "{text}");
        }
    }

    #[test]
    fn a_damaged_file_is_kept_and_unlocks_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("window.toml");
        assert_eq!(Settings::open(&path).1, None, "the first start");
        let sound = Settings { password: Some("$argon2id$v=19$a".into()), ..Settings::default() }.text();
        std::fs::write(&path, &sound).unwrap();
        assert_eq!(Settings::open(&path).1, None);
        let cut = format!("{sound}[shift");
        for bytes in [cut.as_bytes(), &[&[0xff, 0x00, b'\n'], sound.as_bytes()].concat(), b"watch = 3", b"\x00\xff"] {
            std::fs::write(&path, bytes).unwrap();
            let (settings, told) = Settings::open(&path);
            assert!(told.is_some_and(|told| told.help.is_some_and(|help| help.contains(".damaged"))));
            assert_eq!(std::fs::read(folder.path().join("window.toml.damaged")).unwrap(), bytes);
            assert_eq!(settings.password.is_some(), bytes.windows(7).any(|w| w == b"$argon2"), "{bytes:?}");
        }
    }

    #[test]
    fn a_plan_opened_again_comes_first_and_keeps_its_takt() {
        let mut settings = Settings::default();
        for k in 0..RECENT + 2 {
            settings.remember(Path::new(&format!("{k}.toml")));
        }
        assert_eq!(settings.recent.len(), RECENT);
        settings.recent[3].takt_s = Some(6.0);
        let path = settings.recent[3].path.clone();
        settings.remember(&path);
        assert_eq!((settings.recent[0].path.clone(), settings.takt_s(&path)), (path, Some(6.0)));
        assert_eq!(settings.recent.len(), RECENT);
    }
}
