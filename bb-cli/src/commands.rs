//! All commands except `bb eval` and `bb calibrate`, one file each.

mod convert;
mod echo;
mod hz;
mod info;
mod new;
pub(crate) mod plot;
mod recover;

use clap::Subcommand;

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    New(new::Arguments),
    Info(info::Arguments),
    Echo(echo::Arguments),
    Hz(hz::Arguments),
    Plot(plot::Arguments),
    Convert(convert::Arguments),
    Recover(recover::Arguments),
}

impl Command {
    /// Runs the command, and returns whether all went well.
    pub(crate) fn run(&self) -> Result<bool, String> {
        match self {
            Self::New(arguments) => new::run(arguments),
            Self::Info(arguments) => info::run(arguments),
            Self::Echo(arguments) => echo::run(arguments),
            Self::Hz(arguments) => hz::run(arguments),
            Self::Plot(arguments) => plot::run(arguments),
            Self::Convert(arguments) => convert::run(arguments),
            Self::Recover(arguments) => recover::run(arguments),
        }
    }
}
