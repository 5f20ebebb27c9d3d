//! Outputs and status of the filter.

use super::life::{Sensed, Verdicts, World};
use crate::navigation::eskf::EskfFilter;
use crate::navigation::math::{skew, sqrt};
use crate::navigation::state::{
    Estimate, GYROSCOPE_BIAS, NAVIGATION, Optional, POSITION, ROTATION, States, VELOCITY, offset,
};
use bb_core::Payload;
use bb_core::payload::{GeodeticPosition, Odometry, Pose, Twist};
use nalgebra::{Isometry3, Matrix3, Matrix6, SMatrix, UnitQuaternion, Vector3};

/// Status of the filter, published with its odometry.
#[derive(Clone, Copy, Debug, Default, PartialEq, Payload)]
pub struct NavigationStatus {
    /// Accelerometer bias: the reading minus the specific force, axes of the link, m/s².
    pub accelerometer_bias: Vector3<f64>,
    /// Gyroscope bias: the reading minus the angular velocity, axes of the link, rad/s.
    pub gyroscope_bias: Vector3<f64>,
    /// Time since the horizontal position was last corrected by a position in the world, s.
    pub dead_reckoning_s: f64,
    /// Standard deviation of the horizontal position in its least certain direction, m.
    pub horizontal_deviation: f64,
    /// Standard deviation of the heading, rad; that of a whole turn while it is unknown.
    pub heading_deviation: f64,
    /// The multiple of the IMU's white noise that fits best.
    pub imu_noise: f64,
    /// Fixes by result.
    pub gnss: Verdicts,
    /// Velocities of the receiver by result.
    pub gnss_velocity: Verdicts,
    /// Headings of the receiver by result.
    pub gnss_heading: Verdicts,
    /// Velocities from odometry by result.
    pub odometry: Verdicts,
    /// Poses by result.
    pub pose: Verdicts,
    /// Relative poses by result.
    pub relative: Verdicts,
    /// Measurements of the magnetic field by result.
    pub magnetic_field: Verdicts,
    /// Pressures by result.
    pub pressure: Verdicts,
    /// Scale of the wheels, less 1. 0 if it is not a state.
    pub wheel_scale: f64,
    /// Yaw and pitch of the IMU's mounting in the vehicle beyond the declared ones, rad. 0 if they are no states.
    pub wheel_yaw: f64,
    /// See [`wheel_yaw`](Self::wheel_yaw).
    pub wheel_pitch: f64,
    /// Scale of relative poses, less 1. 0 if it is not a state.
    pub relative_scale: f64,
    /// Offset of the GNSS antenna from its declared position, axes of the link, m. 0 if it is not a state.
    pub gnss_lever_arm: Vector3<f64>,
    /// Delay of fixes beyond their stamps, s. 0 if it is not a state.
    pub gnss_delay: f64,
    /// Standard deviation of that delay, s. 0 if it is not a state.
    pub gnss_delay_deviation: f64,
    /// Magnetic field of the robot itself, axes of the link, T. 0 if it is not a state.
    pub hard_iron: Vector3<f64>,
    /// Barometric height minus the height, m. 0 if it is not a state.
    pub barometer_bias: f64,
    /// Place of the world's origin on the Earth. `None` without satellites.
    pub world_origin: Option<GeodeticPosition>,
    /// Number of times that IMU samples were missing for longer than a sample may take.
    pub gaps: u32,
    /// Number of times the filter was wrong and restarted where fixes or poses agree.
    pub resets: u32,
}

/// A filter's estimate of the body's motion, whatever else it estimates.
pub(super) struct Motion {
    position: Vector3<f64>,
    velocity: Vector3<f64>,
    world_from_body: UnitQuaternion<f64>,
    angular_velocity: Vector3<f64>,
    /// Covariance of the states that every filter has.
    covariance: SMatrix<f64, NAVIGATION, NAVIGATION>,
}

impl Motion {
    pub(super) fn of<S: States, const N: usize>(filter: &EskfFilter<S, N>) -> Option<Self> {
        let Estimate { position, velocity, world_from_body, angular_velocity, .. } = *filter.estimate()?;
        let covariance = filter.covariance().fixed_view::<NAVIGATION, NAVIGATION>(0, 0).into_owned();
        Some(Self { position, velocity, world_from_body, angular_velocity, covariance })
    }

