//! The filter after its start.

use super::PlanarOutput;
use super::filter::{Filter, Measured};
use super::input::{Mounting, PlanarInputs};
use super::options::PlanarOptions;
use crate::navigation::eskf::ImuMean;
use crate::navigation::estimator::health::{Limits, Watch};
use crate::navigation::geodesy::LocalFrame;
use crate::navigation::history::History;
use crate::navigation::planar::filter::PlanarStart;
use crate::navigation::refusal::Refusal;
use bb_core::{Fault, Reply};

/// Number of stored IMU samples, which limits how late a measurement may be: 1.3 s at 400 Hz.
const SAMPLES: usize = 512;
const MEASUREMENTS: usize = 128;
const STATES: usize = 16;
type Past = History<Filter, SAMPLES, MEASUREMENTS, STATES>;

/// Largest lead of a measurement's stamp over the IMU, ns.
const LONGEST_LEAD_NS: i64 = 500_000_000;

#[derive(Debug)]
pub(super) struct Running {
    past: Past,
    /// The world's frame on the Earth; `None` without satellite navigation.
    frame: Option<LocalFrame>,
    watch: Watch,
    resets: u32,
}

impl Running {
    /// Creates the state from a filter that has started.
    pub(super) fn new(
        options: &PlanarOptions,
        start: &PlanarStart,
        frame: Option<LocalFrame>,
        limits: Limits,
    ) -> Result<Box<Self>, Fault> {
        let filter = Filter::new(options, start)?;
        let past = Past::new(filter, LONGEST_LEAD_NS).map_err(|refusal| Fault::new(refusal.to_string()))?;
        Ok(Box::new(Self { past, frame, watch: Watch::new(limits), resets: 1 }))
    }

    /// The distance of positions, m, that are beyond any way of a robot from the filter.
    pub(super) fn elsewhere(&self) -> Option<f64> {
        self.past.now().copies().elsewhere()
    }

    /// The world's frame on the Earth; `None` without satellite navigation.
    pub(super) fn frame(&self) -> Option<LocalFrame> {
        self.frame
    }

    /// Returns whether no emitted value is NaN and no variance is negative.
    pub(super) fn is_sound(&self) -> bool {
        self.past.now().is_sound()
    }

    pub(super) fn take(
        &mut self,
        sample: &ImuMean,
        inputs: &PlanarInputs<'_>,
        options: &PlanarOptions,
        mounting: &Mounting,
    ) -> Result<(), Refusal> {
        self.past.propagate(sample)?;
        if let Some(fix) = inputs.gnss.filter(|fix| fix.is_new())
            && let Some(frame) = &self.frame
            && let Some(measured) = mounting.fix(&fix.payload, frame, options)
        {
            self.fuse(fix.monotonic_time.as_nanos(), Measured::Gnss(measured));
        }
        if let Some(odometry) = inputs.odometry.filter(|odometry| odometry.is_new()) {
            let (velocity, rate) = mounting.wheels(&odometry.payload, options);
            self.fuse(odometry.monotonic_time.as_nanos(), Measured::Odometry(velocity, rate));
        }
        if let Some(pose) = inputs.pose.filter(|pose| pose.is_new()) {
            let measured = mounting.pose(&pose.payload, options);
            self.fuse(pose.monotonic_time.as_nanos(), Measured::Pose(measured));
        }
        if let Some(orientation) = inputs.orientation.filter(|orientation| orientation.is_new()) {
            let measured = mounting.heading(&orientation.payload, options);
            self.fuse(orientation.monotonic_time.as_nanos(), Measured::Orientation(measured));
        }
        let resets = self.past.now().ekf().resets();
        if resets != self.resets {
            tracing::warn!("it was wrong, and goes on where positions agree");
            self.resets = resets;
        }
        Ok(())
    }

    fn fuse(&mut self, time_ns: i64, measured: Measured) {
        if let Err(refusal) = self.past.update(time_ns, &measured) {
            tracing::debug!(%refusal, sensor = measured.name(), "measurement refused");
        }
    }

    pub(super) fn reply<O: PlanarOutput>(&mut self, mounting: &Mounting) -> Reply<O> {
        let filter = self.past.now();
        let reply: Reply<O> = O::of(filter, mounting, self.frame.as_ref()).into();
        let counts = filter.counts();
        match filter.sight(&counts).and_then(|sight| self.watch.look(&sight)) {
            Some(reason) => reply.diverged(reason),
            None => reply,
        }
    }
}
