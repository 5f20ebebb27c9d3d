//! Parse errors: one mistake neither hides nor causes another.

use super::{base, faults, places, sensing, tokens, wrong};

#[test]
fn words() {
    wrong(
        &base("senor imu: A();"),
        &[(
            "senor",
            "unknown word `senor`; a link holds `sensor`, `estimator`, `joint`, `inertial`, `visual` or `collision`; did you mean `sensor`?",
        )],
    );
    wrong(
        &base("sensor imu: A() { on_lost: stop; }"),
        &[("on_lost", "`on_lost` does not belong in a sensor, which holds `estimator` or `rate`")],
    );
    wrong(
        &base("rate: 5 Hz;"),
        &[(
            "rate",
            "`rate` does not belong in a link; the rate is the sensor's; an estimator runs when its input arrives",
        )],
    );
    wrong(
        &base("5; #[cfg(test)] sensor imu: A();"),
        &[
            ("5", "this does not start a part of a robot; expected a word such as `link`, `joint` or `sensor`"),
            ("#[cfg(test)]", "only doc comments are allowed before a part of a robot; leave this attribute out"),
        ],
    );
}

#[test]
fn headers() {
    let expected = "expected the robot's name first, as in `robot Rover;`";
    wrong("", &[("", expected)]);
    wrong("link base;", &[("link", expected)]);
    wrong(
        "/// Doc.\n link base { wheel; }",
        &[
            ("link", expected),
            (
                "wheel",
                "unknown word `wheel`; a link holds `sensor`, `estimator`, `joint`, `inertial`, `visual` or `collision`",
            ),
        ],
    );
    wrong("pub struct Rover; link base;", &[("struct", expected)]);
    wrong("robo Rover; link base;", &[("robo", expected)]);
    wrong("robot; link base;", &[(";", "expected the name of this `robot`")]);
    wrong("robot 5; link base;", &[("5", "expected the name of this `robot`")]);
    wrong(
        "robot Rover { link base; }",
        &[("{", "what a robot holds follows without braces, after `robot Rover;`")],
    );
    // Missing tokens at the end are reported at the last token; a group is represented by its last character.
    for robot in ["robot", "robot Rover", "pub", "#[doc = \"\"]", "robot Rover; link"] {
        let places = places(robot);
        assert!(
            matches!(&places[..], [place] if !place.is_empty() && robot.ends_with(place)),
            "{robot}: {places:?}"
        );
    }
}

#[test]
fn semicolons() {
    wrong(
        "robot Rover link base { sensor imu: A() { rate: 5 Hz } sensor mag: B() sensor other: C(); }",
        &[
            ("link", "expected `;` after the robot's name"),
            ("}", "expected `;` after `rate`"),
            ("sensor", "expected `;` after `mag`"),
        ],
    );
    wrong(
        &base("sensor imu: A() 5 6 7; sensor mag: B() { rat: 5 Hz; }"),
        &[
            ("5", "expected `;` after `imu`"),
            ("rat", "unknown word `rat`; a sensor holds `estimator` or `rate`; did you mean `rate`?"),
        ],
    );
}

#[test]
fn declarations() {
    wrong(
        &base("sensor imu; sensor mag: ; sensor: A(); joint j; joint k: spin { link a; } estimator t = T();"),
        &[
            (";", "expected `:` and a type after `imu`"),
            (";", "expected the type of `mag`"),
            (":", "expected the name of this `sensor`"),
            (";", "expected `:` and the type of the joint after `j`"),
            (
                "spin",
                "unknown type of joint; expected `fixed`, `revolute`, `continuous`, `prismatic`, `planar` or `floating`",
            ),
            ("=", "expected `:` and a type after `t`"),
        ],
    );
    wrong(
        &base("sensor a: A(5); sensor b: A(x: 5); sensor c: A(x = K y = 6); sensor d: A(,);"),
        &[
            ("5", "expected an option, as in `name = value`"),
            (":", "expected `=` and a value after the option `x`"),
            ("y", "expected `,`"),
            (",", "expected an option, as in `name = value`"),
        ],
    );
    wrong(
        &sensing(
            "estimator h: H() { input a: ; input b: sensor::, driver; input c: sensor::base::imu, fast; output o: []; }",
        ),
        &[
            (";", "expected the path of a publisher, as in `sensor::base_link::imu`"),
            (",", "expected the path of a publisher, as in `sensor::base_link::imu`"),
            ("fast", "expected `driver`, `optional`, `within: …` or `external`"),
            ("[]", "expected a path in brackets, as in `[nav, velocity]`; the algorithm gives the type"),
        ],
    );
}

