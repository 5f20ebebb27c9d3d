//! A rover that navigates by an IMU, wheels and satellites, each of which fails in turn.

use bb_core::nalgebra::{Matrix3, UnitQuaternion, Vector3};
use bb_core::payload::{GeodeticPosition, GnssFix, GnssServices, GnssStatus, Twist};
use bb_core::prelude::*;
use bb_estimators::Eskf;
use bb_estimators::navigation::{Geodetic, LocalFrame, NavigationOutputs, NavigationStatus};
use bb_tests::random::Random;
use std::f64::consts::{FRAC_PI_2, PI};

robot! {
    robot Surveyor;

    link base {
        sensor wheels: External<Odometry>();
        joint bracket: fixed {
            // Upside down and turned by a quarter.
            origin: { xyz: [0 m, 0 m, 40 cm], rpy: [180 deg, 0 deg, 90 deg] };
            link board { sensor imu: External<Imu>(); }
        }
        joint mast: fixed {
            origin: { xyz: [-50 cm, 20 cm, 1.5 m] };
            link antenna { sensor gnss: External<GnssFix>(); }
        }
        estimator navigation: Eskf<NavigationOutputs>(
            heading_deviation = 3 deg, longest_dead_reckoning = 20 s, wheel_mounting = 1 deg, gnss_delay = 1 ms
        ) {
            input imu: sensor::base::bracket::board::imu, driver;
            input gnss: sensor::base::mast::antenna::gnss, optional, within: 1 s;
            input odometry: sensor::base::wheels, optional, within: 1 s;
            output odometry;
            output status;
            lost_after: 200 ms;
            recover_after: 20;
        }
    }
}

const ANTENNA: Vector3<f64> = Vector3::new(-0.5, 0.2, 1.5);
pub(super) const ORIGIN: (f64, f64, f64) = (48.1, 11.6, 520.0);
const STEP_MILLIS: i64 = 10;

/// Motion of the rover at a time: it is at rest for three seconds, speeds up to 2 m/s along its x axis, east, and then drives on a circle
/// of 20 m.
pub(super) struct Truth {
    pub(super) position: Vector3<f64>,
    pub(super) heading: f64,
    pub(super) speed: f64,
    pub(super) rate: f64,
    pub(super) acceleration: Vector3<f64>,
}

pub(super) fn truth(seconds: f64) -> Truth {
    const RADIUS: f64 = 20.0;
    let straight = |x: f64, speed: f64, forward: f64| Truth {
        position: Vector3::new(x, 0.0, 0.0),
        heading: 0.0,
        speed,
        rate: 0.0,
        acceleration: Vector3::new(forward, 0.0, 0.0),
    };
    match seconds {
        ..=3.0 => straight(0.0, 0.0, 0.0),
        ..=5.0 => straight(0.5 * (seconds - 3.0).powi(2), seconds - 3.0, 1.0),
        _ => {
            let heading = (seconds - 5.0) * 2.0 / RADIUS;
            let position = Vector3::new(2.0 + RADIUS * heading.sin(), RADIUS * (1.0 - heading.cos()), 0.0);
            Truth {
                position,
                heading,
                speed: 2.0,
                rate: 2.0 / RADIUS,
                acceleration: Vector3::new(0.0, 4.0 / RADIUS, 0.0),
            }
        }
    }
}

/// Noise of sensors, the same on every run, with a standard deviation of 1.
pub(super) struct Noise(Random);

impl Noise {
    pub(super) fn new(seed: u64) -> Self {
        Self(Random::new(seed))
    }

    pub(super) fn next(&mut self) -> f64 {
        self.0.noise()
    }

    pub(super) fn vector(&mut self) -> Vector3<f64> {
        Vector3::new(self.next(), self.next(), self.next())
    }
}

/// Failure of a sensor, and its time.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Failure {
    Nothing,
    /// No fixes in that span, in seconds.
    NoFixes(f64, f64),
    /// Fixes are 80 m off.
    WrongFixes(f64, f64),
    /// No wheels.
    NoWheels(f64, f64),
    /// Wheels that spin: they count 3 m/s more.
    SpinningWheels(f64, f64),
    /// No samples of the IMU.
    NoImu(f64, f64),
    /// Samples that are not numbers.
    WrongImu(f64, f64),
    /// Fixes that come 0.8 s late.
    LateFixes,
}

