//! What a component is told when it starts.

use super::{Fault, Request};
use crate::control::Control;
use crate::message::Frame;
use crate::node::{EstimatorDeclaration, InputDeclaration};
use crate::run::{SensorDeclaration, StopSignal};
use crate::time::{Clock, MonotonicTime};
use crate::topology::Transform;
use nalgebra::Isometry3;
use std::cell::RefCell;
use std::sync::Arc;

/// What an estimator is told when it starts: where it stands in the robot, and where its inputs come from.
#[derive(Debug)]
pub struct Context {
    robot: &'static str,
    declaration: &'static EstimatorDeclaration,
    now: MonotonicTime,
    requests: RefCell<Vec<Request>>,
}

impl Context {
    pub(crate) fn new(robot: &'static str, declaration: &'static EstimatorDeclaration, now: MonotonicTime) -> Self {
        Self { robot, declaration, now, requests: RefCell::default() }
    }

    /// Takes what was asked for.
    pub(crate) fn into_requests(self) -> Vec<Request> {
        self.requests.into_inner()
    }

    /// A context of no robot, for tests of an estimator's `init`: an input at each transform given, the first one the
    /// driver. (Contexts are constants of robots; this one is leaked, a few hundred bytes each time.)
    ///
    /// ```
    /// use bb_core::nalgebra::Isometry3;
    /// use bb_core::prelude::*;
    ///
    /// # fn main() -> Result<(), Fault> {
    /// let context = Context::for_test(&[("imu", Isometry3::translation(0.0, 0.0, 1.0))]);
    /// assert_eq!(context.frame_from_input("imu")?.translation.z, 1.0);
    /// # Ok(())
    /// # }
    /// ```
    pub fn for_test(inputs: &[(&'static str, Isometry3<f64>)]) -> Self {
        let inputs = inputs.iter().enumerate().map(|(index, (name, frame_from_input))| InputDeclaration {
            index,
            name,
            source: "test",
            driver: index == 0,
            optional: false,
            tolerance_nanos: None,
            stale_after_nanos: None,
            frame_from_input: Transform::of(frame_from_input),
        });
        let inputs: &'static [InputDeclaration] = Vec::leak(inputs.collect());
        let declaration = EstimatorDeclaration { path: "test", inputs, ..EstimatorDeclaration::NONE };
        Self::new("test", Box::leak(Box::new(declaration)), MonotonicTime::ZERO)
    }

    /// The robot's name.
    pub fn robot(&self) -> &'static str {
        self.robot
    }

    /// The estimator's path: `estimator/base_link/pose`.
    pub fn path(&self) -> &'static str {
        self.declaration.path
    }

    /// The frame of what it publishes: its sensor's, or its link's.
    pub fn frame(&self) -> Frame {
        self.declaration.frame
    }

    /// Takes points from the frame of `input` to the frame of the output: the product of the fixed joints between.
    ///
    /// The identity where the two are one frame, and where the input has no frame (a robot-level sensor). A moving joint,
    /// which only an estimator that declares [`Estimator::HANDLES_MOVING_JOINTS`] may span, counts as it stands at zero.
    ///
    /// # Errors
    /// No input of that name is declared.
    ///
    /// [`Estimator::HANDLES_MOVING_JOINTS`]: super::Estimator::HANDLES_MOVING_JOINTS
    pub fn frame_from_input(&self, input: &str) -> Result<Isometry3<f64>, Fault> {
        let declared = self.declaration.inputs.iter().find(|declared| declared.name == input);
        let declared = declared.ok_or_else(|| Fault::new(format!("no input `{input}` is declared")))?;
        Ok(declared.frame_from_input.isometry())
    }

    /// The time now.
    pub fn now(&self) -> MonotonicTime {
        self.now
    }

    /// Asks for a timer, a tick, a timeout or a continue, from the start on.
    pub fn request(&self, request: Request) {
        self.requests.borrow_mut().push(request);
    }

    /// What has been asked for: for tests.
    pub fn requests(&self) -> Vec<Request> {
        self.requests.borrow().clone()
    }

    /// The same for the driver, or for the only input.
    pub fn frame_from_driver(&self) -> Isometry3<f64> {
        let driver = self.declaration.inputs.iter().find(|declared| declared.driver);
        driver.map_or_else(Isometry3::identity, |declared| declared.frame_from_input.isometry())
    }
}

/// What a sensor is told when it starts.
#[derive(Clone, Debug)]
pub struct SensorContext {
    pub(crate) robot: &'static str,
    pub(crate) declaration: &'static SensorDeclaration,
    pub(crate) clock: Clock,
    pub(crate) stop: StopSignal,
    pub(crate) control: Control,
}

impl SensorContext {
    /// Registers what makes its hardware safe when the robot is disarmed: a lidar's motor, a laser. All callbacks run at
    /// the same time, and must have come back within 5 s; one that fails leads to the safety state `error`. What it registers
    /// when it is made anew takes the place of what it had registered before.
    pub fn on_disarm(&self, hook: impl Fn() -> Result<(), Fault> + Send + Sync + 'static) {
        self.control.on_disarm(self.declaration.path, Arc::new(hook));
    }

    /// The robot's name.
    pub fn robot(&self) -> &'static str {
        self.robot
    }

    /// The sensor's path: `sensor/base_link/imu`.
    pub fn path(&self) -> &'static str {
        self.declaration.path
    }

    /// The frame of what it publishes.
    pub fn frame(&self) -> Frame {
        self.declaration.frame
    }

    /// The declared period in seconds, if it has a `rate`.
    pub fn period_s(&self) -> Option<f64> {
        self.declaration.period_nanos.map(|nanos| nanos as f64 * 1e-9)
    }

    /// Takes points from the sensor's frame to the root link's: the product of the fixed joints between; none if a
    /// moving joint lies between, or the sensor has no frame.
    pub fn root_from_frame(&self) -> Option<Isometry3<f64>> {
        self.declaration.root_from_frame.map(|transform| transform.isometry())
    }

    /// The clock of the run.
    pub fn clock(&self) -> &Clock {
        &self.clock
    }

    /// Whether the robot has been told to stop: a sensor that waits for its device gives up its wait then.
    pub fn is_stopping(&self) -> bool {
        self.stop.is_set()
    }
}
