//! Clocks that are set back or jump, and stay so.

use super::*;
use bb_tests::laws;
use proptest::prelude::*;

/// The output on the clock that was not set back.
fn of_then(output: &EstimatorOutput, by_ns: i64) -> EstimatorOutput {
    EstimatorOutput { time_ns: output.time_ns + by_ns, ..*output }
}

/// Also if it is set back by less than inputs may be late: its stamps then repeat a time that other samples cover,
/// and none is new.
#[test]
fn a_clock_that_is_set_back_is_followed_and_told() {
    let flight = Flight::new(24, 3);
    let jump_ns = 12 * SECOND;
    for (strategy, (by_ns, worst_m)) in each([
        (700_000_000, 20.0),
        (1_001_700_000, 20.0),
        (1_990_000_000, 20.0),
        (2_200_000_000, 20.0),
        (5 * SECOND, 40.0),
        (10_000 * SECOND, 40.0),
    ]) {
        let what = std::format!("{strategy:?}, {by_ns} ns");
        let mut estimator = started(&flight, strategy);
        let flown = fly(&mut estimator, &flight.sent(true, true, false), |sent| sent.set_back(jump_ns, by_ns));
        // Believing it takes half a second. Until then, the time of a new estimate may be one of the old clock.
        let first_ns = jump_ns + if by_ns < 3 * SECOND { 6 * SECOND / 10 } else { 0 };
        let after = flown.iter().filter(|flown| flown.at_ns >= first_ns && flown.output.is_some());
        let outputs: Vec<_> = after.map(|flown| (flown.at_ns, flown.output.unwrap())).collect();
        assert!(outputs[0].0 < jump_ns + SECOND, "{what}: an estimate again at {}", outputs[0].0);
        for (at_ns, output) in &outputs {
            let (error_m, _) = flight.error(&of_then(output, by_ns));
            assert!(error_m < if output.degraded { worst_m } else { 5.0 }, "{what}: {error_m} m at {at_ns}");
        }
        let degraded = outputs.iter().filter(|(_, output)| output.degraded).count();
        assert!((20..40).contains(&degraded), "{what}: trusted after {degraded} outputs");
        let told: Vec<_> = kinds(estimator.sink(), "clock_set_back").collect();
        let EventKind::ClockSetBack { seconds } = told[0].kind else { unreachable!() };
        assert!((seconds - by_ns as f64 * 1e-9 + 0.5).abs() < 0.02, "{what}: {seconds} s");
        assert_eq!((told.len(), told[0].level(), estimator.counts().set_back), (1, Level::Warn, 1));
        assert!(told[0].status_text().unwrap().as_str().starts_with("NAV IMU clock set back"));
        assert_eq!(count(estimator.sink(), "fallback_engaged"), 0, "{what}");
    }
}

/// An old estimate is not given for the time of a new clock: until that is believed, there is none for its times.
#[test]
fn an_old_estimate_is_not_given_for_the_time_of_a_new_clock() {
    for (strategy, _, mut estimator) in flights_by_imu::<NavigationFactor>(4, 3) {
        let newest_ns = 4 * SECOND;
        for (behind_ns, is_given) in
            [(0, true), (SECOND / 5, true), (SECOND / 5 + 1, false), (2 * SECOND, false), (100 * SECOND, false)]
        {
            let output = estimator.predicted(newest_ns - behind_ns);
            assert_eq!(output.map(|output| output.time_ns), is_given.then_some(newest_ns), "{behind_ns}");
        }
        assert!(estimator.tick(newest_ns - SECOND).is_none());
        assert_eq!(estimator.tick(newest_ns).unwrap().time_ns, newest_ns);
        // Ticks of that clock alone, for five seconds.
        let is_silent = (0..50).all(|i| estimator.tick(newest_ns - 100 * SECOND + i * FRAME).is_none());
        assert!(is_silent && estimator.health().state == HealthState::Lost, "{strategy:?}");
    }
}

