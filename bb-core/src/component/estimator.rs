//! The contract of an estimator.

use super::{Context, Fault, Info, InputTransforms, Inputs, Options, Outputs, Request, RequestCodec, Termination};

/// Consumes messages and emits derived state. The book has one from scratch, in its chapter on drivers.
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
    /// Options of the estimator: the struct that `Name(…)` in `robot!` fills.
    type Options: Options;
    /// A payload, or a struct of several inputs.
    type Input: Inputs; // of a struct: `type Input = Pair<'static>;`
    /// A payload, or a struct of several outputs; [`Outputs`] lists the forms, among them several messages at once.
    type Output: Outputs;

    /// `true` if the estimator handles changing transforms, with [`handle_transforms`](Self::handle_transforms), so that its inputs may
    /// span moving joints.
    const HANDLES_MOVING_JOINTS: bool = false;

    /// Creates it, at the start and at every restart.
    ///
    /// # Errors
    /// At the start, any error keeps the robot from starting, except [`Fault::skip`], which leaves the estimator out. At a
    /// restart, it is tried again later; an estimator that is left out only then stays stopped.
    fn init(options: Self::Options, context: &Context) -> Result<Self, Fault>;

    /// Handles one message, or the snapshot of all inputs when the driver has arrived.
    ///
    /// # Errors
    /// Any error is reported, and the estimator is restarted with fresh state.
    fn handle_input(&mut self, input: <Self::Input as Inputs>::View<'_>) -> Result<Reply<Self::Output>, Fault>;

    /// Takes the transforms of its inputs, each at the time of its message, right before
    /// [`handle_input`](Self::handle_input). Called if it declares
    /// [`HANDLES_MOVING_JOINTS`](Self::HANDLES_MOVING_JOINTS). If a joint between an input that is not optional and
    /// the output is unknown or too old, neither is called: the dispatch is dropped, counted and degrades its health.
    ///
    /// # Errors
    /// As for [`handle_input`](Self::handle_input).
    fn handle_transforms(&mut self, transforms: &InputTransforms<'_>) -> Result<(), Fault> {
        let _ = transforms;
        Ok(())
    }

    /// Handles a timer, a tick or a timeout that it has asked for. Outputs are stamped with the current time, unless they
    /// are [`Timed`](super::Timed).
    ///
    /// # Errors
    /// As for [`handle_input`](Self::handle_input).
    fn handle_info(&mut self, info: Info) -> Result<Reply<Self::Output>, Fault> {
        let _ = info;
        Ok(Reply::none())
    }

    /// Continues work that it has asked to continue, before anything else happens to it.
    ///
    /// # Errors
    /// As for [`handle_input`](Self::handle_input).
    fn handle_continue(&mut self, step: u32) -> Result<Reply<Self::Output>, Fault> {
        let _ = step;
        Ok(Reply::none())
    }

    /// Takes new options, validated, after a parameter that they are bound to has changed. The default restarts the
    /// estimator with them: it is terminated and dropped before the new one is made.
    ///
    /// # Errors
    /// As for [`handle_input`](Self::handle_input).
    fn handle_options(&mut self, options: Self::Options, context: &Context) -> Result<(), Fault> {
        let _ = (options, context);
        Err(Fault::remake())
    }

    /// Emits what it still holds, such as the end of what it records, right before [`terminate`](Self::terminate): when the robot
    /// stops, and when it is restarted with new options or by its supervisor. Not called after an error or a panic. The output is
    /// stamped with the current time. Estimators that have stopped before do not get it.
    fn handle_end(&mut self) -> Option<Self::Output> {
        None
    }

    /// Cleans up before it stops or is restarted, also after an error; not called after a panic, when its state may be
    /// inconsistent.
    fn terminate(&mut self, reason: Termination<'_>) {
        let _ = reason;
    }
}

/// An estimator that answers requests of type `Q`; one may implement it for several.
///
/// Sent with [`Live::call`](crate::Live::call), to which a running robot and a simulated one dereference.
#[diagnostic::on_unimplemented(
    message = "`{Self}` does not answer requests of type `{Q}`",
    label = "no `HandleCall<{Q}>`"
)]
pub trait HandleCall<Q>: Estimator {
    /// Answer to the request.
    type Response;

    /// Form of these requests in a journal, so that a replay repeats them: `Some(RequestCodec::bytes())` for a request that derives
    /// [`Payload`](crate::message::Payload). By default, the journal holds only the outputs that they caused.
    const RECORD: Option<RequestCodec<Q>> = None;

    /// Answers, and may emit outputs as well. With [`Request::Restart`] in the reply, the estimator answers and then
    /// stops, to be made again.
    ///
    /// # Errors
    /// As for [`handle_input`](Estimator::handle_input); the caller gets the error as well.
    fn handle_call(&mut self, request: Q) -> Result<(Self::Response, Reply<Self::Output>), Fault>;
}

/// An estimator that takes one-way requests of type `Q`; one may implement it for several.
///
/// Sent with [`Live::cast`](crate::Live::cast), to which a running robot and a simulated one dereference.
#[diagnostic::on_unimplemented(
    message = "`{Self}` does not take requests of type `{Q}`",
    label = "no `HandleCast<{Q}>`"
)]
pub trait HandleCast<Q>: Estimator {
    /// Form of these requests in a journal, see [`HandleCall::RECORD`].
    const RECORD: Option<RequestCodec<Q>> = None;

    /// Handles the request.
    ///
    /// # Errors
    /// As for [`handle_input`](Estimator::handle_input).
    fn handle_cast(&mut self, request: Q) -> Result<Reply<Self::Output>, Fault>;
}

/// The result of a callback: outputs, if any, and whether the estimate has diverged.
#[derive(Clone, Debug, PartialEq)]
#[must_use]
pub struct Reply<O> {
    pub(crate) output: Option<O>,
    pub(crate) diverged: Option<&'static str>,
    pub(crate) request: Option<Request>,
}

impl<O> Reply<O> {
    /// Nothing to emit this time.
    pub fn none() -> Self {
        Self { output: None, diverged: None, request: None }
    }

    /// Emits `output`.
    pub fn emit(output: O) -> Self {
        Self { output: Some(output), diverged: None, request: None }
    }

    /// Reports that the estimate is not to be trusted, and why. Outputs are published all the same.
    pub fn diverged(mut self, reason: &'static str) -> Self {
        self.diverged = Some(reason);
        self
    }

    /// Adds a request for a timer, a tick, a timeout or a continue. A reply has one request: the last one wins.
    pub fn and(mut self, request: Request) -> Self {
        self.request = Some(request);
        self
    }

    /// The request, if any.
    pub fn request(&self) -> Option<Request> {
        self.request
    }

    /// The output, if any.
    pub fn output(&self) -> Option<&O> {
        self.output.as_ref()
    }

    /// Takes out the output, if any.
    pub fn into_output(self) -> Option<O> {
        self.output
    }

    /// Returns the reason for which the estimate has diverged, if it has.
    pub fn divergence(&self) -> Option<&'static str> {
        self.diverged
    }
}

impl<O> From<O> for Reply<O> {
    /// [`Reply::emit`].
    fn from(output: O) -> Self {
        Self::emit(output)
    }
}

impl<O> From<Option<O>> for Reply<O> {
    fn from(output: Option<O>) -> Self {
        Self { output, diverged: None, request: None }
    }
}
