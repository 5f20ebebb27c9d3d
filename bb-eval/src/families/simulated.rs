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
        let motion = self.motion(&mut random);
        sampled(&motion, &mut random)
    }

    fn motion(self, random: &mut Random) -> Motion {
        match self {
            Self::Plane { rate } => motions::plane(rate, random),
            Self::Car => motions::car(random),
            Self::Boat => motions::boat(random),
            Self::Drone => motions::drone(random),
            Self::Walker => motions::walker(random),
            Self::Steel => motions::steel(random),
            Self::Warm => motions::warm(random),
        }
    }
}

/// Samples an IMU with a magnetometer on the body.
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
        let force = specific_force(motion, time_s);
        bias += random.normal() * (BIAS_WALK * step_s.sqrt());
        let warmed = warming * (motion.bias)(time_s);
        let angular_velocity = rate
            + rate.component_mul(&scale)
            + bias
            + warmed
            + random.normal() * (noise.gyroscope_noise / step_s.sqrt());
        let shaken = (noise.accelerometer_noise / step_s.sqrt()).hypot(motion.vibration);
        let specific_force = force + force_bias + random.normal() * shaken;
        position += velocity(motion, time_s) * step_s;
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

fn velocity(motion: &Motion, time_s: f64) -> Vector3<f64> {
    motion.velocity.as_ref().map_or_else(Vector3::zeros, |velocity| velocity(time_s))
}

/// The specific force in the body frame, m/s².
fn specific_force(motion: &Motion, time_s: f64) -> Vector3<f64> {
    (motion.rotation)(time_s).inverse() * ((motion.acceleration)(time_s) + Vector3::z() * GRAVITY)
}

/// The mean angular velocity between two orientations in the body frame, rad/s.
fn mean_rate(before: &UnitQuaternion<f64>, after: &UnitQuaternion<f64>, step_s: f64) -> Vector3<f64> {
    (before.inverse() * after).scaled_axis() / step_s
}

#[cfg(test)]
mod tests {
    use super::*;

    const BODIES: [(Body, f64); 7] = [
        (Body::Plane { rate: 50.0 }, 360.0),
        (Body::Car, 600.0),
        (Body::Boat, 600.0),
        (Body::Drone, 300.0),
        (Body::Walker, 300.0),
        (Body::Steel, 600.0),
        (Body::Warm, 10_800.0),
    ];

    fn motion(body: Body) -> Motion {
        body.motion(&mut Random::new([3, 0, 0, 0]))
    }

    /// Strapdown integration of exact rates and forces at 1 kHz comes back to the orientation and the velocity.
    #[test]
    fn rates_and_forces_integrate_to_the_motion() {
        for (body, length_s) in BODIES {
            let motion = motion(body);
            assert_eq!(motion.length_s, length_s);
            let step_s = 1e-3;
            let at = |index: u32| f64::from(index) * step_s;
            let mut rotation = (motion.rotation)(0.0);
            let mut integrated = velocity(&motion, 0.0);
            for index in 0..100_000 {
                let (from, to) = ((motion.rotation)(at(index)), (motion.rotation)(at(index + 1)));
                // A body does not turn faster than this, so no step is ambiguous.
                let rate = mean_rate(&from, &to, step_s);
                assert!(rate.norm() < 10.0, "{body:?} turns by {} rad/s at {}", rate.norm(), at(index));
                let middle = at(index) + 0.5 * step_s;
                let half = rotation * UnitQuaternion::from_scaled_axis(0.5 * step_s * rate);
                integrated += (half * specific_force(&motion, middle) - Vector3::z() * GRAVITY) * step_s;
                rotation *= UnitQuaternion::from_scaled_axis(rate * step_s);
            }
            assert!(rotation.angle_to(&(motion.rotation)(100.0)) < 1e-9, "{body:?}");
            let error = (integrated - velocity(&motion, 100.0)).norm();
            // A body without a velocity swings about its place, so its own is at most that of its swings.
            let most = if motion.velocity.is_some() { 1e-3 } else { 20.0 };
            assert!(error < most, "{body:?}: {integrated} instead of {}", velocity(&motion, 100.0));
        }
    }

