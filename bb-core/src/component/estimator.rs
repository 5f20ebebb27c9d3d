//! The contract of an estimator.

use super::{Context, Fault, Inputs, Options, Outputs};

/// Consumes messages and emits derived state. See the crate's README for one from scratch.
///
/// The estimator stays a plain value: it knows no path, no subscriber and no thread, and is tested by calling it.
///
/// ```
/// use bb_core::prelude::*;
///
/// /// How strongly a body is accelerated beyond gravity, m/s².
/// #[derive(Clone, Debug, Payload)]
/// pub struct Shake {
///     /// m/s².
///     pub acceleration: f64,
/// }
///
/// /// Measures it from the specific force.
/// #[derive(Debug)]
/// pub struct ShakeMeter;
///
/// impl Estimator for ShakeMeter {
///     type Options = NoOptions;
///     type Input = Imu;
///     type Output = Shake;
///
///     fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
///         Ok(Self)
///     }
///
///     fn handle_input(&mut self, imu: &Stamped<Imu>) -> Result<Reply<Shake>, Fault> {
///         let acceleration = (imu.linear_acceleration.norm() - 9.81).abs();
///         Ok(Reply::emit(Shake { acceleration }))
///     }
/// }
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not an estimator",
    label = "cannot be declared with `estimator`",
    note = "implement `bb_core::Estimator` for it"
)]
pub trait Estimator: Sized + Send + 'static {
    /// What `Name(…)` in `robot!` fills.
    type Options: Options;
    /// A payload, or a struct of several inputs.
    type Input: Inputs;
    /// A payload, or a struct of several outputs.
    type Output: Outputs;

    /// Whether it asks for the joints' positions itself, so that its inputs may span moving joints.
    const HANDLES_MOVING_JOINTS: bool = false;

    /// Makes it, at the start and at every restart.
    ///
    /// # Errors
    /// What keeps it from starting; the robot then does not start.
    fn init(options: Self::Options, context: &Context) -> Result<Self, Fault>;

    /// Handles one message, or the snapshot of all inputs when the driver has arrived.
    ///
    /// # Errors
    /// What keeps it from going on; it is stopped and the fault is reported.
    fn handle_input(&mut self, input: <Self::Input as Inputs>::View<'_>) -> Result<Reply<Self::Output>, Fault>;

    /// Cleans up, before it stops, also after an error; not after a panic.
    fn terminate(&mut self) {}
}

/// What a callback gives back: outputs or none, and whether the estimate has diverged.
#[derive(Clone, Debug, PartialEq)]
#[must_use]
pub struct Reply<O> {
    pub(crate) output: Option<O>,
    pub(crate) diverged: Option<&'static str>,
}

impl<O> Reply<O> {
    /// Nothing to emit this time.
    pub fn none() -> Self {
        Self { output: None, diverged: None }
    }

    /// Emits `output`.
    pub fn emit(output: O) -> Self {
        Self { output: Some(output), diverged: None }
    }

    /// Reports that the estimate is not to be trusted, and why. Outputs go out all the same.
    pub fn diverged(mut self, reason: &'static str) -> Self {
        self.diverged = Some(reason);
        self
    }

    /// What is to be emitted.
    pub fn output(&self) -> Option<&O> {
        self.output.as_ref()
    }

    /// Takes out what is to be emitted.
    pub fn into_output(self) -> Option<O> {
        self.output
    }

    /// Why the estimate has diverged, if it has.
    pub fn divergence(&self) -> Option<&'static str> {
        self.diverged
    }
}

impl<O> From<Option<O>> for Reply<O> {
    fn from(output: Option<O>) -> Self {
        Self { output, diverged: None }
    }
}
