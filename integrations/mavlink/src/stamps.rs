//! Converts the flight controller's stamps to the robot's time.

use bb_core::MonotonicTime;
use bb_core::time::DeviceClock;
use std::time::Duration;

/// Largest disagreement of stamps and arrivals from one message to the next.
const TOLERANCE: Duration = Duration::from_secs(1);
/// Time for which stamps may be behind by more than that.
const PATIENCE: Duration = Duration::from_secs(2);

/// The unit of a stream's stamps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unit {
    /// 64 bits of microseconds, since the start or since 1970.
    Micros,
    /// 32 bits of milliseconds since the start, which wrap after 49.7 days.
    Millis,
}

/// A clock that cannot be trusted.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub(crate) enum ClockFault {
    #[error("its clock went back by {by_s:.3} s: the flight controller may have started again")]
    WentBack { by_s: f64 },
    #[error("its clock jumped ahead by {by_s:.3} s more than the time that passed")]
    JumpedAhead { by_s: f64 },
    #[error("its clock has stood still for {for_s:.3} s, although messages arrive")]
    StandsStill { for_s: f64 },
    #[error(
        "its stamps have been behind for {for_s:.3} s, now by {by_s:.3} s: its clock is slow, or the link is congested"
    )]
    Late { for_s: f64, by_s: f64 },
}

/// Converts the stamps of one stream, with a [`DeviceClock`], and checks them.
///
/// A stamp of zero means none: the arrival is used instead.
#[derive(Clone, Debug)]
pub(crate) struct Stamps {
    clock: DeviceClock,
    unit: Unit,
    /// Time for which the same stamp may repeat.
    still: Duration,
    last: Option<Last>,
    late_since: Option<MonotonicTime>,
}

#[derive(Clone, Copy, Debug)]
struct Last {
    ticks: u64,
    /// Arrivals of the newest message, and of the first with these ticks.
    arrival: MonotonicTime,
    since: MonotonicTime,
}

impl Stamps {
    pub(crate) fn new(unit: Unit, still: Duration) -> Self {
        let clock = match unit {
            Unit::Micros => DeviceClock::new(1e6, 64),
            Unit::Millis => DeviceClock::new(1e3, 32),
        };
        Self { clock, unit, still, last: None, late_since: None }
    }

    /// The time of the measurement; `None` if it is a repetition, or was overtaken by a newer one.
    ///
    /// # Errors
    /// The clock cannot be trusted. Use a new `Stamps` for later messages.
    pub(crate) fn time_of(
        &mut self,
        ticks: u64,
        arrival: MonotonicTime,
    ) -> Result<Option<MonotonicTime>, ClockFault> {
        if ticks == 0 {
            return Ok(Some(arrival));
        }
        if let Some(last) = self.last {
            let step_s = self.seconds(last.ticks, ticks);
            let passed_s = arrival.seconds_since(last.arrival);
            if step_s == 0.0 {
                self.last = Some(Last { arrival, ..last });
                let for_s = arrival.seconds_since(last.since);
                let is_still = for_s > self.still.as_secs_f64();
                return if is_still { Err(ClockFault::StandsStill { for_s }) } else { Ok(None) };
            }
            if step_s < -TOLERANCE.as_secs_f64() {
                return Err(ClockFault::WentBack { by_s: -step_s });
            }
            if step_s < 0.0 {
                return Ok(None);
            }
            // Delayed messages arrive together, so a single one ahead of the last proves nothing.
            let by_s = step_s - passed_s;
            if by_s > TOLERANCE.as_secs_f64() && self.late_since.is_none() {
                return Err(ClockFault::JumpedAhead { by_s });
            }
        }
        self.last = Some(Last { ticks, arrival, since: arrival });
        let time = self.clock.time_of(ticks, arrival);
        self.check_late(time, arrival)?;
        Ok(Some(time))
    }

    fn check_late(&mut self, time: MonotonicTime, arrival: MonotonicTime) -> Result<(), ClockFault> {
        let by_s = arrival.seconds_since(time);
        if by_s <= TOLERANCE.as_secs_f64() {
            self.late_since = None;
            return Ok(());
        }
        let since = *self.late_since.get_or_insert(arrival);
        let for_s = arrival.seconds_since(since);
        if for_s > PATIENCE.as_secs_f64() { Err(ClockFault::Late { for_s, by_s }) } else { Ok(()) }
    }