/// Nobody knows for how long the IMU was silent before its clock was set back. What the body may have moved by in that time is in the
/// covariance, so the first anchor fits, and no later one is needed to overrule the estimate.
#[test]
fn the_time_that_a_clock_hides_is_in_the_covariance() {
    let (jump_ns, by_ns) = (6 * SECOND, 1000 * SECOND);
    for (seed, silence_ns) in [(1, 1_900_000_000), (24, 1_600_000_000), (26, 1_400_000_000), (20, 0)] {
        let flight = Flight::new(20, seed);
        for strategy in StrategyKind::ALL {
            let mut estimator = started(&flight, *strategy);
            let (mut first, mut confirmed_ns) = (None, None);
            for sent in &flight.sent(true, true, false) {
                let time_ns = sent.time_ns();
                if (jump_ns..jump_ns + silence_ns).contains(&time_ns) {
                    continue;
                }
                let sent = sent.set_back(jump_ns, by_ns);
                let result = sent.to(&mut estimator);
                let Some(output) = estimator.predicted(sent.time_ns()).filter(|_| time_ns >= jump_ns) else {
                    continue;
                };
                assert!(!matches!(sent, Sent::Anchor(_)) || result.is_ok(), "{strategy:?}, {seed}: {result:?}");
                let deviation_m = output.covariance.fixed_view::<3, 3>(0, 0).trace().sqrt();
                first.get_or_insert((flight.error(&of_then(&output, by_ns)).0, deviation_m));
                if !output.degraded {
                    confirmed_ns.get_or_insert(time_ns - jump_ns - silence_ns);
                }
            }
            let (error_m, deviation_m) = first.unwrap();
            assert!(error_m < 3.0 * deviation_m, "{strategy:?}, seed {seed}: {error_m} m of {deviation_m}");
            // Five anchors, and a second.
            let is_confirmed = confirmed_ns.is_some_and(|after_ns| after_ns < 7 * SECOND);
            assert!(is_confirmed, "{strategy:?}, seed {seed}: {confirmed_ns:?}");
        }
    }
}

#[test]
fn a_covariance_never_grows_for_a_negative_time() {
    for (strategy, flight, mut estimator) in flights(20, 4) {
        let mut longest_s = 0.0_f64;
        for sent in &flight.sent(false, false, false) {
            let sent = sent.set_back(10 * SECOND + 1, 500 * SECOND);
            ignore(sent.to(&mut estimator));
            estimator.tick(sent.time_ns());
            let growing_s = estimator.health().covariance_growing_s;
            assert!(growing_s >= 0.0, "{strategy:?}: {growing_s} s at {}", sent.time_ns());
            longest_s = longest_s.max(growing_s);
        }
        assert_eq!(estimator.counts().set_back, 1);
        assert!(longest_s > 5.0, "{longest_s}");
    }
}

/// Samples that are sent twice, and those that a link had held back for more than half a second, are on the same clock.
#[test]
fn samples_sent_again_and_a_backlog_are_no_jump() {
    for (strategy, flight, mut estimator) in flights(14, 2) {
        let mut add = |samples: &[ImuMean]| samples.iter().for_each(|sample| ignore(estimator.add_imu(sample)));
        for (index, sample) in flight.samples.iter().enumerate().skip(1) {
            // The last 0.8 s once more at every second; from the tenth on, the newest first and then those before it.
            match (index / 200, index % 200) {
                (..10, 199) => add(&flight.samples[index - 160..=index]),
                (_, 199) => {
                    add(&[*sample]);
                    add(&flight.samples[index - 180..index]);
                }
                (..10, _) | (_, ..19) => add(&[*sample]),
                _ => {}
            }
        }
        assert_eq!(estimator.counts().set_back, 0, "{strategy:?}");
        assert!(estimator.counts().duplicates > 1500 && estimator.counts().late > 700, "{:?}", estimator.counts());
        let mut in_order: Estimator = by_imu(&flight, strategy);
        let place = |of: &mut Estimator| flight.frame.position(&of.predicted(14 * SECOND).unwrap().position);
        assert!((place(&mut estimator) - place(&mut in_order)).norm() < 1e-6, "{strategy:?}");
    }
}

#[test]
fn before_the_start_a_clock_that_is_set_back_starts_on_the_new_one() {
    let flight = Flight::new(8, 3);
    for strategy in StrategyKind::ALL {
        let mut estimator = estimator(*strategy);
        for sample in &flight.samples[..200] {
            Sent::Imu(*sample).behind(-1000 * SECOND).to(&mut estimator).unwrap();
        }
        send(&mut estimator, &flight.sent(true, true, false));
        assert_eq!(estimator.counts().set_back, 1);
        assert!(flight.error(&estimator.predicted(8 * SECOND).unwrap()).0 < 5.0, "{strategy:?}");
    }
}

#[test]
fn a_clock_that_is_set_back_does_not_let_a_spoofed_receiver_in() {
    for (_, flight, mut estimator) in flights(8, 3) {
        for sent in &flight.sent(true, true, true) {
            let is_before = sent.time_ns() <= 4 * SECOND;
            let sent = if is_before { sent.reporting(GpsHealth::Spoofed) } else { sent.behind(3600 * SECOND) };
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
                let sent = sent.set_back(jump_ns, by_ns);
                ignore(sent.to(&mut estimator));
                if time_ns < jump_ns {
                    continue;
                }
                if let Some(output) = estimator.predicted(sent.time_ns()) {
                    again_ns.get_or_insert(time_ns);
                    last = Some(flight.error(&of_then(&output, by_ns)).0);
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
