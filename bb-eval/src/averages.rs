//! Averages over recordings, with equal weights for recordings of all lengths.

use crate::score::Degrees;

/// The mean and the worst of root mean squares over recordings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Averages {
    /// The number of recordings.
    pub count: usize,
    /// Mean of each angle separately.
    pub mean: Degrees,
    /// The largest of each angle separately.
    pub worst: Degrees,
}

impl Averages {
    /// Averages the recordings' root mean squares; `None` if there are none.
    pub fn of(scores: impl IntoIterator<Item = Degrees>) -> Option<Self> {
        let scores: Vec<_> = scores.into_iter().collect();
        let over = |fold: fn(&[f64]) -> f64| {
            let angle = |of: fn(&Degrees) -> f64| fold(&scores.iter().map(of).collect::<Vec<_>>());
            Degrees {
                total: angle(|score| score.total),
                heading: angle(|score| score.heading),
                inclination: angle(|score| score.inclination),
            }
        };
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        // NaN counts as the worst.
        let worst = |values: &[f64]| values.iter().copied().fold(0.0, |a: f64, b| if a >= b { a } else { b });
        (!scores.is_empty()).then(|| Self { count: scores.len(), mean: over(mean), worst: over(worst) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_and_worst_are_of_each_angle() {
        let score = |total, heading, inclination| Degrees { total, heading, inclination };
        assert_eq!(Averages::of([]), None);
        let averages = Averages::of([score(1.0, 0.5, 3.0), score(3.0, 2.5, 1.0)]).expect("two");
        assert_eq!(averages.count, 2);
        assert_eq!(averages.mean, score(2.0, 1.5, 2.0));
        assert_eq!(averages.worst, score(3.0, 2.5, 3.0));
        let broken = Averages::of([score(1.0, 1.0, 1.0), score(f64::NAN, 1.0, 1.0)]).expect("two");
        assert!(broken.worst.total.is_nan() && broken.mean.total.is_nan());
    }
}
