//! An estimator of your own, tested by itself and run in a robot. `cargo run --example estimator`
//!
//! A water clock: it estimates the flow into a tank from the heights that a gauge measures.

use bb_core::prelude::*;

#[derive(Clone, Copy, Debug, Payload)]
struct Level {
    /// Height of the water, m.
    height: f64,
}

#[derive(Clone, Copy, Debug, Payload)]
struct Flow {
    /// m/s
    speed: f64,
}

#[derive(Clone, Copy, Debug, Options)]
struct FlowMeterOptions {
    /// Smooths over this time. Unit: s.
    #[option(default = 1.0, range = 0.01..=100.0, unit = "s")]
    time_constant: f64,
}

struct FlowMeter {
    time_constant_s: f64,
    last: Option<(MonotonicTime, f64)>,
    speed: f64,
}

impl Estimator for FlowMeter {
    type Options = FlowMeterOptions;
    type Input = Level;
    type Output = Flow;

    fn init(options: FlowMeterOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self { time_constant_s: options.time_constant, last: None, speed: 0.0 })
    }

    fn handle_input(&mut self, level: &Stamped<Level>) -> Result<Reply<Flow>, Fault> {
        let last = self.last.replace((level.monotonic_time, level.height));
        let Some((time, height)) = last else { return Ok(Reply::none()) }; // a speed takes two heights
        let elapsed_s = level.monotonic_time.seconds_since(time); // positive: messages of an input are in order
        let gain = 1.0 - (-elapsed_s / self.time_constant_s).exp();
        self.speed += gain * ((level.height - height) / elapsed_s - self.speed);
        Ok(Reply::emit(Flow { speed: self.speed }))
    }
}

robot! {
    robot Tank;
    link basin { sensor gauge: External<Level>() { estimator flow: FlowMeter(time_constant = 500 ms); } }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let at = |tenths: i64| MonotonicTime::from_nanos(tenths * 100_000_000);

    // A component is a plain value.
    let mut meter = FlowMeter::init(FlowMeterOptions { time_constant: 0.5 }, &Context::for_test(&[]))?;
    assert!(meter.handle_input(&Stamped::new(at(0), Level { height: 1.0 }))?.output().is_none());

    // In a robot: the gauge is fed by other code, such as a network.
    let builder = Tank::builder();
    let flows = builder.subscribe(tank::sensor::basin::gauge::flow);
    let mut simulation = builder.simulate()?;
    for tenths in 0..=20 {
        simulation.run_until(at(tenths));
        simulation.publish(tank::sensor::basin::gauge, at(tenths), Level { height: 1.0 + 0.02 * tenths as f64 });
    }
    for flow in flows.drain().filter(|flow| flow.monotonic_time.as_nanos() % 500_000_000 == 0) {
        println!("{:.1} s: {:.3} m/s", flow.monotonic_time.seconds_since(MonotonicTime::ZERO), flow.speed);
    }
    Ok(())
}
