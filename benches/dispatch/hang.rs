//! A 1 kHz chain beside an estimator on a worker that hangs for 100 ms at every tenth message.

use super::Line;
use super::chain::{Inertial, Pass};
use bb_core::prelude::*;

/// Hangs.
#[derive(Debug)]
pub(super) struct Hangs(u32);

impl Estimator for Hangs {
    type Options = NoOptions;
    type Input = Inertial;
    type Output = Inertial;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self(0))
    }

    fn handle_input(&mut self, _: &Stamped<Inertial>) -> Result<Reply<Inertial>, Fault> {
        self.0 += 1;
        if self.0 % 10 == 1 {
            std::thread::sleep(Duration::from_millis(100));
        }
        Ok(Reply::none())
    }
}

/// Tells how long after its stamp a message has come here, in the first of the ten values, in seconds.
#[derive(Debug)]
pub(super) struct Delay(Clock);

impl Estimator for Delay {
    type Options = NoOptions;
    type Input = Inertial;
    type Output = Inertial;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self(Clock::real()))
    }

    fn handle_input(&mut self, message: &Stamped<Inertial>) -> Result<Reply<Inertial>, Fault> {
        Ok(Reply::emit(Inertial::new(self.0.now().seconds_since(message.monotonic_time))))
    }
}

/// Counts up.
#[derive(Debug)]
pub(super) struct Ticks;

impl Sensor for Ticks {
    type Options = NoOptions;
    type Output = Inertial;

    fn init(_: NoOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Inertial>, Fault> {
        Ok(Reading::now(Inertial::new(1.0)))
    }
}

robot! {
    robot Beside;
    link base {
        sensor imu: Ticks() {
            rate: 1 kHz;
            estimator hangs: Hangs() { runs_on: worker; }
            estimator first: Pass();
        }
        estimator second: Pass() { input message: first; }
        estimator last: Delay() { input message: second; }
    }
}

pub(super) fn measure() -> Result<Vec<Line>, StartError> {
    let builder = Beside::builder();
    let last = builder.subscribe_with(beside::estimator::base::last, Overflow::DropOldest { capacity: 1 << 14 });
    let running = builder.start()?;
    std::thread::sleep(Duration::from_secs(5));
    let report = running.stop();
    let mut delays_s: Vec<f64> = last.drain().map(|message| message.first()).collect();
    delays_s.sort_unstable_by(f64::total_cmp);
    let sent = report.topic("sensor/base/imu").map_or(0, |topic| topic.published);
    let rank = delays_s.len() * 999 / 1000;
    let hung = report.estimator("sensor/base/imu/hangs").expect("it is declared");
    assert!(hung.dispatched > 10, "it was there, and hung");
    Ok(vec![
        Line::Figure { name: "hang_lost", ours: sent as f64 - delays_s.len() as f64, unit: "messages" },
        Line::Figure {
            name: "hang_p999_us",
            ours: delays_s.get(rank).map_or(f64::NAN, |delay| delay * 1e6),
            unit: "us",
        },
    ])
}
