//! The filter once it has started, for any set of states.

use super::filter::{Filter, Measured};
use super::health::{Limits, Watch};
use super::height::Heights;
use super::input::{Mounting, NavigationInputs};
use super::options::NavigationOptions;
use super::refuted::{Found, Refuted};
use super::report::{NavigationStatus, odometry_of, status_of};
use super::world::World;
use crate::navigation::eskf::{ImuMean, Start};
use crate::navigation::geodesy::LocalFrame;
use crate::navigation::history::History;
use crate::navigation::measurement::AbsolutePose;
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{NAVIGATION, Navigation, Optional, States, Wheeled, offset};
use crate::navigation::track::TrackPoint;
use bb_core::Fault;
use bb_core::payload::Odometry;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use std::any::TypeId;
use std::fmt::Debug;

/// Number of IMU samples by which measurements may be late: 1.3 s at 400 Hz.
const SAMPLES: usize = 512;
const MEASUREMENTS: usize = 128;
/// Each entry is a filter with all its states: more would take many hundred kilobytes.
const STATES: usize = 8;
type Past<S, const N: usize> = History<Filter<S, N>, SAMPLES, MEASUREMENTS, STATES>;

/// How far ahead of the IMU a measurement may be stamped, ns.
const LONGEST_LEAD_NS: i64 = 500_000_000;

/// Interface of a filter to the estimator.
pub(super) trait Core: Debug + Send {
    /// Whether all outputs are finite and no variance is negative.
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

    /// Why the estimate is not to be trusted, if it is not.
    fn divergence(&mut self) -> Option<&'static str>;
}

#[derive(Debug)]
struct Running<S: States, const N: usize> {
    past: Past<S, N>,
    world: World,
    heights: Heights,
    watch: Watch,
    /// Fixes, and poses.
    fixes: Refuted,
    poses: Refuted,
    /// Orientation of the last pose.
    orientation: Option<(UnitQuaternion<f64>, Matrix3<f64>)>,
}

/// A filter that has started.
///
/// For states that this crate provides, the function is compiled with this crate and its optimisation level. It is not compiled
/// with the robot, which may be a debug build.
pub(super) fn started<S: States + Send + 'static, const N: usize>(
    options: &NavigationOptions,
    start: &Start,
    world: World,
    limits: Limits,
) -> Result<Box<dyn Core>, Fault> {
    let states = TypeId::of::<S>();
    if states == TypeId::of::<Navigation>() {
        plain(options, start, world, limits)
    } else if states == TypeId::of::<Wheeled>() {
        wheeled(options, start, world, limits)
    } else {
        running::<S, N>(options, start, world, limits)
    }
}

fn plain(options: &NavigationOptions, start: &Start, world: World, limits: Limits) -> Result<Box<dyn Core>, Fault> {
    running::<Navigation, NAVIGATION>(options, start, world, limits)
}

fn wheeled(
    options: &NavigationOptions,
    start: &Start,
    world: World,
    limits: Limits,
) -> Result<Box<dyn Core>, Fault> {
    running::<Wheeled, { Wheeled::DIMENSION }>(options, start, world, limits)
}

fn running<S: States + Send + 'static, const N: usize>(
    options: &NavigationOptions,
    start: &Start,
    world: World,
    limits: Limits,
) -> Result<Box<dyn Core>, Fault> {
    let filter = Filter::<S, N>::new(options, start)?;
    let past = Past::new(filter, LONGEST_LEAD_NS).map_err(|refusal| Fault::new(refusal.to_string()))?;
    Ok(Box::new(Running {
        past,
        world,
        heights: Heights::default(),
        watch: Watch::new(limits),
        fixes: Refuted::default(),
        poses: Refuted::default(),
        orientation: None,
    }))
}

impl<S: States, const N: usize> Running<S, N> {
    fn fuse(&mut self, time_ns: i64, measured: Measured) {
        if let Err(refusal) = self.past.update(time_ns, &measured) {
            tracing::debug!(%refusal, sensor = measured.name(), "measurement refused");
        }
    }

    /// If fixes or poses agree with each other but not with the filter, moves the filter to them.
    fn go_where_positions_agree(
        &mut self,
        options: &NavigationOptions,
        mounting: &Mounting,
    ) -> Result<(), Refusal> {
        let now = self.past.now();
        let [of_fixes, of_poses] = now.positions();
        let (found, lever_arm, orientation, world) =
            if let Some(found) = self.fixes.verdict(of_fixes, options.patience) {
                let jump = now.position().map_or(0.0, |position| (found.point.position - position).norm());
                let is_confirmed = self.fixes.confirms(of_fixes, options.patience);
                let world = self.world.corrected(&found.point.position, jump, is_confirmed);
                let position = self.world.position_in(&world, &found.point.position);
                let turn = self.world.rotation_to(&world);
                let velocity = found.velocity.map(|(velocity, deviation)| (turn * velocity, deviation));
                let found = Found { point: TrackPoint { position, ..found.point }, velocity };
                (found, mounting.antenna(), None, world)
            } else if let Some(found) = self.poses.verdict(of_poses, options.patience) {
                (found, Vector3::zeros(), self.orientation, self.world)
            } else {
                return Ok(());
            };
        let mut filter = now.clone();
        filter.relocate(&found, &lever_arm, orientation)?;
        tracing::warn!(position = ?found.point.position, "it was wrong, and begins again where positions agree");
        // The next reading becomes the barometer's reference.
        self.heights = Heights::default();
        let [of_fixes, of_poses] = filter.positions();
        self.fixes.begin(of_fixes);
        self.poses.begin(of_poses);
        self.begin_again(filter, world)
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
            let time_ns = fix.monotonic_time.as_nanos();
            self.world.point(time_ns, &fix.payload, options).into_iter().for_each(|point| self.fixes.see(point));
            self.fuse(time_ns, Measured::Gnss(measured));
        }
        if let Some(odometry) = inputs.odometry.filter(|odometry| odometry.is_new()) {
            let time_ns = odometry.monotonic_time.as_nanos();
            if offset::<S>(Optional::WheelScale).is_some() {
                let (speed, sideways) = mounting.wheels(&odometry.payload, options);
                self.fuse(time_ns, Measured::Wheels(speed));
                self.fuse(time_ns, Measured::Sideways(sideways));
            } else {
                self.fuse(time_ns, Measured::Odometry(mounting.velocity(&odometry.payload, options)));
            }
        }
        if let Some(pose) = inputs.pose.filter(|pose| pose.is_new()) {
            let measured = self.world.pose(&pose.payload, options, mounting);
            let time_ns = pose.monotonic_time.as_nanos();
            let AbsolutePose { position, position_covariance: covariance, .. } = measured;
            self.poses.see(TrackPoint { time_ns, position, covariance, yaw: 0.0 });
            self.orientation = Some((measured.world_from_body, measured.rotation_covariance));
            self.fuse(time_ns, Measured::Pose(measured));
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
        self.go_where_positions_agree(options, mounting)?;
        let mut world = self.world;
        if let Some(new_from_old) = self.past.now().position().and_then(|position| world.moves_on(&position)) {
            let mut filter = self.past.now().clone();
            filter.move_world(&new_from_old)?;
            self.fixes.move_world();
            self.poses.move_world();
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

    fn divergence(&mut self) -> Option<&'static str> {
        let filter = self.past.now();
        let counts = filter.counts();
        filter.sight(&counts).and_then(|sight| self.watch.look(&sight))
    }
}
