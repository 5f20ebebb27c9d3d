//! The time of a device's own counter.

use super::MonotonicTime;

/// Turns the counter of a device into the robot's time.
///
/// A reading arrives after it was measured: later by the time that the transport takes, which varies by milliseconds on USB, a
/// serial port or a loaded machine. The counter that many devices send along does not vary. This clock learns how far the
/// counter is from the robot's clock, from the readings that were delayed least: the time that it gives is never after the
/// arrival, and after the measurement by the smallest delay that has been seen, plus what the device's oscillator may have
/// drifted since. (Readings that arrive at the same time are kept in order by a nanosecond each.)
///
/// The counter may wrap, start again from zero, or stand still for a while; the clock then learns anew.
///
/// ```
/// use bb_core::MonotonicTime;
/// use bb_core::time::DeviceClock;
///
/// // 32 bits of microseconds.
/// let mut clock = DeviceClock::new(1e6, 32);
/// let at = |ms: i64| MonotonicTime::from_nanos(ms * 1_000_000);
/// assert_eq!(clock.time_of(5_000, at(100)), at(100));
/// // 10 ms later by the counter; it was delayed by 3 ms.
/// let late = clock.time_of(15_000, at(113));
/// assert!(late.nanos_since(at(110)).abs() < 10_000);
/// ```
//
// The lower envelope of arrival minus device time, tilted by the largest drift: one-way synchronisation as in L. Zhang, Z. Liu,
// C. Xia, "Clock synchronization algorithms for network measurements", INFOCOM 2002, with one point kept instead of a hull.
#[derive(Clone, Debug)]
pub struct DeviceClock {
    nanos_per_tick: f64,
    /// Ticks after which the counter is at zero again; none for 64 bits.
    modulus: Option<u64>,
    /// How much faster or slower the device may count, relative.
    drift: f64,
    state: Option<State>,
}

#[derive(Clone, Copy, Debug)]
struct State {
    ticks: u64,
    /// Ticks since the first reading.
    elapsed: u64,
    /// Of that first reading on the robot's clock, as far as is known: in nanoseconds.
    origin: f64,
    last: MonotonicTime,
    window: Window,
}

/// The smallest delay within a while.
#[derive(Clone, Copy, Debug)]
struct Window {
    start: MonotonicTime,
    least: f64,
}

/// Readings that all seem to be delayed by more than `STALE` for as long as `WINDOW` are not: the counter stood still.
const STALE_NANOS: f64 = 1e9;
const WINDOW_NANOS: i64 = 2_000_000_000;

impl DeviceClock {
    /// Of a counter of `bits` bits, 64 at most, that counts `ticks_per_second`.
    pub fn new(ticks_per_second: f64, bits: u32) -> Self {
        let modulus = 1_u64.checked_shl(bits).filter(|_| bits < 64);
        Self { nanos_per_tick: 1e9 / ticks_per_second, modulus, drift: 2e-4, state: None }
    }

    /// How far the rate of the device's oscillator may be off, relative; 2e-4 (200 ppm) unless set. Crystals are within
    /// 1e-4, and internal oscillators of microcontrollers within 1e-2.
    pub fn with_drift(mut self, drift: f64) -> Self {
        self.drift = drift;
        self
    }

    /// When the counter was at `ticks`, of a reading that has arrived at `arrival`. Later readings get later times, as long as
    /// the counter goes on.
    pub fn time_of(&mut self, ticks: u64, arrival: MonotonicTime) -> MonotonicTime {
        let ticks = self.modulus.map_or(ticks, |modulus| ticks % modulus);
        let next = self.state.and_then(|state| self.next(state, ticks, arrival)).unwrap_or(State {
            ticks,
            elapsed: 0,
            origin: arrival.as_nanos() as f64,
            last: arrival,
            window: Window { start: arrival, least: 0.0 },
        });
        self.state.insert(next).last
    }

