//! The expansion of a robot: it is readable Rust, it contains all type checks, and its size is linear.

use super::{diagnostics, sensing, tokens};
use crate::pipeline;

/// Sensors, estimators and what carries them.
pub(super) const WHOLE: &str = r#"
    /// A rover.
    pub robot Rover;
    sensors { sensor battery: Battery(); }
    /// The body.
    link base {
        /// Inertial sensor.
        sensor imu: drivers::Bmi270<2>(bus = "i2c-1", rate = 2 * K, scale = 2000 deg/s, gain = -0.5) {
            rate: 200 Hz;
            estimator tilt: Madgwick<Imu>(beta = 0.1);
        }
        sensor field: Magnetometer() { rate: 50Hz; }
        estimator heading: Heading() {
            input imu: sensor::base::imu, driver;
            input field: sensor::base::mount::mast::field, optional, within: 250 ms;
            sync_tolerance: 20 ms;
            output out;
            output rate: [nav, rate];
        }
        joint mount: fixed {
            origin: { xyz: [0.2 m, 0 m, -90 cm], rpy: [0 deg, 90 deg, 1 rad] };
            link mast { sensor field: Magnetometer(); }
        }
        joint pan: revolute {
            axis: -z;
            limit: { lower: -90 deg, upper: 90 deg, velocity: 60 deg/s, effort: 5 N*m };
            sensor encoder: Encoder(id = 3);
            link head { sensor imu: Bmi270(); }
        }
        estimator far: Far() { input imu: sensor::base::pan::head::imu; }
    }
"#;

/// A robot's actions beside sensing and estimating.
pub(super) const ACTING: &str = r#"
    robot Rover;
    parameters {
        /// Parameters of the filter.
        imu {
            /// Step of the filter.
            beta: f64 = 0.1, range: 0.0..=1.0;
            mount { height: f64 = 90 cm, range: 0 m..=2 m; }
        }
        count: i64 = -3, range: -0x10..=10;
        name: String = "rover";
        verbose: bool = false;
    }
    states {
        /// Slow driving.
        degraded;
        moving;
    }
    commands {
        /// Commands that move.
        category motion { concurrency: 2; }
        category default { concurrency: 3; }
        /// Permission to move.
        arm: Arm;
        move_to: MoveTo(speed = 1 m/s) { allowed_states: [idle, executing]; timeout: 2 s; category: motion; }
        slow_down: SlowDown { cancel: [motion, default]; category: default; }
        stop: Stop { allowed_states: [idle, executing, degraded, moving]; cancel: all; }
        resume: Resume { allowed_states: [degraded,]; }
    }
    controllers {
        /// Balance.
        controller stability: Stability(gain = param::imu::beta) { rate: 100 Hz; }
    }
    bridges { bridge ros: RosBridge(port = 1, name = param::name); bridge log: Log { rate: 10 Hz; } }
    sensors { sensor stability: Level(); }
    link base {
        sensor imu: Imu() {
            rate: 200 Hz;
            estimator tilt: Madgwick(beta = param::imu::beta, count = param::count) {
                latency_budget: 1 ms;
                lost_after: 100 ms;
                recover_after: 10;
                on_degraded: slow_down;
                on_lost: stop;
                on_recovered: resume;
                runs_on: worker, priority: 80, core: 1;
            }
        }
        estimator pose: Pose() {
            input imu: imu, driver;
            input wish: controller::stability, within: 10 ms;
            input log: log, optional;
            sync_tolerance: 5 ms;
            runs_on: worker;
            on_degraded: slow_down;
        }
        joint pan: continuous {
            axis: z;
            /// Turning motor.
            actuator servo: Dynamixel(id = 3);
            sensor encoder: Encoder(id = 3);
            link head;
        }
    }
"#;

/// One of everything that a robot may have.
const EVERYTHING: &str = include_str!("expansion/everything.txt");

/// File in which the expansion is stored, so that a change of the macro can be reviewed as a change of its output.
const EXPANDED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/src/tests/expansion/everything.rs");

/// Lines of that file: every robot pays for them in its build. A change that raises the number says in its commit by how much and why.
const LINES: usize = 1611;

