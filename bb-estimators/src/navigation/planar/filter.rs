//! The filter: gyroscope samples propagate it, and measurements correct it.

use nalgebra::{Matrix2, Matrix3, SMatrix, Vector2};

use super::estimate::{GYROSCOPE_BIAS, HEADING, POSITION, PlanarEstimate, STATES, VELOCITY, WHEEL_SCALE};
use super::measurement::PlanarMeasurement;
use super::params::{Densities, PlanarParams};
use super::propagation::Transition;
use crate::attitude::{MAX_ANGULAR_VELOCITY, ParamsError};
use crate::navigation::bounds::{is_on_earth, is_within};
use crate::navigation::covariance::Covariance;
use crate::navigation::eskf::{Doubt, ImuMean, seconds_between};
use crate::navigation::fused::Fused;
use crate::navigation::layout::Layout;
use crate::navigation::math::{exp, wrapped};
use crate::navigation::numbers::{LONGEST_GAP_S, START_GYROSCOPE_BIAS};
use crate::navigation::propagate::Propagate;
use crate::navigation::refusal::Refusal;
use crate::navigation::stream::{Gate, Stream};
use crate::navigation::update::{Composed as _, updated};
use crate::navigation::upkeep::{Upkeep, upkeep_methods};
use crate::params::Params as _;

pub(super) const LAYOUT: Layout<STATES> = PlanarEstimate::LAYOUT;

/// A variance that amounts to a known state, where 0 would make the matrix singular.
const KNOWN: f64 = 1e-24;

/// The state and uncertainty that a filter starts with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarStart {
    /// Time of the start, nanoseconds since any fixed epoch.
    pub time_ns: i64,
    /// Position of the body's origin in the world, m.
    pub position: Vector2<f64>,
    /// Heading of the body's x axis, from the world's x axis counter-clockwise, rad; any number of turns.
    pub heading: f64,
    /// Velocity of the body's origin, in the body, m/s.
    pub velocity: Vector2<f64>,
    /// Bias of the gyroscope, rad/s.
    pub gyroscope_bias: f64,
    /// Covariance of the position, m².
    pub position_covariance: Matrix2<f64>,
    /// Standard deviation of the heading, rad.
    pub heading_deviation: f64,
    /// Standard deviation of a component of the velocity, m/s.
    pub velocity_deviation: f64,
    /// Standard deviation of the gyroscope's bias, rad/s.
    pub gyroscope_bias_deviation: f64,
}

impl PlanarStart {
    /// Creates a start from a pose and a body velocity with standard deviations, m, rad, m/s. The gyroscope's bias is zero, with
    /// a standard deviation of 0.02 rad/s.
    pub fn at(
        time_ns: i64,
        position: (Vector2<f64>, f64),
        heading: (f64, f64),
        velocity: (Vector2<f64>, f64),
    ) -> Self {
        Self {
            time_ns,
            position: position.0,
            heading: heading.0,
            velocity: velocity.0,
            gyroscope_bias: 0.0,
            position_covariance: Matrix2::identity() * (position.1 * position.1),
            heading_deviation: heading.1,
            velocity_deviation: velocity.1,
            gyroscope_bias_deviation: START_GYROSCOPE_BIAS,
        }
    }

    fn state(&self, params: &PlanarParams) -> Result<(PlanarEstimate, Covariance<STATES>), Refusal> {
        let square = |x: f64| (x * x).max(KNOWN);
        let mut covariance = Covariance::new();
        for i in 0..2 {
            covariance.forget(VELOCITY + i, square(self.velocity_deviation));
        }
        covariance.set_pair(POSITION, &self.position_covariance);
        covariance.forget(HEADING, square(self.heading_deviation));
        covariance.forget(GYROSCOPE_BIAS, square(self.gyroscope_bias_deviation));
        covariance.forget(WHEEL_SCALE, square(params.wheel_scale.deviation));
        let estimate = PlanarEstimate {
            time_ns: self.time_ns,
            position: self.position,
            heading: wrapped(self.heading),
            velocity: self.velocity,
            gyroscope_bias: self.gyroscope_bias,
            wheel_scale: 0.0,
            yaw_rate: 0.0,
        };
        if !estimate.is_finite() {
            return Err(Refusal::NonFinite);
        }
        if !is_on_earth(estimate.position.iter().chain(&estimate.velocity))
            || !is_within([&estimate.gyroscope_bias], MAX_ANGULAR_VELOCITY)
        {
            return Err(Refusal::OutOfRange);
        }
        if !covariance.is_positive_definite() {
            return Err(Refusal::Noise);
        }
        Ok((estimate, covariance))
    }
}

