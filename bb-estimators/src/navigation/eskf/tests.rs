//! The transition and every Jacobian against numeric differentiation, and the laws of the filter.

mod adopt;
mod attack;
mod cases;
mod consistency;
#[cfg(feature = "eskf")]
mod jacobians;
mod laws;
mod transition;

use nalgebra::{SVector, UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::params::EskfParams;
use super::{EskfFilter, ImuMean, Start};
use crate::navigation::state::{Estimate, Optional, States};

/// All optional states.
#[derive(Clone, Copy, Debug, PartialEq)]
struct All;

impl States for All {
    const OPTIONAL: &'static [Optional] = &[
        Optional::GnssLeverArm,
        Optional::RelativeScale,
        Optional::Keyframe,
        Optional::GnssDelay,
        Optional::WheelScale,
        Optional::WheelMounting,
        Optional::HardIron,
        Optional::BarometerBias,
    ];
}

/// Wheels that wear and an antenna on a mast.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Rover;

impl States for Rover {
    const OPTIONAL: &'static [Optional] = &[Optional::WheelScale, Optional::GnssLeverArm, Optional::GnssDelay];
}

/// Poses from a camera, relative to keyframes.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Drone;

impl States for Drone {
    const OPTIONAL: &'static [Optional] = &[Optional::Keyframe, Optional::RelativeScale];
}

/// Calls a macro with every configuration whose laws are tested.
macro_rules! configurations {
    ($macro:ident) => {
        $macro! {
            plain: Navigation;
            rover: Rover;
            drone: Drone;
            all: All;
        }
    };
}
use configurations;

const ALL: usize = All::DIMENSION;

fn vector(limit: f64) -> impl Strategy<Value = Vector3<f64>> {
    let number = move || -limit..limit;
    (number(), number(), number()).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

fn orientation() -> impl Strategy<Value = UnitQuaternion<f64>> {
    vector(3.0).prop_map(UnitQuaternion::from_scaled_axis)
}

/// An estimate with a keyframe and all optional states.
fn estimate() -> impl Strategy<Value = Estimate<ALL>> {
    let motion = (vector(100.0), vector(20.0), orientation(), vector(2.0), vector(20.0));
    let rest = (vector(0.5), vector(0.1), vector(30.0), orientation(), proptest::array::uniform32(-0.2..0.2));
    (motion, rest).prop_map(|((position, velocity, world_from_body, angular_velocity, specific_force), rest)| {
        let (accelerometer_bias, gyroscope_bias, way, turn, optional) = rest;
        let keyframe = crate::navigation::Keyframe {
            id: 7,
            position: position - way,
            world_from_body: turn * world_from_body,
        };
        let mut estimate = Estimate {
            time_ns: 0,
            position,
            velocity,
            world_from_body,
            accelerometer_bias,
            gyroscope_bias,
            angular_velocity,
            specific_force,
            acceleration: Vector3::zeros(),
            keyframe: Some(keyframe),
            optional: SVector::from_fn(
                |i, _| if i < crate::navigation::NAVIGATION { 0.0 } else { optional[i % 32] },
            ),
        };
        // The keyframe has no values of its own in this vector.
        estimate = estimate.corrected::<All>(&SVector::zeros());
        estimate
    })
}

/// A level filter at rest at the origin with a moderate uncertainty.
fn started<S: States, const N: usize>() -> EskfFilter<S, N> {
    let mut filter = EskfFilter::new(EskfParams::default()).unwrap();
    let start = Start::at(0, (Vector3::zeros(), 2.0), (Vector3::zeros(), 0.5), (UnitQuaternion::identity(), 0.1));
    filter.start(&start).unwrap();
    filter
}

/// A flight with turns and accelerations, sampled at 100 Hz.
fn sample(i: i64) -> ImuMean {
    let t = i as f64 * 0.01;
    ImuMean {
        time_ns: i * 10_000_000,
        angular_velocity: Vector3::new(0.3 * t.sin(), 0.2 * (1.3 * t).cos(), 0.4 * (0.7 * t).sin()),
        specific_force: Vector3::new(t.cos(), (0.8 * t).sin(), 9.8 + 0.5 * (0.5 * t).sin()),
    }
}
