//! Whether the robot may move.

use crate::Payload;
use crate::component::Fault;
use crate::run::caught;
use std::fmt;
use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

/// Whether the robot may move.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Payload)]
pub enum Safety {
    /// It may not.
    #[default]
    Disarmed,
    /// It may.
    Armed,
    /// Whoever owns hardware makes it safe.
    Disarming,
    /// Something could not be made safe, or failed too often; only a forced disarm leads out.
    Error,
}

impl fmt::Display for Safety {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Disarmed => "disarmed",
            Self::Armed => "armed",
            Self::Disarming => "disarming",
            Self::Error => "error",
        })
    }
}

/// Why the safety state is `error`, at `safety/error`.
#[derive(Clone, Debug, PartialEq, Eq, Payload)]
pub struct SafetyError {
    /// The component.
    pub path: &'static str,
    /// What happened.
    pub message: String,
}

/// How long all disarm callbacks together may take.
pub(super) const DISARM_WITHIN: Duration = Duration::from_secs(5);

/// What makes hardware safe, in the order in which they were registered.
#[derive(Default)]
pub(super) struct Hooks {
    all: Vec<(&'static str, u64, Hook)>,
    next: u64,
}

impl Hooks {
    pub(super) fn add(&mut self, path: &'static str, hook: Hook) {
        self.all.push((path, self.next, hook));
        self.next += 1;
    }

    /// What is registered from now on has a number from this one on.
    pub(super) fn next(&self) -> u64 {
        self.next
    }

    /// Whether the component at `path` has registered any from `number` on.
    pub(super) fn any_since(&self, path: &str, number: u64) -> bool {
        self.all.iter().any(|(other, own, _)| *other == path && *own >= number)
    }

    /// Takes those of a component out that were registered before `number`, or since; to be dropped without a lock.
    pub(super) fn take(&mut self, path: &str, number: u64, before: bool) -> Vec<(&'static str, u64, Hook)> {
        self.all.extract_if(.., |(other, own, _)| *other == path && (*own < number) == before).collect()
    }

    pub(super) fn all(&self) -> Vec<(&'static str, Hook)> {
        self.all.iter().map(|(path, _, hook)| (*path, Arc::clone(hook))).collect()
    }
}

/// Makes hardware safe.
pub(super) type Hook = Arc<dyn Fn() -> Result<(), Fault> + Send + Sync>;

/// Runs the disarm callbacks, each on a thread of its own; what failed or did not come back in time.
pub(super) fn disarm(hooks: Vec<(&'static str, Hook)>) -> Vec<SafetyError> {
    let (sender, receiver) = mpsc::channel();
    let mut waiting: Vec<&'static str> = Vec::new();
    let mut errors = Vec::new();
    for (path, hook) in hooks {
        let sender = sender.clone();
        let thread = std::thread::Builder::new().name(format!("disarm {path}"));
        let spawned = thread.spawn(move || {
            let result = caught(|| hook()).map_err(|failed| failed.fault.to_string());
            // Nobody listens any more if it took too long.
            let _ = sender.send((path, result));
        });
        match spawned {
            Ok(_) => waiting.push(path),
            Err(error) => errors.push(SafetyError { path, message: format!("cannot be disarmed: {error}") }),
        }
    }
    let deadline = Instant::now() + DISARM_WITHIN;
    while !waiting.is_empty() {
        let left = deadline.saturating_duration_since(Instant::now());
        let Ok((path, result)) = receiver.recv_timeout(left) else { break };
        if let Some(position) = waiting.iter().position(|other| *other == path) {
            waiting.swap_remove(position);
        }
        if let Err(message) = result {
            errors.push(SafetyError { path, message: format!("disarming failed: {message}") });
        }
    }
    let late = waiting.into_iter();
    errors
        .extend(late.map(|path| SafetyError { path, message: "did not come back from disarming in time".into() }));
    errors
}

/// The same on the caller's thread, one after the other: on virtual time.
pub(super) fn disarm_in_order(hooks: Vec<(&'static str, Hook)>) -> Vec<SafetyError> {
    let run = |(path, hook): (&'static str, Hook)| {
        let fault = caught(|| hook()).err()?.fault;
        Some(SafetyError { path, message: format!("disarming failed: {fault}") })
    };
    hooks.into_iter().filter_map(run).collect()
}
