//! Every rule of the language: invalid and valid examples, and the places of its errors.

use super::{base, places, right, sensing, wrong};

#[test]
fn unique_names() {
    right(&base("sensor imu: A() { estimator imu: T(); } joint j: fixed { link mast { sensor imu: A(); } }"));
    right("robot Rover; sensors { sensor imu: A(); } link base { sensor imu: A(); }");
    let taken = "the name `imu` is taken among its siblings, on line 1; choose another";
    wrong(&base("sensor imu: A(); sensor imu: B();"), &[("imu", taken)]);
    wrong(&base("sensor imu: A(); sensor imu: B(); sensor imu: C();"), &[("imu", taken), ("imu", taken)]);
    wrong(&base("sensor imu: A(); estimator imu: T() { input imu: sensor::base::imu; }"), &[("imu", taken)]);
    wrong(&base("sensor imu: A(); joint imu: fixed { link mast; }"), &[("imu", taken)]);
    wrong(&base("sensor a: A() { estimator imu: T(); estimator imu: T(); }"), &[("imu", taken)]);
    wrong(
        "robot Rover; sensors { sensor base: A() { estimator imu: T(); } } link base { sensor imu: B(); }",
        &[("base", "the name `base` is taken among its siblings, on line 1; choose another")],
    );
    wrong(
        &base("joint a: fixed { link m; } joint b: fixed { link m; }"),
        &[("m", "the name `m` is taken among the links and joints of the robot, on line 1; choose another")],
    );
    wrong(
        "robot rover; link base;",
        &[("rover", "`rover` would be both the robot's type and its module; write it in camel case")],
    );
    wrong(
        "robot Loop; link base;",
        &[("Loop", "the robot's module would be `loop`, a keyword; choose another name than `Loop`")],
    );
}

#[test]
fn one_root() {
    right(&base("joint a: fixed { link b { joint c: fixed { link d; } } }"));
    wrong("robot Rover;", &[("Rover", "`Rover` has no link; declare its root, as in `link base { }`")]);
    wrong(
        "robot Rover; link a; link b; link c;",
        &[
            ("b", "`b` is a second root beside `a`; put it into a joint of another link"),
            ("c", "`c` is a second root beside `a`; put it into a joint of another link"),
        ],
    );
    wrong(
        &base("joint pan: fixed { }"),
        &[("pan", "the joint `pan` carries no link; declare it, as in `link pan_link { }`")],
    );
    wrong(
        &base("joint pan: fixed { link a; link b; }"),
        &[("b", "`b` is a second link of the joint `pan`, which carries one")],
    );
}

#[test]
fn joint_geometry() {
    right(&base("joint j: revolute { axis: z; limit: { lower: -90 deg, upper: 90 deg }; link a; }"));
    right(&base("joint j: prismatic { axis: [0, 3, 4]; limit: { lower: 0 m, upper: 1 m }; link a; }"));
    right(&base("joint j: continuous { axis: -x; link a; } joint k: floating { link b; }"));
    wrong(
        &base("joint j: revolute { link a; }"),
        &[
            ("revolute", "a revolute joint needs an axis; give `j` one, as in `axis: z;`"),
            (
                "revolute",
                "a revolute joint needs a limit; give `j` one, as in `limit: { lower: -1 deg, upper: 1 deg };`",
            ),
        ],
    );
    wrong(
        &base("joint j: prismatic { axis: x; limit: { lower: 1 m, upper: 1 m }; link a; }"),
        &[("1 m", "the upper limit must be above the lower one")],
    );
    // A continuous joint needs no limit; if it has one, it must not be reversed either.
    wrong(
        &base("joint j: continuous { axis: x; limit: { lower: 1 deg, upper: -2 deg }; link a; }"),
        &[("-2 deg", "the upper limit must be above the lower one")],
    );
    right(&base(
        "joint j: revolute { axis: z; limit: { lower: 0 deg, upper: 1 deg }; transmission: { reduction: -2, offset: 1 deg, reversed: true }; link a; }",
    ));
    wrong(
        &base(
            "joint j: revolute { axis: z; limit: { lower: 0 deg, upper: 1 deg }; transmission: { reduction: 0 }; link a; }",
        ),
        &[("0", "this must not be 0")],
    );
    wrong(
        &base("joint j: prismatic { axis: x; limit: { velocity: 1 m/s }; link a; }"),
        &[("limit", "the limit of a prismatic joint needs both `lower` and `upper`")],
    );
    wrong(
        &base("joint j: fixed { axis: x; limit: { velocity: 0 m }; link a; }"),
        &[
            ("axis", "a fixed joint has no axis; leave it out of `j`"),
            ("limit", "a fixed joint has no limit; leave it out of `j`"),
        ],
    );
    let no_direction = "this axis has no direction; give it a component that is not 0";
    wrong(&base("joint j: planar { axis: [0, 0, -0.0]; link a; }"), &[("[0, 0, -0.0]", no_direction)]);
    wrong(
        &base("joint j: fixed { origin: { xyz: [0 m, -2e16 m, 0 m] }; link a; }"),
        &[("-2e16 m", "this is farther than a light year; bring it nearer")],
    );
}

