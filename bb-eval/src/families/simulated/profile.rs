//! Quantities that change in smooth steps, with their derivatives and integrals in closed form.

/// A quantity that is zero at first and changes in steps, one after another, with continuous derivatives up to the second.
#[derive(Clone, Debug, Default)]
pub(super) struct Profile {
    steps: Vec<Step>,
}

#[derive(Clone, Copy, Debug)]
struct Step {
    begins_s: f64,
    length_s: f64,
    height: f64,
    /// The value and the integral at its beginning.
    value: f64,
    integral: f64,
}

impl Profile {
    /// Adds a step, which must not begin before the last one ends.
    pub(super) fn step(&mut self, begins_s: f64, length_s: f64, height: f64) {
        let ends_s = self.steps.last().map_or(0.0, |last| last.begins_s + last.length_s);
        debug_assert!(begins_s >= ends_s, "{begins_s} is before {ends_s}");
        let (value, integral) = (self.value(begins_s), self.integral(begins_s));
        self.steps.push(Step { begins_s, length_s, height, value, integral });
    }

    /// The value at a time.
    pub(super) fn value(&self, time_s: f64) -> f64 {
        let Some((step, part)) = self.at(time_s) else { return 0.0 };
        step.value + step.height * part.powi(3) * (10.0 + part * (6.0 * part - 15.0))
    }

    /// The derivative.
    pub(super) fn slope(&self, time_s: f64) -> f64 {
        let Some((step, part)) = self.at(time_s) else { return 0.0 };
        step.height * 30.0 * (part * (1.0 - part)).powi(2) / step.length_s
    }

    /// The integral from zero.
    pub(super) fn integral(&self, time_s: f64) -> f64 {
        let Some((step, part)) = self.at(time_s) else { return 0.0 };
        let since_s = time_s - step.begins_s;
        let within =
            step.length_s * part.powi(4) * (2.5 + part * (part - 3.0)) + (since_s - step.length_s).max(0.0);
        step.integral + step.value * since_s + step.height * within
    }

    /// The last step that has begun, and the part of it that has passed.
    fn at(&self, time_s: f64) -> Option<(&Step, f64)> {
        let begun = self.steps.partition_point(|step| step.begins_s < time_s);
        let step = self.steps.get(begun.checked_sub(1)?)?;
        Some((step, ((time_s - step.begins_s) / step.length_s).min(1.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slope_and_integral_are_those_of_the_value() {
        let mut profile = Profile::default();
        profile.step(1.0, 2.0, 3.0);
        profile.step(3.5, 0.5, -1.0);
        let mut integral = 0.0;
        let step_s = 1e-4;
        for index in 0..60_000 {
            let time_s = (f64::from(index) + 0.5) * step_s;
            integral += profile.value(time_s) * step_s;
            let slope = (profile.value(time_s + step_s) - profile.value(time_s - step_s)) / (2.0 * step_s);
            assert!((slope - profile.slope(time_s)).abs() < 1e-5, "{time_s}");
        }
        assert!((profile.integral(6.0) - integral).abs() < 1e-6);
        assert!((profile.value(6.0) - 2.0).abs() < 1e-12);
    }
}
