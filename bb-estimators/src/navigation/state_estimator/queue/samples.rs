//! Samples of the IMU: which are taken, where they are put, and which leave when there is no room.

use super::Queue;
use crate::navigation::eskf::ImuMean;
use crate::navigation::history::past::Key;
use crate::navigation::numbers::LONGEST_TAIL_NS;
use crate::navigation::refusal::Refusal;
use crate::navigation::state_estimator::clock::{Stamped, follows};
use crate::navigation::state_estimator::engine::Condition;
use crate::navigation::state_estimator::error::Reason;
use crate::navigation::state_estimator::event::{EventKind, InputKind};
use crate::navigation::state_estimator::factor::ProvidedFactor;
use crate::navigation::state_estimator::params::{StateEstimatorConfig, ns};

/// One over the fraction of the samples that is dropped at once when there is no room.
const LEAVING: usize = 8;

impl<F: ProvidedFactor> Queue<F> {
    pub(super) fn place_sample(&mut self, sample: &ImuMean, config: &StateEstimatorConfig) -> Result<bool, Reason> {
        sample.check()?;
        let time_ns = sample.time_ns;
        let Some(newest) = self.newest().copied() else { return self.place_first(sample, config) };
        if self.past.samples.get(self.index_of(time_ns)) == Some(sample) {
            // Sent twice: it says nothing about the clock.
            return Err(Reason::Duplicate);
        }
        let is_surplus = time_ns <= newest.time_ns && self.is_surplus(time_ns, config);
        match self.clock.judge(time_ns, newest.time_ns, ns(config.params.lateness), is_surplus) {
            Stamped::Next => {}
            Stamped::Late => return self.place_late_sample(sample, config),
            Stamped::Ahead => return Err(Refusal::InTheFuture { time_ns }.into()),
            Stamped::TooOld => return Err(Refusal::TooOld { time_ns }.into()),
            Stamped::SetBack { for_ns } => {
                self.set_back(sample, for_ns, newest.time_ns, config);
                return Err(Reason::Bridged);
            }
        }
        self.make_room(config);
        self.past.push(*sample);
        let is_gap = time_ns.saturating_sub(newest.time_ns) > ns(config.sensors.longest_sample);
        // After a change it is rebuilt before it is read.
        let is_current = self.past.changed.is_none();
        if is_current
            && self.predictor.as_mut().is_some_and(|predictor| predictor.propagate(&newest, sample).is_err())
        {
            self.predictor = None;
        }
        let due = self.past.inputs.iter().rev().map(|(key, _)| *key).find(|key| key.time_ns <= time_ns);
        let behind_ns = self.engine().now_ns().map_or(i64::MAX, |now_ns| time_ns.saturating_sub(now_ns));
        let is_starting = is_current && self.engine().condition() != Condition::Running;
        if is_starting || behind_ns > LONGEST_TAIL_NS {
            self.settle(time_ns, config);
        } else if let Some(last) = due.filter(|last| *last > self.past.now.key) {
            self.settle(last.time_ns, config);
        }
        if is_gap { Err(Reason::Bridged) } else { Ok(false) }
    }

    /// The place of a sample of that time.
    fn index_of(&self, time_ns: i64) -> usize {
        self.past.samples.count_while(|other| other.time_ns < time_ns)
    }

    /// Returns whether no sample is missing at a time: those before and after it are no farther apart than others.
    fn is_surplus(&self, time_ns: i64, config: &StateEstimatorConfig) -> bool {
        let index = self.index_of(time_ns);
        let Some(after) = self.past.samples.get(index) else { return false };
        if after.time_ns == time_ns {
            return true;
        }
        let Some(before_ns) = self.past.since_ns(index) else { return false };
        // An outage says nothing of how far apart they are.
        let following = self.past.samples.iter().zip(self.past.samples.iter().skip(1));
        let apart = following.map(|(before, after)| after.time_ns.saturating_sub(before.time_ns));
        let usual = apart.filter(|apart_ns| *apart_ns <= ns(config.sensors.longest_sample));
        let (sum_ns, count) =
            usual.fold((0, 0), |(sum_ns, count), apart_ns| (apart_ns.saturating_add(sum_ns), count + 1));
        let apart_ns = sum_ns / count.max(1);
        // Where one is missing, they are twice as far apart.
        after.time_ns.saturating_sub(before_ns) <= apart_ns.saturating_add(apart_ns / 2)
    }

    /// The first sample sets the time, once another stamp agrees with its own. Two stamps are not enough to discard earlier
    /// reports: that takes as many as a jump of the clock.
    fn place_first(&mut self, sample: &ImuMean, config: &StateEstimatorConfig) -> Result<bool, Reason> {
        let time_ns = sample.time_ns;
        let before = self.first.take();
        let is_believed = self.clock.doubt(time_ns).is_some() || self.past.inputs.len() == 0;
        if let Some(first) = before.filter(|first| is_believed && follows(time_ns, first.time_ns)) {
            self.begin(&first, config);
            return self.place_sample(sample, config);
        }
        if let Some(first) = before {
            // Neither is known to be wrong, but the later one may still be confirmed.
            let reason = self.count(stranger(first.time_ns, time_ns).into());
            self.news.tell(first.time_ns, EventKind::Degraded { input: InputKind::Imu, reason });
        }
        if self.past.inputs.iter().any(|(key, _)| self.is_near(key.time_ns, time_ns, config)) {
            self.begin(sample, config);
            return Ok(false);
        }
        self.first = Some(*sample);
        Ok(true)
    }

