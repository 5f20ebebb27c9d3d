//! Consistency: with sensors whose errors match the filter's noise model, its errors match its covariance.

use nalgebra::{SVector, Vector2, Vector3};

use super::super::propagation::Transition;
use super::super::{
    PlanarEstimate, PlanarHeading, PlanarParams, PlanarPosition, PlanarStart, STATES, WheelVelocity, YawRate,
};
use super::{sample, started_with};
use crate::navigation::eskf::GaussMarkov;
use crate::navigation::eskf::tests::{Run, are_consistent, open};
use crate::navigation::math::sqrt;
use crate::navigation::noise::Noise;
use crate::navigation::{ImuMean, nees};

const DT: f64 = 0.01;
const ANTENNA: Vector2<f64> = Vector2::new(-0.5, 0.3);

/// A drive of 40 s.
fn drive(seed: u64) -> Run {
    let params = PlanarParams {
        gyroscope_noise: 1e-3,
        gyroscope_bias_walk: 1e-4,
        forward_acceleration: 0.5,
        lateral_acceleration: 0.2,
        wheel_scale: GaussMarkov::constant(0.03),
        ..PlanarParams::default()
    };
    let mut noise = Noise::new(seed);
    let velocity = Vector2::new(3.0, 0.0);
    let start = PlanarStart::at(0, (Vector2::zeros(), 1.0), (1.0, 0.05), (velocity, 0.3));
    let mut filter = started_with(params, &start);
    // The truth deviates from the estimate according to the filter's initial covariance.
    let mut truth: PlanarEstimate = *filter.estimate().unwrap();
    let pair = |noise: &mut Noise, deviation: f64| Vector2::new(noise.next(), noise.next()) * deviation;
    truth.position += pair(&mut noise, 1.0);
    truth.heading += 0.05 * noise.next();
    truth.velocity += pair(&mut noise, 0.3);
    truth.wheel_scale = 0.03 * noise.next();
    truth.gyroscope_bias = 0.02 * noise.next();
    let mut streams = [open(); 4];
    for i in 1..=4000_i64 {
        let rate = sample(i).angular_velocity.z;
        truth.yaw_rate = rate;
        Transition::advance(&mut truth, DT);
        let measured = rate + truth.gyroscope_bias + noise.next() * params.gyroscope_noise / sqrt(DT);
        let angular_velocity = Vector3::new(0.0, 0.0, measured);
        truth.gyroscope_bias += noise.next() * params.gyroscope_bias_walk * sqrt(DT);
        truth.velocity.x += noise.next() * params.forward_acceleration * sqrt(DT);
        truth.velocity.y += noise.next() * params.lateral_acceleration * sqrt(DT);
        filter.propagate(&ImuMean { angular_velocity, ..sample(i) }).unwrap();
        if i % 5 == 0 {
            let wheels = truth.velocity * (1.0 + truth.wheel_scale) + pair(&mut noise, 0.05);
            filter.update(&mut streams[0], &WheelVelocity::new(wheels, 0.05)).unwrap();
            let turning = rate + 0.05 * noise.next();
            // The gyroscope's own noise in one sample.
            let deviation = 0.05_f64.hypot(params.gyroscope_noise / sqrt(DT));
            filter.update(&mut streams[1], &YawRate { rate: turning, deviation }).unwrap();
        }
        if i % 20 == 0 {
            let position = truth.position + truth.world_from_body() * ANTENNA + pair(&mut noise, 0.8);
            let fix = PlanarPosition { lever_arm: ANTENNA, ..PlanarPosition::new(position, 0.8) };
            filter.update(&mut streams[2], &fix).unwrap();
        }
        if i % 50 == 0 {
            let heading = truth.heading + 0.1 * noise.next();
            filter.update(&mut streams[3], &PlanarHeading { heading, deviation: 0.1 }).unwrap();
        }
    }
    let error: SVector<f64, STATES> = filter.estimate().unwrap().error_to(&truth);
    Run { nees: nees(&error, filter.covariance()).unwrap(), dimension: STATES, streams: streams.to_vec() }
}

#[test]
fn errors_are_as_large_as_the_filter_says() {
    let drives: Vec<_> = (1..=200).map(drive).collect();
    assert_eq!(are_consistent(&drives, &["wheels", "yaw rates", "positions", "headings"], 3.5), 4);
}
