//! The filter, with its sensors and outputs.

use super::height::of_pressure;
use super::input::{NavigationInputs, Setup, keyframe_at};
use super::life::{Running, Sensed, Sensing, World, new_of};
use super::report::{Motion, NavigationStatus, status_of};
use super::starting::Starting;
use crate::navigation::eskf::EskfFilter;
use crate::navigation::fused::Fused;
use crate::navigation::measurement::{
    AbsolutePose, BarometricHeight, BodyVelocity, GnssHeading, GnssPosition, GnssVelocity, MagneticHeading,
    RelativePose,
};
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{NAVIGATION, POSITION, States};
use bb_core::payload::Odometry;

/// A measurement from one of the sensors.
#[derive(Clone, Copy, Debug)]
pub(in crate::navigation) enum Measured {
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

impl<S: States + Send, const N: usize> Sensing for EskfFilter<S, N> {
    type Starting = Starting;
    type Measured = Measured;

    const NAMES: &'static [&'static str] =
        &["gnss", "odometry", "pose", "relative", "magnetic_field", "pressure", "gnss_velocity", "gnss_heading"];

    fn sensor(measured: &Measured) -> usize {
        match measured {
            Measured::Gnss(_) => 0,
            Measured::Odometry(_) => 1,
            Measured::Pose(_) => 2,
            Measured::Relative(..) => 3,
            Measured::MagneticField(_) => 4,
            Measured::Pressure(_) => 5,
            Measured::GnssVelocity(_) => 6,
            Measured::GnssHeading(_) => 7,
        }
    }

    fn correct(sensed: &mut Sensed<Self>, measured: &Measured) -> Result<Fused, Refusal> {
        let Sensed { copies, streams, correlation } = sensed;
        let stream = &mut streams[Self::sensor(measured)];
        match measured {
            Measured::Gnss(fix) => copies.update_fix(stream, fix),
            Measured::GnssVelocity(velocity) => copies.update(stream, velocity),
            Measured::GnssHeading(heading) => copies.update(stream, heading),
            Measured::Odometry(own) => {
                let now_ns = copies.estimate().ok_or(Refusal::NotStarted)?.time_ns;
                let deviations = own.deviations * correlation.factor(now_ns);
                copies.update_correlated(stream, own, &BodyVelocity { deviations, ..*own })
            }
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

    fn fuse<const STATES: usize>(
        running: &mut Running<Self, STATES>,
        inputs: &NavigationInputs<'_>,
        setup: &Setup,
    ) -> Result<(), Refusal> {
        if let Some((time_ns, fix)) = new_of(inputs.gnss)
            && let Some(measured) = setup.fix(fix, &running.world)
        {
            running.fuse(time_ns, Measured::Gnss(measured));
        }
        if let Some((time_ns, twist)) = new_of(inputs.gnss_velocity) {
            running.fuse(time_ns, Measured::GnssVelocity(setup.gnss_velocity(twist)));
        }
        if let Some((time_ns, orientation)) = new_of(inputs.gnss_heading) {
            running.fuse(time_ns, Measured::GnssHeading(setup.gnss_heading(orientation)));
        }
        if let Some((time_ns, odometry)) = new_of(inputs.odometry) {
            running.fuse(time_ns, Measured::Odometry(setup.velocity(odometry)));
        }
        if let Some((time_ns, pose)) = new_of(inputs.pose) {
            running.fuse(time_ns, Measured::Pose(setup.absolute_pose(pose, &running.world)));
        }
        if let Some((_, relative)) = new_of(inputs.relative) {
            let end_ns = relative.end.as_nanos();
            running.fuse(end_ns, Measured::Relative(setup.relative_pose(relative), end_ns));
        }
        if let Some((time_ns, field)) = new_of(inputs.magnetic_field) {
            running.fuse(time_ns, Measured::MagneticField(setup.magnetic_heading(field)));
        }
        if let Some((time_ns, pressure)) = new_of(inputs.pressure)
            && let Some(at) = running.past.now().copies.estimate()
            && let Some(height) = of_pressure(pressure, at, &mut running.world, setup)
        {
            running.fuse(time_ns, Measured::Pressure(height));
        }
        if running.has_moved() {
            // The next reading becomes the barometer's reference.
            running.world.pressure = None;
        }
        let mut world = running.world;
        if let Some(at) = running.now().copies.estimate()
            && let Some(new_from_old) = world.moves_on(&at.position)
        {
            let mut sensed = running.now().clone();
            sensed.copies.move_world(&new_from_old)?;
            // The history belongs to the old world.
            running.past.restart(sensed)?;
            running.world = world;
        }
        Ok(())
    }

    fn odometry(&self, world: &World, setup: &Setup) -> Option<Odometry> {
        Some(Motion::of(self)?.of_link(&setup.link(), &world.first_from_frame))
    }

    fn status(sensed: &Sensed<Self>, world: &World) -> Option<NavigationStatus> {
        status_of(sensed, world)
    }

    fn is_sound(&self) -> bool {
        let variances = self.covariance().diagonal();
        self.estimate().is_none_or(|estimate| {
            let numbers =
                estimate.position.iter().chain(&estimate.velocity).chain(estimate.world_from_body.coords.iter());
            numbers.copied().all(f64::is_finite)
                && variances.iter().take(NAVIGATION).all(|variance| variance.is_finite() && *variance >= 0.0)
        })
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
    use crate::navigation::eskf::{EskfParams, ImuMean, Start};
    use crate::navigation::state::Navigation;
    use nalgebra::{UnitQuaternion, Vector3};

    /// The parts of a gap that a measurement divides are gaps.
    #[test]
    fn a_divided_gap_is_counted() {
        let (rest, level) = (Vector3::zeros(), UnitQuaternion::identity());
        let start = Start::at(0, (rest, 2.0), (rest, 0.5), (level, 0.1));
        let sensed = Sensed::<EskfFilter<Navigation, NAVIGATION>>::new(EskfParams::default(), &start, 1.0).unwrap();
        let mut history = History::<_, 10, 10, 2>::new(sensed, 90_000_000).unwrap();
        history.update(90_000_000, &Measured::Gnss(GnssPosition::new(rest, 1.0, 2.0))).unwrap();
        let specific_force = Vector3::new(0.0, 0.0, 9.8);
        history.propagate(&ImuMean { time_ns: 180_000_000, angular_velocity: rest, specific_force }).unwrap();
        assert_eq!(history.now().best().gaps(), 2);
    }
}
