//! How each payload is written as ROS's message, and read back: one file a ROS package.

mod covariance;
mod geometry;
mod nav;
mod number;
mod sensor;
mod trajectory;

use crate::message::codec::ros::{DurationMessage, Header, Time, WORLD, ros_message};
