//! Requirements of copies on their filter.

use crate::navigation::numbers::{
    ATTITUDE_DEVIATION, CLEARLY, MOST_STILL, MOVES, SAME_COPY, STILL_SPEED, UNKNOWABLE,
};
use crate::navigation::numbers::{TURN_DEVIATION, TURNS, UNKNOWN_HEADING};
use alloc::vec;
use alloc::vec::Vec;
use core::f64::consts::{FRAC_PI_2, PI, TAU};
use core::fmt::Debug;

use nalgebra::{Matrix3, SMatrix, SVector, UnitQuaternion, Vector3};

use super::Ways;
use super::rest::GyroscopeAtRest;
use crate::attitude::ParamsError;
use crate::navigation::eskf::{Doubt, EskfFilter, EskfParams, GaussMarkov, ImuMean, Start};
use crate::navigation::fused::Fused;
use crate::navigation::math::{rotation, rotation_vector, sqrt};
use crate::navigation::measurement::{GnssPosition, Measurement, ZeroVelocity};
use crate::navigation::propagate::Propagate;
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{Estimate, Optional, ROTATION, States, VELOCITY, offset};
use crate::navigation::stream::Stream;
use crate::navigation::update::Judged;

/// A filter of which there can be [`Copies`](super::Copies).
#[expect(private_interfaces, reason = "implemented here alone")]
pub trait CopiedFilter: Propagate + Copy + Debug {
    /// Parameters of the filter.
    type Params: Copy + Debug;
    /// The state that it starts with.
    type Start;
    /// The state that it estimates.
    type Estimate;

    /// A filter that has not started.
    fn new(params: Self::Params) -> Result<Self, ParamsError>;

    /// A filter that has started for each way of what is unknown of the start.
    fn starts(params: &Self::Params, ways: Ways, start: &Self::Start) -> Result<Vec<Self>, Refusal>;

    /// The estimate; `None` before the start.
    fn estimate(&self) -> Option<&Self::Estimate>;

    /// The position in the world, m.
    fn position(&self) -> Option<Vector3<f64>>;

    /// The acceleration in the world that the last sample shows, m/s², in a heading that may be wrong; `None` if the tilt is not known.
    fn acceleration(&self) -> Option<Vector3<f64>>;

    /// The speed, m/s, and its deviation in the least certain direction; `None` if rest tells nothing.
    fn speed(&self) -> Option<(f64, f64)> {
        None
    }

    /// Returns whether the body clearly moves, as far as the filter can tell it from rest.
    fn is_moving(&self) -> bool {
        self.speed().is_none_or(|(speed, deviation)| speed > MOVES.max(CLEARLY * deviation))
    }

    /// Stops where the velocity allows it: the body is at rest.
    fn stop(&mut self, _bias: &GyroscopeAtRest) {}

    /// The angle about the vertical to the attitude of another, rad.
    fn turn_to(&self, other: &Self) -> f64;

    /// The standard deviation of the heading, rad.
    fn heading_deviation(&self) -> f64;

    /// Returns whether another has come to the same state, and is as sure of it.
    fn is_same(&self, other: &Self) -> bool;

    /// The longest interval that a sample covers, s; a longer one is a gap.
    fn longest_sample(&self) -> f64;

    /// Propagates over a part of a gap, during which the reading is assumed to be that of `sample`, but may have been wrong by `doubt`.
    fn hold(&mut self, sample: &ImuMean, doubt: &Doubt) -> Result<(), Refusal>;

    /// Multiplies the white noise of the IMU, as a deviation.
    fn multiply_noise(&mut self, multiple: f64);

    /// Multiplies the covariance.
    fn doubt_all(&mut self, factor: f64);

    /// Forgets the position, and doubts the motion by as much as a filter in the wrong place may have been wrong.
    fn unmoor(&mut self);

    /// Makes the attitude unknown.
    fn forget_attitude(&mut self) {}

    /// Returns this filter with each of several attitudes that cover one which a gap has left unknown, with the log likelihood of each;
    /// none if it is known.
    fn forks(&self) -> Vec<(Self, f64)> {
        Vec::new()
    }

    /// Counts a new beginning.
    fn begin_again(&mut self);
}

/// A filter that a measurement `M` with `D` components corrects.
#[expect(private_interfaces, reason = "implemented here alone")]
pub trait Update<M, const D: usize>: CopiedFilter {
    /// Compares a measurement with the filter. `slack` is added to each variance of its noise.
    fn judge(&self, measurement: &M, slack: f64) -> Result<Judged, Refusal>;

