//! Reasons for which a robot is no node.

use crate::session::SessionError;
use bb_core::Fault;
use bb_ros2::{NameError, TypeError};
use thiserror::Error;

/// Reason for which a robot is no node.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Ros2Error {
    /// An option has an unusable value.
    #[error("the robot is no node of ROS: {0}")]
    Options(Fault),
    /// A name is not one of ROS.
    #[error("the robot is no node of ROS: {0}")]
    Name(#[from] NameError),
    /// The name or the hash of a type is not one of ROS.
    #[error("the robot is no node of ROS: {0}")]
    Type(#[from] TypeError),
    /// zenoh does not do what is asked.
    #[error("the robot is no node of ROS: {0}")]
    Session(#[from] SessionError),
    /// A thread cannot be started.
    #[error("the robot is no node of ROS, since a thread cannot be started: {0}")]
    Thread(std::io::Error),
}
