//! Inputs of the declared filter, and the mounting of its sensors.

use super::life::World;
use super::measured::{deviation, heading, in_body, told};
use super::options::NavigationOptions;
use crate::navigation::measurement::{
    AbsolutePose, BodyVelocity, GnssHeading, GnssPosition, GnssVelocity, MagneticHeading, RelativePose, isotropic,
};
use bb_core::payload::{self, FluidPressure, GnssFix, Imu, MagneticField, Odometry, Orientation, Pose, Twist};
use bb_core::{Context, Fault, Input, Inputs};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

/// The inputs of [`EskfEstimator`](super::EskfEstimator).
#[derive(Clone, Copy, Debug, Inputs)]
pub struct NavigationInputs<'a> {
    /// The inertial sensor, the driving input.
    pub imu: Input<'a, Imu>,
    /// Satellite navigation.
    pub gnss: Option<Input<'a, GnssFix>>,
    /// The velocity of the receiver's antenna: the linear part of a twist, east, north and up, as drivers of receivers publish it.
    pub gnss_velocity: Option<Input<'a, Twist>>,
    /// The orientation of a pair of antennas, of which the heading is used: that of the x axis of the link where the receiver is
    /// declared, from the first antenna to the second.
    pub gnss_heading: Option<Input<'a, Orientation>>,
    /// Wheels, or any other source of odometry. Only the velocity is used, along the x axis and across it.
    pub odometry: Option<Input<'a, Odometry>>,
    /// Poses in the world, from a map or a tracking system.
    pub pose: Option<Input<'a, Pose>>,
    /// Poses relative to the previous one, from a visual or lidar odometry: each begins where the last one ended.
    pub relative: Option<Input<'a, payload::RelativePose>>,
    /// A magnetometer: the heading of the field is used.
    pub magnetic_field: Option<Input<'a, MagneticField>>,
    /// A barometer: changes of height since its first reading.
    pub pressure: Option<Input<'a, FluidPressure>>,
    /// The state of the link to start from, in motion or at rest: one that was kept, or one that an operator has set. With
    /// satellite navigation, the position is that of the fixes.
    pub start: Option<Input<'a, Odometry>>,
}

/// Options, and the poses of the sensors: `None` for inputs that the robot does not declare.
///
/// The filter's body frame has the axes of the link and its origin at the IMU.
#[derive(Clone, Copy, Debug)]
pub(in crate::navigation) struct Setup {
    pub(super) options: NavigationOptions,
    pub(super) link_from_imu: Isometry3<f64>,
    pub(super) gnss: Option<Isometry3<f64>>,
    pub(super) gnss_velocity: Option<Isometry3<f64>>,
    pub(super) gnss_heading: Option<Isometry3<f64>>,
    pub(super) odometry: Option<Isometry3<f64>>,
    pub(super) pose: Option<Isometry3<f64>>,
    pub(super) relative: Option<Isometry3<f64>>,
    pub(super) magnetic_field: Option<Isometry3<f64>>,
    pub(super) pressure: Option<Isometry3<f64>>,
}

impl Setup {
    /// Reads the mounting that the robot declares.
    pub(super) fn new(options: NavigationOptions, context: &Context) -> Result<Self, Fault> {
        let link_from_imu = context.frame_from_driver()?;
        let optional = |input: &str| in_body(context, &link_from_imu, input);
        Ok(Self {
            options,
            link_from_imu,
            gnss: optional("gnss"),
            gnss_velocity: optional("gnss_velocity"),
            gnss_heading: optional("gnss_heading"),
            odometry: optional("odometry"),
            pose: optional("pose"),
            relative: optional("relative"),
            magnetic_field: optional("magnetic_field"),
            pressure: optional("pressure"),
        })
    }

    /// Returns whether any input measures the position in the world.
    pub(super) fn has_positions(&self) -> bool {
        self.has_gnss() || self.pose.is_some()
    }

    /// Returns whether there is an input whose delay is a state.
    pub(super) fn has_receiver(&self) -> bool {
        self.has_gnss() || self.gnss_velocity.is_some() || self.gnss_heading.is_some()
    }

    pub(super) fn has_gnss(&self) -> bool {
        self.gnss.is_some()
    }

    /// Pose and velocity of the body, from those of the link.
    pub(super) fn state(&self, link: &Odometry) -> (Vector3<f64>, UnitQuaternion<f64>, Vector3<f64>) {
        let (turn, imu) = (link.pose.world_from_body, self.link_from_imu.translation.vector);
        let velocity = link.twist.linear + link.twist.angular.cross(&imu);
        (link.pose.position + turn * imu, turn, turn * velocity)
    }

    /// The antenna in the body, m.
    pub(super) fn antenna(&self) -> Vector3<f64> {
        place(self.gnss.as_ref())
    }

    /// The link's origin in the body, m.
    pub(super) fn link(&self) -> Vector3<f64> {
        -self.link_from_imu.translation.vector
    }

