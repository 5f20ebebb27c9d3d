use super::*;
use bb_tests::laws;
use proptest::prelude::*;

fn easings() -> impl Strategy<Value = Easing> {
    prop_oneof![Just(Easing::Linear), Just(Easing::Trapezoidal), Just(Easing::SCurve)]
}

fn paces() -> impl Strategy<Value = Pace> {
    prop_oneof![(0.01..20.0).prop_map(Pace::Duration), (0.01..10.0).prop_map(Pace::Speed)]
}

fn accelerations() -> impl Strategy<Value = Option<f64>> {
    proptest::option::of(0.1..50.0)
}

laws! {
    /// The velocity integrates to the target, and the acceleration to the velocity, by Simpson's rule, which is exact for
    /// polynomials of third degree between the ends of the ramps.
    #[test]
    fn it_integrates_to_the_target(
        easing in easings(), initial in -5.0..5.0, target in -5.0..5.0, pace in paces(), a in accelerations(),
    ) {
        let profile = Profile::new(easing, initial, target, pace, a);
        let knots = [0.0, profile.ramp_s, profile.duration_s - profile.ramp_s, profile.duration_s];
        let (mut position, mut velocity) = (initial, 0.0);
        for ends in knots.windows(2) {
            let (from, width) = (ends[0], ends[1] - ends[0]);
            // At the ends themselves a velocity or an acceleration may jump: the limits from inside.
            let inside = |share: f64| profile.at(from + width * share.clamp(1e-9, 1.0 - 1e-9));
            let (first, middle, last) = (inside(0.0), inside(0.5), inside(1.0));
            position += width / 6.0 * (first.velocity + 4.0 * middle.velocity + last.velocity);
            velocity += width / 6.0 * (first.acceleration + 4.0 * middle.acceleration + last.acceleration);
        }
        let size = 1.0 + (target - initial).abs();
        prop_assert!((position - target).abs() < 1e-7 * size, "{position} is not {target}");
        // A linear one starts and ends in a jump of the velocity, which no acceleration shows.
        prop_assert!(velocity.abs() < 1e-6 * (1.0 + profile.speed()), "ends at {velocity}");
    }

    #[test]
    fn it_moves_one_way_at_no_more_than_its_speed_and_acceleration(
        easing in easings(), initial in -5.0..5.0, target in -5.0..5.0, pace in paces(), a in accelerations(),
    ) {
        let profile = Profile::new(easing, initial, target, pace, a);
        let direction = (target - initial).signum();
        let peak = match easing { Easing::SCurve => 1.5, Easing::Linear | Easing::Trapezoidal => 1.0 };
        let mut last = initial;
        for step in 0..=200 {
            let point = profile.at(profile.duration_s() * f64::from(step) / 200.0);
            prop_assert!((point.position - last) * direction >= -1e-12, "it turns back");
            prop_assert!(point.velocity * direction >= 0.0);
            prop_assert!(point.velocity.abs() <= profile.speed() * (1.0 + 1e-12));
            if let (Some(a), Pace::Speed(speed)) = (a, pace) {
                prop_assert!(point.velocity.abs() <= speed * (1.0 + 1e-12));
                prop_assert!(point.acceleration.abs() <= peak * a * (1.0 + 1e-9), "{point:?}");
            }
            last = point.position;
        }
        prop_assert_eq!(profile.at(profile.duration_s()), JointPoint { position: target, ..JointPoint::default() });
    }

    /// Position and velocity do not jump, but at the ends of a linear motion.
    #[test]
    fn it_is_continuous(
        easing in easings(), initial in -5.0..5.0, target in -5.0..5.0, pace in paces(), a in accelerations(),
    ) {
        let profile = Profile::new(easing, initial, target, pace, a);
        let step_s = profile.duration_s() * 1e-7;
        for knot in [0.0, profile.ramp_s, profile.duration_s - profile.ramp_s, profile.duration_s] {
            let (before, after) = (profile.at(knot - step_s), profile.at(knot + step_s));
            prop_assert!((before.position - after.position).abs() <= 3.0 * step_s * profile.speed());
            if easing != Easing::Linear {
                let ramp_s = profile.ramp_s.max(f64::MIN_POSITIVE);
                prop_assert!((before.velocity - after.velocity).abs() <= 4.0 * step_s / ramp_s * profile.speed());
            }
        }
    }
}

#[test]
fn the_speed_and_the_duration_are_those_asked_for() {
    let trapezoid = Profile::new(Easing::Trapezoidal, 1.0, 4.0, Pace::Speed(2.0), Some(4.0));
    assert_eq!((trapezoid.duration_s(), trapezoid.speed()), (2.0, 2.0));
    let triangle = Profile::new(Easing::Trapezoidal, 0.0, 1.0, Pace::Speed(2.0), Some(1.0));
    assert_eq!((triangle.duration_s(), triangle.speed()), (2.0, 1.0));
    let timed = Profile::new(Easing::SCurve, 0.0, -3.0, Pace::Duration(2.0), None);
    assert_eq!((timed.duration_s(), timed.speed()), (2.0, 2.0));
    assert_eq!(timed.at(1.0).position, -1.5);
    let within = Profile::new(Easing::Trapezoidal, 1.0, 4.0, Pace::Duration(2.0), Some(4.0));
    assert!((within.speed() - 2.0).abs() < 1e-12);
}

#[test]
fn a_pace_that_means_nothing_is_over_at_once() {
    for pace in [Pace::Speed(0.0), Pace::Speed(f64::NAN), Pace::Duration(-1.0), Pace::Duration(f64::INFINITY)] {
        let profile = Profile::new(Easing::SCurve, 0.0, 1.0, pace, None);
        assert_eq!((profile.duration_s(), profile.at(0.0).position), (0.0, 1.0), "{pace:?}");
    }
}