impl Failure {
    fn is(self, of: fn(f64, f64) -> Self, seconds: f64) -> bool {
        let (Self::NoFixes(from, to)
        | Self::WrongFixes(from, to)
        | Self::NoWheels(from, to)
        | Self::SpinningWheels(from, to)
        | Self::NoImu(from, to)
        | Self::WrongImu(from, to)) = self
        else {
            return false;
        };
        self == of(from, to) && (from..to).contains(&seconds)
    }
}

/// Errors and reports of a drive.
#[derive(Debug)]
struct Seen {
    /// The largest horizontal error of the position after the start, m; after a failure; and at the end.
    worst: f64,
    at_the_end: f64,
    /// The largest error of the attitude after half a minute, rad.
    worst_attitude: f64,
    /// Squared errors of the horizontal position, over what the filter says, in the mean: 2 if it is right.
    consistency: f64,
    status: NavigationStatus,
    health: Vec<(f64, HealthState, HealthReason)>,
    emitted: usize,
}

fn drive(failure: Failure, seconds: f64) -> Result<Seen, StartError> {
    let builder = Surveyor::builder();
    let room = Overflow::DropOldest { capacity: 1 << 16 };
    let odometry = builder.subscribe_with(surveyor::estimator::base::navigation::odometry, room);
    let status = builder.subscribe_with(surveyor::estimator::base::navigation::status, room);
    let health = builder.subscribe(system::Health);
    let mut simulation = builder.simulate()?;
    let frame = LocalFrame::new(Geodetic::from_degrees(ORIGIN.0, ORIGIN.1, ORIGIN.2));
    let board_from_base = UnitQuaternion::from_euler_angles(PI, 0.0, FRAC_PI_2).inverse();
    let mut noise = Noise::new(7);
    let mut late = std::collections::VecDeque::new();
    for step in 0..(seconds * 1000.0) as i64 / STEP_MILLIS {
        let millis = step * STEP_MILLIS;
        let (now, time) = (millis as f64 * 1e-3, MonotonicTime::ZERO + Duration::from_millis(millis as u64));
        let Truth { position, heading, speed, .. } = truth(now);
        if step % 5 == 0 && !failure.is(Failure::NoWheels, now) {
            let spin = if failure.is(Failure::SpinningWheels, now) { 3.0 } else { 0.0 };
            let linear = Vector3::new(speed + spin, 0.0, 0.0) + 0.05 * noise.vector();
            let pose = Pose { position, world_from_body: UnitQuaternion::identity(), covariance: None };
            let twist = Twist { linear, angular: Vector3::zeros(), covariance: None };
            simulation.publish(surveyor::sensor::base::wheels, time, Odometry { pose, twist });
        }
        if step % 20 == 0 && !failure.is(Failure::NoFixes, now) {
            let off = if failure.is(Failure::WrongFixes, now) { 80.0 } else { 0.0 };
            let antenna = position + UnitQuaternion::from_euler_angles(0.0, 0.0, heading) * ANTENNA;
            let measured = frame.geodetic(&(antenna + 0.5 * noise.vector() + Vector3::new(off, 0.0, 0.0)));
            let position = GeodeticPosition {
                latitude_rad: measured.latitude,
                longitude_rad: measured.longitude,
                altitude: Some(measured.height),
            };
            let fix = GnssFix {
                status: GnssStatus::Fix,
                services: GnssServices::default(),
                position: Some(position),
                position_covariance: Some(Matrix3::identity() * 0.25),
            };
            late.push_back((time, fix));
        }
        let delay = if failure == Failure::LateFixes && now > 3.0 { 0.8 } else { 0.0 };
        while late.front().is_some_and(|(stamp, _)| time.seconds_since(*stamp) >= delay) {
            if let Some((stamp, fix)) = late.pop_front() {
                simulation.live().publish(surveyor::sensor::base::mast::antenna::gnss, stamp, fix);
            }
        }
        if !failure.is(Failure::NoImu, now) {
            // The mean over the interval that ends now.
            let Truth { rate, acceleration, .. } = truth(now - 0.5e-3 * STEP_MILLIS as f64);
            let force = acceleration + Vector3::new(0.0, 0.0, 9.80665) + 0.02 * noise.vector();
            let turning =
                Vector3::new(0.0, 0.0, rate) + 0.0017 * noise.vector() + Vector3::new(0.004, -0.003, 0.002);
            let turning = if failure.is(Failure::WrongImu, now) { turning * f64::NAN } else { turning };
            let imu = Imu::new(board_from_base * turning, board_from_base * force);
            simulation.publish(surveyor::sensor::base::bracket::board::imu, time, imu);
        }
    }
    let mut seen = Seen {
        worst: 0.0,
        at_the_end: f64::NAN,
        worst_attitude: 0.0,
        consistency: 0.0,
        status: status.drain().last().map(|status| status.payload).unwrap_or_default(),
        health: health
            .drain()
            .map(|change| {
                (change.monotonic_time.seconds_since(MonotonicTime::ZERO), change.payload.to, change.payload.reason)
            })
            .collect(),
        emitted: 0,
    };
    let mut count = 0.0;
    for message in odometry.drain() {
        let now = message.monotonic_time.seconds_since(MonotonicTime::ZERO);
        let Truth { position, heading, speed, .. } = truth(now);
        let error = (message.pose.position - position - first_fix()).xy();
        let covariance = message.pose.covariance.unwrap_or_default().fixed_view::<2, 2>(0, 0).into_owned();
        if let Some(inverse) = covariance.try_inverse() {
            seen.consistency += (error.transpose() * inverse * error)[(0, 0)];
            count += 1.0;
        }
        seen.worst = seen.worst.max(error.norm());
        seen.at_the_end = error.norm();
        if now > 30.0 {
            let attitude = UnitQuaternion::from_euler_angles(0.0, 0.0, heading);
            seen.worst_attitude = seen.worst_attitude.max(attitude.angle_to(&message.pose.world_from_body));
            let velocity = (message.twist.linear - Vector3::new(speed, 0.0, 0.0)).norm();
            // A heading that is unknown turns 2 m/s by any angle.
            assert!(velocity < 4.5, "{velocity} m/s at {now} s");
        }
        seen.emitted += 1;
    }
    seen.consistency /= count;
    Ok(seen)
}

