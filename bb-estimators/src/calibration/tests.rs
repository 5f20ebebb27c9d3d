//! Calibrations of simulated sensors, whose errors are known.

use bb_tests::laws;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal, Uniform};

use super::*;
use crate::attitude::ImuSample;

const GRAVITY: f64 = 9.81;

struct Random(ChaCha8Rng);

impl Random {
    fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    fn vector(&mut self, deviation: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.normal()) * deviation
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        Uniform::new(low, high).expect("an interval").sample(&mut self.0)
    }

    fn direction(&mut self) -> Vector3<f64> {
        self.vector(1.0).normalize()
    }

    /// A sensor's errors: offset, and a matrix near 1 with these elements.
    fn sensor(&mut self, offset: f64, symmetric: bool) -> Linear {
        let mut matrix = Matrix3::identity() + Matrix3::from_fn(|_, _| self.between(-0.05, 0.05)).upper_triangle();
        if symmetric {
            matrix.fill_lower_triangle_with_upper_triangle();
        }
        Linear { offset: Vector3::from_fn(|_, _| self.between(-offset, offset)), matrix }
    }
}

/// The reading of a sensor with these errors.
fn reading(sensor: &Linear, truth: &Vector3<f64>) -> Vector3<f64> {
    sensor.matrix.try_inverse().expect("near 1") * truth + sensor.offset
}

fn rest(force: Vector3<f64>, force_deviation: f64, samples: u64) -> Rest {
    let (rate, rate_deviation) = (Vector3::zeros(), 0.0);
    Rest { start_ns: 0, end_ns: 0, samples, force, rate, force_deviation, rate_deviation }
}

/// Squared errors over the variances reported by the fit, for elements that have one.
fn squared_errors(fit: &Linear, truth: &Linear, offset: &Vector3<f64>, matrix: &Matrix3<f64>) -> Vec<f64> {
    let offsets = (0..3).map(|axis| (fit.offset[axis] - truth.offset[axis]) / offset[axis]);
    let elements = (0..3).flat_map(|row| (row..3).map(move |column| (row, column)));
    let elements = elements.map(|at| (fit.matrix[at] - truth.matrix[at]) / matrix[at]);
    offsets.chain(elements).map(|error| error * error).collect()
}

#[test]
fn accelerometer_fit_reports_its_deviations() {
    const SAMPLES: u64 = 200;
    const NOISE: f64 = 0.05;
    let mut squares = Vec::new();
    for seed in 0..100 {
        let mut random = Random::new(seed);
        let sensor = random.sensor(0.5, false);
        let rests: Vec<_> = (0..60)
            .map(|_| {
                let truth = random.direction() * GRAVITY;
                // The mean of the noise, and a bias that wanders by 0.2 mg.
                let noise = random.vector((NOISE * NOISE / SAMPLES as f64 + 2e-3 * 2e-3).sqrt());
                rest(reading(&sensor, &truth) + noise, NOISE, SAMPLES)
            })
            .collect();
        let fit = accelerometer(&rests, GRAVITY).expect("sixty directions");
        assert_eq!(fit.model, Model::ScaleAndMisalignment);
        // 4.1 mm/s² of noise, of which the fit takes nine of sixty degrees of freedom; four deviations either way.
        assert!((0.0022..0.0053).contains(&fit.residual) && fit.residual_before > 0.1, "{fit:?}");
        squares.extend(squared_errors(&fit.calibration, &sensor, &fit.offset_deviation, &fit.matrix_deviation));
    }
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    let worst = squares.iter().copied().fold(0.0, f64::max).sqrt();
    // 900 errors of one deviation: their mean square is 1 ± 0.05, minus the increase of a bad fit's deviations.
    assert!((0.8..1.15).contains(&mean), "mean square {mean}");
    assert!(worst < 4.5, "worst {worst}");
}

#[test]
fn six_poses_give_offset_and_scale() {
    let sensor = Linear {
        offset: Vector3::new(0.2, -0.3, 0.1),
        matrix: Matrix3::from_diagonal(&Vector3::new(1.02, 0.97, 1.01)),
    };
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let poses = axes.iter().flat_map(|axis| [*axis, -*axis]);
    let rests: Vec<_> = poses.map(|up| rest(reading(&sensor, &(up * GRAVITY)), 0.0, 100)).collect();
    let fit = accelerometer(&rests, GRAVITY).expect("six directions");
    assert_eq!((fit.model, fit.directions), (Model::Scale, 6));
    assert!((fit.calibration.offset - sensor.offset).norm() < 1e-9, "{fit:?}");
    assert!((fit.calibration.matrix - sensor.matrix).norm() < 1e-9, "{fit:?}");
    // Two opposite readings determine an offset to 1/√2 of one.
    assert!((fit.offset_deviation - Vector3::repeat(2e-3 / 2_f64.sqrt())).norm() < 1e-4, "{fit:?}");

    // In g instead of m/s²: the matrix has the unit.
    let in_g: Vec<_> = rests.iter().map(|one| rest(one.force / GRAVITY, 0.0, 100)).collect();
    let fit = accelerometer(&in_g, GRAVITY).expect("six directions");
    assert!((fit.calibration.matrix - sensor.matrix * GRAVITY).norm() < 1e-7, "{fit:?}");
}

