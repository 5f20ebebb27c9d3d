//! Settings other than the defaults are obeyed.

use super::flight::{FRAME, SECOND, STEP};
use super::*;

/// Flies with these settings, with the camera and the anchors up to a time. Returns the outputs of 200 ticks a second.
fn flown(
    strategy: StrategyKind,
    seen_until_ns: [i64; 2],
    set: impl Fn(&mut StateEstimatorParams),
) -> (Estimator, Vec<EstimatorOutput>) {
    let flight = Flight::new(12, 3);
    let mut config = config(strategy);
    set(&mut config.params);
    let mut estimator: Estimator = FlightNavigator::new(config, Events::new()).unwrap();
    estimator.warm_start(flight.warm_start(0)).unwrap();
    estimator.add_imu(&flight.samples[0]).unwrap();
    let mut outputs = Vec::new();
    for sent in &flight.sent(true, true, false) {
        match sent {
            Sent::Vio(vio) if vio.to_ns > seen_until_ns[0] => continue,
            Sent::Anchor(anchor) if anchor.time_ns > seen_until_ns[1] => continue,
            sent => sent.to(&mut estimator).unwrap(),
        }
        outputs.extend(estimator.tick(sent.time_ns()));
    }
    (estimator, outputs)
}

/// Times of the changes to a label.
fn changes_to(estimator: &Estimator, label: SourceLabel) -> Vec<i64> {
    let is_it = |event: &&Event| matches!(event.kind, EventKind::Label { to, .. } if to == label);
    kinds(estimator.sink(), "label").filter(is_it).map(|event| event.time_ns).collect()
}

#[test]
fn the_rate_of_the_output() {
    for strategy in StrategyKind::ALL {
        for (output_rate, apart_ns) in [(1.0, SECOND), (2.5, 2 * SECOND / 5), (20.0, SECOND / 20), (200.0, STEP)] {
            let (_, outputs) = flown(*strategy, [i64::MAX; 2], |params| params.output_rate = output_rate);
            assert!(
                outputs.windows(2).all(|two| two[1].emitted_ns - two[0].emitted_ns == apart_ns),
                "{output_rate}"
            );
            let first_ns = outputs[0].emitted_ns;
            assert_eq!(outputs.len() as i64, (12 * SECOND - first_ns) / apart_ns + 1, "{output_rate} Hz");
        }
    }
}

#[test]
fn the_size_of_the_window() {
    for strategy in StrategyKind::ALL {
        for window in [2, 6, 40] {
            let (mut estimator, _) = flown(*strategy, [i64::MAX; 2], |params| params.window = window);
            let held = estimator.health().keyframes as i64;
            // The smoother's window restarts when another copy of the filter becomes the best, here last at 10.3 s.
            let expected = if strategy.is_smoothing() { window.min(18) } else { window };
            assert_eq!(held, i64::from(expected), "{}", strategy.name());
            let times: Vec<i64> = estimator.smoothed_history(1000).iter().map(|past| past.time_ns).collect();
            let expected: Vec<i64> = (1..held).map(|i| 12 * SECOND - i * FRAME).collect();
            assert_eq!(times, expected, "{}", strategy.name());
            // Those before went to the recorder.
            let left: Vec<i64> = kinds(estimator.sink(), "keyframe").map(|event| event.time_ns).collect();
            assert_eq!(left, (0..=120 - held).map(|i| i * FRAME).collect::<Vec<_>>());
        }
    }
}

#[test]
fn the_age_of_an_anchor() {
    for strategy in StrategyKind::ALL {
        for (anchor_age, age_ns) in [(0.7, 7 * FRAME), (1.5, 15 * FRAME), (6.0, 60 * FRAME)] {
            // The last anchor is at 4.015 s.
            let (estimator, outputs) =
                flown(*strategy, [i64::MAX, 5 * SECOND], |params| params.anchor_age = anchor_age);
            let last_ns = 4 * SECOND + 3 * STEP;
            let demoted = changes_to(&estimator, SourceLabel::VisualPropagated);
            assert_eq!(demoted.last(), Some(&(last_ns + age_ns + STEP)), "{}, {anchor_age} s", strategy.name());
            for output in outputs.iter().filter(|output| output.anchor_age_ms.is_some()) {
                let is_anchored = output.anchor_age_ms.is_some_and(|age_ms| age_ms as i64 * 1_000_000 <= age_ns);
                assert_eq!(
                    output.label == SourceLabel::SatelliteAnchored,
                    is_anchored,
                    "{anchor_age} s: {output:?}"
                );
            }
        }
    }
}

#[test]
fn the_time_after_which_the_camera_is_lost() {
    for strategy in StrategyKind::ALL {
        for (visual_loss, loss_ns) in [(0.3, 3 * FRAME), (2.5, 25 * FRAME)] {
            let (estimator, outputs) =
                flown(*strategy, [5 * SECOND, 5 * SECOND], |params| params.visual_loss = visual_loss);
            // The last frame is at 5.0 s, and the label as of a sample.
            let lost_ns = 5 * SECOND + loss_ns + STEP;
            assert_eq!(changes_to(&estimator, SourceLabel::DeadReckoned), [lost_ns], "{visual_loss} s");
            for output in outputs.iter().filter(|output| output.time_ns > 2 * SECOND) {
                assert_eq!(output.label == SourceLabel::DeadReckoned, output.time_ns >= lost_ns, "{output:?}");
            }
        }
    }
}

/// A provider that is too hot says that its covariance is a cheaper one. It is used as it is, to the last bit, and nothing else
/// changes.
#[test]
fn a_degraded_covariance_is_used_as_given() {
    let flight = Flight::new(6, 1);
    for strategy in StrategyKind::ALL {
        let flown = |factor: f64, is_covariance_degraded: bool| {
            let mut estimator = started(&flight, *strategy);
            let mut outputs = Vec::new();
            for sent in &flight.sent(true, true, false) {
                match sent {
                    Sent::Anchor(anchor) => {
                        let covariance = anchor.covariance * factor;
                        let anchor = PoseAnchor { covariance, is_covariance_degraded, ..*anchor };
                        estimator.add_pose_anchor(anchor).unwrap();
                    }
                    sent => sent.to(&mut estimator).unwrap(),
                }
                outputs.extend(estimator.tick(sent.time_ns()));
            }
            outputs
        };
        let (usual, degraded, given) = (flown(1.0, false), flown(9.0, true), flown(9.0, false));
        let unmarked: Vec<_> = degraded
            .iter()
            .map(|output| {
                let quality = Quality { is_anchor_degraded: false, ..output.quality };
                EstimatorOutput { quality, ..*output }
            })
            .collect();
        assert_eq!(unmarked, given, "{}", strategy.name());
        assert!(degraded.iter().any(|output| output.quality.is_anchor_degraded));
        // Three times the deviation is in the covariance of the estimate, which the camera hardly improves.
        let [usual, degraded] =
            [usual, degraded].map(|outputs| outputs[outputs.len() - 1].covariance[(0, 0)].sqrt());
        assert!(degraded > 1.5 * usual, "{}: {degraded} m, {usual} m", strategy.name());
    }
}
