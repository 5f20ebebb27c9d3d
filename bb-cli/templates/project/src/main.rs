//! A robot with a sensor and an estimator of its own.

mod low_pass;
mod thermometer;

use bb_core::prelude::*;
use bb_mcap::{Recorder, RecorderOptions};
use low_pass::LowPass;
use std::error::Error;
use std::time::SystemTime;
use thermometer::Thermometer;

robot! {
    /// An oven whose temperature is measured and smoothed.
    robot Oven;

    link body {
        sensor thermometer: Thermometer(noise = 0.5 K) {
            rate: 20 Hz;
            estimator smooth: LowPass(time_constant = 500 ms);
        }
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    // What the robot tells of itself: restarts, what was left out, faults.
    tracing_subscriber::fmt().with_writer(std::io::stderr).init();

    let builder = Oven::builder();
    let smooth = builder.subscribe(oven::sensor::body::thermometer::smooth);
    let all = builder.subscribe_any(Select::All, None, Overflow::DropOldest { capacity: 10_000 });
    std::fs::create_dir_all("recordings")?;
    let now_s = SystemTime::UNIX_EPOCH.elapsed()?.as_secs();
    let file = format!("recordings/run-{now_s}.mcap");
    let recorder = Recorder::new(&file, all, RecorderOptions::of::<Oven>())?.spawn()?;

    let running = builder.start()?; // in real time, a thread for each sensor
    for _ in 0..3 {
        std::thread::sleep(Duration::from_secs(1));
        if let Some(temperature) = smooth.drain().last() {
            println!("{}: {:.2} K", temperature.monotonic_time, temperature.temperature_k);
        }
    }
    println!("{}", running.stop()); // what was published where
    let report = recorder.stop()?;
    println!("{file}: {} messages; look at it with `bb info {file}`", report.messages);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// On virtual time: ten seconds take milliseconds, and give the same each time.
    #[test]
    fn the_temperature_is_smoothed() -> Result<(), Box<dyn Error>> {
        let builder = Oven::builder();
        let raw = builder.subscribe(oven::sensor::body::thermometer);
        let smooth = builder.subscribe(oven::sensor::body::thermometer::smooth);
        let mut simulation = builder.simulate()?;
        simulation.run_for(Duration::from_secs(10));
        simulation.stop().ok()?;

        let spread = |temperatures: Vec<f64>| {
            let later = &temperatures[temperatures.len() / 2..]; // the filter has settled
            later.iter().fold(f64::MIN, |a, b| a.max(*b)) - later.iter().fold(f64::MAX, |a, b| a.min(*b))
        };
        let raw = spread(raw.drain().map(|message| message.temperature_k).collect());
        let smooth = spread(smooth.drain().map(|message| message.temperature_k).collect());
        assert!(smooth < 0.5 * raw, "raw {raw} K, smooth {smooth} K");
        Ok(())
    }
}