/// Returns the true origin in the world whose origin is the first fix: at the first fix the rover stood at the true origin, and the fix was
/// the antenna's, with its noise.
fn first_fix() -> Vector3<f64> {
    let mut noise = Noise::new(7);
    // The wheels take the first three.
    noise.vector();
    -(ANTENNA + 0.5 * noise.vector())
}

#[test]
fn a_rover_knows_where_it_is() -> Result<(), StartError> {
    let seen = drive(Failure::Nothing, 90.0)?;
    assert!(seen.worst < 1.0 && seen.at_the_end < 0.25 && seen.worst_attitude < 0.015, "{seen:?}");
    assert!((0.5..4.0).contains(&seen.consistency), "{seen:?}");
    assert_eq!((seen.health.len(), seen.status.gnss.refused, seen.status.gaps), (0, 0, 0), "{seen:?}");
    assert!((seen.status.gyroscope_bias - Vector3::new(0.004, -0.003, 0.002)).norm() < 5e-4, "{seen:?}");
    // With every sample but those of the first second.
    assert!((8890..8905).contains(&seen.emitted), "{seen:?}");
    Ok(())
}

/// The changes of health: when, to what, and why.
fn expect_health(seen: &Seen, expected: &[(std::ops::RangeInclusive<f64>, HealthState, HealthReason)]) {
    assert_eq!(seen.health.len(), expected.len(), "{seen:?}");
    for ((time, state, reason), (when, to, why)) in seen.health.iter().zip(expected) {
        assert!(when.contains(time) && (state, reason) == (to, why), "{seen:?}");
    }
}

use HealthReason::{Diverged, Recovered};
use HealthState::{Degraded, Healthy, Lost};

#[test]
fn a_rover_without_fixes_counts_on_its_wheels_and_says_so_in_time() -> Result<(), StartError> {
    let seen = drive(Failure::NoFixes(40.0, 75.0), 90.0)?;
    assert!(seen.worst < 1.0 && seen.at_the_end < 0.3 && seen.worst_attitude < 0.02, "{seen:?}");
    // 20 s after the last fix, until 20 good samples after the next.
    expect_health(&seen, &[(59.8..=60.1, Degraded, Diverged), (75.0..=75.5, Healthy, Recovered)]);
    Ok(())
}

#[test]
fn a_rover_does_not_believe_fixes_that_are_far_off() -> Result<(), StartError> {
    let seen = drive(Failure::WrongFixes(40.0, 48.0), 90.0)?;
    assert!(seen.worst < 1.0 && seen.at_the_end < 0.25, "{seen:?}");
    assert_eq!(seen.status.gnss.refused, 40, "{seen:?}");
    expect_health(&seen, &[(40.4..=40.7, Degraded, Diverged), (48.0..=48.5, Healthy, Recovered)]);
    Ok(())
}

