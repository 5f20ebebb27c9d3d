//! States and commands that cannot be read, among some that can.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    states { degraded, moving; }
    commands {
        category motion { concurency: 2; }
        arm Arm;
        move_to: MoveTo(speed = 1 m/s) {
            allowed_state: [idle];
            timeout: soon;
            cancel: motion;
        }
        stop: Stop { rate: 5 Hz; }
    }
    controllers { bridge ros: RosBridge(port = 1); }
    link base {
        sensor field: Magnetometer();
        actuator servo: Servo();
    }
}

fn main() {}
