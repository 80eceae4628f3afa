//! Small work that must not hold a frame up: a file read or written, the system's file dialog. One thing at a time, on a thread of its own.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::time::{Duration, Instant};

/// Something that is being done.
#[derive(Debug)]
pub struct Later<T> {
    answer: Option<Receiver<T>>,
}

impl<T> Default for Later<T> {
    fn default() -> Self {
        Self { answer: None }
    }
}

impl<T: Send + 'static> Later<T> {
    /// Begins; what was begun before is forgotten. The window is drawn again when it is done.
    pub fn start(&mut self, ctx: &egui::Context, work: impl FnOnce() -> T + Send + 'static) {
        let (sender, answer) = channel();
        let ctx = ctx.clone();
        let thread = std::thread::Builder::new().name("later".into()).spawn(move || {
            let done = work();
            if sender.send(done).is_ok() {
                ctx.request_repaint();
            }
        });
        self.answer = thread.is_ok().then_some(answer);
    }

    /// Whether it is still being done.
    pub fn is_busy(&self) -> bool {
        self.answer.is_some()
    }

    /// What came of it, once; the error: it ended without an answer.
    pub fn poll(&mut self) -> Option<Result<T, Lost>> {
        let answer = match self.answer.as_ref()?.try_recv() {
            Ok(answer) => Ok(answer),
            Err(TryRecvError::Empty) => return None,
            Err(TryRecvError::Disconnected) => Err(Lost),
        };
        self.answer = None;
        Some(answer)
    }
}

/// The work ended in a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lost;

/// Nobody shuts a dialog that fast: it did not open (no portal, no zenity).
const NOT_SHOWN: Duration = Duration::from_millis(300);

/// What a file dialog is for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Asked {
    /// A file that is there, with one of these endings.
    Open(&'static [&'static str]),
    /// A folder.
    Folder,
    /// A file to be written, under this name at first.
    Save(String),
}

/// The system's dialog for a path, beside a field in which the path can be typed.
#[derive(Debug, Default)]
pub struct PathDialog {
    open: Later<(Option<PathBuf>, Duration)>,
    /// The last dialog did not open.
    pub failed: bool,
}

impl PathDialog {
    /// Opens it, in a folder if that is there.
    pub fn ask(&mut self, ctx: &egui::Context, asked: Asked, folder: Option<&Path>) {
        if self.open.is_busy() {
            return;
        }
        self.failed = false;
        let folder = folder.filter(|f| f.is_dir()).map(Path::to_path_buf);
        self.open.start(ctx, move || {
            let begin = Instant::now();
            let mut dialog = rfd::FileDialog::new();
            if let Some(folder) = folder {
                dialog = dialog.set_directory(folder);
            }
            let path = match asked {
                Asked::Open(endings) => dialog.add_filter(endings.join(", "), endings).pick_file(),
                Asked::Folder => dialog.pick_folder(),
                Asked::Save(name) => dialog.set_file_name(name).save_file(),
            };
            (path, begin.elapsed())
        });
    }

    /// Whether it is open.
    pub fn is_open(&self) -> bool {
        self.open.is_busy()
    }

    /// The path that was chosen, once.
    pub fn answer(&mut self) -> Option<PathBuf> {
        match self.open.poll()? {
            Ok((Some(path), _)) => Some(path),
            Ok((None, after)) => {
                self.failed = after <= NOT_SHOWN;
                None
            }
            Err(Lost) => {
                self.failed = true;
                None
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wait<T: Send + 'static>(later: &mut Later<T>) -> Result<T, Lost> {
        let begin = Instant::now();
        loop {
            if let Some(done) = later.poll() {
                return done;
            }
            assert!(begin.elapsed() < Duration::from_secs(60));
            std::thread::yield_now();
        }
    }

    #[test]
    fn an_answer_comes_once_and_a_fault_is_told() {
        let ctx = egui::Context::default();
        let mut later = Later::default();
        assert!(!later.is_busy() && later.poll().is_none());
        later.start(&ctx, || 7);
        assert_eq!(wait(&mut later), Ok(7));
        assert!(!later.is_busy() && later.poll().is_none());
        later.start(&ctx, || panic!("on purpose"));
        assert_eq!(wait(&mut later), Err(Lost));
    }
}
