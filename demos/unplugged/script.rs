//! Events from outside: cables that are pulled, and commands of the rover's operator.

use bb_core::prelude::*;

/// An interval in which a sensor sends nothing.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Silence {
    from_millis: u64,
    until_millis: u64,
    begins: (&'static str, &'static str),
    ends: (&'static str, &'static str),
}

impl Silence {
    /// Returns whether `time` is in the interval.
    pub(crate) fn includes(self, time: MonotonicTime) -> bool {
        (at(self.from_millis)..at(self.until_millis)).contains(&time)
    }
}

pub(crate) const WHEELS_STALLED: Silence = Silence {
    from_millis: 2000,
    until_millis: 2250,
    begins: ("the wheels stall", "their encoders fall silent"),
    ends: ("the wheels turn again", ""),
};

pub(crate) const IMU_UNPLUGGED: Silence = Silence {
    from_millis: 3000,
    until_millis: 4500,
    begins: ("the IMU is unplugged", "so that nothing runs the estimator"),
    ends: ("the IMU is plugged in", ""),
};

/// An action from outside.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Action {
    /// Event of the hardware with its detail; the sensors simulate it themselves.
    Hardware(&'static str, &'static str),
    /// Arming by the operator.
    Arm,
    /// Drive command by the operator.
    Drive,
    /// Disarming by the operator.
    Disarm,
}

/// All actions with their times, in order.
pub(crate) fn steps() -> Vec<(MonotonicTime, Action)> {
    let operator = [(500, Action::Arm), (1000, Action::Drive), (3900, Action::Drive), (6500, Action::Disarm)];
    let hardware = [WHEELS_STALLED, IMU_UNPLUGGED].into_iter().flat_map(|silence| {
        let Silence { from_millis, until_millis, begins, ends } = silence;
        [(from_millis, Action::Hardware(begins.0, begins.1)), (until_millis, Action::Hardware(ends.0, ends.1))]
    });
    let mut steps: Vec<_> = operator.into_iter().chain(hardware).collect();
    steps.sort_by_key(|(millis, _)| *millis);
    steps.into_iter().map(|(millis, action)| (at(millis), action)).collect()
}

/// Time at which the story ends.
pub(crate) const END: MonotonicTime = at(7000);

const fn at(millis: u64) -> MonotonicTime {
    MonotonicTime::from_nanos(millis as i64 * 1_000_000)
}
