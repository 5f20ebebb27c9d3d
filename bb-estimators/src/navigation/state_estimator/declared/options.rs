//! Options of the declared state estimator.

use crate::navigation::camera::Camera;
use crate::navigation::eskf::EskfParams;
use crate::navigation::geodesy::Geodetic;
use crate::navigation::state_estimator::{StateEstimatorConfig, StateEstimatorParams, StrategyKind, TakeoffOrigin};
use bb_core::{Fault, Options};
use nalgebra::Isometry3;

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
    /// Anchors and fixes of a trusted receiver that are older than this demote to `visual_propagated`.
    #[option(default = 3.0, range = 0.1..=600.0, unit = "s")]
    pub anchor_age: f64,
    /// Largest delay of an input behind the newest sample of the IMU with which it is still placed where it belongs.
    #[option(default = 2.0, range = 0.05..=10.0, unit = "s")]
    pub lateness: f64,
    /// Largest lead of an input's stamp over the newest sample of the IMU.
    #[option(default = 0.5, range = 0.0..=10.0, unit = "s")]
    pub lead: f64,
    /// Time after which a keyframe is made without camera frames.
    #[option(default = 1.0, range = 0.05..=10.0, unit = "s")]
    pub keyframe_interval: f64,
    /// Time after the last sample of the IMU for which there is still an estimate.
    #[option(default = 0.2, range = 0.0..=1.0, unit = "s")]
    pub longest_prediction: f64,
    /// Time for which estimates may be missing before the flight controller's own IMU takes over.
    #[option(default = 3.0, range = 0.1..=60.0, unit = "s")]
    pub fallback_after: f64,
    /// Without a camera's, or a satellite's, measurement for this time it is `dead_reckoned`.
    #[option(default = 1.0, range = 0.05..=60.0, unit = "s")]
    pub visual_loss: f64,
    /// Time for which a receiver that was spoofed must be healthy before it may be let in again.
    #[option(default = 10.0, range = 0.0..=600.0, unit = "s")]
    pub dwell: f64,
    /// Reports of its health that are farther apart break the dwell.
    #[option(default = 2.0, range = 0.05..=60.0, unit = "s")]
    pub health_gap: f64,
    /// Largest distance of its fix from the next anchor with which it is let in again.
    #[option(default = 25.0, range = 0.1..=1e4, unit = "m")]
    pub anchor_tolerance: f64,
    /// Largest distance of its fix from the estimate with which it is let in again.
    #[option(default = 200.0, range = 1.0..=1e6, unit = "m")]
    pub bounded_distance: f64,
    /// Factor of the flight controller's standard deviations at a warm start.
    #[option(default = 2.0, range = 1.0..=100.0)]
    pub warm_inflation: f64,
    /// A covariance that is larger than the steady one by this factor is warned of.
    #[option(default = 2.0, range = 1.1..=1e3)]
    pub growing_covariance: f64,
    /// White noise of the gyroscope, rad/s/√Hz.
    #[option(default = 1.7e-4, range = 1e-9..=10.0)]
    pub gyroscope_noise: f64,
    /// White noise of the accelerometer, m/s²/√Hz.
    #[option(default = 2e-3, range = 1e-9..=100.0)]
    pub accelerometer_noise: f64,
    /// Gravity where the robot is.
    #[option(default = 9.80665, range = 1.0..=30.0, unit = "m/s^2")]
    pub gravity: f64,
    /// Horizontal focal length of the camera that sees landmarks, pixels.
    #[option(default = f64::NAN)]
    pub fx: f64,
    /// Vertical focal length, pixels.
    #[option(default = f64::NAN)]
    pub fy: f64,
    /// Principal point from the left, pixels.
    #[option(default = f64::NAN)]
    pub cx: f64,
    /// Principal point from the top, pixels.
    #[option(default = f64::NAN)]
    pub cy: f64,
    /// Width of its images, pixels.
    #[option(default = f64::NAN)]
    pub width: f64,
    /// Height of its images, pixels.
    #[option(default = f64::NAN)]
    pub height: f64,
    /// Radial distortion of its lens.
    #[option(default = 0.0)]
    pub k1: f64,
    /// Radial distortion of the fourth order.
    #[option(default = 0.0)]
    pub k2: f64,
    /// Radial distortion of the sixth order.
    #[option(default = 0.0)]
    pub k3: f64,
    /// Tangential distortion, vertical.
    #[option(default = 0.0)]
    pub p1: f64,
    /// Tangential distortion, horizontal.
    #[option(default = 0.0)]
    pub p2: f64,
    /// Number of landmarks that are held at once, from 1 to 100,000; more are refused.
    #[option(default = 256)]
    pub landmarks: u32,
    /// Beginning of the names of frames; 0 for one that is made from the first sample of the IMU, another in each flight.
    #[option(default = 0)]
    pub flight: u32,
}

