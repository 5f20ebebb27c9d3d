//! The weighted average of two orientations as an estimator to declare on a link.

use super::average_pair;
use bb_core::payload::Orientation;
use bb_core::{Context, Estimator, Fault, Input, Inputs, Options, Reply};
use nalgebra::UnitQuaternion;

/// Averages the orientations of two sensors of one rigid body.
///
/// Each input is the orientation of its own sensor. The fixed joints between convert it to that of the link where the
/// average is declared, which it emits.
#[derive(Debug)]
pub struct OrientationAverage {
    first_weight: f64,
    first_from_link: UnitQuaternion<f64>,
    second_from_link: UnitQuaternion<f64>,
}

/// Options of [`OrientationAverage`].
#[derive(Clone, Copy, Debug, PartialEq, Options)]
pub struct OrientationAverageOptions {
    /// The weight of the first orientation; the second has the rest. 1: the first alone. Unit: none. Default: 0.5.
    #[option(default = 0.5, range = 0.0..=1.0)]
    pub first_weight: f64,
}

/// Two orientations of one body.
#[derive(Clone, Copy, Debug, Inputs)]
pub struct OrientationPair<'a> {
    /// Orientation with the given weight.
    pub first: Input<'a, Orientation>,
    /// Orientation with the rest of the weight.
    pub second: Input<'a, Orientation>,
}

impl Estimator for OrientationAverage {
    type Options = OrientationAverageOptions;
    type Input = OrientationPair<'static>;
    type Output = Orientation;

    fn init(options: OrientationAverageOptions, context: &Context) -> Result<Self, Fault> {
        Ok(Self {
            first_weight: options.first_weight,
            first_from_link: context.frame_from_input("first")?.rotation.inverse(),
            second_from_link: context.frame_from_input("second")?.rotation.inverse(),
        })
    }

    fn handle_input(&mut self, inputs: OrientationPair<'_>) -> Result<Reply<Orientation>, Fault> {
        let first = inputs.first.world_from_body * self.first_from_link;
        let second = inputs.second.world_from_body * self.second_from_link;
        Ok(match average_pair(&first, self.first_weight, &second, 1.0 - self.first_weight) {
            Ok(average) => Reply::emit(Orientation::new(average)),
            Err(_) => Reply::none().diverged("the two orientations are opposite"),
        })
    }
}
