//! A sensor that fails, and what the robot does then. `cargo run --example health`
//!
//! The lidar is unplugged for a second. Its driver is closed and opened again until it answers; its estimator is *lost*, which starts
//! a command. The first run afterwards makes it *degraded*, and as many good runs as `recover_after` says, here one, *healthy*.

use bb_core::prelude::*;

#[derive(Clone, Copy, Debug, Payload)]
struct Distance {
    /// m
    metres: f64,
}

struct Lidar;

impl Sensor for Lidar {
    type Options = NoOptions;
    type Output = Distance;

    fn init(_: NoOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self)
    }
    fn read(&mut self, now: MonotonicTime) -> Result<Reading<Distance>, Fault> {
        if (1.0..2.0).contains(&now.seconds_since(MonotonicTime::ZERO)) {
            return Err(Fault::new("the lidar does not answer"));
        }
        Ok(Reading::now(Distance { metres: 3.0 }))
    }
}

struct Nearest;

impl Estimator for Nearest {
    type Options = NoOptions;
    type Input = Distance;
    type Output = Distance;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }
    fn handle_input(&mut self, distance: &Stamped<Distance>) -> Result<Reply<Distance>, Fault> {
        Ok(Reply::emit(distance.payload))
    }
}

robot! {
    robot Scout;
    commands { halt: Disarm; }
    link base {
        sensor lidar: Lidar() {
            rate: 100 Hz;
            estimator nearest: Nearest() { lost_after: 200 ms; on_lost: halt; }
        }
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let builder = Scout::builder();
    let (health, states) = (builder.subscribe(system::Health), builder.subscribe(system::StateMachine));
    let mut simulation = builder.simulate()?;
    simulation.arm()?;
    simulation.run_for(Duration::from_secs(4));
    for change in health.drain() {
        let time_s = change.time.seconds_since(MonotonicTime::ZERO);
        println!("{time_s:.2} s: {} -> {}, by {}", change.from, change.to, change.source);
    }
    for change in states.drain() {
        let time_s = change.monotonic_time.seconds_since(MonotonicTime::ZERO);
        println!("{time_s:.2} s: {} -> {}", change.from, change.to);
    }
    let report = simulation.stop();
    println!("the lidar was opened again {} times", report.sources[0].restarts);
    Ok(())
}