#[test]
fn numbers() {
    for (number, place, message) in [
        ("200 hz", "hz", "unknown unit `hz`; did you mean `Hz`?"),
        ("200hz", "200hz", "unknown unit `hz`; did you mean `Hz`?"),
        (
            "200 degrees",
            "degrees",
            "unknown unit `degrees`; units are symbols, as in `m`, `s`, `deg` or `Hz`, and a count has none",
        ),
        ("0x20 Hz", "0x20", "a number in hexadecimal, octal or binary takes no unit; write it in decimal"),
        ("1 m/", ";", "expected a unit, as in `m` or `deg/s`"),
        ("1 m^x", "x", "expected an exponent from 1 to 9"),
        ("1 m^10", "10", "expected an exponent from 1 to 9"),
        ("1e999 Hz", "1e999", "this number is too large"),
        ("1e308 kHz", "1e308", "this number is too large"),
        ("fast", "fast", "expected a number with its unit; write it out, the value of a name is not known here"),
        ("\"5 Hz\"", "\"5 Hz\"", "expected a number with its unit"),
        ("", ";", "expected a number with its unit"),
    ] {
        wrong(&base(&format!("sensor imu: A() {{ rate: {number}; }}")), &[(place, message)]);
    }
}

#[test]
fn geometry() {
    let joint = |content| base(&format!("joint j: revolute {{ {content} link a; }}"));
    wrong(&joint("axis: up;"), &[("up", "expected `x`, `y`, `z`, one of them with `-`, or `[a, b, c]`")]);
    wrong(&joint("axis: [1, 2];"), &[("[1, 2]", "expected 3 values, found 2")]);
    wrong(&joint("origin: { xzy: [0 m, 0 m, 0 m] };"), &[("xzy", "expected `xyz` or `rpy`; did you mean `xyz`?")]);
    wrong(&joint("limit: { lower: -1 rad; upper: 1 rad };"), &[(";", "expected `,`")]);
    wrong(&joint("limit: { lower = -1 rad };"), &[("=", "expected `:` and a value after `lower`")]);
    wrong(&joint("limit { lower: -1 rad };"), &[("{", "expected `:` and its fields in braces after `limit`")]);
}

#[test]
fn what_is_not_read_makes_no_further_faults() {
    // The unread sensor may be the publisher of the input, the unread link the joint's child, and the unread limit
    // the joint's limit.
    for content in [
        "sensor imu Imu(); estimator t: T() { input imu: sensor::base::imu; }",
        "joint pan: fixed { lnk head { } }",
        "joint pan: revolute { axis: z; limit: { lower: }; link head; }",
        "estimator t: T() { inptu imu: sensor::base::imu; }",
        "sensor i: A(); estimator h: H() { input a: sensor::base::i; input b: sensor::base::i, drivr; }",
        "joint pan: revolut { axis: z; limit: { lower: -1 deg, upper: 1 deg }; link head; }",
        "sensor imu: Imu(bus 5) { rate: 5 Hz; } estimator t: T() { input imu: sensor::base::imu; }",
    ] {
        assert_eq!(faults(&base(content)).len(), 1, "{content}: {:?}", faults(&base(content)));
    }
    assert_eq!(places("robot Rover; lnik base { }"), ["lnik"]);
}

#[test]
fn faults_of_all_phases_are_reported_together() {
    let robot = sensing(
        "sensor gnss: Gnss() { rate: 5 hz; }
         sensor odom: Odom() { rate: 0 Hz; estimator t: T() { input imu: sensor::base::imu; } }
         estimator h: H() { input a: sensor::base::imu, driver; input a: sensor::base::mag; sync_tolerance: 20 m; }
         joint pan: revolut { link head; }
         joint tilt: fixed { axis: z; link nose; }",
    );
    assert_eq!(places(&robot), ["hz", "revolut", "axis", "20 m", "input", "0 Hz", "a"]);
}

#[test]
fn a_robot_with_mistakes_keeps_its_type_and_handles() {
    let robot = sensing(
        "sensor imu2: A() { estimator tilt: T() { input x: a; } }
         estimator h: H() { input a: sensor::base::inu, driver; sync_tolerance: 20 m; output x: [nav, heading]; }
         joint pan: revolut { link head { sensor cam: C(5); } }",
    );
    let expansion = crate::pipeline(tokens(&robot)).to_string();
    for kept in [
        "struct Rover ;",
        "mod rover {",
        "const imu :",
        "const imu2 :",
        "const tilt :",
        "const h :",
        "const heading :",
        "mod pan {",
        "const cam :",
    ] {
        assert!(expansion.contains(kept), "`{kept}` is not in {expansion}");
    }
    assert_eq!(expansion.matches("compile_error").count(), faults(&robot).len());
}

