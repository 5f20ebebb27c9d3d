//! Threads for disarm callbacks, which are started before they are needed.
//!
//! Each callback of a component has a [`Reserved`] from its registration until it is dropped, and there are at least as many threads as
//! places. So all of these callbacks run at once, even if no thread can be started any more and some of them hang. Other callbacks have
//! a [`Reserve`] of their own with one place, since there may be any number of them: they get further threads when they are submitted,
//! and if none can be started, they wait for the next of these threads that becomes free.

use crate::fault::guarded;
#[cfg(not(loom))]
use crate::fault::lock;
#[cfg(not(loom))]
use std::collections::VecDeque;
use std::sync::Arc;
#[cfg(not(loom))]
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// Code to run on a thread, see the [module](self).
type Job = Box<dyn FnOnce() + Send>;

/// The threads of one robot. They end when there are more of them than places.
#[derive(Clone, Default)]
pub(crate) struct Reserve(Arc<Shared>);

#[cfg(not(loom))]
#[derive(Default)]
struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

/// A model starts a thread for each job.
#[cfg(loom)]
#[derive(Default)]
struct Shared;

#[cfg(not(loom))]
#[derive(Default)]
struct State {
    jobs: VecDeque<Job>,
    places: usize,
    threads: usize,
    /// Threads that take the next job, among them those that do not run yet.
    free: usize,
}

/// A thread that is kept for one callback.
pub(crate) struct Reserved(Reserve);

#[cfg(not(loom))]
impl Reserve {
    /// Keeps one more thread.
    pub(crate) fn place(&self) -> std::io::Result<Reserved> {
        let mut state = lock(&self.0.state);
        state.places += 1;
        let place = Reserved(self.clone());
        if state.threads < state.places {
            self.start(state)?;
        }
        Ok(place)
    }

    /// Runs a job on a thread of its own.
    pub(crate) fn run(&self, job: Job) {
        let mut state = lock(&self.0.state);
        state.jobs.push_back(job);
        if state.jobs.len() <= state.free {
            self.0.changed.notify_one();
        } else {
            // Without one, it is taken by the next thread that returns.
            let _ = self.start(state);
        }
    }

    fn start(&self, mut state: MutexGuard<'_, State>) -> std::io::Result<()> {
        state.threads += 1;
        state.free += 1;
        drop(state);
        let reserve = self.clone();
        let started = super::start_thread("disarm", Box::new(move || reserve.work()));
        started.map(drop).inspect_err(|_| {
            let mut state = lock(&self.0.state);
            state.threads -= 1;
            state.free -= 1;
        })
    }

    fn work(&self) {
        let mut state = lock(&self.0.state);
        loop {
            if let Some(job) = state.jobs.pop_front() {
                state.free -= 1;
                drop(state);
                // A callback's own panics are caught where it is called.
                let _ = guarded(job);
                state = lock(&self.0.state);
                state.free += 1;
            } else if state.threads > state.places {
                state.threads -= 1;
                state.free -= 1;
                return;
            } else {
                state = self.0.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
            }
        }
    }

    /// The number of threads that take the next job.
    #[cfg(test)]
    pub(crate) fn free(&self) -> usize {
        lock(&self.0.state).free
    }
}

#[cfg(loom)]
impl Reserve {
    pub(crate) fn place(&self) -> std::io::Result<Reserved> {
        Ok(Reserved(self.clone()))
    }

    pub(crate) fn run(&self, job: Job) {
        loom::thread::spawn(move || guarded(job));
    }
}

impl Drop for Reserved {
    fn drop(&mut self) {
        #[cfg(not(loom))]
        {
            lock(&self.0.0.state).places -= 1;
            self.0.0.changed.notify_one();
        }
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use std::sync::mpsc;
    use std::time::{Duration, Instant};

    /// Longer than anything takes unless it hangs.
    const LONG: Duration = Duration::from_secs(20);

    fn threads(reserve: &Reserve, count: usize) {
        let start = Instant::now();
        while lock(&reserve.0.state).threads != count {
            assert!(start.elapsed() < LONG, "{} threads", lock(&reserve.0.state).threads);
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn there_are_as_many_threads_as_places_and_jobs_and_none_is_left_behind() {
        let reserve = Reserve::default();
        let mut places: Vec<_> = (0..3).map(|_| reserve.place().expect("there are threads")).collect();
        assert_eq!(lock(&reserve.0.state).threads, 3, "before any job");
        let (release, blocked) = mpsc::channel::<()>();
        let blocked = Arc::new(Mutex::new(blocked));
        let (started, running) = mpsc::channel();
        for number in 0..5 {
            let (started, blocked) = (started.clone(), Arc::clone(&blocked));
            reserve.run(Box::new(move || {
                started.send(number).expect("the test waits");
                drop(blocked.lock().map(|blocked| blocked.recv()));
                assert!(number != 1, "a job that panics");
            }));
        }
        let mut begun: Vec<_> = (0..5).map(|_| running.recv_timeout(LONG).expect("all run at once")).collect();
        begun.sort_unstable();
        assert_eq!((begun, lock(&reserve.0.state).threads), (vec![0, 1, 2, 3, 4], 5));
        drop(release);
        threads(&reserve, 3);
        places.pop();
        threads(&reserve, 2);
        drop(places);
        threads(&reserve, 0);
        assert_eq!(lock(&reserve.0.state).free, 0);
    }
}
