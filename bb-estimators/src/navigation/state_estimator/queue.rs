//! The single queue of all inputs, ordered by stamp, and the only writer that follows it.
//!
//! The engine is run up to the newest input that is not a sample of the IMU. Later IMU samples only feed the predictor. After a late
//! input, [`Past`] runs the engine again: at once, or for a late sample of the IMU once the estimate is needed, see [`reruns`].

use alloc::vec::Vec;

use super::clock::Clock;
use super::engine::{Engine, Left};
use super::entry::{Entry, Payload};
use super::error::{Outcome, Reason};
use super::event::{EventKind, StartedFrom};
use super::factor::ProvidedFactor;
use super::input::{GpsHealth, TakeoffOrigin};
use super::params::{StateEstimatorConfig, ns};
use super::strategy::Predictor;
use crate::attitude::ParamsError;
use crate::navigation::eskf::ImuMean;
use crate::navigation::history::past::{Key, Past};
use crate::navigation::refusal::Refusal;

mod reruns;
mod samples;

/// Number of copies of the engine: as many as cover the lateness, at the time between them.
const COPIES: usize = 8;

/// Counts of inputs by how they arrived.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct QueueCounts {
    /// Inserted before others.
    pub late: u64,
    /// Older than the window, and refused.
    pub too_old: u64,
    /// Stamped in the future, and refused.
    pub in_the_future: u64,
    /// Already present, and refused.
    pub duplicates: u64,
    /// Refused because there was no room.
    pub overflows: u64,
    /// Not finite or otherwise invalid, and refused.
    pub invalid: u64,
    /// Number of times the engine was run again from an earlier copy.
    pub reruns: u64,
    /// Samples of the IMU that were dropped early because there was no room for more.
    pub dropped: u64,
    /// Number of times the clock of the IMU was set back and the estimator continued on the new clock.
    pub set_back: u64,
}

/// Reports of the queue.
#[derive(Clone, Copy, Debug)]
pub(super) enum Told {
    /// An event, with its time.
    Event(i64, EventKind),
    /// A keyframe has left the window.
    Left(Left),
}

/// See the module.
#[derive(Debug)]
pub(super) struct Queue<F: ProvidedFactor> {
    /// While it has changed, the predictor does not run on.
    past: Past<Engine<F>, Entry<F>, 0, 0, 0>,
    /// While inputs are added together: the time up to which they have to be run.
    held: Option<i64>,
    predictor: Option<Predictor>,
    /// The first sample, until another stamp agrees with its own.
    first: Option<ImuMean>,
    clock: Clock,
    counts: QueueCounts,
    pub(super) news: News,
}

/// Reports, and those already made that a repeated run would make again.
#[derive(Debug)]
pub(super) struct News {
    /// Starts that may be run again.
    started: Vec<(i64, StartedFrom)>,
    /// The last failure by a sample.
    broken: Option<(i64, Reason)>,
    /// Time of the last keyframe that has left the window.
    pub(super) left_ns: i64,
    pub(super) told: Vec<Told>,
}

impl<F: ProvidedFactor> Queue<F> {
    pub(super) fn new(config: &StateEstimatorConfig) -> Result<Self, ParamsError> {
        let [samples, inputs] = config.params.room();
        Ok(Self {
            past: Past::new(Engine::new(config)?, Key::FIRST, None, [samples, inputs, COPIES]),
            held: None,
            predictor: None,
            first: None,
            clock: Clock::default(),
            counts: QueueCounts::default(),
            news: News { started: Vec::new(), broken: None, left_ns: i64::MIN, told: Vec::new() },
        })
    }

    /// Returns whether there has been no input yet.
    pub(super) fn is_empty(&self) -> bool {
        self.newest().is_none() && self.first.is_none() && self.past.inputs.len() == 0
    }

    pub(super) fn set_origin(&mut self, origin: &TakeoffOrigin) {
        self.past.each(|engine| engine.set_origin(origin));
    }

    /// The engine as of the last run, see [`catch_up`](Self::catch_up).
    pub(super) fn engine(&self) -> &Engine<F> {
        &self.past.now.state
    }

    pub(super) fn engine_mut(&mut self) -> &mut Engine<F> {
        &mut self.past.now.state
    }

    /// The predictor as of the last run, see [`catch_up`](Self::catch_up).
    pub(super) fn predictor(&self) -> Option<&Predictor> {
        self.predictor.as_ref()
    }

    /// The newest sample of the IMU.
    pub(super) fn newest(&self) -> Option<&ImuMean> {
        self.past.samples.last()
    }

    pub(super) fn counts(&self) -> &QueueCounts {
        &self.counts
    }

