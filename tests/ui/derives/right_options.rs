//! Options of many types.

use bb_core::prelude::*;
use bb_ui_tests::*;

#[derive(Clone, Debug, PartialEq)]
pub enum Drive {
    Differential,
    Omni,
}

#[derive(Clone, Debug, Options)]
pub struct WheelOptions {
    #[option(default = Duration::from_millis(20))]
    pub timeout: Duration,
    #[option(default = None, unit = "m")]
    pub track: Option<f64>,
    #[option(default = 0.5, unit = "rad/s", range = 0.0..=1.0)]
    pub noise: f32,
    #[option(default = Drive::Differential)]
    pub drive: Drive,
    #[option(required)]
    pub port: std::path::PathBuf,
}

pub struct Wheels;

impl Sensor for Wheels {
    type Options = WheelOptions;
    type Output = Imu;

    fn init(options: WheelOptions, _: &SensorContext) -> Result<Self, Fault> {
        assert_eq!(options.timeout, Duration::from_millis(30));
        assert_eq!(options.track, Some(0.42));
        assert_eq!(options.noise, 0.25);
        assert_eq!(options.drive, Drive::Omni);
        assert_eq!(options.port.to_str(), Some("/dev/ttyUSB0"));
        Ok(Self)
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Imu>, Fault> {
        Ok(Reading::finished())
    }
}

robot! {
    robot Rover;

    link base {
        sensor wheels: Wheels(
            timeout = 30 ms, track = 42 cm, noise = 0.25 rad/s, drive = Drive::Omni, port = "/dev/ttyUSB0"
        ) {
            estimator tilt: Tilt();
        }
    }
}

#[test]
fn compiles() {
    Rover::builder().simulate().expect("it starts");
}
