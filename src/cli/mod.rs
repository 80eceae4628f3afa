//! The command line: one file a subcommand. Words for people here, work in the layers below.

mod check;
mod demo;
mod fit;
mod mask_study;
mod merge;
mod prepare;
mod run;
mod simulate;
mod study;
mod terminal;
mod verify;

use crate::diagnostic::{Diagnostic, ReadError};
use clap::{Parser, Subcommand};
use std::path::PathBuf;
use std::process::ExitCode;

/// Shape inspection of stamped sheet metal: point clouds against the CAD model, verdicts and reports.
#[derive(Debug, Parser)]
#[command(name = "shapeline", version, subcommand_precedence_over_arg = true)]
struct Arguments {
    /// Threads to use; 0 = one a core. Results are the same with any number.
    #[arg(long, global = true, default_value_t = 0, value_name = "N")]
    threads: usize,
    /// No progress and no hints, only results and errors.
    #[arg(long, short, global = true)]
    quiet: bool,
    /// Measure how long the window's frames take on the first scan of the plan, and write that as JSON.
    #[arg(long, value_name = "FILE", requires = "plan")]
    frame_times: Option<PathBuf>,
    /// Plan to open in the window.
    plan: Option<PathBuf>,
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Inspect scans by a plan and write the reports.
    Run(run::RunArguments),
    /// List every problem of a plan; inspect nothing.
    Check(check::CheckArguments),
    /// Write the bundled demo project, run it and say what came out.
    Demo(demo::DemoArguments),
    /// Pre-process the plan's CAD and write its cache.
    Prepare(prepare::PrepareArguments),
    /// Write synthetic scans of the plan's part with known truth.
    Simulate(simulate::SimulateArguments),
    /// Tell which tolerances of a plan can be judged: bias, spread, coverage, Cg and Cgk of every comparison point.
    Study(study::StudyArguments),
    /// Fit a line, plane, circle, sphere, cylinder or cone to files of points.
    Fit(fit::FitArguments),
    /// Check a results folder against its manifest.
    Verify(verify::VerifyArguments),
    /// Merge overlapping views of a part or tool into one cloud that keeps the best points.
    Merge(merge::MergeArguments),
    /// Tell what each mask of a merge is worth: scatter and points left over the thresholds of every metric.
    MaskStudy(mask_study::MaskStudyArguments),
}

/// How the program ends; the README tells people the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Exit {
    /// All is well: every part within tolerance, no problem found.
    Good,
    /// A part out of tolerance, undecided, incomplete or refused; a warning.
    NotGood,
    /// Nothing could be done.
    Unusable,
    /// Stopped by Ctrl-C.
    Stopped,
}

impl Exit {
    /// What scripts see.
    fn status(self) -> u8 {
        match self {
            Exit::Good => 0,
            Exit::NotGood => 1,
            Exit::Unusable => 2,
            Exit::Stopped => 130,
        }
    }
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        ExitCode::from(exit.status())
    }
}

/// What all commands share.
#[derive(Debug, Clone, Copy)]
struct Manner {
    quiet: bool,
}

/// Reads the arguments, runs the command and tells how it ended.
pub fn main() -> ExitCode {
    let arguments = Arguments::parse();
    // A second pool cannot be built; the first call in the process decides, and this is it.
    if let Err(e) = rayon::ThreadPoolBuilder::new().num_threads(arguments.threads).build_global() {
        terminal::error(&Diagnostic::error(format!("{} threads cannot be started: {e}", arguments.threads)));
        return Exit::Unusable.into();
    }
    if let Err(e) = outlive_file_size_limits() {
        terminal::error(&Diagnostic::error(format!("the system's limit on file sizes cannot be caught: {e}")));
        return Exit::Unusable.into();
    }
    std::panic::set_hook(Box::new(|fault| terminal::error(&internal_fault(fault))));
    match std::panic::catch_unwind(|| run_command(arguments)) {
        Ok(Ok(exit)) => exit.into(),
        Ok(Err(diagnostic)) => {
            terminal::error(&diagnostic);
            Exit::Unusable.into()
        }
        // The hook has told it.
        Err(_) => Exit::Unusable.into(),
    }
}

/// Unix ends a program that writes beyond the limit on file sizes (`ulimit -f`), unless it takes the signal: then the write
/// fails, and is told like any other that fails.
#[cfg(unix)]
fn outlive_file_size_limits() -> std::io::Result<()> {
    let beyond_the_limit = std::sync::Arc::default();
    signal_hook::flag::register(signal_hook::consts::SIGXFSZ, beyond_the_limit).map(|_| ())
}