    /// None if the counter does not go on.
    fn next(&self, before: State, ticks: u64, arrival: MonotonicTime) -> Option<State> {
        let step = match self.modulus {
            Some(modulus) => (ticks + modulus - before.ticks) % modulus,
            None => ticks.checked_sub(before.ticks)?,
        };
        if self.modulus.is_some_and(|modulus| step > modulus / 2) {
            return None;
        }
        let elapsed = before.elapsed.checked_add(step)?;
        let device = elapsed as f64 * self.nanos_per_tick;
        let arrived = arrival.as_nanos() as f64;
        let mut origin = (before.origin + self.drift * step as f64 * self.nanos_per_tick).min(arrived - device);
        let delay = arrived - device - origin;
        let mut window = Window { least: before.window.least.min(delay), ..before.window };
        if arrival.nanos_since(window.start) > WINDOW_NANOS {
            if window.least > STALE_NANOS {
                origin += window.least;
            }
            window = Window { start: arrival, least: f64::INFINITY };
        }
        let time = MonotonicTime::from_nanos((origin + device) as i64).min(arrival);
        // A first reading that was delayed is found out by the next ones; time does not go back for that.
        let earliest = if step > 0 { before.last.plus_nanos(1) } else { before.last };
        Some(State { ticks, elapsed, origin, last: time.max(earliest), window })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn at(nanos: i64) -> MonotonicTime {
        MonotonicTime::from_nanos(nanos)
    }

    proptest! {
        /// Between the measurement with the smallest delay and the arrival, whatever the delays; a counter that wraps often.
        #[test]
        fn a_time_is_between_measurement_and_arrival(
            delays in proptest::collection::vec(0..50_000_000_i64, 2..300),
            least in 0..5_000_000_i64,
            rate in -1e-4..1e-4_f64,
            start in any::<u64>(),
        ) {
            let mut clock = DeviceClock::new(1e6, 16);
            let (mut arrived, mut best) = (0, i64::MAX);
            let mut last = None;
            for (index, delay) in delays.iter().enumerate() {
                // 100 Hz by the robot's clock, read by a counter of 1 MHz that runs at a rate of its own.
                let measured = 10_000_000 * index as i64;
                let ticks = start.wrapping_add((measured as f64 * (1.0 + rate) / 1e3) as u64) % (1 << 16);
                // A transport keeps the order.
                arrived = (measured + least + delay).max(arrived);
                let time = clock.time_of(ticks, at(arrived)).as_nanos();
                // A tick is 1 us. Two that arrive at once are kept in order by a nanosecond.
                let latest = arrived + index as i64;
                prop_assert!(time >= measured + least - 2_000 && time <= latest, "{time} {measured} {arrived}");
                // What the best reading so far leaves open, and the drift since, at most.
                best = best.min(arrived - measured);
                let drift = (3e-4 * measured as f64) as i64;
                prop_assert!(time <= measured + best.max(last.unwrap_or(0) + 1 - measured) + drift + 2_000);
                prop_assert!(last.is_none_or(|last| time > last));
                last = Some(time);
            }
        }

        #[test]
        fn no_counter_panics(
            readings in proptest::collection::vec((any::<u64>(), any::<i64>()), 0..50),
            bits in 0..80_u32,
            frequency in proptest::num::f64::ANY,
        ) {
            let mut clock = DeviceClock::new(frequency, bits);
            for (ticks, arrival) in readings {
                let _ = clock.time_of(ticks, at(arrival));
            }
        }
    }

    #[test]
    fn a_device_that_starts_again_or_stands_still_is_learnt_anew() {
        let mut clock = DeviceClock::new(1e6, 32);
        let mut read = |ticks: u64, ms: i64| clock.time_of(ticks, at(ms * 1_000_000)).as_nanos() / 1_000;
        assert_eq!(read(3_000_000, 100), 100_000);
        assert_eq!(read(3_010_000, 110), 110_000);
        // Off and on.
        assert_eq!(read(0, 5_000), 5_000_000);
        assert_eq!(read(10_000, 5_010), 5_010_000);
        // It slept for 3 s and went on counting from where it was: believed to be delayed for 2 s, then no longer.
        let times: Vec<i64> = (1..=400).map(|n| read(10_000 + n * 10_000, 8_010 + n as i64 * 10)).collect();
        assert!((5_020_000..5_021_000).contains(&times[0]), "{}", times[0]);
        assert_eq!(times[399], 12_010_000);
        assert!(times.windows(2).all(|pair| pair[0] < pair[1]));
    }

    #[test]
    fn a_burst_after_a_stall_keeps_its_times() {
        let mut clock = DeviceClock::new(1e6, 32);
        let mut read = |ms: i64, arrival: i64| clock.time_of(ms as u64 * 1_000, at(arrival * 1_000_000)).as_nanos();
        (0..100).for_each(|n| assert_eq!(read(n * 10, n * 10) / 10_000, n * 1_000, "{n}"));
        // 3 s of readings arrive at once.
        for n in 100..400 {
            let time = read(n * 10, 4_000);
            assert!((time - n * 10_000_000).abs() < 1_000_000, "{n}: {time}");
        }
    }
}
