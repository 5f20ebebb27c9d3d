//! Covariances of poses are about the axes of the world, as in ROS (REP 103, `geometry_msgs/PoseWithCovariance`: rotation about
//! fixed axes), in what is read and in what is emitted, however the robot and the sensor are turned. Fixes that tell nothing of their noise, or are nowhere on Earth,
//! are not taken for exact, and lead to nothing that is no number.

use bb_core::nalgebra::{Matrix3, Matrix6, UnitQuaternion, Vector3, Vector6};
use bb_core::payload::{GeodeticPosition, GnssServices, GnssStatus};
use bb_core::prelude::*;
use bb_estimators::{Eskf, PlanarEkf};
use std::f64::consts::FRAC_PI_2;

robot! {
    robot Turned;

    link base {
        sensor imu: External<Imu>();
        joint side: fixed {
            // Its x axis points up.
            origin: { rpy: [0 deg, -90 deg, 0 deg] };
            link bracket { sensor map: External<Pose>(); }
        }
        estimator eskf: Eskf(heading = 90 deg, heading_deviation = 1 deg) {
            input imu: sensor::base::imu, driver;
            input pose: sensor::base::side::bracket::map, optional;
        }
        estimator planar: PlanarEkf(heading = 90 deg, heading_deviation = 10 deg) {
            input imu: sensor::base::imu, driver;
            input pose: sensor::base::side::bracket::map, optional;
        }
    }
}

/// Known well about north, and hardly about east and up.
const DEVIATIONS: Vector3<f64> = Vector3::new(0.3, 2e-4, 0.3);

fn at_rest() -> Imu {
    Imu::new(Vector3::zeros(), Vector3::new(0.0, 0.0, 9.80665))
}

/// Returns the last outputs of both, fed with poses that are turned by `off` (world axes, rad) from a robot that rests, its x axis to the
/// north.
fn rests(off: Vector3<f64>, deviations: Vector3<f64>) -> Result<[Pose; 2], StartError> {
    let builder = Turned::builder();
    let emitted =
        [builder.subscribe(turned::estimator::base::eskf), builder.subscribe(turned::estimator::base::planar)];
    let mut simulation = builder.simulate()?;
    let north = UnitQuaternion::from_euler_angles(0.0, 0.0, FRAC_PI_2);
    let link_from_map = UnitQuaternion::from_euler_angles(0.0, -FRAC_PI_2, 0.0);
    let variances = Vector6::new(1e-4, 1e-4, 1e-4, deviations.x, deviations.y, deviations.z);
    let mut covariance = Matrix6::from_diagonal(&variances);
    (3..6).for_each(|i| covariance[(i, i)] *= covariance[(i, i)]);
    let pose = Pose {
        position: Vector3::zeros(),
        world_from_body: UnitQuaternion::from_scaled_axis(off) * north * link_from_map,
        covariance: Some(covariance),
    };
    for millis in (0..4_000).step_by(10) {
        let time = MonotonicTime::ZERO + Duration::from_millis(millis);
        if millis % 100 == 0 {
            simulation.publish(turned::sensor::base::side::bracket::map, time, pose);
        }
        simulation.publish(turned::sensor::base::imu, time, at_rest());
    }
    Ok(emitted.map(|emitted| emitted.drain().last().expect("it has started").pose))
}

#[test]
fn a_rotation_is_known_about_the_axes_of_the_world() -> Result<(), StartError> {
    let off = Vector3::new(0.02, 0.005, 0.0);
    let [Pose { world_from_body, covariance, .. }, _] = rests(off, DEVIATIONS)?;
    let north = UnitQuaternion::from_euler_angles(0.0, 0.0, FRAC_PI_2);
    let turned = (world_from_body * north.inverse()).scaled_axis();
    // It follows what is well known, and not the four times as large angle that is not.
    assert!((turned.y - off.y).abs() < 1e-3 && turned.x.abs() < 3e-3, "{turned}");
    let covariance = covariance.expect("it is told");
    let deviation = |i: usize| covariance[(i, i)].sqrt();
    assert!(deviation(4) < 1e-3 && deviation(3) > 10.0 * deviation(4), "{covariance}");
    assert_eq!(covariance, covariance.transpose());
    Ok(())
}

/// A heading is known about up, for a sensor whose own axis points up, so that no axis of its body is the one that counts.
#[test]
fn a_heading_is_known_about_up() -> Result<(), StartError> {
    let off = Vector3::new(0.0, 0.0, 0.1);
    for (deviations, follows) in [(Vector3::new(0.3, 0.3, 1e-3), true), (Vector3::new(1e-3, 1e-3, 3.0), false)] {
        let emitted = rests(off, deviations)?;
        let [_, planar] = emitted;
        let heading = planar.world_from_body.euler_angles().2 - FRAC_PI_2;
        assert!(
            if follows { (heading - 0.1).abs() < 2e-3 } else { heading.abs() < 0.02 },
            "{deviations}: {heading}"
        );
        for pose in emitted {
            let deviation = pose.covariance.expect("it is told")[(5, 5)].sqrt();
            assert!(if follows { deviation < 2e-3 } else { deviation > 0.01 }, "{deviations}: {deviation}");
        }
    }
    Ok(())
}

robot! {
    robot Cart;
    link base {
        sensor imu: External<Imu>();
        sensor gnss: External<GnssFix>();
        estimator planar: PlanarEkf(heading_deviation = 10 deg) {
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
fn drifts(first: &GnssFix, then: &GnssFix) -> Result<[Vec<Odometry>; 2], StartError> {
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
        simulation.publish(cart::sensor::base::imu, time, at_rest());
    }
    Ok(emitted.map(|emitted| emitted.drain().map(|message| message.payload).collect()))
}

#[test]
fn a_fix_whose_covariance_is_zero_tells_none() -> Result<(), StartError> {
    let unknown = drifts(&fix(500.0, None), &fix(500.0, None))?;
    for variance in [0.0, -1.0] {
        let told = fix(500.0, Some(variance));
        let zero = drifts(&told, &told)?;
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
        for emitted in drifts(&nowhere, &there)? {
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