/// Elsewhere a write that the system does not allow fails as it is.
#[cfg(not(unix))]
fn outlive_file_size_limits() -> std::io::Result<()> {
    Ok(())
}

fn run_command(arguments: Arguments) -> Result<Exit, Diagnostic> {
    let manner = Manner { quiet: arguments.quiet };
    match arguments.command {
        Some(Command::Run(run)) => run::run(&run, manner),
        Some(Command::Check(check)) => check::run(&check),
        Some(Command::Demo(demo)) => demo::run(&demo, manner),
        Some(Command::Prepare(prepare)) => prepare::run(&prepare, manner),
        Some(Command::Simulate(simulate)) => simulate::run(&simulate, manner),
        Some(Command::Study(study)) => study::run(&study, manner),
        Some(Command::Fit(fit)) => fit::run(&fit),
        Some(Command::Verify(verify)) => verify::run(&verify, manner),
        Some(Command::Merge(merge)) => merge::run(&merge, manner),
        Some(Command::MaskStudy(study)) => mask_study::run(&study, manner),
        None => window(arguments.plan, arguments.frame_times),
    }
}

/// A fault of this program, in the words of its other messages.
fn internal_fault(fault: &std::panic::PanicHookInfo<'_>) -> Diagnostic {
    let words = fault.payload_as_str().unwrap_or("no further words");
    let place = fault.location().map(|place| format!(" at {place}")).unwrap_or_default();
    Diagnostic::error(format!("an internal fault{place}: {words}"))
        .with_help("this is a fault of the program, not of your files; please send this message to the maintainers")
}

/// Opens the window; returns when it is closed.
#[cfg(feature = "gui")]
fn window(plan: Option<PathBuf>, frame_times: Option<PathBuf>) -> Result<Exit, Diagnostic> {
    match (plan, frame_times) {
        (Some(plan), Some(file)) => crate::gui::frame_times(&plan, &file),
        (plan, _) => crate::gui::open(plan),
    }
    .map(|()| Exit::Good)
}

/// A program that was built without the window says so.
#[cfg(not(feature = "gui"))]
fn window(plan: Option<PathBuf>, _frame_times: Option<PathBuf>) -> Result<Exit, Diagnostic> {
    let plan = plan.map_or_else(|| "PLAN.toml".into(), |p| p.display().to_string());
    Err(Diagnostic::error("this program was built without the window")
        .with_help(format!("inspect with `shapeline run {plan}`, or see `shapeline --help`")))
}

/// A file's fault as a message; a cancelled job has none of its own.
fn diagnostic_of(error: ReadError) -> Diagnostic {
    match error {
        ReadError::Bad(diagnostic) | ReadError::CutOff(diagnostic) => *diagnostic,
        ReadError::Cancelled(_) => Diagnostic::error("stopped"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    /// The man page without the marks of its notation.
    fn man_page() -> String {
        include_str!("../../packaging/shapeline.1")
            .replace("\\fB", "")
            .replace("\\fI", "")
            .replace("\\fR", "")
            .replace("\\-", "-")
    }

    #[test]
    fn the_man_page_has_every_command_option_and_exit_status() {
        let page = man_page();
        let (commands, rest) = page.split_once(".SH OPTIONS").expect("a section of options");
        let program = Arguments::command();
        let options = |command: &clap::Command, text: &str| {
            for argument in command.get_arguments().filter(|a| !a.is_hide_set()) {
                let Some(long) = argument.get_long() else { continue };
                let name = format!("--{long}");
                let stands = text.lines().any(|line| line.split([' ', ',']).any(|word| word == name));
                assert!(stands, "{}: {name} is missing in packaging/shapeline.1", command.get_name());
            }
        };
        options(&program, rest);
        for command in program.get_subcommands().filter(|c| !c.is_hide_set()) {
            // From its own line to that of the next command.
            let own = format!(".TP\n{} ", command.get_name());
            let (_, after) = commands.split_once(&own).unwrap_or_else(|| panic!("no command {}", command.get_name()));
            let others = program.get_subcommands().filter_map(|c| after.find(&format!(".TP\n{} ", c.get_name())));
            options(command, &after[..others.min().unwrap_or(after.len())]);
        }
        let states = rest.split_once(".SH EXIT STATUS").expect("a section").1;
        for exit in [Exit::Good, Exit::NotGood, Exit::Unusable, Exit::Stopped] {
            assert!(states.contains(&format!(".TP\n.B {}\n", exit.status())), "{exit:?}");
        }
    }
}
