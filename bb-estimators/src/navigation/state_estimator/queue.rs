//! The single queue of all inputs, ordered by stamp, and the only writer that follows it.
//!
//! The engine is run up to the newest input that is not a sample of the IMU. Later IMU samples only feed the predictor. A late
//! input is inserted at its place, and the engine is run again from its last copy before that input: at once, or for a late sample
//! of the IMU once the estimate is needed, see [`reruns`]. The result equals that of inputs that arrive in order, to the last bit.

use alloc::collections::VecDeque;
use alloc::vec::Vec;

use super::clock::Clock;
use super::engine::Engine;
use super::entry::{Entry, Key, Payload};
use super::error::{EstimatorError, Outcome, Reason};
use super::event::{EventKind, InputKind, StartedFrom};
use super::factor::ProvidedFactor;
use super::input::TakeoffOrigin;
use super::label::Sources;
use super::params::{Rooms, StateEstimatorConfig, ns};
use super::strategy::{Pose, Predictor};
use crate::attitude::ParamsError;
use crate::navigation::eskf::ImuMean;
use crate::navigation::refusal::Refusal;

mod reruns;
mod samples;

/// Number of copies of the engine: as many as cover the lateness, at the time between them.
const COPIES: usize = 8;

/// Shortest time between two copies, ns. A copy costs as much as some samples.
const SHORTEST_NS: i64 = 100_000_000;

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
    Left(Pose, Sources),
}

/// See the module.
#[derive(Debug)]
pub(super) struct Queue<F: ProvidedFactor> {
    samples: VecDeque<ImuMean>,
    /// The time of the last sample that was dropped: the first one held begins there.
    dropped_ns: Option<i64>,
    inputs: VecDeque<Entry<F>>,
    engine: Engine<F>,
    copies: VecDeque<Engine<F>>,
    /// The first place at which the queue has changed since the engine and the predictor were run. While there is one, neither
    /// runs on, and no copy is made.
    changed: Option<Key>,
    /// While inputs are added together: the time up to which they have to be run.
    held: Option<i64>,
    predictor: Option<Predictor>,
    newest: Option<ImuMean>,
    /// The first sample, until another stamp agrees with its own.
    first: Option<ImuMean>,
    clock: Clock,
    rooms: Rooms,
    counts: QueueCounts,
    /// Starts that were told and may be run again.
    started: Vec<(i64, StartedFrom)>,
    /// The last failure by a sample that was told.
    broken: Option<(i64, Reason)>,
    left_ns: i64,
    pub(super) told: Vec<Told>,
}

impl<F: ProvidedFactor> Queue<F> {
    pub(super) fn new(config: &StateEstimatorConfig) -> Result<Self, ParamsError> {
        let engine = Engine::new(config)?;
        let mut copies = VecDeque::with_capacity(COPIES + 2);
        copies.push_back(engine.clone());
        let rooms = Rooms::of(&config.params);
        Ok(Self {
            samples: VecDeque::with_capacity(rooms.samples),
            dropped_ns: None,
            inputs: VecDeque::with_capacity(rooms.inputs),
            engine,
            copies,
            changed: None,
            held: None,
            predictor: None,
            newest: None,
            first: None,
            clock: Clock::default(),
            rooms,
            counts: QueueCounts::default(),
            started: Vec::new(),
            broken: None,
            left_ns: i64::MIN,
            told: Vec::new(),
        })
    }

    /// Returns whether there has been no input yet.
    pub(super) fn is_empty(&self) -> bool {
        self.newest.is_none() && self.first.is_none() && self.inputs.is_empty()
    }

    pub(super) fn set_origin(&mut self, origin: &TakeoffOrigin) {
        self.engine.set_origin(origin);
        self.copies.iter_mut().for_each(|copy| copy.set_origin(origin));
    }

    /// The engine as of the last run, see [`catch_up`](Self::catch_up).
    pub(super) fn engine(&self) -> &Engine<F> {
        &self.engine
    }

    pub(super) fn engine_mut(&mut self) -> &mut Engine<F> {
        &mut self.engine
    }

    /// The predictor as of the last run, see [`catch_up`](Self::catch_up).
    pub(super) fn predictor(&self) -> Option<&Predictor> {
        self.predictor.as_ref()
    }

    /// The newest sample of the IMU.
    pub(super) fn newest(&self) -> Option<&ImuMean> {
        self.newest.as_ref()
    }

    pub(super) fn counts(&self) -> &QueueCounts {
        &self.counts
    }

    /// Result of an input. `None` while it waits.
    pub(super) fn outcome(&self, key: Key) -> Option<Outcome> {
        let index = self.inputs.binary_search_by(|entry| entry.key.cmp(&key)).ok()?;
        self.inputs.get(index)?.outcome
    }

    /// Numbers of samples, inputs and copies held.
    #[cfg(test)]
    pub(super) fn held(&self) -> [usize; 3] {
        [self.samples.len(), self.inputs.len(), self.copies.len()]
    }

