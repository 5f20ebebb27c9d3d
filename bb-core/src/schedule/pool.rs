//! A pool of threads for user code without its own thread: turns of islands, commands, wakers.
//!
//! A job may block forever. When jobs wait and no thread has taken one for some milliseconds, another thread is
//! started, so a blocked job delays others by no more than that. Each [`Lane`] has its own queue, and each lane but
//! the robot's own has a limit on blocked threads. A full lane is reported and does not hold up the others.

mod crew;
#[cfg(all(test, loom))]
mod model;
mod threads;

use self::crew::{Call, Crew, Next};
use self::threads::{Mutex, MutexGuard, Run, Spawn};
use crate::fault::guarded;
use std::fmt;
use std::sync::{Arc, PoisonError};
use std::time::{Duration, Instant};

/// A job. It catches and reports panics of user code itself; any other panic ends here.
pub(crate) type Job = Box<dyn FnOnce() + Send>;

/// The purpose of a job. Lanes are served in this order, except for jobs that have waited for long.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Lane {
    /// Commands that disarm the robot, or that a change of health has started: no other code takes their threads.
    Safety,
    /// Turns of islands, orders to actuators, lines for loggers: as many may block as the robot has components.
    Robot,
    /// All other commands.
    Commands,
    /// Wakers, and values that are dropped, among them the futures of cancelled commands.
    User,
}

impl Lane {
    const ALL: [Self; 4] = [Self::Safety, Self::Robot, Self::Commands, Self::User];

    /// The largest number of the lane's jobs that run at once; others wait until one returns.
    const fn most(self) -> usize {
        match self {
            // The model checker has room for few threads.
            Self::Commands if cfg!(loom) => 1,
            Self::Robot => usize::MAX,
            Self::Safety | Self::Commands | Self::User => 512,
        }
    }

    /// The name of the lane's jobs, for a report.
    const fn jobs(self) -> &'static str {
        match self {
            Self::Safety => "commands that disarm or that health has started",
            Self::Robot => "turns",
            Self::Commands => "commands",
            Self::User => "wakers and values that were dropped",
        }
    }
}

/// Number of permanent threads.
const READY: usize = if cfg!(loom) { 1 } else { 2 };

/// Time for which a lane must be full, with jobs waiting, before that is reported.
const FULL_AFTER: Duration = Duration::from_secs(1);

/// The threads of one robot. Clones are the same pool; it ends with [`Pool::close`].
#[derive(Clone)]
pub(crate) struct Pool(Arc<Shared>);

struct Shared {
    state: Mutex<Crew>,
    /// Time for which a thread beyond [`READY`] stays without work.
    idle_for: Duration,
    /// Notifies the timekeeper's thread that a job waits.
    alarm: Box<dyn Fn() + Send + Sync>,
    spawn: Box<Spawn>,
}

impl Pool {
    /// A pool without threads yet. `alarm` is called when a job has to wait; its receiver then calls [`Pool::relieve`].
    pub(crate) fn new(alarm: impl Fn() + Send + Sync + 'static) -> Self {
        Self::with(Duration::from_secs(5), alarm, threads::spawn)
    }

    fn with(
        idle_for: Duration,
        alarm: impl Fn() + Send + Sync + 'static,
        spawn: impl Fn(String, Run) -> std::io::Result<()> + Send + Sync + 'static,
    ) -> Self {
        let state = Mutex::new(Crew::default());
        Self(Arc::new(Shared { state, idle_for, alarm: Box::new(alarm), spawn: Box::new(spawn) }))
    }

    /// Starts the permanent threads. A thread inherits priority and cores from its parent, and the first job may be
    /// submitted by a real-time worker.
    pub(crate) fn start(&self) {
        for _ in 0..READY {
            self.start_thread(self.0.lock());
        }
    }

    pub(crate) fn submit(&self, lane: Lane, job: impl FnOnce() + Send + 'static) {
        let mut crew = self.0.lock();
        crew.add(lane, Box::new(job), Instant::now());
        self.call(crew);
    }

    /// Starts a thread if jobs wait and no existing thread takes one. Returns the time until the next call, if jobs wait.
    pub(crate) fn relieve(&self) -> Option<Duration> {
        self.relieve_at(Instant::now())
    }

