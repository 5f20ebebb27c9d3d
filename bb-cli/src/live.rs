//! Commands for a running robot, by the address of its dashboard.

mod address;
mod arming;
mod command;
mod connection;
mod param;
mod ros2;
mod top;
mod topic;
mod yaml;

use address::Address;
use clap::{Args, Subcommand};
use connection::Robot;

/// The robot that a command is for, and how it prints what the robot answers.
#[derive(Debug, Args)]
pub(crate) struct Live {
    /// The address that the robot's dashboard has printed; its token gives the right to steer. By default that in the variable `BB_ROBOT`,
    /// else `http://127.0.0.1:8912`.
    #[arg(long, value_name = "ADDRESS", global = true)]
    robot: Option<Address>,
    /// Name of one of several robots at the address.
    #[arg(long, value_name = "NAME", global = true)]
    name: Option<String>,
    /// Prints JSON instead of text: one value, or one on each line.
    #[arg(long, global = true)]
    json: bool,
}

impl Live {
    fn connect(&self) -> Result<Robot, String> {
        let address = match (&self.robot, std::env::var("BB_ROBOT")) {
            (Some(address), _) => address.clone(),
            (None, Ok(text)) if !text.is_empty() => text.parse().map_err(|error| format!("BB_ROBOT: {error}"))?,
            (None, _) => Address::default(),
        };
        Robot::connect(&address, self.name.as_deref())
    }
}

/// Commands of one kind.
#[derive(Debug, Args)]
pub(crate) struct Group<What: Subcommand> {
    #[command(flatten)]
    live: Live,
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
pub(crate) enum LiveCommand {
    Top(top::Arguments),
    /// Lists topics of a running robot, and prints their messages and rates.
    Topic(Group<topic::What>),
    /// Lists, reads and sets parameters of a running robot.
    Param(Group<param::What>),
    /// Lists, starts and cancels commands of a running robot.
    Command(Group<command::What>),
    Arm(arming::Arm),
    Disarm(arming::Disarm),
    /// Writes files for programs of ROS 2.
    Ros2(Group<ros2::What>),
}

impl LiveCommand {
    /// Runs the command, and returns whether all went well.
    pub(crate) fn run(&self) -> Result<bool, String> {
        match self {
            Self::Top(arguments) => top::run(arguments),
            Self::Topic(arguments) => topic::run(arguments),
            Self::Param(arguments) => param::run(arguments),
            Self::Command(arguments) => command::run(arguments),
            Self::Arm(arguments) => arguments.run(),
            Self::Disarm(arguments) => arguments.run(),
            Self::Ros2(arguments) => ros2::run(arguments),
        }
    }
}
