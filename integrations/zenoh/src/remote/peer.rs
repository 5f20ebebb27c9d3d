//! Another robot: the runs of it that are heard, and their clocks.

use super::clock::{Converted, Exchange, PeerClock};
use super::wire::{ClockAnswer, clock_key};
use crate::session::{Session, SessionError, SessionSettings, lock};
use bb_core::MonotonicTime;
use bb_core::time::Clock;
use std::collections::HashMap;
use std::sync::{Arc, Mutex};
use std::time::Duration;
use zenoh::Wait;
use zenoh::query::{ConsolidationMode, QueryTarget};

/// Exchanges after which a clock is known well.
const FIRST_EXCHANGES: u64 = 50;
/// Times from one question to the next: at first, then, and while nobody answers. With delays of 5 ± 3 ms, of 100 bounds 99 are within
/// 0.8 ms of half of the least round trip with a question each 50 ms, 0.5 ms with 20 ms, 0.4 ms with 10 ms and 0.2 ms with 2 ms. On a link it
/// is the same as in a model without threads: it is the delays that vary, and between its two times, a peer takes 2 µs.
const FIRST: Duration = Duration::from_millis(10);
const LATER: Duration = Duration::from_millis(20);
const UNANSWERED: Duration = Duration::from_millis(200);
/// Time after which a question is given up.
const PATIENCE: Duration = Duration::from_secs(1);
/// Time for which a run must have been silent before another one is believed to be its successor.
const SILENCE: Duration = Duration::from_secs(1);
/// Runs that are remembered.
const RUNS: usize = 8;

/// The peers of a run, so that all sensors of one share its clock.
#[derive(Debug, Default)]
pub(super) struct Peers(Mutex<HashMap<(SessionSettings, String), Arc<Peer>>>);

impl Peers {
    /// The peer of that name in the session with these settings.
    ///
    /// # Errors
    /// There is no session.
    pub(super) fn get(
        &self,
        settings: &SessionSettings,
        robot: &str,
        clock: &Clock,
    ) -> Result<Arc<Peer>, SessionError> {
        // Opened without the lock: other sensors do not wait for it.
        let session = Session::open(settings)?;
        let new =
            || Arc::new(Peer { session, robot: robot.to_owned(), clock: clock.clone(), runs: Arc::default() });
        let mut peers = lock(&self.0);
        Ok(Arc::clone(peers.entry((settings.clone(), robot.to_owned())).or_insert_with(new)))
    }
}

/// Another robot.
#[derive(Debug)]
pub(super) struct Peer {
    session: Session,
    robot: String,
    clock: Clock,
    runs: Arc<Mutex<Runs>>,
}

/// The runs of a peer that were heard.
#[derive(Debug, Default)]
pub(super) struct Runs {
    heard: Vec<Run>,
    next_question: MonotonicTime,
}

#[derive(Debug)]
struct Run {
    session: u64,
    first: MonotonicTime,
    last: MonotonicTime,
    exchanges: u64,
    clock: PeerClock,
}

/// Trust in a run of the peer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Trust {
    /// No other has been heard for a while.
    Alone,
    /// Another was heard until just before it began, and may still be there.
    New,
    /// Another one is heard at the same time.
    OneOfTwo,
}

impl Runs {
    /// Notes that a run was heard.
    pub(super) fn hear(&mut self, session: u64, now: MonotonicTime) {
        self.run(session, now);
    }

    fn run(&mut self, session: u64, now: MonotonicTime) -> &mut Run {
        let index = self.heard.iter().position(|run| run.session == session).unwrap_or_else(|| {
            if self.heard.len() >= RUNS {
                // The one that has been silent for longest.
                let oldest =
                    self.heard.iter().enumerate().min_by_key(|(_, run)| run.last).map_or(0, |(index, _)| index);
                self.heard.swap_remove(oldest);
            }
            self.heard.push(Run { session, first: now, last: now, exchanges: 0, clock: PeerClock::default() });
            self.heard.len() - 1
        });
        let run = &mut self.heard[index];
        run.last = run.last.max(now);
        // The next question may be due as of one that does not answer: until then, all that it measures could be as old as the one before.
        self.next_question = self.next_question.min(now + self.pace(now));
        &mut self.heard[index]
    }

    fn answer(&mut self, answer: ClockAnswer, asked: MonotonicTime, heard: MonotonicTime) {
        let ClockAnswer { session, received, answered } = answer;
        let run = self.run(session, heard);
        run.exchanges += 1;
        let restarts = run.clock.restarts();
        run.clock.add(Exchange { asked, received, answered, heard });
        if run.clock.restarts() > restarts {
            run.exchanges = 0;
        }
    }

