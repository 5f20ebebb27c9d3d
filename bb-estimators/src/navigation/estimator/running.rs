//! The filter once it has started, for any set of states.

use super::filter::{Filter, Measured};
use super::health::{Limits, Watch};
use super::height::Heights;
use super::input::{Mounting, NavigationInputs};
use super::options::NavigationOptions;
use super::report::{NavigationStatus, odometry_of, status_of};
use super::world::World;
use crate::navigation::eskf::{ImuMean, Start};
use crate::navigation::geodesy::LocalFrame;
use crate::navigation::history::History;
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{Aided, Complete, NAVIGATION, Navigation, States, Vehicle};
use bb_core::Fault;
use bb_core::payload::Odometry;
use std::any::TypeId;
use std::fmt::Debug;

/// Number of IMU samples by which measurements may be late: 1.3 s at 400 Hz.
const SAMPLES: usize = 512;
const MEASUREMENTS: usize = 128;
/// Each entry is a filter with all its states: more would take many hundred kilobytes.
const STATES: usize = 8;
type Past<S, const N: usize> = History<Filter<S, N>, SAMPLES, MEASUREMENTS, STATES>;

/// Largest lead of a measurement's stamp over the IMU, ns.
const LONGEST_LEAD_NS: i64 = 500_000_000;

/// Interface of a filter to the estimator.
pub(super) trait Core: Debug + Send {
    /// Returns whether all outputs are finite and no variance is negative.
    fn is_sound(&self) -> bool;
    /// Takes a sample and the other new inputs.
    fn take(
        &mut self,
        sample: &ImuMean,
        inputs: &NavigationInputs<'_>,
        options: &NavigationOptions,
        mounting: &Mounting,
    ) -> Result<(), Refusal>;

    /// The frame of the outputs. `None` without satellites.
    fn frame(&self) -> Option<LocalFrame>;

    /// Pose and motion of the link.
    fn odometry(&self, mounting: &Mounting) -> Option<Odometry>;

    /// The remaining status.
    fn status(&self) -> Option<NavigationStatus>;

    /// The distance of positions, m, that are beyond any way of a robot from the filter.
    fn elsewhere(&self) -> Option<f64>;

    /// Returns the reason for which the estimate is not to be trusted, if there is one.
    fn divergence(&mut self) -> Option<&'static str>;
}

#[derive(Debug)]
struct Running<S: States, const N: usize> {
    past: Past<S, N>,
    world: World,
    heights: Heights,
    watch: Watch,
    resets: u32,
}

/// A filter that has started.
///
/// Unless states are declared, they are those that the inputs bring. For states that this crate provides, the function is compiled with
/// this crate and its optimisation level, not with the robot, which may be a debug build.
pub(super) fn started<S: States + Send + 'static, const N: usize>(
    options: &NavigationOptions,
    mounting: &Mounting,
    start: &Start,
    world: World,
    limits: Limits,
) -> Result<Box<dyn Core>, Fault> {
    if TypeId::of::<S>() != TypeId::of::<Navigation>() {
        return running::<S, N>(options, start, world, limits);
    }
    // Without wheels, nothing tells how the IMU is mounted on them.
    let wheel_mounting = if mounting.odometry.is_some() { options.wheel_mounting } else { 0.0 };
    let options = &NavigationOptions { wheel_mounting, ..*options };
    if mounting.relative.is_some() {
        complete(options, start, world, limits)
    } else if mounting.odometry.is_some() {
        vehicle(options, start, world, limits)
    } else {
        aided(options, start, world, limits)
    }
}

fn aided(options: &NavigationOptions, start: &Start, world: World, limits: Limits) -> Result<Box<dyn Core>, Fault> {
    running::<Aided, { Aided::DIMENSION }>(options, start, world, limits)
}

fn vehicle(
    options: &NavigationOptions,
    start: &Start,
    world: World,
    limits: Limits,
) -> Result<Box<dyn Core>, Fault> {
    running::<Vehicle, { Vehicle::DIMENSION }>(options, start, world, limits)
}

fn complete(
    options: &NavigationOptions,
    start: &Start,
    world: World,
    limits: Limits,
) -> Result<Box<dyn Core>, Fault> {
    running::<Complete, { Complete::DIMENSION }>(options, start, world, limits)
}

fn running<S: States + Send + 'static, const N: usize>(
    options: &NavigationOptions,
    start: &Start,
    world: World,
    limits: Limits,
) -> Result<Box<dyn Core>, Fault> {
    let filter = Filter::<S, N>::new(options, start)?;
    let past = Past::new(filter, LONGEST_LEAD_NS).map_err(|refusal| Fault::new(refusal.to_string()))?;
    Ok(Box::new(Running { past, world, heights: Heights::default(), watch: Watch::new(limits), resets: 1 }))
}

