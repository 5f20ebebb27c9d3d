//! Code that may hang, on threads of its own: what hangs is not started again before it has returned.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, mpsc};
use std::time::{Duration, Instant};

/// At most one thread for each key. Clones are the same.
#[derive(Clone)]
pub(crate) struct Solo<K>(Arc<Shared<K>>);

struct Shared<K> {
    running: Mutex<Vec<Running<K>>>,
    changed: Condvar,
}

struct Running<K> {
    key: K,
    since: Instant,
    is_reported: bool,
}

/// Why there is no result.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Missed {
    /// It has not returned in time, and is left behind.
    Late,
    /// It was not run, since that of the same key which was left behind has not returned; `is_new` the first time.
    Hangs { is_new: bool },
    /// It was not run: there is no thread to be had.
    NoThread,
}

impl<K> Default for Solo<K> {
    fn default() -> Self {
        Self(Arc::new(Shared { running: Mutex::new(Vec::new()), changed: Condvar::new() }))
    }
}

impl<K: Copy + Eq + Send + 'static> Solo<K> {
    /// Runs `run` on a thread of that name, and waits for it, `longest` at most. One of the same key that runs already is
    /// waited for as long.
    pub(crate) fn run<T: Send + 'static>(
        &self,
        key: K,
        name: String,
        longest: Duration,
        run: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, Missed> {
        self.begin(key, longest)?;
        let (returned, waits) = mpsc::channel();
        let begun = Begun { solo: self.clone(), key };
        let thread = std::thread::Builder::new().name(name).spawn(move || {
            let result = run();
            drop(begun);
            let _ = returned.send(result);
        });
        if thread.is_err() {
            return Err(Missed::NoThread);
        }
        waits.recv_timeout(longest).map_err(|_| Missed::Late)
    }

    fn begin(&self, key: K, longest: Duration) -> Result<(), Missed> {
        let mut running = self.lock();
        loop {
            let Some(earlier) = running.iter_mut().find(|other| other.key == key) else {
                running.push(Running { key, since: Instant::now(), is_reported: false });
                return Ok(());
            };
            let left = longest.saturating_sub(earlier.since.elapsed());
            if left.is_zero() {
                let is_new = !std::mem::replace(&mut earlier.is_reported, true);
                return Err(Missed::Hangs { is_new });
            }
            running = self.0.changed.wait_timeout(running, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    fn lock(&self) -> MutexGuard<'_, Vec<Running<K>>> {
        self.0.running.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// It runs as long as this lives.
struct Begun<K: Copy + Eq + Send + 'static> {
    solo: Solo<K>,
    key: K,
}

impl<K: Copy + Eq + Send + 'static> Drop for Begun<K> {
    fn drop(&mut self) {
        self.solo.lock().retain(|running| running.key != self.key);
        self.solo.0.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHORT: Duration = Duration::from_millis(20);
    const LONG: Duration = Duration::from_secs(20);

    #[test]
    fn what_hangs_is_not_started_again_before_it_has_returned() {
        let solo = Solo::default();
        let (release, hang) = mpsc::channel::<()>();
        let run = |key, run: Box<dyn FnOnce() -> u32 + Send>| solo.run(key, "solo".into(), SHORT, run);
        let hangs = Box::new(move || {
            let _ = hang.recv();
            1
        });
        assert_eq!(run('a', hangs), Err(Missed::Late));
        assert_eq!(run('a', Box::new(|| 2)), Err(Missed::Hangs { is_new: true }));
        assert_eq!(run('a', Box::new(|| 3)), Err(Missed::Hangs { is_new: false }));
        assert_eq!(solo.run('b', "solo".into(), LONG, || 4), Ok(4));
        drop(release);
        let start = Instant::now();
        while solo.run('a', "solo".into(), LONG, || 5) != Ok(5) {
            assert!(start.elapsed() < LONG);
        }
    }

    #[test]
    fn one_that_runs_is_waited_for() {
        let solo = Solo::default();
        let sum = Arc::new(Mutex::new(0));
        std::thread::scope(|scope| {
            for _ in 0..8 {
                let (solo, sum) = (solo.clone(), Arc::clone(&sum));
                scope.spawn(move || {
                    let add = move || *sum.lock().expect("it does not panic") += 1;
                    assert_eq!(solo.run((), "solo".into(), LONG, add), Ok(()));
                });
            }
        });
        assert_eq!(*sum.lock().expect("it does not panic"), 8);
    }
}
