//! Clocks that are set back or jump, and stay so.

use super::flight::{SECOND, STEP};
use super::*;
use crate::navigation::ImuMean;
use bb_tests::laws;
use proptest::prelude::*;

#[test]
fn a_clock_that_is_set_back_is_followed_and_told() {
    let flight = Flight::new(24, 3);
    for strategy in StrategyKind::ALL {
        for by_ns in [5 * SECOND, 10_000 * SECOND] {
            let mut estimator = started(&flight, *strategy);
            let (mut first_ns, mut confirmed_ns) = (None, None);
            for sent in &flight.sent(true, true, false) {
                let time_ns = sent.time_ns();
                let set_back_ns = if time_ns > 12 * SECOND { by_ns } else { 0 };
                ignore(sent.behind(set_back_ns).to(&mut estimator));
                let Some(output) = estimator.tick(time_ns - set_back_ns) else { continue };
                if set_back_ns == 0 {
                    continue;
                }
                first_ns.get_or_insert(time_ns);
                let on_the_old_clock = EstimatorOutput { time_ns: output.time_ns + by_ns, ..output };
                let (error_m, _) = flight.error(&on_the_old_clock);
                assert!(output.degraded || error_m < 5.0, "{}: {error_m} m", strategy.name());
                assert!(error_m < 40.0, "{}: {error_m} m at {time_ns}", strategy.name());
                if !output.degraded {
                    confirmed_ns.get_or_insert(time_ns);
                }
            }
            let (first_ns, confirmed_ns) = (first_ns.unwrap(), confirmed_ns.unwrap());
            assert!((12 * SECOND..13 * SECOND).contains(&first_ns), "an estimate again after {first_ns}");
            assert!((16 * SECOND..22 * SECOND).contains(&confirmed_ns), "trusted after {confirmed_ns}");
            let told: Vec<_> = kinds(estimator.sink(), "clock_set_back").collect();
            let EventKind::ClockSetBack { seconds } = told[0].kind else { unreachable!() };
            // Believing it takes half a second.
            assert!((seconds - by_ns as f64 * 1e-9 + 0.5).abs() < 0.02, "{seconds}");
            assert_eq!((told.len(), told[0].level(), estimator.counts().set_back), (1, Level::Warn, 1));
            assert!(told[0].status_text().unwrap().as_str().starts_with("NAV IMU clock set back"));
            assert_eq!(count(estimator.sink(), "fallback_engaged"), 0);
        }
    }
}

/// An old estimate is not given for the time of a new clock: until that is believed, there is none for its times.
#[test]
fn an_old_estimate_is_not_given_for_the_time_of_a_new_clock() {
    let flight = Flight::new(4, 3);
    for strategy in StrategyKind::ALL {
        let mut estimator = started(&flight, *strategy);
        flight.samples[1..].iter().for_each(|sample| estimator.add_imu(sample).unwrap());
        let newest_ns = 4 * SECOND;
        for (behind_ns, is_given) in [(0, true), (SECOND / 5, true), (SECOND / 5 + 1, false), (2 * SECOND, false)] {
            let output = estimator.predicted(newest_ns - behind_ns);
            assert_eq!(output.map(|output| output.time_ns), is_given.then_some(newest_ns), "{behind_ns}");
        }
        assert!(estimator.tick(newest_ns - SECOND).is_none());
        assert_eq!(estimator.tick(newest_ns).unwrap().time_ns, newest_ns);
    }
}

/// Nobody knows for how long the IMU was silent before its clock was set back. What the body may have moved by in that time is in the
/// covariance, so the first anchor fits, and no later one is needed to overrule the estimate.
#[test]
fn the_time_that_a_clock_hides_is_in_the_covariance() {
    let jump_ns = 6 * SECOND;
    for (seed, silence_ns) in [(1, 1_900_000_000), (24, 1_600_000_000), (26, 1_400_000_000), (20, 0)] {
        let flight = Flight::new(20, seed);
        for strategy in StrategyKind::ALL {
            let mut estimator = started(&flight, *strategy);
            let by_ns = 1000 * SECOND;
            let (mut first, mut confirmed_ns) = (None, None);
            for sent in &flight.sent(true, true, false) {
                let time_ns = sent.time_ns();
                if (jump_ns..jump_ns + silence_ns).contains(&time_ns) {
                    continue;
                }
                let behind_ns = if time_ns >= jump_ns { by_ns } else { 0 };
                let result = sent.behind(behind_ns).to(&mut estimator);
                let Some(output) = estimator.predicted(time_ns - behind_ns).filter(|_| time_ns >= jump_ns) else {
                    continue;
                };
                if let Sent::Anchor(_) = sent {
                    assert_eq!(result, Ok(()), "{}, seed {seed}, at {time_ns}", strategy.name());
                }
                let of_then = EstimatorOutput { time_ns: output.time_ns + by_ns, ..output };
                first.get_or_insert((
                    flight.error(&of_then).0,
                    output.covariance.fixed_view::<3, 3>(0, 0).trace().sqrt(),
                ));
                if !output.degraded {
                    confirmed_ns.get_or_insert(time_ns - jump_ns - silence_ns);
                }
            }
            let (error_m, deviation_m) = first.unwrap();
            assert!(error_m < 3.0 * deviation_m, "{}, seed {seed}: {error_m} m of {deviation_m}", strategy.name());
            // Five anchors, and a second.
            let Some(confirmed_ns) = confirmed_ns else {
                panic!(
                    "{}, seed {seed}: {:?}",
                    strategy.name(),
                    estimator
                        .sink()
                        .iter()
                        .filter(|event| !["added", "keyframe"].contains(&event.kind.name()))
                        .map(|event| (event.time_ns, event.kind))
                        .collect::<Vec<_>>()
                )
            };
            assert!(confirmed_ns < 7 * SECOND, "{}, seed {seed}: {confirmed_ns}", strategy.name());
        }
    }
}

