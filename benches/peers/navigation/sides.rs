//! The filters, each as its own documentation uses it, with the same noise.

use crate::readings::{GRAVITY, PERIOD_NS, POSITION_NOISE, Reading};
use bb_estimators::navigation::{
    EskfFilter, EskfParams, GnssPosition, Height, ImuMean, Navigation, Refusal, Start, Stream,
};
use multicalc::estimation::{CovarianceUpdate, ErrorStateKalmanFilter, ImuNoise, NominalState, NominalStateFn};
use multicalc::linear_algebra::{Matrix, Vector};
use multicalc::scalar::Numeric;
use multicalc::spatial::SO3;
use nalgebra::{UnitQuaternion, Vector3};
use nalgebra_of_eskf as na;
use std::error::Error;
use std::time::Duration;

const GYROSCOPE_NOISE: f64 = 2e-4;
const ACCELEROMETER_NOISE: f64 = 2e-3;
const GYROSCOPE_BIAS_WALK: f64 = 2e-5;
const ACCELEROMETER_BIAS_WALK: f64 = 3e-3;
const POSITION_VARIANCE: f64 = POSITION_NOISE * POSITION_NOISE;

/// Standard deviation of the position at the start, m; the others likewise.
const POSITION_DEVIATION: f64 = 1.0;
const VELOCITY_DEVIATION: f64 = 0.1;
const ROTATION_DEVIATION: f64 = 0.05;
const GYROSCOPE_BIAS_DEVIATION: f64 = 0.02;
const ACCELEROMETER_BIAS_DEVIATION: f64 = 0.2;

/// A filter of an IMU.
pub trait Navigating: Sized {
    fn start() -> Result<Self, Box<dyn Error>>;

    /// Takes the sample of the IMU.
    fn predict(&mut self, reading: &Reading) -> Result<(), Box<dyn Error>>;

    /// Takes the position.
    fn position(&mut self, reading: &Reading) -> Result<(), Box<dyn Error>>;

    /// Takes the height alone.
    fn height(&mut self, reading: &Reading) -> Result<(), Box<dyn Error>>;

    /// Returns the estimated position, z up, m.
    fn at(&self) -> Vector3<f64>;
}

/// 15 states in `f64`; a gate, counts and statistics of the sensor in each update.
pub struct Ours {
    filter: EskfFilter<Navigation>,
    stream: Stream,
}

impl Navigating for Ours {
    fn start() -> Result<Self, Box<dyn Error>> {
        let mut filter = EskfFilter::<Navigation>::new(EskfParams {
            gyroscope_noise: GYROSCOPE_NOISE,
            accelerometer_noise: ACCELEROMETER_NOISE,
            gyroscope_bias_walk: GYROSCOPE_BIAS_WALK,
            accelerometer_bias_walk: ACCELEROMETER_BIAS_WALK,
            gravity: GRAVITY,
            ..EskfParams::default()
        })?;
        let (origin, level) = (Vector3::zeros(), UnitQuaternion::identity());
        let deviations = (POSITION_DEVIATION, VELOCITY_DEVIATION, ROTATION_DEVIATION);
        let start = Start::at(0, (origin, deviations.0), (origin, deviations.1), (level, deviations.2));
        filter.start(&Start {
            gyroscope_bias_deviation: GYROSCOPE_BIAS_DEVIATION,
            accelerometer_bias_deviation: ACCELEROMETER_BIAS_DEVIATION,
            ..start
        })?;
        Ok(Self { filter, stream: Stream::default() })
    }

    fn predict(&mut self, reading: &Reading) -> Result<(), Box<dyn Error>> {
        let &Reading { time_ns, angular_velocity, specific_force, .. } = reading;
        Ok(self.filter.propagate(&ImuMean { time_ns, angular_velocity, specific_force })?)
    }

    fn position(&mut self, reading: &Reading) -> Result<(), Box<dyn Error>> {
        let fix = GnssPosition::new(reading.position, POSITION_NOISE, POSITION_NOISE);
        passed(self.filter.update(&mut self.stream, &fix))
    }

    fn height(&mut self, reading: &Reading) -> Result<(), Box<dyn Error>> {
        let height = Height { height: reading.position.z, deviation: POSITION_NOISE };
        passed(self.filter.update(&mut self.stream, &height))
    }

    fn at(&self) -> Vector3<f64> {
        self.filter.estimate().map_or_else(|| Vector3::repeat(f64::NAN), |estimate| estimate.position)
    }
}

/// One in 10,000 is far out, as the gate has it.
fn passed<T>(result: Result<T, Refusal>) -> Result<(), Box<dyn Error>> {
    match result {
        Ok(_) | Err(Refusal::Gate { .. }) => Ok(()),
        Err(error) => Err(error.into()),
    }
}

/// 15 states in `f64`; Joseph's form of the update, which is its default, or the short one.
pub struct Multicalc<const NAIVE: bool>(ErrorStateKalmanFilter<3>);

struct Position;

impl NominalStateFn<3> for Position {
    fn eval<S: Numeric>(&self, state: &NominalState<S>) -> [S; 3] {
        *state.position().as_array()
    }
}

