//! Implausible stamps: too few to be a clock that was set.

use super::*;
use bb_tests::laws;
use proptest::prelude::*;

/// An isolated absurd stamp, before the first sample, as the first, or among others, or two that agree. Other inputs
/// are processed as if it were absent, and a warm start before the first sample is not discarded.
#[test]
fn one_absurd_stamp_moves_nothing() {
    let flight = Flight::new(8, 3);
    let absurd = [i64::MAX, i64::MIN, 59 * SECOND, -59 * SECOND, 1 << 60].map(|absurd_ns| (absurd_ns, 1));
    for strategy in StrategyKind::ALL {
        for (absurd_ns, times) in absurd.into_iter().chain([(3600 * SECOND, 2)]) {
            for at in [0, 1, 800] {
                let what = std::format!("{strategy:?}, {times} of {absurd_ns} at {at}");
                let mut estimator = estimator(*strategy);
                estimator.warm_start(flight.warm_start(0)).unwrap();
                let mut outputs = 0;
                for (i, sent) in flight.sent(true, true, false).iter().enumerate() {
                    for j in (0..times).filter(|_| i == at) {
                        let time_ns = absurd_ns + j * STEP;
                        ignore(estimator.add_imu(&ImuMean { time_ns, ..flight.samples[0] }));
                    }
                    sent.to(&mut estimator).unwrap();
                    if let Some(output) = estimator.tick(sent.time_ns()) {
                        outputs += 1;
                        let (error_m, _) = flight.error(&output);
                        assert!(error_m < 5.0 && !output.degraded, "{what}: {error_m} m");
                    }
                }
                assert!(outputs >= 39, "{what}: {outputs}");
                assert_eq!(count(estimator.sink(), "degraded") as i64, times, "{what}: refused, and said so");
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
    /// `true` if it replaces the regular samples of that time.
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

laws! {
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
                            let refusal = if burst.off_ns > 0 {
                                Refusal::InTheFuture { time_ns }
                            } else {
                                Refusal::TooOld { time_ns }
                            };
                            prop_assert_eq!(refused, degraded(refusal));
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
            prop_assert!(error_m < 5.0, "{strategy:?}: {error_m} m");
        }
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
