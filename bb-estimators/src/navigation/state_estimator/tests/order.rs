//! The result does not depend on the order of arrival.

use super::flight::SECOND;
use super::*;
use crate::navigation::Refusal;
use proptest::prelude::*;

/// All query results.
fn answers(estimator: &mut Estimator) -> impl PartialEq + core::fmt::Debug + use<> {
    let now_ns = 3 * SECOND;
    let gate = estimator.health().gate;
    (
        estimator.current_estimate(),
        estimator.predicted(now_ns),
        estimator.smoothed_history(20),
        estimator.label(),
        gate,
    )
}

fn spoofed(sent: &Sent) -> Sent {
    match sent {
        Sent::Health(reading) if (SECOND / 2..SECOND).contains(&reading.time_ns) => {
            Sent::Health(GpsHealthReading { health: GpsHealth::Spoofed, ..*reading })
        }
        sent => *sent,
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4))]

    #[test]
    fn what_arrives_late_is_as_if_it_had_not(delays in prop::collection::vec(0.0..1.0_f64, 64), seed in 0..1000_u64) {
        let flight = Flight::new(3, seed);
        let sent: Vec<Sent> = flight.sent(true, true, true).iter().map(spoofed).collect();
        for strategy in StrategyKind::ALL {
            let mut config = config(*strategy);
            config.params.dwell = 1.0;
            let start = || {
                let mut estimator = StateEstimator::new(config, Events::new()).unwrap();
                estimator.warm_start(flight.warm_start(0)).unwrap();
                estimator.add_imu(&flight.samples[0]).unwrap();
                estimator
            };
            let mut in_order = start();
            for sent in &sent {
                let _ = sent.to(&mut in_order);
            }
            // One IMU sample in ten is up to 0.3 s late, and other inputs up to 1.6 s. The limit is 2 s.
            let mut arriving: Vec<(i64, &Sent)> = sent.iter().enumerate().map(|(i, sent)| {
                let most = match sent {
 Sent::Imu(_) if i % 10 == 0 => 0.3e9,
 Sent::Imu(_) => 0.0,
 _ => 1.6e9,
 };
                let share = delays[(i * 31 + i / 7) % delays.len()];
                (sent.time_ns() + (most * share * share) as i64, sent)
            }).collect();
            arriving.sort_by_key(|(at_ns, _)| *at_ns);
            let mut shuffled = start();
            for (_, sent) in arriving {
                let _ = sent.to(&mut shuffled);
            }
            prop_assert!(shuffled.counts().late > 30, "{:?}", shuffled.counts());
            prop_assert_eq!(shuffled.counts().too_old + shuffled.counts().in_the_future, 0);
            prop_assert_eq!(answers(&mut in_order), answers(&mut shuffled));
        }
    }
}

#[test]
fn what_is_older_than_the_window_is_refused_and_counted() {
    let flight = Flight::new(6, 1);
    for strategy in StrategyKind::ALL {
        let mut estimator = started(&flight, *strategy);
        flight.samples[1..].iter().for_each(|sample| estimator.add_imu(sample).unwrap());
        let late = |estimator: &mut Estimator, index: usize| estimator.add_pose_anchor(flight.anchors[index]);
        assert!(matches!(late(&mut estimator, 4), Ok(Added::Taken { .. })), "1 s late");
        let refused = late(&mut estimator, 2).unwrap_err();
        let too_old = |time_ns| Reason::Refused(Refusal::TooOld { time_ns });
        assert_eq!(refused.reason(), too_old(flight.anchors[2].time_ns));
        assert_eq!(refused.to_string(), "degraded: time stamp 3015000000 ns is older than the history");
        let refused = estimator.add_imu(&flight.samples[100]).unwrap_err();
        assert_eq!(refused.reason(), too_old(flight.samples[100].time_ns));
        let ahead = PoseAnchor { time_ns: 7 * SECOND, ..flight.anchors[4] };
        let in_the_future = Reason::Refused(Refusal::InTheFuture { time_ns: 7 * SECOND });
        assert_eq!(estimator.add_pose_anchor(ahead), Err(EstimatorError::Degraded(in_the_future)));
        let counts = *estimator.counts();
        assert_eq!((counts.too_old, counts.in_the_future), (2, 1));
        assert_eq!(count(estimator.sink(), "degraded"), 3, "each is an event");
    }
}