impl FlightOptions {
    /// The configuration, given the pose of the camera if landmarks are an input.
    pub(super) fn config(&self, body_from_camera: Option<Isometry3<f64>>) -> Result<StateEstimatorConfig, Fault> {
        let strategy = StrategyKind::named(&self.strategy).ok_or_else(|| {
            let known: Vec<_> = StrategyKind::ALL.iter().map(|strategy| strategy.name()).collect();
            Fault::new(format!("there is no strategy `{}`: choose one of {}", self.strategy, known.join(", ")))
        })?;
        let params = StateEstimatorParams {
            output_rate: self.output_rate,
            window: self.window,
            takeoff_heading: self.heading,
            anchor_age: self.anchor_age,
            lateness: self.lateness,
            lead: self.lead,
            keyframe_interval: self.keyframe_interval,
            longest_prediction: self.longest_prediction,
            fallback_after: self.fallback_after,
            visual_loss: self.visual_loss,
            dwell: self.dwell,
            health_gap: self.health_gap,
            anchor_tolerance: self.anchor_tolerance,
            bounded_distance: self.bounded_distance,
            warm_inflation: self.warm_inflation,
            growing_covariance: self.growing_covariance,
            landmarks: self.landmarks,
            ..StateEstimatorParams::default()
        };
        let sensors = EskfParams {
            gyroscope_noise: self.gyroscope_noise,
            accelerometer_noise: self.accelerometer_noise,
            gravity: self.gravity,
            ..EskfParams::default()
        };
        if body_from_camera.is_some() && !strategy.is_smoothing() {
            let named = strategy.name();
            return Err(Fault::new(format!("the input `features` needs `strategy = \"smoother\"`, not `{named}`")));
        }
        let camera = body_from_camera.map(|pose| self.camera(&pose)).transpose()?;
        Ok(StateEstimatorConfig { strategy, params, sensors, camera, flight: self.flight.into() })
    }

    fn camera(&self, body_from_camera: &Isometry3<f64>) -> Result<Camera, Fault> {
        let lens = [
            ("fx", self.fx),
            ("fy", self.fy),
            ("cx", self.cx),
            ("cy", self.cy),
            ("width", self.width),
            ("height", self.height),
        ];
        if let Some((name, _)) = lens.iter().find(|(_, value)| value.is_nan()) {
            return Err(Fault::new(format!(
                "the input `features` needs the lens of its camera: the option `{name}`"
            )));
        }
        Ok(Camera {
            distortion: [self.k1, self.k2, self.k3, self.p1, self.p2],
            body_from_camera: body_from_camera.rotation,
            position: body_from_camera.translation.vector,
            ..Camera::pinhole((self.fx, self.fy), (self.cx, self.cy), (self.width, self.height))
        })
    }

    pub(super) fn origin(&self) -> Option<TakeoffOrigin> {
        let (latitude, longitude) = (self.origin_latitude, self.origin_longitude);
        let position = Geodetic { latitude, longitude, height: self.origin_height };
        (!latitude.is_nan()).then(|| TakeoffOrigin::new(position))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_those_of_the_library() {
        let FlightOptions { gravity, .. } = FlightOptions::defaults();
        let config = FlightOptions::defaults().config(None).unwrap();
        let sensors = EskfParams { gravity, ..config.sensors };
        assert_eq!(config, StateEstimatorConfig { sensors, ..StateEstimatorConfig::default() });
    }

    #[test]
    fn landmarks_need_a_window_and_a_lens() {
        let text = |options: &FlightOptions| options.config(Some(Isometry3::identity())).unwrap_err().to_string();
        let options = FlightOptions::defaults();
        assert_eq!(text(&options), "the input `features` needs the lens of its camera: the option `fx`");
        let options = FlightOptions { fx: 400.0, fy: 400.0, cx: 320.0, width: 640.0, height: 480.0, ..options };
        assert_eq!(text(&options), "the input `features` needs the lens of its camera: the option `cy`");
        let options = FlightOptions { strategy: "eskf".to_owned(), cy: 240.0, ..options };
        assert_eq!(text(&options), "the input `features` needs `strategy = \"smoother\"`, not `eskf`");
        let options = FlightOptions { strategy: "smoother".to_owned(), k1: -0.1, ..options };
        let camera = options.config(Some(Isometry3::translation(0.1, 0.0, 0.0))).unwrap().camera.unwrap();
        assert_eq!((camera.position.x, camera.distortion[0], camera.size.y), (0.1, -0.1, 480.0));
        assert_eq!(options.config(None).unwrap().camera, None);
    }

    #[test]
    fn options_reach_the_estimator() {
        let options =
            FlightOptions { dwell: 4.0, anchor_tolerance: 7.0, fallback_after: 1.5, ..FlightOptions::defaults() };
        let StateEstimatorParams { dwell, anchor_tolerance, fallback_after, .. } =
            options.config(None).unwrap().params;
        assert_eq!([dwell, anchor_tolerance, fallback_after], [4.0, 7.0, 1.5]);
    }
}
