//! Outputs of attitude estimators: the orientation alone, or beside what else they know.

use crate::kit::*;
use bb_estimators::attitude::AttitudeOutputs;
use bb_estimators::{Madgwick, Mekf, SimulatedImu};

robot! {
    robot Outputs;

    link body {
        sensor imu: SimulatedImu(duration = 2 s) {
            rate: 100 Hz;
            estimator plain: Madgwick<Marg>();
            estimator madgwick: Madgwick<Marg, AttitudeOutputs>() { output orientation; output status; }
            estimator mekf: Mekf<Marg, AttitudeOutputs>() { output orientation; output status; }
        }
    }
}

#[test]
fn a_filter_publishes_what_it_knows() {
    let mut simulation = Outputs::builder().simulate().unwrap();
    let plain = simulation.subscribe(outputs::sensor::body::imu::plain);
    let orientation = simulation.subscribe(outputs::sensor::body::imu::madgwick::orientation);
    let status = simulation.subscribe(outputs::sensor::body::imu::madgwick::status);
    let known_orientation = simulation.subscribe(outputs::sensor::body::imu::mekf::orientation);
    let known_status = simulation.subscribe(outputs::sensor::body::imu::mekf::status);
    let mut count = 0;
    while simulation.step() {
        for (plain, orientation) in plain.drain().zip(orientation.drain()) {
            assert_eq!(plain.payload, orientation.payload, "the same filter");
            assert_eq!(plain.covariance, None, "this one keeps none");
            count += 1;
        }
        for status in status.drain() {
            assert_eq!(status.gyroscope_bias, None);
            assert_eq!((status.is_at_rest, status.is_magnetically_disturbed), (None, None));
        }
        for orientation in known_orientation.drain() {
            let covariance = orientation.covariance.expect("a Kalman filter keeps one");
            assert!(covariance.trace() > 0.0 && (covariance - covariance.transpose()).norm() < 1e-12);
        }
        for status in known_status.drain() {
            assert!(status.gyroscope_bias.is_some());
            assert!(status.is_at_rest.is_some() && status.is_magnetically_disturbed.is_some());
        }
    }
    simulation.stop().ok().unwrap();
    assert!(count > 100, "{count} orientations");
}