    /// Trust in a run that was heard.
    pub(super) fn trust(&self, session: u64, now: MonotonicTime) -> Trust {
        let first = self.heard.iter().find(|run| run.session == session).map_or(now, |run| run.first);
        let others = self.heard.iter().filter(|run| run.session != session);
        let mut trust = Trust::Alone;
        for other in others.filter(|other| now.duration_since(other.last) < SILENCE) {
            if other.last > first && other.first < now {
                // It was heard after this one had begun. If it had begun later, it may be the successor of this one.
                return Trust::OneOfTwo;
            }
            trust = Trust::New;
        }
        trust
    }

    fn converted(&self, session: u64, time: MonotonicTime) -> Option<Converted> {
        self.heard.iter().find(|run| run.session == session)?.clock.local(time)
    }

    /// Time of the next question after one at `now`.
    fn pace(&self, now: MonotonicTime) -> Duration {
        let mut present = self.heard.iter().filter(|run| now.duration_since(run.last) < PATIENCE).peekable();
        if present.peek().is_none() {
            UNANSWERED
        } else if present.any(|run| run.exchanges < FIRST_EXCHANGES) {
            FIRST
        } else {
            LATER
        }
    }
}

impl Peer {
    pub(super) fn session(&self) -> &Session {
        &self.session
    }

    pub(super) fn robot(&self) -> &str {
        &self.robot
    }

    /// The runs that were heard, to be noted from zenoh's thread.
    pub(super) fn runs(&self) -> Arc<Mutex<Runs>> {
        Arc::clone(&self.runs)
    }

    /// Asks for the peer's time if that is due, without waiting for the answer, and returns how long nothing is to be done.
    ///
    /// # Errors
    /// The session is closed.
    pub(super) fn ask(&self) -> Result<Duration, SessionError> {
        let now = self.clock.now();
        {
            let mut runs = lock(&self.runs);
            if now < runs.next_question {
                return Ok(runs.next_question.duration_since(now));
            }
            let pace = runs.pace(now);
            runs.next_question = now + pace;
        }
        let (runs, clock) = (Arc::clone(&self.runs), self.clock.clone());
        let asked = self.clock.now();
        self.session
            .get(clock_key(&self.robot))
            .target(QueryTarget::All)
            .consolidation(ConsolidationMode::None)
            .timeout(PATIENCE)
            .callback(move |reply| {
                let heard = clock.now();
                // What is not an answer is ignored: the clock stays unknown, and the sensors say so.
                let answer =
                    reply.result().ok().and_then(|sample| ClockAnswer::from_bytes(&sample.payload().to_bytes()));
                if let Some(answer) = answer {
                    lock(&runs).answer(answer, asked, heard);
                }
            })
            .wait()
            .map_err(SessionError::of(format!("asking `{}` for its time", self.robot)))?;
        Ok(FIRST)
    }

    /// Trust in a run that was heard.
    pub(super) fn trust(&self, session: u64) -> Trust {
        lock(&self.runs).trust(session, self.clock.now())
    }

    /// A time of a run of the peer, on the local clock; `None` if its clock is not known yet.
    pub(super) fn converted(&self, session: u64, time: MonotonicTime) -> Option<Converted> {
        lock(&self.runs).converted(session, time)
    }

    /// Time at which anything was last heard of the peer.
    pub(super) fn last_heard(&self) -> Option<MonotonicTime> {
        lock(&self.runs).heard.iter().map(|run| run.last).max()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(ms: i64) -> MonotonicTime {
        MonotonicTime::from_nanos(ms * 1_000_000)
    }

    #[test]
    fn a_successor_is_trusted_once_the_former_run_is_silent() {
        let mut runs = Runs::default();
        runs.hear(1, at(0));
        assert_eq!(runs.trust(1, at(0)), Trust::Alone);
        runs.hear(2, at(300));
        assert_eq!(runs.trust(2, at(300)), Trust::New);
        runs.hear(2, at(1100));
        assert_eq!(runs.trust(2, at(1100)), Trust::Alone);
    }

    #[test]
    fn one_that_is_heard_is_asked_as_one_that_is_there() {
        let mut runs = Runs { next_question: at(1000) + UNANSWERED, ..Runs::default() };
        runs.hear(1, at(1005));
        assert_eq!(runs.next_question, at(1005) + FIRST);
    }

    #[test]
    fn two_of_one_name_are_noticed_from_both_sides() {
        let mut runs = Runs::default();
        for ms in (0..3000).step_by(10) {
            runs.hear(1 + (ms / 10 % 2) as u64, at(ms));
        }
        assert_eq!([runs.trust(1, at(3000)), runs.trust(2, at(3000))], [Trust::OneOfTwo; 2]);
    }

    #[test]
    fn no_number_of_runs_grows_without_bound() {
        let mut runs = Runs::default();
        (0..1000).for_each(|session| runs.hear(session, at(session as i64)));
        assert!(runs.heard.len() <= RUNS);
        assert_eq!(runs.converted(999, at(0)), None);
    }
}
