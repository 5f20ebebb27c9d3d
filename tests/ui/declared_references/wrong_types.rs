//! Fields that are not there or are not numbers, and something else than a field or a command.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    commands { stop: Stop; }
    sensors { sensor battery: External<BatteryState>(); }
    controllers {
        controller unknown: Reaction(when = sensor::battery.volts, below = 11 V, run = command::stop);
        controller text: Reaction(when = sensor::battery.location, below = 11.0, run = command::stop);
        controller whole: Reaction(when = sensor::battery, below = 11.0, run = command::stop);
        controller quoted: Reaction(when = "sensor/battery.voltage", below = 11.0, run = "command/stop");
        controller swapped: Reaction(when = command::stop, below = 11.0, run = sensor::battery.voltage);
    }
    link base;
}

fn main() {}
