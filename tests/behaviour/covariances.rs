//! Covariances of poses are about the axes of the world, as in ROS (REP 103, `geometry_msgs/PoseWithCovariance`: rotation about
//! fixed axes), in what is read and in what is emitted, however the robot and the sensor are turned.

use bb_core::nalgebra::{Matrix6, UnitQuaternion, Vector3, Vector6};
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

/// What both emit last, of poses that are turned by `off` (world axes, rad) from a robot that rests, its x axis to the north.
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
        let at_rest = Imu::new(Vector3::zeros(), Vector3::new(0.0, 0.0, 9.80665));
        simulation.publish(turned::sensor::base::imu, time, at_rest);
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
    assert!(deviation(4) < 2e-4 && deviation(3) > 10.0 * deviation(4), "{covariance}");
    assert_eq!(covariance, covariance.transpose());
    Ok(())
}

/// Of a sensor whose own axis points up, so that no axis of its body is the one that counts.
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
            assert!(if follows { deviation < 1e-3 } else { deviation > 0.01 }, "{deviations}: {deviation}");
        }
    }
    Ok(())
}
