//! Properties of one joint's history.

use super::*;
use bb_tests::laws;
use proptest::prelude::*;

fn state<'a>(millis: i64, position: &'a [f64], velocity: &'a [f64]) -> State<'a> {
    State { time: MonotonicTime::from_nanos(millis * 1_000_000), position, velocity, effort: &[] }
}

fn sampled(history: &History, millis: i64, tolerance_millis: i64) -> Result<f64, Missing> {
    let mut position = [f64::NAN];
    let time = MonotonicTime::from_nanos(millis * 1_000_000);
    history.sample(time, tolerance_millis * 1_000_000, &mut position).map(|()| position[0])
}

fn angle(from: f64, to: f64) -> f64 {
    (to - from - TAU * ((to - from) / TAU).round()).abs()
}

#[test]
fn it_forgets_by_count_and_by_time() {
    let mut history = History::new(JointKind::Revolute, 4, 100_000_000);
    for time in 0..10 {
        history.add(state(time, &[time as f64], &[])).expect("it is newer");
    }
    assert_eq!(sampled(&history, 6, 0), Ok(6.0));
    assert_eq!(sampled(&history, 5, 0), Err(Missing::TooOld { nanos: 1_000_000 }));
    // Beyond the span all states but the last one are dropped.
    history.add(state(1000, &[1.0], &[])).expect("it is newer");
    assert_eq!(sampled(&history, 9, 0), Err(Missing::TooOld { nanos: 991_000_000 }));
    assert_eq!((sampled(&history, 1000, 0), history.length), (Ok(1.0), 1));
    history.add(state(1100, &[2.0], &[])).expect("it is newer");
    assert_eq!(sampled(&history, 1050, 0), Ok(1.5));
}

#[test]
fn the_extremes_of_time_are_no_panic() {
    let mut history = History::new(JointKind::Prismatic, 8, i64::MAX);
    let at = |nanos| State { time: MonotonicTime::from_nanos(nanos), position: &[1.0], velocity: &[], effort: &[] };
    history.add(at(i64::MIN)).expect("it is the first");
    let mut first = [0.0];
    assert_eq!(history.sample(MonotonicTime::MAX, i64::MAX, &mut first), Ok(()));
    history.add(at(i64::MAX)).expect("it is newer");
    let mut position = [0.0];
    for time in [i64::MIN, -1, 0, i64::MAX] {
        let _ = history.sample(MonotonicTime::from_nanos(time), i64::MAX, &mut position);
        assert!(position[0].is_finite(), "{time}");
    }
}

#[test]
fn an_absurd_velocity_does_no_lasting_harm_to_a_continuous_joint() {
    for velocity in [1e18, 1e20, 1e300, -1e20] {
        let mut history = History::new(JointKind::Continuous, 16, i64::MAX);
        history.add(state(0, &[0.1], &[])).expect("it is the first");
        history.add(state(1, &[0.1], &[velocity])).expect("it is a number");
        for (millis, angle) in [(2, 0.11), (3, 0.12)] {
            history.add(state(millis, &[angle], &[0.0])).expect("it is newer");
        }
        let known = sampled(&history, 3, 0).expect("it is known");
        assert!((known - 0.12).abs() < 1e-6, "{velocity}: {known}");
    }
}

#[test]
fn coordinates_of_another_joint_are_refused() {
    let mut history = History::new(JointKind::Planar, 4, i64::MAX);
    assert_eq!(history.add(state(0, &[1.0], &[])), Err(JointRefusal::OtherCoordinates));
    assert_eq!(history.add(state(0, &[1.0; 3], &[1.0])), Err(JointRefusal::OtherCoordinates));
    assert_eq!(history.add(state(0, &[1.0; 3], &[f64::NAN; 3])), Err(JointRefusal::NonFinite));
    let mut history = History::new(JointKind::Floating, 4, i64::MAX);
    assert_eq!(history.add(state(0, &[0.0; 7], &[])), Err(JointRefusal::NonFinite), "no rotation");
    let huge = [0.0, 0.0, 0.0, 1e200, 0.0, 0.0, 0.0];
    assert_eq!(history.add(state(0, &huge, &[])), Err(JointRefusal::NonFinite), "its norm is no number");
    assert_eq!(history.add(state(0, &[0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0], &[])), Ok(()));
}

