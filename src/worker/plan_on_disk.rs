//! Whether the plan on the disk is still the one that scans are held to.

use crate::diagnostic::{Diagnostic, Severity};
use crate::plan::{self, Plan};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Time between two looks while nothing else happens.
const LOOK: Duration = Duration::from_secs(1);

/// What a look showed.
#[derive(Debug)]
pub(super) enum PlanNow {
    /// What it was.
    Same,
    /// It is another one, perhaps half written yet: nothing is held to either of them.
    Settling,
    /// Another one, in words.
    Another(Box<Diagnostic>),
    /// It cannot be read or used any more: why.
    Unusable(Box<Diagnostic>),
}

/// The plan as it was read, to be compared with its file.
#[derive(Debug)]
pub(super) struct PlanOnDisk {
    path: PathBuf,
    sha256: String,
    revision: String,
    looked: Option<Instant>,
    /// What lay there at the last look, where it was another one, and since when.
    other: Option<(String, Instant)>,
}

impl PlanOnDisk {
    /// Of the plan that was read from a file.
    pub fn of(plan: &Plan, path: PathBuf) -> Self {
        let (sha256, revision) = (plan.sha256.clone(), plan.part.revision.clone());
        Self { path, sha256, revision, looked: None, other: None }
    }

    /// Whether it is time for another look.
    pub fn is_due(&self, now: Instant) -> bool {
        self.other.is_some() || self.looked.is_none_or(|then| now.duration_since(then) >= LOOK)
    }

    /// Looks at the file. Another plan is told as one when it was the same for so long.
    pub fn look(&mut self, now: Instant, settle: Duration) -> PlanNow {
        self.looked = Some(now);
        let loaded = plan::load(&self.path);
        let found = loaded.draft.sha256;
        // Folders that are away make a plan unusable, too, and are waited for elsewhere.
        if found == self.sha256 {
            self.other = None;
            return PlanNow::Same;
        }
        let since = match &self.other {
            Some((other, since)) if *other == found => *since,
            _ => now,
        };
        self.other = Some((found, since));
        if now.duration_since(since) < settle {
            return PlanNow::Settling;
        }
        match loaded.plan {
            Some(plan) => PlanNow::Another(Box::new(self.another(&plan))),
            None => {
                let why = loaded.problems.into_iter().find(|p| p.severity == Severity::Error);
                PlanNow::Unusable(Box::new(
                    why.unwrap_or_else(|| Diagnostic::error("the plan cannot be used").in_file(&self.path)),
                ))
            }
        }
    }

    fn another(&self, plan: &Plan) -> Diagnostic {
        let (old, new) = (&self.revision, &plan.part.revision);
        let told = if new.is_empty() || new == old {
            "the plan on the disk has changed".to_owned()
        } else {
            format!("the plan on the disk has changed: it is revision {new} now")
        };
        Diagnostic::warning(told).in_file(&self.path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAN: &str = "schema = 1\n[part]\nname = \"a\"\nrevision = \"D\"\nthickness_mm = 1.0\n";

    /// What is half written is neither the old plan nor the new one; what is gone is no plan.
    #[test]
    fn a_plan_that_changes_settles_first() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("plan.toml");
        std::fs::write(&path, PLAN).unwrap();
        let sha256 = plan::load(&path).draft.sha256;
        let mut on_disk = PlanOnDisk { path: path.clone(), sha256, revision: "D".into(), looked: None, other: None };
        let start = Instant::now();
        let mut look = |s: u64| on_disk.look(start + Duration::from_secs(s), Duration::from_secs(2));
        // It names no CAD and cannot be used, but it is the one that was read.
        assert!(matches!(look(0), PlanNow::Same));
        std::fs::write(&path, PLAN.replace('D', "E")).unwrap();
        assert!(matches!(look(1), PlanNow::Settling) && matches!(look(2), PlanNow::Settling));
        assert!(matches!(look(3), PlanNow::Unusable(_)));
        std::fs::write(&path, PLAN).unwrap();
        assert!(matches!(look(4), PlanNow::Same));
        std::fs::remove_file(&path).unwrap();
        assert!(matches!(look(5), PlanNow::Settling));
        assert!(matches!(look(7), PlanNow::Unusable(_)));
    }
}
