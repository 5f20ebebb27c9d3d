//! The filter with a stream per sensor.

use super::health::{Sight, largest_deviation};
use super::input::keyframe_at;
use super::options::NavigationOptions;
use super::refuted::Found;
use crate::navigation::eskf::{Eskf, Start};
use crate::navigation::fused::Fused;
use crate::navigation::history::Replayed;
use crate::navigation::math::skew;
use crate::navigation::measurement::{
    AbsolutePose, BarometricHeight, BodyVelocity, GnssPosition, MagneticHeading, NonHolonomic, RelativePose,
    WheelSpeed,
};
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{Estimate, POSITION, ROTATION, States, VELOCITY};
use crate::navigation::stream::{Counts, Stream, StreamParams};
use bb_core::Fault;
use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3};

/// See the [module](self).
#[derive(Clone, Debug)]
pub(super) struct Filter<S: States, const N: usize> {
    eskf: Eskf<S, N>,
    /// Indexed by [`Measured::sensor`].
    streams: [Stream; SENSORS],
}

/// A measurement from one of the sensors.
#[derive(Clone, Copy, Debug)]
pub(super) enum Measured {
    Gnss(GnssPosition),
    Odometry(BodyVelocity),
    Wheels(WheelSpeed),
    Sideways(NonHolonomic),
    Pose(AbsolutePose),
    /// With the start of the next relative pose, ns.
    Relative(RelativePose, i64),
    MagneticField(MagneticHeading),
    Pressure(BarometricHeight),
}

/// The streams of sensors. Wheels have a second one for their motion constraints.
const SENSORS: usize = 7;
const GNSS: usize = 0;
const POSE: usize = 3;
const NAMES: [&str; SENSORS] =
    ["gnss", "odometry", "odometry, sideways", "pose", "relative", "magnetic_field", "pressure"];

impl Measured {
    fn sensor(&self) -> usize {
        match self {
            Self::Gnss(_) => GNSS,
            Self::Odometry(_) | Self::Wheels(_) => 1,
            Self::Sideways(_) => 2,
            Self::Pose(_) => POSE,
            Self::Relative(..) => 4,
            Self::MagneticField(_) => 5,
            Self::Pressure(_) => 6,
        }
    }

    pub(super) fn name(&self) -> &'static str {
        NAMES[self.sensor()]
    }
}

impl<S: States, const N: usize> Filter<S, N> {
    pub(super) fn new(options: &NavigationOptions, start: &Start) -> Result<Self, Fault> {
        let mut eskf = Eskf::new(options.params())?;
        eskf.start(start).map_err(|refusal| Fault::new(refusal.to_string()))?;
        let stream = Stream::new(StreamParams { patience: options.patience, ..StreamParams::default() });
        let mut streams = [stream; SENSORS];
        // If these refute a filter, it is moved instead: see `refuted.rs`.
        for sensor in [GNSS, POSE] {
            streams[sensor] = Stream::new(StreamParams { patience: 0, ..StreamParams::default() });
        }
        Ok(Self { eskf, streams })
    }

    pub(super) fn eskf(&self) -> &Eskf<S, N> {
        &self.eskf
    }

    pub(super) fn estimate(&self) -> Option<&Estimate<N>> {
        self.eskf.estimate()
    }

    pub(super) fn position(&self) -> Option<Vector3<f64>> {
        self.estimate().map(|estimate| estimate.position)
    }

    /// Standard deviation of the horizontal position in its least certain direction, m.
    pub(super) fn horizontal_deviation(&self) -> f64 {
        let covariance = self.eskf.covariance();
        let of = |i: usize, j: usize| covariance[(POSITION + i, POSITION + j)];
        largest_deviation(of(0, 0), of(0, 1), of(1, 1))
    }

    /// Counts of the measurements by result: satellites, odometry, wheel constraints, poses, relative poses, magnetic field,
    /// pressure.
    pub(super) fn counts(&self) -> [&Counts; SENSORS] {
        self.streams.each_ref().map(Stream::counts)
    }

