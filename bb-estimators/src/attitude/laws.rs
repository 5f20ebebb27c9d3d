//! Laws that hold for every attitude filter, whatever its method: one macro, one line for each filter.
//!
//! Known answers that all filters share are here as well; those of one filter are in its own tests.

use core::f64::consts::PI;

use nalgebra::{Quaternion, Unit, UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::{AttitudeFilter, ImuSample, MAX_GAP_S, Quantity, SampleError};

/// At rest: one g upwards, in the world.
pub(super) const UP: Vector3<f64> = Vector3::new(0.0, 0.0, 9.81);

/// The magnetic field of central Europe, in the world.
pub(super) const FIELD: Vector3<f64> = Vector3::new(0.0, 20e-6, -45e-6);

/// Writes the tests of all laws for one filter. The parameters have to pull an error of 90° to below 0.1°
/// within 200 s at 100 Hz.
macro_rules! attitude_laws {
    (nine_axes: $nine:expr, six_axes: $six:expr) => {
        mod laws {
            use super::*;
            use crate::attitude::laws;
            use proptest::prelude::*;

            proptest! {
                #![proptest_config(ProptestConfig::with_cases(64))]

                #[test]
                fn unit_norm_whatever_comes(samples in laws::wild_samples()) {
                    laws::unit_norm(&$nine, &samples)?;
                    laws::unit_norm(&$six, &samples)?;
                }

                #[test]
                fn refused_samples_change_nothing(samples in laws::wild_samples()) {
                    laws::refused_changes_nothing(&$nine, &samples)?;
                    laws::refused_changes_nothing(&$six, &samples)?;
                }

                #[test]
                fn the_sensors_mounting_does_not_matter(
                    samples in laws::samples(), start in laws::orientation(), turn in laws::orientation(),
                ) {
                    laws::mounting(&$nine, &samples, None, turn)?;
                    laws::mounting(&$nine, &samples, Some(start), turn)?;
                    laws::mounting(&$six, &samples, Some(start), turn)?;
                }

                #[test]
                fn six_axes_have_no_heading_of_their_own(
                    samples in laws::samples(), start in laws::orientation(), heading in -3.0..3.0,
                ) {
                    laws::heading_reference(&$six, &samples, start, heading)?;
                }

                #[test]
                fn the_unit_of_the_field_does_not_matter(
                    samples in laws::samples(), scale in 1e-9..1e9,
                ) {
                    laws::field_unit(&$nine, &samples, scale)?;
                }
            }

            #[test]
            fn unit_norm_for_ever() {
                laws::unit_norm_for_ever(&$nine);
                laws::unit_norm_for_ever(&$six);
            }

            #[test]
            fn tilt_converges_from_any_start() {
                laws::tilt_converges(&$nine);
                laws::tilt_converges(&$six);
            }

            #[test]
            fn heading_converges_to_magnetic_north() {
                laws::heading_converges(&$nine);
            }

            #[test]
            fn heading_is_left_alone_by_six_axes() {
                laws::heading_is_left_alone(&$six);
            }

            #[test]
            fn constant_rotation_is_tracked() {
                laws::constant_rotation(&$nine);
                laws::constant_rotation(&$six);
            }

            #[test]
            fn the_first_sample_starts_the_filter() {
                laws::first_sample(&$nine, &$six);
            }

            #[test]
            fn the_first_field_sets_the_heading() {
                laws::first_field(&$nine);
            }

            #[test]
            fn free_fall_follows_the_gyroscope_alone() {
                laws::free_fall(&$nine);
                laws::free_fall(&$six);
            }

            #[test]
            fn a_gap_is_not_integrated() {
                laws::gap(&$nine, &$six);
            }

            #[test]
            fn bad_samples_are_named() {
                laws::bad_samples(&$nine);
            }

            #[test]
            fn reset_is_as_new() {
                laws::reset(&$nine);
                laws::reset(&$six);
            }
        }
    };
}
pub(super) use attitude_laws;

/// What the laws need of a filter beside its trait.
pub(super) trait Filter: AttitudeFilter + Clone + PartialEq + core::fmt::Debug {}

impl<F: AttitudeFilter + Clone + PartialEq + core::fmt::Debug> Filter for F {}

/// A sample at rest in the orientation `truth`.
pub(super) fn at_rest(time_ns: i64, truth: &UnitQuaternion<f64>) -> ImuSample {
    let body_from_world = truth.inverse();
    ImuSample {
        time_ns,
        angular_velocity: Vector3::zeros(),
        specific_force: body_from_world * UP,
        magnetic_field: Some(body_from_world * FIELD),
    }
}

/// Any orientation.
pub(super) fn orientation() -> impl Strategy<Value = UnitQuaternion<f64>> {
    (-1.0..1.0, -1.0..1.0, -1.0..1.0, -1.0..1.0_f64)
        .prop_map(|(w, x, y, z)| Quaternion::new(w, x, y, z))
        .prop_filter("a quaternion with a direction", |q| q.norm() > 0.1)
        .prop_map(Unit::new_normalize)
}

fn vector(size: f64) -> impl Strategy<Value = Vector3<f64>> {
    (-size..size, -size..size, -size..size).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

/// Samples that a sensor could give when it is thrown about, some without a field, the first with one.
pub(super) fn samples() -> impl Strategy<Value = Vec<ImuSample>> {
    let force = prop_oneof![20 => vector(30.0), 1 => Just(Vector3::zeros())];
    let field = prop_oneof![2 => vector(60e-6).prop_map(Some), 1 => Just(None)];
    let dt_ns = prop_oneof![20 => 1_000_000..20_000_000_i64, 1 => Just(2_000_000_000)];
    let one = (dt_ns, vector(20.0), force, field);
    (vector(60e-6), proptest::collection::vec(one, 2..100)).prop_map(|(first_field, parts)| {
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
    })
}

/// Samples that no sensor gives: any number there is, at any time.
pub(super) fn wild_samples() -> impl Strategy<Value = Vec<ImuSample>> {
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
        // Mostly in order, so that most are taken.
        let half = samples.len() / 2;
        samples[half..].sort_by_key(|sample| sample.time_ns);
        samples
    })
}