/// A body that moves with a constant velocity in its own axes: a screw motion, which the interpolation and the prediction of
/// floating and planar joints approximate to second order.
#[test]
fn a_screw_is_followed_to_the_second_order() {
    let (speed, rate) = (1.0, 0.8);
    let planar = |time: f64| {
        let angle = rate * time;
        [speed / rate * angle.sin(), speed / rate * (1.0 - angle.cos()), angle]
    };
    let floating = |time: f64| {
        let [x, y, angle] = planar(time);
        [x, y, 0.3 * time, (0.5 * angle).cos(), 0.0, 0.0, (0.5 * angle).sin()]
    };
    let error = |step: f64| {
        let mut flat = History::new(JointKind::Planar, 8, i64::MAX);
        let mut free = History::new(JointKind::Floating, 8, i64::MAX);
        let nanos = |time: f64| MonotonicTime::from_nanos((time * 1e9).round() as i64);
        for time in [0.0, step] {
            let velocity = [speed, 0.0, rate];
            flat.add(State { time: nanos(time), position: &planar(time), velocity: &velocity, effort: &[] })
                .expect("it is newer");
            let velocity = [speed, 0.0, 0.3, 0.0, 0.0, rate];
            free.add(State { time: nanos(time), position: &floating(time), velocity: &velocity, effort: &[] })
                .expect("it is newer");
        }
        [0.5 * step, 2.0 * step].map(|time| {
            let (mut on_plane, mut in_space) = ([0.0; 3], [0.0; 7]);
            flat.sample(nanos(time), i64::MAX, &mut on_plane).expect("it is known");
            free.sample(nanos(time), i64::MAX, &mut in_space).expect("it is known");
            let far = |is: &[f64], expected: &[f64]| {
                is.iter().zip(expected).map(|(is, expected)| (is - expected).abs()).fold(0.0, f64::max)
            };
            far(&on_plane, &planar(time)).max(far(&in_space, &floating(time)))
        })
    };
    let (coarse, fine) = (error(0.1), error(0.05));
    // With half the step, the interpolation error is a quarter and the prediction error an eighth.
    assert!((3.8..4.2).contains(&(coarse[0] / fine[0])), "{coarse:?} {fine:?}");
    assert!((7.0..9.0).contains(&(coarse[1] / fine[1])), "{coarse:?} {fine:?}");
    assert!(coarse[0] < 1.1e-3 && coarse[1] < 5e-5, "{coarse:?}");
}

laws! {
    /// Compares with the plain definition, over a list that is kept in full.
    #[test]
    fn samples_are_those_of_the_list(
        steps in proptest::collection::vec((1..50_i64, -3.0..3.0_f64), 1..60),
        capacity in 2..20_usize,
        asked in -20..1600_i64,
        tolerance in 0..60_i64,
    ) {
        let mut history = History::new(JointKind::Prismatic, capacity, i64::MAX);
        let mut list = Vec::new();
        let mut time = 0;
        for (step, position) in steps {
            time += step;
            history.add(state(time, &[position], &[])).expect("it is newer");
            list.push((time, position));
        }
        let kept = &list[list.len().saturating_sub(capacity)..];
        let (newest, last) = kept[kept.len() - 1];
        let expected = if asked > newest + tolerance {
            Err(Missing::InFuture { nanos: (asked - newest) * 1_000_000 })
        } else if asked >= newest {
            Ok(last)
        } else if asked < kept[0].0 {
            Err(Missing::TooOld { nanos: (kept[0].0 - asked) * 1_000_000 })
        } else {
            let after = kept.iter().position(|(time, _)| *time > asked).expect("it is before the newest");
            let ((from, start), (to, end)) = (kept[after - 1], kept[after]);
            Ok(start + (end - start) * ((asked - from) as f64 / (to - from) as f64))
        };
        match (sampled(&history, asked, tolerance), expected) {
            (Ok(is), Ok(expected)) => prop_assert!((is - expected).abs() < 1e-12, "{is} {expected}"),
            (is, expected) => prop_assert_eq!(is, expected),
        }
    }

    /// A joint that keeps turning, reported within one turn: between two states it is at its true angle, whichever turn was
    /// reported.
    #[test]
    fn turns_are_unwound(rate in -30.0..30.0_f64, start in -10.0..10.0_f64, wrapping in 1..4_u32, is_measured in any::<bool>()) {
        // Without a velocity, only steps of less than half a turn can be resolved.
        let rate = if is_measured { rate * 10.0 } else { rate };
        let truth = |millis: f64| start + rate * millis * 1e-3;
        let mut history = History::new(JointKind::Continuous, 64, i64::MAX);
        for step in 0..20 {
            let angle = truth(f64::from(step) * 100.0);
            let wrapped = match wrapping {
                1 => angle.rem_euclid(TAU),
                2 => angle - TAU * (angle / TAU).round(),
                _ => angle,
            };
            let velocity = [rate];
            history.add(state(i64::from(step) * 100, &[wrapped], if is_measured { &velocity } else { &[] })).expect("it is newer");
        }
        for asked in 0..1900 {
            let is = sampled(&history, asked, 0).expect("it is known");
            prop_assert!(angle(is, truth(asked as f64)) < 1e-9, "{asked}: {is}");
        }
    }
}