#[test]
fn a_mistake_in_a_block_leaves_the_rest_of_it_known() {
    // One typo in each; the hidden parts cause no further fault, and their siblings are read.
    for (robot, place) in [
        ("paramters { a: f64 = 1; }", "paramters"),
        ("parameters { a: f46 = 1; kept: i64 = 1; }", "f46"),
        ("parameters { a f64 = 1; kept: i64 = 1; }", "f64"),
        ("parameters { a: f64; kept: i64 = 1; }", ";"),
        ("parameters { a: f64 = ; kept: i64 = 1; }", ";"),
        ("parameters { a: f64 = 1 kept: i64 = 1; }", "kept"),
        ("parameters { a: f64 = 1 g { kept: i64 = 1; } }", "g"),
        ("parameters { a: f64 = 1, rnage: 0..=2; kept: i64 = 1; }", "rnage"),
        ("parameters { a: f64 = 1, range: 0..2; kept: i64 = 1; }", "."),
        ("parameters { a: f64 = K; kept: i64 = 1; }", "K"),
        ("parameters { 5; kept: i64 = 1; }", "5"),
        ("parameters { type: f64 = 1; kept: i64 = 1; }", "type"),
        ("parameters { group g { kept: i64 = 1; } }", "group"),
        ("commands { command kept: A; }", "command"),
        ("states { state a; }", "state"),
        ("states { a b; }", "b"),
        ("states { 5; a; }", "5"),
        ("states { fn; a; }", "fn"),
        ("commands { arm Arm; kept: A; }", "Arm"),
        ("commands { arm: Arm kept: A; }", "kept"),
        ("commands { arm: ; kept: A; }", ";"),
        ("commands { \"arm\"; kept: A; }", "\"arm\""),
        ("commands { category { concurrency: 2; } kept: A; }", "{"),
        ("commands { category motion { concurency: 2; } kept: A; }", "concurency"),
        ("commands { kept: A { alowed_states: [idle]; timeout: 1 s; } }", "alowed_states"),
        ("commands { kept: A { allowed_states: idle; } }", "idle"),
        ("commands { kept: A { allowed_states: []; } }", "[]"),
        ("commands { kept: A { allowed_states: [idle executing]; } }", "executing"),
        ("commands { kept: A { timeout: 2 } }", "}"),
        ("commands { kept: A { cancel: motion; } }", "motion"),
        ("commands { kept: A { category: [motion]; } }", "["),
        ("commands { kept: A { rate: 1 Hz; } }", "rate"),
        ("controllers { contoller c: C(); controller kept: C(); }", "contoller"),
        ("controllers { bridge c: C(); controller kept: C(); }", "bridge"),
        ("bridges { bridge kept: C() { port: 1; } }", "port"),
    ] {
        let text = format!("robot Rover; {robot} link base;");
        let faults = faults(&text);
        if robot.contains("timeout: 2 }") {
            // Two mistakes: no unit and no `;`.
            assert_eq!(places(&text), ["}", "2"]);
            continue;
        }
        assert_eq!(faults.iter().map(|(place, _)| &**place).collect::<Vec<_>>(), [place], "{robot}: {faults:?}");
    }
}

#[test]
fn unread_declarations_make_references_to_them_no_faults() {
    for robot in [
        "parameters { a f64 = 1; } link base { sensor i: A(x = param::a); }",
        "commands { stp Stop; } link base { sensor i: A() { estimator t: T() { latency_budget: 1 s; on_degraded: stop; } } }",
        "states { degraded moving; } commands { a: A { allowed_states: [moving]; } } link base;",
        "commands { category motion { concurency: 1; } a: A { category: motion; cancel: [motoin]; } } link base;",
        "commands { c: C; } link base { sensor i: A() { estimator t: T() { lost_aftr: 1 s; on_lost: c; } } }",
        "link base { joint j: continuous { axis: z; snesor e: E(); actuator m: M(); link l; } }",
        "link base { sensor i: A() { rate: 1 kHz; } sensor g: B() { rate: 1 Hz; } estimator e: E() { input i: i, driver;
         input g: g, optinal; sync_tolerance: 1 ms; } }",
    ] {
        let text = format!("robot Rover; {robot}");
        assert_eq!(faults(&text).len(), 1, "{text}: {:?}", faults(&text));
    }
}

#[test]
fn settings_of_estimators() {
    let nested = |settings: &str| base(&format!("sensor i: A() {{ estimator t: T() {{ {settings} }} }}"));
    let worker = "expected `worker`; without this setting it runs where its input is published";
    let property = "expected `priority: …` or `core: …`";
    wrong(&nested("runs_on: thread;"), &[("thread", worker)]);
    wrong(&nested("runs_on: ;"), &[(";", worker)]);
    wrong(&nested("runs_on: worker, prio: 3;"), &[("prio", property)]);
    wrong(
        &nested("runs_on: worker, proirity: 3;"),
        &[("proirity", &format!("{property}; did you mean `priority`?"))],
    );
    wrong(&nested("runs_on: worker, core: 1, core: 2;"), &[("core", "`core` is given twice; leave one out")]);
    wrong(&nested("on_lost: \"stop\";"), &[("\"stop\"", "a name is written without quotes: `stop`")]);
    wrong(&nested("recover_after: ten;"), &[("ten", "expected a whole number, as in `recover_after: 10;`")]);
}

#[test]
fn actuators() {
    let joint = |content: &str| base(&format!("joint j: fixed {{ {content} link l; }}"));
    wrong(&joint("actuator m: M() { rate: 5 Hz; }"), &[("rate", "an actuator holds nothing; leave this out")]);
    wrong(
        &joint("acuator m: M();"),
        &[(
            "acuator",
            "unknown word `acuator`; a joint holds `origin`, `axis`, `limit`, `dynamics`, `mimic`, `transmission`, `sensor`, `actuator` or `link`; did you mean `actuator`?",
        )],
    );
    wrong(
        &base("actuator m: M();"),
        &[("actuator", "`actuator` does not belong in a link; an actuator moves a joint; declare it in one")],
    );
}
