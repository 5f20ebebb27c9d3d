//! Relative poses that do not fit: one alone, several in a row, and a camera that is wrong for seconds.

use super::*;

/// Flies with a camera and anchors. Moves each relative pose by what is given for the number of its frame, m: these
/// are refused.
fn flown(
    strategy: StrategyKind,
    off: impl Fn(i64) -> Option<Vector3<f64>>,
) -> (Flight, Estimator, Vec<EstimatorOutput>) {
    let flight = Flight::new(40, 2);
    let mut estimator = started(&flight, strategy);
    let of = |sent: &Sent| match sent {
        Sent::Vio(vio) => off(vio.to_ns / FRAME),
        _ => None,
    };
    let flown = fly(&mut estimator, &flight.sent(true, true, false), |sent| match (sent, of(sent)) {
        (Sent::Vio(vio), Some(off)) => Some(Sent::Vio(VioOutput { translation: vio.translation + off, ..*vio })),
        _ => Some(*sent),
    });
    for Flown { sent, result, .. } in flown.iter().filter(|flown| of(&flown.sent).is_some()) {
        assert!(is_gated(result), "{strategy:?}: {sent:?}, {result:?}");
    }
    (flight, estimator, flown.into_iter().filter_map(|flown| flown.output).collect())
}

#[test]
fn one_is_refused_and_several_in_a_row_are_told() {
    // From the third refusal on, for a second.
    for (unfit, outputs_degraded) in [(100..101, 0..=0), (100..104, 5..=7)] {
        for strategy in StrategyKind::ALL {
            let (flight, estimator, outputs) =
                flown(*strategy, |frame| unfit.contains(&frame).then(|| Vector3::new(5.0, 0.0, 0.0)));
            assert_eq!(count(estimator.sink(), "degraded"), unfit.clone().count(), "{strategy:?}");
            let mut degraded = 0;
            for output in &outputs {
                assert!(flight.error(output).0 < 5.0 && output.resets == 0, "{strategy:?}: {output:?}");
                let is_after = (102 * FRAME..=114 * FRAME).contains(&output.time_ns);
                assert!(is_after || !output.degraded, "{strategy:?}, {unfit:?}: {}", output.time_ns);
                degraded += usize::from(output.degraded);
            }
            assert!(outputs_degraded.contains(&degraded), "{strategy:?}, {unfit:?}: {degraded}");
            assert_eq!(estimator.health().state, HealthState::Tracking, "{strategy:?}");
        }
    }
}

/// Three seconds of ways that contradict one another and the IMU.
#[test]
fn a_storm_degrades_and_passes() {
    for strategy in StrategyKind::ALL {
        let (flight, estimator, outputs) = flown(*strategy, |frame| {
            let (sin, cos) = (frame as f64 * 2.4).sin_cos();
            (80..110).contains(&frame).then(|| Vector3::new(8.0 * cos, 8.0 * sin, 3.0))
        });
        for output in &outputs {
            let (error_m, _) = flight.error(output);
            let is_storm = (83 * FRAME..110 * FRAME).contains(&output.time_ns);
            assert!(output.degraded || !is_storm, "{strategy:?}: {output:?}");
            assert!(output.degraded || error_m < 5.0, "{strategy:?}: {error_m} m at {}", output.time_ns);
        }
        assert_eq!((outputs.len(), count(estimator.sink(), "fatal")), (200, 0), "{strategy:?}");
        assert_eq!(estimator.health().state, HealthState::Tracking, "{strategy:?}");
    }
}