#[test]
fn dimensions() {
    right(&base(
        "sensor imu: A() { rate: 0.2kHz; } joint j: fixed { origin: { rpy: [0 deg, 1 rad, 0 rev] }; link a; }",
    ));
    let time = "expected a time, found a length; write it as in `20 ms`";
    let heading = "estimator h: H() { input imu: sensor::base::imu, driver; input mag: sensor::base::mag";
    wrong(
        &sensing(&format!("{heading}, within: 1e3 m; sync_tolerance: 20m; }}")),
        &[("1e3 m", time), ("20m", time)],
    );
    for (rate, found) in [
        ("5 ms", "found a time"),
        ("200", "found a number without a unit"),
        ("-1 deg/s", "found an angular velocity"),
        ("3 kg*m^2/s^2", "found a torque"),
        ("3 m^3", "found a quantity in m^3"),
        ("0 m", "found a length"),
    ] {
        let message = format!("expected a frequency, {found}; write it as in `200 Hz`");
        wrong(&base(&format!("sensor imu: A() {{ rate: {rate}; }}")), &[(rate, &message)]);
    }
    wrong(
        &base("joint j: fixed { origin: { xyz: [1, 0 m, 0 m], rpy: [0 deg, 0 m, 0 deg] }; link a; }"),
        &[
            ("1", "expected a length, found a number without a unit; write it as in `0.1 m`"),
            ("0 m", "expected an angle, found a length; write it as in `90 deg`"),
        ],
    );
    let limit =
        |kind: &str, limit: &str| base(&format!("joint j: {kind} {{ axis: z; limit: {{ {limit} }}; link a; }}"));
    assert_eq!(
        places(&limit("revolute", "lower: -1 m, upper: 1 rad, velocity: 1 m/s, effort: 5 N")),
        ["-1 m", "1 m/s", "5 N"]
    );
    assert_eq!(
        places(&limit("prismatic", "lower: 1 m, upper: 90 deg, velocity: 1 deg/s, effort: 5 N*m")),
        ["90 deg", "1 deg/s", "5 N*m"]
    );
    assert_eq!(places(&base("joint j: continuous { axis: [0 m, 0 m, 0 m]; link a; }")), ["0 m", "0 m", "0 m"]);
}

#[test]
fn sensor_nested_input() {
    right(&base("sensor imu: A() { estimator t: T(); }"));
    let input = "an estimator in a sensor takes that sensor, `imu`, and no `input`; leave it out, or declare the \
                 estimator on the link";
    let tolerance = "an estimator in a sensor has one input, and nothing to be in step with; leave it out";
    wrong(&base("sensor imu: A() { estimator t: T() { input x: nothing; } }"), &[("input", input)]);
    wrong(
        &base("sensor imu: A() { estimator t: T() { input x: a; input x: b, driver; sync_tolerance: 1 s; } }"),
        &[("input", input), ("input", input), ("sync_tolerance", tolerance)],
    );
}

#[test]
fn link_nested_input() {
    right(&sensing("estimator t: T() { input imu: sensor::base::imu; }"));
    wrong(
        &sensing("estimator t: T();"),
        &[("t", "the estimator `t` on a link has no input; declare one, as in `input imu: sensor::base::imu;`")],
    );
    wrong(
        &base("estimator t: T() { output out; }"),
        &[("t", "the estimator `t` on a link has no input; declare one, as in `input imu: sensor::base::imu;`")],
    );
}

#[test]
fn one_driver() {
    let heading = |imu, mag| {
        sensing(&format!(
            "estimator h: H() {{ input imu: sensor::base::imu{imu}; input mag: sensor::base::mag{mag}; }}"
        ))
    };
    right(&heading(", driver", ""));
    right(&heading("", ", optional, driver"));
    wrong(
        &heading("", ""),
        &[(
            "h",
            "none of the inputs of `h` is its driver; mark the one whose arrival runs it, as in `input imu: …, driver;`",
        )],
    );
    wrong(
        &heading(", driver", ", driver"),
        &[("driver", "`h` already has a driver, the input `imu`; leave out all but one")],
    );
}

