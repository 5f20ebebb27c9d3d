//! The filter with a stream for each sensor.

use super::options::PlanarOptions;
use crate::navigation::eskf::ImuMean;
use crate::navigation::estimator::health::{Sight, largest_deviation};
use crate::navigation::fused::Fused;
use crate::navigation::history::Replayed;
use crate::navigation::planar::estimate::{POSITION, PlanarEstimate};
use crate::navigation::planar::filter::{PlanarEkf, PlanarStart};
use crate::navigation::planar::measurement::{PlanarHeading, PlanarPose, PlanarPosition, WheelVelocity, YawRate};
use crate::navigation::refusal::Refusal;
use crate::navigation::stream::{Counts, Stream, StreamParams};
use bb_core::Fault;

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

/// A measurement of one of the sensors.
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
        Ok(Self { ekf, gnss: stream, odometry: stream, yaw_rate: stream, pose: stream, orientation: stream })
    }

    pub(super) fn ekf(&self) -> &PlanarEkf {
        &self.ekf
    }

    /// Standard deviation of the position, in the direction where it is least known, m.
    pub(super) fn deviation(&self) -> f64 {
        let covariance = self.ekf.covariance();
        let of = |i: usize, j: usize| covariance[(POSITION + i, POSITION + j)];
        largest_deviation(of(0, 0), of(0, 1), of(1, 1))
    }

    /// Whether all that is emitted is a number, and no variance is negative.
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

    /// What became of the measurements: satellites, velocities and yaw rates of the odometry, poses, orientations.
    pub(super) fn counts(&self) -> [&Counts; 5] {
        [&self.gnss, &self.odometry, &self.yaw_rate, &self.pose, &self.orientation].map(Stream::counts)
    }

    /// What its health is judged by.
    pub(super) fn sight<'a>(&self, counts: &'a [&'a Counts]) -> Option<Sight<'a>> {
        Some(Sight {
            now_ns: self.time_ns()?,
            counts,
            dead_reckoning_s: self.ekf.dead_reckoning_s(),
            deviation: self.deviation(),
        })
    }
}

impl Replayed for Filter {
    type Measurement = Measured;

    fn time_ns(&self) -> Option<i64> {
        self.ekf.estimate().map(|estimate| estimate.time_ns)
    }

    fn propagate(&mut self, sample: &ImuMean) -> Result<(), Refusal> {
        self.ekf.propagate(sample)
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