impl<S: States, const N: usize> Running<S, N> {
    fn fuse(&mut self, time_ns: i64, measured: Measured) {
        if let Err(refusal) = self.past.update(time_ns, &measured) {
            tracing::debug!(%refusal, sensor = measured.name(), "measurement refused");
        }
    }

    /// Continues with a filter in another place or world. The history belongs to the old one.
    fn begin_again(&mut self, filter: Filter<S, N>, world: World) -> Result<(), Refusal> {
        self.past.restart(filter)?;
        self.world = world;
        Ok(())
    }
}

impl<S: States + Send, const N: usize> Core for Running<S, N> {
    fn take(
        &mut self,
        sample: &ImuMean,
        inputs: &NavigationInputs<'_>,
        options: &NavigationOptions,
        mounting: &Mounting,
    ) -> Result<(), Refusal> {
        self.past.propagate(sample)?;
        if let Some(fix) = inputs.gnss.filter(|fix| fix.is_new())
            && let Some(measured) = self.world.fix(&fix.payload, options, mounting)
        {
            self.fuse(fix.monotonic_time.as_nanos(), Measured::Gnss(measured));
        }
        if let Some(twist) = inputs.gnss_velocity.filter(|twist| twist.is_new()) {
            let measured = mounting.gnss_velocity(&twist.payload, options);
            self.fuse(twist.monotonic_time.as_nanos(), Measured::GnssVelocity(measured));
        }
        if let Some(orientation) = inputs.gnss_heading.filter(|orientation| orientation.is_new()) {
            let measured = mounting.gnss_heading(&orientation.payload, options);
            self.fuse(orientation.monotonic_time.as_nanos(), Measured::GnssHeading(measured));
        }
        if let Some(odometry) = inputs.odometry.filter(|odometry| odometry.is_new()) {
            let measured = mounting.velocity(&odometry.payload, options);
            self.fuse(odometry.monotonic_time.as_nanos(), Measured::Odometry(measured));
        }
        if let Some(pose) = inputs.pose.filter(|pose| pose.is_new()) {
            let measured = self.world.pose(&pose.payload, options, mounting);
            self.fuse(pose.monotonic_time.as_nanos(), Measured::Pose(measured));
        }
        if let Some(relative) = inputs.relative.filter(|relative| relative.is_new()) {
            let end_ns = relative.end.as_nanos();
            let measured = mounting.relative_pose(&relative.payload, options);
            self.fuse(end_ns, Measured::Relative(measured, end_ns));
        }
        if let Some(field) = inputs.magnetic_field.filter(|field| field.is_new()) {
            let measured = mounting.magnetic_heading(&field.payload, options);
            self.fuse(field.monotonic_time.as_nanos(), Measured::MagneticField(measured));
        }
        if let Some(pressure) = inputs.pressure.filter(|pressure| pressure.is_new())
            && let Some(at) = self.past.now().estimate()
        {
            let drop = self.world.drop(&at.position);
            if let Some(height) = self.heights.of_pressure(&pressure.payload, at, drop, options, mounting) {
                self.fuse(pressure.monotonic_time.as_nanos(), Measured::Pressure(height));
            }
        }
        let resets = self.past.now().eskf().resets();
        if resets != self.resets {
            tracing::warn!("it was wrong, and goes on where positions agree");
            // The next reading becomes the barometer's reference.
            (self.resets, self.heights) = (resets, Heights::default());
        }
        let mut world = self.world;
        if let Some(new_from_old) = self.past.now().position().and_then(|position| world.moves_on(&position)) {
            let mut filter = self.past.now().clone();
            filter.move_world(&new_from_old)?;
            self.begin_again(filter, world)?;
        }
        Ok(())
    }

    fn is_sound(&self) -> bool {
        let eskf = self.past.now().eskf();
        eskf.estimate().is_none_or(|estimate| {
            let numbers =
                estimate.position.iter().chain(&estimate.velocity).chain(estimate.world_from_body.coords.iter());
            let variances = (0..NAVIGATION).map(|i| eskf.covariance()[(i, i)]);
            numbers.copied().all(f64::is_finite)
                && variances.into_iter().all(|variance| variance.is_finite() && variance >= 0.0)
        })
    }

    fn frame(&self) -> Option<LocalFrame> {
        self.world.first()
    }

    fn odometry(&self, mounting: &Mounting) -> Option<Odometry> {
        odometry_of(self.past.now(), &self.world, mounting)
    }

    fn status(&self) -> Option<NavigationStatus> {
        status_of(self.past.now(), &self.world)
    }

    fn elsewhere(&self) -> Option<f64> {
        self.past.now().copies().elsewhere()
    }

    fn divergence(&mut self) -> Option<&'static str> {
        let filter = self.past.now();
        let counts = filter.counts();
        filter.sight(&counts).and_then(|sight| self.watch.look(&sight))
    }
}
