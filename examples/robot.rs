//! The first robot: one IMU, and an estimator of its attitude. `cargo run --example robot`
//!
//! `robot!` declares it, the builder starts it, and handles such as `rover::sensor::base::imu` name what it publishes. The IMU is
//! simulated; `Mekf<Marg>` is the filter of `hello` with a magnetometer, `Mekf<Imu>` the one without.

use bb_core::prelude::*;
use bb_estimators::simulation::Motion;
use bb_estimators::{Mekf, SimulatedImu};

robot! {
    robot Rover;

    link base {
        sensor imu: SimulatedImu() {
            rate: 200 Hz;
            estimator attitude: Mekf<Marg>();
        }
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let builder = Rover::builder();
    let samples = builder.subscribe(rover::sensor::base::imu);
    let attitude = builder.subscribe(rover::sensor::base::imu::attitude);

    // On virtual time, which is as fast as it can be and the same in every run; `start()` runs in real time.
    let mut simulation = builder.simulate()?;
    for second in [1, 5, 10] {
        simulation.run_until(MonotonicTime::from_nanos(second * 1_000_000_000));
        let last = attitude.drain().last().ok_or("no attitude")?;
        let truth = Motion.world_from_root(last.monotonic_time.seconds_since(MonotonicTime::ZERO)).rotation;
        let off = truth.angle_to(&last.world_from_body).to_degrees();
        println!("{second} s: {} samples, the attitude {off:.0}° off", samples.drain().count());
    }
    simulation.stop().ok()?; // the first fault, if there was one
    Ok(())
}