    /// Returns the time from one stamp to another, s.
    fn seconds(&self, from: u64, to: u64) -> f64 {
        match self.unit {
            Unit::Micros => to.wrapping_sub(from).cast_signed() as f64 * 1e-6,
            Unit::Millis => {
                let [from, to] = [from, to].map(|ticks| (ticks & u64::from(u32::MAX)) as u32);
                f64::from(to.wrapping_sub(from).cast_signed()) * 1e-3
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bb_tests::laws;
    use proptest::prelude::*;

    fn at(millis: i64) -> MonotonicTime {
        MonotonicTime::from_nanos(millis * 1_000_000)
    }

    fn stamps(unit: Unit) -> Stamps {
        Stamps::new(unit, Duration::from_secs(1))
    }

    #[test]
    fn good_stamps_follow_the_measurements() {
        let mut stamps = stamps(Unit::Millis);
        // It wraps on the way.
        let start = u64::from(u32::MAX) - 500;
        for millis in (0..3_000).step_by(10) {
            let ticks = (start + millis as u64) & u64::from(u32::MAX);
            let delay = if millis % 30 == 0 { 0 } else { 7 };
            if ticks == 0 {
                continue;
            }
            let time = stamps.time_of(ticks, at(millis + delay)).expect("it is good").expect("it is new");
            assert!(time.nanos_since(at(millis)).abs() < 1_100_000, "{millis}: {time}");
        }
    }

    #[test]
    fn a_wrong_clock_is_reported() {
        let feed = |readings: &[(u64, i64)]| {
            let mut stamps = stamps(Unit::Micros);
            readings
                .iter()
                .map(|(millis, arrival)| stamps.time_of(millis * 1_000, at(*arrival)))
                .fold(None, |_, last| Some(last))
        };
        assert_eq!(feed(&[(5_000, 0), (3_000, 10)]), Some(Err(ClockFault::WentBack { by_s: 2.0 })));
        assert_eq!(feed(&[(5_000, 0), (9_000, 1_500)]), Some(Err(ClockFault::JumpedAhead { by_s: 2.5 })));
        assert_eq!(feed(&[(5_000, 0), (5_000, 1_000)]), Some(Ok(None)), "a repetition");
        assert_eq!(
            feed(&[(5_000, 0), (5_000, 600), (5_000, 1_100)]),
            Some(Err(ClockFault::StandsStill { for_s: 1.1 }))
        );
        assert_eq!(feed(&[(5_000, 0), (4_900, 5)]), Some(Ok(None)), "it was overtaken");
        assert_eq!(feed(&[(0, 7)]), Some(Ok(Some(at(7)))), "no stamp");
    }

    #[test]
    fn a_clock_at_half_speed_is_reported() {
        let mut stamps = stamps(Unit::Micros);
        let fault = (0..10_000_i64).step_by(100).find_map(|millis| {
            stamps.time_of(1_000_000 + millis as u64 * 500, at(millis)).err().map(|fault| (millis, fault))
        });
        let (millis, fault) = fault.expect("it is found");
        assert!(matches!(fault, ClockFault::Late { .. }), "{fault:?}");
        assert!((4_000..=4_300).contains(&millis), "behind by a second after two, and then for two: {millis}");
    }

    #[test]
    fn a_stall_of_the_link_is_no_lie() {
        let mut stamps = stamps(Unit::Micros);
        let mut read = |millis: i64, arrival: i64| stamps.time_of(millis as u64 * 1_000, at(arrival));
        (1..100).for_each(|n| assert!(matches!(read(n * 10, n * 10), Ok(Some(_)))));
        // 3 s of readings arrive at once, then it goes on as before.
        (100..400).for_each(|n| assert!(matches!(read(n * 10, 4_000), Ok(Some(_))), "{n}"));
        (400..500).for_each(|n| assert!(matches!(read(n * 10, n * 10), Ok(Some(_))), "{n}"));
    }

    laws! {
        #[test]
        fn no_stamp_panics(readings in proptest::collection::vec((any::<u64>(), any::<i64>()), 0..50), millis in any::<bool>()) {
            let mut stamps = stamps(if millis { Unit::Millis } else { Unit::Micros });
            for (ticks, arrival) in readings {
                let _ = stamps.time_of(ticks, MonotonicTime::from_nanos(arrival));
            }
        }

        /// Whatever it says of them, times are never after their arrival by more than the nanoseconds that keep them in order.
        #[test]
        fn times_are_not_after_arrivals(steps in proptest::collection::vec((0..2_000_u64, 0..2_000_i64), 1..200)) {
            let mut stamps = stamps(Unit::Micros);
            let (mut millis, mut arrival) = (1, 0);
            for (step, passed) in steps {
                (millis, arrival) = (millis + step, arrival + passed);
                if let Ok(Some(time)) = stamps.time_of(millis * 1_000, at(arrival)) {
                    prop_assert!(time.nanos_since(at(arrival)) < 1_000);
                }
            }
        }
    }
}
