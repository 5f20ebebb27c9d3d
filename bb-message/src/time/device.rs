//! The time of a device's counter.

use super::MonotonicTime;

/// Converts the counter of a device to the robot's time.
///
/// A reading arrives after it was measured: later by the transport delay, which varies by milliseconds on USB, a
/// serial port or a loaded machine. The counter that many devices send along does not vary. This clock learns the
/// offset between the counter and the robot's clock from the readings with the smallest delay. The time it returns is
/// never after the arrival. It is after the measurement by at most the smallest delay of the last 10 to 20 s (and 16
/// readings), plus the possible drift of the device's oscillator since. (Readings that arrive at the same time are
/// kept in order by a nanosecond each.)
///
/// - The counter may wrap, also several times between two readings: the arrivals tell how often, as long as delays differ by
///   less than half a wrap.
/// - A counter that jumps ahead of the arrivals by more than a second, or back, was restarted: the clock starts over
///   at once.
/// - A counter that stood still looks the same as a late transport, and is treated as one until no reading of 10 to
///   20 s has been on time.
/// - A reading that is overtaken by another gets its own, earlier time.
/// - Without a rate that is positive and finite, the time of a reading is its arrival.
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
// The lower envelope of arrival minus device time over a sliding window, tilted by the largest drift: one-way
// synchronisation as in L. Zhang, Z. Liu, C. Xia, "Clock synchronization algorithms for network measurements",
// INFOCOM 2002, but keeping the minima of two windows instead of a hull.
#[derive(Clone, Debug)]
pub struct DeviceClock {
    /// `None` without a rate.
    nanos_per_tick: Option<f64>,
    /// Ticks after which the counter wraps to zero; `None` for 64 bits.
    modulus: Option<u64>,
    /// The largest relative rate error of the device.
    drift: f64,
    state: Option<State>,
}

#[derive(Clone, Copy, Debug)]
struct State {
    ticks: u64,
    /// Ticks since the first reading.
    elapsed: u64,
    arrival: MonotonicTime,
    last: MonotonicTime,
    /// The first reading's time on the robot's clock, estimated from this window and the previous one, in
    /// nanoseconds.
    origin: [f64; 2],
    window_start: MonotonicTime,
    readings: u32,
}

const WINDOW_NANOS: i64 = 10_000_000_000;
const WINDOW_READINGS: u32 = 16;

/// Time in nanoseconds by which a reading may be ahead of its arrival, if the previous one was late, or behind it, if it was overtaken.
const TOLERANCE_NANOS: f64 = 1e9;

/// The relation of a reading to the previous one.
enum Step {
    /// Later by this many ticks.
    Later(u64),
    /// Earlier by this many ticks.
    Overtaken(u64),
    /// The counter was restarted.
    Restarted,
}

impl DeviceClock {
    /// Creates the clock of a counter of `bits` bits, at most 64, that counts `ticks_per_second`.
    pub fn new(ticks_per_second: f64, bits: u32) -> Self {
        let modulus = 1_u64.checked_shl(bits).filter(|_| bits < 64);
        let nanos_per_tick = Some(1e9 / ticks_per_second).filter(|nanos| nanos.is_finite() && *nanos > 0.0);
        Self { nanos_per_tick, modulus, drift: 2e-4, state: None }
    }

    /// The largest relative error in the rate of the device's oscillator; 2e-4 (200 ppm) by default. Crystals are
    /// within 1e-4, and internal oscillators of microcontrollers within 1e-2. From 0 to 0.5. If a device is off by
    /// more, its times are before the measurement, by the excess over 10 to 20 s.
    pub fn with_drift(mut self, drift: f64) -> Self {
        self.drift = if drift.is_nan() { self.drift } else { drift.clamp(0.0, 0.5) };
        self
    }

