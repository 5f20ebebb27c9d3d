//! Threads that run user code which no thread of its own runs: turns of islands, commands, wakers.
//!
//! Each job may block for ever. A job that waits while every thread is busy gets a new thread, so that a blocked one delays
//! it by a few milliseconds; up to a bound, beyond which the robot reports that jobs wait.

use std::collections::VecDeque;
use std::fmt;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// A job. It catches the panics of user code itself.
pub(crate) type Job = Box<dyn FnOnce() + Send>;

/// Threads that are started without a wait.
const READY: usize = 2;

/// Threads that may be blocked at once; jobs beyond wait until one returns.
const MOST: usize = 512;

/// How long a job waits for a thread before another one is started.
const PATIENCE: Duration = Duration::from_millis(2);

/// How long a thread beyond [`READY`] stays without work.
const IDLE_FOR: Duration = Duration::from_secs(5);

/// The threads of one robot. Clones are the same pool; it ends with [`Pool::close`].
#[derive(Clone)]
pub(crate) struct Pool(Arc<Shared>);

struct Shared {
    state: Mutex<State>,
    arrived: Condvar,
    /// Tells the thread that keeps time that a job waits.
    alarm: Box<dyn Fn() + Send + Sync>,
}

#[derive(Default)]
struct State {
    jobs: VecDeque<(Instant, Job)>,
    threads: usize,
    idle: usize,
    is_closed: bool,
}

impl Pool {
    /// A pool without threads yet. `alarm` is called when a job has to wait: someone then calls [`Pool::relieve`].
    pub(crate) fn new(alarm: impl Fn() + Send + Sync + 'static) -> Self {
        Self(Arc::new(Shared { state: Mutex::default(), arrived: Condvar::new(), alarm: Box::new(alarm) }))
    }

    /// Starts the threads that are always there. A thread inherits priority and cores from the one that starts it, and a
    /// real-time worker may be the first to submit a job.
    pub(crate) fn start(&self) {
        for _ in 0..READY {
            self.start_thread(self.0.lock());
        }
    }

    pub(crate) fn submit(&self, job: impl FnOnce() + Send + 'static) {
        let mut state = self.0.lock();
        state.jobs.push_back((Instant::now(), Box::new(job)));
        // Of the threads without work, some have been told of jobs that wait.
        if state.idle >= state.jobs.len() {
            drop(state);
            self.0.arrived.notify_one();
        } else if state.threads < READY {
            self.start_thread(state);
        } else {
            drop(state);
            (self.0.alarm)();
        }
    }

    /// Starts a thread if the first job has waited for too long; when to look again, if one waits.
    pub(crate) fn relieve(&self) -> Option<Duration> {
        let state = self.0.lock();
        let waited = state.jobs.front()?.0.elapsed();
        if waited < PATIENCE {
            return Some(PATIENCE - waited);
        }
        if state.threads < MOST {
            self.start_thread(state);
        }
        Some(PATIENCE)
    }

    /// Runs what waits, on threads that end once nothing does.
    pub(crate) fn close(&self) {
        self.0.lock().is_closed = true;
        self.0.arrived.notify_all();
    }

    fn start_thread(&self, mut state: MutexGuard<'_, State>) {
        let number = state.threads;
        state.threads += 1;
        drop(state);
        let shared = Arc::clone(&self.0);
        let spawned = std::thread::Builder::new().name(format!("pool {number}")).spawn(move || shared.work());
        if let Err(error) = spawned {
            // The threads there are go on; the next look tries again.
            self.0.lock().threads -= 1;
            tracing::error!(%error, "no thread for the pool");
        }
    }
}

impl Shared {
    fn work(&self) {
        let mut state = self.lock();
        loop {
            if let Some((_, job)) = state.jobs.pop_front() {
                drop(state);
                job();
                state = self.lock();
                continue;
            }
            if state.is_closed {
                break;
            }
            state.idle += 1;
            let (back, wait) = self.arrived.wait_timeout(state, IDLE_FOR).unwrap_or_else(PoisonError::into_inner);
            state = back;
            state.idle -= 1;
            if wait.timed_out() && state.jobs.is_empty() && state.threads > READY {
                break;
            }
        }
        state.threads -= 1;
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl fmt::Debug for Pool {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let state = self.0.lock();
        f.debug_struct("Pool").field("threads", &state.threads).field("jobs", &state.jobs.len()).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc;

    #[test]
    fn blocked_jobs_do_not_keep_others_from_running() {
        let pool = Pool::new(|| {});
        let (release, blocked) = mpsc::channel::<()>();
        let blocked = Arc::new(Mutex::new(blocked));
        for _ in 0..50 {
            let blocked = Arc::clone(&blocked);
            pool.submit(move || {
                let _ = blocked.lock().map(|blocked| blocked.recv());
            });
        }
        let (done, finished) = mpsc::channel();
        pool.submit(move || done.send(()).expect("the test waits"));
        while finished.try_recv().is_err() {
            if let Some(wait) = pool.relieve() {
                std::thread::sleep(wait);
            }
        }
        assert!(pool.0.lock().threads > 50);
        drop(release);
        pool.close();
    }
}
