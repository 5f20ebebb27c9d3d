//! The input of an attitude filter, and its frame.

use crate::attitude::ImuSample;
use bb_core::message::Stamped;
use bb_core::payload::{Imu, MagneticField, Marg};
use bb_core::{Context, Fault, Input, Inputs};
use nalgebra::{Matrix3, Vector3};

/// An input that provides an inertial sample.
#[diagnostic::on_unimplemented(
    message = "an attitude filter cannot take `{Self}`",
    label = "not an inertial input",
    note = "it takes `Imu`, `Marg` or `ImuAndMagnetometer`"
)]
pub trait InertialInput: Inputs {
    /// The sample, rotated to the frame of the output.
    fn sample(view: &Self::View<'_>, frames: &Frames) -> ImuSample;
}

/// An IMU and a magnetometer that are two sensors, on one link or on two across fixed joints.
#[derive(Clone, Copy, Debug, Inputs)]
pub struct InertialInputs<'a> {
    /// The inertial sensor, the driving input.
    pub imu: Input<'a, Imu>,
    /// The magnetometer; each of its readings is used once.
    pub magnetic_field: Option<Input<'a, MagneticField>>,
}

/// [`InertialInputs`], as the parameter of a filter: `Madgwick<ImuAndMagnetometer>`.
pub type ImuAndMagnetometer = InertialInputs<'static>;

/// The rotations from the inputs to the frame of the output; `None` if there is none.
#[derive(Clone, Copy, Debug, Default)]
pub struct Frames {
    frame_from_imu: Option<Matrix3<f64>>,
    frame_from_magnetometer: Option<Matrix3<f64>>,
}

impl Frames {
    /// Returns the rotations that the robot declares.
    ///
    /// # Errors
    /// There is a moving joint between an input and the output.
    pub fn of(context: &Context) -> Result<Self, Fault> {
        let turned = |rotation: nalgebra::UnitQuaternion<f64>| {
            (rotation.angle() > 0.0).then(|| rotation.to_rotation_matrix().into_inner())
        };
        // Without a magnetometer there is nothing to rotate.
        let magnetometer = context.frame_from_input("magnetic_field");
        Ok(Self {
            frame_from_imu: turned(context.frame_from_driver()?.rotation),
            frame_from_magnetometer: magnetometer.ok().and_then(|magnetometer| turned(magnetometer.rotation)),
        })
    }
}

fn sample(imu: &Stamped<Imu>, frames: &Frames) -> ImuSample {
    ImuSample {
        time_ns: imu.monotonic_time.as_nanos(),
        angular_velocity: turned(frames.frame_from_imu.as_ref(), imu.angular_velocity),
        specific_force: turned(frames.frame_from_imu.as_ref(), imu.linear_acceleration),
        magnetic_field: None,
    }
}

fn turned(rotation: Option<&Matrix3<f64>>, vector: Vector3<f64>) -> Vector3<f64> {
    rotation.map_or(vector, |rotation| rotation * vector)
}

impl InertialInput for Imu {
    fn sample(imu: &&Stamped<Imu>, frames: &Frames) -> ImuSample {
        sample(imu, frames)
    }
}

impl InertialInput for Marg {
    fn sample(marg: &&Stamped<Marg>, frames: &Frames) -> ImuSample {
        let field = marg.magnetic_field.as_ref();
        ImuSample {
            time_ns: marg.monotonic_time.as_nanos(),
            angular_velocity: turned(frames.frame_from_imu.as_ref(), marg.imu.angular_velocity),
            specific_force: turned(frames.frame_from_imu.as_ref(), marg.imu.linear_acceleration),
            magnetic_field: field.map(|field| turned(frames.frame_from_imu.as_ref(), field.magnetic_field)),
        }
    }
}

impl InertialInput for InertialInputs<'static> {
    fn sample(inputs: &InertialInputs<'_>, frames: &Frames) -> ImuSample {
        let field = inputs.magnetic_field.filter(Input::is_new);
        ImuSample {
            magnetic_field: field
                .map(|field| turned(frames.frame_from_magnetometer.as_ref(), field.magnetic_field)),
            ..sample(inputs.imu.message(), frames)
        }
    }
}
