//! The table.

use super::Occurs::{Often, Once};
use super::{Bounds, Measure, Value, Word};
use crate::units::Dimension;

macro_rules! words {
    ($($name:ident: $text:literal, $value:expr, $occurs:expr, $example:literal, $doc:literal;)*) => { $(
        pub(crate) const $name: Word =
            Word { text: $text, value: $value, occurs: $occurs, example: $example, doc: $doc };
    )* };
}

words! {
    // Of the robot.
    TOPOLOGY: "topology", Value::Other, Often, ": urdf(\"robot.urdf\");",
        "links and joints from a URDF, see [below](#a-topology-from-a-urdf)";
    PARAMETERS: "parameters", Value::Other, Often, " { gain: f64 = 0.1; }",
        "values that may change at run time, see [below](#parameters)";
    STATES: "states", Value::Other, Often, " { degraded; }",
        "operational states beside the built-in ones, see [below](#states)";
    COMMANDS: "commands", Value::Other, Often, " { stop: Stop; }",
        "commands it accepts, see [below](#commands)";
    CONTROLLERS: "controllers", Value::Other, Often, " { controller stability: Stability(); }",
        "components outside of the topology, see [below](#controllers-and-bridges)";
    BRIDGES: "bridges", Value::Other, Often, " { bridge ros: RosBridge(); }",
        "the same, by another name";
    SENSORS: "sensors", Value::Other, Often, " { sensor battery: Ina219(); }",
        "sensors of the robot as a whole, in no frame";
    LINK: "link", Value::Other, Often, " name { … }",
        "a rigid body with its frame: one is the root, each joint has one";
    JOINT: "joint", Value::Other, Often, " name: kind { … }",
        "`fixed`, `revolute`, `continuous`, `prismatic`, `planar` or `floating`";
    JOINT_OF_URDF: "joint", Value::Other, Often, " elbow { sensor encoder: Encoder(); }",
        "sensors and actuators of a joint from a URDF";

    // Of joints.
    ORIGIN: "origin", Value::Other, Once, ": { xyz: [0 m, 0 m, 0.9 m], rpy: [0 deg, 0 deg, 90 deg] };",
        "where the joint is in its parent link: lengths, and angles about the fixed axes x, y, z. Default: zero";
    ORIGIN_OF_BODY: "origin", Value::Other, Once, ": { xyz: [0 m, 0 m, 0.1 m] }",
        "where it is in the link. Default: zero";
    XYZ: "xyz", Value::Number(Measure::Of(Dimension::LENGTH), Bounds::Any), Once, ": [0.1 m, 0 m, 0 m]",
        "lengths. Default: zero";
    RPY: "rpy", Value::Number(Measure::Of(Dimension::ANGLE), Bounds::Any), Once, ": [90 deg, 0 deg, 0 deg]",
        "angles about the fixed axes x, y, z. Default: zero";
    AXIS: "axis", Value::Other, Once, ": z;",
        "of a joint that moves: `x`, `y`, `z`, `-x`, `-y`, `-z` or `[a, b, c]`; for `planar` the plane's normal";
    // A component of a vector written as `[a, b, c]`.
    AXIS_COMPONENT: "axis", Value::Number(Measure::Of(Dimension::NONE), Bounds::Any), Once, ": 1",
        "";
    LIMIT: "limit", Value::Other, Once, ": { lower: -90 deg, upper: 90 deg };",
        "of a joint that moves: angles, rad/s, N·m where it turns; lengths, m/s, N where it slides";
    LOWER: "lower", Value::Number(Measure::Position, Bounds::Any), Once, ": -90 deg",
        "the lowest position";
    UPPER: "upper", Value::Number(Measure::Position, Bounds::Any), Once, ": 90 deg",
        "the highest position";
    VELOCITY: "velocity", Value::Number(Measure::Velocity, Bounds::Positive), Once, ": 60 deg/s",
        "the highest speed";
    EFFORT: "effort", Value::Number(Measure::Effort, Bounds::Positive), Once, ": 5 N*m",
        "the highest torque or force";
    DYNAMICS: "dynamics", Value::Other, Once, ": { damping: 0.1 N*m*s/rad, friction: 0.2 N*m };",
        "of a joint that moves: N·m·s/rad and N·m where it turns; N·s/m and N where it slides";
    DAMPING: "damping", Value::Number(Measure::Damping, Bounds::Any), Once, ": 0.1 N*m*s/rad",
        "viscous friction";
    FRICTION: "friction", Value::Number(Measure::Effort, Bounds::Any), Once, ": 0.2 N*m",
        "static friction";
    MIMIC: "mimic", Value::Other, Once, ": { joint: left_finger, multiplier: -1 };",
        "of a joint that moves: it follows another joint";
    JOINT_TO_MIMIC: "joint", Value::Other, Once, ": left_finger",
        "the joint that it follows";
    MULTIPLIER: "multiplier", Value::Number(Measure::Of(Dimension::NONE), Bounds::Any), Once, ": 2",
        "how far it moves per movement of the other. Default: 1";
    OFFSET: "offset", Value::Number(Measure::Position, Bounds::Any), Once, ": 0 deg",
        "its position when the other is at zero. Default: zero";
    TRANSMISSION: "transmission", Value::Other, Once, ": { reduction: 50 };",
        "the gear between motor and joint";
    REDUCTION: "reduction", Value::Number(Measure::Of(Dimension::NONE), Bounds::NotZero), Once, ": 50",
        "turns of the motor for one of the joint. Default: 1";
    OFFSET_OF_MOTOR: "offset", Value::Number(Measure::Position, Bounds::Any), Once, ": 0 deg",
        "the position of the joint when the motor is at zero. Default: zero";
    REVERSED: "reversed", Value::Other, Once, ": true",
        "whether the joint turns the other way than the motor. Default: false";

    // Of links.
    INERTIAL: "inertial", Value::Other, Once, ": { mass: 1.2 kg, inertia: { xx: 0.1 kg*m^2, yy: 0.1 kg*m^2, zz: 0.1 kg*m^2 } };",
        "mass and moments of inertia";
    MASS: "mass", Value::Number(Measure::Of(Dimension::MASS), Bounds::Any), Once, ": 1 kg",
        "the mass, which must be given";
    INERTIA: "inertia", Value::Other, Once, ": { xx: 0.1 kg*m^2, yy: 0.1 kg*m^2, zz: 0.1 kg*m^2 }",
        "moments: `xx`, `yy`, `zz` must be given, `xy`, `xz`, `yz` are 0";
    XX: "xx", Value::Number(Measure::Of(Dimension::MOMENT_OF_INERTIA), Bounds::Any), Once, ": 0.1 kg*m^2",
        "a moment of inertia";
    XY: "xy", Value::Number(Measure::Of(Dimension::MOMENT_OF_INERTIA), Bounds::Any), Once, ": 0.1 kg*m^2",
        "a moment of inertia";
    XZ: "xz", Value::Number(Measure::Of(Dimension::MOMENT_OF_INERTIA), Bounds::Any), Once, ": 0.1 kg*m^2",
        "a moment of inertia";
    YY: "yy", Value::Number(Measure::Of(Dimension::MOMENT_OF_INERTIA), Bounds::Any), Once, ": 0.1 kg*m^2",
        "a moment of inertia";
    YZ: "yz", Value::Number(Measure::Of(Dimension::MOMENT_OF_INERTIA), Bounds::Any), Once, ": 0.1 kg*m^2",
        "a moment of inertia";
    ZZ: "zz", Value::Number(Measure::Of(Dimension::MOMENT_OF_INERTIA), Bounds::Any), Once, ": 0.1 kg*m^2",
        "a moment of inertia";
    VISUAL: "visual", Value::Other, Often, ": { box: [0.4 m, 0.3 m, 0.1 m] };",
        "what viewers draw";
    COLLISION: "collision", Value::Other, Often, ": { box: [0.4 m, 0.3 m, 0.1 m] };",
        "what collision checks use: as `visual`, without material";
    BOX: "box", Value::Number(Measure::Of(Dimension::LENGTH), Bounds::Any), Once, ": [0.1 m, 0.1 m, 0.1 m]",
        "a box: its sides along x, y, z";
    CYLINDER: "cylinder", Value::Other, Once, ": { radius: 0.1 m, length: 0.3 m }",
        "a cylinder along z";
    SPHERE: "sphere", Value::Other, Once, ": { radius: 0.1 m }",
        "a sphere";
    MESH: "mesh", Value::Other, Once, ": { file: \"base.stl\" }",
        "a mesh from a file, which URDF viewers read";
    RADIUS: "radius", Value::Number(Measure::Of(Dimension::LENGTH), Bounds::Any), Once, ": 0.1 m",
        "a length";
    LENGTH: "length", Value::Number(Measure::Of(Dimension::LENGTH), Bounds::Any), Once, ": 0.1 m",
        "a length";
    FILE: "file", Value::Other, Once, ": \"base.stl\"",
        "its path or URL";
    SCALE: "scale", Value::Number(Measure::Of(Dimension::NONE), Bounds::Any), Once, ": [1, 1, 1]",
        "by axis. Default: 1";
    MATERIAL: "material", Value::Other, Once, ": { color: [0, 0, 1, 1] }",
        "how it looks";
    NAME: "name", Value::Other, Once, ": \"blue\"",
        "its name";
    COLOR: "color", Value::Number(Measure::Of(Dimension::NONE), Bounds::Any), Once, ": [0.5, 0.5, 0.5, 1]",
        "red, green, blue and opacity, from 0 to 1";
    TEXTURE: "texture", Value::Other, Once, ": \"wood.png\"",
        "the file of an image";

    // Components.
    SENSOR: "sensor", Value::Other, Often, " name: Type(option = value, …) { … }",
        "a [`Sensor`]. At a joint it is fixed to the joint's parent";
    ACTUATOR: "actuator", Value::Other, Often, " name: Type(option = value, …);",
        "an [`Actuator`], which moves the joint, see [below](#actuators)";
    CONTROLLER: "controller", Value::Other, Often, " name: Type(option = value, …);",
        "a [`Service`], see [below](#controllers-and-bridges)";
    BRIDGE: "bridge", Value::Other, Often, " name: Type(option = value, …);",
        "a [`Service`], see [below](#controllers-and-bridges)";
    RATE: "rate", Value::Number(Measure::Of(Dimension::FREQUENCY), Bounds::Rate), Once, ": 200 Hz;",
        "how often it is called: a frequency. Default: a sensor is read again as soon as it returns; a controller or bridge chooses";
    ESTIMATOR: "estimator", Value::Other, Often, " name: Type(option = value, …) { … }",
        "an [`Estimator`]: in a sensor it takes that sensor, on a link its `input`s";

    // Of estimators.
    INPUT: "input", Value::Other, Often, " name: path;",
        "on a link: an input; its name is that of the algorithm's field, and any name if the algorithm takes a single payload";
    DRIVER: "driver", Value::Other, Once, "",
        "its arrival runs the estimator; one of several inputs";
    OPTIONAL: "optional", Value::Other, Once, "",
        "when it is missing or too old, the estimator is run without it";
    WITHIN: "within", Value::Number(Measure::Of(Dimension::TIME), Bounds::Time), Once, ": 20 ms",
        "how much older than the driver it may be; else `sync_tolerance`. Of the driver: how old it may be by the clock when it arrives";
    EXTERNAL: "external", Value::Other, Once, "",
        "other code publishes there: the robot must not declare the path, see [below](#inputs-from-other-code)";
    OUTPUT: "output", Value::Other, Often, " name: [path, …];",
        "which outputs are published: elsewhere, or without a path below its own. An estimator of one output publishes it at its own path without";
    SYNC_TOLERANCE: "sync_tolerance", Value::Number(Measure::Of(Dimension::TIME), Bounds::Time), Once, ": 20 ms;",
        "with several inputs: how much older than the driver the others may be. Default: any age will do";
    LATENCY_BUDGET: "latency_budget", Value::Number(Measure::Of(Dimension::TIME), Bounds::Time), Once, ": 1 ms;",
        "how long a run may take before it degrades the estimator: a time. Default: any";
    LOST_AFTER: "lost_after", Value::Number(Measure::Of(Dimension::TIME), Bounds::Time), Once, ": 100 ms;",
        "how long it may go without a run on a message of its driver before it is lost: a time. Default: any";
    RECOVER_AFTER: "recover_after", Value::Count { lowest: 1, highest: u32::MAX }, Once, ": 10;",
        "how many good runs in a row make it healthy again: a whole number of at least 1. Default: 1";
    ON_DEGRADED: "on_degraded", Value::Other, Once, ": slow_down;",
        "the command called when it degrades: a run was too long, an input was missing or too old, the algorithm diverged, or it failed";
    ON_LOST: "on_lost", Value::Other, Once, ": stop;",
        "the command called when it is lost; needs `lost_after`";
    ON_RECOVERED: "on_recovered", Value::Other, Once, ": resume;",
        "the command called when it is healthy again";
    RUNS_ON: "runs_on", Value::Other, Once, ": worker;",
        "a thread of its own, see [below](#where-an-estimator-runs)";
    PRIORITY: "priority", Value::Count { lowest: 1, highest: 99 }, Once, ": 80",
        "its real-time priority, 1 to 99, with the feature `realtime`. Default: that of other threads";
    CORE: "core", Value::Count { lowest: 0, highest: 8191 }, Once, ": 1",
        "the processor's core that it is bound to, from 0, with the feature `realtime`. Default: any";

    // Of commands and parameters.
    CATEGORY: "category", Value::Other, Often, " name { … }",
        "a category of commands";
    CONCURRENCY: "concurrency", Value::Count { lowest: 1, highest: u32::MAX }, Once, ": 2;",
        "how many of its commands run at once: a whole number of at least 1. Default: 1";
    ALLOWED_STATES: "allowed_states", Value::Other, Once, ": [idle, executing];",
        "the states in which it may start, built-in or declared. Default: `idle`; for the one that arms `disarmed`, for the one that disarms every other";
    TIMEOUT: "timeout", Value::Number(Measure::Of(Dimension::TIME), Bounds::Time), Once, ": 2 s;",
        "how long it may run: a time. Default: no limit";
    IN_CATEGORY: "category", Value::Other, Once, ": motion;",
        "which commands it shares the `concurrency` with. Default: `default`";
    CANCEL: "cancel", Value::Other, Once, ": all;",
        "which commands end when it starts: all, or those of categories, `[motion]`. Default: none";
    RANGE: "range", Value::Other, Once, ": 0.0..=1.0",
        "of an `i64` or `f64`: the values it may take, both ends included, in units of the default's kind. Default: any";
}
