//! Written values are read back, errors name the field, and the schema accepts what the reader accepts.

use super::*;
use crate::message::Payload;
use crate::message::codec::Field;
use crate::message::codec::tests::{Choice, Everything, Nothing, bytes_of, choice, everything};
use crate::message::{Finite, Stamped};
use crate::payload::{Imu, JointState, Pose};
use crate::time::MonotonicTime;
use bb_tests::laws;
use nalgebra::{DMatrix, Matrix3, Vector3};
use proptest::prelude::*;
use serde_json::{Value, json};
use std::time::Duration;

/// JSON that was written is read back unchanged, except for the bits of a NaN and for `Some(None)`, which `null` does
/// not express.
pub(in crate::message::codec) fn round_trip<T: Field>(value: &T) {
    let json = to_json(value);
    let read: T = from_json(&json).expect("it was written just now");
    assert_eq!(to_json(&read), json);
    let again: T = from_json(&json).expect("it was read just now");
    assert_eq!(bytes_of(&again), bytes_of(&read));
    assert_eq!(bytes_to_json(&bytes_of(value), T::SHAPE).as_ref(), Ok(&json));
    assert_eq!(json_to_bytes(&json, T::SHAPE), Ok(bytes_of(&read)));
    let schema: Value = serde_json::from_str(&json_schema(T::SHAPE)).expect("it is JSON");
    let written: Value = serde_json::from_str(&json).expect("it is JSON");
    assert!(accepts(&schema, &schema, &written), "{schema}\n{written}");
}

/// Arguments of a command.
#[derive(Clone, Debug, Default, PartialEq, Payload)]
struct Arguments {
    speed: f64,
    gain: f32,
    count: u8,
    offset: i64,
    label: String,
    letter: char,
    goal: Option<Vector3<f64>>,
    corners: [i16; 2],
    mode: Mode,
    nothing: Nothing,
}

#[derive(Clone, Debug, Default, PartialEq, Payload)]
enum Mode {
    #[default]
    Fast,
    Slow(f64),
    Along {
        path: Vec<Wrapped>,
    },
}

#[derive(Clone, Debug, Default, PartialEq, Payload)]
struct Wrapped(Option<u16>);

/// The arguments of a command without arguments, as a user writes them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Payload)]
struct NoArguments;

#[derive(Clone, Debug, Default, PartialEq, Payload)]
enum Never {
    #[default]
    Only,
}

fn arguments() -> Value {
    json!({
        "speed": 1, "gain": 0.1, "count": 3, "offset": -7, "label": "", "letter": "é", "corners": [1, 2],
        "mode": "Fast", "nothing": {}, "goal": null,
    })
}

/// The error for the arguments with one field changed.
fn error_with(field: &str, value: Value) -> String {
    let mut arguments = arguments();
    arguments[field] = value;
    from_json::<Arguments>(&arguments.to_string()).expect_err("it is wrong").to_string()
}

