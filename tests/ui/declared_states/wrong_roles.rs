use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    commands {
        arm: Arm { allowed_states: [idle]; }
        arm_again: Arm;
        disarm: Disarm { allowed_states: [disarmed]; }
        stop: Disarm;
    }
    link base { sensor imu: Bmi270(bus = "i2c-1") { estimator tilt: Tilt(); } }
}

fn main() {
    let _ = Rover::builder().subscribe(rover::sensor::base::imu::tilt);
}
