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

pub(super) mod past;
mod ring;
#[cfg(test)]
pub(super) mod tests;

use past::{Key, Past, Run};

/// A filter with its streams, as one value that can be stored and replayed.
///
/// ```
/// use bb_estimators::navigation::{EskfFilter, Fused, GnssPosition, Refusal, Replayed, Stream};
///
/// #[derive(Clone)]
/// struct Rover {
///     filter: EskfFilter,
///     gnss: Stream,
/// }
///
/// impl Replayed for Rover {
///     type Filter = EskfFilter;
///     type Measurement = GnssPosition;
///
///     fn filter(&self) -> &EskfFilter {
///         &self.filter
///     }
///     fn filter_mut(&mut self) -> &mut EskfFilter {
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
/// With the feature `alloc`, these are on the heap, allocated when the history is created; without it, they are stored inline.
///
/// The history covers about `SAMPLES` samples. A measurement at the time of the last sample costs nothing more, and one that is less
/// late than the late one before it costs the time since that one; else it costs its own delay plus half the time between two states, of
/// which more take memory.
#[derive(Clone, Debug)]
pub struct History<F: Replayed, const SAMPLES: usize, const MEASUREMENTS: usize, const STATES: usize> {
    past: Past<F, F::Measurement, SAMPLES, MEASUREMENTS, STATES>,
    /// Number of measurements so far: those of one stamp are fused in the order of their arrival.
    arrived: u64,
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
        let time_ns = started.filter().time_ns().ok_or(Refusal::NotStarted)?;
        let rooms = [SAMPLES, MEASUREMENTS, STATES];
        let past = Past::new(started, Key::of_sample(time_ns), Some(time_ns), rooms);
        Ok(Self { past, arrived: 0, longest_lead_ns, counts: Arrivals::default() })
    }

    /// Continues with a filter that was started elsewhere. Earlier measurements are discarded. Does not allocate.
    ///
    /// # Errors
    ///
    /// Returns [`Refusal::NotStarted`]. The history is then unchanged.
    pub fn restart(&mut self, started: F) -> Result<(), Refusal> {
        let time_ns = started.filter().time_ns().ok_or(Refusal::NotStarted)?;
        self.past.now.state = started;
        self.past.restart(Key::of_sample(time_ns), Some(time_ns));
        Ok(())
    }

    /// The filter at the time of the last sample.
    pub fn now(&self) -> &F {
        &self.past.now.state
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
        // A rejected sample must not have fused any measurement.
        self.now().filter().admits(sample)?;
        self.past.push(*sample);
        let _ = self.run(sample.time_ns, None);
        Ok(())
    }

    /// Fuses a measurement at the time it was taken.
    ///
    /// # Errors
    ///
    /// Returns [`Refusal::TooOld`], [`Refusal::InTheFuture`], or an error of [`Replayed::update`].
    pub fn update(&mut self, time_ns: i64, measurement: &F::Measurement) -> Result<Placed, Refusal> {
        let now_ns = self.past.now.key.time_ns;
        let is_ahead = time_ns > now_ns;
        let too_far = is_ahead && time_ns.saturating_sub(now_ns) > self.longest_lead_ns;
        if too_far || !self.make_room(now_ns) {
            self.counts.in_the_future += 1;
            return Err(Refusal::InTheFuture { time_ns });
        }
        self.arrived = self.arrived.wrapping_add(1);
        let key = Key { time_ns, rank: MEASURED, order: self.arrived };
        if !self.past.reaches(key) {
            self.counts.too_old += 1;
            return Err(Refusal::TooOld { time_ns });
        }
        self.past.insert(key, *measurement);
        if is_ahead {
            return Ok(Placed::Waits);
        }
        self.counts.late += 1;
        self.counts.longest_delay_ns = self.counts.longest_delay_ns.max(now_ns.saturating_sub(time_ns));
        self.run(now_ns, Some(key)).map(Placed::Fused)
    }

    /// Runs up to a time, and returns the result of a measurement.
    fn run(&mut self, until_ns: i64, asked: Option<Key>) -> Result<Fused, Refusal> {
        let mut replay = Replay { asked, answer: Err(Refusal::NotStarted), apart: SAMPLES / STATES };
        self.past.run(Key::end_of(until_ns), &mut replay);
        self.past.trim();
        replay.answer
    }

    /// Makes room for a measurement: removes the oldest, and with it the states that do not include it yet. Returns `false` if
    /// all still wait for a sample.
    fn make_room(&mut self, now_ns: i64) -> bool {
        let past = &mut self.past;
        if !past.inputs.is_full() {
            return true;
        }
        let Some((left, _)) = past.inputs.pop_front_if(|(key, _)| key.time_ns <= now_ns) else { return false };
        while past.copies.pop_front_if(|copy| copy.key < left).is_some() {}
        past.recent.take_if(|recent| recent.key < left);
        if past.copies.len() == 0 {
            past.copy_now();
        }
        true
    }
}

/// The rank of measurements among what has one stamp: they follow the sample.
const MEASURED: u8 = 1;

/// A run of the filter.
struct Replay {
    /// The measurement whose result is wanted.
    asked: Option<Key>,
    answer: Result<Fused, Refusal>,
    /// Number of samples from a state to the next.
    apart: usize,
}

impl<F: Replayed> Run<F, F::Measurement> for Replay {
    fn advance(&mut self, filter: &mut F, until_ns: i64, sample: &ImuMean, since_ns: Option<i64>) {
        let since_ns = since_ns.unwrap_or(sample.time_ns);
        let _ = filter.filter_mut().propagate_until(until_ns, sample, since_ns);
    }

    fn apply(&mut self, filter: &mut F, key: Key, measurement: &mut F::Measurement) -> bool {
        let result = filter.update(measurement);
        if self.asked == Some(key) {
            self.answer = result;
        }
        true
    }

    fn is_due(&self, _: &F, _: &F, samples: usize) -> bool {
        samples >= self.apart
    }
}
