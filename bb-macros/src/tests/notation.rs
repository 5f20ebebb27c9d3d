//! Syntax of other languages and tools: one error, which shows the syntax of this language.

use super::{base, faults, sensing, wrong};

#[test]
fn paths() {
    for path in [
        "sensor/base/imu",
        "/sensor/base/imu",
        "sensor.base.imu",
        "sensor:base:imu",
        "sensor::base/imu",
        "\"sensor/base/imu\"",
        "\"/sensor/base/imu\"",
    ] {
        wrong(
            &sensing(&format!("estimator t: T() {{ input imu: {path}; }}")),
            &[(path, "paths are written with `::`; write `sensor::base::imu`")],
        );
    }
    wrong(
        &sensing("estimator t: T() { input wheels: sensor/base/wheel/encoder, driver; input m: mag; }"),
        &[("sensor/base/wheel/encoder", "paths are written with `::`; write `sensor::base::wheel::encoder`")],
    );
}

#[test]
fn an_input_without_its_name() {
    wrong(
        &base("estimator t: T() { input estimator::base::pose::pose; }"),
        &[(
            "estimator::base::pose::pose",
            "expected the name of this `input` before the path, as in `input pose: estimator::base::pose::pose;`; the algorithm says what its inputs are called",
        )],
    );
    wrong(
        &base("estimator t: T() { input imu; }"),
        &[(";", "expected `:` and the path of a publisher after `imu`")],
    );
}

#[test]
fn names_with_other_characters() {
    let try_name = |name: &str| format!("a name consists of letters, digits and `_`; try `{name}`");
    let left_wheel = try_name("left_wheel");
    for (robot, place) in [
        (base("joint left-wheel: fixed { link w; }"), "left-wheel"),
        (base("joint left wheel: fixed { link w; }"), "left wheel"),
        (base("joint left.wheel: fixed { link w; }"), "left.wheel"),
        (base("joint j: fixed { link left-wheel { } }"), "left-wheel"),
        (base("joint j: fixed { link left wheel { } }"), "left wheel"),
        (base("joint j: fixed { link left wheel; }"), "left wheel"),
        (base("sensor left-wheel: A() { rate: 5 Hz; }"), "left-wheel"),
        (base("sensor left wheel: A() { rate: 5 Hz; }"), "left wheel"),
        (base("sensor s: A(left-wheel = 5);"), "left-wheel"),
        (base("sensor s: A() { estimator left-wheel: A(); }"), "left-wheel"),
        (base("sensor s: A() { estimator t: A() { output left-wheel; } }"), "left-wheel"),
        (base("sensor s: A() { estimator t: A() { lost_after: 1 s; on_lost: left-wheel; } }"), "left-wheel"),
        ("robot R; states { left-wheel; } link b;".into(), "left-wheel"),
        ("robot R; commands { left-wheel: C; } link b;".into(), "left-wheel"),
        ("robot R; parameters { left-wheel: f64 = 1; } link b;".into(), "left-wheel"),
    ] {
        wrong(&robot, &[(place, &left_wheel)]);
    }
    wrong("robot My-Rover; link b;", &[("My-Rover", &try_name("MyRover"))]);
    wrong("robot my rover; link b;", &[("my rover", &try_name("MyRover"))]);
}

#[test]
fn names_that_are_none() {
    let keyword = |name: &str, word: &str| {
        format!("`{name}` is a keyword of Rust; choose another name, as in `{name}_{word}`")
    };
    wrong("robot R; link loop { }", &[("loop", &keyword("loop", "link"))]);
    wrong(&base("sensor super: A();"), &[("super", &keyword("super", "sensor"))]);
    wrong(&base("joint type: fixed { link l; }"), &[("type", &keyword("type", "joint"))]);
    let digit = "a name starts with a letter, not with a digit; try `tyre2`";
    wrong("robot R; link 2tyre { }", &[("2tyre", digit)]);
    wrong("robot R; link 2_tyre { }", &[("2_tyre", digit)]);
    wrong("robot R; link \"base\" { }", &[("\"base\"", "a name is written without quotes: `base`")]);
    wrong("robot R; link _ { }", &[("_", "expected the name of this `link`")]);
}

#[test]
fn brackets_for_braces() {
    wrong(
        &base("joint j: fixed { origin: [0 m, 0 m, 1 m]; link l; }"),
        &[("[", "expected `{`, as in `origin: { xyz: [0 m, 0 m, 0.9 m], rpy: [0 deg, 0 deg, 90 deg] };`")],
    );
    wrong("robot R; states: [parked]; link b;", &[(":", "expected `{`, as in `states { degraded; }`")]);
}

