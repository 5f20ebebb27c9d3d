//! Consistency: with sensors whose errors match the filter's noise model, its errors match its covariance, for every configuration, over
//! seeds.

use nalgebra::{UnitQuaternion, Vector3};

use super::super::propagation::Transition;
use super::{All, Drone, Rover, Run, are_consistent, open, sample};
use crate::navigation::math::{exp, rotation, sqrt};
use crate::navigation::noise::Noise;
use crate::navigation::state::{Estimate, NAVIGATION, Navigation, Optional, States, offset};
use crate::navigation::{
    BarometricHeight, EskfFilter, EskfParams, GaussMarkov, GnssHeading, GnssPosition, GnssVelocity, ImuMean,
    MagneticField, RelativePose, Start, WheelSpeed, nees,
};

const DT: f64 = 0.01;

/// The sensors, named after their streams.
const SENSORS: [&str; 7] =
    ["relative poses", "positions", "velocities", "headings", "wheels", "magnetic field", "air pressure"];

/// Magnetic field of the Earth, in the world.
const FIELD: Vector3<f64> = Vector3::new(1e-6, 20e-6, -44e-6);

fn params() -> EskfParams {
    EskfParams {
        gyroscope_noise: 1e-3,
        accelerometer_noise: 1e-2,
        gyroscope_bias_walk: 1e-4,
        accelerometer_bias_walk: 3e-3,
        relative_scale: GaussMarkov::constant(0.02),
        gnss_lever_arm: GaussMarkov::constant(0.2),
        gnss_delay: GaussMarkov::constant(0.02),
        wheel_scale: GaussMarkov::new(0.03, 20.0),
        hard_iron: GaussMarkov::new(3e-6, 60.0),
        barometer_bias: GaussMarkov::new(3.0, 20.0),
        ..EskfParams::default()
    }
}

/// The true values of the optional states.
struct Hidden {
    state: Optional,
    process: GaussMarkov,
    index: usize,
}

fn hidden<S: States>() -> Vec<Hidden> {
    let params = params();
    let process = |state| match state {
        Optional::Keyframe => None,
        Optional::RelativeScale => Some(params.relative_scale),
        Optional::GnssLeverArm => Some(params.gnss_lever_arm),
        Optional::GnssDelay => Some(params.gnss_delay),
        Optional::WheelScale => Some(params.wheel_scale),
        Optional::WheelMounting => Some(params.wheel_mounting),
        Optional::HardIron => Some(params.hard_iron),
        Optional::BarometerBias => Some(params.barometer_bias),
    };
    let hidden =
        |state: &Optional| Some(Hidden { state: *state, process: process(*state)?, index: offset::<S>(*state)? });
    S::OPTIONAL.iter().filter_map(hidden).collect()
}

impl Hidden {
    fn indices(&self) -> std::ops::Range<usize> {
        self.index..self.index + self.state.dimension()
    }

    /// Draws the initial values.
    fn draw<const N: usize>(&self, truth: &mut Estimate<N>, noise: &mut Noise) {
        for i in self.indices() {
            truth.optional[i] = self.process.deviation * noise.next();
        }
    }

    /// Propagates the values over a sample.
    fn wander<const N: usize>(&self, truth: &mut Estimate<N>, noise: &mut Noise) {
        if self.process.time_s.is_finite() {
            let stays = exp(-DT / self.process.time_s);
            for i in self.indices() {
                let step = sqrt(1.0 - stays * stays) * self.process.deviation * noise.next();
                truth.optional[i] = stays * truth.optional[i] + step;
            }
        }
    }
}

