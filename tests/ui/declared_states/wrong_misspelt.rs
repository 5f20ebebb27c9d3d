//! States that are not there, and one twice.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    states { degraded; }
    commands {
        stop: Stop { allowed_states: [idle, executing, degarded]; }
        resume: Resume { allowed_states: [moving]; }
        slow_down: SlowDown { allowed_states: [idle, idle]; }
    }
    link base { sensor field: Magnetometer(); }
}

fn main() {}
