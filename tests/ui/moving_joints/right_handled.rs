//! An algorithm that takes transforms that change, one behind a fixed joint, one on the moving link, and one of a payload that
//! depends on no frame.

use bb_core::prelude::*;
use bb_ui_tests::*;

/// Watches a joint, wherever it is.
struct Watch;

impl Estimator for Watch {
    type Options = NoOptions;
    type Input = JointState;
    type Output = JointState;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, _: &Stamped<JointState>) -> Result<Reply<JointState>, Fault> {
        Ok(Reply::none())
    }
}

robot! {
    robot Rover;
    link base {
        joint pan: continuous {
            axis: z;
            link head {
                sensor imu: Bmi270(bus = "i2c-1");
                joint tilt: continuous { axis: y; sensor encoder: External<JointState>(); link face; }
                estimator near: Tilt() { input imu: sensor::base::pan::head::imu; }
            }
        }
        joint mount: fixed { link mast { sensor imu: Bmi270(bus = "i2c-2"); } }
        estimator far: Jointed() { input imu: sensor::base::pan::head::imu; }
        estimator watch: Watch() { input tilt: sensor::base::pan::head::tilt::encoder; }
        estimator fixed: Tilt() { input imu: sensor::base::mount::mast::imu; }
    }
}

#[test]
fn compiles() {
    let _ = Rover::builder().subscribe(rover::estimator::base::far);
}