    /// Pose and motion of a link whose origin is at `link` in the body, in another world.
    #[inline(never)]
    pub(super) fn of_link(&self, link: &Vector3<f64>, first_from_frame: &Isometry3<f64>) -> Odometry {
        let block = |row: usize, column: usize| self.covariance.fixed_view::<3, 3>(row, column).into_owned();
        let rotation = self.world_from_body.to_rotation_matrix().into_inner();
        let arm = rotation * link;
        // The link's origin: errors of the body's origin and of the rotated lever arm, θ × R l.
        let from_rotation = -skew(&arm);
        let position = block(POSITION, POSITION)
            + block(POSITION, ROTATION) * from_rotation.transpose()
            + from_rotation * block(ROTATION, POSITION)
            + from_rotation * block(ROTATION, ROTATION) * from_rotation.transpose();
        let position_rotation = block(POSITION, ROTATION) + from_rotation * block(ROTATION, ROTATION);
        let turned = first_from_frame.rotation.to_rotation_matrix().into_inner();
        let pose = Pose {
            position: first_from_frame.transform_point(&(self.position + arm).into()).coords,
            world_from_body: first_from_frame.rotation * self.world_from_body,
            covariance: Some(symmetric(
                turned * position * turned.transpose(),
                turned * position_rotation * turned.transpose(),
                turned * block(ROTATION, ROTATION) * turned.transpose(),
            )),
        };
        let to_body = rotation.transpose();
        // Rᵀ v + ω × l: errors of v, of R by Rᵀ [v]ₓ, and of the gyroscope's bias by [l]ₓ.
        let of_rotation = to_body * skew(&self.velocity);
        let of_bias = skew(link);
        let linear = to_body * block(VELOCITY, VELOCITY) * to_body.transpose()
            + to_body * block(VELOCITY, ROTATION) * of_rotation.transpose()
            + of_rotation * block(ROTATION, VELOCITY) * to_body.transpose()
            + of_rotation * block(ROTATION, ROTATION) * of_rotation.transpose()
            + to_body * block(VELOCITY, GYROSCOPE_BIAS) * of_bias.transpose()
            + of_bias * block(GYROSCOPE_BIAS, VELOCITY) * to_body.transpose()
            + of_rotation * block(ROTATION, GYROSCOPE_BIAS) * of_bias.transpose()
            + of_bias * block(GYROSCOPE_BIAS, ROTATION) * of_rotation.transpose()
            + of_bias * block(GYROSCOPE_BIAS, GYROSCOPE_BIAS) * of_bias.transpose();
        let linear_angular = -(to_body * block(VELOCITY, GYROSCOPE_BIAS)
            + of_rotation * block(ROTATION, GYROSCOPE_BIAS)
            + of_bias * block(GYROSCOPE_BIAS, GYROSCOPE_BIAS));
        let twist = Twist {
            linear: to_body * self.velocity + self.angular_velocity.cross(link),
            angular: self.angular_velocity,
            covariance: Some(symmetric(linear, linear_angular, block(GYROSCOPE_BIAS, GYROSCOPE_BIAS))),
        };
        Odometry { pose, twist }
    }
}

/// The remaining status of the filter.
pub(super) fn status_of<S: States + Send, const N: usize>(
    sensed: &Sensed<EskfFilter<S, N>>,
    world: &World,
) -> Option<NavigationStatus> {
    let filter = sensed.best();
    let estimate = filter.estimate()?;
    let mounting =
        |i: usize| offset::<S>(Optional::WheelMounting).map_or(0.0, |first| estimate.optional[first + i]);
    let deviation = |i: usize| sqrt(filter.covariance()[(i, i)]);
    let [gnss, odometry, pose, relative, magnetic_field, pressure, gnss_velocity, gnss_heading] = sensed.verdicts();
    Some(NavigationStatus {
        accelerometer_bias: estimate.accelerometer_bias,
        gyroscope_bias: estimate.gyroscope_bias,
        dead_reckoning_s: filter.dead_reckoning_s(),
        horizontal_deviation: sensed.deviation(),
        heading_deviation: sensed.copies.heading_deviation(),
        imu_noise: sensed.copies.noise(),
        gnss,
        gnss_velocity,
        gnss_heading,
        odometry,
        pose,
        relative,
        magnetic_field,
        pressure,
        wheel_scale: estimate.scalar::<S>(Optional::WheelScale),
        wheel_yaw: mounting(0),
        wheel_pitch: mounting(1),
        relative_scale: estimate.scalar::<S>(Optional::RelativeScale),
        gnss_lever_arm: estimate.vector::<S>(Optional::GnssLeverArm),
        gnss_delay: estimate.scalar::<S>(Optional::GnssDelay),
        gnss_delay_deviation: offset::<S>(Optional::GnssDelay).map_or(0.0, deviation),
        hard_iron: estimate.vector::<S>(Optional::HardIron),
        barometer_bias: estimate.scalar::<S>(Optional::BarometerBias),
        world_origin: world.origin(),
        gaps: filter.gaps(),
        // The start counts as the first.
        resets: filter.resets().saturating_sub(1),
    })
}

/// The symmetric block matrix of `first`, `between`, its transpose and `second`, exact to the last bit.
fn symmetric(first: Matrix3<f64>, between: Matrix3<f64>, second: Matrix3<f64>) -> Matrix6<f64> {
    let mut matrix = Matrix6::zeros();
    matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&(0.5 * (first + first.transpose())));
    matrix.fixed_view_mut::<3, 3>(0, 3).copy_from(&between);
    matrix.fixed_view_mut::<3, 3>(3, 0).copy_from(&between.transpose());
    matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(&(0.5 * (second + second.transpose())));
    matrix
}
