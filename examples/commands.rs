//! Commands: what a robot does, in which states it may, and what it does then. `cargo run --example commands`
//!
//! A command is an `async` function on the robot's clock. Another one can cancel it; code that must run then is in a `Drop`. The states
//! *disarmed*, *idle* and *executing* are there in every robot.

use bb_core::prelude::*;

#[derive(Clone, Debug, Options)]
struct DriveOptions {
    /// Unit: m/s.
    #[option(default = 1.0, range = 0.0..=3.0, unit = "m/s")]
    speed: f64,
}

#[derive(Clone, Debug, Default, Payload)]
struct Distance {
    /// m
    metres: f64,
}

/// Drives straight on, and returns how long that took.
struct Drive;

impl Command for Drive {
    type Options = DriveOptions;
    type Arguments = Distance;
    type Output = Duration;

    async fn run(
        options: DriveOptions,
        distance: Distance,
        context: CommandContext,
    ) -> Result<Outcome<Duration>, Fault> {
        let duration = Duration::from_secs_f64(distance.metres / options.speed);
        context.sleep(duration).await;
        Ok(Outcome::done(duration).next_state("parked"))
    }
}

robot! {
    robot Cart;
    states { parked; }
    commands {
        category motion { concurrency: 1; } // one of its commands at a time
        arm: Arm; // leads from `disarmed` to `idle`
        go: Drive(speed = 0.5 m/s) { allowed_states: [idle, parked]; category: motion; timeout: 10 s; }
        hurry: Drive(speed = 2 m/s) { allowed_states: [idle, executing]; cancel: [motion]; }
    }
    link base;
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let builder = Cart::builder();
    let states = builder.subscribe(system::StateMachine);
    let mut simulation = builder.simulate()?;

    let refusal = simulation.command(cart::command::go, Distance { metres: 1.0 }).err();
    println!("{}", refusal.ok_or("it must be refused while disarmed")?);

    simulation.command(cart::command::arm, NoArguments)?;
    simulation.run_for(Duration::ZERO); // what is due now: it is armed
    let slow = simulation.command(cart::command::go, Distance { metres: 2.0 })?;
    simulation.run_for(Duration::from_secs(1));
    let fast = simulation.command(cart::command::hurry, Distance { metres: 2.0 })?;
    simulation.run_for(Duration::from_secs(5));
    println!("go: {:?}", slow.try_result());
    println!("hurry: {:?}", fast.try_result());
    for change in states.drain() {
        let time_s = change.monotonic_time.seconds_since(MonotonicTime::ZERO);
        println!("{time_s:.0} s: {} -> {}", change.from, change.to);
    }
    Ok(())
}
