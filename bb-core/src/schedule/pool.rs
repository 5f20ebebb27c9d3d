//! Threads that run user code which no thread of its own runs: turns of islands, commands, wakers.
//!
//! Each job may block for ever. When jobs wait and no thread has taken one for some milliseconds, another thread is started,
//! so that a blocked job delays others by no more than that. Jobs of the four [`Lane`]s wait apart, and each lane but the
//! robot's own may block so many threads: whatever fills one of them, the others go on, and the full one is reported.

mod crew;

use self::crew::{Crew, Next};
use crate::fault::guarded;
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// A job. It catches and reports the panics of user code itself; another panic ends there.
pub(crate) type Job = Box<dyn FnOnce() + Send>;

/// What a job is for. Lanes are served in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Lane {
    /// Commands that disarm the robot, or that a change of health has started.
    Safety,
    /// Turns of islands, orders to actuators, lines for loggers: as many may block as the robot has components.
    Robot,
    /// All other commands.
    Commands,
    /// Wakers, and values that are dropped.
    Wakers,
}

impl Lane {
    const ALL: [Self; 4] = [Self::Safety, Self::Robot, Self::Commands, Self::Wakers];

    /// How many of its jobs may run at once; others wait until one returns.
    const fn most(self) -> usize {
        match self {
            Self::Safety => 64,
            Self::Robot => usize::MAX,
            Self::Commands | Self::Wakers => 512,
        }
    }

    /// Its jobs, for a report.
    const fn jobs(self) -> &'static str {
        match self {
            Self::Safety => "commands that disarm, or that health has started",
            Self::Robot => "turns",
            Self::Commands => "commands",
            Self::Wakers => "wakers",
        }
    }
}

/// Threads that are always there.
const READY: usize = 2;

/// How long a lane is full, and jobs of it wait, before that is reported.
const FULL_AFTER: Duration = Duration::from_secs(1);

/// The threads of one robot. Clones are the same pool; it ends with [`Pool::close`].
#[derive(Clone)]
pub(crate) struct Pool(Arc<Shared>);

struct Shared {
    state: Mutex<Crew>,
    /// How long a thread beyond [`READY`] stays without work.
    idle_for: Duration,
    /// Tells the thread that keeps time that a job waits.
    alarm: Box<dyn Fn() + Send + Sync>,
}

impl Pool {
    /// A pool without threads yet. `alarm` is called when a job has to wait: someone then calls [`Pool::relieve`].
    pub(crate) fn new(alarm: impl Fn() + Send + Sync + 'static) -> Self {
        Self::with_idle_time(Duration::from_secs(5), alarm)
    }

    fn with_idle_time(idle_for: Duration, alarm: impl Fn() + Send + Sync + 'static) -> Self {
        Self(Arc::new(Shared { state: Mutex::default(), idle_for, alarm: Box::new(alarm) }))
    }

    /// Starts the threads that are always there. A thread inherits priority and cores from the one that starts it, and a
    /// real-time worker may be the first to submit a job.
    pub(crate) fn start(&self) {
        for _ in 0..READY {
            self.start_thread(self.0.lock());
        }
    }

    pub(crate) fn submit(&self, lane: Lane, job: impl FnOnce() + Send + 'static) {
        let mut crew = self.0.lock();
        crew.add(lane, Box::new(job), Instant::now());
        if let Some(thread) = crew.take_idle() {
            drop(crew);
            thread.unpark();
        } else if crew.threads() < READY {
            self.start_thread(crew);
        } else if crew.may_take() {
            drop(crew);
            (self.0.alarm)();
        }
    }

    /// Starts a thread if jobs wait and those there are take none; when to look again, if jobs wait.
    pub(crate) fn relieve(&self) -> Option<Duration> {
        let mut crew = self.0.lock();
        let wait = crew.wait(Instant::now())?;
        if let Some(thread) = crew.take_idle() {
            thread.unpark();
            return Some(crew::PATIENCE);
        }
        if wait.is_zero() {
            self.start_thread(crew);
            return Some(crew::PATIENCE);
        }
        Some(wait)
    }

    /// The next lane that has become full, in words; each time once.
    pub(crate) fn report(&self) -> Option<String> {
        let lane = self.0.lock().newly_full(Instant::now())?;
        let (most, jobs) = (lane.most(), lane.jobs());
        Some(format!("{most} {jobs} have not returned, as many as there are threads for: others wait"))
    }

    /// Runs what waits, on threads that end once nothing does.
    pub(crate) fn close(&self) {
        let idle = self.0.lock().close();
        idle.iter().for_each(std::thread::Thread::unpark);
    }

