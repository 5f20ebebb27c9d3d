use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    commands { stop: Stop; slow_down: SlowDown; resume: Resume; }
    link base {
        sensor imu: Bmi270(bus = "i2c-1") {
            estimator tilt: Tilt() {
                latency_budget: 1 ms;
                lost_after: 100 ms;
                recover_after: 10;
                on_degraded: slow_down;
                on_lost: stop;
                on_recovered: resume;
            }
        }
    }
}

#[test]
fn compiles() {
    let _ = Rover::builder().subscribe(rover::sensor::base::imu::tilt);
}