/// An extended Kalman filter on a plane; the [module](super) has an example.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarFilter {
    params: PlanarParams,
    pub(super) densities: Densities,
    pub(super) estimate: Option<PlanarEstimate>,
    pub(super) covariance: Covariance<STATES>,
    pub(super) upkeep: Upkeep,
}

impl PlanarFilter {
    /// Creates a filter that has not started.
    ///
    /// # Errors
    ///
    /// Returns the name of the first parameter outside its accepted range.
    pub fn new(params: PlanarParams) -> Result<Self, ParamsError> {
        params.check()?;
        let (densities, covariance, upkeep) = (params.densities(), Covariance::new(), Upkeep::default());
        Ok(Self { params, densities, estimate: None, covariance, upkeep })
    }

    /// The parameters that the filter was created with.
    pub fn params(&self) -> &PlanarParams {
        &self.params
    }

    /// Starts or restarts the filter.
    ///
    /// # Errors
    ///
    /// Returns [`Refusal::NonFinite`] if a value is not finite, [`Refusal::OutOfRange`] if it is absurdly large, and
    /// [`Refusal::Noise`] if a covariance is not positive definite. The filter is then unchanged.
    pub fn start(&mut self, start: &PlanarStart) -> Result<(), Refusal> {
        let (estimate, mut covariance) = start.state(&self.params)?;
        covariance.bound(&LAYOUT);
        self.upkeep.started(start.time_ns);
        self.estimate = Some(estimate);
        self.covariance = covariance;
        Ok(())
    }

    /// Propagates the filter over one sample. Uses only the z component of its angular velocity, in body axes.
    ///
    /// A sample that covers more than [`PlanarParams::longest_sample`] is a gap: its reading is assumed to have been the same all the
    /// time, but for a turn by 1 rad/s for about a second. [`Copies`](crate::navigation::Copies) know better.
    ///
    /// # Errors
    ///
    /// Returns a [`Refusal`] if the filter has not started, a value is not finite or absurdly large, time does not increase, or
    /// the gap is longer than a minute. The filter is then unchanged.
    pub fn propagate(&mut self, sample: &ImuMean) -> Result<(), Refusal> {
        Propagate::propagate(self, sample)
    }

    /// The time from the filter to the end of a sample, s.
    #[inline]
    pub(super) fn seconds_to(&self, sample: &ImuMean) -> Result<f64, Refusal> {
        let estimate = self.estimate.as_ref().ok_or(Refusal::NotStarted)?;
        sample.check()?;
        let dt = seconds_between(estimate.time_ns, sample.time_ns)?;
        if dt > LONGEST_GAP_S { Err(Refusal::Gap { seconds: dt }) } else { Ok(dt) }
    }

    /// Propagates over a part, `dt` seconds, of a gap in the samples, during which the reading is assumed to be that of `sample`, but
    /// may have been wrong by `doubt`.
    #[cold]
    pub(super) fn bridge(&mut self, sample: &ImuMean, dt: f64, doubt: &Doubt) {
        let gyroscope = self.densities.gyroscope + doubt.rotation.z / dt;
        self.advance(sample, dt, &Densities { gyroscope, ..self.densities });
        self.covariance.enforce();
        self.upkeep.bridged();
    }

