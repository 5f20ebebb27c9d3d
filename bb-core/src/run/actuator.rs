//! A running actuator: whether it may move, and what becomes of it when it fails.

use super::supervision::{Failures, Supervisor};
use super::{Failed, Startup, caught, retire};
use crate::component::{Actuator, ActuatorContext, Then};
use crate::control::{Binding, Safety};
use crate::message::{Finite, Frame, Payload, Stamp};
use crate::pubsub::{AnyTopic, Topic};
use crate::time::MonotonicTime;
use std::any::Any;
use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};
use std::time::{Duration, Instant};

/// An actuator as declared.
#[derive(Clone, Copy, Debug)]
pub struct ActuatorDeclaration {
    /// Its path: `actuator/base_link/pan/servo`.
    pub path: &'static str,
    /// The joint that it moves, which is the frame of its commands.
    pub joint: &'static str,
    /// The number of its supervisor.
    pub supervisor: Supervisor,
}

/// An actuator in the wiring.
pub struct ActuatorNode<A: Actuator>(Arc<Inner<A>>);

struct Inner<A: Actuator> {
    declaration: &'static ActuatorDeclaration,
    context: ActuatorContext,
    options: Mutex<A::Options>,
    binding: Binding<A::Options>,
    options_changed: AtomicBool,
    startup: Startup,
    topic: Topic<A::Command>,
    state: Mutex<State<A>>,
}

struct State<A> {
    /// None while it does not run.
    actuator: Option<A>,
    restart_at: Option<MonotonicTime>,
    failures: Failures,
}

/// Why an actuator has not done what it was told.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ActuatorError {
    /// The robot is not armed.
    NotArmed(Safety),
    /// The command holds a NaN or an infinity.
    NonFinite,
    /// It does not run: it has failed, and waits for its restart.
    Stopped,
    /// It has failed at this command.
    Failed(String),
}

impl fmt::Display for ActuatorError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotArmed(safety) => write!(f, "the robot is not armed ({safety})"),
            Self::NonFinite => f.write_str("the command holds a NaN or an infinity"),
            Self::Stopped => f.write_str("the actuator has failed and does not run"),
            Self::Failed(message) => write!(f, "the actuator failed: {message}"),
        }
    }
}

impl std::error::Error for ActuatorError {}

impl<A: Actuator> ActuatorNode<A> {
    /// Makes the actuator; what keeps it from starting is in `startup`.
    pub fn new(
        declaration: &'static ActuatorDeclaration,
        options: &A::Options,
        binding: Binding<A::Options>,
        startup: &Startup,
    ) -> Self {
        let context = ActuatorContext {
            robot: startup.robot(),
            path: declaration.path,
            joint: declaration.joint,
            clock: startup.clock().clone(),
        };
        // A journal does not move anything.
        let made = if startup.is_replay() {
            Err("a journal is replayed".into())
        } else {
            startup.make(declaration.path, options, binding, |options| A::init(options, &context))
        };
        let state = State { actuator: made.ok(), restart_at: None, failures: Failures::default() };
        let inner = Arc::new(Inner {
            declaration,
            context,
            options: Mutex::new(options.clone()),
            binding,
            options_changed: AtomicBool::new(false),
            startup: startup.clone(),
            topic: Topic::new(declaration.path),
            state: Mutex::new(state),
        });
        // Weak, since the startup that keeps these is kept by the actuator.
        let (told, disarmed) = (Arc::downgrade(&inner), Arc::downgrade(&inner));
        startup.bind(declaration.path, options, binding, move || {
            if let Some(inner) = told.upgrade() {
                inner.options_changed.store(true, Ordering::Release);
            }
        });
        let disarm = move || match disarmed.upgrade() {
            Some(inner) => lock(&inner.state).actuator.as_mut().map_or(Ok(()), A::disarm),
            None => Ok(()),
        };
        startup.control.on_disarm(declaration.path, Arc::new(disarm));
        Self(inner)
    }

    /// Where its commands are seen.
    pub fn topic(&self) -> &Topic<A::Command> {
        &self.0.topic
    }

    /// Has it do what it is told.
    ///
    /// # Errors
    /// See [`ActuatorError`].
    pub fn send(&self, command: A::Command) -> Result<(), ActuatorError> {
        self.0.accept(command)
    }
}

/// That commands of type `T` can be sent to it.
pub(super) trait Accepts<T>: Send + Sync {
    fn accept(&self, command: T) -> Result<(), ActuatorError>;
}

