//! Whether the robot may move.

use crate::component::Fault;
use crate::run::caught;
use std::fmt;
use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

/// Whether the robot may move.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
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
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SafetyError {
    /// The component.
    pub path: &'static str,
    /// What happened.
    pub message: String,
}

/// How long all disarm callbacks together may take.
pub(super) const DISARM_WITHIN: Duration = Duration::from_secs(5);

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
