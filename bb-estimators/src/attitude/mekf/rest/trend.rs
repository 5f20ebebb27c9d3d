//! The linear trend of a vector, by least squares with fading.

use nalgebra::Vector3;

use crate::attitude::Real;

/// Time constant with which values fade, s.
const FADING_S: f64 = 5.0;

/// The assumed error counts as that of so many values.
const PRIOR: f64 = 4.0;

/// Sums over the values and their ages.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Trend<T> {
    /// The first value: the others are relative to it, against rounding.
    origin: Vector3<T>,
    weight: T,
    age: T,
    squared_age: T,
    value: Vector3<T>,
    value_age: Vector3<T>,
    squared_value: T,
}

/// The line through the values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Line<T> {
    /// Change per second.
    pub(super) slope: Vector3<T>,
    /// Of a component of it.
    pub(super) variance: T,
    /// How far a component of a value is off the line, mean square.
    pub(super) squared_error: T,
    /// How far the line is off its mean, mean square of a component.
    pub(super) squared_rise: T,
}

impl<T: Real> Trend<T> {
    pub(super) fn new() -> Self {
        Self {
            origin: Vector3::zeros(),
            weight: T::ZERO,
            age: T::ZERO,
            squared_age: T::ZERO,
            value: Vector3::zeros(),
            value_age: Vector3::zeros(),
            squared_value: T::ZERO,
        }
    }

    /// Lets `dt` seconds pass, and adds the present value if there is one.
    pub(super) fn add(&mut self, dt: T, value: Option<&Vector3<T>>) {
        let keep = T::ONE - (dt / T::of(FADING_S)).min(T::ONE);
        self.squared_age = (self.squared_age + dt * (T::TWO * self.age + dt * self.weight)) * keep;
        self.age = (self.age + dt * self.weight) * keep;
        self.value_age = (self.value_age + self.value * dt) * keep;
        self.value *= keep;
        self.squared_value *= keep;
        self.weight *= keep;
        let Some(value) = value else { return };
        if self.weight <= T::ZERO {
            self.origin = *value;
        }
        let value = value - self.origin;
        self.weight += T::ONE;
        self.value += value;
        self.squared_value += value.norm_squared();
    }

    /// The line, with `error` as the assumed error of a value until there are many.
    pub(super) fn line(&self, error: T) -> Line<T> {
        let weight = self.weight.max(T::ONE);
        let (age, value) = (self.age / weight, self.value / weight);
        let spread = (self.squared_age / weight - age * age).max(T::of(1e-6));
        let slope = (value * age - self.value_age / weight) / spread;
        let squared_rise = spread * slope.norm_squared() / T::of(3.0);
        let explained = weight * (value.norm_squared() + T::of(3.0) * squared_rise);
        let left = (self.squared_value - explained).max(T::ZERO);
        let squared_error = (T::of(3.0 * PRIOR) * error * error + left) / (T::of(3.0) * (weight + T::of(PRIOR)));
        Line { slope, variance: squared_error / (weight * spread), squared_error, squared_rise }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trend<T: Real>(noise: f64) -> Line<T> {
        let mut trend = Trend::<T>::new();
        for i in 0..100 {
            let t = 0.08 * f64::from(i);
            let off = (1.7 * f64::from(i * i)).sin() * noise;
            let value = Vector3::new(20.0 + 0.3 * t + off, -45.0 - 0.1 * t - off, off).map(T::of);
            // Every other window has a value.
            trend.add(T::of(0.08), (i % 2 == 1).then_some(&value));
        }
        trend.line(T::of(0.01))
    }

    #[test]
    fn the_slope_of_a_line_is_found() {
        let line = trend::<f64>(0.0);
        assert!((line.slope - Vector3::new(0.3, -0.1, 0.0)).norm() < 1e-9, "{line:?}");
        assert!(line.squared_error < 1e-4, "{line:?}");
        let single = trend::<f32>(0.0);
        assert!((single.slope.map(f64::from) - line.slope).norm() < 1e-4, "{single:?}");
    }

    #[test]
    fn the_slope_of_a_noisy_line_is_as_uncertain_as_it_is_wrong() {
        let line = trend::<f64>(0.5);
        let error = (line.slope - Vector3::new(0.3, -0.1, 0.0)).norm();
        assert!(error < 3.0 * (3.0 * line.variance).sqrt(), "{error}, {line:?}");
        // A sine has a mean square of half its squared amplitude.
        assert!((line.squared_error - 0.125).abs() < 0.05, "{line:?}");
    }

    #[test]
    fn one_value_or_none_has_no_slope() {
        let mut trend = Trend::<f64>::new();
        assert_eq!(trend.line(0.1).slope, Vector3::zeros());
        trend.add(0.08, Some(&Vector3::new(1.0, 2.0, 3.0)));
        let line = trend.line(0.1);
        assert_eq!(line.slope, Vector3::zeros());
        assert!(line.variance > 1.0, "{line:?}");
    }
}
