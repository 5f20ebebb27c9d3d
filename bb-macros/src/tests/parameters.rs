//! Rules about parameters and the options that are bound to them.

use super::{right, wrong};

/// A robot with these parameters.
fn with(parameters: &str) -> String {
    format!("robot Rover; parameters {{ {parameters} }} link base;")
}

/// A robot with a few parameters, and a sensor with an option.
fn bound(option: &str) -> String {
    format!(
        "robot Rover; parameters {{ imu {{ beta: f64 = 0.1; deep {{ on: bool = true; }} }} rate: i64 = 1; }}
         link base {{ sensor imu: A(x = {option}); }}"
    )
}

#[test]
fn values_are_of_the_declared_type() {
    right(&with("a: bool = true; b: i64 = -0xFF; c: f64 = 3; d: f64 = -3.5 m; e: String = \"\"; f: i64 = 1_000;"));
    let fault = |kind: &str, value: &str, message: &str| {
        wrong(&with(&format!("a: {kind} = {value};")), &[(value, message)]);
    };
    fault("f64", "\"0.1\"", "expected an `f64`, found a text; change it, or the type of `a`");
    fault("f64", "true", "expected an `f64`, found a `bool`; change it, or the type of `a`");
    fault("i64", "0.5", "expected an `i64`, found a number with a fraction; change it, or the type of `a`");
    fault("i64", "3 s", "an `i64` has no unit; leave it out, or make `a` an `f64`");
    fault("i64", "99999999999999999999", "this does not fit into an `i64`, which has 64 bits");
    fault("bool", "0", "expected a `bool`, found an integer; change it, or the type of `a`");
    fault("String", "1.5", "expected a `String`, found a number; change it, or the type of `a`");
    fault("String", "-7 m", "expected a `String`, found a number; change it, or the type of `a`");
}

#[test]
fn ranges() {
    right(&with("a: i64 = 3, range: 3..=3; b: f64 = 0.4 m, range: -10 mm..=2 m; c: f64 = 1, range: 0..=2.5;"));
    let outside = "this default is outside the range of `a`; change one of them";
    wrong(&with("a: i64 = 4, range: 0..=3;"), &[("4", outside)]);
    wrong(&with("a: f64 = -0.1, range: 0..=3;"), &[("-0.1", outside)]);
    wrong(&with("a: f64 = 3 m, range: 0 m..=200 cm;"), &[("3 m", outside)]);
    wrong(&with("a: i64 = 9, range: 3..=0;"), &[("0", "this is below the start of the range; exchange the two")]);
    wrong(
        &with("a: bool = true, range: false..=true;"),
        &[("range", "only numbers have a range; leave it out of `a`")],
    );
    wrong(
        &with("a: i64 = 1, range: 0.5..=\"x\";"),
        &[
            ("0.5", "expected an `i64`, found a number with a fraction; change it, or the type of `a`"),
            ("\"x\"", "expected an `i64`, found a text; change it, or the type of `a`"),
        ],
    );
    wrong(
        &with("a: f64 = 1 m, range: 0 s..=2;"),
        &[
            ("0 s", "the default is a length and this is a time; write both in units of one kind"),
            ("2", "the default is a length and this is a number without a unit; write both in units of one kind"),
        ],
    );
}

#[test]
fn names() {
    right(&with("a { a: i64 = 1; b { a: i64 = 2; } } b: i64 = 3;"));
    let taken = "the name `a` is taken among its siblings, on line 1; choose another";
    wrong(&with("a: i64 = 1; a: f64 = 1;"), &[("a", taken)]);
    wrong(&with("a { b: i64 = 1; } a { c: i64 = 1; }"), &[("a", taken)]);
    wrong(&with("g { a { } a: i64 = 1; }"), &[("a", taken)]);
}

#[test]
fn references() {
    right(&bound("param::imu::beta"));
    right(&bound("param::imu::deep::on, y = param::rate"));
    // A function belongs to a user's module.
    right(&bound("param::f(3)"));
    for (path, near) in [
        ("param::imu::beat", "param::imu::beta"),
        ("param::inu::beta", "param::imu::beta"),
        ("param::beta", "param::imu::beta"),
        ("param::imu::rate", "param::rate"),
    ] {
        let message = format!("there is no parameter `{path}`; did you mean `{near}`?");
        wrong(&bound(path), &[(path, &message)]);
    }
    wrong(
        &bound("param::imu::gain"),
        &[(
            "param::imu::gain",
            "there is no parameter `param::imu::gain`; declare it in `parameters`, or name one of `param::imu::beta`, `param::imu::deep::on`, `param::rate`",
        )],
    );
    wrong(
        &bound("param::imu"),
        &[(
            "param::imu",
            "`param::imu` is a group of parameters; name one in it: `param::imu::beta`, `param::imu::deep::on`",
        )],
    );
    wrong(
        "robot Rover; link base { sensor a: A(x = param::x); }",
        &[("param::x", "there is no parameter `param::x`; declare it in `parameters`")],
    );
    wrong(&bound("param::"), &[(")", "expected the path of a parameter, as in `param::imu::beta`")]);
}

#[test]
fn references_of_every_component() {
    let robot = "robot Rover; parameters { a: i64 = 1; }
        commands { go: Go(x = param::b); } controllers { controller c: C(x = param::b); }
        bridges { bridge b: B(x = param::b); } sensors { sensor s: S(x = param::b); }
        link base {
            sensor imu: A(x = param::b) { estimator e: E(x = param::b); }
            joint j: continuous { axis: z; sensor e: E(); actuator m: M(x = param::b); link l; }
        }";
    let message = "there is no parameter `param::b`; declare it in `parameters`, or name one of `param::a`";
    wrong(robot, &[("param::b", message); 7]);
}