#[test]
fn a_covariance_never_grows_for_a_negative_time() {
    let flight = Flight::new(20, 4);
    for strategy in StrategyKind::ALL {
        let mut estimator = started(&flight, *strategy);
        let mut longest_s = 0.0_f64;
        for sent in &flight.sent(false, false, false) {
            let behind_ns = if sent.time_ns() > 10 * SECOND { 500 * SECOND } else { 0 };
            ignore(sent.behind(behind_ns).to(&mut estimator));
            estimator.tick(sent.time_ns() - behind_ns);
            let growing_s = estimator.health().covariance_growing_s;
            assert!(growing_s >= 0.0, "{}: {growing_s} s at {}", strategy.name(), sent.time_ns());
            longest_s = longest_s.max(growing_s);
        }
        assert_eq!(estimator.counts().set_back, 1);
        assert!(longest_s > 5.0, "{longest_s}");
    }
}

/// A clock that is set back by less than inputs may be late is followed: its stamps repeat a time that other samples
/// cover, and none is new.
#[test]
fn a_clock_that_is_set_back_a_little_is_followed() {
    let flight = Flight::new(20, 2);
    let jump_ns = 8 * SECOND;
    for strategy in StrategyKind::ALL {
        for by_ns in [700_000_000, 1_001_700_000, 1_990_000_000, 2_200_000_000] {
            let mut estimator = started(&flight, *strategy);
            let mut degraded = 0;
            for sent in &flight.sent(true, true, false) {
                let time_ns = sent.time_ns();
                let behind_ns = if time_ns >= jump_ns { by_ns } else { 0 };
                ignore(sent.behind(behind_ns).to(&mut estimator));
                let Some(output) = estimator.tick(time_ns - behind_ns) else { continue };
                if time_ns < jump_ns + 6 * SECOND / 10 {
                    continue;
                }
                let (error_m, _) = flight.error(&EstimatorOutput { time_ns: output.time_ns + by_ns, ..output });
                let what = std::format!("{}, {by_ns}: {error_m} m at {time_ns}", strategy.name());
                assert!(error_m < 5.0 || (output.degraded && error_m < 20.0), "{what}");
                degraded += usize::from(output.degraded);
            }
            assert!((20..40).contains(&degraded), "{}, {by_ns}: {degraded}", strategy.name());
            assert_eq!((estimator.counts().set_back, count(estimator.sink(), "clock_set_back")), (1, 1));
        }
    }
}

/// Samples that are sent twice, and those that a link had held back for more than half a second, are on the same clock.
#[test]
fn samples_sent_again_and_a_backlog_are_no_jump() {
    let flight = Flight::new(14, 2);
    for strategy in StrategyKind::ALL {
        let mut estimator = started(&flight, *strategy);
        for (index, sample) in flight.samples.iter().enumerate().skip(1) {
            let second = index / 200;
            // The last 0.8 s once more at every second; from the tenth on, the newest first and then those before it.
            match (second, index % 200) {
                (..10, 199) => {
                    flight.samples[index - 160..=index].iter().for_each(|sample| ignore(estimator.add_imu(sample)));
                }
                (..10, _) => ignore(estimator.add_imu(sample)),
                (_, 199) => {
                    ignore(estimator.add_imu(sample));
                    flight.samples[index - 180..index].iter().for_each(|sample| ignore(estimator.add_imu(sample)));
                }
                (_, ..19) => ignore(estimator.add_imu(sample)),
                _ => {}
            }
        }
        assert_eq!(estimator.counts().set_back, 0, "{}", strategy.name());
        assert!(estimator.counts().duplicates > 1500 && estimator.counts().late > 700, "{:?}", estimator.counts());
        let mut in_order = started(&flight, *strategy);
        flight.samples[1..].iter().for_each(|sample| in_order.add_imu(sample).unwrap());
        let place = |of: &mut Estimator| flight.frame.position(&of.predicted(14 * SECOND).unwrap().position);
        assert!((place(&mut estimator) - place(&mut in_order)).norm() < 1e-6, "{}", strategy.name());
    }
}

