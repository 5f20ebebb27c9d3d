//! The filter, with a stream for each sensor.

use super::options::PlanarOptions;
use crate::navigation::copies::{Copies, Ways};
use crate::navigation::estimator::correlation::Correlation;
use crate::navigation::estimator::fusing::Sensing;
use crate::navigation::estimator::health::{Sight, Watch, largest_deviation};
use crate::navigation::fused::Fused;
use crate::navigation::history::Replayed;
use crate::navigation::planar::estimate::{POSITION, PlanarEstimate};
use crate::navigation::planar::filter::{PlanarFilter, PlanarStart};
use crate::navigation::planar::measurement::{PlanarHeading, PlanarPose, PlanarPosition, WheelVelocity, YawRate};
use crate::navigation::refusal::Refusal;
use crate::navigation::stream::{Counts, Stream};
use bb_core::Fault;

/// Copies of the filter, and a stream for each sensor.
#[derive(Clone, Debug)]
pub(super) struct Filter {
    copies: Copies<PlanarFilter>,
    correlation: Correlation,
    gnss: Stream,
    odometry: Stream,
    yaw_rate: Stream,
    pose: Stream,
    orientation: Stream,
}

/// A measurement from one of the sensors.
#[derive(Clone, Copy, Debug)]
pub(super) enum Measured {
    Gnss(PlanarPosition),
    Odometry(WheelVelocity, YawRate),
    Pose(PlanarPose),
    Orientation(PlanarHeading),
}

impl Filter {
    pub(super) fn new(options: &PlanarOptions, start: &PlanarStart) -> Result<Self, Fault> {
        let mut copies = Copies::new(options.params(), Ways { noise: true, scale: false })?;
        copies.start(start).map_err(|refusal| Fault::new(refusal.to_string()))?;
        let correlation = Correlation::new(options.odometry_correlation);
        let stream = Stream::default();
        let (gnss, odometry, yaw_rate, pose, orientation) = (stream, stream, stream, stream, stream);
        Ok(Self { copies, correlation, gnss, odometry, yaw_rate, pose, orientation })
    }

    pub(super) fn copies(&self) -> &Copies<PlanarFilter> {
        &self.copies
    }

    pub(super) fn ekf(&self) -> &PlanarFilter {
        self.copies.best()
    }

    /// Standard deviation of the position in its least certain direction, m.
    pub(super) fn deviation(&self) -> f64 {
        let covariance = self.ekf().covariance();
        let of = |i: usize, j: usize| covariance[(POSITION + i, POSITION + j)];
        largest_deviation(of(0, 0), of(0, 1), of(1, 1))
    }

    /// Counts of the measurements: satellite fixes, odometry velocities and yaw rates, poses, orientations.
    pub(super) fn counts(&self) -> [&Counts; 5] {
        [&self.gnss, &self.odometry, &self.yaw_rate, &self.pose, &self.orientation].map(Stream::counts)
    }
}

impl Replayed for Filter {
    type Filter = Copies<PlanarFilter>;
    type Measurement = Measured;

    fn filter(&self) -> &Copies<PlanarFilter> {
        &self.copies
    }

    fn filter_mut(&mut self) -> &mut Copies<PlanarFilter> {
        &mut self.copies
    }

    fn update(&mut self, measured: &Measured) -> Result<Fused, Refusal> {
        let copies = &mut self.copies;
        match measured {
            Measured::Gnss(fix) => copies.update_fix(&mut self.gnss, fix),
            Measured::Odometry(velocity, rate) => {
                let now_ns = copies.estimate().ok_or(Refusal::NotStarted)?.time_ns;
                let factor = self.correlation.factor(now_ns);
                let correlated = WheelVelocity { covariance: velocity.covariance * (factor * factor), ..*velocity };
                let result = copies.update_correlated(&mut self.odometry, velocity, &correlated);
                let correlated = YawRate { deviation: rate.deviation * factor, ..*rate };
                result.and(copies.update_correlated(&mut self.yaw_rate, rate, &correlated))
            }
            Measured::Pose(pose) => copies.update_position(&mut self.pose, pose),
            Measured::Orientation(heading) => copies.update(&mut self.orientation, heading),
        }
    }
}

impl Sensing for Filter {
    fn sensor(measured: &Measured) -> &'static str {
        match measured {
            Measured::Gnss(_) => "gnss",
            Measured::Odometry(..) => "odometry",
            Measured::Pose(_) => "pose",
            Measured::Orientation(_) => "orientation",
        }
    }

    fn is_sound(&self) -> bool {
        let variances = self.ekf().covariance().diagonal();
        let is_number = |estimate: &PlanarEstimate| {
            estimate.position.iter().chain(&estimate.velocity).all(|x| x.is_finite())
                && estimate.heading.is_finite()
        };
        variances.iter().all(|variance| variance.is_finite() && *variance >= 0.0)
            && self.ekf().estimate().is_none_or(is_number)
    }

    fn elsewhere(&self) -> Option<f64> {
        self.copies.elsewhere()
    }

    fn resets(&self) -> u32 {
        self.ekf().resets()
    }

    fn watched(&self, watch: &mut Watch) -> Option<&'static str> {
        watch.look(&Sight {
            now_ns: self.ekf().estimate()?.time_ns,
            counts: &self.counts(),
            resets: self.resets(),
            dead_reckoning_s: self.ekf().dead_reckoning_s(),
            deviation: self.deviation(),
            heading_deviation: self.copies.heading_deviation(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::navigation::History;
    use crate::navigation::eskf::ImuMean;
    use nalgebra::{Vector2, Vector3};

    /// The parts of a gap that a measurement divides are gaps.
    #[test]
    fn a_divided_gap_is_counted() {
        let rest = Vector2::zeros();
        let start = PlanarStart::at(0, (rest, 2.0), (0.3, 0.1), (rest, 0.5));
        let filter = Filter::new(&PlanarOptions::default(), &start).unwrap();
        let mut history = History::<_, 10, 10, 2>::new(filter, 90_000_000).unwrap();
        history.update(90_000_000, &Measured::Gnss(PlanarPosition::new(rest, 1.0))).unwrap();
        let (angular_velocity, specific_force) = (Vector3::zeros(), Vector3::new(0.0, 0.0, 9.8));
        history.propagate(&ImuMean { time_ns: 180_000_000, angular_velocity, specific_force }).unwrap();
        assert_eq!(history.now().ekf().gaps(), 2);
    }
}