    /// The data from which its health is judged.
    pub(super) fn sight<'a>(&self, counts: &'a [&'a Counts]) -> Option<Sight<'a>> {
        Some(Sight {
            now_ns: self.estimate()?.time_ns,
            counts,
            resets: self.eskf.resets(),
            dead_reckoning_s: self.eskf.dead_reckoning_s(),
            deviation: self.horizontal_deviation(),
        })
    }

    /// Counts of fixes and of poses by result.
    pub(super) fn positions(&self) -> [&Counts; 2] {
        [GNSS, POSE].map(|sensor| self.streams[sensor].counts())
    }

    /// Moves the filter so that its sensor is at the position of `found`. The sensor is at `lever_arm` in the body, m, and
    /// `orientation` gives its rotation, if known.
    pub(super) fn relocate(
        &mut self,
        found: &Found,
        lever_arm: &Vector3<f64>,
        orientation: Option<(UnitQuaternion<f64>, Matrix3<f64>)>,
    ) -> Result<(), Refusal> {
        let estimate = *self.estimate().ok_or(Refusal::NotStarted)?;
        let block = |first: usize| self.eskf.covariance().fixed_view::<3, 3>(first, first).into_owned();
        let own = (estimate.velocity, block(VELOCITY));
        let velocity = found.new_velocity(&own.0, &own.1);
        let (speed, of_speed) = velocity.unwrap_or(own);
        let (rotation, of_rotation) = orientation.unwrap_or((estimate.world_from_body, block(ROTATION)));
        let (position, covariance) = found.at(estimate.time_ns, &speed, &of_speed);
        let arm = rotation * lever_arm;
        let by_rotation = skew(&arm);
        let covariance = covariance + by_rotation * of_rotation * by_rotation.transpose();
        self.eskf.relocate((position - arm, covariance), velocity, orientation)?;
        for sensor in [GNSS, POSE] {
            self.streams[sensor].forgive();
        }
        Ok(())
    }

    pub(super) fn move_world(&mut self, new_from_old: &Isometry3<f64>) -> Result<(), Refusal> {
        self.eskf.move_world(new_from_old)
    }
}

impl<S: States, const N: usize> Replayed for Filter<S, N> {
    type Filter = Eskf<S, N>;
    type Measurement = Measured;

    fn filter(&self) -> &Eskf<S, N> {
        &self.eskf
    }

    fn filter_mut(&mut self) -> &mut Eskf<S, N> {
        &mut self.eskf
    }

    fn update(&mut self, measured: &Measured) -> Result<Fused, Refusal> {
        let Self { eskf, streams } = self;
        let stream = &mut streams[measured.sensor()];
        match measured {
            Measured::Gnss(fix) => eskf.update(stream, fix),
            Measured::Odometry(velocity) => eskf.update(stream, velocity),
            Measured::Wheels(speed) => eskf.update(stream, speed),
            Measured::Sideways(none) => eskf.update(stream, none),
            Measured::Pose(pose) => eskf.update(stream, pose),
            Measured::Relative(relative, end_ns) => {
                let result = eskf.update(stream, relative);
                // The next one begins here, whether this one was fused or not.
                eskf.set_keyframe(keyframe_at(*end_ns));
                result
            }
            Measured::MagneticField(heading) => eskf.update(stream, heading),
            Measured::Pressure(height) => eskf.update(stream, height),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::navigation::History;
    use crate::navigation::eskf::ImuMean;
    use crate::navigation::state::{NAVIGATION, Navigation};

    /// The parts of a gap that a measurement divides are gaps.
    #[test]
    fn a_divided_gap_is_counted() {
        let (rest, level) = (Vector3::zeros(), UnitQuaternion::identity());
        let start = Start::at(0, (rest, 2.0), (rest, 0.5), (level, 0.1));
        let filter = Filter::<Navigation, NAVIGATION>::new(&NavigationOptions::default(), &start).unwrap();
        let mut history = History::<_, 10, 10, 2>::new(filter, 90_000_000).unwrap();
        history.update(90_000_000, &Measured::Gnss(GnssPosition::new(rest, 1.0, 2.0))).unwrap();
        let specific_force = Vector3::new(0.0, 0.0, 9.8);
        history.propagate(&ImuMean { time_ns: 180_000_000, angular_velocity: rest, specific_force }).unwrap();
        assert_eq!(history.now().eskf().gaps(), 2);
    }
}
