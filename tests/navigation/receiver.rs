//! A rover whose receiver also measures its velocity and, with two antennas, its heading, all 150 ms late: each input gains what it is
//! for, and the delay is that of the receiver.

use super::optional_states::{State, fix, imu, turned, velocity, way};
use super::rover::{Noise, ORIGIN};
use bb_core::nalgebra::{Matrix6, Vector3};
use bb_core::payload::{GnssFix, Orientation, Twist};
use bb_core::prelude::*;
use bb_estimators::Eskf;
use bb_estimators::navigation::{Geodetic, LocalFrame, NavigationOutputs, NavigationStatus};

robot! {
    robot Surveyor;

    link base {
        sensor imu: External<Imu>();
        joint mast: fixed {
            origin: { xyz: [-50 cm, 0 m, 1 m], rpy: [0 deg, 0 deg, 90 deg] };
            link antennas {
                sensor gnss: External<GnssFix>();
                sensor velocity: External<Twist>();
                sensor heading: External<Orientation>();
            }
        }
        estimator navigation: Eskf<NavigationOutputs>(gnss_delay = 200 ms) {
            input imu: sensor::base::imu, driver;
            input gnss: sensor::base::mast::antennas::gnss, optional;
            input gnss_velocity: sensor::base::mast::antennas::velocity, optional;
            input gnss_heading: sensor::base::mast::antennas::heading, optional;
            output odometry;
            output status;
        }
    }
}

const ANTENNA: Vector3<f64> = Vector3::new(-0.5, 0.0, 1.0);
const DELAY_MILLIS: usize = 150;
const FIX: f64 = 1.0;
const VELOCITY: f64 = 0.1;
const HEADING: f64 = 0.02;

/// Errors over the second half, RMS, and the status at the end of the rest and at the end.
#[derive(Debug)]
struct Outcome {
    speed: f64,
    heading: f64,
    resting: NavigationStatus,
    end: NavigationStatus,
}

/// Every `wild`-th velocity is 20 m/s off.
fn drive(has_velocity: bool, has_heading: bool, wild: Option<usize>, seed: u64) -> Result<Outcome, StartError> {
    let builder = Surveyor::builder();
    let room = || Overflow::DropOldest { capacity: 1 << 16 };
    let odometry = builder.subscribe_with(surveyor::estimator::base::navigation::odometry, room());
    let status = builder.subscribe_with(surveyor::estimator::base::navigation::status, room());
    let mut simulation = builder.simulate()?;
    let frame = LocalFrame::new(Geodetic::from_degrees(ORIGIN.0, ORIGIN.1, ORIGIN.2));
    let way = way(120);
    let mut noise = Noise::new(seed);
    let antenna = |state: &State| {
        let arm = turned(state.heading) * ANTENNA;
        (state.position + arm, velocity(state) + (Vector3::z() * state.rate).cross(&arm))
    };
    for millis in (0..way.len() - 1).step_by(10) {
        let time = MonotonicTime::ZERO + Duration::from_millis(millis as u64);
        if millis % 200 == 0 {
            use surveyor::sensor::base::mast::antennas;
            let then = way[millis.saturating_sub(DELAY_MILLIS)];
            let (place, moving) = antenna(&then);
            simulation.publish(antennas::gnss, time, fix(&frame, &(place + FIX * noise.vector()), FIX));
            if has_velocity {
                let is_wild = wild.is_some_and(|wild| (millis / 200).is_multiple_of(wild) && millis > 0);
                let off = if is_wild { Vector3::x() * 20.0 } else { Vector3::zeros() };
                let linear = moving + VELOCITY * noise.vector() + off;
                let covariance = Some(Matrix6::identity() * (VELOCITY * VELOCITY));
                simulation.publish(
                    antennas::velocity,
                    time,
                    Twist { linear, angular: Vector3::zeros(), covariance },
                );
            }
            if has_heading {
                let heading = then.heading + std::f64::consts::FRAC_PI_2 + HEADING * noise.vector().x;
                simulation.publish(antennas::heading, time, Orientation::new(turned(heading)));
            }
        }
        simulation.publish(surveyor::sensor::base::imu, time, imu(&way, millis, &mut noise));
    }
    let statuses = status.drain().collect::<Vec<_>>();
    let at = |seconds: f64| {
        let is_before = |message: &&Stamped<NavigationStatus>| {
            message.monotonic_time.seconds_since(MonotonicTime::ZERO) <= seconds
        };
        statuses.iter().take_while(is_before).last().expect("it has started").payload
    };
    let (mut speed, mut heading, mut count) = (0.0, 0.0, 0.0);
    for message in odometry.drain() {
        let millis = (message.monotonic_time.seconds_since(MonotonicTime::ZERO) * 1000.0).round() as usize;
        if millis < 60_000 {
            continue;
        }
        let state = way[millis];
        let off = message.pose.world_from_body * message.twist.linear - velocity(&state);
        let turn = (turned(state.heading).inverse() * message.pose.world_from_body).euler_angles().2;
        (speed, heading, count) = (speed + off.norm_squared(), heading + turn * turn, count + 1.0);
    }
    let root = |sum: f64| (sum / count).sqrt();
    Ok(Outcome { speed: root(speed), heading: root(heading), resting: at(3.0), end: at(120.0) })
}

#[test]
fn a_receivers_velocity_and_heading_are_used_at_their_time() -> Result<(), StartError> {
    let (mut speeds, mut headings, mut delays) = ([0.0; 3], [0.0; 3], [0.0; 3]);
    for seed in 20..26 {
        for (i, (has_velocity, has_heading)) in
            [(false, false), (true, false), (true, true)].into_iter().enumerate()
        {
            let Outcome { speed, heading, resting, end } = drive(has_velocity, has_heading, None, seed)?;
            // At rest, only antennas tell the heading.
            let is_known = resting.heading_deviation < 0.03;
            assert!(is_known == has_heading, "{} rad", resting.heading_deviation);
            assert_eq!((end.gnss_velocity.refused, end.gnss_heading.refused), (0, 0));
            speeds[i] += speed / 6.0;
            headings[i] += heading / 6.0;
            delays[i] += (end.gnss_delay - 0.15).abs() / 6.0;
        }
    }
    println!("off by {speeds:?} m/s, {headings:?} rad, {delays:?} s");
    let falls = |[without, of_velocity, of_both]: [f64; 3], bounds: [f64; 3]| {
        without < bounds[0] && of_velocity < bounds[1] && of_both < bounds[2]
    };
    assert!(falls(speeds, [0.13, 0.055, 0.05]), "{speeds:?} m/s");
    assert!(falls(headings, [0.012, 0.0055, 0.0022]), "{headings:?} rad");
    assert!(falls(delays, [0.03, 0.011, 0.008]), "{delays:?} s");
    Ok(())
}

#[test]
fn wild_velocities_of_a_receiver_are_refused() -> Result<(), StartError> {
    let (wild, sound) = (drive(true, false, Some(50), 11)?, drive(true, false, None, 11)?);
    assert_eq!(wild.end.gnss_velocity.refused, 11);
    assert!(wild.speed < 1.1 * sound.speed, "{} and {} m/s", wild.speed, sound.speed);
    Ok(())
}
