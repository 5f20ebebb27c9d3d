//! Two sensors and one estimator of both: fan-in. `cargo run --example fan_in`
//!
//! The mast is mounted at an angle to the base. The estimator runs when its driver's message arrives, and takes the newest message of
//! the other input, turned by the mounting; one that is older than the tolerance is a *sync miss*.

use bb_core::prelude::*;
use bb_estimators::simulation::Motion;
use bb_estimators::{Mekf, OrientationAverage, SimulatedImu};

robot! {
    robot Rover;

    link base {
        sensor imu: SimulatedImu() { rate: 200 Hz; estimator orientation: Mekf<Marg>(); }
        estimator attitude: OrientationAverage() {
            input first: sensor::base::imu::orientation, driver;
            input second: sensor::base::mount::mast::imu::orientation;
            sync_tolerance: 10 ms;
        }
        joint mount: fixed {
            origin: { xyz: [0.2 m, 0 m, 0.9 m], rpy: [10 deg, 0 deg, 90 deg] };
            link mast {
                sensor imu: SimulatedImu(duration = 5 s) { rate: 200 Hz; estimator orientation: Mekf<Marg>(); }
            }
        }
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let builder = Rover::builder();
    let attitude = builder.subscribe(rover::estimator::base::attitude);
    let health = builder.subscribe(system::Health);
    let mut simulation = builder.simulate()?;
    simulation.run_for(Duration::from_secs(6));

    let last = attitude.drain().last().ok_or("no attitude")?;
    let time_s = last.monotonic_time.seconds_since(MonotonicTime::ZERO);
    let truth = Motion.world_from_root(time_s).rotation;
    let off = truth.angle_to(&last.world_from_body).to_degrees();
    println!("{time_s:.1} s: attitude of {}, {off:.0}° off", last.frame.name());

    // The second IMU measures for five seconds.
    for change in health.drain() {
        let time_s = change.time.seconds_since(MonotonicTime::ZERO);
        println!("{time_s:.1} s: {} is {}, {}", change.estimator, change.to, change.reason);
    }
    Ok(())
}
