//! Options of the declared state estimator.

use crate::navigation::eskf::EskfParams;
use crate::navigation::geodesy::Geodetic;
use crate::navigation::state_estimator::{StateEstimatorConfig, StateEstimatorParams, StrategyKind, TakeoffOrigin};
use bb_core::{Fault, Options};

/// Options of [`FlightEstimator`](super::FlightEstimator); what is not among them is as in [`StateEstimatorParams`].
#[derive(Clone, Debug, Options)]
pub struct FlightOptions {
    /// `smoother` or `eskf`. Default: `smoother`, where the crate was built with it.
    #[option(default = StrategyKind::ALL[0].name().to_owned())]
    pub strategy: String,
    /// Estimates a second.
    #[option(default = 5.0, range = 0.1..=1000.0, unit = "Hz")]
    pub output_rate: f64,
    /// Number of keyframes that are held, from 2 to 100.
    #[option(default = 15)]
    pub window: u32,
    /// Latitude of the take-off; not a number for a start from the first anchor.
    #[option(default = f64::NAN, unit = "rad")]
    pub origin_latitude: f64,
    /// Longitude of the take-off.
    #[option(default = 0.0, unit = "rad")]
    pub origin_longitude: f64,
    /// Height of the origin above the ellipsoid.
    #[option(default = 0.0, unit = "m")]
    pub origin_height: f64,
    /// Heading of the link's x axis at take-off, from east counter-clockwise.
    #[option(default = 0.0, range = -7.0..=7.0, unit = "rad")]
    pub heading: f64,
    /// An anchor older than this demotes to `visual_propagated`.
    #[option(default = 3.0, range = 0.1..=600.0, unit = "s")]
    pub anchor_age: f64,
    /// White noise of the gyroscope, rad/s/√Hz.
    #[option(default = 1.7e-4, range = 1e-9..=10.0)]
    pub gyroscope_noise: f64,
    /// White noise of the accelerometer, m/s²/√Hz.
    #[option(default = 2e-3, range = 1e-9..=100.0)]
    pub accelerometer_noise: f64,
    /// Gravity where the robot is.
    #[option(default = 9.80665, range = 1.0..=30.0, unit = "m/s^2")]
    pub gravity: f64,
    /// Beginning of the names of frames: another in each flight.
    #[option(default = 0)]
    pub flight: u32,
}

impl FlightOptions {
    pub(super) fn config(&self) -> Result<StateEstimatorConfig, Fault> {
        let strategy = StrategyKind::named(&self.strategy).ok_or_else(|| {
            let known: Vec<_> = StrategyKind::ALL.iter().map(|strategy| strategy.name()).collect();
            Fault::new(format!("there is no strategy `{}`: choose one of {}", self.strategy, known.join(", ")))
        })?;
        let params = StateEstimatorParams {
            output_rate: self.output_rate,
            window: self.window,
            takeoff_heading: self.heading,
            anchor_age: self.anchor_age,
            ..StateEstimatorParams::default()
        };
        let sensors = EskfParams {
            gyroscope_noise: self.gyroscope_noise,
            accelerometer_noise: self.accelerometer_noise,
            gravity: self.gravity,
            ..EskfParams::default()
        };
        Ok(StateEstimatorConfig { strategy, params, sensors, flight: self.flight.into() })
    }

    pub(super) fn origin(&self) -> Option<TakeoffOrigin> {
        let (latitude, longitude) = (self.origin_latitude, self.origin_longitude);
        let position = Geodetic { latitude, longitude, height: self.origin_height };
        (!latitude.is_nan()).then(|| TakeoffOrigin::new(position))
    }
}
