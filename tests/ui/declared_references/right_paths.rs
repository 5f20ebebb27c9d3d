//! Options that name fields of sensors, estimators and outputs at paths of their own, commands, and paths as texts.

use bb_core::prelude::*;
use bb_ui_tests::*;

/// A module of the user's with the name of a root of paths.
mod sensor {
    pub(super) const FULL_SCALE: f64 = 10.0;
}

/// Options that are paths as texts.
#[derive(Clone, Debug, Options)]
pub struct FollowOptions {
    #[option(required)]
    pub measurement: &'static str,
    #[option(required)]
    pub actuator: String,
}

#[derive(Debug)]
pub struct Follow;

impl Service for Follow {
    type Options = FollowOptions;
    type Output = Imu;

    fn init(options: FollowOptions, _: &ServiceContext) -> Result<Self, Fault> {
        assert_eq!(options.measurement, "sensor/base/arm/encoder");
        assert_eq!(options.actuator, "actuator/base/arm/motor");
        Ok(Self)
    }

    fn update(&mut self, _: MonotonicTime) -> Result<Reading<Imu>, Fault> {
        Ok(Reading::finished())
    }
}

robot! {
    robot Rover;
    parameters { lowest: f64 = 11 V; }
    commands { stop: Stop; }
    sensors { sensor battery: External<BatteryState>(); sensor other: Bmi270(bus = "i2c-2", full_scale = sensor::FULL_SCALE); }
    controllers {
        controller low: Reaction(when = sensor::battery.voltage, below = param::lowest, for = 2 s, run = command::stop);
        controller empty: Reaction(when = sensor::battery.percentage, below = 0.1, run = command::stop);
        controller tilted: Reaction(
            when = sensor::base::imu.angular_velocity.x, below = -90 deg/s, above = 90 deg/s, run = command::stop,
        );
        controller turned: Reaction(when = sensor::base::arm::encoder.position, above = 80 deg, run = command::stop);
        controller far: Reaction(when = nav::tilt.world_from_body.coords.w, below = 0.5, run = command::stop);
        controller hold: Follow(measurement = sensor::base::arm::encoder, actuator = actuator::base::arm::motor);
    }
    link base {
        sensor imu: Bmi270(bus = "i2c-1") { estimator tilt: Tilt() { output out: [nav, tilt]; } }
        joint arm: continuous {
            axis: z;
            actuator motor: Servo(id = 2);
            sensor encoder: External<JointState>();
            link hand;
        }
    }
}

#[test]
fn compiles() {
    assert!(Rover::builder().simulate().is_ok());
}
