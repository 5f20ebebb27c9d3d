//! Position of a rover from an IMU, wheels and satellites. `cargo run --example navigation`
//!
//! Drivers of the real sensors would be declared where the simulated ones are. After ten seconds the receiver loses the satellites, and
//! the wheels spin for two seconds: `Eskf` refuses them, since the accelerometer shows no such motion.

use bb_core::nalgebra::Isometry3;
use bb_core::prelude::*;
use bb_estimators::simulation::{GnssFault, SimulatedWorld};
use bb_estimators::{Eskf, SimulatedGnss, SimulatedLinkImu, SimulatedWheels};

robot! {
    robot Mower;

    link base {
        sensor imu: SimulatedLinkImu() { rate: 100 Hz; }
        sensor wheels: SimulatedWheels() { rate: 20 Hz; }
        joint mast: fixed {
            origin: { xyz: [0 m, 0 m, 40 cm] };
            link antenna { sensor gnss: SimulatedGnss() { rate: 5 Hz; } }
        }
        estimator position: Eskf(heading_deviation = 2 deg) {
            input imu: sensor::base::imu, driver;
            input odometry: sensor::base::wheels, optional;
            input gnss: sensor::base::mast::antenna::gnss, optional;
        }
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let builder = Mower::builder();
    let positions = builder.subscribe(mower::estimator::base::position);
    let mut simulation = builder.simulate()?;
    let world = simulation.shared(|| SimulatedWorld::new(Mower::TOPOLOGY));
    // At rest for two seconds, then ever faster to the east, up to 1.2 m/s.
    world.move_root(MonotonicTime::ZERO, |time_s| {
        let moving = (time_s - 2.0).max(0.0);
        let east = if moving < 2.0 { 0.1 * moving.powi(3) } else { 0.8 + 1.2 * (moving - 2.0) };
        Isometry3::translation(east, 0.0, 0.0)
    });
    for second in 1..=20 {
        simulation.run_until(MonotonicTime::from_nanos(second * 1_000_000_000));
        match second {
            10 => world.set_gnss_fault("sensor/base/mast/antenna/gnss", GnssFault::Outage),
            12 => world.set_slip("sensor/base/wheels", 3.0), // m/s more than it drives
            14 => world.set_slip("sensor/base/wheels", 0.0),
            _ => {}
        }
        let Some(last) = positions.drain().last().filter(|_| second % 4 == 0) else { continue };
        let truth = world.pose("base", last.monotonic_time)?.translation.vector;
        let off = (last.pose.position.xy() - truth.xy()).norm();
        println!("{second} s: {:.1} m to the east, within 1 m: {}", last.pose.position.x, off < 1.0);
    }
    simulation.stop().ok()?;
    Ok(())
}
