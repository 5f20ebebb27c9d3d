//! Cameras with a frame period longer than the keyframe interval without a camera.

use super::flight::{FRAME, SECOND, STEP};
use super::*;
use nalgebra::Isometry3;

/// The camera with every n-th frame only, as if the others had not been captured.
fn every(flight: &Flight, n: usize) -> impl Iterator<Item = VioOutput> {
    flight.vio.chunks_exact(n).map(move |parts| {
        let way = parts.iter().fold(Isometry3::identity(), |way, part| {
            way * Isometry3::from_parts(part.translation.into(), part.from_to)
        });
        VioOutput {
            from_ns: parts[0].from_ns,
            to_ns: parts[n - 1].to_ns,
            translation: way.translation.vector,
            from_to: way.rotation,
            // Orientation errors displace the next pose, by 15 m/s times the time since then.
            covariance: parts[0].covariance * (2 * n) as f64,
            bias: None,
        }
    })
}

#[test]
fn a_slow_camera_is_waited_for() {
    let flight = Flight::new(30, 3);
    for strategy in StrategyKind::ALL {
        for (n, keyframe_interval) in [(1, 0.05), (5, 0.2), (5, 1.0), (10, 0.8), (10, 1.0), (12, 1.0)] {
            let mut config = config(*strategy);
            config.params.keyframe_interval = keyframe_interval;
            config.params.visual_loss = 3.0;
            let mut estimator: Estimator = FlightNavigator::new(config, Events::new()).unwrap();
            estimator.warm_start(flight.warm_start(0)).unwrap();
            estimator.add_imu(&flight.samples[0]).unwrap();
            let mut camera = every(&flight, n).peekable();
            let mut refused = 0;
            for sent in &flight.sent(false, true, false) {
                ignore(sent.to(&mut estimator));
                if let Some(vio) = camera.next_if(|vio| vio.to_ns <= sent.time_ns()) {
                    refused += usize::from(estimator.add_vio(vio).is_err());
                }
            }
            // The frame period is known from the second frame on.
            assert!(refused <= 1, "{}, {n}, {keyframe_interval} s: {refused}", strategy.name());
            assert_eq!(estimator.counts().dropped, 0);
            assert!(flight.error(&estimator.predicted(30 * SECOND).unwrap()).0 < 3.0, "{}", strategy.name());
        }
    }
}

/// A keyframe does not wait for a camera that has stopped.
#[test]
fn without_the_camera_keyframes_come_at_their_interval() {
    let flight = Flight::new(12, 3);
    for strategy in StrategyKind::ALL {
        let mut estimator = started(&flight, *strategy);
        let mut camera = every(&flight, 10).take_while(|vio| vio.to_ns <= 4 * SECOND).peekable();
        for sent in &flight.sent(false, false, false) {
            ignore(sent.to(&mut estimator));
            if let Some(vio) = camera.next_if(|vio| vio.to_ns <= sent.time_ns()) {
                ignore(estimator.add_vio(vio));
            }
        }
        let mut times: Vec<i64> = estimator.smoothed_history(20).iter().map(|past| past.time_ns).collect();
        times.reverse();
        let late: Vec<i64> =
            times.windows(2).filter(|two| two[0] > 4 * SECOND).map(|two| two[1] - two[0]).collect();
        assert!(late.len() >= 4 && late.iter().all(|apart| *apart == SECOND), "{}: {late:?}", strategy.name());
        // One and a half frame periods after the last frame, plus one sample.
        let first = times.iter().find(|time_ns| **time_ns > 4 * SECOND).unwrap() - 4 * SECOND;
        assert!((first - 15 * FRAME - STEP).abs() <= STEP, "{}: {first}", strategy.name());
    }
}