    /// Corrects the filter with a measurement, whatever its gate.
    fn update_ungated(&mut self, stream: &mut Stream, measurement: &M) -> Result<Fused, Refusal>;
}

/// A position from satellites, whose noise may be larger than stated.
pub trait Fix: Copy {
    /// The number of axes that it measures.
    const AXES: f64;

    /// The position, m; zero along an axis that it does not measure.
    fn position(&self) -> Vector3<f64>;

    /// The mean variance of an axis, m².
    fn variance(&self) -> f64;

    /// The fix with this variance added to each axis, m².
    #[must_use]
    fn with_noise(&self, variance: f64) -> Self;
}

/// Returns whether two filters, an `error` apart, have come to the same state, and are as sure of it.
pub(in crate::navigation) fn is_same<const N: usize>(
    error: &SVector<f64, N>,
    own: &SMatrix<f64, N, N>,
    other: &SMatrix<f64, N, N>,
) -> bool {
    (0..N).all(|i| {
        let (own, other) = (own[(i, i)], other[(i, i)]);
        let is_known_alike = own == other || (0.25..4.0).contains(&(own / other));
        is_known_alike && error[i] * error[i] <= SAME_COPY * SAME_COPY * own
    })
}

impl Fix for GnssPosition {
    const AXES: f64 = 3.0;

    fn position(&self) -> Vector3<f64> {
        self.position
    }

    fn variance(&self) -> f64 {
        self.covariance.trace() / 3.0
    }

    fn with_noise(&self, variance: f64) -> Self {
        Self { covariance: self.covariance + Matrix3::identity() * variance, ..*self }
    }
}

#[expect(private_interfaces, reason = "implemented here alone")]
impl<S: States, M: Measurement<D>, const N: usize, const D: usize> Update<M, D> for EskfFilter<S, N> {
    fn judge(&self, measurement: &M, slack: f64) -> Result<Judged, Refusal> {
        self.judge(measurement, slack)
    }

    fn update_ungated(&mut self, stream: &mut Stream, measurement: &M) -> Result<Fused, Refusal> {
        self.update_ungated(stream, measurement)
    }
}

#[expect(private_interfaces, reason = "implemented here alone")]
impl<S: States, const N: usize> CopiedFilter for EskfFilter<S, N> {
    type Params = EskfParams;
    type Start = Start;
    type Estimate = Estimate<N>;

    fn new(params: EskfParams) -> Result<Self, ParamsError> {
        Self::new(params)
    }

