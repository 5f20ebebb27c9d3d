//! Contexts that components are given when they start.

use super::guardian::Guardian;
use super::host::Host;
use super::motion_reports::{MotionReport, MotionReports};
use super::replacement::Replacement;
use super::{Bus, Caller, Counter, Counts, Fault, Request, SafetyLink};
use crate::declaration::{ActuatorDeclaration, EstimatorDeclaration, InputDeclaration, SensorDeclaration};
use crate::event::HardwareError;
use crate::fault::lock;
use crate::message::{Frame, JointSide};
use crate::payload::{BeginMotion, EndMotion, MotionEnd};
use crate::time::{Clock, MonotonicTime};
use crate::topology::{Limit, Topology, Transform, Transmission};
use nalgebra::Isometry3;
use std::cell::RefCell;
use std::ops::Deref;
use std::sync::{Arc, Mutex};

/// An estimator's context at its start: its place in the robot, and where its inputs come from.
#[derive(Debug)]
pub struct Context {
    robot: &'static str,
    declaration: &'static EstimatorDeclaration,
    now: MonotonicTime,
    safety: SafetyLink,
    requests: RefCell<Vec<Request>>,
    replacement: Option<Replacement>,
}

impl Context {
    pub(crate) fn new(
        robot: &'static str,
        declaration: &'static EstimatorDeclaration,
        now: MonotonicTime,
        guardian: Option<Arc<dyn Guardian>>,
    ) -> Self {
        let safety = SafetyLink::new(declaration.path, guardian);
        Self { robot, declaration, now, safety, requests: RefCell::default(), replacement: None }
    }

    /// Returns the same context, of an estimator that takes the place of the declared one.
    pub(crate) fn with_replacement(self, replacement: Option<Replacement>) -> Self {
        Self { replacement, ..self }
    }

    pub(crate) fn replacement(&self) -> Option<&Replacement> {
        self.replacement.as_ref()
    }

    /// Takes the requests made so far.
    pub(crate) fn into_requests(self) -> Vec<Request> {
        self.requests.into_inner()
    }