#[test]
fn too_few_directions_are_counted_and_named() {
    let up = rest(Vector3::new(0.0, 0.0, 9.8), 0.01, 100);
    let error = accelerometer(&[up; 20], GRAVITY).expect_err("one direction");
    assert_eq!(
        error.to_string(),
        "there are 1 directions in which it rested, and it takes 6: turn the sensor to more directions"
    );
    // Seven directions, of which six are on a cone of 25° and one is its axis.
    let lean = |i: i32| {
        let about = f64::from(i) * core::f64::consts::FRAC_PI_3;
        let angle = if i == 6 { 0.0 } else { 0.44 };
        UnitQuaternion::from_scaled_axis(Vector3::new(about.cos(), about.sin(), 0.0) * angle) * up.force
    };
    let cone: Vec<_> = (0..7).map(|i| rest(lean(i), 0.01, 100)).collect();
    let error = accelerometer(&cone, GRAVITY).expect_err("a cone");
    assert!(matches!(error, CalibrationError::NotObservable { .. }), "{error}");
    assert!(error.to_string().contains("directions that are further apart"), "{error}");
    assert_eq!(gyroscope(&[]), Err(CalibrationError::TooFew { what: "rests", found: 0, needed: 1 }));
    let broken = rest(Vector3::repeat(f64::NAN), 0.01, 100);
    assert_eq!(accelerometer(&[broken; 9], GRAVITY), Err(CalibrationError::NonFinite));
    assert_eq!(accelerometer(&[up; 9], f64::NAN), Err(CalibrationError::NonFinite));
}

#[test]
fn gyroscope_offset_is_the_mean_over_all_rests() {
    let mut random = Random::new(1);
    let truth = Vector3::new(0.01, -0.02, 0.005);
    let mut squares = Vec::new();
    for _ in 0..100 {
        let rests: Vec<_> = (0..10)
            .map(|_| {
                let mut one = rest(Vector3::z() * GRAVITY, 0.0, 400);
                one.rate = truth + random.vector(0.002 / 20.0);
                one.rate_deviation = 0.002;
                one
            })
            .collect();
        let fit = gyroscope(&rests).expect("ten rests");
        let errors = (fit.offset - truth).component_div(&fit.deviation);
        squares.push(errors.norm_squared() / 3.0);
    }
    // The deviation is the greater of two estimates, and so a little too large.
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    assert!((0.6..1.1).contains(&mean), "{mean}");
}

#[test]
fn magnetometer_fit_reports_its_deviations() {
    const NORM: f64 = 48e-6;
    // The noise for which the deviations hold: 0.5 %, ten measurements alike.
    let noise = 0.005 * 10_f64.sqrt() * NORM;
    let mut squares = Vec::new();
    for seed in 0..60 {
        let mut random = Random::new(seed);
        let mut sensor = random.sensor(60e-6, true);
        sensor.matrix /= sensor.matrix.determinant().cbrt();
        let fields: Vec<_> =
            (0..1000).map(|_| reading(&sensor, &(random.direction() * NORM + random.vector(noise)))).collect();
        let fit = magnetometer(&fields, Some(NORM)).expect("all directions");
        assert!((fit.residual / noise - 1.0).abs() < 0.1 && fit.residual_before > 3.0 * fit.residual, "{fit:?}");
        squares.extend(squared_errors(&fit.calibration, &sensor, &fit.offset_deviation, &fit.matrix_deviation));
    }
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    assert!((0.8..1.2).contains(&mean), "mean square {mean}");
}

