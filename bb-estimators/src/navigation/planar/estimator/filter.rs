//! The filter, with its sensors and outputs.

use super::input::{PlanarInputs, Setup};
use super::report::{PlanarStatus, odometry_of, status_of};
use super::starting::Starting;
use crate::navigation::estimator::life::{Limits, Running, Runs, Sensed, Sensing, World, new_of};
use crate::navigation::fused::Fused;
use crate::navigation::geodesy::LocalFrame;
use crate::navigation::planar::estimate::{POSITION, PlanarEstimate};
use crate::navigation::planar::filter::{PlanarFilter, PlanarStart};
use crate::navigation::planar::measurement::{PlanarHeading, PlanarPose, PlanarPosition, WheelVelocity, YawRate};
use crate::navigation::refusal::Refusal;
use bb_core::Fault;
use bb_core::payload::Odometry;

/// Number of states in the history.
const STATES: usize = 16;

/// A filter that has started.
pub(super) fn started(
    setup: &Setup,
    start: &PlanarStart,
    frame: Option<LocalFrame>,
) -> Result<Box<dyn Runs<Starting>>, Fault> {
    let options = &setup.options;
    let sensed = Sensed::<PlanarFilter>::new(options.params(), start, options.odometry_correlation)?;
    let dead_reckoning_s = setup.has_positions().then_some(options.longest_dead_reckoning);
    let limits = Limits { dead_reckoning_s, deviation: options.largest_deviation };
    Ok(Box::new(Running::<_, STATES>::new(sensed, limits, frame)?))
}

/// A measurement from one of the sensors.
#[derive(Clone, Copy, Debug)]
pub(in crate::navigation) enum Measured {
    Gnss(PlanarPosition),
    Odometry(WheelVelocity, YawRate),
    Pose(PlanarPose),
    Orientation(PlanarHeading),
}

impl Sensing for PlanarFilter {
    type Starting = Starting;
    type Measured = Measured;

    const NAMES: &'static [&'static str] = &["gnss", "odometry", "yaw_rate", "pose", "orientation"];

    fn sensor(measured: &Measured) -> usize {
        match measured {
            Measured::Gnss(_) => 0,
            // The velocity; its yaw rate is next.
            Measured::Odometry(..) => 1,
            Measured::Pose(_) => 3,
            Measured::Orientation(_) => 4,
        }
    }

    fn correct(sensed: &mut Sensed<Self>, measured: &Measured) -> Result<Fused, Refusal> {
        let Sensed { copies, streams: [gnss, odometry, yaw_rate, pose_stream, orientation, ..], correlation } =
            sensed;
        match measured {
            Measured::Gnss(fix) => copies.update_fix(gnss, fix),
            Measured::Odometry(velocity, rate) => {
                let now_ns = copies.estimate().ok_or(Refusal::NotStarted)?.time_ns;
                let factor = correlation.factor(now_ns);
                let correlated = WheelVelocity { covariance: velocity.covariance * (factor * factor), ..*velocity };
                let result = copies.update_correlated(odometry, velocity, &correlated);
                let correlated = YawRate { deviation: rate.deviation * factor, ..*rate };
                result.and(copies.update_correlated(yaw_rate, rate, &correlated))
            }
            Measured::Pose(pose) => copies.update_position(pose_stream, pose),
            Measured::Orientation(heading) => copies.update(orientation, heading),
        }
    }

    fn fuse<const STATES: usize>(
        running: &mut Running<Self, STATES>,
        inputs: &PlanarInputs<'_>,
        setup: &Setup,
    ) -> Result<(), Refusal> {
        if let Some((time_ns, fix)) = new_of(inputs.gnss)
            && let Some(frame) = &running.world.frame
            && let Some(measured) = setup.fix(fix, frame)
        {
            running.fuse(time_ns, Measured::Gnss(measured));
        }
        if let Some((time_ns, odometry)) = new_of(inputs.odometry) {
            let (velocity, rate) = setup.wheels(odometry);
            running.fuse(time_ns, Measured::Odometry(velocity, rate));
        }
        if let Some((time_ns, pose)) = new_of(inputs.pose) {
            running.fuse(time_ns, Measured::Pose(setup.pose(pose)));
        }
        if let Some((time_ns, orientation)) = new_of(inputs.orientation) {
            running.fuse(time_ns, Measured::Orientation(setup.heading(orientation)));
        }
        running.has_moved();
        Ok(())
    }

    fn odometry(&self, _: &World, setup: &Setup) -> Option<Odometry> {
        odometry_of(self, setup)
    }

    fn status(sensed: &Sensed<Self>, world: &World) -> Option<PlanarStatus> {
        status_of(sensed, world)
    }

    fn is_sound(&self) -> bool {
        let is_number = |estimate: &PlanarEstimate| {
            estimate.position.iter().chain(&estimate.velocity).all(|x| x.is_finite())
                && estimate.heading.is_finite()
        };
        self.covariance().diagonal().iter().all(|variance| variance.is_finite() && *variance >= 0.0)
            && self.estimate().is_none_or(is_number)
    }

    fn horizontal(&self) -> [f64; 3] {
        [(0, 0), (0, 1), (1, 1)].map(|(i, j)| self.covariance()[(POSITION + i, POSITION + j)])
    }

    fn resets(&self) -> u32 {
        self.resets()
    }

    fn dead_reckoning_s(&self) -> f64 {
        self.dead_reckoning_s()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::navigation::History;
    use crate::navigation::eskf::ImuMean;
    use crate::navigation::planar::params::PlanarParams;
    use nalgebra::{Vector2, Vector3};

    /// The parts of a gap that a measurement divides are gaps.
    #[test]
    fn a_divided_gap_is_counted() {
        let rest = Vector2::zeros();
        let start = PlanarStart::at(0, (rest, 2.0), (0.3, 0.1), (rest, 0.5));
        let sensed = Sensed::<PlanarFilter>::new(PlanarParams::default(), &start, 1.0).unwrap();
        let mut history = History::<_, 10, 10, 2>::new(sensed, 90_000_000).unwrap();
        history.update(90_000_000, &Measured::Gnss(PlanarPosition::new(rest, 1.0))).unwrap();
        let (angular_velocity, specific_force) = (Vector3::zeros(), Vector3::new(0.0, 0.0, 9.8));
        history.propagate(&ImuMean { time_ns: 180_000_000, angular_velocity, specific_force }).unwrap();
        assert_eq!(history.now().best().gaps(), 2);
    }
}
