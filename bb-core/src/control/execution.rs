//! The caller's handle of a command.

use super::WeakControl;
use super::task::Value;
use crate::component::AnyExecution;
use crate::fault::{Fault, lock};
use std::fmt;
use std::future::Future;
use std::marker::PhantomData;
use std::pin::Pin;
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::task::{Context, Poll, Waker};
use std::time::{Duration, Instant};

/// A running command. Await it on any executor, or wait for it. Dropping it lets the command run on.
pub struct Execution<T> {
    slot: Arc<Slot>,
    result: PhantomData<fn() -> T>,
}

/// Reason for which a command has no result.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum CommandError {
    /// The command has failed, for this reason.
    Failed(String),
    /// The command took longer than its `timeout`.
    TimedOut,
    /// The command was cancelled: by its caller, by another command, or because the robot was disarmed or stopped.
    Cancelled,
}

/// The place of the result.
pub(super) struct Slot {
    /// The number of the execution.
    id: u64,
    /// The number of the command.
    command: usize,
    control: WeakControl,
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    result: Option<Result<Value, CommandError>>,
    /// `true` once there is or was a result; the first one counts.
    has_ended: bool,
    waker: Option<Waker>,
}

impl State {
    /// The result; an error if it was already taken.
    fn take(&mut self) -> Option<Result<Value, CommandError>> {
        let missing = || Err(CommandError::Failed("its result was taken already".into()));
        self.has_ended.then(|| self.result.take().unwrap_or_else(missing))
    }
}

impl Slot {
    pub(super) fn new(id: u64, command: usize, control: WeakControl) -> Self {
        Self { id, command, control, state: Mutex::default(), changed: Condvar::new() }
    }

    /// Stores the result. Returns the waker of a task that awaits it, which is user code, and a result that came too
    /// late.
    pub(super) fn set(&self, result: Result<Value, CommandError>) -> (Option<Waker>, Option<Value>) {
        let mut state = lock(&self.state);
        if state.has_ended {
            return (None, result.ok());
        }
        state.result = Some(result);
        state.has_ended = true;
        let waker = state.waker.take();
        drop(state);
        self.changed.notify_all();
        (waker, None)
    }

    fn wait_timeout(&self, timeout: Duration) -> Option<Result<Value, CommandError>> {
        let deadline = Instant::now().checked_add(timeout);
        let mut state = lock(&self.state);
        loop {
            if let Some(result) = state.take() {
                return Some(result);
            }
            let left = match deadline {
                Some(deadline) => deadline.checked_duration_since(Instant::now()).filter(|left| !left.is_zero())?,
                None => Duration::MAX,
            };
            state = self.changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    fn poll(&self, context: &mut Context<'_>) -> Poll<Result<Value, CommandError>> {
        // Cloning and dropping wakers is user code: not under the lock.
        let waker = context.waker().clone();
        let mut state = lock(&self.state);
        match state.take() {
            Some(result) => {
                drop(state);
                Poll::Ready(result)
            }
            None => {
                let previous = state.waker.replace(waker);
                drop(state);
                drop(previous);
                Poll::Pending
            }
        }
    }

    fn cancel(&self) {
        if let Some(control) = self.control.upgrade() {
            control.cancel(self.id);
        }
    }

    fn json(&self, result: Result<Value, CommandError>) -> Result<String, Fault> {
        let control = self.control.upgrade().ok_or_else(|| Fault::new("the robot is gone"))?;
        control.result_json(self.command, result?)
    }
}

impl<T: 'static> Execution<T> {
    pub(super) fn new(slot: Arc<Slot>) -> Self {
        Self { slot, result: PhantomData }
    }

    /// The result, if the command has ended and the result has not been taken yet.
    pub fn try_result(&self) -> Option<Result<T, CommandError>> {
        let result = lock(&self.slot.state).result.take();
        result.map(typed)
    }

    /// Waits for the result. On virtual time, nothing advances the clock meanwhile: run the simulation and use
    /// [`Self::try_result`].
    ///
    /// # Errors
    /// Why there is no result.
    pub fn wait(self) -> Result<T, CommandError> {
        loop {
            if let Some(result) = self.slot.wait_timeout(Duration::MAX) {
                return typed(result);
            }
        }
    }

    /// Waits for the result, `timeout` at most; returns `None` after that.
    pub fn wait_timeout(&self, timeout: Duration) -> Option<Result<T, CommandError>> {
        self.slot.wait_timeout(timeout).map(typed)
    }

    /// Cancels it. Its result is [`CommandError::Cancelled`] at once, and from now on its handles refuse to act. Its
    /// future is dropped as soon as its code yields.
    pub fn cancel(&self) {
        self.slot.cancel();
    }
}

fn typed<T: 'static>(result: Result<Value, CommandError>) -> Result<T, CommandError> {
    let value = result?.downcast::<T>().map_err(|_| CommandError::Failed("its result has another type".into()))?;
    Ok(*value)
}

impl<T: 'static> Future for Execution<T> {
    type Output = Result<T, CommandError>;

    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Self::Output> {
        self.slot.poll(context).map(typed)
    }
}

/// An execution whose caller does not know its types.
pub(super) struct UntypedExecution(pub(super) Arc<Slot>);

impl AnyExecution for UntypedExecution {
    fn number(&self) -> u64 {
        self.0.id
    }

    fn try_result(&self) -> Option<Result<String, Fault>> {
        let result = lock(&self.0.state).result.take();
        result.map(|result| self.0.json(result))
    }

    fn wait_timeout(&self, timeout: Duration) -> Option<Result<String, Fault>> {
        self.0.wait_timeout(timeout).map(|result| self.0.json(result))
    }

    fn cancel(&self) {
        self.0.cancel();
    }

    fn poll(&mut self, context: &mut Context<'_>) -> Poll<Result<String, Fault>> {
        self.0.poll(context).map(|result| self.0.json(result))
    }
}

impl<T> fmt::Debug for Execution<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Execution").finish_non_exhaustive()
    }
}

impl fmt::Display for CommandError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Failed(message) => write!(f, "the command failed: {message}"),
            Self::TimedOut => f.write_str("the command took longer than its timeout"),
            Self::Cancelled => f.write_str("the command was cancelled"),
        }
    }
}

impl std::error::Error for CommandError {}
