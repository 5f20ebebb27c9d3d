//! Parameters at the top and in groups.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    parameters {
        /// Parameters of the filter.
        imu {
            /// Weight of a sample in the estimate.
            gain: f64 = 0.2, range: 0.0..=1.0;
            memory { time: f64 = 500 ms; }
        }
        bus: String = "i2c-1";
        averages: i64 = 4;
    }
    link base {
        sensor imu: Bmi270(bus = param::bus, averages = param::averages) {
            estimator tilt: Tilt(gain = param::imu::gain, time_constant = param::imu::memory::time);
        }
    }
}

#[test]
fn compiles() {
    let _ = Rover::builder().subscribe(rover::sensor::base::imu::tilt);
}