fn is_unit(orientation: &UnitQuaternion<f64>) -> bool {
    (orientation.norm() - 1.0).abs() < 1e-12
}

pub(super) fn unit_norm<F: Filter>(filter: &F, samples: &[ImuSample]) -> Result<(), TestCaseError> {
    let mut filter = filter.clone();
    let mut started = false;
    for sample in samples {
        let _ = filter.update(sample);
        let orientation = filter.world_from_body();
        prop_assert!(orientation.is_some() || !started, "started filters have an orientation");
        prop_assert!(orientation.as_ref().is_none_or(is_unit), "{orientation:?} after {sample:?}");
        started = orientation.is_some();
    }
    Ok(())
}

pub(super) fn refused_changes_nothing<F: Filter>(filter: &F, samples: &[ImuSample]) -> Result<(), TestCaseError> {
    let mut filter = filter.clone();
    for sample in samples {
        let before = filter.clone();
        if filter.update(sample).is_err() {
            prop_assert_eq!(&filter, &before);
        }
    }
    Ok(())
}

/// Rotating the sensor in its housing by `turn` rotates all it measures, and the estimate the other way.
pub(super) fn mounting<F: Filter>(
    filter: &F,
    samples: &[ImuSample],
    start: Option<UnitQuaternion<f64>>,
    turn: UnitQuaternion<f64>,
) -> Result<(), TestCaseError> {
    let (mut filter, mut turned) = (filter.clone(), filter.clone());
    if let Some(start) = start {
        filter.start_at(0, start).unwrap();
        turned.start_at(0, start * turn.inverse()).unwrap();
    }
    for sample in samples {
        filter.update(sample).unwrap();
        let rotated = ImuSample {
            time_ns: sample.time_ns,
            angular_velocity: turn * sample.angular_velocity,
            specific_force: turn * sample.specific_force,
            magnetic_field: sample.magnetic_field.map(|field| turn * field),
        };
        turned.update(&rotated).unwrap();
        if let (Some(plain), Some(rotated)) = (filter.world_from_body(), turned.world_from_body()) {
            prop_assert!(rotated.angle_to(&(plain * turn.inverse())) < 1e-6);
        }
    }
    Ok(())
}

