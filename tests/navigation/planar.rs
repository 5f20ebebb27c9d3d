//! A rover that navigates on a plane by a gyroscope, wheels and satellites, each of which fails in turn.

use super::rover::{Noise, ORIGIN, Truth, truth};
use bb_core::nalgebra::{Matrix3, Matrix6, UnitQuaternion, Vector3};
use bb_core::payload::{GeodeticPosition, GnssFix, GnssServices, GnssStatus, Twist};
use bb_core::prelude::*;
use bb_estimators::PlanarEkf;
use bb_estimators::navigation::planar::{PlanarOutputs, PlanarStatus};
use bb_estimators::navigation::{Geodetic, LocalFrame};
use std::f64::consts::{FRAC_PI_2, PI};
use std::ops::Range;

robot! {
    robot Cart;

    link base {
        joint axle: fixed {
            // The wheels are behind the base, and the driver has its x axis to the left.
            origin: { xyz: [-30 cm, 0 m, 0 m], rpy: [0 deg, 0 deg, 90 deg] };
            link wheels { sensor odometry: External<Odometry>(); }
        }
        joint bracket: fixed {
            // Upside down and turned by a quarter.
            origin: { xyz: [0 m, 0 m, 40 cm], rpy: [180 deg, 0 deg, 90 deg] };
            link board { sensor imu: External<Imu>(); }
        }
        joint mast: fixed {
            origin: { xyz: [-50 cm, 20 cm, 1.5 m] };
            link antenna { sensor gnss: External<GnssFix>(); }
        }
        sensor compass: External<Orientation>();
        estimator navigation: PlanarEkf<PlanarOutputs>(
            omnidirectional = true, heading_deviation = 3 deg, longest_dead_reckoning = 20 s
        ) {
            input imu: sensor::base::bracket::board::imu, driver;
            input gnss: sensor::base::mast::antenna::gnss, optional, within: 1 s;
            input odometry: sensor::base::axle::wheels::odometry, optional, within: 1 s;
            input orientation: sensor::base::compass, optional, within: 1 s;
            output odometry;
            output status;
            lost_after: 200 ms;
            recover_after: 20;
        }
    }
}

const ANTENNA: Vector3<f64> = Vector3::new(-0.5, 0.2, 1.5);
const AXLE: Vector3<f64> = Vector3::new(-0.3, 0.0, 0.0);
const BIAS: f64 = 0.006;
const SCALE: f64 = 0.02;

/// Failures of the sensors, and their times, s.
#[derive(Clone, Debug, Default)]
struct Failures {
    no_fixes: Range<f64>,
    wrong_fixes: Range<f64>,
    spinning_wheels: Range<f64>,
    no_imu: Range<f64>,
    wrong_imu: Range<f64>,
    late_fixes: bool,
    /// Seed of the noise, added to that of all other tests.
    seed: u64,
    /// A compass, instead of a heading that is known.
    compass: bool,
    /// Nothing says where it heads.
    unknown_heading: bool,
}

#[derive(Debug)]
struct Seen {
    /// Largest error of the position after ten seconds, m.
    worst: f64,
    at_the_end: f64,
    worst_heading: f64,
    /// Normalised error of position and heading, in the mean: 3 if the filter is right.
    nees: f64,
    /// Number of times that the error was beyond three standard deviations in the direction where the position is least known.
    beyond: usize,
    status: PlanarStatus,
    health: Vec<(f64, HealthState, HealthReason)>,
    emitted: usize,
}

