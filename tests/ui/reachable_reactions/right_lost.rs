use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    commands { stop: Stop; }
    link base {
        sensor imu: Bmi270(bus = "i2c-1") {
            estimator tilt: Tilt() { lost_after: 100 ms; on_lost: stop; on_recovered: stop; recover_after: 3; }
        }
    }
}

#[test]
fn compiles() {
    let _ = Rover::builder().subscribe(rover::sensor::base::imu::tilt);
}