/// Rotating the world's heading reference rotates a six-axis estimate accordingly.
pub(super) fn heading_reference<F: Filter>(
    filter: &F,
    samples: &[ImuSample],
    start: UnitQuaternion<f64>,
    heading: f64,
) -> Result<(), TestCaseError> {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading);
    let (mut filter, mut turned) = (filter.clone(), filter.clone());
    filter.start_at(0, start).unwrap();
    turned.start_at(0, turn * start).unwrap();
    for sample in samples {
        filter.update(sample).unwrap();
        turned.update(sample).unwrap();
        let (plain, turned) = (filter.world_from_body().unwrap(), turned.world_from_body().unwrap());
        prop_assert!(turned.angle_to(&(turn * plain)) < 1e-6);
    }
    Ok(())
}

pub(super) fn field_unit<F: Filter>(filter: &F, samples: &[ImuSample], scale: f64) -> Result<(), TestCaseError> {
    let (mut filter, mut scaled) = (filter.clone(), filter.clone());
    for sample in samples {
        filter.update(sample).unwrap();
        let magnetic_field = sample.magnetic_field.map(|field| field * scale);
        scaled.update(&ImuSample { magnetic_field, ..*sample }).unwrap();
        if let (Some(plain), Some(scaled)) = (filter.world_from_body(), scaled.world_from_body()) {
            prop_assert!(plain.angle_to(&scaled) < 1e-6);
        }
    }
    Ok(())
}

pub(super) fn unit_norm_for_ever<F: Filter>(filter: &F) {
    let mut filter = filter.clone();
    for i in 0..200_000_i64 {
        let t = i as f64 * 1e-2;
        filter
            .update(&ImuSample {
                time_ns: i * 10_000_000,
                angular_velocity: Vector3::new(3.0 * t.sin(), -7.0 * (0.3 * t).cos(), 0.2),
                specific_force: Vector3::new((1.7 * t).sin(), t.cos(), (0.9 * t).sin()) * 9.81,
                magnetic_field: (i % 3 == 0).then(|| Vector3::new((0.2 * t).cos(), 0.3, t.sin())),
            })
            .unwrap();
        let norm = filter.world_from_body().unwrap().norm();
        assert!((norm - 1.0).abs() < 4.0 * f64::EPSILON, "norm {norm} after {i} samples");
    }
}

/// Runs a filter at rest in `truth` at 100 Hz, from `start`, and returns where it ends.
fn settle<F: Filter>(filter: &F, start: UnitQuaternion<f64>, truth: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    let mut filter = filter.clone();
    filter.start_at(0, start).unwrap();
    for i in 1..20_000 {
        filter.update(&at_rest(i * 10_000_000, truth)).unwrap();
    }
    filter.world_from_body().unwrap()
}

fn starts() -> [UnitQuaternion<f64>; 6] {
    let about = |axis, angle| UnitQuaternion::from_axis_angle(&axis, angle);
    [
        about(Vector3::x_axis(), PI),
        about(Vector3::y_axis(), PI),
        about(Vector3::x_axis(), PI - 1e-9),
        about(Vector3::y_axis(), -1.5),
        UnitQuaternion::from_euler_angles(2.0, 1.0, -2.0),
        UnitQuaternion::identity(),
    ]
}

pub(super) fn tilt_converges<F: Filter>(filter: &F) {
    for truth in [UnitQuaternion::identity(), UnitQuaternion::from_euler_angles(0.5, -0.3, 1.0)] {
        for start in starts() {
            // Rotated by the truth, so that some starts are exactly upside down.
            let end = settle(filter, truth * start, &truth);
            let error = (end * truth.inverse() * Vector3::z()).angle(&Vector3::z());
            assert!(error.to_degrees() < 0.1, "{} degrees from {start}", error.to_degrees());
        }
    }
}