    /// The time at which the counter was at `ticks`, for a reading that arrived at `arrival`. Later readings get
    /// later times, as long as the counter continues.
    pub fn time_of(&mut self, ticks: u64, arrival: MonotonicTime) -> MonotonicTime {
        let Some(nanos_per_tick) = self.nanos_per_tick else { return arrival };
        let ticks = self.modulus.map_or(ticks, |modulus| ticks % modulus);
        let Some(before) = self.state else { return self.restart(ticks, arrival) };
        match self.step(before, ticks, arrival, nanos_per_tick) {
            Step::Later(step) => match before.elapsed.checked_add(step) {
                Some(elapsed) => {
                    let next = self.follow(before, ticks, elapsed, arrival, nanos_per_tick);
                    self.state.insert(next).last
                }
                None => self.restart(ticks, arrival),
            },
            Step::Overtaken(step) => before.last.plus_nanos(-((step as f64 * nanos_per_tick) as i64)).min(arrival),
            Step::Restarted => self.restart(ticks, arrival),
        }
    }

    fn restart(&mut self, ticks: u64, arrival: MonotonicTime) -> MonotonicTime {
        let origin = [arrival.as_nanos() as f64, f64::INFINITY];
        let state = State { ticks, elapsed: 0, arrival, last: arrival, origin, window_start: arrival, readings: 1 };
        self.state.insert(state).last
    }

    fn step(&self, before: State, ticks: u64, arrival: MonotonicTime, nanos_per_tick: f64) -> Step {
        let passed = arrival.nanos_since(before.arrival) as f64;
        let limit = passed * (1.0 + self.drift) + TOLERANCE_NANOS;
        let later = ticks.wrapping_sub(before.ticks);
        let (later, earlier) = match self.modulus {
            Some(modulus) => {
                let later = later % modulus;
                // The number of wraps that agrees best with the arrivals.
                let wraps = ((passed / nanos_per_tick - later as f64) / modulus as f64).round().max(0.0);
                // Larger than any counter: the conversion saturates.
                (later.saturating_add((wraps as u64).saturating_mul(modulus)), modulus - later)
            }
            None => (later, later.wrapping_neg()),
        };
        if later as f64 * nanos_per_tick <= limit {
            Step::Later(later)
        } else if earlier as f64 * nanos_per_tick <= TOLERANCE_NANOS && passed.abs() <= TOLERANCE_NANOS {
            Step::Overtaken(earlier)
        } else {
            Step::Restarted
        }
    }

