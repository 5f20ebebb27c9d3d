//! The filter with a stream per sensor.

use super::correlation::Correlation;
use super::fusing::Sensing;
use super::health::{Sight, Watch, largest_deviation};
use super::input::keyframe_at;
use super::options::NavigationOptions;
use crate::navigation::copies::{Copies, Ways};
use crate::navigation::eskf::{EskfFilter, Start};
use crate::navigation::fused::Fused;
use crate::navigation::history::Replayed;
use crate::navigation::math::sqrt;
use crate::navigation::measurement::{
    AbsolutePose, BarometricHeight, BodyVelocity, GnssHeading, GnssPosition, GnssVelocity, MagneticHeading,
    RelativePose,
};
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{Estimate, NAVIGATION, Optional, POSITION, States, offset};
use crate::navigation::stream::{Counts, Stream};
use bb_core::Fault;
use nalgebra::Isometry3;

/// Copies of the filter, and a stream for each sensor.
#[derive(Clone, Debug)]
pub(super) struct Filter<S: States, const N: usize> {
    copies: Copies<EskfFilter<S, N>>,
    /// Indexed by [`Measured::sensor`].
    streams: [Stream; SENSORS],
    correlation: Correlation,
}

/// A measurement from one of the sensors.
#[derive(Clone, Copy, Debug)]
pub(super) enum Measured {
    Gnss(GnssPosition),
    GnssVelocity(GnssVelocity),
    GnssHeading(GnssHeading),
    Odometry(BodyVelocity),
    Pose(AbsolutePose),
    /// Relative pose, with the start of the next one, ns.
    Relative(RelativePose, i64),
    MagneticField(MagneticHeading),
    Pressure(BarometricHeight),
}

/// The number of sensors, each with a stream.
const SENSORS: usize = 8;
const NAMES: [&str; SENSORS] =
    ["gnss", "odometry", "pose", "relative", "magnetic_field", "pressure", "gnss_velocity", "gnss_heading"];

impl Measured {
    fn sensor(&self) -> usize {
        match self {
            Self::Gnss(_) => 0,
            Self::Odometry(_) => 1,
            Self::Pose(_) => 2,
            Self::Relative(..) => 3,
            Self::MagneticField(_) => 4,
            Self::Pressure(_) => 5,
            Self::GnssVelocity(_) => 6,
            Self::GnssHeading(_) => 7,
        }
    }
}

impl<S: States, const N: usize> Filter<S, N> {
    pub(super) fn new(options: &NavigationOptions, start: &Start) -> Result<Self, Fault> {
        let mut copies = Copies::new(options.params(), Ways { noise: true, scale: true })?;
        copies.start(start).map_err(|refusal| Fault::new(refusal.to_string()))?;
        let stream = Stream::default();
        let correlation = Correlation::new(options.odometry_correlation);
        Ok(Self { copies, streams: [stream; SENSORS], correlation })
    }

    pub(super) fn copies(&self) -> &Copies<EskfFilter<S, N>> {
        &self.copies
    }

    pub(super) fn eskf(&self) -> &EskfFilter<S, N> {
        self.copies.best()
    }

    pub(super) fn estimate(&self) -> Option<&Estimate<N>> {
        self.copies.estimate()
    }

    /// Standard deviation of the horizontal position in its least certain direction, m.
    pub(super) fn horizontal_deviation(&self) -> f64 {
        let covariance = self.eskf().covariance();
        let of = |i: usize, j: usize| covariance[(POSITION + i, POSITION + j)];
        largest_deviation(of(0, 0), of(0, 1), of(1, 1))
    }

    /// Standard deviation of an optional scalar state; 0 if it is not a state.
    pub(super) fn deviation(&self, state: Optional) -> f64 {
        offset::<S>(state).map_or(0.0, |index| sqrt(self.eskf().covariance()[(index, index)]))
    }

    /// Counts of the measurements by result, in the order of [`NAMES`].
    pub(super) fn counts(&self) -> [&Counts; SENSORS] {
        self.streams.each_ref().map(Stream::counts)
    }

    pub(super) fn move_world(&mut self, new_from_old: &Isometry3<f64>) -> Result<(), Refusal> {
        self.copies.move_world(new_from_old)
    }

    fn odometry(&mut self, own: &BodyVelocity) -> Result<Fused, Refusal> {
        let now_ns = self.estimate().ok_or(Refusal::NotStarted)?.time_ns;
        let correlated = BodyVelocity { deviations: own.deviations * self.correlation.factor(now_ns), ..*own };
        self.copies.update_correlated(&mut self.streams[1], own, &correlated)
    }
}

impl<S: States, const N: usize> Replayed for Filter<S, N> {
    type Filter = Copies<EskfFilter<S, N>>;
    type Measurement = Measured;

    fn filter(&self) -> &Copies<EskfFilter<S, N>> {
        &self.copies
    }

    fn filter_mut(&mut self) -> &mut Copies<EskfFilter<S, N>> {
        &mut self.copies
    }

    fn update(&mut self, measured: &Measured) -> Result<Fused, Refusal> {
        if let Measured::Odometry(velocity) = measured {
            return self.odometry(velocity);
        }
        let Self { copies, streams, .. } = self;
        let stream = &mut streams[measured.sensor()];
        match measured {
            Measured::Gnss(fix) => copies.update_fix(stream, fix),
            Measured::GnssVelocity(velocity) => copies.update(stream, velocity),
            Measured::GnssHeading(heading) => copies.update(stream, heading),
            Measured::Odometry(velocity) => copies.update(stream, velocity),
            Measured::Pose(pose) => copies.update_position(stream, pose),
            Measured::Relative(relative, end_ns) => {
                let result = copies.update(stream, relative);
                // The next one begins here, whether this one was fused or not.
                copies.set_keyframe(keyframe_at(*end_ns));
                result
            }
            Measured::MagneticField(heading) => copies.update(stream, heading),
            Measured::Pressure(height) => copies.update(stream, height),
        }
    }
}

impl<S: States, const N: usize> Sensing for Filter<S, N> {
    fn sensor(measured: &Measured) -> &'static str {
        NAMES[measured.sensor()]
    }

    fn is_sound(&self) -> bool {
        let variances = self.eskf().covariance().diagonal();
        self.estimate().is_none_or(|estimate| {
            let numbers =
                estimate.position.iter().chain(&estimate.velocity).chain(estimate.world_from_body.coords.iter());
            numbers.copied().all(f64::is_finite)
                && variances.iter().take(NAVIGATION).all(|variance| variance.is_finite() && *variance >= 0.0)
        })
    }

    fn elsewhere(&self) -> Option<f64> {
        self.copies.elsewhere()
    }

    fn resets(&self) -> u32 {
        self.eskf().resets()
    }

    fn watched(&self, watch: &mut Watch) -> Option<&'static str> {
        watch.look(&Sight {
            now_ns: self.estimate()?.time_ns,
            counts: &self.counts(),
            resets: self.resets(),
            dead_reckoning_s: self.eskf().dead_reckoning_s(),
            deviation: self.horizontal_deviation(),
            heading_deviation: self.copies.heading_deviation(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::navigation::History;
    use crate::navigation::eskf::ImuMean;
    use crate::navigation::state::Navigation;
    use nalgebra::{UnitQuaternion, Vector3};

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