impl<A: Actuator> Accepts<A::Command> for Inner<A> {
    fn accept(&self, command: A::Command) -> Result<(), ActuatorError> {
        if !command.is_finite() {
            return Err(ActuatorError::NonFinite);
        }
        let clock = self.startup.clock();
        let now = clock.now();
        let stamp = Stamp {
            monotonic_time: now,
            wall_time: clock.wall_at(now),
            frame: Frame::new(self.declaration.joint),
            origin: self.startup.origin(),
        };
        let message = stamp.message(command);
        {
            let mut state = lock(&self.state);
            // Under the lock that disarming takes as well: nothing moves once that has come back.
            let safety = self.startup.control.safety();
            if safety != Safety::Armed {
                return Err(ActuatorError::NotArmed(safety));
            }
            self.make_anew(&mut state, now);
            let Some(actuator) = &mut state.actuator else { return Err(ActuatorError::Stopped) };
            let done = caught(|| {
                if self.options_changed.swap(false, Ordering::AcqRel) {
                    let options = self.startup.bound(&*lock(&self.options), self.binding)?;
                    actuator.handle_options(options, &self.context)?;
                }
                actuator.handle_command(&message)
            });
            if let Err(failed) = done {
                let text = failed.fault.to_string();
                self.fail(&mut state, failed, now);
                return Err(ActuatorError::Failed(text));
            }
        }
        self.topic.publish(&message);
        Ok(())
    }
}

impl<A: Actuator> Inner<A> {
    /// If it has failed and the time has come.
    fn make_anew(&self, state: &mut State<A>, now: MonotonicTime) {
        if state.actuator.is_some() || state.restart_at.is_none_or(|at| at > now) {
            return;
        }
        state.restart_at = None;
        let options = self.startup.bound(&*lock(&self.options), self.binding);
        let made = match options {
            Ok(options) => caught(|| A::init(options, &self.context)),
            Err(fault) => Err(Failed { fault, panicked: false }),
        };
        match made {
            Ok(actuator) => state.actuator = Some(actuator),
            Err(failed) => self.fail(state, failed, now),
        }
    }

    fn fail(&self, state: &mut State<A>, Failed { fault, panicked }: Failed, now: MonotonicTime) {
        self.startup.fault(self.declaration.path, &fault);
        if let Some(mut actuator) = state.actuator.take() {
            // After a panic too: hardware that may still move is worse than a second panic, which is caught.
            if let Err(failed) = caught(|| actuator.disarm()) {
                self.startup.fault(self.declaration.path, &failed.fault);
            }
            let _ = retire(actuator, panicked, A::terminate);
        }
        if fault.then != Then::Restart {
            return;
        }
        let ActuatorDeclaration { supervisor, path, .. } = *self.declaration;
        state.restart_at = self.startup.failed(&mut state.failures, supervisor, path, now, true);
    }
}

/// What all running actuators have in common.
pub trait AnyActuator {
    /// Its path.
    fn path(&self) -> &'static str;
    /// The name of the type of its commands.
    fn command_name(&self) -> &'static str;
    /// Where its commands are seen.
    fn any_topic(&self) -> &dyn AnyTopic;
    /// What takes its commands, for whoever knows their type.
    #[doc(hidden)]
    fn accepts(&self) -> Box<dyn Any>;
    /// Stops it once it is free; false if it is still busy after `timeout`.
    #[doc(hidden)]
    fn terminate(&self, timeout: Duration) -> bool;
}

impl<A: Actuator> AnyActuator for ActuatorNode<A> {
    fn path(&self) -> &'static str {
        self.0.declaration.path
    }

    fn command_name(&self) -> &'static str {
        A::Command::NAME
    }

    fn any_topic(&self) -> &dyn AnyTopic {
        &self.0.topic
    }

    fn accepts(&self) -> Box<dyn Any> {
        let accepts: Arc<dyn Accepts<A::Command>> = Arc::clone(&self.0) as _;
        Box::new(accepts)
    }

    fn terminate(&self, timeout: Duration) -> bool {
        let Some(mut state) = lock_within(&self.0.state, timeout) else { return false };
        state.restart_at = None;
        if let Some(fault) = state.actuator.take().and_then(|actuator| retire(actuator, false, A::terminate)) {
            self.0.startup.fault(self.0.declaration.path, &fault);
        }
        true
    }
}

impl<A: Actuator> Drop for Inner<A> {
    /// Of a robot that did not start.
    fn drop(&mut self) {
        let state = self.state.get_mut().unwrap_or_else(PoisonError::into_inner);
        if let Some(actuator) = state.actuator.take() {
            let _ = retire(actuator, false, A::terminate);
        }
    }
}

impl<A: Actuator> fmt::Debug for ActuatorNode<A> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ActuatorNode").field("path", &self.0.declaration.path).finish_non_exhaustive()
    }
}

fn lock_within<T>(mutex: &Mutex<T>, timeout: Duration) -> Option<MutexGuard<'_, T>> {
    let start = Instant::now();
    loop {
        match mutex.try_lock() {
            Ok(guard) => return Some(guard),
            Err(TryLockError::Poisoned(poisoned)) => return Some(poisoned.into_inner()),
            Err(TryLockError::WouldBlock) if start.elapsed() >= timeout => return None,
            Err(TryLockError::WouldBlock) => std::thread::sleep(Duration::from_millis(1)),
        }
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
