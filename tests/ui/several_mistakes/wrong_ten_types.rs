//! Ten mistakes of types: ten messages, although `main` uses it all.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor wheel: Wheel();
        sensor imu: Bmi720(bus = "i2c-1");
        sensor left: Bmi270() { estimator tilt: Tilt(gain = 2.0); }
        sensor right: Bmi270(bus = "i2c-2", full_scale = 20 m) { estimator tilt: Tilt(gian = 0.2); }
        sensor field: Magnetometer() { estimator tilt: Tilt(); }
        estimator heading: Heading() {
            input imu: sensor::base::left, driver;
            input feild: sensor::base::field;
        }
        estimator motion: Motion() { input imu: sensor::base::right; output velocty; }
        estimator far: Tilt() { input imu: sensor::base::pan::head::imu; }
        joint pan: continuous {
            axis: z;
            link head { sensor imu: Bmi270(bus = "i2c-3"); }
        }
    }
}

fn main() {
    let builder = Rover::builder();
    let _ = builder.subscribe(rover::sensor::base::wheel);
    let _ = builder.subscribe(rover::sensor::base::field::tilt);
    let _ = builder.subscribe(rover::estimator::base::heading);
    let _ = builder.subscribe(rover::estimator::base::motion::velocty);
    let _ = builder.subscribe(rover::estimator::base::far);
}