#[test]
fn comments() {
    let hash = "`#` does not start a comment; write `//`";
    let inner = "`//!` and `#![…]` cannot be used in a robot; write `///` before what it documents";
    wrong("# The rover.\nrobot Rover; link base;", &[("#", hash)]);
    wrong("//! The rover.\nrobot Rover; link base;", &[("//! The rover.", inner)]);
    wrong(
        "robot Rover; link base {\n # the sensor: good\n sensor i: A() { rate: 0 Hz; }\n # end\n }",
        &[("#", hash), ("#", hash), ("0 Hz", "this must be more than 0")],
    );
    wrong(
        "robot Rover;\n//! Doc.\n link base { 5; }",
        &[
            ("//! Doc.", inner),
            ("5", "this does not start a part of a robot; expected a word such as `link`, `joint` or `sensor`"),
        ],
    );
}

#[test]
fn decimal_commas() {
    let point = "a decimal point is written `.`; try `0.5`";
    wrong(&base("joint j: fixed { origin: { xyz: [0,5 m, 0 m, 1 m] }; link l; }"), &[("0,5", point)]);
    wrong(&base("sensor i: A() { rate: 0,5 Hz; }"), &[("0,5", point)]);
    wrong(&base("sensor i: A(x = 0,5);"), &[("0,5", point)]);
    wrong(&base("sensor i: A(x = -0,5);"), &[("-0,5", point)]);
    wrong("robot R; parameters { a: f64 = 0,5; } link b;", &[("0,5", point)]);
    wrong(&base("joint j: continuous { axis: [0,5, 0,5, 0]; link l; }"), &[("0,5", point)]);
    // With spaces they are several.
    wrong(
        &base("joint j: continuous { axis: [1, 0, 0, 0]; link l; }"),
        &[("[1, 0, 0, 0]", "expected 3 values, found 4")],
    );
}

#[test]
fn components_made_as_in_rust() {
    let braces = "options are written in parentheses, each with `=`: `Encoder(port = …, id = …)`";
    for end in [";", "", " { rate: 5 Hz; }"] {
        wrong(
            &base(&format!("sensor e: Encoder {{ port: \"x\", id: 5 }}{end} sensor f: F();")),
            &[("{ port: \"x\", id: 5 }", braces)],
        );
    }
    let function = "a component is named by its type, and made when the robot starts; leave `::new` out and give options by name, as in `Encoder(option = value)`";
    for arguments in ["(\"x\", 5)", "()", ""] {
        wrong(&base(&format!("sensor e: my::Encoder::new{arguments};")), &[("new", function)]);
    }
    // A sensor's words are its settings, with or without parentheses.
    assert_eq!(faults(&base("sensor e: E { rate: 5 Hz; }")), []);
    wrong(
        &base("sensor e: E { rat: 5 Hz; }"),
        &[("rat", "unknown word `rat`; a sensor holds `estimator` or `rate`; did you mean `rate`?")],
    );
}

#[test]
fn parameters_in_expressions() {
    let message = "an option is bound to a parameter as it is, and a parameter is not a value that can be computed with; compute in the component, or declare a parameter of its own";
    for (value, place) in [
        ("param::gain * 2.0", "param::gain"),
        ("2.0 * param::gain", "param::gain"),
        ("f(-param::gain)", "param::gain"),
        ("Some(param::gain)", "param::gain"),
        ("param::gain.sqrt()", "param::gain"),
    ] {
        let robot = format!("robot R; parameters {{ gain: f64 = 1; }} link b {{ sensor i: A(x = {value}); }}");
        wrong(&robot, &[(place, message)]);
    }
    assert_eq!(faults(&base("sensor i: A(x = crate::param::GAIN * 2.0);")), []);
}

#[test]
fn misspelt_and_missing_outputs() {
    let robot = |outputs: &str| {
        base(&format!(
            "sensor pose: A() {{ estimator fuse: F() {{ {outputs} }} }}
             estimator t: T() {{ input p: sensor::base::pose::fuse::pose; }}"
        ))
    };
    let place = "sensor::base::pose::fuse::pose";
    wrong(
        &robot("output psoe;"),
        &[(
            place,
            "`fuse` declares no output `pose`; it declares `psoe`; give it the algorithm's name in both places",
        )],
    );
    wrong(
        &robot(""),
        &[(place, "`fuse` declares no output `pose`; if the algorithm has it, add `output pose;` there")],
    );
}

#[test]
fn both_micro_signs() {
    for unit in ["us", "\u{b5}s", "\u{3bc}s"] {
        for blank in ["", " "] {
            let robot = base(&format!("sensor i: A() {{ estimator t: T() {{ lost_after: 20{blank}{unit}; }} }}"));
            assert_eq!(faults(&robot), [], "{robot}");
        }
    }
}
