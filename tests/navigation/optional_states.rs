//! A rover whose antenna is not where it is declared, whose receiver stamps late, and which is magnetic: the declared filter finds all
//! three, as well as it says.

use super::rover::{Noise, ORIGIN};
use bb_core::nalgebra::{Matrix3, UnitQuaternion, Vector3};
use bb_core::payload::{GeodeticPosition, GnssFix, GnssServices, GnssStatus, MagneticField, Twist};
use bb_core::prelude::*;
use bb_estimators::Eskf;
use bb_estimators::navigation::{Geodetic, LocalFrame, NavigationOutputs, Optional, States};

/// States of the errors that the robot has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Flaws;

impl States for Flaws {
    const OPTIONAL: &'static [Optional] = &[Optional::GnssLeverArm, Optional::GnssDelay, Optional::HardIron];
}

robot! {
    robot Flawed;

    link base {
        sensor imu: External<Imu>();
        sensor wheels: External<Odometry>();
        sensor compass: External<MagneticField>();
        joint mast: fixed {
            origin: { xyz: [-50 cm, 0 m, 1 m] };
            link antenna { sensor gnss: External<GnssFix>(); }
        }
        estimator navigation: Eskf<NavigationOutputs, Flaws, { Flaws::DIMENSION }>(
            heading_deviation = 3 deg, gnss_lever_arm = 0.5 m, gnss_delay = 200 ms, hard_iron = 1e-5 T,
            magnetic_deviation = 2 deg
        ) {
            input imu: sensor::base::imu, driver;
            input gnss: sensor::base::mast::antenna::gnss, optional;
            input odometry: sensor::base::wheels, optional;
            input magnetic_field: sensor::base::compass, optional;
            output odometry;
            output status;
        }
    }
}

const DECLARED: Vector3<f64> = Vector3::new(-0.5, 0.0, 1.0);
const LEVER_ARM: Vector3<f64> = Vector3::new(0.4, -0.3, 0.0);
const DELAY_MILLIS: usize = 150;
const HARD_IRON: Vector3<f64> = Vector3::new(6e-6, -4e-6, 0.0);
/// North and down, T.
const FIELD: Vector3<f64> = Vector3::new(0.0, 2.1e-5, -4.3e-5);
const FIX: f64 = 0.1;

/// Motion of the robot: at rest for three seconds, then curves to both sides at changing speed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct State {
    pub(crate) position: Vector3<f64>,
    pub(crate) heading: f64,
    pub(crate) speed: f64,
    pub(crate) rate: f64,
}

/// Each millisecond.
pub(crate) fn way(seconds: usize) -> Vec<State> {
    driven(seconds, |since| {
        let begun = ((since - 3.0) / 2.0).clamp(0.0, 1.0);
        let since = since - 3.0;
        (begun * (3.0 + 2.0 * (0.7 * since).sin()), begun * (0.25 + 0.5 * (0.31 * since).sin()))
    })
}

/// Each millisecond, by the speed and the turn rate at a time.
pub(crate) fn driven(seconds: usize, motion: impl Fn(f64) -> (f64, f64)) -> Vec<State> {
    let mut state = State { position: Vector3::zeros(), heading: 0.0, speed: 0.0, rate: 0.0 };
    let mut way = vec![state];
    for millis in 1..=seconds * 1000 {
        let (speed, rate) = motion(millis as f64 * 1e-3);
        let middle = state.heading + 0.25e-3 * (rate + state.rate);
        let along = 0.5e-3 * (speed + state.speed);
        state.position += Vector3::new(middle.cos(), middle.sin(), 0.0) * along;
        state.heading += 0.5e-3 * (rate + state.rate);
        (state.speed, state.rate) = (speed, rate);
        way.push(state);
    }
    way
}

/// The velocity in the world.
pub(crate) fn velocity(state: &State) -> Vector3<f64> {
    turned(state.heading) * Vector3::x() * state.speed
}

/// The sample of an IMU over the last 10 ms.
pub(crate) fn imu(way: &[State], millis: usize, noise: &mut Noise) -> Imu {
    let (before, now) = (way[millis.saturating_sub(10)], way[millis]);
    let acceleration = (velocity(&now) - velocity(&before)) * 100.0;
    let middle = turned(0.5 * (now.heading + before.heading));
    let force = middle.inverse() * acceleration + Vector3::new(0.0, 0.0, 9.80665) + 0.02 * noise.vector();
    let turning = Vector3::z() * ((now.heading - before.heading) * 100.0) + 0.0017 * noise.vector();
    Imu::new(turning, force)
}

