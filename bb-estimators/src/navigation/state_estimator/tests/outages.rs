//! Gaps of the IMU, whole and divided by other inputs, and the fallback to the flight controller's IMU: one event for
//! each time without an estimate, and one for each return.

use super::*;

/// A relative pose that says nothing.
fn vague(vio: &VioOutput) -> Sent {
    Sent::Vio(VioOutput { covariance: Matrix6::identity() * 1e8, ..*vio })
}

/// Checks that a gap is as uncertain if something divides it as it is without.
fn is_as_uncertain(flown: impl Fn(StrategyKind, bool) -> EstimatorOutput) {
    for strategy in StrategyKind::ALL {
        let [whole, divided] = [false, true].map(|is_divided| flown(*strategy, is_divided).covariance);
        for i in 0..6 {
            let ratio = divided[(i, i)] / whole[(i, i)];
            // Undivided, it is one step, in which the tilt does not turn gravity yet.
            assert!((0.8..2.0).contains(&ratio), "{strategy:?}, {i}: {ratio} of {}", whole[(i, i)]);
        }
    }
}

#[test]
fn degraded_a_gap_of_the_imu_is_bridged() {
    for (strategy, flight, mut estimator) in flights(4, 2) {
        let gap_ns = 2 * SECOND..5 * SECOND / 2;
        for sample in flight.samples[1..].iter().filter(|sample| !gap_ns.contains(&sample.time_ns)) {
            let result = estimator.add_imu(sample);
            assert_eq!(result, if sample.time_ns == gap_ns.end { degraded(Reason::Bridged) } else { Ok(()) });
        }
        assert!(estimator.predicted(4 * SECOND).unwrap().covariance[(0, 0)] > 0.1);
        // The camera divides the gap and measures the motion in it. The motion that the IMU missed is still unknown.
        let mut estimator = started(&flight, strategy);
        for sent in &flight.sent(true, false, false) {
            if gap_ns.contains(&sent.time_ns()) && matches!(sent, Sent::Imu(_)) {
                continue;
            }
            ignore(sent.to(&mut estimator));
            if let (Sent::Imu(sample), Some(output)) = (sent, estimator.predicted(sent.time_ns())) {
                let is_before = sample.time_ns < gap_ns.start;
                let is_after = (gap_ns.end..3 * SECOND).contains(&sample.time_ns);
                assert!(if output.degraded { !is_before } else { !is_after }, "{}", sample.time_ns);
            }
        }
        assert!(kinds(estimator.sink(), "degraded").all(|event| event.level() == Level::Warn));
    }
}

/// Frames of the camera that say nothing do not make a gap of the IMU shorter: its noise is no smaller if they divide it.
#[test]
fn a_gap_that_the_camera_divides_is_as_uncertain() {
    let flight = Flight::new(4, 2);
    is_as_uncertain(|strategy, with_frames| {
        let mut estimator = started(&flight, strategy);
        for sent in &flight.sent(true, false, false) {
            let is_missing = (2 * SECOND..5 * SECOND / 2).contains(&sent.time_ns());
            match sent {
                Sent::Imu(_) if is_missing => {}
                // Once the camera is known, the smoother waits for its frames.
                Sent::Vio(vio) if vio.to_ns > 2 * SECOND => {
                    if with_frames {
                        ignore(vague(vio).to(&mut estimator));
                    }
                }
                sent => ignore(sent.to(&mut estimator)),
            }
        }
        estimator.predicted(4 * SECOND).unwrap()
    });
}

