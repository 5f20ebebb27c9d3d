//! The clock of another machine: its stamps on the local clock, each with a bound that holds however a round trip divides into two ways.
//!
//! A peer that answers a question at `received` and `answered` on its own clock, asked at `asked` and heard at `heard` on the local one,
//! limits the difference δ of the clocks (peer less local) from both sides, since both clocks go forward:
//! δ(`asked`) ≤ `received` − `asked`, and δ(`heard`) ≥ `answered` − `heard`. This is NTP's bound (D. Mills, RFC 5905, section 4), which
//! assumes nothing of the delays. Over time, δ is a line whose slope is limited and changes slowly; all lines between the limits of the
//! last exchanges are possible, and the largest and the smallest of them at a time are the bound. So the quickest question and the
//! quickest answer count, even if they did not belong to one exchange.

use bb_core::MonotonicTime;
use std::time::Duration;

/// Largest difference of the rates of two clocks: crystals are within 100 ppm, and NTP turns a clock by up to 500 ppm.
const RATE: f64 = 5e-4;
/// Largest change of that difference, 1/s: one ppm in a second. A crystal that warms up changes by less. If NTP begins to turn a clock at
/// once, the limits soon contradict each other, and the clock starts over.
const RATE_CHANGE: f64 = 1e-6;
/// Longest time for which a limit is kept, s: the allowance for changes of the rate grows with the square of its age.
const LONGEST_S: f64 = 15.0;

/// One question and its answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Exchange {
    /// Time of the question, on the local clock.
    pub(crate) asked: MonotonicTime,
    /// Time at which the peer received it, on the peer's clock.
    pub(crate) received: MonotonicTime,
    /// Time at which the peer answered, on the peer's clock.
    pub(crate) answered: MonotonicTime,
    /// Time at which the answer was heard, on the local clock.
    pub(crate) heard: MonotonicTime,
}

/// A time of the peer, on the local clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Converted {
    pub(crate) time: MonotonicTime,
    /// Largest distance to the true time.
    pub(crate) bound: Duration,
}

/// The clock of a peer, as the last exchanges limit it.
#[derive(Clone, Debug, Default)]
pub(crate) struct PeerClock {
    /// Difference of the clocks by the first exchange, ns, to which the others are relative: what remains fits a float.
    base: Option<i64>,
    /// Limits from above and from below that can still count, the oldest first: the corners of the convex hulls. The allowances change
    /// them by a linear function of time as they age, which leaves the corners corners.
    highest: Vec<Limit>,
    lowest: Vec<Limit>,
    /// Time of the last question.
    last: Option<MonotonicTime>,
    estimate: Option<Estimate>,
    restarts: u64,
}

/// A limit of the difference at a local time, ns.
#[derive(Clone, Copy, Debug)]
struct Limit {
    time: MonotonicTime,
    difference: f64,
}

impl Limit {
    /// Time since then, ns.
    fn ago(&self, now: MonotonicTime) -> f64 {
        now.nanos_since(self.time) as f64
    }
}

/// Allowance for changes of the rate over a time, and for the rounding of the clocks, ns.
fn allowance(nanos: f64) -> f64 {
    RATE_CHANGE * 1e-9 * nanos * nanos / 2.0 + 4.0
}

/// Adds the newest limit, from above with `side` 1, from below with −1, and removes those that no longer count.
fn push(limits: &mut Vec<Limit>, limit: Limit, now: MonotonicTime, side: f64) {
    limits.retain(|old| old.ago(now) <= LONGEST_S * 1e9);
    let point = |limit: &Limit| {
        let ago = limit.ago(now);
        (-ago, side * limit.difference + allowance(ago))
    };
    while let [.., first, second] = limits.as_slice() {
        let (a, b, c) = (point(first), point(second), point(&limit));
        let turn = (b.0 - a.0) * (c.1 - a.1) - (b.1 - a.1) * (c.0 - a.0);
        // The second is a corner only if it is below the line from the first to the new one.
        if turn > 0.0 {
            break;
        }
        limits.pop();
    }
    limits.push(limit);
}

/// The possible lines at a time: peer's less local time, relative to `base`, in nanoseconds.
#[derive(Clone, Copy, Debug)]
struct Estimate {
    at: MonotonicTime,
    base: i64,
    least: f64,
    most: f64,
    slowest: f64,
    fastest: f64,
}

impl PeerClock {
    /// Takes an exchange; one that cannot have been, with an answer before its question, is ignored.
    pub(crate) fn add(&mut self, exchange: Exchange) {
        if exchange.heard < exchange.asked || exchange.answered < exchange.received {
            return;
        }
        if self.last.is_some_and(|last| exchange.asked < last) {
            return;
        }
        self.limit(exchange);
        if self.estimate.is_none() {
            // A clock has jumped, or its rate has changed: the machine was suspended, or NTP has begun to turn it.
            *self = Self { restarts: self.restarts + 1, ..Self::default() };
            self.limit(exchange);
        }
    }

