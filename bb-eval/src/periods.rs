//! The times between messages.

use serde::Serialize;

/// Statistics of the times between messages.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Periods {
    /// The mean, s.
    pub mean_s: f64,
    /// The shortest, s.
    pub min_s: f64,
    /// The longest, s.
    pub max_s: f64,
    /// The standard deviation, s.
    pub std_s: f64,
    /// The median, s.
    pub median_s: f64,
    /// The mean without gaps and jumps, s.
    #[serde(skip)]
    usual_s: f64,
    /// `true` if messages come at a rate; unknown if there are few.
    pub regular: Option<bool>,
    /// Periods that differ from another, if they do by much; known only if they come regularly.
    #[serde(skip)]
    pub jitter: Option<Jitter>,
    /// Gaps in the messages; known only if they come regularly.
    #[serde(skip)]
    pub gaps: Vec<Gap>,
    /// Indices of the messages after which time goes backwards.
    #[serde(skip)]
    pub backward: Vec<usize>,
    /// The number of messages with the same time as the previous one.
    #[serde(skip)]
    pub repeated: usize,
}

/// The deviation of one period in ten from a multiple of the mean outside of gaps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jitter {
    /// The mean outside of gaps, s.
    pub period_s: f64,
    /// The deviation, s.
    pub deviation_s: f64,
}

/// A time without messages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// The index of the message before it.
    pub after: usize,
    /// Length, s.
    pub length_s: f64,
}

/// A period longer than this many medians is a gap.
const GAP: f64 = 3.0;
/// Periods jitter if one in ten deviates by this part.
const JITTER: f64 = 0.25;
/// Messages are regular if nine of ten periods are at most this many medians,
const REGULAR: f64 = 2.0;
/// and nine of ten are not this many times shorter than the median, as in a burst;
const BURST: f64 = 10.0;
/// known only with at least this many periods.
const FEWEST: usize = 8;

impl Periods {
    /// Computes the periods from the times of messages in order, nanoseconds; `None` if there are fewer than two. Times
    /// that go back do not count as periods.
    pub fn of(times_ns: &[i64]) -> Option<Self> {
        let seconds = |ns: i64| ns as f64 * 1e-9;
        let steps = || times_ns.windows(2).map(|pair| seconds(pair[1].saturating_sub(pair[0])));
        let mut all: Vec<f64> = steps().collect();
        all.sort_by(f64::total_cmp);
        let sorted = &all[all.partition_point(|step| *step < 0.0)..];
        let (first, last) = (*sorted.first()?, *sorted.last()?);
        let count = sorted.len() as f64;
        let mean_s = sorted.iter().sum::<f64>() / count;
        let variance = sorted.iter().map(|step| (step - mean_s).powi(2)).sum::<f64>() / count;
        // Of those that go back too: where stamps jitter, the others alone are too long.
        let median_s = all[all.len() / 2];
        let usual = all.iter().filter(|step| step.abs() <= GAP * median_s);
        let (sum_s, usual) = usual.fold((0.0, 0.0), |(sum_s, count), step| (sum_s + step, count + 1.0));
        let usual_s = if usual > 0.0 { sum_s / usual } else { 0.0 };
        let tenths = |tenths: usize| sorted[sorted.len() * tenths / 10];
        let is_regular = tenths(9) <= REGULAR * median_s && tenths(1) * BURST >= median_s && median_s > 0.0;
        let regular = (sorted.len() >= FEWEST).then_some(is_regular);
        let jitter = (regular == Some(true)).then(|| jitter(sorted, [median_s, usual_s])).flatten();
        let gaps = steps().enumerate().filter(|(_, step)| regular == Some(true) && *step > GAP * median_s);
        Some(Self {
            mean_s,
            min_s: first,
            max_s: last,
            std_s: variance.sqrt(),
            median_s,
            usual_s,
            regular,
            jitter,
            gaps: gaps.map(|(after, length_s)| Gap { after, length_s }).collect(),
            backward: steps().enumerate().filter(|(_, step)| *step < 0.0).map(|(index, _)| index + 1).collect(),
            repeated: steps().filter(|step| *step == 0.0).count(),
        })
    }

    /// Returns the periods as those of events: they have no rate, and so no gaps.
    pub fn of_events(self) -> Self {
        Self { regular: Some(false), jitter: None, gaps: Vec::new(), ..self }
    }

    /// Messages per second outside of gaps, if they come at a rate.
    pub fn rate_hz(&self) -> Option<f64> {
        (self.usual_s > 0.0 && self.regular != Some(false)).then(|| 1.0 / self.usual_s)
    }

    /// The rate with this many decimals, for a table.
    pub fn rate_in_words(&self, decimals: usize) -> String {
        match (self.rate_hz(), self.regular) {
            (Some(rate), _) => format!("{rate:.decimals$} Hz"),
            (None, Some(false)) => "irregular".to_owned(),
            (None, _) => "-".to_owned(),
        }
    }
}