    /// A fix as a measurement. `None` if it has no position.
    pub(super) fn fix(&self, fix: &GnssFix, world: &World) -> Option<GnssPosition> {
        GnssPosition::of_fix(fix, &world.frame?, self.antenna(), self.options.gnss_deviation)
    }

    /// A pose in the outputs' world as a measurement.
    pub(super) fn absolute_pose(&self, pose: &Pose, world: &World) -> AbsolutePose {
        let body_from_sensor = self.pose.unwrap_or_else(Isometry3::identity);
        AbsolutePose::of_pose(pose, &body_from_sensor, self.options.pose_deviation)
            .moved(&world.first_from_frame.inverse())
    }

    /// The velocity of a receiver's antenna.
    pub(super) fn gnss_velocity(&self, twist: &Twist) -> GnssVelocity {
        let stated = twist.covariance.map(|covariance| covariance.fixed_view::<3, 3>(0, 0).into_owned());
        GnssVelocity {
            velocity: twist.linear,
            covariance: told(stated).unwrap_or_else(|| isotropic(self.options.gnss_velocity_deviation)),
            lever_arm: place(self.gnss_velocity.as_ref()),
        }
    }

    /// The heading of a pair of antennas.
    pub(super) fn gnss_heading(&self, orientation: &Orientation) -> GnssHeading {
        let stated = told(orientation.covariance).map(|covariance| covariance[(2, 2)]);
        GnssHeading {
            heading: heading(&orientation.world_from_body),
            deviation: deviation(stated, self.options.gnss_heading_deviation),
            baseline: rotation(self.gnss_heading.as_ref()) * Vector3::x(),
        }
    }

    /// The velocity in an odometry.
    pub(super) fn velocity(&self, odometry: &Odometry) -> BodyVelocity {
        let sideways = self.options.sideways_deviation;
        let least = Vector3::new(self.options.odometry_deviation, sideways, 2.0 * sideways);
        let stated = |i: usize| odometry.twist.covariance.map(|covariance| covariance[(i, i)]);
        BodyVelocity {
            velocity: odometry.twist.linear,
            deviations: Vector3::from_fn(|i, _| deviation(stated(i), least[i]).max(least[i])),
            body_from_sensor: rotation(self.odometry.as_ref()),
            lever_arm: place(self.odometry.as_ref()),
        }
    }

    /// The heading from a magnetic field.
    pub(super) fn magnetic_heading(&self, field: &MagneticField) -> MagneticHeading {
        MagneticHeading {
            field: rotation(self.magnetic_field.as_ref()) * field.magnetic_field,
            declination: self.options.declination,
            deviation: self.options.magnetic_deviation,
        }
    }

    /// Converts a relative pose of its sensor to one of the body: `X T X⁻¹`, where X is the pose of the sensor in the body.
    ///
    /// The scale applies to the translation of the sensor. Where the body rotates, part of the lever arm is not scaled. This is
    /// neglected.
    pub(super) fn relative_pose(&self, relative: &payload::RelativePose) -> RelativePose {
        let body_from_sensor = rotation(self.relative.as_ref());
        let lever_arm = place(self.relative.as_ref());
        let start_from_end = body_from_sensor * relative.start_from_end * body_from_sensor.inverse();
        let way = body_from_sensor * relative.position + lever_arm - start_from_end * lever_arm;
        let (translation_covariance, rotation_covariance) = match relative.covariance {
            Some(covariance) => {
                let turned = |rotation: UnitQuaternion<f64>, first: usize| {
                    let turn = rotation.to_rotation_matrix().into_inner();
                    turn * covariance.fixed_view::<3, 3>(first, first) * turn.transpose()
                };
                // Given in the frame at the start. The filter expects it in the body frame at the end.
                (turned(start_from_end.inverse() * body_from_sensor, 0), turned(body_from_sensor, 3))
            }
            None => (isotropic(self.options.relative_deviation), isotropic(0.1 * self.options.relative_deviation)),
        };
        RelativePose {
            keyframe: keyframe_at(relative.start.as_nanos()),
            translation: way,
            keyframe_from_body: start_from_end,
            translation_covariance,
            rotation_covariance,
        }
    }
}

/// The filter's keyframe id for an instant.
pub(super) fn keyframe_at(time_ns: i64) -> u64 {
    time_ns.cast_unsigned()
}

/// Position of a sensor in the body, m.
pub(super) fn place(body_from_sensor: Option<&Isometry3<f64>>) -> Vector3<f64> {
    body_from_sensor.map_or(Vector3::zeros(), |sensor| sensor.translation.vector)
}

fn rotation(body_from_sensor: Option<&Isometry3<f64>>) -> UnitQuaternion<f64> {
    body_from_sensor.map_or(UnitQuaternion::identity(), |sensor| sensor.rotation)
}
