//! The result does not depend on the order of arrival.

use super::flight::SECOND;
use super::*;
use crate::navigation::Refusal;
use bb_tests::laws;
use proptest::prelude::*;

/// All query results.
pub(super) fn answers(estimator: &mut Estimator) -> impl PartialEq + core::fmt::Debug + use<> {
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

laws! {
    #![proptest_config(ProptestConfig::with_cases(4))]

    #[test]
    fn what_arrives_late_is_as_if_it_had_not(delays in prop::collection::vec(0.0..1.0_f64, 64), seed in 0..1000_u64) {
        let flight = Flight::new(3, seed);
        let sent: Vec<Sent> = flight.sent(true, true, true).iter().map(spoofed).collect();
        for strategy in StrategyKind::ALL {
            let mut config = config(*strategy);
            config.params.dwell = 1.0;
            let start = || {
                let mut estimator = FlightNavigator::new(config, Events::new()).unwrap();
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

/// Anchors that are always late lose nothing, for as long as one likes: an input that is late drops no copy that the
/// next one, as late, needs.
#[test]
fn anchors_that_are_always_late_lose_nothing() {
    let flight = Flight::new(9, 2);
    let sent = flight.sent(true, true, false);
    let cases =
        [1_500_000_000, 1_900_000_000].map(|late_ns| StrategyKind::ALL.iter().map(move |kind| (kind, late_ns)));
    for (strategy, late_ns) in cases.into_iter().flatten() {
        let mut arriving: Vec<(i64, &Sent)> = sent
            .iter()
            .map(|sent| {
                let is_late = matches!(sent, Sent::Anchor(_));
                (sent.time_ns() + if is_late { late_ns } else { 0 }, sent)
            })
            .collect();
        arriving.sort_by_key(|(at_ns, _)| *at_ns);
        arriving.retain(|(at_ns, _)| *at_ns <= 9 * SECOND);
        let mut in_order: Vec<&Sent> = arriving.iter().map(|(_, sent)| *sent).collect();
        in_order.sort_by_key(|sent| sent.time_ns());
        let (mut late, mut on_time) = (started(&flight, *strategy), started(&flight, *strategy));
        let mut most_copies = 0;
        for (_, sent) in &arriving {
            ignore(sent.to(&mut late));
            most_copies = most_copies.max(late.held()[2]);
        }
        in_order.iter().for_each(|sent| ignore(sent.to(&mut on_time)));
        let counts = *late.counts();
        let more = counts.late - on_time.counts().late;
        assert_eq!((more, counts.too_old, counts.dropped), (7, 0, 0), "{}: {counts:?}", strategy.name());
        assert!(most_copies <= 8, "{most_copies} copies");
        assert!(late.held()[0] < 900, "{:?} samples", late.held());
        assert_eq!(answers(&mut late), answers(&mut on_time), "{}", strategy.name());
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
