//! A run that is recorded as a journal and replayed from it, bit for bit. `cargo run --example replay`
//!
//! A journal has what came in from outside and the order in which it was processed, so that a run on many threads can be repeated
//! without its hardware. Here it is kept in memory; `bb-mcap` writes it to a file, which ROS 2 tools read too.

use bb_core::prelude::*;
use bb_estimators::{Madgwick, SimulatedImu};
use std::sync::{Arc, Mutex, PoisonError};

robot! {
    robot Walker;
    link base {
        sensor imu: SimulatedImu() {
            rate: 200 Hz;
            estimator orientation: Madgwick<Marg>() { lost_after: 50 ms; }
        }
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let lines = Arc::new(Mutex::new(Vec::new()));
    let sink = Arc::clone(&lines);
    let mut builder = Walker::builder();
    builder.journal(move |line| sink.lock().unwrap_or_else(PoisonError::into_inner).push(line));
    let all = Overflow::DropOldest { capacity: 100_000 };
    let first = builder.subscribe_with(walker::sensor::base::imu::orientation, all);
    let progress = builder.subscribe(walker::sensor::base::imu::orientation);

    let running = builder.start()?; // in real time, on threads
    for _ in 0..100 {
        progress.recv_timeout(Duration::from_secs(10)).ok_or("no orientation for ten seconds")?;
    }
    running.stop().ok()?;
    let journal = std::mem::take(&mut *lines.lock().unwrap_or_else(PoisonError::into_inner));

    let builder = Walker::builder();
    let again = builder.subscribe_with(walker::sensor::base::imu::orientation, all);
    let mut replay = builder.replay()?;
    replay.play(journal)?; // stops at the first message that differs
    replay.stop().ok()?;

    let (first, again): (Vec<_>, Vec<_>) = (first.drain().collect(), again.drain().collect());
    println!("the same orientations, bit for bit: {}", first.len() >= 100 && first == again);
    Ok(())
}
