//! How much of a registration is done, by about how long its steps take.

use crate::run::RunContext;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

/// Steps, each as the share of the whole at which it begins and that at which it ends, as measured on a hundred views of a flat part.
pub(super) const SURFACES: Range<f64> = 0.0..0.22;
pub(super) const NEIGHBOURS: Range<f64> = 0.22..0.65;
pub(super) const AGAIN: Range<f64> = 0.65..0.68;
pub(super) const TOGETHER: Range<f64> = 0.68..0.90;
pub(super) const TELLING: Range<f64> = 0.90..1.0;

/// A step of many pieces, done in any order.
pub(super) struct Step<'a> {
    run: RunContext<'a>,
    share: Range<f64>,
    pieces: usize,
    done: AtomicUsize,
    /// What is left where nobody knows the number of pieces, as bits.
    left: AtomicU64,
}

impl<'a> Step<'a> {
    pub(super) fn new(run: &RunContext<'a>, share: Range<f64>, pieces: usize) -> Self {
        run.done(share.start);
        Self { run: *run, share, pieces, done: AtomicUsize::new(0), left: AtomicU64::new(1_f64.to_bits()) }
    }

    /// One more is done.
    pub(super) fn one(&self) {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        self.tell(done as f64 / self.pieces.max(1) as f64);
    }

    /// One more is done of nobody knows how many, which leaves this part of what was left.
    pub(super) fn leaves(&self, part: f64) {
        let less = |left: u64| Some((f64::from_bits(left) * part).to_bits());
        let before = self.left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, less);
        let before = f64::from_bits(before.unwrap_or_else(|before| before));
        self.tell(1.0 - before * part);
    }

    fn tell(&self, part: f64) {
        self.run.done(self.share.start + part.min(1.0) * (self.share.end - self.share.start));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::CancelToken;
    use crate::stitch::View;
    use crate::stitch::register::synthetic_tests::{ONE_DEGREE, Part, look, prior};
    use crate::stitch::register::{Options, register};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use std::sync::Mutex;

    /// Each view and each pair is a piece: with and without poses, three views and two pairs or more.
    #[test]
    fn every_step_tells_how_far_it_is() {
        let at = [[0.0, 0.0], [9.0, 2.0], [4.0, 9.0]];
        let looks: Vec<_> =
            (0..3).map(|k| look(&Part::formed(), &format!("v{k}"), at[k], 18.0, 0.4, 0.01, 40 + k as u64)).collect();
        let views: Vec<View> = looks.iter().map(|look| look.view.clone()).collect();
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let priors: Vec<_> = looks.iter().map(|l| Some(prior(l, 0.3, ONE_DEGREE, &mut rng))).collect();
        for priors in [priors, vec![None; 3]] {
            let told = Mutex::new(Vec::new());
            let hear = |share: f64| told.lock().unwrap().push(share);
            let stop = CancelToken::default();
            let run = RunContext::new(&stop, &|_| {}).with_share(&hear);
            register(&views, &priors, &Options::default(), &run).unwrap();
            let told = told.into_inner().unwrap();
            assert!(told.iter().all(|share| (0.0..=1.0).contains(share)), "{told:?}");
            let within = |step: Range<f64>| told.iter().filter(|t| **t > step.start && **t <= step.end).count();
            assert!(
                within(SURFACES) >= 3 && within(NEIGHBOURS) >= 2 && within(TOGETHER) >= 2 && within(TELLING) >= 2,
                "{told:?}"
            );
            assert!(told.iter().copied().fold(0.0, f64::max) > 1.0 - 1e-9, "{told:?}");
        }
    }
}
