//! Durations by the processor's counter.

use super::{Clock, MonotonicTime};
use std::sync::{Once, OnceLock};
use std::time::{Duration, Instant};

/// Measures how long code takes on one thread. Reading the processor's counter costs less than half of reading the
/// [`Clock`].
///
/// It is not a clock: readings of two threads cannot be compared, and the scale is exact to some parts in a million
/// (a percent, if the machine was busy during calibration; a scale that is further off is not used). If a processor has no
/// counter that runs at a constant rate, the crate `quanta` reads the system's clock.
#[derive(Clone, Copy, Debug)]
pub enum Stopwatch {
    /// Counter of the processor, and what it read at the start.
    Counter(&'static Counter, u64),
    /// Time of the start, by the clock.
    Clock(MonotonicTime),
}

/// Counter of the processor, calibrated.
#[derive(Debug)]
pub struct Counter {
    raw: quanta::Clock,
    /// Nanoseconds of 2^[`SHIFT`] ticks.
    scale: u64,
}

/// Fraction bits of [`Counter::scale`], which is rounded by less than a part in 10^9 with them.
const SHIFT: u32 = 32;

static COUNTER: OnceLock<Counter> = OnceLock::new();

impl Counter {
    fn new(raw: quanta::Clock) -> Self {
        let scale = raw.delta_as_nanos(0, 1 << SHIFT);
        Self { raw, scale }
    }

    /// Nanoseconds since it read `start`. Zero if it went back, as it may when a machine is suspended.
    #[inline]
    fn nanos_since(&self, start: u64) -> i64 {
        let ticks = self.raw.raw().saturating_sub(start);
        ((u128::from(ticks) * u128::from(self.scale)) >> SHIFT) as i64
    }
}

impl Stopwatch {
    /// Calibrates the counter, unless done already: up to 200 ms of a busy machine and a pause of 50 ms. Until then, the clock is read.
    pub fn prepare() {
        static ONCE: Once = Once::new();
        ONCE.call_once(|| {
            let counter = quanta::Clock::new();
            if is_right(&counter) {
                COUNTER.get_or_init(|| Counter::new(counter));
            }
        });
    }

    /// Starts, by the counter or, until that is calibrated, by the clock.
    #[inline]
    pub fn start(clock: &Clock) -> Self {
        match COUNTER.get() {
            Some(counter) => Self::Counter(counter, counter.raw.raw()),
            None => Self::Clock(clock.now()),
        }
    }

    /// Nanoseconds since the start.
    #[inline]
    pub fn nanos(self, clock: &Clock) -> i64 {
        match self {
            Self::Counter(counter, start) => counter.nanos_since(start),
            Self::Clock(start) => clock.now().nanos_since(start),
        }
    }
}

/// Returns whether the counter and the system's clock agree within a percent over a pause. The scale would be wrong for good if the
/// machine was suspended, or the thread had no core, at the wrong moment of the calibration.
fn is_right(counter: &quanta::Clock) -> bool {
    let start = together(counter);
    std::thread::sleep(Duration::from_millis(50));
    let end = together(counter);
    let (Some(start), Some(end)) = (start, end) else { return false };
    let measured = counter.delta_as_nanos(start.1, end.1) as f64;
    let elapsed = end.0.duration_since(start.0).as_nanos() as f64;
    (measured / elapsed - 1.0).abs() < 0.01
}

/// Reads both at the same time: of ten tries, the one that took the least time.
fn together(counter: &quanta::Clock) -> Option<(Instant, u64)> {
    let tries = (0..10).map(|_| {
        let (before, raw) = (Instant::now(), counter.raw());
        (before.elapsed(), (before, raw))
    });
    tries.min_by_key(|(took, _)| *took).map(|(_, read)| read)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The counter of this process, once it is calibrated.
    fn calibrated() -> &'static Counter {
        let counter = quanta::Clock::new();
        assert!((0..20).any(|_| is_right(&counter)), "the scale is off");
        COUNTER.get_or_init(|| Counter::new(counter))
    }

    #[test]
    fn a_duration_is_the_systems() {
        let clock = Clock::real();
        let counter = calibrated();
        for is_counted in [false, true] {
            for millis in [0, 1, 30, 300] {
                let outer = Instant::now();
                let stopwatch = if is_counted { Stopwatch::start(&clock) } else { Stopwatch::Clock(clock.now()) };
                assert_eq!(matches!(stopwatch, Stopwatch::Counter(..)), is_counted);
                let inner = Instant::now();
                std::thread::sleep(Duration::from_millis(millis));
                let shortest = inner.elapsed().as_nanos() as i64;
                let measured = stopwatch.nanos(&clock);
                let longest = outer.elapsed().as_nanos() as i64;
                // A busy machine distorts the scale by a percent or two.
                let tolerance = 100 + longest / 20;
                let is_right = shortest - tolerance <= measured && measured <= longest + tolerance;
                assert!(is_right, "{measured} ns in {shortest} to {longest}: {counter:?}");
            }
        }
    }

    #[test]
    fn a_counter_that_goes_back_gives_zero() {
        assert_eq!(Stopwatch::Counter(calibrated(), u64::MAX).nanos(&Clock::real()), 0);
    }
}
