//! Events from outside: cables that are pulled, and commands of the rover's operator.

use bb_core::prelude::*;

/// A while in which a sensor says nothing.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Silence {
    from_millis: u64,
    until_millis: u64,
    begins: (&'static str, &'static str),
    ends: (&'static str, &'static str),
}

impl Silence {
    /// Returns whether it lasts at `time`.
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

/// Something that is done.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Deed {
    /// Event of the hardware, by itself: the sensors know of it.
    Hardware(&'static str, &'static str),
    /// Arming by the operator.
    Arm,
    /// Drive command by the operator.
    Drive,
    /// Disarming by the operator.
    Disarm,
}

/// All of it, in order.
pub(crate) fn steps() -> Vec<(MonotonicTime, Deed)> {
    let operator = [(500, Deed::Arm), (1000, Deed::Drive), (3900, Deed::Drive), (6500, Deed::Disarm)];
    let hardware = [WHEELS_STALLED, IMU_UNPLUGGED].into_iter().flat_map(|silence| {
        let Silence { from_millis, until_millis, begins, ends } = silence;
        [(from_millis, Deed::Hardware(begins.0, begins.1)), (until_millis, Deed::Hardware(ends.0, ends.1))]
    });
    let mut steps: Vec<_> = operator.into_iter().chain(hardware).collect();
    steps.sort_by_key(|(millis, _)| *millis);
    steps.into_iter().map(|(millis, deed)| (at(millis), deed)).collect()
}

/// Time at which the story ends.
pub(crate) const END: MonotonicTime = at(7000);

const fn at(millis: u64) -> MonotonicTime {
    MonotonicTime::from_nanos(millis as i64 * 1_000_000)
}
