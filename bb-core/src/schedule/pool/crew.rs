//! The waiting jobs, and the threads that take them.

use super::threads::{Thread, current};
use super::{FULL_AFTER, Job, Lane, READY};
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Time for which jobs wait without any being started before another thread is started.
pub(super) const PATIENCE: Duration = Duration::from_millis(2);

/// Time for which jobs of a later lane wait before they overtake those of an earlier one.
const OVERDUE: Duration = Duration::from_millis(50);

/// Delay before another attempt to start a thread after one failed.
const RETRY: Duration = Duration::from_millis(20);

/// The jobs and the threads of a pool.
///
/// Every job that a thread may take is taken. When there is one, [`Crew::call`] returns which thread to notify: an
/// idle one, then counted as starting until it looks, or else the timekeeper. The timekeeper looks as long as jobs wait,
/// and starts a thread unless one is starting or jobs were taken lately. `call` runs when a job was added, when a
/// job of a full lane returned, and when no thread could be started. A thread that runs out of work looks once more
/// before it ends, under the same lock.
#[derive(Default)]
pub(super) struct Crew {
    lanes: [Queue; Lane::ALL.len()],
    threads: usize,
    /// Threads that were started or notified of a job and do not run yet. While there are any, the machine is busy, and
    /// one more would not help.
    starting: usize,
    /// Idle threads, the most recently active last. That one takes the next job, so those at the front can end.
    idle: Vec<Thread>,
    /// Time at which a thread last started a job. While jobs are being started, the others wait because the machine is busy.
    last_job: Option<Instant>,
    /// The last attempt to start a thread failed.
    without_thread: Option<WithoutThread>,
    is_closed: bool,
}

/// The jobs of one lane.
#[derive(Default)]
struct Queue {
    waiting: VecDeque<(Instant, Job)>,
    running: usize,
    /// Time since which all of the lane's threads are busy while a job waits.
    full_since: Option<Instant>,
    is_reported: bool,
}

/// No thread could be started.
struct WithoutThread {
    error: std::io::Error,
    tried: Instant,
    is_reported: bool,
}

/// Next action of a thread.
pub(super) enum Next {
    Job(Lane, Job),
    Idle,
    /// The pool was closed, and nothing waits.
    End,
}

/// The threads to notify of jobs.
pub(super) enum Call {
    Nobody,
    Thread(Thread),
    NewThread,
    Timekeeper,
}

impl Crew {
    pub(super) fn add(&mut self, lane: Lane, job: Job, now: Instant) {
        self.lanes[lane as usize].waiting.push_back((now, job));
    }

    /// The threads to notify of the jobs that may be taken.
    pub(super) fn call(&mut self) -> Call {
        if !self.may_take() {
            return Call::Nobody;
        }
        if let Some(thread) = self.take_idle() {
            return Call::Thread(thread);
        }
        if self.without_thread.is_none() && self.threads < READY {
            return Call::NewThread;
        }
        match (self.is_closed, self.starting) {
            (false, _) => Call::Timekeeper,
            // No thread keeps time any more, but each thread that takes a job checks this again.
            (true, 0) => Call::NewThread,
            (true, _) => Call::Nobody,
        }
    }

    /// The thread to notify of a job.
    pub(super) fn take_idle(&mut self) -> Option<Thread> {
        let thread = if self.may_take() { self.idle.pop() } else { None };
        self.starting += usize::from(thread.is_some());
        thread
    }

    /// Jobs of a lane that have not returned.
    pub(super) fn left(&self, lane: Lane) -> usize {
        let queue = &self.lanes[lane as usize];
        queue.running + queue.waiting.len()
    }

    pub(super) fn threads(&self) -> usize {
        self.threads
    }

    #[cfg(test)]
    pub(super) fn is_full(&self, lane: Lane) -> bool {
        self.lanes[lane as usize].running >= lane.most()
    }

    #[cfg(test)]
    pub(super) fn is_unoccupied(&self) -> bool {
        self.lanes.iter().all(|queue| queue.running == 0 && queue.waiting.is_empty())
    }

    pub(super) fn is_closed(&self) -> bool {
        self.is_closed
    }

    /// Returns whether there is a job that a thread may take.
    pub(super) fn may_take(&self) -> bool {
        Lane::ALL.into_iter().any(|lane| self.front(lane).is_some())
    }

