//! The transforms of an estimator's inputs when it runs.

use super::Fault;
use crate::joints::LookupError;
use crate::time::MonotonicTime;
use nalgebra::Isometry3;

/// The transforms of an estimator's inputs at one dispatch, each at the time of its message; see
/// [`Estimator::handle_transforms`](super::Estimator::handle_transforms).
#[derive(Clone, Copy, Debug)]
pub struct InputTransforms<'a> {
    inputs: &'a [InputTransform],
    driver_time: MonotonicTime,
}

/// The transform of one input.
#[derive(Clone, Debug)]
pub struct InputTransform {
    name: &'static str,
    is_driver: bool,
    placed: Placed,
}

#[derive(Clone, Debug)]
enum Placed {
    At(Isometry3<f64>),
    /// No transform: the payload is the same in every frame.
    Nowhere,
    /// No message of the input takes part in this dispatch.
    Absent,
    Missing(LookupError),
}

impl InputTransform {
    /// Creates the transform of an input from its frame to the output's, for tests of an estimator.
    ///
    /// ```
    /// use bb_core::component::{InputTransform, InputTransforms};
    /// use bb_core::nalgebra::Isometry3;
    ///
    /// # fn main() -> Result<(), bb_core::Fault> {
    /// let inputs = [InputTransform::new("camera", Isometry3::translation(0.0, 0.0, 1.0))];
    /// assert_eq!(InputTransforms::new(&inputs).frame_from_input("camera")?.translation.z, 1.0);
    /// # Ok(())
    /// # }
    /// ```
    pub fn new(name: &'static str, frame_from_input: Isometry3<f64>) -> Self {
        Self { name, is_driver: true, placed: Placed::At(frame_from_input) }
    }

    /// Creates the transform of an input before its first message: the fixed one if no moving joint is in between.
    pub(crate) fn declared(name: &'static str, is_driver: bool, fixed: Option<Isometry3<f64>>) -> Self {
        Self { name, is_driver, placed: fixed.map_or(Placed::Nowhere, Placed::At) }
    }

    pub(crate) fn set(&mut self, found: Result<Isometry3<f64>, LookupError>) {
        self.placed = match found {
            Ok(frame_from_input) => Placed::At(frame_from_input),
            Err(error) => Placed::Missing(error),
        };
    }

    pub(crate) fn set_absent(&mut self) {
        self.placed = Placed::Absent;
    }

    fn get(&self) -> Result<Isometry3<f64>, Fault> {
        let name = self.name;
        match &self.placed {
            Placed::At(frame_from_input) => Ok(*frame_from_input),
            Placed::Nowhere => Err(Fault::new(format!("the input `{name}` depends on no frame"))),
            Placed::Absent => Err(Fault::new(format!("the input `{name}` takes no part in this dispatch"))),
            Placed::Missing(error) => Err(Fault::new(format!("the input `{name}` has no transform: {error}"))),
        }
    }
}

impl<'a> InputTransforms<'a> {
    /// Creates the transforms of these inputs, of which the first is the driver, for tests of an estimator.
    pub fn new(inputs: &'a [InputTransform]) -> Self {
        Self { inputs, driver_time: MonotonicTime::ZERO }
    }

    /// Returns the same transforms, for a message of the driving input with this stamp.
    pub fn at(self, driver_time: MonotonicTime) -> Self {
        Self { driver_time, ..self }
    }

    /// The stamp of the driving input's message, which is also that of the output.
    pub fn driver_time(&self) -> MonotonicTime {
        self.driver_time
    }

    /// Transforms points from the frame of `input`, at the time of its message, to that of the output.
    ///
    /// # Errors
    /// No such input is declared, it takes no part in this dispatch, its payload depends on no frame, or it is
    /// optional and a joint between is unknown or too old. (If the input is not optional, there is no dispatch in
    /// that case.)
    pub fn frame_from_input(&self, input: &str) -> Result<Isometry3<f64>, Fault> {
        let declared = self.inputs.iter().find(|declared| declared.name == input);
        declared.ok_or_else(|| Fault::new(format!("no input `{input}` is declared")))?.get()
    }

    /// Transforms points from the frame of the driver, or of the only input, to that of the output.
    ///
    /// # Errors
    /// Its payload depends on no frame.
    pub fn frame_from_driver(&self) -> Result<Isometry3<f64>, Fault> {
        let driver = self.inputs.iter().find(|declared| declared.is_driver);
        driver.map_or_else(|| Ok(Isometry3::identity()), InputTransform::get)
    }
}
