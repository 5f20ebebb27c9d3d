//! The two robots.

use bb_core::prelude::*;
use bb_zenoh::{Remote, Share, ShownClock, Source};
use std::time::{SystemTime, UNIX_EPOCH};

/// A measurement of the mast: the truth by which the rover's view is judged.
#[derive(Clone, Debug, PartialEq, Payload)]
pub(crate) struct Beat {
    /// Number, from 1 on.
    pub(crate) number: u64,
    /// Date of the measurement by the clock that both processes have, ns since 1970.
    pub(crate) date_ns: i64,
    /// `true` if the mast is armed.
    pub(crate) is_armed: bool,
}

/// The date, ns since 1970.
pub(crate) fn date_ns() -> i64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_nanos() as i64)
}

/// A sensor that counts.
#[derive(Debug)]
pub(crate) struct Beacon {
    number: u64,
    bus: bb_core::Bus,
}

impl Sensor for Beacon {
    type Options = NoOptions;
    type Output = Beat;

    fn init(_: NoOptions, context: &SensorContext) -> Result<Self, Fault> {
        Ok(Self { number: 0, bus: context.bus() })
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Beat>, Fault> {
        self.number += 1;
        let is_armed = self.bus.safety() == Safety::Armed;
        Ok(Reading::now(Beat { number: self.number, date_ns: date_ns(), is_armed }))
    }
}

/// A clock that is 10 s ahead, and gains 100 ppm.
#[derive(Debug)]
pub(crate) struct Ahead;

impl ShownClock for Ahead {
    fn shown(time: MonotonicTime) -> MonotonicTime {
        time.plus_nanos(10_000_000_000 + time.as_nanos() / 10_000)
    }
}

robot! {
    /// The robot that measures.
    pub(crate) robot Mast;
    link mast { sensor beacon: Beacon() { rate: 50 Hz; } }
    bridges { bridge net: Share<Ahead>(paths = "sensor/mast", listen = "tcp/127.0.0.1:0"); }
}

/// A beat as the rover saw it.
#[derive(Clone, Debug, PartialEq, Payload)]
pub(crate) struct Seen {
    /// Number of the beat.
    pub(crate) number: u64,
    /// Error of the stamp, s: too late if positive.
    pub(crate) error_s: f64,
    /// Date of the stamp less that of the measurement before, s.
    pub(crate) period_s: f64,
    /// `true` if the mast is armed.
    pub(crate) is_armed: bool,
}

/// Compares stamps with the truth.
#[derive(Debug)]
pub(crate) struct Judge {
    last: Option<i64>,
}

impl Estimator for Judge {
    type Options = NoOptions;
    type Input = Beat;
    type Output = Seen;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self { last: None })
    }

    fn handle_input(&mut self, beat: &Stamped<Beat>) -> Result<Reply<Seen>, Fault> {
        let stamp = beat.wall_time.as_unix_nanos();
        let error_s = (stamp - beat.date_ns) as f64 * 1e-9;
        let period_s = self.last.map_or(0.0, |last| (stamp - last) as f64 * 1e-9);
        self.last = Some(stamp);
        Ok(Reply::emit(Seen { number: beat.number, error_s, period_s, is_armed: beat.is_armed }))
    }
}

robot! {
    /// The robot that looks at what the other one measures.
    pub(crate) robot Rover;
    commands { arm: Arm; }
    link base {
        sensor beacon: Remote<Beat>(
            from = Source::of(mast::sensor::mast::beacon),
            timeout = 300 ms,
            within = 150 ms,
            clock_within = 15 ms
        );
        estimator judge: Judge() { input beat: sensor::base::beacon; lost_after: 500 ms; }
    }
}
