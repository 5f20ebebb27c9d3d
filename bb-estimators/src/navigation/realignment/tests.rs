//! Exact measurements give the exact state from any attitude, noisy ones a state as uncertain as it says, and useless ones none.

use nalgebra::{Matrix3, SVector, UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::*;
use crate::navigation::eskf::{Eskf, Start};
use crate::navigation::math::rotation_vector;
use crate::navigation::noise::Noise;
use crate::navigation::state::Navigation;

const STEP_NS: i64 = 5_000_000;
const DT: f64 = 0.005;

/// One in this many samples comes with a fix.
const FIX: i64 = 40;

/// Standard deviations of fixes, m and m/s, and of the biases before the outage, m/s² and rad/s.
const FIXED: [f64; 2] = [2.0, 0.2];
const BIAS: [f64; 2] = [0.05, 0.002];

type Filter = Eskf<Navigation, NAVIGATION>;

/// How a body moves.
#[derive(Clone, Copy, Debug)]
enum Motion {
    Manoeuvring,
    /// Its specific force is the opposite of gravity.
    Hovering,
}

/// A flight after an outage: the truth, and what an estimator makes of it that knows nothing of the attitude.
struct After {
    truth: Filter,
    realignment: Realignment,
    biases: [Vector3<f64>; 2],
    motion: Motion,
    phase: f64,
    with_velocity: bool,
    lever_arm: Vector3<f64>,
    /// On every measurement; 0 or 1.
    noise: f64,
    samples: i64,
}

fn rotation_of(noise: &mut Noise) -> UnitQuaternion<f64> {
    let [w, x, y, z] = core::array::from_fn(|_| noise.next());
    UnitQuaternion::new_normalize(nalgebra::Quaternion::new(w, x, y, z))
}

impl After {
    fn new(attitude: UnitQuaternion<f64>, motion: Motion, noise: f64, random: &mut Noise) -> Self {
        let biases = BIAS.map(|deviation| random.vector(deviation * noise));
        let filter = |attitude, biases: [Vector3<f64>; 2]| {
            let mut filter = Filter::new(EskfParams::default()).unwrap();
            let [accelerometer_bias, gyroscope_bias] = biases;
            let [accelerometer_bias_deviation, gyroscope_bias_deviation] = BIAS;
            let (place, speed) = (Vector3::new(200.0, -100.0, 50.0), Vector3::new(12.0, -5.0, 1.0));
            let start = Start::at(0, (place, 1.0), (speed, 1.0), (attitude, 1.8));
            let start = Start { accelerometer_bias, gyroscope_bias, ..start };
            filter.start(&Start { accelerometer_bias_deviation, gyroscope_bias_deviation, ..start }).unwrap();
            filter
        };
        let unaware = filter(UnitQuaternion::identity(), [Vector3::zeros(); 2]);
        let realignment = Realignment::new(unaware.estimate().unwrap(), unaware.covariance(), unaware.params());
        Self {
            truth: filter(attitude, biases),
            realignment: realignment.unwrap(),
            biases,
            motion,
            phase: random.between(0.0, 6.0),
            with_velocity: true,
            lever_arm: Vector3::new(0.8, -0.3, 0.5),
            noise,
            samples: 0,
        }
    }

    /// A sample of the IMU, and perhaps a fix that is off by a distance.
    fn step(&mut self, random: &mut Noise, off: &Vector3<f64>) {
        let t = self.samples as f64 * DT + self.phase;
        self.samples += 1;
        let at = *self.truth.estimate().unwrap();
        let up = at.world_from_body.inverse() * Vector3::new(0.0, 0.0, 9.80665);
        let (turn, force) = match self.motion {
            Motion::Hovering => (Vector3::zeros(), up),
            Motion::Manoeuvring => {
                let ahead = Vector3::new(2.0 * (0.9 * t).sin(), 2.0 * (0.7 * t).cos(), (1.3 * t).sin());
                (Vector3::new(0.4 * (1.1 * t).sin(), 0.3 * (0.8 * t).cos(), 0.5 * (0.6 * t).sin()), up + ahead)
            }
        };
        let [accelerometer, gyroscope] = self.biases;
        let exact = ImuMean {
            time_ns: self.samples * STEP_NS,
            angular_velocity: turn + gyroscope,
            specific_force: force + accelerometer,
        };
        self.truth.propagate(&exact).unwrap();
        let params = EskfParams::default();
        let white = self.noise / DT.sqrt();
        self.realignment.propagate(&ImuMean {
            angular_velocity: exact.angular_velocity + random.vector(params.gyroscope_noise * white),
            specific_force: exact.specific_force + random.vector(params.accelerometer_noise * white),
            ..exact
        });
        if self.samples % FIX == 0 {
            let at = self.truth.estimate().unwrap();
            let [position, velocity] = FIXED.map(|deviation| random.vector(deviation * self.noise));
            let swing = at.angular_velocity.cross(&self.lever_arm);
            let of = |deviation: f64| Matrix3::identity() * (deviation * deviation);
            self.realignment.position(&GnssPosition {
                position: at.position + at.world_from_body * self.lever_arm + position + off,
                covariance: of(FIXED[0]),
                lever_arm: self.lever_arm,
            });
            if self.with_velocity {
                self.realignment.velocity(&GnssVelocity {
                    velocity: at.velocity + at.world_from_body * swing + velocity,
                    covariance: of(FIXED[1]),
                    lever_arm: self.lever_arm,
                });
            }
        }
    }

    /// Until the attitude is known, the measurements are of no use, or a time has passed, s.
    fn fly(&mut self, random: &mut Noise, longest_s: f64) -> Result<Option<Realigned>, Dropped> {
        while (self.samples as f64) * DT < longest_s {
            self.step(random, &Vector3::zeros());
            if self.samples % FIX == 0 {
                match self.realignment.solve() {
                    Ok(None) => {}
                    result => return result,
                }
            }
        }
        Ok(None)
    }

    /// The truth minus a result.
    fn error(&self, realigned: &Realigned) -> SVector<f64, NAVIGATION> {
        let at = self.truth.estimate().unwrap();
        let mut error = SVector::<f64, NAVIGATION>::zeros();
        let mut set = |first: usize, part: Vector3<f64>| error.fixed_rows_mut::<3>(first).copy_from(&part);
        set(POSITION, at.position - realigned.position);
        set(VELOCITY, at.velocity - realigned.velocity);
        set(ROTATION, rotation_vector(&(at.world_from_body * realigned.world_from_body.inverse())));
        set(ACCELEROMETER_BIAS, self.biases[0] - realigned.accelerometer_bias);
        set(GYROSCOPE_BIAS, self.biases[1] - realigned.gyroscope_bias);
        error
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn exact_measurements_give_the_exact_state_from_any_attitude(seed in 0..1_000_000_u64, with_velocity: bool) {
        let mut random = Noise::new(seed);
        let mut after = After::new(rotation_of(&mut random), Motion::Manoeuvring, 0.0, &mut random);
        after.with_velocity = with_velocity;
        let realigned = after.fly(&mut random, 40.0).unwrap().unwrap();
        let error = after.error(&realigned);
        prop_assert!(error.norm() < 1e-5, "{error}");
        prop_assert!(realigned.covariance.fixed_view::<3, 3>(ROTATION, ROTATION).trace() < KNOWN * KNOWN);
    }
}

/// The squared error of `D` states, normalised by their covariance.
fn normalised<const D: usize>(error: &SVector<f64, NAVIGATION>, realigned: &Realigned, first: usize) -> f64 {
    let error = SVector::<f64, D>::from_fn(|i, _| error[first + i]);
    let covariance = SMatrix::<f64, D, D>::from_fn(|i, j| realigned.covariance[(first + i, first + j)]);
    error.dot(&Cholesky::new(covariance).unwrap().solve(&error))
}

/// Over 400 flights, the squared errors are what the covariance says: of all states, of the motion and of the attitude. With positions alone
/// it takes four times as long, and the second order of what remains of the attitude shows in relation to the biases.
#[test]
fn noisy_measurements_give_a_state_as_uncertain_as_it_says() {
    for (with_velocity, bounds) in
        [(true, [13.9..15.9, 8.2..9.6, 2.5..3.4]), (false, [13.9..20.0, 8.2..9.9, 2.5..3.5])]
    {
        let (mut sums, mut worst) = ([0.0; 3], 0.0_f64);
        for seed in 0..400 {
            let mut random = Noise::new(seed);
            let mut after = After::new(rotation_of(&mut random), Motion::Manoeuvring, 1.0, &mut random);
            after.with_velocity = with_velocity;
            let realigned = after.fly(&mut random, 40.0).unwrap().unwrap();
            let error = after.error(&realigned);
            let squares = [
                normalised::<NAVIGATION>(&error, &realigned, POSITION),
                normalised::<ACCELEROMETER_BIAS>(&error, &realigned, POSITION),
                normalised::<3>(&error, &realigned, ROTATION),
            ];
            (0..3).for_each(|i| sums[i] += squares[i] / 400.0);
            worst = worst.max(squares[2]);
        }
        let is_within = bounds.iter().zip(&sums).all(|(bounds, sum)| bounds.contains(sum));
        // Three squares exceed 25 in one of 160 sets of 400.
        assert!(is_within && worst < 25.0, "{with_velocity}: {sums:?}, {worst}");
    }
}

/// Noise of fixes is no motion: without a horizontal acceleration, the heading is not known however many there are.
#[test]
fn without_acceleration_the_heading_remains_unknown() {
    for seed in 0..8 {
        let mut random = Noise::new(seed);
        let mut after = After::new(rotation_of(&mut random), Motion::Hovering, 1.0, &mut random);
        assert_eq!(after.fly(&mut random, 60.0), Err(Dropped::TooLong), "{seed}");
    }
}

/// One of them is off by 60 m: it is noticed before the attitude is believed, or the attitude is right in spite of it.
#[test]
fn an_outlier_is_noticed() {
    let mut noticed = 0;
    for seed in 0..50 {
        let mut random = Noise::new(seed);
        let mut after = After::new(rotation_of(&mut random), Motion::Manoeuvring, 1.0, &mut random);
        let off = rotation_of(&mut random) * Vector3::new(60.0, 0.0, 0.0);
        let outlier = 1 + i64::try_from(seed % 8).unwrap();
        let result = loop {
            let is_it = after.samples + 1 == outlier * FIX;
            after.step(&mut random, &if is_it { off } else { Vector3::zeros() });
            if after.samples % FIX == 0 {
                match after.realignment.solve() {
                    Ok(None) => {}
                    result => break result,
                }
            }
        };
        match result {
            Ok(realigned) => {
                let error = after.error(&realigned.unwrap());
                assert!(error.fixed_rows::<3>(ROTATION).norm() < 0.6, "{seed}: {error}");
            }
            Err(dropped) => {
                assert_eq!(dropped, Dropped::Misfit);
                noticed += 1;
            }
        }
    }
    assert!(noticed >= 45, "{noticed}");
}

#[test]
fn what_determines_nothing_gives_nothing() {
    let mut random = Noise::new(1);
    let mut after = After::new(rotation_of(&mut random), Motion::Manoeuvring, 1.0, &mut random);
    assert_eq!(after.realignment.solve(), Ok(None), "no measurement");
    let fix = GnssPosition::new(Vector3::new(200.0, -100.0, 50.0), 2.0, 2.0);
    (0..20).for_each(|_| after.realignment.position(&fix));
    assert_eq!(after.realignment.solve(), Ok(None), "all at one time");
    let before = after.realignment.components;
    for variance in [f64::NAN, f64::INFINITY] {
        after.realignment.position(&GnssPosition { covariance: Matrix3::identity() * variance, ..fix });
    }
    assert_eq!(after.realignment.components, before, "without a variance");
}

#[test]
fn the_limit_is_that_of_four_deviations() {
    for freedom in [3, 10, 30, 100, 300] {
        let exceedance = crate::navigation::chi_square::exceedance(freedom, limit(freedom as f64));
        assert!((1.5e-5..6e-5).contains(&exceedance), "{freedom}: {exceedance}, and 3.2e-5 exactly");
    }
}
