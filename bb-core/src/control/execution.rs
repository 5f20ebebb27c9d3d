//! What the caller of a command holds.

use super::tasks::{Signal, Value, lock};
use std::fmt;
use std::future::Future;
use std::marker::PhantomData;
use std::pin::Pin;
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::task::{Context, Poll, Waker};
use std::time::{Duration, Instant};

/// A command that runs. Await it on any executor, or wait for it; dropping it lets the command run on.
pub struct Execution<T> {
    slot: Arc<Slot>,
    result: PhantomData<fn() -> T>,
}

/// Why a command has given no result.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum CommandError {
    /// It has failed, and why.
    Failed(String),
    /// It took longer than its `timeout`.
    TimedOut,
    /// It was cancelled: by its caller, by another command, or since the robot was disarmed or stopped.
    Cancelled,
}

/// Where the result is left.
pub(super) struct Slot {
    state: Mutex<State>,
    changed: Condvar,
    signal: Arc<Signal>,
}

#[derive(Default)]
struct State {
    result: Option<Result<Value, CommandError>>,
    /// Once there is or was a result; the first one counts.
    has_ended: bool,
    waker: Option<Waker>,
}

impl State {
    /// The result; an error if somebody has taken it already.
    fn take(&mut self) -> Option<Result<Value, CommandError>> {
        let taken = || Err(CommandError::Failed("its result was taken already".into()));
        self.has_ended.then(|| self.result.take().unwrap_or_else(taken))
    }
}

impl Slot {
    pub(super) fn new(signal: Arc<Signal>) -> Self {
        Self { state: Mutex::default(), changed: Condvar::new(), signal }
    }

    pub(super) fn set(&self, result: Result<Value, CommandError>) {
        let mut state = lock(&self.state);
        if state.has_ended {
            return;
        }
        (state.result, state.has_ended) = (Some(result), true);
        let waker = state.waker.take();
        drop(state);
        self.changed.notify_all();
        if let Some(waker) = waker {
            crate::run::wake(waker);
        }
    }
}

impl<T: 'static> Execution<T> {
    pub(super) fn new(slot: Arc<Slot>) -> Self {
        Self { slot, result: PhantomData }
    }

    /// The result, if it has come to an end and nobody has taken it yet.
    pub fn try_result(&self) -> Option<Result<T, CommandError>> {
        lock(&self.slot.state).result.take().map(typed)
    }

    /// Waits for the result. On virtual time nobody moves the clock meanwhile: run the simulation and use
    /// [`Self::try_result`].
    ///
    /// # Errors
    /// Why there is none.
    pub fn wait(self) -> Result<T, CommandError> {
        let mut state = lock(&self.slot.state);
        loop {
            if let Some(result) = state.take() {
                return typed(result);
            }
            state = self.slot.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Waits for the result, `timeout` at most; none after that.
    pub fn wait_timeout(&self, timeout: Duration) -> Option<Result<T, CommandError>> {
        let deadline = Instant::now().checked_add(timeout);
        let mut state = lock(&self.slot.state);
        loop {
            if let Some(result) = state.take() {
                return Some(typed(result));
            }
            let left = match deadline {
                Some(deadline) => deadline.checked_duration_since(Instant::now()).filter(|left| !left.is_zero())?,
                None => Duration::MAX,
            };
            state = self.slot.changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Cancels it.
    pub fn cancel(&self) {
        self.slot.signal.cancel();
    }
}

fn typed<T: 'static>(result: Result<Value, CommandError>) -> Result<T, CommandError> {
    let value = result?.downcast::<T>().map_err(|_| CommandError::Failed("its result has another type".into()))?;
    Ok(*value)
}

impl<T: 'static> Future for Execution<T> {
    type Output = Result<T, CommandError>;

    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Self::Output> {
        let mut state = lock(&self.slot.state);
        match state.take() {
            Some(result) => Poll::Ready(typed(result)),
            None => {
                state.waker = Some(context.waker().clone());
                Poll::Pending
            }
        }
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
