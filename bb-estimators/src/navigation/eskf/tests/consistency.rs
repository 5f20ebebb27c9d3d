//! With sensors that err exactly as the filter is told, its errors are as large as it says.

use nalgebra::{SVector, UnitQuaternion, Vector3};

use super::super::propagation::Transition;
use super::sample;
use crate::navigation::math::{rotation, sqrt};
use crate::navigation::noise::Noise;
use crate::navigation::state::{Estimate, NAVIGATION, Optional, States};
use crate::navigation::{
    Eskf, EskfParams, GaussMarkov, GnssHeading, GnssPosition, GnssVelocity, ImuMean, RelativePose, Start, Stream,
    StreamParams, nees,
};

#[derive(Clone, Copy, Debug, PartialEq)]
struct Drone;

impl States for Drone {
    const OPTIONAL: &'static [Optional] = &[Optional::Keyframe, Optional::RelativeScale, Optional::GnssLeverArm];
}

const N: usize = Drone::DIMENSION;
const DT: f64 = 0.01;

/// How a flight of 30 s ended: the normalised error of all navigation states, and the sensors' streams.
struct Flown {
    nees: f64,
    streams: [Stream; 4],
}

fn fly(seed: u64) -> Flown {
    let params = EskfParams {
        gyroscope_noise: 1e-3,
        accelerometer_noise: 1e-2,
        gyroscope_bias_walk: 1e-4,
        accelerometer_bias_walk: 3e-3,
        relative_scale: GaussMarkov::constant(0.02),
        gnss_lever_arm: GaussMarkov::constant(0.2),
        ..EskfParams::default()
    };
    let mut noise = Noise::new(seed);
    let mut filter = Eskf::<Drone, N>::new(params).unwrap();
    let level = UnitQuaternion::from_euler_angles(0.1, -0.1, 1.0);
    let velocity = Vector3::new(8.0, 2.0, 0.0);
    let start = Start {
        accelerometer_bias_deviation: 0.1,
        gyroscope_bias_deviation: 0.01,
        ..Start::at(0, (Vector3::zeros(), 1.0), (velocity, 0.3), (level, 0.05))
    };
    filter.start(&start).unwrap();
    filter.set_keyframe(0);
    // The truth is off by what the filter is told.
    let mut truth: Estimate<N> = *filter.estimate().unwrap();
    truth.position += noise.vector(1.0);
    truth.velocity += noise.vector(0.3);
    truth.world_from_body = rotation(&noise.vector(0.05)) * truth.world_from_body;
    let mut gyroscope_bias = noise.vector(0.01);
    let mut accelerometer_bias = noise.vector(0.1);
    let scale = 0.02 * noise.next();
    let lever_arm = noise.vector(0.2);
    let mut keyframe = truth;
    let mut streams = [Stream::new(StreamParams { gate: 0.0, ..StreamParams::default() }); 4];
    for i in 1..=3000_i64 {
        let ImuMean { time_ns, angular_velocity, specific_force } = sample(i);
        (truth.angular_velocity, truth.specific_force) = (angular_velocity, specific_force);
        Transition::advance(&mut truth, DT, params.gravity);
        let measured = ImuMean {
            time_ns,
            angular_velocity: angular_velocity + gyroscope_bias + noise.vector(params.gyroscope_noise / sqrt(DT)),
            specific_force: specific_force
                + accelerometer_bias
                + noise.vector(params.accelerometer_noise / sqrt(DT)),
        };
        gyroscope_bias += noise.vector(params.gyroscope_bias_walk * sqrt(DT));
        accelerometer_bias += noise.vector(params.accelerometer_bias_walk * sqrt(DT));
        filter.propagate(&measured).unwrap();
        if i % 20 == 0 {
            let back = keyframe.world_from_body.inverse();
            let way = back * (truth.position - keyframe.position) * (1.0 + scale) + noise.vector(0.05);
            let turn = back * truth.world_from_body * rotation(&noise.vector(2e-3));
            let id = u64::try_from(i / 20 - 1).unwrap();
            filter.update(&mut streams[0], &RelativePose::new(id, (way, 0.05), (turn, 2e-3))).unwrap();
            filter.set_keyframe(id + 1);
            keyframe = truth;
        }
        if i % 50 == 0 {
            let antenna = truth.position + truth.world_from_body * lever_arm;
            let fix = GnssPosition::new(antenna + noise.vector(0.8), 0.8, 0.8);
            filter.update(&mut streams[1], &fix).unwrap();
            let swing = truth.world_from_body * angular_velocity.cross(&lever_arm);
            let fix = GnssVelocity::new(truth.velocity + swing + noise.vector(0.1), 0.1, 0.1);
            filter.update(&mut streams[2], &fix).unwrap();
            let baseline = Vector3::x();
            let ahead = truth.world_from_body * baseline;
            let heading = ahead.y.atan2(ahead.x) + 0.02 * noise.next();
            filter.update(&mut streams[3], &GnssHeading { heading, deviation: 0.02, baseline }).unwrap();
        }
    }
    (truth.gyroscope_bias, truth.accelerometer_bias) = (gyroscope_bias, accelerometer_bias);
    let error = filter.estimate().unwrap().error_to::<Drone>(&truth);
    let error: SVector<f64, NAVIGATION> = error.fixed_rows::<NAVIGATION>(0).into_owned();
    let covariance = filter.covariance().fixed_view::<NAVIGATION, NAVIGATION>(0, 0).into_owned();
    Flown { nees: nees(&error, &covariance).unwrap(), streams }
}

#[test]
fn errors_are_as_large_as_the_filter_says() {
    const FLIGHTS: u32 = 100;
    let flights: Vec<_> = (0..FLIGHTS).map(|seed| fly(u64::from(seed) + 1)).collect();
    let mean = flights.iter().map(|flown| flown.nees).sum::<f64>() / f64::from(FLIGHTS);
    // Three standard deviations of a mean of χ² of as many dimensions.
    let dimension = NAVIGATION as f64;
    let spread = 3.0 * (2.0 * dimension / f64::from(FLIGHTS)).sqrt();
    assert!((mean - dimension).abs() < spread, "NEES {mean}, not {dimension} ± {spread}");
    for (i, name) in ["relative poses", "positions", "velocities", "headings"].into_iter().enumerate() {
        let consistency = |flown: &Flown| *flown.streams[i].consistency();
        let over = |of: &dyn Fn(&Flown) -> f64| flights.iter().map(of).sum::<f64>() / f64::from(FLIGHTS);
        let nis = over(&|flown| consistency(flown).mean_nis().unwrap());
        let correlation = over(&|flown| consistency(flown).correlation().unwrap());
        assert!((nis - 1.0).abs() < 0.04, "{name}: NIS {nis}");
        assert!(correlation.abs() < 0.05, "{name}: {correlation} from one innovation to the next");
    }
}