    fn follow(
        &self,
        before: State,
        ticks: u64,
        elapsed: u64,
        arrival: MonotonicTime,
        nanos_per_tick: f64,
    ) -> State {
        let device = elapsed as f64 * nanos_per_tick;
        let passed = (elapsed - before.elapsed) as f64 * nanos_per_tick;
        // A device that is slow by `d` counts `1 − d` of the time.
        let tilt = passed * self.drift / (1.0 - self.drift);
        let mut origin = before.origin.map(|origin| origin + tilt);
        let (mut window_start, mut readings) = (before.window_start, before.readings + 1);
        if arrival.nanos_since(window_start) > WINDOW_NANOS && before.readings >= WINDOW_READINGS {
            origin = [f64::INFINITY, origin[0]];
            window_start = arrival;
            readings = 1;
        }
        origin[0] = origin[0].min(arrival.as_nanos() as f64 - device);
        let time = MonotonicTime::from_nanos((origin[0].min(origin[1]) + device) as i64).min(arrival);
        // A delay of the first reading is discovered from later ones; time does not go back for that.
        let earliest = if elapsed > before.elapsed { before.last.plus_nanos(1) } else { before.last };
        State { ticks, elapsed, arrival, last: time.max(earliest), origin, window_start, readings }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bb_tests::laws;
    use proptest::prelude::*;

    fn at(nanos: i64) -> MonotonicTime {
        MonotonicTime::from_nanos(nanos)
    }

    laws! {
        /// The time is between the measurement with the smallest delay and the arrival, for any delays; the counter
        /// wraps often.
        #[test]
        fn a_time_is_between_measurement_and_arrival(
            delays in proptest::collection::vec(0..50_000_000_i64, 2..300),
            least in 0..5_000_000_i64,
            rate in -1e-4..1e-4_f64,
            start in any::<u64>(),
        ) {
            let mut clock = DeviceClock::new(1e6, 18);
            let (mut arrived, mut best) = (0, i64::MAX);
            let mut last = None;
            for (index, delay) in delays.iter().enumerate() {
                // 100 Hz by the robot's clock, read by a counter of 1 MHz with its own rate error.
                let measured = 10_000_000 * index as i64;
                let ticks = start.wrapping_add((measured as f64 * (1.0 + rate) / 1e3) as u64) % (1 << 18);
                // The transport keeps the order.
                arrived = (measured + least + delay).max(arrived);
                let time = clock.time_of(ticks, at(arrived)).as_nanos();
                // A tick is 1 us. Two that arrive at once are kept in order by a nanosecond.
                let latest = arrived + index as i64;
                prop_assert!(time >= measured + least - 2_000 && time <= latest, "{time} {measured} {arrived}");
                // The uncertainty left by the best reading so far, and the largest drift since.
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
    fn a_device_that_restarts_or_pauses_is_learnt_again() {
        let mut clock = DeviceClock::new(1e6, 32);
        let mut read = |ticks: u64, ms: i64| clock.time_of(ticks, at(ms * 1_000_000)).as_nanos() / 1_000;
        assert_eq!(read(3_000_000, 100), 100_000);
        assert_eq!(read(3_010_000, 110), 110_000);
        // Off and on; and on again with a count above the previous one.
        assert_eq!(read(0, 5_000), 5_000_000);
        assert_eq!(read(90_000_000, 5_010), 5_010_000);
        // It stood still for 0.9 s and went on counting from there: treated as late for 20 s, then no longer.
        let times: Vec<i64> = (1..=2_100).map(|n| read(90_000_000 + n * 10_000, 5_910 + n as i64 * 10)).collect();
        assert!((5_020_000..5_021_000).contains(&times[0]), "{}", times[0]);
        assert_eq!(times[2_099], 26_910_000);
        assert!(times.windows(2).all(|pair| pair[0] < pair[1]));
    }

    #[test]
    fn readings_may_be_further_apart_than_a_wrap() {
        // 16 bits of microseconds wrap after 65.5 ms.
        for period_ms in [40, 70, 98, 1000, 60_000] {
            let mut clock = DeviceClock::new(1e6, 16);
            for n in 0..500 {
                let ms = n * period_ms;
                let time = clock.time_of(ms as u64 * 1000 % 65_536, at(ms * 1_000_000)).as_nanos();
                assert!((time - ms * 1_000_000).abs() <= 2_000, "{period_ms} ms, reading {n}: {time}");
            }
        }
    }

    #[test]
    fn a_device_as_slow_as_it_may_be_gets_no_time_before_the_measurement() {
        for drift in [2e-4, 1e-2] {
            let mut clock = DeviceClock::new(1e6, 32).with_drift(drift);
            for n in 0..100_000_i64 {
                let measured = n * 100_000_000;
                let ticks = (measured as f64 / 1e3 * (1.0 - drift)) as u64;
                let time = clock.time_of(ticks & 0xffff_ffff, at(measured + 1_000_000)).as_nanos();
                assert!(time >= measured + 1_000_000 - 3_000, "{drift}: {} ns early", measured - time);
            }
        }
    }

    #[test]
    fn one_late_reading_of_a_slow_sensor_is_not_believed() {
        let mut clock = DeviceClock::new(1e6, 32);
        for n in 0..100_i64 {
            let delay = if n == 50 { 1_500_000_000 } else { 5_000_000 };
            let measured = n * 5_000_000_000;
            let time = clock.time_of(measured as u64 / 1_000, at(measured + delay)).as_nanos();
            // Drift of at most 200 ppm within 5 s.
            assert!((measured + 5_000_000..=measured + 6_100_000).contains(&time), "{n}: {}", time - measured);
        }
    }

    #[test]
    fn a_reading_that_was_overtaken_gets_its_own_time() {
        let mut clock = DeviceClock::new(1e6, 32);
        let mut read = |ms: i64, arrival: i64| clock.time_of(ms as u64 * 1_000, at(arrival * 1_000_000)).as_nanos();
        (0..100).for_each(|n| assert!(read(n * 10, n * 10 + 1) > 0));
        let overtaken = read(970, 992);
        assert!((overtaken - 971_000_000).abs() < 10_000, "{overtaken}");
        let next = read(1000, 1008);
        assert!((next - 1_001_000_000).abs() < 10_000, "{next}");
    }

    #[test]
    fn without_a_rate_the_arrival_is_the_time() {
        for rate in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let mut clock = DeviceClock::new(rate, 32);
            assert_eq!([clock.time_of(1, at(5)), clock.time_of(2, at(9))], [at(5), at(9)]);
        }
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
