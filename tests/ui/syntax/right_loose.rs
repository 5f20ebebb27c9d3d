//! Semicolons to spare, docs everywhere, glued units, no bodies.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    /// A rover.
    pub robot Rover;;
    /// The body.
    link base {
        ;
        /// Inertial sensor.
        sensor imu: Bmi270(bus = "i2c-1",) { rate: 200Hz; };
        joint mount: fixed { link mast; };
    };
}

#[test]
fn compiles() {
    let _ = Rover::builder().subscribe(rover::sensor::base::imu);
}
