//! Fixes that tell nothing of their noise, or are nowhere on Earth: no filter takes them for exact, or emits what is no number.

use bb_core::nalgebra::{Matrix3, Vector3};
use bb_core::payload::{GeodeticPosition, GnssServices, GnssStatus};
use bb_core::prelude::*;
use bb_estimators::{Eskf, PlanarEkf};

robot! {
    robot Cart;
    link base {
        sensor imu: External<Imu>();
        sensor gnss: External<GnssFix>();
        estimator planar: PlanarEkf() {
            input imu: sensor::base::imu, driver;
            input gnss: sensor::base::gnss, optional;
        }
        estimator eskf: Eskf() {
            input imu: sensor::base::imu, driver;
            input gnss: sensor::base::gnss, optional;
        }
    }
}

fn fix(altitude: f64, covariance: Option<f64>) -> GnssFix {
    GnssFix {
        status: GnssStatus::Fix,
        services: GnssServices::default(),
        position: Some(GeodeticPosition { latitude_rad: 0.84, longitude_rad: 0.2, altitude: Some(altitude) }),
        position_covariance: covariance.map(|variance| Matrix3::identity() * variance),
    }
}

/// A cart at rest for 20 s; what both emit. Every fifth of a second there is a fix, `first` before the fifth second.
fn rests(first: &GnssFix, then: &GnssFix) -> Result<[Vec<Odometry>; 2], StartError> {
    let builder = Cart::builder();
    let room = Overflow::DropOldest { capacity: 1 << 12 };
    let emitted = [
        builder.subscribe_with(cart::estimator::base::planar, room),
        builder.subscribe_with(cart::estimator::base::eskf, room),
    ];
    let mut simulation = builder.simulate()?;
    for millis in (0..20_000).step_by(10) {
        let time = MonotonicTime::ZERO + Duration::from_millis(millis);
        if millis % 200 == 0 {
            let fix = if millis < 5_000 { first } else { then };
            simulation.publish(cart::sensor::base::gnss, time, *fix);
        }
        let at_rest = Imu::new(Vector3::zeros(), Vector3::new(0.0, 0.0, 9.80665));
        simulation.publish(cart::sensor::base::imu, time, at_rest);
    }
    Ok(emitted.map(|emitted| emitted.drain().map(|message| message.payload).collect()))
}

#[test]
fn a_fix_whose_covariance_is_zero_tells_none() -> Result<(), StartError> {
    let unknown = rests(&fix(500.0, None), &fix(500.0, None))?;
    for variance in [0.0, -1.0] {
        let told = fix(500.0, Some(variance));
        let zero = rests(&told, &told)?;
        for (zero, unknown) in zero.iter().zip(&unknown) {
            assert!(!zero.is_empty() && zero == unknown, "{variance}");
        }
    }
    Ok(())
}

#[test]
fn a_fix_that_is_nowhere_on_earth_is_no_fix() -> Result<(), StartError> {
    let there = fix(500.0, Some(0.25));
    let mut beyond = fix(500.0, Some(0.25));
    if let Some(position) = &mut beyond.position {
        position.latitude_rad = 48.0;
    }
    for nowhere in [fix(1e300, Some(0.25)), fix(1e7, Some(0.25)), beyond] {
        for emitted in rests(&nowhere, &there)? {
            assert!(!emitted.is_empty(), "it starts at the first that is there");
            for odometry in &emitted {
                let horizontal = odometry.pose.position.xy().norm();
                assert!(horizontal < 1.0, "{horizontal} m");
                let covariance = odometry.pose.covariance.expect("it is told");
                assert!((0..6).all(|i| covariance[(i, i)] >= 0.0), "{covariance}");
            }
        }
    }
    Ok(())
}
