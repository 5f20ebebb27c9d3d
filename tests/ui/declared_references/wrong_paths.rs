//! Topics, commands and an actuator that are not declared, and fields of what has none.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    commands { stop: Stop; slow_down: SlowDown; }
    sensors { sensor battery: External<BatteryState>(); }
    controllers {
        controller misspelt: Reaction(when = sensor::batery.voltage, below = 11 V, run = command::stopp);
        controller absent: Reaction(when = estimator::base::pose.height, below = 1 m, run = command::land);
        controller command: Reaction(when = command::stop.phase, below = 1, run = command::stop.now);
        controller low: Reaction(when = sensor::battery.voltage, below = 11 V, run = actuator::base::motor);
    }
    link base;
}

fn main() {}
