//! The parameters of the robot, as the six services of ROS have them.

use crate::messages::{
    Below, Descriptor, Descriptors, FloatRange, IntegerRange, ListResult, Listed, Names, Parameter, Parameters,
    SetAll, SetResult, SetResults, Types, Value, Values, bytes_of,
};
use bb_core::component::ParameterDescription;
use bb_core::event::ParameterValue;
use bb_core::message::DecodeError;
use bb_core::message::codec::service_hash;
use bb_core::{Bus, Field};
use bb_ros2::{parameter_name, parameter_path};
use std::collections::HashMap;
use thiserror::Error;

// `rcl_interfaces/msg/ParameterType`
const NOT_SET: u8 = 0;
const BOOL: u8 = 1;
const INTEGER: u8 = 2;
const DOUBLE: u8 = 3;
const STRING: u8 = 4;

/// Names or values in one request. `ros2 param` asks for all that a robot has at once.
const MOST: usize = 4096;

/// A service of parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ParameterService {
    Get,
    Types,
    Describe,
    List,
    Set,
    SetAtomically,
}

impl ParameterService {
    pub(crate) const ALL: [Self; 6] =
        [Self::Get, Self::Types, Self::Describe, Self::List, Self::Set, Self::SetAtomically];

    /// The name of the service below the node, and the name and the hash of its type.
    pub(crate) fn declaration(self) -> (&'static str, String, String) {
        let (name, kind, request, response) = match self {
            Self::Get => ("get_parameters", "GetParameters", Names::SHAPE, Values::SHAPE),
            Self::Types => ("get_parameter_types", "GetParameterTypes", Names::SHAPE, Types::SHAPE),
            Self::Describe => ("describe_parameters", "DescribeParameters", Names::SHAPE, Descriptors::SHAPE),
            Self::List => ("list_parameters", "ListParameters", Below::SHAPE, Listed::SHAPE),
            Self::Set => ("set_parameters", "SetParameters", Parameters::SHAPE, SetResults::SHAPE),
            Self::SetAtomically => {
                ("set_parameters_atomically", "SetParametersAtomically", Parameters::SHAPE, SetAll::SHAPE)
            }
        };
        let type_name = format!("rcl_interfaces/srv/{kind}");
        let type_hash = service_hash(&type_name, request, response);
        (name, type_name, type_hash)
    }

    /// The response to a request, both in CDR. Only the rights of the bus limit it.
    ///
    /// # Errors
    /// The request cannot be read, or has too many names or values.
    pub(crate) fn answer(self, bus: &Bus, request: &[u8]) -> Result<Vec<u8>, RequestError> {
        let names = || {
            let names = request_of::<Names>(request)?.names;
            bounded(names.len()).map(|()| names)
        };
        let parameters = || {
            let parameters = request_of::<Parameters>(request)?.parameters;
            bounded(parameters.len()).map(|()| parameters)
        };
        let described = || bus.description().parameters;
        Ok(match self {
            Self::Get => {
                let value = |name: &String| {
                    bus.parameter(&parameter_path(name)).map_or_else(Value::default, |value| value_of(&value))
                };
                bytes_of(&Values { values: names()?.iter().map(value).collect() })
            }
            Self::Types => {
                let kind =
                    |name: &String| bus.parameter(&parameter_path(name)).map_or(NOT_SET, |value| type_of(&value));
                bytes_of(&Types { types: names()?.iter().map(kind).collect() })
            }
            Self::Describe => {
                let known: HashMap<_, _> =
                    described().into_iter().map(|parameter| (parameter.path, parameter)).collect();
                let describe = |name: &String| {
                    let found = known.get(parameter_path(name).as_str());
                    found.map_or_else(
                        || Descriptor { name: name.clone(), ..Descriptor::default() },
                        |found| descriptor(name, found),
                    )
                };
                bytes_of(&Descriptors { descriptors: names()?.iter().map(describe).collect() })
            }
            Self::List => {
                let Below { prefixes, depth } = request_of(request)?;
                bounded(prefixes.len())?;
                let names: Vec<String> =
                    described().iter().filter_map(|parameter| parameter_name(parameter.path)).collect();
                bytes_of(&Listed { result: listed(names, &prefixes, depth) })
            }
            Self::Set => {
                let set = |parameter: &Parameter| set(bus, std::slice::from_ref(parameter));
                bytes_of(&SetResults { results: parameters()?.iter().map(set).collect() })
            }
            Self::SetAtomically => bytes_of(&SetAll { result: set(bus, &parameters()?) }),
        })
    }
}