/// The gap that a clock set back leaves is one even if frames on the new clock divide it into parts shorter than a sample may be.
#[test]
fn the_gap_of_a_clock_that_is_set_back_is_as_uncertain_if_it_is_divided() {
    let flight = Flight::new(8, 2);
    let (jump_ns, by_ns) = (4 * SECOND, 3600 * SECOND);
    is_as_uncertain(|strategy, with_frames| {
        let mut estimator = started(&flight, strategy);
        let mut frames = 0;
        for sent in flight.sent(true, false, false) {
            if matches!(sent, Sent::Vio(_)) && sent.time_ns() > jump_ns {
                continue;
            }
            let is_bridged = sent.set_back(jump_ns + 1, by_ns).to(&mut estimator) == degraded(Reason::Bridged);
            if !(is_bridged && with_frames) {
                continue;
            }
            // It continues from half a second before the jump.
            let gap_ns = jump_ns - SECOND / 2..jump_ns + SECOND / 2;
            for vio in flight.vio.iter().filter(|vio| gap_ns.contains(&vio.to_ns)) {
                ignore(vague(vio).behind(by_ns).to(&mut estimator));
                frames += 1;
            }
        }
        assert_eq!((estimator.counts().set_back, frames), (1, if with_frames { 10 } else { 0 }));
        estimator.predicted(8 * SECOND - by_ns).unwrap()
    });
}

/// The gap before the first sample is as uncertain if it is divided, for a warm start some time before it.
#[test]
fn the_gap_before_the_first_sample_is_as_uncertain_if_it_is_divided() {
    let flight = Flight::new(4, 2);
    is_as_uncertain(|strategy, with_frames| {
        let mut estimator = estimator(strategy);
        estimator.warm_start(flight.warm_start(0)).unwrap();
        if with_frames {
            flight.vio[..4].iter().for_each(|vio| ignore(vague(vio).to(&mut estimator)));
        }
        flight.samples[99..].iter().for_each(|sample| ignore(estimator.add_imu(sample)));
        estimator.predicted(4 * SECOND).unwrap()
    });
}

/// Names and times, s, of the events of the fallback.
fn fallback(estimator: &Estimator) -> Vec<(&'static str, f64)> {
    let is_it = |event: &&Event| event.kind.name().starts_with("fallback");
    let of = |event: &Event| (event.kind.name(), event.time_ns as f64 * 1e-9);
    estimator.sink().iter().filter(is_it).map(of).collect()
}

/// Checks names and times of the events of the fallback.
fn is_told(estimator: &Estimator, expected: &[(&str, f64)], within_s: f64) {
    let told = fallback(estimator);
    let is_it = |(one, other): (&(&str, f64), &(&str, f64))| one.0 == other.0 && (one.1 - other.1).abs() < within_s;
    assert!(told.len() == expected.len() && told.iter().zip(expected).all(is_it), "{told:?}, not {expected:?}");
}

#[test]
fn two_outages_in_a_row_are_two_of_each_event() {
    for (_, flight, mut estimator) in flights(30, 2) {
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
        // Outputs are 0.2 s apart, and predicted for as long.
        is_told(&estimator, &expected, 0.41);
        assert!(!estimator.health().is_fallback_engaged);
    }
}

/// Nothing has started, and nothing may be flown by: the time is that since the first tick.
#[test]
fn before_any_start_the_fallback_engages_once() {
    let flight = Flight::new(20, 2);
    for strategy in StrategyKind::ALL {
        // Ticks alone, without any input.
        let mut unused = estimator(*strategy);
        assert!((0..200).all(|i| unused.tick(i * SECOND / 10).is_none()));
        is_told(&unused, &[("fallback_imminent", 2.0), ("fallback_engaged", 3.0)], 1e-6);
        let mut estimator = estimator(*strategy);
        for sample in &flight.samples {
            ignore(estimator.add_imu(sample));
            if sample.time_ns == 15 * SECOND {
                estimator.warm_start(flight.warm_start(sample.time_ns)).unwrap();
            }
            estimator.tick(sample.time_ns);
            // Ticks count from the first, at 5 ms, in steps of 0.2 s.
            let is_engaged = (3 * SECOND + STEP..=15 * SECOND).contains(&sample.time_ns);
            assert_eq!(estimator.health().is_fallback_engaged, is_engaged, "{strategy:?} at {}", sample.time_ns);
        }
        let expected = [("fallback_imminent", 2.005), ("fallback_engaged", 3.005), ("fallback_recovered", 15.005)];
        is_told(&estimator, &expected, 1e-6);
    }
}
