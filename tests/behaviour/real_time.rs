//! Real time: a thread per sensor. Nothing here asserts how late a thread was.

use crate::components::{Counter, Number, Scale};
use bb_core::prelude::*;
use std::time::Instant;

/// A driver that waits for its device.
#[derive(Debug)]
pub(crate) struct Waiting {
    context: SensorContext,
}

impl Sensor for Waiting {
    type Options = NoOptions;
    type Output = Number;

    fn init(_: NoOptions, context: &SensorContext) -> Result<Self, Fault> {
        Ok(Self { context: context.clone() })
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Number>, Fault> {
        while !self.context.is_stopping() {
            std::thread::sleep(Duration::from_millis(1));
        }
        Ok(Reading::nothing())
    }
}

robot! {
    robot Live;
    link base {
        sensor numbers: Counter(count = 20) { rate: 200 Hz; estimator scaled: Scale(); }
        sensor waiting: Waiting();
        sensor rare: Counter(count = 2) { rate: 0.001 Hz; }
    }
}

#[test]
fn sensors_run_on_threads_of_their_own_and_stop_when_told() -> Result<(), StartError> {
    let builder = Live::builder();
    let scaled = builder.subscribe(live::sensor::base::numbers::scaled);
    let running = builder.start()?;
    let numbers: Vec<_> = (0..20).filter_map(|_| scaled.recv_timeout(Duration::from_secs(10))).collect();
    assert_eq!(numbers.len(), 20);
    assert!(numbers.is_sorted_by_key(|number| number.monotonic_time));
    assert!(numbers.iter().all(|number| number.wall_time.as_unix_nanos() > 1_600_000_000_000_000_000));
    // One sensor waits for its device, another sleeps for a quarter of an hour: neither keeps the robot from stopping.
    let stopped = Instant::now();
    let report = running.stop();
    assert!(stopped.elapsed() < Duration::from_secs(4));
    assert_eq!(report.topic("sensor/base/rare").map(|topic| topic.published), Some(1));
    assert!(report.ok().is_ok());
    Ok(())
}
