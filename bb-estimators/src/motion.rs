//! Motion of joints: profiles, trajectories, controllers, and the position of a joint without a sensor.
//!
//! | what | where |
//! |---|---|
//! | a motion from one position to another, with easing | [`Profile`] |
//! | several joints that arrive together, time-optimal within limits | [`plan`] |
//! | the part of a trajectory for one joint | [`JointPath`] |
//! | PID, and a switch with hysteresis, as plain values | [`Pid`], [`Threshold`] |
//! | the same to declare as `controller` | [`PidController`], [`ThresholdController`] |
//! | a joint without an encoder | [`OpenLoopPosition`] |
//! | a command that moves joints | [`MoveJoints`] |

mod commands;
mod controllers;
mod open_loop;
mod path;
mod pid;
mod planner;
mod profile;
mod threshold;

pub use commands::{JointTarget, JointTargets, MotionProgress, MoveJoints, MoveJointsOptions};
pub use controllers::{
    Drive, PidController, PidControllerOptions, PidState, ThresholdController, ThresholdControllerOptions,
    ThresholdState,
};
pub use open_loop::{OpenLoopOptions, OpenLoopPosition};
pub use path::JointPath;
pub use pid::{Pid, PidParams, PidTerms};
pub use planner::{JointMotionLimits, PlanError, plan};
pub use profile::{Easing, JointPoint, Pace, Profile};
pub use threshold::Threshold;
