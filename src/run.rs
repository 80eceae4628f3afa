//! How a job is run, apart from what it does: progress, cancelling, stages.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// The steps of one scan, in their order; also the keys of `--timings`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Stage {
    /// CAD preparation or loading of its cache.
    Prepare,
    /// Reading the scan's bytes into points.
    Read,
    /// SHA-256 of the scan's bytes.
    Hash,
    /// Belt, colour and luminance filters.
    Background,
    /// Global pose and robust best fit.
    BestFit,
    /// Datum features and the alignment on them.
    Features,
    /// Comparison points.
    Comparison,
    /// Deviation of every kept point.
    Map,
    /// Report files.
    Report,
    /// Finding the places of views.
    Register,
    /// Merging views.
    Merge,
}

impl Stage {
    /// The key in timings files.
    pub fn key(self) -> &'static str {
        match self {
            Stage::Prepare => "prepare",
            Stage::Read => "read",
            Stage::Hash => "hash",
            Stage::Background => "background",
            Stage::BestFit => "best_fit",
            Stage::Features => "features",
            Stage::Comparison => "comparison",
            Stage::Map => "map",
            Stage::Report => "report",
            Stage::Register => "register",
            Stage::Merge => "merge",
        }
    }

    /// What people read while it runs.
    pub fn words(self) -> &'static str {
        match self {
            Stage::Prepare => "preparing the CAD",
            Stage::Read => "reading",
            Stage::Hash => "hashing",
            Stage::Background => "removing the belt",
            Stage::BestFit => "aligning",
            Stage::Features => "measuring datum features",
            Stage::Comparison => "comparing",
            Stage::Map => "drawing the deviation map",
            Stage::Report => "writing reports",
            Stage::Register => "registering the views",
            Stage::Merge => "merging",
        }
    }
}

/// The job was cancelled; nothing is wrong with its input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("cancelled")]
pub struct Cancelled;

/// A flag that anybody may raise and long loops look at.
#[derive(Debug, Clone, Default)]
pub struct CancelToken(Arc<AtomicBool>);

impl CancelToken {
    /// Raises the flag.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether the flag is up.
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Called at each change of stage.
pub type StageObserver<'a> = &'a (dyn Fn(Stage) + Sync);

/// Called with the share of a stage that is done, 0 to 1; from any thread, and not always rising.
pub type ShareObserver<'a> = &'a (dyn Fn(f64) + Sync);

/// How a job runs: who watches it and how it is stopped. It never changes a result.
#[derive(Clone, Copy)]
pub struct RunContext<'a> {
    cancel: Option<&'a CancelToken>,
    observer: Option<StageObserver<'a>>,
    share: Option<ShareObserver<'a>>,
}

impl<'a> RunContext<'a> {
    /// Nobody watches and nobody stops it: tests and tools.
    pub const fn silent() -> RunContext<'static> {
        RunContext { cancel: None, observer: None, share: None }
    }

    /// A job that can be cancelled and reports its stages.
    pub fn new(cancel: &'a CancelToken, observer: StageObserver<'a>) -> Self {
        Self { cancel: Some(cancel), observer: Some(observer), share: None }
    }

    /// The same job, told how much of a stage is done where the stage knows it.
    pub fn with_share(self, share: ShareObserver<'a>) -> Self {
        Self { share: Some(share), ..self }
    }

    /// The same job where a part of the stage has no share to tell.
    pub fn without_share(self) -> Self {
        Self { share: None, ..self }
    }

    /// Tells the share of the stage that is done, 0 to 1.
    pub fn done(&self, share: f64) {
        if let Some(observer) = self.share {
            observer(share);
        }
    }

    /// Tells that a stage begins, and ends the job if it was cancelled.
    pub fn enter(&self, stage: Stage) -> Result<(), Cancelled> {
        if let Some(observer) = self.observer {
            observer(stage);
        }
        self.check()
    }

    /// Ends the job if it was cancelled; cheap enough for every chunk of a loop.
    pub fn check(&self) -> Result<(), Cancelled> {
        match self.cancel {
            Some(token) if token.is_cancelled() => Err(Cancelled),
            _ => Ok(()),
        }
    }
}