fn drive(failures: &Failures, seconds: f64) -> Result<Seen, StartError> {
    let mut builder = Cart::builder();
    if failures.compass {
        // It says nothing about the heading itself.
        builder.options(cart::estimator::base::navigation).heading = 2.0;
    }
    if failures.unknown_heading {
        builder.options(cart::estimator::base::navigation).heading_deviation = 4.0;
    }
    let room = Overflow::DropOldest { capacity: 1 << 16 };
    let odometry = builder.subscribe_with(cart::estimator::base::navigation::odometry, room);
    let status = builder.subscribe_with(cart::estimator::base::navigation::status, room);
    let health = builder.subscribe(system::Health);
    let mut simulation = builder.simulate()?;
    let frame = LocalFrame::new(Geodetic::from_degrees(ORIGIN.0, ORIGIN.1, ORIGIN.2));
    let board_from_base = UnitQuaternion::from_euler_angles(PI, 0.0, FRAC_PI_2).inverse();
    let wheels_from_base = UnitQuaternion::from_euler_angles(0.0, 0.0, FRAC_PI_2).inverse();
    let (mut noise, mut late) = (Noise::new(7 + failures.seed), std::collections::VecDeque::new());
    let mut origin = None;
    for millis in (0..(seconds * 1000.0) as u64).step_by(10) {
        let (now, time) = (millis as f64 * 1e-3, MonotonicTime::ZERO + Duration::from_millis(millis));
        let Truth { position, heading, speed, rate, acceleration } = truth(now);
        let world_from_base = UnitQuaternion::from_euler_angles(0.0, 0.0, heading);
        let up = Vector3::z();
        if millis.is_multiple_of(50) {
            let spin = if failures.spinning_wheels.contains(&now) { 3.0 } else { 0.0 };
            let at_axle = Vector3::new(speed + spin, 0.0, 0.0) + (up * rate).cross(&AXLE);
            let linear = wheels_from_base * at_axle * (1.0 + SCALE) + 0.05 * noise.vector();
            let covariance = Matrix6::from_diagonal_element(0.0025);
            let angular = up * (rate + 0.05 * noise.next());
            let pose = Pose { position, world_from_body: UnitQuaternion::identity(), covariance: None };
            let twist = Twist { linear, angular, covariance: Some(covariance) };
            simulation.publish(cart::sensor::base::axle::wheels::odometry, time, Odometry { pose, twist });
        }
        if failures.compass && millis.is_multiple_of(100) {
            let off = UnitQuaternion::from_euler_angles(0.0, 0.0, 0.05 * noise.next());
            let covariance = Some(Matrix3::identity() * 0.0025);
            let orientation = Orientation { world_from_body: world_from_base * off, covariance };
            simulation.publish(cart::sensor::base::compass, time, orientation);
        }
        if millis.is_multiple_of(200) && !failures.no_fixes.contains(&now) {
            let off = if failures.wrong_fixes.contains(&now) { 80.0 } else { 0.0 };
            let antenna = position + world_from_base * ANTENNA;
            let measured = antenna + 0.5 * noise.vector() + Vector3::new(off, 0.0, 0.0);
            origin.get_or_insert(measured);
            let measured = frame.geodetic(&measured);
            let position = GeodeticPosition {
                latitude_rad: measured.latitude,
                longitude_rad: measured.longitude,
                altitude: Some(measured.height),
            };
            let (status, services) = (GnssStatus::Fix, GnssServices::default());
            let position_covariance = Some(Matrix3::identity() * 0.25);
            late.push_back((time, GnssFix { status, services, position: Some(position), position_covariance }));
        }
        let delay = if failures.late_fixes && now > 3.0 { 0.8 } else { 0.0 };
        while late.front().is_some_and(|(stamp, _)| time.seconds_since(*stamp) >= delay) {
            if let Some((stamp, fix)) = late.pop_front() {
                simulation.live().publish(cart::sensor::base::mast::antenna::gnss, stamp, fix);
            }
        }
        if !failures.no_imu.contains(&now) {
            // The mean over the interval that ends now.
            let rate = truth(now - 0.005).rate;
            let force = acceleration + Vector3::new(0.0, 0.0, 9.80665) + 0.02 * noise.vector();
            let turning = up * (rate + BIAS) + 0.0017 * noise.vector();
            let turning = if failures.wrong_imu.contains(&now) { turning * f64::NAN } else { turning };
            let imu = Imu::new(board_from_base * turning, board_from_base * force);
            simulation.publish(cart::sensor::base::bracket::board::imu, time, imu);
        }
    }
    let origin = origin.expect("there was a fix");
    let seconds = |time: MonotonicTime| time.seconds_since(MonotonicTime::ZERO);
    let change = |message: Stamped<HealthTransition>| {
        (seconds(message.monotonic_time), message.payload.to, message.payload.reason)
    };
    let mut seen = Seen {
        worst: 0.0,
        at_the_end: f64::NAN,
        worst_heading: 0.0,
        nees: 0.0,
        beyond: 0,
        status: status.drain().last().map(|status| status.payload).unwrap_or_default(),
        health: health.drain().map(change).collect(),
        emitted: 0,
    };
    let mut counted = 0.0;
    for message in odometry.drain() {
        seen.emitted += 1;
        let now = seconds(message.monotonic_time);
        let Truth { position, heading, speed, rate, .. } = truth(now);
        let error = (message.pose.position - (position - origin)).xy();
        let turned = UnitQuaternion::from_euler_angles(0.0, 0.0, heading).inverse() * message.pose.world_from_body;
        let heading_error = turned.euler_angles().2;
        if now < 10.0 {
            continue;
        }
        let covariance = message.pose.covariance.expect("it says how well it is known");
        assert_eq!(covariance, covariance.transpose());
        let error = Vector3::new(error.x, error.y, heading_error);
        let place = [0, 1, 5];
        let own = Matrix3::from_fn(|i, j| covariance[(place[i], place[j])]);
        seen.nees += error.dot(&(own.try_inverse().expect("it is regular") * error));
        counted += 1.0;
        let distance = error.xy().norm();
        let deviation = own.fixed_view::<2, 2>(0, 0).symmetric_eigenvalues().max().sqrt();
        seen.beyond += usize::from(distance > 3.0 * deviation);
        seen.worst = seen.worst.max(distance);
        seen.at_the_end = distance;
        seen.worst_heading = seen.worst_heading.max(heading_error.abs());
        assert_eq!((message.pose.position.z, message.twist.linear.z), (0.0, 0.0));
        let twist = message.twist.linear - Vector3::new(speed, 0.0, 0.0);
        assert!(twist.norm() < 4.0 && (message.twist.angular.z - rate).abs() < 0.3, "{message:?}");
    }
    seen.nees /= counted;
    Ok(seen)
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
fn a_cart_knows_where_it_is_and_finds_bias_and_scale() -> Result<(), StartError> {
    let seen = drive(&Failures::default(), 90.0)?;
    assert!(seen.worst < 1.0 && seen.at_the_end < 0.3 && seen.worst_heading < 0.05, "{seen:?}");
    assert!((1.0..5.0).contains(&seen.nees), "{seen:?}");
    let status = &seen.status;
    assert!((status.gyroscope_bias - BIAS).abs() < 5e-4 && status.gyroscope_bias_deviation < 5e-4, "{seen:?}");
    assert!((status.wheel_scale - SCALE).abs() < 0.005 && status.wheel_scale_deviation < 0.01, "{seen:?}");
    assert_eq!((status.gnss.refused, status.odometry.refused, status.yaw_rate.refused), (0, 0, 0), "{seen:?}");
    expect_health(&seen, &[]);
    // With every sample after the second fix, which it starts at.
    assert!((8978..=8979).contains(&seen.emitted), "{seen:?}");
    Ok(())
}

#[test]
fn a_cart_without_fixes_counts_on_its_wheels_and_says_how_little_it_knows() -> Result<(), StartError> {
    let seen = drive(&Failures { no_fixes: 40.0..75.0, ..Failures::default() }, 90.0)?;
    assert!(seen.worst < 1.0 && seen.at_the_end < 0.4 && seen.beyond < 20, "{seen:?}");
    expect_health(&seen, &[(59.8..=60.1, Degraded, Diverged), (75.0..=75.5, Healthy, Recovered)]);
    Ok(())
}

#[test]
fn a_cart_does_not_believe_what_is_far_off() -> Result<(), StartError> {
    let seen = drive(&Failures { wrong_fixes: 40.0..48.0, ..Failures::default() }, 90.0)?;
    assert!(seen.worst < 1.0 && seen.at_the_end < 0.3, "{seen:?}");
    assert_eq!(seen.status.gnss.refused, 40, "{seen:?}");
    expect_health(&seen, &[(40.4..=40.7, Degraded, Diverged), (48.0..=48.5, Healthy, Recovered)]);
    for seed in 0..10 {
        let failures = Failures { spinning_wheels: 40.0..42.0, seed, ..Failures::default() };
        let seen = drive(&failures, 60.0)?;
        assert!(seen.worst < 1.0 && seen.at_the_end < 0.4, "{seen:?}");
        assert_eq!(seen.status.odometry.refused, 40, "{seen:?}");
        expect_health(&seen, &[(40.1..=40.2, Degraded, Diverged), (42.0..=42.5, Healthy, Recovered)]);
    }
    Ok(())
}

#[test]
fn a_cart_bridges_a_second_without_its_imu() -> Result<(), StartError> {
    let silent = Failures { no_imu: 40.0..41.0, ..Failures::default() };
    let broken = Failures { wrong_imu: 40.0..41.0, ..Failures::default() };
    for failures in [silent, broken] {
        let seen = drive(&failures, 90.0)?;
        assert!(seen.worst < 2.0 && seen.at_the_end < 0.3, "{seen:?}");
        assert_eq!(seen.status.gaps, 1, "{seen:?}");
        let lost = (40.1..=40.2, Lost, HealthReason::Lost);
        assert!(seen.health.len() >= 3, "{seen:?}");
        let (when, state, reason) = lost;
        assert!(
            when.contains(&seen.health[0].0) && (seen.health[0].1, seen.health[0].2) == (state, reason),
            "{seen:?}"
        );
        assert_eq!(seen.health.last().map(|(_, state, _)| *state), Some(Healthy), "{seen:?}");
    }
    Ok(())
}

/// Unlike the filter in three dimensions it need not be at rest for that.
#[test]
fn a_cart_that_was_blind_for_a_minute_starts_again_in_motion() -> Result<(), StartError> {
    let failures = Failures { no_imu: 40.0..105.0, compass: true, ..Failures::default() };
    let seen = drive(&failures, 130.0)?;
    assert!(seen.at_the_end < 1.5, "{seen:?}");
    assert_eq!(seen.health.last().map(|(_, state, _)| *state), Some(Healthy), "{seen:?}");
    Ok(())
}

#[test]
fn a_heading_that_nobody_knows_is_found_by_driving() -> Result<(), StartError> {
    for seed in 0..5 {
        let seen = drive(&Failures { unknown_heading: true, seed, ..Failures::default() }, 60.0)?;
        assert!(seen.worst < 1.0 && seen.at_the_end < 0.4 && seen.worst_heading < 0.1, "{seen:?}");
        assert_eq!(
            (seen.status.gnss.refused, seen.status.odometry.refused, seen.status.resets),
            (0, 0, 0),
            "{seen:?}"
        );
        expect_health(&seen, &[(0.2..=0.4, Degraded, Diverged), (1.0..=8.0, Healthy, Recovered)]);
    }
    Ok(())
}

#[test]
fn a_compass_takes_the_place_of_a_heading_that_is_known() -> Result<(), StartError> {
    let seen = drive(&Failures { compass: true, ..Failures::default() }, 60.0)?;
    assert!(seen.worst < 1.0 && seen.worst_heading < 0.05 && seen.status.orientation.fused > 500, "{seen:?}");
    Ok(())
}

#[test]
fn fixes_that_come_late_are_as_good_as_in_time() -> Result<(), StartError> {
    let late = drive(&Failures { late_fixes: true, ..Failures::default() }, 90.0)?;
    assert!(late.worst < 1.0 && late.at_the_end < 0.35 && late.worst_heading < 0.05, "{late:?}");
    assert_eq!((late.status.gnss.refused, late.status.gnss.invalid), (0, 0), "{late:?}");
    expect_health(&late, &[]);
    Ok(())
}

robot! {
    robot Tilted;

    link base {
        sensor imu: External<Imu>();
        joint axle: fixed {
            origin: { rpy: [0 deg, 90 deg, 0 deg] };
            link wheels { sensor odometry: External<Odometry>(); }
        }
        estimator navigation: PlanarEkf() {
            input imu: sensor::base::imu, driver;
            input odometry: sensor::base::axle::wheels::odometry, optional;
        }
    }
}

#[test]
fn wheels_that_do_not_stand_upright_are_refused_at_the_start() {
    let refused = Tilted::builder().simulate().map(drop).expect_err("its x axis points down");
    assert!(refused.to_string().contains("the frame of the input `odometry` is not level"), "{refused}");
}

robot! {
    robot Level;

    link base {
        sensor imu: External<Imu>();
        sensor wheels: External<Odometry>();
        estimator navigation: PlanarEkf() {
            input imu: sensor::base::imu, driver;
            input odometry: sensor::base::wheels, optional;
        }
    }
}

/// Wheels and a gyroscope alone: the pose begins at zero, at once, and drives a circle.
#[test]
fn without_satellites_the_world_begins_at_the_start() -> Result<(), StartError> {
    let builder = Level::builder();
    let odometry =
        builder.subscribe_with(level::estimator::base::navigation, Overflow::DropOldest { capacity: 1 << 16 });
    let mut simulation = builder.simulate()?;
    for millis in (0..40_000_u64).step_by(10) {
        let (now, time) = (millis as f64 * 1e-3, MonotonicTime::ZERO + Duration::from_millis(millis));
        let Truth { speed, rate, .. } = truth(now);
        if millis.is_multiple_of(50) {
            let pose =
                Pose { position: Vector3::zeros(), world_from_body: UnitQuaternion::identity(), covariance: None };
            let (linear, angular) = (Vector3::new(speed, 0.0, 0.0), Vector3::new(0.0, 0.0, rate));
            let twist = Twist { linear, angular, covariance: None };
            simulation.publish(level::sensor::base::wheels, time, Odometry { pose, twist });
        }
        let turning = Vector3::new(0.0, 0.0, truth(now - 0.005).rate);
        simulation.publish(level::sensor::base::imu, time, Imu::new(turning, Vector3::new(0.0, 0.0, 9.8)));
    }
    let messages: Vec<_> = odometry.drain().collect();
    assert!(messages.len() > 3990, "{}", messages.len());
    let first = &messages[0].pose.position;
    assert!(first.norm() < 1e-3, "{first}");
    let (last, truth) = (&messages[messages.len() - 1], truth(39.99));
    let error = (last.pose.position - truth.position).norm();
    let deviation =
        last.pose.covariance.map_or(f64::NAN, |covariance| covariance[(0, 0)].max(covariance[(1, 1)]).sqrt());
    assert!(error < 0.3 && error < 3.0 * deviation, "{error} m, {deviation} m");
    Ok(())
}
