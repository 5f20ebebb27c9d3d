//! An estimator in a sensor has no `input` and no `sync_tolerance`: its only input is that sensor.
//!
//! Right: `sensor imu: A() { estimator tilt: Madgwick(); }`
//! Wrong: `sensor imu: A() { estimator tilt: Madgwick() { input imu: sensor::base::imu; } }`

use crate::diagnostics::Diagnostics;
use crate::language::EstimatorSetting;
use crate::model::{Home, Robot};

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    for estimator in &robot.estimators {
        let Home::Sensor(sensor) = estimator.home else {
            continue;
        };
        let sensor = &robot.sensors[sensor].name;
        for input in &estimator.inputs {
            let message = format!(
                "an estimator in a sensor takes that sensor, `{sensor}`, and no `input`; leave it out, or declare the \
                 estimator on the link"
            );
            diagnostics.error(&input.word, message);
        }
        for tolerance in estimator.settings.of(EstimatorSetting::SyncTolerance) {
            let message = "an estimator in a sensor has one input, and nothing to be in step with; leave it out";
            diagnostics.error(&tolerance.word, message.into());
        }
    }
}
