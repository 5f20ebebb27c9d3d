//! A misspelt path, an input in a sensor, a length where a time belongs: three errors, although `main` uses it all.

use bb_core::prelude::*;
use bb_ui_tests::*;

robot! {
    robot Rover;
    link base {
        sensor imu: Bmi270(bus = "i2c-1") {
            rate: 200 Hz;
            estimator tilt: Tilt() { input imu: sensor::base::imu; }
        }
        sensor field: Magnetometer() { rate: 50 Hz; }
        estimator heading: Heading() {
            input imu: sensor::base::imu, driver;
            input field: sensor::base::feild;
            sync_tolerance: 20 m;
        }
    }
}

fn main() -> Result<(), StartError> {
    let mut builder = Rover::builder();
    builder.options(rover::sensor::base::imu::tilt).gain = 0.2;
    let heading: Subscription<Orientation> = builder.subscribe(rover::estimator::base::heading);
    let mut simulation = builder.simulate()?;
    simulation.run_for(Duration::from_secs(1));
    for message in heading.drain() {
        println!("{:?}", message.world_from_body);
    }
    Ok(())
}
