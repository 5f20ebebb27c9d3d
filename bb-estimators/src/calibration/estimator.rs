//! A calibration as an estimator to declare in `robot!`.

use super::Linear;
use bb_core::payload::{Imu, Marg};
use bb_core::{Context, Estimator, Fault, Inputs, Options, Payload, Reply, Stamped};
use nalgebra::{Matrix3, Vector3};
use std::marker::PhantomData;

/// Calibrates the samples of a sensor: an [`Imu`], or a [`Marg`] with its field. Its options are the output of `bb
/// calibrate imu`.
///
/// ```
/// # fn main() {}
/// use bb_core::prelude::*;
/// use bb_estimators::{Calibrated, Mekf};
///
/// robot! {
///     robot Stick;
///
///     link body {
///         sensor imu: External<Marg>() {
///             estimator calibrated: Calibrated<Marg>(
///                 gyroscope_offset = [3.4e-3, 2.0e-3, -3.9e-3],
///                 accelerometer_offset = [0.11, -0.03, 0.2],
///                 accelerometer_matrix = [[1.002, 0.001, 0.0], [0.0, 0.998, 0.002], [0.0, 0.0, 1.001]],
///             );
///         }
///         estimator attitude: Mekf<Marg>() { input calibrated: sensor::body::imu::calibrated; }
///     }
/// }
/// ```
#[derive(Debug)]
pub struct Calibrated<I = Imu> {
    options: CalibratedOptions,
    types: PhantomData<fn() -> I>,
}

/// Options of [`Calibrated`]: the true vector is `matrix (measured - offset)`. Without options nothing is changed.
#[derive(Clone, Copy, Debug, PartialEq, Options)]
pub struct CalibratedOptions {
    /// Reading of the gyroscope at rest, rad/s.
    #[option(default = [0.0; 3])]
    pub gyroscope_offset: [f64; 3],
    /// Reading of the accelerometer in free fall, m/s².
    #[option(default = [0.0; 3])]
    pub accelerometer_offset: [f64; 3],
    /// Scale and misalignment of the accelerometer, row by row.
    #[option(default = IDENTITY)]
    pub accelerometer_matrix: [[f64; 3]; 3],
    /// Hard iron, T.
    #[option(default = [0.0; 3])]
    pub magnetometer_offset: [f64; 3],
    /// Soft iron and scale, row by row.
    #[option(default = IDENTITY)]
    pub magnetometer_matrix: [[f64; 3]; 3],
}

const IDENTITY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// The input of [`Calibrated`].
pub trait Calibrate: Payload + Clone {
    /// The sample with its errors removed.
    fn calibrated(&self, options: &CalibratedOptions) -> Self;
}

fn linear(offset: &[f64; 3], rows: &[[f64; 3]; 3]) -> Linear {
    Linear { offset: Vector3::from(*offset), matrix: Matrix3::from_fn(|row, column| rows[row][column]) }
}

impl Calibrate for Imu {
    fn calibrated(&self, options: &CalibratedOptions) -> Self {
        let accelerometer = linear(&options.accelerometer_offset, &options.accelerometer_matrix);
        Self {
            angular_velocity: self.angular_velocity - Vector3::from(options.gyroscope_offset),
            linear_acceleration: accelerometer.apply(&self.linear_acceleration),
            ..*self
        }
    }
}

impl Calibrate for Marg {
    fn calibrated(&self, options: &CalibratedOptions) -> Self {
        let magnetometer = linear(&options.magnetometer_offset, &options.magnetometer_matrix);
        let mut magnetic_field = self.magnetic_field;
        if let Some(field) = &mut magnetic_field {
            field.magnetic_field = magnetometer.apply(&field.magnetic_field);
        }
        Self { imu: self.imu.calibrated(options), magnetic_field }
    }
}

impl<I> Estimator for Calibrated<I>
where
    I: Calibrate + for<'a> Inputs<View<'a> = &'a Stamped<I>>,
{
    type Options = CalibratedOptions;
    type Input = I;
    type Output = I;

    fn init(options: CalibratedOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self { options, types: PhantomData })
    }

    fn handle_input(&mut self, input: <I as Inputs>::View<'_>) -> Result<Reply<I>, Fault> {
        Ok(Reply::emit(input.calibrated(&self.options)))
    }
}
