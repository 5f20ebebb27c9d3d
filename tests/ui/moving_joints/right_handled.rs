//! An algorithm that asks for the joints itself, one behind a fixed joint, one on the moving link.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        joint pan: continuous {
            axis: z;
            link head {
                sensor imu: Bmi270(bus = "i2c-1");
                estimator near: Tilt() { input imu: sensor::base::pan::head::imu; }
            }
        }
        joint mount: fixed { link mast { sensor imu: Bmi270(bus = "i2c-2"); } }
        estimator far: Jointed() { input imu: sensor::base::pan::head::imu; }
        estimator fixed: Tilt() { input imu: sensor::base::mount::mast::imu; }
    }
}

fn main() {
    let _ = Rover::builder().subscribe(rover::estimator::base::far);
}
