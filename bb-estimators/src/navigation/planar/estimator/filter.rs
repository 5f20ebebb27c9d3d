//! The filter, with a stream for each sensor.

use super::options::PlanarOptions;
use crate::navigation::estimator::health::{Sight, largest_deviation};
use crate::navigation::estimator::refuted::Found;
use crate::navigation::fused::Fused;
use crate::navigation::history::Replayed;
use crate::navigation::planar::estimate::{HEADING, POSITION, PlanarEstimate, VELOCITY, left};
use crate::navigation::planar::filter::{PlanarEkf, PlanarStart};
use crate::navigation::planar::measurement::{PlanarHeading, PlanarPose, PlanarPosition, WheelVelocity, YawRate};
use crate::navigation::refusal::Refusal;
use crate::navigation::stream::{Counts, Stream, StreamParams};
use bb_core::Fault;
use nalgebra::{Matrix2, Matrix3, Rotation2, Vector2};

/// See the [module](self).
#[derive(Clone, Debug)]
pub(super) struct Filter {
    ekf: PlanarEkf,
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
    Odometry(WheelVelocity),
    YawRate(YawRate),
    Pose(PlanarPose),
    Orientation(PlanarHeading),
}

impl Measured {
    pub(super) fn name(&self) -> &'static str {
        match self {
            Self::Gnss(_) => "gnss",
            Self::Odometry(_) => "odometry",
            Self::YawRate(_) => "odometry, yaw rate",
            Self::Pose(_) => "pose",
            Self::Orientation(_) => "orientation",
        }
    }
}

impl Filter {
    pub(super) fn new(options: &PlanarOptions, start: &PlanarStart) -> Result<Self, Fault> {
        let mut ekf = PlanarEkf::new(options.params())?;
        ekf.start(start).map_err(|refusal| Fault::new(refusal.to_string()))?;
        let stream = Stream::new(StreamParams { patience: options.patience, ..StreamParams::default() });
        // A filter that fixes or poses refute is relocated instead: see `refuted.rs`.
        let position = Stream::new(StreamParams { patience: 0, ..StreamParams::default() });
        Ok(Self { ekf, gnss: position, odometry: stream, yaw_rate: stream, pose: position, orientation: stream })
    }

    pub(super) fn ekf(&self) -> &PlanarEkf {
        &self.ekf
    }

    /// Standard deviation of the position in its least certain direction, m.
    pub(super) fn deviation(&self) -> f64 {
        let covariance = self.ekf.covariance();
        let of = |i: usize, j: usize| covariance[(POSITION + i, POSITION + j)];
        largest_deviation(of(0, 0), of(0, 1), of(1, 1))
    }

    /// Whether no emitted value is NaN and no variance is negative.
    pub(super) fn is_sound(&self) -> bool {
        let covariance = self.ekf.covariance();
        let variances =
            (0..covariance.nrows()).all(|i| covariance[(i, i)].is_finite() && covariance[(i, i)] >= 0.0);
        let is_number = |estimate: &PlanarEstimate| {
            estimate.position.iter().chain(&estimate.velocity).all(|x| x.is_finite())
                && estimate.heading.is_finite()
        };
        variances && self.ekf.estimate().is_none_or(is_number)
    }

    /// Counts of the measurements: satellite fixes, odometry velocities and yaw rates, poses, orientations.
    pub(super) fn counts(&self) -> [&Counts; 5] {
        [&self.gnss, &self.odometry, &self.yaw_rate, &self.pose, &self.orientation].map(Stream::counts)
    }

    /// Counts of fixes and of poses.
    pub(super) fn positions(&self) -> [&Counts; 2] {
        [self.gnss.counts(), self.pose.counts()]
    }

    /// Relocates the filter to the sensor position in `found`, with the sensor at `lever_arm` in the body, m. Uses the given
    /// heading and its variance, rad, if it is known.
    pub(super) fn relocate(
        &mut self,
        found: &Found,
        lever_arm: &Vector2<f64>,
        heading: Option<(f64, f64)>,
    ) -> Result<(), Refusal> {
        let estimate = *self.ekf.estimate().ok_or(Refusal::NotStarted)?;
        let covariance = self.ekf.covariance();
        let world_from_body = estimate.world_from_body();
        let in_world = |of_body: &Matrix2<f64>| {
            let mut matrix = Matrix3::zeros();
            let turned = world_from_body * of_body * world_from_body.transpose();
            matrix.fixed_view_mut::<2, 2>(0, 0).copy_from(&turned);
            matrix
        };
        let own = (world_from_body * estimate.velocity).push(0.0);
        let of_own = in_world(&covariance.fixed_view::<2, 2>(VELOCITY, VELOCITY).into_owned());
        let velocity = found.new_velocity(&own, &of_own);
        let (speed, of_speed) = velocity.unwrap_or((own, of_own));
        let (turned, variance) = heading.unwrap_or((estimate.heading, covariance[(HEADING, HEADING)]));
        let (position, own) = found.at(estimate.time_ns, &speed, &of_speed);
        let arm = Rotation2::new(turned) * lever_arm;
        let across = left(&arm);
        let flat = |matrix: &Matrix3<f64>| matrix.fixed_view::<2, 2>(0, 0).into_owned();
        let own = flat(&own) + across * across.transpose() * variance;
        let velocity = velocity.map(|(velocity, covariance)| (velocity.xy(), flat(&covariance)));
        self.ekf.relocate((position.xy() - arm, own), velocity, heading)?;
        self.gnss.forgive();
        self.pose.forgive();
        Ok(())
    }

    /// The inputs to the health assessment.
    pub(super) fn sight<'a>(&self, counts: &'a [&'a Counts]) -> Option<Sight<'a>> {
        Some(Sight {
            now_ns: self.ekf.estimate()?.time_ns,
            counts,
            resets: self.ekf.resets(),
            dead_reckoning_s: self.ekf.dead_reckoning_s(),
            deviation: self.deviation(),
            heading_deviation: 0.0,
        })
    }
}

impl Replayed for Filter {
    type Filter = PlanarEkf;
    type Measurement = Measured;

    fn filter(&self) -> &PlanarEkf {
        &self.ekf
    }

    fn filter_mut(&mut self) -> &mut PlanarEkf {
        &mut self.ekf
    }

    fn update(&mut self, measured: &Measured) -> Result<Fused, Refusal> {
        match measured {
            Measured::Gnss(fix) => self.ekf.update(&mut self.gnss, fix),
            Measured::Odometry(velocity) => self.ekf.update(&mut self.odometry, velocity),
            Measured::YawRate(rate) => self.ekf.update(&mut self.yaw_rate, rate),
            Measured::Pose(pose) => self.ekf.update(&mut self.pose, pose),
            Measured::Orientation(heading) => self.ekf.update(&mut self.orientation, heading),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::navigation::History;
    use crate::navigation::eskf::ImuMean;
    use nalgebra::Vector3;

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
