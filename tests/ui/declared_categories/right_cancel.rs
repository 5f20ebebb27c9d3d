use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    commands {
        category motion { concurrency: 2; }
        move_to: MoveTo(speed = 2 m/s) { category: motion; }
        slow_down: SlowDown { category: default; cancel: [motion, default]; }
        stop: Stop { cancel: all; }
    }
    link base { sensor imu: Bmi270(bus = "i2c-1") { estimator tilt: Tilt(); } }
}

#[test]
fn compiles() {
    let _ = Rover::builder().subscribe(rover::sensor::base::imu::tilt);
}
