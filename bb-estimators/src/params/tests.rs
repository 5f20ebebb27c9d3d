//! Laws of the parameters of every algorithm.

use bb_tests::laws;

use super::{Kind, Params, SetError, Value};
use crate::attitude::{FilterParams, MadgwickParams, VqfParams};
use crate::navigation::planar::PlanarParams;
use crate::navigation::{AlignmentParams, EskfParams, StreamParams};

/// Calls a law with the parameters of each algorithm.
fn each(mut law: impl FnMut(&mut dyn Params)) {
    for default in FilterParams::ALL {
        law(&mut default());
    }
    law(&mut EskfParams::default());
    law(&mut AlignmentParams::default());
    law(&mut StreamParams::default());
    #[cfg(feature = "runtime")]
    law(&mut crate::navigation::NavigationOptions::default());
    law(&mut PlanarParams::default());
    #[cfg(feature = "runtime")]
    law(&mut crate::navigation::planar::PlanarOptions::default());
}

#[test]
fn defaults_are_accepted_and_read_back_from_their_text() {
    each(|params| {
        assert_eq!(params.check(), Ok(()));
        for row in params.parameters() {
            let value = params.get(row.name).expect("it is there");
            let text = value.to_string();
            assert_eq!(params.set(row.name, &text), Ok(()), "{}", row.name);
            assert_eq!(params.get(row.name), Some(value), "{}", row.name);
            assert!(!row.summary().is_empty(), "{} is documented", row.name);
        }
    });
}

#[test]
fn a_value_just_outside_its_range_is_refused_and_changes_nothing() {
    each(|params| {
        for (index, row) in params.parameters().iter().enumerate() {
            let before = params.get(row.name).expect("it is there");
            let with = |number: f64| match before {
                Value::Number(_) => Some(Value::Number(number)),
                Value::Process { time_s, .. } => Some(Value::Process { deviation: number, time_s }),
                Value::Switch(_) | Value::Choice(_) | Value::Count(_) => None,
            };
            let (min, max) = (row.range.min, row.range.max);
            for (inside, outside) in [(min, min.next_down()), (max, max.next_up()), (max, f64::NAN)] {
                let (Some(good), Some(bad)) = (with(inside), with(outside)) else { continue };
                if inside == outside {
                    continue;
                }
                assert_eq!(params.set(row.name, &good.to_string()), Ok(()), "{} at {inside}", row.name);
                let text = bad.to_string();
                let Err(SetError::Refused(error)) = params.set(row.name, &text) else {
                    panic!("{} takes {text}", row.name)
                };
                assert_eq!((error.parameter, error.min, error.max, error.unit), (row.name, min, max, row.unit));
                assert_eq!(params.get(row.name), Some(good), "it is as it was");
                assert!(params.replace(index, bad));
                assert_eq!(params.check().map_err(|error| error.parameter), Err(row.name));
                assert!(params.replace(index, before));
            }
        }
    });
}

#[test]
fn a_value_of_another_kind_is_refused() {
    each(|params| {
        for (index, row) in params.parameters().iter().enumerate() {
            let other = if row.kind == Kind::Switch { Value::Number(1.0) } else { Value::Switch(true) };
            assert!(!params.replace(index, other), "{}", row.name);
        }
        assert!(!params.replace(params.parameters().len(), Value::Switch(true)));
    });
}

laws! {
    #[test]
    fn a_name_with_a_letter_too_many_is_answered_with_the_right_one(letter in "[a-z]", at in 0_usize..100) {
        each(|params| {
            for row in params.parameters() {
                let mut name = row.name.to_owned();
                name.insert_str(at % row.name.len(), &letter);
                if params.get(&name).is_some() {
                    continue;
                }
                let error = params.set(&name, "1").expect_err("there is none").to_string();
                assert_eq!(error, format!("there is no parameter `{name}`; did you mean `{}`?", row.name));
            }
        });
    }

    #[test]
    fn any_text_is_refused_or_parsed_within_the_range(text in "\\PC{0,12}|[-+.e0-9]{0,8}( ?[a-zµ/^*2]{0,5})?") {
        each(|params| {
            for row in params.parameters() {
                let _ = params.set(row.name, &text);
                assert_eq!(params.check(), Ok(()), "{} from {text:?}", row.name);
            }
        });
    }
}

#[test]
fn an_error_names_parameter_value_range_and_unit() {
    let fault = |name, text| VqfParams::default().set(name, text).unwrap_err().to_string();
    let name = "motion_bias_deviation";
    assert_eq!(fault(name, "0"), "`motion_bias_deviation` is 0 rad/s: choose a value from 1e-6 to 10 rad/s");
    assert_eq!(fault(name, "fast"), "`motion_bias_deviation` is `fast`: write a number from 1e-6 to 10 rad/s");
    assert_eq!(
        fault(name, "5 m"),
        "`motion_bias_deviation` is `5 m`: its unit is rad/s; choose a value from 1e-6 to 10 rad/s"
    );
    assert_eq!(
        fault("vertical_forgetting_factor", "5 m"),
        "`vertical_forgetting_factor` is `5 m`: it has no unit; choose a value from 0 to 1"
    );
    assert_eq!(fault("rest_bias", "1"), "`rest_bias` is `1`: write `true` or `false`");
    let fault = |name, text| StreamParams::default().set(name, text).unwrap_err().to_string();
    assert_eq!(fault("delay", "1"), {
        let names = StreamParams::PARAMETERS.iter().map(|row| format!("`{}`", row.name)).collect::<Vec<_>>();
        format!("there is no parameter `delay`; choose one of {}", names.join(", "))
    });
    #[cfg(any(feature = "smoother", feature = "eskf"))]
    {
        let mut params = crate::navigation::state_estimator::StateEstimatorParams::default();
        let fault = params.set("window", "-1").unwrap_err().to_string();
        assert_eq!(fault, "`window` is `-1`: write a whole number from 0");
    }
    let fault = |name, text| EskfParams::default().set(name, text).unwrap_err().to_string();
    assert_eq!(
        fault("gnss_lever_arm", "1 m for"),
        "`gnss_lever_arm` is `1 m for`: its unit is m; choose a value from 0 to 100 m"
    );
    assert_eq!(
        fault("gnss_lever_arm", "far"),
        "`gnss_lever_arm` is `far`: write a deviation from 0 to 100 m and its time, as `0.1 for 20 s` or `0.1 for ever`"
    );
}

#[test]
fn units_reach_the_value_in_si() {
    let mut madgwick = MadgwickParams::default();
    assert_eq!(madgwick.set("beta", "180 deg/s"), Ok(()));
    assert_eq!(madgwick.beta, core::f64::consts::PI);
    let mut eskf = EskfParams::default();
    assert_eq!(eskf.set("hard_iron", "20 uT for 10 min"), Ok(()));
    assert!((eskf.hard_iron.deviation - 20e-6).abs() < 1e-18 && eskf.hard_iron.time_s == 600.0);
    assert_eq!(eskf.set("hard_iron", "1e-6"), Ok(()));
    assert_eq!((eskf.hard_iron.deviation, eskf.hard_iron.time_s), (1e-6, 600.0), "the time stays");
    assert_eq!(eskf.set("hard_iron", "1e-6 for ever"), Ok(()));
    assert_eq!(eskf.hard_iron.time_s, f64::INFINITY);
}
