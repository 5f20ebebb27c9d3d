//! The robots that are scored: each has one filter, declared as in any robot, and runs on virtual time on what a
//! recording holds.

mod configuration;
mod mounted;

pub use configuration::{NAVIGATION_FILTERS, NavigationFilter, NavigationSetting, RobotSettings};

use super::feed::{Feed, INPUTS, Time, What};
use super::record::{Estimate, Record, Verdict};
use bb_core::event::HealthTransition;
use bb_core::nalgebra::{Isometry3, UnitQuaternion, Vector3};
use bb_core::payload::{
    GeodeticPosition, GnssFix, GnssStatus, Imu, MagneticField, Odometry, Orientation, Pose, RelativePose, Twist,
};
use bb_core::prelude::*;
use bb_core::{Builder, Robot, Simulation, system};
use bb_estimators::navigation::planar::{PlanarEstimator, PlanarOutputs, PlanarStatus};
use bb_estimators::navigation::state_estimator::{
    AnchorReading, AttitudeReport, FlightEstimate, FlightEstimator, GpsHealth, GpsReport, RelativePoseReading,
    WarmStartReport,
};
use bb_estimators::navigation::{
    EskfEstimator, Geodetic, LocalFrame, NavigationOutputs, NavigationStatus, Verdicts,
};
use bb_estimators::{Eskf, PlanarEkf, StateEstimator};
use configuration::Kind;
use mounted::{Mounted, MountedOptions, Reasons};
use std::sync::PoisonError;
use std::time::Instant;

robot! {
    /// The filter in three dimensions, with every input that a recording may have.
    robot Spatial;

    link base {
        sensor imu: External<Imu>();
        sensor gnss: External<GnssFix>();
        sensor odometry: External<Odometry>();
        sensor pose: External<Pose>();
        sensor relative: External<RelativePose>();
        sensor magnetic_field: External<MagneticField>();
        sensor gnss_velocity: External<Twist>();
        sensor gnss_heading: External<Orientation>();
        sensor start: External<Odometry>();
        estimator navigation: Eskf<NavigationOutputs>() {
            input imu: sensor::base::imu, driver;
            input gnss: sensor::base::gnss, optional;
            input odometry: sensor::base::odometry, optional;
            input pose: sensor::base::pose, optional;
            input relative: sensor::base::relative, optional;
            input magnetic_field: sensor::base::magnetic_field, optional;
            input gnss_velocity: sensor::base::gnss_velocity, optional;
            input gnss_heading: sensor::base::gnss_heading, optional;
            input start: sensor::base::start, optional;
            output odometry;
            output status;
            lost_after: 200 ms;
            recover_after: 20;
        }
    }
}

robot! {
    /// The filter on a plane.
    robot Planar;

    link base {
        sensor imu: External<Imu>();
        sensor gnss: External<GnssFix>();
        sensor odometry: External<Odometry>();
        sensor pose: External<Pose>();
        sensor orientation: External<Orientation>();
        estimator navigation: PlanarEkf<PlanarOutputs>() {
            input imu: sensor::base::imu, driver;
            input gnss: sensor::base::gnss, optional;
            input odometry: sensor::base::odometry, optional;
            input pose: sensor::base::pose, optional;
            input orientation: sensor::base::orientation, optional;
            output odometry;
            output status;
            lost_after: 200 ms;
            recover_after: 20;
        }
    }
}

robot! {
    /// The estimator of flights.
    robot Flight;

    link base {
        sensor imu: External<Imu>();
        sensor gnss: External<GnssFix>();
        sensor anchor: External<AnchorReading>();
        sensor vio: External<RelativePoseReading>();
        sensor report: External<GpsReport>();
        sensor warm_start: External<WarmStartReport>();
        estimator navigation: StateEstimator() {
            input imu: sensor::base::imu, driver;
            input gnss: sensor::base::gnss, optional;
            input anchor: sensor::base::anchor, optional;
            input vio: sensor::base::vio, optional;
            input gps_health: sensor::base::report, optional;
            input warm_start: sensor::base::warm_start, optional;
            output estimate;
            output events;
            lost_after: 200 ms;
            recover_after: 20;
        }
    }
}

