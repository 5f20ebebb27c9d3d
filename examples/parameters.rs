//! Parameters: values that can be changed while a robot runs. `cargo run --example parameters`
//!
//! An option that is bound to a parameter follows it, here the gain of a filter. Settings come from a file or the command line too:
//! `cargo run --example parameters -- --set "param/filter/beta=0.3 rad/s"`; `--list` shows what can be set.

use bb_core::prelude::*;
use bb_estimators::{Madgwick, SimulatedImu};

robot! {
    robot Rig;

    parameters {
        filter {
            /// Gain: by how much each sample moves the estimate.
            beta: f64 = 0.05 rad/s, range: 0 rad/s..=1 rad/s;
        }
    }

    link base {
        sensor imu: SimulatedImu() {
            rate: 100 Hz;
            estimator tilt: Madgwick<Marg>(beta = param::filter::beta);
        }
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut builder = Rig::builder();
    if builder.take_arguments(std::env::args_os().skip(1))?.is_none() {
        return Ok(()); // it has printed what was asked for
    }
    let changes = builder.subscribe(rig::param::filter::beta);
    let mut simulation = builder.simulate()?;
    simulation.run_for(Duration::from_secs(1));
    println!("beta is {:?}", simulation.parameter(rig::param::filter::beta));

    // By its handle, or by its path, as a dashboard does.
    simulation.set_parameter(rig::param::filter::beta, 0.2)?;
    simulation.run_for(Duration::from_secs(1));
    simulation.bus().set_parameters([("param/filter/beta", 0.1.into())])?;

    // A value beyond the range is not set.
    let error = simulation.set_parameter(rig::param::filter::beta, 2.0).err();
    println!("{}", error.ok_or("it must be refused")?);
    for change in changes.drain() {
        println!("{} -> {}", change.from, change.to);
    }
    simulation.stop().ok()?;
    Ok(())
}
