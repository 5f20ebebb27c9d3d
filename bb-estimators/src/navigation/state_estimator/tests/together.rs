//! Inputs that arrive together are run together, with the result of one by one.

use super::*;
use bb_tests::laws;
use proptest::prelude::*;

/// Stamps that are far in the future begin here.
const ELSEWHEN: i64 = 1000 * SECOND;

/// Returns the inputs that came while the IMU was silent, and the sample that ends it, with the estimator.
fn after_silence(flight: &Flight, strategy: StrategyKind, silent_ns: i64) -> (Estimator, Vec<Sent>) {
    let mut estimator = started(flight, strategy);
    let (from_ns, to_ns) = (SECOND, SECOND + silent_ns);
    let mut waiting = Vec::new();
    for sent in flight.sent(true, true, true) {
        let time_ns = sent.time_ns();
        match sent {
            Sent::Imu(_) if time_ns > from_ns && time_ns < to_ns => {}
            sent if time_ns <= from_ns => ignore(sent.to(&mut estimator)),
            Sent::Imu(sample) if time_ns == to_ns => ignore(estimator.add_imu(&sample)),
            sent if time_ns < to_ns => waiting.push(sent),
            _ => {}
        }
    }
    (estimator, waiting)
}

#[test]
fn a_call_within_another_is_part_of_it() {
    let flight = Flight::new(4, 5);
    for strategy in StrategyKind::ALL {
        let (mut estimator, waiting) = after_silence(&flight, *strategy, 380 * STEP);
        let before = estimator.counts().reruns;
        estimator.together(|estimator| {
            waiting.iter().for_each(|sent| estimator.together(|estimator| ignore(sent.to(estimator))));
            assert_eq!(estimator.counts().reruns, before);
        });
        assert!(estimator.counts().reruns <= before + 1);
        let (mut one_by_one, _) = after_silence(&flight, *strategy, 380 * STEP);
        send(&mut one_by_one, &waiting);
        assert_eq!(answers(&mut estimator), answers(&mut one_by_one));
    }
}

/// A refused alarm counts as one of the newest sample, whatever comes before or after it.
#[test]
fn a_refused_alarm_shuts_out_what_is_later_than_the_newest_sample() {
    let flight = Flight::new(4, 5);
    let alarm = Sent::Health(GpsHealthReading { time_ns: ELSEWHEN, health: GpsHealth::Spoofed });
    for (strategy, silent_steps) in
        StrategyKind::ALL.iter().flat_map(|strategy| [(*strategy, 48), (*strategy, 380)])
    {
        let to_ns = SECOND + silent_steps * STEP;
        let with_alarm_after = |fixes: usize, are_together: bool| {
            let (mut estimator, mut waiting) = after_silence(&flight, strategy, silent_steps * STEP);
            waiting.retain(|sent| matches!(sent, Sent::Fix(_)));
            assert!(waiting.len() >= 2, "{}", waiting.len());
            waiting.insert(fixes.min(waiting.len()), alarm);
            match are_together {
                true => estimator.together(|estimator| send(estimator, &waiting)),
                false => send(&mut estimator, &waiting),
            }
            assert_eq!(count(estimator.sink(), "rejected"), 0, "they were measured before");
            assert_eq!(estimator.health().gate, GateState::Blocked);
            let before = answers(&mut estimator);
            let after = flight.sent(true, true, true).into_iter().filter(|sent| sent.time_ns() > to_ns);
            let after: Vec<Sent> = after.filter(|sent| matches!(sent, Sent::Imu(_) | Sent::Fix(_))).collect();
            send(&mut estimator, &after);
            let fixes = after.iter().filter(|sent| matches!(sent, Sent::Fix(_))).count();
            assert!(fixes > 1 || silent_steps == 380);
            assert_eq!(count(estimator.sink(), "rejected"), fixes);
            (before, answers(&mut estimator))
        };
        let first = with_alarm_after(0, false);
        for (fixes, are_together) in
            [0, 1, 2, usize::MAX].into_iter().flat_map(|fixes| [(fixes, false), (fixes, true)])
        {
            assert_eq!(with_alarm_after(fixes, are_together), first, "{strategy:?} {silent_steps} {fixes}");
        }
    }
}

laws! {
    #![proptest_config(ProptestConfig::with_cases(6))]

    #[test]
    fn inputs_together_are_as_if_one_by_one(
        chunks in prop::collection::vec(prop_oneof![1..40_usize, 40..200_usize], 32),
        silent_steps in 0..390_i64,
        alarms in prop::collection::vec(0..20_usize, 0..3),
        refused in prop::collection::vec(0..20_usize, 0..3),
        seed in 0..1000_u64,
    ) {
        let flight = Flight::new(4, seed);
        let mut sent = flight.sent(true, true, true);
        sent.retain(|sent| {
            let is_silent = (SECOND..SECOND + silent_steps * STEP).contains(&sent.time_ns());
            !(is_silent && matches!(sent, Sent::Imu(_)))
        });
        let mut healths: Vec<&mut GpsHealthReading> = sent.iter_mut().filter_map(|sent| match sent {
            Sent::Health(reading) => Some(reading),
            _ => None,
        }).collect();
        for index in &alarms {
            if let Some(reading) = healths.get_mut(*index) {
                reading.health = GpsHealth::Spoofed;
            }
        }
        // Alarms of another clock.
        for (count, index) in refused.iter().enumerate() {
            if let Some(reading) = healths.get_mut(*index) {
                **reading = GpsHealthReading { time_ns: ELSEWHEN + count as i64, health: GpsHealth::Spoofed };
            }
        }
        for strategy in StrategyKind::ALL {
            let mut one_by_one = started(&flight, *strategy);
            let mut in_chunks = started(&flight, *strategy);
            let mut rest = &sent[..];
            for size in chunks.iter().cycle() {
                let (chunk, after) = rest.split_at(rest.len().min(*size));
                rest = after;
                let (samples, others): (Vec<&Sent>, Vec<&Sent>) =
                    chunk.iter().partition(|sent| matches!(sent, Sent::Imu(_)));
                send(&mut one_by_one, samples.iter().copied());
                send(&mut in_chunks, samples);
                send(&mut one_by_one, others.iter().copied());
                in_chunks.together(|estimator| send(estimator, others));
                let health = |estimator: &Estimator| (estimator.health().state, estimator.health().gate, estimator.label());
                prop_assert_eq!(health(&one_by_one), health(&in_chunks));
                if rest.is_empty() {
                    break;
                }
            }
            prop_assert_eq!(answers(&mut one_by_one), answers(&mut in_chunks));
            let [one, together] = [&one_by_one, &in_chunks].map(|estimator| *estimator.counts());
            prop_assert!(together.reruns <= one.reruns);
            prop_assert_eq!(
                (one.too_old, one.in_the_future, one.overflows, one.duplicates, one.invalid),
                (together.too_old, together.in_the_future, together.overflows, together.duplicates, together.invalid)
            );
        }
    }
}