#[test]
fn a_rover_whose_wheels_spin_or_stop_counting_has_its_satellites() -> Result<(), StartError> {
    let seen = drive(Failure::SpinningWheels(40.0, 42.0), 90.0)?;
    assert!(seen.worst < 1.0 && seen.at_the_end < 0.25, "{seen:?}");
    assert_eq!(seen.status.odometry.refused, 40, "{seen:?}");
    expect_health(&seen, &[(40.1..=40.2, Degraded, Diverged), (42.0..=42.5, Healthy, Recovered)]);
    let seen = drive(Failure::NoWheels(40.0, 80.0), 90.0)?;
    assert!(seen.worst < 1.0 && seen.at_the_end < 0.3, "{seen:?}");
    expect_health(&seen, &[]);
    Ok(())
}

#[test]
fn a_rover_bridges_a_second_without_its_imu() -> Result<(), StartError> {
    for failure in [Failure::NoImu(40.0, 41.0), Failure::WrongImu(40.0, 41.0)] {
        let seen = drive(failure, 90.0)?;
        assert!(seen.worst < 3.0 && seen.at_the_end < 0.2, "{seen:?}");
        assert_eq!(seen.status.gaps, 1, "{seen:?}");
        let lost = (40.1..=40.2, Lost, HealthReason::Lost);
        expect_health(&seen, &[lost, (40.9..=41.1, Degraded, Recovered), (41.1..=41.4, Healthy, Recovered)]);
    }
    Ok(())
}

#[test]
fn a_rover_that_was_blind_for_a_minute_starts_again_in_motion() -> Result<(), StartError> {
    // It drives on, and nobody knows any more where it is heading.
    let seen = drive(Failure::NoImu(40.0, 105.0), 145.0)?;
    assert!((7000..7900).contains(&seen.emitted), "{seen:?}");
    let last = seen.health.last().map(|(_, state, _)| *state);
    assert!(last == Some(Healthy) && seen.at_the_end < 1.0, "{seen:?}");
    Ok(())
}

#[test]
fn fixes_that_come_late_are_as_good_as_in_time() -> Result<(), StartError> {
    let (late, in_time) = (drive(Failure::LateFixes, 90.0)?, drive(Failure::Nothing, 90.0)?);
    assert!(late.at_the_end < 0.2 && late.worst_attitude < 0.015, "{late:?}");
    assert_eq!((late.status.gnss.refused, late.status.gnss.invalid), (0, 0), "{late:?}");
    // The last four have not come.
    assert!(in_time.status.gnss.fused - late.status.gnss.fused <= 5, "{late:?}");
    expect_health(&late, &[]);
    Ok(())
}

