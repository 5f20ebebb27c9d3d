//! The state estimator with the landmarks of a camera in place of its odometry, or beside it, on simulated flights.

use bb_core::nalgebra::{Matrix3, Matrix6, Vector3};
use bb_estimators::navigation::state_estimator::{
    Added, AttitudeReading, EstimatorError, Event, EventKind, Feature, FlightControllerState, FlightNavigator,
    ImageFeatures, InputKind, PoseAnchor, StateEstimatorConfig, StateEstimatorParams, StrategyKind, VioOutput,
};
use bb_estimators::navigation::{EskfParams, Geodetic, ImuMean, LocalFrame, nees};
use bb_eval::DataSet;
use bb_tests::recordings::navigation;
use std::error::Error;

/// Inputs that tell the camera's motion.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Camera {
    Landmarks,
    /// Landmarks and relative poses.
    Both,
}

/// RMS of the position, m, mean NEES of it (3), and numbers of refused anchors and images.
#[derive(Clone, Copy, Debug)]
struct Flown {
    position_m: f64,
    nees: f64,
    refused: [usize; 2],
}

fn nanoseconds(time_s: f64) -> i64 {
    (time_s * 1e9).round() as i64
}

fn diagonal(position: &Matrix3<f64>, rotation: &Matrix3<f64>) -> Matrix6<f64> {
    let mut both = Matrix6::zeros();
    both.fixed_view_mut::<3, 3>(0, 0).copy_from(position);
    both.fixed_view_mut::<3, 3>(3, 3).copy_from(rotation);
    both
}

/// Accepted, or refused with a reason that a flight may have.
fn accepted(result: Result<Added, EstimatorError>) -> Result<(), EstimatorError> {
    match result {
        Err(error) if error.is_fatal() => Err(error),
        _ => Ok(()),
    }
}