    /// Returns the time since which the first job of a lane waits, if a thread may take it.
    fn front(&self, lane: Lane) -> Option<Instant> {
        let queue = &self.lanes[lane as usize];
        queue.waiting.front().filter(|_| queue.running < lane.most()).map(|(since, _)| *since)
    }

    /// The lane whose first job is taken next: the first lane, unless a job of a later one has waited for too long.
    /// Nothing overtakes the jobs that make the robot safe.
    fn first(&self, now: Instant) -> Option<Lane> {
        if self.front(Lane::Safety).is_some() {
            return Some(Lane::Safety);
        }
        let waiting = || Lane::ALL.into_iter().filter_map(|lane| Some((self.front(lane)?, lane)));
        let oldest = waiting().min_by_key(|(since, _)| *since);
        let overdue = oldest.filter(|(since, _)| now.saturating_duration_since(*since) >= OVERDUE);
        overdue.or_else(|| waiting().next()).map(|(_, lane)| lane)
    }

    /// Returns the time for which the waiting jobs may go on waiting: zero to start a thread now, `None` if that would not help.
    pub(super) fn wait(&self, now: Instant) -> Option<Duration> {
        let since = Lane::ALL.into_iter().filter_map(|lane| self.front(lane)).min()?;
        if self.starting > 0 {
            return Some(PATIENCE);
        }
        if let Some(WithoutThread { tried, .. }) = &self.without_thread {
            return Some(RETRY.saturating_sub(now.saturating_duration_since(*tried)));
        }
        let since = self.last_job.map_or(since, |at| at.max(since));
        Some(PATIENCE.saturating_sub(now.saturating_duration_since(since)))
    }

    /// The next lane that was full for a while and was not reported since.
    pub(super) fn newly_full(&mut self, now: Instant) -> Option<Lane> {
        Lane::ALL.into_iter().find(|lane| {
            let queue = &mut self.lanes[*lane as usize];
            if queue.waiting.is_empty() || queue.running < lane.most() {
                (queue.full_since, queue.is_reported) = (None, false);
                return false;
            }
            let since = *queue.full_since.get_or_insert(now);
            let is_new = now.saturating_duration_since(since) >= FULL_AFTER && !queue.is_reported;
            queue.is_reported |= is_new;
            is_new
        })
    }

    /// Returns the reason for which no thread could be started; each failure once.
    pub(super) fn newly_without_thread(&mut self) -> Option<String> {
        let without = self.without_thread.as_mut().filter(|without| !without.is_reported)?;
        without.is_reported = true;
        Some(without.error.to_string())
    }

    /// Counts a thread that is started; returns its number.
    pub(super) fn start(&mut self) -> usize {
        self.threads += 1;
        self.starting += 1;
        self.threads - 1
    }

    pub(super) fn not_started(&mut self, error: std::io::Error, now: Instant) {
        self.threads -= 1;
        self.starting -= 1;
        let is_reported = self.without_thread.as_ref().is_some_and(|before| before.is_reported);
        self.without_thread = Some(WithoutThread { error, tried: now, is_reported });
    }

    /// A thread that was started runs.
    pub(super) fn arrive(&mut self) {
        self.starting -= 1;
        self.without_thread = None;
    }

    pub(super) fn leave(&mut self) {
        self.threads -= 1;
    }

    pub(super) fn next(&mut self, now: Instant) -> Next {
        let Some(lane) = self.first(now) else { return if self.is_closed { Next::End } else { Next::Idle } };
        let queue = &mut self.lanes[lane as usize];
        match queue.waiting.pop_front() {
            Some((_, job)) => {
                queue.running += 1;
                self.last_job = Some(now);
                Next::Job(lane, job)
            }
            None => Next::Idle,
        }
    }

    /// A job has returned. Returns whether its lane was full, so another one may be taken now.
    pub(super) fn done(&mut self, lane: Lane) -> bool {
        let queue = &mut self.lanes[lane as usize];
        queue.running -= 1;
        queue.running + 1 == lane.most()
    }

    /// The calling thread has no work. Returns how long it waits for some, or `None` for a permanent thread.
    pub(super) fn rest(&mut self, longest: Duration) -> Option<Duration> {
        self.idle.push(current());
        (self.threads > READY).then_some(longest)
    }

    /// The calling thread continues. Returns whether it was notified of a job.
    pub(super) fn rise(&mut self) -> bool {
        let this = current().id();
        let position = self.idle.iter().position(|thread| thread.id() == this);
        match position {
            Some(position) => drop(self.idle.remove(position)),
            None => self.starting -= 1,
        }
        position.is_none()
    }

