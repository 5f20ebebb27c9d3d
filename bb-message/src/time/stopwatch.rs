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
pub struct Stopwatch(Option<&'static quanta::Clock>);

/// A reading of the stopwatch.
#[derive(Clone, Copy, Debug)]
pub enum Reading {
    /// Ticks of the processor's counter.
    Counter(u64),
    /// Time of the clock.
    Clock(MonotonicTime),
}

static COUNTER: OnceLock<quanta::Clock> = OnceLock::new();

impl Stopwatch {
    /// Calibrates the counter, unless done already: up to 200 ms of a busy machine and a pause of 50 ms. Until then, the clock is read.
    pub fn prepare() {
        static ONCE: Once = Once::new();
        ONCE.call_once(|| {
            let counter = quanta::Clock::new();
            if is_right(&counter) {
                COUNTER.get_or_init(|| counter);
            }
        });
    }

    /// Chooses the counter, or the clock until the counter is calibrated.
    #[inline]
    pub fn start() -> Self {
        Self(COUNTER.get())
    }

    /// Reads the counter, or the clock if [`Self::start`] found no counter.
    #[inline]
    pub fn read(self, clock: &Clock) -> Reading {
        match self.0 {
            Some(counter) => Reading::Counter(counter.raw()),
            None => Reading::Clock(clock.now()),
        }
    }

    /// The nanoseconds from `start` to `end`, both of this stopwatch. Zero if the counter went back, as it may when a
    /// machine is suspended.
    #[inline]
    pub fn nanos_between(self, start: Reading, end: Reading) -> i64 {
        match (self.0, start, end) {
            (Some(counter), Reading::Counter(start), Reading::Counter(end)) => {
                i64::try_from(counter.delta_as_nanos(start, end)).unwrap_or(i64::MAX)
            }
            (_, Reading::Clock(start), Reading::Clock(end)) => end.nanos_since(start),
            _ => 0,
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
    fn calibrated() -> &'static quanta::Clock {
        let counter = quanta::Clock::new();
        assert!((0..20).any(|_| is_right(&counter)), "the scale is off");
        COUNTER.get_or_init(|| counter)
    }

    #[test]
    fn a_duration_is_the_systems() {
        let clock = Clock::real();
        for stopwatch in [Stopwatch(None), Stopwatch(Some(calibrated()))] {
            for millis in [0, 1, 30, 300] {
                let outer = Instant::now();
                let start = stopwatch.read(&clock);
                let inner = Instant::now();
                std::thread::sleep(Duration::from_millis(millis));
                let shortest = inner.elapsed().as_nanos() as i64;
                let measured = stopwatch.nanos_between(start, stopwatch.read(&clock));
                let longest = outer.elapsed().as_nanos() as i64;
                // A busy machine distorts the scale by a percent or two.
                let tolerance = 100 + longest / 20;
                let is_right = shortest - tolerance <= measured && measured <= longest + tolerance;
                assert!(is_right, "{measured} ns in {shortest} to {longest}: {stopwatch:?}");
            }
        }
    }

    #[test]
    fn a_counter_that_goes_back_gives_zero() {
        let stopwatch = Stopwatch(Some(calibrated()));
        for (start, end) in [(u64::MAX, 0), (1, 0)] {
            assert_eq!(stopwatch.nanos_between(Reading::Counter(start), Reading::Counter(end)), 0);
        }
    }
}
