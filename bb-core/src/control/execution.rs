//! One execution of a command: its future, which the pool or the loop of a simulation polls, and the caller's handle of its result.
//!
//! - At most one thread is inside the code. A wake while a thread polls it is kept, and that thread schedules it once more.
//! - A cancelled execution has its result at once. [`Task::mark_cancelled`], under the lock of the control state, has no thread enter
//!   the code any more; [`Task::cancel`], without it, has the future dropped as soon as the code yields.
//! - The first result counts; one that comes later is dropped without the lock.

use super::WeakControl;
use crate::component::{AnyExecution, Outcome};
use crate::fault::{Fault, Inside, Place, caught, discard, lock};
use crate::journal::End;
use crate::schedule::Lane;
use crate::time::MonotonicTime;
use std::any::Any;
use std::fmt;
use std::future::Future;
use std::marker::PhantomData;
use std::pin::Pin;
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::task::{Context, Poll, Wake, Waker};
use std::time::{Duration, Instant};

/// The result of a command, whatever its type.
pub(super) type Value = Box<dyn Any + Send>;
pub(super) type Ended = Result<Outcome<Value>, Fault>;
pub(super) type RunningFuture = Pin<Box<dyn Future<Output = Ended> + Send>>;
/// Creates the future. This is user code too, and runs where the future is polled.
pub(super) type Starter = Box<dyn FnOnce() -> Result<RunningFuture, Fault> + Send>;

/// A command whose code has ended.
pub(super) struct EndedCode {
    pub(super) id: u64,
    pub(super) end: End,
    pub(super) value: Option<Value>,
}

/// One execution's future.
pub(super) struct Task {
    id: u64,
    lane: Lane,
    control: WeakControl,
    state: Mutex<TaskState>,
}

struct TaskState {
    code: Code,
    is_scheduled: bool,
    is_woken: bool,
    is_cancelled: bool,
    /// Time of the last poll, and the number of polls at that instant.
    polled: (MonotonicTime, u32),
    /// Time at which the thread that is inside the code entered it.
    entered: Option<MonotonicTime>,
}

enum Code {
    New(Starter),
    Future(RunningFuture),
    /// A thread polls it.
    Polled,
    Done,
}

/// Polls at one instant of virtual time before a command is taken to be stuck.
const STUCK_AFTER: u32 = 1_000_000;

impl Task {
    pub(super) fn new(id: u64, lane: Lane, control: WeakControl, starter: Starter) -> Self {
        let state = TaskState {
            code: Code::New(starter),
            is_scheduled: false,
            is_woken: false,
            is_cancelled: false,
            polled: (MonotonicTime::MAX, 0),
            entered: None,
        };
        Self { id, lane, control, state: Mutex::new(state) }
    }

    /// Schedules it to be polled.
    pub(super) fn schedule(self: &Arc<Self>) {
        let mut state = lock(&self.state);
        match state.code {
            Code::Done => return,
            Code::Polled => {
                state.is_woken = true;
                return;
            }
            _ if state.is_scheduled => return,
            _ => state.is_scheduled = true,
        }
        drop(state);
        if let Some(control) = self.control.upgrade() {
            control.run_task(Arc::clone(self));
        }
    }

    /// Ensures that the code is not entered any more. Call this before [`Self::cancel`], which cannot be called under a lock.
    pub(super) fn mark_cancelled(&self) {
        lock(&self.state).is_cancelled = true;
    }

    /// Returns whether the code may still act: a thread is inside, or the future is to be dropped.
    pub(super) fn may_act(&self) -> bool {
        matches!(lock(&self.state).code, Code::Polled | Code::Future(_))
    }

    /// Drops the future as soon as its code yields.
    pub(super) fn cancel(self: &Arc<Self>) {
        let Some(control) = self.control.upgrade() else { return };
        let mut state = lock(&self.state);
        state.is_cancelled = true;
        // It may be waiting for a thread of its lane, and all of these may hang. On virtual time, nothing waits for
        // long.
        state.is_scheduled &= control.is_virtual();
        drop(state);
        self.schedule();
    }