    fn relieve_at(&self, now: Instant) -> Option<Duration> {
        let mut crew = self.0.lock();
        let wait = crew.wait(now)?;
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

    /// Describes the next lane that has become full, or a failure to start threads; each is reported once.
    pub(crate) fn report(&self) -> Option<String> {
        let mut crew = self.0.lock();
        if let Some(error) = crew.newly_without_thread() {
            return Some(format!("no thread can be started, and jobs wait: {error}"));
        }
        let lane = crew.newly_full(Instant::now())?;
        let (most, jobs) = (lane.most(), lane.jobs());
        Some(format!("{most} {jobs} have not returned, as many as there are threads for: others wait"))
    }

    /// Waits until a lane is empty, until `deadline` at most; otherwise describes the remaining jobs.
    pub(crate) fn left(&self, lane: Lane, deadline: Instant) -> Option<String> {
        loop {
            let left = self.0.lock().left(lane);
            if left == 0 {
                return None;
            }
            if Instant::now() >= deadline {
                return Some(format!("{} that have not returned: {left}", lane.jobs()));
            }
            std::thread::sleep(Duration::from_micros(100));
        }
    }

    /// Runs the waiting jobs, on threads that end once none is left. There is no timekeeper any more.
    pub(crate) fn close(&self) {
        let mut crew = self.0.lock();
        let idle = crew.close();
        self.call(crew);
        idle.iter().for_each(threads::Thread::unpark);
    }

    /// Wakes or starts a thread for the jobs that may be taken.
    fn call(&self, mut crew: MutexGuard<'_, Crew>) {
        match crew.call() {
            Call::Nobody => {}
            Call::Thread(thread) => {
                drop(crew);
                thread.unpark();
            }
            Call::NewThread => self.start_thread(crew),
            Call::Timekeeper => {
                drop(crew);
                (self.0.alarm)();
            }
        }
    }

    /// Starts a thread. Nothing is logged here: jobs may be submitted under a lock of the robot, and the timekeeper must not block.
    fn start_thread(&self, mut crew: MutexGuard<'_, Crew>) {
        let number = crew.start();
        drop(crew);
        let pool = self.clone();
        if let Err(error) = (self.0.spawn)(format!("pool {number}"), Box::new(move || pool.work())) {
            // The existing threads go on; the timekeeper tries again.
            self.0.lock().not_started(error, Instant::now());
            (self.0.alarm)();
        }
    }

    fn work(&self) {
        let mut crew = self.0.lock();
        crew.arrive();
        let mut has_room = false;
        loop {
            match crew.next(Instant::now()) {
                Next::Job(lane, job) => {
                    if has_room || crew.is_closed() {
                        self.call(crew);
                    } else {
                        drop(crew);
                    }
                    // For example, a panic of a logger, which cannot be reported through that logger.
                    let _ = guarded(job);
                    crew = self.0.lock();
                    has_room = crew.done(lane);
                }
                Next::End => return crew.leave(),
                Next::Idle => {
                    has_room = false;
                    let longest = crew.rest(self.0.idle_for);
                    drop(crew);
                    let was_long = threads::park(longest);
                    crew = self.0.lock();
                    let was_notified = crew.rise();
                    if was_long && !was_notified && crew.threads() > READY && !crew.may_take() {
                        return crew.leave();
                    }
                }
            }
        }
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Crew> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl fmt::Debug for Pool {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Pool").field("threads", &self.0.lock().threads()).finish_non_exhaustive()
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::sync::mpsc;

    /// Longer than anything takes unless it hangs.
    const LONG: Duration = Duration::from_secs(20);

    /// Submits this many jobs to a lane; they block until the returned value is dropped.
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
        let release = block(&pool, Lane::Commands, Lane::Commands.most() + 3);
        relieve_until(&pool, || pool.0.lock().is_full(Lane::Commands));
        let (done, finished) = mpsc::channel();
        for lane in [Lane::Safety, Lane::Robot, Lane::User] {
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
        assert!(report.starts_with("512 commands have not returned"), "{report}");
        assert_eq!((pool.report(), pool.relieve()), (None, None), "nothing that a thread would help");
        drop(release);
        pool.close();
    }

    #[test]
    fn threads_that_are_not_needed_any_more_end_while_others_have_work() {
        let pool = Pool::with(Duration::from_millis(100), || {}, threads::spawn);
        let release = block(&pool, Lane::Commands, 20);
        relieve_until(&pool, || pool.0.lock().threads() >= 20);
        drop(release);
        // A trickle of jobs, which would keep all of them busy if it were spread over them.
        let start = Instant::now();
        while pool.0.lock().threads() > READY {
            assert!(start.elapsed() < LONG, "{pool:?}");
            pool.submit(Lane::Robot, || {});
            std::thread::sleep(Duration::from_millis(2));
        }
        pool.close();
    }

    #[test]
    fn jobs_run_once_there_are_threads_again() {
        let (can_start, alarms) = (Arc::new(AtomicBool::new(false)), mpsc::channel());
        let (can, tell) = (Arc::clone(&can_start), std::sync::Mutex::new(alarms.0));
        let spawn = move |name, run| match can.load(Ordering::SeqCst) {
            true => threads::spawn(name, run),
            false => Err(std::io::Error::other("too many")),
        };
        let alarm = move || drop(tell.lock().map(|tell| tell.send(())));
        let pool = Pool::with(Duration::from_secs(5), alarm, spawn);
        pool.start();
        let (done, finished) = mpsc::channel();
        pool.submit(Lane::Robot, move || done.send(()).expect("the test waits"));
        assert!(alarms.1.try_recv().is_ok(), "the thread that keeps time tries again");
        let report = pool.report().expect("there is no thread");
        assert_eq!(report, "no thread can be started, and jobs wait: too many");
        assert_eq!(pool.report(), None, "it is said once");
        can_start.store(true, Ordering::SeqCst);
        relieve_until(&pool, || finished.try_recv().is_ok());
        pool.close();
    }

    #[test]
    fn after_the_end_what_waits_runs_though_all_threads_hang() {
        let pool = Pool::new(|| {});
        let before = block(&pool, Lane::Commands, 10);
        pool.close();
        let after = block(&pool, Lane::User, 10);
        let (done, finished) = mpsc::channel();
        pool.submit(Lane::User, move || done.send(()).expect("the test waits"));
        assert_eq!(finished.recv_timeout(LONG), Ok(()));
        drop((before, after));
    }
}
