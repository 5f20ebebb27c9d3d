//! Code that hangs until a test lets it go on, and components that are made of it.

use crate::components::Number;
use bb_core::prelude::*;
use std::marker::PhantomData;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// Longer than anything takes that does not hang, however busy the machine.
pub(crate) const PATIENCE: Duration = Duration::from_secs(20);

/// Waits until `holds`, however busy the machine.
pub(crate) fn wait_until(what: &str, mut holds: impl FnMut() -> bool) {
    let start = std::time::Instant::now();
    while !holds() {
        assert!(start.elapsed() < PATIENCE, "not reached: {what}");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// A place at which code waits until the test lets it go on.
#[derive(Debug, Default)]
pub(crate) struct Gate {
    /// The place that is closed, and how many have come there.
    state: Mutex<(Option<&'static str>, u32)>,
    changed: Condvar,
}

impl Gate {
    pub(crate) const fn new() -> Self {
        Self { state: Mutex::new((None, 0)), changed: Condvar::new() }
    }

    fn lock(&self) -> MutexGuard<'_, (Option<&'static str>, u32)> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn close(&self, place: &'static str) {
        *self.lock() = (Some(place), 0);
        // Who waits at another place goes on.
        self.changed.notify_all();
    }

    pub(crate) fn open(&self) {
        self.lock().0 = None;
        self.changed.notify_all();
    }

    pub(crate) fn pass(&self, place: &'static str) {
        let mut state = self.lock();
        if state.0 == Some(place) {
            state.1 += 1;
            self.changed.notify_all();
        }
        while state.0 == Some(place) {
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Waits until so many wait there.
    pub(crate) fn wait_for(&self, many: u32) {
        let state = self.lock();
        let waited = self.changed.wait_timeout_while(state, PATIENCE, |state| state.1 < many);
        let (state, timeout) = waited.unwrap_or_else(PoisonError::into_inner);
        assert!(!timeout.timed_out(), "nobody came to {:?}", state.0);
    }
}

/// A place at a gate, as a type.
pub(crate) trait Place: 'static {
    const GATE: &'static Gate;
    const NAME: &'static str;
}

/// A command that blocks the thread that runs it.
#[derive(Debug)]
pub(crate) struct Stuck<P>(PhantomData<P>);

impl<P: Place + Send + Sync> Command for Stuck<P> {
    type Options = NoOptions;
    type Arguments = NoArguments;
    type Output = ();

    async fn run(_: NoOptions, _: NoArguments, _: CommandContext) -> Result<Outcome<()>, Fault> {
        P::GATE.pass(P::NAME);
        Ok(Outcome::done(()))
    }
}

/// Code of a [`Brake`].
pub(crate) trait Brakes: Send + 'static {
    fn brake() -> Result<(), Fault>;
}

/// Measures nothing; its disarm callback takes its time.
#[derive(Debug)]
pub(crate) struct Brake<B>(PhantomData<B>);

impl<B: Brakes> Sensor for Brake<B> {
    type Options = NoOptions;
    type Output = Number;

    fn init(_: NoOptions, context: &SensorContext) -> Result<Self, Fault> {
        context.on_disarm(B::brake);
        Ok(Self(PhantomData))
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Number>, Fault> {
        Ok(Reading::nothing())
    }
}
