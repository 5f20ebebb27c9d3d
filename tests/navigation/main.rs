//! Robots that navigate with the filters of `bb_estimators`, whose sensors fail.

mod false_covariances;
mod optional_states;
mod planar;
mod receiver;
mod rest;
mod rover;
mod sensor_failures;
mod small_stacks;
mod wrong_fixes;
