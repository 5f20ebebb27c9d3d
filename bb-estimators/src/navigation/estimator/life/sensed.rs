//! Copies of a filter, and a stream for each of its sensors.

use super::Sensing;
use super::correlation::Correlation;
use crate::navigation::copies::{Copies, Ways};
use crate::navigation::fused::Fused;
use crate::navigation::history::Replayed;
use crate::navigation::refusal::Refusal;
use crate::navigation::stream::{Counts, Stream};
use bb_core::{Fault, Payload};

/// A sensor's measurements since the start, by result.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Payload)]
pub struct Verdicts {
    /// Number of measurements that corrected the estimate.
    pub fused: u64,
    /// Number of measurements that the gate refused: too far from the prediction.
    pub refused: u64,
    /// Number of measurements that were not finite, too late or in the future.
    pub invalid: u64,
}

impl From<&Counts> for Verdicts {
    fn from(counts: &Counts) -> Self {
        Self {
            fused: counts.fused + counts.weighed_down,
            refused: counts.gate,
            invalid: counts.invalid + counts.late + counts.future,
        }
    }
}

/// The most sensors that a filter has.
pub(in crate::navigation) const SENSORS: usize = 8;

/// See the module.
#[derive(Clone, Debug)]
pub(in crate::navigation) struct Sensed<F: Sensing> {
    pub(in crate::navigation) copies: Copies<F>,
    /// Indexed by [`Sensing::sensor`].
    pub(in crate::navigation) streams: [Stream; SENSORS],
    pub(in crate::navigation) correlation: Correlation,
}

impl<F: Sensing> Sensed<F> {
    /// Creates copies that have started. `correlation_s` is the time over which the errors of the odometry are alike, s.
    pub(in crate::navigation) fn new(
        params: F::Params,
        start: &F::Start,
        correlation_s: f64,
    ) -> Result<Self, Fault> {
        let mut copies = Copies::new(params, Ways { noise: true, scale: true })?;
        copies.start(start).map_err(|refusal| Fault::new(refusal.to_string()))?;
        let correlation = Correlation::new(correlation_s);
        Ok(Self { copies, streams: [Stream::default(); SENSORS], correlation })
    }

    pub(in crate::navigation) fn best(&self) -> &F {
        self.copies.best()
    }

    /// Standard deviation of the horizontal position in its least certain direction, m.
    pub(in crate::navigation) fn deviation(&self) -> f64 {
        let [xx, xy, yy] = self.best().horizontal();
        let (mean, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
        (mean + half.hypot(xy)).sqrt()
    }

    /// Counts of the measurements by result, in the order of [`Sensing::NAMES`].
    pub(in crate::navigation) fn verdicts(&self) -> [Verdicts; SENSORS] {
        self.streams.each_ref().map(|stream| Verdicts::from(stream.counts()))
    }
}

impl<F: Sensing> Replayed for Sensed<F> {
    type Filter = Copies<F>;
    type Measurement = F::Measured;

    fn filter(&self) -> &Copies<F> {
        &self.copies
    }

    fn filter_mut(&mut self) -> &mut Copies<F> {
        &mut self.copies
    }

    fn update(&mut self, measured: &F::Measured) -> Result<Fused, Refusal> {
        F::correct(self, measured)
    }
}