    fn limit(&mut self, exchange: Exchange) {
        let Exchange { asked, received, answered, heard } = exchange;
        self.last = Some(asked);
        let base = *self.base.get_or_insert(received.nanos_since(asked));
        let highest = Limit { time: asked, difference: received.nanos_since(asked).saturating_sub(base) as f64 };
        let lowest = Limit { time: heard, difference: answered.nanos_since(heard).saturating_sub(base) as f64 };
        push(&mut self.highest, highest, heard, 1.0);
        push(&mut self.lowest, lowest, heard, -1.0);
        self.estimate = Estimate::of(self, heard);
    }

    /// Number of times that it started over, since the exchanges contradicted each other.
    pub(crate) fn restarts(&self) -> u64 {
        self.restarts
    }

    /// A time of the peer on the local clock; `None` before the first exchange.
    pub(crate) fn local(&self, peer: MonotonicTime) -> Option<Converted> {
        let estimate = self.estimate.as_ref()?;
        let middle = estimate.base as f64 + (estimate.least + estimate.most) / 2.0;
        // The difference is that at the local time, which is known to within the bound: it changes over that by its slope.
        let about = peer.plus_nanos((-middle) as i64);
        let (least, most) = estimate.difference(about);
        let time = peer.plus_nanos(estimate.base.saturating_neg()).plus_nanos((-(least + most) / 2.0) as i64);
        let slope = estimate.slowest.abs().max(estimate.fastest.abs());
        // Two are lost to rounding.
        let bound = Duration::from_nanos(((most - least) / 2.0 * (1.0 + 2.0 * slope)).ceil() as u64)
            .saturating_add(Duration::from_nanos(2));
        Some(Converted { time, bound })
    }
}

impl Estimate {
    /// `None` if no line is possible.
    fn of(clock: &PeerClock, at: MonotonicTime) -> Option<Self> {
        let base = clock.base?;
        let highest =
            clock.highest.iter().map(|limit| (limit.difference + allowance(limit.ago(at)), limit.ago(at)));
        let highest: Vec<_> = highest.collect();
        let lowest = clock.lowest.iter().map(|limit| (limit.difference - allowance(limit.ago(at)), limit.ago(at)));
        let lowest: Vec<_> = lowest.collect();
        let (mut slowest, mut fastest) = (-RATE, RATE);
        for (high, high_ago) in &highest {
            for (low, low_ago) in &lowest {
                let (rise, run) = (high - low, low_ago - high_ago);
                if run > 0.0 {
                    fastest = fastest.min(rise / run);
                } else if run < 0.0 {
                    slowest = slowest.max(rise / run);
                } else if rise < 0.0 {
                    return None;
                }
            }
        }
        if slowest > fastest {
            return None;
        }
        // Towards now, a line rises by its slope; the highest is that of the greatest slope.
        let most = highest.iter().map(|(high, ago)| high + fastest * ago).fold(f64::INFINITY, f64::min);
        let least = lowest.iter().map(|(low, ago)| low + slowest * ago).fold(f64::NEG_INFINITY, f64::max);
        (least <= most).then_some(Self { at, base, least, most, slowest, fastest })
    }

