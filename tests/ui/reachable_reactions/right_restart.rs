//! Any estimator can degrade: it does when it is restarted.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    commands { slow_down: SlowDown; }
    link base {
        sensor imu: Bmi270(bus = "i2c-1") {
            estimator tilt: Tilt() { on_degraded: slow_down; recover_after: 3; }
        }
    }
}

#[test]
fn compiles() {
    let _ = Rover::builder().subscribe(rover::sensor::base::imu::tilt);
}
