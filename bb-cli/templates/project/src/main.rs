//! A robot with a sensor and an estimator of its own.

mod low_pass;
mod thermometer;

use bb_core::prelude::*;
use bb_mcap::{Recorder, RecorderOptions};
use low_pass::LowPass;
use std::error::Error;
use std::io::IsTerminal;
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

/// Frequent and rare messages are recorded from separate queues, so that a slow disk loses samples but no events.
const SAMPLES: Select<'static> = Select::Below("sensor");
const EVENTS: Select<'static> = Select::AnyOf(&[
    Select::Path("fault"),
    Select::Path("health"),
    Select::Path("state_machine"),
    Select::Below("safety"),
]);

/// Runs until Ctrl-C, or for a number of seconds: `cargo run -- 3`.
fn main() -> Result<(), Box<dyn Error>> {
    // Logs: faults, restarts, changes of health and safety. Without colours if stderr is a file.
    let stderr = std::io::stderr;
    tracing_subscriber::fmt().with_writer(stderr).with_ansi(stderr().is_terminal()).init();

    let mut builder = Oven::builder();
    // `--list`, `--config FILE`, `--set PATH=VALUE`: options without recompiling. Other arguments are returned.
    let Some(others) = builder.take_arguments(std::env::args_os().skip(1))? else { return Ok(()) };
    let seconds: Option<u64> = others.first().map(|seconds| seconds.to_string_lossy().parse()).transpose()?;
    let smooth = builder.subscribe(oven::sensor::body::thermometer::smooth);
    let samples = builder.subscribe_any(SAMPLES, None, Overflow::DropOldest { capacity: 10_000 });
    let events = builder.subscribe_any(EVENTS, None, Overflow::DropOldest { capacity: 1_000 });
    std::fs::create_dir_all("recordings")?;
    // Named by time and process, since an existing recording is not overwritten.
    let seconds_since_1970 = SystemTime::UNIX_EPOCH.elapsed()?.as_secs();
    let file = format!("recordings/run-{seconds_since_1970}-{}.mcap", std::process::id());
    let recorder = Recorder::new(&file, samples, RecorderOptions::of::<Oven>())?.also(events)?.spawn()?;

    let mut running = builder.start()?; // in real time, with a thread per sensor
    running.stop_on_signals()?;
    if let Some(seconds) = seconds {
        let live = running.live();
        std::thread::spawn(move || {
            std::thread::sleep(Duration::from_secs(seconds));
            live.request_stop();
        });
    }
    // Prints once a second; the messages end when the robot has stopped.
    let printer = std::thread::spawn(move || {
        for temperature in std::iter::from_fn(|| smooth.recv()).step_by(20) {
            println!("{}: {:.2} K", temperature.monotonic_time, temperature.temperature_k);
        }
    });
    running.wait();
    println!("{}", running.stop()); // what was published where
    let _ = printer.join();
    let report = recorder.stop()?;
    println!("{file}: {} messages; look at it with `bb info {file}`", report.messages);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Simulation on virtual time: ten seconds take milliseconds, and every run gives the same result.
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