/// A vehicle that is on its way when it is switched on, along a straight line for 15 km. Down turns as it goes, by 2.4 mrad.
#[test]
fn a_vehicle_in_motion_takes_its_heading_from_its_course_and_leaves_its_origin_behind() -> Result<(), StartError> {
    const SPEED: f64 = 50.0;
    let mut builder = Surveyor::builder();
    builder.options(surveyor::estimator::base::navigation).heading_deviation = 4.0;
    let room = Overflow::DropOldest { capacity: 1 << 16 };
    let odometry = builder.subscribe_with(surveyor::estimator::base::navigation::odometry, room);
    let mut simulation = builder.simulate()?;
    let frame = LocalFrame::new(Geodetic::from_degrees(ORIGIN.0, ORIGIN.1, ORIGIN.2));
    let world_from_base = UnitQuaternion::from_euler_angles(0.0, 0.0, 2.0);
    let base_from_board = UnitQuaternion::from_euler_angles(PI, 0.0, FRAC_PI_2);
    let position = |seconds: f64| world_from_base * Vector3::new(SPEED * seconds, 0.0, 0.0);
    let mut noise = Noise::new(11);
    let mut first = None;
    for step in 0..30_000 {
        let now = step as f64 * 0.01;
        let time = MonotonicTime::ZERO + Duration::from_millis(10 * step as u64);
        if step % 20 == 0 {
            let measured = position(now) + world_from_base * ANTENNA + 0.5 * noise.vector();
            let place = frame.geodetic(&measured);
            first.get_or_insert(place);
            let position = GeodeticPosition {
                latitude_rad: place.latitude,
                longitude_rad: place.longitude,
                altitude: Some(place.height),
            };
            let fix = GnssFix {
                status: GnssStatus::Fix,
                services: GnssServices::default(),
                position: Some(position),
                position_covariance: Some(Matrix3::identity() * 0.25),
            };
            simulation.publish(surveyor::sensor::base::mast::antenna::gnss, time, fix);
        }
        if step % 5 == 0 {
            // Without wheels, nothing tells the heading of a vehicle that goes straight on.
            let linear = Vector3::new(SPEED, 0.0, 0.0) + 0.05 * noise.vector();
            let pose =
                Pose { position: Vector3::zeros(), world_from_body: UnitQuaternion::identity(), covariance: None };
            let twist = Twist { linear, angular: Vector3::zeros(), covariance: None };
            simulation.publish(surveyor::sensor::base::wheels, time, Odometry { pose, twist });
        }
        let here = LocalFrame::new(frame.geodetic(&position(now)));
        let up = here.other_from_self(&frame).rotation * Vector3::new(0.0, 0.0, 9.80665);
        let force = base_from_board.inverse() * (world_from_base.inverse() * up) + 0.02 * noise.vector();
        let imu = Imu::new(0.0017 * noise.vector(), force);
        simulation.publish(surveyor::sensor::base::bracket::board::imu, time, imu);
    }
    let first = LocalFrame::new(first.expect("there were fixes"));
    let (mut worst, mut last, mut deviation) = (0.0_f64, f64::NAN, f64::NAN);
    let mut emitted = 0;
    for message in
        odometry.drain().filter(|message| message.monotonic_time.seconds_since(MonotonicTime::ZERO) > 60.0)
    {
        let now = message.monotonic_time.seconds_since(MonotonicTime::ZERO);
        let expected = first.position(&frame.geodetic(&position(now)));
        worst = worst.max((message.pose.position - expected).norm());
        last = (frame.other_from_self(&first).rotation * world_from_base).angle_to(&message.pose.world_from_body);
        let covariance = message.pose.covariance.expect("it is known");
        deviation = covariance.fixed_view::<3, 3>(3, 3).trace().sqrt();
        emitted += 1;
    }
    assert!((23_999..=24_000).contains(&emitted), "{emitted}");
    assert!(worst < 0.7, "{worst} m: a fix is 0.9 m off");
    assert!(last < deviation && deviation < 0.03, "{last} rad, deviation {deviation} rad");
    Ok(())
}

/// A start at rest takes a second, the first time and after more than a minute without samples.
#[test]
fn a_rover_at_rest_that_was_blind_for_a_minute_starts_again() -> Result<(), StartError> {
    let builder = Surveyor::builder();
    let odometry = builder.subscribe(surveyor::estimator::base::navigation::odometry);
    let mut simulation = builder.simulate()?;
    let board_from_base = UnitQuaternion::from_euler_angles(PI, 0.0, FRAC_PI_2).inverse();
    let gravity = board_from_base * Vector3::new(0.0, 0.0, 9.80665);
    let frame = LocalFrame::new(Geodetic::from_degrees(ORIGIN.0, ORIGIN.1, ORIGIN.2));
    let (status, services) = (GnssStatus::Fix, GnssServices::default());
    let mut emitted = [0, 0];
    // While it was blind somebody has carried it, but not its world.
    let places = [Vector3::zeros(), Vector3::new(400.0, 300.0, 0.0)];
    for ((begin, place), emitted) in [0_u64, 72_000].into_iter().zip(places).zip(&mut emitted) {
        let geodetic = frame.geodetic(&place);
        let position = GeodeticPosition {
            latitude_rad: geodetic.latitude,
            longitude_rad: geodetic.longitude,
            altitude: Some(geodetic.height),
        };
        let fix = GnssFix { status, services, position: Some(position), position_covariance: None };
        for step in 0..200 {
            let time = MonotonicTime::ZERO + Duration::from_millis(begin + 10 * step);
            if step % 20 == 0 {
                simulation.publish(surveyor::sensor::base::mast::antenna::gnss, time, fix);
            }
            let imu = Imu::new(Vector3::zeros(), gravity);
            simulation.publish(surveyor::sensor::base::bracket::board::imu, time, imu);
        }
        let messages: Vec<_> = odometry.drain().collect();
        *emitted = messages.len();
        let last = messages.last().expect("it has started");
        assert!((last.pose.position + ANTENNA - place).norm() < 0.1, "{}", last.pose.position);
    }
    // Of two seconds at 100 Hz, those after the first; the sample after the gap only tells of it.
    assert!((98..=100).contains(&emitted[0]) && (97..=99).contains(&emitted[1]), "{emitted:?}");
    Ok(())
}
