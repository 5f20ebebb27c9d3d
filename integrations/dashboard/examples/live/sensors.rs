//! Simulated sensors of a rover that drives in a circle, with faults that repeat in every [`CYCLE`].

use bb_core::nalgebra::Vector3;
use bb_core::prelude::*;
use std::ops::Range as Span;

/// Period of the faults.
pub(crate) const CYCLE: Duration = Duration::from_secs(40);

/// The wheels' encoders say nothing.
const STALLED: Span<f64> = 8.0..8.3;
/// The IMU is unplugged.
const UNPLUGGED: Span<f64> = 15.0..20.0;
/// The sonar's cable has a loose contact.
const LOOSE: Span<f64> = 26.0..30.0;

fn is_in(span: &Span<f64>, now: MonotonicTime) -> bool {
    span.contains(&(seconds(now) % CYCLE.as_secs_f64()))
}

fn seconds(now: MonotonicTime) -> f64 {
    now.seconds_since(MonotonicTime::ZERO)
}

/// Options of the sensors that measure the motion of the rover.
#[derive(Clone, Debug, Options)]
pub(crate) struct Drive {
    /// Speed. Unit: m/s.
    #[option(required, range = 0.0..=1.5, unit = "m/s")]
    pub(crate) speed: f64,
    /// Radius of its circle. Unit: m.
    #[option(default = 2.0, range = 0.5..=10.0, unit = "m")]
    pub(crate) radius: f64,
}

/// An IMU without a bias, with a periodic disturbance.
#[derive(Debug)]
pub(crate) struct Gyroscope(Drive);

impl Sensor for Gyroscope {
    type Options = Drive;
    type Output = Imu;

    fn init(options: Drive, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self(options))
    }

    fn read(&mut self, now: MonotonicTime) -> Result<Reading<Imu>, Fault> {
        if is_in(&UNPLUGGED, now) {
            return Ok(Reading::nothing());
        }
        let (speed, disturbance) = (self.0.speed, (seconds(now) * 31.0).sin() * 0.02);
        let angular_velocity =
            Vector3::new(disturbance, -disturbance / 2.0, speed / self.0.radius + disturbance / 4.0);
        let linear_acceleration =
            Vector3::new(disturbance, speed * speed / self.0.radius, 9.81 + 4.0 * disturbance);
        Ok(Reading::now(Imu::new(angular_velocity, linear_acceleration)))
    }

    fn handle_options(&mut self, options: Drive, _: &SensorContext) -> Result<(), Fault> {
        self.0 = options;
        Ok(())
    }
}

/// Odometry of the wheels.
#[derive(Debug)]
pub(crate) struct Wheels(Drive);

impl Sensor for Wheels {
    type Options = Drive;
    type Output = Twist;

    fn init(options: Drive, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self(options))
    }

    fn read(&mut self, now: MonotonicTime) -> Result<Reading<Twist>, Fault> {
        if is_in(&STALLED, now) {
            return Ok(Reading::nothing());
        }
        let linear = Vector3::new(self.0.speed, 0.0, 0.0);
        let angular = Vector3::new(0.0, 0.0, self.0.speed / self.0.radius);
        Ok(Reading::now(Twist { linear, angular, covariance: None }))
    }

    fn handle_options(&mut self, options: Drive, _: &SensorContext) -> Result<(), Fault> {
        self.0 = options;
        Ok(())
    }
}

/// A sonar that sees a wall come and go.
#[derive(Debug)]
pub(crate) struct Sonar;

impl Sensor for Sonar {
    type Options = NoOptions;
    type Output = Range;

    fn init(_: NoOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn read(&mut self, now: MonotonicTime) -> Result<Reading<Range>, Fault> {
        if is_in(&LOOSE, now) {
            return Err(Fault::new("no echo from the transducer: is its cable plugged in?"));
        }
        let range = Range {
            radiation: Radiation::Ultrasound,
            field_of_view: 0.3,
            min_range: 0.05,
            max_range: 4.0,
            range: (1.2 + (seconds(now) * 0.4).sin()) as f32,
            variance: None,
        };
        Ok(Reading::now(range))
    }
}

/// Options of [`Battery`].
#[derive(Clone, Debug, Options)]
pub(crate) struct Load {
    /// Speed of the rover. Unit: m/s.
    #[option(required, range = 0.0..=1.5, unit = "m/s")]
    pub(crate) speed: f64,
}

/// A battery that sags when the rover drives.
#[derive(Debug)]
pub(crate) struct Battery(Load);

impl Sensor for Battery {
    type Options = Load;
    type Output = BatteryState;

    fn init(options: Load, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self(options))
    }

    fn read(&mut self, now: MonotonicTime) -> Result<Reading<BatteryState>, Fault> {
        let voltage = 25.2 - 0.8 * self.0.speed - 0.1 * (seconds(now) * 0.7).sin();
        Ok(Reading::now(BatteryState { voltage, is_present: true, ..BatteryState::default() }))
    }

    fn handle_options(&mut self, options: Load, _: &SensorContext) -> Result<(), Fault> {
        self.0 = options;
        Ok(())
    }
}
