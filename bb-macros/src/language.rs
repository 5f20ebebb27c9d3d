//! The words of the language, each stated once: where it is allowed, what number it takes, how often it may be
//! repeated, an example, and its documentation.
//!
//! Everything that depends on the words is derived from here: the parser (the words of each place, where it can
//! resume, "did you mean"), the rules on dimensions, bounds and repetition, and the tables of the reference on
//! `bb_core::robot`.
//!
//! To add a setting such as `deadline: 5 ms;` of an estimator: state the word in `language/words.rs`, list it in
//! `EstimatorSetting` below, and give it its meaning in the model, whose `match` is exhaustive.

mod foreign;
mod joint_kind;
mod measure;
pub(crate) mod words;

pub(crate) use foreign::way_out;
pub(crate) use joint_kind::JointKind;
pub(crate) use measure::{Bounds, Measure};

use crate::names::{did_you_mean, one_of};
use proc_macro2::Ident;

/// A word of the language.
#[derive(Debug)]
pub(crate) struct Word {
    pub(crate) text: &'static str,
    pub(crate) value: Value,
    pub(crate) occurs: Occurs,
    /// The syntax after the word, up to the end of its item.
    pub(crate) example: &'static str,
    /// Text of the reference, which a test compares.
    #[cfg_attr(not(test), allow(dead_code, reason = "read by the test of the reference"))]
    pub(crate) doc: &'static str,
}

impl Word {
    /// The number in the example.
    pub(crate) fn number(&self) -> &'static str {
        let value = self.example.trim_start_matches([':', ' ', '[']);
        value.split([',', ';', ']']).next().unwrap_or(value)
    }
}

/// The value that a word sets.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Value {
    /// A number with a unit, or without one if it has no dimension.
    Number(Measure, Bounds),
    /// A whole number, both ends included.
    Count { lowest: u32, highest: u32 },
    /// No number.
    Other,
}

/// Number of times that a word may be written in one block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Occurs {
    Once,
    Often,
}

/// The words of one place.
pub(crate) trait Words: Copy + PartialEq + 'static {
    /// The place, with its article if it has one: `an estimator`.
    const PLACE: &'static str;
    const ALL: &'static [(&'static Word, Self)];

    /// The word with this spelling.
    fn of(text: &str) -> Option<(&'static Word, Self)> {
        Self::ALL.iter().find(|(word, _)| word.text == text).copied()
    }

    fn texts() -> Vec<&'static str> {
        Self::ALL.iter().map(|(word, _)| word.text).collect()
    }
}

/// `Sensor { Rate = RATE }` to an enum of the words of a place.
macro_rules! enums {
    ($($(#[$doc:meta])* $name:ident in $place:literal { $($variant:ident = $word:ident,)* })*) => { $(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub(crate) enum $name {
            $($variant,)*
        }

        impl Words for $name {
            const PLACE: &'static str = $place;
            const ALL: &'static [(&'static Word, Self)] = &[$((&words::$word, Self::$variant),)*];
        }
    )* };
}