/// A flight of 30 s. The keyframe has no error of its own.
fn fly<S: States, const N: usize>(seed: u64) -> Run {
    let params = params();
    let mut noise = Noise::new(seed);
    let mut filter = EskfFilter::<S, N>::new(params).unwrap();
    let level = UnitQuaternion::from_euler_angles(0.1, -0.1, 1.0);
    let velocity = Vector3::new(8.0, 2.0, 0.0);
    let start = Start {
        accelerometer_bias_deviation: 0.1,
        gyroscope_bias_deviation: 0.01,
        ..Start::at(0, (Vector3::zeros(), 1.0), (velocity, 0.3), (level, 0.05))
    };
    filter.start(&start).unwrap();
    filter.set_keyframe(0);
    // The truth deviates from the estimate according to the filter's initial covariance.
    let mut truth: Estimate<N> = *filter.estimate().unwrap();
    truth.position += noise.vector(1.0);
    truth.velocity += noise.vector(0.3);
    truth.world_from_body = rotation(&noise.vector(0.05)) * truth.world_from_body;
    let mut gyroscope_bias = noise.vector(0.01);
    let mut accelerometer_bias = noise.vector(0.1);
    let hidden = hidden::<S>();
    hidden.iter().for_each(|state| state.draw(&mut truth, &mut noise));
    let mut keyframe = truth;
    let mut streams = [open(); SENSORS.len()];
    for i in 1..=3000_i64 {
        let ImuMean { time_ns, angular_velocity, specific_force } = sample(i);
        (truth.angular_velocity, truth.specific_force) = (angular_velocity, specific_force);
        Transition::advance(&mut truth, DT, params.gravity);
        hidden.iter().for_each(|state| state.wander(&mut truth, &mut noise));
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
        let [relative, positions, velocities, headings, wheels, magnetic, pressure] = &mut streams;
        if i % 20 == 0 && offset::<S>(Optional::Keyframe).is_some() {
            let back = keyframe.world_from_body.inverse();
            let scale = 1.0 + truth.scalar::<S>(Optional::RelativeScale);
            let way = back * (truth.position - keyframe.position) * scale + noise.vector(0.05);
            let turn = back * truth.world_from_body * rotation(&noise.vector(2e-3));
            let id = u64::try_from(i / 20 - 1).unwrap();
            filter.update(relative, &RelativePose::new(id, (way, 0.05), (turn, 2e-3))).unwrap();
            filter.set_keyframe(id + 1);
            keyframe = truth;
        }
        if i % 10 == 0 {
            if offset::<S>(Optional::WheelScale).is_some() {
                let (forward, lever_arm) = (Vector3::x(), Vector3::new(0.1, 0.3, -0.4));
                let along =
                    (truth.world_from_body.inverse() * truth.velocity + angular_velocity.cross(&lever_arm)).x;
                let speed = (1.0 + truth.scalar::<S>(Optional::WheelScale)) * along + 0.1 * noise.next();
                filter.update(wheels, &WheelSpeed { speed, deviation: 0.1, forward, lever_arm }).unwrap();
            }
            if offset::<S>(Optional::HardIron).is_some() {
                let iron = truth.vector::<S>(Optional::HardIron);
                let field = truth.world_from_body.inverse() * FIELD + iron + noise.vector(1e-6);
                filter.update(magnetic, &MagneticField { field, reference: FIELD, deviation: 1e-6 }).unwrap();
            }
            if offset::<S>(Optional::BarometerBias).is_some() {
                let bias = truth.scalar::<S>(Optional::BarometerBias);
                let height = truth.position.z + bias + 0.5 * noise.next();
                filter.update(pressure, &BarometricHeight { height, deviation: 0.5 }).unwrap();
            }
        }
        if i % 50 == 0 {
            let lever_arm = truth.vector::<S>(Optional::GnssLeverArm);
            let swing = truth.world_from_body * angular_velocity.cross(&lever_arm);
            let delay = truth.scalar::<S>(Optional::GnssDelay);
            let gravity = Vector3::new(0.0, 0.0, params.gravity);
            let acceleration = truth.world_from_body * specific_force - gravity
                + truth.world_from_body * angular_velocity.cross(&angular_velocity.cross(&lever_arm));
            let moving = truth.velocity + swing - acceleration * (0.5 * delay);
            let antenna = truth.position + truth.world_from_body * lever_arm - moving * delay;
            filter.update(positions, &GnssPosition::new(antenna + noise.vector(0.8), 0.8, 0.8)).unwrap();
            let moving = truth.velocity + swing - acceleration * delay;
            filter.update(velocities, &GnssVelocity::new(moving + noise.vector(0.1), 0.1, 0.1)).unwrap();
            let baseline = Vector3::x();
            let ahead = truth.world_from_body * rotation(&(angular_velocity * -delay)) * baseline;
            let heading = ahead.y.atan2(ahead.x) + 0.02 * noise.next();
            filter.update(headings, &GnssHeading { heading, deviation: 0.02, baseline }).unwrap();
        }
    }
    (truth.gyroscope_bias, truth.accelerometer_bias) = (gyroscope_bias, accelerometer_bias);
    let mut error = filter.estimate().unwrap().error_to::<S>(&truth);
    let mut covariance = *filter.covariance();
    let is_counted = |i: usize| i < NAVIGATION || hidden.iter().any(|state| state.indices().contains(&i));
    // States that are not counted add nothing.
    for i in (0..N).filter(|i| !is_counted(*i)) {
        error[i] = 0.0;
        covariance.row_mut(i).fill(0.0);
        covariance.column_mut(i).fill(0.0);
        covariance[(i, i)] = 1.0;
    }
    let dimension = (0..N).filter(|i| is_counted(*i)).count();
    let nees = nees(&error, &covariance).unwrap();
    Run { nees, dimension, streams: streams.to_vec() }
}

/// The number of sensors in a configuration: the common ones and those of its optional states.
fn sensors<S: States>() -> usize {
    let of_states = [Optional::Keyframe, Optional::WheelScale, Optional::HardIron, Optional::BarometerBias];
    3 + of_states.into_iter().filter(|state| offset::<S>(*state).is_some()).count()
}

macro_rules! errors_are_as_large_as_the_filter_says {
    ($($name:ident: $states:ty),*) => { $(
        #[test]
        fn $name() {
            let flights: Vec<_> = (1..=100).map(fly::<$states, { <$states>::DIMENSION }>).collect();
            assert_eq!(are_consistent(&flights, &SENSORS, 4.0), sensors::<$states>());
        }
    )* };
}

errors_are_as_large_as_the_filter_says!(plain: Navigation, rover: Rover, drone: Drone, all: All);