    fn begin(&mut self, sample: &ImuMean, config: &StateEstimatorConfig) {
        self.past.push(*sample);
        self.drop_strangers(sample.time_ns, config);
        self.settle(sample.time_ns, config);
    }

    /// The clock of the IMU was set back: the engine continues on the new clock, without the past.
    fn set_back(&mut self, sample: &ImuMean, for_ns: i64, newest_ns: i64, config: &StateEstimatorConfig) {
        self.settle(newest_ns, config);
        let mut is_alarmed = false;
        while let Some((key, entry)) = self.past.inputs.pop_front() {
            if entry.outcome.is_none() && entry.payload.is_added() {
                is_alarmed |= entry.payload.is_alarm();
                self.counts.too_old += 1;
                let reason = Refusal::TooOld { time_ns: key.time_ns }.into();
                self.news.tell(key.time_ns, EventKind::Degraded { input: entry.payload.kind(), reason });
            }
        }
        let engine = &mut self.past.now.state;
        // The window restarts, on another clock.
        engine.leave();
        self.news.look(engine);
        if is_alarmed {
            // On the new clock it is older than all that comes.
            engine.alarm(newest_ns, config);
        }
        engine.set_clock_back(sample.time_ns, for_ns, config);
        let (now_ns, started) = (engine.now_ns(), engine.started().into_iter().collect());
        self.past.restart(now_ns.map_or(Key::FIRST, Key::of_sample), None);
        (self.news.left_ns, self.news.started, self.news.broken) = (i64::MIN, started, None);
        self.counts.set_back += 1;
        let seconds = newest_ns.saturating_sub(sample.time_ns) as f64 * 1e-9;
        self.news.tell(sample.time_ns, EventKind::ClockSetBack { seconds });
        self.past.push(*sample);
        self.settle(sample.time_ns, config);
    }

    /// Inserts a sample at its place. The engine is not run: more such samples may follow.
    fn place_late_sample(&mut self, sample: &ImuMean, config: &StateEstimatorConfig) -> Result<bool, Reason> {
        let time_ns = sample.time_ns;
        if self.past.samples.get(self.index_of(time_ns)).is_some_and(|other| other.time_ns == time_ns) {
            return Err(Reason::Duplicate);
        }
        self.make_room(config);
        let index = self.index_of(time_ns);
        let before_ns = self.since_ns(index);
        // Inputs since the sample before have been reached with a part of the sample after.
        let from = before_ns.filter(|at_ns| *at_ns < time_ns).map_or(Key::of_sample(time_ns), Key::end_of);
        if !self.past.reaches(from) {
            return Err(Refusal::TooOld { time_ns }.into());
        }
        self.past.samples.insert(index, *sample);
        self.counts.late += 1;
        self.past.change(from);
        Ok(false)
    }

    /// Drops the oldest sample if there is no room for another one. Those needed only for late inputs are dropped first, and such inputs
    /// are then refused as too old.
    fn make_room(&mut self, config: &StateEstimatorConfig) {
        if !self.past.samples.is_full() {
            return;
        }
        let newest_ns = self.newest().map_or(i64::MIN, |newest| newest.time_ns);
        self.run(newest_ns, config);
        let held = self.past.samples.len();
        while self.past.samples.is_full() && self.past.copies.len() > 1 {
            self.past.copies.pop_front();
            self.trim();
        }
        if self.past.samples.is_full() {
            self.past.copy_now();
            self.trim();
        }
        if self.past.samples.is_full() {
            // All remaining samples are later than the newest keyframe. The prediction has to bridge the dropped ones.
            (0..(held / LEAVING).max(1)).for_each(|_| self.past.drop_sample());
        }
        self.predict();
        let count = held.saturating_sub(self.past.samples.len()) as u64;
        self.counts.dropped += count;
        self.news.tell(newest_ns, EventKind::SamplesDropped { count });
    }

    /// Drops inputs that came before the IMU and do not match its time.
    fn drop_strangers(&mut self, time_ns: i64, config: &StateEstimatorConfig) {
        let mut is_alarmed = false;
        for _ in 0..self.past.inputs.len() {
            let Some((key, entry)) = self.past.inputs.pop_front() else { break };
            if self.is_near(key.time_ns, time_ns, config) {
                self.past.inputs.push((key, entry));
                continue;
            }
            is_alarmed |= entry.payload.is_alarm();
            if entry.payload.is_added() {
                let reason = self.count(stranger(key.time_ns, time_ns).into());
                self.news.tell(key.time_ns, EventKind::Degraded { input: entry.payload.kind(), reason });
            }
        }
        if is_alarmed {
            self.alarm(config);
        }
    }
}

/// The refusal of an input whose time does not match that of a sample.
fn stranger(time_ns: i64, sample_ns: i64) -> Refusal {
    if time_ns < sample_ns { Refusal::TooOld { time_ns } } else { Refusal::InTheFuture { time_ns } }
}
