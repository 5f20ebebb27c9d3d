//! The filter with a stream for each sensor.

use super::health::{Sight, largest_deviation};
use super::options::NavigationOptions;
use crate::attitude::ParamsError;
use crate::navigation::eskf::{Eskf, Estimate, ImuMean, NAVIGATION, POSITION, Refusal, Start};
use crate::navigation::history::Replayed;
use crate::navigation::measurement::{AbsolutePose, BodyVelocity, GnssPosition};
use crate::navigation::stream::{Counts, Fused, Stream, StreamParams};
use bb_core::Fault;
use nalgebra::{Isometry3, Vector3};

/// See the [module](self).
#[derive(Clone, Debug)]
pub(super) struct Filter {
    eskf: Eskf,
    gnss: Stream,
    odometry: Stream,
    pose: Stream,
}

/// A measurement of one of the sensors.
#[derive(Clone, Copy, Debug)]
pub(super) enum Measured {
    Gnss(GnssPosition),
    Odometry(BodyVelocity),
    Pose(AbsolutePose),
}

impl Measured {
    pub(super) fn name(&self) -> &'static str {
        match self {
            Self::Gnss(_) => "gnss",
            Self::Odometry(_) => "odometry",
            Self::Pose(_) => "pose",
        }
    }
}

impl Filter {
    pub(super) fn new(options: &NavigationOptions, start: &Start) -> Result<Self, Fault> {
        let mut eskf = Eskf::new(options.params()).map_err(|error: ParamsError| Fault::from(error))?;
        eskf.start(start).map_err(|refusal| Fault::new(refusal.to_string()))?;
        let stream = Stream::new(StreamParams { patience: options.patience, ..StreamParams::default() });
        Ok(Self { eskf, gnss: stream, odometry: stream, pose: stream })
    }

    pub(super) fn eskf(&self) -> &Eskf {
        &self.eskf
    }

    pub(super) fn estimate(&self) -> Option<&Estimate<NAVIGATION>> {
        self.eskf.estimate()
    }

    pub(super) fn position(&self) -> Option<Vector3<f64>> {
        self.estimate().map(|estimate| estimate.position)
    }

    /// Standard deviation of the horizontal position, in the direction where it is least known, m.
    pub(super) fn horizontal_deviation(&self) -> f64 {
        let covariance = self.eskf.covariance();
        let of = |i: usize, j: usize| covariance[(POSITION + i, POSITION + j)];
        largest_deviation(of(0, 0), of(0, 1), of(1, 1))
    }

    /// What became of the measurements: satellites, odometry, poses.
    pub(super) fn counts(&self) -> [&Counts; 3] {
        [self.gnss.counts(), self.odometry.counts(), self.pose.counts()]
    }

    /// What its health is judged by.
    pub(super) fn sight<'a>(&self, counts: &'a [&'a Counts]) -> Option<Sight<'a>> {
        Some(Sight {
            now_ns: self.time_ns()?,
            counts,
            dead_reckoning_s: self.eskf.dead_reckoning_s(),
            deviation: self.horizontal_deviation(),
        })
    }

    pub(super) fn move_world(&mut self, new_from_old: &Isometry3<f64>) -> Result<(), Refusal> {
        self.eskf.move_world(new_from_old)
    }
}

impl Replayed for Filter {
    type Measurement = Measured;

    fn time_ns(&self) -> Option<i64> {
        self.estimate().map(|estimate| estimate.time_ns)
    }

    fn propagate(&mut self, sample: &ImuMean) -> Result<(), Refusal> {
        self.eskf.propagate(sample)
    }

    fn update(&mut self, measured: &Measured) -> Result<Fused, Refusal> {
        match measured {
            Measured::Gnss(fix) => self.eskf.update(&mut self.gnss, fix),
            Measured::Odometry(velocity) => self.eskf.update(&mut self.odometry, velocity),
            Measured::Pose(pose) => self.eskf.update(&mut self.pose, pose),
        }
    }
}
