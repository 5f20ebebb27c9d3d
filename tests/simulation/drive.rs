//! A rover whose drivers are replaced by simulated sensors: it drives figures of eight, its receiver loses its satellites and
//! later gives wrong positions, and its wheels spin. One filter in three dimensions and one on a plane estimate where it is.

use bb_core::nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use bb_core::prelude::*;
use bb_estimators::navigation::{Geodetic, LocalFrame};
use bb_estimators::simulation::{
    GnssFault, SimulatedGnssOptions, SimulatedLinkImuOptions, SimulatedWheelsOptions, SimulatedWorld,
};
use bb_estimators::{Eskf, PlanarEkf, SimulatedGnss, SimulatedLinkImu, SimulatedWheels};
use std::marker::PhantomData;

type Failure = Box<dyn std::error::Error>;

/// A driver of hardware that is not here.
#[derive(Debug)]
struct Driver<P>(PhantomData<fn() -> P>);

impl<P: bb_core::Payload> Sensor for Driver<P> {
    type Options = NoOptions;
    type Output = P;

    fn init(_: NoOptions, _: &SensorContext) -> Result<Self, Fault> {
        Err(Fault::new("no such device"))
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<P>, Fault> {
        Err(Fault::new("no such device"))
    }
}

robot! {
    robot Rover;

    link base {
        sensor wheels: Driver<Odometry>() { rate: 20 Hz; }
        joint bracket: fixed {
            origin: { xyz: [10 cm, 0 m, 30 cm], rpy: [180 deg, 0 deg, 90 deg] };
            link board { sensor imu: Driver<Imu>() { rate: 100 Hz; } }
        }
        joint mast: fixed {
            origin: { xyz: [-50 cm, 20 cm, 1.5 m] };
            link antenna { sensor gnss: Driver<GnssFix>() { rate: 5 Hz; } }
        }
        estimator space: Eskf(heading = 26.565 deg, heading_deviation = 3 deg, wheel_mounting = 1 deg, gnss_delay = 1 ms) {
            input imu: sensor::base::bracket::board::imu, driver;
            input gnss: sensor::base::mast::antenna::gnss, optional, within: 1 s;
            input odometry: sensor::base::wheels, optional, within: 1 s;
        }
        estimator plane: PlanarEkf(heading = 26.565 deg, heading_deviation = 3 deg) {
            input imu: sensor::base::bracket::board::imu, driver;
            input gnss: sensor::base::mast::antenna::gnss, optional, within: 1 s;
            input odometry: sensor::base::wheels, optional, within: 1 s;
        }
    }
}

const GNSS: &str = "sensor/base/mast/antenna/gnss";
const IMU: &str = "sensor/base/bracket/board/imu";
const WHEELS: &str = "sensor/base/wheels";

/// An eight, 40 m long and 10 m wide, a round in a minute; at rest for three seconds, then faster and faster up to 2 m/s.
fn eight(time_s: f64) -> Isometry3<f64> {
    let moving = (time_s - 3.0).max(0.0);
    let angle = 0.1 * moving * moving.powi(3) / (moving.powi(3) + 8.0);
    let position = Translation3::new(20.0 * angle.sin(), 5.0 * (2.0 * angle).sin(), 0.0);
    let heading = (10.0 * (2.0 * angle).cos()).atan2(20.0 * angle.cos());
    Isometry3::from_parts(position, UnitQuaternion::from_euler_angles(0.0, 0.0, heading))
}

/// Estimates of a filter in a span of time: their largest error, m, and the deviation at the end, m.
#[derive(Debug, Default)]
struct Span {
    /// Number of tenths of a second with an estimate.
    spoken: usize,
    worst: f64,
    last: f64,
    deviation: f64,
}

/// Faults of the drive, if any.
#[derive(Clone, Copy, Debug)]
struct Faults {
    /// Excess speed of the wheels when they spin, m/s.
    slip: f64,
    /// Seed of the noise.
    seed: u64,
    /// Noise with which the filter on a plane lets the rover change its speed, m/s²/√Hz.
    forward_acceleration: f64,
}

/// Faults with the default settings of the filter.
const FAULTS: Faults = Faults { slip: 6.0, seed: 0, forward_acceleration: 1.0 };

/// The errors of both filters between the given times.
fn drive(faults: Option<Faults>, spans: &[f64]) -> Result<[Vec<Span>; 2], Failure> {
    let mut builder = Rover::builder();
    let delay = Duration::from_millis(120);
    let seed = faults.map_or(0, |faults| faults.seed);
    if let Some(Faults { forward_acceleration, .. }) = faults {
        builder.options(rover::estimator::base::plane).forward_acceleration = forward_acceleration;
    }
    builder.replace_sensor::<SimulatedGnss>(
        GNSS,
        SimulatedGnssOptions { delay, seed, ..SimulatedGnssOptions::defaults() },
    )?;
    let imu = SimulatedLinkImuOptions { seed, ..SimulatedLinkImuOptions::defaults() };
    builder.replace_sensor::<SimulatedLinkImu>(IMU, imu)?;
    let (speed_noise, yaw_rate_noise) = (0.05, 0.05);
    let wheels = SimulatedWheelsOptions { seed, speed_noise, yaw_rate_noise, ..SimulatedWheelsOptions::defaults() };
    builder.replace_sensor::<SimulatedWheels>(WHEELS, wheels)?;
    let fixes = builder.subscribe(rover::sensor::base::mast::antenna::gnss);
    let estimates =
        [builder.subscribe(rover::estimator::base::space), builder.subscribe(rover::estimator::base::plane)];
    let mut simulation = builder.simulate()?;
    let world = simulation.shared(|| SimulatedWorld::new(Rover::TOPOLOGY));
    world.move_root(MonotonicTime::ZERO, eight);
    let mut errors = [Vec::new(), Vec::new()];
    let mut origin = None;
    let at_s = |seconds: f64| MonotonicTime::ZERO + Duration::from_secs_f64(seconds);
    for span in spans.windows(2) {
        let mut of_span = [Span::default(), Span::default()];
        let mut now = span[0];
        while now < span[1] {
            now += 0.1;
            simulation.run_until(at_s(now));
            if let Some(Faults { slip, .. }) = faults {
                let is_within = |from: f64, to: f64| (from..to).contains(&now);
                let offset = Vector3::new(40.0, -25.0, 0.0);
                let fault = if is_within(60.0, 68.0) { GnssFault::Offset(offset) } else { GnssFault::None };
                world.set_gnss_fault(GNSS, if is_within(30.0, 50.0) { GnssFault::Outage } else { fault });
                world.set_slip(WHEELS, if is_within(78.0, 79.5) { slip } else { 0.0 });
            }
            // Both filters take the first fix, of a robot at rest, as the origin of their world.
            let first = fixes.drain().find_map(|fix| fix.position);
            if let (None, Some(first)) = (origin, first) {
                let options = SimulatedGnssOptions::defaults();
                let frame = LocalFrame::new(Geodetic {
                    latitude: options.latitude,
                    longitude: options.longitude,
                    height: options.height,
                });
                let height = first.altitude.ok_or("a height")?;
                let first = Geodetic { latitude: first.latitude_rad, longitude: first.longitude_rad, height };
                origin = Some(frame.position(&first));
            }
            for (estimates, span) in estimates.iter().zip(&mut of_span) {
                let (Some(estimate), Some(origin)) = (estimates.drain().last(), origin) else { continue };
                let truth = world.pose("base", estimate.monotonic_time)?.translation.vector;
                let error = (estimate.pose.position + origin - truth).xy().norm();
                let covariance = estimate.pose.covariance.ok_or("a covariance")?;
                span.deviation = (covariance[(0, 0)] + covariance[(1, 1)]).sqrt();
                assert!(error.is_finite() && span.deviation > 0.0, "at {now} s: {error} m, {} m", span.deviation);
                span.worst = span.worst.max(error);
                span.spoken += 1;
                span.last = error;
            }
        }
        let tenths = ((span[1] - span[0]) * 10.0).round() as usize;
        for (errors, of_span) in errors.iter_mut().zip(of_span) {
            assert!(of_span.spoken + 1 >= tenths || span[0] == 0.0, "from {} s: {of_span:?}", span[0]);
            errors.push(of_span);
        }
    }
    let report = simulation.stop().ok()?;
    assert!(report.estimator("estimator/base/space").is_some_and(|space| space.emitted > 1000), "{report}");
    Ok(errors)
}

#[test]
fn estimators_know_where_a_simulated_rover_is() -> Result<(), Failure> {
    for (name, spans) in ["space", "plane"].iter().zip(drive(None, &[10.0, 60.0])?) {
        assert!(spans[0].worst < 0.6 && spans[0].last < 0.4, "{name}: {spans:?}");
    }
    Ok(())
}

#[test]
fn they_survive_lost_and_wrong_satellites_and_spinning_wheels() -> Result<(), Failure> {
    for (name, spans) in
        ["space", "plane"].iter().zip(drive(Some(FAULTS), &[10.0, 30.0, 50.0, 60.0, 68.0, 78.0, 80.0, 100.0])?)
    {
        let [before, outage, _, wrong, _, spinning, after] = spans.as_slice() else { return Err("seven".into()) };
        assert!(before.worst < 0.6, "{name}: {before:?}");
        // By wheels and gyroscope alone, and less sure from second to second.
        assert!(outage.worst < 1.5 && outage.deviation > 1.3 * before.deviation, "{name}: {outage:?} {before:?}");
        // The fixes are 47 m off.
        assert!(wrong.worst < 1.0, "{name}: {wrong:?}");
        // The wheels would have it 9 m further on.
        assert!(spinning.worst < 1.0, "{name}: {spinning:?}");
        assert!(after.last < 0.4, "{name}: {after:?}");
    }
    Ok(())
}

/// Wheels that spin, as `book/src/how-to/navigation.md` says. With an accelerometer no spin is believed. On a plane, wheels are refused for as long as the
/// rover cannot have sped up like that by its settings.
#[test]
fn a_spin_is_believed_if_the_rover_can_speed_up_like_that() -> Result<(), Failure> {
    for seed in 0..4 {
        let spin = |slip: f64, forward_acceleration: f64| -> Result<[f64; 2], Failure> {
            let faults = Faults { slip, seed, forward_acceleration };
            let [space, plane] = drive(Some(faults), &[10.0, 78.0, 80.0])?;
            Ok([space[1].worst, plane[1].worst])
        };
        for slip in [2.0, 3.0, 4.0, 6.0] {
            let [space, plane] = spin(slip, 0.3)?;
            assert!(space < 0.5 && plane < 0.8, "seed {seed}, {slip} m/s: {space} m and {plane} m");
        }
        let [space, plane] = spin(3.0, FAULTS.forward_acceleration)?;
        assert!(space < 0.5 && (2.0..4.0).contains(&plane), "seed {seed}, by default: {space} m and {plane} m");
    }
    Ok(())
}

/// Fixes come late by the delay, with the time at which they were measured, and none comes from an outage.
#[test]
fn a_simulated_receiver_has_the_delay_and_the_faults_that_are_set() -> Result<(), Failure> {
    let mut builder = Rover::builder();
    let options = SimulatedGnssOptions {
        delay: Duration::from_millis(330),
        horizontal_noise: 0.0,
        vertical_noise: 0.0,
        ..SimulatedGnssOptions::defaults()
    };
    let frame = LocalFrame::new(Geodetic {
        latitude: options.latitude,
        longitude: options.longitude,
        height: options.height,
    });
    builder.replace_sensor::<SimulatedGnss>(GNSS, options)?;
    builder.replace_sensor::<SimulatedLinkImu>(IMU, SimulatedLinkImuOptions::defaults())?;
    builder.replace_sensor::<SimulatedWheels>(WHEELS, SimulatedWheelsOptions::defaults())?;
    let fixes = builder.subscribe(rover::sensor::base::mast::antenna::gnss);
    let mut simulation = builder.simulate()?;
    let world = simulation.shared(|| SimulatedWorld::new(Rover::TOPOLOGY));
    world.move_root(MonotonicTime::ZERO, eight);
    let millis = |millis: u64| MonotonicTime::ZERO + Duration::from_millis(millis);
    simulation.run_until(millis(329));
    assert_eq!(fixes.drain().count(), 0);
    simulation.run_until(millis(10_000));
    let times: Vec<_> = fixes.drain().map(|fix| fix.monotonic_time).collect();
    // Measured each 200 ms; the last two are on their way.
    assert_eq!(times, (0..49).map(|number| millis(200 * number)).collect::<Vec<_>>());
    let offset = Vector3::new(3.0, -4.0, 2.0);
    world.set_gnss_fault(GNSS, GnssFault::Offset(offset));
    simulation.run_until(millis(12_000));
    let fix = fixes.drain().last().ok_or("it measures")?;
    let place = fix.position.ok_or("a position")?;
    let place = Geodetic {
        latitude: place.latitude_rad,
        longitude: place.longitude_rad,
        height: place.altitude.ok_or("a height")?,
    };
    let antenna = world.pose("antenna", fix.monotonic_time)?.translation.vector;
    assert!((frame.position(&place) - antenna - offset).norm() < 1e-3, "{fix:?}");
    world.set_gnss_fault(GNSS, GnssFault::Outage);
    simulation.run_until(millis(13_000));
    let fix = fixes.drain().last().ok_or("it says that it has none")?;
    assert_eq!((fix.status, fix.position), (GnssStatus::NoFix, None));
    world.set_unplugged(GNSS, true);
    simulation.run_until(millis(13_500));
    assert_eq!(fixes.drain().filter(|fix| fix.monotonic_time > millis(13_000)).count(), 0);
    Ok(())
}
