//! Exactly one of several inputs is the `driver`.
//!
//! Right: `input imu: sensor::base::imu, driver; input odom: sensor::base::wheels;`
//! Wrong: `input imu: sensor::base::imu; input odom: sensor::base::wheels;`

use crate::diagnostics::Diagnostics;
use crate::model::Robot;

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    let several = robot.estimators.iter().filter(|estimator| !estimator.is_nested() && estimator.inputs.len() > 1);
    for estimator in several {
        let name = &estimator.name;
        let mut drivers = estimator.inputs.iter().filter_map(|input| Some((&input.name, input.driver.as_ref()?)));
        match drivers.next() {
            Some((first, _)) => {
                for (_, extra) in drivers {
                    let message =
                        format!("`{name}` already has a driver, the input `{first}`; leave out all but one");
                    diagnostics.error(extra, message);
                }
            }
            None if robot.complete => {
                let first = estimator.inputs.first().map_or(String::new(), |input| input.name.to_string());
                let message = format!(
                    "none of the inputs of `{name}` is its driver; mark the one whose arrival runs it, as in `input \
                     {first}: …, driver;`"
                );
                diagnostics.error(name, message);
            }
            None => {}
        }
    }
}