/// Any number, often one at which sums and products overflow.
fn extreme() -> impl Strategy<Value = f64> {
    prop_oneof![
        proptest::num::f64::NORMAL,
        -10.0..10.0,
        prop_oneof![Just(f64::MAX), Just(-f64::MAX), Just(0.6 * f64::MAX), Just(-0.6 * f64::MAX)],
    ]
}

laws! {
    #[test]
    fn finite_states_of_several_coordinates_never_lead_to_infinite_poses(
        states in proptest::collection::vec(proptest::array::uniform12(extreme()), 2..6),
        millis in 0..7000_i64,
    ) {
        for kind in [JointKind::Planar, JointKind::Floating] {
            let mut history = History::new(kind, 8, i64::MAX);
            for (time, state_of) in (0..).step_by(100).zip(&states) {
                let [x, y, z, a, b, c, ..] = *state_of;
                let (position, velocity) = match kind {
                    JointKind::Planar => (vec![x, y, z], vec![a, b, c]),
                    _ => (vec![x, y, z, 0.6, 0.0, 0.8, 0.0], state_of[3..9].to_vec()),
                };
                history.add(state(time, &position, &velocity)).expect("it is newer");
            }
            let mut position = [0.0; 7];
            let position = &mut position[..if kind == JointKind::Planar { 3 } else { 7 }];
            let time = MonotonicTime::from_nanos(millis * 1_000_000);
            history.sample(time, i64::MAX, position).expect("all times are within the tolerance");
            prop_assert!(position.iter().all(|value| value.is_finite()), "{kind:?}: {position:?}");
        }
    }

    #[test]
    fn finite_states_never_lead_to_infinite_positions(
        states in proptest::collection::vec((extreme(), extreme()), 2..6),
        millis in 0..7000_i64,
    ) {
        for kind in [JointKind::Prismatic, JointKind::Revolute] {
            let mut history = History::new(kind, 8, i64::MAX);
            for (time, (position, velocity)) in (0..).step_by(100).zip(&states) {
                history.add(state(time, &[*position], &[*velocity])).expect("it is newer");
            }
            let position = sampled(&history, millis, i64::MAX / 1_000_000).expect("all times are within the tolerance");
            prop_assert!(position.is_finite(), "{position}");
            let bound = states.iter().fold(0.0_f64, |bound, (position, _)| bound.max(position.abs()));
            // Between two states, the result is between their positions.
            prop_assert!(millis >= 100 * (states.len() as i64 - 1) || position.abs() <= bound * (1.0 + 1e-12));
        }
    }
}

