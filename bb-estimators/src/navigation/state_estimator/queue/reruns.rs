//! Runs of the engine, and repeated runs.
//!
//! Samples of the IMU are many, and each that is late changes all that came since. They are inserted, and the first place at which
//! one was is remembered. The run is repeated from there when its result is needed: when the estimate is read, when the engine is
//! to run on, and before anything else that depends on it. So the number of runs depends on how often that is, and not on the
//! number of late samples.

use super::Queue;
use crate::navigation::state_estimator::engine::Condition;
use crate::navigation::state_estimator::entry::Key;
use crate::navigation::state_estimator::factor::ProvidedFactor;
use crate::navigation::state_estimator::params::StateEstimatorConfig;

impl<F: ProvidedFactor> Queue<F> {
    /// Notes that the queue has changed at a place that may have been run already.
    pub(super) fn change(&mut self, at: Key) {
        self.changed = Some(self.changed.map_or(at, |before| before.min(at)));
    }

    /// Runs what has changed since the last run, up to where that was. Must be called before the engine or the predictor is read.
    /// Returns whether anything was run.
    pub(in crate::navigation::state_estimator) fn catch_up(&mut self, config: &StateEstimatorConfig) -> bool {
        let has_changed = self.changed.is_some();
        if has_changed {
            self.settle(self.engine.now_ns().unwrap_or(i64::MIN), config);
        }
        has_changed
    }

    /// Inserts inputs other than samples from now on, without running them. Returns whether they were run until now.
    pub(in crate::navigation::state_estimator) fn hold(&mut self) -> bool {
        let were_run = self.held.is_none();
        self.held = self.held.or(Some(i64::MIN));
        were_run
    }

    /// Runs the inputs since [`hold`](Self::hold) together.
    pub(in crate::navigation::state_estimator) fn release(&mut self, config: &StateEstimatorConfig) {
        self.run_held(config);
        self.held = None;
    }

    /// Runs what has changed, and the inputs held so far, as if they had not been held.
    pub(super) fn catch_up_with_held(&mut self, config: &StateEstimatorConfig) {
        self.run_held(config);
        self.catch_up(config);
    }

    fn run_held(&mut self, config: &StateEstimatorConfig) {
        if let Some(held_ns) = &mut self.held
            && *held_ns > i64::MIN
        {
            let until_ns = core::mem::replace(held_ns, i64::MIN);
            self.settle(until_ns, config);
        }
    }

    /// Runs the engine on, through all inputs stamped up to a time, and the predictor from there.
    pub(super) fn settle(&mut self, until_ns: i64, config: &StateEstimatorConfig) {
        self.run(until_ns, config);
        if let Some(newest) = self.newest
            && self.engine.condition() != Condition::Running
        {
            // Nothing predicts, and a start must not be missed.
            self.run(newest.time_ns, config);
        }
        self.forget(config);
        self.predict(config);
    }

    /// Runs the engine on, through all inputs stamped up to a time. What it has passed is run again if it has changed.
    pub(super) fn run(&mut self, until_ns: i64, config: &StateEstimatorConfig) {
        let mut until_ns = until_ns;
        if let Some(from) = self.changed.take()
            && from < self.engine.key()
        {
            until_ns = self.engine.now_ns().map_or(until_ns, |now_ns| now_ns.max(until_ns));
            self.take_back(from);
        }
        // Every input breaks the engine at most once.
        while let Err(broken) = self.run_until(Key::end_of(until_ns), config) {
            self.take_back(broken);
        }
    }

    /// Restores the last copy before an input.
    fn take_back(&mut self, from: Key) {
        while self.copies.len() > 1 && self.copies.back().is_some_and(|copy| copy.key() >= from) {
            self.copies.pop_back();
        }
        if let Some(copy) = self.copies.back() {
            self.engine = copy.clone();
            self.counts.reruns += 1;
        }
    }
}
