//! Rules about the health of estimators, the rates of their inputs, and actuated joints.

use super::{base, places, right, wrong};

/// A robot with a command, and a nested estimator with these settings.
fn nested(settings: &str) -> String {
    format!(
        "robot R; commands {{ stop: Stop; }} link b {{ sensor i: A() {{ estimator t: T() {{ {settings} }} }} }}"
    )
}

#[test]
fn reachable_reactions() {
    right(&nested("lost_after: 1 s; on_lost: stop;"));
    // A restart degrades any estimator.
    right(&nested("on_degraded: stop; on_recovered: stop; recover_after: 3;"));
    wrong(
        &nested("on_lost: stop; latency_budget: 1 ms;"),
        &[(
            "on_lost",
            "`t` is never lost, since it has no `lost_after`; say how long it may wait for its input, as in `lost_after: 100 ms;`",
        )],
    );
}

#[test]
fn values() {
    right(&nested(
        "latency_budget: 1 us; lost_after: 1 h; recover_after: 1; runs_on: worker, priority: 1, core: 0;",
    ));
    for (setting, value, message) in [
        ("latency_budget", "0 ms", "this must be more than 0"),
        ("lost_after", "-1 s", "this must be more than 0"),
        ("lost_after", "1e10 s", "this must be at most 292 years"),
        ("latency_budget", "1 m", "expected a time, found a length; write it as in `1 ms`"),
        ("lost_after", "1", "expected a time, found a number without a unit; write it as in `100 ms`"),
        ("recover_after", "0", "this must be at least 1"),
        ("recover_after", "2.5", "this must be a whole number"),
        ("recover_after", "2 s", "expected a plain number, found a time; write it as in `10`"),
        ("runs_on: worker, priority", "0", "this must be at least 1"),
        ("runs_on: worker, priority", "100", "this must be at most 99"),
        ("runs_on: worker, core", "-1", "this must be at least 0"),
        ("runs_on: worker, core", "1 m", "expected a plain number, found a length; write it as in `1`"),
    ] {
        wrong(&nested(&format!("{setting}: {value};")), &[(value, message)]);
    }
}

/// A robot with sensors of 1 kHz and 10 Hz, and an estimator of both.
fn fused(gnss: &str, settings: &str) -> String {
    base(&format!(
        "sensor imu: A() {{ rate: 1 kHz; estimator tilt: T(); }} sensor gnss: B() {{ rate: 10 Hz; }} sensor any: C();
         estimator slow: S() {{ input x: gnss; }}
         estimator pose: P() {{ input imu: imu, driver; input gnss: gnss{gnss}; {settings} }}"
    ))
}

#[test]
fn input_periods() {
    right(&fused("", ""));
    right(&fused(", within: 100 ms", "sync_tolerance: 1 ms;"));
    right(&fused(", optional", "sync_tolerance: 20 ms;"));
    right(&fused("", "sync_tolerance: 100 ms;"));
    // The rate of `any` is unknown; `tilt` comes with the driver.
    right(&fused(", optional", "input a: any; input tilt: tilt; sync_tolerance: 0.1 ms;"));
    wrong(
        &fused("", "sync_tolerance: 20 ms;"),
        &[(
            "20 ms",
            "`gnss` comes every 100 ms but may be no older than 20 ms, so runs of `pose` would be dropped all the time; give it `within: 100 ms` or more, or make it `optional`",
        )],
    );
    wrong(
        &fused(", within: 20 ms", "sync_tolerance: 1 s;"),
        &[(
            "20 ms",
            "`gnss` comes every 100 ms but may be no older than 20 ms, so runs of `pose` would be dropped all the time; give it `within: 100 ms` or more, or make it `optional`",
        )],
    );
    // Through the driver of another estimator; a single tolerance is a single mistake.
    assert_eq!(places(&fused("", "input s: slow, within: 50 ms; sync_tolerance: 1 s;")), ["50 ms"]);
    wrong(
        &fused("", "input s: slow; sync_tolerance: 50 ms;"),
        &[(
            "50 ms",
            "`gnss` comes every 100 ms and `s` comes every 100 ms but may be no older than 50 ms, so runs of `pose` would be dropped all the time; give each a `within` of its own that is as long, or make it `optional`",
        )],
    );
    // Other faults of the tolerance are one fault each.
    assert_eq!(places(&fused(", within: 0 s", "")), ["0 s"]);
    assert_eq!(places(&fused(", within: 1 mm", "")), ["1 mm"]);
    // A controller has a period, too.
    let robot = "robot R; controllers { controller c: C() { rate: 5 Hz; } }
        link b { sensor i: I(); estimator e: E() { input i: i, driver; input c: c, within: 0.1 s; } }";
    wrong(
        robot,
        &[(
            "0.1 s",
            "`c` comes every 200 ms but may be no older than 100 ms, so runs of `e` would be dropped all the time; give it `within: 200 ms` or more, or make it `optional`",
        )],
    );
}

#[test]
fn what_comes_in_step_with_the_driver_is_new() {
    let pair = |driver: &str, other: &str| {
        base(&format!(
            "sensor a: A() {{ rate: {driver}; }} sensor b: B() {{ rate: {other}; }}
             estimator e: E() {{ input a: a, driver; input b: b, within: 1 ms; }}"
        ))
    };
    right(&pair("10 Hz", "10 Hz"));
    right(&pair("10 Hz", "30 Hz"));
    right(&pair("1 Hz", "3 Hz"));
    for (driver, other) in [("20 Hz", "10 Hz"), ("10 Hz", "15 Hz")] {
        assert_eq!(places(&pair(driver, other)), ["1 ms"]);
    }
}

#[test]
fn inputs_round_a_circle_have_no_period() {
    let robot = base(
        "sensor i: I() { rate: 1 Hz; }
         estimator a: A() { input b: estimator::base::b, driver; input i: sensor::base::i, within: 2 s; }
         estimator b: B() { input a: estimator::base::a, driver; input i: sensor::base::i, within: 2 s; }",
    );
    assert_eq!(places(&robot), ["estimator::base::a"]);
}

#[test]
fn actuated_joints() {
    let joint = |kind: &str, content: &str| base(&format!("joint j: {kind} {{ {content} link l; }}"));
    right(&joint("continuous", "axis: z; actuator m: M(); sensor e: E();"));
    right(&joint("fixed", "actuator lamp: Lamp();"));
    right(&base(
        "joint j: continuous { axis: z; sensor e: E(); link l; }
         joint k: continuous { axis: z; actuator m: M(); mimic: { joint: j }; link n; }",
    ));
    let message = "`m` moves the joint `j`, whose position nothing measures; declare a sensor in this joint, as in `sensor encoder: Encoder();`";
    wrong(&joint("continuous", "axis: z; actuator m: M();"), &[("m", message)]);
    wrong(
        &base("sensor e: E(); joint j: continuous { axis: z; actuator m: M(); link l { sensor f: F(); } }"),
        &[("m", message)],
    );
}
