//! Simulated bodies: what there is no recording of, with exact truth and the noise of a consumer IMU.

mod motions;
mod profile;

use super::trial::{Trial, Truth};
use crate::variants::Random;
use bb_core::Options;
use bb_core::nalgebra::{UnitQuaternion, Vector3};
use bb_estimators::attitude::ImuSample;
use bb_estimators::simulation::{GRAVITY, SimulatedImuOptions};
use motions::Motion;

/// The field of central Europe, its horizontal part due north, T.
const FIELD: Vector3<f64> = Vector3::new(0.0, 20e-6, -44e-6);

/// A magnetometer measures at most this often, 1/s.
const FIELD_RATE: f64 = 50.0;

/// The standard deviations of what calibration leaves, by axis: of the gyroscope's scale,
const SCALE: f64 = 3e-3;
/// of the accelerometer's bias, m/s²,
const FORCE_BIAS: f64 = 0.05;
/// and of the magnetometer's offset, T.
const FIELD_OFFSET: f64 = 0.5e-6;

/// The growth of the gyroscope's bias, rad/s/√s.
const BIAS_WALK: f64 = 1e-5;

/// The bodies.
#[derive(Clone, Copy, Debug)]
pub(super) enum Body {
    /// A plane that takes off and flies circles, at samples a second.
    Plane {
        rate: f64,
    },
    Car,
    Boat,
    Drone,
    Walker,
    Steel,
    Warm,
}

impl Body {
    /// The number of trials, which differ by the seed of the noise and the motion's phases.
    pub(super) fn trials(self) -> u64 {
        match self {
            Self::Warm => 1,
            _ => 3,
        }
    }

    /// Simulates a trial.
    pub(super) fn trial(self, seed: u64) -> Trial {
        let mut random = Random::new([seed, 0, 0, 0]);
        let motion = match self {
            Self::Plane { rate } => motions::plane(rate, &mut random),
            Self::Car => motions::car(&mut random),
            Self::Boat => motions::boat(&mut random),
            Self::Drone => motions::drone(&mut random),
            Self::Walker => motions::walker(&mut random),
            Self::Steel => motions::steel(&mut random),
            Self::Warm => motions::warm(&mut random),
        };
        sampled(&motion, &mut random)
    }
}

/// What an IMU with a magnetometer on the body measures.
fn sampled(motion: &Motion, random: &mut Random) -> Trial {
    let noise = SimulatedImuOptions::defaults();
    let step_s = 1.0 / motion.rate;
    let scale = random.normal() * SCALE;
    let force_bias = random.normal() * FORCE_BIAS;
    let field_offset = random.normal() * FIELD_OFFSET;
    let warming = random.direction();
    let mut bias = random.normal() * noise.gyroscope_bias;
    let mut position = Vector3::zeros();
    let mut before = (motion.rotation)(0.0);
    let mut trial = Trial::default();
    for index in 1..=(motion.length_s * motion.rate) as u64 {
        let time_s = index as f64 * step_s;
        let world_from_body = (motion.rotation)(time_s);
        let body_from_world = world_from_body.inverse();
        let rate = mean_rate(&before, &world_from_body, step_s);
        before = world_from_body;
        let force = body_from_world * ((motion.acceleration)(time_s) + Vector3::z() * GRAVITY);
        bias += random.normal() * (BIAS_WALK * step_s.sqrt());
        let warmed = warming * (motion.bias)(time_s);
        let angular_velocity = rate
            + rate.component_mul(&scale)
            + bias
            + warmed
            + random.normal() * (noise.gyroscope_noise / step_s.sqrt());
        let shaken = (noise.accelerometer_noise / step_s.sqrt()).hypot(motion.vibration);
        let specific_force = force + force_bias + random.normal() * shaken;
        position += (motion.velocity)(time_s) * step_s;
        let is_new = (time_s * FIELD_RATE).floor() > ((time_s - step_s) * FIELD_RATE).floor();
        let magnetic_field = is_new.then(|| {
            let field = body_from_world * (FIELD + (motion.disturbance)(&position));
            field + field_offset + random.normal() * noise.magnetometer_noise
        });
        let time_ns = (time_s * 1e9).round() as i64;
        trial.push(
            ImuSample { time_ns, angular_velocity, specific_force, magnetic_field },
            Truth { world_from_body: Some(world_from_body), is_moving: time_s > motion.rest_s },
        );
    }
    trial
}

/// The mean angular velocity between two orientations in the body frame, rad/s.
fn mean_rate(before: &UnitQuaternion<f64>, after: &UnitQuaternion<f64>, step_s: f64) -> Vector3<f64> {
    (before.inverse() * after).scaled_axis() / step_s
}
