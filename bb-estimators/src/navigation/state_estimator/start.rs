//! Initial states of the estimator.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::input::{AttitudeReading, FlightControllerState, ImuBias, PoseAnchor, TakeoffOrigin, blocks};
use super::params::{StateEstimatorConfig, ns};
use super::world::World;
use crate::navigation::alignment::{Alignment, AlignmentParams};
use crate::navigation::eskf::{ImuMean, Start};
use crate::navigation::numbers::{ATTITUDE_AGE_S, PLAUSIBLE_BIAS, UNKNOWN_VELOCITY};

/// Gathers the data for a start from the take-off origin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Starter {
    alignment: Alignment,
    attitude: Option<AttitudeReading>,
}

impl Starter {
    pub(super) fn new(config: &StateEstimatorConfig) -> Self {
        let params = AlignmentParams { gravity: config.sensors.gravity, ..AlignmentParams::default() };
        Self { alignment: Alignment::new(params), attitude: None }
    }

    pub(super) fn attitude(&mut self, attitude: &AttitudeReading) {
        self.attitude = Some(*attitude);
    }

    pub(super) fn sample(&mut self, sample: &ImuMean) {
        // A refused sample carries no information.
        let _ = self.alignment.add(sample);
    }

    /// The start from an origin, once the attitude is known from the flight controller or from rest.
    pub(super) fn at_origin(
        &self,
        now_ns: i64,
        origin: &TakeoffOrigin,
        config: &StateEstimatorConfig,
        bias: Option<&ImuBias>,
    ) -> Option<Start> {
        let params = &config.params;
        let square = |x: f64| x * x;
        let (horizontal, vertical) = (square(origin.horizontal_deviation), square(origin.vertical_deviation));
        let position_covariance = Matrix3::from_diagonal(&Vector3::new(horizontal, horizontal, vertical));
        let recent = |attitude: &AttitudeReading| now_ns.saturating_sub(attitude.time_ns) <= ns(ATTITUDE_AGE_S);
        let rest = (Vector3::zeros(), params.takeoff_velocity);
        if let Some(attitude) = self.attitude.filter(recent) {
            let start = Start::at(now_ns, (Vector3::zeros(), 1.0), rest, (attitude.world_from_body, 1.0));
            let rotation_covariance = attitude.covariance();
            return Some(with_bias(Start { position_covariance, rotation_covariance, ..start }, config, bias));
        }
        let heading = (params.takeoff_heading, params.takeoff_heading_deviation);
        let start = self.alignment.at_rest((Vector3::zeros(), 1.0), heading).ok()?;
        let accelerometer_bias_deviation = params.accelerometer_bias;
        Some(Start { time_ns: now_ns, position_covariance, accelerometer_bias_deviation, ..start })
    }
}

/// The start from the last known state of the flight controller, with its covariance inflated.
pub(super) fn warm(
    now_ns: i64,
    state: &FlightControllerState,
    world: &World,
    config: &StateEstimatorConfig,
    bias: Option<&ImuBias>,
) -> Start {
    let inflation = config.params.warm_inflation * config.params.warm_inflation;
    let turn = world.frame_from_local(&state.position);
    let matrix = turn.to_rotation_matrix().into_inner();
    let turned = |covariance: &Matrix3<f64>| matrix * covariance * matrix.transpose() * inflation;
    let velocity = (turn * state.velocity, 1.0);
    let orientation = (turn * state.attitude.world_from_body, 1.0);
    let start = Start {
        position_covariance: turned(&state.position_covariance),
        velocity_covariance: turned(&state.velocity_covariance),
        rotation_covariance: turned(&state.attitude.covariance()),
        ..Start::at(now_ns, (world.position(&state.position), 1.0), velocity, orientation)
    };
    with_bias(start, config, bias)
}

/// The start from an anchor, in the air.
pub(super) fn at_anchor(
    now_ns: i64,
    anchor: &PoseAnchor,
    world: &World,
    config: &StateEstimatorConfig,
    bias: Option<&ImuBias>,
) -> Start {
    let turn = world.frame_from_local(&anchor.position);
    let matrix = turn.to_rotation_matrix().into_inner();
    let [position, rotation] = blocks(&anchor.covariance);
    let orientation: UnitQuaternion<f64> = turn * anchor.world_from_body;
    let velocity = (Vector3::zeros(), UNKNOWN_VELOCITY);
    let start = Start {
        position_covariance: matrix * position * matrix.transpose(),
        rotation_covariance: matrix * rotation * matrix.transpose(),
        ..Start::at(now_ns, (world.position(&anchor.position), 1.0), velocity, (orientation, 1.0))
    };
    with_bias(start, config, bias)
}

fn with_bias(start: Start, config: &StateEstimatorConfig, bias: Option<&ImuBias>) -> Start {
    let (accelerometer, gyroscope) = (config.params.accelerometer_bias, config.params.gyroscope_bias);
    // An odometry that is lost may report any values.
    let is_plausible = |bias: &&ImuBias| {
        bias.accelerometer.norm() <= PLAUSIBLE_BIAS * accelerometer
            && bias.gyroscope.norm() <= PLAUSIBLE_BIAS * gyroscope
    };
    let bias = bias.filter(is_plausible);
    let zero = Vector3::zeros();
    Start {
        accelerometer_bias: bias.map_or(zero, |bias| bias.accelerometer),
        gyroscope_bias: bias.map_or(zero, |bias| bias.gyroscope),
        accelerometer_bias_deviation: accelerometer,
        gyroscope_bias_deviation: gyroscope,
        ..start
    }
}