/// The path of the filter in each of them.
pub(super) const NAVIGATION_PATH: &str = "estimator/base/navigation";

/// Runs a filter on a recording.
///
/// # Errors
/// A setting is refused, or the robot cannot start; in words.
pub(crate) fn run(
    filter: &NavigationFilter,
    feed: &Feed,
    settings: &RobotSettings,
    progress: &mut dyn FnMut(),
) -> Result<Record, String> {
    let mut record = match filter.kind {
        Kind::Spatial => spatial(filter, feed, settings, progress),
        Kind::Planar => planar(filter, feed, settings, progress),
        Kind::Flight(strategy) => flight(filter, strategy, feed, settings, progress),
    }?;
    let started_ns = record.estimates.first().map_or(i64::MAX, |estimate| estimate.time_ns);
    for of in &mut record.verdicts {
        let since = feed.usable(of.input).filter(|message| message.arrival_ns > started_ns);
        of.unused = (since.count() as u64).saturating_sub(of.fused + of.refused);
    }
    Ok(record)
}

/// The mountings of the inputs that a recording has, under the names that a filter gives them.
fn mounts(feed: &Feed, names: &[(&'static str, &str)]) -> Vec<(&'static str, Isometry3<f64>)> {
    let mount = |(name, input): &(&'static str, &str)| {
        let index = INPUTS.iter().position(|known| known == input)?;
        Some((*name, (*feed.mounts.get(index)?)?))
    };
    names.iter().filter_map(mount).collect()
}

/// Plays a feed on virtual time, which begins 10 ms before the first message.
fn play<R: Robot>(
    simulation: &mut Simulation<R>,
    feed: &Feed,
    record: &mut Record,
    progress: &mut dyn FnMut(),
    publish: impl Fn(&Simulation<R>, MonotonicTime, &What),
    mut collect: impl FnMut(&mut Record),
) {
    let began = Instant::now();
    for message in &feed.messages {
        simulation.run_until(record.virtual_time(message.arrival_ns));
        publish(simulation, record.virtual_time(message.stamp_ns), &record.rebased(&message.what));
        collect(record);
        if matches!(message.what, What::Imu(_)) {
            record.samples += 1;
            progress();
        }
    }
    record.seconds = began.elapsed().as_secs_f64();
}

/// Parts that all robots have after a run.
fn finish(record: &mut Record, health: impl Iterator<Item = Stamped<HealthTransition>>, reasons: &Reasons) {
    record.health = health.map(|change| (record.time_ns(change.time), change.to)).collect();
    let reasons = std::mem::take(&mut *reasons.lock().unwrap_or_else(PoisonError::into_inner));
    record.reasons = reasons;
}

fn shown<R: Robot>(builder: Builder<R>) -> Result<Simulation<R>, String> {
    builder.simulate().map_err(|error| error.to_string())
}

fn spatial(
    filter: &NavigationFilter,
    feed: &Feed,
    settings: &RobotSettings,
    progress: &mut dyn FnMut(),
) -> Result<Record, String> {
    let mut builder = Spatial::builder();
    settings.apply(&mut builder, &filter.names())?;
    let names = INPUTS.map(|name| (name, name));
    let reasons = Reasons::default();
    let options = MountedOptions {
        options: *builder.options(spatial::estimator::base::navigation),
        inputs: mounts(feed, &names),
        reasons: Reasons::clone(&reasons),
    };
    builder
        .replace_estimator::<Mounted<EskfEstimator<NavigationOutputs>>>(NAVIGATION_PATH, options)
        .map_err(|fault| fault.to_string())?;
    let odometry = builder.subscribe(spatial::estimator::base::navigation::odometry);
    let status = builder.subscribe(spatial::estimator::base::navigation::status);
    let health = builder.subscribe(system::Health);
    let mut simulation = shown(builder)?;
    let mut record = Record::of(feed);
    let mut last = None;
    let publish = |simulation: &Simulation<Spatial>, time: MonotonicTime, what: &What| {
        use spatial::sensor::base;
        match what.clone() {
            What::Imu(imu) => simulation.live().publish(base::imu, time, imu),
            What::Gnss(fix) => simulation.live().publish(base::gnss, time, fix),
            What::Odometry(odometry) => simulation.live().publish(base::odometry, time, odometry),
            What::Pose(pose) => simulation.live().publish(base::pose, time, pose),
            What::Relative(relative) => simulation.live().publish(base::relative, time, relative),
            What::MagneticField(field) => simulation.live().publish(base::magnetic_field, time, field),
            What::GnssVelocity(twist) => simulation.live().publish(base::gnss_velocity, time, twist),
            What::GnssHeading(heading) => simulation.live().publish(base::gnss_heading, time, heading),
            What::Start(start) => simulation.live().publish(base::start, time, start),
        }
    };
    play(&mut simulation, feed, &mut record, progress, publish, |record| {
        for (odometry, status) in odometry.drain().zip(status.drain()) {
            let NavigationStatus { world_origin: origin, gnss_delay, gnss_delay_deviation, gnss, pose, .. } =
                status.payload;
            let time_ns = record.time_ns(odometry.monotonic_time);
            record.note_positions(time_ns, &gnss, &pose);
            record.estimates.extend(Estimate::of(
                time_ns,
                &odometry.payload,
                origin,
                (gnss_delay, gnss_delay_deviation),
            ));
            last = Some(status.payload);
        }
    });
    simulation.stop();
    finish(&mut record, health.drain(), &reasons);
    if let Some(status) = last {
        let NavigationStatus { gnss, odometry, pose, relative, magnetic_field, .. } = status;
        let verdicts = [gnss, odometry, pose, relative, magnetic_field, status.gnss_velocity, status.gnss_heading];
        record.verdicts = INPUTS.into_iter().skip(1).zip(verdicts).map(|(input, of)| verdict(input, &of)).collect();
        record.resets = status.resets;
    }
    Ok(record)
}

fn verdict(input: &'static str, of: &Verdicts) -> Verdict {
    Verdict { input, fused: of.fused, refused: of.refused + of.invalid, unused: 0 }
}

fn planar(
    filter: &NavigationFilter,
    feed: &Feed,
    settings: &RobotSettings,
    progress: &mut dyn FnMut(),
) -> Result<Record, String> {
    let mut builder = Planar::builder();
    settings.apply(&mut builder, &filter.names())?;
    let names =
        [("imu", "imu"), ("gnss", "gnss"), ("odometry", "odometry"), ("pose", "pose"), ("orientation", "start")];
    let reasons = Reasons::default();
    let options = MountedOptions {
        options: *builder.options(planar::estimator::base::navigation),
        inputs: mounts(feed, &names),
        reasons: Reasons::clone(&reasons),
    };
    builder
        .replace_estimator::<Mounted<PlanarEstimator<PlanarOutputs>>>(NAVIGATION_PATH, options)
        .map_err(|fault| fault.to_string())?;
    let odometry = builder.subscribe(planar::estimator::base::navigation::odometry);
    let status = builder.subscribe(planar::estimator::base::navigation::status);
    let health = builder.subscribe(system::Health);
    let mut simulation = shown(builder)?;
    let mut record = Record::of(feed);
    let mut last = None;
    let publish = |simulation: &Simulation<Planar>, time: MonotonicTime, what: &What| {
        use planar::sensor::base;
        match what.clone() {
            What::Imu(imu) => simulation.live().publish(base::imu, time, imu),
            What::Gnss(fix) => simulation.live().publish(base::gnss, time, fix),
            What::Odometry(odometry) => simulation.live().publish(base::odometry, time, odometry),
            What::Pose(pose) => simulation.live().publish(base::pose, time, pose),
            // The heading of a state to start from.
            What::Start(Odometry { pose, .. }) => {
                let covariance = pose.covariance.map(|of| of.fixed_view::<3, 3>(3, 3).into_owned());
                let orientation = Orientation { world_from_body: pose.world_from_body, covariance };
                simulation.live().publish(base::orientation, time, orientation);
            }
            What::Relative(_) | What::MagneticField(_) | What::GnssVelocity(_) | What::GnssHeading(_) => {}
        }
    };
    play(&mut simulation, feed, &mut record, progress, publish, |record| {
        for (odometry, status) in odometry.drain().zip(status.drain()) {
            let time_ns = record.time_ns(odometry.monotonic_time);
            record.note_positions(time_ns, &status.gnss, &status.pose);
            record.estimates.extend(Estimate::of(time_ns, &odometry.payload, status.world_origin, (0.0, 0.0)));
            last = Some(status.payload);
        }
    });
    simulation.stop();
    finish(&mut record, health.drain(), &reasons);
    record.is_planar = true;
    if let Some(PlanarStatus { gnss, odometry, pose, resets, .. }) = last {
        let verdicts = [gnss, odometry, pose];
        record.verdicts = INPUTS.into_iter().skip(1).zip(verdicts).map(|(input, of)| verdict(input, &of)).collect();
        record.resets = resets;
    }
    Ok(record)
}

fn flight(
    filter: &NavigationFilter,
    strategy: &'static str,
    feed: &Feed,
    settings: &RobotSettings,
    progress: &mut dyn FnMut(),
) -> Result<Record, String> {
    let mut builder = Flight::builder();
    builder.options(flight::estimator::base::navigation).strategy = strategy.to_owned();
    settings.apply(&mut builder, &filter.names())?;
    let names =
        [("imu", "imu"), ("gnss", "gnss"), ("anchor", "pose"), ("vio", "relative"), ("warm_start", "start")];
    let reasons = Reasons::default();
    let options = MountedOptions {
        options: builder.options(flight::estimator::base::navigation).clone(),
        inputs: mounts(feed, &names),
        reasons: Reasons::clone(&reasons),
    };
    builder
        .replace_estimator::<Mounted<FlightEstimator>>(NAVIGATION_PATH, options)
        .map_err(|fault| fault.to_string())?;
    let estimate = builder.subscribe(flight::estimator::base::navigation::estimate);
    let events = builder.subscribe(flight::estimator::base::navigation::events);
    let health = builder.subscribe(system::Health);
    let mut simulation = shown(builder)?;
    let mut record = Record::of(feed);
    // Any place will do for a world that is nowhere on the Earth.
    let world = feed.world.unwrap_or_else(|| LocalFrame::new(Geodetic::from_degrees(48.0, 11.0, 500.0)));
    let earth = OnEarth { world, feed };
    let publish = |simulation: &Simulation<Flight>, time: MonotonicTime, what: &What| {
        use flight::sensor::base;
        match what.clone() {
            What::Imu(imu) => simulation.live().publish(base::imu, time, imu),
            What::Gnss(fix) => {
                // A recording holds no reports on the receiver: a fix is one of a stable receiver.
                let health = if fix.status == GnssStatus::NoFix { GpsHealth::NoFix } else { GpsHealth::Stable };
                simulation.live().publish(base::report, time, GpsReport { health });
                simulation.live().publish(base::gnss, time, fix);
            }
            What::Pose(pose) => simulation.live().publish(base::anchor, time, earth.anchor(&pose)),
            What::Relative(relative) => simulation.live().publish(base::vio, time, earth.vio(&relative)),
            What::Start(start) => simulation.live().publish(base::warm_start, time, earth.warm_start(&start)),
            What::Odometry(_) | What::MagneticField(_) | What::GnssVelocity(_) | What::GnssHeading(_) => {}
        }
    };
    let mut refused = 0;
    play(&mut simulation, feed, &mut record, progress, publish, |record| {
        for message in estimate.drain() {
            record.estimates.push(earth.estimate(record.time_ns(message.time), &message.payload));
        }
        for message in events.drain() {
            refused += message.events.iter().filter(|event| event.kind == "rejected").count() as u64;
        }
    });
    simulation.stop();
    finish(&mut record, health.drain(), &reasons);
    record.refused = refused;
    // It does not count them.
    let positions = ["gnss", "pose"].into_iter().flat_map(|input| feed.usable(input));
    record.positions = positions.map(|message| message.stamp_ns).collect();
    record.positions.sort_unstable();
    Ok(record)
}

/// Poses in the world of a recording as the estimator of flights takes them, which knows places on the Earth alone, and
/// a body that is the IMU with the axes of the link.
struct OnEarth<'a> {
    world: LocalFrame,
    feed: &'a Feed,
}

impl OnEarth<'_> {
    fn place(&self, position: &Vector3<f64>) -> (GeodeticPosition, UnitQuaternion<f64>) {
        let at = self.world.geodetic(position);
        let Geodetic { latitude, longitude, height } = at;
        let place = GeodeticPosition { latitude_rad: latitude, longitude_rad: longitude, altitude: Some(height) };
        (place, self.world.other_from_self(&LocalFrame::new(at)).rotation)
    }

    /// A sensor's pose in the body.
    fn body_from(&self, input: usize) -> Isometry3<f64> {
        let mount =
            |input: usize| self.feed.mounts.get(input).copied().flatten().unwrap_or_else(Isometry3::identity);
        let (sensor, imu) = (mount(input), mount(0).translation.vector);
        Isometry3::from_parts((sensor.translation.vector - imu).into(), sensor.rotation)
    }

    fn anchor(&self, pose: &Pose) -> AnchorReading {
        let body_from_sensor = self.body_from(3);
        let world_from_body = pose.world_from_body * body_from_sensor.rotation.inverse();
        let position = pose.position - world_from_body * body_from_sensor.translation.vector;
        let (position, turn) = self.place(&position);
        let unknown = bb_core::nalgebra::Matrix6::identity() * 0.25;
        AnchorReading {
            provider: 0,
            position,
            world_from_body: turn * world_from_body,
            covariance: pose.covariance.unwrap_or(unknown),
            is_covariance_degraded: false,
        }
    }

    fn vio(&self, relative: &RelativePose) -> RelativePoseReading {
        let body_from_sensor = self.body_from(4);
        let way = Isometry3::from_parts(relative.position.into(), relative.start_from_end);
        let way = body_from_sensor * way * body_from_sensor.inverse();
        let unknown = bb_core::nalgebra::Matrix6::identity() * 2.5e-3;
        RelativePoseReading {
            from: relative.start,
            translation: way.translation.vector,
            from_to: way.rotation,
            covariance: relative.covariance.unwrap_or(unknown),
            accelerometer_bias: None,
            gyroscope_bias: None,
        }
    }

    fn warm_start(&self, start: &Odometry) -> WarmStartReport {
        let imu = self.feed.mounts[0].unwrap_or_else(Isometry3::identity).translation.vector;
        let turn = start.pose.world_from_body;
        let (position, local) = self.place(&(start.pose.position + turn * imu));
        let velocity = turn * (start.twist.linear + start.twist.angular.cross(&imu));
        let block = |of: Option<bb_core::nalgebra::Matrix6<f64>>, first: usize, otherwise: f64| {
            let isotropic = bb_core::nalgebra::Matrix3::identity() * (otherwise * otherwise);
            of.map_or(isotropic, |of| of.fixed_view::<3, 3>(first, first).into_owned())
        };
        let rotation = block(start.pose.covariance, 3, 0.02);
        WarmStartReport {
            attitude: AttitudeReport {
                world_from_body: local * turn,
                tilt_deviation: rotation[(0, 0)].sqrt(),
                heading_deviation: rotation[(2, 2)].sqrt(),
            },
            position,
            position_covariance: block(start.pose.covariance, 0, 0.1),
            velocity: local * velocity,
            velocity_covariance: block(start.twist.covariance, 0, 1.0),
        }
    }

    fn estimate(&self, time_ns: Time, estimate: &FlightEstimate) -> Estimate {
        let GeodeticPosition { latitude_rad, longitude_rad, altitude } = estimate.position;
        let at = Geodetic { latitude: latitude_rad, longitude: longitude_rad, height: altitude.unwrap_or(0.0) };
        let local = LocalFrame::new(at).other_from_self(&self.world).rotation;
        let link_from_imu = self.feed.mounts[0].unwrap_or_else(Isometry3::identity).translation.vector;
        let world_from_body = local * estimate.world_from_body;
        Estimate {
            time_ns,
            position: self.world.position(&at) - world_from_body * link_from_imu,
            velocity: local * estimate.velocity,
            world_from_body,
            angular_velocity: Vector3::zeros(),
            covariance: estimate.covariance,
            origin: self.feed.world.map(|world| *world.origin()),
            delay_s: 0.0,
            delay_deviation_s: 0.0,
        }
    }
}
