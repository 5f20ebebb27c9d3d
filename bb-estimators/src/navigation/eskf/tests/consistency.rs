//! Consistency: with sensors whose errors match the filter's noise model, its errors match its covariance, for every configuration, over
//! seeds.

use nalgebra::{UnitQuaternion, Vector3};

use super::super::propagation::Transition;
use super::{All, Drone, Rover, configurations, sample};
use crate::navigation::math::{exp, rotation, sqrt};
use crate::navigation::noise::Noise;
use crate::navigation::state::{Estimate, NAVIGATION, Navigation, Optional, States, offset};
use crate::navigation::{
    BarometricHeight, EskfFilter, EskfParams, GaussMarkov, GnssHeading, GnssPosition, GnssVelocity, ImuMean,
    MagneticField, Measurement, RelativePose, Start, Stream, StreamParams, WheelSpeed, nees,
};

const DT: f64 = 0.01;
const FLIGHTS: u32 = 100;

/// The sensors, named after their streams.
const SENSORS: [&str; 7] =
    ["relative poses", "positions", "velocities", "headings", "wheels", "magnetic field", "air pressure"];

/// Magnetic field of the Earth, in the world.
const FIELD: Vector3<f64> = Vector3::new(1e-6, 20e-6, -44e-6);

/// The result of a 30 s flight: the normalised error of all states except the keyframe, the number of these states, and the
/// sensors' streams.
struct Flown {
    nees: f64,
    dimension: usize,
    streams: [Stream; SENSORS.len()],
}

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

fn fly<S: States, const N: usize>(seed: u64) -> Flown {
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
    let mut streams = [Stream::new(StreamParams { gate: 0.0, ..StreamParams::default() }); SENSORS.len()];
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
            fuse(&mut filter, relative, &RelativePose::new(id, (way, 0.05), (turn, 2e-3)));
            filter.set_keyframe(id + 1);
            keyframe = truth;
        }
        if i % 10 == 0 {
            if offset::<S>(Optional::WheelScale).is_some() {
                let (forward, lever_arm) = (Vector3::x(), Vector3::new(0.1, 0.3, -0.4));
                let along =
                    (truth.world_from_body.inverse() * truth.velocity + angular_velocity.cross(&lever_arm)).x;
                let speed = (1.0 + truth.scalar::<S>(Optional::WheelScale)) * along + 0.1 * noise.next();
                fuse(&mut filter, wheels, &WheelSpeed { speed, deviation: 0.1, forward, lever_arm });
            }
            if offset::<S>(Optional::HardIron).is_some() {
                let iron = truth.vector::<S>(Optional::HardIron);
                let field = truth.world_from_body.inverse() * FIELD + iron + noise.vector(1e-6);
                fuse(&mut filter, magnetic, &MagneticField { field, reference: FIELD, deviation: 1e-6 });
            }
            if offset::<S>(Optional::BarometerBias).is_some() {
                let bias = truth.scalar::<S>(Optional::BarometerBias);
                let height = truth.position.z + bias + 0.5 * noise.next();
                fuse(&mut filter, pressure, &BarometricHeight { height, deviation: 0.5 });
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
            fuse(&mut filter, positions, &GnssPosition::new(antenna + noise.vector(0.8), 0.8, 0.8));
            let moving = truth.velocity + swing - acceleration * delay;
            fuse(&mut filter, velocities, &GnssVelocity::new(moving + noise.vector(0.1), 0.1, 0.1));
            let baseline = Vector3::x();
            let ahead = truth.world_from_body * rotation(&(angular_velocity * -delay)) * baseline;
            let heading = ahead.y.atan2(ahead.x) + 0.02 * noise.next();
            fuse(&mut filter, headings, &GnssHeading { heading, deviation: 0.02, baseline });
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
    Flown { nees, dimension, streams }
}

fn fuse<S: States, const N: usize, X: Measurement<D>, const D: usize>(
    filter: &mut EskfFilter<S, N>,
    stream: &mut Stream,
    measurement: &X,
) {
    filter.update(stream, measurement).unwrap();
}

fn errors_are_as_large_as_the_filter_says<S: States, const N: usize>(sensors: usize) {
    let flights: Vec<_> = (0..FLIGHTS).map(|seed| fly::<S, N>(u64::from(seed) + 1)).collect();
    let mean = flights.iter().map(|flown| flown.nees).sum::<f64>() / f64::from(FLIGHTS);
    // Three standard deviations of a mean of χ² with the same number of dimensions.
    let dimension = flights[0].dimension as f64;
    let spread = 3.0 * (2.0 * dimension / f64::from(FLIGHTS)).sqrt();
    assert!((mean - dimension).abs() < spread, "NEES {mean}, not {dimension} ± {spread}");
    let mut used = 0;
    for (i, name) in SENSORS.into_iter().enumerate() {
        let consistency = |flown: &Flown| *flown.streams[i].consistency();
        if consistency(&flights[0]).count() == 0 {
            continue;
        }
        used += 1;
        let over = |of: &dyn Fn(&Flown) -> f64| flights.iter().map(of).sum::<f64>() / f64::from(FLIGHTS);
        let nis = over(&|flown| consistency(flown).mean_nis().unwrap());
        let correlation = over(&|flown| consistency(flown).correlation().unwrap());
        // Four standard deviations of a mean of χ², and of a correlation, over the same number of innovations.
        let innovations = consistency(&flights[0]).count() as f64 * f64::from(FLIGHTS);
        let of_one = consistency(&flights[0]).nis_bounds().1 - 1.0;
        let spread = 4.0 * of_one / 1.96 / f64::from(FLIGHTS).sqrt();
        assert!((nis - 1.0).abs() < spread, "{name}: NIS {nis}, not 1 ± {spread}");
        let spread = 4.0 / innovations.sqrt();
        assert!(
            correlation.abs() < spread,
            "{name}: {correlation} from one innovation to the next, not 0 ± {spread}"
        );
    }
    assert_eq!(used, sensors);
}

/// The number of sensors in a configuration: the common ones and those of its optional states.
fn sensors<S: States>() -> usize {
    let of_states = [Optional::Keyframe, Optional::WheelScale, Optional::HardIron, Optional::BarometerBias];
    3 + of_states.into_iter().filter(|state| offset::<S>(*state).is_some()).count()
}

macro_rules! consistent {
    ($($name:ident: $states:ty;)*) => { $(
        mod $name {
            use super::*;

            #[test]
            fn errors_are_as_large_as_the_filter_says() {
                super::errors_are_as_large_as_the_filter_says::<$states, { <$states>::DIMENSION }>(sensors::<$states>());
            }
        }
    )* };
}

configurations!(consistent);
