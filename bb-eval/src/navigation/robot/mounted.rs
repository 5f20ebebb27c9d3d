//! An estimator as a robot declares it, with its sensors where a recording says.

use bb_core::component::{Info, InputTransforms, Inputs, OptionField};
use bb_core::nalgebra::Isometry3;
use bb_core::prelude::*;
use std::sync::{Arc, Mutex, PoisonError};

/// Reasons for which an estimate was not to be trusted, each from its time on; `None` where it was.
pub(super) type Reasons = Arc<Mutex<Vec<Option<&'static str>>>>;

/// The options of [`Mounted`].
#[derive(Clone, Debug)]
pub(super) struct MountedOptions<O> {
    /// Parameters of the estimator.
    pub(super) options: O,
    /// The inputs that the recording has, the driver first, with their places on the link.
    pub(super) inputs: Vec<(&'static str, Isometry3<f64>)>,
    /// Takes the reason of each run on a sample.
    pub(super) reasons: Reasons,
}

impl<O: Options + Sync> Options for MountedOptions<O> {
    const FIELDS: &'static [OptionField] = &[];

    fn defaults() -> Self {
        Self { options: O::defaults(), inputs: Vec::new(), reasons: Reasons::default() }
    }

    fn validate(&self) -> Result<(), String> {
        self.options.validate()
    }
}

/// The estimator `E` in the place of the declared one. A robot's mountings are constants, and those of a recording are not;
/// everything else is as declared.
#[derive(Debug)]
pub(super) struct Mounted<E> {
    estimator: E,
    reasons: Reasons,
}

impl<E> Mounted<E> {
    fn noted<O>(&self, reply: Result<Reply<O>, Fault>) -> Result<Reply<O>, Fault> {
        let reason = match &reply {
            Ok(reply) => reply.divergence(),
            Err(_) => Some("it failed"),
        };
        // A thread that panicked leaves the list intact.
        self.reasons.lock().unwrap_or_else(PoisonError::into_inner).push(reason);
        reply
    }
}

impl<E: Estimator<Options: Sync>> Estimator for Mounted<E> {
    type Options = MountedOptions<E::Options>;
    type Input = E::Input;
    type Output = E::Output;

    const HANDLES_MOVING_JOINTS: bool = E::HANDLES_MOVING_JOINTS;

    fn init(options: Self::Options, context: &Context) -> Result<Self, Fault> {
        let MountedOptions { options, inputs, reasons } = options;
        let mounted = context.with_inputs(&inputs);
        let estimator = E::init(options, &mounted)?;
        mounted.requests().into_iter().for_each(|request| context.request(request));
        Ok(Self { estimator, reasons })
    }

    fn handle_input(&mut self, input: <E::Input as Inputs>::View<'_>) -> Result<Reply<E::Output>, Fault> {
        let reply = self.estimator.handle_input(input);
        self.noted(reply)
    }

    fn handle_transforms(&mut self, transforms: &InputTransforms<'_>) -> Result<(), Fault> {
        self.estimator.handle_transforms(transforms)
    }

    fn handle_info(&mut self, info: Info) -> Result<Reply<E::Output>, Fault> {
        self.estimator.handle_info(info)
    }

    fn handle_continue(&mut self, step: u32) -> Result<Reply<E::Output>, Fault> {
        self.estimator.handle_continue(step)
    }

    fn handle_end(&mut self) -> Option<E::Output> {
        self.estimator.handle_end()
    }

    fn terminate(&mut self, reason: Termination<'_>) {
        self.estimator.terminate(reason);
    }
}
