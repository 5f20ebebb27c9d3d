use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    parameters {
        bus: String = "i2c-1";
        fast: f64 = 9 m/s;
        plain: f64 = 1.0;
        count: i64 = 3;
    }
    commands {
        too_fast: MoveTo(speed = param::fast);
        no_unit: MoveTo(speed = param::plain);
        no_number: MoveTo(speed = param::bus);
        whole: MoveTo(speed = param::count);
    }
    link base { sensor imu: Bmi270(bus = "i2c-1") { estimator tilt: Tilt(); } }
}

fn main() {
    let _ = Rover::builder().subscribe(rover::sensor::base::imu::tilt);
}
