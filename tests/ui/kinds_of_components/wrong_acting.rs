use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    commands { stop: Servo; }
    controllers { controller balance: Servo(); }
    bridges { bridge ros: Stop(); }
    link base {
        sensor imu: Bmi270(bus = "i2c-1") { estimator tilt: Tilt(); }
        joint pan: continuous {
            axis: z;
            actuator servo: Stop();
            sensor encoder: Encoder();
            link head { }
        }
    }
}

fn main() {
    let _ = Rover::builder().subscribe(rover::sensor::base::imu::tilt);
}
