//! The robot of tests that need no other: a component of each kind, whose code a test sets by its options.

use crate::components::{Echo, Number, Servo, Source, Task};
use bb_core::prelude::*;
use bb_core::run::{ActuatorHandle, CommandHandle};
use bb_core::{EstimatorHandle, SensorHandle};

robot! {
    pub(crate) robot Plain;

    parameters { gain: f64 = 1.0; }

    commands {
        category many { concurrency: 1000; }
        arm: Arm;
        disarm: Disarm;
        task: Task { category: many; allowed_states: [disarmed, idle, executing]; }
    }

    link base {
        sensor source: Source() { rate: 100 Hz; estimator behind: Echo(); }
        sensor number: External<Number>() { estimator echo: Echo(); }
        estimator apart: Echo() { input number: sensor::base::number; runs_on: worker; }
        joint pan: continuous {
            axis: z;
            sensor encoder: External<Number>() { estimator position: Echo(); }
            actuator servo: Servo();
            link head { }
        }
    }
}

pub(crate) const SOURCE: SensorHandle<Plain, Source> = plain::sensor::base::source;
pub(crate) const BEHIND: EstimatorHandle<Plain, Echo, Number> = plain::sensor::base::source::behind;
pub(crate) const NUMBER: SensorHandle<Plain, External<Number>> = plain::sensor::base::number;
pub(crate) const ECHO: EstimatorHandle<Plain, Echo, Number> = plain::sensor::base::number::echo;
pub(crate) const APART: EstimatorHandle<Plain, Echo, Number> = plain::estimator::base::apart;
pub(crate) const POSITION: EstimatorHandle<Plain, Echo, Number> = plain::sensor::base::pan::encoder::position;
pub(crate) const ENCODER: SensorHandle<Plain, External<Number>> = plain::sensor::base::pan::encoder;
pub(crate) const SERVO: ActuatorHandle<Plain, Servo> = plain::actuator::base::pan::servo;
pub(crate) const TASK: CommandHandle<Plain, Task> = plain::command::task;
