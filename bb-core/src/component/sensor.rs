//! The contract of a sensor.

use super::{Fault, Options, SensorContext, Termination};
use crate::message::Payload;
use crate::time::MonotonicTime;

/// Reads a device, a recording or a simulation.
///
/// The framework calls [`read`](Sensor::read) at the declared `rate`; without a rate, it calls it repeatedly, so a
/// driver may wait for its device there. The reading is published, and all estimators downstream run, before the next
/// call.
///
/// ```
/// use bb_core::prelude::*;
///
/// /// Options of the simulated encoder.
/// #[derive(Clone, Debug, Options)]
/// pub struct EncoderOptions {
///     /// Unit: rad/s.
///     #[option(default = 1.0, unit = "rad/s")]
///     pub velocity: f64,
/// }
///
/// /// An encoder on a joint that turns forever.
/// #[derive(Debug)]
/// pub struct SimulatedEncoder(EncoderOptions);
///
/// impl Sensor for SimulatedEncoder {
///     type Options = EncoderOptions;
///     type Output = JointState;
///
///     fn init(options: EncoderOptions, _: &SensorContext) -> Result<Self, Fault> {
///         Ok(Self(options))
///     }
///
///     fn read(&mut self, now: MonotonicTime) -> Result<Reading<JointState>, Fault> {
///         let position = self.0.velocity * now.seconds_since(MonotonicTime::ZERO);
///         Ok(Reading::now(JointState { position, velocity: Some(self.0.velocity), effort: None }))
///     }
/// }
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a sensor",
    label = "cannot be declared with `sensor`",
    note = "implement `bb_core::Sensor` for it; a payload that other code publishes is declared as `External<Payload>()`"
)]
pub trait Sensor: Sized + Send + 'static {
    /// Options of the sensor: the struct that `Name(…)` in `robot!` fills.
    type Options: Options;
    /// Payload that the sensor publishes.
    type Output: Payload;

    /// Opens the device.
    ///
    /// # Errors
    /// Any error keeps the robot from starting.
    fn init(options: Self::Options, context: &SensorContext) -> Result<Self, Fault>;

    /// Takes one reading. `now` is the time of the call.
    ///
    /// A read that waits must return [`Reading::nothing`] from time to time, so that the robot can stop.
    ///
    /// # Errors
    /// There is no reading, for example because the device is unplugged. The fault is reported and the sensor is
    /// restarted, after a backoff of at most a second, for as long as the robot runs; nothing else is restarted. A
    /// [`Fault::permanent`] leaves it stopped.
    fn read(&mut self, now: MonotonicTime) -> Result<Reading<Self::Output>, Fault>;

    /// The time of its first reading; `None` means at once. A recording returns the stamp of its first message:
    /// virtual time starts at the earliest of all. Stamps of more than a year are taken for nanoseconds since 1970: the run then has
    /// that date.
    fn starts_at(&self) -> Option<MonotonicTime> {
        None
    }

    /// `true` if other code publishes the sensor's messages, by path too: see [`External`](crate::component::External).
    #[doc(hidden)]
    const IS_EXTERNAL: bool = false;

    /// Takes new options, validated, after a parameter that they are bound to has changed. The default restarts the
    /// sensor with them: it is terminated and dropped before the new one is made.
    ///
    /// # Errors
    /// As for [`read`](Self::read).
    fn handle_options(&mut self, options: Self::Options, context: &SensorContext) -> Result<(), Fault> {
        let _ = (options, context);
        Err(Fault::remake())
    }

    /// Closes the device before the sensor stops or is restarted; not called after a panic. When the robot stops, it
    /// has already been disarmed.
    fn terminate(&mut self, reason: Termination<'_>) {
        let _ = reason;
    }
}

/// The result of one [`Sensor::read`], and when to read next.
#[derive(Clone, Debug, PartialEq)]
#[must_use]
pub struct Reading<T> {
    pub(crate) payload: Option<T>,
    pub(crate) time: Option<MonotonicTime>,
    pub(crate) next: Next,
}

/// Time at which a sensor is read next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Next {
    /// The next period of the declared rate.
    AtRate,
    /// The time given.
    At(MonotonicTime),
    /// No time: there is no more to read.
    Never,
}

impl<T> Reading<T> {
    /// A reading taken now.
    pub fn now(payload: T) -> Self {
        Self { payload: Some(payload), time: None, next: Next::AtRate }
    }

    /// A reading with the device's own stamp.
    pub fn at(time: MonotonicTime, payload: T) -> Self {
        Self { payload: Some(payload), time: Some(time), next: Next::AtRate }
    }

    /// Nothing new this time.
    pub fn nothing() -> Self {
        Self { payload: None, time: None, next: Next::AtRate }
    }

    /// There is no more to read: the end of a recording.
    pub fn finished() -> Self {
        Self { payload: None, time: None, next: Next::Never }
    }

    /// Asks to be read next at `time`, regardless of the rate: a recording asks for the time of its next message.
    pub fn next_at(mut self, time: MonotonicTime) -> Self {
        self.next = Next::At(time);
        self
    }

    /// The payload read, if any.
    pub fn payload(&self) -> Option<&T> {
        self.payload.as_ref()
    }

    /// The device's own stamp, if any.
    pub fn time(&self) -> Option<MonotonicTime> {
        self.time
    }

    /// Returns the time at which to read next.
    pub fn next(&self) -> Next {
        self.next
    }
}
