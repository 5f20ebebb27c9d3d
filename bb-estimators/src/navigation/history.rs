//! Fuses late and out-of-order measurements at their own time.
//!
//! A bounded history of samples, measurements and filter states. A measurement from the past rewinds the filter to the last state
//! before it, and everything after that is replayed. The result is bit-for-bit the same as if all had arrived in the order of
//! their stamps. T. D. Larsen et al., "Incorporation of time delayed measurements in a discrete-time Kalman filter", CDC 1998,
//! compare this with cheaper, approximate methods.

use super::eskf::ImuMean;
use super::fused::Fused;
use super::propagate::Propagate;
use super::refusal::Refusal;

mod ring;
#[cfg(test)]
mod tests;

use ring::Ring;

/// A filter with its streams, as one value that can be stored and replayed.
///
/// ```
/// use bb_estimators::navigation::{Eskf, Fused, GnssPosition, Refusal, Replayed, Stream};
///
/// #[derive(Clone)]
/// struct Rover {
///     filter: Eskf,
///     gnss: Stream,
/// }
///
/// impl Replayed for Rover {
///     type Filter = Eskf;
///     type Measurement = GnssPosition;
///
///     fn filter(&self) -> &Eskf {
///         &self.filter
///     }
///     fn filter_mut(&mut self) -> &mut Eskf {
///         &mut self.filter
///     }
///     fn update(&mut self, fix: &GnssPosition) -> Result<Fused, Refusal> {
///         self.filter.update(&mut self.gnss, fix)
///     }
/// }
/// ```
pub trait Replayed: Clone {
    /// The type of the filter.
    type Filter: Propagate;
    /// The type of its measurements: an enum if there are several sensors.
    type Measurement: Copy;

    /// The filter.
    fn filter(&self) -> &Self::Filter;

    /// The filter, for the history to propagate it.
    fn filter_mut(&mut self) -> &mut Self::Filter;

    /// Corrects the filter with a measurement at its current time.
    ///
    /// # Errors
    ///
    /// Returns the reason why the measurement is rejected. The filter is then unchanged.
    fn update(&mut self, measurement: &Self::Measurement) -> Result<Fused, Refusal>;
}

/// The outcome of adding a measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Placed {
    /// Measurement that was fused.
    Fused(Fused),
    /// Measurement that is newer than the last IMU sample and waits for the next.
    Waits,
}

/// A filter with its last `SAMPLES` samples, `MEASUREMENTS` measurements, and `STATES` states, spread evenly between the samples.
///
/// With the feature `std`, these are on the heap, allocated when the history is created; without it, they are stored inline.
///
/// The history covers about `SAMPLES` samples. A measurement that is less late than the one before it costs the time since that one;
/// else it costs its own delay plus half the time between two states, of which more take memory.
#[derive(Clone, Debug)]
pub struct History<F: Replayed, const SAMPLES: usize, const MEASUREMENTS: usize, const STATES: usize> {
    now: F,
    samples: Ring<ImuMean, SAMPLES>,
    measurements: Ring<(i64, F::Measurement), MEASUREMENTS>,
    /// Each with the number of samples since the previous one.
    states: Ring<F, STATES>,
    since_state: usize,
    /// State before the last late measurement, with the number of samples since the last of `states`: the next one is seldom older.
    recent: Option<(F, usize)>,
    longest_lead_ns: i64,
    counts: Arrivals,
}

/// Counts of late and rejected measurements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Arrivals {
    /// Arrived after the sample that follows their stamp.
    pub late: u64,
    /// Older than the history, and rejected.
    pub too_old: u64,
    /// Stamped in the future, and rejected: the clocks disagree.
    pub in_the_future: u64,
    /// The longest delay of a fused measurement, ns.
    pub longest_delay_ns: i64,
}