/// The enums, and the lists of all.
macro_rules! language {
    (items { $($items:tt)* } fields { $($fields:tt)* }) => {
        enums! { $($items)* $($fields)* }
        language! { @list
            /// The words that start an item, by place: where the parser can resume.
            ITEMS { $($items)* } }
        language! { @list
            /// The words within items, by place.
            #[cfg(test)]
            FIELDS { $($fields)* } }
    };
    (@list $(#[$meta:meta])* $list:ident {
        $($(#[$_:meta])* $name:ident in $place:literal { $($variant:ident = $word:ident,)* })*
    }) => {
        $(#[$meta])*
        pub(crate) const $list: &[(&str, &[&Word])] = &[$(($place, &[$(&words::$word,)*]),)*];
    };
}

language! {
    items {
        /// The contents of a robot.
        RobotItem in "a robot" {
            Topology = TOPOLOGY,
            Parameters = PARAMETERS,
            States = STATES,
            Commands = COMMANDS,
            Controllers = CONTROLLERS,
            Bridges = BRIDGES,
            Sensors = SENSORS,
            Link = LINK,
            Joint = JOINT_OF_URDF,
        }
        SensorsItem in "`sensors`" {
            Sensor = SENSOR,
        }
        ControllersItem in "`controllers`" {
            Controller = CONTROLLER,
        }
        BridgesItem in "`bridges`" {
            Bridge = BRIDGE,
        }
        LinkItem in "a link" {
            Sensor = SENSOR,
            Estimator = ESTIMATOR,
            Joint = JOINT,
            Inertial = INERTIAL,
            Visual = VISUAL,
            Collision = COLLISION,
        }
        JointItem in "a joint" {
            Origin = ORIGIN,
            Axis = AXIS,
            Limit = LIMIT,
            Dynamics = DYNAMICS,
            Mimic = MIMIC,
            Transmission = TRANSMISSION,
            Sensor = SENSOR,
            Actuator = ACTUATOR,
            Link = LINK,
        }
        /// An item that is declared at a joint of a URDF.
        UrdfJointItem in "a joint of a URDF" {
            Sensor = SENSOR,
            Actuator = ACTUATOR,
        }
        SensorSetting in "a sensor" {
            Rate = RATE,
        }
        SensorItem in "a sensor" {
            Estimator = ESTIMATOR,
        }
        /// An actuator holds nothing.
        ActuatorItem in "an actuator" {}
        ControllerItem in "a controller" {}
        BridgeItem in "a bridge" {}
        /// The contents of controllers and bridges.
        ServiceSetting in "a controller or bridge" {
            Rate = RATE,
        }
        EstimatorItem in "an estimator" {
            Input = INPUT,
            Output = OUTPUT,
            RunsOn = RUNS_ON,
            OnDegraded = ON_DEGRADED,
            OnLost = ON_LOST,
            OnRecovered = ON_RECOVERED,
        }
        EstimatorSetting in "an estimator" {
            SyncTolerance = SYNC_TOLERANCE,
            LatencyBudget = LATENCY_BUDGET,
            LostAfter = LOST_AFTER,
            RecoverAfter = RECOVER_AFTER,
        }
        /// Items in `commands` that have no name.
        CommandsItem in "`commands`" {
            Category = CATEGORY,
        }
        CategoryItem in "a category" {}
        CategorySetting in "a category" {
            Concurrency = CONCURRENCY,
        }
        CommandItem in "a command" {
            AllowedStates = ALLOWED_STATES,
            Category = IN_CATEGORY,
            Cancel = CANCEL,
        }
        CommandSetting in "a command" {
            Timeout = TIMEOUT,
        }
        /// A place without words of this kind.
        Nothing in "" {}
    }
    fields {
        InputField in "`input`" {
            Driver = DRIVER,
            Optional = OPTIONAL,
            Within = WITHIN,
            External = EXTERNAL,
        }
        RunsOnField in "`runs_on`" {
            Priority = PRIORITY,
            Core = CORE,
        }
        OriginField in "`origin`" {
            Xyz = XYZ,
            Rpy = RPY,
        }
        LimitField in "`limit`" {
            Lower = LOWER,
            Upper = UPPER,
            Velocity = VELOCITY,
            Effort = EFFORT,
        }
        DynamicsField in "`dynamics`" {
            Damping = DAMPING,
            Friction = FRICTION,
        }
        MimicField in "`mimic`" {
            Joint = JOINT_TO_MIMIC,
            Multiplier = MULTIPLIER,
            Offset = OFFSET,
        }
        TransmissionField in "`transmission`" {
            Reduction = REDUCTION,
            Offset = OFFSET_OF_MOTOR,
            Reversed = REVERSED,
        }
        InertialField in "`inertial`" {
            Mass = MASS,
            Origin = ORIGIN_OF_BODY,
            Inertia = INERTIA,
        }
        InertiaField in "`inertia`" {
            Xx = XX,
            Xy = XY,
            Xz = XZ,
            Yy = YY,
            Yz = YZ,
            Zz = ZZ,
        }
        VisualField in "`visual`" {
            Origin = ORIGIN_OF_BODY,
            Box = BOX,
            Cylinder = CYLINDER,
            Sphere = SPHERE,
            Mesh = MESH,
            Material = MATERIAL,
        }
        /// A collision shape is not visible.
        CollisionField in "`collision`" {
            Origin = ORIGIN_OF_BODY,
            Box = BOX,
            Cylinder = CYLINDER,
            Sphere = SPHERE,
            Mesh = MESH,
        }
        CylinderField in "`cylinder`" {
            Radius = RADIUS,
            Length = LENGTH,
        }
        SphereField in "`sphere`" {
            Radius = RADIUS,
        }
        MeshField in "`mesh`" {
            File = FILE,
            Scale = SCALE,
        }
        MaterialField in "`material`" {
            Name = NAME,
            Color = COLOR,
            Texture = TEXTURE,
        }
        ParameterField in "a parameter" {
            Range = RANGE,
        }
    }
}

/// Returns whether a word starts an item in any place.
pub(crate) fn starts_item(text: &str) -> bool {
    item_words().any(|word| word == text)
}

pub(crate) fn item_words() -> impl Iterator<Item = &'static str> {
    ITEMS.iter().flat_map(|(_, words)| words.iter()).map(|word| word.text)
}

/// The error for a word that does not belong in a place with the words of `I` and `S`.
pub(crate) fn unexpected<I: Words, S: Words>(word: &Ident) -> syn::Error {
    let name = word.to_string();
    let place = I::PLACE;
    let allowed: Vec<&str> = I::texts().into_iter().chain(S::texts()).collect();
    let message = if allowed.is_empty() {
        format!("{place} holds nothing; leave this out")
    } else if let Some(way) = way_out(place, &name) {
        if starts_item(&name) {
            format!("`{name}` does not belong in {place}; {way}")
        } else {
            format!("unknown word `{name}`; {way}")
        }
    } else if starts_item(&name) {
        format!("`{name}` does not belong in {place}, which holds {}", one_of(&allowed))
    } else {
        let hint = did_you_mean(&name, allowed.iter().copied());
        format!("unknown word `{name}`; {place} holds {}{hint}", one_of(&allowed))
    };
    syn::Error::new(word.span(), message)
}
