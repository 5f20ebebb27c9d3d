//! Commands of the rover.

use crate::rover::rover;
use bb_core::prelude::*;

/// Options of [`Pace`].
#[derive(Clone, Debug, Options)]
pub(crate) struct PaceOptions {
    /// Target speed of the rover. Unit: m/s.
    #[option(required, range = 0.0..=1.5, unit = "m/s")]
    pub(crate) speed: f64,
    /// Time that the change of speed takes. Unit: s.
    #[option(default = Duration::from_millis(200))]
    pub(crate) over: Duration,
    /// The state that the rover is in then.
    #[option(required)]
    pub(crate) then: &'static str,
}

/// Changes the speed, and with it the state: driving, slowing down, stopping and resuming differ in nothing else.
#[derive(Debug)]
pub(crate) struct Pace;

impl Command for Pace {
    type Options = PaceOptions;
    type Arguments = NoArguments;
    type Output = ();

    async fn run(options: PaceOptions, _: NoArguments, context: CommandContext) -> Result<Outcome<()>, Fault> {
        context.set_parameter(rover::param::speed.path(), options.speed)?;
        context.sleep(options.over).await;
        Ok(Outcome::done(()).next_state(options.then))
    }
}