/// Reason for which a request has no response.
#[derive(Debug, Error)]
pub(crate) enum RequestError {
    #[error(transparent)]
    Unreadable(#[from] DecodeError),
    #[error("the request has {found} names or values, and {MOST} are the most")]
    TooMany { found: usize },
}

/// Bounds the response and the work, which a short request could make large.
fn bounded(found: usize) -> Result<(), RequestError> {
    if found > MOST { Err(RequestError::TooMany { found }) } else { Ok(()) }
}

/// Reads a request. What ROS counts as padding at its end may follow.
fn request_of<T: Field>(bytes: &[u8]) -> Result<T, DecodeError> {
    T::read(&mut bb_core::message::codec::Reader::of_message(bytes)?)
}

/// The value of a parameter as ROS has it.
pub(crate) fn value_of(value: &ParameterValue) -> Value {
    let mut found = Value { r#type: type_of(value), ..Value::default() };
    match value {
        ParameterValue::Bool(value) => found.bool_value = *value,
        ParameterValue::Integer(value) => found.integer_value = *value,
        ParameterValue::Float(value) => found.double_value = *value,
        ParameterValue::Text(value) => found.string_value.clone_from(value),
    }
    found
}

const fn type_of(value: &ParameterValue) -> u8 {
    match value {
        ParameterValue::Bool(_) => BOOL,
        ParameterValue::Integer(_) => INTEGER,
        ParameterValue::Float(_) => DOUBLE,
        ParameterValue::Text(_) => STRING,
    }
}

/// Sets all of them, or none.
fn set(bus: &Bus, parameters: &[Parameter]) -> SetResult {
    let values = parameters.iter().map(|Parameter { name, value }| {
        let path = parameter_path(name);
        let value = match (value.r#type, bus.parameter(&path)) {
            (BOOL, _) => ParameterValue::Bool(value.bool_value),
            // `ros2 param set /rover speed 1` has an integer.
            (INTEGER, Some(ParameterValue::Float(_))) => {
                let (exact, float) = (value.integer_value, value.integer_value as f64);
                // Not all above 2^53 are floats.
                if float as i128 != i128::from(exact) {
                    return Err(format!("{path} is not set: no float is {exact}"));
                }
                ParameterValue::Float(float)
            }
            (INTEGER, _) => ParameterValue::Integer(value.integer_value),
            (DOUBLE, _) => ParameterValue::Float(value.double_value),
            (STRING, _) => ParameterValue::Text(value.string_value.clone()),
            (other, _) => {
                return Err(format!(
                    "{path} is not set: a value of type {other} is neither a bool, a number nor a text"
                ));
            }
        };
        Ok((path, value))
    });
    let set = values
        .collect::<Result<Vec<_>, _>>()
        .and_then(|values| bus.set_parameters(values).map_err(|error| error.to_string()));
    match set {
        Ok(()) => SetResult { successful: true, reason: String::new() },
        Err(reason) => SetResult { successful: false, reason },
    }
}

fn descriptor(name: &str, parameter: &ParameterDescription) -> Descriptor {
    let range = parameter.range.as_ref().map(|range| (*range.start(), *range.end()));
    let is_integer = matches!(parameter.value, ParameterValue::Integer(_));
    Descriptor {
        name: name.to_owned(),
        r#type: type_of(&parameter.value),
        description: parameter.doc.to_owned(),
        additional_constraints: match parameter.unit {
            "" => String::new(),
            unit => format!("in SI; declared in {unit}"),
        },
        read_only: false,
        dynamic_typing: false,
        floating_point_range: range.filter(|_| !is_integer).map(|(from_value, to_value)| FloatRange {
            from_value,
            to_value,
            step: 0.0,
        }),
        integer_range: range.filter(|_| is_integer).map(|(from, to)| IntegerRange {
            // Saturates, as a range without an end does.
            from_value: from as i64,
            to_value: to as i64,
            step: 1,
        }),
    }
}

/// The names at the prefixes and below, down to that many parts; all names without prefixes.
fn listed(mut names: Vec<String>, prefixes: &[String], depth: u64) -> ListResult {
    let is_deep =
        |parts: &str| depth != 0 && u64::try_from(parts.split('.').count()).is_ok_and(|parts| parts > depth);
    names.retain(|name| match prefixes {
        [] => !is_deep(name),
        prefixes => prefixes.iter().any(|prefix| match name.strip_prefix(prefix.as_str()) {
            Some("") => true,
            Some(below) => below.strip_prefix('.').is_some_and(|below| !is_deep(below)),
            None => false,
        }),
    });
    let mut above: Vec<String> =
        names.iter().filter_map(|name| Some(name.rsplit_once('.')?.0.to_owned())).collect();
    above.sort();
    above.dedup();
    ListResult { names, prefixes: above }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bb_core::event::Right;
    use bb_core::message::codec::decode;
    use bb_core::prelude::*;

    robot! {
        robot Tuned;
        parameters {
            /// Speed ahead.
            speed: f64 = 0.5 m/s, range: 0 m/s..=1.5 m/s;
            count: i64 = 3, range: 0..=9;
            name: String = "x";
            gains { kp: f64 = 1.0; deep { on: bool = true; } }
        }
        link base;
    }

    fn ask<T: Field>(bus: &Bus, service: ParameterService, request: &impl Field) -> T {
        let answer = service.answer(bus, &bytes_of(request)).expect("the request can be read");
        decode(&answer).expect("the response can be read")
    }

    fn names(names: &[&str]) -> Names {
        Names { names: names.iter().map(|name| (*name).to_owned()).collect() }
    }

    #[test]
    fn parameters_are_listed_by_prefix_and_depth() {
        let robot = Tuned::builder().simulate().expect("it starts");
        let below = |prefixes: &[&str], depth| {
            let prefixes = prefixes.iter().map(|prefix| (*prefix).to_owned()).collect();
            ask::<Listed>(&robot, ParameterService::List, &Below { prefixes, depth }).result
        };
        assert_eq!(below(&[], 0).names, ["speed", "count", "name", "gains.kp", "gains.deep.on"]);
        assert_eq!(below(&[], 0).prefixes, ["gains", "gains.deep"]);
        assert_eq!(below(&[], 1).names, ["speed", "count", "name"]);
        assert_eq!(below(&["gains"], 0).names, ["gains.kp", "gains.deep.on"]);
        assert_eq!(below(&["gains"], 1).names, ["gains.kp"]);
        assert_eq!(below(&["gain", "speed"], 0).names, ["speed"]);
    }

    #[test]
    fn what_is_not_there_is_not_set_and_described_without_a_type() {
        let robot = Tuned::builder().simulate().expect("it starts");
        let values =
            ask::<Values>(&robot, ParameterService::Get, &names(&["speed", "none", "gains.deep.on", "name"]))
                .values;
        assert_eq!(values.iter().map(|value| value.r#type).collect::<Vec<_>>(), [DOUBLE, NOT_SET, BOOL, STRING]);
        assert_eq!(
            (values[0].double_value, values[2].bool_value, values[3].string_value.as_str()),
            (0.5, true, "x")
        );
        let types = ask::<Types>(&robot, ParameterService::Types, &names(&["count", "none"])).types;
        assert_eq!(types, [INTEGER, NOT_SET]);
        let described =
            ask::<Descriptors>(&robot, ParameterService::Describe, &names(&["speed", "count", "none"])).descriptors;
        assert_eq!((described[0].description.as_str(), described[0].r#type), ("Speed ahead.", DOUBLE));
        assert_eq!(described[0].additional_constraints, "in SI; declared in m/s");
        assert_eq!(
            described[0].floating_point_range,
            Some(FloatRange { from_value: 0.0, to_value: 1.5, step: 0.0 })
        );
        assert_eq!(described[1].integer_range, Some(IntegerRange { from_value: 0, to_value: 9, step: 1 }));
        assert_eq!((described[2].r#type, described[2].name.as_str()), (NOT_SET, "none"));
    }

    #[test]
    fn one_refused_value_leaves_the_others_unless_they_are_set_at_once() {
        let robot = Tuned::builder().simulate().expect("it starts");
        let parameter =
            |name: &str, value: ParameterValue| Parameter { name: name.to_owned(), value: value_of(&value) };
        let both = Parameters {
            parameters: vec![
                parameter("speed", ParameterValue::Integer(1)),
                parameter("gains.kp", ParameterValue::Text("x".into())),
            ],
        };
        let all = ask::<SetAll>(&robot, ParameterService::SetAtomically, &both).result;
        assert!(!all.successful && all.reason.contains("param/gains/kp is not set"), "{}", all.reason);
        assert_eq!(robot.bus().parameter("param/speed"), Some(ParameterValue::Float(0.5)));
        let each = ask::<SetResults>(&robot, ParameterService::Set, &both).results;
        assert_eq!(each.iter().map(|result| result.successful).collect::<Vec<_>>(), [true, false]);
        assert_eq!(robot.bus().parameter("param/speed"), Some(ParameterValue::Float(1.0)));
        let far = Parameters { parameters: vec![parameter("speed", ParameterValue::Float(7.0))] };
        let reason = &ask::<SetResults>(&robot, ParameterService::Set, &far).results[0].reason;
        assert!(reason.contains("expected a number in 0.0..=1.5 m/s, found `7.0`"), "{reason}");
        // Integers, of which a float is one or is not.
        let gain = |value: i64| {
            let set = Parameters { parameters: vec![parameter("gains.kp", ParameterValue::Integer(value))] };
            let result = ask::<SetAll>(&robot, ParameterService::SetAtomically, &set).result;
            (result.successful, result.reason)
        };
        assert!(gain(1 << 53).0);
        for value in [(1 << 53) + 1, -(1 << 53) - 1, i64::MAX] {
            assert_eq!(gain(value), (false, format!("param/gains/kp is not set: no float is {value}")));
        }
        assert_eq!(robot.bus().parameter("param/gains/kp"), Some(ParameterValue::Float((1_u64 << 53) as f64)));
        assert!(gain(i64::MIN).0);
        // A type that no parameter of a robot has.
        let list = Parameters {
            parameters: vec![Parameter { name: "speed".into(), value: Value { r#type: 8, ..Value::default() } }],
        };
        assert!(!ask::<SetAll>(&robot, ParameterService::SetAtomically, &list).result.successful);
        let reader = robot.bus().for_caller("ros2 /spy", [Right::Read]);
        let refused = ask::<SetAll>(
            &reader,
            ParameterService::SetAtomically,
            &Parameters { parameters: vec![parameter("speed", ParameterValue::Float(0.1))] },
        );
        assert!(
            refused.result.reason.contains("`ros2 /spy` does not have the right `parameters`"),
            "{}",
            refused.result.reason
        );
    }

    /// A name takes few bytes, and its description many.
    #[test]
    fn a_request_for_a_million_names_is_refused() {
        let robot = Tuned::builder().simulate().expect("it starts");
        let parameter =
            |name: &str, value: ParameterValue| Parameter { name: name.to_owned(), value: value_of(&value) };
        for (count, is_answered) in [(MOST, true), (MOST + 1, false), (1_000_000, false)] {
            let names = bytes_of(&names(&vec![""; count]));
            for service in [ParameterService::Get, ParameterService::Types, ParameterService::Describe] {
                assert_eq!(service.answer(&robot, &names).is_ok(), is_answered, "{service:?} of {count}");
            }
            let parameters =
                bytes_of(&Parameters { parameters: vec![parameter("", ParameterValue::Bool(true)); count] });
            for service in [ParameterService::Set, ParameterService::SetAtomically] {
                assert_eq!(service.answer(&robot, &parameters).is_ok(), is_answered, "{service:?} of {count}");
            }
        }
    }

    /// Requests with changed, missing and added bytes: an answer or an error, never a stop, and nothing is set beyond its range.
    #[test]
    fn ten_thousand_malformed_requests_are_answered_or_refused() {
        let robot = Tuned::builder().simulate().expect("it starts");
        let parameter = Parameter { name: "speed".into(), value: value_of(&ParameterValue::Float(1.0)) };
        let whole = [
            bytes_of(&names(&["speed", "gains.kp"])),
            bytes_of(&Below { prefixes: vec!["gains".into()], depth: 1 }),
            bytes_of(&Parameters { parameters: vec![parameter] }),
        ];
        let mut state = 1_u64;
        let mut below = |bound: usize| {
            // xorshift64
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state % bound as u64) as usize
        };
        let mut refused = 0;
        for _ in 0..10_000 {
            let mut request = whole[below(whole.len())].clone();
            for _ in 0..=below(3) {
                match below(3) {
                    0 => request.truncate(below(request.len() + 1)),
                    1 => request.push(below(256) as u8),
                    _ if !request.is_empty() => {
                        let at = below(request.len());
                        request[at] = below(256) as u8;
                    }
                    _ => {}
                }
            }
            for service in ParameterService::ALL {
                refused += usize::from(service.answer(&robot, &request).is_err());
            }
            let speed = robot.bus().parameter("param/speed");
            assert!(
                matches!(speed, Some(ParameterValue::Float(speed)) if (0.0..=1.5).contains(&speed)),
                "{speed:?}"
            );
        }
        assert!(refused > 10_000, "{refused}");
    }
}
