//! Timings of a scan, taken from its changes of stage. The only place where a job looks at a clock.

use crate::run::Stage;
use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Watches the stages of one scan.
#[derive(Debug)]
pub struct StageClock {
    started: Instant,
    changes: Mutex<Vec<(Stage, Instant)>>,
}

impl Default for StageClock {
    fn default() -> Self {
        Self { started: Instant::now(), changes: Mutex::new(Vec::new()) }
    }
}

impl StageClock {
    /// Notes that a stage begins now.
    pub fn enter(&self, stage: Stage) {
        self.changes().push((stage, Instant::now()));
    }

    /// Milliseconds a stage, in the stages' order, and in all until now. A stage entered twice counts both times.
    pub fn milliseconds(&self) -> (BTreeMap<Stage, f64>, f64) {
        let now = Instant::now();
        let changes = self.changes();
        let mut stages = BTreeMap::new();
        for (k, (stage, begin)) in changes.iter().enumerate() {
            let end = changes.get(k + 1).map_or(now, |next| next.1);
            *stages.entry(*stage).or_insert(0.0) += (end - *begin).as_secs_f64() * 1e3;
        }
        (stages, (now - self.started).as_secs_f64() * 1e3)
    }

    /// Since the scan was begun.
    pub fn elapsed(&self) -> Duration {
        self.started.elapsed()
    }

    /// A panic in a job never leaves the list half-changed: a push either happened or not.
    fn changes(&self) -> MutexGuard<'_, Vec<(Stage, Instant)>> {
        self.changes.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// One line of a timings file: every stage's milliseconds, 0 for a stage that was not reached; `prepare` only where given.
pub fn timings_line(scan: &str, clock: &StageClock, prepare_ms: Option<f64>) -> String {
    const STAGES: [Stage; 8] = [
        Stage::Read,
        Stage::Hash,
        Stage::Background,
        Stage::BestFit,
        Stage::Features,
        Stage::Comparison,
        Stage::Map,
        Stage::Report,
    ];
    // Only of parts that are made of views.
    const OF_VIEWS: [Stage; 2] = [Stage::Register, Stage::Merge];
    let (stages, total) = clock.milliseconds();
    let round = |ms: f64| (ms * 1e3).round() / 1e3;
    let mut object = serde_json::Map::new();
    object.insert("scan".into(), scan.into());
    if let Some(ms) = prepare_ms {
        object.insert(Stage::Prepare.key().into(), round(ms).into());
    }
    let entered = OF_VIEWS.into_iter().filter(|stage| stages.contains_key(stage));
    for stage in STAGES.into_iter().chain(entered) {
        object.insert(stage.key().into(), round(stages.get(&stage).copied().unwrap_or(0.0)).into());
    }
    object.insert("total".into(), round(total).into());
    serde_json::Value::Object(object).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_add_up_to_no_more_than_the_total() {
        let clock = StageClock::default();
        clock.enter(Stage::Read);
        clock.enter(Stage::Hash);
        clock.enter(Stage::Read);
        let (stages, total) = clock.milliseconds();
        assert_eq!(stages.keys().copied().collect::<Vec<_>>(), [Stage::Read, Stage::Hash]);
        assert!(stages.values().sum::<f64>() <= total);
    }

    #[test]
    fn the_line_has_every_key_of_the_contract() {
        let clock = StageClock::default();
        clock.enter(Stage::Read);
        let line = timings_line("1.ply", &clock, Some(12.3456));
        let value: serde_json::Value = serde_json::from_str(&line).unwrap();
        for key in
            ["prepare", "read", "hash", "background", "best_fit", "features", "comparison", "map", "report", "total"]
        {
            assert!(value[key].as_f64().is_some(), "{key} in {line}");
        }
        assert_eq!(value["prepare"], 12.346);
        assert!(!timings_line("2.ply", &clock, None).contains("prepare"));
    }
}
