//! The estimator: how the tip accelerates, across joints that move.

use bb_core::component::InputTransforms;
use bb_core::nalgebra::{UnitQuaternion, Vector3};
use bb_core::prelude::*;

/// Inputs of the estimator.
#[derive(Clone, Copy, Debug, Inputs)]
pub(crate) struct TipInputs<'a> {
    tip: Input<'a, Imu>,
    base: Input<'a, Imu>,
}

/// Motion of the tip relative to the base, in the axes of the base.
#[derive(Clone, Debug, Payload)]
pub(crate) struct Tip {
    /// m/s²
    pub(crate) acceleration: Vector3<f64>,
    /// rad/s
    pub(crate) angular_velocity: Vector3<f64>,
}

/// Turns what the tip's IMU measures into the axes of the base and takes away what the IMU there measures: gravity, and how
/// the base itself moves.
#[derive(Debug, Default)]
pub(crate) struct TipMotion {
    base_from_tip: UnitQuaternion<f64>,
    base_from_base_imu: UnitQuaternion<f64>,
}

impl Estimator for TipMotion {
    type Options = NoOptions;
    type Input = TipInputs<'static>;
    type Output = Tip;
    const HANDLES_MOVING_JOINTS: bool = true;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self::default())
    }

    fn handle_transforms(&mut self, transforms: &InputTransforms<'_>) -> Result<(), Fault> {
        self.base_from_tip = transforms.frame_from_input("tip")?.rotation;
        self.base_from_base_imu = transforms.frame_from_input("base")?.rotation;
        Ok(())
    }

    fn handle_input(&mut self, inputs: TipInputs<'_>) -> Result<Reply<Tip>, Fault> {
        let (tip, base) = (self.base_from_tip, self.base_from_base_imu);
        Ok(Reply::emit(Tip {
            acceleration: tip * inputs.tip.linear_acceleration - base * inputs.base.linear_acceleration,
            angular_velocity: tip * inputs.tip.angular_velocity - base * inputs.base.angular_velocity,
        }))
    }
}