    /// A context without a robot, for tests of an estimator's `init`: an input at each transform given, the first
    /// being the driver. (Contexts are constants of robots; this one is leaked, a few hundred bytes each time.)
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
        let declaration = EstimatorDeclaration { path: "test", ..EstimatorDeclaration::NONE };
        Self::new("test", Self::leaked(declaration, inputs), MonotonicTime::ZERO, None)
    }

    /// Returns this context with other inputs than the declared ones, the first being the driver: for an
    /// estimator that wraps another whose sensors are mounted as a file says. Requests made to it are its own. (It leaks
    /// what [`for_test`](Self::for_test) does.)
    ///
    /// ```
    /// use bb_core::nalgebra::Isometry3;
    /// use bb_core::prelude::*;
    ///
    /// # fn main() -> Result<(), Fault> {
    /// let context = Context::for_test(&[("imu", Isometry3::identity()), ("gnss", Isometry3::identity())]);
    /// let other = context.with_inputs(&[("imu", Isometry3::translation(0.0, 0.0, 1.0))]);
    /// assert_eq!(other.frame_from_driver()?.translation.z, 1.0);
    /// assert!(other.frame_from_input("gnss").is_err());
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    pub fn with_inputs(&self, inputs: &[(&'static str, Isometry3<f64>)]) -> Self {
        Self {
            robot: self.robot,
            declaration: Self::leaked(*self.declaration, inputs),
            now: self.now,
            safety: self.safety.clone(),
            requests: RefCell::default(),
            replacement: None,
        }
    }

    fn leaked(
        declaration: EstimatorDeclaration,
        inputs: &[(&'static str, Isometry3<f64>)],
    ) -> &'static EstimatorDeclaration {
        let inputs = inputs.iter().enumerate().map(|(index, (name, frame_from_input))| InputDeclaration {
            index,
            name,
            source: "test",
            driver: index == 0,
            optional: false,
            tolerance_nanos: None,
            stale_after_nanos: None,
            frame_from_input: Some(Transform::of(frame_from_input)),
        });
        let inputs: &'static [InputDeclaration] = Vec::leak(inputs.collect());
        Box::leak(Box::new(EstimatorDeclaration { inputs, ..declaration }))
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

    /// Transforms points from the frame of `input` to the frame of the output: the product of the fixed joints
    /// between.
    ///
    /// The identity if both are the same frame, or if the input has no frame (a robot-level sensor).
    ///
    /// # Errors
    /// No input of that name is declared, or there is a moving joint between them. In that case the transform
    /// changes, and [`Estimator::handle_transforms`] gets it with each message. (Only an estimator that declares
    /// [`Estimator::HANDLES_MOVING_JOINTS`] may span one.)
    ///
    /// [`Estimator::HANDLES_MOVING_JOINTS`]: super::Estimator::HANDLES_MOVING_JOINTS
    /// [`Estimator::handle_transforms`]: super::Estimator::handle_transforms
    pub fn frame_from_input(&self, input: &str) -> Result<Isometry3<f64>, Fault> {
        let declared = self.declaration.inputs.iter().find(|declared| declared.name == input);
        let declared = declared.ok_or_else(|| Fault::new(format!("no input `{input}` is declared")))?;
        transform_of(declared)
    }

    /// The time of this start or restart.
    pub fn now(&self) -> MonotonicTime {
        self.now
    }

    /// Registers a callback that makes hardware safe when the robot is disarmed; see [`SafetyLink::on_disarm`].
    pub fn on_disarm(&self, hook: impl Fn() -> Result<(), Fault> + Send + Sync + 'static) {
        self.safety.on_disarm(hook);
    }

    /// Reports that hardware is in a dangerous state; see [`SafetyLink::hardware_error`].
    pub fn hardware_error(&self, error: impl Into<HardwareError>) {
        self.safety.hardware_error(error);
    }

    /// A link with the same functions, to keep for later callbacks.
    pub fn safety(&self) -> SafetyLink {
        self.safety.clone()
    }

    /// Asks for a timer, a tick, a timeout or a continue, from the start on.
    pub fn request(&self, request: Request) {
        self.requests.borrow_mut().push(request);
    }

    /// The requests made so far: for tests.
    pub fn requests(&self) -> Vec<Request> {
        self.requests.borrow().clone()
    }

    /// Returns the transform from the frame of the driver, or of the only input, to that of the output.
    ///
    /// # Errors
    /// There is a moving joint between them.
    pub fn frame_from_driver(&self) -> Result<Isometry3<f64>, Fault> {
        let driver = self.declaration.inputs.iter().find(|declared| declared.driver);
        driver.map_or_else(|| Ok(Isometry3::identity()), transform_of)
    }
}

fn transform_of(input: &InputDeclaration) -> Result<Isometry3<f64>, Fault> {
    let transform = input.frame_from_input.ok_or_else(|| {
        let name = input.name;
        Fault::new(format!(
            "there is a moving joint between the input `{name}` and the output; `handle_transforms` is told where it is"
        ))
    })?;
    Ok(transform.isometry())
}

/// The context of a component that runs on its own thread or owns hardware, at its start.
#[derive(Clone, Debug)]
pub struct ComponentContext {
    path: &'static str,
    host: Arc<dyn Host>,
}

impl ComponentContext {
    pub(crate) fn new(path: &'static str, host: Arc<dyn Host>) -> Self {
        Self { path, host }
    }

    /// The robot's name.
    pub fn robot(&self) -> &'static str {
        self.host.controls().origin().robot
    }

    /// The component's path: `sensor/base_link/imu`.
    pub fn path(&self) -> &'static str {
        self.path
    }

    /// The clock of the run.
    pub fn clock(&self) -> &Clock {
        self.host.controls().clock()
    }

    /// Returns whether the robot is stopping: a component that waits for its device should then stop waiting.
    pub fn is_stopping(&self) -> bool {
        self.host.controls().is_stopping()
    }

    /// The links and joints of the robot.
    pub fn topology(&self) -> &'static Topology {
        self.host.topology()
    }

    /// A value that the components of this run share, created by the first that asks for its type: the simulated
    /// world of simulated components, or the bus that several drivers use. It lives as long as the robot runs,
    /// through restarts of the components.
    pub fn shared<T: Send + Sync + 'static>(&self, make: impl FnOnce() -> T) -> Arc<T> {
        self.host.shared().get(make)
    }

    fn bus(&self) -> Bus {
        Bus::new(Arc::clone(&self.host), Caller::component(self.path))
    }

    pub(crate) fn replacement(&self) -> Option<Replacement> {
        self.host.replacement(self.path)
    }

    /// Registers a callback that makes its hardware safe when the robot is disarmed: stops a lidar's motor, switches
    /// a laser off. All callbacks run concurrently, each on its own thread, and must return within 5 s. One that
    /// fails or takes longer leads to the safety state `error`. A restart of the component replaces its earlier
    /// callbacks.
    pub fn on_disarm(&self, hook: impl Fn() -> Result<(), Fault> + Send + Sync + 'static) {
        self.host.controls().on_disarm(self.path, None, Arc::new(hook));
    }

    /// Reports that hardware is in a dangerous state: the robot is disarmed, its safety state becomes `error`, and the error
    /// is published at `safety/error`. Give a text, or a [`HardwareError`] with a kind and a quantity.
    pub fn hardware_error(&self, error: impl Into<HardwareError>) {
        self.host.controls().hardware_error(self.path, error.into());
    }
}