impl<F: Replayed, const SAMPLES: usize, const MEASUREMENTS: usize, const STATES: usize>
    History<F, SAMPLES, MEASUREMENTS, STATES>
{
    /// Creates the history of a filter that has started. A measurement may be up to `longest_lead_ns` ahead of the last sample.
    ///
    /// # Errors
    ///
    /// Returns [`Refusal::NotStarted`].
    pub fn new(started: F, longest_lead_ns: i64) -> Result<Self, Refusal> {
        const {
            assert!(STATES >= 1 && SAMPLES >= STATES, "a history needs a state, and a sample for each");
            assert!(MEASUREMENTS >= 1, "a history needs room for a measurement");
        }
        if time_of(&started).is_none() {
            return Err(Refusal::NotStarted);
        }
        let mut states = Ring::new();
        states.push(started.clone());
        Ok(Self {
            now: started,
            samples: Ring::new(),
            measurements: Ring::new(),
            states,
            since_state: 0,
            recent: None,
            longest_lead_ns,
            counts: Arrivals::default(),
        })
    }

    /// Continues with a filter that was started elsewhere. Earlier measurements are discarded. Does not allocate.
    ///
    /// # Errors
    ///
    /// Returns [`Refusal::NotStarted`]. The history is then unchanged.
    pub fn restart(&mut self, started: F) -> Result<(), Refusal> {
        if time_of(&started).is_none() {
            return Err(Refusal::NotStarted);
        }
        self.samples.clear();
        self.measurements.clear();
        self.states.clear();
        self.states.push(started.clone());
        self.since_state = 0;
        self.recent = None;
        self.now = started;
        Ok(())
    }

    /// The filter at the time of the last sample.
    pub fn now(&self) -> &F {
        &self.now
    }

    /// Counts of late and rejected measurements.
    pub fn arrivals(&self) -> &Arrivals {
        &self.counts
    }

    /// Advances by one IMU sample and fuses the measurements that waited for it.
    ///
    /// # Errors
    ///
    /// The same as [`Propagate::propagate`]. The history is then unchanged.
    pub fn propagate(&mut self, sample: &ImuMean) -> Result<(), Refusal> {
        if self.has_measurements_until(sample.time_ns) {
            // A rejected sample must not have fused any measurement.
            self.now.filter().admits(sample)?;
            self.advance(sample, None);
        } else {
            self.now.filter_mut().propagate(sample)?;
        }
        self.samples.push(*sample);
        self.keep_state();
        Ok(())
    }

    /// Fuses a measurement at the time it was taken.
    ///
    /// # Errors
    ///
    /// Returns [`Refusal::TooOld`], [`Refusal::InTheFuture`], or an error of [`Replayed::update`].
    pub fn update(&mut self, time_ns: i64, measurement: &F::Measurement) -> Result<Placed, Refusal> {
        let now_ns = time_of(&self.now).ok_or(Refusal::NotStarted)?;
        let is_ahead = time_ns > now_ns;
        let too_far = is_ahead && time_ns.saturating_sub(now_ns) > self.longest_lead_ns;
        if too_far || !self.make_room(now_ns) {
            self.counts.in_the_future += 1;
            return Err(Refusal::InTheFuture { time_ns });
        }
        if is_ahead {
            self.insert(time_ns, measurement);
            return Ok(Placed::Waits);
        }
        // The last state that is not after the measurement: the measurements in that state are not newer.
        let is_before = |state: &F| time_of(state).is_some_and(|state_ns| state_ns <= time_ns);
        let found = self.states.count_while(is_before).checked_sub(1);
        let Some((index, state)) = found.and_then(|index| Some((index, self.states.get(index)?))) else {
            self.counts.too_old += 1;
            return Err(Refusal::TooOld { time_ns });
        };
        let recent = self.recent.take().filter(|(recent, _)| is_before(recent) && time_of(recent) > time_of(state));
        let is_recent = recent.is_some();
        (self.now, self.since_state) = recent.unwrap_or_else(|| (state.clone(), 0));
        let place = self.insert(time_ns, measurement);
        self.counts.late += 1;
        self.counts.longest_delay_ns = self.counts.longest_delay_ns.max(now_ns.saturating_sub(time_ns));
        self.states.truncate(index + 1);
        let from = time_of(&self.now).ok_or(Refusal::NotStarted)?;
        let first = self.samples.count_while(|sample| sample.time_ns <= from);
        let mut result = Err(Refusal::NotStarted);
        if from == time_ns {
            result = self.now.update(measurement);
            if !is_recent {
                self.states.truncate(index);
                self.states.push(self.now.clone());
            }
        }
        for i in first..self.samples.len() {
            let Some(sample) = self.samples.get(i).copied() else { break };
            if self.recent.is_none() && sample.time_ns >= time_ns {
                self.recent = Some((self.now.clone(), self.since_state));
            }
            if let Some(of_it) = self.advance(&sample, Some(place)) {
                result = of_it;
            }
            self.keep_state();
        }
        result.map(Placed::Fused)
    }

    fn has_measurements_until(&self, time_ns: i64) -> bool {
        let now_ns = time_of(&self.now).unwrap_or(i64::MAX);
        let first = self.measurements.count_while(|(at, _)| *at <= now_ns);
        self.measurements.get(first).is_some_and(|(at, _)| *at <= time_ns)
    }

    /// Makes room for a measurement: removes the oldest, and with it the states that do not include it yet. Returns `false` if
    /// all still wait for a sample.
    fn make_room(&mut self, now_ns: i64) -> bool {
        if self.measurements.len() < MEASUREMENTS {
            return true;
        }
        let Some((left_ns, _)) = self.measurements.get(0).copied() else { return true };
        if left_ns > now_ns {
            return false;
        }
        self.measurements.pop_front();
        while self.states.get(0).and_then(time_of).is_some_and(|state_ns| state_ns < left_ns) {
            self.states.pop_front();
        }
        self.recent.take_if(|(state, _)| time_of(state).is_some_and(|state_ns| state_ns < left_ns));
        if self.states.len() == 0 {
            self.states.push(self.now.clone());
            self.since_state = 0;
        }
        true
    }

    /// Inserts a measurement after those that are not newer, and returns its index.
    fn insert(&mut self, time_ns: i64, measurement: &F::Measurement) -> usize {
        let place = self.measurements.count_while(|(at, _)| *at <= time_ns);
        self.measurements.insert(place, (time_ns, *measurement));
        place
    }

    /// Advances `now` over one sample with the measurements in it, and returns the result of the one at `place`.
    fn advance(&mut self, sample: &ImuMean, place: Option<usize>) -> Option<Result<Fused, Refusal>> {
        let mut result = None;
        let from = time_of(&self.now).unwrap_or(i64::MAX);
        for index in self.measurements.count_while(|(at, _)| *at <= from)..self.measurements.len() {
            let Some((time_ns, measurement)) = self.measurements.get(index) else { break };
            if *time_ns > sample.time_ns {
                break;
            }
            if time_of(&self.now) != Some(*time_ns) {
                let _ = self.now.filter_mut().propagate_until(*time_ns, sample, from);
            }
            let of_it = self.now.update(measurement);
            if place == Some(index) {
                result = Some(of_it);
            }
        }
        let reached = time_of(&self.now);
        if reached == Some(from) {
            let _ = self.now.filter_mut().propagate(sample);
        } else if reached != Some(sample.time_ns) {
            let _ = self.now.filter_mut().propagate_until(sample.time_ns, sample, from);
        }
        result
    }

    /// Stores the state if one is due, and discards data older than the oldest state.
    fn keep_state(&mut self) {
        self.since_state += 1;
        if self.since_state < SAMPLES / STATES {
            return;
        }
        self.since_state = 0;
        self.states.push(self.now.clone());
        let oldest_ns = self.states.get(0).and_then(time_of).unwrap_or(i64::MIN);
        while self.measurements.get(0).is_some_and(|(time_ns, _)| *time_ns <= oldest_ns) {
            self.measurements.pop_front();
        }
    }
}

fn time_of<F: Replayed>(state: &F) -> Option<i64> {
    state.filter().time_ns()
}
