//! Second-order Butterworth low-passes in state-variable form.
//!
//! `H(s) = 1 / (s²/ω² + √2 s/ω + 1)` with `ω = √2/τ`, by the bilinear transform: section 3.2 of the paper. The form
//! is the one of A. Simper, "Linear trapezoidal integrated state variable filter", 2013: two trapezoidal integrators,
//! whose states are the output and its derivative but for half a sample. At a constant input they are the input and
//! zero, whatever the coefficients.

use crate::attitude::Real;
use core::f64::consts::SQRT_2;

/// The greatest `dt / (√2 τ)`: beyond it the low-pass lets everything through in one sample, and the tangent ends.
const MAX_ANGLE: f64 = 1.5;

/// The coefficients of a low-pass with one time constant, at one sample time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Coefficients<T> {
    time_constant_s: T,
    integrator: T,
    band_from_band: T,
    band_from_input: T,
}

impl<T: Real> Coefficients<T> {
    pub(super) fn new(time_constant_s: T, dt_s: T) -> Self {
        let integrator = (dt_s / (T::of(SQRT_2) * time_constant_s)).min(T::of(MAX_ANGLE)).tan();
        let band_from_band = T::ONE / (T::ONE + integrator * (integrator + T::of(SQRT_2)));
        Self { time_constant_s, integrator, band_from_band, band_from_input: integrator * band_from_band }
    }
}

/// The state of `N` low-passes with common coefficients.
///
/// During the first time constant, the output is the mean of all inputs.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LowPass<T, const N: usize> {
    band: [T; N],
    low: [T; N],
    /// Number of samples in the mean so far; `None` once it is over.
    samples: Option<T>,
    elapsed_s: T,
}

impl<T: Real, const N: usize> LowPass<T, N> {
    /// A low-pass initialised by the mean of its first inputs.
    pub(super) fn new() -> Self {
        Self { band: [T::ZERO; N], low: [T::ZERO; N], samples: Some(T::ZERO), elapsed_s: T::ZERO }
    }

    /// A low-pass settled at this input.
    pub(super) fn settled(value: [T; N]) -> Self {
        Self { band: [T::ZERO; N], low: value, samples: None, elapsed_s: T::ZERO }
    }

    /// Adds an input that came `dt_s` after the last one; returns the output.
    #[inline]
    pub(super) fn filter(&mut self, input: &[T; N], dt_s: T, coefficients: &Coefficients<T>) -> [T; N] {
        if let Some(samples) = self.samples {
            return self.mean(input, samples + T::ONE, dt_s, coefficients.time_constant_s);
        }
        let mut output = [T::ZERO; N];
        for i in 0..N {
            let difference = input[i] - self.low[i];
            let band = coefficients.band_from_band * self.band[i] + coefficients.band_from_input * difference;
            let step = coefficients.integrator * band;
            output[i] = self.low[i] + step;
            self.low[i] = output[i] + step;
            self.band[i] = band + band - self.band[i];
        }
        output
    }

    #[cold]
    fn mean(&mut self, input: &[T; N], samples: T, dt_s: T, time_constant_s: T) -> [T; N] {
        for (mean, input) in self.low.iter_mut().zip(input) {
            *mean += (*input - *mean) / samples;
        }
        self.elapsed_s += dt_s;
        // The first sample has no period; it gets that of the current one.
        self.samples = (self.elapsed_s + dt_s < time_constant_s).then_some(samples);
        self.low
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_step_response_is_the_bilinear_butterworths() {
        // The difference equation in its direct form, from the bilinear transform by hand.
        let (time_constant, dt) = (0.5, 0.01);
        let c = (dt / (SQRT_2 * time_constant)).tan();
        let d = c * c + SQRT_2 * c + 1.0;
        let (b0, a1, a2) = (c * c / d, 2.0 * (c * c - 1.0) / d, (1.0 - SQRT_2 * c + c * c) / d);
        let (mut x1, mut x2, mut y1, mut y2) = (0.0, 0.0, 0.0, 0.0);
        let coefficients = Coefficients::new(time_constant, dt);
        let mut low_pass = LowPass::settled([0.0]);
        for i in 0..1000 {
            let x = if i % 300 < 100 { 1.0 } else { -0.3 };
            let y = b0 * (x + 2.0 * x1 + x2) - a1 * y1 - a2 * y2;
            (x2, x1, y2, y1) = (x1, x, y1, y);
            let [output] = low_pass.filter(&[x], dt, &coefficients);
            assert!((output - y).abs() < 1e-12, "{output} {y} at {i}");
        }
    }

    #[test]
    fn it_starts_with_the_mean_and_keeps_what_is_constant_at_any_rate() {
        let mut low_pass = LowPass::new();
        let at = |dt: f64| Coefficients::new(0.1, dt);
        assert_eq!(low_pass.filter(&[2.0], 0.0, &at(0.05)), [2.0]);
        assert_eq!(low_pass.filter(&[4.0], 0.05, &at(0.05)), [3.0]);
        for i in 1..100 {
            let dt = 0.01 * f64::from(i);
            let [output] = low_pass.filter(&[3.0], dt, &at(dt));
            assert!((output - 3.0).abs() < 1e-12);
        }
    }
}
