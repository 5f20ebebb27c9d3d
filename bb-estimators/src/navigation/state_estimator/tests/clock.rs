//! Implausible stamps, clocks that are set back, and more samples than the configured rate.

use super::flight::{SECOND, STEP};
use super::*;
use crate::navigation::{ImuMean, Refusal};
use nalgebra::Matrix6;
use proptest::prelude::*;

/// An input on a clock that is behind by `by_ns`.
fn behind(sent: &Sent, by_ns: i64) -> Sent {
    match *sent {
        Sent::Imu(sample) => Sent::Imu(ImuMean { time_ns: sample.time_ns - by_ns, ..sample }),
        Sent::Vio(vio) => Sent::Vio(VioOutput { from_ns: vio.from_ns - by_ns, to_ns: vio.to_ns - by_ns, ..vio }),
        Sent::Anchor(anchor) => Sent::Anchor(PoseAnchor { time_ns: anchor.time_ns - by_ns, ..anchor }),
        Sent::Fix(fix) => Sent::Fix(GnssReading { time_ns: fix.time_ns - by_ns, ..fix }),
        Sent::Health(health) => Sent::Health(GpsHealthReading { time_ns: health.time_ns - by_ns, ..health }),
    }
}

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
                ignore(behind(sent, set_back_ns).to(&mut estimator));
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
                let result = behind(sent, behind_ns).to(&mut estimator);
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
            let confirmed_ns = confirmed_ns.unwrap();
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
            ignore(behind(sent, behind_ns).to(&mut estimator));
            estimator.tick(sent.time_ns() - behind_ns);
            let growing_s = estimator.health().covariance_growing_s;
            assert!(growing_s >= 0.0, "{}: {growing_s} s at {}", strategy.name(), sent.time_ns());
            longest_s = longest_s.max(growing_s);
        }
        assert_eq!(estimator.counts().set_back, 1);
        assert!(longest_s > 5.0, "{longest_s}");
    }
}

/// By less than inputs may be late: its stamps repeat a time that other samples cover, and none is new.
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
                ignore(behind(sent, behind_ns).to(&mut estimator));
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
        let place = |of: &Estimator| flight.frame.position(&of.predicted(14 * SECOND).unwrap().position);
        assert!((place(&estimator) - place(&in_order)).norm() < 1e-6, "{}", strategy.name());
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
                sent => behind(sent, if is_set_back { 3600 * SECOND } else { 0 }),
            };
            ignore(sent.to(&mut estimator));
        }
        assert_eq!(estimator.counts().set_back, 1);
        assert!(!estimator.health().gate.is_open());
    }
}

/// An isolated absurd stamp, before the first sample, as the first, or among others. Other inputs are processed as if it were
/// absent.
#[test]
fn one_absurd_stamp_moves_nothing() {
    let flight = Flight::new(8, 3);
    for strategy in StrategyKind::ALL {
        for absurd_ns in [i64::MAX, i64::MIN, 59 * SECOND, -59 * SECOND, 1 << 60] {
            for at in [0, 1, 800] {
                let mut estimator = estimator(*strategy);
                estimator.warm_start(flight.warm_start(0)).unwrap();
                let mut outputs = 0;
                for (i, sent) in flight.sent(true, true, false).iter().enumerate() {
                    if i == at {
                        let sample = ImuMean { time_ns: absurd_ns, ..flight.samples[0] };
                        ignore(estimator.add_imu(&sample));
                    }
                    sent.to(&mut estimator).unwrap();
                    if let Some(output) = estimator.tick(sent.time_ns()) {
                        outputs += 1;
                        let (error_m, _) = flight.error(&output);
                        assert!(error_m < 5.0 && !output.degraded, "{}, {absurd_ns}: {error_m}", strategy.name());
                    }
                }
                assert!(outputs >= 39, "{}, {absurd_ns} at {at}: {outputs}", strategy.name());
                let told = kinds(estimator.sink(), "degraded").count();
                assert_eq!(told, 1, "{absurd_ns} at {at}: it is refused, and said so");
            }
        }
    }
}

/// A burst of stamps too small to be believed.
#[derive(Clone, Copy, Debug)]
struct Burst {
    /// The index of the sample it precedes.
    at: usize,
    count: i64,
    step_ns: i64,
    /// Offset from the present.
    off_ns: i64,
    /// Whether it replaces the regular samples of that time.
    replaces: bool,
}

