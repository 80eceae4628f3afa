//! What a verdict rests on, looked at again while nothing runs: the plan, the CAD, the results on the disk.

use super::plan_on_disk::{PlanNow, PlanOnDisk};
use crate::diagnostic::{Diagnostic, os_words};
use crate::io::{read_plain, sha256_hex};
use crate::part::Part;
use crate::plan::Plan;
use std::io::ErrorKind;
use std::path::PathBuf;
use std::time::{Duration, Instant, SystemTime};

/// How long another plan lies there before it is told: it may be half written.
const SETTLE: Duration = Duration::from_secs(2);

/// What a verdict rests on is not what it was: why, and what to do.
#[derive(Debug)]
pub enum Shaken {
    /// Another plan or CAD: both must be read again before anything is judged.
    Ground(Diagnostic),
    /// Results are gone.
    Results(Diagnostic),
}

/// Plan and CAD as they were read, and the results of a part as they were written.
#[derive(Debug)]
pub struct Ground {
    plan: PlanOnDisk,
    cad: CadOnDisk,
    results: Vec<PathBuf>,
}

impl Ground {
    /// Of a plan with its CAD, and the result files of the part that was judged last, if one was.
    pub fn of(plan: &Plan, part: &Part, results: Vec<PathBuf>) -> Self {
        let cad =
            CadOnDisk { path: plan.cad.path.clone(), sha256: part.cad_sha256.clone(), known: None, settling: None };
        Self { plan: PlanOnDisk::of(plan, plan.path.clone()), cad, results }
    }

    /// Looks at all of it.
    pub fn look(&mut self, now: Instant) -> Option<Shaken> {
        let help = "the parts before were judged by the one of then; inspect the part at hand again";
        match self.plan.look(now, SETTLE) {
            PlanNow::Another(told) => return Some(Shaken::Ground(told.with_help(help))),
            PlanNow::Unusable(why) => return Some(Shaken::Ground(*why)),
            // Nothing is said of the rest while the plan is being written.
            PlanNow::Settling => return None,
            PlanNow::Same => {}
        }
        if let Some(told) = self.cad.look() {
            return Some(Shaken::Ground(told));
        }
        let is_gone = |path: &&PathBuf| std::fs::metadata(path).is_err_and(|e| e.kind() == ErrorKind::NotFound);
        let gone = self.results.iter().find(is_gone)?;
        let told = Diagnostic::error("the result of the last part is not there any more").in_file(gone);
        Some(Shaken::Results(told.with_help("inspect the part again, so that its result is written")))
    }
}

/// Size and time of a file.
type Stamp = (u64, Option<SystemTime>);

/// The CAD as it was read, to be compared with its file. It is read again only where size or time are others.
#[derive(Debug)]
struct CadOnDisk {
    path: PathBuf,
    sha256: String,
    /// Stamp of the file when its content was last found to be what it was.
    known: Option<Stamp>,
    /// Stamp at the last look, where it was another one: it may be being written.
    settling: Option<Stamp>,
}

impl CadOnDisk {
    fn look(&mut self) -> Option<Diagnostic> {
        let told = |why: String, help: &str| Some(Diagnostic::error(why).in_file(&self.path).with_help(help));
        let put_back = "put it back, or choose another one in the plan";
        let stamp = match std::fs::metadata(&self.path) {
            Ok(about) => (about.len(), about.modified().ok()),
            Err(e) => return told(format!("the CAD cannot be read any more: {}", os_words(&e)), put_back),
        };
        if self.known == Some(stamp) {
            self.settling = None;
            return None;
        }
        if self.known.is_some() && self.settling != Some(stamp) {
            self.settling = Some(stamp);
            return None;
        }
        match read_plain(&self.path) {
            Ok(bytes) if sha256_hex(&bytes) == self.sha256 => {
                (self.known, self.settling) = (Some(stamp), None);
                None
            }
            Ok(_) => told(
                "the CAD has changed since it was read".into(),
                "the parts before were held to the one of then; inspect the part at hand again",
            ),
            Err(e) => told(format!("the CAD cannot be read any more: {}", os_words(&e)), put_back),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;
    use std::fs::write;

    fn shaken(ground: &mut Ground, now: Instant) -> Option<String> {
        ground.look(now).map(|shaken| match shaken {
            Shaken::Ground(told) => format!("ground: {}", told.message),
            Shaken::Results(told) => format!("results: {}", told.message),
        })
    }

    /// The demo's plan in a folder with a CAD of three bytes.
    #[test]
    fn what_changes_under_a_verdict_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let text = include_str!("../../settings/demo.toml");
        let text = text.replace("../assets/demo/scans", "scans").replace("../assets/demo/bracket.stl", "bracket.stl");
        std::fs::create_dir_all(at("scans")).unwrap();
        write(at("plan.toml"), &text).unwrap();
        write(at("bracket.stl"), "cad").unwrap();
        write(at("1.json"), "result").unwrap();
        let plan = crate::plan::load(&at("plan.toml")).plan.expect("the demo's plan");
        let mut part = example::dome_part(20);
        part.cad_sha256 = sha256_hex(b"cad");
        let new = || Ground::of(&plan, &part, vec![at("1.json")]);
        let start = Instant::now();
        let mut ground = new();
        assert_eq!(shaken(&mut ground, start), None);
        // Written anew as it was.
        write(at("bracket.stl"), "cad").unwrap();
        assert_eq!(shaken(&mut ground, start), None);
        assert_eq!(shaken(&mut ground, start), None);
        std::fs::rename(at("1.json"), at("2.json")).unwrap();
        assert!(shaken(&mut ground, start).unwrap().starts_with("results: "));
        std::fs::rename(at("2.json"), at("1.json")).unwrap();
        // Half written at the first look, whole at the second.
        write(at("bracket.stl"), "another").unwrap();
        assert_eq!(shaken(&mut ground, start), None);
        assert_eq!(shaken(&mut ground, start).unwrap(), "ground: the CAD has changed since it was read");
        // One that changed before the first look.
        assert!(shaken(&mut new(), start).is_some());
        std::fs::remove_file(at("bracket.stl")).unwrap();
        assert!(shaken(&mut new(), start).unwrap().starts_with("ground: the CAD cannot be read any more"));
        write(at("bracket.stl"), "cad").unwrap();
        write(at("plan.toml"), text.replacen("revision = \"", "revision = \"9", 1)).unwrap();
        let mut ground = new();
        assert_eq!(shaken(&mut ground, start), None, "it may be half written");
        assert!(shaken(&mut ground, start + SETTLE).unwrap().starts_with("ground: the plan on the disk has changed"));
    }
}