#[test]
fn a_joint_whose_clock_is_set_back_is_known_again() {
    let mut history = History::new(JointKind::Revolute, 64, 10_000_000_000);
    for millis in (0..200).step_by(10) {
        history.add(state(millis, &[millis as f64], &[])).expect("it is newer");
    }
    // One stamp is a second ahead: the states that follow are older than it.
    history.add(state(1_190, &[0.0], &[])).expect("it is newer");
    let added: Vec<_> =
        (200..400).step_by(10).map(|millis| history.add(state(millis, &[millis as f64], &[]))).collect();
    let refused = added.iter().take_while(|added| **added == Err(JointRefusal::OutOfOrder)).count();
    assert_eq!(refused, 10, "for 100 ms");
    assert!(added[refused..].iter().all(Result::is_ok), "{added:?}");
    assert_eq!((sampled(&history, 345, 0), history.newest()), (Ok(345.0), Some(390_000_000)));
    // Nothing of the time before is left to interpolate with.
    assert_eq!(sampled(&history, 250, 0), Err(Missing::TooOld { nanos: 50_000_000 }));
}

#[test]
fn a_clock_that_is_set_back_is_noticed_if_each_state_arrives_twice() {
    let mut history = History::new(JointKind::Revolute, 64, 10_000_000_000);
    history.add(state(1_000, &[0.0], &[])).expect("it is the first");
    let twice = (0..300).step_by(10).flat_map(|millis| [millis, millis]);
    let added: Vec<_> = twice.map(|millis| history.add(state(millis, &[millis as f64], &[]))).collect();
    let (refused, known) = added.split_at(20);
    assert!(refused.iter().all(|added| *added == Err(JointRefusal::OutOfOrder)), "for 100 ms: {added:?}");
    assert!(known.iter().step_by(2).all(Result::is_ok), "{added:?}");
    assert!(known.iter().skip(1).step_by(2).all(|added| *added == Err(JointRefusal::Duplicate)), "{added:?}");
    // Two states, however often they are repeated, are no succession.
    let mut history = History::new(JointKind::Revolute, 64, 10_000_000_000);
    history.add(state(1_000, &[0.0], &[])).expect("it is the first");
    for millis in [0; 20].into_iter().chain([200; 20]) {
        assert_eq!(history.add(state(millis, &[0.0], &[])), Err(JointRefusal::OutOfOrder));
    }
}

#[test]
fn late_states_do_not_restart_the_history() {
    let mut history = History::new(JointKind::Revolute, 64, 10_000_000_000);
    // A second source is 300 ms late, and a third delivers old states in reverse.
    for millis in (1000..3000).step_by(10) {
        history.add(state(millis, &[1.0], &[])).expect("it is newer");
        assert_eq!(history.add(state(millis - 300, &[2.0], &[])), Err(JointRefusal::OutOfOrder));
    }
    for millis in (1000..2990).rev() {
        assert_eq!(history.add(state(millis, &[3.0], &[])), Err(JointRefusal::OutOfOrder));
    }
    assert_eq!(sampled(&history, 2990, 0), Ok(1.0));
}

/// An encoder at 1 kHz whose velocity is off by a hundredth: between two states that is 20 rad/s².
#[test]
fn the_acceleration_of_a_noisy_encoder_is_a_mean() {
    let mut history = History::new(JointKind::Revolute, 1000, 1_000_000_000);
    for millis in 0..200 {
        let noise = if millis % 2 == 0 { 0.01 } else { -0.01 };
        history.add(state(millis, &[0.0], &[1e-3 * millis as f64 + noise])).expect("it is newer");
        let acceleration = history.newest_accelerations().next();
        assert!(millis < 60 || acceleration.is_some_and(|is| (is - 1.0).abs() < 0.5), "{acceleration:?}");
    }
}

#[test]
fn the_acceleration_is_that_of_the_last_two_velocities() {
    let mut history = History::new(JointKind::Prismatic, 4, 1_000_000_000);
    let accelerations = |history: &History| history.newest_accelerations().collect::<Vec<_>>();
    assert_eq!(accelerations(&history), Vec::<f64>::new());
    history.add(state(0, &[0.0], &[1.0])).expect("it is the first");
    assert_eq!(accelerations(&history), Vec::<f64>::new());
    history.add(state(500, &[0.0], &[2.0])).expect("it is newer");
    assert_eq!(accelerations(&history), [2.0]);
    history.add(state(600, &[0.0], &[])).expect("it is newer");
    assert_eq!(accelerations(&history), Vec::<f64>::new());
}
