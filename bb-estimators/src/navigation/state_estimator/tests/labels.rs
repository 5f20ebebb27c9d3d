//! The requirements of the source label.

use super::*;

/// Labels with their times, s, of a flight with camera, anchors and fixes only at some times.
fn timeline(
    strategy: StrategyKind,
    sees: impl Fn(i64) -> bool,
    anchors: impl Fn(i64) -> bool,
    fixes: impl Fn(i64) -> bool,
) -> (Vec<(i64, SourceLabel)>, Vec<EstimatorOutput>) {
    let flight = Flight::new(40, 3);
    let mut estimator = started(&flight, strategy);
    let flown = fly(&mut estimator, &flight.sent(true, true, true), |sent| {
        let second = sent.time_ns() / SECOND;
        let is_sent = match sent {
            Sent::Vio(_) => sees(second),
            Sent::Anchor(_) => anchors(second),
            Sent::Fix(_) => fixes(second),
            _ => true,
        };
        is_sent.then_some(*sent)
    });
    let labels = kinds(estimator.sink(), "label").map(|event| match event.kind {
        EventKind::Label { to, .. } => (event.time_ns / SECOND, to),
        _ => unreachable!(),
    });
    (labels.collect(), flown.into_iter().filter_map(|flown| flown.output).collect())
}

/// A trusted receiver bounds the position as anchors do, but the age is that of anchors alone.
#[test]
fn fixes_keep_the_label_and_not_the_age_of_the_anchor() {
    for strategy in StrategyKind::ALL {
        let (labels, outputs) = timeline(*strategy, |_| true, |second| second < 5, |second| second >= 6);
        assert_eq!(labels, [(1, SourceLabel::SatelliteAnchored)]);
        let last_ns = 4 * SECOND + 3 * STEP;
        for output in outputs.iter().filter(|output| output.time_ns >= 5 * SECOND) {
            let age_ns = output.anchor_age_ms.map(|age_ms| age_ms as i64 * 1_000_000);
            assert_eq!(age_ns, Some(output.time_ns - last_ns), "{output:?}");
        }
        let (labels, outputs) = timeline(*strategy, |_| true, |_| false, |_| true);
        assert_eq!(labels, [(0, SourceLabel::SatelliteAnchored)]);
        assert!(outputs.iter().all(|output| output.anchor_age_ms.is_none()));
    }
}

/// The camera returns at 20 s and improves the velocity. Only the anchor determines the position.
#[test]
fn visual_loss_demotes_to_dead_reckoning_that_grows_until_the_next_anchor() {
    use SourceLabel::{DeadReckoned, SatelliteAnchored};
    let flight = Flight::new(1, 3);
    for strategy in StrategyKind::ALL {
        let (labels, outputs) = timeline(
            *strategy,
            |second| !(10..20).contains(&second),
            |second| !(10..25).contains(&second),
            |_| false,
        );
        assert_eq!(labels, [(1, SatelliteAnchored), (10, DeadReckoned), (25, SatelliteAnchored)]);
        let lost: Vec<_> =
            outputs.iter().filter(|output| output.label == DeadReckoned && output.time_ns > SECOND * 5).collect();
        assert!(lost.len() > 65, "{}", lost.len());
        let trace = |output: &EstimatorOutput, first: usize| {
            (first..first + 3).map(|i| output.covariance[(i, i)]).sum::<f64>()
        };
        for two in lost.windows(2) {
            assert!(two[1].quality.covariance_norm >= two[0].quality.covariance_norm);
            for first in [0, 3] {
                assert!(trace(two[1], first) >= trace(two[0], first));
            }
            let decomposed = nalgebra::linalg::Cholesky::new(two[1].covariance);
            assert!(decomposed.is_some(), "it is still a covariance");
        }
        let [first, last] = [lost[0], lost[lost.len() - 1]].map(|output| output.quality.covariance_norm);
        assert!(last > 20.0 * first, "{first} to {last}");
        for output in lost {
            let (error_m, deviation_m) = (flight.error(output).0, trace(output, 0).sqrt());
            assert!(error_m < 4.0 * deviation_m, "{error_m} m, deviation {deviation_m} m");
        }
    }
}

#[test]
fn growth_of_the_covariance_is_in_the_health_and_warned_of_once() {
    for (_, flight, mut estimator) in flights(30, 3) {
        for sent in &flight.sent(true, true, false) {
            if sent.time_ns() < 15 * SECOND || matches!(sent, Sent::Imu(_)) {
                sent.to(&mut estimator).unwrap();
            }
            estimator.tick(sent.time_ns());
        }
        assert!(estimator.health().covariance_growing_s > 10.0);
        let warnings: Vec<_> =
            kinds(estimator.sink(), "covariance_growing").filter(|event| event.time_ns > 15 * SECOND).collect();
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        assert_eq!(warnings[0].level(), Level::Warn);
    }
}

/// A warm start after the estimate was lost is as uncertain as the flight controller says, and not as what was lost.
#[test]
fn a_warm_start_begins_the_covariance_anew() {
    for (strategy, flight, mut estimator) in flights(22, 4) {
        let (mut before, mut after) = (0.0_f64, None);
        for sample in &flight.samples[1..] {
            // After 20 s of dead reckoning, the clock jumps by more than a gap may last.
            let time_ns = sample.time_ns + if sample.time_ns > 20 * SECOND { 100 * SECOND } else { 0 };
            ignore(estimator.add_imu(&ImuMean { time_ns, ..*sample }));
            if sample.time_ns == 21 * SECOND {
                assert_eq!(estimator.health().state, HealthState::Lost);
                let mut state = flight.warm_start(sample.time_ns);
                state.attitude.time_ns = time_ns;
                estimator.warm_start(state).unwrap();
            }
            let Some(output) = estimator.tick(time_ns) else { continue };
            assert_eq!(output.label, SourceLabel::DeadReckoned);
            let own = estimator.predicted(time_ns).unwrap().covariance.norm();
            match sample.time_ns > 20 * SECOND {
                false => before = output.covariance.norm(),
                true => {
                    assert!(output.covariance.norm() < 1.001 * own, "{strategy:?}: {output:?}, not {own}");
                    after.get_or_insert(own);
                }
            }
        }
        assert!(after.unwrap() < 0.1 * before, "{after:?} {before}");
    }
}