#[test]
fn the_expansion_is_as_stored() {
    assert!(diagnostics(tokens(EVERYTHING)).is_empty(), "{:?}", super::faults(EVERYTHING));
    let file = syn::parse2::<syn::File>(pipeline(tokens(EVERYTHING))).expect("it is Rust");
    let expanded = format!(
        "// What `robot!` makes of everything.txt. Written by a test: `UPDATE_EXPANSION=1 cargo test -p bb-macros expansion`.\n\n{}",
        prettyplease::unparse(&file)
    );
    if std::env::var_os("UPDATE_EXPANSION").is_some() {
        std::fs::write(EXPANDED, &expanded).expect("the folder is there");
    }
    let stored = std::fs::read_to_string(EXPANDED).unwrap_or_default();
    let difference = stored.lines().zip(expanded.lines()).find(|(stored, now)| stored != now);
    assert!(
        stored == expanded,
        "read the difference, then renew it: UPDATE_EXPANSION=1 cargo test -p bb-macros expansion\n{difference:?}"
    );
    assert_eq!(stored.lines().count(), LINES, "store the number of lines too");
}

/// Everything in the expansion is named by a path, a field or a role, so that its purpose is readable.
#[test]
fn no_name_in_the_expansion_is_a_number() {
    let expansion = pipeline(tokens(EVERYTHING)).to_string();
    let words = expansion.split(|c: char| !c.is_alphanumeric() && c != '_');
    // The groups of fields of `__Options`, `__Topics` and `__Islands`, which are numbered.
    let is_numbered = |word: &&str| {
        let letters = word.trim_start_matches('_').trim_end_matches(|c: char| c.is_ascii_digit());
        letters.len() == 1 && letters.len() < word.trim_start_matches('_').len() && letters != "g"
    };
    let numbered: Vec<&str> =
        words.filter(is_numbered).filter(|word| !["f64", "i64", "u64"].contains(word)).collect();
    assert_eq!(numbered, [] as [&str; 0]);
}

#[test]
fn a_right_robot_expands_to_rust() {
    for robot in [WHOLE, ACTING] {
        assert!(diagnostics(tokens(robot)).is_empty(), "{:?}", super::faults(robot));
        let file = syn::parse2::<syn::File>(pipeline(tokens(robot)));
        assert!(file.is_ok(), "{:?}", file.err());
    }
}

#[test]
fn an_input_across_a_moving_joint_is_left_to_the_type() {
    let expansion = pipeline(tokens(WHOLE)).to_string();
    // `far` spans the joint `pan`; `heading` spans only the fixed `mount`.
    assert_eq!(expansion.matches("check_dynamic").count(), 1);
    assert!(expansion.contains(r#""imu" , "pan" , "revolute""#));
}

#[test]
fn numbers_that_no_double_holds_are_no_panic() {
    let robot = sensing("sensor x: A(a = 1e999, b = -1e999, c = 1e999 + 1.0, d = 0xFFFF_FFFF_FFFF_FFFF_FFFF);");
    assert!(syn::parse2::<syn::File>(pipeline(tokens(&robot))).is_ok());
}

/// A robot with `count` estimators in a chain, all names of one length.
fn chain(count: usize) -> String {
    let estimators = (0..count).map(|number| {
        let source =
            if number == 0 { "sensor::base::imu".into() } else { format!("estimator::base::e{:04}", number - 1) };
        format!("estimator e{number:04}: Tilt(gain = 0.1) {{ input imu: {source}; }}\n")
    });
    sensing(&estimators.collect::<String>())
}

#[test]
fn the_expansion_is_linear_in_size() {
    let bytes = |count| pipeline(tokens(&chain(count))).to_string().len() as f64;
    let none = bytes(0);
    let each = [10, 100, 1000].map(|count| (bytes(count) - none) / f64::from(count as i32));
    for bytes in each {
        assert!((bytes / each[0] - 1.0).abs() < 0.2, "bytes per estimator at 10, 100 and 1000: {each:?}");
    }
}

#[test]
fn a_robot_named_by_a_keyword_is_no_panic() {
    let expansion = pipeline(tokens("robot r#type; link base;"));
    let text = expansion.to_string();
    assert!(text.contains("struct r#type") && text.contains("mod __type_1_"), "{text}");
    assert!(syn::parse2::<syn::File>(expansion).is_ok(), "{text}");
}
