//! Commands, actuators, controllers and bridges: only their names so far.

macro_rules! named {
    ($($(#[$doc:meta])* $name:ident)*) => {
        $($(#[$doc])* #[derive(Debug)] pub struct $name;)*
    };
}

named! {
    /// A command.
    Stop
    /// A command.
    SlowDown
    /// A command.
    Resume
    /// A command.
    MoveTo
    /// An actuator.
    Servo
    /// A controller.
    Stability
    /// A bridge.
    RosBridge
}
