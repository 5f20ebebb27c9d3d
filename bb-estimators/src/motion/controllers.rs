//! Controllers to declare in `controllers { … }`.

use super::{Pid, PidParams, Threshold};
use bb_core::payload::{ActuatorCommand, EffortCommand, JointState, VelocityCommand};
use bb_core::run::{ActuatorError, ActuatorLink};
use bb_core::{Fault, MonotonicTime, Options, Overflow, Payload, Reading, Service, ServiceContext, Subscription};
use std::time::Duration;

/// The quantity driven by the output of a [`PidController`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Drive {
    /// A velocity: rad/s or m/s.
    #[default]
    Velocity,
    /// An effort: N·m or N.
    Effort,
}

/// Brings a joint to a position with a [`Pid`]: it reads the joint's state at `measurement` and commands the actuator at
/// `actuator`.
///
/// Gains and setpoint are options, to be bound to parameters: `PidController(kp = param::gains::kp, …)`. A new gain
/// takes effect with the next step; the integral is kept. While the robot is not armed, or the measurement is older than `stale_after`, it
/// commands nothing and resets its integral. When it stops commanding, it commands the actuator once to hold, so that the joint does
/// not continue with the last velocity or effort.
#[derive(Debug)]
pub struct PidController {
    options: PidControllerOptions,
    pid: Pid,
    measurement: Subscription<JointState>,
    actuator: ActuatorLink<ActuatorCommand>,
    latest: Option<(MonotonicTime, f64)>,
    last_step: Option<MonotonicTime>,
    /// `true` if the actuator carries out a command of this controller.
    is_driving: bool,
}

/// Options of [`PidController`].
#[derive(Clone, Debug, PartialEq, Options)]
pub struct PidControllerOptions {
    /// Path of the `JointState` to control: `"sensor/base/pan/encoder"`.
    #[option(required)]
    pub measurement: &'static str,
    /// Path of the actuator, which takes `ActuatorCommand`.
    #[option(required)]
    pub actuator: &'static str,
    /// Kind of the output. Default: a velocity.
    #[option(default = Drive::Velocity)]
    pub drive: Drive,
    /// Target position of the joint, rad or m. Default: 0.
    #[option(default = 0.0)]
    pub setpoint: f64,
    /// Proportional gain. Default: 1.
    #[option(default = 1.0, range = 0.0..=1e9)]
    pub kp: f64,
    /// Integral gain, 1/s. Default: 0.
    #[option(default = 0.0, range = 0.0..=1e9)]
    pub ki: f64,
    /// Derivative gain, s. Default: 0.
    #[option(default = 0.0, range = 0.0..=1e9)]
    pub kd: f64,
    /// Time constant of the filter of the derivative. Unit: s. Default: 20 ms.
    #[option(default = 0.02, range = 0.0..=1e3, unit = "s")]
    pub derivative_filter: f64,
    /// Largest output in either direction. Default: no limit but that of the joint.
    #[option(default = f64::INFINITY, range = 0.0..=f64::INFINITY)]
    pub output_limit: f64,
    /// Time constant with which the integral follows the output while that is at its limit. Unit: s. Default: at once.
    #[option(default = 0.0, range = 0.0..=1e3, unit = "s")]
    pub tracking_time: f64,
    /// Age beyond which a measurement is not used. Unit: s. Default: 100 ms.
    #[option(default = Duration::from_millis(100))]
    pub stale_after: Duration,
}

/// A step of a [`PidController`], after `control_msgs/PidState`: rad or m, and the unit of the output.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
pub struct PidState {
    /// The setpoint.
    pub setpoint: f64,
    /// The measured position.
    pub measurement: f64,
    /// The difference.
    pub error: f64,
    /// The proportional term.
    pub proportional: f64,
    /// The integral term.
    pub integral: f64,
    /// The derivative term.
    pub derivative: f64,
    /// The commanded value, within the limits of the joint.
    pub output: f64,
}

