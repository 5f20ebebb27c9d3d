//! The future of one execution of a command: polled by the pool, or by the loop of a simulation.

use super::WeakControl;
use super::callbacks::Inside;
use crate::component::Outcome;
use crate::fault::{Fault, caught, discard, lock};
use crate::journal::End;
use crate::schedule::Lane;
use crate::time::MonotonicTime;
use std::any::Any;
use std::future::Future;
use std::pin::Pin;
use std::sync::{Arc, Mutex};
use std::task::{Context, Poll, Wake, Waker};

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
    state: Mutex<State>,
}

struct State {
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
        let state = State {
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
        let inside = Inside::command(control.id());
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
