//! A bridge to another system: a `Service` with a line of the robot. `cargo run --example bridge`
//!
//! Bridges and controllers run beside the estimators and reach everything by path. This one writes what a flight controller would get;
//! `bb-mavlink` has one that sends it, and `bb-dashboard` one that serves a page.

use bb_core::prelude::*;
use bb_estimators::{Mekf, SimulatedImu};

#[derive(Clone, Debug, Options)]
struct TelegramOptions {
    /// Path of the orientation to send.
    #[option(required)]
    from: String,
}

/// State of the bridge, which it publishes: the number of telegrams so far.
#[derive(Clone, Copy, Debug, Payload)]
struct Sent {
    telegrams: u64,
}

struct Telegram {
    attitude: Subscription<Orientation>,
    sent: u64,
}

impl Service for Telegram {
    type Options = TelegramOptions;
    type Output = Sent;

    fn init(options: TelegramOptions, context: &ServiceContext) -> Result<Self, Fault> {
        // A path without a publisher, or another payload, keeps the robot from starting.
        let attitude = context.bus().subscribe(&options.from, Overflow::KeepLatest)?.matched()?;
        Ok(Self { attitude, sent: 0 })
    }

    fn update(&mut self, now: MonotonicTime) -> Result<Reading<Sent>, Fault> {
        let Some(attitude) = self.attitude.try_recv() else { return Ok(Reading::nothing()) };
        let (roll, pitch, yaw) = attitude.world_from_body.euler_angles();
        let [roll, pitch, yaw] = [roll, pitch, yaw].map(|angle| angle.to_degrees().round() + 0.0);
        println!("{:.1} s ATTITUDE {roll} {pitch} {yaw}", now.seconds_since(MonotonicTime::ZERO));
        self.sent += 1;
        Ok(Reading::now(Sent { telegrams: self.sent }))
    }
}

robot! {
    robot Drone;
    bridges { bridge telegram: Telegram(from = "sensor/body/imu/attitude") { rate: 2 Hz; } }
    link body {
        sensor imu: SimulatedImu() { rate: 200 Hz; estimator attitude: Mekf<Marg>(); }
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let builder = Drone::builder();
    let sent = builder.subscribe(drone::bridge::telegram);
    let mut simulation = builder.simulate()?;
    simulation.run_for(Duration::from_secs(3));
    println!("{} telegrams", sent.drain().last().ok_or("none was sent")?.telegrams);
    simulation.stop().ok()?;
    Ok(())
}
