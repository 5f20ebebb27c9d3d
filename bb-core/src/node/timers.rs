//! Timers and other pending work of one estimator.

use crate::component::{Info, Request};
use crate::time::MonotonicTime;
use std::time::Duration;

/// The requests made by an estimator.
#[derive(Clone, Debug, Default)]
pub(super) struct Timers {
    pub(super) continue_with: Option<Continuation>,
    timeout: Option<MonotonicTime>,
    tick: Option<(Duration, MonotonicTime)>,
    timers: Vec<(u32, MonotonicTime)>,
}

/// Action of an estimator before anything else happens to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Continuation {
    /// Continue with this number.
    Step(u32),
    /// Fail for this reason, after the reply.
    Fail(&'static str),
}

/// The most timers that one estimator may have running; one more replaces the latest.
const MAX_TIMERS: usize = 64;

/// The shortest delay of a request. On virtual time, an estimator that repeatedly asked for a shorter delay would stop the time
/// from advancing.
const SHORTEST: Duration = Duration::from_micros(1);

impl Timers {
    /// Takes a request.
    #[cold]
    pub(super) fn request(&mut self, request: Request, now: MonotonicTime) {
        let after = |duration: Duration| now + duration.max(SHORTEST);
        match request {
            // A restart comes before all else, wherever it comes in the reply.
            Request::Continue(_) if matches!(self.continue_with, Some(Continuation::Fail(_))) => {}
            Request::Continue(step) => self.continue_with = Some(Continuation::Step(step)),
            Request::Restart(reason) => self.continue_with = Some(Continuation::Fail(reason)),
            Request::Timeout(duration) => self.timeout = Some(after(duration)),
            Request::Tick(Duration::ZERO) => self.tick = None,
            Request::Tick(period) => self.tick = Some((period.max(SHORTEST), after(period))),
            Request::Timer(number, duration) => {
                self.timers.retain(|(other, _)| *other != number);
                if self.timers.len() == MAX_TIMERS {
                    self.timers.pop();
                }
                self.timers.push((number, after(duration)));
            }
        }
    }

    /// Records that the estimator has handled something, which ends a timeout.
    #[inline]
    pub(super) fn happened(&mut self) {
        self.timeout = None;
    }

    pub(super) fn next(&self) -> Option<MonotonicTime> {
        let mut next = self.timeout.unwrap_or(MonotonicTime::MAX);
        if let Some((_, time)) = self.tick {
            next = next.min(time);
        }
        for (_, time) in &self.timers {
            next = next.min(*time);
        }
        // The last instant is never reached.
        (next < MonotonicTime::MAX).then_some(next)
    }

    /// Takes the request that is due first, and the time at which it was due.
    pub(super) fn take(&mut self, now: MonotonicTime) -> Option<Info> {
        let due = self.next().filter(|due| *due <= now)?;
        if let Some(position) = self.timers.iter().position(|(_, time)| *time == due) {
            return Some(Info::Timer(self.timers.remove(position).0));
        }
        if let Some((period, time)) = self.tick.filter(|(_, time)| *time == due) {
            // Missed ticks are skipped; the phase stays the same.
            let period_nanos = i64::try_from(period.as_nanos()).unwrap_or(i64::MAX);
            let periods = now.nanos_since(time) / period_nanos + 1;
            self.tick = Some((period, time.plus_nanos(period_nanos.saturating_mul(periods))));
            return Some(Info::Tick);
        }
        self.timeout = None;
        Some(Info::Timeout)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(millis: u64) -> MonotonicTime {
        MonotonicTime::ZERO + Duration::from_millis(millis)
    }

    #[test]
    fn what_is_due_comes_in_the_order_of_its_time() {
        let mut timers = Timers::default();
        timers.request(Request::Timer(7, Duration::from_millis(30)), at(0));
        timers.request(Request::Tick(Duration::from_millis(20)), at(0));
        timers.request(Request::Timeout(Duration::from_millis(25)), at(0));
        assert_eq!(timers.take(at(10)), None);
        let taken: Vec<_> = std::iter::from_fn(|| timers.take(at(30))).collect();
        assert_eq!(taken, [Info::Tick, Info::Timeout, Info::Timer(7)]);
        assert_eq!(timers.next(), Some(at(40)));
    }

    #[test]
    fn missed_ticks_are_skipped_and_the_phase_is_kept() {
        let mut timers = Timers::default();
        timers.request(Request::Tick(Duration::from_millis(10)), at(0));
        assert_eq!(timers.take(at(35)), Some(Info::Tick));
        assert_eq!((timers.take(at(35)), timers.next()), (None, Some(at(40))));
    }

    #[test]
    fn a_timeout_is_over_once_something_happens_and_a_tick_ends_on_request() {
        let mut timers = Timers::default();
        timers.request(Request::Timeout(Duration::from_millis(5)), at(0));
        timers.request(Request::Tick(Duration::from_millis(5)), at(0));
        timers.happened();
        timers.request(Request::Tick(Duration::ZERO), at(1));
        assert_eq!(timers.next(), None);
    }

    #[test]
    fn a_timer_of_the_same_number_is_replaced() {
        let mut timers = Timers::default();
        timers.request(Request::Timer(1, Duration::from_millis(5)), at(0));
        timers.request(Request::Timer(1, Duration::from_millis(50)), at(0));
        assert_eq!((timers.take(at(10)), timers.next()), (None, Some(at(50))));
    }

    #[test]
    fn a_restart_comes_before_a_continuation_in_either_order() {
        for requests in
            [[Request::Restart("asked"), Request::Continue(3)], [Request::Continue(3), Request::Restart("asked")]]
        {
            let mut timers = Timers::default();
            requests.into_iter().for_each(|request| timers.request(request, at(0)));
            assert_eq!(timers.continue_with, Some(Continuation::Fail("asked")));
        }
    }
}
