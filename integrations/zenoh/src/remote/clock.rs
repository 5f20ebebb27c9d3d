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
    /// Earliest local time at which it can have been, also if the peer's clock was put forward after its last answer.
    pub(crate) since: MonotonicTime,
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
    last: Option<Exchange>,
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

/// The last of a list up to which each is better than the one before, by halving.
fn turning<T>(list: &[T], is_better: impl Fn(&T, &T) -> bool) -> Option<&T> {
    let (mut first, mut last) = (0, list.len().checked_sub(1)?);
    while first < last {
        let middle = first + (last - first) / 2;
        if is_better(&list[middle], &list[middle + 1]) { first = middle + 1 } else { last = middle }
    }
    list.get(first)
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
        if self.last.is_some_and(|last| exchange.asked < last.asked) {
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
        self.last = Some(exchange);
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
        let (estimate, last) = (self.estimate.as_ref()?, self.last?);
        // What the peer stamps after it has answered is after the question. Of a time before that, the distance is known: a clock that was
        // put forward makes it longer.
        let since = last.asked.plus_nanos(peer.nanos_since(last.answered).min(0));
        let middle = estimate.base as f64 + (estimate.least + estimate.most) / 2.0;
        // The difference is that at the local time, which is known to within the bound: it changes over that by its slope.
        let about = peer.plus_nanos((-middle) as i64);
        let (least, most) = estimate.difference(about);
        let time = peer.plus_nanos(estimate.base.saturating_neg()).plus_nanos((-(least + most) / 2.0) as i64);
        let slope = estimate.slowest.abs().max(estimate.fastest.abs());
        // Two are lost to rounding.
        let bound = Duration::from_nanos(((most - least) / 2.0 * (1.0 + 2.0 * slope)).ceil() as u64)
            .saturating_add(Duration::from_nanos(2));
        Some(Converted { time, bound, since })
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
        // Of the corners of a convex hull, that with the least slope to a point is found by halving: each is a limit by itself, so that
        // one that is missed by rounding leaves the bound wider.
        for (high, high_ago) in &highest {
            let slope = |&(low, low_ago): &(f64, f64)| (high - low) / (low_ago - high_ago);
            let earlier = lowest.partition_point(|(_, low_ago)| low_ago > high_ago);
            let (before, after) = lowest.split_at(earlier);
            let same = after.iter().take_while(|(_, low_ago)| low_ago == high_ago);
            if same.clone().any(|(low, _)| high < low) {
                return None;
            }
            let after = &after[same.count()..];
            fastest = turning(before, |one, next| slope(next) < slope(one))
                .map_or(fastest, |low| fastest.min(slope(low)));
            slowest =
                turning(after, |one, next| slope(next) > slope(one)).map_or(slowest, |low| slowest.max(slope(low)));
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
        /// Change of the rate, 1/s, and the time at which it turns round, s.
        change: f64,
        turn_s: f64,
        /// Least and greatest delay there and back, ns.
        there: (i64, i64),
        back: (i64, i64),
        random: u64,
    }

    impl Link {
        fn new(offset: i64, rate: f64, there: (i64, i64), back: (i64, i64), random: u64) -> Self {
            Self { offset, rate, change: 0.0, turn_s: f64::INFINITY, there, back, random }
        }

        fn peer(&self, local: i64) -> i64 {
            let s = local as f64 * 1e-9;
            let (before, after) = (s.min(self.turn_s), (s - self.turn_s).max(0.0));
            let gained_s = self.rate * s
                + self.change * (before * before / 2.0)
                + if after > 0.0 { self.change * (before * after - after * after / 2.0) } else { 0.0 };
            local + self.offset + (gained_s * 1e9) as i64
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
                due = now + if count < 50 { 10 } else { 20 } * MS;
                pending = Some(exchange);
            }
            // Measured up to 20 ms ago.
            let measured = now - link.delay((0, 20 * MS));
            let Some(converted) = clock.local(at(link.peer(measured))) else { continue };
            let error = converted.time.nanos_since(at(measured)).abs();
            let bound = converted.bound.as_nanos() as i64;
            assert!(error <= bound, "at {now}: {error} beyond {bound}");
            // It gains at most 500 ppm.
            let early = at(measured).nanos_since(converted.since);
            assert!((-MS / 100..120 * MS).contains(&early), "at {now}: {early} before");
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
            rate in -4.8e-4..4.8e-4_f64,
            change in -1e-6..1e-6_f64,
            turn_s in 0.0..20.0,
            offset in -10_000..10_000_i64,
            there in (0..20_i64, 0..6_i64),
            back in (0..20_i64, 0..6_i64),
            random: u64,
        ) {
            let way = |(least, more): (i64, i64)| (least * MS, (least + more) * MS);
            let link = Link::new(offset * MS, rate, way(there), way(back), random);
            run(&mut Link { change, turn_s, ..link }, 15);
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
            let mut link = Link::new(10_000 * MS, rate, (2 * MS, 8 * MS), (2 * MS, 8 * MS), random);
            let (bounds, least) = run(&mut link, 60);
            let above = [50, 99].map(|percent| bounds[bounds.len() * percent / 100] - least / 2);
            assert!(above[0] < 300_000 && above[1] < 700_000, "{above:?} ns above {least} / 2");
        }
    }

    #[test]
    fn the_bound_is_half_of_the_round_trip_if_its_ways_differ() {
        for (there, back) in [(1, 20), (20, 1)] {
            for rate in [1e-4, -1e-4] {
                let (there, back) = ((there * MS, there * MS), (back * MS, back * MS));
                let mut link = Link::new(10_000 * MS, rate, there, back, 1);
                let (bounds, least) = run(&mut link, 60);
                let p99 = bounds[bounds.len() * 99 / 100];
                assert!(p99 <= least / 2 + 100_000, "{p99} ns, of {least}");
            }
        }
    }

    /// NTP begins to turn the peer's clock by 400 ppm at once, which is more than the bound allows for. Over a quick link, stamps are off by
    /// more than it, by up to 0.15 ms, until the limits contradict each other.
    #[test]
    fn a_clock_that_is_turned_at_once_is_learnt_again_within_a_second() {
        for (change, least) in [(4e-4, MS), (-4e-4, MS), (4e-4, MS / 10), (-4e-4, MS / 10)] {
            let mut link = Link::new(0, 0.0, (least, 2 * least), (least, 2 * least), 1);
            let mut clock = PeerClock::default();
            let mut wrong = Vec::new();
            for step in 0..1500_i64 {
                let now = step * 20 * MS;
                if now == 10_000 * MS {
                    // The clock goes on from where it is.
                    (link.rate, link.offset) = (change, -(10_000.0 * MS as f64 * change) as i64);
                }
                clock.add(link.exchange(now));
                let converted = clock.local(at(link.peer(now))).expect("it is known");
                let error = converted.time.nanos_since(at(now)).abs();
                if error > converted.bound.as_nanos() as i64 {
                    wrong.push((step * 20, error));
                }
            }
            assert_eq!(clock.restarts(), u64::from(!wrong.is_empty()), "{wrong:?}");
            let is_right = |(ms, error): &(i64, i64)| (10_000..11_000).contains(ms) && *error < MS / 5;
            assert!(wrong.iter().all(is_right), "{wrong:?}");
        }
    }

    /// Stamps that arrive before the clock is asked again are converted by what it was before.
    #[test]
    fn a_clock_that_is_put_forward_makes_nothing_younger_than_it_can_be() {
        for forward in [0, 150, 3_000] {
            let mut link = Link::new(-7_000 * MS, 0.0, (MS, 3 * MS), (MS, 3 * MS), 1);
            let mut clock = PeerClock::default();
            (0..100).for_each(|n| clock.add(link.exchange(n * 20 * MS)));
            link.offset += forward * MS;
            for measured in (1_990..3_000).map(|ms| ms * MS) {
                let converted = clock.local(at(link.peer(measured))).expect("it is known");
                assert!(converted.since <= at(measured), "{measured}, put forward by {forward} ms: {converted:?}");
            }
        }
    }

    #[test]
    fn a_clock_that_jumps_is_learnt_again() {
        let mut link = Link::new(0, 0.0, (MS, MS), (MS, MS), 1);
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
