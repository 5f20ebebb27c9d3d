//! Mean and variance of vectors, one after the other.

use nalgebra::Vector3;

/// Mean, and sum of squared differences to it, by component; B. P. Welford, Technometrics 4(3), 1962.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Moments {
    pub(crate) mean: Vector3<f64>,
    pub(crate) squares: Vector3<f64>,
}

impl Moments {
    /// Adds a value; `count` includes it.
    pub(crate) fn add(&mut self, count: f64, value: &Vector3<f64>) {
        let before = value - self.mean;
        self.mean += before / count;
        self.squares += before.component_mul(&(value - self.mean));
    }

    /// Adds those of `others` further values to those of `count`; T. F. Chan, G. H. Golub, R. J. LeVeque, COMPSTAT
    /// 1982.
    pub(crate) fn merge(&mut self, count: f64, other: &Self, others: f64) {
        let difference = other.mean - self.mean;
        let part = others / (count + others);
        self.mean += difference * part;
        self.squares += other.squares + difference.component_mul(&difference) * (count * part);
    }

    /// The variance of the component that varies most.
    pub(crate) fn largest_variance(&self, count: f64) -> f64 {
        self.squares.max() / count
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bb_tests::laws;
    use proptest::prelude::*;

    fn moments(values: &[[f64; 3]]) -> Moments {
        let mut moments = Moments::default();
        for (index, value) in values.iter().enumerate() {
            moments.add((index + 1) as f64, &Vector3::from(*value));
        }
        moments
    }

    laws! {
        #[test]
        fn merged_parts_are_the_whole(
            one in proptest::collection::vec(proptest::array::uniform3(-1e3..1e3_f64), 1..20),
            other in proptest::collection::vec(proptest::array::uniform3(-1e3..1e3_f64), 1..20),
        ) {
            let all: Vec<_> = one.iter().chain(&other).copied().collect();
            let (mut merged, whole) = (moments(&one), moments(&all));
            merged.merge(one.len() as f64, &moments(&other), other.len() as f64);
            prop_assert!((merged.mean - whole.mean).amax() <= 1e-9);
            prop_assert!((merged.squares - whole.squares).amax() <= 1e-9 * (1.0 + whole.squares.amax()));
            // And the whole agrees with the definition.
            let mean = all.iter().map(|value| Vector3::from(*value)).sum::<Vector3<f64>>() / all.len() as f64;
            let squares: Vector3<f64> = all.iter().map(|value| (Vector3::from(*value) - mean).map(|x| x * x)).sum();
            prop_assert!((whole.mean - mean).amax() <= 1e-9);
            let variance = squares.max() / all.len() as f64;
            prop_assert!((whole.largest_variance(all.len() as f64) - variance).abs() <= 1e-9 * (1.0 + variance));
        }
    }
}
