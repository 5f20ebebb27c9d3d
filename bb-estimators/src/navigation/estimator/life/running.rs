//! A filter that has started, with its history.

use super::health::{Limits, Watch};
use super::world::World;
use super::{Runs, Sensed, Sensing, Starts, Taken};
use crate::navigation::eskf::ImuMean;
use crate::navigation::geodesy::LocalFrame;
use crate::navigation::history::History;
use crate::navigation::numbers::{LONGEST_LEAD_NS, MOST_REFUSED};
use crate::navigation::refusal::Refusal;
use bb_core::payload::Odometry;
use bb_core::{Fault, Input};

/// Number of IMU samples by which measurements may be late: 1.3 s at 400 Hz.
const SAMPLES: usize = 512;
const MEASUREMENTS: usize = 128;

/// See the module. The constant is the number of states that the history holds.
#[derive(Debug)]
pub(in crate::navigation) struct Running<F: Sensing, const STATES: usize> {
    /// History, on the heap: with all its states, a filter is tens of kilobytes, and a thread's stack is small.
    pub(in crate::navigation) past: Box<History<Sensed<F>, SAMPLES, MEASUREMENTS, STATES>>,
    pub(in crate::navigation) world: World,
    watch: Watch,
    resets: u32,
    /// IMU samples.
    refused_in_a_row: u32,
}

impl<F: Sensing, const STATES: usize> Running<F, STATES> {
    /// Creates the history of a filter that has started in this frame.
    pub(in crate::navigation) fn new(
        sensed: Sensed<F>,
        limits: Limits,
        frame: Option<LocalFrame>,
    ) -> Result<Self, Fault> {
        let past = match History::new(sensed, LONGEST_LEAD_NS) {
            Ok(past) => Box::new(past),
            Err(refusal) => return Err(Fault::new(refusal.to_string())),
        };
        Ok(Self { past, world: World::new(frame), watch: Watch::new(limits), resets: 1, refused_in_a_row: 0 })
    }

    /// The filter at the time of the last sample.
    pub(in crate::navigation) fn now(&self) -> &Sensed<F> {
        self.past.now()
    }

    /// Fuses a measurement at its own time.
    pub(in crate::navigation) fn fuse(&mut self, time_ns: i64, measured: F::Measured) {
        if let Err(refusal) = self.past.update(time_ns, &measured) {
            tracing::debug!(%refusal, sensor = F::NAMES[F::sensor(&measured)], "measurement refused");
        }
    }

    /// Returns whether the filter has moved to where positions agree.
    pub(in crate::navigation) fn has_moved(&mut self) -> bool {
        let resets = self.now().best().resets();
        let has_moved = resets != std::mem::replace(&mut self.resets, resets);
        if has_moved {
            tracing::warn!("it was wrong, and goes on where positions agree");
        }
        has_moved
    }
}

impl<F: Sensing, const STATES: usize> Runs<F::Starting> for Running<F, STATES> {
    fn take(
        &mut self,
        sample: &ImuMean,
        inputs: &<F::Starting as Starts>::Inputs<'_>,
        setup: &<F::Starting as Starts>::Setup,
    ) -> Result<Taken, Fault> {
        match self.past.propagate(sample).map(drop).and_then(|()| F::fuse(self, inputs, setup)) {
            Ok(()) => {
                self.refused_in_a_row = 0;
                let sensed = self.past.now();
                if !sensed.best().is_sound() {
                    return Err(Fault::new("its estimate is no number"));
                }
                if let Some(distance) = sensed.copies.elsewhere() {
                    let km = distance * 1e-3;
                    return Err(Fault::new(format!(
                        "fixes agree on a place {km:.0} km away: its world is elsewhere"
                    )));
                }
                Ok(Taken::In(self.watch.look(sensed)))
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

    fn first(&self) -> Option<LocalFrame> {
        self.world.first
    }

    fn odometry(&self, setup: &<F::Starting as Starts>::Setup) -> Option<Odometry> {
        self.now().best().odometry(&self.world, setup)
    }

    fn status(&self) -> Option<<F::Starting as Starts>::Status> {
        F::status(self.now(), &self.world)
    }
}

/// The message of an input and its stamp, ns, if it is new.
pub(in crate::navigation) fn new_of<T>(input: Option<Input<'_, T>>) -> Option<(i64, &T)> {
    let message = input.filter(Input::is_new)?.message();
    Some((message.monotonic_time.as_nanos(), &message.payload))
}
