//! Outputs and status of the filter.

use super::input::Setup;
use crate::navigation::estimator::life::{Sensed, Verdicts, World};
use crate::navigation::numbers::PLANE_VARIANCE;
use crate::navigation::planar::estimate::{GYROSCOPE_BIAS, HEADING, POSITION, STATES, VELOCITY, WHEEL_SCALE, left};
use crate::navigation::planar::filter::PlanarFilter;
use bb_core::Payload;
use bb_core::payload::{GeodeticPosition, Odometry, Pose, Twist};
use nalgebra::{Matrix6, SMatrix, UnitQuaternion, Vector2, Vector3};

/// Filter state beyond the odometry.
#[derive(Clone, Copy, Debug, Default, PartialEq, Payload)]
pub struct PlanarStatus {
    /// Bias of the gyroscope: its reading minus the yaw rate, rad/s.
    pub gyroscope_bias: f64,
    /// Scale of the wheels' velocity, less 1: `measured = (1 + s) true`.
    pub wheel_scale: f64,
    /// Standard deviation of the heading, rad; that of a whole turn while it is unknown.
    pub heading_deviation: f64,
    /// The multiple of the gyroscope's white noise that fits best.
    pub imu_noise: f64,
    /// Standard deviation of the gyroscope's bias, rad/s.
    pub gyroscope_bias_deviation: f64,
    /// Standard deviation of the wheels' scale.
    pub wheel_scale_deviation: f64,
    /// Time since the position was last corrected by a position in the world, s.
    pub dead_reckoning_s: f64,
    /// Standard deviation of the position in its least certain direction, m.
    pub horizontal_deviation: f64,
    /// Counts of fixes that were fused and that were rejected.
    pub gnss: Verdicts,
    /// Counts of odometry velocities by result.
    pub odometry: Verdicts,
    /// Counts of odometry yaw rates by result.
    pub yaw_rate: Verdicts,
    /// Counts of poses by result.
    pub pose: Verdicts,
    /// Counts of orientations by result.
    pub orientation: Verdicts,
    /// Place of the world's origin on the Earth. `None` without satellites.
    pub world_origin: Option<GeodeticPosition>,
    /// Number of times that IMU samples were missing for longer than a sample may take.
    pub gaps: u32,
    /// Number of times that the filter was wrong and was reset to where fixes or poses agree.
    pub resets: u32,
}

/// Pose and motion of the link.
pub(super) fn odometry_of(filter: &PlanarFilter, setup: &Setup) -> Option<Odometry> {
    let estimate = filter.estimate()?;
    // The link's pose in the body.
    let link = setup.body_from_link;
    let in_body = link.translation.vector.xy();
    let world_from_body = estimate.world_from_body();
    let arm = world_from_body * in_body;
    let link_from_body = link.rotation.inverse();
    let position = estimate.position + arm;
    let velocity = link_from_body * estimate.velocity_at(&in_body).push(0.0);
    let up = Vector3::z() * estimate.yaw_rate;
    Some(Odometry {
        pose: Pose {
            position: position.push(0.0),
            world_from_body: UnitQuaternion::from_euler_angles(0.0, 0.0, estimate.heading) * link.rotation,
            covariance: Some(pose_covariance(filter.covariance(), &arm)),
        },
        twist: Twist {
            linear: velocity,
            angular: up,
            covariance: Some(twist_covariance(filter.covariance(), &link_from_body, &in_body)),
        },
    })
}

/// The remaining status of the filter.
pub(super) fn status_of(sensed: &Sensed<PlanarFilter>, world: &World) -> Option<PlanarStatus> {
    let filter = sensed.best();
    let estimate = filter.estimate()?;
    let deviation = |state: usize| filter.covariance()[(state, state)].sqrt();
    let [gnss, odometry, yaw_rate, pose, orientation, ..] = sensed.verdicts();
    Some(PlanarStatus {
        gyroscope_bias: estimate.gyroscope_bias,
        wheel_scale: estimate.wheel_scale,
        heading_deviation: sensed.copies.heading_deviation(),
        imu_noise: sensed.copies.noise(),
        gyroscope_bias_deviation: deviation(GYROSCOPE_BIAS),
        wheel_scale_deviation: deviation(WHEEL_SCALE),
        dead_reckoning_s: filter.dead_reckoning_s(),
        horizontal_deviation: sensed.deviation(),
        gnss,
        odometry,
        yaw_rate,
        pose,
        orientation,
        world_origin: world.origin(),
        gaps: filter.gaps(),
        // The start itself counts as the first reset.
        resets: filter.resets().saturating_sub(1),
    })
}

/// Covariance of the pose, with the link's origin at `arm` from the body's, in the world.
fn pose_covariance(covariance: &SMatrix<f64, STATES, STATES>, arm: &Vector2<f64>) -> Matrix6<f64> {
    // Derivatives of the link's x, y and yaw with respect to the filter's errors.
    let mut by_errors = SMatrix::<f64, 6, STATES>::zeros();
    let by_heading = left(arm);
    for i in 0..2 {
        by_errors[(i, POSITION + i)] = 1.0;
        by_errors[(i, HEADING)] = by_heading[i];
    }
    by_errors[(5, HEADING)] = 1.0;
    on_the_plane(&by_errors, covariance)
}

/// Covariance of the twist, with the link's origin at `link` in the body.
fn twist_covariance(
    covariance: &SMatrix<f64, STATES, STATES>,
    link_from_body: &UnitQuaternion<f64>,
    link: &Vector2<f64>,
) -> Matrix6<f64> {
    let mut by_errors = SMatrix::<f64, 6, STATES>::zeros();
    let turn = link_from_body.to_rotation_matrix();
    let by_rate = left(link);
    for i in 0..2 {
        for j in 0..2 {
            by_errors[(i, VELOCITY + j)] = turn[(i, j)];
            by_errors[(i, GYROSCOPE_BIAS)] -= turn[(i, j)] * by_rate[j];
        }
    }
    by_errors[(5, GYROSCOPE_BIAS)] = -1.0;
    on_the_plane(&by_errors, covariance)
}

/// `J P Jᵀ`, exactly symmetric, with the components that the plane determines.
fn on_the_plane(by_errors: &SMatrix<f64, 6, STATES>, covariance: &SMatrix<f64, STATES, STATES>) -> Matrix6<f64> {
    let product = by_errors * covariance * by_errors.transpose();
    let mut matrix = 0.5 * (product + product.transpose());
    for i in [2, 3, 4] {
        matrix[(i, i)] = PLANE_VARIANCE;
    }
    matrix
}