    #[inline]
    fn advance(&mut self, sample: &ImuMean, dt: f64, densities: &Densities) {
        let Some(estimate) = &mut self.estimate else { return };
        estimate.time_ns = sample.time_ns;
        estimate.yaw_rate = sample.angular_velocity.z - estimate.gyroscope_bias;
        Transition::advance(estimate, dt).apply(self.covariance.rows_mut(), densities);
        let scale = self.params.wheel_scale;
        if scale.time_s != f64::INFINITY {
            let factor = exp(-dt / scale.time_s);
            estimate.wheel_scale *= factor;
            let variance = scale.deviation * scale.deviation * (1.0 - factor * factor);
            self.covariance.decay(WHEEL_SCALE, factor, variance.max(KNOWN));
        }
        self.covariance.bound(&LAYOUT);
    }

    /// Corrects the filter with a measurement taken at its current time.
    ///
    /// `stream` belongs to the sensor: its gate accepts or rejects the measurement, and it keeps the sensor's counts and
    /// statistics.
    ///
    /// # Errors
    ///
    /// Returns a [`Refusal`], which the stream has counted. The filter is then unchanged.
    pub fn update<M: PlanarMeasurement<D>, const D: usize>(
        &mut self,
        stream: &mut Stream,
        measurement: &M,
    ) -> Result<Fused, Refusal> {
        self.update_at(stream, measurement, Gate::Closed)
    }

    #[inline]
    pub(super) fn update_at<M: PlanarMeasurement<D>, const D: usize>(
        &mut self,
        stream: &mut Stream,
        measurement: &M,
        gate: Gate,
    ) -> Result<Fused, Refusal> {
        let result = self.estimate.as_mut().ok_or(Refusal::NotStarted).and_then(|estimate| {
            let linearise = |at: &PlanarEstimate, model: &mut _| measurement.linearise(at, model);
            let updated =
                updated::<PlanarEstimate, D, STATES>(estimate, &mut self.covariance, stream, gate, linearise)?;
            *estimate = updated.estimate;
            if updated.is_fix {
                self.upkeep.fixed_ns = estimate.time_ns;
            }
            Ok(updated.fused)
        });
        stream.count(&result);
        result
    }

    /// The estimate at the end of the last sample; `None` before the start.
    pub fn estimate(&self) -> Option<&PlanarEstimate> {
        self.estimate.as_ref()
    }

    /// The estimate extrapolated to `time_ns` with the last yaw rate, for an output between samples. The filter is unchanged.
    ///
    /// # Errors
    ///
    /// Returns a [`Refusal`] if the filter has not started, or if the time is before its own or more than a sample after it.
    pub fn predicted(&self, time_ns: i64) -> Result<PlanarEstimate, Refusal> {
        let mut estimate = self.estimate.ok_or(Refusal::NotStarted)?;
        if time_ns == estimate.time_ns {
            return Ok(estimate);
        }
        let dt = seconds_between(estimate.time_ns, time_ns)?;
        if dt > self.params.longest_sample {
            return Err(Refusal::Gap { seconds: dt });
        }
        Transition::advance(&mut estimate, dt);
        estimate.time_ns = time_ns;
        Ok(estimate)
    }

    /// Covariance of all errors, in the order of the [states](super). Exactly symmetric.
    pub fn covariance(&self) -> &SMatrix<f64, STATES, STATES> {
        self.covariance.matrix()
    }

    /// Covariance of the pose: position in the world, m², then heading, rad².
    pub fn pose_covariance(&self) -> Matrix3<f64> {
        self.covariance.matrix().fixed_view::<3, 3>(POSITION, POSITION).into_owned()
    }

    upkeep_methods!();
}

impl Propagate for PlanarFilter {
    fn time_ns(&self) -> Option<i64> {
        self.estimate().map(|estimate| estimate.time_ns)
    }

    fn admits(&self, sample: &ImuMean) -> Result<(), Refusal> {
        self.seconds_to(sample).map(drop)
    }

    fn propagate_until(&mut self, time_ns: i64, sample: &ImuMean, since_ns: i64) -> Result<(), Refusal> {
        let part = ImuMean { time_ns, ..*sample };
        let dt = self.seconds_to(&part)?;
        if seconds_between(since_ns, sample.time_ns)? <= self.params.longest_sample {
            self.advance(&part, dt, &{ self.densities });
        } else {
            self.bridge(&part, dt, &Doubt::unknown(dt));
        }
        Ok(())
    }
}
