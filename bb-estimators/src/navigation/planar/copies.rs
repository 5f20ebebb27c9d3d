//! The planar filter as one of which there are copies.

use alloc::vec::Vec;
use core::f64::consts::TAU;

use nalgebra::{Matrix2, Vector3};

use super::estimate::{HEADING, POSITION, PlanarEstimate, VELOCITY, left};
use super::filter::{LAYOUT, PlanarFilter, PlanarStart};
use super::measurement::{PlanarMeasurement, PlanarPosition};
use super::params::PlanarParams;
use crate::attitude::ParamsError;
use crate::navigation::copies::{CopiedFilter, Fix, Update, Ways, is_same};
use crate::navigation::eskf::{Doubt, ImuMean};
use crate::navigation::fused::Fused;
use crate::navigation::math::{sqrt, wrapped};
use crate::navigation::numbers::{
    TURN_DEVIATION, TURNS, UNKNOWN_HEADING, UNMOORED, UNMOORED_HEADING, UNMOORED_SPEED,
};
use crate::navigation::refusal::Refusal;
use crate::navigation::stream::{Gate, Stream};
use crate::navigation::update::Judged;
use crate::navigation::update::judged;

impl Fix for PlanarPosition {
    const AXES: f64 = 2.0;

    fn position(&self) -> Vector3<f64> {
        self.position.push(0.0)
    }

    fn variance(&self) -> f64 {
        0.5 * self.covariance.trace()
    }

    fn with_noise(&self, variance: f64) -> Self {
        Self { covariance: self.covariance + Matrix2::identity() * variance, ..*self }
    }
}

#[expect(private_interfaces, reason = "implemented here alone")]
impl<M: PlanarMeasurement<D>, const D: usize> Update<M, D> for PlanarFilter {
    fn judge(&self, measurement: &M, slack: f64) -> Result<Judged, Refusal> {
        let estimate = self.estimate.as_ref().ok_or(Refusal::NotStarted)?;
        judged(estimate, &self.covariance, slack, |at, model| measurement.linearise(at, model))
    }

    fn update_ungated(&mut self, stream: &mut Stream, measurement: &M) -> Result<Fused, Refusal> {
        self.update_at(stream, measurement, Gate::Open)
    }
}

#[expect(private_interfaces, reason = "implemented here alone")]
impl CopiedFilter for PlanarFilter {
    type Params = PlanarParams;
    type Start = PlanarStart;
    type Estimate = PlanarEstimate;

    fn new(params: PlanarParams) -> Result<Self, ParamsError> {
        Self::new(params)
    }

    /// A heading whose deviation is more than half a radian counts as unknown.
    fn starts(params: &PlanarParams, _: Ways, start: &PlanarStart) -> Result<Vec<Self>, Refusal> {
        let (turns, deviation) = match start.heading_deviation <= UNKNOWN_HEADING {
            true => (1, start.heading_deviation),
            false => (TURNS, TURN_DEVIATION),
        };
        let begun = |turn: u32| {
            let heading = start.heading + TAU * f64::from(turn) / f64::from(TURNS);
            let mut filter = Self::new(*params).map_err(|_| Refusal::OutOfRange)?;
            filter.start(&PlanarStart { heading, heading_deviation: deviation, ..*start })?;
            Ok(filter)
        };
        (0..turns).map(begun).collect()
    }

    fn estimate(&self) -> Option<&PlanarEstimate> {
        self.estimate()
    }

    fn position(&self) -> Option<Vector3<f64>> {
        self.estimate().map(|estimate| estimate.position.push(0.0))
    }

    /// Acceleration of a curve: nothing shows that of the speed before the wheels do.
    fn acceleration(&self) -> Option<Vector3<f64>> {
        let of_curve = |at: &PlanarEstimate| at.world_from_body() * left(&at.velocity) * at.yaw_rate;
        self.estimate().map(|at| of_curve(at).push(0.0))
    }

    fn turn_to(&self, other: &Self) -> f64 {
        let heading = |filter: &Self| filter.estimate().map_or(0.0, |at| at.heading);
        wrapped(heading(other) - heading(self))
    }

    fn heading_deviation(&self) -> f64 {
        sqrt(self.covariance()[(HEADING, HEADING)])
    }

    fn is_same(&self, other: &Self) -> bool {
        let (Some(from), Some(to)) = (self.estimate(), other.estimate()) else { return false };
        is_same(&from.error_to(to), self.covariance(), other.covariance())
    }

    fn longest_sample(&self) -> f64 {
        self.params().longest_sample
    }

    fn hold(&mut self, sample: &ImuMean, doubt: &Doubt) -> Result<(), Refusal> {
        let dt = self.seconds_to(sample)?;
        self.bridge(sample, dt, doubt);
        Ok(())
    }

    fn multiply_noise(&mut self, multiple: f64) {
        self.densities.gyroscope = self.params().densities().gyroscope * multiple * multiple;
    }

    fn doubt_all(&mut self, factor: f64) {
        self.covariance.multiply(factor);
        self.covariance.bound(&LAYOUT);
    }

    fn unmoor(&mut self) {
        let square = |x: f64| x * x;
        self.covariance.set_pair(POSITION, &(Matrix2::identity() * square(UNMOORED)));
        self.covariance.inflate(HEADING, square(UNMOORED_HEADING));
        (0..2).for_each(|i| self.covariance.inflate(VELOCITY + i, square(UNMOORED_SPEED)));
        self.covariance.enforce();
    }

    fn begin_again(&mut self) {
        if let Some(estimate) = &self.estimate {
            self.upkeep.started(estimate.time_ns);
        }
    }
}