#[test]
fn single_input_tolerance() {
    right(&sensing(
        "estimator h: H() { input a: sensor::base::imu, driver; input b: sensor::base::mag; sync_tolerance: 1 s; }",
    ));
    wrong(
        &sensing("estimator h: H() { input a: sensor::base::imu; sync_tolerance: 1 s; }"),
        &[(
            "sync_tolerance",
            "there is a single input, and nothing for it to be in step with; add the other input, or leave this out",
        )],
    );
}

#[test]
fn declared_publishers() {
    let tilt = |path| sensing(&format!("estimator t: T() {{ input imu: {path}; }}"));
    right(&tilt("sensor::base::imu"));
    // A path suffix is enough if no other path has it.
    right(&tilt("base::mag"));
    right(&tilt("imu"));
    let two = "sensor imu: A() { estimator t: T(); } sensor mag: B() { estimator t: T(); }";
    let message = "`t` may be `sensor::base::imu::t` or `sensor::base::mag::t`; write more of the path";
    wrong(&base(&format!("{two} estimator e: T() {{ input a: t; }}")), &[("t", message)]);
    for (path, near) in [
        ("sensor::base::inu", "sensor::base::imu"),
        ("sensor::bas::imu", "sensor::base::imu"),
        ("sensor :: base :: mga", "sensor::base::mag"),
    ] {
        let message = format!("nothing publishes at `{}`; did you mean `{near}`?", path.replace(' ', ""));
        wrong(&tilt(path), &[(path, &message)]);
    }
    wrong(
        &tilt("sensor::base::wheels"),
        &[(
            "sensor::base::wheels",
            "nothing publishes at `sensor::base::wheels`; declared are `sensor::base::imu`, `sensor::base::mag`",
        )],
    );
    wrong(
        &base("estimator t: T() { input imu: sensor::base::imu; }"),
        &[("sensor::base::imu", "nothing publishes at `sensor::base::imu`, nor elsewhere; declare a sensor")],
    );
    wrong(
        &base("estimator t: T() { input pose: slam::pose; }"),
        &[(
            "slam::pose",
            "nothing publishes at `slam::pose`, nor elsewhere; declare a sensor; if other code publishes there, add `, external`",
        )],
    );
}

#[test]
fn external_inputs() {
    let arm = |input: &str| {
        format!(
            "robot R; parameters {{ gain: f64 = 1.0; }} commands {{ go: Go; }}
             link base {{
                 sensor imu: A();
                 estimator several: T() {{ input imu: imu; output x; output y; }}
                 estimator t: T() {{ {input} }}
                 joint pan: continuous {{ axis: z; sensor e: E(); actuator servo: S(); link head; }}
             }}"
        )
    };
    // A second input at the path takes the same messages; names of sensors are no obstacle.
    right(&arm("input a: slam::imu, external, driver; input b: slam::imu, external, within: 1 s;"));
    right(&arm("input a: command::go::progress, external;"));
    right(&arm("input a: sensor::head::imu, external;"));
    wrong(
        &arm("input a: slam::imu;"),
        &[("slam::imu", "nothing publishes at `slam::imu`; did you mean `sensor::base::imu`?")],
    );
    wrong(
        &arm("input a: vision::landmarks;"),
        &[(
            "vision::landmarks",
            "nothing publishes at `vision::landmarks`; declared are `sensor::base::imu`, `estimator::base::several::x`, \
         `estimator::base::several::y`, `sensor::base::pan::e`; if other code publishes there, add `, external`",
        )],
    );
    let declared = "`sensor::base::imu` is a publisher of the robot; leave out `external`";
    wrong(&arm("input a: sensor::base::imu, external;"), &[("external", declared)]);
    let of_actuator = "the actuator `servo` publishes at `actuator::base::pan::servo::end_motion`, not other code";
    let path = "actuator::base::pan::servo::end_motion";
    wrong(&arm(&format!("input a: {path}, external;")), &[(path, of_actuator)]);
    for path in ["health", "safety::error", "param::gain", "command::go", "estimator::base::several"] {
        let message = format!("the robot itself publishes at `{path}`; choose another path");
        wrong(&arm(&format!("input a: {path}, external;")), &[(path, &message)]);
    }
    let nested = "sensor imu: A() { estimator t: T() { input a: slam::pose, external; } }";
    let message = "an estimator in a sensor takes that sensor, `imu`, and no `input`; leave it out, or declare the estimator on the link";
    wrong(&base(nested), &[("input", message)]);
}

