//! The filter after its start.

use super::filter::{Filter, Measured};
use super::input::{Mounting, PlanarInputs};
use super::options::PlanarOptions;
use crate::navigation::eskf::ImuMean;
use crate::navigation::estimator::fusing::{Fusing, new_of};
use crate::navigation::estimator::health::Limits;
use crate::navigation::geodesy::LocalFrame;
use crate::navigation::planar::filter::PlanarStart;
use crate::navigation::refusal::Refusal;
use bb_core::Fault;

/// Number of states in the history.
const STATES: usize = 16;

#[derive(Debug)]
pub(super) struct Running {
    pub(super) fusing: Fusing<Filter, STATES>,
    /// The world's frame on the Earth; `None` without satellite navigation.
    pub(super) frame: Option<LocalFrame>,
}

impl Running {
    /// Creates the state from a filter that has started.
    pub(super) fn new(
        options: &PlanarOptions,
        mounting: &Mounting,
        start: &PlanarStart,
        frame: Option<LocalFrame>,
    ) -> Result<Box<Self>, Fault> {
        let longest_s = options.longest_dead_reckoning;
        let limits = Limits {
            dead_reckoning_s: mounting.has_positions().then_some(longest_s),
            deviation: options.largest_deviation,
        };
        let fusing = Fusing::new(Filter::new(options, start)?, limits)?;
        Ok(Box::new(Self { fusing, frame }))
    }

    pub(super) fn take(
        &mut self,
        sample: &ImuMean,
        inputs: &PlanarInputs<'_>,
        options: &PlanarOptions,
        mounting: &Mounting,
    ) -> Result<(), Refusal> {
        let fusing = &mut self.fusing;
        fusing.past.propagate(sample)?;
        if let Some((time_ns, fix)) = new_of(inputs.gnss)
            && let Some(frame) = &self.frame
            && let Some(measured) = mounting.fix(fix, frame, options)
        {
            fusing.fuse(time_ns, Measured::Gnss(measured));
        }
        if let Some((time_ns, odometry)) = new_of(inputs.odometry) {
            let (velocity, rate) = mounting.wheels(odometry, options);
            fusing.fuse(time_ns, Measured::Odometry(velocity, rate));
        }
        if let Some((time_ns, pose)) = new_of(inputs.pose) {
            fusing.fuse(time_ns, Measured::Pose(mounting.pose(pose, options)));
        }
        if let Some((time_ns, orientation)) = new_of(inputs.orientation) {
            fusing.fuse(time_ns, Measured::Orientation(mounting.heading(orientation, options)));
        }
        fusing.has_moved();
        Ok(())
    }
}
