//! Model-checks every order in which threads meet in a pool: `RUSTFLAGS="--cfg loom"`.
//!
//! In each order, every job that a thread may take runs, even while others hang, and the timekeeper looks only when
//! it was told or jobs wait. Without being told, it would wait forever, and the model would find that. There is one
//! permanent thread, and one command may run at once.

use super::threads::{Run, spawn};
use super::{Lane, Pool};
use loom::sync::{Arc, Condvar, Mutex};
use loom::thread;
use std::time::{Duration, Instant};

/// State that the threads share.
#[derive(Default)]
struct Shared {
    /// A job waits.
    is_rung: bool,
    /// Jobs that have run.
    done: usize,
    /// Jobs that hang may return.
    is_released: bool,
}

#[derive(Clone)]
struct Model {
    pool: Pool,
    shared: Arc<(Mutex<Shared>, Condvar)>,
}

impl Model {
    /// The first `failing` attempts to start a thread fail.
    fn new(failing: usize) -> Self {
        let shared: Arc<(Mutex<Shared>, Condvar)> = Arc::new((Mutex::new(Shared::default()), Condvar::new()));
        let rung = Arc::clone(&shared);
        let alarm = move || tell(&rung, |shared| shared.is_rung = true);
        let left = std::sync::atomic::AtomicUsize::new(failing);
        let spawn = move |name: String, run: Run| {
            use std::sync::atomic::Ordering::Relaxed;
            let fails = left.fetch_update(Relaxed, Relaxed, |left| left.checked_sub(1)).is_ok();
            if fails { Err(std::io::Error::other("too many")) } else { spawn(name, run) }
        };
        Self { pool: Pool::with(Duration::ZERO, alarm, spawn), shared }
    }

    fn quick(&self, lane: Lane) {
        let shared = Arc::clone(&self.shared);
        self.pool.submit(lane, move || tell(&shared, |shared| shared.done += 1));
    }

    /// A job that hangs until the end.
    fn hanging(&self, lane: Lane) {
        let shared = Arc::clone(&self.shared);
        self.pool.submit(lane, move || {
            let mut state = shared.0.lock().expect("nobody panicked");
            while !state.is_released {
                state = shared.1.wait(state).expect("nobody panicked");
            }
        });
    }

    /// Keeps time until this many jobs have run, as the runtime does: it looks while jobs wait, and otherwise when
    /// told.
    fn keep_time_until(&self, done: usize) {
        // Any time that a thread may have left is over.
        let late = Instant::now() + Duration::from_secs(3600);
        loop {
            let waits = self.pool.relieve_at(late).is_some();
            let mut shared = self.shared.0.lock().expect("nobody panicked");
            if shared.done >= done {
                return;
            }
            if waits {
                drop(shared);
                thread::yield_now();
                continue;
            }
            while !shared.is_rung && shared.done < done {
                shared = self.shared.1.wait(shared).expect("nobody panicked");
            }
            shared.is_rung = false;
        }
    }

    /// All threads end.
    fn end(&self) {
        tell(&self.shared, |shared| shared.is_released = true);
        self.pool.close();
    }
}

fn tell(shared: &(Mutex<Shared>, Condvar), tell: impl FnOnce(&mut Shared)) {
    tell(&mut shared.0.lock().expect("nobody panicked"));
    shared.1.notify_all();
}

/// Runs `run` in all orders with at most this many preemptions, where the first `failing` attempts to start a thread
/// fail.
fn check(preemptions: usize, failing: usize, run: fn(&Model)) {
    let mut checker = loom::model::Builder::new();
    checker.preemption_bound = Some(preemptions);
    checker.check(move || run(&Model::new(failing)));
}

/// The first two start a thread at once.
#[test]
fn two_jobs_while_the_first_thread_starts() {
    check(3, 0, |model| {
        let other = model.clone();
        let submits = thread::spawn(move || other.quick(Lane::User));
        model.quick(Lane::Robot);
        model.keep_time_until(2);
        submits.join().expect("it does not panic");
        model.end();
    });
}

#[test]
fn a_job_while_the_last_thread_without_work_goes_away() {
    check(2, 0, |model| {
        model.hanging(Lane::Robot);
        // Another thread takes it, and ends after it has waited for long enough.
        model.quick(Lane::Robot);
        model.keep_time_until(1);
        model.quick(Lane::User);
        model.keep_time_until(2);
        model.end();
    });
}

#[test]
fn a_job_from_another_thread_while_one_that_hangs_is_relieved() {
    check(2, 0, |model| {
        let other = model.clone();
        let submits = thread::spawn(move || other.hanging(Lane::Robot));
        model.quick(Lane::Robot);
        model.keep_time_until(1);
        submits.join().expect("it does not panic");
        model.quick(Lane::User);
        model.keep_time_until(2);
        model.end();
    });
}

#[test]
fn jobs_while_no_thread_can_be_started() {
    check(2, 2, |model| {
        let other = model.clone();
        let submits = thread::spawn(move || other.quick(Lane::Robot));
        model.quick(Lane::User);
        model.keep_time_until(2);
        submits.join().expect("it does not panic");
        model.end();
    });
}

/// The thread whose command returns takes the turn, which hangs: the other command needs another thread.
#[test]
fn a_job_of_a_full_lane_that_has_room_again() {
    check(2, 0, |model| {
        model.quick(Lane::Commands);
        model.quick(Lane::Commands);
        model.hanging(Lane::Robot);
        model.keep_time_until(2);
        model.end();
    });
}

/// Jobs at the end of a pool, after which nobody keeps time.
#[test]
fn jobs_around_the_end_while_a_thread_hangs() {
    check(2, 0, |model| {
        model.hanging(Lane::Robot);
        let other = model.clone();
        let submits = thread::spawn(move || other.quick(Lane::User));
        model.pool.close();
        submits.join().expect("it does not panic");
        let mut shared = model.shared.0.lock().expect("nobody panicked");
        while shared.done < 1 {
            shared = model.shared.1.wait(shared).expect("nobody panicked");
        }
        shared.is_released = true;
        drop(shared);
        model.shared.1.notify_all();
    });
}