    /// Least and greatest difference at a local time.
    fn difference(&self, local: MonotonicTime) -> (f64, f64) {
        let later = local.nanos_since(self.at) as f64;
        let allowance = allowance(later);
        let (slow, fast) = (self.slowest * later, self.fastest * later);
        (self.least + slow.min(fast) - allowance, self.most + slow.max(fast) + allowance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const MS: i64 = 1_000_000;

    fn at(nanos: i64) -> MonotonicTime {
        MonotonicTime::from_nanos(nanos)
    }

    /// Two clocks and the ways between them; the local clock is the truth.
    struct Link {
        offset: i64,
        rate: f64,
        /// Least and greatest delay there and back, ns.
        there: (i64, i64),
        back: (i64, i64),
        random: u64,
    }

    impl Link {
        fn peer(&self, local: i64) -> i64 {
            local + self.offset + (local as f64 * self.rate) as i64
        }

        fn delay(&mut self, (least, most): (i64, i64)) -> i64 {
            self.random =
                self.random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            least + ((self.random >> 33) as i64) % (most - least + 1)
        }

        fn exchange(&mut self, asked: i64) -> Exchange {
            let received = asked + self.delay(self.there);
            let answered = received + 20_000;
            let heard = answered + self.delay(self.back);
            Exchange {
                asked: at(asked),
                received: at(self.peer(received)),
                answered: at(self.peer(answered)),
                heard: at(heard),
            }
        }
    }

    /// Asks a peer, one question at a time, and converts a stamp each 5 ms, none of which may be off by more than its bound. Returns the
    /// bounds of the stamps after 5 s, sorted, and the least round trip, ns.
    fn run(link: &mut Link, seconds: i64) -> (Vec<i64>, i64) {
        let mut clock = PeerClock::default();
        let (mut bounds, mut least_trip) = (Vec::new(), i64::MAX);
        let (mut due, mut count, mut pending) = (0, 0, None::<Exchange>);
        for now in (0..seconds * 1000).step_by(5).map(|ms| ms * MS) {
            if let Some(exchange) = pending.filter(|exchange| exchange.heard <= at(now)) {
                clock.add(exchange);
                pending = None;
            }
            if pending.is_none() && now >= due {
                let exchange = link.exchange(now);
                let inside = exchange.answered.nanos_since(exchange.received);
                least_trip = least_trip.min(exchange.heard.nanos_since(exchange.asked) - inside);
                count += 1;
                due = now + if count < 50 { 10 } else { 50 } * MS;
                pending = Some(exchange);
            }
            // Measured up to 20 ms ago.
            let measured = now - link.delay((0, 20 * MS));
            let Some(converted) = clock.local(at(link.peer(measured))) else { continue };
            let error = converted.time.nanos_since(at(measured)).abs();
            let bound = converted.bound.as_nanos() as i64;
            assert!(error <= bound, "at {now}: {error} beyond {bound}");
            if now >= 5_000 * MS {
                bounds.push(bound);
            }
        }
        assert_eq!(clock.restarts(), 0);
        bounds.sort_unstable();
        (bounds, least_trip)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn no_stamp_is_off_by_more_than_its_bound(
            rate in -1e-4..1e-4_f64,
            offset in -10_000..10_000_i64,
            there in (0..20_i64, 0..6_i64),
            back in (0..20_i64, 0..6_i64),
            random: u64,
        ) {
            let way = |(least, more): (i64, i64)| (least * MS, (least + more) * MS);
            let mut link = Link { offset: offset * MS, rate, there: way(there), back: way(back), random };
            run(&mut link, 15);
        }

        #[test]
        fn no_times_panic(times: Vec<(i64, i64, i64, i64)>, stamps in any::<[i64; 4]>()) {
            let mut clock = PeerClock::default();
            for (asked, received, answered, heard) in times {
                clock.add(Exchange { asked: at(asked), received: at(received), answered: at(answered), heard: at(heard) });
                let _ = stamps.map(|stamp| clock.local(at(stamp)));
            }
        }
    }

    /// Delays of 5 ± 3 ms: all ways between the limits of the last seconds are possible, so the bound is above half of the least round
    /// trip.
    #[test]
    fn the_bound_is_near_half_of_the_least_round_trip_with_jitter() {
        for (rate, random) in [(1e-4, 1), (-1e-4, 2), (0.0, 3)] {
            let mut link =
                Link { offset: 10_000 * MS, rate, there: (2 * MS, 8 * MS), back: (2 * MS, 8 * MS), random };
            let (bounds, least) = run(&mut link, 60);
            let above = [50, 99].map(|percent| bounds[bounds.len() * percent / 100] - least / 2);
            assert!(above[0] < 500_000 && above[1] < 1_100_000, "{above:?} ns above {least} / 2");
        }
    }

    #[test]
    fn the_bound_is_half_of_the_round_trip_if_its_ways_differ() {
        for (there, back) in [(1, 20), (20, 1)] {
            for rate in [1e-4, -1e-4] {
                let (there, back) = ((there * MS, there * MS), (back * MS, back * MS));
                let mut link = Link { offset: 10_000 * MS, rate, there, back, random: 1 };
                let (bounds, least) = run(&mut link, 60);
                let p99 = bounds[bounds.len() * 99 / 100];
                assert!(p99 <= least / 2 + 100_000, "{p99} ns, of {least}");
            }
        }
    }

    #[test]
    fn a_clock_that_jumps_is_learnt_again() {
        let mut link = Link { offset: 0, rate: 0.0, there: (MS, MS), back: (MS, MS), random: 1 };
        let mut clock = PeerClock::default();
        (0..100).for_each(|n| clock.add(link.exchange(n * 10 * MS)));
        link.offset = 5_000 * MS;
        clock.add(link.exchange(1_000 * MS));
        assert_eq!(clock.restarts(), 1);
        let converted = clock.local(at(6_000 * MS)).expect("it is known");
        assert!(converted.time.nanos_since(at(1_000 * MS)).abs() <= converted.bound.as_nanos() as i64);
        assert!(converted.bound < Duration::from_millis(2), "{converted:?}");
    }
}