    /// A heading whose deviation is more than half a radian counts as unknown, and so does such a yaw of
    /// [`EskfParams::wheel_mounting`].
    fn starts(params: &EskfParams, ways: Ways, start: &Start) -> Result<Vec<Self>, Refusal> {
        let turns = |is_unknown: bool| if is_unknown { TURNS } else { 1 };
        let angle = |i: u32| TAU * f64::from(i) / f64::from(TURNS);
        let mounting = offset::<S>(Optional::WheelMounting);
        let is_mounted = mounting.is_none() || params.wheel_mounting.deviation <= UNKNOWN_HEADING;
        let is_pointed = start.rotation_covariance[(2, 2)] <= UNKNOWN_HEADING * UNKNOWN_HEADING;
        let mut scales = vec![*params];
        if offset::<S>(Optional::RelativeScale).is_some() && ways.scale {
            scales.push(EskfParams { relative_scale: GaussMarkov::constant(0.0), ..*params });
        }
        let mut filters = Vec::new();
        for heading in 0..turns(!is_pointed) {
            let mut begun = *start;
            if !is_pointed {
                let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle(heading));
                begun.world_from_body = turn * start.world_from_body;
                let variance = TURN_DEVIATION * TURN_DEVIATION;
                begun.rotation_covariance =
                    Matrix3::from_diagonal(&start.rotation_covariance.diagonal().map(|own| own.min(variance)));
            }
            for yaw in 0..turns(!is_mounted) {
                for mut params in scales.iter().copied() {
                    if !is_mounted {
                        params.wheel_mounting.deviation = TURN_DEVIATION;
                    }
                    let mut filter = Self::new(params).map_err(|_| Refusal::OutOfRange)?;
                    filter.start(&begun)?;
                    if let Some(error) = mounting {
                        filter.set_optional(error, angle(yaw));
                    }
                    filters.push(filter);
                }
            }
        }
        Ok(filters)
    }

    fn estimate(&self) -> Option<&Estimate<N>> {
        self.estimate()
    }

    fn position(&self) -> Option<Vector3<f64>> {
        self.estimate().map(|estimate| estimate.position)
    }

    fn acceleration(&self) -> Option<Vector3<f64>> {
        let fall = Vector3::new(0.0, 0.0, self.params().gravity);
        let tilts = [ROTATION, ROTATION + 1].map(|i| self.covariance()[(i, i)]);
        let known =
            self.estimate().filter(|_| tilts.iter().all(|variance| *variance < UNKNOWN_HEADING * UNKNOWN_HEADING));
        known.map(|estimate| estimate.world_from_body * estimate.specific_force - fall)
    }

    fn speed(&self) -> Option<(f64, f64)> {
        let variances = (VELOCITY..VELOCITY + 3).map(|i| self.covariance()[(i, i)]);
        Some((self.estimate()?.velocity.norm(), sqrt(variances.fold(0.0, f64::max))))
    }

    fn stop(&mut self, bias: &GyroscopeAtRest) {
        let still = ZeroVelocity { deviation: STILL_SPEED };
        let is_likely = |judged: Result<Judged, Refusal>| judged.is_ok_and(|judged| judged.nis <= MOST_STILL);
        if is_likely(self.judge(&still, 0.0)) && is_likely(self.judge(bias, 0.0)) {
            let _ = self.update_ungated(&mut Stream::default(), &still);
            let _ = self.update_ungated(&mut Stream::default(), bias);
        }
    }

    fn turn_to(&self, other: &Self) -> f64 {
        let attitude =
            |filter: &Self| filter.estimate().map_or_else(UnitQuaternion::identity, |at| at.world_from_body);
        rotation_vector(&(attitude(other) * attitude(self).inverse())).z
    }

    fn heading_deviation(&self) -> f64 {
        sqrt(self.covariance()[(ROTATION + 2, ROTATION + 2)])
    }

    fn is_same(&self, other: &Self) -> bool {
        let (Some(from), Some(to)) = (self.estimate(), other.estimate()) else { return false };
        is_same(&from.error_to::<S>(to), self.covariance(), other.covariance())
    }

    fn longest_sample(&self) -> f64 {
        self.params().longest_sample
    }

    fn hold(&mut self, sample: &ImuMean, doubt: &Doubt) -> Result<(), Refusal> {
        self.hold(sample, doubt)
    }

    fn multiply_noise(&mut self, multiple: f64) {
        self.multiply_noise(multiple);
    }

    fn doubt_all(&mut self, factor: f64) {
        self.doubt_all(factor);
    }

    fn unmoor(&mut self) {
        self.unmoor();
    }

    fn forget_attitude(&mut self) {
        self.turn(&UnitQuaternion::identity(), &(Matrix3::identity() * (UNKNOWABLE * UNKNOWABLE)));
    }

    fn forks(&self) -> Vec<(Self, f64)> {
        let covariance = self.covariance().fixed_view::<3, 3>(ROTATION, ROTATION).into_owned();
        let variances = covariance.diagonal();
        let (turns, deviation) = if variances.x.max(variances.y) > UNKNOWN_HEADING * UNKNOWN_HEADING {
            (attitudes(), ATTITUDE_DEVIATION)
        } else if variances.z > UNKNOWN_HEADING * UNKNOWN_HEADING {
            ((0..TURNS).map(|turn| turned(2, TAU * f64::from(turn) / f64::from(TURNS))).collect(), TURN_DEVIATION)
        } else {
            return Vec::new();
        };
        let each = Matrix3::from_diagonal(&variances.map(|own| own.min(deviation * deviation)));
        let Some(precision) = covariance.try_inverse() else { return Vec::new() };
        let forked = |turn: &UnitQuaternion<f64>| {
            let (mut filter, way) = (*self, rotation_vector(turn));
            filter.turn(turn, &each);
            (filter, -0.5 * way.dot(&(precision * way)))
        };
        turns.iter().map(forked).collect()
    }

    fn begin_again(&mut self) {
        self.begin_again();
    }
}

/// The rotation by an angle about an axis of the world.
fn turned(axis: usize, angle: f64) -> UnitQuaternion<f64> {
    let mut vector = Vector3::zeros();
    vector[axis] = angle;
    rotation(&vector)
}

/// Attitudes that cover all, 90° apart: the 24 that take a cube to itself.
fn attitudes() -> Vec<UnitQuaternion<f64>> {
    let tilts = [(0, 0.0), (0, PI), (0, FRAC_PI_2), (0, -FRAC_PI_2), (1, FRAC_PI_2), (1, -FRAC_PI_2)];
    let tilted = tilts.into_iter().map(|(axis, angle)| turned(axis, angle));
    tilted.flat_map(|tilt| (0..4).map(move |turn| turned(2, FRAC_PI_2 * f64::from(turn)) * tilt)).collect()
}
