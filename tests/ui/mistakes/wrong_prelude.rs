//! The prelude is not imported: one error for each name of its own that the robot's author wrote, none of the macro's.

use bb_ui_tests::Tilt;

bb_core::robot! {
    robot Rover;
    link base {
        sensor imu: External<Imu>() { estimator tilt: Tilt(gain = 0.2); }
    }
}

fn main() {
    let _ = Rover::builder();
}
