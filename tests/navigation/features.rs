//! A camera whose landmarks a robot's smoother is given, mounted as the robot declares it.

use crate::flights::{at, attitude, geodetic, local};
use bb_core::message::codec::{decode, encode};
use bb_core::nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use bb_core::prelude::*;
use bb_estimators::StateEstimator;
use bb_estimators::navigation::Camera;
use bb_estimators::navigation::state_estimator::{Feature, FeaturesReading, FlightEstimate, WarmStartReport};
use std::error::Error;

robot! {
    robot Seeing;

    link base {
        joint shelf: fixed {
            origin: { xyz: [20 cm, 0 m, 10 cm] };
            link board { sensor imu: External<Imu>(); }
        }
        joint belly: fixed {
            // The optical frame of a lens that looks down, with the top of the image ahead.
            origin: { xyz: [60 cm, 0 m, -10 cm], rpy: [180 deg, 0 deg, -90 deg] };
            link lens { sensor camera: External<FeaturesReading>(); }
        }
        sensor state: External<WarmStartReport>();
        estimator navigation: StateEstimator(
            fx = 458.0, fy = 457.0, cx = 376.0, cy = 240.0, width = 752.0, height = 480.0, k1 = -0.05, p1 = 2e-4,
        ) {
            input imu: sensor::base::shelf::board::imu, driver;
            input features: sensor::base::belly::lens::camera, optional;
            input warm_start: sensor::base::state, optional;
            output estimate;
            output events;
        }
    }
}

/// Position and acceleration; the body stays level, with its x axis to the north.
fn motion(millis: i64) -> [Vector3<f64>; 2] {
    let t = millis as f64 * 1e-3;
    let [(a, b), (sin_a, cos_b)] = [(0.4, 0.5), ((0.4 * t).sin(), (0.5 * t).cos())];
    let position = Vector3::new(10.0 * sin_a, 5.0 * t - 8.0 * cos_b, 0.0);
    [position, Vector3::new(-10.0 * a * a * sin_a, 8.0 * b * b * cos_b, 0.0)]
}

/// Landmarks on a grid 30 m below, with an unevenness of a few metres.
fn image(millis: i64) -> FeaturesReading {
    let world_from_body = attitude().world_from_body;
    let lens = Camera {
        distortion: [-0.05, 0.0, 0.0, 2e-4, 0.0],
        ..Camera::pinhole((458.0, 457.0), (376.0, 240.0), (752.0, 480.0))
    };
    let axes = Matrix3::new(0.0, -1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, -1.0);
    let body_from_camera = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    // From the IMU, whose position is that of the body.
    let centre = motion(millis)[0] + world_from_body * Vector3::new(0.4, 0.0, -0.2);
    let (x, y) = ((centre.x / 8.0).round() as i64, (centre.y / 8.0).round() as i64);
    let mut features = Vec::new();
    for (i, j) in (-3..=3).flat_map(|i| (-3..=3).map(move |j| (x + i, y + j))) {
        let place = Vector3::new(8.0 * i as f64, 8.0 * j as f64, -30.0 + ((7 * i + 3 * j) % 5) as f64);
        let seen = lens.seen(&((world_from_body * body_from_camera).inverse() * (place - centre)));
        let landmark = ((i + 1000) * 10_000 + j + 1000) as u64;
        if let Some(seen) = seen.ok().filter(|seen| (0..2).all(|k| (0.0..=lens.size[k]).contains(&seen.pixel[k]))) {
            features.push(Feature { landmark, pixel: seen.pixel, deviation_px: 0.5 });
        }
    }
    FeaturesReading { features }
}

/// Error of the last estimate, m, and its deviation, after 15 s from a start whose velocity is 0.3 m/s off.
fn fly(sees: bool) -> Result<(f64, f64), Box<dyn Error>> {
    let builder = Seeing::builder();
    let estimates = builder.subscribe(seeing::estimator::base::navigation::estimate);
    let events = builder.subscribe(seeing::estimator::base::navigation::events);
    let mut simulation = builder.simulate()?;
    let velocity = (motion(1)[0] - motion(-1)[0]) * 500.0;
    let state = WarmStartReport {
        attitude: attitude(),
        position: geodetic(motion(0)[0]),
        position_covariance: Matrix3::identity() * 0.01,
        velocity: velocity + Vector3::new(0.2, -0.3, 0.1),
        velocity_covariance: Matrix3::identity() * 0.09,
    };
    simulation.publish(seeing::sensor::base::state, at(0), state);
    let mut last: Option<FlightEstimate> = None;
    for millis in (5..=15_000).step_by(5) {
        let acceleration = (motion(millis)[1] + motion(millis - 5)[1]) / 2.0;
        let force = attitude().world_from_body.inverse() * acceleration + Vector3::new(0.0, 0.0, 9.80665);
        simulation.publish(seeing::sensor::base::shelf::board::imu, at(millis), Imu::new(Vector3::zeros(), force));
        if sees && millis % 100 == 0 {
            simulation.publish(seeing::sensor::base::belly::lens::camera, at(millis), image(millis));
        }
        last = estimates.drain().last().map(|estimate| estimate.payload).or(last);
    }
    simulation.stop();
    let told: Vec<_> = events.drain().flat_map(|events| events.payload.events).collect();
    assert!(!told.iter().any(|event| event.kind == "degraded" || event.kind == "fatal"), "{told:?}");
    let last = last.ok_or("it flies")?;
    let off = local(&last.position) - motion(last.time.as_nanos() / 1_000_000)[0];
    Ok((off.norm(), last.covariance.fixed_view::<3, 3>(0, 0).trace().sqrt()))
}

#[test]
fn landmarks_hold_the_position() -> Result<(), Box<dyn Error>> {
    let (blind, unsure) = fly(false)?;
    let (seeing, sure) = fly(true)?;
    assert!(seeing < 0.15 * blind && sure < 0.03 * unsure && seeing < sure, "{blind} {unsure} {seeing} {sure}");
    let mut bytes = Vec::new();
    encode(&image(100), &mut bytes);
    assert!(image(100).features.len() > 10);
    assert_eq!(decode::<FeaturesReading>(&bytes)?, image(100));
    Ok(())
}
