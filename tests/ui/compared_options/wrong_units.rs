//! Bounds without the unit of the field that they are compared with, without any bound, and a time without a unit.

use bb_core::prelude::*;
use bb_ui_tests::*;

#[derive(Clone, Debug, Payload)]
pub struct Level {
    pub metres: f64,
}

robot! {
    robot Rover;
    parameters { lowest: f64 = 1 A; }
    commands { stop: Stop; }
    sensors { sensor battery: External<BatteryState>(); sensor tank: External<Level>(); }
    controllers {
        controller ampere: Reaction(when = sensor::battery.voltage, below = 11 A, run = command::stop);
        controller plain: Reaction(when = sensor::battery.voltage, below = 11, run = command::stop);
        controller bound: Reaction(when = sensor::battery.voltage, below = param::lowest, run = command::stop);
        controller joint: Reaction(when = sensor::base::pan::encoder.position, above = 1 V, run = command::stop);
        controller turning: Reaction(when = sensor::base::imu.angular_velocity.x, above = 1 rad, run = command::stop);
        controller without: Reaction(when = sensor::tank.metres, above = 1 m, run = command::stop);
        controller never: Reaction(when = sensor::battery.voltage, run = command::stop);
        controller time: Reaction(when = sensor::battery.voltage, below = 11 V, for = 2, run = command::stop);
        controller nothing: Reaction(below = 11 V, run = command::stop);
    }
    link base {
        sensor imu: External<Imu>();
        joint pan: continuous { axis: z; sensor encoder: External<JointState>(); link head; }
    }
}

fn main() {}
