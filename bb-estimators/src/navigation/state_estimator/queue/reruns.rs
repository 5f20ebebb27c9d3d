//! Runs of the engine, and repeated runs.
//!
//! Samples of the IMU are many, and each that is late changes all that came since. They are inserted, and the run is repeated from the
//! first place at which one was, when its result is needed: when the estimate is read, when the engine is to run on, and before
//! anything else that depends on it. So the number of runs depends on how often that is, and not on the number of late samples.

use super::{COPIES, News, Queue};
use crate::navigation::eskf::ImuMean;
use crate::navigation::history::past::{Key, Run};
use crate::navigation::numbers::COPY_INTERVAL_NS;
use crate::navigation::state_estimator::engine::{Condition, Engine};
use crate::navigation::state_estimator::entry::Entry;
use crate::navigation::state_estimator::error::EstimatorError;
use crate::navigation::state_estimator::event::{EventKind, InputKind};
use crate::navigation::state_estimator::factor::ProvidedFactor;
use crate::navigation::state_estimator::params::{StateEstimatorConfig, ns};

impl<F: ProvidedFactor> Queue<F> {
    /// Runs what has changed since the last run, up to where that was. Must be called before the engine or the predictor is read.
    /// Returns whether anything was run.
    pub(in crate::navigation::state_estimator) fn catch_up(&mut self, config: &StateEstimatorConfig) -> bool {
        let has_changed = self.past.changed.is_some();
        if has_changed {
            self.settle(self.engine().now_ns().unwrap_or(i64::MIN), config);
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
        if let Some(until_ns) = self.held.take().filter(|until_ns| *until_ns > i64::MIN) {
            self.settle(until_ns, config);
        }
    }

    /// Runs the engine on, through all inputs stamped up to a time, and the predictor from there.
    pub(super) fn settle(&mut self, until_ns: i64, config: &StateEstimatorConfig) {
        self.run(until_ns, config);
        if let Some(newest) = self.newest().copied()
            && self.engine().condition() != Condition::Running
        {
            // Nothing predicts, and a start must not be missed.
            self.run(newest.time_ns, config);
        }
        self.forget(config);
        self.predict();
    }

    /// Runs the engine on, through all inputs stamped up to a time. What it has passed is run again if it has changed.
    pub(super) fn run(&mut self, until_ns: i64, config: &StateEstimatorConfig) {
        let mut flight = Flight { config, news: &mut self.news };
        self.counts.reruns += self.past.run(Key::end_of(until_ns), &mut flight);
    }
}

/// A run of the engine, and what it tells.
struct Flight<'a> {
    config: &'a StateEstimatorConfig,
    news: &'a mut News,
}

impl<F: ProvidedFactor> Run<Engine<F>, Entry<F>> for Flight<'_> {
    fn advance(&mut self, engine: &mut Engine<F>, until_ns: i64, sample: &ImuMean, since_ns: Option<i64>) {
        if engine.now_ns().is_none() && until_ns < sample.time_ns {
            // The first sample has no part before its end.
            return;
        }
        let was = engine.condition();
        let since_ns = since_ns.or(engine.begun_ns()).or(engine.now_ns()).unwrap_or(sample.time_ns);
        if let Err(reason) = engine.advance(until_ns, sample, since_ns, self.config)
            && engine.condition() != was
        {
            if self.news.broken.is_none_or(|(at_ns, before)| at_ns != until_ns || !before.is_alike(&reason)) {
                self.news.tell(until_ns, EventKind::Fatal { input: InputKind::Imu, reason });
            }
            self.news.broken = Some((until_ns, reason));
        }
        self.news.look(engine);
    }

    fn apply(&mut self, engine: &mut Engine<F>, Key { time_ns, .. }: Key, entry: &mut Entry<F>) -> bool {
        if matches!(entry.outcome, Some(Err(EstimatorError::Fatal(_)))) {
            return true;
        }
        let (outcome, rejection) = engine.apply(time_ns, entry, self.config);
        let news = entry.became(outcome, rejection);
        news.into_iter().flatten().for_each(|kind| self.news.tell(time_ns, kind));
        if matches!(outcome, Err(EstimatorError::Fatal(_))) {
            return false;
        }
        self.news.look(engine);
        true
    }

    fn is_due(&self, last: &Engine<F>, engine: &Engine<F>, _: usize) -> bool {
        let apart_ns = (ns(self.config.params.lateness) / (COPIES as i64 - 2)).max(COPY_INTERVAL_NS);
        let is_apart = |now_ns: i64| last.now_ns().is_none_or(|last_ns| now_ns.saturating_sub(last_ns) >= apart_ns);
        engine.now_ns().is_some_and(is_apart)
    }
}