laws! {
    #[test]
    fn iron_is_exact_without_noise_in_any_unit(seed in any::<u64>(), exponent in -9..6) {
        let mut random = Random::new(seed);
        let unit = 10_f64.powi(exponent);
        let mut sensor = random.sensor(3.0 * unit, true);
        sensor.matrix /= sensor.matrix.determinant().cbrt();
        let fields: Vec<_> = (0..200).map(|_| reading(&sensor, &(random.direction() * unit))).collect();
        let fit = magnetometer(&fields, None).expect("all directions");
        prop_assert!((fit.norm / unit - 1.0).abs() < 1e-9);
        prop_assert!((fit.calibration.offset - sensor.offset).norm() < 1e-8 * unit);
        prop_assert!((fit.calibration.matrix - sensor.matrix).norm() < 1e-8);
        for field in &fields {
            prop_assert!((fit.calibration.apply(field).norm() / unit - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn any_fields_give_a_calibration_or_an_error(numbers in proptest::collection::vec(proptest::num::f64::ANY, 300..330)) {
        let fields: Vec<_> = numbers.chunks_exact(3).map(Vector3::from_column_slice).collect();
        if let Ok(fit) = magnetometer(&fields, None) {
            prop_assert!(fit.calibration.matrix.iter().chain(fit.calibration.offset.iter()).all(|value| value.is_finite()));
        }
        let rests: Vec<_> = fields.iter().map(|force| rest(*force, 0.01, 100)).collect();
        let _ = (accelerometer(&rests, GRAVITY), gyroscope(&rests));
    }
}

#[test]
fn a_sensor_that_turned_too_little_is_refused() {
    let mut random = Random::new(3);
    let turned = |random: &mut Random| {
        let lean = UnitQuaternion::from_scaled_axis(random.vector(0.1));
        lean * Vector3::new(20.0, 0.0, -40.0) + Vector3::new(5.0, 10.0, -10.0) + random.vector(0.2)
    };
    let fields: Vec<_> = (0..500).map(|_| turned(&mut random)).collect();
    let error = magnetometer(&fields, None).expect_err("within 15°");
    assert!(matches!(error, CalibrationError::NotObservable { .. } | CalibrationError::NoEllipsoid), "{error}");
    let flat: Vec<_> = (0..500).map(|i| Vector3::new(f64::from(i).cos(), f64::from(i).sin(), 0.0)).collect();
    assert_eq!(magnetometer(&flat, None), Err(CalibrationError::NoEllipsoid));
    assert!(matches!(magnetometer(&flat[..50], None), Err(CalibrationError::TooFew { found: 50, .. })));
}

/// Rest of `seconds` in each pose, with motion of a second between, at 100 Hz.
fn poses(random: &mut Random, forces: &[Vector3<f64>], seconds: usize) -> Vec<ImuSample> {
    let mut samples = Vec::new();
    for force in forces {
        for i in 0..100 * (seconds + 1) {
            let is_moving = i >= 100 * seconds;
            let moved = if is_moving { random.vector(3.0) } else { random.vector(0.02) };
            let rate = if is_moving { random.vector(1.0) } else { random.vector(0.002) };
            samples.push(ImuSample {
                time_ns: samples.len() as i64 * 10_000_000,
                angular_velocity: Vector3::new(0.01, 0.0, -0.01) + rate,
                specific_force: force + moved,
                magnetic_field: None,
            });
        }
    }
    samples
}

fn rests_of(samples: &[ImuSample]) -> Vec<Rest> {
    let mut rests = Rests::new(RestParams::default()).expect("defaults");
    let mut found: Vec<_> = samples.iter().filter_map(|sample| rests.add(sample)).collect();
    found.extend(rests.finish());
    found
}

#[test]
fn rests_are_found_between_motions_without_their_ends() {
    let mut random = Random::new(5);
    let forces: Vec<_> = (0..8).map(|_| random.direction() * GRAVITY).collect();
    let samples = poses(&mut random, &forces, 4);
    let found = rests_of(&samples);
    assert_eq!(found.len(), 8);
    for (index, (rest, force)) in found.iter().zip(&forces).enumerate() {
        let (start, end) = (index as i64 * 5_000_000_000, index as i64 * 5_000_000_000 + 4_000_000_000);
        assert!(rest.start_ns >= start + 500_000_000 && rest.end_ns < end, "{rest:?}");
        // Four seconds, less half a second at each end and up to another where a window did not end in time.
        assert!((200..=300).contains(&rest.samples), "{rest:?}");
        assert!((rest.force - force).norm() < 5.0 * 0.02 * (3.0 / rest.samples as f64).sqrt(), "{rest:?}");
        assert!(
            (rest.force_deviation / 0.02 - 1.0).abs() < 0.15 && (rest.rate_deviation / 0.002 - 1.0).abs() < 0.15
        );
    }
    let offset = gyroscope(&found).expect("rests").offset;
    assert!((offset - Vector3::new(0.01, 0.0, -0.01)).norm() < 5.0 * 0.002 / (8.0_f64 * 200.0).sqrt());
}

#[test]
fn gaps_and_bad_samples_are_no_rest() {
    let mut random = Random::new(6);
    let mut samples = poses(&mut random, &[Vector3::z() * GRAVITY], 10);
    samples.truncate(1000);
    // A gap in the middle: two rests.
    for sample in &mut samples[500..] {
        sample.time_ns += 5_000_000_000;
    }
    samples[100].specific_force.x = f64::NAN;
    samples[200].time_ns = 0;
    let found = rests_of(&samples);
    assert_eq!(found.len(), 2, "{found:?}");
    assert!(found.iter().all(|rest| rest.force.norm().is_finite()));
    assert!(Rests::new(RestParams { window: 0.0, ..RestParams::default() }).is_err());
}