    fn start_thread(&self, mut crew: MutexGuard<'_, Crew>) {
        let number = crew.start();
        drop(crew);
        let shared = Arc::clone(&self.0);
        let spawned = std::thread::Builder::new().name(format!("pool {number}")).spawn(move || shared.work());
        if let Err(error) = spawned {
            // The threads there are go on; the next look tries again.
            self.0.lock().not_started();
            tracing::error!(%error, "no thread for the pool");
        }
    }
}

impl Shared {
    fn work(&self) {
        let mut crew = self.lock();
        crew.arrive();
        loop {
            match crew.next(Instant::now()) {
                Next::Job(lane, job) => {
                    drop(crew);
                    // A logger that panics, say, which cannot be told so.
                    let _ = guarded(job);
                    crew = self.lock();
                    crew.done(lane);
                }
                Next::End => return crew.leave(),
                Next::Idle => {
                    crew.rest();
                    drop(crew);
                    let start = Instant::now();
                    std::thread::park_timeout(self.idle_for);
                    crew = self.lock();
                    let was_told = crew.rise();
                    if !was_told && start.elapsed() >= self.idle_for && crew.threads() > READY {
                        return crew.leave();
                    }
                }
            }
        }
    }

    fn lock(&self) -> MutexGuard<'_, Crew> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl fmt::Debug for Pool {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Pool").field("threads", &self.0.lock().threads()).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc;

    /// Longer than anything takes that does not hang.
    const LONG: Duration = Duration::from_secs(20);

    /// So many jobs of a lane that block until what is returned is dropped.
    fn block(pool: &Pool, lane: Lane, jobs: usize) -> mpsc::Sender<()> {
        let (release, blocked) = mpsc::channel::<()>();
        let blocked = Arc::new(Mutex::new(blocked));
        for _ in 0..jobs {
            let blocked = Arc::clone(&blocked);
            pool.submit(lane, move || {
                let _ = blocked.lock().map(|blocked| blocked.recv());
            });
        }
        release
    }

    fn relieve_until(pool: &Pool, done: impl Fn() -> bool) {
        let start = Instant::now();
        while !done() {
            assert!(start.elapsed() < LONG, "{pool:?}");
            std::thread::sleep(pool.relieve().unwrap_or(Duration::from_millis(1)));
        }
    }

    #[test]
    fn blocked_jobs_do_not_keep_others_from_running() {
        let pool = Pool::new(|| {});
        let release = block(&pool, Lane::Commands, 50);
        let (done, finished) = mpsc::channel();
        pool.submit(Lane::Commands, move || done.send(()).expect("the test waits"));
        relieve_until(&pool, || finished.try_recv().is_ok());
        assert!(pool.0.lock().threads() > 50);
        drop(release);
        pool.close();
    }

    #[test]
    fn a_job_that_panics_does_not_take_its_thread_with_it() {
        let pool = Pool::new(|| {});
        (0..10).for_each(|_| pool.submit(Lane::Robot, || panic!("of a job")));
        let (done, finished) = mpsc::channel();
        pool.submit(Lane::Robot, move || done.send(()).expect("the test waits"));
        relieve_until(&pool, || finished.try_recv().is_ok());
        relieve_until(&pool, || pool.0.lock().is_unoccupied());
        pool.close();
    }

    #[test]
    fn a_full_lane_is_reported_once_and_keeps_no_other_from_running() {
        let pool = Pool::new(|| {});
        let release = block(&pool, Lane::Safety, Lane::Safety.most() + 3);
        relieve_until(&pool, || pool.0.lock().is_full(Lane::Safety));
        let (done, finished) = mpsc::channel();
        for lane in [Lane::Robot, Lane::Commands, Lane::Wakers] {
            let done = done.clone();
            pool.submit(lane, move || done.send(lane).expect("the test waits"));
            relieve_until(&pool, || finished.try_recv() == Ok(lane));
        }
        let start = Instant::now();
        let mut report = None;
        while report.is_none() && start.elapsed() < LONG {
            report = pool.report();
        }
        let report = report.expect("it is full");
        assert!(report.starts_with("64 commands that disarm"), "{report}");
        assert_eq!((pool.report(), pool.relieve()), (None, None), "nothing that a thread would help");
        drop(release);
        pool.close();
    }

    #[test]
    fn threads_that_are_not_needed_any_more_end_while_others_have_work() {
        let pool = Pool::with_idle_time(Duration::from_millis(100), || {});
        let release = block(&pool, Lane::Commands, 20);
        relieve_until(&pool, || pool.0.lock().threads() >= 20);
        drop(release);
        // A trickle, which would keep all of them busy if it went round.
        let start = Instant::now();
        while pool.0.lock().threads() > READY {
            assert!(start.elapsed() < LONG, "{pool:?}");
            pool.submit(Lane::Robot, || {});
            std::thread::sleep(Duration::from_millis(2));
        }
        pool.close();
    }
}