#[test]
fn no_cycles() {
    right(&sensing(
        "estimator a: T() { input i: sensor::base::imu; } estimator b: T() { input i: estimator::base::a; }
         estimator c: T() { input x: estimator::base::a, driver; input y: estimator::base::b; }",
    ));
    wrong(
        &base("estimator a: T() { input i: estimator::base::a; }"),
        &[("estimator::base::a", "`a` takes what it publishes; name another publisher")],
    );
    wrong(
        &base(
            "estimator a: T() { input i: estimator::base::b; } estimator b: T() { input i: estimator::base::a; }",
        ),
        &[("estimator::base::a", "`b` depends on itself: `b` → `a` → `b`; leave out one of these inputs")],
    );
    // Two rings through one estimator are two mistakes.
    assert_eq!(
        places(&base(
            "estimator a: T() { input x: estimator::base::b, driver; input y: estimator::base::c; }
             estimator b: T() { input i: estimator::base::a; } estimator c: T() { input i: estimator::base::a; }"
        )),
        ["estimator::base::a", "estimator::base::a"]
    );
}

#[test]
fn positive_values() {
    right(&base("sensor imu: A() { rate: 1e-9 Hz; }"));
    let positive = "this must be more than 0";
    for (rate, message) in [
        ("0 Hz", positive),
        ("-5 Hz", positive),
        ("0.0", "expected a frequency, found a number without a unit; write it as in `200 Hz`"),
        ("2 kMHz", "unknown unit `kMHz`; did you mean `kHz`?"),
        ("2e4 MHz", "this must be at most 1 GHz"),
        ("1e-11 Hz", "this rate is too low; it must be more than once in 292 years"),
    ] {
        let place = if rate.contains("kM") { "kMHz" } else { rate };
        wrong(&base(&format!("sensor imu: A() {{ rate: {rate}; }}")), &[(place, message)]);
    }
    wrong(
        &sensing(
            "estimator h: H() { input imu: sensor::base::imu, driver; input mag: sensor::base::mag, within: 0 s;
             sync_tolerance: -1 ms; }",
        ),
        &[("0 s", positive), ("-1 ms", positive)],
    );
    wrong(
        &base("joint j: continuous { axis: z; limit: { velocity: -1 deg/s, effort: 0 N*m }; link a; }"),
        &[("-1 deg/s", positive), ("0 N*m", positive)],
    );
}

#[test]
fn distinct_paths() {
    let motion = |name, outputs| format!("estimator {name}: M() {{ input imu: sensor::base::imu; {outputs} }}");
    right(&sensing(&motion("m", "output out; output a; output b: [nav, b];")));
    right(&sensing(&motion("m", "output a: [estimator, base, m];")));
    wrong(
        &sensing(&motion("m", "output a; output a;")),
        &[("a", "an output `a` is already declared; leave one out")],
    );
    let nav = "something else publishes at `nav::x`; choose another path";
    wrong(&sensing(&motion("m", "output a: [nav, x]; output b: [nav, x];")), &[("nav, x", nav)]);
    let (one, two) = (motion("m", "output a: [nav, x];"), motion("n", "output a: [nav, x];"));
    wrong(&sensing(&format!("{one} {two}")), &[("nav, x", nav)]);
    let below = "something else publishes at `estimator::base::m::b`; choose another path";
    wrong(
        &sensing(&motion("m", "output a: [estimator, base, m, b]; output b;")),
        &[("estimator, base, m, b", below)],
    );
    wrong(
        &sensing(&format!("{} {}", motion("m", "output a;"), motion("n", "output a: [estimator, base, m];"))),
        &[("estimator, base, m", "the estimator `m` already has this path; choose another path")],
    );
    wrong(
        &sensing("estimator h: H() { input i: sensor::base::imu, driver; input i: sensor::base::mag; }"),
        &[("i", "`h` already has an input `i`; choose another name")],
    );
}

#[test]
fn single_settings() {
    right(&sensing("joint j: continuous { axis: z; link a { sensor x: A(a = 1, b = 2) { rate: 1 Hz; } } }"));
    let rate = "`rate` is given twice; leave one out";
    wrong(&base("sensor i: A() { rate: 1 Hz; rate: 2 Hz; rate: 3 Hz; }"), &[("rate", rate), ("rate", rate)]);
    wrong(
        &base("joint j: continuous { axis: z; origin: {}; axis: x; origin: {}; link a; }"),
        &[("axis", "`axis` is given twice; leave one out"), ("origin", "`origin` is given twice; leave one out")],
    );
    wrong(&base("sensor i: A(a = 1, b = 2, a = 3);"), &[("a", "`a` is given twice; leave one out")]);
    wrong(
        &base("joint j: fixed { origin: { xyz: [0 m, 0 m, 0 m], xyz: [0 m, 0 m, 0 m] }; link a; }"),
        &[("xyz", "`xyz` is given twice; leave one out")],
    );
}