/// The jitter of periods in ascending order. A message that is missing leaves a multiple of the period: they jitter only if
/// they are multiples neither of the shortest usual period nor of the median or the mean.
fn jitter(sorted: &[f64], [median_s, usual_s]: [f64; 2]) -> Option<Jitter> {
    let short = sorted[sorted.len() / 10];
    let usual = &sorted[..sorted.partition_point(|period| *period < 1.5 * short)];
    let of = |period_s: f64| {
        let off = |period: &f64| (period - (period / period_s).round().max(1.0) * period_s).abs();
        let mut deviations: Vec<f64> = sorted.iter().map(off).collect();
        deviations.sort_by(f64::total_cmp);
        let deviation_s = deviations[deviations.len() * 9 / 10];
        (deviation_s > JITTER * period_s).then_some(Jitter { period_s, deviation_s })
    };
    of(*usual.get(usual.len() / 2)?).and(of(median_s)).and(of(usual_s))
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    #[test]
    fn regular_messages_have_gaps() {
        let mut times: Vec<i64> = (0..100).map(|index| index * 10 * MS).collect();
        times.iter_mut().skip(50).for_each(|time| *time += 500 * MS);
        let periods = Periods::of(&times).expect("there are some");
        assert_eq!(periods.gaps, [Gap { after: 49, length_s: 0.51 }]);
        assert!((periods.median_s - 0.01).abs() < 1e-12 && (periods.max_s - 0.51).abs() < 1e-12);
        assert!((periods.mean_s - (0.98 + 0.51) / 99.0).abs() < 1e-12);
    }

    /// A receiver at 5 Hz that is silent for half a minute, and a clock that is set in between.
    #[test]
    fn the_rate_is_that_outside_of_gaps_and_jumps() {
        let late = |index: i64| if index >= 300 { 30_000 } else { 0 } - if index >= 800 { 7_000_000 } else { 0 };
        let times: Vec<i64> = (0..1350).map(|index| (10_000_000 + index * 200 + late(index)) * MS).collect();
        let rate = Periods::of(&times).and_then(|periods| periods.rate_hz()).expect("has one");
        assert!((rate - 5.0).abs() < 1e-9, "{rate}");
        // By a clock of whole milliseconds.
        let rounded: Vec<i64> = (0..1000).map(|index| index * 5 / 2 * MS).collect();
        let rate = Periods::of(&rounded).and_then(|periods| periods.rate_hz()).expect("has one");
        assert!((rate - 400.0).abs() < 0.2, "{rate}");
    }

    /// Jitter by less than half a period, and by so much that some stamps go back.
    #[test]
    fn jitter_is_about_the_period() {
        for most in [6, 9, 13] {
            let times: Vec<i64> =
                (0..3000_i64).map(|index| index * 10 * MS + index * index * 7919 % 101 * most * MS / 100).collect();
            let periods = Periods::of(&times).expect("there are some");
            let jitter = periods.jitter.expect("they jitter");
            assert!((jitter.period_s - 0.01).abs() < 3e-4, "{most}: {jitter:?}");
            assert!((periods.rate_hz().expect("has one") - 100.0).abs() < 0.5, "{most}: {:?}", periods.rate_hz());
        }
        // Every second of three messages is missing.
        let missing: Vec<i64> = (0..1000).map(|index| index * 3 / 2 * 10 * MS).collect();
        assert_eq!(Periods::of(&missing).expect("there are some").jitter, None);
    }

    #[test]
    fn messages_that_come_as_they_like_have_none() {
        let times: Vec<i64> = (0..30_i64).map(|index| index * index * index * MS).collect();
        assert_eq!(Periods::of(&times).expect("there are some").gaps, []);
        assert_eq!(Periods::of(&[0, 5 * MS, 900 * MS]).expect("there are some").gaps, []);
        assert_eq!(Periods::of(&[7]), None);
        assert_eq!(Periods::of(&[]), None);
    }

    /// Bursts, like health changes: twice within a millisecond, then nothing for a while.
    #[test]
    fn bursts_have_no_rate_and_no_gaps() {
        let bursts: Vec<i64> =
            (0..40).map(|index| (index / 2 * 1000 + index % 2 + index / 20 * 9000) * MS).collect();
        let at_once: Vec<i64> = (0..40).map(|index| index / 10 * 1000 * MS).collect();
        let late: Vec<i64> = (0..40).map(|index| (index * 50 + index % 3 * 20) * MS).collect();
        assert_eq!(Periods::of(&late).expect("there are some").regular, Some(true), "jitter is no burst");
        for times in [bursts, at_once] {
            let periods = Periods::of(&times).expect("there are some");
            assert_eq!((periods.regular, periods.rate_hz(), &*periods.gaps), (Some(false), None, &[][..]));
            assert_eq!(periods.rate_in_words(1), "irregular");
        }
        let mut times: Vec<i64> = (0..40).map(|index| index * 1000 * MS).collect();
        times.push(90_000 * MS);
        assert_eq!(Periods::of(&times).expect("there are some").gaps.len(), 1);
        let events = Periods::of(&times).expect("there are some").of_events();
        assert_eq!((events.rate_hz(), &*events.gaps), (None, &[][..]));
    }

    #[test]
    fn times_that_go_back_or_stand_still_are_counted() {
        let periods = Periods::of(&[0, 10, 20, 20, 5, 15]).expect("there are some");
        assert_eq!((periods.backward, periods.repeated), (vec![4], 1));
        assert_eq!(Periods::of(&[20, 10, 0]), None);
    }
}
