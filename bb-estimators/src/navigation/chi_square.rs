//! The χ² distribution, whose quantiles are the gate thresholds.

use crate::navigation::math::{exp, sqrt};

/// Probability that the sum of the squares of `dimension` standard normal numbers exceeds `x`.
///
/// By the recurrence `Q(k + 2, x) = Q(k, x) + (x/2)^(k/2) exp(-x/2) / Γ(k/2 + 1)`; M. Abramowitz, I. Stegun, "Handbook of
/// Mathematical Functions", 1964, 26.4.8.
pub fn exceedance(dimension: usize, x: f64) -> f64 {
    if x.is_nan() || x <= 0.0 {
        return 1.0;
    }
    let half = 0.5 * x;
    let tail = exp(-half);
    let is_odd = dimension % 2 == 1;
    // The first term that the recurrence adds: k = 1 with Γ(3/2) = √π / 2, k = 2 with Γ(2) = 1.
    let (mut k, mut sum) = if is_odd { (1, complementary_error(sqrt(half))) } else { (2, tail) };
    let mut term = if is_odd { sqrt(half) * tail * core::f64::consts::FRAC_2_SQRT_PI } else { half * tail };
    if dimension == 0 {
        return 0.0;
    }
    while k < dimension {
        sum += term;
        k += 2;
        term *= half / (0.5 * k as f64);
    }
    sum
}

/// The `x` that is exceeded with the given probability: the threshold of a gate that rejects this fraction of good measurements.
/// Infinite for a probability of 0, and 0 for a probability of 1.
pub fn limit(dimension: usize, probability: f64) -> f64 {
    if probability.is_nan() || probability <= 0.0 {
        return f64::INFINITY;
    }
    let (mut low, mut high) = (0.0, 4.0);
    while exceedance(dimension, high) > probability && high < 1e4 {
        low = high;
        high *= 2.0;
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if exceedance(dimension, middle) > probability {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// `erfc(x)` for `x ≥ 0`: its series below 2.5, its continued fraction beyond; Abramowitz and Stegun, 7.1.6 and 7.1.14.
fn complementary_error(x: f64) -> f64 {
    let square = x * x;
    if x < 2.5 {
        let (mut term, mut sum, mut n) = (x, x, 0.0);
        while term > 1e-17 * sum {
            n += 1.0;
            term *= 2.0 * square / (2.0 * n + 1.0);
            sum += term;
        }
        return 1.0 - core::f64::consts::FRAC_2_SQRT_PI * exp(-square) * sum;
    }
    let mut fraction = x;
    for k in (1..=80).rev() {
        fraction = x + 0.5 * f64::from(k) / fraction;
    }
    exp(-square) * 0.5 * core::f64::consts::FRAC_2_SQRT_PI / fraction
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_those_of_the_tables() {
        // Abramowitz and Stegun, table 26.8.
        for (dimension, probability, known) in [
            (1, 0.05, 3.84146),
            (1, 0.001, 10.8276),
            (2, 0.01, 9.21034),
            (3, 0.05, 7.81473),
            (3, 0.001, 16.2662),
            (4, 0.5, 3.35669),
            (5, 0.005, 16.7496),
            (6, 0.01, 16.8119),
            (6, 0.95, 1.63539),
        ] {
            let limit = limit(dimension, probability);
            assert!((limit / known - 1.0).abs() < 1e-5, "{dimension}, {probability}: {limit}");
            assert!((exceedance(dimension, limit) / probability - 1.0).abs() < 1e-9);
        }
        assert_eq!(limit(3, 0.0), f64::INFINITY);
        assert_eq!(exceedance(3, f64::NAN), 1.0);
    }

    #[test]
    fn both_sides_of_the_seam_agree() {
        let [below, above] = [2.5 - 1e-9, 2.5 + 1e-9].map(complementary_error);
        assert!((below / above - 1.0).abs() < 1e-7, "{below} {above}");
    }
}
