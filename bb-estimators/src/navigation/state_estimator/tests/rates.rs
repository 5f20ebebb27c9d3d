//! Rates of the IMU: those that fit, and more than was configured.

use super::flight::SECOND;
use super::*;
use crate::navigation::{ImuMean, Refusal};

/// A fast IMU and a long lateness fit: with valid settings, nothing is dropped and the stated capacity is not exceeded.
#[test]
fn a_fast_imu_and_a_long_lateness_fit() {
    let flight = Flight::new(4, 3);
    for strategy in StrategyKind::ALL {
        let mut config = config(*strategy);
        config.params.imu_rate = 4000.0;
        config.params.lateness = 3.0;
        config.params.keyframe_interval = 2.0;
        let mut estimator: Estimator = FlightNavigator::new(config, Events::new()).unwrap();
        // Before the start as well: the position is unknown for twenty seconds.
        let fast = |i: i64, from: &ImuMean| ImuMean { time_ns: i * SECOND / 4000, ..*from };
        let most = config.params.room()[0];
        let mut held = 0;
        for i in 1..=20 * 4000 {
            estimator.add_imu(&fast(i, &flight.samples[0])).unwrap();
            held = held.max(estimator.held()[0]);
            estimator.sink_mut().clear();
        }
        estimator.add_pose_anchor(PoseAnchor { time_ns: 20 * SECOND, ..flight.anchors[0] }).unwrap();
        for i in 20 * 4000 + 1..=32 * 4000 {
            estimator.add_imu(&fast(i, &flight.samples[0])).unwrap();
            held = held.max(estimator.held()[0]);
        }
        assert!(held <= most && held > 3 * 4000, "{held} of {most}");
        assert_eq!((estimator.counts().dropped, estimator.counts().overflows), (0, 0));
        assert_eq!(count(estimator.sink(), "samples_dropped"), 0);
        assert!(estimator.predicted(32 * SECOND).is_some());
    }
}

/// More than the configured rate: the oldest samples are dropped, which is counted and reported, and the estimate continues.
#[test]
fn an_imu_that_is_too_fast_drops_the_oldest_and_says_so() {
    let flight = Flight::new(12, 3);
    for strategy in StrategyKind::ALL {
        for (imu_rate, keyframe_interval) in [(50.0, 1.0), (1.0, 10.0)] {
            let mut config = config(*strategy);
            (config.params.imu_rate, config.params.keyframe_interval) = (imu_rate, keyframe_interval);
            let mut estimator: Estimator = FlightNavigator::new(config, Events::new()).unwrap();
            estimator.warm_start(flight.warm_start(0)).unwrap();
            for sent in &flight.sent(true, true, false) {
                ignore(sent.to(&mut estimator));
                assert!(estimator.held()[0] <= config.params.room()[0]);
                if let Some(output) = estimator.tick(sent.time_ns()) {
                    assert!(flight.error(&output).0 < 5.0, "{}", strategy.name());
                }
            }
            let dropped = estimator.counts().dropped;
            let told = kinds(estimator.sink(), "samples_dropped").map(|event| match event.kind {
                EventKind::SamplesDropped { count } => count,
                _ => 0,
            });
            assert!(dropped > 0, "{}: {dropped}", strategy.name());
            assert_eq!(told.sum::<u64>(), dropped);
            assert!(count(estimator.sink(), "samples_dropped") < 1000, "not one event a sample");
            // Inputs that can no longer be placed are refused.
            let late = estimator.add_pose_anchor(PoseAnchor { provider: 3, ..flight.anchors[9] });
            let too_old = Refusal::TooOld { time_ns: flight.anchors[9].time_ns };
            assert_eq!(late, Err(EstimatorError::Degraded(Reason::Refused(too_old))), "{}", strategy.name());
        }
    }
}
