//! What waits, and who takes it.

use super::{FULL_AFTER, Job, Lane};
use std::collections::VecDeque;
use std::thread::Thread;
use std::time::{Duration, Instant};

/// How long jobs wait, while no thread takes one, before another thread is started.
pub(super) const PATIENCE: Duration = Duration::from_millis(2);

/// The jobs and the threads of a pool.
#[derive(Default)]
pub(super) struct Crew {
    lanes: [Queue; Lane::ALL.len()],
    threads: usize,
    /// Threads that were started or told of a job and do not run yet. While there are any the machine is busy, and one more
    /// would not help.
    starting: usize,
    /// Those without work, the one that ran last at the end: it takes the next job, so that those at the beginning can end.
    idle: Vec<Thread>,
    /// When a thread took a job last: as long as some do, those that wait do so because the machine is busy.
    taken: Option<Instant>,
    is_closed: bool,
}

/// The jobs of one lane.
#[derive(Default)]
struct Queue {
    waiting: VecDeque<(Instant, Job)>,
    running: usize,
    /// Since when all of its threads are busy while a job waits.
    full_since: Option<Instant>,
    is_reported: bool,
}

/// What a thread does next.
pub(super) enum Next {
    Job(Lane, Job),
    Idle,
    /// The pool was closed, and nothing waits.
    End,
}

impl Crew {
    pub(super) fn add(&mut self, lane: Lane, job: Job, now: Instant) {
        self.lanes[lane as usize].waiting.push_back((now, job));
    }

    /// The thread that is to be told of a job.
    pub(super) fn take_idle(&mut self) -> Option<Thread> {
        let thread = if self.may_take() { self.idle.pop() } else { None };
        self.starting += usize::from(thread.is_some());
        thread
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

    /// Whether there is a job that a thread may take.
    pub(super) fn may_take(&self) -> bool {
        self.first().is_some()
    }

    fn first(&self) -> Option<Lane> {
        Lane::ALL.into_iter().find(|lane| {
            let queue = &self.lanes[*lane as usize];
            !queue.waiting.is_empty() && queue.running < lane.most()
        })
    }

    /// How long the jobs that wait may go on doing so; zero if a thread is to be started, none if that would not help.
    pub(super) fn wait(&self, now: Instant) -> Option<Duration> {
        let waiting = Lane::ALL.into_iter().filter_map(|lane| {
            let queue = &self.lanes[lane as usize];
            queue.waiting.front().filter(|_| queue.running < lane.most()).map(|(since, _)| *since)
        });
        let since = waiting.min()?;
        if self.starting > 0 {
            return Some(PATIENCE);
        }
        let since = self.taken.map_or(since, |taken| taken.max(since));
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

    /// Counts a thread that is started; its number.
    pub(super) fn start(&mut self) -> usize {
        self.threads += 1;
        self.starting += 1;
        self.threads - 1
    }

    pub(super) fn not_started(&mut self) {
        self.threads -= 1;
        self.starting -= 1;
    }

    /// A thread that was started runs.
    pub(super) fn arrive(&mut self) {
        self.starting -= 1;
    }

    pub(super) fn leave(&mut self) {
        self.threads -= 1;
    }

    pub(super) fn next(&mut self, now: Instant) -> Next {
        let Some(lane) = self.first() else { return if self.is_closed { Next::End } else { Next::Idle } };
        let queue = &mut self.lanes[lane as usize];
        match queue.waiting.pop_front() {
            Some((_, job)) => {
                queue.running += 1;
                self.taken = Some(now);
                Next::Job(lane, job)
            }
            None => Next::Idle,
        }
    }

    pub(super) fn done(&mut self, lane: Lane) {
        self.lanes[lane as usize].running -= 1;
    }

    /// The calling thread has no work.
    pub(super) fn rest(&mut self) {
        self.idle.push(std::thread::current());
    }

    /// The calling thread goes on; whether it was told of a job.
    pub(super) fn rise(&mut self) -> bool {
        let this = std::thread::current().id();
        let position = self.idle.iter().position(|thread| thread.id() == this);
        match position {
            Some(position) => drop(self.idle.remove(position)),
            None => self.starting -= 1,
        }
        position.is_none()
    }

    /// Threads end once nothing waits that they may take; those to be told so.
    pub(super) fn close(&mut self) -> Vec<Thread> {
        self.is_closed = true;
        self.starting += self.idle.len();
        std::mem::take(&mut self.idle)
    }
}

#[cfg(test)]
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
    fn a_thread_is_started_when_none_has_taken_a_job_and_not_because_jobs_wait() {
        let start = Instant::now();
        let at = |millis| start + Duration::from_millis(millis);
        let mut crew = busy(start);
        (0..100).for_each(|_| crew.add(Lane::Robot, Box::new(|| {}), start));
        assert_eq!(crew.wait(at(1)), Some(Duration::from_millis(1)));
        assert_eq!(crew.wait(at(2)), Some(Duration::ZERO));
        // One comes back and goes on: the machine is busy, and nothing blocks.
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
    fn lanes_are_served_in_their_order() {
        let now = Instant::now();
        let mut crew = Crew::default();
        for lane in Lane::ALL.into_iter().rev() {
            crew.add(lane, Box::new(|| {}), now);
        }
        let taken = std::iter::from_fn(|| match crew.next(now) {
            Next::Job(lane, _) => Some(lane),
            Next::Idle | Next::End => None,
        });
        assert_eq!(taken.collect::<Vec<_>>(), Lane::ALL);
    }
}