struct HeightOfBody;

impl NominalStateFn<1> for HeightOfBody {
    fn eval<S: Numeric>(&self, state: &NominalState<S>) -> [S; 1] {
        [state.position()[2]]
    }
}

impl<const NAIVE: bool> Navigating for Multicalc<NAIVE> {
    fn start() -> Result<Self, Box<dyn Error>> {
        let deviations = [
            POSITION_DEVIATION,
            VELOCITY_DEVIATION,
            ROTATION_DEVIATION,
            GYROSCOPE_BIAS_DEVIATION,
            ACCELEROMETER_BIAS_DEVIATION,
        ];
        let covariance = Matrix::from_diagonal(std::array::from_fn(|i| deviations[i / 3] * deviations[i / 3]));
        // It takes a density times the period for the deviation of a step's noise.
        let per_step = (PERIOD_NS as f64 * 1e-9).sqrt().recip();
        let noise = ImuNoise {
            gyroscope_noise_density: GYROSCOPE_NOISE * per_step,
            accelerometer_noise_density: ACCELEROMETER_NOISE * per_step,
            gyroscope_bias_random_walk: GYROSCOPE_BIAS_WALK,
            accelerometer_bias_random_walk: ACCELEROMETER_BIAS_WALK,
        };
        let filter = ErrorStateKalmanFilter::new(
            NominalState::at_rest(SO3::identity()),
            covariance,
            noise,
            Matrix::from_diagonal([POSITION_VARIANCE; 3]),
        );
        let update = if NAIVE { CovarianceUpdate::Naive } else { CovarianceUpdate::Joseph };
        let gravity = Vector::new([0.0, 0.0, -GRAVITY]);
        Ok(Self(filter.with_gravity(gravity).with_covariance_update(update)))
    }

    fn predict(&mut self, reading: &Reading) -> Result<(), Box<dyn Error>> {
        let [angular_velocity, specific_force] =
            [reading.angular_velocity, reading.specific_force].map(|vector| Vector::new(vector.into()));
        self.0.predict(angular_velocity, specific_force, PERIOD_NS as f64 * 1e-9).map_err(said)
    }

    fn position(&mut self, reading: &Reading) -> Result<(), Box<dyn Error>> {
        self.0.update(&Position, Vector::new(reading.position.into())).map_err(said)
    }

    fn height(&mut self, reading: &Reading) -> Result<(), Box<dyn Error>> {
        let residual = Vector::new([reading.position.z - self.0.nominal_state().position()[2]]);
        let noise = Matrix::from_diagonal([POSITION_VARIANCE]);
        self.0.update_other(&HeightOfBody, residual, noise).map_err(said)
    }

    fn at(&self) -> Vector3<f64> {
        let position = self.0.nominal_state().position();
        Vector3::new(position[0], position[1], position[2])
    }
}

fn said(error: impl std::fmt::Debug) -> Box<dyn Error> {
    format!("{error:?}").into()
}

/// 18 states, gravity among them, in `f32`; x north, z down.
pub struct EskfCrate(eskf::ESKF);

impl Navigating for EskfCrate {
    fn start() -> Result<Self, Box<dyn Error>> {
        // Deviations, all; of the noise per step, and of the biases' per √s.
        let per_step = (PERIOD_NS as f64 * 1e-9).sqrt().recip();
        let mut filter = eskf::Builder::new()
            .acceleration_variance((ACCELEROMETER_NOISE * per_step) as f32)
            .rotation_variance((GYROSCOPE_NOISE * per_step) as f32)
            .acceleration_bias(ACCELEROMETER_BIAS_WALK as f32)
            .rotation_bias(GYROSCOPE_BIAS_WALK as f32)
            // One for all states.
            .initial_covariance(0.01)
            .build();
        filter.gravity.z = GRAVITY as f32;
        Ok(Self(filter))
    }

    fn predict(&mut self, reading: &Reading) -> Result<(), Box<dyn Error>> {
        let [acceleration, rotation] = [reading.specific_force, reading.angular_velocity].map(z_down);
        self.0.predict(acceleration, rotation, Duration::from_nanos(PERIOD_NS.unsigned_abs()));
        Ok(())
    }

    fn position(&mut self, reading: &Reading) -> Result<(), Box<dyn Error>> {
        let variance = eskf::ESKF::variance_from_element(POSITION_VARIANCE as f32);
        self.0.observe_position(z_down(reading.position).into(), variance).map_err(said)
    }

    fn height(&mut self, reading: &Reading) -> Result<(), Box<dyn Error>> {
        self.0.observe_height(z_down(reading.position).z, POSITION_VARIANCE as f32).map_err(said)
    }

    fn at(&self) -> Vector3<f64> {
        let position = self.0.position;
        Vector3::new(position.x, -position.y, -position.z).map(f64::from)
    }
}

/// Half a turn about x.
fn z_down(vector: Vector3<f64>) -> na::Vector3<f32> {
    na::Vector3::new(vector.x as f32, -vector.y as f32, -vector.z as f32)
}
