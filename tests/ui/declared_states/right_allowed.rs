use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    states { degraded; }
    commands {
        arm: Arm;
        disarm: Disarm { allowed_states: [idle, executing, degraded]; }
        stop: Stop { allowed_states: [disarmed, idle, executing, degraded]; timeout: 2 s; }
        resume: Resume { allowed_states: [degraded]; }
    }
    link base { sensor imu: Bmi270(bus = "i2c-1") { estimator tilt: Tilt(); } }
}

#[test]
fn compiles() {
    let _ = Rover::builder().subscribe(rover::sensor::base::imu::tilt);
}
