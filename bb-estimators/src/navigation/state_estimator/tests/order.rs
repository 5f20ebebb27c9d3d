//! The result does not depend on the order of arrival.

use super::*;
use bb_tests::laws;
use proptest::prelude::*;

laws! {
    #![proptest_config(ProptestConfig::with_cases(4))]

    #[test]
    fn what_arrives_late_is_as_if_it_had_not(delays in prop::collection::vec(0.0..1.0_f64, 64), seed in 0..1000_u64) {
        let flight = Flight::new(3, seed);
        let spoofed = |sent: &Sent| match sent.time_ns() {
            500_000_000..SECOND => sent.reporting(GpsHealth::Spoofed),
            _ => *sent,
        };
        let sent: Vec<Sent> = flight.sent(true, true, true).iter().map(spoofed).collect();
        for strategy in StrategyKind::ALL {
            let start = || started_with(&flight, *strategy, |params| params.dwell = 1.0);
            let (mut in_order, mut shuffled) = (start(), start());
            send(&mut in_order, &sent);
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
            send(&mut shuffled, arriving.into_iter().map(|(_, sent)| sent));
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
        send(&mut on_time, in_order);
        let counts = *late.counts();
        let more = counts.late - on_time.counts().late;
        assert_eq!((more, counts.too_old, counts.dropped), (7, 0, 0), "{strategy:?}: {counts:?}");
        assert!(most_copies <= 8, "{most_copies} copies");
        assert!(late.held()[0] < 900 && late.held()[1] < 200, "{:?} samples and inputs", late.held());
        assert_eq!(answers(&mut late), answers(&mut on_time), "{strategy:?}");
    }
}