/// A sensor's context at its start.
#[derive(Clone, Debug)]
pub struct SensorContext {
    common: ComponentContext,
    declaration: &'static SensorDeclaration,
    counters: Counts,
}

impl Deref for SensorContext {
    type Target = ComponentContext;
    fn deref(&self) -> &ComponentContext {
        &self.common
    }
}

/// The context of a controller or a bridge at its start: that of a sensor without a place.
#[derive(Clone, Debug)]
pub struct ServiceContext(SensorContext);

impl Deref for ServiceContext {
    type Target = ComponentContext;
    fn deref(&self) -> &ComponentContext {
        &self.0
    }
}

/// An actuator's context at its start.
#[derive(Clone, Debug)]
pub struct ActuatorContext {
    common: ComponentContext,
    declaration: &'static ActuatorDeclaration,
    reports: Arc<Mutex<MotionReports>>,
    /// Transmission between the joint and the side that the actuator speaks of.
    gear: Option<Transmission>,
}

impl Deref for ActuatorContext {
    type Target = ComponentContext;
    fn deref(&self) -> &ComponentContext {
        &self.common
    }
}

impl SensorContext {
    pub(crate) fn new(declaration: &'static SensorDeclaration, host: Arc<dyn Host>) -> Self {
        let common = ComponentContext::new(declaration.path, host);
        Self { common, declaration, counters: Counts::default() }
    }

    pub(crate) fn counters(&self) -> &Counts {
        &self.counters
    }

    /// The component's count of that name, for the report ([`SourceStatistics`](crate::run::SourceStatistics)) and the
    /// metrics. It goes on when the component is restarted.
    pub fn counter(&self, name: &'static str) -> Counter {
        self.counters.get(name)
    }

    /// The frame of what it publishes.
    pub fn frame(&self) -> Frame {
        self.declaration.frame
    }

    /// The declared period in seconds, if it has a `rate`.
    pub fn period_s(&self) -> Option<f64> {
        self.declaration.period_nanos.map(|nanos| nanos as f64 * 1e-9)
    }

    /// Topics, actuators, parameters and commands, by path: for a sensor whose readings are computed from what others
    /// publish. Messages read this way in `read` are not inputs: they are neither declared nor checked.
    pub fn bus(&self) -> Bus {
        self.common.bus()
    }