fn burst() -> impl Strategy<Value = Burst> {
    let off = prop_oneof![2 * SECOND + STEP..10 * SECOND, 10 * SECOND..8000 * SECOND];
    // Many within less than half a second, or up to four over any time.
    let size = prop_oneof![(1..100_i64, Just(STEP)), (1..=4_i64, STEP..SECOND)];
    (0..2000_usize, size, off, any::<bool>(), any::<bool>()).prop_map(
        |(at, (count, step_ns), off_ns, is_ahead, replaces)| {
            // Times before the origin of the clock are valid.
            let off_ns = if is_ahead { off_ns } else { -off_ns - count * step_ns };
            Burst { at, count, step_ns, off_ns, replaces }
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    /// The estimate is the same as without the burst, except for any missing samples.
    #[test]
    fn stamps_that_are_too_few_move_nothing(mut bursts in prop::collection::vec(burst(), 1..6), seed in 0..1000_u64) {
        let flight = Flight::new(10, seed);
        bursts.sort_by_key(|burst| burst.at);
        for strategy in StrategyKind::ALL {
            let mut estimator = started(&flight, *strategy);
            let mut left = bursts.iter().peekable();
            let mut missing_until = 0;
            let mut seen = 0;
            for sent in &flight.sent(true, true, false) {
                if let Sent::Imu(sample) = sent {
                    seen += 1;
                    // Two bursts in a row would form a larger one.
                    while let Some(burst) = left.next_if(|burst| burst.at <= seen) {
                        if seen < missing_until + 2 {
                            continue;
                        }
                        for i in 0..burst.count {
                            let time_ns = sample.time_ns + burst.off_ns + i * burst.step_ns;
                            let refused = estimator.add_imu(&ImuMean { time_ns, ..*sample });
                            prop_assert!(matches!(refused, Err(EstimatorError::Degraded(_))), "{refused:?}");
                        }
                        missing_until = seen + if burst.replaces { burst.count.min(20) as usize } else { 0 };
                    }
                    if seen < missing_until {
                        continue;
                    }
                }
                ignore(sent.to(&mut estimator));
            }
            prop_assert_eq!(estimator.counts().set_back, 0);
            prop_assert_eq!(count(estimator.sink(), "started"), 1);
            prop_assert_eq!(count(estimator.sink(), "fatal"), 0);
            let (error_m, _) = flight.error(&estimator.predicted(10 * SECOND).unwrap());
            prop_assert!(error_m < 5.0, "{}: {error_m} m", strategy.name());
        }
    }

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
            let (mut again_ns, mut last, mut is_confirmed) = (None, None, false);
            for sent in &flight.sent(true, true, false) {
                let time_ns = sent.time_ns();
                if (jump_ns..jump_ns + silence_ns).contains(&time_ns) {
                    continue;
                }
                let behind_ns = if time_ns >= jump_ns { by_ns } else { 0 };
                ignore(behind(sent, behind_ns).to(&mut estimator));
                if time_ns < jump_ns {
                    continue;
                }
                let now = estimator.predicted(time_ns - behind_ns);
                if let Some(output) = now {
                    again_ns.get_or_insert(time_ns);
                    let of_then = EstimatorOutput { time_ns: output.time_ns + by_ns, ..output };
                    last = Some(flight.error(&of_then).0);
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
            let is_long = is_ahead && !is_lost && off_ns + silence_ns > 10 * SECOND;
            let is_told = error_m < 6.0 && (is_confirmed || is_long);
            prop_assert!(is_told, "{}: {error_m} m, confirmed {is_confirmed}", strategy.name());
        }
    }
}

/// Reports before the first sample are not discarded for two stamps that agree.
#[test]
fn two_absurd_stamps_before_the_first_do_not_cost_the_warm_start() {
    let flight = Flight::new(4, 3);
    for strategy in StrategyKind::ALL {
        let mut estimator = estimator(*strategy);
        estimator.warm_start(flight.warm_start(0)).unwrap();
        for i in 0..2 {
            ignore(estimator.add_imu(&ImuMean { time_ns: 3600 * SECOND + i * STEP, ..flight.samples[0] }));
        }
        flight.samples.iter().for_each(|sample| ignore(estimator.add_imu(sample)));
        assert!(flight.error(&estimator.predicted(4 * SECOND).unwrap()).0 < 5.0, "{}", strategy.name());
    }
}

#[test]
fn the_first_sample_waits_for_one_that_agrees() {
    let flight = Flight::new(2, 3);
    for strategy in StrategyKind::ALL {
        let mut estimator = estimator(*strategy);
        estimator.add_imu(&flight.samples[0]).unwrap();
        let last = estimator.sink().last().unwrap().kind;
        assert_eq!(last, EventKind::Added { input: InputKind::Imu, nis: None, waits: true });
        let origin = TakeoffOrigin::new(*flight.frame.origin());
        assert_eq!(estimator.set_takeoff_origin(origin), Err(OriginError::AfterMeasurement));
        estimator.add_imu(&flight.samples[1]).unwrap();
        assert_eq!(estimator.held()[0], 2, "none is lost");
    }
}

/// With valid settings, nothing is dropped and the stated capacity is not exceeded.
#[test]
fn a_fast_imu_and_a_long_lateness_fit() {
    let flight = Flight::new(4, 3);
    for strategy in StrategyKind::ALL {
        let mut config = config(*strategy);
        config.params.imu_rate = 4000.0;
        config.params.lateness = 3.0;
        config.params.keyframe_interval = 2.0;
        let mut estimator: Estimator = StateEstimator::new(config, Events::new()).unwrap();
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
            let mut estimator: Estimator = StateEstimator::new(config, Events::new()).unwrap();
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

/// The gap that a clock set back leaves is one even if frames on the new clock divide it into parts shorter than a sample may be.
#[test]
fn the_gap_of_a_clock_that_is_set_back_is_as_uncertain_if_it_is_divided() {
    let flight = Flight::new(8, 2);
    let (jump_ns, by_ns) = (4 * SECOND, 3600 * SECOND);
    for strategy in StrategyKind::ALL {
        let [whole, divided] = [false, true].map(|with_frames| {
            let mut estimator = started(&flight, *strategy);
            let mut frames = 0;
            for sent in flight.sent(true, false, false) {
                let is_after = sent.time_ns() > jump_ns;
                match behind(&sent, if is_after { by_ns } else { 0 }) {
                    Sent::Vio(_) if is_after => {}
                    sent => {
                        let is_bridged = sent.to(&mut estimator) == Err(EstimatorError::Degraded(Reason::Bridged));
                        if !(is_bridged && with_frames) {
                            continue;
                        }
                        // It continues from half a second before the jump.
                        let in_gap =
                            |vio: &&VioOutput| (jump_ns - SECOND / 2..jump_ns + SECOND / 2).contains(&vio.to_ns);
                        for vio in flight.vio.iter().filter(in_gap) {
                            let said = VioOutput { covariance: Matrix6::identity() * 1e8, ..*vio };
                            ignore(behind(&Sent::Vio(said), by_ns).to(&mut estimator));
                            frames += 1;
                        }
                    }
                }
            }
            assert_eq!((estimator.counts().set_back, frames), (1, if with_frames { 10 } else { 0 }));
            estimator.predicted(8 * SECOND - by_ns).unwrap().covariance
        });
        for i in 0..6 {
            let ratio = divided[(i, i)] / whole[(i, i)];
            assert!((0.8..2.0).contains(&ratio), "{strategy:?}, {i}: {} and {}", whole[(i, i)], divided[(i, i)]);
        }
    }
}

/// The same for a warm start some time before the first sample.
#[test]
fn the_gap_before_the_first_sample_is_as_uncertain_if_it_is_divided() {
    let flight = Flight::new(4, 2);
    for strategy in StrategyKind::ALL {
        let [whole, divided] = [false, true].map(|with_frames| {
            let mut estimator = estimator(*strategy);
            estimator.warm_start(flight.warm_start(0)).unwrap();
            if with_frames {
                for vio in flight.vio.iter().filter(|vio| vio.to_ns < SECOND / 2) {
                    let said = VioOutput { covariance: Matrix6::identity() * 1e8, ..*vio };
                    ignore(estimator.add_vio(said));
                }
            }
            for sample in flight.samples.iter().filter(|sample| sample.time_ns >= SECOND / 2) {
                ignore(estimator.add_imu(sample));
            }
            estimator.predicted(4 * SECOND).unwrap().covariance
        });
        for i in 0..6 {
            let ratio = divided[(i, i)] / whole[(i, i)];
            assert!((0.8..2.0).contains(&ratio), "{strategy:?}, {i}: {} and {}", whole[(i, i)], divided[(i, i)]);
        }
    }
}