pub(super) fn heading_converges<F: Filter>(filter: &F) {
    let truth = UnitQuaternion::from_euler_angles(0.5, -0.3, 1.0);
    for start in starts() {
        let error = settle(filter, start, &truth).angle_to(&truth);
        assert!(error.to_degrees() < 0.1, "{} degrees from {start}", error.to_degrees());
    }
    for heading in [-3.0, -1.0, 2.0] {
        let start = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading) * truth;
        let error = settle(filter, start, &truth).angle_to(&truth);
        assert!(error.to_degrees() < 0.1, "{} degrees from heading {heading}", error.to_degrees());
    }
}

pub(super) fn heading_is_left_alone<F: Filter>(filter: &F) {
    let tilt = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 0.5);
    let heading = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 1.0);
    let end = settle(filter, heading, &tilt);
    assert!(end.angle_to(&(heading * tilt)).to_degrees() < 0.1);
}

pub(super) fn constant_rotation<F: Filter>(filter: &F) {
    let start = UnitQuaternion::from_euler_angles(0.2, 0.4, -1.0);
    for rate in [Vector3::new(2.0, 0.0, 0.0), Vector3::new(0.0, 0.0, -5.0), Vector3::new(1.0, -2.0, 3.0)] {
        let mut filter = filter.clone();
        filter.start_at(0, start).unwrap();
        for i in 1..6_000 {
            let truth = start * UnitQuaternion::from_scaled_axis(rate * (i as f64 * 0.01));
            let sample = ImuSample { angular_velocity: rate, ..at_rest(i * 10_000_000, &truth) };
            filter.update(&sample).unwrap();
            let error = filter.world_from_body().unwrap().angle_to(&truth);
            assert!(error.to_degrees() < 0.1, "{} degrees at sample {i}", error.to_degrees());
        }
    }
}

pub(super) fn first_sample<F: Filter>(nine: &F, six: &F) {
    let truth = UnitQuaternion::from_euler_angles(2.5, -0.7, 1.0);
    let (mut nine, mut six) = (nine.clone(), six.clone());
    assert_eq!(nine.world_from_body(), None);
    let fall = ImuSample { specific_force: Vector3::zeros(), ..at_rest(0, &truth) };
    nine.update(&fall).unwrap();
    assert_eq!(nine.world_from_body(), None, "free fall does not show where up is");
    nine.update(&at_rest(10_000_000, &truth)).unwrap();
    assert!(nine.world_from_body().unwrap().angle_to(&truth) < 1e-12);
    six.update(&at_rest(0, &truth)).unwrap();
    let started = six.world_from_body().unwrap();
    assert!((started * (truth.inverse() * UP) - UP).norm() < 1e-12);
    assert!(started.k.abs() < 1e-15, "heading 0");
}

pub(super) fn first_field<F: Filter>(filter: &F) {
    let truth = UnitQuaternion::from_euler_angles(0.5, -0.7, 2.0);
    let mut filter = filter.clone();
    for i in 0..100 {
        filter.update(&ImuSample { magnetic_field: None, ..at_rest(i * 10_000_000, &truth) }).unwrap();
    }
    assert!(filter.world_from_body().unwrap().angle_to(&truth) > 1.0);
    filter.update(&at_rest(1_000_000_000, &truth)).unwrap();
    assert!(filter.world_from_body().unwrap().angle_to(&truth) < 0.01);
}

pub(super) fn free_fall<F: Filter>(filter: &F) {
    let start = UnitQuaternion::from_euler_angles(0.5, -0.7, 2.0);
    let rate = Vector3::new(1.0, -2.0, 3.0);
    let mut filter = filter.clone();
    filter.start_at(0, start).unwrap();
    for i in 1..100 {
        filter
            .update(&ImuSample {
                time_ns: i * 10_000_000,
                angular_velocity: rate,
                specific_force: Vector3::zeros(),
                magnetic_field: None,
            })
            .unwrap();
    }
    let truth = start * UnitQuaternion::from_scaled_axis(rate * 0.99);
    assert!(filter.world_from_body().unwrap().angle_to(&truth) < 1e-9);
}

