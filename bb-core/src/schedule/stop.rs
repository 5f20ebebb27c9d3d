//! Tells the threads of a robot to stop, and wakes those that sleep.

use crate::fault::lock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::Thread;
use std::time::Duration;

/// Signal that the robot's sensors and services are to stop. Each sleeping thread is parked separately, so thousands of them do not
/// contend for one lock.
#[derive(Clone, Debug, Default)]
pub(crate) struct StopSignal(Arc<Shared>);

#[derive(Debug, Default)]
struct Shared {
    is_set: AtomicBool,
    threads: Mutex<Vec<Thread>>,
}

impl StopSignal {
    /// The calling thread is woken when the signal is set.
    pub(crate) fn register(&self) {
        lock(&self.0.threads).push(std::thread::current());
    }

    pub(crate) fn set(&self) {
        self.0.is_set.store(true, Ordering::SeqCst);
        for thread in &*lock(&self.0.threads) {
            thread.unpark();
        }
    }

    pub(crate) fn is_set(&self) -> bool {
        self.0.is_set.load(Ordering::SeqCst)
    }

    /// Sleeps for `duration`, until the signal is set, or until the thread is unparked. The thread must have
    /// registered.
    pub(crate) fn sleep(&self, duration: Duration) {
        if !self.is_set() {
            std::thread::park_timeout(duration);
        }
    }
}
