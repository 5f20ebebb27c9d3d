//! A read of the robot's clock, beside one of the standard library's.

use super::{Line, in_turn};
use bb_core::prelude::*;
use std::hint::black_box;
use std::time::Instant;

pub(super) fn measure() -> Vec<Line> {
    let clock = Clock::real();
    let (ours_ns, beside_ns) = in_turn(
        2_000,
        || {
            black_box(clock.now());
        },
        || {
            black_box(Instant::now());
        },
    );
    vec![Line::Beside { name: "clock_now", ours_ns, beside_ns }]
}
