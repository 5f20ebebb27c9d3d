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

/// The deviation of one period in ten from a multiple of the shortest usual period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jitter {
    /// The shortest usual period, s.
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
        let mut sorted: Vec<f64> = steps().filter(|step| *step >= 0.0).collect();
        sorted.sort_by(f64::total_cmp);
        let (first, last) = (*sorted.first()?, *sorted.last()?);
        let count = sorted.len() as f64;
        let mean_s = sorted.iter().sum::<f64>() / count;
        let variance = sorted.iter().map(|step| (step - mean_s).powi(2)).sum::<f64>() / count;
        let median_s = sorted[sorted.len() / 2];
        let tenths = |tenths: usize| sorted[sorted.len() * tenths / 10];
        let is_regular = tenths(9) <= REGULAR * median_s && tenths(1) * BURST >= median_s && median_s > 0.0;
        let regular = (sorted.len() >= FEWEST).then_some(is_regular);
        let jitter = (regular == Some(true)).then(|| jitter(&sorted)).flatten();
        let gaps = steps().enumerate().filter(|(_, step)| regular == Some(true) && *step > GAP * median_s);
        Some(Self {
            mean_s,
            min_s: first,
            max_s: last,
            std_s: variance.sqrt(),
            median_s,
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

    /// Messages per second, if they come at a rate.
    pub fn rate_hz(&self) -> Option<f64> {
        (self.mean_s > 0.0 && self.regular != Some(false)).then(|| 1.0 / self.mean_s)
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

/// The jitter of periods in ascending order. A message that is missing leaves a multiple of the period.
fn jitter(sorted: &[f64]) -> Option<Jitter> {
    let short = sorted[sorted.len() / 10];
    let usual = &sorted[..sorted.partition_point(|period| *period < 1.5 * short)];
    let period_s = *usual.get(usual.len() / 2)?;
    let off = |period: &f64| (period - (period / period_s).round() * period_s).abs();
    let mut deviations: Vec<f64> = sorted.iter().map(off).collect();
    deviations.sort_by(f64::total_cmp);
    let deviation_s = deviations[deviations.len() * 9 / 10];
    (deviation_s > JITTER * period_s).then_some(Jitter { period_s, deviation_s })
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