    fn greatest(body: Body, of: impl Fn(&Motion, f64) -> f64) -> f64 {
        let motion = motion(body);
        (0..60_000).map(|index| of(&motion, f64::from(index) * 0.005)).fold(f64::MIN, f64::max)
    }

    #[test]
    fn bodies_move_as_they_are_described() {
        let plane = motion(Body::Plane { rate: 50.0 });
        let (speed, acceleration) = (velocity(&plane, 100.0), (plane.acceleration)(100.0));
        assert!((speed.norm() - 25.0).abs() < 1e-9);
        assert!((speed.norm_squared() / acceleration.norm() - 120.0).abs() < 1e-6);
        let braking = greatest(Body::Car, |car, time_s| {
            -(car.acceleration)(time_s).dot(&velocity(car, time_s)) / velocity(car, time_s).norm().max(0.1)
        });
        assert!((braking / GRAVITY - 0.35).abs() < 1e-3, "{braking}");
        let bend = greatest(Body::Car, |car, time_s| {
            (car.acceleration)(time_s).cross(&velocity(car, time_s)).norm() / velocity(car, time_s).norm().max(0.1)
        });
        assert!((bend - 8.0 * 8.0 / 20.0).abs() < 1e-3, "{bend}");
        let roll = greatest(Body::Boat, |boat, time_s| (boat.rotation)(time_s).euler_angles().0.to_degrees());
        assert!((12.0..=16.5).contains(&roll), "{roll}");
        let surge = greatest(Body::Boat, |boat, time_s| {
            ((boat.rotation)(time_s).inverse() * (boat.acceleration)(time_s)).x
        });
        assert!((0.8..=1.2).contains(&surge), "{surge}");
        let level = greatest(Body::Drone, |drone, time_s| {
            let force = specific_force(drone, time_s);
            force.xy().norm() / force.z
        });
        assert!(level < 0.06, "it shows {level} rad");
        let (cold, warm) = ((motion(Body::Warm).bias)(0.0), (motion(Body::Warm).bias)(10_800.0));
        assert!(cold == 0.0 && (warm.to_degrees() - 0.3).abs() < 0.005);
    }

    #[test]
    fn steel_disturbs_the_field_in_places() {
        let steel = motion(Body::Steel);
        let trial = Body::Steel.trial(0);
        let norms = trial.samples.iter().filter_map(|sample| Some(sample.magnetic_field?.norm() - FIELD.norm()));
        let norms: Vec<_> = norms.collect();
        let disturbed = norms.iter().filter(|norm| norm.abs() > 5e-6).count() as f64 / norms.len() as f64;
        assert!((0.1..0.6).contains(&disturbed), "{disturbed}");
        assert!((steel.disturbance)(&Vector3::new(12.0, 12.0, 0.0)).norm() < 2e-6, "the middle of the block");
    }

    /// The noise alone, at rest.
    #[test]
    fn noise_is_that_of_the_simulated_imu() {
        let noise = SimulatedImuOptions::defaults();
        let trial = Body::Warm.trial(0);
        let rest = &trial.samples[..450];
        let deviation = |of: fn(&ImuSample) -> f64| {
            let mean = rest.iter().map(of).sum::<f64>() / rest.len() as f64;
            (rest.iter().map(|sample| (of(sample) - mean).powi(2)).sum::<f64>() / rest.len() as f64).sqrt()
        };
        let gyroscope = noise.gyroscope_noise * 50_f64.sqrt();
        assert!((deviation(|sample| sample.angular_velocity.y) / gyroscope - 1.0).abs() < 0.15);
        let accelerometer = (noise.accelerometer_noise * 50_f64.sqrt()).hypot(0.05);
        assert!((deviation(|sample| sample.specific_force.y) / accelerometer - 1.0).abs() < 0.15);
    }
}
