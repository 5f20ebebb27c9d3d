//! The input samples of the laws.

use nalgebra::{Quaternion, Unit, UnitQuaternion, Vector3};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use super::{FIELD, UP};
use crate::attitude::initial::initial_orientation;
use crate::attitude::{ImuSample, Real};

/// Number and choice of the cases that a law is checked with.
///
/// In double precision they differ each time. In single precision they are always the same: a filter with a threshold
/// may decide differently within rounding of it, which happens in about one case in 100,000. `PROPTEST_RNG_SEED`
/// chooses others, `PROPTEST_CASES` more.
pub(in crate::attitude) fn cases<T: Real>() -> ProptestConfig {
    let config = ProptestConfig::with_cases(64);
    match config.rng_seed {
        RngSeed::Random if T::EPSILON.as_f64() > f64::EPSILON => {
            ProptestConfig { rng_seed: RngSeed::Fixed(1), ..config }
        }
        _ => config,
    }
}

/// A sample at rest in the orientation `truth`.
pub(in crate::attitude) fn at_rest(time_ns: i64, truth: &UnitQuaternion<f64>) -> ImuSample {
    let body_from_world = truth.inverse();
    ImuSample {
        time_ns,
        angular_velocity: Vector3::zeros(),
        specific_force: body_from_world * UP,
        magnetic_field: Some(body_from_world * FIELD),
    }
}

/// Any orientation.
pub(in crate::attitude) fn orientation() -> impl Strategy<Value = UnitQuaternion<f64>> {
    (-1.0..1.0, -1.0..1.0, -1.0..1.0, -1.0..1.0_f64)
        .prop_map(|(w, x, y, z)| Quaternion::new(w, x, y, z))
        .prop_filter("a quaternion with a direction", |q| q.norm() > 0.1)
        .prop_map(Unit::new_normalize)
}

fn vector(size: f64) -> impl Strategy<Value = Vector3<f64>> {
    (-size..size, -size..size, -size..size).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

/// Possible samples of a sensor that is thrown about, some without a field. The first has a field that gives a
/// heading: without it, a filter has to choose its start, and that depends on how the sensor is mounted.
pub(in crate::attitude) fn samples() -> impl Strategy<Value = Vec<ImuSample>> {
    let force = prop_oneof![20 => vector(30.0), 1 => Just(Vector3::zeros())];
    let field = prop_oneof![2 => vector(60e-6).prop_map(Some), 1 => Just(None)];
    let dt_ns = prop_oneof![20 => 1_000_000..20_000_000_i64, 1 => Just(2_000_000_000)];
    let one = (dt_ns, vector(20.0), force, field);
    let samples = (vector(60e-6), proptest::collection::vec(one, 2..100)).prop_map(|(first_field, parts)| {
        let mut time_ns = 0;
        let mut samples: Vec<_> = parts
            .into_iter()
            .map(|(dt_ns, angular_velocity, specific_force, magnetic_field)| {
                time_ns += dt_ns;
                ImuSample { time_ns, angular_velocity, specific_force, magnetic_field }
            })
            .collect();
        samples[0].magnetic_field = Some(first_field);
        samples[0].specific_force += UP;
        samples
    });
    samples.prop_filter("a first sample that shows an orientation", |samples| {
        initial_orientation(&samples[0].specific_force, samples[0].magnetic_field.as_ref()).is_ok()
    })
}

/// Samples that no sensor gives: any numbers, at any time.
pub(in crate::attitude) fn wild_samples() -> impl Strategy<Value = Vec<ImuSample>> {
    let number = || prop_oneof![4 => -100.0..100.0, 1 => any::<f64>(), 1 => Just(0.0), 1 => Just(1e300)];
    let tame = || prop_oneof![vector(1e3), vector(1e-160), Just(Vector3::zeros())];
    let any_vector = move || prop_oneof![1 => (number(), number(), number()).prop_map(|(x, y, z)| Vector3::new(x, y, z)), 2 => tame()];
    let time_ns = prop_oneof![3 => 0..2_000_000_000_i64, 1 => any::<i64>()];
    let one = (time_ns, any_vector(), any_vector(), proptest::option::of(any_vector()));
    proptest::collection::vec(one, 2..100).prop_map(|parts| {
        let mut samples: Vec<_> = parts
            .into_iter()
            .map(|(time_ns, angular_velocity, specific_force, magnetic_field)| ImuSample {
                time_ns,
                angular_velocity,
                specific_force,
                magnetic_field,
            })
            .collect();
        // Mostly in order, so that most are accepted.
        let half = samples.len() / 2;
        samples[half..].sort_by_key(|sample| sample.time_ns);
        samples
    })
}
