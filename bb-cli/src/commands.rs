//! The commands that are not `bb eval`, one file each.

mod convert;
mod echo;
mod hz;
mod info;
mod new;
mod plot;
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
    /// Does it; whether all went well. An error is told in words.
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
