//! The fallback to the flight controller's IMU: one event for each time without an estimate, and one for each return.

use super::flight::{SECOND, STEP};
use super::*;

/// Names and times, s, of the events of the fallback.
fn fallback(estimator: &Estimator) -> Vec<(&'static str, f64)> {
    let is_it = |event: &&Event| event.kind.name().starts_with("fallback");
    let of = |event: &Event| (event.kind.name(), event.time_ns as f64 * 1e-9);
    estimator.sink().iter().filter(is_it).map(of).collect()
}

#[test]
fn two_outages_in_a_row_are_two_of_each_event() {
    let flight = Flight::new(30, 2);
    for strategy in StrategyKind::ALL {
        let mut estimator = started(&flight, *strategy);
        for sample in &flight.samples[1..] {
            // The IMU is silent twice.
            let is_silent =
                [5, 16].iter().any(|from| (from * SECOND..(from + 7) * SECOND).contains(&sample.time_ns));
            if !is_silent {
                ignore(estimator.add_imu(sample));
            }
            estimator.tick(sample.time_ns);
        }
        // The last estimates are predicted to 5.0 s and 16.0 s. A gap is believed after half a second.
        let expected = [
            ("fallback_imminent", 7.0),
            ("fallback_engaged", 8.0),
            ("fallback_recovered", 12.6),
            ("fallback_imminent", 18.0),
            ("fallback_engaged", 19.0),
            ("fallback_recovered", 23.6),
        ];
        let told = fallback(&estimator);
        assert_eq!(told.len(), expected.len(), "{}: {told:?}", strategy.name());
        for ((name, time_s), (expected, expected_s)) in told.iter().zip(expected) {
            // Outputs are 0.2 s apart, and predicted for as long.
            assert!(*name == expected && (time_s - expected_s).abs() < 0.41, "{}: {told:?}", strategy.name());
        }
        assert!(!estimator.health().is_fallback_engaged);
    }
}

/// Nothing has started, and nothing may be flown by: the time is that since the first tick.
#[test]
fn before_any_start_the_fallback_engages_once() {
    let flight = Flight::new(20, 2);
    for strategy in StrategyKind::ALL {
        let mut estimator = estimator(*strategy);
        for sample in &flight.samples {
            ignore(estimator.add_imu(sample));
            if sample.time_ns == 15 * SECOND {
                estimator.warm_start(flight.warm_start(sample.time_ns)).unwrap();
            }
            estimator.tick(sample.time_ns);
            // Ticks count from the first, at 5 ms, in steps of 0.2 s.
            let is_engaged = (3 * SECOND + STEP..=15 * SECOND).contains(&sample.time_ns);
            assert_eq!(
                estimator.health().is_fallback_engaged,
                is_engaged,
                "{} at {}",
                strategy.name(),
                sample.time_ns
            );
        }
        let expected = [("fallback_imminent", 2.005), ("fallback_engaged", 3.005), ("fallback_recovered", 15.005)];
        let told = fallback(&estimator);
        let is_it = |(one, other): (&(&str, f64), &(&str, f64))| one.0 == other.0 && (one.1 - other.1).abs() < 1e-6;
        assert!(told.len() == 3 && told.iter().zip(&expected).all(is_it), "{}: {told:?}", strategy.name());
    }
}

/// Without the IMU and without anything else: ticks alone.
#[test]
fn without_any_input_the_fallback_engages_once() {
    for strategy in StrategyKind::ALL {
        let mut estimator = estimator(*strategy);
        assert!((0..200).all(|i| estimator.tick(i * SECOND / 10).is_none()));
        assert_eq!(fallback(&estimator), [("fallback_imminent", 2.0), ("fallback_engaged", 3.0)]);
    }
}
