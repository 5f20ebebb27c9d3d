//! Robots that navigate with the filters of `bb_estimators`, whose sensors fail or are mounted askew, and what their logs and recorders hold.

mod covariances;
mod factors;
mod false_covariances;
mod features;
mod flight_logs;
mod flights;
mod optional_states;
mod planar;
mod receiver;
mod rest;
mod rover;
mod sensor_failures;
mod small_stacks;
mod wrong_fixes;