#[test]
fn before_the_start_a_clock_that_is_set_back_starts_on_the_new_one() {
    let flight = Flight::new(8, 3);
    for strategy in StrategyKind::ALL {
        let mut estimator = estimator(*strategy);
        for sample in &flight.samples[..200] {
            estimator.add_imu(&ImuMean { time_ns: sample.time_ns + 1000 * SECOND, ..*sample }).unwrap();
        }
        for sent in &flight.sent(true, true, false) {
            ignore(sent.to(&mut estimator));
        }
        assert_eq!(estimator.counts().set_back, 1);
        assert!(flight.error(&estimator.predicted(8 * SECOND).unwrap()).0 < 5.0, "{}", strategy.name());
    }
}

#[test]
fn a_clock_that_is_set_back_does_not_let_a_spoofed_receiver_in() {
    let flight = Flight::new(8, 3);
    for strategy in StrategyKind::ALL {
        let mut estimator = started(&flight, *strategy);
        for sent in &flight.sent(true, true, true) {
            let is_set_back = sent.time_ns() > 4 * SECOND;
            let sent = match sent {
                Sent::Health(reading) if !is_set_back => {
                    Sent::Health(GpsHealthReading { health: GpsHealth::Spoofed, ..*reading })
                }
                sent => sent.behind(if is_set_back { 3600 * SECOND } else { 0 }),
            };
            ignore(sent.to(&mut estimator));
        }
        assert_eq!(estimator.counts().set_back, 1);
        assert!(!estimator.health().gate.is_open());
    }
}

laws! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    /// A clock that jumps and keeps its new time. There is an estimate again within a second, or with the next anchor if the gap is
    /// too long to be bridged. It is accurate once anchors confirm it.
    #[test]
    fn a_clock_that_jumps_is_followed(
        off_ns in prop_oneof![2100 * SECOND / 1000..61 * SECOND, 61 * SECOND..8000 * SECOND],
        is_ahead in any::<bool>(),
        silence_ns in 0..2 * SECOND,
        seed in 0..1000_u64,
    ) {
        let flight = Flight::new(30, seed);
        let by_ns = if is_ahead { -off_ns } else { off_ns };
        let jump_ns = 6 * SECOND;
        for strategy in StrategyKind::ALL {
            let mut estimator = started(&flight, *strategy);
            let (mut again_ns, mut last, mut is_confirmed, mut is_degraded) = (None, None, false, true);
            for sent in &flight.sent(true, true, false) {
                let time_ns = sent.time_ns();
                if (jump_ns..jump_ns + silence_ns).contains(&time_ns) {
                    continue;
                }
                let behind_ns = if time_ns >= jump_ns { by_ns } else { 0 };
                ignore(sent.behind(behind_ns).to(&mut estimator));
                if time_ns < jump_ns {
                    continue;
                }
                let now = estimator.predicted(time_ns - behind_ns);
                if let Some(output) = now {
                    again_ns.get_or_insert(time_ns);
                    let of_then = EstimatorOutput { time_ns: output.time_ns + by_ns, ..output };
                    last = Some(flight.error(&of_then).0);
                    is_degraded = output.degraded;
                    // An anchor that the gate refuses by chance makes it degraded for some seconds.
                    is_confirmed |= time_ns > jump_ns + 10 * SECOND && !output.degraded;
                }
            }
            let again_ns = again_ns.unwrap() - jump_ns - silence_ns;
            // A gap of a minute, including the time that it takes to believe it.
            let is_lost = is_ahead && off_ns + silence_ns + SECOND / 2 + 2 * STEP > 60 * SECOND;
            let bound_ns = if is_lost { 3 * SECOND / 2 + 5 * STEP } else { SECOND / 2 + 2 * STEP };
            prop_assert!(again_ns <= bound_ns, "{}: again after {again_ns} ns", strategy.name());
            let error_m = last.unwrap();
            // After a long gap the attitude is unknown, and confirming it may take longer than the flight.
            let is_long = is_ahead && !is_lost && off_ns + silence_ns > 3 * SECOND;
            let is_told = error_m < 6.0 && is_confirmed || is_long && is_degraded;
            prop_assert!(is_told, "{}: {error_m} m, confirmed {is_confirmed}", strategy.name());
        }
    }
}