fn fly(data: &DataSet, camera: Camera) -> Result<Flown, Box<dyn Error>> {
    let noise = data.noise.ok_or("no noise")?;
    let sensors = EskfParams {
        gyroscope_noise: noise.gyroscope,
        accelerometer_noise: noise.accelerometer,
        gyroscope_bias_walk: noise.gyroscope_bias,
        accelerometer_bias_walk: noise.accelerometer_bias,
        gravity: noise.gravity,
        ..EskfParams::default()
    };
    let start = &data.start;
    let params = StateEstimatorParams {
        warm_inflation: 1.0,
        accelerometer_bias: start.accelerometer_bias_deviation,
        gyroscope_bias: start.gyroscope_bias_deviation,
        window: 20,
        ..StateEstimatorParams::default()
    };
    let strategy = StrategyKind::FixedLagSmoother;
    let config = StateEstimatorConfig { strategy, params, sensors, camera: data.camera, ..Default::default() };
    let (mut anchors, mut images) = (0, 0);
    let sink = |event: &Event| match event.kind {
        EventKind::Degraded { input: InputKind::Anchor, .. } => anchors += 1,
        EventKind::Degraded { input: InputKind::Features, .. } => images += 1,
        _ => {}
    };
    let mut estimator: FlightNavigator<_> = FlightNavigator::new(config, sink)?;
    let frame = LocalFrame::new(Geodetic::from_degrees(48.0, 11.0, 500.0));
    let here = |position: &Vector3<f64>| {
        let on_earth = frame.geodetic(position);
        (on_earth, frame.other_from_self(&LocalFrame::new(on_earth)).rotation)
    };
    let time = |k: u64| nanoseconds(data.keyframes[k as usize].time_s);
    let (position, turn) = here(&start.position);
    estimator.warm_start(FlightControllerState {
        attitude: AttitudeReading {
            time_ns: start.time_ns,
            world_from_body: turn * start.world_from_body,
            tilt_deviation: start.rotation_covariance[(0, 0)].sqrt(),
            heading_deviation: start.rotation_covariance[(2, 2)].sqrt(),
        },
        position,
        position_covariance: start.position_covariance,
        velocity: turn * start.velocity,
        velocity_covariance: start.velocity_covariance,
    })?;
    let (mut sum, mut nees_sum, mut count) = (0.0, 0.0, 0.0);
    let mut samples = data.samples.iter();
    let (mut sample, mut now_s) = (0, data.keyframes[0].time_s);
    for (k, keyframe) in (0_u64..).zip(&data.keyframes) {
        while sample < keyframe.sample {
            let next = samples.next().ok_or("no sample")?;
            now_s += next.dt;
            sample += 1;
            let time_ns = nanoseconds(now_s);
            let (angular_velocity, specific_force) = (next.angular_velocity, next.specific_force);
            let _ = estimator.add_imu(&ImuMean { time_ns, angular_velocity, specific_force });
        }
        let time_ns = time(k);
        if let Some(vio) = data.relative.get(&k).filter(|_| camera != Camera::Landmarks) {
            accepted(estimator.add_vio(VioOutput {
                from_ns: time(vio.keyframe),
                to_ns: time_ns,
                translation: vio.translation,
                from_to: vio.keyframe_from_body,
                covariance: diagonal(&vio.translation_covariance, &vio.rotation_covariance),
                bias: None,
            }))?;
        }
        if let Some(anchor) = data.anchors.get(&k) {
            let (position, turn) = here(&anchor.position);
            accepted(estimator.add_pose_anchor(PoseAnchor {
                time_ns,
                provider: 0,
                position,
                world_from_body: turn * anchor.world_from_body,
                covariance: diagonal(&anchor.position_covariance, &anchor.rotation_covariance),
                is_covariance_degraded: false,
            }))?;
        }
        if let Some(seen) = data.seen.get(&k) {
            let feature = |seen: &bb_estimators::navigation::Observation| Feature {
                landmark: seen.landmark,
                pixel: seen.pixel,
                deviation_px: seen.deviation_px,
            };
            accepted(
                estimator.add_features(ImageFeatures { time_ns, features: seen.iter().map(feature).collect() }),
            )?;
        }
        let Some(truth) = keyframe.truth.filter(|_| keyframe.scored && k > 0) else { continue };
        let Some(now) = estimator.predicted(time_ns) else { continue };
        let off = frame.position(&now.position) - truth.position;
        let covariance = now.covariance.fixed_view::<3, 3>(0, 0).into_owned();
        sum += off.norm_squared();
        nees_sum += nees(&off, &covariance).ok_or("no covariance")?;
        count += 1.0;
    }
    drop(estimator);
    Ok(Flown { position_m: (sum / count).sqrt(), nees: nees_sum / count, refused: [anchors, images] })
}

/// Flight, camera, the position that was measured, m, and the NEES that is accepted.
const KNOWN: [(&str, Camera, f64, std::ops::Range<f64>); 4] = [
    ("simflight", Camera::Landmarks, 0.964, 1.5..4.0),
    ("simflight", Camera::Both, 0.833, 1.5..4.0),
    ("simflight_stress", Camera::Landmarks, 0.939, 1.5..4.0),
    ("simflight_stress", Camera::Both, 1.045, 1.5..4.0),
];

#[test]
fn errors_are_no_greater_than_known() -> Result<(), Box<dyn Error>> {
    let folder = navigation()?;
    for (name, camera, known, range) in KNOWN {
        let Flown { position_m, nees, refused } = fly(&DataSet::read(&folder.join(name))?, camera)?;
        println!("{name}, {camera:?}: {position_m:.3} m, NEES {nees:.2}, {refused:?} refused");
        assert!(position_m <= 1.02 * known, "{name}, {camera:?}: {position_m} m was {known}");
        assert!(range.contains(&nees), "{name}, {camera:?}: NEES {nees}");
        // The anchors of the flight with faults have outliers.
        let expected = if name == "simflight" { [0, 0] } else { [6, 0] };
        assert_eq!(refused, expected, "{name}, {camera:?}");
    }
    Ok(())
}
