//! Rules about states, commands and references to them.

use super::{places, right, wrong};

/// A robot with a declared state, a category and these commands.
fn with(commands: &str) -> String {
    format!("robot Rover; states {{ degraded; }} commands {{ category motion; {commands} }} link base;")
}

/// A robot with a few commands, and an estimator with these settings.
fn estimator(settings: &str) -> String {
    format!(
        "robot Rover; commands {{ stop: Stop; slow_down: SlowDown; }}
         link base {{ sensor imu: A() {{ estimator t: T() {{ latency_budget: 1 ms; {settings} }} }} }}"
    )
}

#[test]
fn declared_commands() {
    right(&estimator("on_degraded: slow_down; lost_after: 1 s; on_lost: stop; on_recovered: stop;"));
    wrong(
        &estimator("on_degraded: slow_donw;"),
        &[("slow_donw", "there is no command `slow_donw`; did you mean `slow_down`?")],
    );
    wrong(
        &estimator("on_recovered: resume; on_degraded: brake;"),
        &[
            ("brake", "there is no command `brake`; declare it in `commands`, or name one of `stop`, `slow_down`"),
            (
                "resume",
                "there is no command `resume`; declare it in `commands`, or name one of `stop`, `slow_down`",
            ),
        ],
    );
    wrong(
        "robot R; link b { sensor i: A() { estimator t: T() { lost_after: 1 s; on_lost: stop; } } }",
        &[("stop", "there is no command `stop`; declare it in `commands`")],
    );
}

#[test]
fn declared_states() {
    right(&with("a: A { allowed_states: [disarmed, idle, executing, degraded]; } b: B;"));
    wrong(
        &with("a: A { allowed_states: [idel, degraded]; }"),
        &[("idel", "there is no state `idel`; did you mean `idle`?")],
    );
    wrong(
        &with("a: A { allowed_states: [moving, idle, idle]; }"),
        &[
            (
                "moving",
                "there is no state `moving`; declare it in `states`, or name one of `disarmed`, `idle`, `executing`, `degraded`",
            ),
            ("idle", "`idle` is given twice; leave one out"),
        ],
    );
    wrong(
        "robot R; states { idle; moving; moving; } link b;",
        &[
            ("moving", "the name `moving` is taken among its siblings, on line 1; choose another"),
            ("idle", "every robot has the state `idle`; leave it out"),
        ],
    );
}

#[test]
fn declared_categories() {
    right(&with("a: A { category: motion; cancel: [motion, default]; } b: B { cancel: all; category: default; }"));
    right(&with("category default { concurrency: 4; } category: Category; motion: M { category: motion; }"));
    wrong(
        &with("a: A { category: motoin; cancel: [defualt, motion]; }"),
        &[
            ("motoin", "there is no category `motoin`; did you mean `motion`?"),
            ("defualt", "there is no category `defualt`; did you mean `default`?"),
        ],
    );
    wrong(
        &with("a: A { cancel: [motion, motion, all, b]; } b: B { category: speech; }"),
        &[
            ("motion", "`motion` is given twice; leave one out"),
            ("all", "`all` is not a category; to end all commands write `cancel: all;`"),
            ("b", "`b` is a command, not a category; give it a `category` and name that"),
            (
                "speech",
                "there is no category `speech`; declare it in `commands`, or name one of `default`, `motion`",
            ),
        ],
    );
    wrong(
        &with("category all;"),
        &[("all", "`all` means all categories, as in `cancel: all;`; choose another name")],
    );
}

#[test]
fn names_are_unique_among_their_kind() {
    right(&with("idle: A; degraded: B; default: C; base: D;"));
    right(
        "robot R; sensors { sensor a: S(); } controllers { controller a: C(); } bridges { bridge a: B(); }
         commands { a: A; } states { a; } parameters { a: i64 = 1; } link a;"
            .replace("link a", "link b")
            .as_str(),
    );
    for (robot, name) in [
        (with("a: A; a: B;"), "a"),
        (with("category motion;"), "motion"),
        (with("category default; category default;"), "default"),
        ("robot R; controllers { controller c: C(); controller c: D(); } link b;".into(), "c"),
        ("robot R; bridges { bridge c: C(); bridge c: D(); } link b;".into(), "c"),
        (
            "robot R; link b { joint j: continuous { axis: z; sensor m: S(); actuator m: M(); link l; } }".into(),
            "m",
        ),
        (
            "robot R; link b { joint j: continuous { axis: z; sensor s: S(); actuator l: M(); link l; } }".into(),
            "l",
        ),
    ] {
        let taken = format!("the name `{name}` is taken among its siblings, on line 1; choose another");
        wrong(&robot, &[(name, &taken)]);
    }
}

#[test]
fn each_setting_occurs_once() {
    let robot = with(
        "category other { concurrency: 1; concurrency: 2; }
         a: A(x = 1, x = 2) {
            timeout: 1 s; timeout: 2 s; category: motion; category: other; cancel: all; cancel: all;
            allowed_states: [idle]; allowed_states: [idle];
         }",
    );
    assert_eq!(places(&robot), ["concurrency", "timeout", "category", "cancel", "allowed_states", "x"]);
    let robot = estimator(
        "lost_after: 1 s; lost_after: 2 s; latency_budget: 1 s; recover_after: 1; recover_after: 2; on_lost: stop;
         on_lost: stop; on_degraded: stop; on_degraded: stop; on_recovered: stop; on_recovered: stop;
         runs_on: worker; runs_on: worker;",
    );
    assert_eq!(
        places(&robot),
        ["lost_after", "latency_budget", "recover_after", "on_lost", "on_degraded", "on_recovered", "runs_on"]
    );
}

#[test]
fn quantities() {
    let time = "expected a time, found a length; write it as in `2 s`";
    wrong(&with("a: A { timeout: 2 m; }"), &[("2 m", time)]);
    wrong(&with("a: A { timeout: 0 s; }"), &[("0 s", "this must be more than 0")]);
    for (concurrency, message) in [
        ("0", "this must be at least 1"),
        ("-1", "this must be at least 1"),
        ("1.5", "this must be a whole number"),
        ("5e9", "this must be at most 4294967295"),
        ("2 s", "expected a plain number, found a time; write it as in `2`"),
    ] {
        wrong(&with(&format!("category x {{ concurrency: {concurrency}; }}")), &[(concurrency, message)]);
    }
    wrong(
        "robot R; controllers { controller c: C() { rate: 0 Hz; } } bridges { bridge b: B() { rate: 3 s; } } link b;",
        &[
            ("3 s", "expected a frequency, found a time; write it as in `200 Hz`"),
            ("0 Hz", "this must be more than 0"),
        ],
    );
}

#[test]
fn paths_of_commands_and_parameters_are_not_free() {
    let robot = |path| {
        format!(
            "robot R; parameters {{ imu {{ beta: f64 = 1; }} }} commands {{ go: Go; }}
             controllers {{ controller c: C(); }}
             link b {{ sensor i: S() {{ estimator e: E() {{ output a: [{path}]; }} }} }}"
        )
    };
    right(&robot("nav, go"));
    for (path, other) in [
        ("command, go", "the command `go` has this path already"),
        ("param, imu, beta", "the parameter `beta` has this path already"),
        ("param, imu", "the group `imu` has this path already"),
        ("controller, c", "something else publishes at `controller::c`"),
    ] {
        wrong(&robot(path), &[(path, &format!("{other}; choose another path"))]);
    }
}
