//! Conversions of each payload to and from its ROS message: one file per ROS package.

mod covariance;
mod geometry;
mod nav;
mod number;
mod sensor;
mod trajectory;

use crate::message::codec::ros::{DurationMessage, Header, Time, WORLD, ros_message};
