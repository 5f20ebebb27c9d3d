//! A flight whose receiver is spoofed: camera and map in its place. `cargo run --example no_satellites`
//!
//! The state estimator as a plain value: fixes while the flight controller trusts its receiver, then relative poses of a camera, and
//! every four seconds a pose from a satellite image, an *anchor*. The label says where an estimate comes from.

use bb_core::nalgebra::{Matrix3, Matrix6, UnitQuaternion, Vector3};
use bb_estimators::navigation::state_estimator::{
    AttitudeReading, EstimatorError, Event, FlightNavigator, GnssReading, GpsHealth, GpsHealthReading, PoseAnchor,
    StateEstimatorConfig, StrategyKind, TakeoffOrigin, VioOutput,
};
use bb_estimators::navigation::{Geodetic, ImuMean};

const MS: i64 = 1_000_000;

/// Goes on without an input that was refused, which is an event too.
fn goes_on<T>(added: Result<T, EstimatorError>) -> Result<(), EstimatorError> {
    added.map(drop).or_else(|error| if error.is_fatal() { Err(error) } else { Ok(()) })
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let log = |event: &Event| {
        if let Some(text) = event.status_text() {
            println!("        {text}"); // at most 50 characters, as a ground station shows them
        }
    };
    let position = Geodetic::from_degrees(48.0, 11.0, 500.0);
    let level = UnitQuaternion::identity();
    let covariance = |position: f64, angle: f64| {
        Matrix6::from_diagonal(&[position, position, position, angle, angle, angle].map(|one| one * one).into())
    };
    let config = StateEstimatorConfig { strategy: StrategyKind::Eskf, ..StateEstimatorConfig::default() };
    let mut estimator: FlightNavigator<_> = FlightNavigator::new(config, log)?;
    estimator.set_takeoff_origin(TakeoffOrigin::new(position))?;
    estimator.add_attitude(AttitudeReading {
        time_ns: 0,
        world_from_body: level,
        tilt_deviation: 0.01,
        heading_deviation: 0.1,
    })?;
    let mut label = None;
    for millis in (0..=30_000).step_by(5) {
        let time_ns = millis * MS;
        let (angular_velocity, specific_force) = (Vector3::zeros(), Vector3::new(0.0, 0.0, 9.80665));
        estimator.add_imu(&ImuMean { time_ns, angular_velocity, specific_force })?;
        let is_spoofed = millis >= 15_000;
        if millis % 2_000 == 0 {
            let health = if is_spoofed { GpsHealth::Spoofed } else { GpsHealth::Stable };
            estimator.add_gps_health(GpsHealthReading { time_ns, health })?;
            let mut position = position;
            position.height += if is_spoofed { 50.0 } else { 0.0 };
            let (covariance, lever_arm) = (Matrix3::identity() * 4.0, Vector3::zeros());
            goes_on(estimator.add_gnss(GnssReading { time_ns, position, covariance, velocity: None, lever_arm }))?;
        }
        if millis % 100 == 0 && millis >= 1_000 {
            let (from_ns, to_ns) = (time_ns - 100 * MS, time_ns);
            let (translation, covariance) = (Vector3::zeros(), covariance(0.02, 1e-3));
            estimator.add_vio(VioOutput { from_ns, to_ns, translation, from_to: level, covariance, bias: None })?;
        }
        if millis % 4_000 == 0 && millis >= 20_000 {
            let (world_from_body, covariance) = (level, covariance(1.5, 0.02));
            estimator.add_pose_anchor(PoseAnchor {
                time_ns,
                provider: 0,
                position,
                world_from_body,
                covariance,
                is_covariance_degraded: false,
            })?;
        }
        let Some(output) = estimator.tick(time_ns) else { continue };
        if label.replace(output.label) != Some(output.label) {
            println!("{:>5.1} s {}", millis as f64 * 1e-3, output.label);
        }
    }
    Ok(())
}
