//! `shapeline demo`: the bundled project, written, run and explained.

use super::run::run_to_end;
use super::{Exit, Manner, terminal};
use crate::demo;
use crate::diagnostic::Diagnostic;
use crate::report::atomic;
use crate::worker::SequenceRequest;
use clap::Args;
use std::path::{Path, PathBuf};

/// `shapeline demo [DIR]`.
#[derive(Debug, Args)]
pub(super) struct DemoArguments {
    /// Where to put the demo project.
    #[arg(default_value = "shapeline-demo")]
    folder: PathBuf,
}

pub(super) fn run(arguments: &DemoArguments, manner: Manner) -> Result<Exit, Diagnostic> {
    let folder = &arguments.folder;
    write_project(folder)?;
    if !manner.quiet {
        terminal::note(format!("demo project written to {}", folder.display()));
    }
    let request = SequenceRequest { plan_path: folder.join("demo.toml"), ..SequenceRequest::default() };
    let (summary, files) = run_to_end(request, manner)?;
    if let Some(diagnostic) = summary.error {
        return Err(diagnostic);
    }
    if summary.stopped {
        return Ok(Exit::Stopped);
    }
    if summary.measured() == 0 {
        return Err(Diagnostic::error("none of the demo's scans could be measured"));
    }
    explain(folder, &files);
    // What could not be written was told on the way.
    Ok(if summary.unwritten > 0 { Exit::NotGood } else { Exit::Good })
}

/// Writes what is not there yet; somebody's changes to an earlier demo are not overwritten.
fn write_project(folder: &Path) -> Result<(), Diagnostic> {
    for (name, bytes) in demo::files() {
        let path = folder.join(name);
        match crate::io::read_plain(&path) {
            Ok(found) if found == *bytes => continue,
            Ok(_) => {
                return Err(Diagnostic::error("is not the demo's file and is left as it is")
                    .in_file(&path)
                    .with_help("give another folder: `shapeline demo OTHER_FOLDER`"));
            }
            Err(_) => {}
        }
        let parent = path.parent().unwrap_or(folder);
        std::fs::create_dir_all(parent)
            .map_err(|e| Diagnostic::error(format!("the folder cannot be made: {e}")).in_file(parent))?;
        atomic::write(&path, &bytes)?;
    }
    Ok(())
}

fn explain(folder: &Path, files: &[PathBuf]) {
    let pdf = |stem: &str| {
        let found = files.iter().find(|f| {
            f.extension().is_some_and(|e| e == "pdf")
                && f.file_name().is_some_and(|n| n.to_string_lossy().starts_with(stem))
        });
        found.map_or_else(|| folder.join("results").display().to_string(), |f| f.display().to_string())
    };
    terminal::line("");
    terminal::line("What you saw: five scans of one bracket, as they lay on the belt.");
    terminal::line("  01, 02  the same good part, seen from the top and from the bottom");
    terminal::line("  03      three points out of tolerance; start here:");
    terminal::line(format!("          {}", pdf("03")));
    terminal::line("  04      a flange that cannot be told from the belt: those points are not measured, never passed");
    terminal::line("  05      a file that was cut off: refused with the reason");
    terminal::line(format!("Plan to play with: {}", folder.join("demo.toml").display()));
    terminal::line(format!("Again:             shapeline run {}", folder.join("demo.toml").display()));
}
