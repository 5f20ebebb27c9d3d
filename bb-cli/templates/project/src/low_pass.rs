//! The estimator: a first-order low pass.

use crate::thermometer::Temperature;
use bb_core::prelude::*;

/// Smooths temperatures.
#[derive(Debug)]
pub struct LowPass {
    time_constant_s: f64,
    last: Option<(MonotonicTime, f64)>,
}

#[derive(Clone, Debug, Options)]
pub struct LowPassOptions {
    /// The time after which the output has followed two thirds of a step. Unit: s.
    #[option(default = 1.0, range = 0.001..=1000.0, unit = "s")]
    pub time_constant: f64,
}

impl Estimator for LowPass {
    type Options = LowPassOptions;
    type Input = Temperature;
    type Output = Temperature;

    fn init(options: LowPassOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self { time_constant_s: options.time_constant, last: None })
    }

    fn handle_input(&mut self, input: &Stamped<Temperature>) -> Result<Reply<Temperature>, Fault> {
        let smooth = match self.last {
            None => input.temperature_k,
            Some((time, last)) => {
                let gain = 1.0 - (-input.monotonic_time.seconds_since(time) / self.time_constant_s).exp();
                last + gain * (input.temperature_k - last)
            }
        };
        self.last = Some((input.monotonic_time, smooth));
        Ok(Reply::emit(Temperature { temperature_k: smooth }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_thirds_of_a_step_are_followed_after_a_time_constant() -> Result<(), Fault> {
        let mut filter = LowPass::init(LowPassOptions::defaults(), &Context::for_test(&[]))?;
        let mut smooth = f64::NAN;
        for (time_s, temperature_k) in [(0, 300.0), (1, 400.0)] {
            let time = MonotonicTime::from_nanos(time_s * 1_000_000_000);
            let reply = filter.handle_input(&Stamped::new(time, Temperature { temperature_k }))?;
            smooth = reply.output().map_or(f64::NAN, |smooth| smooth.temperature_k);
        }
        assert!((smooth - 363.2).abs() < 0.1, "{smooth}");
        Ok(())
    }
}