#[test]
fn structs_with_a_default_and_without_fields_are_arguments() {
    round_trip(&Arguments::default());
    round_trip(&NoArguments);
    round_trip(&Never::default());
    for text in ["", " \n", "{}", "null", " { } "] {
        assert_eq!(from_json(text), Ok(NoArguments), "{text}");
    }
    let reason = |text: &str| from_json::<NoArguments>(text).expect_err("it is wrong").to_string();
    assert_eq!(reason("[]"), "expected an object, found an array");
    assert_eq!(reason(r#"{"a":1}"#), "a: unknown field; there are no fields");
    let error = from_json::<Arguments>("").expect_err("it has fields");
    assert_eq!(error.to_string(), "expected an object, found nothing");
}

#[test]
fn optional_fields_alone_may_be_left_out() {
    let read: Arguments = from_json(&arguments().to_string()).expect("it is right");
    let expected = Arguments {
        speed: 1.0,
        gain: 0.1,
        count: 3,
        offset: -7,
        letter: 'é',
        corners: [1, 2],
        ..Arguments::default()
    };
    assert_eq!(read, expected);
    let mut short = arguments();
    short.as_object_mut().expect("it is one").remove("goal");
    assert_eq!(from_json(&short.to_string()), Ok(expected));
    for name in ["speed", "label", "corners", "mode", "nothing"] {
        let mut short = arguments();
        short.as_object_mut().expect("it is one").remove(name);
        let error = from_json::<Arguments>(&short.to_string()).expect_err("it is wrong").within("arguments");
        assert_eq!(error.to_string(), format!("arguments.{name}: missing"));
    }
}

#[test]
fn errors_name_the_field_and_the_way_out() {
    assert_eq!(error_with("sped", json!(1)), "sped: unknown field; did you mean `speed`?");
    assert_eq!(
        error_with("velocity", json!(1)),
        "velocity: unknown field; the fields are speed, gain, count, offset, label, letter, goal, corners, mode, nothing"
    );
    for (field, value, error) in [
        ("speed", json!("fast"), "speed: expected a number, found the text \"fast\""),
        ("speed", json!(null), "speed: expected a number, found null"),
        ("speed", json!("inf"), "speed: expected a number, found the text \"inf\""),
        ("gain", json!(1e39), "gain: expected a number, found 1e+39, which is too large"),
        ("count", json!(300), "count: expected an integer from 0 to 255, found 300"),
        ("count", json!(-1), "count: expected an integer from 0 to 255, found -1"),
        ("count", json!(1.5), "count: expected an integer from 0 to 255, found 1.5"),
        ("count", json!("1"), "count: expected an integer from 0 to 255, found the text \"1\""),
        (
            "offset",
            json!(u64::MAX),
            "offset: expected an integer from -9223372036854775808 to 9223372036854775807, found 18446744073709551615",
        ),
        ("label", json!(7), "label: expected text, found 7"),
        ("label", json!({}), "label: expected text, found an object"),
        ("letter", json!("ab"), "letter: expected text of one character, found the text \"ab\""),
        ("goal", json!({"x": 1, "y": 2}), "goal.z: missing"),
        ("goal", json!({"x": 1, "y": true, "z": 3}), "goal.y: expected a number, found true"),
        ("corners", json!([1, 2, 3]), "corners: expected an array of 2, found an array of 3"),
        ("corners", json!([1, 1e9]), "corners[1]: expected an integer from -32768 to 32767, found 1000000000.0"),
        ("corners", json!({}), "corners: expected an array of 2, found an object"),
        (
            "mode",
            json!("Fats"),
            "mode: expected one of \"Fast\", \"Slow\", \"Along\", found \"Fats\"; did you mean `Fast`?",
        ),
        ("mode", json!(0), "mode: expected one of \"Fast\", \"Slow\", \"Along\", found 0"),
        ("mode", json!("Slow"), "mode.Slow: its fields are missing; write {\"Slow\": …}"),
        ("mode", json!({"Fast": {}}), "mode.Fast: has no fields; write its name alone"),
        ("mode", json!({}), "mode: expected one of \"Fast\", \"Slow\", \"Along\", found an object"),
        (
            "mode",
            json!({"Slow": 1, "Fast": {}}),
            "mode: expected one of \"Fast\", \"Slow\", \"Along\", found several fields",
        ),
        ("mode", json!({"Slow": "x"}), "mode.Slow: expected a number, found the text \"x\""),
        (
            "mode",
            json!({"Along": {"path": [1, -2]}}),
            "mode.Along.path[1]: expected an integer from 0 to 65535, found -2",
        ),
        ("nothing", json!(1), "nothing: expected an object, found 1"),
    ] {
        assert_eq!(error_with(field, value), error);
    }
}

#[test]
fn what_is_no_json_is_named_by_its_place() {
    let reason = |text: &str| from_json::<Vec<f64>>(text).expect_err("it is wrong").to_string();
    assert_eq!(reason("[1, 2"), "line 1, column 5: EOF while parsing a list");
    assert_eq!(reason("[1]\n]"), "line 2, column 1: trailing characters");
    assert_eq!(reason("[inf]"), "line 1, column 2: expected value");
    assert_eq!(reason("[01]"), "line 1, column 3: invalid number");
    assert_eq!(reason("[1e400]"), "[0]: expected a number, found 1e400, which is too large");
    assert_eq!(reason(&"[".repeat(1 << 20)), "line 1, column 1048576: EOF while parsing a list");
    let deep = "[".repeat(1 << 20) + &"]".repeat(1 << 20);
    assert_eq!(reason(&deep), "[0]: expected a number, found an array");
    let long = "9".repeat(1 << 16);
    assert_eq!(
        reason(&format!("[{long}]")),
        format!("[0]: expected a number, found {}…, which is too large", &long[..40])
    );
    let error = from_json::<String>(r#""\ud800""#).expect_err("half of a character");
    assert_eq!(error.to_string(), r#"expected text, found "\ud800" (unexpected end of hex escape)"#);
    let error = from_json::<Arguments>(r#"{"speed": 1, "spee\u0064": 2}"#).expect_err("it is there twice");
    assert_eq!(error.to_string(), "speed: given twice");
    let error = from_json::<Arguments>(r#"{"\udc00": 2}"#).expect_err("half of a character");
    assert_eq!(error.to_string(), "invalid field name (lone leading surrogate in hex escape)");
}

#[test]
fn what_a_type_refuses_is_named_too() {
    let error = from_json::<Vec<Duration>>(r#"[{"sec": 1, "nanosec": 1000000000}]"#).expect_err("it is a second");
    assert_eq!(error.to_string(), "[0].nanosec: expected less than 1e9 nanoseconds, found 1000000000");
    let error = from_json::<DMatrix<f64>>(r#"{"rows": 4000000000, "columns": 4000000000, "data": [1]}"#);
    assert_eq!(
        error.expect_err("one is not enough").to_string(),
        "data: expected as many elements as rows and columns make, found 1 for 4000000000 rows and 4000000000 columns"
    );
}

#[test]
fn numbers_are_read_as_the_nearest() {
    assert_eq!(from_json("0.1"), Ok(0.1f32));
    assert_eq!(from_json("0.30000000000000004"), Ok(0.1 + 0.2));
    assert_eq!(from_json("5e-324"), Ok(5e-324));
    assert_eq!(from_json("18446744073709551615"), Ok(u64::MAX));
    assert_eq!(from_json("-9223372036854775808"), Ok(i64::MIN));
    assert_eq!(from_json::<f64>("-0").map(f64::to_bits), Ok((-0.0f64).to_bits()));
    // JSON has one type of numbers: 1.0 is an integer as well.
    assert_eq!(from_json("[1.0, 1e2, -0.0]"), Ok(vec![1u8, 100, 0]));
    assert!(from_json::<u64>("9007199254740993.0").is_err());
}

#[test]
fn json_is_exact() {
    let value = vec![
        Choice::Unit,
        Choice::Pair(0.1 + 0.2, "a\"\n\u{1}".into()),
        Choice::One(Some(Vector3::new(f64::NAN, f64::NEG_INFINITY, -0.0))),
        Choice::AlsoUnit {},
    ];
    let expected = r#"["Unit",{"Pair":{"0":0.30000000000000004,"1":"a\"\n\u0001"}},"#.to_owned()
        + r#"{"One":{"x":"NaN","y":"-Infinity","z":-0.0}},"AlsoUnit"]"#;
    assert_eq!(to_json(&value), expected);
    let message =
        Stamped::new(MonotonicTime::from_nanos(5), JointState { position: 1e300, velocity: None, effort: None });
    assert_eq!(
        to_json(&message),
        r#"{"header":{"stamp":{"sec":0,"nanosec":0},"frame_id":""},"monotonic_time":5,"wall_time":0,"robot":"","node":"","#
            .to_owned()
            + r#""payload":{"position":1e300,"velocity":null,"effort":null}}"#
    );
    let covariance = Some(Matrix3::<f64>::identity());
    assert!(to_json(&covariance).starts_with("[1.0,0.0,0.0,0.0,1.0"));
}

#[test]
fn bytes_that_are_none_of_an_enum_are_errors() {
    for bytes in [[9, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0], [1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]] {
        let mut cdr = vec![0, 1, 0, 0];
        cdr.extend(bytes);
        cdr.extend([0; 4]);
        assert!(bytes_to_json(&cdr, Choice::SHAPE).is_err());
    }
}

#[test]
fn a_schema_says_what_is_read() {
    let schema: Value = serde_json::from_str(&json_schema(Arguments::SHAPE)).expect("it is JSON");
    let number = json!({"anyOf": [{"type": "number"}, {"enum": ["NaN", "Infinity", "-Infinity"]}]});
    let expected = json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Arguments",
        "type": "object",
        "properties": {
            "speed": number,
            "gain": number,
            "count": {"type": "integer", "minimum": 0, "maximum": 255},
            "offset": {"type": "integer", "minimum": i64::MIN, "maximum": i64::MAX},
            "label": {"type": "string"},
            "letter": {"type": "string", "minLength": 1, "maxLength": 1},
            "goal": {"anyOf": [{"$ref": "#/$defs/geometry_msgs.Vector3"}, {"type": "null"}]},
            "corners": {
                "type": "array",
                "items": {"type": "integer", "minimum": -32768, "maximum": 32767},
                "minItems": 2,
                "maxItems": 2,
            },
            "mode": {"$ref": "#/$defs/Mode"},
            "nothing": {"$ref": "#/$defs/Nothing"},
        },
        "required": ["speed", "gain", "count", "offset", "label", "letter", "corners", "mode", "nothing"],
        "additionalProperties": false,
        "$defs": {
            "geometry_msgs.Vector3": {
                "title": "geometry_msgs/Vector3",
                "type": "object",
                "properties": {"x": number, "y": number, "z": number},
                "required": ["x", "y", "z"],
                "additionalProperties": false,
            },
            "Mode": {"title": "Mode", "oneOf": [
                {"enum": ["Fast"]},
                {
                    "type": "object",
                    "properties": {"Slow": number},
                    "required": ["Slow"],
                    "additionalProperties": false,
                },
                {
                    "type": "object",
                    "properties": {"Along": {
                        "type": "object",
                        "properties": {"path": {
                            "type": "array",
                            "items": {"anyOf": [
                                {"type": "integer", "minimum": 0, "maximum": 65535},
                                {"type": "null"},
                            ]},
                        }},
                        "required": ["path"],
                        "additionalProperties": false,
                    }},
                    "required": ["Along"],
                    "additionalProperties": false,
                },
            ]},
            "Nothing": {"title": "Nothing", "type": ["object", "null"], "additionalProperties": false},
        },
    });
    assert_eq!(schema, expected);
    let text = json_schema(Arguments::SHAPE);
    assert!(text.find("speed") < text.find("gain"), "fields keep their order: {text}");
    let scalar = r#"{"$schema":"https://json-schema.org/draft/2020-12/schema","type":"boolean"}"#;
    assert_eq!(json_schema(bool::SHAPE), scalar);
}

/// The part of JSON Schema that our schemas use.
fn accepts(root: &Value, schema: &Value, value: &Value) -> bool {
    let Some(keywords) = schema.as_object() else { return schema != &json!(false) };
    let all = |list: &Value| list.as_array().cloned().unwrap_or_default();
    let count = |limit: &Value| limit.as_u64().and_then(|limit| usize::try_from(limit).ok()).expect("a count");
    keywords.iter().all(|(keyword, limit)| match keyword.as_str() {
        "$schema" | "title" | "$defs" | "description" | "unit" => true,
        "$ref" => {
            let name = limit.as_str().and_then(|name| name.strip_prefix("#/$defs/")).expect("a definition");
            accepts(root, &root["$defs"][name], value)
        }
        "anyOf" => all(limit).iter().any(|choice| accepts(root, choice, value)),
        "oneOf" => all(limit).iter().filter(|choice| accepts(root, choice, value)).count() == 1,
        "not" => !accepts(root, limit, value),
        "enum" => all(limit).contains(value),
        "type" => {
            let names = if limit.is_array() { all(limit) } else { vec![limit.clone()] };
            names.iter().any(|name| match name.as_str().unwrap_or("") {
                "boolean" => value.is_boolean(),
                "null" => value.is_null(),
                "string" => value.is_string(),
                "array" => value.is_array(),
                "object" => value.is_object(),
                "number" => value.is_number(),
                "integer" => value.as_f64().is_some_and(|number| number.fract() == 0.0),
                other => panic!("no type {other}"),
            })
        }
        "minimum" => value.as_f64() >= limit.as_f64(),
        "maximum" => value.as_f64() <= limit.as_f64(),
        "minLength" => value.as_str().is_some_and(|text| text.chars().count() >= count(limit)),
        "maxLength" => value.as_str().is_some_and(|text| text.chars().count() <= count(limit)),
        "minItems" => value.as_array().is_none_or(|items| items.len() >= count(limit)),
        "maxItems" => value.as_array().is_none_or(|items| items.len() <= count(limit)),
        "items" => all(value).iter().all(|item| accepts(root, limit, item)),
        "properties" => value.as_object().is_none_or(|members| {
            members.iter().all(|(name, member)| limit.get(name).is_none_or(|limit| accepts(root, limit, member)))
        }),
        "required" => all(limit).iter().all(|name| name.as_str().is_some_and(|name| value.get(name).is_some())),
        "additionalProperties" => value.as_object().is_none_or(|members| {
            members.keys().all(|name| schema.get("properties").is_some_and(|known| known.get(name).is_some()))
        }),
        other => panic!("no keyword {other}"),
    })
}

/// Another value at one place of it.
fn change(value: &mut Value, place: usize, other: Value, key: &str) {
    match value {
        Value::Array(items) if !items.is_empty() && !place.is_multiple_of(7) => {
            let length = items.len();
            change(&mut items[place % length], place / 7, other, key);
        }
        Value::Array(items) if place.is_multiple_of(2) => items.push(other),
        Value::Object(members) if !members.is_empty() && place % 7 > 1 => {
            let name = members.keys().nth(place % members.len()).cloned().expect("it is there");
            change(&mut members[&name], place / 7, other, key);
        }
        Value::Object(members) if place % 7 == 1 => {
            let name = members.keys().next().cloned().unwrap_or_default();
            members.remove(&name);
        }
        Value::Object(members) if place.is_multiple_of(2) => _ = members.insert(key.to_owned(), other),
        any => *any = other,
    }
}

fn anything() -> impl Strategy<Value = Value> {
    prop_oneof![
        Just(json!(null)),
        Just(json!(true)),
        Just(json!([])),
        Just(json!({})),
        Just(json!(1.5)),
        Just(json!(1e30)),
        Just(json!("NaN")),
        Just(json!("Unit")),
        Just(json!({"Pair": null})),
        any::<i64>().prop_map(|number| json!(number)),
        any::<u8>().prop_map(|number| json!(number)),
        any::<i16>().prop_map(|number| json!(f64::from(number))),
        any::<String>().prop_map(|text| json!(text)),
    ]
}

/// Checks that a value that was read from JSON is a value like any other.
fn read_or_refuse<T: Field>(text: &str) {
    if let Ok(value) = from_json::<T>(text) {
        round_trip(&value);
    }
}

laws! {
    #[test]
    fn the_schema_takes_what_the_reader_takes(
        value in everything(), changes in proptest::collection::vec((any::<usize>(), anything()), 1..4),
    ) {
        let mut json: Value = serde_json::from_str(&to_json(&value)).expect("it is JSON");
        for (place, other) in changes {
            change(&mut json, place, other, ["maybe", "list", "new"][place % 3]);
        }
        let schema: Value = serde_json::from_str(&json_schema(Everything::SHAPE)).expect("it is JSON");
        let read = json_to_bytes(&json.to_string(), Everything::SHAPE);
        prop_assert_eq!(read.is_ok(), accepts(&schema, &schema, &json), "{:?}\n{}", read, json);
        read_or_refuse::<Everything>(&json.to_string());
    }

    #[test]
    fn damaged_json_never_panics(
        value in everything(), at in any::<prop::sample::Index>(), cut in 0usize..4,
        new in prop_oneof!["[\\[\\]{},:\"\\\\ue0-9a.-]{0,3}", any::<String>()],
    ) {
        let mut letters: Vec<char> = to_json(&value).chars().collect();
        let at = at.index(letters.len());
        letters.splice(at..(at + cut).min(letters.len()), new.chars());
        let text: String = letters.into_iter().collect();
        read_or_refuse::<Everything>(&text);
        read_or_refuse::<Stamped<Imu>>(&text);
    }

    #[test]
    fn json_from_anywhere_never_panics(text in any::<String>(), value in anything()) {
        for text in [text, value.to_string()] {
            read_or_refuse::<Arguments>(&text);
            read_or_refuse::<Choice>(&text);
            read_or_refuse::<Vec<Vec<f32>>>(&text);
            read_or_refuse::<Option<Pose>>(&text);
        }
    }

    #[test]
    fn finite_values_are_read_back_bit_for_bit(
        numbers in any::<[f64; 9]>(), single in any::<u32>(), choice in choice(),
    ) {
        let covariance = Some(Matrix3::from_row_slice(&numbers));
        if covariance.is_finite() {
            let text = to_json(&covariance);
            prop_assert_eq!(from_json::<Option<Matrix3<f64>>>(&text), Ok(covariance));
        }
        let single = f32::from_bits(single);
        if single.is_finite() {
            prop_assert_eq!(from_json::<f32>(&to_json(&single)).map(f32::to_bits), Ok(single.to_bits()));
        }
        if choice.is_finite() {
            let read: Choice = from_json(&to_json(&choice)).expect("it was written just now");
            prop_assert_eq!(bytes_of(&read), bytes_of(&choice));
        }
    }
}