pub(super) fn gap<F: Filter>(nine: &F, six: &F) {
    let after_ns = (MAX_GAP_S * 1e9) as i64 + 1;
    let before = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.8);
    let tilt = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 0.5);
    let truth = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -2.0) * tilt;
    let sample = ImuSample { angular_velocity: Vector3::new(9.0, 9.0, 9.0), ..at_rest(after_ns, &truth) };

    let mut six = six.clone();
    six.start_at(0, before).unwrap();
    six.update(&sample).unwrap();
    let orientation = six.world_from_body().unwrap();
    assert!((orientation * sample.specific_force - UP).norm() < 1e-12, "tilt is the accelerometer's");
    let turned = orientation * before.inverse();
    assert!(turned.k.abs() < 1e-12, "heading is kept");

    let mut nine = nine.clone();
    nine.start_at(0, before).unwrap();
    nine.update(&ImuSample { magnetic_field: None, ..sample }).unwrap();
    assert!(nine.world_from_body().unwrap().angle_to(&orientation) < 1e-12, "no field, the same");
    nine.update(&at_rest(after_ns + 1_000_000, &truth)).unwrap();
    assert!(nine.world_from_body().unwrap().angle_to(&truth) < 0.01, "the next field sets the heading");
    nine.update(&at_rest(i64::MAX, &before)).unwrap();
    assert!(nine.world_from_body().unwrap().angle_to(&before) < 1e-12, "a field at once sets it at once");

    let mut nine = nine.clone();
    nine.start_at(i64::MIN, before).unwrap();
    nine.update(&ImuSample { specific_force: Vector3::zeros(), magnetic_field: None, ..sample }).unwrap();
    assert!(nine.world_from_body().unwrap().angle_to(&before) < 1e-12, "nothing known, nothing changed");
}

pub(super) fn bad_samples<F: Filter>(filter: &F) {
    let mut filter = filter.clone();
    let good = at_rest(5, &UnitQuaternion::identity());
    filter.update(&good).unwrap();
    let before = filter.clone();
    let next = ImuSample { time_ns: 10_000_000, ..good };
    let nan = Vector3::new(1.0, f64::NAN, 1.0);
    let infinite = Vector3::new(0.0, 0.0, f64::NEG_INFINITY);
    let huge = Vector3::new(0.0, -1e300, 0.0);
    type Set = fn(&mut ImuSample, Vector3<f64>);
    let quantities: [(Quantity, Set); 3] = [
        (Quantity::AngularVelocity, |sample, value| sample.angular_velocity = value),
        (Quantity::SpecificForce, |sample, value| sample.specific_force = value),
        (Quantity::MagneticField, |sample, value| sample.magnetic_field = Some(value)),
    ];
    for (quantity, set) in quantities {
        for value in [nan, infinite] {
            let mut bad = next;
            set(&mut bad, value);
            assert_eq!(filter.update(&bad), Err(SampleError::NonFinite { quantity }));
        }
        let mut bad = next;
        set(&mut bad, huge);
        let result = filter.update(&bad);
        assert!(matches!(result, Err(SampleError::OutOfRange { quantity: q, value: 1e300, .. }) if q == quantity));
    }
    for time_ns in [5, 4, i64::MIN] {
        let error = SampleError::TimeNotIncreasing { previous_ns: 5, time_ns };
        assert_eq!(filter.update(&ImuSample { time_ns, ..good }), Err(error));
    }
    let broken = Unit::new_unchecked(Quaternion::new(f64::NAN, 0.0, 0.0, 0.0));
    let quantity = Quantity::Orientation;
    assert_eq!(filter.start_at(7, broken), Err(SampleError::NonFinite { quantity }));
    assert_eq!(filter, before);
    filter.update(&next).unwrap();
}

pub(super) fn reset<F: Filter>(filter: &F) {
    let mut used = filter.clone();
    for i in 0..10 {
        used.update(&at_rest(i * 10_000_000, &UnitQuaternion::from_euler_angles(1.0, 0.5, 0.2))).unwrap();
    }
    used.reset();
    assert_eq!(&used, filter);
    assert_eq!(used.params(), filter.params());
}
