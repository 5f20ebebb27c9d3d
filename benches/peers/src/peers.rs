//! The peers: each takes the samples as its own documentation has it, and gives `world_from_body` in its own world, so that no
//! conversion is counted as its work.

use ahrs::Ahrs;
use bb_eval::{Refused, Running};
use bb_estimators::attitude::ImuSample;
use bb_estimators::attitude::initial::initial_orientation;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use nalgebra_of_ahrs as na;
use std::f64::consts::FRAC_1_SQRT_2;

/// Fixed period of the peers: that of BROAD, s.
const PERIOD_S: f64 = 3.5e-3;

const STANDARD_GRAVITY: f64 = 9.80665;

/// A peer that runs, and its world.
pub struct Beside {
    pub running: Box<dyn Running>,
    pub enu_from_world: UnitQuaternion<f64>,
}

/// A peer, made with the first sample.
struct Peer<F> {
    make: fn(&ImuSample, [f64; 3]) -> F,
    parameters: [f64; 3],
    step: fn(&mut F, &ImuSample) -> UnitQuaternion<f64>,
    filter: Option<F>,
}

impl<F> Running for Peer<F> {
    fn run(&mut self, samples: &[ImuSample], estimates: &mut Vec<Option<UnitQuaternion<f64>>>) -> Refused {
        let Some(first) = samples.first() else { return Refused::default() };
        let filter = self.filter.get_or_insert_with(|| (self.make)(first, self.parameters));
        for sample in samples {
            estimates.push(Some((self.step)(filter, sample)));
        }
        Refused::default()
    }
}

pub fn madgwick(beta: f64) -> Beside {
    in_nwu(Peer {
        make: |first, [beta, ..]| ahrs::Madgwick::new_with_quat(PERIOD_S, beta, nwu_start(first)),
        parameters: [beta, 0.0, 0.0],
        step: step_of_ahrs,
        filter: None,
    })
}

pub fn mahony(kp: f64, ki: f64) -> Beside {
    in_nwu(Peer {
        make: |first, [kp, ki, _]| ahrs::Mahony::new_with_quat(PERIOD_S, kp, ki, nwu_start(first)),
        parameters: [kp, ki, 0.0],
        step: step_of_ahrs,
        filter: None,
    })
}

pub fn vqf() -> Beside {
    in_enu(Peer {
        make: |_, _| vqf_rs::VQF::new(PERIOD_S, None, None, None),
        parameters: [0.0; 3],
        step: |vqf, sample| {
            let field = sample.magnetic_field;
            vqf.update(sample.angular_velocity.into(), sample.specific_force.into(), field.map(Into::into));
            let vqf_rs::Quaternion(w, x, y, z) = if field.is_some() { vqf.quat_9d() } else { vqf.quat_6d() };
            UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z))
        },
        filter: None,
    })
}

/// The settings of the example in the library's documentation.
pub fn fusion_published() -> Beside {
    fusion([0.5, 10.0, 10.0])
}

/// The best settings of a search on BROAD itself: gain 0.02 to 0.5, rejection of acceleration 0 to 40°, of the field 0 to
/// 20°.
pub fn fusion_best() -> Beside {
    fusion([0.1, 40.0, 20.0])
}

/// Makes the peer with the correction of the gyroscope's bias that comes with it; gain, and rejection of acceleration
/// and field in degrees.
fn fusion(parameters: [f64; 3]) -> Beside {
    in_enu(Peer {
        make: |_, [gain, acceleration, magnetic]| {
            let sample_rate = (1.0 / PERIOD_S) as f32;
            let bias = fusion_ahrs::BiasSettings { sample_rate, ..fusion_ahrs::BiasSettings::default() };
            let ahrs = fusion_ahrs::Ahrs::with_settings(fusion_ahrs::AhrsSettings {
                sample_rate,
                convention: fusion_ahrs::Convention::Enu,
                gain: gain as f32,
                gyroscope_range: 2000.0,
                acceleration_rejection: acceleration as f32,
                magnetic_rejection: magnetic as f32,
                rejection_timeout: 5.0,
            });
            (fusion_ahrs::Bias::with_settings(bias), ahrs)
        },
        parameters,
        step: |(bias, ahrs), sample| {
            let single = |vector: Vector3<f64>| -> [f32; 3] { vector.map(|component| component as f32).into() };
            let gyroscope = bias.update(single(sample.angular_velocity.map(f64::to_degrees)));
            let accelerometer = single(sample.specific_force / STANDARD_GRAVITY);
            match sample.magnetic_field {
                Some(field) => ahrs.update(gyroscope, accelerometer, single(field * 1e6)),
                None => ahrs.update_no_magnetometer(gyroscope, accelerometer),
            }
            let q = ahrs.quaternion();
            let [w, x, y, z] = [q.w, q.x, q.y, q.z].map(f64::from);
            UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z))
        },
        filter: None,
    })
}

fn in_enu(peer: impl Running + 'static) -> Beside {
    Beside { running: Box::new(peer), enu_from_world: UnitQuaternion::identity() }
}

/// The world of `ahrs`, whose x points north.
fn in_nwu(peer: impl Running + 'static) -> Beside {
    Beside { running: Box::new(peer), enu_from_world: enu_from_nwu() }
}

fn step_of_ahrs<F: Ahrs<f64>>(filter: &mut F, sample: &ImuSample) -> UnitQuaternion<f64> {
    let vector = |vector: Vector3<f64>| na::Vector3::new(vector.x, vector.y, vector.z);
    let (gyroscope, accelerometer) = (vector(sample.angular_velocity), vector(sample.specific_force));
    let updated = match sample.magnetic_field {
        Some(field) => filter.update(&gyroscope, &accelerometer, &vector(field)),
        None => filter.update_imu(&gyroscope, &accelerometer),
    };
    // No sample of the recordings has a norm of zero.
    updated.map_or_else(|_| UnitQuaternion::identity(), |q| quaternion(q.w, q.i, q.j, q.k))
}

/// The orientation that the first sample shows, in the world of `ahrs`, whose x points north.
fn nwu_start(first: &ImuSample) -> na::UnitQuaternion<f64> {
    let start = initial_orientation(&first.specific_force, first.magnetic_field.as_ref()).unwrap_or_default();
    let start = enu_from_nwu().inverse() * start;
    na::UnitQuaternion::new_unchecked(na::Quaternion::new(start.w, start.i, start.j, start.k))
}

/// A quarter turn about the vertical.
fn enu_from_nwu() -> UnitQuaternion<f64> {
    quaternion(FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2)
}

fn quaternion(w: f64, x: f64, y: f64, z: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z))
}
