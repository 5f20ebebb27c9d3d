//! The filter once it has started, for any set of states.

use super::filter::{Filter, Measured};
use super::fusing::{Fusing, Taken, new_of};
use super::health::Limits;
use super::height::Heights;
use super::input::{Mounting, NavigationInputs};
use super::options::NavigationOptions;
use super::report::{NavigationStatus, odometry_of, status_of};
use super::world::World;
use crate::navigation::eskf::{ImuMean, Start};
use crate::navigation::geodesy::LocalFrame;
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{Aided, Complete, Navigation, States, Vehicle};
use bb_core::Fault;
use bb_core::payload::Odometry;
use std::any::TypeId;
use std::fmt::Debug;

/// Number of states in the history. Each is a filter with all its states: more would take many hundred kilobytes.
const STATES: usize = 8;

/// Interface of a filter to the estimator.
pub(super) trait Core: Debug + Send {
    /// Takes a sample and the other new inputs.
    fn take(
        &mut self,
        sample: &ImuMean,
        inputs: &NavigationInputs<'_>,
        options: &NavigationOptions,
        mounting: &Mounting,
    ) -> Result<(), Refusal>;

    /// See [`Fusing::judge`].
    fn judge(&mut self, taken: Result<(), Refusal>) -> Result<Taken, Fault>;

    /// The frame of the outputs. `None` without satellites.
    fn frame(&self) -> Option<LocalFrame>;

    /// Pose and motion of the link.
    fn odometry(&self, mounting: &Mounting) -> Option<Odometry>;

    /// The remaining status.
    fn status(&self) -> Option<NavigationStatus>;
}

#[derive(Debug)]
struct Running<S: States, const N: usize> {
    fusing: Fusing<Filter<S, N>, STATES>,
    world: World,
    heights: Heights,
}

/// A filter that has started. Unless states are declared, they are those that the inputs bring.
pub(super) fn started<S: States + Send + 'static, const N: usize>(
    options: &NavigationOptions,
    mounting: &Mounting,
    start: &Start,
    world: World,
) -> Result<Box<dyn Core>, Fault> {
    if TypeId::of::<S>() == TypeId::of::<Navigation>() {
        provided(options, mounting, start, world)
    } else {
        running::<S, N>(options, mounting, start, world)
    }
}

/// A filter with states that this crate provides. It is compiled with this crate and its optimisation level, not with the robot, which
/// may be a debug build.
fn provided(
    options: &NavigationOptions,
    mounting: &Mounting,
    start: &Start,
    world: World,
) -> Result<Box<dyn Core>, Fault> {
    // Without wheels, nothing tells how the IMU is mounted on them; and a delay is that of a receiver.
    let wheel_mounting = if mounting.odometry.is_some() { options.wheel_mounting } else { 0.0 };
    let gnss_delay = if mounting.has_receiver() { options.gnss_delay } else { 0.0 };
    let options = &NavigationOptions { wheel_mounting, gnss_delay, ..*options };
    if mounting.relative.is_some() {
        running::<Complete, { Complete::DIMENSION }>(options, mounting, start, world)
    } else if mounting.odometry.is_some() {
        running::<Vehicle, { Vehicle::DIMENSION }>(options, mounting, start, world)
    } else {
        running::<Aided, { Aided::DIMENSION }>(options, mounting, start, world)
    }
}

fn running<S: States + Send + 'static, const N: usize>(
    options: &NavigationOptions,
    mounting: &Mounting,
    start: &Start,
    world: World,
) -> Result<Box<dyn Core>, Fault> {
    let longest_s = options.longest_dead_reckoning;
    let limits = Limits {
        dead_reckoning_s: mounting.has_positions().then_some(longest_s),
        deviation: options.largest_deviation,
    };
    let fusing = Fusing::new(Filter::<S, N>::new(options, start)?, limits)?;
    Ok(Box::new(Running { fusing, world, heights: Heights::default() }))
}

impl<S: States + Send, const N: usize> Core for Running<S, N> {
    fn take(
        &mut self,
        sample: &ImuMean,
        inputs: &NavigationInputs<'_>,
        options: &NavigationOptions,
        mounting: &Mounting,
    ) -> Result<(), Refusal> {
        let fusing = &mut self.fusing;
        fusing.past.propagate(sample)?;
        if let Some((time_ns, fix)) = new_of(inputs.gnss)
            && let Some(measured) = self.world.fix(fix, options, mounting)
        {
            fusing.fuse(time_ns, Measured::Gnss(measured));
        }
        if let Some((time_ns, twist)) = new_of(inputs.gnss_velocity) {
            fusing.fuse(time_ns, Measured::GnssVelocity(mounting.gnss_velocity(twist, options)));
        }
        if let Some((time_ns, orientation)) = new_of(inputs.gnss_heading) {
            fusing.fuse(time_ns, Measured::GnssHeading(mounting.gnss_heading(orientation, options)));
        }
        if let Some((time_ns, odometry)) = new_of(inputs.odometry) {
            fusing.fuse(time_ns, Measured::Odometry(mounting.velocity(odometry, options)));
        }
        if let Some((time_ns, pose)) = new_of(inputs.pose) {
            fusing.fuse(time_ns, Measured::Pose(self.world.pose(pose, options, mounting)));
        }
        if let Some((_, relative)) = new_of(inputs.relative) {
            let end_ns = relative.end.as_nanos();
            fusing.fuse(end_ns, Measured::Relative(mounting.relative_pose(relative, options), end_ns));
        }
        if let Some((time_ns, field)) = new_of(inputs.magnetic_field) {
            fusing.fuse(time_ns, Measured::MagneticField(mounting.magnetic_heading(field, options)));
        }
        if let Some((time_ns, pressure)) = new_of(inputs.pressure)
            && let Some(at) = fusing.now().estimate()
        {
            let drop = self.world.drop(&at.position);
            if let Some(height) = self.heights.of_pressure(pressure, at, drop, options, mounting) {
                fusing.fuse(time_ns, Measured::Pressure(height));
            }
        }
        if fusing.has_moved() {
            // The next reading becomes the barometer's reference.
            self.heights = Heights::default();
        }
        let mut world = self.world;
        if let Some(at) = fusing.now().estimate()
            && let Some(new_from_old) = world.moves_on(&at.position)
        {
            let mut filter = fusing.now().clone();
            filter.move_world(&new_from_old)?;
            // The history belongs to the old world.
            fusing.past.restart(filter)?;
            self.world = world;
        }
        Ok(())
    }

    fn judge(&mut self, taken: Result<(), Refusal>) -> Result<Taken, Fault> {
        self.fusing.judge(taken)
    }

    fn frame(&self) -> Option<LocalFrame> {
        self.world.first()
    }

    fn odometry(&self, mounting: &Mounting) -> Option<Odometry> {
        odometry_of(self.fusing.now(), &self.world, mounting)
    }

    fn status(&self) -> Option<NavigationStatus> {
        status_of(self.fusing.now(), &self.world)
    }
}