/// A fix of a place in the world, with a deviation of each axis in m.
pub(crate) fn fix(frame: &LocalFrame, place: &Vector3<f64>, deviation: f64) -> GnssFix {
    let at = frame.geodetic(place);
    let position =
        GeodeticPosition { latitude_rad: at.latitude, longitude_rad: at.longitude, altitude: Some(at.height) };
    GnssFix {
        status: GnssStatus::Fix,
        services: GnssServices::default(),
        position: Some(position),
        position_covariance: Some(Matrix3::identity() * (deviation * deviation)),
    }
}

pub(crate) fn turned(heading: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_euler_angles(0.0, 0.0, heading)
}

#[test]
fn a_lever_arm_a_delay_and_a_hard_iron_are_found() -> Result<(), StartError> {
    let builder = Flawed::builder();
    let room = || Overflow::DropOldest { capacity: 1 << 16 };
    let odometry = builder.subscribe_with(flawed::estimator::base::navigation::odometry, room());
    let status = builder.subscribe(flawed::estimator::base::navigation::status);
    let mut simulation = builder.simulate()?;
    let frame = LocalFrame::new(Geodetic::from_degrees(ORIGIN.0, ORIGIN.1, ORIGIN.2));
    let way = way(120);
    let mut noise = Noise::new(5);
    let mut first = None;
    for millis in (0..way.len() - 1).step_by(10) {
        let time = MonotonicTime::ZERO + Duration::from_millis(millis as u64);
        let now = way[millis];
        if millis % 200 == 0 {
            let then = way[millis.saturating_sub(DELAY_MILLIS)];
            let antenna = then.position + turned(then.heading) * (DECLARED + LEVER_ARM) + FIX * noise.vector();
            first.get_or_insert(antenna);
            let fix = fix(&frame, &antenna, FIX);
            simulation.publish(flawed::sensor::base::mast::antenna::gnss, time, fix);
        }
        if millis % 50 == 0 {
            let linear = Vector3::new(now.speed, 0.0, 0.0) + 0.05 * noise.vector();
            let pose = Pose { position: Vector3::zeros(), world_from_body: turned(0.0), covariance: None };
            let twist = Twist { linear, angular: Vector3::zeros(), covariance: None };
            simulation.publish(flawed::sensor::base::wheels, time, Odometry { pose, twist });
            let field = turned(now.heading).inverse() * FIELD + HARD_IRON + 3e-7 * noise.vector();
            simulation.publish(flawed::sensor::base::compass, time, MagneticField::new(field));
        }
        simulation.publish(flawed::sensor::base::imu, time, imu(&way, millis, &mut noise));
    }
    let status = status.drain().last().expect("it has started").payload;
    let arm = (status.gnss_lever_arm - LEVER_ARM).xy().norm();
    let delay = (status.gnss_delay - 0.15).abs();
    let iron = (status.hard_iron - HARD_IRON).xy().norm();
    println!("lever arm off by {arm} m, delay by {delay} s, hard iron by {iron} T");
    assert!(arm < 0.05, "{arm} m: {}", status.gnss_lever_arm);
    assert!(delay < 0.02, "{delay} s: {}", status.gnss_delay);
    assert!(iron < 8e-7, "{iron} T: {}", status.hard_iron);
    assert_eq!((status.gnss.refused, status.magnetic_field.refused, status.resets), (0, 0, 0), "{status:?}");
    // Where it is follows, with an antenna half a metre off and at 5 m/s a delay of 0.75 m: the world begins at the first fix.
    let first = first.expect("there were fixes");
    let (mut worst, mut worst_heading) = (0.0_f64, 0.0_f64);
    for message in odometry.drain() {
        let millis = (message.monotonic_time.seconds_since(MonotonicTime::ZERO) * 1000.0).round() as usize;
        if millis < 60_000 {
            continue;
        }
        let off = (message.pose.position - (way[millis].position - first)).xy().norm();
        worst = worst.max(off);
        worst_heading = worst_heading.max(turned(way[millis].heading).angle_to(&message.pose.world_from_body));
    }
    println!("position off by {worst} m, attitude by {worst_heading} rad");
    assert!(worst > 0.0 && worst < 0.15 && worst_heading < 0.015, "{worst} m, {worst_heading} rad");
    Ok(())
}