    /// Polls it once. User code runs here: a panic fails the command.
    pub(super) fn run(self: &Arc<Self>) {
        let Some(control) = self.control.upgrade() else { return };
        let mut state = lock(&self.state);
        state.is_scheduled = false;
        let code = std::mem::replace(&mut state.code, Code::Polled);
        let is_cancelled = state.is_cancelled;
        if !matches!(code, Code::Polled | Code::Done) {
            state.entered = Some(control.clock().now());
        }
        drop(state);
        let inside = Inside::new(Place::Command(control.id()));
        let ended = match code {
            // A late wake: another thread is polling it, or it has ended.
            Code::Polled | Code::Done => {
                let mut state = lock(&self.state);
                if matches!(code, Code::Done) {
                    state.code = Code::Done;
                }
                return;
            }
            code if is_cancelled => {
                match code {
                    Code::New(starter) => discard(starter),
                    Code::Future(future) => discard(future),
                    Code::Polled | Code::Done => {}
                }
                drop(inside);
                lock(&self.state).code = Code::Done;
                return control.future_dropped(self.id);
            }
            Code::New(starter) => match caught(starter) {
                Ok(future) => self.poll(future),
                Err(failed) => Some(Err(failed.fault)),
            },
            Code::Future(future) => self.poll(future),
        };
        drop(inside);
        match ended {
            Some(ended) => {
                lock(&self.state).code = Code::Done;
                control.code_returned(self.id, ended);
            }
            None => {
                let mut state = lock(&self.state);
                let is_due = std::mem::take(&mut state.is_woken) || state.is_cancelled;
                drop(state);
                if let Some(fault) = self.is_stuck(control.clock().now(), control.is_virtual()) {
                    let code = std::mem::replace(&mut lock(&self.state).code, Code::Done);
                    if let Code::Future(future) = code {
                        discard(future);
                    }
                    return control.code_returned(self.id, Err(fault));
                }
                if is_due {
                    self.schedule();
                }
            }
        }
    }

    /// Polls the future; returns how it has ended, if it has, otherwise the future is kept.
    fn poll(self: &Arc<Self>, mut future: RunningFuture) -> Option<Ended> {
        let waker = Waker::from(Arc::clone(self));
        let polled = caught(|| Ok(future.as_mut().poll(&mut Context::from_waker(&waker))));
        let ended = match polled {
            Ok(Poll::Pending) => {
                lock(&self.state).code = Code::Future(future);
                return None;
            }
            Ok(Poll::Ready(ended)) => ended,
            Err(failed) => Err(failed.fault),
        };
        discard(future);
        Some(ended)
    }

    /// Returns the fault of a command that is stuck, if it is.
    fn is_stuck(&self, now: MonotonicTime, is_virtual: bool) -> Option<Fault> {
        if !is_virtual {
            return None;
        }
        let mut state = lock(&self.state);
        state.polled = if state.polled.0 == now { (now, state.polled.1 + 1) } else { (now, 1) };
        (state.polled.1 >= STUCK_AFTER).then(|| {
            Fault::new(format!(
                "it woke itself {STUCK_AFTER} times at {now}, and virtual time cannot go on: await \
                 `CommandContext::sleep` between two looks"
            ))
        })
    }

    /// Returns the time at which the thread that is inside the code entered it.
    pub(super) fn entered_at(&self) -> Option<MonotonicTime> {
        let state = lock(&self.state);
        state.entered.filter(|_| matches!(state.code, Code::Polled))
    }

    /// The lane of the pool that runs it, or drops its future.
    pub(super) fn lane(&self) -> Lane {
        if lock(&self.state).is_cancelled { Lane::User } else { self.lane }
    }
}

impl Wake for Task {
    fn wake(self: Arc<Self>) {
        self.schedule();
    }
}

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
    state: Mutex<SlotState>,
    changed: Condvar,
}

#[derive(Default)]
struct SlotState {
    result: Option<Result<Value, CommandError>>,
    /// `true` once there is or was a result; the first one counts.
    has_ended: bool,
    waker: Option<Waker>,
}

impl SlotState {
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
            control.cancel_execution(self.id);
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