    /// Result of an input. `None` while it waits.
    pub(super) fn outcome(&self, key: Key) -> Option<Outcome> {
        self.past.input(key)?.outcome
    }

    /// Numbers of samples, inputs and copies held.
    #[cfg(test)]
    pub(super) fn held(&self) -> [usize; 3] {
        [self.past.samples.len(), self.past.inputs.len(), self.past.copies.len()]
    }

    fn count(&mut self, reason: Reason) -> Reason {
        let counts = &mut self.counts;
        match reason {
            Reason::Duplicate => counts.duplicates += 1,
            Reason::Overflow => counts.overflows += 1,
            Reason::Refused(Refusal::TooOld { .. }) => counts.too_old += 1,
            Reason::Refused(Refusal::InTheFuture { .. }) => counts.in_the_future += 1,
            Reason::Refused(_) => counts.invalid += 1,
            Reason::Gate(_) | Reason::Overruled { .. } | Reason::Bridged | Reason::NotConverged => {}
        }
        reason
    }

    /// Counts an input that was refused before it reached the queue.
    pub(super) fn refuse(&mut self, refusal: Refusal) -> Reason {
        self.count(refusal.into())
    }

    /// Takes a sample of the IMU. Returns whether it waits: the one after the first shows whether the stamp of the first can be believed.
    /// One that follows a gap is taken as well, and [`Reason::Bridged`].
    pub(super) fn add_sample(&mut self, sample: &ImuMean, config: &StateEstimatorConfig) -> Result<bool, Reason> {
        let result = self.place_sample(sample, config);
        result.map_err(|reason| self.count(reason))
    }

    /// Returns whether an input may belong to the time of a sample.
    fn is_near(&self, input_ns: i64, sample_ns: i64, config: &StateEstimatorConfig) -> bool {
        let (oldest_ns, latest_ns) = (
            sample_ns.saturating_sub(ns(config.params.lateness)),
            sample_ns.saturating_add(ns(config.params.lead)),
        );
        (oldest_ns..=latest_ns).contains(&input_ns)
    }

    /// Adds an input that is not a sample of the IMU. Returns its key.
    pub(super) fn add(
        &mut self,
        time_ns: i64,
        payload: Payload<F>,
        frames: &[i64],
        config: &StateEstimatorConfig,
    ) -> Result<Key, Reason> {
        let is_alarm = payload.is_alarm();
        let result = self.place(time_ns, payload, frames, config);
        result.map_err(|reason| {
            if is_alarm && reason != Reason::Duplicate {
                self.alarm(config);
            }
            self.count(reason)
        })
    }

    /// Adds a report of spoofing at the newest sample: its own stamp was refused, or there was no room.
    fn alarm(&mut self, config: &StateEstimatorConfig) {
        let time_ns = self.newest().map_or(i64::MIN, |newest| newest.time_ns);
        let payload = Payload::Health(GpsHealth::Spoofed);
        let key = payload.key(time_ns);
        if self.past.input(key).is_some() {
            return;
        }
        // Reports without end leave an eighth of the room for relative poses and anchors, which are fatal where they find none.
        let most = self.past.inputs.room() - self.past.inputs.room() / 8;
        if self.past.inputs.len() >= most {
            // Rather late inputs are lost than an alarm.
            self.settle(time_ns, config);
            self.past.copy_now();
            self.trim();
        }
        if self.past.inputs.len() >= most || !self.past.reaches(key) {
            // No run begins before it.
            self.past.each(|engine| engine.alarm(time_ns, config));
            return;
        }
        // Its sender has been told otherwise.
        self.past.insert(key, Entry { payload, outcome: Some(Ok(None)), rejection: None });
        self.run_or_hold(time_ns, config);
    }

    /// Runs the engine through the inputs up to a time, unless they are to be run together with others.
    fn run_or_hold(&mut self, until_ns: i64, config: &StateEstimatorConfig) {
        match &mut self.held {
            Some(held_ns) => *held_ns = until_ns.max(*held_ns),
            None => self.settle(until_ns, config),
        }
    }

