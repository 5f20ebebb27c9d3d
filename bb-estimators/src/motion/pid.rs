//! A PID controller.

/// The gains of a [`Pid`], and its limits. The output is in the unit of the driven quantity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PidParams {
    /// Output for each unit of the error.
    pub proportional: f64,
    /// Output for each unit of the error and second.
    pub integral: f64,
    /// Output for each unit of the rate at which the measurement changes, per second.
    pub derivative: f64,
    /// Time constant of the low-pass filter of the derivative, s. 0: none.
    pub derivative_filter_s: f64,
    /// Smallest output.
    pub minimum: f64,
    /// Largest output.
    pub maximum: f64,
    /// Time constant with which the integral is reduced while the output is at a limit, s: a small time follows the
    /// limit closely. 0: at once.
    pub tracking_s: f64,
}

/// A PID controller with back-calculation against windup and a filtered derivative.
///
/// u = P e + I ∫ e dt − D dy/dt, where e = setpoint − y; Åström and Hägglund, *Advanced PID Control*, 2006, sections
/// 3.5 and 13. The derivative is that of the measurement, so a setpoint jump causes no kick, through a first-order
/// low-pass. While the output is at a limit, the integral is drawn to the value at which the output is just there.
/// Steps may have any length.
///
/// ```
/// use bb_estimators::motion::{Pid, PidParams};
///
/// let mut pid = Pid::new(PidParams {
///     proportional: 2.0,
///     integral: 0.5,
///     derivative: 0.0,
///     derivative_filter_s: 0.0,
///     minimum: -1.0,
///     maximum: 1.0,
///     tracking_s: 1.0,
/// });
/// let (mut position, step_s) = (0.0, 0.01);
/// for _ in 0..2000 {
///     position += pid.update(1.0, position, step_s).output * step_s; // a joint that moves at the velocity of the output
/// }
/// assert!((position - 1.0_f64).abs() < 0.02);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pid {
    params: PidParams,
    integral: f64,
    /// The rate of the measurement, filtered.
    rate: f64,
    measurement: Option<f64>,
}

/// The result of a step of a [`Pid`]: `output` is the sum of the three terms within the limits.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PidTerms {
    /// setpoint − measurement.
    pub error: f64,
    /// The proportional term.
    pub proportional: f64,
    /// The integral term.
    pub integral: f64,
    /// The derivative term.
    pub derivative: f64,
    /// The value to apply.
    pub output: f64,
}

impl Pid {
    /// A controller with a zero integral.
    pub fn new(params: PidParams) -> Self {
        Self { params, integral: 0.0, rate: 0.0, measurement: None }
    }

    /// Changes the gains; the integral is kept, so that the output does not jump with the integral gain.
    pub fn set_params(&mut self, params: PidParams) {
        self.params = params;
    }

    /// Resets the integral and the last measurement.
    pub fn reset(&mut self) {
        *self = Self::new(self.params);
    }

    /// The output for a measurement, `step_s` after the last one. A step that is not positive, and values that are
    /// not finite, do not change the state: the output is then that of the proportional and the kept terms.
    ///
    /// A controller that runs faster or slower than its sensor calls [`measured`](Self::measured) with each measurement and
    /// [`step`](Self::step) at its own rate instead.
    pub fn update(&mut self, setpoint: f64, measurement: f64, step_s: f64) -> PidTerms {
        if setpoint.is_finite() {
            self.measured(measurement, step_s);
        }
        self.step(setpoint, measurement, step_s)
    }

    /// Takes a measurement for the derivative, `interval_s` after the last one. An interval that is not positive, and values
    /// that are not finite, do not change the state.
    pub fn measured(&mut self, measurement: f64, interval_s: f64) {
        let is_interval = interval_s > 0.0 && (measurement + interval_s).is_finite();
        if is_interval && let Some(last) = self.measurement.replace(measurement) {
            let filter_s = self.params.derivative_filter_s;
            // The low pass in its exact form for a rate that is constant during the interval.
            let share = if filter_s > 0.0 { 1.0 - (-interval_s / filter_s).exp() } else { 1.0 };
            self.rate += share * ((measurement - last) / interval_s - self.rate);
        }
    }

    /// The output `step_s` after the last step; `measurement` is the latest one. The same holds as for
    /// [`update`](Self::update).
    pub fn step(&mut self, setpoint: f64, measurement: f64, step_s: f64) -> PidTerms {
        let params = &self.params;
        let is_step = step_s > 0.0 && (setpoint + measurement + step_s).is_finite();
        let error = setpoint - measurement;
        let proportional = params.proportional * error;
        let derivative = -params.derivative * self.rate;
        if is_step {
            self.integral += params.integral * error * step_s;
            let unlimited = proportional + self.integral + derivative;
            let beyond = unlimited - params.limit(unlimited);
            self.integral -= params.windup(beyond, self.integral, step_s);
        }
        let output = params.limit(proportional + self.integral + derivative);
        let output = if output.is_finite() { output } else { params.limit(0.0) };
        PidTerms { error, proportional, integral: self.integral, derivative, output }
    }

    /// Feeds back that `applied` was carried out instead of the output of the last [`step`](Self::step), of `step_s`: the
    /// integral is reduced as at a limit of the controller's own. Returns the terms with the reduced integral and the applied
    /// output.
    pub fn limited(&mut self, terms: PidTerms, applied: f64, step_s: f64) -> PidTerms {
        let beyond = terms.output - applied;
        if step_s > 0.0 && beyond.is_finite() {
            self.integral -= self.params.windup(beyond, self.integral, step_s);
        }
        PidTerms { integral: self.integral, output: applied, ..terms }
    }
}

impl PidParams {
    fn limit(&self, output: f64) -> f64 {
        output.max(self.minimum).min(self.maximum)
    }

    /// Returns the amount by which a step reduces the integral for the excess over the limit. At most the integral's value is attributed to
    /// it, so that a proportional term that saturates alone does not wind it up in the other direction.
    fn windup(&self, beyond: f64, integral: f64, step_s: f64) -> f64 {
        let share = if self.tracking_s > 0.0 { (step_s / self.tracking_s).min(1.0) } else { 1.0 };
        let excess =
            if beyond * integral > 0.0 { beyond.abs().min(integral.abs()).copysign(integral) } else { 0.0 };
        share * excess
    }
}

#[cfg(test)]
mod tests;