impl PidControllerOptions {
    fn params(&self) -> PidParams {
        PidParams {
            proportional: self.kp,
            integral: self.ki,
            derivative: self.kd,
            derivative_filter_s: self.derivative_filter,
            minimum: -self.output_limit,
            maximum: self.output_limit,
            tracking_s: self.tracking_time,
        }
    }
}

impl Service for PidController {
    type Options = PidControllerOptions;
    type Output = PidState;

    fn init(options: PidControllerOptions, context: &ServiceContext) -> Result<Self, Fault> {
        if context.period_s().is_none() {
            return Err(Fault::permanent("it runs at a rate; declare one, as in `rate: 100 Hz;`"));
        }
        let bus = context.bus();
        let measurement = bus.subscribe(options.measurement, Overflow::KeepLatest)?.matched()?;
        let actuator = bus.actuator(options.actuator)?;
        let pid = Pid::new(options.params());
        Ok(Self { options, pid, measurement, actuator, latest: None, last_step: None, is_driving: false })
    }

    fn update(&mut self, now: MonotonicTime) -> Result<Reading<PidState>, Fault> {
        // A message that arrives late, or twice, must not take the place of a newer one.
        let is_newer = |time: MonotonicTime| self.latest.is_none_or(|(last, _)| time > last);
        if let Some(state) = self.measurement.try_recv().filter(|state| is_newer(state.monotonic_time)) {
            // The sensor has its own rate: the derivative is that between its measurements.
            let interval_s = self.latest.map_or(0.0, |(last, _)| state.monotonic_time.seconds_since(last));
            self.pid.measured(state.position, interval_s);
            self.latest = Some((state.monotonic_time, state.position));
        }
        let fresh = self.latest.filter(|(time, _)| now.duration_since(*time) <= self.options.stale_after);
        let Some((_, measurement)) = fresh else { return self.pause() };
        // The first step has no step before it.
        let step_s = self.last_step.map_or(0.0, |last| now.seconds_since(last));
        self.last_step = Some(now);
        let terms = self.pid.step(self.options.setpoint, measurement, step_s);
        let command = match self.options.drive {
            Drive::Velocity => VelocityCommand { velocity: terms.output, effort: None }.into(),
            Drive::Effort => EffortCommand { effort: terms.output }.into(),
        };
        if let Some(applied) = sent(self.actuator.apply(command))? {
            self.is_driving = true;
            // The limits of the joint also limit the integral.
            let applied = match applied {
                ActuatorCommand::Velocity(command) => command.velocity,
                ActuatorCommand::Effort(command) => command.effort,
                _ => terms.output,
            };
            let terms = self.pid.limited(terms, applied, step_s);
            return Ok(Reading::now(PidState {
                setpoint: self.options.setpoint,
                measurement,
                error: terms.error,
                proportional: terms.proportional,
                integral: terms.integral,
                derivative: terms.derivative,
                output: terms.output,
            }));
        }
        self.pause()
    }

    fn handle_options(&mut self, options: PidControllerOptions, context: &ServiceContext) -> Result<(), Fault> {
        if options.measurement != self.options.measurement || options.actuator != self.options.actuator {
            self.hold()?;
            *self = Self::init(options, context)?;
            return Ok(());
        }
        self.pid.set_params(options.params());
        self.options = options;
        Ok(())
    }
}

impl PidController {
    fn pause(&mut self) -> Result<Reading<PidState>, Fault> {
        self.pid.reset();
        self.last_step = None;
        self.hold()?;
        Ok(Reading::nothing())
    }

    /// Ends its own command. An actuator that refuses this has been made safe already.
    fn hold(&mut self) -> Result<(), Fault> {
        if std::mem::take(&mut self.is_driving) {
            sent(self.actuator.send(ActuatorCommand::Hold))?;
        }
        Ok(())
    }
}

