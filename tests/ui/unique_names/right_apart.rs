//! Equal names in different places.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    sensors { sensor imu: Bmi270(bus = "spi-0"); }
    link base {
        sensor imu: Bmi270(bus = "i2c-1") { estimator imu: Tilt(); }
        joint mount: fixed { link mast { sensor imu: Bmi270(bus = "i2c-2"); } }
    }
}

#[test]
fn compiles() {
    let builder = Rover::builder();
    let _ = builder.subscribe(rover::sensor::imu);
    let _ = builder.subscribe(rover::sensor::base::imu);
    let _ = builder.subscribe(rover::sensor::base::imu::imu);
    let _ = builder.subscribe(rover::sensor::base::mount::mast::imu);
}