    fn tell(&mut self, time_ns: i64, kind: EventKind) {
        self.told.push(Told::Event(time_ns, kind));
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

    /// Returns whether there is a copy from before an input. Within the lateness there always is, unless samples were dropped or the clock
    /// was set back.
    fn reaches(&self, key: Key) -> bool {
        let is_before =
            |copy: &Engine<F>| copy.key() < key && copy.now_ns().is_none_or(|now_ns| now_ns <= key.time_ns);
        self.copies.front().is_some_and(is_before)
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
                self.block(config);
            }
            self.count(reason)
        })
    }

    /// Blocks the gate: a report of spoofing was refused.
    fn block(&mut self, config: &StateEstimatorConfig) {
        // Fixes that came before the report remain in the estimate: a run from a blocked engine drops them.
        self.catch_up_with_held(config);
        let until_ns = self.newest.map(|newest| newest.time_ns);
        self.engine.block(until_ns);
        self.copies.iter_mut().for_each(|copy| copy.block(until_ns));
    }

    fn place(
        &mut self,
        time_ns: i64,
        payload: Payload<F>,
        frames: &[i64],
        config: &StateEstimatorConfig,
    ) -> Result<Key, Reason> {
        let newest_ns = self.newest.map(|newest| newest.time_ns);
        let oldest_ns =
            newest_ns.map_or(i64::MIN, |newest_ns| newest_ns.saturating_sub(ns(config.params.lateness)));
        let key = payload.key(time_ns);
        if time_ns < oldest_ns || !self.reaches(key) {
            return Err(Refusal::TooOld { time_ns }.into());
        }
        if newest_ns.is_some_and(|newest_ns| time_ns > newest_ns.saturating_add(ns(config.params.lead))) {
            return Err(Refusal::InTheFuture { time_ns }.into());
        }
        if self.inputs.binary_search_by(|entry| entry.key.cmp(&key)).is_ok() {
            return Err(Reason::Duplicate);
        }
        let room = if payload.kind().is_of_window() { self.rooms.inputs } else { self.rooms.of_controller() };
        if self.inputs.len() + 1 + frames.len() > room {
            return Err(Reason::Overflow);
        }
        let is_past = |at_ns: i64| newest_ns.is_some_and(|newest_ns| at_ns <= newest_ns);
        let mut first = key;
        let mut until_ns = Some(time_ns).filter(|time_ns| is_past(*time_ns));
        self.insert(key, payload);
        for frame_ns in frames.iter().filter(|frame_ns| **frame_ns >= oldest_ns) {
            let frame = Payload::<F>::Frame.key(*frame_ns);
            if self.reaches(frame) && self.inputs.binary_search_by(|entry| entry.key.cmp(&frame)).is_err() {
                self.insert(frame, Payload::Frame);
                first = first.min(frame);
                // The relative pose may have to wait for the IMU, but it begins where this is.
                until_ns = until_ns.max(Some(*frame_ns).filter(|frame_ns| is_past(*frame_ns)));
            }
        }
        if first < self.engine.key() {
            self.counts.late += 1;
            self.change(first);
        }
        match (&mut self.held, until_ns) {
            (Some(held_ns), Some(until_ns)) => *held_ns = until_ns.max(*held_ns),
            (None, Some(until_ns)) => self.settle(until_ns, config),
            (_, None) => {}
        }
        Ok(key)
    }

    fn insert(&mut self, key: Key, payload: Payload<F>) {
        let index = self.inputs.partition_point(|entry| entry.key < key);
        self.inputs.insert(index, Entry { key, payload, outcome: None, rejection: None });
    }

    /// Runs the engine on. An input that breaks it is marked, and the engine must be restored from a copy.
    fn run_until(&mut self, until: Key, config: &StateEstimatorConfig) -> Result<(), Key> {
        let key = self.engine.key();
        let mut sample_index = self.samples.partition_point(|sample| Key::of_sample(sample.time_ns) <= key);
        let mut input_index = self.inputs.partition_point(|entry| entry.key <= key);
        loop {
            // Also on the way of a run that is repeated: it has dropped those after the late input, and the next one may be as late.
            self.keep_copy(config);
            let sample = self.samples.get(sample_index).copied();
            let sample_key = sample.map(|sample| Key::of_sample(sample.time_ns));
            let input_key = self.inputs.get(input_index).map(|entry| entry.key);
            let is_input = match (sample_key, input_key) {
                (Some(sample), Some(input)) => input < sample,
                // Nothing is known after the newest sample.
                (None, Some(input)) => self.newest.is_some_and(|newest| input.time_ns <= newest.time_ns),
                _ => false,
            };
            let Some(next) = (if is_input { input_key } else { sample_key }) else { break };
            if next > until {
                break;
            }
            let since_ns = self.since_ns(sample_index);
            if !is_input {
                if let Some(sample) = sample {
                    self.advance(sample.time_ns, &sample, since_ns, config);
                }
                sample_index += 1;
                continue;
            }
            if self.engine.now_ns().is_some_and(|now_ns| now_ns < next.time_ns)
                && let Some(sample) = sample
            {
                // The sample is a mean, so its parts have the same values.
                self.advance(next.time_ns, &sample, since_ns, config);
            }
            self.apply(input_index, config)?;
            input_index += 1;
        }
        Ok(())
    }

    /// The time at which a sample begins. Inputs may divide it into parts of any length.
    fn since_ns(&self, index: usize) -> Option<i64> {
        let before = index.checked_sub(1).and_then(|before| self.samples.get(before));
        // The first sample held follows one that was dropped, or continues from where the engine began.
        before.map(|before| before.time_ns).or(self.dropped_ns).or(self.engine.begun_ns())
    }

    /// Returns whether a sample is the first after a gap.
    fn follows_gap(&self, index: usize, config: &StateEstimatorConfig) -> bool {
        let (Some(since_ns), Some(sample)) = (self.since_ns(index), self.samples.get(index)) else { return false };
        sample.time_ns.saturating_sub(since_ns) > ns(config.sensors.longest_sample)
    }

    fn advance(&mut self, until_ns: i64, sample: &ImuMean, since_ns: Option<i64>, config: &StateEstimatorConfig) {
        let was = self.engine.condition();
        let since_ns = since_ns.or(self.engine.now_ns()).unwrap_or(sample.time_ns);
        if let Err(reason) = self.engine.advance(until_ns, sample, since_ns, config)
            && self.engine.condition() != was
        {
            let time_ns = until_ns;
            if self.broken.is_none_or(|(at_ns, before)| at_ns != time_ns || !before.is_alike(&reason)) {
                self.tell(time_ns, EventKind::Fatal { input: InputKind::Imu, reason });
            }
            self.broken = Some((time_ns, reason));
        }
        self.look();
    }

    fn apply(&mut self, index: usize, config: &StateEstimatorConfig) -> Result<(), Key> {
        let Some(entry) = self.inputs.get_mut(index) else { return Ok(()) };
        if matches!(entry.outcome, Some(Err(EstimatorError::Fatal(_)))) {
            return Ok(());
        }
        let (outcome, rejection) = self.engine.apply(entry, config);
        let key = entry.key;
        let news = entry.became(outcome, rejection);
        self.told.extend(news.into_iter().flatten().map(|kind| Told::Event(key.time_ns, kind)));
        if matches!(outcome, Err(EstimatorError::Fatal(_))) {
            return Err(key);
        }
        self.look();
        Ok(())
    }

    /// Collects the reports of the engine. Those already made in an earlier run are skipped.
    fn look(&mut self) {
        while let Some((pose, sources)) = self.engine.take_left() {
            if pose.time_ns > self.left_ns {
                self.left_ns = pose.time_ns;
                self.told.push(Told::Left(pose, sources));
            }
        }
        if let Some(started) = self.engine.started()
            && !self.started.contains(&started)
        {
            self.started.push(started);
            let (time_ns, from) = started;
            self.tell(time_ns, EventKind::Started { from });
        }
    }

    /// Copies the engine if the last copy is old enough.
    fn keep_copy(&mut self, config: &StateEstimatorConfig) {
        let apart_ns = (ns(config.params.lateness) / (COPIES as i64 - 2)).max(SHORTEST_NS);
        let Some(now_ns) = self.engine.now_ns() else { return };
        let last_ns = self.copies.back().and_then(Engine::now_ns);
        if last_ns.is_none_or(|last_ns| now_ns.saturating_sub(last_ns) >= apart_ns) {
            self.copies.push_back(self.engine.clone());
        }
    }

    /// Drops the copies that no late input needs.
    fn forget(&mut self, config: &StateEstimatorConfig) {
        let Some(newest) = self.newest else { return };
        let oldest_ns = newest.time_ns.saturating_sub(ns(config.params.lateness));
        let is_old = |copy: &Engine<F>| copy.key().time_ns < oldest_ns;
        while self.copies.len() > COPIES || self.copies.get(1).is_some_and(is_old) {
            self.copies.pop_front();
        }
        self.trim();
    }

    /// Drops entries that no copy needs to run on or to predict.
    fn trim(&mut self) {
        let Some(oldest) = self.copies.front() else { return };
        let key = oldest.key();
        let kept_ns = oldest.needed_ns().min(self.engine.needed_ns());
        // The sample before the first needed one shows whether that one follows a gap.
        while self.samples.get(1).is_some_and(|sample| sample.time_ns <= kept_ns) {
            self.dropped_ns = self.samples.pop_front().map(|sample| sample.time_ns);
        }
        while self.inputs.front().is_some_and(|entry| entry.key <= key) {
            self.inputs.pop_front();
        }
        // The start of the oldest copy is that of any run.
        let last = oldest.started();
        self.started.retain(|started| started.0 >= key.time_ns || Some(*started) == last);
    }

    /// Restarts the prediction at the newest estimate.
    fn predict(&mut self, config: &StateEstimatorConfig) {
        self.predictor = None;
        let Some(mut predictor) = self.engine.predictor() else { return };
        let first = self.samples.partition_point(|sample| sample.time_ns <= predictor.time_ns());
        for (index, sample) in self.samples.iter().enumerate().skip(first) {
            // An input may have divided a gap.
            if predictor.propagate(sample, self.follows_gap(index, config)).is_err() {
                return;
            }
        }
        self.predictor = Some(predictor);
    }
}
