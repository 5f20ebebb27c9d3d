use super::*;
use bb_tests::laws;
use proptest::prelude::*;

const PARAMS: PidParams = PidParams {
    proportional: 2.0,
    integral: 1.0,
    derivative: 0.5,
    derivative_filter_s: 0.0,
    minimum: -10.0,
    maximum: 10.0,
    tracking_s: 0.0,
};

#[test]
fn the_terms_are_those_of_the_equation() {
    let mut pid = Pid::new(PARAMS);
    let first = pid.update(3.0, 1.0, 0.5);
    assert_eq!(first, PidTerms { error: 2.0, proportional: 4.0, integral: 1.0, derivative: 0.0, output: 5.0 });
    let second = pid.update(3.0, 2.0, 0.5);
    assert_eq!(second, PidTerms { error: 1.0, proportional: 2.0, integral: 1.5, derivative: -1.0, output: 2.5 });
}

#[test]
fn a_jump_of_the_setpoint_causes_no_kick_of_the_derivative() {
    let mut pid = Pid::new(PARAMS);
    let _ = pid.update(0.0, 1.0, 0.01);
    assert_eq!(pid.update(100.0, 1.0, 0.01).derivative, 0.0);
}

/// The step response of the filter: 1 − e^(−t/T), whatever the steps.
#[test]
fn the_derivative_is_filtered_with_its_time_constant() {
    for step_s in [0.001, 0.01, 0.05] {
        let params = PidParams { derivative_filter_s: 0.1, derivative: 1.0, ..PARAMS };
        let mut pid = Pid::new(params);
        let steps = (0.1_f64 / step_s).round() as i32;
        let mut last = PidTerms::default();
        for step in 0..=steps {
            last = pid.update(0.0, -2.0 * f64::from(step) * step_s, step_s);
        }
        assert!((last.derivative - 2.0 * (1.0 - (-1.0_f64).exp())).abs() < 1e-9, "{last:?}");
    }
}

/// A setpoint out of reach for a minute: without protection, the integral would then be 600, and the output would
/// stay at its limit for many seconds after the setpoint is back in reach.
#[test]
fn it_does_not_wind_up() {
    let mut pid = Pid::new(PARAMS);
    for _ in 0..6000 {
        assert_eq!(pid.update(11.0, 1.0, 0.01).output, 10.0);
    }
    let turned = pid.update(0.0, 1.0, 0.01);
    assert!(turned.output < 0.0, "{turned:?}");
    // With a time to track in, it gives way in about that time.
    let mut slow = Pid::new(PidParams { tracking_s: 0.5, proportional: 0.1, ..PARAMS });
    for _ in 0..6000 {
        let _ = slow.update(20.0, 1.0, 0.01);
    }
    assert!(slow.update(20.0, 1.0, 0.01).integral < 10.0 + 0.5 * 19.0 + 0.2);
}

/// A mass with friction comes to rest at the setpoint, also with a load, for which the integral compensates.
#[test]
fn it_holds_a_mass_against_a_load() {
    let mut pid = Pid::new(PidParams { proportional: 20.0, integral: 15.0, derivative: 8.0, ..PARAMS });
    let (mut position, mut velocity) = (0.0, 0.0);
    for _ in 0..20_000 {
        let effort = pid.update(1.0, position, 1e-3).output;
        velocity += 1e-3 * (effort - 3.0 - 0.5 * velocity);
        position += 1e-3 * velocity;
    }
    assert!((position - 1.0_f64).abs() < 1e-3 && velocity.abs() < 1e-3, "{position} {velocity}");
}

laws! {
    #[test]
    fn the_output_and_the_integral_stay_within_the_limits(
        steps in proptest::collection::vec((-100.0..100.0, -100.0..100.0, 0.0..2.0), 1..100),
        gains in (0.0..50.0, 0.0..50.0, 0.0..50.0, 0.0..1.0),
        limits in (-20.0..0.0, 0.0..20.0),
    ) {
        let (minimum, maximum): (f64, f64) = limits;
        let params = PidParams {
            proportional: gains.0, integral: gains.1, derivative: gains.2, derivative_filter_s: gains.3,
            minimum, maximum, tracking_s: 0.0,
        };
        let mut pid = Pid::new(params);
        for (setpoint, measurement, step_s) in steps {
            let terms = pid.update(setpoint, measurement, step_s);
            prop_assert!((minimum..=maximum).contains(&terms.output), "{:?}", terms);
            // The part of the output's range that the other terms leave.
            let others = terms.proportional + terms.derivative;
            let most = (maximum - others).max(others - minimum).max(0.0) + 1e-9 * (1.0 + others.abs());
            prop_assert!(terms.integral.abs() <= most, "{:?}", terms);
        }
    }

    #[test]
    fn what_is_not_finite_is_not_kept(bad in prop_oneof![Just(f64::NAN), Just(f64::INFINITY)], step_s in 0.001..1.0) {
        let mut pid = Pid::new(PARAMS);
        let _ = pid.update(1.0, 0.0, 0.1);
        let kept = pid;
        prop_assert!(pid.update(bad, 0.0, step_s).output.is_finite());
        prop_assert!(pid.update(0.0, bad, step_s).output.is_finite());
        prop_assert!(pid.update(0.0, 0.0, -step_s).output.is_finite());
        prop_assert_eq!(pid, kept);
    }
}

/// The runtime clamps to the limits of the joint, which the controller does not know.
#[test]
fn an_output_that_is_limited_elsewhere_does_not_wind_it_up() {
    let unlimited = PidParams { minimum: f64::NEG_INFINITY, maximum: f64::INFINITY, proportional: 0.5, ..PARAMS };
    let (mut pid, mut own) =
        (Pid::new(unlimited), Pid::new(PidParams { minimum: -2.0, maximum: 2.0, ..unlimited }));
    for _ in 0..6000 {
        let terms = pid.update(11.0, 1.0, 0.01);
        let limited = pid.limited(terms, terms.output.clamp(-2.0, 2.0), 0.01);
        assert_eq!(limited.output, 2.0);
        // As if the limit were its own.
        assert_eq!(limited, own.update(11.0, 1.0, 0.01));
    }
    let turned = pid.update(0.0, 1.0, 0.01);
    assert!(turned.output < 0.0, "{turned:?}");
}

/// A sensor at 50 Hz, and a controller at any rate.
#[test]
fn the_derivative_does_not_depend_on_the_rate_of_the_controller() {
    for steps in [1, 4, 20] {
        let params = PidParams { derivative_filter_s: 0.05, derivative: 1.0, ..PARAMS };
        let (mut pid, mut last) = (Pid::new(params), PidTerms::default());
        for sample in 0..50 {
            let measurement = 0.06 * f64::from(sample);
            pid.measured(measurement, 0.02);
            for _ in 0..steps {
                last = pid.step(0.0, measurement, 0.02 / f64::from(steps));
                let most = 3.0 * (1.0 + 1e-12);
                assert!((-most..=0.0).contains(&last.derivative), "{steps} steps: {last:?}");
            }
        }
        assert!((last.derivative + 3.0).abs() < 1e-6, "{steps} steps: {last:?}");
    }
}