    fn place(
        &mut self,
        time_ns: i64,
        payload: Payload<F>,
        frames: &[i64],
        config: &StateEstimatorConfig,
    ) -> Result<Key, Reason> {
        let newest_ns = self.newest().map(|newest| newest.time_ns);
        let oldest_ns =
            newest_ns.map_or(i64::MIN, |newest_ns| newest_ns.saturating_sub(ns(config.params.lateness)));
        let key = payload.key(time_ns);
        // Within the lateness there is a copy, unless samples were dropped or the clock was set back.
        if time_ns < oldest_ns || !self.past.reaches(key) {
            return Err(Refusal::TooOld { time_ns }.into());
        }
        if newest_ns.is_some_and(|newest_ns| time_ns > newest_ns.saturating_add(ns(config.params.lead))) {
            return Err(Refusal::InTheFuture { time_ns }.into());
        }
        if self.past.input(key).is_some() {
            return Err(Reason::Duplicate);
        }
        let room = self.past.inputs.room();
        // The flight controller alone may fill three quarters, which at the configured rate it does not.
        let room = if payload.kind().is_of_window() { room } else { room - room / 4 };
        if self.past.inputs.len() + 1 + frames.len() > room {
            return Err(Reason::Overflow);
        }
        let is_past = |at_ns: i64| newest_ns.is_some_and(|newest_ns| at_ns <= newest_ns);
        let entry = |payload| Entry { payload, outcome: None, rejection: None };
        let mut until_ns = Some(time_ns).filter(|time_ns| is_past(*time_ns));
        let mut is_late = self.past.insert(key, entry(payload));
        for frame_ns in frames.iter().filter(|frame_ns| **frame_ns >= oldest_ns) {
            let frame = Payload::<F>::Frame.key(*frame_ns);
            if self.past.reaches(frame) && self.past.input(frame).is_none() {
                is_late |= self.past.insert(frame, entry(Payload::Frame));
                // The relative pose may have to wait for the IMU, but it begins where this is.
                until_ns = until_ns.max(Some(*frame_ns).filter(|frame_ns| is_past(*frame_ns)));
            }
        }
        self.counts.late += u64::from(is_late);
        if let Some(until_ns) = until_ns {
            self.run_or_hold(until_ns, config);
        }
        Ok(key)
    }

    /// The time at which a sample begins.
    fn since_ns(&self, index: usize) -> Option<i64> {
        self.past.since_ns(index).or(self.engine().begun_ns())
    }

    /// The reading before a sample, at the time at which the sample begins.
    fn before(&self, index: usize) -> Option<ImuMean> {
        let last = self.past.samples.get(index.saturating_sub(1))?;
        Some(ImuMean { time_ns: self.since_ns(index)?, ..*last })
    }

    /// Drops the copies that no late input needs.
    fn forget(&mut self, config: &StateEstimatorConfig) {
        let Some(newest) = self.newest() else { return };
        let oldest_ns = newest.time_ns.saturating_sub(ns(config.params.lateness));
        while self.past.copies.get(1).is_some_and(|copy| copy.key.time_ns < oldest_ns) {
            self.past.copies.pop_front();
        }
        self.trim();
    }

    /// Drops entries that no copy needs to run on or to predict.
    fn trim(&mut self) {
        self.past.trim();
        let Some(oldest) = self.past.copies.get(0) else { return };
        let kept_ns = oldest.state.needed_ns().min(self.past.now.state.needed_ns());
        // The start of the oldest copy is that of any run.
        let (from_ns, last) = (oldest.key.time_ns, oldest.state.started());
        self.news.started.retain(|started| started.0 >= from_ns || Some(*started) == last);
        // The sample before the first needed one shows whether that one follows a gap.
        while self.past.samples.get(1).is_some_and(|sample| sample.time_ns <= kept_ns) {
            self.past.drop_sample();
        }
    }

    /// Restarts the prediction at the newest estimate.
    fn predict(&mut self) {
        self.predictor = None;
        let Some(mut predictor) = self.engine().predictor() else { return };
        let first = self.past.samples.count_while(|sample| sample.time_ns <= predictor.time_ns());
        for (index, sample) in self.past.samples.iter().enumerate().skip(first) {
            // An input may have divided the first.
            if self.before(index).is_none_or(|last| predictor.propagate(&last, sample).is_err()) {
                return;
            }
        }
        self.predictor = Some(predictor);
    }
}

impl News {
    fn tell(&mut self, time_ns: i64, kind: EventKind) {
        self.told.push(Told::Event(time_ns, kind));
    }

    /// Collects the reports of the engine. Those already made in an earlier run are skipped.
    fn look<F: ProvidedFactor>(&mut self, engine: &mut Engine<F>) {
        while let Some(left) = engine.take_left() {
            if left.pose.time_ns > self.left_ns {
                self.left_ns = left.pose.time_ns;
                self.told.push(Told::Left(left));
            }
        }
        if let Some(started) = engine.started()
            && !self.started.contains(&started)
        {
            self.started.push(started);
            let (time_ns, from) = started;
            self.tell(time_ns, EventKind::Started { from });
        }
    }
}