    /// Threads end once no job waits that they may take; returns those to tell.
    pub(super) fn close(&mut self) -> Vec<Thread> {
        self.is_closed = true;
        self.starting += self.idle.len();
        std::mem::take(&mut self.idle)
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;

    /// Two threads that are busy with commands.
    fn busy(now: Instant) -> Crew {
        let mut crew = Crew::default();
        for _ in 0..2 {
            crew.start();
            crew.arrive();
            crew.add(Lane::Commands, Box::new(|| {}), now);
            assert!(matches!(crew.next(now), Next::Job(Lane::Commands, _)));
        }
        crew
    }

    #[test]
    fn a_thread_is_started_when_none_has_begun_a_job_and_not_because_jobs_wait() {
        let start = Instant::now();
        let at = |millis| start + Duration::from_millis(millis);
        let mut crew = busy(start);
        (0..100).for_each(|_| crew.add(Lane::Robot, Box::new(|| {}), start));
        assert_eq!(crew.wait(at(1)), Some(Duration::from_millis(1)));
        assert_eq!(crew.wait(at(2)), Some(Duration::ZERO));
        // One returns and continues: the machine is busy, and nothing blocks.
        for millis in 1..50 {
            crew.done(if millis == 1 { Lane::Commands } else { Lane::Robot });
            assert!(matches!(crew.next(at(millis)), Next::Job(Lane::Robot, _)));
            assert_eq!(crew.wait(at(millis + 1)), Some(Duration::from_millis(1)), "at {millis} ms");
        }
        // Nobody does any more.
        assert_eq!(crew.wait(at(60)), Some(Duration::ZERO));
        // A thread that was started and cannot run yet is no reason for another.
        crew.start();
        assert_eq!(crew.wait(at(70)), Some(PATIENCE));
    }

    #[test]
    fn a_flood_of_one_lane_does_not_keep_later_ones_from_being_served() {
        let start = Instant::now();
        let mut crew = Crew::default();
        crew.add(Lane::User, Box::new(|| {}), start);
        let mut begun = Vec::new();
        for millis in 0..100 {
            let now = start + Duration::from_millis(millis);
            (0..2).for_each(|_| crew.add(Lane::Robot, Box::new(|| {}), now));
            match crew.next(now) {
                Next::Job(Lane::Robot, _) => {}
                Next::Job(lane, _) => begun.push((millis, lane)),
                Next::Idle | Next::End => panic!("jobs wait"),
            }
        }
        assert_eq!(begun, [(50, Lane::User)]);
        // Even an overdue job does not overtake those that make the robot safe.
        let now = start + Duration::from_secs(1);
        crew.add(Lane::Safety, Box::new(|| {}), now);
        assert!(matches!(crew.next(now), Next::Job(Lane::Safety, _)));
    }

    #[test]
    fn a_thread_that_cannot_be_started_is_reported_once_and_tried_again() {
        let start = Instant::now();
        let at = |millis| start + Duration::from_millis(millis);
        let mut crew = busy(start);
        crew.add(Lane::Robot, Box::new(|| {}), start);
        for millis in [2, 22, 42] {
            assert_eq!(crew.wait(at(millis)), Some(Duration::ZERO), "at {millis} ms");
            crew.start();
            crew.not_started(std::io::Error::other("too many"), at(millis));
            assert_eq!(crew.newly_without_thread(), (millis == 2).then(|| "too many".to_owned()));
            assert_eq!(crew.wait(at(millis + 5)), Some(Duration::from_millis(15)));
            assert!(matches!(crew.call(), Call::Timekeeper));
        }
        crew.start();
        crew.arrive();
        assert!(matches!(crew.next(at(62)), Next::Job(Lane::Robot, _)));
        crew.start();
        crew.not_started(std::io::Error::other("again"), at(70));
        assert!(crew.newly_without_thread().is_some(), "there were some meanwhile");
    }

    #[test]
    fn lanes_are_served_in_their_order() {
        let now = Instant::now();
        let mut crew = Crew::default();
        for lane in Lane::ALL.into_iter().rev() {
            crew.add(lane, Box::new(|| {}), now);
        }
        let begun = std::iter::from_fn(|| match crew.next(now) {
            Next::Job(lane, _) => Some(lane),
            Next::Idle | Next::End => None,
        });
        assert_eq!(begun.collect::<Vec<_>>(), Lane::ALL);
    }
}
