//! Words from other languages and tools, and from other places of this one, with what to write instead.

/// The places for which an entry applies (empty: all), the words, and the suggestion.
type Row = (&'static [&'static str], &'static [&'static str], &'static str);

const ROWS: [Row; 40] = [
    // Words of the language, elsewhere.
    (&["a link"], &["link"], "put it at the end of a joint: `joint name: fixed { link arm { } }`"),
    (&["a link"], &["actuator"], "an actuator moves a joint; declare it in one"),
    (&["a link"], &["controller"], "declare it in `controllers { … }`, beside the links"),
    (&["a link"], &["bridge"], "declare it in `bridges { … }`, beside the links"),
    (&["a link"], &["mass", "inertia"], "write `inertial: { mass: 1 kg, inertia: { … } };`"),
    (&["a link"], &["geometry", "mesh", "material"], "write `visual: { box: [1 m, 1 m, 1 m] };` or `collision: …`"),
    (&["a robot"], &["sensor"], "declare it in a link, or in `sensors { … }` if it is in no frame"),
    (&["a robot"], &["estimator"], "declare it in a link, or in the sensor that feeds it"),
    (&["a robot"], &["controller"], "declare it in `controllers { … }`"),
    (&["a robot"], &["bridge"], "declare it in `bridges { … }`"),
    (&["a robot"], &["estimators"], "declare each in a link, or in the sensor that feeds it"),
    (&["a robot"], &["actuator", "actuators"], "an actuator moves a joint; declare it in one"),
    (&["a robot"], &["robot"], "one `robot!` declares one robot; write another `robot!` for the next"),
    (
        &["a robot"],
        &["include", "import", "xacro", "urdf"],
        "write `topology: urdf(\"robot.urdf\");` for a URDF; what else a robot has is declared in one `robot!`",
    ),
    (&["an estimator"], &["estimator"], "declare it in the link, with an `input` that names this one"),
    (
        &["an estimator"],
        &["driver", "optional", "required"],
        "write it after the path, as in `input imu: sensor::base::imu, driver;`",
    ),
    // ROS and URDF.
    (
        &["an estimator"],
        &["subscribe", "subscriber", "subscription", "sub", "in", "inputs"],
        "write `input name: path;`",
    ),
    (
        &[],
        &["publish", "publisher", "publishes", "out", "outputs"],
        "what a component emits is published at its path; an estimator of several outputs names them, as in `output pose;`",
    ),
    (&["an estimator"], &["slop", "sync", "tolerance", "max_interval_duration"], "write `sync_tolerance: 20 ms;`"),
    (
        &["an estimator"],
        &["timeout", "deadline", "watchdog"],
        "write `lost_after: 100 ms;` for how long it may be silent, `latency_budget: 1 ms;` for how long it may take",
    ),
    (
        &["an estimator"],
        &["on_error", "on_fault", "on_failure", "on_timeout", "on_late"],
        "write `on_degraded: …;` for a run that fails or is late, `on_lost: …;` for no run within `lost_after`",
    ),
    (
        &["an estimator", "a link", "a joint"],
        &["rate", "update_rate", "frequency", "hz", "period"],
        "the rate is the sensor's; an estimator runs when its input arrives",
    ),
    (
        &["a sensor", "a controller or bridge"],
        &["update_rate", "rate_hz", "frequency", "freq", "hz", "period", "interval"],
        "write `rate: 200 Hz;`",
    ),
    (
        &[],
        &["queue_size", "queue", "qos", "depth", "history", "reliability", "durability"],
        "each subscription says how it queues, where it is made; leave this out",
    ),
    (
        &[],
        &["topic", "topics", "remap", "remappings", "namespace", "ns"],
        "a topic's path follows from where its publisher is declared; leave this out",
    ),
    (
        &[],
        &["frame", "frame_id", "parent_frame", "child_frame_id"],
        "the frame is that of the link or joint it is declared in; leave this out",
    ),
    (
        &[],
        &["plugin", "package", "executable", "node", "nodes", "component", "components", "exec", "pkg"],
        "a component is named by its Rust type, after its name: `sensor imu: Bmi270();`",
    ),
    (
        &[],
        &["param", "params", "parameter", "declare_parameter"],
        "declare it in the robot's `parameters { … }`, and use it as `param::name`",
    ),
    (
        &["a joint", "a joint of a URDF"],
        &["parent"],
        "the parent is the link in which the joint is written; leave this out",
    ),
    (
        &["a joint", "a joint of a URDF"],
        &["child"],
        "the child is the link that is written in the joint, as in `link tyre { }`",
    ),
    (
        &["a joint", "a joint of a URDF"],
        &["type"],
        "the type is written after the name: `joint name: revolute { … }`",
    ),
    (
        &["a joint", "a joint of a URDF"],
        &["xyz", "rpy", "position", "orientation", "pose", "transform", "translation", "rotation", "offset"],
        "write `origin: { xyz: [0 m, 0 m, 0.9 m], rpy: [0 deg, 0 deg, 90 deg] };`",
    ),
    (
        &["a joint", "a joint of a URDF"],
        &["lower", "upper", "velocity", "effort"],
        "write `limit: { lower: -90 deg, upper: 90 deg };`",
    ),
    (&["`limit`"], &["min", "max", "minimum", "maximum"], "write `lower: -90 deg, upper: 90 deg`"),
    (
        &["`origin`"],
        &["quat", "quaternion", "orientation", "rotation", "wxyz", "xyzw"],
        "write roll, pitch and yaw: `rpy: [0 deg, 0 deg, 90 deg]`",
    ),
    (&["`origin`"], &["position", "translation", "x", "y", "z"], "write `xyz: [0.1 m, 0 m, 0 m]`"),
    (&["`origin`"], &["roll", "pitch", "yaw"], "write `rpy: [0 deg, 0 deg, 90 deg]`"),
    (&["`inertia`"], &["ixx", "ixy", "ixz", "iyy", "iyz", "izz"], "leave the `i` out, as in `xx: 0.1 kg*m^2`"),
    // Programming languages.
    (
        &[],
        &["if", "else", "for", "while", "match", "loop", "switch", "elif"],
        "a robot is what there is, without conditions and loops; a `macro_rules!` may write it",
    ),
    (
        &[],
        &["let", "const", "var", "static", "def", "fn", "class", "struct", "use", "return", "from"],
        "a robot holds declarations only; write this outside of `robot!`",
    ),
];

/// Returns what to write instead of `word` in `place`.
pub(crate) fn way_out(place: &str, word: &str) -> Option<&'static str> {
    let is_here =
        |(places, words, _): &&Row| (places.is_empty() || places.contains(&place)) && words.contains(&word);
    ROWS.iter().find(is_here).map(|(_, _, way)| *way)
}