/// Returns the command that was carried out, if any. A robot that is not armed, or an actuator that has failed and is restarted, is not a
/// fault of the controller.
fn sent<T>(result: Result<T, ActuatorError>) -> Result<Option<T>, Fault> {
    match result {
        Ok(applied) => Ok(Some(applied)),
        Err(ActuatorError::NotArmed(_) | ActuatorError::Stopped | ActuatorError::Failed(_)) => Ok(None),
        Err(error) => Err(error.into()),
    }
}

/// Switches an actuator between two velocities by the position of a joint, with hysteresis, such as a float that
/// starts a pump. It commands with each measurement, and publishes when it has switched.
#[derive(Debug)]
pub struct ThresholdController {
    options: ThresholdControllerOptions,
    threshold: Threshold,
    measurement: Subscription<JointState>,
    actuator: ActuatorLink<ActuatorCommand>,
    /// Command carried out last: on or off.
    commanded: Option<bool>,
}

/// Options of [`ThresholdController`].
#[derive(Clone, Debug, PartialEq, Options)]
pub struct ThresholdControllerOptions {
    /// Path of the `JointState` to watch.
    #[option(required)]
    pub measurement: &'static str,
    /// Path of the actuator, which takes `ActuatorCommand`.
    #[option(required)]
    pub actuator: &'static str,
    /// Position at or above which it switches on, rad or m. Default: 1.
    #[option(default = 1.0)]
    pub on_at: f64,
    /// Position at or below which it switches off, rad or m; at most `on_at`. Default: 0.
    #[option(default = 0.0)]
    pub off_at: f64,
    /// Velocity while it is on, rad/s or m/s. Default: 1.
    #[option(default = 1.0)]
    pub on_velocity: f64,
    /// Velocity while it is off, rad/s or m/s. Default: 0.
    #[option(default = 0.0)]
    pub off_velocity: f64,
}

/// A change of a [`ThresholdController`].
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
pub struct ThresholdState {
    /// The position that caused it, rad or m.
    pub measurement: f64,
    /// `true` if it switched on.
    pub is_on: bool,
}

impl ThresholdControllerOptions {
    fn threshold(&self) -> Result<Threshold, Fault> {
        let Self { on_at, off_at, .. } = self;
        let refused = || Fault::permanent(format!("`off_at` is {off_at}, but must be at most `on_at`, {on_at}"));
        Threshold::new(*on_at, *off_at).ok_or_else(refused)
    }
}

impl Service for ThresholdController {
    type Options = ThresholdControllerOptions;
    type Output = ThresholdState;

    fn init(options: ThresholdControllerOptions, context: &ServiceContext) -> Result<Self, Fault> {
        if context.period_s().is_none() {
            return Err(Fault::permanent("it runs at a rate; declare one, as in `rate: 10 Hz;`"));
        }
        let bus = context.bus();
        let measurement = bus.subscribe(options.measurement, Overflow::KeepLatest)?.matched()?;
        let actuator = bus.actuator(options.actuator)?;
        let threshold = options.threshold()?;
        Ok(Self { options, threshold, measurement, actuator, commanded: None })
    }

    fn update(&mut self, _: MonotonicTime) -> Result<Reading<ThresholdState>, Fault> {
        let Some(measurement) = self.measurement.try_recv().map(|state| state.position) else {
            return Ok(Reading::nothing());
        };
        let is_on = self.threshold.update(measurement);
        let velocity = if is_on { self.options.on_velocity } else { self.options.off_velocity };
        // Each time: a joint that was disarmed since, or whose actuator was restarted, rests.
        let is_sent = sent(self.actuator.send(VelocityCommand { velocity, effort: None }.into()))?;
        if is_sent.is_none() || self.commanded == Some(is_on) {
            return Ok(Reading::nothing());
        }
        self.commanded = Some(is_on);
        Ok(Reading::now(ThresholdState { measurement, is_on }))
    }
}
