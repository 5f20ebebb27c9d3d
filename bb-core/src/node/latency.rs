//! Callback durations, as a histogram that can be read while it is written.
//!
//! Each bucket is an eighth of a power of two wide: a quantile is accurate within 12.5 %. Counting is a load and a store, since the
//! thread that holds the estimator is the only writer; existing histogram crates need a lock for that.

use super::count::Count;
use std::fmt;
use std::time::Duration;

/// Buckets per power of two.
const PARTS: usize = 8;
/// Number of buckets: up to 2^40 ns, 18 minutes.
const BUCKETS: usize = 40 * PARTS;

pub(super) struct Latency {
    buckets: Box<[Count; BUCKETS]>,
    longest: Count,
}

impl Default for Latency {
    fn default() -> Self {
        Self { buckets: Box::new(core::array::from_fn(|_| Count::default())), longest: Count::default() }
    }
}

impl fmt::Debug for Latency {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.statistics().fmt(f)
    }
}

impl Latency {
    #[inline]
    pub(super) fn add(&self, nanos: u64) {
        self.buckets[bucket(nanos)].increment();
        if nanos > self.longest.get() {
            self.longest.set(nanos);
        }
    }

    pub(super) fn statistics(&self) -> LatencyStatistics {
        let counts: Vec<u64> = self.buckets.iter().map(Count::get).collect();
        let total: u64 = counts.iter().sum();
        let quantile = |part: f64| {
            let rank = (total as f64 * part).ceil() as u64;
            let mut below = 0;
            let found = counts.iter().position(|count| {
                below += count;
                below >= rank && total > 0
            });
            Duration::from_nanos(found.map_or(0, upper_end).min(self.longest.get()))
        };
        LatencyStatistics {
            count: total,
            median: quantile(0.5),
            p99: quantile(0.99),
            p999: quantile(0.999),
            longest: Duration::from_nanos(self.longest.get()),
        }
    }
}

/// Each value below 8 ns has its own bucket; above, the three bits after the highest one select among the parts of a power.
#[inline]
fn bucket(nanos: u64) -> usize {
    if nanos < PARTS as u64 {
        return nanos as usize;
    }
    let power = nanos.ilog2() as usize;
    let part = (nanos >> (power - 3)) as usize & (PARTS - 1);
    ((power - 2) * PARTS + part).min(BUCKETS - 1)
}

/// The largest number of nanoseconds in a bucket.
fn upper_end(bucket: usize) -> u64 {
    if bucket < PARTS {
        return bucket as u64;
    }
    let (power, part) = (bucket / PARTS + 2, bucket % PARTS);
    ((PARTS + part + 1) as u64) << (power - 3)
}

/// Durations of callbacks. Quantiles are accurate within an eighth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct LatencyStatistics {
    /// Number of measured callbacks.
    pub count: u64,
    /// The median.
    pub median: Duration,
    /// The 99th percentile.
    pub p99: Duration,
    /// The 99.9th percentile.
    pub p999: Duration,
    /// The longest.
    pub longest: Duration,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_right_within_an_eighth() {
        let latency = Latency::default();
        (1..=100_000_u64).for_each(|nanos| latency.add(nanos));
        let statistics = latency.statistics();
        assert_eq!((statistics.count, statistics.longest.as_nanos()), (100_000, 100_000));
        for (found, expected) in
            [(statistics.median, 50_000.0), (statistics.p99, 99_000.0), (statistics.p999, 99_900.0)]
        {
            let ratio = found.as_nanos() as f64 / expected;
            assert!((1.0..=1.125).contains(&ratio), "{ratio}");
        }
    }

    #[test]
    fn buckets_follow_each_other_without_gaps() {
        for nanos in (0..100_000).chain((0..63).map(|power| 1 << power)) {
            let bucket = bucket(nanos);
            assert!(nanos <= upper_end(bucket) || bucket == BUCKETS - 1, "{nanos}");
            assert!(
                bucket == 0 || nanos > upper_end(bucket - 1) || nanos < 8 || nanos == upper_end(bucket - 1),
                "{nanos}"
            );
        }
        assert_eq!(Latency::default().statistics(), LatencyStatistics::default());
    }
}