    /// Transforms points from the sensor's frame to the root link's: the product of the fixed joints between. `None`
    /// if one of the joints moves, or the sensor has no frame.
    pub fn root_from_frame(&self) -> Option<Isometry3<f64>> {
        self.declaration.root_from_frame.map(|transform| transform.isometry())
    }
}

impl ServiceContext {
    pub(crate) fn of(context: &SensorContext) -> Self {
        Self(context.clone())
    }

    /// The component's count of that name, for the report ([`SourceStatistics`](crate::run::SourceStatistics)) and the
    /// metrics. It goes on when the component is restarted.
    pub fn counter(&self, name: &'static str) -> Counter {
        self.0.counter(name)
    }

    /// The declared period in seconds, if it has a `rate`.
    pub fn period_s(&self) -> Option<f64> {
        self.0.period_s()
    }

    /// Topics, actuators, parameters and commands, by path.
    pub fn bus(&self) -> Bus {
        self.0.bus()
    }
}

impl ActuatorContext {
    pub(crate) fn new(declaration: &'static ActuatorDeclaration, host: Arc<dyn Host>, side: JointSide) -> Self {
        let common = ComponentContext::new(declaration.path, host);
        let joint = common.topology().joint(declaration.joint);
        let gear = joint.and_then(|joint| joint.transmission).filter(|_| side == JointSide::Motor);
        Self { common, declaration, reports: Arc::default(), gear }
    }

    /// Transmission between the joint and the side that the actuator speaks of; `None` if that is the joint.
    pub(crate) fn gear(&self) -> Option<&Transmission> {
        self.gear.as_ref()
    }

    /// The limits of the joint, on the side that the actuator speaks of ([`Actuator::SIDE`](super::Actuator::SIDE)): of its motor, they
    /// are rad, rad/s and N·m.
    pub fn limit(&self) -> Option<Limit> {
        let limit = self.topology().joint(self.joint())?.limit?;
        let Some(gear) = &self.gear else { return Some(limit) };
        let [lower, upper] = [limit.lower, limit.upper].map(|end| end.map(|end| gear.motor_position(end)));
        let (lower, upper) = if gear.ratio() < 0.0 { (upper, lower) } else { (lower, upper) };
        let velocity = limit.velocity.map(|velocity| gear.motor_velocity(velocity).abs());
        Some(Limit { lower, upper, velocity, effort: limit.effort.map(|effort| gear.motor_effort(effort).abs()) })
    }

    /// The joint that it moves.
    pub fn joint(&self) -> &'static str {
        self.declaration.joint
    }

    /// Publishes, at `begin_motion` below the actuator's path, that it begins to move its joint. The message is
    /// published once the current call of its code has returned. Reports from its own threads wait for the next call
    /// of its code.
    pub fn begin_motion(&self, motion: BeginMotion) {
        let motion = self.gear.map_or(motion, |gear| motion.at_joint(&gear));
        lock(&self.reports).begin(motion);
    }

    /// Publishes the end of a motion at `end_motion`, as [`begin_motion`](Self::begin_motion) does the beginning.
    pub fn end_motion(&self, mut motion: EndMotion) {
        motion.position = self.gear.map_or(motion.position, |gear| gear.joint_position(motion.position));
        lock(&self.reports).end(motion);
    }

    pub(crate) fn take_reports(&self) -> Vec<MotionReport> {
        lock(&self.reports).take()
    }

    /// The actuator is failing: ends that it reports from now on until [`Self::end_current_motion`] get this reason.
    pub(crate) fn set_failing(&self, reason: &str) {
        lock(&self.reports).set_failing(reason);
    }

    /// Reports the end of the motion under way, if the actuator has not reported it.
    pub(crate) fn end_current_motion(&self, end: MotionEnd, position: impl FnOnce(&BeginMotion) -> f64) {
        lock(&self.reports).end_current(end, position);
    }
}
