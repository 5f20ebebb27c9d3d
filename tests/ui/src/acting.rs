//! Commands, actuators, controllers and bridges.

use bb_core::prelude::*;

/// Options of [`MoveTo`].
#[derive(Clone, Debug, Options)]
pub struct MoveToOptions {
    /// Unit: m/s.
    #[option(default = 1.0, range = 0.0..=5.0, unit = "m/s")]
    pub speed: f64,
}

macro_rules! commands {
    ($($(#[$doc:meta])* $name:ident($options:ty))*) => { $(
        $(#[$doc])*
        #[derive(Debug)]
        pub struct $name;

        impl Command for $name {
            type Options = $options;
            type Arguments = NoArguments;
            type Output = ();

            async fn run(_: $options, _: NoArguments, _: CommandContext) -> Result<Outcome<()>, Fault> {
                Ok(Outcome::done(()))
            }
        }
    )* };
}

commands! {
    /// Stops the robot.
    Stop(NoOptions)
    /// Slows it down.
    SlowDown(NoOptions)
    /// Goes on.
    Resume(NoOptions)
    /// Moves somewhere.
    MoveTo(MoveToOptions)
}

/// Target position of a joint.
#[derive(Clone, Copy, Debug, Payload)]
pub struct Position(pub f64);

/// Options of [`Servo`].
#[derive(Clone, Debug, Options)]
pub struct ServoOptions {
    /// Number of the servo on the bus.
    #[option(default = 1)]
    pub id: u8,
}

/// An actuator.
#[derive(Debug)]
pub struct Servo;

impl Actuator for Servo {
    type Options = ServoOptions;
    type Command = Position;

    fn init(_: ServoOptions, _: &ActuatorContext) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_command(&mut self, _: &Stamped<Position>) -> Result<(), Fault> {
        Ok(())
    }

    fn disarm(&mut self) -> Result<(), Fault> {
        Ok(())
    }
}

/// Options of [`RosBridge`].
#[derive(Clone, Debug, Options)]
pub struct RosBridgeOptions {
    /// TCP.
    #[option(default = 9090)]
    pub port: u16,
}

macro_rules! services {
    ($($(#[$doc:meta])* $name:ident($options:ty))*) => { $(
        $(#[$doc])*
        #[derive(Debug)]
        pub struct $name;

        impl Service for $name {
            type Options = $options;
            type Output = Position;

            fn init(_: $options, _: &ServiceContext) -> Result<Self, Fault> {
                Ok(Self)
            }

            fn update(&mut self, _: MonotonicTime) -> Result<Reading<Position>, Fault> {
                Ok(Reading::nothing())
            }
        }
    )* };
}

services! {
    /// A controller.
    Stability(NoOptions)
    /// A bridge.
    RosBridge(RosBridgeOptions)
}
