//! Relative poses that do not fit: one alone, several in a row, and a camera that is wrong for seconds.

use super::flight::FRAME;
use super::*;
use crate::navigation::Refusal;
use nalgebra::Vector3;

/// Flies with a camera and anchors. Moves each relative pose by what is given for the number of its frame, m. Returns the results of
/// those that were moved, and the outputs.
fn flown(
    strategy: StrategyKind,
    off: impl Fn(i64) -> Option<Vector3<f64>>,
) -> (Flight, Estimator, Vec<Reason>, Vec<EstimatorOutput>) {
    let flight = Flight::new(40, 2);
    let mut estimator = started(&flight, strategy);
    let (mut reasons, mut outputs) = (Vec::new(), Vec::new());
    for sent in &flight.sent(true, true, false) {
        match sent {
            Sent::Vio(vio) => match off(vio.to_ns / FRAME) {
                Some(off) => {
                    let translation = vio.translation + off;
                    let error = estimator.add_vio(VioOutput { translation, ..*vio }).unwrap_err();
                    assert!(!error.is_fatal(), "{error}");
                    reasons.push(error.reason());
                }
                None => ignore(estimator.add_vio(*vio)),
            },
            sent => ignore(sent.to(&mut estimator)),
        }
        outputs.extend(estimator.tick(sent.time_ns()));
    }
    (flight, estimator, reasons, outputs)
}

fn is_gated(reason: &Reason) -> bool {
    matches!(reason, Reason::Refused(Refusal::Gate { nis, limit }) if nis > limit)
}

#[test]
fn one_that_does_not_fit_is_refused_and_moves_nothing() {
    for strategy in StrategyKind::ALL {
        let (flight, estimator, reasons, outputs) =
            flown(*strategy, |frame| (frame == 100).then(|| Vector3::new(5.0, 0.0, 0.0)));
        assert!(reasons.len() == 1 && is_gated(&reasons[0]), "{reasons:?}");
        assert_eq!(count(estimator.sink(), "degraded"), 1, "{}", strategy.name());
        for output in &outputs {
            assert!(!output.degraded && flight.error(output).0 < 5.0, "{}: {output:?}", strategy.name());
        }
        assert_eq!(outputs.last().map(|output| output.resets), Some(0));
    }
}

#[test]
fn several_in_a_row_are_refused_and_told() {
    for strategy in StrategyKind::ALL {
        let (flight, estimator, reasons, outputs) =
            flown(*strategy, |frame| (100..104).contains(&frame).then(|| Vector3::new(5.0, 0.0, 0.0)));
        let name = strategy.name();
        assert!(reasons.len() == 4 && reasons.iter().all(is_gated), "{name}: {reasons:?}");
        // From the third refusal on, for a second.
        let degraded: Vec<i64> =
            outputs.iter().filter(|output| output.degraded).map(|output| output.time_ns).collect();
        assert!((5..=7).contains(&degraded.len()), "{name}: {degraded:?}");
        assert!(
            degraded.iter().all(|time_ns| (102 * FRAME..=114 * FRAME).contains(time_ns)),
            "{name}: {degraded:?}"
        );
        for output in &outputs {
            assert!(flight.error(output).0 < 5.0 && output.resets == 0, "{name}: {output:?}");
        }
        assert_eq!(estimator.health().state, HealthState::Tracking, "{name}");
    }
}

/// Three seconds of ways that contradict one another and the IMU.
#[test]
fn a_storm_degrades_and_passes() {
    for strategy in StrategyKind::ALL {
        let (flight, estimator, reasons, outputs) = flown(*strategy, |frame| {
            let (sin, cos) = (frame as f64 * 2.4).sin_cos();
            (80..110).contains(&frame).then(|| Vector3::new(8.0 * cos, 8.0 * sin, 3.0))
        });
        let name = strategy.name();
        assert_eq!(reasons.len(), 30, "{name}");
        assert!(reasons.iter().all(is_gated), "{name}: {reasons:?}");
        for output in &outputs {
            let (error_m, _) = flight.error(output);
            let is_storm = (83 * FRAME..110 * FRAME).contains(&output.time_ns);
            assert!(output.degraded || !is_storm, "{name}: {output:?}");
            assert!(output.degraded || error_m < 5.0, "{name}: {error_m} m at {}", output.time_ns);
        }
        assert_eq!((outputs.len(), count(estimator.sink(), "fatal")), (200, 0), "{name}");
        assert_eq!(estimator.health().state, HealthState::Tracking, "{name}");
    }
}
