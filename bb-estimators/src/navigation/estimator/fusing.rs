//! A filter that has started, with its history: what the declared filters have in common.

use super::health::{Limits, Watch};
use crate::navigation::history::{History, Replayed};
use crate::navigation::numbers::{LONGEST_LEAD_NS, MOST_REFUSED};
use crate::navigation::refusal::Refusal;
use bb_core::{Fault, Input, Reply};
use std::fmt::Debug;

/// Number of IMU samples by which measurements may be late: 1.3 s at 400 Hz.
const SAMPLES: usize = 512;
const MEASUREMENTS: usize = 128;

/// A filter with a stream for each of its sensors.
pub(in crate::navigation) trait Sensing: Replayed<Measurement: Debug> {
    /// Name of the sensor of a measurement.
    fn sensor(measured: &Self::Measurement) -> &'static str;

    /// Returns whether all outputs are finite and no variance is negative.
    fn is_sound(&self) -> bool;

    /// The distance of positions, m, that are beyond any way of a robot from the filter.
    fn elsewhere(&self) -> Option<f64>;

    /// Number of times that the filter was started or moved.
    fn resets(&self) -> u32;

    /// Returns the reason for which the estimate is not to be trusted, if there is one.
    fn watched(&self, watch: &mut Watch) -> Option<&'static str>;
}

/// See the module. The constant is the number of states that the history holds.
#[derive(Debug)]
pub(in crate::navigation) struct Fusing<F: Sensing, const STATES: usize> {
    /// History, on the heap: with all its states, a filter is tens of kilobytes, and a thread's stack is small.
    pub(in crate::navigation) past: Box<History<F, SAMPLES, MEASUREMENTS, STATES>>,
    watch: Watch,
    resets: u32,
    /// IMU samples.
    refused_in_a_row: u32,
}

/// Result of a sample.
#[derive(Clone, Copy, Debug)]
pub(in crate::navigation) enum Taken {
    /// Sample that is in the estimate, with the reason if that is not to be trusted.
    In(Option<&'static str>),
    /// Sample that was refused, with the reason once there are many.
    Refused(Option<&'static str>),
    /// Sample after too long a gap: the filter must start again.
    Lost,
}

impl<F: Sensing, const STATES: usize> Fusing<F, STATES> {
    /// Creates the history of a filter that has started.
    pub(in crate::navigation) fn new(filter: F, limits: Limits) -> Result<Self, Fault> {
        let past = match History::new(filter, LONGEST_LEAD_NS) {
            Ok(past) => Box::new(past),
            Err(refusal) => return Err(Fault::new(refusal.to_string())),
        };
        Ok(Self { past, watch: Watch::new(limits), resets: 1, refused_in_a_row: 0 })
    }

    /// The filter at the time of the last sample.
    pub(in crate::navigation) fn now(&self) -> &F {
        self.past.now()
    }

    /// Fuses a measurement at its own time.
    pub(in crate::navigation) fn fuse(&mut self, time_ns: i64, measured: F::Measurement) {
        if let Err(refusal) = self.past.update(time_ns, &measured) {
            tracing::debug!(%refusal, sensor = F::sensor(&measured), "measurement refused");
        }
    }

    /// Returns whether the filter has moved to where positions agree.
    pub(in crate::navigation) fn has_moved(&mut self) -> bool {
        let resets = self.now().resets();
        let has_moved = resets != std::mem::replace(&mut self.resets, resets);
        if has_moved {
            tracing::warn!("it was wrong, and goes on where positions agree");
        }
        has_moved
    }

    /// Judges the filter after a sample.
    pub(in crate::navigation) fn judge(&mut self, taken: Result<(), Refusal>) -> Result<Taken, Fault> {
        match taken {
            Ok(()) => {
                self.refused_in_a_row = 0;
                let filter = self.past.now();
                if !filter.is_sound() {
                    return Err(Fault::new("its estimate is no number"));
                }
                if let Some(distance) = filter.elsewhere() {
                    let km = distance * 1e-3;
                    return Err(Fault::new(format!(
                        "fixes agree on a place {km:.0} km away: its world is elsewhere"
                    )));
                }
                Ok(Taken::In(filter.watched(&mut self.watch)))
            }
            Err(Refusal::Gap { .. }) => {
                tracing::info!("no sample for too long: it starts again");
                Ok(Taken::Lost)
            }
            Err(refusal) => {
                tracing::debug!(%refusal, "sample refused");
                self.refused_in_a_row += 1;
                let is_deaf = self.refused_in_a_row >= MOST_REFUSED;
                Ok(Taken::Refused(is_deaf.then_some("it refuses every sample of the IMU")))
            }
        }
    }
}

impl Taken {
    /// The reply to the sample, with the output if there is an estimate.
    pub(in crate::navigation) fn reply<O>(&self, output: impl FnOnce() -> Option<O>) -> Reply<O> {
        match *self {
            Self::In(reason) => doubted(output().into(), reason),
            Self::Refused(reason) => doubted(Reply::none(), reason),
            Self::Lost => Reply::none().diverged("no sample of the IMU for too long"),
        }
    }
}

/// A reply with the reason for which the estimate is not to be trusted, if there is one.
pub(in crate::navigation) fn doubted<O>(reply: Reply<O>, reason: Option<&'static str>) -> Reply<O> {
    match reason {
        Some(reason) => reply.diverged(reason),
        None => reply,
    }
}

/// The message of an input and its stamp, ns, if it is new.
pub(in crate::navigation) fn new_of<T>(input: Option<Input<'_, T>>) -> Option<(i64, &T)> {
    let message = input.filter(Input::is_new)?.message();
    Some((message.monotonic_time.as_nanos(), &message.payload))
}
